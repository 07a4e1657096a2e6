//! Makes a task that fails smaller, while it still fails in the same way.

use super::model::{Body, Condition, Effect, Expression, Measure, Part, Task, q};

/// A task with one thing less, for each thing.
pub fn smaller(task: &Task) -> Vec<Task> {
    let mut tasks = Vec::new();
    let mut without = |change: &dyn Fn(&mut Task)| {
        let mut less = task.clone();
        change(&mut less);
        tasks.push(less);
    };
    (0..task.actions.len()).for_each(|at| without(&|less| drop(less.actions.remove(at))));
    for (at, (_, literals)) in task.events.iter().enumerate() {
        without(&|less| drop(less.events.remove(at)));
        for literal in (0..literals.len()).filter(|_| literals.len() > 1) {
            without(&|less| drop(less.events[at].1.remove(literal)));
        }
    }
    (0..task.atoms.len()).for_each(|at| without(&|less| drop(less.atoms.remove(at))));
    for goal in conditions(&task.goal) {
        without(&|less| less.goal = goal.clone());
    }
    for (at, action) in task.actions.iter().enumerate() {
        match &action.body {
            Body::Instantaneous(part) => {
                for part in parts(part) {
                    without(&|less| less.actions[at].body = Body::Instantaneous(part.clone()));
                }
            }
            Body::Durative { duration, start, over_all, end } => {
                let mut bodies = Vec::new();
                let body = |duration: &Expression, start: &Part, over_all: &Condition, end: &Part| {
                    let (duration, over_all) = (duration.clone(), over_all.clone());
                    Body::Durative { duration, start: start.clone(), over_all, end: end.clone() }
                };
                bodies.extend(parts(start).iter().map(|start| body(duration, start, over_all, end)));
                bodies.extend(parts(end).iter().map(|end| body(duration, start, over_all, end)));
                bodies
                    .extend(conditions(over_all).iter().map(|over_all| body(duration, start, over_all, end)));
                for number in [q(0), q(1)] {
                    let constant = Expression::Number(number);
                    if !matches!(duration, Expression::Number(_)) {
                        bodies.push(body(&constant, start, over_all, end));
                    }
                }
                bodies.into_iter().for_each(|body| without(&|less| less.actions[at].body = body.clone()));
            }
        }
    }
    if let Measure::Metric { maximize, time, functions } = &task.measure {
        for at in (0..functions.len()).filter(|_| *time != q(0) || functions.len() > 1) {
            let mut functions = functions.clone();
            functions.remove(at);
            let (maximize, time) = (*maximize, *time);
            without(&|less| less.measure = Measure::Metric { maximize, time, functions: functions.clone() });
        }
    }
    let predicates: Vec<usize> = task.axioms.iter().map(|axiom| axiom.predicate).collect();
    if predicates.last().is_some_and(|last| last + 1 == task.predicates.len() && !task.domain_uses(*last)) {
        without(&|less| {
            less.axioms.pop();
            less.predicates.pop();
        });
    }
    tasks
}

/// A condition with one thing less.
fn conditions(condition: &Condition) -> Vec<Condition> {
    let none = Condition::All(Vec::new());
    match condition {
        Condition::All(parts) if parts.is_empty() => Vec::new(),
        Condition::All(parts) => {
            let mut found = Vec::new();
            for at in 0..parts.len() {
                let mut less = parts.clone();
                less.remove(at);
                found.push(Condition::All(less));
                for part in conditions(&parts[at]) {
                    let mut less = parts.clone();
                    less[at] = part;
                    found.push(Condition::All(less));
                }
            }
            found
        }
        Condition::Any(parts) => parts.clone(),
        Condition::Imply(left, right) => vec![(**left).clone(), (**right).clone()],
        Condition::Not(part) if !matches!(**part, Condition::Atom(_)) => vec![(**part).clone(), none],
        _ => vec![none],
    }
}

/// One end of an action with one thing less.
fn parts(part: &Part) -> Vec<Part> {
    let mut found: Vec<Part> = conditions(&part.condition)
        .into_iter()
        .map(|condition| Part { condition, effects: part.effects.clone() })
        .collect();
    for (at, effect) in part.effects.iter().enumerate() {
        let mut with = |replacement: &[Effect]| {
            let effects = [&part.effects[..at], replacement, &part.effects[at + 1..]].concat();
            found.push(Part { condition: part.condition.clone(), effects });
        };
        with(&[]);
        if let Effect::When(condition, inner) = effect {
            with(inner);
            conditions(condition)
                .into_iter()
                .for_each(|condition| with(&[Effect::When(condition, inner.clone())]));
        }
    }
    found
}
