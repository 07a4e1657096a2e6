//! Evaluates filters, which aggregate the values of a property over a set of states.

use fixedbitset::FixedBitSet;
use num_bigint::BigInt;
use num_rational::BigRational;

use crate::check::answer::{Answer, Listed, Quantity};
use crate::check::ask::{Checked, refusal};
use crate::check::query::Query;
use crate::check::vector::Vector;
use crate::number::{Number, count};
use crate::prism::ast::{Expr, Filter, Type};

#[derive(Debug, Clone)]
pub enum Filtered {
    Number(Answer),
    Truth(bool),
    /// The least and the greatest number.
    Range(Answer, Answer),
    States(Vec<Listed>),
}

enum Values<N> {
    Numbers(Vector<N>),
    Truth(FixedBitSet),
}

impl<N: Number> Query<'_, N> {
    /// Evaluates `filter` for the property `inner` over the states that satisfy `states`, or over all states if
    /// `states` is `None`. Fails if no state is selected, if the filter `state` applies to several states, or
    /// if the filter does not fit the type of `inner`.
    pub fn filtered(&self, filter: Filter, inner: &Expr, states: Option<&Expr>) -> Checked<Filtered> {
        let chosen = states.map_or_else(|| Ok(self.every()), |states| self.truth(states))?;
        let values = match self.kind_of(inner)? {
            Type::Bool => Values::Truth(self.truth(inner)?),
            _ => Values::Numbers(self.numbers(inner, &chosen)?),
        };
        if chosen.is_clear() {
            return Err(refusal("Q509", "no state satisfies the condition of the filter"));
        }
        match values {
            Values::Truth(holds) => self.of_truth(filter, &holds, &chosen),
            Values::Numbers(vector) => self.of_numbers(filter, &vector, &chosen),
        }
    }

    fn of_truth(&self, filter: Filter, holds: &FixedBitSet, chosen: &FixedBitSet) -> Checked<Filtered> {
        let satisfying = || chosen.intersection(holds);
        let listed = |state: usize| Listed {
            values: self.values_of(state),
            truth: Some(holds.contains(state)),
            answer: None,
        };
        Ok(match filter {
            Filter::Count => Filtered::Number(whole(satisfying().count())),
            Filter::ForAll => Filtered::Truth(chosen.is_subset(holds)),
            Filter::Exists => Filtered::Truth(satisfying().next().is_some()),
            Filter::First => Filtered::Truth(holds.contains(self.first(chosen))),
            Filter::State => Filtered::Truth(holds.contains(only(chosen)?)),
            Filter::Print => Filtered::States(self.sorted(satisfying()).into_iter().map(listed).collect()),
            Filter::PrintAll => {
                Filtered::States(self.sorted(chosen.ones()).into_iter().map(listed).collect())
            }
            _ => return Err(refusal("Q203", "this filter takes numbers, and not truth values")),
        })
    }

    fn of_numbers(&self, filter: Filter, vector: &Vector<N>, chosen: &FixedBitSet) -> Checked<Filtered> {
        let listed = |state: usize| Listed {
            values: self.values_of(state),
            truth: None,
            answer: Some(vector.answer(state)),
        };
        let values_of_states =
            |states: Vec<usize>| Filtered::States(states.into_iter().map(listed).collect());
        let is_nonzero = |state: &usize| vector.infinite.contains(*state) || !vector.values[*state].is_zero();
        Ok(match filter {
            Filter::Min => Filtered::Number(extreme(vector, chosen, false)),
            Filter::Max => Filtered::Number(extreme(vector, chosen, true)),
            Filter::Range => Filtered::Range(extreme(vector, chosen, false), extreme(vector, chosen, true)),
            Filter::Sum => Filtered::Number(sum(vector, chosen, 1)),
            Filter::Average => Filtered::Number(sum(vector, chosen, chosen.count_ones(..))),
            Filter::First => Filtered::Number(vector.answer(self.first(chosen))),
            Filter::State => Filtered::Number(vector.answer(only(chosen)?)),
            Filter::Print => values_of_states(self.sorted(chosen.ones().filter(is_nonzero))),
            Filter::PrintAll => values_of_states(self.sorted(chosen.ones())),
            Filter::ArgMin | Filter::ArgMax => {
                let best = extreme(vector, chosen, filter == Filter::ArgMax);
                values_of_states(
                    self.sorted(chosen.ones().filter(|state| can_be(&vector.answer(*state), &best))),
                )
            }
            Filter::Count | Filter::ForAll | Filter::Exists => {
                return Err(refusal("Q203", "this filter takes truth values, and not numbers"));
            }
        })
    }

    fn values_of(&self, state: usize) -> Vec<i64> {
        let mut values = Vec::new();
        self.program.unpack(&self.explored.states[state], &mut values);
        values
    }

    fn sorted(&self, states: impl Iterator<Item = usize>) -> Vec<usize> {
        let mut states: Vec<usize> = states.collect();
        states.sort_by_cached_key(|state| self.values_of(*state));
        states
    }

    fn first(&self, chosen: &FixedBitSet) -> usize {
        chosen.ones().min_by_key(|state| self.values_of(*state)).unwrap_or(0)
    }
}

