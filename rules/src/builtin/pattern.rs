//! Regular expressions, as far as those of `XPath` and of the `regex` crate agree: no back references, no character
//! class subtraction. A pattern that cannot be read makes its built-in false.
//!
//! [2] W3C `XQuery` 1.0 and `XPath` 2.0 Functions and Operators, 2007.

use std::collections::HashSet;

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

/// The parts of the first argument between matches of the second, each once, in their order. None of the empty text, nor for
/// a pattern that matches the empty text ([2], section 7.6.4).
pub(super) fn tokens(arguments: &[&Literal]) -> Vec<Literal> {
    let texts = arguments.iter().map(|argument| as_text(argument)).collect::<Option<Vec<&str>>>();
    let (text, pattern, flags) = match texts.as_deref() {
        Some([text, pattern]) => (text, pattern, ""),
        Some([text, pattern, flags]) => (text, pattern, *flags),
        _ => return Vec::new(),
    };
    let regex = compile(pattern, flags).filter(|regex| !regex.is_match("") && !text.is_empty());
    let Some(regex) = regex else { return Vec::new() };
    let mut seen = HashSet::new();
    regex.split(text).filter(|token| seen.insert(*token)).map(|token| Literal::String(token.into())).collect()
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
