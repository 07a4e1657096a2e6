//! Expressions with names resolved and types known, and their evaluation: exact, so that `1 - 0.7 - 0.3` is zero whatever
//! kind of number the model is solved in.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{ToPrimitive, Zero};

use crate::number::Number;
use crate::prism::ast::{BinaryOp, Function, Type};

/// An expression over the values of the variables; truth values are 0 and 1.
#[derive(Debug, Clone)]
pub enum Code {
    /// A whole number or a truth value.
    Whole(i64),
    /// Any other number.
    Number(BigRational),
    /// A variable.
    Variable(u32),
    /// `!`.
    Not(Box<Self>),
    /// `-`.
    Negative(Box<Self>, Type),
    /// All of them hold.
    All(Vec<Self>),
    /// One of them holds.
    Any(Vec<Self>),
    /// Both hold or neither does.
    Iff(Box<Self>, Box<Self>),
    /// A comparison; the type is that of both sides together.
    Compare(BinaryOp, Type, Box<Self>, Box<Self>),
    /// Arithmetic; the type is that of the result.
    Arithmetic(BinaryOp, Type, Box<Self>, Box<Self>),
    /// `condition ? then : otherwise`.
    If(Box<Self>, Box<Self>, Box<Self>),
    /// A function; the type is that of the result.
    Call(Function, Type, Vec<Self>),
}

/// An evaluation that has no result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault(pub &'static str);

type Result<T> = std::result::Result<T, Fault>;

/// Bits that the operands of an operation may have together.
const BITS: u64 = 100_000;

const OVERFLOW: Fault = Fault("an integer grows out of its range");

impl Code {
    /// Its truth value.
    pub fn holds(&self, values: &[i64]) -> Result<bool> {
        Ok(match self {
            Self::Whole(value) => *value != 0,
            Self::Variable(variable) => values[*variable as usize] != 0,
            Self::Not(inner) => !inner.holds(values)?,
            Self::All(parts) => {
                for part in parts {
                    if !part.holds(values)? {
                        return Ok(false);
                    }
                }
                true
            }
            Self::Any(parts) => {
                for part in parts {
                    if part.holds(values)? {
                        return Ok(true);
                    }
                }
                false
            }
            Self::Iff(left, right) => left.holds(values)? == right.holds(values)?,
            Self::Compare(op, Type::Double, left, right) => {
                compare(*op, left.number(values)?.partial_cmp(&right.number(values)?))
            }
            Self::Compare(op, _, left, right) => {
                compare(*op, Some(left.whole(values)?.cmp(&right.whole(values)?)))
            }
            Self::If(condition, then, otherwise) => {
                if condition.holds(values)? {
                    then.holds(values)?
                } else {
                    otherwise.holds(values)?
                }
            }
            _ => self.whole(values)? != 0,
        })
    }

    /// Its value, for whole numbers and truth values.
    pub fn whole(&self, values: &[i64]) -> Result<i64> {
        Ok(match self {
            Self::Whole(value) => *value,
            Self::Variable(variable) => values[*variable as usize],
            Self::Negative(inner, _) => inner.whole(values)?.checked_neg().ok_or(OVERFLOW)?,
            Self::Arithmetic(op, _, left, right) => {
                let (left, right) = (left.whole(values)?, right.whole(values)?);
                let result = match op {
                    BinaryOp::Plus => left.checked_add(right),
                    BinaryOp::Minus => left.checked_sub(right),
                    _ => left.checked_mul(right),
                };
                result.ok_or(OVERFLOW)?
            }
            Self::If(condition, then, otherwise) => {
                if condition.holds(values)? {
                    then.whole(values)?
                } else {
                    otherwise.whole(values)?
                }
            }
            Self::Call(function, _, arguments) => whole_call(*function, arguments, values)?,
            Self::Number(_) => return Err(Fault("a whole number is needed here")),
            _ => i64::from(self.holds(values)?),
        })
    }

    /// Its value as a number, exactly.
    pub fn number(&self, values: &[i64]) -> Result<BigRational> {
        Ok(match self {
            Self::Number(value) => value.clone(),
            Self::Negative(inner, Type::Double) => -inner.number(values)?,
            Self::Arithmetic(op, Type::Double, left, right) => {
                let (left, right) = (left.number(values)?, right.number(values)?);
                if left.size().saturating_add(right.size()) > BITS {
                    return Err(Fault("a number with too many digits"));
                }
                match op {
                    BinaryOp::Plus => left + right,
                    BinaryOp::Minus => left - right,
                    BinaryOp::Times => left * right,
                    _ if Zero::is_zero(&right) => return Err(Fault("a division by zero")),
                    _ => left / right,
                }
            }
            Self::If(condition, then, otherwise) => {
                if condition.holds(values)? {
                    then.number(values)?
                } else {
                    otherwise.number(values)?
                }
            }
            Self::Call(function, Type::Double, arguments) => number_call(*function, arguments, values)?,
            _ => from_whole(self.whole(values)?),
        })
    }

