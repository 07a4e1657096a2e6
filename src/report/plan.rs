//! Converts the solution of a mission to a picture.

use std::collections::BTreeMap;

use picture::Axis;
use planner::{Exact, Plan, Solution, Status, Step};

use crate::mission::Mission;
use crate::report::designs::designs;
use crate::report::map::map;
use crate::report::numbers::curves;
use crate::report::seen::{Designs, Scene, Seen, known_designs};

/// Returns the picture of a solution. The steps of its plan must have all arguments of the
/// mission's domain.
pub fn plan_picture(seen: Seen<'_>, solution: &Solution) -> picture::Plan {
    let functions_of_designs = known_designs(seen.mission);
    let mut picture =
        solution.plan.as_ref().map(|plan| drawn(seen.scene(&functions_of_designs), plan)).unwrap_or_default();
    (picture.verdict, picture.search) = (sentence(solution), search(solution));
    picture.designs = designs(seen.mission, &picture.steps);
    picture
}

pub(super) fn drawn(scene: Scene<'_>, plan: &Plan) -> picture::Plan {
    let axis = axis(plan);
    let mut steps = steps(scene.designs, plan, axis);
    let map = map(scene, plan, &mut steps);
    let curves = curves(scene, plan, &steps, axis);
    picture::Plan { steps, axis, map, curves, ..picture::Plan::default() }
}

/// Returns a picture of a solution without map, curves and designs: the verdict, the steps and the
/// progress of the search.
pub fn timeline_picture(mission: &Mission, solution: &Solution) -> picture::Plan {
    let axis = solution.plan.as_ref().map(axis).unwrap_or_default();
    let functions_of_designs = known_designs(mission);
    let steps =
        solution.plan.as_ref().map(|plan| steps(&functions_of_designs, plan, axis)).unwrap_or_default();
    let (verdict, search) = (sentence(solution), search(solution));
    picture::Plan { verdict, steps, axis, search, ..picture::Plan::default() }
}

fn sentence(solution: &Solution) -> String {
    let cost = solution.plan.as_ref().map(|plan| format!("Cost {}", plan.cost));
    let bound = solution.lower_bound.as_ref().filter(|_| solution.status != Status::Optimal);
    let bound = bound.filter(|_| cost.is_some()).map(|bound| format!(", lower bound {bound}"));
    let verdict = solution.verdict();
    if let Some(cost) = cost {
        return format!("{cost}{}: {verdict}.", bound.unwrap_or_default());
    }
    let (first, rest) = verdict.split_at(verdict.chars().next().map_or(0, char::len_utf8));
    format!("{}{rest}.", first.to_uppercase())
}

fn axis(plan: &Plan) -> Axis {
    let ends = plan.steps.iter().map(|step| step.start.to_rational() + step.duration.to_rational());
    let is_sequence = plan.steps.iter().skip(1).zip(ends).all(|(next, end)| end <= next.start.to_rational());
    let takes_none = plan.steps.iter().any(|step| step.duration.is_zero());
    // Actions without duration would be invisible on a time axis.
    if is_sequence && takes_none { Axis::Steps } else { Axis::Time }
}

fn steps(functions_of_designs: &Designs, plan: &Plan, axis: Axis) -> Vec<picture::Step> {
    let mut before: BTreeMap<String, String> = BTreeMap::new();
    let mut drawn = Vec::new();
    for (index, step) in plan.steps.iter().enumerate() {
        let configuration = configuration(step, functions_of_designs);
        let changed = configuration.iter().filter_map(|(function, design)| {
            let old = before.get(function).filter(|old| *old != design)?;
            Some((function.clone(), old.clone()))
        });
        let reconfigured = changed.collect();
        before.extend(configuration.iter().cloned());
        let (start, duration) = step.times();
        let (from, to) = match axis {
            Axis::Steps => (index as f64, index as f64 + 1.0),
            Axis::Time => (step.start.to_f64(), step.start.to_f64() + step.duration.to_f64()),
        };
        drawn.push(picture::Step {
            label: label(step, &configuration),
            start: from,
            end: to,
            start_text: start.to_string(),
            duration_text: duration.to_string(),
            cost_text: step.cost.to_string(),
            configuration,
            reconfigured,
            way: None,
        });
    }
    drawn
}

/// Returns the designs of a step, as pairs of function and design. If the planner has assigned no
/// designs to functions, each argument that is a design is assigned to the first function that it
/// solves. Of several designs for one function, the last one is used.
fn configuration(step: &Step, functions_of_designs: &Designs) -> Vec<(String, String)> {
    if !step.configuration.is_empty() {
        return step.configuration.clone();
    }
    let of_arguments = step
        .arguments
        .iter()
        .filter_map(|name| Some((functions_of_designs.get(name)?.clone(), name.clone())));
    of_arguments.collect::<BTreeMap<String, String>>().into_iter().collect()
}

fn label(step: &Step, configuration: &[(String, String)]) -> String {
    let configured = |word: &&String| configuration.iter().any(|(f, design)| f == *word || design == *word);
    let words = step.arguments.iter().filter(|word| !configured(word)).map(String::as_str);
    std::iter::once(step.action.as_str()).chain(words).collect::<Vec<_>>().join(" ")
}

/// Returns the progress of the search. Times are omitted, because they differ between runs.
fn search(solution: &Solution) -> Vec<picture::Progress> {
    let moments = solution.statistics.history.iter().map(|moment| {
        let cost =
            moment.cost.as_ref().map_or_else(|| "no plan yet".to_owned(), |cost| format!("cost {cost}"));
        picture::Progress {
            cost: moment.cost.as_ref().map(Exact::to_f64),
            lower_bound: moment.lower_bound.to_f64(),
            text: format!("{cost}, lower bound {}", moment.lower_bound),
        }
    });
    moments.collect()
}
