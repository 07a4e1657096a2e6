//! String tests and functions on characters (not bytes), as defined by `XPath`.

use super::math;
use super::signature::BuiltIn;
use crate::literal::Literal;

pub(super) fn test(built_in: BuiltIn, left: &Literal, right: &Literal) -> bool {
    let (Some(left), Some(right)) = (as_text(left), as_text(right)) else { return false };
    match built_in {
        BuiltIn::StringEqualIgnoreCase => folded(left) == folded(right),
        BuiltIn::Contains => left.contains(right),
        BuiltIn::ContainsIgnoreCase => folded(left).contains(&folded(right)),
        BuiltIn::StartsWith => left.starts_with(right),
        BuiltIn::EndsWith => left.ends_with(right),
        _ => false,
    }
}

/// Converts a text to lower case for a comparison, each character independently of its neighbours. A final sigma
/// becomes an ordinary one; `str::to_lowercase` distinguishes the two.
fn folded(text: &str) -> String {
    let lower = text.chars().flat_map(char::to_lowercase);
    lower.map(|character| if character == 'ς' { 'σ' } else { character }).collect()
}

pub(super) fn compute(built_in: BuiltIn, arguments: &[&Literal]) -> Option<Literal> {
    if built_in == BuiltIn::StringConcat {
        return Some(Literal::String(arguments.iter().map(|a| a.lexical()).collect::<String>().into()));
    }
    let first = as_text(arguments.first()?)?;
    if built_in == BuiltIn::Substring {
        return substring(first, &arguments[1..]).map(|text| Literal::String(text.into()));
    }
    let other_texts = arguments[1..].iter().map(|a| as_text(a)).collect::<Option<Vec<_>>>()?;
    let text = match (built_in, other_texts.as_slice()) {
        (BuiltIn::StringLength, []) => return Some(Literal::integer(first.chars().count() as i64)),
        (BuiltIn::NormalizeSpace, []) => first.split_ascii_whitespace().collect::<Vec<_>>().join(" "),
        (BuiltIn::UpperCase, []) => first.to_uppercase(),
        (BuiltIn::LowerCase, []) => first.to_lowercase(),
        (BuiltIn::Translate, [from, to]) => translate(first, from, to),
        (BuiltIn::SubstringBefore, [mark]) => {
            first.split_once(mark).map_or("", |(before, _)| before).to_string()
        }
        (BuiltIn::SubstringAfter, [mark]) => {
            first.split_once(mark).map_or("", |(_, after)| after).to_string()
        }
        _ => return None,
    };
    Some(Literal::String(text.into()))
}

pub(super) fn as_text(literal: &Literal) -> Option<&str> {
    match literal {
        Literal::String(text) | Literal::Uri(text) | Literal::Language { text, .. } => Some(text),
        _ => None,
    }
}

/// Computes `XPath`'s `fn:substring`. Positions are counted from 1 and rounded, and positions outside the
/// text are ignored.
fn substring(text: &str, bounds: &[&Literal]) -> Option<String> {
    let round = |literal: &Literal| literal.as_f64().map(math::round);
    let start = round(bounds.first()?)?;
    let end = match bounds.get(1) {
        Some(length) => start + round(length)?,
        None => f64::INFINITY,
    };
    let inside =
        |&(position, _): &(usize, char)| (position as f64 + 1.0) >= start && (position as f64 + 1.0) < end;
    Some(text.chars().enumerate().filter(inside).map(|(_, character)| character).collect())
}

fn translate(text: &str, from: &str, to: &str) -> String {
    let replace = |character| match from.chars().position(|f| f == character) {
        // A character without a counterpart is removed.
        Some(position) => to.chars().nth(position),
        None => Some(character),
    };
    text.chars().filter_map(replace).collect()
}