fn whole(number: usize) -> Answer {
    Answer::from_exact(BigRational::from(BigInt::from(number)))
}

fn only(chosen: &FixedBitSet) -> Checked<usize> {
    let mut states = chosen.ones();
    match (states.next(), states.next()) {
        (Some(state), None) => Ok(state),
        _ => Err(refusal("Q509", "the filter `state` takes one state, and there are several")),
    }
}

/// Returns the least value over the states in `chosen`, or the greatest one if `greatest`. Infinite for an
/// empty set. The bounds enclose the true extreme even if the bounds of several states overlap.
pub fn extreme<N: Number>(vector: &Vector<N>, chosen: &FixedBitSet, greatest: bool) -> Answer {
    let mut best: Option<Quantity> = None;
    for state in chosen.ones() {
        let Answer::Finite(next) = vector.answer(state) else {
            if greatest {
                return Answer::Infinite;
            }
            continue;
        };
        let Some(incumbent) = &mut best else {
            best = Some(next);
            continue;
        };
        let pick = |a: f64, b: f64| if greatest { a.max(b) } else { a.min(b) };
        let better = match (&incumbent.exact, &next.exact) {
            (Some(incumbent), Some(next)) => (next > incumbent) == greatest && next != incumbent,
            _ => (next.value > incumbent.value) == greatest,
        };
        if better {
            (incumbent.value, incumbent.exact) = (next.value, next.exact);
        }
        (incumbent.lower, incumbent.upper) =
            (pick(incumbent.lower, next.lower), pick(incumbent.upper, next.upper));
    }
    best.map_or(Answer::Infinite, Answer::Finite)
}

/// Returns `true` if `answer` can equal the extreme value `best`, because both are exact and equal, or their
/// bounds overlap.
fn can_be(answer: &Answer, best: &Answer) -> bool {
    match (answer, best) {
        (Answer::Finite(a), Answer::Finite(b)) => match (&a.exact, &b.exact) {
            (Some(a), Some(b)) => a == b,
            _ => a.lower <= b.upper && b.lower <= a.upper,
        },
        (Answer::Infinite, Answer::Infinite) => true,
        _ => false,
    }
}

fn sum<N: Number>(vector: &Vector<N>, chosen: &FixedBitSet, parts: usize) -> Answer {
    if !chosen.is_disjoint(&vector.infinite) {
        return Answer::Infinite;
    }
    let sum = chosen.ones().fold(N::zero(), |sum, state| sum.plus(&vector.values[state]));
    let parts = N::from_rational(&BigRational::from(BigInt::from(parts)));
    let value = sum.over(&parts);
    if let Some(exact) = value.to_rational() {
        return Answer::from_exact(exact);
    }
    let errors: f64 =
        chosen.ones().map(|state| vector.error(state) + vector.values[state].to_f64().abs() * 1e-300).sum();
    let sizes: f64 = chosen.ones().map(|state| vector.values[state].to_f64().abs()).sum();
    let rounding = sizes * count(chosen.count_ones(..)) * f64::EPSILON;
    let error = (errors + rounding) / parts.to_f64() * (1.0 + 1e-12);
    let value = value.to_f64();
    Answer::between(value, [(value - error).next_down(), (value + error).next_up()])
}
