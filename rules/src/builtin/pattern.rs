//! Regular expressions of `XPath`: matching, replacement and tokenisation. Patterns are translated to the
//! syntax of the `regex` crate, which supports neither back references nor names of Unicode blocks (`\p{IsGreek}`). An
//! invalid constant pattern is an error of its rule (R210). An invalid pattern in a variable makes the
//! built-in false.
//!
//! [1] W3C `XQuery` 1.0 and `XPath` 2.0 Functions and Operators, 2007.

use std::cell::RefCell;
use std::collections::HashSet;

use regex::{Regex, RegexBuilder};

use super::text::as_text;
use crate::limits::MAX_VALUE_BYTES;
use crate::literal::Literal;

const SIZE_LIMIT: usize = 1 << 20;

pub(super) fn matches(arguments: &[&Literal]) -> bool {
    let texts: Option<Vec<&str>> = arguments.iter().map(|argument| as_text(argument)).collect();
    match texts.as_deref() {
        Some([text, pattern]) => with_pattern(pattern, "", |regex| regex.is_match(text)) == Some(true),
        Some([text, pattern, flags]) => {
            with_pattern(pattern, flags, |regex| regex.is_match(text)) == Some(true)
        }
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
    let replacement = expand(replacement)?;
    let replaced = |regex: &Regex| (!regex.is_match("")).then(|| replace_all(regex, text, &replacement));
    Some(Literal::String(with_pattern(pattern, flags, replaced)??.into()))
}

/// Replaces all matches. A result above [`MAX_VALUE_BYTES`], which exhausts the budget, is not completed.
fn replace_all(regex: &Regex, text: &str, replacement: &str) -> String {
    let (mut result, mut end) = (String::new(), 0);
    for captures in regex.captures_iter(text) {
        let Some(whole) = captures.get(0) else { continue };
        result += &text[end..whole.start()];
        captures.expand(replacement, &mut result);
        end = whole.end();
        if result.len() as u64 > MAX_VALUE_BYTES {
            return result;
        }
    }
    result + &text[end..]
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
    let split = |regex: &Regex| {
        if regex.is_match("") || text.is_empty() {
            return Vec::new();
        }
        let mut unique = HashSet::new();
        let tokens = regex.split(text).filter(|token| unique.insert(*token));
        tokens.map(|token| Literal::String(token.into())).collect()
    };
    with_pattern(pattern, flags, split).unwrap_or_default()
}

/// Returns the error of a pattern and its flags. A valid pattern above the size limit has no error, but
/// matches nothing.
pub(super) fn fault(pattern: &str, flags: &str) -> Option<String> {
    build(pattern, flags).err().filter(|reason| !reason.contains("size limit"))
}

struct Compiled {
    pattern: String,
    flags: String,
    /// `None` if the pattern is invalid.
    regex: Option<Regex>,
}

thread_local! {
    /// The last pattern. Compiling takes much longer than matching, and most patterns are constants of a rule, which
    /// are used for many matches in turn.
    static LAST: RefCell<Option<Compiled>> = const { RefCell::new(None) };
}

/// Evaluates a function on the compiled pattern. Returns `None` if the pattern or the flags are invalid.
fn with_pattern<T>(pattern: &str, flags: &str, evaluate: impl FnOnce(&Regex) -> T) -> Option<T> {
    LAST.with_borrow_mut(|last| {
        let compiled = match last.take() {
            Some(compiled) if compiled.pattern == pattern && compiled.flags == flags => compiled,
            _ => Compiled {
                pattern: pattern.to_owned(),
                flags: flags.to_owned(),
                regex: build(pattern, flags).ok(),
            },
        };
        last.insert(compiled).regex.as_ref().map(evaluate)
    })
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
