//! Tasks as data: typed predicates and functions, actions with and without duration, exact numbers.
//!
//! Only what generator B needs: no derived predicates, no timed initial literals, no quantifiers. What a task means is said in
//! `ground` and `step`; how it reads in `print`.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{One as _, Zero as _};

/// An exact number.
pub type Number = BigRational;

/// A whole number.
pub fn whole(value: i64) -> Number {
    Number::from_integer(BigInt::from(value))
}

/// The value of a decimal such as `-0.25`.
pub fn decimal(text: &str) -> Number {
    let (negative, digits) = text.strip_prefix('-').map_or((false, text), |rest| (true, rest));
    let (before, after) = digits.split_once('.').unwrap_or((digits, ""));
    let all: BigInt = format!("{before}{after}").parse().expect("digits");
    let value = Number::new(all, power_of_ten(after.len()));
    if negative { -value } else { value }
}

/// 10 to the power of `exponent`.
pub fn power_of_ten(exponent: usize) -> BigInt {
    BigInt::from(10).pow(u32::try_from(exponent).expect("a small exponent"))
}

/// A number as a decimal, if it has one.
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
    let (before, after) = padded.split_at(padded.len() - digits);
    Some(if digits == 0 { format!("{sign}{before}") } else { format!("{sign}{before}.{after}") })
}

/// An argument: a parameter of the action, or an object, by position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Term {
    Parameter(usize),
    Object(usize),
}

/// A predicate or a function with its arguments.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Applied {
    pub symbol: usize,
    pub arguments: Vec<Term>,
}

/// A predicate or function with arguments.
pub fn applied(symbol: usize, arguments: &[Term]) -> Applied {
    Applied { symbol, arguments: arguments.to_vec() }
}

/// An arithmetic expression.
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

/// How two numbers compare.
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

    /// Whether it holds.
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

/// What must hold.
#[derive(Debug, Clone, PartialEq)]
pub enum Condition {
    Holds(Applied),
    Not(Box<Condition>),
    Any(Vec<Condition>),
    Same(Term, Term),
    Compare(Relation, Expr, Expr),
    /// A comparison whose right side is to be chosen from values that occur: the number of the threshold.
    Open(Relation, Expr, usize),
}

/// How a number changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    Assign,
    Increase,
    Decrease,
    ScaleUp,
    ScaleDown,
}

/// What an action does.
#[derive(Debug, Clone, PartialEq)]
pub enum Effect {
    Add(Applied),
    Delete(Applied),
    Number(Change, Applied, Expr),
    When(Vec<Condition>, Vec<Effect>),
}

/// Conditions and effects of one time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Happening {
    pub conditions: Vec<Condition>,
    pub effects: Vec<Effect>,
}

/// What a durative action has besides its start.
#[derive(Debug, Clone, PartialEq)]
pub struct Lasting {
    pub duration: Expr,
    pub over_all: Vec<Condition>,
    pub end: Happening,
}

/// An action schema; classical if it does not last.
#[derive(Debug, Clone, PartialEq)]
pub struct Action {
    pub name: String,
    /// Names and types.
    pub parameters: Vec<(String, usize)>,
    pub start: Happening,
    pub lasting: Option<Lasting>,
}

/// A predicate's or function's name and the types of its parameters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Symbol {
    pub name: String,
    pub types: Vec<usize>,
}

/// A domain and a problem.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Task {
    pub types: Vec<String>,
    /// Names and types.
    pub objects: Vec<(String, usize)>,
    pub predicates: Vec<Symbol>,
    pub functions: Vec<Symbol>,
    pub actions: Vec<Action>,
    pub atoms: Vec<(usize, Vec<usize>)>,
    pub values: Vec<(usize, Vec<usize>, Number)>,
    pub goal: Vec<Condition>,
    /// Whether it is to be maximised, and what.
    pub metric: Option<(bool, Expr)>,
}

impl Task {
    /// The objects of a type.
    pub fn of_type(&self, kind: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.objects.len()).filter(move |object| self.objects[*object].1 == kind)
    }

    /// Whether any action lasts.
    pub fn is_timed(&self) -> bool {
        self.actions.iter().any(|action| action.lasting.is_some())
    }

    /// Declares a predicate.
    pub fn predicate(&mut self, name: &str, types: &[usize]) -> usize {
        self.predicates.push(Symbol { name: name.to_owned(), types: types.to_vec() });
        self.predicates.len() - 1
    }

    /// Declares a function.
    pub fn function(&mut self, name: &str, types: &[usize]) -> usize {
        self.functions.push(Symbol { name: name.to_owned(), types: types.to_vec() });
        self.functions.len() - 1
    }

    /// Declares an object.
    pub fn object(&mut self, name: String, kind: usize) -> usize {
        self.objects.push((name, kind));
        self.objects.len() - 1
    }

    /// Which predicates, and which functions, actions change.
    pub fn changing(&self) -> (Vec<bool>, Vec<bool>) {
        let mut changing = (vec![false; self.predicates.len()], vec![false; self.functions.len()]);
        for action in &self.actions {
            note_changes(&action.start.effects, &mut changing);
            if let Some(lasting) = &action.lasting {
                note_changes(&lasting.end.effects, &mut changing);
            }
        }
        changing
    }
}

fn note_changes(effects: &[Effect], changing: &mut (Vec<bool>, Vec<bool>)) {
    for effect in effects {
        match effect {
            Effect::Add(atom) | Effect::Delete(atom) => changing.0[atom.symbol] = true,
            Effect::Number(_, function, _) => changing.1[function.symbol] = true,
            Effect::When(_, inner) => note_changes(inner, changing),
        }
    }
}

#[test]
fn numbers_read_and_print() {
    for text in ["0", "-5", "0.25", "-0.0000000000000001", "0.9389281746152837", "1000000000000000000"] {
        assert_eq!(text_of(&decimal(text)).as_deref(), Some(text));
    }
    assert_eq!(text_of(&(whole(1) / whole(3))), None);
}
