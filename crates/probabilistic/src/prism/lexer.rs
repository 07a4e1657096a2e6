//! PRISM text to tokens with places.

use crate::error::{Diagnostic, Place};

/// What a token is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Kind {
    /// A name or a keyword.
    Name(String),
    /// A number as it is written.
    Number(String),
    /// Text in quotation marks, without them.
    Quoted(String),
    /// A sign.
    Sign(&'static str),
    /// The end of the text.
    End,
}

impl Kind {
    /// How messages call it.
    pub fn describe(&self) -> String {
        match self {
            Self::Name(name) | Self::Number(name) => format!("`{name}`"),
            Self::Quoted(text) => format!("`\"{text}\"`"),
            Self::Sign(sign) => format!("`{sign}`"),
            Self::End => "the end of the text".to_owned(),
        }
    }
}

/// A token and where it starts.
#[derive(Debug, Clone)]
pub struct Token {
    /// What it is.
    pub kind: Kind,
    /// Where it starts.
    pub place: Place,
}

/// Signs, longer ones first.
const SIGNS: [&str; 30] = [
    "<=>", "->", "=>", "<=", ">=", "!=", "..", "(", ")", "[", "]", "{", "}", "<", ">", "=", "+", "-", "*",
    "/", "!", "&", "|", "?", ":", ";", ",", "'", ".", "^",
];

/// All tokens of a text, the end among them.
///
/// # Errors
/// Characters that no token starts with, and quotation marks without end.
#[expect(clippy::arithmetic_side_effects, reason = "lines and columns of a text in memory")]
pub fn tokens(text: &str) -> Result<Vec<Token>, Vec<Diagnostic>> {
    let (mut tokens, mut problems) = (Vec::new(), Vec::new());
    let mut place = Place { line: 1, column: 1 };
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = if first.is_whitespace() {
            first.len_utf8()
        } else if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else {
            match token(rest) {
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
        let (taken, left) = rest.split_at(length);
        for c in taken.chars() {
            if c == '\n' {
                place = Place { line: place.line + 1, column: 1 };
            } else {
                place.column += 1;
            }
        }
        rest = left;
    }
    tokens.push(Token { kind: Kind::End, place });
    if problems.is_empty() { Ok(tokens) } else { Err(problems) }
}

/// The first token of a text that is not empty, and its length in bytes.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "positions in a text in memory, which are at most its length"
)]
fn token(text: &str) -> Result<(Kind, usize), String> {
    let first = text.chars().next().unwrap_or(' ');
    let length = |good: fn(char) -> bool| text.find(|c| !good(c)).unwrap_or(text.len());
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
        if text[end..].starts_with('.') && digit_follows(end + 1) {
            end = digits(end + 1);
        }
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
            _ => Err("this quotation mark has no partner on its line".to_owned()),
        };
    }
    let sign = SIGNS.iter().find(|sign| text.starts_with(**sign));
    sign.map(|sign| (Kind::Sign(sign), sign.len()))
        .ok_or_else(|| format!("`{first}` has no meaning in the PRISM language"))
}
