//! Grammar of properties: converts tokens to the syntax tree.

use crate::error::{Diagnostic, Error, Place};
use crate::prism::ast::{
    BinaryOp, Expr, ExprKind, Filter, Path, Property, Question, RewardPath, StepBound, Steps, Temporal,
};
use crate::prism::expression::{Cursor, PropertySyntax, Read};
use crate::prism::lexer::{Kind, tokens};
use crate::solve::Direction;

const PROPERTY: &str = "a property (`Pmax=? [ F … ]`, `R{\"name\"}min=? [ F … ]`)";

pub const PROPERTY_SYNTAX: PropertySyntax = PropertySyntax { parse_prefix, parse_infix };

/// The names of the filters. The last entry is another name for `avg`.
const FILTERS: [(&str, Filter); 15] = [
    ("min", Filter::Min),
    ("max", Filter::Max),
    ("sum", Filter::Sum),
    ("avg", Filter::Average),
    ("count", Filter::Count),
    ("forall", Filter::ForAll),
    ("exists", Filter::Exists),
    ("first", Filter::First),
    ("state", Filter::State),
    ("range", Filter::Range),
    ("print", Filter::Print),
    ("printall", Filter::PrintAll),
    ("argmin", Filter::ArgMin),
    ("argmax", Filter::ArgMax),
    ("average", Filter::Average),
];

/// Parses a single property, which must be the whole text.
///
/// # Errors
/// The first syntax error, or the first unsupported construct.
pub fn parse(text: &str) -> Result<Property, Error> {
    let tokens = tokens(text).map_err(|problems| Error::Property(problems.into()))?;
    let mut cursor = Cursor::for_properties(&tokens, PROPERTY_SYNTAX);
    let result = property(&mut cursor).and_then(|property| {
        cursor.take(";");
        if *cursor.peek() == Kind::End {
            Ok(property)
        } else {
            Err(cursor.expected("the end of the property"))
        }
    });
    result.map_err(|problem| Error::Property(problem.into()))
}

pub fn property(cursor: &mut Cursor<'_>) -> Read<Property> {
    if !matches!(
        cursor.peek(),
        Kind::Name(_) | Kind::Number(_) | Kind::Quoted(_) | Kind::Sign("(" | "!" | "-")
    ) {
        return Err(cursor.expected(PROPERTY));
    }
    let mut expression = cursor.expression()?;
    // In a file, the next property may begin with `R`. A complete property is never an operand of
    // the temporal operator `R`.
    if !cursor.is_word("R") {
        expression = parse_infix(cursor, expression)?;
    }
    Ok(match expression.kind {
        ExprKind::Property(property) => *property,
        ExprKind::Temporal(_) => {
            let text =
                "a path has a probability and no truth value: write `P=? [ … ]` or `P>=1 [ … ]` around it";
            return Err(Diagnostic::new("Q403", expression.place, text));
        }
        _ => Property::Expression(expression),
    })
}

/// Parses a property or a unary temporal operator. Returns `None` if the next token begins neither,
/// and an error for the CTL quantifiers `A` and `E`.
fn parse_prefix(cursor: &mut Cursor<'_>) -> Read<Option<ExprKind>> {
    let Kind::Name(word) = cursor.peek() else { return Ok(None) };
    let place = cursor.place();
    let property = match word.as_str() {
        "multi" if matches!(cursor.peek_at(1), Kind::Sign("(")) => multi(cursor)?,
        "P" | "Pmin" | "Pmax" => probability(cursor, &word[1..])?,
        "R" | "Rmin" | "Rmax" => reward(cursor, &word[1..])?,
        // `S` before a closing bracket is the long-run average of a reward, as in `R=? [ S ]`.
        "S" | "Smin" | "Smax" if !matches!(cursor.peek_at(1), Kind::Sign(")" | "]")) => {
            cursor.advance();
            let question = question(cursor, &word[1..])?;
            cursor.need("[")?;
            let states = cursor.expression()?;
            filtered(cursor, Property::SteadyState(question, states), place)?
        }
        "filter" => filter(cursor)?,
        "X" | "F" | "G" => {
            let letter = word.chars().next().unwrap_or('F');
            cursor.advance();
            let steps = if letter == 'X' { None } else { steps(cursor)?.map(Box::new) };
            let right = cursor.expression()?;
            let temporal = Temporal { letter, steps, left: Expr::bool(true), right };
            return Ok(Some(ExprKind::Temporal(Box::new(temporal))));
        }
        "A" | "E" => {
            let text = format!("`{word}` of CTL is not supported; use `P>=1 [ … ]` or `P>0 [ … ]`");
            return Err(Diagnostic::new("Q403", place, text));
        }
        _ => return Ok(None),
    };
    Ok(Some(ExprKind::Property(Box::new(property))))
}

