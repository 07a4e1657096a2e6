//! Regular expressions, as far as those of `XPath` and of the `regex` crate agree: no back references, no character
//! class subtraction. A pattern that cannot be read makes its built-in false.

use regex::{Regex, RegexBuilder};

use super::text::as_text;
use crate::literal::Literal;

/// The compiled size of a pattern, in bytes, from which it is refused.
const SIZE_LIMIT: usize = 1 << 20;

/// Whether the first argument contains a match of the second.
pub(super) fn matches(arguments: &[&Literal]) -> bool {
    let texts: Option<Vec<&str>> = arguments.iter().map(|argument| as_text(argument)).collect();
    match texts.as_deref() {
        Some([text, pattern]) => compile(pattern, "").is_some_and(|regex| regex.is_match(text)),
        Some([text, pattern, flags]) => compile(pattern, flags).is_some_and(|regex| regex.is_match(text)),
        _ => false,
    }
}

/// The first argument with each match of the second replaced by the third, where `$1` is the first group. `None` for a
/// pattern that matches the empty text, which `XPath` forbids.
pub(super) fn replace(arguments: &[&Literal]) -> Option<Literal> {
    let texts = arguments.iter().map(|argument| as_text(argument)).collect::<Option<Vec<&str>>>()?;
    let (text, pattern, replacement, flags) = match texts.as_slice() {
        [text, pattern, replacement] => (text, pattern, replacement, ""),
        [text, pattern, replacement, flags] => (text, pattern, replacement, *flags),
        _ => return None,
    };
    let regex = compile(pattern, flags).filter(|regex| !regex.is_match(""))?;
    Some(Literal::String(regex.replace_all(text, expand(replacement)?.as_str()).into()))
}

fn compile(pattern: &str, flags: &str) -> Option<Regex> {
    let mut builder = RegexBuilder::new(pattern);
    builder.size_limit(SIZE_LIMIT).dfa_size_limit(SIZE_LIMIT);
    for flag in flags.chars() {
        match flag {
            's' => builder.dot_matches_new_line(true),
            'm' => builder.multi_line(true),
            'i' => builder.case_insensitive(true),
            'x' => builder.ignore_whitespace(true),
            _ => return None,
        };
    }
    builder.build().ok()
}

/// The replacement text of `XPath` in the spelling of the `regex` crate; `None` where it is not one.
fn expand(replacement: &str) -> Option<String> {
    let mut expanded = String::new();
    let mut rest = replacement.chars();
    while let Some(character) = rest.next() {
        match character {
            '\\' => match rest.next()? {
                '$' => expanded.push_str("$$"),
                '\\' => expanded.push('\\'),
                _ => return None,
            },
            '$' => {
                let digit = rest.next().filter(char::is_ascii_digit)?;
                expanded.push_str("${");
                expanded.push(digit);
                expanded.push('}');
            }
            other => expanded.push(other),
        }
    }
    Some(expanded)
}