    /// The least number that is above all of its variables.
    pub fn variables_below(&self) -> u32 {
        let mut below = 0;
        self.each_variable(&mut |variable| below = below.max(variable.saturating_add(1)));
        below
    }

    /// Whether no variable occurs in it.
    pub fn is_constant(&self) -> bool {
        self.variables_below() == 0
    }

    /// Tells all variables that occur in it, some of them more than once.
    pub fn each_variable(&self, tell: &mut impl FnMut(u32)) {
        match self {
            Self::Whole(_) | Self::Number(_) => {}
            Self::Variable(variable) => tell(*variable),
            Self::Not(inner) | Self::Negative(inner, _) => inner.each_variable(tell),
            Self::All(parts) | Self::Any(parts) | Self::Call(_, _, parts) => {
                for part in parts {
                    part.each_variable(tell);
                }
            }
            Self::Iff(left, right)
            | Self::Compare(_, _, left, right)
            | Self::Arithmetic(_, _, left, right) => {
                left.each_variable(tell);
                right.each_variable(tell);
            }
            Self::If(condition, then, otherwise) => {
                for part in [condition, then, otherwise] {
                    part.each_variable(tell);
                }
            }
        }
    }
}

/// A whole number as a number.
pub fn from_whole(value: i64) -> BigRational {
    BigRational::from(BigInt::from(value))
}

/// A probability or a reward in the kind of number that is solved in.
pub fn rounded<N: Number>(value: &BigRational) -> Result<N> {
    crate::number::rounded(value).ok_or(Fault("a number that is too large or too small for doubles"))
}

fn compare(op: BinaryOp, order: Option<std::cmp::Ordering>) -> bool {
    let Some(order) = order else { return false };
    match op {
        BinaryOp::Equal => order.is_eq(),
        BinaryOp::NotEqual => order.is_ne(),
        BinaryOp::Less => order.is_lt(),
        BinaryOp::LessEqual => order.is_le(),
        BinaryOp::Greater => order.is_gt(),
        _ => order.is_ge(),
    }
}

fn whole_call(function: Function, arguments: &[Code], values: &[i64]) -> Result<i64> {
    let whole = |at: usize| arguments[at].whole(values);
    match function {
        Function::Min | Function::Max => {
            let mut best = whole(0)?;
            for at in 1..arguments.len() {
                let value = whole(at)?;
                best = if function == Function::Min { best.min(value) } else { best.max(value) };
            }
            Ok(best)
        }
        Function::Mod => {
            let (left, right) = (whole(0)?, whole(1)?);
            if right <= 0 {
                Err(Fault("`mod` by a number that is not positive"))
            } else {
                Ok(left.rem_euclid(right))
            }
        }
        Function::Pow => {
            let (base, exponent) = (whole(0)?, whole(1)?);
            if exponent < 0 {
                return Err(Fault("a negative power of an integer"));
            }
            match (base, u32::try_from(exponent)) {
                (0 | 1, _) if exponent > 0 => Ok(base),
                (-1, _) => Ok(if exponent % 2 == 0 { 1 } else { -1 }),
                (_, Ok(exponent)) => base.checked_pow(exponent).ok_or(OVERFLOW),
                (_, Err(_)) => Err(OVERFLOW),
            }
        }
        Function::Floor | Function::Ceil | Function::Round => {
            let value = arguments[0].number(values)?;
            let rounded = match function {
                Function::Floor => value.floor(),
                Function::Ceil => value.ceil(),
                _ => (value + half()).floor(),
            };
            rounded.to_i64().ok_or(OVERFLOW)
        }
        Function::Log => Err(Fault("a whole number is needed here")),
    }
}

fn half() -> BigRational {
    BigRational::new(BigInt::from(1), BigInt::from(2))
}

fn number_call(function: Function, arguments: &[Code], values: &[i64]) -> Result<BigRational> {
    let number = |at: usize| arguments[at].number(values);
    match function {
        Function::Min | Function::Max => {
            let mut best = number(0)?;
            for at in 1..arguments.len() {
                let value = number(at)?;
                if (value < best) == (function == Function::Min) && value != best {
                    best = value;
                }
            }
            Ok(best)
        }
        Function::Pow => {
            let (base, exponent) = (number(0)?, number(1)?);
            let whole = exponent.is_integer().then(|| exponent.to_i32()).flatten();
            match whole {
                Some(whole) if whole < 0 && Zero::is_zero(&base) => Err(Fault("a division by zero")),
                Some(whole) if base.size().saturating_mul(whole.unsigned_abs().into()) <= BITS => {
                    Ok(base.pow(whole))
                }
                _ => irrational(Number::to_f64(&base).powf(Number::to_f64(&exponent))),
            }
        }
        Function::Log => irrational(Number::to_f64(&number(0)?).log(Number::to_f64(&number(1)?))),
        Function::Floor | Function::Ceil | Function::Round | Function::Mod => {
            whole_call(function, arguments, values).map(from_whole)
        }
    }
}

/// The double nearest to a number that is not rational.
fn irrational(value: f64) -> Result<BigRational> {
    BigRational::from_float(value).ok_or(Fault("a number that is not finite"))
}
