//! Compares the ground task with the interpreter. In corresponding states, the same actions must be
//! applicable, the same atoms true, the goal satisfied or not, and the metric equal.

use std::collections::{BTreeMap, BTreeSet};

use metaplan_planner::{GroundConfig, TaskState, ground};
use pddl::ast::{Domain, Problem};

use crate::ground_semantics::interpret::{State, choices};
use crate::ground_semantics::model::{Action, Expression, Number, OBJECTS, Sign, Task, fact_text};

/// Maximum number of pairs of states that are compared, or of states that are searched.
const LIMIT: usize = 60;

/// States with numbers above this limit are not expanded, because exact integers are limited.
const LARGE: i128 = 100_000;

/// Error codes with which grounding may reject a task: unsupported construct or missing value, product
/// of fluents, too large numbers.
const REFUSALS: [&str; 3] = ["E301", "E303", "E304"];

fn rewards_time(task: &Task) -> bool {
    let Some((maximize, Expression::Sum(parts))) = &task.metric else { return false };
    let weights = parts.iter().filter_map(|part| match part {
        Expression::Product(weight, what) if matches!(**what, Expression::TotalTime) => Some(&**weight),
        _ => None,
    });
    let zero = Number::from_integer(0);
    let sum = weights.fold(zero, |sum, weight| match weight {
        Expression::Number(weight) => sum + weight,
        _ => sum,
    });
    if *maximize { sum > zero } else { sum < zero }
}

/// The duration that the planner should choose: the value of the only equation, or otherwise of the
/// only bound that is optimal for the metric.
fn duration(task: &Task, action: &Action, scope: &[usize], state: &State) -> Option<Number> {
    let bounds = action.duration.as_ref()?;
    let among = |signs: &[Sign]| {
        let mut found = bounds.iter().filter(|(_, sign, _)| signs.contains(sign)).map(|(.., value)| value);
        found.next().filter(|_| found.next().is_none())
    };
    let longest = if rewards_time(task) { Sign::LessOrEqual } else { Sign::GreaterOrEqual };
    let chosen = if bounds.iter().any(|(_, sign, _)| *sign == Sign::Equal) {
        among(&[Sign::Equal])
    } else {
        among(&[longest])
    };
    state.value(task, chosen?, scope)
}

fn after(task: &Task, state: &State, index: usize, objects: Vec<usize>) -> Option<State> {
    let duration = duration(task, &task.actions[index], &objects, state);
    state.after(task, &(index, objects, duration))
}

fn goal_is_out_of_reach(task: &Task) {
    let mut open = vec![State::initial(task)];
    let mut next = 0;
    while let Some(state) = open.get(next).cloned() {
        next += 1;
        assert!(!state.is_goal(task), "{}\n{}", task.domain(), task.problem());
        for (index, action) in task.actions.iter().enumerate() {
            let ranges: Vec<_> = action.parameters.iter().map(|range| range.objects()).collect();
            let states =
                choices(&ranges).into_iter().filter_map(|objects| after(task, &state, index, objects));
            let room = LIMIT.saturating_sub(open.len());
            open.extend(states.filter(is_small).take(room));
        }
    }
}

fn is_small(state: &State) -> bool {
    state.values.values().all(|value| value.numer().abs().max(*value.denom()) < LARGE)
}

struct Pair {
    lifted: State,
    ground: TaskState,
    /// Number of actions from the initial state, unless one of them is not in the ground task, so
    /// that its cost is unknown.
    steps: Option<usize>,
}

/// Returns the number of compared pairs of states (0 if grounding finds the goal unreachable), or
/// `None` if grounding rejects the task.
pub fn check(task: &Task, (domain, problem): &(Domain, Problem)) -> Option<usize> {
    let context = || format!("{}\n{}", task.domain(), task.problem());
    let ground = match ground(domain, problem, &GroundConfig::default()) {
        Ok(ground) => ground,
        Err(errors) => {
            assert!(errors.iter().all(|error| REFUSALS.contains(&error.code())), "{errors:?}\n{}", context());
            return None;
        }
    };
    let atoms: BTreeSet<&str> = ground.atoms().collect();
    let actions: BTreeSet<_> = ground.actions().collect();
    let mut open = vec![Pair { lifted: State::initial(task), ground: ground.start(), steps: Some(0) }];
    let mut seen = BTreeSet::from([open[0].lifted.clone()]);
    let mut next = 0;
    if ground.unreachable().is_some() {
        goal_is_out_of_reach(task);
        return Some(0);
    }
    while let Some(Pair { lifted, ground: state, steps }) = open.get(next) {
        next += 1;
        let (lifted, state, steps) = (lifted.clone(), state.clone(), *steps);
        let all = lifted.all_facts(task);
        let facts = all.iter().map(fact_text).filter(|fact| atoms.contains(fact.as_str()));
        let holding: BTreeSet<_> = ground.holding(&state).into_iter().map(str::to_owned).collect();
        assert_eq!(facts.collect::<BTreeSet<_>>(), holding, "{}", context());
        assert_eq!(lifted.is_goal(task), ground.reaches_goal(&state), "{holding:?}\n{}", context());
        if let Some(steps) = steps {
            let found = ground.metric(&state);
            let part = |part: num_bigint::BigInt| i128::try_from(part).expect("a small number");
            let found = num_rational::Ratio::new(part(found.numerator()), part(found.denominator()));
            let possible = match &task.metric {
                Some(_) => vec![lifted.metric(task)],
                None => vec![Some(lifted.time), Some(num_rational::Ratio::from_integer(steps as i128))],
            };
            assert!(possible.contains(&Some(found)), "{found}, not one of {possible:?}\n{}", context());
        }
        let mut transitions: BTreeMap<_, _> = ground
            .transitions(&state)
            .expect("numbers that fit")
            .into_iter()
            .map(|transition| ((transition.action, transition.arguments), transition.after))
            .collect();
        for (index, action) in task.actions.iter().enumerate() {
            let ranges: Vec<_> = action.parameters.iter().map(|range| range.objects()).collect();
            for objects in choices(&ranges) {
                let names = objects.iter().map(|object| OBJECTS[*object].0.to_owned()).collect();
                let key = (format!("a{index}"), names);
                let after = after(task, &lifted, index, objects);
                let pair = match (after, transitions.remove(&key)) {
                    (Some(after), Some(ground)) => (after, ground, steps.map(|steps| steps + 1)),
                    // Grounding may omit an action that changes nothing relevant, and such a case of an
                    // action with conditional effects.
                    (Some(after), None) if !actions.contains(&key) || action.is_conditional() => {
                        (after, state.clone(), None)
                    }
                    (None, None) => continue,
                    (after, ground) => {
                        let (lifted_can, ground_can) = (after.is_some(), ground.is_some());
                        panic!(
                            "{key:?} in {:?}: lifted {lifted_can}, ground {ground_can}\n{}",
                            lifted.facts.iter().map(fact_text).collect::<Vec<_>>(),
                            context()
                        );
                    }
                };
                if open.len() < LIMIT && is_small(&pair.0) && seen.insert(pair.0.clone()) {
                    open.push(Pair { lifted: pair.0, ground: pair.1, steps: pair.2 });
                }
            }
        }
        assert!(transitions.is_empty(), "{:?} is not an instance\n{}", transitions.keys(), context());
    }
    Some(next)
}
