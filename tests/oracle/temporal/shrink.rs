//! Candidates for shrinking a failing task (delta debugging).

use super::model::{Body, Condition, Effect, Expression, Measure, Part, Task, q};

pub fn smaller(task: &Task) -> Vec<Task> {
    let mut tasks = Vec::new();
    let mut add_changed = |change: &dyn Fn(&mut Task)| {
        let mut smaller_task = task.clone();
        change(&mut smaller_task);
        tasks.push(smaller_task);
    };
    (0..task.actions.len()).for_each(|at| add_changed(&|smaller_task| drop(smaller_task.actions.remove(at))));
    for (at, (_, literals)) in task.events.iter().enumerate() {
        add_changed(&|smaller_task| drop(smaller_task.events.remove(at)));
        for literal in (0..literals.len()).filter(|_| literals.len() > 1) {
            add_changed(&|smaller_task| drop(smaller_task.events[at].1.remove(literal)));
        }
    }
    (0..task.atoms.len()).for_each(|at| add_changed(&|smaller_task| drop(smaller_task.atoms.remove(at))));
    for goal in conditions(&task.goal) {
        add_changed(&|smaller_task| smaller_task.goal = goal.clone());
    }
    for (at, action) in task.actions.iter().enumerate() {
        match &action.body {
            Body::Instantaneous(part) => {
                for part in parts(part) {
                    add_changed(&|smaller_task| {
                        smaller_task.actions[at].body = Body::Instantaneous(part.clone());
                    });
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
                bodies.into_iter().for_each(|body| {
                    add_changed(&|smaller_task| smaller_task.actions[at].body = body.clone());
                });
            }
        }
    }
    if let Measure::Metric { maximize, time, functions } = &task.measure {
        for at in (0..functions.len()).filter(|_| *time != q(0) || functions.len() > 1) {
            let mut functions = functions.clone();
            functions.remove(at);
            let (maximize, time) = (*maximize, *time);
            add_changed(&|smaller_task| {
                smaller_task.measure = Measure::Metric { maximize, time, functions: functions.clone() }
            });
        }
    }
    let predicates: Vec<usize> = task.axioms.iter().map(|axiom| axiom.predicate).collect();
    if predicates.last().is_some_and(|last| last + 1 == task.predicates.len() && !task.domain_uses(*last)) {
        add_changed(&|smaller_task| {
            smaller_task.axioms.pop();
            smaller_task.predicates.pop();
        });
    }
    tasks
}

fn conditions(condition: &Condition) -> Vec<Condition> {
    let always_true = Condition::All(Vec::new());
    match condition {
        Condition::All(parts) if parts.is_empty() => Vec::new(),
        Condition::All(parts) => {
            let mut smaller = Vec::new();
            for at in 0..parts.len() {
                let mut remaining = parts.clone();
                remaining.remove(at);
                smaller.push(Condition::All(remaining));
                for part in conditions(&parts[at]) {
                    let mut remaining = parts.clone();
                    remaining[at] = part;
                    smaller.push(Condition::All(remaining));
                }
            }
            smaller
        }
        Condition::Any(parts) => parts.clone(),
        Condition::Imply(left, right) => vec![(**left).clone(), (**right).clone()],
        Condition::Not(part) if !matches!(**part, Condition::Atom(_)) => vec![(**part).clone(), always_true],
        _ => vec![always_true],
    }
}

fn parts(part: &Part) -> Vec<Part> {
    let mut smaller: Vec<Part> = conditions(&part.condition)
        .into_iter()
        .map(|condition| Part { condition, effects: part.effects.clone() })
        .collect();
    for (at, effect) in part.effects.iter().enumerate() {
        let mut add_replaced = |replacement: &[Effect]| {
            let effects = [&part.effects[..at], replacement, &part.effects[at + 1..]].concat();
            smaller.push(Part { condition: part.condition.clone(), effects });
        };
        add_replaced(&[]);
        if let Effect::When(condition, inner) = effect {
            add_replaced(inner);
            conditions(condition)
                .into_iter()
                .for_each(|condition| add_replaced(&[Effect::When(condition, inner.clone())]));
        }
    }
    smaller
}
