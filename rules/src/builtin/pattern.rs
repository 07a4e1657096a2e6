//! Regular expressions of `XPath`: matching, replacement and tokenisation. Patterns are translated to the
//! syntax of the `regex` crate, which supports neither back references nor names of Unicode blocks (`\p{IsGreek}`). An
//! invalid constant pattern is an error of its rule (R210). An invalid pattern in a variable makes the
//! built-in false.
//!
//! [1] W3C `XQuery` 1.0 and `XPath` 2.0 Functions and Operators, 2007.

use std::collections::HashSet;

use regex::{Regex, RegexBuilder};

use super::text::as_text;
use crate::literal::Literal;

const SIZE_LIMIT: usize = 1 << 20;

pub(super) fn matches(arguments: &[&Literal]) -> bool {
    let texts: Option<Vec<&str>> = arguments.iter().map(|argument| as_text(argument)).collect();
    match texts.as_deref() {
        Some([text, pattern]) => compile(pattern, "").is_some_and(|regex| regex.is_match(text)),
        Some([text, pattern, flags]) => compile(pattern, flags).is_some_and(|regex| regex.is_match(text)),
        _ => false,
    }
}

/// Replaces each match of the second argument in the first by the third, in which `$1` refers to the first group.
/// `None` for invalid arguments, and for a pattern that matches the empty text, which `XPath` forbids.
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

/// Returns the distinct parts of the first argument between matches of the second, in order of occurrence. Empty for
/// the empty text, for invalid arguments, and for a pattern that matches the empty text ([1], section 7.6.4).
pub(super) fn tokens(arguments: &[&Literal]) -> Vec<Literal> {
    let texts = arguments.iter().map(|argument| as_text(argument)).collect::<Option<Vec<&str>>>();
    let (text, pattern, flags) = match texts.as_deref() {
        Some([text, pattern]) => (text, pattern, ""),
        Some([text, pattern, flags]) => (text, pattern, *flags),
        _ => return Vec::new(),
    };
    let regex = compile(pattern, flags).filter(|regex| !regex.is_match("") && !text.is_empty());
    let Some(regex) = regex else { return Vec::new() };
    let mut unique = HashSet::new();
    regex
        .split(text)
        .filter(|token| unique.insert(*token))
        .map(|token| Literal::String(token.into()))
        .collect()
}

/// Returns the error of a pattern and its flags. A valid pattern above the size limit has no error, but
/// matches nothing.
pub(super) fn fault(pattern: &str, flags: &str) -> Option<String> {
    build(pattern, flags).err().filter(|reason| !reason.contains("size limit"))
}

fn compile(pattern: &str, flags: &str) -> Option<Regex> {
    build(pattern, flags).ok()
}

fn build(pattern: &str, flags: &str) -> Result<Regex, String> {
    let translated = translate(pattern, flags.contains('x'))?;
    let mut builder = RegexBuilder::new(&translated);
    builder.size_limit(SIZE_LIMIT).dfa_size_limit(SIZE_LIMIT);
    for flag in flags.chars() {
        match flag {
            's' => builder.dot_matches_new_line(true),
            'm' => builder.multi_line(true),
            'i' => builder.case_insensitive(true),
            // `translate` removes the white space: the `regex` crate would remove it in classes, too.
            'x' => &mut builder,
            _ => return Err(format!("`{flag}` is not a flag; there are s, m, i and x")),
        };
    }
    builder.build().map_err(|error| {
        // The last line of the multi-line message contains the reason.
        let text = error.to_string();
        text.lines().last().unwrap_or_default().trim_start_matches("error: ").to_owned()
    })
}

/// Characters at the start of an XML name, as members of a class (XML 1.0, fifth edition, production 4).
const NAME_START: &str = ":A-Z_a-z\\x{C0}-\\x{D6}\\x{D8}-\\x{F6}\\x{F8}-\\x{2FF}\\x{370}-\\x{37D}\\x{37F}-\\x{1FFF}\\x{200C}-\\x{200D}\\x{2070}-\\x{218F}\\x{2C00}-\\x{2FEF}\\x{3001}-\\x{D7FF}\\x{F900}-\\x{FDCF}\\x{FDF0}-\\x{FFFD}\\x{10000}-\\x{EFFFF}";

