//! Numeric effects of ground operators.

use crate::lifted::Rational;
use crate::task::quantity::{Linear, NumericId};

/// Numeric variables that an operator changes, with their new values as expressions over the state before the
/// operator. A sorted list, because an operator changes few variables.
#[derive(Debug, Clone, Default)]
pub struct Numbers {
    changes: Vec<(NumericId, Linear<Rational>)>,
}

impl Numbers {
    pub(crate) fn get(&self, variable: NumericId) -> Option<&Linear<Rational>> {
        let position = self.changes.binary_search_by_key(&variable, |(changed, _)| *changed);
        position.ok().map(|position| &self.changes[position].1)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &(NumericId, Linear<Rational>)> {
        self.changes.iter()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.changes.is_empty()
    }

    pub(crate) fn retain(&mut self, keep: &dyn Fn(NumericId) -> bool) {
        self.changes.retain(|(variable, _)| keep(*variable));
    }

    pub(crate) fn one(variable: NumericId, value: Linear<Rational>) -> Self {
        Self { changes: vec![(variable, value)] }
    }

    pub(crate) fn each(&mut self, change: &mut dyn FnMut(&mut Linear<Rational>)) {
        self.changes.iter_mut().for_each(|(_, value)| change(value));
    }

    pub(crate) fn complete(&mut self, earlier: Self) {
        for (variable, value) in earlier.changes {
            if self.get(variable).is_none() {
                self.insert(variable, value);
            }
        }
    }

    pub(crate) fn insert(&mut self, variable: NumericId, value: Linear<Rational>) {
        match self.changes.binary_search_by_key(&variable, |(own, _)| *own) {
            Ok(position) => self.changes[position].1 = value,
            Err(position) => self.changes.insert(position, (variable, value)),
        }
    }
}
