//! Properties in PRISM's syntax to what is asked.
//!
//! `Pmax=? [ F "goal" ]`, `P>=0.9 [ !hit U "goal" ]`, `R{"time"}min=? [ F "goal" ]`, `R{"time"}min=? [ C<=10 ]`,
//! `multi(R{"time"}min=? [ F "goal" ], Pmax=? [ F "safe" ])`.

use crate::error::{Diagnostic, Error};
use crate::prism::ast::{BinaryOp, Expr, ExprKind};
use crate::prism::expression::{Cursor, Read};
use crate::prism::lexer::{Kind, tokens};
use crate::solve::Direction;

/// What is asked of a model.
#[derive(Debug, Clone, PartialEq)]
pub enum Property {
    /// A probability.
    Probability(Question, Path),
    /// An expected reward, with the name of its structure where there is one.
    Reward(Question, Option<String>, RewardPath),
    /// Several objectives at once.
    Multi(Vec<Self>),
}

/// For the value, or whether it keeps a bound.
#[derive(Debug, Clone, PartialEq)]
pub struct Question {
    /// Least or greatest; none where the model has one policy only, or the bound says it.
    pub direction: Option<Direction>,
    /// The bound; none for the value.
    pub bound: Option<(BinaryOp, Expr)>,
}

/// Paths.
#[derive(Debug, Clone, PartialEq)]
pub enum Path {
    /// `X`: in the next state.
    Next(Expr),
    /// `U`, and `F` with `true` on the left: the right one holds some day (in at most so many steps), the left one
    /// until then.
    Until(Expr, Expr, Option<Steps>),
    /// `G`: always (for so many steps).
    Globally(Expr, Option<Steps>),
}

/// A bound on the number of steps: at most so many.
#[derive(Debug, Clone, PartialEq)]
pub struct Steps {
    /// The number.
    pub limit: Expr,
    /// Whether the number itself is excluded.
    pub strict: bool,
}

/// Over what a reward is summed.
#[derive(Debug, Clone, PartialEq)]
pub enum RewardPath {
    /// `F`: until a state is reached.
    Reach(Expr),
    /// `C<=k`: over so many steps.
    Steps(Steps),
}

/// Reads a property.
///
/// # Errors
/// What is wrong with it.
pub fn parse(text: &str) -> Result<Property, Error> {
    let tokens = tokens(text).map_err(Error::Property)?;
    let mut cursor = Cursor::new(&tokens);
    let read = property(&mut cursor).and_then(|property| {
        cursor.take(";");
        if *cursor.peek() == Kind::End {
            Ok(property)
        } else {
            Err(cursor.expected("the end of the property"))
        }
    });
    read.map_err(|problem| Error::Property(vec![problem]))
}

fn property(cursor: &mut Cursor<'_>) -> Read<Property> {
    let Kind::Name(word) = cursor.peek() else {
        return Err(cursor.expected("a property (`Pmax=? [ F … ]`, `R{\"name\"}min=? [ F … ]`)"));
    };
    let place = cursor.place();
    match word.as_str() {
        "multi" => {
            cursor.advance();
            cursor.need("(")?;
            let mut parts = vec![property(cursor)?];
            while cursor.take(",") {
                parts.push(property(cursor)?);
            }
            cursor.need(")")?;
            if parts.iter().any(|part| matches!(part, Property::Multi(_))) {
                return Err(Diagnostic::new("Q501", place, "`multi` does not nest"));
            }
            Ok(Property::Multi(parts))
        }
        "P" | "Pmin" | "Pmax" => {
            cursor.advance();
            let question = question(cursor, &word[1..])?;
            cursor.need("[")?;
            let path = path(cursor)?;
            cursor.need("]")?;
            Ok(Property::Probability(question, path))
        }
        "R" | "Rmin" | "Rmax" => {
            cursor.advance();
            let mut name = None;
            if cursor.take("{") {
                let Kind::Quoted(text) = cursor.peek() else {
                    return Err(cursor.expected("the name of a reward structure in quotation marks"));
                };
                name = Some(text.clone());
                cursor.advance();
                cursor.need("}")?;
            }
            let question = question(cursor, &word[1..])?;
            cursor.need("[")?;
            let path = reward_path(cursor)?;
            cursor.need("]")?;
            Ok(Property::Reward(question, name, path))
        }
        "S" | "E" | "A" | "filter" => {
            Err(Diagnostic::new("Q403", place, format!("properties with `{word}` are not handled")))
        }
        _ => Err(cursor.expected("a property (`Pmax=? [ F … ]`, `R{\"name\"}min=? [ F … ]`)")),
    }
}

