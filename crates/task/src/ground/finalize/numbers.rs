//! Converts numeric variables, linear expressions and numeric effects to the number type of the final task.

use std::borrow::Cow;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::error::Error;
use crate::ground::config::Generality;
use crate::ground::finalize::integers::{Denominator, Integers};
use crate::ground::vocabulary::operator::GroundOperator;
use crate::ground::vocabulary::task::GroundTask;
use crate::lifted::Rational;
use crate::number::{Int, LIMIT};
use crate::task::NumericEffect;
use crate::task::number::TaskNumber;
use crate::task::quantity::{Linear, NumericId};

/// The numeric variables that conditions, numeric effects or objectives read, with the common scale of their
/// values.
pub(super) struct Numbers<N> {
    pub(super) initial: Vec<N>,
    pub(super) names: Vec<String>,
    ids: FxHashMap<NumericId, NumericId>,
    /// Factors by which the values of some numeric variables are multiplied before they are stored; 1 for all others.
    multiples: FxHashMap<NumericId, Int>,
    pub(super) integers: Integers<N>,
}

impl<N: TaskNumber> Numbers<N> {
    pub(super) fn new(task: &GroundTask<'_>, generality: &Generality) -> Result<Self, Error> {
        let mut used = FxHashSet::default();
        let mut denominator = Denominator::new("numeric fluents");
        let mut note = |linear: &Linear<Rational>| {
            used.extend(linear.coefficients.iter().map(|(variable, _)| *variable));
            denominator.quantity(&linear.quantity);
        };
        for condition in task.operators.iter().map(|operator| &operator.condition).chain(&task.goal) {
            condition.comparisons.iter().for_each(|(linear, _)| note(linear));
        }
        for axiom in &task.axioms {
            axiom.body.comparisons.iter().for_each(|(linear, _)| note(linear));
        }
        for operator in &task.operators {
            operator.numeric_effects.iter().for_each(|(_, value)| note(value));
        }
        used.extend(
            task.objectives.iter().flat_map(|objective| objective.rest.iter().map(|(variable, _)| *variable)),
        );
        let mut used: Vec<_> = used.into_iter().collect();
        used.sort_unstable();
        let initial: Vec<_> = used.iter().map(|variable| task.world.initial_value(*variable)).collect();
        denominator.note(|| ("those in conditions and effects".to_owned(), None));
        for (number, variable) in initial.iter().zip(&used) {
            denominator.number(number);
            denominator.note(|| (task.world.numeric_name(*variable), None));
        }
        // Multiples of 1/n become integers as well, if `generality` requires this.
        for precision in generality.numbers.into_iter().chain(generality.precision) {
            denominator.number(&Rational::new(1, precision));
        }
        let names = used.iter().map(|variable| task.world.numeric_name(*variable)).collect();
        let integers = denominator.integers()?;
        let can_choose = N::SCALED && generality.numbers.is_none();
        let multiples = if can_choose { multiples(task) } else { FxHashMap::default() };
        let initial = initial.into_iter().zip(&used).map(|(number, variable)| {
            let multiple = Rational::from_integer(multiples.get(variable).copied().unwrap_or(1));
            integers.number(&(number * &multiple))
        });
        let initial = initial.collect::<Result<_, _>>()?;
        let ids = used.into_iter().zip((0..).map(NumericId)).collect();
        Ok(Self { initial, names, ids, multiples, integers })
    }

    pub(super) fn linear(&mut self, linear: &Linear<Rational>) -> Result<Linear<N>, Error> {
        let overflow = || Error::overflow("a factor of a numeric fluent");
        let coefficients = linear.coefficients.iter().map(|(variable, factor)| {
            Ok((self.ids[variable], N::from_rational(factor, 1).ok_or_else(overflow)?))
        });
        let coefficients = coefficients.collect::<Result<_, Error>>()?;
        Ok(Linear { coefficients, quantity: self.integers.quantity(&linear.quantity)? })
    }

