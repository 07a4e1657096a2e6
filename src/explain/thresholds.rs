//! Searches for the smallest changes of measurements and of values of the problem that lead to another plan.
//! Values of the problem are changed in growing steps of up to 100 %, then by bisection. So a nearer change
//! that is undone within a step is not found.

use num_bigint::BigInt;
use num_rational::BigRational;
use planner::Limits;

use crate::explain::parts::{Alteration, BestPlan, Change, Target, little};
use crate::explain::rule_bounds::{RuleBounds, rule_bounds};
use crate::explain::solve::best;
use crate::knowledge::Knowledge;
use crate::message::Errors;
use crate::mission::Mission;
use crate::number;

/// Bisection ends if the interval is at most the current value divided by this number, or at most [`little`].
const BISECTION_RESOLUTION: i64 = 1000;

/// Result of [`smallest_changes`]: smallest changes of single values that lead to another plan.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SmallestChanges {
    /// The best plan for the mission in its current situation.
    pub best: BestPlan,
    /// The changes found, at most one upwards and one downwards for each value.
    pub changes: Vec<Change>,
    /// `true` if all values were examined. Otherwise, a plan was not proved to be the best, for example because a
    /// limit was reached.
    pub complete: bool,
    /// Comparisons of measurements in rules that were not examined, in words.
    pub unexamined: Vec<String>,
}

/// Searches for the smallest changes of single values that lead to another plan. Each measured attribute is set to
/// the values, below and above the current one, at which a requirement of a design begins or ceases to hold, or at
/// which the outcome of a comparison with a number in a rule changes. Each positive value of a numeric function without
/// parameters is changed downwards and upwards by at most 100 %. At a limit, returns the partial results. `hear` is
/// called with `the best plan` and then with the name of each value, before the search.
///
/// # Errors
/// The mission cannot be planned for.
pub fn smallest_changes(
    mission: &Mission,
    limits: &Limits,
    hear: &mut dyn FnMut(&str),
) -> Result<SmallestChanges, Errors> {
    hear("the best plan");
    let base = best(mission, limits)?;
    let bounds = mission.knowledge().map(rule_bounds).unwrap_or_default();
    let unexamined = bounds.unexamined.clone();
    let mut result = SmallestChanges { best: base, changes: Vec::new(), complete: false, unexamined };
    if !result.best.proved {
        return Ok(result);
    }
    let tried = VariedMission { mission, base: result.best.clone(), bounds, limits };
    let attributes = mission.knowledge().map(measured).unwrap_or_default();
    for (attribute, from) in attributes {
        hear(&attribute);
        for upwards in [false, true] {
            match tried.first_threshold(&attribute, &from, upwards)? {
                Outcome::Found(change) => result.changes.push(*change),
                Outcome::None => {}
                Outcome::AtLimit => return Ok(result),
            }
        }
    }
    for (function, from) in mission.values() {
        hear(&function);
        for upwards in [false, true] {
            match tried.bisected(&function, &from, upwards)? {
                Outcome::Found(change) => result.changes.push(*change),
                Outcome::None => {}
                Outcome::AtLimit => return Ok(result),
            }
        }
    }
    result.complete = true;
    Ok(result)
}

pub(super) fn measured(knowledge: &Knowledge) -> Vec<(String, BigRational)> {
    let measurements = knowledge.view().measurements().into_iter();
    measurements.filter_map(|measurement| Some((measurement.attribute, measurement.value?))).collect()
}

enum Outcome {
    Found(Box<Change>),
    None,
    AtLimit,
}

struct VariedMission<'a> {
    mission: &'a Mission,
    base: BestPlan,
    bounds: RuleBounds,
    limits: &'a Limits,
}

