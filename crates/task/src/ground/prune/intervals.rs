//! Interval analysis of numeric variables: removes operators and rules whose comparisons can never hold.
//!
//! Uses the relaxation of Hoffmann's Metric-FF \[1\] with a lower and an upper bound for each variable. If each
//! comparison of an operator is satisfiable within the current intervals, its numeric effects extend the
//! intervals. For termination, a bound that still changes after a few rounds is set to infinity (widening).
//!
//! \[1\] J. Hoffmann: The Metric-FF planning system, JAIR 20, 2003.

use num_traits::Zero;

use crate::ground::vocabulary::condition::GroundCondition;
use crate::ground::vocabulary::task::GroundTask;
use crate::lifted::Rational;
use crate::limits::Interrupted;
use crate::task::quantity::{Linear, NumericId, Quantity};

/// Number of rounds before bounds that still change are set to infinity.
const ROUNDS: usize = 3;

/// Range of a number. `None` represents an infinite bound.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Interval {
    low: Option<Rational>,
    high: Option<Rational>,
}

/// Removes operators and rules with a comparison that is false everywhere in the reachable intervals. Returns
/// `true` if any were removed.
pub fn prune_by_numbers(task: &mut GroundTask<'_>) -> Result<bool, Interrupted> {
    let conditions = task.operators.iter().map(|operator| &operator.condition);
    let bodies = task.axioms.iter().map(|axiom| &axiom.body);
    if conditions.chain(bodies).all(|condition| condition.comparisons.is_empty()) {
        return Ok(false);
    }
    let intervals = reachable(task)?;
    let (operators, axioms) = (task.operators.len(), task.axioms.len());
    task.operators.retain(|operator| can_hold(&operator.condition, &intervals));
    task.axioms.retain(|axiom| can_hold(&axiom.body, &intervals));
    Ok(operators != task.operators.len() || axioms != task.axioms.len())
}

/// Returns `true` if each comparison of the goal is satisfiable by itself within the reachable intervals.
pub fn goal_can_hold(task: &GroundTask<'_>) -> Result<bool, Interrupted> {
    let Some(goal) = task.goal.as_ref().filter(|goal| !goal.comparisons.is_empty()) else {
        return Ok(true);
    };
    Ok(can_hold(goal, &reachable(task)?))
}

#[expect(
    clippy::arithmetic_side_effects,
    reason = "after a few rounds each one moves an end, or is the last"
)]
fn reachable(task: &GroundTask<'_>) -> Result<Vec<Interval>, Interrupted> {
    let limits = task.world.limits;
    let variables = NumericId::all(task.world.numerics.len());
    let mut intervals: Vec<Interval> = variables
        .map(|variable| {
            let initial = task.world.initial_value(variable);
            Interval { low: Some(initial.clone()), high: Some(initial) }
        })
        .collect();
    let changing: Vec<_> =
        task.operators.iter().filter(|operator| !operator.numeric_effects.is_empty()).collect();
    let mut round = 0;
    loop {
        let before = intervals.clone();
        for operator in limits.watch(&changing) {
            let operator = operator?;
            if !can_hold(&operator.condition, &before) {
                continue;
            }
            for (variable, value) in operator.numeric_effects.iter() {
                let range = range(value, &before);
                let interval = &mut intervals[variable.index()];
                // `zip` keeps an infinite bound (`None`) infinite.
                interval.low = interval.low.take().zip(range.low).map(|(a, b)| a.min(b));
                interval.high = interval.high.take().zip(range.high).map(|(a, b)| a.max(b));
            }
        }
        if intervals == before {
            return Ok(intervals);
        }
        round += 1;
        if round > ROUNDS {
            // Widening: a bound that still changes becomes infinite.
            for (interval, before) in intervals.iter_mut().zip(&before) {
                interval.low = interval.low.take().filter(|low| before.low.as_ref() == Some(low));
                interval.high = interval.high.take().filter(|high| before.high.as_ref() == Some(high));
            }
        }
    }
}

fn can_hold(condition: &GroundCondition, intervals: &[Interval]) -> bool {
    condition.comparisons.iter().all(|(linear, strict)| match range(linear, intervals).high {
        Some(high) if *strict => high > Rational::zero(),
        Some(high) => high >= Rational::zero(),
        None => true,
    })
}

fn range(linear: &Linear<Rational>, intervals: &[Interval]) -> Interval {
    let mut low = Some(extreme(&linear.quantity, Iterator::min));
    let mut high = Some(extreme(&linear.quantity, Iterator::max));
    for (variable, factor) in &linear.coefficients {
        let interval = &intervals[variable.index()];
        let (least, most) = if factor.is_positive() {
            (&interval.low, &interval.high)
        } else {
            (&interval.high, &interval.low)
        };
        low = low.zip(least.as_ref()).map(|(sum, value)| sum + factor.clone() * value);
        high = high.zip(most.as_ref()).map(|(sum, value)| sum + factor.clone() * value);
    }
    Interval { low, high }
}

/// Returns the constant plus the minimum (or maximum) entry of each table. The sum is a bound for every
/// combination of designs.
fn extreme<'q>(
    quantity: &'q Quantity<Rational>,
    pick: impl Fn(std::slice::Iter<'q, Rational>) -> Option<&'q Rational>,
) -> Rational {
    let tables = quantity.tables.iter().filter_map(|table| pick(table.values.iter()));
    tables.fold(quantity.constant.clone(), |sum, value| sum + value)
}
