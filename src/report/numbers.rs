//! Curves for a plan's picture: the cost, the numbers that the plan changes, and the limits that the conditions
//! of its actions and the goal impose.

use std::collections::BTreeMap;

use num_rational::BigRational;
use pddl::validate::{Course, CourseMoment, NumberBound, course, metric_after};
use picture::{Axis, Bound, Curve, Step};
use planner::Plan;

use crate::mission::plan_text;
use crate::number;
use crate::report::seen::Scene;

pub(super) fn curves(scene: Scene<'_>, plan: &Plan, steps: &[Step], axis: Axis) -> Vec<Curve> {
    if steps.is_empty() {
        return Vec::new();
    }
    // The validator has executed the plan before, so executing it again is expected to succeed. Otherwise, only
    // the cost is drawn.
    let course = course(scene.domain, scene.problem, &plan_text(plan)).unwrap_or_default();
    let points = metric(scene, plan, &course, axis).unwrap_or_else(|| spent(plan, steps, axis));
    let cost = Curve { name: "cost".to_owned(), points, bounds: Vec::new() };
    std::iter::once(cost).chain(numbers(&course, steps, axis)).collect()
}

/// Returns the value of the problem's metric after each start and end of an action, as if the plan
/// ended there. Returns `None` if a value is undefined, or if the last value is not the cost of the
/// plan. For example, the cost of a plan's remainder does not include costs of earlier actions.
fn metric(scene: Scene<'_>, plan: &Plan, course: &Course, axis: Axis) -> Option<Vec<(f64, f64)>> {
    let first = metric_after(scene.domain, scene.problem, &BigRational::default())?;
    let mut points = vec![(0.0, number::to_f64(&first))];
    for moment in &course.moments {
        set(&mut points, place(moment, axis), number::to_f64(moment.metric.as_ref()?));
    }
    let (last, cost) = (points.last()?.1, plan.cost.to_f64());
    ((last - cost).abs() <= 1e-6 * cost.abs().max(1.0)).then_some(points)
}

/// Returns the cost of the plan after each step. The part that belongs to no step is added before
/// the first step. If actions overlap, this part (such as the makespan) is spread evenly over time
/// instead.
fn spent(plan: &Plan, steps: &[Step], axis: Axis) -> Vec<(f64, f64)> {
    let costs = plan.steps.iter().map(|step| step.cost.to_f64());
    let remainder = plan.cost.to_f64() - costs.clone().sum::<f64>();
    let overlaps = axis == Axis::Time && steps.windows(2).any(|pair| pair[1].start < pair[0].end);
    let last = steps.iter().map(|step| step.end).fold(0.0, f64::max);
    let remainder = |at: f64| if overlaps && last > 0.0 { remainder * at / last } else { remainder };
    let mut ends: Vec<(f64, f64)> = steps.iter().map(|step| step.end).zip(costs).collect();
    ends.sort_by(|left, right| left.0.total_cmp(&right.0));
    let (mut sum, mut points) = (0.0, vec![(0.0, remainder(0.0))]);
    for (end, cost) in ends {
        sum += cost;
        set(&mut points, end, sum + remainder(end));
    }
    points
}

/// Appends the point (`at`, `value`). If the last point is not before `at`, replaces the last
/// point's value instead.
fn set(points: &mut Vec<(f64, f64)>, at: f64, value: f64) {
    match points.last_mut() {
        Some(last) if last.0 >= at => last.1 = value,
        _ => points.push((at, value)),
    }
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
            set(&mut curve.points, at, number::to_f64(value));
        }
        let Some(step) = steps.get(moment.step) else { continue };
        for bound in &moment.bounds {
            let requirement = format!("step {} ({}) needs", moment.step + 1, step.label);
            add(&mut curves, bound, (step.start, step.end), &requirement);
        }
    }
    let end = steps.iter().map(|step| step.end).fold(0.0, f64::max);
    for bound in &course.goal {
        add(&mut curves, bound, (end, end), "the goal needs");
    }
    // Constant numbers without limits would only hide the other curves.
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

/// Returns the position of a start or end of a step: its time, or the number of steps that have
/// ended if the steps are executed in order.
fn place(moment: &CourseMoment, axis: Axis) -> f64 {
    match axis {
        Axis::Time => number::to_f64(&moment.time),
        Axis::Steps => moment.step as f64 + if moment.is_end { 1.0 } else { 0.0 },
    }
}

fn bare(name: &str) -> String {
    name.trim_start_matches('(').trim_end_matches(')').to_owned()
}
