//! Chooses thresholds and a goal among the values that occur, so that they are hit exactly or missed by a hair.
//!
//! The actions are executed at random, every open comparison taken as true. Each threshold then becomes a value that its
//! expression had when an action was executed, or one next to it; the goal holds, or almost, in a state that was reached.

use fastrand::Rng;

use super::draw::{self, near, once_in};
use super::ground::{Ground, Test, ground};
use super::model::{Action, Applied, Condition, Expr, Number, Relation, Task, applied, whole};
use super::step::{State, execute, number};

/// Most instances of a task that is walked through.
const INSTANCES: usize = 20_000;

/// What may become the goal.
pub struct Wishes {
    /// Atoms of which some that hold become conjuncts.
    pub atoms: Vec<(usize, Vec<usize>)>,
    /// Expressions that may be compared with a value that they have.
    pub numbers: Vec<Expr>,
}

/// Fills in thresholds and goal.
pub fn tune(task: &mut Task, wishes: &Wishes, rng: &mut Rng) {
    let mut with_wishes = task.clone();
    with_wishes.goal = wishes.atoms.iter().map(|(p, objects)| Condition::Holds(fixed(*p, objects))).collect();
    let Some(open) = ground(&with_wishes, &wishes.numbers, INSTANCES) else {
        // Too many to walk through: any thresholds will do.
        return close(task, &[], rng);
    };
    let mut seen: Vec<Vec<Number>> = Vec::new();
    let mut last = start(&open);
    for _ in 0..3 {
        last = walk(&open, &mut seen, rng);
    }
    close(task, &seen, rng);
    task.goal = goal(wishes, &open, &last, rng);
}

fn fixed(symbol: usize, objects: &[usize]) -> Applied {
    let terms: Vec<_> = objects.iter().map(|object| super::model::Term::Object(*object)).collect();
    applied(symbol, &terms)
}

fn start(ground: &Ground) -> State {
    State { atoms: ground.atoms.clone(), numbers: ground.numbers.clone(), time: whole(0) }
}

/// Executes up to six actions; notes the values of open comparisons.
fn walk(ground: &Ground, seen: &mut Vec<Vec<Number>>, rng: &mut Rng) -> State {
    let mut state = start(ground);
    let length = rng.usize(1..7);
    for _ in 0..length {
        let mut order: Vec<usize> = (0..ground.instances.len()).collect();
        rng.shuffle(&mut order);
        let next = order.into_iter().take(200).find_map(|position| {
            let instance = &ground.instances[position];
            execute(instance, &state).map(|after| (instance, after))
        });
        let Some((instance, after)) = next else { break };
        for test in &instance.start.tests {
            if let Test::Open(position, value) = test
                && let Some(value) = number(value, &state)
            {
                seen.resize((*position + 1).max(seen.len()), Vec::new());
                seen[*position].push(value);
            }
        }
        state = after;
    }
    state
}

/// Replaces open comparisons.
fn close(task: &mut Task, seen: &[Vec<Number>], rng: &mut Rng) {
    let mut close_all = |conditions: &mut Vec<Condition>| {
        for condition in conditions {
            if let Condition::Open(relation, expression, position) = condition {
                let values = seen.get(*position).filter(|values| !values.is_empty());
                let value = match values {
                    Some(values) => draw::one(rng, values),
                    None => whole(rng.i64(0..4)),
                };
                let relation = match relation {
                    Relation::AtLeast if once_in(rng, 3) => draw::relation(rng),
                    other => *other,
                };
                *condition = compare(rng, relation, expression.clone(), &value);
            }
        }
    };
    for Action { start, lasting, .. } in &mut task.actions {
        close_all(&mut start.conditions);
        if let Some(lasting) = lasting {
            close_all(&mut lasting.over_all);
            close_all(&mut lasting.end.conditions);
        }
    }
}

/// A comparison of an expression with a value or one next to it, in one of the ways to write it.
fn compare(rng: &mut Rng, relation: Relation, expression: Expr, value: &Number) -> Condition {
    let value = near(rng, value);
    let reversed = match relation {
        Relation::Less => Relation::Greater,
        Relation::AtMost => Relation::AtLeast,
        Relation::Equal => Relation::Equal,
        Relation::AtLeast => Relation::AtMost,
        Relation::Greater => Relation::Less,
    };
    match rng.u32(0..8) {
        0 => Condition::Compare(reversed, Expr::Number(value), expression),
        1 => {
            let difference = Expr::Minus(Box::new(expression), Box::new(Expr::Number(value)));
            Condition::Compare(relation, difference, Expr::Number(whole(0)))
        }
        2 => {
            let factor = draw::one(rng, &["0.3", "7", "0.1234567890123456", "-2"]);
            let factor = super::model::decimal(factor);
            let relation = if factor < whole(0) { reversed } else { relation };
            let product = Expr::Product(vec![Expr::Number(factor.clone()), expression]);
            Condition::Compare(relation, product, Expr::Number(value * factor))
        }
        3 => Condition::Not(Box::new(Condition::Compare(
            match relation {
                Relation::Less => Relation::AtLeast,
                Relation::AtMost => Relation::Greater,
                Relation::AtLeast => Relation::Less,
                _ => Relation::AtMost,
            },
            expression,
            Expr::Number(value),
        ))),
        _ => Condition::Compare(relation, expression, Expr::Number(value)),
    }
}

/// Some of the wishes that hold in a state.
fn goal(wishes: &Wishes, open: &Ground, state: &State, rng: &mut Rng) -> Vec<Condition> {
    let mut goal = Vec::new();
    for ((predicate, objects), test) in wishes.atoms.iter().zip(&open.goal) {
        if super::step::holds(test, state) == Some(true) && (goal.is_empty() || rng.bool()) {
            goal.push(Condition::Holds(fixed(*predicate, objects)));
        }
    }
    let mut numbers: Vec<usize> = (0..wishes.numbers.len()).collect();
    rng.shuffle(&mut numbers);
    for position in numbers {
        if !(goal.is_empty() || once_in(rng, 4)) {
            break;
        }
        if let Some(value) = number(&open.objectives[position], state) {
            let relation = draw::relation(rng);
            goal.push(compare(rng, relation, wishes.numbers[position].clone(), &value));
        }
    }
    goal
}
