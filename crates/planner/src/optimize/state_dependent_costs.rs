//! Exact costs of paths for a metric whose fluents change by amounts that depend on the state \[1\]. Lower bounds on
//! the cost of each operator serve the heuristics. Unlike in \[1\], the cost functions are not decomposed.
//! `branch_and_bound` minimises such a metric.
//!
//! The cost of a path is the sum of its operator costs plus the weighted values of the measured fluents (fluents of the
//! metric) in its last state. Each operator has a lower bound on the increase of this cost, over the intervals of all
//! numbers in reachable states \[2\]. With these bounds as constant costs, the heuristics of the task are admissible if
//! no bound is negative.
//!
//! \[1\] F. Geißer, T. Keller, R. Mattmüller: Delete relaxations for planning with state-dependent action costs,
//! IJCAI 2015.
//! \[2\] P. Cousot, R. Cousot: Abstract interpretation, POPL 1977.

use num_bigint::BigInt;
use num_integer::Integer;
use num_traits::ToPrimitive as _;
use task::limits::{Interrupted, Limits};
use task::number::{GROWTH_LIMIT, Int, LIMIT, Rational};
use task::plan::ground::{GroundPlan, cost, pass};
use task::plan::{Exact, metric};
use task::task::number::TaskNumber as _;
use task::task::quantity::{Linear, Quantity};
use task::task::{Condition, NumericId, Objective, Operator, State, Task};

/// Number of rounds of the interval analysis before widening, and also the number of narrowing rounds.
const ROUNDS: usize = 3;

/// Range of a number. `None` represents an infinite bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Interval {
    low: Option<Int>,
    high: Option<Int>,
}

impl Interval {
    fn hull(self, other: Self) -> Self {
        // `zip` keeps an infinite bound (`None`) infinite.
        let low = self.low.zip(other.low).map(|(a, b)| a.min(b));
        Self { low, high: self.high.zip(other.high).map(|(a, b)| a.max(b)) }
    }

    /// Widening: `other`, but with an infinite bound where its bound differs from that of `self`.
    fn widened(self, other: Self) -> Self {
        let low = other.low.filter(|low| self.low == Some(*low));
        Self { low, high: other.high.filter(|high| self.high == Some(*high)) }
    }
}

/// Exact costs of paths, as integers: the costs of the task multiplied by `factor`.
pub(super) struct StateDependentCosts {
    factor: Int,
    /// Measured fluents with their cost per unit of the stored number.
    weights: Vec<(NumericId, Int)>,
    pub(super) preferences: Vec<Preference>,
    /// The task with constant operator costs, which are lower bounds on the increase of the exact cost.
    pub(super) priced: Task,
}

impl StateDependentCosts {
    /// Computes a lower bound on the increase of the exact cost by each operator. Returns `None` if an operator has no
    /// bound of at least 0, or if numbers overflow.
    ///
    /// # Errors
    /// Fails if the deadline has passed or the interrupt flag is set.
    pub(super) fn new(task: &Task, limits: &Limits) -> Result<Option<Self>, Interrupted> {
        let Some((factor, weights)) = weights(task) else { return Ok(None) };
        let intervals = reachable(task, limits)?;
        let mut priced = task.clone();
        for operator in limits.watch(&mut priced.operators) {
            let operator = operator?;
            let least = least_increase(operator, &intervals, factor, &weights);
            // A greater bound could overflow in the heuristics; a smaller one is a bound as well.
            let Some(least) = least.filter(|least| *least >= 0).map(|least| least.min(LIMIT)) else {
                return Ok(None);
            };
            operator.cost = Quantity::constant(least);
        }
        priced.objective = Objective { scale: 1, offset: 0, maximize: false, rest: Vec::new() };
        let preferences = preferences(task, &weights);
        Ok(Some(Self { factor, weights, preferences, priced }))
    }

