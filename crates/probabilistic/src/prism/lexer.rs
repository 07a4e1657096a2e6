//! Lexer: splits PRISM text into tokens with positions.

use crate::error::{Diagnostic, Place};

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Kind {
    /// A name or a keyword.
    Name(String),
    Number(String),
    /// A text in quotation marks, stored without the quotation marks.
    Quoted(String),
    Sign(&'static str),
    End,
}

impl Kind {
    pub fn describe(&self) -> String {
        match self {
            Self::Name(name) | Self::Number(name) => format!("`{name}`"),
            Self::Quoted(text) => format!("`\"{text}\"`"),
            Self::Sign(sign) => format!("`{sign}`"),
            Self::End => "the end of the text".to_owned(),
        }
    }
}

#[derive(Debug, Clone)]
pub struct Token {
    pub kind: Kind,
    pub place: Place,
}

/// All operators and punctuation marks. An entry precedes its prefixes, because the first match is used.
const SIGNS: [&str; 30] = [
    "<=>", "->", "=>", "<=", ">=", "!=", "..", "(", ")", "[", "]", "{", "}", "<", ">", "=", "+", "-", "*",
    "/", "!", "&", "|", "?", ":", ";", ",", "'", ".", "^",
];

/// Splits a PRISM text into tokens; skips white space and comments. The last token is [`Kind::End`].
///
/// # Errors
/// All characters that begin no token, and all quotation marks that are not closed on their line.
#[expect(clippy::arithmetic_side_effects, reason = "lines and columns of a text in memory")]
pub fn tokens(text: &str) -> Result<Vec<Token>, Vec<Diagnostic>> {
    let (mut tokens, mut problems) = (Vec::new(), Vec::new());
    let mut place = Place { line: 1, column: 1 };
    let mut remainder = text;
    while let Some(first) = remainder.chars().next() {
        let length = if first.is_whitespace() {
            first.len_utf8()
        } else if remainder.starts_with("//") {
            remainder.find('\n').unwrap_or(remainder.len())
        } else {
            match token(remainder) {
                Ok((kind, length)) => {
                    tokens.push(Token { kind, place });
                    length
                }
                Err(message) => {
                    problems.push(Diagnostic::new("Q101", place, message));
                    first.len_utf8()
                }
            }
        };
        let (consumed, unread) = remainder.split_at(length);
        for c in consumed.chars() {
            if c == '\n' {
                place = Place { line: place.line + 1, column: 1 };
            } else {
                place.column += 1;
            }
        }
        remainder = unread;
    }
    tokens.push(Token { kind: Kind::End, place });
    if problems.is_empty() { Ok(tokens) } else { Err(problems) }
}

/// Returns the first token of a nonempty text, with its length in bytes.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "positions in a text in memory, which are at most its length"
)]
fn token(text: &str) -> Result<(Kind, usize), String> {
    let first = text.chars().next().unwrap_or(' ');
    let length = |is_part: fn(char) -> bool| text.find(|c| !is_part(c)).unwrap_or(text.len());
    if first.is_ascii_alphabetic() || first == '_' {
        let end = length(|c| c.is_ascii_alphanumeric() || c == '_');
        return Ok((Kind::Name(text[..end].to_owned()), end));
    }
    let digit_follows = |at: usize| text[at..].starts_with(|c: char| c.is_ascii_digit());
    if first.is_ascii_digit() || first == '.' && digit_follows(1) {
        let digits = |from: usize| {
            from + text[from..].find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len() - from)
        };
        let mut end = digits(0);
        // A point belongs to a number only before a digit, because `0..3` is a range.
        if text[end..].starts_with('.') && digit_follows(end + 1) {
            end = digits(end + 1);
        }
        // An `e` without digits after it begins a name.
        if text[end..].starts_with(['e', 'E']) {
            let sign = usize::from(text[end + 1..].starts_with(['+', '-']));
            if digit_follows(end + 1 + sign) {
                end = digits(end + 1 + sign);
            }
        }
        return Ok((Kind::Number(text[..end].to_owned()), end));
    }
    if first == '"' {
        return match text[1..].find(['"', '\n']) {
            Some(end) if text[1 + end..].starts_with('"') => {
                Ok((Kind::Quoted(text[1..=end].to_owned()), end + 2))
            }
            _ => Err("this quotation mark is not closed on its line".to_owned()),
        };
    }
    let sign = SIGNS.iter().find(|sign| text.starts_with(**sign));
    sign.map(|sign| (Kind::Sign(sign), sign.len()))
        .ok_or_else(|| format!("`{first}` has no meaning in the PRISM language"))
}
