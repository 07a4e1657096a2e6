//! Tasks as data: typed predicates and functions, actions with and without duration, exact numbers.
//!
//! The model is restricted to the needs of generator B: no derived predicates, no timed initial literals, no
//! quantifiers. The modules `ground` and `step` define the semantics, and `print` defines the syntax.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{One as _, Zero as _};

pub type Number = BigRational;

pub fn whole(value: i64) -> Number {
    Number::from_integer(BigInt::from(value))
}

pub fn decimal(text: &str) -> Number {
    let (negative, digits) = text.strip_prefix('-').map_or((false, text), |unsigned| (true, unsigned));
    let (whole_digits, fraction_digits) = digits.split_once('.').unwrap_or((digits, ""));
    let scaled: BigInt = format!("{whole_digits}{fraction_digits}").parse().expect("digits");
    let value = Number::new(scaled, power_of_ten(fraction_digits.len()));
    if negative { -value } else { value }
}

pub fn power_of_ten(exponent: usize) -> BigInt {
    BigInt::from(10).pow(u32::try_from(exponent).expect("a small exponent"))
}

/// Formats a number as a decimal. Returns `None` if the number has more than 200 digits after the point.
pub fn text_of(value: &Number) -> Option<String> {
    let (mut digits, mut power) = (0, BigInt::one());
    while !(&power % value.denom()).is_zero() {
        digits += 1;
        power *= 10;
        if digits > 200 {
            return None;
        }
    }
    let scaled = value.numer() * (&power / value.denom());
    let sign = if scaled < BigInt::zero() { "-" } else { "" };
    let plain = scaled.magnitude().to_string();
    let padded = format!("{plain:0>width$}", width = digits + 1);
    let (whole_digits, fraction_digits) = padded.split_at(padded.len() - digits);
    Some(if digits == 0 {
        format!("{sign}{whole_digits}")
    } else {
        format!("{sign}{whole_digits}.{fraction_digits}")
    })
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Term {
    Parameter(usize),
    Object(usize),
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Applied {
    pub symbol: usize,
    pub arguments: Vec<Term>,
}

pub fn applied(symbol: usize, arguments: &[Term]) -> Applied {
    Applied { symbol, arguments: arguments.to_vec() }
}

#[derive(Debug, Clone, PartialEq)]
pub enum Expr {
    Number(Number),
    Function(Applied),
    Sum(Vec<Expr>),
    Minus(Box<Expr>, Box<Expr>),
    Negative(Box<Expr>),
    Product(Vec<Expr>),
    Quotient(Box<Expr>, Box<Expr>),
    /// `total-time`, in metrics only.
    TotalTime,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Relation {
    Less,
    AtMost,
    Equal,
    AtLeast,
    Greater,
}

impl Relation {
    pub const ALL: [Self; 5] = [Self::Less, Self::AtMost, Self::Equal, Self::AtLeast, Self::Greater];

    pub fn holds(self, left: &Number, right: &Number) -> bool {
        match self {
            Self::Less => left < right,
            Self::AtMost => left <= right,
            Self::Equal => left == right,
            Self::AtLeast => left >= right,
            Self::Greater => left > right,
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub enum Condition {
    Holds(Applied),
    Not(Box<Condition>),
    Any(Vec<Condition>),
    Same(Term, Term),
    Compare(Relation, Expr, Expr),
    /// A comparison with an open threshold. The last field is the number of the threshold, whose value
    /// [`super::tune`] chooses.
    Open(Relation, Expr, usize),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    Assign,
    Increase,
    Decrease,
    ScaleUp,
    ScaleDown,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Effect {
    Add(Applied),
    Delete(Applied),
    Number(Change, Applied, Expr),
    When(Vec<Condition>, Vec<Effect>),
}

#[derive(Debug, Clone, PartialEq, Default)]
pub struct Happening {
    pub conditions: Vec<Condition>,
    pub effects: Vec<Effect>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Lasting {
    pub duration: Expr,
    pub over_all: Vec<Condition>,
    pub end: Happening,
}

/// Instantaneous if `lasting` is `None`.
#[derive(Debug, Clone, PartialEq)]
pub struct Action {
    pub name: String,
    /// Names and types of the parameters.
    pub parameters: Vec<(String, usize)>,
    pub start: Happening,
    pub lasting: Option<Lasting>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Symbol {
    pub name: String,
    pub types: Vec<usize>,
}

#[derive(Debug, Clone, PartialEq, Default)]
pub struct Task {
    pub types: Vec<String>,
    /// Names and types of the objects.
    pub objects: Vec<(String, usize)>,
    pub predicates: Vec<Symbol>,
    pub functions: Vec<Symbol>,
    pub actions: Vec<Action>,
    pub atoms: Vec<(usize, Vec<usize>)>,
    pub values: Vec<(usize, Vec<usize>, Number)>,
    pub goal: Vec<Condition>,
    /// The metric: `true` for maximisation, and the expression.
    pub metric: Option<(bool, Expr)>,
}

impl Task {
    pub fn of_type(&self, kind: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.objects.len()).filter(move |object| self.objects[*object].1 == kind)
    }

    pub fn is_timed(&self) -> bool {
        self.actions.iter().any(|action| action.lasting.is_some())
    }

    pub fn predicate(&mut self, name: &str, types: &[usize]) -> usize {
        self.predicates.push(Symbol { name: name.to_owned(), types: types.to_vec() });
        self.predicates.len() - 1
    }

    pub fn function(&mut self, name: &str, types: &[usize]) -> usize {
        self.functions.push(Symbol { name: name.to_owned(), types: types.to_vec() });
        self.functions.len() - 1
    }

    pub fn object(&mut self, name: String, kind: usize) -> usize {
        self.objects.push((name, kind));
        self.objects.len() - 1
    }

    /// Returns for each predicate and for each function whether an action changes it.
    pub fn changing(&self) -> (Vec<bool>, Vec<bool>) {
        let mut changing = (vec![false; self.predicates.len()], vec![false; self.functions.len()]);
        for action in &self.actions {
            mark_changes(&action.start.effects, &mut changing);
            if let Some(lasting) = &action.lasting {
                mark_changes(&lasting.end.effects, &mut changing);
            }
        }
        changing
    }
}

fn mark_changes(effects: &[Effect], changing: &mut (Vec<bool>, Vec<bool>)) {
    for effect in effects {
        match effect {
            Effect::Add(atom) | Effect::Delete(atom) => changing.0[atom.symbol] = true,
            Effect::Number(_, function, _) => changing.1[function.symbol] = true,
            Effect::When(_, inner) => mark_changes(inner, changing),
        }
    }
}

#[test]
fn decimals_round_trip_through_text() {
    for text in ["0", "-5", "0.25", "-0.0000000000000001", "0.9389281746152837", "1000000000000000000"] {
        assert_eq!(text_of(&decimal(text)).as_deref(), Some(text));
    }
    assert_eq!(text_of(&(whole(1) / whole(3))), None);
}
