//! Typed expressions with resolved names, and their evaluation.
//!
//! Arithmetic is exact, so that `1 - 0.7 - 0.3` is zero even if the model is solved in doubles.
//! Approximated by doubles are logarithms that are not integers, irrational powers, and logarithms and powers
//! beyond size limits.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{Signed, ToPrimitive, Zero};

use crate::number::Number;
use crate::prism::ast::{BinaryOp, Function, Type};

/// A compiled expression over the values of the variables. Truth values are represented as 0 and 1.
#[derive(Debug, Clone)]
pub enum Code {
    /// An integer or a truth value.
    Whole(i64),
    Number(BigRational),
    Variable(u32),
    Not(Box<Self>),
    /// `-`: unary minus, with the type of the result.
    Negative(Box<Self>, Type),
    All(Vec<Self>),
    Any(Vec<Self>),
    Iff(Box<Self>, Box<Self>),
    /// A comparison of two operands, with their common type.
    Compare(BinaryOp, Type, Box<Self>, Box<Self>),
    /// An arithmetic operation, with the type of its result.
    Arithmetic(BinaryOp, Type, Box<Self>, Box<Self>),
    If(Box<Self>, Box<Self>, Box<Self>),
    /// A function call, with the type of its result.
    Call(Function, Type, Vec<Self>),
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault(pub &'static str);

type Result<T> = std::result::Result<T, Fault>;

/// Upper limit in bits on the total size of both operands of an arithmetic operation, and on the estimated
/// size of a power that is computed exactly.
const MAX_OPERAND_BITS: u64 = 100_000;

/// Upper limit on the degree of a root that is computed exactly.
const MAX_ROOT: u32 = 1000;

const OVERFLOW: Fault = Fault("an integer exceeds its range");

impl Code {
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

    /// Evaluates a numeric expression. The result is exact, except for the logarithms and powers listed in the
    /// head of this file.
    pub fn number(&self, values: &[i64]) -> Result<BigRational> {
        Ok(match self {
            Self::Number(value) => value.clone(),
            Self::Negative(inner, Type::Double) => -inner.number(values)?,
            Self::Arithmetic(op, Type::Double, left, right) => {
                let (left, right) = (left.number(values)?, right.number(values)?);
                if left.size().saturating_add(right.size()) > MAX_OPERAND_BITS {
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

    /// Returns the index of the greatest variable in the expression plus one, or 0 without a variable.
    pub fn variables_below(&self) -> u32 {
        let mut below = 0;
        self.each_variable(&mut |variable| below = below.max(variable.saturating_add(1)));
        below
    }

    pub fn is_constant(&self) -> bool {
        self.variables_below() == 0
    }

    /// Calls `visit` with each occurrence of a variable; a variable that occurs twice is visited twice.
    pub fn each_variable(&self, visit: &mut impl FnMut(u32)) {
        match self {
            Self::Whole(_) | Self::Number(_) => {}
            Self::Variable(variable) => visit(*variable),
            Self::Not(inner) | Self::Negative(inner, _) => inner.each_variable(visit),
            Self::All(parts) | Self::Any(parts) | Self::Call(_, _, parts) => {
                for part in parts {
                    part.each_variable(visit);
                }
            }
            Self::Iff(left, right)
            | Self::Compare(_, _, left, right)
            | Self::Arithmetic(_, _, left, right) => {
                left.each_variable(visit);
                right.each_variable(visit);
            }
            Self::If(condition, then, otherwise) => {
                for part in [condition, then, otherwise] {
                    part.each_variable(visit);
                }
            }
        }
    }
}

pub fn from_whole(value: i64) -> BigRational {
    BigRational::from(BigInt::from(value))
}

/// Converts a probability or reward to the number type of the solver. For doubles, fails if a value
/// other than 0 has a magnitude outside 10^-250 to 10^250.
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
                // Halves are rounded up, as in PRISM.
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
                Some(whole)
                    if base.size().saturating_mul(whole.unsigned_abs().into()) <= MAX_OPERAND_BITS =>
                {
                    Ok(base.pow(whole))
                }
                // Irrational powers and powers beyond the size limit are approximated in doubles.
                _ if let Some(power) = rational_power(&base, &exponent) => Ok(power),
                _ => irrational(Number::to_f64(&base).powf(Number::to_f64(&exponent))),
            }
        }
        Function::Log => {
            let (argument, base) = (number(0)?, number(1)?);
            let approximation = Number::to_f64(&argument).log(Number::to_f64(&base));
            whole_logarithm(&argument, &base, approximation)
                .map_or_else(|| irrational(approximation), |exact| Ok(BigRational::from(BigInt::from(exact))))
        }
        Function::Floor | Function::Ceil | Function::Round | Function::Mod => {
            whole_call(function, arguments, values).map(from_whole)
        }
    }
}

/// Returns a power with a positive base and a fraction as its exponent, if the power is rational. Returns `None` for
/// other powers, and for operands beyond the size limits.
fn rational_power(base: &BigRational, exponent: &BigRational) -> Option<BigRational> {
    let degree = exponent.denom().to_u32().filter(|degree| *degree <= MAX_ROOT)?;
    if !base.is_positive() || base.size() > MAX_OPERAND_BITS {
        return None;
    }
    let root = BigRational::new_raw(base.numer().nth_root(degree), base.denom().nth_root(degree));
    let times = exponent.numer().to_i32()?;
    let is_small = root.size().saturating_mul(times.unsigned_abs().into()) <= MAX_OPERAND_BITS;
    (is_small && root.pow(degree.to_i32()?) == *base).then(|| root.pow(times))
}

/// Returns the logarithm of `argument` to `base` if it is an integer. Otherwise, and for operands beyond the size
/// limit, returns `None`.
fn whole_logarithm(argument: &BigRational, base: &BigRational, approximation: f64) -> Option<i32> {
    let whole = approximation.round().to_i32()?;
    let is_small =
        base.is_positive() && base.size().saturating_mul(whole.unsigned_abs().into()) <= MAX_OPERAND_BITS;
    (is_small && base.pow(whole) == *argument).then_some(whole)
}

fn irrational(value: f64) -> Result<BigRational> {
    BigRational::from_float(value).ok_or(Fault("a number that is not finite"))
}
