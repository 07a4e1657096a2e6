//! Checks names and types of a property before the model is explored.

use crate::check::state::with_placeholders;
use crate::error::{Diagnostic, Error};
use crate::number::Number;
use crate::prism::ast::{Expr, ExprKind, Path, Property, Question, RewardPath, Steps, Type};
use crate::prism::{Names, Program};

struct Validation {
    names: Names,
    problems: Vec<Diagnostic>,
}

/// Checks the names (except those of reward structures) and types in a property. Returns the first
/// error of each expression.
pub fn validate<N: Number>(program: &Program<N>, property: &Property) -> Result<(), Error> {
    let mut validation = Validation { names: program.names.clone(), problems: Vec::new() };
    validation.property(property);
    if validation.problems.is_empty() { Ok(()) } else { Err(Error::Property(validation.problems.into())) }
}

/// Appends the properties nested in an expression to `nested`; does not descend into them.
pub fn properties_in<'a>(expression: &'a Expr, nested: &mut Vec<&'a Property>) {
    match &expression.kind {
        ExprKind::Property(property) => nested.push(property),
        ExprKind::Not(inner) | ExprKind::Negative(inner) => properties_in(inner, nested),
        ExprKind::Binary(_, left, right) => {
            properties_in(left, nested);
            properties_in(right, nested);
        }
        ExprKind::If(condition, then, otherwise) => {
            for part in [condition, then, otherwise] {
                properties_in(part, nested);
            }
        }
        ExprKind::Call(_, arguments) => {
            for argument in arguments {
                properties_in(argument, nested);
            }
        }
        _ => {}
    }
}

pub fn expressions_of(property: &Property) -> Vec<&Expr> {
    match property {
        Property::Probability(_, path) => of_path(path),
        Property::Reward(_, _, RewardPath::Reach(goal)) => vec![goal],
        Property::SteadyState(_, states) => vec![states],
        Property::Filter(_, inner, states) => std::iter::once(inner).chain(states).collect(),
        Property::Expression(inner) => vec![inner],
        Property::Reward(..) | Property::Multi(_) | Property::Refused(_) => Vec::new(),
    }
}

fn of_path(path: &Path) -> Vec<&Expr> {
    match path {
        Path::Not(inner) => of_path(inner),
        Path::State(goal)
        | Path::Next(goal)
        | Path::Globally(goal, _)
        | Path::Repeatedly(goal)
        | Path::Persistently(goal) => vec![goal],
        Path::Until(left, right, _) | Path::WeakUntil(left, right, _) | Path::Release(left, right, _) => {
            vec![left, right]
        }
    }
}

pub fn steps_of(path: &Path) -> Option<&Steps> {
    match path {
        Path::Not(inner) => steps_of(inner),
        Path::Globally(_, steps)
        | Path::Until(_, _, steps)
        | Path::WeakUntil(_, _, steps)
        | Path::Release(_, _, steps) => steps.as_deref(),
        _ => None,
    }
}

impl Validation {
    fn property(&mut self, property: &Property) {
        match property {
            Property::Multi(parts) => {
                for part in parts {
                    self.property(part);
                }
            }
            Property::Probability(question, path) => {
                for states in of_path(path) {
                    self.typed(states, Type::Bool);
                }
                self.bound(question);
                let steps = steps_of(path);
                let kind =
                    if steps.is_some_and(|steps| steps.reward.is_some()) { Type::Double } else { Type::Int };
                let bounds = steps.into_iter().flat_map(|steps| steps.least.iter().chain(&steps.most));
                for bound in bounds {
                    self.typed(&bound.limit, kind);
                }
            }
            Property::Reward(question, _, path) => {
                match path {
                    RewardPath::Reach(goal) => self.typed(goal, Type::Bool),
                    RewardPath::Steps(bound) => self.typed(&bound.limit, Type::Int),
                    RewardPath::Instant(limit) => self.typed(limit, Type::Int),
                    RewardPath::Total | RewardPath::LongRun => {}
                }
                self.bound(question);
            }
            Property::SteadyState(question, states) => {
                self.typed(states, Type::Bool);
                self.bound(question);
            }
            Property::Filter(_, inner, states) => {
                self.any(inner);
                if let Some(states) = states {
                    self.typed(states, Type::Bool);
                }
            }
            Property::Expression(inner) => self.any(inner),
            Property::Refused(problem) => self.problems.push(problem.clone()),
        }
    }

    fn bound(&mut self, question: &Question) {
        if let Some((_, bound)) = &question.bound {
            self.typed(bound, Type::Double);
        }
    }

    fn typed(&mut self, expression: &Expr, kind: Type) {
        let plain = with_placeholders(expression, &self.names);
        if let Err(problem) = self.names.typed(&plain, kind) {
            self.problems.push(problem);
        }
        self.within(expression);
    }

    fn any(&mut self, expression: &Expr) {
        let plain = with_placeholders(expression, &self.names);
        if let Err(problem) = self.names.compile(&plain) {
            self.problems.push(problem);
        }
        self.within(expression);
    }

    fn within(&mut self, expression: &Expr) {
        let mut parts = Vec::new();
        properties_in(expression, &mut parts);
        for part in parts {
            self.property(part);
        }
    }
}
