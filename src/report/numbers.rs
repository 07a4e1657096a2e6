//! The numbers that a plan changes, what its conditions demand of them, and what it costs.

use std::collections::BTreeMap;

use encodings::Plan;
use pddl::ast::Name;
use pddl::validate::{Course, CourseMoment, NumberBound, PlanStep, PlanText, course};
use picture::{Axis, Bound, Curve, Step};

use crate::number;
use crate::report::seen::Scene;

/// One curve for the cost, and one for each number that the plan changes or that something is demanded of.
pub(super) fn curves(scene: Scene<'_>, plan: &Plan, steps: &[Step], axis: Axis) -> Vec<Curve> {
    if steps.is_empty() {
        return Vec::new();
    }
    let text = plan.steps.iter().map(|step| PlanStep {
        action: Name::new(&step.action),
        arguments: step.arguments.iter().map(|argument| Name::new(argument)).collect(),
        start: Some(step.start.to_rational()),
        duration: (!step.duration.is_zero()).then(|| step.duration.to_rational()),
        line: 0,
    });
    let text = PlanText { steps: text.collect() };
    // The validator has executed the plan.
    let course = course(scene.domain, scene.problem, &text).unwrap_or_default();
    std::iter::once(cost(plan, steps)).chain(numbers(&course, steps, axis)).collect()
}

/// What the plan has cost after each step.
fn cost(plan: &Plan, steps: &[Step]) -> Curve {
    let spent = plan.steps.iter().map(|step| step.cost.to_f64());
    let mut sum = plan.cost.to_f64() - spent.clone().sum::<f64>();
    let mut points = vec![(0.0, sum)];
    for (step, cost) in steps.iter().zip(spent) {
        sum += cost;
        points.push((step.end, sum));
    }
    points.sort_by(|left, right| left.0.total_cmp(&right.0));
    Curve { name: "cost".to_owned(), points, bounds: Vec::new() }
}

fn numbers(course: &Course, steps: &[Step], axis: Axis) -> Vec<Curve> {
    let initial = course.initial.iter().map(|(name, value)| {
        let curve =
            Curve { name: bare(name), points: vec![(0.0, number::to_f64(value))], bounds: Vec::new() };
        (name.as_str(), curve)
    });
    let mut curves: BTreeMap<&str, Curve> = initial.collect();
    for moment in &course.moments {
        let at = place(moment, axis);
        for (name, value) in &moment.values {
            let curve = curves.entry(name).or_insert_with(|| Curve { name: bare(name), ..Curve::default() });
            let value = number::to_f64(value);
            match curve.points.last_mut() {
                Some(last) if last.0 >= at => last.1 = value,
                _ => curve.points.push((at, value)),
            }
        }
        let Some(step) = steps.get(moment.step) else { continue };
        for bound in &moment.bounds {
            let who = format!("step {} ({}) needs", moment.step + 1, step.label);
            add(&mut curves, bound, (step.start, step.end), &who);
        }
    }
    let end = steps.iter().map(|step| step.end).fold(0.0, f64::max);
    for bound in &course.goal {
        add(&mut curves, bound, (end, end), "the goal needs");
    }
    let is_of_interest = |curve: &Curve| curve.points.len() > 1 || !curve.bounds.is_empty();
    curves.into_values().filter(is_of_interest).collect()
}

fn add<'c>(curves: &mut BTreeMap<&'c str, Curve>, bound: &'c NumberBound, (from, to): (f64, f64), who: &str) {
    let curve = curves.entry(&bound.number);
    let curve = curve.or_insert_with(|| Curve { name: bare(&bound.number), ..Curve::default() });
    let relation = bound.relation.symbol();
    let text = format!("{who} {} {relation} {}", curve.name, number::decimal(&bound.bound));
    curve.bounds.push(Bound { from, to, value: number::to_f64(&bound.bound), text });
}

/// Where on the axis something happens.
fn place(moment: &CourseMoment, axis: Axis) -> f64 {
    match axis {
        Axis::Time => number::to_f64(&moment.time),
        Axis::Steps => moment.step as f64 + if moment.is_end { 1.0 } else { 0.0 },
    }
}

/// The name of a function without its parentheses.
fn bare(name: &str) -> String {
    name.trim_start_matches('(').trim_end_matches(')').to_owned()
}