/// Parses a binary temporal operator (`U`, `W` or `R`) and its right operand, after the left operand. Returns
/// `left` unchanged if no such operator follows.
fn parse_infix(cursor: &mut Cursor<'_>, left: Expr) -> Read<Expr> {
    let letter = match cursor.peek() {
        Kind::Name(word) if word == "U" => 'U',
        Kind::Name(word) if word == "W" => 'W',
        Kind::Name(word) if word == "R" => 'R',
        _ => return Ok(left),
    };
    let place = left.place;
    cursor.advance();
    let steps = steps(cursor)?.map(Box::new);
    let right = cursor.expression()?;
    Ok(Expr { kind: ExprKind::Temporal(Box::new(Temporal { letter, steps, left, right })), place })
}

fn multi(cursor: &mut Cursor<'_>) -> Read<Property> {
    let place = cursor.place();
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

fn probability(cursor: &mut Cursor<'_>, suffix: &str) -> Read<Property> {
    let place = cursor.place();
    cursor.advance();
    let question = question(cursor, suffix)?;
    cursor.need("[")?;
    let formula = cursor.expression()?;
    let formula = parse_infix(cursor, formula)?;
    let path = path(formula)?;
    filtered(cursor, Property::Probability(question, path), place)
}

fn reward_name(cursor: &mut Cursor<'_>) -> Read<Option<String>> {
    if !cursor.take("{") {
        return Ok(None);
    }
    let Kind::Quoted(text) = cursor.peek() else {
        return Err(cursor.expected("the name of a reward structure in quotation marks"));
    };
    let name = text.clone();
    cursor.advance();
    cursor.need("}")?;
    Ok(Some(name))
}

fn reward(cursor: &mut Cursor<'_>, suffix: &str) -> Read<Property> {
    let place = cursor.place();
    cursor.advance();
    let name = reward_name(cursor)?;
    let question = question(cursor, suffix)?;
    cursor.need("[")?;
    let path = reward_path(cursor)?;
    filtered(cursor, Property::Reward(question, name, path), place)
}

/// Parses the end of a `P`, `R` or `S` operator: `]`, or the deprecated syntax of a filter,
/// `{states}{min}]`. As in PRISM, `{min}{max}` is the filter `range`, and an operator with a bound has to hold in all of
/// the states.
fn filtered(cursor: &mut Cursor<'_>, property: Property, place: Place) -> Read<Property> {
    if !cursor.take("{") {
        cursor.need("]")?;
        return Ok(property);
    }
    let states = cursor.expression()?;
    cursor.need("}")?;
    let (mut least, mut greatest) = (false, false);
    while cursor.take("{") {
        if cursor.take_word("min") {
            least = true;
        } else if cursor.take_word("max") {
            greatest = true;
        } else {
            return Err(cursor.expected("`min` or `max`"));
        }
        cursor.need("}")?;
    }
    cursor.need("]")?;
    let filter = match (least, greatest) {
        _ if property.bound().is_some() => Filter::ForAll,
        (true, true) => Filter::Range,
        (true, false) => Filter::Min,
        (false, true) => Filter::Max,
        (false, false) => Filter::State,
    };
    let inner = Expr { kind: ExprKind::Property(Box::new(property)), place };
    Ok(Property::Filter(filter, inner, Some(states)))
}

fn filter(cursor: &mut Cursor<'_>) -> Read<Property> {
    cursor.advance();
    cursor.need("(")?;
    let signs = [("+", Filter::Sum), ("&", Filter::ForAll), ("|", Filter::Exists)];
    let entry = match cursor.peek() {
        Kind::Name(word) => FILTERS.iter().find(|(name, _)| name == word),
        Kind::Sign(sign) => signs.iter().find(|(name, _)| name == sign),
        _ => None,
    };
    let Some((_, filter)) = entry else {
        let names: Vec<_> = FILTERS.iter().take(14).map(|(name, _)| *name).collect();
        return Err(cursor.expected(&format!("a filter ({})", names.join(", "))));
    };
    cursor.advance();
    cursor.need(",")?;
    let inner = cursor.expression()?;
    let states = if cursor.take(",") { Some(cursor.expression()?) } else { None };
    cursor.need(")")?;
    Ok(Property::Filter(*filter, inner, states))
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

/// Parses the optional bounds of a temporal operator on steps (`<=10`, `[2,5]`) or on a reward
/// (`^{rew{"name"}<=10}`).
fn steps(cursor: &mut Cursor<'_>) -> Read<Option<Steps>> {
    if cursor.take("^") {
        cursor.need("{")?;
        let is_reward = matches!(cursor.peek(), Kind::Name(word) if word == "rew");
        if !is_reward {
            return Err(cursor.expected("`rew{\"name\"}`"));
        }
        cursor.advance();
        let name = reward_name(cursor)?;
        let steps = one_sided(cursor, any_number)?;
        cursor.need("}")?;
        let steps = steps.ok_or_else(|| cursor.expected("a bound (`<=10`)"))?;
        return Ok(Some(Steps { reward: Some(name), ..steps }));
    }
    if cursor.take("[") {
        let least = cursor.expression()?;
        cursor.need(",")?;
        let most = cursor.expression()?;
        cursor.need("]")?;
        let bound = |limit| Some(StepBound { limit, strict: false });
        return Ok(Some(Steps { least: bound(least), most: bound(most), reward: None }));
    }
    one_sided(cursor, number_of_steps)
}

fn one_sided(cursor: &mut Cursor<'_>, limit: impl Fn(&mut Cursor<'_>) -> Read<Expr>) -> Read<Option<Steps>> {
    for sign in ["<=", "<", ">=", ">", "="] {
        if !cursor.take(sign) {
            continue;
        }
        let bound = Some(StepBound { limit: limit(cursor)?, strict: sign.len() == 1 && sign != "=" });
        let (least, most) = match sign {
            "=" => (bound.clone(), bound),
            "<=" | "<" => (None, bound),
            _ => (bound, None),
        };
        return Ok(Some(Steps { least, most, reward: None }));
    }
    Ok(None)
}

/// Parses the limit of a reward bound: any expression, because a bracket ends it.
fn any_number(cursor: &mut Cursor<'_>) -> Read<Expr> {
    cursor.expression()
}

/// Parses the limit of a step bound, as in `F<=10 "goal"`. Because a state formula follows
/// directly, the limit is a number, a name, or an expression in parentheses.
fn number_of_steps(cursor: &mut Cursor<'_>) -> Read<Expr> {
    let place = cursor.place();
    match cursor.peek() {
        Kind::Number(text) if text.bytes().all(|byte| byte.is_ascii_digit()) => {
            let value = text.parse().map_err(|_| cursor.expected("a number of steps"))?;
            cursor.advance();
            Ok(Expr { kind: ExprKind::Int(value), place })
        }
        Kind::Name(_) => Ok(Expr { kind: ExprKind::Name(cursor.name("a number of steps")?.0), place }),
        Kind::Sign("(") => {
            cursor.advance();
            let inner = cursor.expression()?;
            cursor.need(")")?;
            Ok(inner)
        }
        _ => Err(cursor.expected("a number of steps")),
    }
}

/// Converts an expression to a path formula. Permits negations, a single temporal operator, and the
/// nested operators of [`nested`]. Returns an error for other LTL formulas.
fn path(formula: Expr) -> Read<Path> {
    let place = formula.place;
    if !has_temporal(&formula) {
        return Ok(Path::State(formula));
    }
    match formula.kind {
        ExprKind::Not(inner) => Ok(Path::Not(Box::new(path(*inner)?))),
        ExprKind::Temporal(temporal) => {
            let Temporal { letter, steps, left, right } = *temporal;
            if has_temporal(&left) || has_temporal(&right) {
                return nested(letter, steps.as_deref(), right, place);
            }
            Ok(match letter {
                'X' => Path::Next(right),
                'G' => Path::Globally(right, steps),
                'W' => Path::WeakUntil(left, right, steps),
                'R' => Path::Release(left, right, steps),
                _ => Path::Until(left, right, steps),
            })
        }
        _ => Err(ltl(place)),
    }
}

/// Converts nested unary operators: `G F`, `F G`, `F F` and `G G`. Other combinations are an error.
fn nested(letter: char, steps: Option<&Steps>, right: Expr, place: Place) -> Read<Path> {
    let ExprKind::Temporal(inner) = right.kind else { return Err(ltl(place)) };
    if steps.is_some() || inner.steps.is_some() || has_temporal(&inner.right) {
        return Err(ltl(place));
    }
    match (letter, inner.letter) {
        ('G', 'F') => Ok(Path::Repeatedly(inner.right)),
        ('F', 'G') => Ok(Path::Persistently(inner.right)),
        ('F', 'F') => Ok(Path::Until(Expr::bool(true), inner.right, None)),
        ('G', 'G') => Ok(Path::Globally(inner.right, None)),
        _ => Err(ltl(place)),
    }
}

fn ltl(place: Place) -> Diagnostic {
    let text = "LTL (temporal operators in one another, or joined) is not supported, except for `G F` and `F G`; \
                check one operator at a time";
    Diagnostic::new("Q403", place, text)
}

fn has_temporal(expression: &Expr) -> bool {
    match &expression.kind {
        ExprKind::Temporal(_) => true,
        ExprKind::Not(inner) | ExprKind::Negative(inner) => has_temporal(inner),
        ExprKind::Binary(_, left, right) => has_temporal(left) || has_temporal(right),
        ExprKind::If(condition, then, otherwise) => {
            [condition, then, otherwise].into_iter().any(|part| has_temporal(part))
        }
        ExprKind::Call(_, arguments) => arguments.iter().any(has_temporal),
        ExprKind::Bool(_)
        | ExprKind::Int(_)
        | ExprKind::Number(_)
        | ExprKind::Name(_)
        | ExprKind::Label(_)
        | ExprKind::Property(_) => false,
    }
}

fn reward_path(cursor: &mut Cursor<'_>) -> Read<RewardPath> {
    let place = cursor.place();
    if cursor.take_word("C") {
        let strict = cursor.is("<");
        if cursor.take("<=") || cursor.take("<") {
            return Ok(RewardPath::Steps(StepBound { limit: cursor.expression()?, strict }));
        }
        return Ok(RewardPath::Total);
    }
    if cursor.take_word("I") {
        cursor.need("=")?;
        return Ok(RewardPath::Instant(cursor.expression()?));
    }
    if cursor.take_word("S") {
        return Ok(RewardPath::LongRun);
    }
    let formula = cursor.expression()?;
    let formula = parse_infix(cursor, formula)?;
    match path(formula) {
        Ok(Path::Until(left, goal, None)) if left.kind == ExprKind::Bool(true) => Ok(RewardPath::Reach(goal)),
        _ => {
            let text =
                "of rewards, `F`, `C`, `C<=k`, `I=k` and `S` are handled, and no other operators of LTL";
            Err(Diagnostic::new("Q403", place, text))
        }
    }
}
