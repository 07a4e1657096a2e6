//! Relevance analysis of numbers: numbers of the metric that nothing reads and that only increase
//! or decrease become action costs.

use super::happening::{Obstacle, State, World, fit};
use super::model::{Body, Condition, Effect, Expression, Measure, Operation, Q, q};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    Kept,
    /// Excluded from the state. Changes of the number are costs, multiplied by the number's weight in the
    /// metric.
    Cost(Q),
    /// Excluded from the state, because nothing reads its value. Only whether the number is defined matters.
    Unread,
}

#[derive(Debug)]
pub struct Reduction {
    roles: Vec<Role>,
    pub time: Q,
    /// Cost of each action: 1 if plans are measured by their number of steps, otherwise 0.
    pub step: Q,
    /// Weights in the metric of the numbers that are part of the state.
    remaining: Vec<(Q, usize)>,
    pub maximize: bool,
    /// Contribution of the initial values of the excluded numbers to the metric.
    offset: Q,
}

fn expression_functions(expression: &Expression, functions: &mut Vec<usize>) {
    match expression {
        Expression::Number(_) | Expression::Duration(_) => {}
        Expression::Fluent(fluent) => functions.push(fluent.function),
        Expression::Sum(left, right)
        | Expression::Product(left, right)
        | Expression::Quotient(left, right) => {
            expression_functions(left, functions);
            expression_functions(right, functions);
        }
    }
}

fn condition_functions(condition: &Condition, functions: &mut Vec<usize>) {
    match condition {
        Condition::Atom(_) | Condition::Same(..) => {}
        Condition::Compare(_, left, right) => {
            expression_functions(left, functions);
            expression_functions(right, functions);
        }
        Condition::Not(part) | Condition::Forall(_, part) | Condition::Exists(_, part) => {
            condition_functions(part, functions);
        }
        Condition::All(parts) | Condition::Any(parts) => {
            parts.iter().for_each(|part| condition_functions(part, functions));
        }
        Condition::Imply(left, right) => {
            condition_functions(left, functions);
            condition_functions(right, functions);
        }
    }
}

/// Collects the functions that effects read, and the functions that effects change other than by increase and
/// decrease.
fn effect_functions(effects: &[Effect], read: &mut Vec<usize>, assigned: &mut Vec<usize>) {
    for effect in effects {
        match effect {
            Effect::Add(_) | Effect::Delete(_) => {}
            Effect::Change(operation, fluent, expression) => {
                expression_functions(expression, read);
                if !matches!(operation, Operation::Increase | Operation::Decrease) {
                    assigned.push(fluent.function);
                }
            }
            Effect::When(condition, parts) => {
                condition_functions(condition, read);
                effect_functions(parts, read, assigned);
            }
            Effect::Forall(_, parts) => effect_functions(parts, read, assigned),
        }
    }
}

impl Reduction {
    pub fn new(world: &World) -> Self {
        let task = &world.task;
        let (mut read, mut assigned) = (Vec::new(), Vec::new());
        condition_functions(&task.goal, &mut read);
        task.axioms.iter().for_each(|axiom| condition_functions(&axiom.condition, &mut read));
        for action in &task.actions {
            let parts = match &action.body {
                Body::Instantaneous(part) => vec![part],
                Body::Durative { duration, start, over_all, end } => {
                    expression_functions(duration, &mut read);
                    condition_functions(over_all, &mut read);
                    vec![start, end]
                }
            };
            for part in parts {
                condition_functions(&part.condition, &mut read);
                effect_functions(&part.effects, &mut read, &mut assigned);
            }
        }
        let (mut time, mut step, mut maximize, mut weights) = (q(0), q(0), false, Vec::new());
        match &task.measure {
            Measure::Steps => step = q(1),
            Measure::Time => time = q(1),
            Measure::Metric { maximize: is_maximized, time: weight, functions } => {
                (time, maximize, weights) = (*weight, *is_maximized, functions.clone());
            }
        }
        let mut roles = vec![Role::Kept; world.initial.values.len()];
        let (mut remaining, mut offset) = (Vec::new(), q(0));
        for function in (0..task.functions.len()).filter(|function| !read.contains(function)) {
            let first = world.value_of(function);
            let count = task.objects.len().pow(task.functions[function].1 as u32);
            let weight: Vec<Q> =
                weights.iter().filter(|(_, at)| *at == function).map(|(weight, _)| *weight).collect();
            let role = match &weight[..] {
                [] => Role::Unread,
                _ if assigned.contains(&function) => Role::Kept,
                weights => Role::Cost(weights.iter().sum()),
            };
            (first..first + count).for_each(|at| roles[at] = role);
        }
        for (weight, function) in weights {
            let at = world.value_of(function);
            if roles[at] == Role::Kept {
                remaining.push((weight, at));
            } else {
                offset += weight * world.initial.values[at].expect("what is measured has a value");
            }
        }
        Self { roles, time, step, remaining, maximize, offset }
    }

    /// Removes irrelevant values from a state. Returns the reduced state, and the contribution of the removed
    /// values to the metric.
    pub fn reduce(&self, mut state: State) -> Result<(State, Q), Obstacle> {
        let mut cost = q(0);
        for (value, role) in state.values.iter_mut().zip(&self.roles) {
            match (role, &value) {
                (Role::Cost(weight), Some(value)) => cost = fit(cost + weight * value)?,
                (Role::Unread, Some(_)) => {}
                _ => continue,
            }
            *value = Some(q(0));
        }
        Ok((state, cost))
    }

    pub fn keeps(&self, at: usize) -> bool {
        self.roles[at] == Role::Kept
    }

    /// Returns the contribution of the state and of the initial values to the metric. Action costs come in
    /// addition.
    pub fn remaining_metric(&self, state: &State) -> Result<Q, Obstacle> {
        let mut sum = self.offset;
        for (weight, at) in &self.remaining {
            let value = state.values[*at].ok_or(Obstacle::Blocked("the metric is undefined"))?;
            sum = fit(sum + weight * value)?;
        }
        Ok(sum)
    }
}