    /// Scaled operator cost, without the effect of the operator on measured fluents. `None` on overflow.
    pub(super) fn paid(&self, operator: &Operator, choice: &[u32]) -> Option<Int> {
        operator.cost_of(choice).checked_mul(self.factor)
    }

    /// Weighted sum of the measured fluents in a state. `None` on overflow.
    pub(super) fn measured(&self, state: &State) -> Option<Int> {
        let mut terms = self.weights.iter();
        terms.try_fold(0, |sum: Int, (variable, weight)| {
            sum.checked_add(state.numbers[variable.index()].checked_mul(*weight)?)
        })
    }

    pub(super) fn total(&self, task: &Task, plan: &GroundPlan) -> Option<Int> {
        let states = pass(task, &task.initial, &plan.steps)?;
        let paid = cost(task, &plan.steps)?.checked_mul(self.factor)?;
        paid.checked_add(self.measured(states.last()?)?).filter(Int::is_moderate)
    }

    pub(super) fn metric(&self, task: &Task, total: Int) -> Exact {
        metric(task, &(Rational::from_integer(total) / Rational::from_integer(self.factor)))
    }
}

/// Least common factor that makes the weights of all measured fluents integers, and the products of the weights with
/// it. `None` on overflow.
fn weights(task: &Task) -> Option<(Int, Vec<(NumericId, Int)>)> {
    let unit = Rational::from_integer(task.objective.scale) / Rational::from_integer(task.number_scale);
    let measured = &task.objective.rest;
    let weights: Vec<Rational> = measured.iter().map(|(_, factor)| factor.clone() * &unit).collect();
    let common = weights.iter().fold(BigInt::from(1), |common, weight| common.lcm(weight.to_big().denom()));
    let factor = common.to_i128().filter(|factor| *factor <= GROWTH_LIMIT)?;
    let scaled = weights.iter().map(|weight| (weight.clone() * Rational::from_integer(factor)).to_int());
    let pairs = measured.iter().zip(scaled).map(|((variable, _), weight)| Some((*variable, weight?)));
    Some((factor, pairs.collect::<Option<_>>()?))
}

/// Dominance direction of a number: whether less or more of it is never worse. Never worse means that every
/// continuation stays possible and its steps increase the cost by no more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Preference {
    pub(super) less: bool,
    pub(super) more: bool,
}

impl Preference {
    /// Restricts the preference of a number that influences a quantity with the preference `other`.
    /// A positive influence means that less of the number is less of the quantity.
    fn restrict(&mut self, is_positive: bool, other: Self) {
        let (less, more) = if is_positive { (other.less, other.more) } else { (other.more, other.less) };
        *self = Self { less: self.less && less, more: self.more && more };
    }
}

/// Computes for each number whether less or more of it is never worse. The result is a greatest fixpoint, because
/// effects on numbers read other numbers.
fn preferences(task: &Task, weights: &[(NumericId, Int)]) -> Vec<Preference> {
    let mut preferences = vec![Preference { less: true, more: true }; task.initial.numbers.len()];
    // More of a compared expression, and less of the cost, is never worse.
    let (compared, cost) = (Preference { less: false, more: true }, Preference { less: true, more: false });
    let conditions = task.operators.iter().map(|operator| &operator.condition).chain([&task.goal]);
    for (variable, coefficient) in
        conditions.flat_map(Condition::linears).flat_map(|linear| &linear.coefficients)
    {
        preferences[variable.index()].restrict(*coefficient > 0, compared);
    }
    // Derived facts can be required to be true or false, so for a number in a rule, neither less nor more is known
    // to be no worse.
    let bodies = task.axioms.iter().flat_map(|layer| &layer.rules).map(|rule| &rule.body);
    for (variable, _) in bodies.flat_map(Condition::linears).flat_map(|linear| &linear.coefficients) {
        preferences[variable.index()] = Preference { less: false, more: false };
    }
    let effects = || task.operators.iter().flat_map(|operator| &operator.numeric_effects);
    for effect in effects() {
        let Some((_, weight)) = weights.iter().find(|(variable, _)| *variable == effect.variable) else {
            continue;
        };
        let itself = effect.value.coefficients.iter().find(|(variable, _)| *variable == effect.variable);
        let itself = itself.map_or(0, |(_, coefficient)| *coefficient);
        // The cost increases by the weighted difference between the new and the old value.
        if itself != 1 {
            preferences[effect.variable.index()].restrict((itself > 1) == (*weight > 0), cost);
        }
        let terms = effect.value.coefficients.iter().filter(|(variable, _)| *variable != effect.variable);
        for (variable, coefficient) in terms {
            preferences[variable.index()].restrict((*coefficient > 0) == (*weight > 0), cost);
        }
    }
    loop {
        let before = preferences.clone();
        for effect in effects() {
            for (variable, coefficient) in &effect.value.coefficients {
                let target = preferences[effect.variable.index()];
                preferences[variable.index()].restrict(*coefficient > 0, target);
            }
        }
        if preferences == before {
            return preferences;
        }
    }
}

