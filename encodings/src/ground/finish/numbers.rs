//! The numeric variables of a task, in integers.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::error::Error;
use crate::ground::config::Generality;
use crate::ground::finish::integers::{Denominator, Integers};
use crate::ground::vocabulary::operator::GroundOperator;
use crate::ground::vocabulary::task::GroundTask;
use crate::lifted::Rational;
use crate::task::NumericEffect;
use crate::task::number::TaskNumber;
use crate::task::quantity::{Linear, NumericId};

/// The numeric variables that conditions depend on, with the factor that makes all their values integers.
pub(super) struct Numbers<N> {
    pub(super) initial: Vec<N>,
    pub(super) names: Vec<String>,
    ids: FxHashMap<NumericId, NumericId>,
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
        let initial = initial.iter().map(|number| integers.number(number)).collect::<Result<_, _>>()?;
        let ids = used.into_iter().zip((0..).map(NumericId)).collect();
        Ok(Self { initial, names, ids, integers })
    }

    pub(super) fn linear(&mut self, linear: &Linear<Rational>) -> Result<Linear<N>, Error> {
        let overflow = || Error::Overflow { what: "a factor of a numeric fluent".into() };
        let coefficients = linear.coefficients.iter().map(|(variable, factor)| {
            Ok((self.ids[variable], N::from_rational(factor, 1).ok_or_else(overflow)?))
        });
        let coefficients = coefficients.collect::<Result<_, Error>>()?;
        Ok(Linear { coefficients, quantity: self.integers.quantity(&linear.quantity)? })
    }

    pub(super) fn effects(&mut self, operator: &GroundOperator) -> Result<Vec<NumericEffect<N>>, Error> {
        let mut effects = Vec::new();
        for (variable, value) in operator.numeric_effects.iter() {
            if let Some(variable) = self.ids.get(variable).copied() {
                effects.push(NumericEffect { variable, value: self.linear(value)? });
            }
        }
        Ok(effects)
    }
}
