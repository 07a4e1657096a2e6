//! Escapes characters that are invisible on a terminal or change its state.

use std::borrow::Cow;
use std::fmt::Write as _;

use serde::Serialize;

/// Escapes invisible characters (e.g. those of zero width), marks of bidirectional text, and control characters except
/// line breaks and tabs. Such characters could change what a terminal displays, and names originate from files that may
/// be hostile. Zero-width joiners and non-joiners are kept, because some languages need them.
pub fn visible(text: &str) -> Cow<'_, str> {
    escaped(text, |character, all| {
        let _ = write!(all, "\\u{{{:x}}}", u32::from(character));
    })
}

/// Escapes in JSON text the characters that [`visible`] escapes. Such characters can only occur
/// within JSON strings.
pub fn visible_json(text: &str) -> Cow<'_, str> {
    escaped(text, |character, all| {
        for unit in character.encode_utf16(&mut [0; 2]) {
            let _ = write!(all, "\\u{unit:04x}");
        }
    })
}

/// Serialises an answer as indented JSON with a line break at its end.
pub fn pretty(answer: &impl Serialize) -> String {
    // Serialisation cannot fail: answers consist of texts, numbers and lists.
    serde_json::to_string_pretty(answer).unwrap_or_default() + "\n"
}

fn hides(character: char) -> bool {
    let is_unseen = matches!(
        character,
        '\u{ad}' | '\u{180e}' | '\u{200b}' | '\u{2028}' | '\u{2029}' | '\u{2060}'..='\u{2065}'
            | '\u{206a}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}'
    );
    let is_mark = matches!(
        character,
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
    );
    character.is_control() && !matches!(character, '\n' | '\t') || is_unseen || is_mark
}

fn escaped(text: &str, escape: impl Fn(char, &mut String)) -> Cow<'_, str> {
    let is_plain = |byte: u8| matches!(byte, b' '..=b'~' | b'\n' | b'\t');
    if text.bytes().all(is_plain) || !text.contains(hides) {
        return Cow::Borrowed(text);
    }
    let mut result = String::with_capacity(text.len());
    for character in text.chars() {
        if hides(character) {
            escape(character, &mut result);
        } else {
            result.push(character);
        }
    }
    Cow::Owned(result)
}

#[cfg(test)]
mod tests {
    use super::{visible, visible_json};

    fn check(text: &str, shown: &str, in_json: &str) {
        assert_eq!((&*visible(text), &*visible_json(text)), (shown, in_json), "{text:?}");
    }

    #[test]
    fn invisible_characters_are_escaped() {
        check("a\tb\n", "a\tb\n", "a\tb\n");
        check("naïve Ελλάδα می\u{200c}خواهم", "naïve Ελλάδα می\u{200c}خواهم", "naïve Ελλάδα می\u{200c}خواهم");
        check("\u{1b}[2J", "\\u{1b}[2J", "\\u001b[2J");
        check("\u{202e}x\u{feff}", "\\u{202e}x\\u{feff}", "\\u202ex\\ufeff");
        check("\u{200b}\u{2028}", "\\u{200b}\\u{2028}", "\\u200b\\u2028");
        // This character has two UTF-16 code units.
        check("\u{e0041}", "\\u{e0041}", "\\udb40\\udc41");
    }
}