impl VariedMission<'_> {
    /// Computes the best plan after a value of the mission is set. Returns `None` if the plan, or
    /// that there is no plan, is not proved within the limits.
    fn with(&self, name: &str, value: &BigRational) -> Result<Option<BestPlan>, Errors> {
        if self.limits.reached() {
            return Ok(None);
        }
        let mut mission = self.mission.clone();
        if let Some(knowledge) = mission.knowledge_mut() {
            knowledge.interrupt(self.limits.into());
        }
        match mission.set(name, &number::decimal(value)) {
            Err(_) if self.limits.reached() => return Ok(None),
            outcome => outcome?,
        }
        Ok(Some(best(&mission, self.limits)?).filter(|plan| plan.proved))
    }

    fn is_other(&self, plan: &BestPlan) -> bool {
        let steps = |plan: &BestPlan| -> Vec<_> {
            plan.steps.iter().map(|step| (step.action.clone(), step.arguments.clone())).collect()
        };
        steps(plan) != steps(&self.base) || plan.cost.is_some() != self.base.cost.is_some()
    }

    /// Returns the values of an attribute, above or below `from`, at which a requirement of a design
    /// begins or ceases to hold, or the outcome of a comparison in a rule changes, in ascending distance.
    fn thresholds(&self, attribute: &str, from: &BigRational, upwards: bool) -> Vec<Target> {
        let mut targets = required(self.mission, attribute, from, upwards);
        let bounds = self.bounds.bounds.iter().map(|bound| &bound.alteration);
        let bounds = bounds.filter(|alteration| alteration.name == attribute);
        let ahead = |target: &&Target| (target.example() > *from) == upwards;
        targets.extend(bounds.map(|alteration| &alteration.to).filter(ahead).cloned());
        let distance = |target: &Target| {
            let distance = target.example() - from;
            if upwards { distance } else { -distance }
        };
        targets.sort_by_key(distance);
        // Several designs may have the same requirement.
        targets.dedup();
        targets
    }

    fn first_threshold(&self, attribute: &str, from: &BigRational, upwards: bool) -> Result<Outcome, Errors> {
        for target in self.thresholds(attribute, from, upwards) {
            let Some(then) = self.with(attribute, &target.example())? else { return Ok(Outcome::AtLimit) };
            if self.is_other(&then) {
                return Ok(Outcome::Found(Box::new(change(attribute, from, target, None, then))));
            }
        }
        Ok(Outcome::None)
    }

    /// Searches upwards or downwards for a value of a numeric function at which the best plan changes: first in
    /// growing relative steps of up to 100 %, then by bisection. A nearer change that is undone within a step
    /// is not found. Returns [`Outcome::None`] if the current value `from` is not positive.
    fn bisected(&self, function: &str, from: &BigRational, upwards: bool) -> Result<Outcome, Errors> {
        // Relative steps need a positive start value.
        if *from <= BigRational::default() {
            return Ok(Outcome::None);
        }
        let whole = |value: i64| BigRational::from_integer(value.into());
        // Growing steps find an interval with a change of the plan, in which bisection then
        // searches.
        let (mut same, mut other) = (from.clone(), None);
        for percent in [1, 2, 5, 10, 20, 50, 100] {
            let part = from * whole(percent) / whole(100);
            let value = if upwards { from + part } else { from - part };
            let Some(then) = self.with(function, &value)? else { return Ok(Outcome::AtLimit) };
            if self.is_other(&then) {
                other = Some((value, then));
                break;
            }
            same = value;
        }
        let Some((mut value, mut then)) = other else { return Ok(Outcome::None) };
        // Values are rounded, so an interval of [`little`] cannot be divided.
        let fine = (from / whole(BISECTION_RESOLUTION)).max(little());
        loop {
            let distance = if upwards { &value - &same } else { &same - &value };
            if distance <= fine {
                break;
            }
            let middle = number::rounded(&((&value + &same) / whole(2)));
            let Some(between) = self.with(function, &middle)? else { return Ok(Outcome::AtLimit) };
            if self.is_other(&between) {
                (value, then) = (middle, between);
            } else {
                same = middle;
            }
        }
        self.simplest(function, from, (same, value), then)
    }

    /// Determines the bound at which the plan changes between `same`, a value with the current
    /// plan, and `other`, a value with the plan `then`. If the plan changes at the number with the
    /// fewest decimals in this interval, or just beyond it, this number is the bound. Otherwise the
    /// bound is `other`.
    fn simplest(
        &self,
        function: &str,
        from: &BigRational,
        (same, other): (BigRational, BigRational),
        then: BestPlan,
    ) -> Result<Outcome, Errors> {
        let upwards = other > same;
        let (low, high) = if upwards { (&same, &other) } else { (&other, &same) };
        let bound = shortest_decimal(low, high);
        let step = if upwards { little() } else { -little() };
        let (before, beyond) = (&bound - &step, &bound + &step);
        let Some(at) = self.with(function, &bound)? else { return Ok(Outcome::AtLimit) };
        // The plan may change at the bound itself or just beyond it, which decides between a closed
        // and an open bound.
        if self.is_other(&at) {
            let Some(plan) = self.with(function, &before)? else { return Ok(Outcome::AtLimit) };
            if !self.is_other(&plan) {
                let to = if upwards { Target::AtLeast(bound) } else { Target::AtMost(bound) };
                return Ok(Outcome::Found(Box::new(change(function, from, to, Some(little()), at))));
            }
        } else {
            let Some(plan) = self.with(function, &beyond)? else { return Ok(Outcome::AtLimit) };
            if self.is_other(&plan) {
                let to = if upwards { Target::Above(bound) } else { Target::Below(bound) };
                return Ok(Outcome::Found(Box::new(change(function, from, to, Some(little()), plan))));
            }
        }
        let within = high - low;
        let to = if upwards { Target::AtLeast(other) } else { Target::AtMost(other) };
        Ok(Outcome::Found(Box::new(change(function, from, to, Some(within), then))))
    }
}