fn question(cursor: &mut Cursor<'_>, suffix: &str) -> Read<Question> {
    let mut direction = match suffix {
        "min" => Some(Direction::Min),
        "max" => Some(Direction::Max),
        _ => None,
    };
    if direction.is_none() {
        direction = if cursor.take_word("min") {
            Some(Direction::Min)
        } else if cursor.take_word("max") {
            Some(Direction::Max)
        } else {
            None
        };
    }
    for (sign, op) in [
        ("<=", BinaryOp::LessEqual),
        (">=", BinaryOp::GreaterEqual),
        ("<", BinaryOp::Less),
        (">", BinaryOp::Greater),
    ] {
        if cursor.take(sign) {
            return Ok(Question { direction, bound: Some((op, cursor.expression()?)) });
        }
    }
    cursor.need("=")?;
    cursor.need("?")?;
    Ok(Question { direction, bound: None })
}

fn steps(cursor: &mut Cursor<'_>) -> Read<Option<Steps>> {
    let strict = cursor.is("<");
    if cursor.take("<=") || cursor.take("<") {
        // `F<=10 "goal"`: the number ends before the state formula; in parentheses it can be any expression.
        let place = cursor.place();
        let limit = match cursor.peek() {
            Kind::Number(text) if text.bytes().all(|byte| byte.is_ascii_digit()) => {
                let value = text.parse().map_err(|_| cursor.expected("a number of steps"))?;
                cursor.advance();
                Expr { kind: ExprKind::Int(value), place }
            }
            Kind::Name(_) => Expr { kind: ExprKind::Name(cursor.name("a number of steps")?.0), place },
            Kind::Sign("(") => {
                cursor.advance();
                let inner = cursor.expression()?;
                cursor.need(")")?;
                inner
            }
            _ => return Err(cursor.expected("a number of steps")),
        };
        return Ok(Some(Steps { limit, strict }));
    }
    if cursor.is(">") || cursor.is(">=") || cursor.is("[") {
        return Err(Diagnostic::new("Q403", cursor.place(), "only upper bounds on steps are handled"));
    }
    Ok(None)
}

fn path(cursor: &mut Cursor<'_>) -> Read<Path> {
    if cursor.take_word("X") {
        return Ok(Path::Next(cursor.expression()?));
    }
    if cursor.take_word("F") {
        let steps = steps(cursor)?;
        return Ok(Path::Until(Expr::bool(true), cursor.expression()?, steps));
    }
    if cursor.take_word("G") {
        let steps = steps(cursor)?;
        return Ok(Path::Globally(cursor.expression()?, steps));
    }
    let left = cursor.expression()?;
    if cursor.is_word("W") || cursor.is_word("R") {
        return Err(Diagnostic::new("Q403", cursor.place(), "`W` and `R` are not handled"));
    }
    cursor.need_word("U")?;
    let steps = steps(cursor)?;
    Ok(Path::Until(left, cursor.expression()?, steps))
}

fn reward_path(cursor: &mut Cursor<'_>) -> Read<RewardPath> {
    if cursor.take_word("F") {
        return Ok(RewardPath::Reach(cursor.expression()?));
    }
    let place = cursor.place();
    if cursor.take_word("C")
        && let Some(steps) = steps(cursor)?
    {
        return Ok(RewardPath::Steps(steps));
    }
    let text = "only `F` and `C<=k` are handled in properties of rewards";
    Err(Diagnostic::new("Q403", place, text))
}
