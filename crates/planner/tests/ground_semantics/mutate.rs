//! Generates a valid plan whose final state defines the goal, and plans that differ from it by one change.
//! The validator must judge these plans as the interpreter does.

use crate::ground_semantics::generate::Draw;
use crate::ground_semantics::interpret::{State, Step, choices};
use crate::ground_semantics::model::{Action, Atom, Expression, Formula, Number, Sign, Task, Term};
use crate::ground_semantics::text;

const CHANGES: usize = 8;

fn needs_duration(action: &Action) -> bool {
    action.duration.as_ref().is_some_and(|bounds| !matches!(bounds[..], [(false, Sign::Equal, _)]))
}

fn durations() -> impl Iterator<Item = Number> + Clone {
    (-1..=6).map(|halves| Number::new(halves, 2))
}

fn steps(task: &Task) -> Vec<Step> {
    let mut found = Vec::new();
    for (index, action) in task.actions.iter().enumerate() {
        let ranges: Vec<_> = action.parameters.iter().map(|range| range.objects()).collect();
        for objects in choices(&ranges) {
            if needs_duration(action) {
                found.extend(durations().map(|duration| (index, objects.clone(), Some(duration))));
            } else {
                found.push((index, objects, None));
            }
        }
    }
    found
}

fn walk(draw: &mut Draw<'_>, task: &Task) -> (Vec<Step>, State) {
    let (mut plan, mut state) = (Vec::new(), State::initial(task));
    let steps = steps(task);
    for _ in 0..=draw.below(4) {
        let executable = steps.iter().filter_map(|step| Some((step, state.after(task, step)?)));
        let mut executable: Vec<_> = executable.collect();
        // Most instances have no effect. A plan of such instances would stay valid after most changes.
        if executable.iter().any(|(_, after)| after.facts != state.facts) {
            executable.retain(|(_, after)| after.facts != state.facts);
        }
        if executable.is_empty() {
            break;
        }
        let (step, after) = executable.swap_remove(draw.below(executable.len()));
        plan.push(step.clone());
        state = after;
    }
    (plan, state)
}

fn terms(objects: &[usize]) -> Vec<Term> {
    objects.iter().map(|object| Term::Object(*object)).collect()
}

fn difference(before: &State, after: &State) -> Formula {
    let fact = |(predicate, objects): &Atom| Formula::Fact(*predicate, terms(objects));
    let gained = after.facts.difference(&before.facts).map(fact);
    let lost = before.facts.difference(&after.facts).map(|atom| Formula::Not(Box::new(fact(atom))));
    let values = after.values.iter().filter(|(atom, value)| before.values.get(*atom) != Some(*value));
    let values = values.map(|((function, objects), value)| {
        let function = Expression::Function(*function, terms(objects));
        Formula::Compare(Sign::Equal, function, Expression::Number(*value))
    });
    Formula::And(gained.chain(lost).chain(values).collect())
}

fn changed(draw: &mut Draw<'_>, task: &Task, plan: &[Step]) -> Vec<Step> {
    let mut plan = plan.to_vec();
    let place = draw.below(plan.len());
    let all = steps(task);
    let (index, objects, duration) = plan[place].clone();
    match draw.below(7) {
        0 => drop(plan.remove(place)),
        1 => plan.insert(place, plan[place].clone()),
        2 => {
            let next = (place + 1) % plan.len();
            plan.swap(place, next);
        }
        3 => plan.truncate(place),
        4 => plan[place] = all[draw.below(all.len())].clone(),
        5 if duration.is_some() => {
            plan[place].2 = durations().nth(draw.below(8));
        }
        _ if !objects.is_empty() => {
            let argument = draw.below(objects.len());
            let among = task.actions[index].parameters[argument].objects();
            plan[place].1[argument] = among[draw.below(among.len())];
        }
        _ => plan.insert(draw.below(plan.len() + 1), all[draw.below(all.len())].clone()),
    }
    plan
}

/// Returns the numbers of valid and of invalid changed copies of a valid plan.
pub fn check(draw: &mut Draw<'_>) -> (usize, usize) {
    let mut task = draw.task();
    let (plan, last) = walk(draw, &task);
    if plan.is_empty() {
        return (0, 0);
    }
    task.goal = difference(&State::initial(&task), &last);
    let trees = text::trees(&task);
    let judged = |plan: &[Step]| text::check_plan(&task, &trees, plan);
    judged(&plan);
    let valid = (0..CHANGES).filter(|_| judged(&changed(draw, &task, &plan))).count();
    (valid, CHANGES - valid)
}
