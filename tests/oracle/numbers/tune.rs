//! Chooses thresholds and a goal of a task among the values that occur, so that they are hit
//! exactly or missed by a tiny amount.
//!
//! Random walks execute the actions, with all open comparisons taken as true. If a walk evaluates a
//! threshold's expression at the start of an action, the threshold becomes one of these values or a
//! neighbouring value. The goal holds, or almost holds, in a state that was reached.

use fastrand::Rng;

use super::draw::{self, near, once_in};
use super::ground::{Ground, Test, ground};
use super::model::{Action, Applied, Condition, Expr, Number, Relation, Task, applied, whole};
use super::step::{State, execute, number};

const MAX_INSTANCES: usize = 20_000;

/// Candidates for conjuncts of the goal.
pub struct Wishes {
    pub atoms: Vec<(usize, Vec<usize>)>,
    pub numbers: Vec<Expr>,
}

pub fn tune(task: &mut Task, wishes: &Wishes, rng: &mut Rng) {
    let mut task_with_wishes = task.clone();
    task_with_wishes.goal =
        wishes.atoms.iter().map(|(p, objects)| Condition::Holds(ground_atom(*p, objects))).collect();
    let Some(open) = ground(&task_with_wishes, &wishes.numbers, MAX_INSTANCES) else {
        // There are too many instances for random walks, so thresholds and goal are drawn at random. An empty goal
        // would be satisfied by the empty plan.
        close(task, &[], rng);
        let (predicate, objects) = draw::one_of(rng, &wishes.atoms);
        task.goal = vec![Condition::Holds(ground_atom(predicate, &objects))];
        return;
    };
    let mut observed: Vec<Vec<Number>> = Vec::new();
    let mut last = start(&open);
    for _ in 0..3 {
        last = walk(&open, &mut observed, rng);
    }
    close(task, &observed, rng);
    task.goal = goal(wishes, &open, &last, rng);
}

fn ground_atom(symbol: usize, objects: &[usize]) -> Applied {
    let terms: Vec<_> = objects.iter().map(|object| super::model::Term::Object(*object)).collect();
    applied(symbol, &terms)
}

fn start(ground: &Ground) -> State {
    State { atoms: ground.atoms.clone(), numbers: ground.numbers.clone(), time: whole(0) }
}

/// Executes up to six random actions and records in `observed` the values of open comparisons. Returns the
/// final state.
fn walk(ground: &Ground, observed: &mut Vec<Vec<Number>>, rng: &mut Rng) -> State {
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
                observed.resize((*position + 1).max(observed.len()), Vec::new());
                observed[*position].push(value);
            }
        }
        state = after;
    }
    state
}

fn close(task: &mut Task, observed: &[Vec<Number>], rng: &mut Rng) {
    let mut close_all = |conditions: &mut Vec<Condition>| {
        for condition in conditions {
            if let Condition::Open(relation, expression, position) = condition {
                let values = observed.get(*position).filter(|values| !values.is_empty());
                let value = match values {
                    Some(values) => draw::one_of(rng, values),
                    None => whole(rng.i64(0..4)),
                };
                let relation = match relation {
                    Relation::AtLeast if once_in(rng, 3) => draw::relation(rng),
                    unchanged => *unchanged,
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

/// Returns a comparison of an expression with a value or a neighbouring value, in one of several
/// equivalent forms.
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
            let factor = draw::one_of(rng, &["0.3", "7", "0.1234567890123456", "-2"]);
            let factor = super::model::decimal(factor);
            let relation = if factor < whole(0) { reversed } else { relation };
            let product = Expr::Product(vec![Expr::Number(factor.clone()), expression]);
            Condition::Compare(relation, product, Expr::Number(value * factor))
        }
        3 if !matches!(relation, Relation::Equal) => Condition::Not(Box::new(Condition::Compare(
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

fn goal(wishes: &Wishes, open: &Ground, state: &State, rng: &mut Rng) -> Vec<Condition> {
    let mut goal = Vec::new();
    for ((predicate, objects), test) in wishes.atoms.iter().zip(&open.goal) {
        if super::step::holds(test, state) == Some(true) && (goal.is_empty() || rng.bool()) {
            goal.push(Condition::Holds(ground_atom(*predicate, objects)));
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
