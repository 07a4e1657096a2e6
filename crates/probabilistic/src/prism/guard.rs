//! Guards of commands and reward items: conjunctions, split into fast tests of single variables and
//! other conjuncts.

use crate::prism::ast::{BinaryOp, Type};
use crate::prism::code::{Code, Fault};

#[derive(Debug, Clone)]
pub struct Guard {
    /// The leading conjuncts that test whether a single variable is inside or outside of a range. Evaluating
    /// them cannot fail.
    tests: Vec<Test>,
    /// The conjuncts after the tests, in the order of the text. A false conjunct prevents the evaluation of later
    /// conjuncts, which might fail.
    remainder: Vec<Code>,
    fixed: Vec<(u32, i64)>,
}

#[derive(Debug, Clone, Copy)]
struct Test {
    variable: u32,
    least: i64,
    greatest: i64,
    inside: bool,
}

impl Guard {
    pub fn new(code: Code) -> Self {
        let mut parts = Vec::new();
        flatten(code, &mut parts);
        let tests: Vec<Test> = parts.iter().map_while(test).collect();
        let fixed = parts.iter().filter_map(test).filter(|test| test.inside && test.least == test.greatest);
        let fixed = fixed.map(|test| (test.variable, test.least)).collect();
        Self { remainder: parts.split_off(tests.len()), tests, fixed }
    }

    /// Returns the variables that a conjunct `variable = value` or `!variable` fixes: variable index and value.
    pub fn fixed(&self) -> &[(u32, i64)] {
        &self.fixed
    }

    pub fn each_variable(&self, visit: &mut impl FnMut(u32)) {
        self.tests.iter().for_each(|test| visit(test.variable));
        self.remainder.iter().for_each(|part| part.each_variable(visit));
    }

    /// Returns `true` if all conjuncts hold. Fails if a conjunct cannot be evaluated, unless an earlier one is
    /// false.
    pub fn holds(&self, values: &[i64]) -> Result<bool, Fault> {
        for test in &self.tests {
            let value = values[test.variable as usize];
            if (test.least..=test.greatest).contains(&value) != test.inside {
                return Ok(false);
            }
        }
        for part in &self.remainder {
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
        conjunct => parts.push(conjunct),
    }
}

fn test(code: &Code) -> Option<Test> {
    // A Boolean variable holds if it is not 0.
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

fn mirrored(op: BinaryOp) -> BinaryOp {
    match op {
        BinaryOp::Less => BinaryOp::Greater,
        BinaryOp::LessEqual => BinaryOp::GreaterEqual,
        BinaryOp::Greater => BinaryOp::Less,
        BinaryOp::GreaterEqual => BinaryOp::LessEqual,
        symmetric => symmetric,
    }
}