const NAME_CONTINUE: &str = "\\-.0-9\\x{B7}\\x{300}-\\x{36F}\\x{203F}-\\x{2040}";

/// The classes `\w` and `\W` of XML Schema, part 2, appendix G.
const WORD: &str = "[^\\p{P}\\p{Z}\\p{C}]";
const NO_WORD: &str = "[\\p{P}\\p{Z}\\p{C}]";

fn is_space(character: char) -> bool {
    matches!(character, ' ' | '\t' | '\n' | '\r')
}

/// Translates a pattern of `XPath` to the syntax of the `regex` crate: `[a-z-[aeiou]]` (subtraction of classes)
/// becomes `[a-z--[aeiou]]`, and `\i`, `\c`, `\w`, `\s` and their complements are expanded. With `is_spaced` (flag
/// `x`), white space outside of classes is removed. Returns an error for a back reference, for the name of a block,
/// for a backslash at the end, and for a class within a class that is not subtracted.
fn translate(pattern: &str, is_spaced: bool) -> Result<String, String> {
    let mut translated = String::new();
    // Nesting depth of classes, and a flag that is set while the innermost class has no members yet.
    let (mut depth, mut is_empty) = (0, false);
    let mut characters = pattern.chars().peekable();
    while let Some(character) = characters.next() {
        let was_empty = std::mem::replace(&mut is_empty, false);
        match character {
            '\\' => {
                while is_spaced && depth == 0 && characters.next_if(|&next| is_space(next)).is_some() {}
                let escaped = characters.next().ok_or("it ends with a backslash")?;
                match escaped {
                    'w' => translated += WORD,
                    'W' => translated += NO_WORD,
                    's' => translated += "[ \\t\\n\\r]",
                    'S' => translated += "[^ \\t\\n\\r]",
                    'p' | 'P' if characters.clone().take(3).eq("{Is".chars()) => {
                        let name: String = characters.take_while(|&next| next != '}').skip(1).collect();
                        return Err(format!("the name of a Unicode block, `{name}`, is not supported"));
                    }
                    'i' => translated.extend(["[", NAME_START, "]"]),
                    'c' => translated.extend(["[", NAME_START, NAME_CONTINUE, "]"]),
                    'I' => translated.extend(["[^", NAME_START, "]"]),
                    'C' => translated.extend(["[^", NAME_START, NAME_CONTINUE, "]"]),
                    '1'..='9' if depth == 0 => {
                        return Err(format!("the back reference \\{escaped} is not supported"));
                    }
                    _ => translated.extend(['\\', escaped]),
                }
            }
            '[' if depth == 0 => {
                (depth, is_empty) = (1, true);
                translated.push('[');
                if characters.next_if_eq(&'^').is_some() {
                    translated.push('^');
                }
            }
            '-' if depth > 0 && characters.peek() == Some(&'[') && !was_empty => {
                characters.next();
                depth += 1;
                is_empty = true;
                translated += "--[";
                if characters.next_if_eq(&'^').is_some() {
                    translated.push('^');
                }
            }
            ']' if depth > 0 => {
                depth -= 1;
                translated.push(']');
            }
            '[' => {
                return Err("a class within a class is written `-[…]`, or `\\[` for the character".to_owned());
            }
            // `&&` and `~~` are set operations of the `regex` crate, but ordinary characters in `XPath`.
            '&' | '~' if depth > 0 => translated.extend(['\\', character]),
            space if is_spaced && depth == 0 && is_space(space) => {}
            other => translated.push(other),
        }
    }
    Ok(translated)
}

fn expand(replacement: &str) -> Option<String> {
    let mut expanded = String::new();
    let mut characters = replacement.chars();
    while let Some(character) = characters.next() {
        match character {
            '\\' => match characters.next()? {
                '$' => expanded.push_str("$$"),
                '\\' => expanded.push('\\'),
                _ => return None,
            },
            '$' => {
                let digit = characters.next().filter(char::is_ascii_digit)?;
                expanded.push_str("${");
                expanded.push(digit);
                expanded.push('}');
            }
            other => expanded.push(other),
        }
    }
    Some(expanded)
}