/// Lower bound on the increase of the cost in every reachable state in which the operator is
/// applicable. `None` if no bound is known.
fn least_increase(
    operator: &Operator,
    intervals: &[Interval],
    factor: Int,
    weights: &[(NumericId, Int)],
) -> Option<Int> {
    let guarded = Guarded::new(operator, intervals);
    let mut coefficients: Vec<(NumericId, Int)> = Vec::new();
    let mut add = |variable: NumericId, by: Int| {
        match coefficients.iter_mut().find(|(present, _)| *present == variable) {
            Some((_, sum)) => *sum = sum.checked_add(by)?,
            None => coefficients.push((variable, by)),
        }
        Some(())
    };
    let mut least = operator.cost.minimum().checked_mul(factor)?;
    for effect in &operator.numeric_effects {
        let Some((_, weight)) = weights.iter().find(|(variable, _)| *variable == effect.variable) else {
            continue;
        };
        let quantity = &effect.value.quantity;
        let constant = if *weight > 0 { quantity.minimum() } else { quantity.maximum() };
        least = least.checked_add(constant.checked_mul(*weight)?)?;
        for (variable, coefficient) in &effect.value.coefficients {
            add(*variable, coefficient.checked_mul(*weight)?)?;
        }
        add(effect.variable, weight.checked_neg()?)?;
    }
    coefficients.retain(|(_, coefficient)| *coefficient != 0);
    coefficients.sort_unstable();
    least = least.checked_add(guarded.extreme(&coefficients, true)?)?;
    Some(least)
}

/// Intervals of the numbers in reachable states in which an operator is applicable.
struct Guarded<'i> {
    operator: &'i Operator,
    intervals: &'i [Interval],
    restricted: Vec<(NumericId, Interval)>,
}

impl<'i> Guarded<'i> {
    fn new(operator: &'i Operator, intervals: &'i [Interval]) -> Self {
        let mut guarded = Self { operator, intervals, restricted: Vec::new() };
        for linear in &operator.condition.comparisons {
            // coefficient * number + quantity >= 0
            let [(variable, coefficient)] = linear.coefficients[..] else { continue };
            let Some(least) = linear.quantity.maximum().checked_neg() else { continue };
            let mut interval = guarded.of(variable);
            if coefficient > 0 {
                let bound = Integer::div_ceil(&least, &coefficient);
                interval.low = Some(interval.low.map_or(bound, |low| low.max(bound)));
            } else {
                let bound = Integer::div_floor(&least, &coefficient);
                interval.high = Some(interval.high.map_or(bound, |high| high.min(bound)));
            }
            guarded.restricted.retain(|(present, _)| *present != variable);
            guarded.restricted.push((variable, interval));
        }
        guarded
    }