    pub(super) fn rest(&self, rest: &[(NumericId, Rational)]) -> Vec<(NumericId, Rational)> {
        let converted = |(variable, factor): &(NumericId, Rational)| {
            (self.ids[variable], factor.clone() / Rational::from_integer(self.multiple(*variable)))
        };
        rest.iter().map(converted).collect()
    }

    fn multiple(&self, variable: NumericId) -> Int {
        self.multiples.get(&variable).copied().unwrap_or(1)
    }

    /// Returns the multiple of each numeric variable (factor from its original value to its stored value) by id. Empty
    /// if all multiples are 1.
    pub(super) fn multiples(&self) -> Vec<Int> {
        if self.multiples.is_empty() {
            return Vec::new();
        }
        let mut multiples = vec![1; self.initial.len()];
        for (variable, multiple) in &self.multiples {
            if let Some(id) = self.ids.get(variable) {
                multiples[id.index()] = *multiple;
            }
        }
        multiples
    }

    /// Rewrites an expression over the original values of the variables as an expression over their stored values, and
    /// multiplies it by `times`. If there are no multiples, original and stored values are equal, `times` is 1, and the
    /// expression is returned unchanged.
    pub(super) fn stored<'l>(&self, linear: &'l Linear<Rational>, times: Int) -> Cow<'l, Linear<Rational>> {
        if self.multiples.is_empty() {
            return Cow::Borrowed(linear);
        }
        let mut stored = linear.clone();
        stored.scale(&Rational::from_integer(times));
        for (read, factor) in &mut stored.coefficients {
            *factor = factor.clone() / Rational::from_integer(self.multiple(*read));
        }
        Cow::Owned(stored)
    }

    pub(super) fn effects(&mut self, operator: &GroundOperator) -> Result<Vec<NumericEffect<N>>, Error> {
        let mut effects = Vec::new();
        for (variable, value) in operator.numeric_effects.iter() {
            let target = *variable;
            if let Some(variable) = self.ids.get(variable).copied() {
                let value = self.stored(value, self.multiple(target));
                effects.push(NumericEffect { variable, value: self.linear(&value)? });
            }
        }
        Ok(effects)
    }
}

/// Computes a multiple for each numeric variable such that fractional coefficients in effects become integers. For
/// `(increase (x) (* 0.5 (y)))`, twice the value of x is stored. Returns an empty map if no multiples are needed or
/// none are found.
fn multiples(task: &GroundTask<'_>) -> FxHashMap<NumericId, Int> {
    let mut factors: Vec<(NumericId, NumericId, &Rational)> = Vec::new();
    for (variable, value) in task.operators.iter().flat_map(|operator| operator.numeric_effects.iter()) {
        factors.extend(value.coefficients.iter().map(|(read, factor)| (*variable, *read, factor)));
    }
    if factors.iter().all(|(.., factor)| factor.is_integer()) {
        return FxHashMap::default();
    }
    factors.sort_unstable();
    factors.dedup();
    let mut multiples: FxHashMap<NumericId, Int> = FxHashMap::default();
    // With acyclic dependencies, propagation ends after at most as many rounds as there are coefficients.
    for _ in 0..=factors.len() {
        let mut is_changed = false;
        for (variable, read, factor) in &factors {
            let of = |variable: &NumericId| multiples.get(variable).copied().unwrap_or(1);
            // Coefficient between the stored multiples of the two variables.
            let stored = Rational::from_integer(of(variable)) * *factor / Rational::from_integer(of(read));
            if stored.is_integer() {
                continue;
            }
            // The coefficient of a variable on itself is the same for every multiple, so a fractional one
            // cannot be removed.
            let denominator = if variable == read { None } else { stored.denominator() };
            let multiple = denominator
                .and_then(|factor| of(variable).checked_mul(factor))
                .filter(|product| *product < LIMIT);
            let Some(multiple) = multiple else { return FxHashMap::default() };
            multiples.insert(*variable, multiple);
            is_changed = true;
        }
        if !is_changed {
            return multiples;
        }
    }
    FxHashMap::default()
}
