//! The numeric variables of a task, in integers.

use std::borrow::Cow;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::error::Error;
use crate::ground::config::Generality;
use crate::ground::finish::integers::{Denominator, Integers};
use crate::ground::vocabulary::operator::GroundOperator;
use crate::ground::vocabulary::task::GroundTask;
use crate::lifted::Rational;
use crate::number::{Int, LIMIT, checked_lcm};
use crate::task::NumericEffect;
use crate::task::number::TaskNumber;
use crate::task::quantity::{Linear, NumericId};

/// The numeric variables that conditions depend on, with the factor that makes all their values integers.
pub(super) struct Numbers<N> {
    pub(super) initial: Vec<N>,
    pub(super) names: Vec<String>,
    ids: FxHashMap<NumericId, NumericId>,
    /// Of fluents that are only measured: by what they are multiplied, so that what adds to them are integers.
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
        used.extend(task.objectives.iter().flat_map(|own| own.rest.iter().map(|(variable, _)| *variable)));
        let mut used: Vec<_> = used.into_iter().collect();
        used.sort_unstable();
        let initial: Vec<_> = used.iter().map(|variable| task.world.initial_value(*variable)).collect();
        denominator.note(|| "those in conditions and effects".to_owned());
        for (number, variable) in initial.iter().zip(&used) {
            denominator.number(number);
            denominator.note(|| task.world.numeric_name(*variable));
        }
        if let Some(precision) = generality.numbers {
            denominator.number(&Rational::new(1, precision));
        }
        let names = used.iter().map(|variable| task.world.numeric_name(*variable)).collect();
        let integers = denominator.integers()?;
        let multiples = if N::SCALED { multiples(task) } else { FxHashMap::default() };
        let initial = initial.into_iter().zip(&used).map(|(number, variable)| {
            let multiple = Rational::from_integer(multiples.get(variable).copied().unwrap_or(1));
            integers.number(&(number * &multiple))
        });
        let initial = initial.collect::<Result<_, _>>()?;
        let ids = used.into_iter().zip((0..).map(NumericId)).collect();
        Ok(Self { initial, names, ids, multiples, integers })
    }

    pub(super) fn linear(&mut self, linear: &Linear<Rational>) -> Result<Linear<N>, Error> {
        let overflow = || Error::Overflow { what: "a factor of a numeric fluent".into() };
        let coefficients = linear.coefficients.iter().map(|(variable, factor)| {
            Ok((self.ids[variable], N::from_rational(factor, 1).ok_or_else(overflow)?))
        });
        let coefficients = coefficients.collect::<Result<_, Error>>()?;
        Ok(Linear { coefficients, quantity: self.integers.quantity(&linear.quantity)? })
    }

    /// Fluents with their factors.
    pub(super) fn rest(&self, rest: &[(NumericId, Rational)]) -> Vec<(NumericId, Rational)> {
        let own = |(variable, factor): &(NumericId, Rational)| {
            let multiple = self.multiples.get(variable).copied().unwrap_or(1);
            (self.ids[variable], factor.clone() / Rational::from_integer(multiple))
        };
        rest.iter().map(own).collect()
    }

    pub(super) fn effects(&mut self, operator: &GroundOperator) -> Result<Vec<NumericEffect<N>>, Error> {
        let mut effects = Vec::new();
        for (variable, value) in operator.numeric_effects.iter() {
            let own = *variable;
            if let Some(variable) = self.ids.get(variable).copied() {
                let mut value = Cow::Borrowed(value);
                if let Some(multiple) = self.multiples.get(&own).filter(|multiple| **multiple != 1) {
                    let scaled = value.to_mut();
                    scaled.scale(&Rational::from_integer(*multiple));
                    for (_, factor) in scaled.coefficients.iter_mut().filter(|(read, _)| *read == own) {
                        *factor = factor.clone() / Rational::from_integer(*multiple);
                    }
                }
                effects.push(NumericEffect { variable, value: self.linear(&value)? });
            }
        }
        Ok(effects)
    }
}

/// By what fluents are multiplied that a metric counts in the end, and that nothing else reads: the denominators of the factors by
/// which others add to them.
fn multiples(task: &GroundTask<'_>) -> FxHashMap<NumericId, Int> {
    let mut multiples: FxHashMap<NumericId, Option<Int>> = FxHashMap::default();
    multiples.extend(task.objectives.iter().flat_map(|own| own.rest.iter().map(|(own, _)| (*own, Some(1)))));
    if multiples.is_empty() {
        return FxHashMap::default();
    }
    let conditions = task.operators.iter().map(|operator| &operator.condition).chain(&task.goal);
    let bodies = task.axioms.iter().map(|axiom| &axiom.body);
    for (linear, _) in conditions.chain(bodies).flat_map(|condition| &condition.comparisons) {
        for (read, _) in &linear.coefficients {
            multiples.remove(read);
        }
    }
    for (variable, value) in task.operators.iter().flat_map(|operator| operator.numeric_effects.iter()) {
        for (read, factor) in &value.coefficients {
            if read != variable {
                multiples.remove(read);
                if let Some(Some(known)) = multiples.get(variable) {
                    let common = factor.denominator().and_then(|own| checked_lcm(*known, own));
                    multiples.insert(*variable, common.filter(|common| *common < LIMIT));
                }
            }
        }
    }
    multiples.into_iter().filter_map(|(variable, multiple)| Some((variable, multiple?))).collect()
}
