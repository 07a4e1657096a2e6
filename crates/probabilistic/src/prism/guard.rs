//! A condition to tests of single variables, which are quick, and the rest.

use crate::prism::ast::{BinaryOp, Type};
use crate::prism::code::{Code, Fault};

/// A condition.
#[derive(Debug, Clone)]
pub struct Guard {
    /// What it begins with; these cannot fail to have a value, and are evaluated in the order in which they stand.
    tests: Vec<Test>,
    /// What comes after them.
    rest: Vec<Code>,
    /// The variables that it fixes to one value, anywhere in it.
    fixed: Vec<(u32, i64)>,
}

/// A variable lies in a range, or outside of it.
#[derive(Debug, Clone, Copy)]
struct Test {
    variable: u32,
    least: i64,
    greatest: i64,
    inside: bool,
}

impl Guard {
    /// Takes a condition to pieces.
    pub fn new(code: Code) -> Self {
        let mut parts = Vec::new();
        flatten(code, &mut parts);
        let tests: Vec<Test> = parts.iter().map_while(test).collect();
        let fixed = parts.iter().filter_map(test).filter(|test| test.inside && test.least == test.greatest);
        let fixed = fixed.map(|test| (test.variable, test.least)).collect();
        Self { rest: parts.split_off(tests.len()), tests, fixed }
    }

    /// The variables that it fixes to one value.
    pub fn fixed(&self) -> &[(u32, i64)] {
        &self.fixed
    }

    /// Tells all variables that occur in it.
    pub fn each_variable(&self, tell: &mut impl FnMut(u32)) {
        self.tests.iter().for_each(|test| tell(test.variable));
        self.rest.iter().for_each(|part| part.each_variable(tell));
    }

    /// Whether it holds.
    pub fn holds(&self, values: &[i64]) -> Result<bool, Fault> {
        for test in &self.tests {
            let value = values[test.variable as usize];
            if (test.least..=test.greatest).contains(&value) != test.inside {
                return Ok(false);
            }
        }
        for part in &self.rest {
            if !part.holds(values)? {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

fn flatten(code: Code, parts: &mut Vec<Code>) {
    match code {
        Code::All(inner) => inner.into_iter().for_each(|part| flatten(part, parts)),
        other => parts.push(other),
    }
}

fn test(code: &Code) -> Option<Test> {
    let flag = |variable: u32, inside| Test { variable, least: 0, greatest: 0, inside };
    match code {
        Code::Variable(variable) => Some(flag(*variable, false)),
        Code::Not(inner) => test(inner).map(|test| Test { inside: !test.inside, ..test }),
        Code::Compare(op, Type::Int, left, right) => match (&**left, &**right) {
            (Code::Variable(variable), Code::Whole(value)) => Some(compared(*variable, *op, *value)),
            (Code::Whole(value), Code::Variable(variable)) => {
                Some(compared(*variable, mirrored(*op), *value))
            }
            _ => None,
        },
        _ => None,
    }
}

fn compared(variable: u32, op: BinaryOp, value: i64) -> Test {
    let range = |least, greatest, inside| Test { variable, least, greatest, inside };
    match op {
        BinaryOp::Equal => range(value, value, true),
        BinaryOp::NotEqual => range(value, value, false),
        BinaryOp::Less => range(value, i64::MAX, false),
        BinaryOp::LessEqual => range(i64::MIN, value, true),
        BinaryOp::Greater => range(i64::MIN, value, false),
        _ => range(value, i64::MAX, true),
    }
}

/// The comparison with its sides exchanged.
fn mirrored(op: BinaryOp) -> BinaryOp {
    match op {
        BinaryOp::Less => BinaryOp::Greater,
        BinaryOp::LessEqual => BinaryOp::GreaterEqual,
        BinaryOp::Greater => BinaryOp::Less,
        BinaryOp::GreaterEqual => BinaryOp::LessEqual,
        other => other,
    }
}