fn change(name: &str, from: &BigRational, to: Target, within: Option<BigRational>, then: BestPlan) -> Change {
    let alteration = Alteration { name: name.to_owned(), from: Some(from.clone()), to };
    Change { alteration, within, suffices: true, then }
}

/// Returns a number with the fewest decimals in the interval from `low` to `high`, both included.
fn shortest_decimal(low: &BigRational, high: &BigRational) -> BigRational {
    let mut unit = BigInt::from(1);
    loop {
        let scale = BigRational::from_integer(unit.clone());
        let rounded = (low * &scale).ceil() / scale;
        if rounded <= *high {
            return rounded;
        }
        unit *= 10;
    }
}

fn required(mission: &Mission, attribute: &str, from: &BigRational, upwards: bool) -> Vec<Target> {
    let designs = mission.knowledge().into_iter().flat_map(|knowledge| knowledge.catalogue().designs());
    let requirements = designs.flat_map(|design| &design.requirements);
    let mut targets: Vec<Target> = Vec::new();
    for requirement in requirements.filter(|requirement| requirement.attribute == attribute) {
        if let Some(minimum) = &requirement.minimum {
            match (upwards, from < minimum) {
                (true, true) => targets.push(Target::AtLeast(minimum.clone())),
                (false, false) => targets.push(Target::Below(minimum.clone())),
                _ => {}
            }
        }
        if let Some(maximum) = &requirement.maximum {
            match (upwards, from > maximum) {
                (false, true) => targets.push(Target::AtMost(maximum.clone())),
                (true, false) => targets.push(Target::Above(maximum.clone())),
                _ => {}
            }
        }
    }
    targets
}

#[cfg(test)]
mod tests {
    use num_rational::BigRational;

    use super::shortest_decimal;

    #[test]
    fn the_shortest_decimal_lies_in_the_interval() {
        let number = |value: i64| BigRational::new(value.into(), 1_000_000.into());
        let check =
            |low, high, expected| assert_eq!(shortest_decimal(&number(low), &number(high)), number(expected));
        check(7_910_157, 8_010_000, 8_000_000);
        check(12_400_000, 12_412_000, 12_400_000);
        check(12_410_001, 12_419_000, 12_411_000);
        check(86_953_125, 87_000_000, 87_000_000);
        check(0, 30, 0);
    }
}