    fn of(&self, variable: NumericId) -> Interval {
        let restricted = self.restricted.iter().find(|(present, _)| *present == variable);
        restricted.map_or(self.intervals[variable.index()], |(_, interval)| *interval)
    }

    /// Lower bound (if `is_low`) or upper bound on a weighted sum of numbers. `None` if no bound is known. A condition
    /// also gives a bound if the weighted sum is an integer multiple of the sum that it compares.
    fn extreme(&self, coefficients: &[(NumericId, Int)], is_low: bool) -> Option<Int> {
        let mut sums = coefficients.iter();
        let by_intervals = sums.try_fold(0, |sum: Int, (variable, coefficient)| {
            let interval = self.of(*variable);
            let bound = if (*coefficient > 0) == is_low { interval.low } else { interval.high };
            sum.checked_add(bound?.checked_mul(*coefficient)?)
        });
        let by_conditions = self.operator.condition.comparisons.iter().filter_map(|linear| {
            let factor = multiple(coefficients, &linear.coefficients)?;
            // sum = factor * (condition - quantity), and the condition is at least 0.
            let is_bound = (factor > 0) == is_low;
            is_bound.then(|| linear.quantity.maximum().checked_neg()?.checked_mul(factor)).flatten()
        });
        let bounds = by_intervals.into_iter().chain(by_conditions);
        if is_low { bounds.max() } else { bounds.min() }
    }

    /// Returns the range of a linear expression. A bound that overflows is infinite.
    fn range(&self, linear: &Linear<Int>) -> Interval {
        let Linear { coefficients, quantity } = linear;
        let low = self.extreme(coefficients, true).and_then(|sum| sum.checked_add(quantity.minimum()));
        let high = self.extreme(coefficients, false).and_then(|sum| sum.checked_add(quantity.maximum()));
        Interval { low, high }
    }
}

/// Nonzero integer factor by which `second` must be multiplied to yield `first`, if there is one. Both must be sorted.
fn multiple(first: &[(NumericId, Int)], second: &[(NumericId, Int)]) -> Option<Int> {
    let ((_, a), (_, b)) = (first.first()?, second.first()?);
    let factor = a.checked_div(*b).filter(|factor| *factor != 0 && first.len() == second.len())?;
    let is_multiple = |((v, a), (w, b)): (&(NumericId, Int), &(NumericId, Int))| {
        v == w && b.checked_mul(factor) == Some(*a)
    };
    first.iter().zip(second).all(is_multiple).then_some(factor)
}

/// Interval analysis with widening and narrowing \[2\].
fn reachable(task: &Task, limits: &Limits) -> Result<Vec<Interval>, Interrupted> {
    let initial =
        task.initial.numbers.iter().map(|number| Interval { low: Some(*number), high: Some(*number) });
    let initial: Vec<Interval> = initial.collect();
    let changing: Vec<&Operator> =
        task.operators.iter().filter(|operator| !operator.numeric_effects.is_empty()).collect();
    // Initial values, and the values that operators set if the previous values are within `intervals`.
    let step = |intervals: &[Interval]| {
        let mut next = initial.clone();
        for operator in limits.watch(&changing) {
            let operator = operator?;
            let guarded = Guarded::new(operator, intervals);
            for effect in &operator.numeric_effects {
                let range = guarded.range(&effect.value);
                let interval = &mut next[effect.variable.index()];
                *interval = interval.hull(range);
            }
        }
        Ok(next)
    };
    let mut intervals = initial.clone();
    for round in 0_usize.. {
        let next = step(&intervals)?;
        let widened = intervals.iter().zip(next).map(|(before, next)| {
            let hull = before.hull(next);
            if round < ROUNDS { hull } else { before.widened(hull) }
        });
        let widened: Vec<Interval> = widened.collect();
        if widened == intervals {
            break;
        }
        intervals = widened;
    }
    // Each further step keeps a superset of the reachable values.
    for _ in 0..ROUNDS {
        intervals = step(&intervals)?;
    }
    Ok(intervals)
}
