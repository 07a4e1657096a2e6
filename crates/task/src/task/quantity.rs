//! Quantities, for example costs and durations, whose values depend on the designs that an operator selects.
//!
//! A quantity is a constant plus tables over slots. Tables keep the quantity factored: a sum over k functions
//! with m designs each has k tables of m entries instead of one table of m^k entries.

use crate::number::Int;
use crate::task::dense_ids::dense_ids;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

use smallvec::SmallVec;

/// A set of slots, as ascending positions in an operator's slot list. Also the type of a combination of designs: one
/// index for each slot of a set.
pub type SlotSet = SmallVec<[u32; 2]>;

/// A value for each combination of suitable designs of some slots.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table<N> {
    pub slots: SlotSet,
    /// Values in row-major order: the last slot varies fastest. Several operators of a schema may share the
    /// values.
    pub values: Arc<[N]>,
}

/// Hashes the slots and the first value only, because tables are long and rarely differ elsewhere.
impl<N: Hash> Hash for Table<N> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        (&self.slots, self.values.first()).hash(state);
    }
}

/// A quantity: a constant plus one table entry per table, selected by the designs of the slots.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct Quantity<N> {
    pub constant: N,
    pub tables: Vec<Table<N>>,
}

/// A linear expression: a weighted sum of numeric variables plus a quantity that depends on designs.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct Linear<N> {
    /// Numeric variables with their non-zero coefficients, in ascending order of the variables.
    pub coefficients: Vec<(NumericId, N)>,
    pub quantity: Quantity<N>,
}

/// Id of a numeric variable of a ground task.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NumericId(pub u32);

dense_ids!(NumericId);

/// Arithmetic that quantities require.
pub trait Number:
    Clone
    + PartialEq
    + Ord
    + num_traits::Zero
    + num_traits::One
    + std::ops::Neg<Output = Self>
    + std::ops::Mul<Output = Self>
{
}

impl<N> Number for N where
    N: Clone
        + PartialEq
        + Ord
        + num_traits::Zero
        + num_traits::One
        + std::ops::Neg<Output = N>
        + std::ops::Mul<Output = N>
{
}

impl<N: Number> Quantity<N> {
    pub fn constant(constant: N) -> Self {
        Self { constant, tables: Vec::new() }
    }

    pub fn is_zero(&self) -> bool {
        self.constant.is_zero() && self.tables.is_empty()
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "where they are machine integers, the numbers of a quantity fit together (TaskNumber::fits), whatever their signs"
    )]
    pub(crate) fn add(&mut self, other: &Self) {
        self.constant = self.constant.clone() + other.constant.clone();
        for table in &other.tables {
            self.add_table(table.clone());
        }
    }

    /// Adds a table. If there is already a table over the same slots, the values are added to its values. A table whose
    /// values are all equal is added to the constant instead.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "where they are machine integers, the numbers of a quantity fit together (TaskNumber::fits), whatever their signs"
    )]
    pub fn add_table(&mut self, table: Table<N>) {
        match self.tables.iter_mut().find(|present| present.slots == table.slots) {
            Some(present) => {
                let sums = present.values.iter().zip(table.values.iter());
                present.values = sums.map(|(value, more)| value.clone() + more.clone()).collect();
            }
            None => self.tables.push(table),
        }
        // Sorted tables make equal quantities comparable.
        self.tables.sort_by(|a, b| a.slots.cmp(&b.slots));
        self.fold_constant_tables();
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "where they are machine integers, the numbers of a quantity fit together (TaskNumber::fits), whatever their signs"
    )]
    fn fold_constant_tables(&mut self) {
        let constant = &mut self.constant;
        self.tables.retain(|table| {
            let Some(first) = table.values.first() else { return false };
            let uniform = table.values.iter().all(|value| value == first);
            if uniform {
                *constant = constant.clone() + first.clone();
            }
            !uniform
        });
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "where they are machine integers, the numbers of a quantity fit together (TaskNumber::fits), whatever their signs"
    )]
    pub(crate) fn scale(&mut self, factor: &N) {
        if factor.is_one() {
            return;
        }
        self.constant = self.constant.clone() * factor.clone();
        for table in &mut self.tables {
            table.values = table.values.iter().map(|value| value.clone() * factor.clone()).collect();
        }
        self.fold_constant_tables();
    }

    /// Returns the sum of the tables whose slots are all contained in `slots`, for a combination of designs.
    /// The constant is not included.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "where they are machine integers, the numbers of a quantity fit together (TaskNumber::fits), whatever their signs"
    )]
    pub fn part(&self, slots: &[u32], choice: &[u32], sizes: &[usize]) -> N {
        let tables = self.tables.iter().filter(|table| table.slots.iter().all(|slot| slots.contains(slot)));
        tables
            .map(|table| table.values[table.index(choice, sizes)].clone())
            .fold(N::zero(), |sum, value| sum + value)
    }

    /// Returns the value for a combination of designs: the slot at position `i` has its suitable design
    /// number `choice[i]`. `sizes` is the number of suitable designs of each slot.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "where they are machine integers, the numbers of a quantity fit together (TaskNumber::fits), whatever their signs"
    )]
    pub fn at(&self, choice: &[u32], sizes: &[usize]) -> N {
        let chosen = self.tables.iter().map(|table| table.values[table.index(choice, sizes)].clone());
        chosen.fold(self.constant.clone(), |sum, value| sum + value)
    }
}

impl<N: Number> Quantity<N> {
    /// Returns the constant plus the minimum of each table. This is a lower bound, and exact if no two tables
    /// share a slot and no combination of designs is forbidden.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "where they are machine integers, the numbers of a quantity fit together (TaskNumber::fits), whatever their signs"
    )]
    pub fn minimum(&self) -> N {
        let least = self.tables.iter().filter_map(|table| table.values.iter().min());
        least.fold(self.constant.clone(), |sum, value| sum + value.clone())
    }
}

impl Quantity<Int> {
    /// Returns the constant plus the maximum of each table, which is an upper bound.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "where they are machine integers, the numbers of a quantity fit together (TaskNumber::fits), whatever their signs"
    )]
    pub fn maximum(&self) -> Int {
        self.constant
            + self.tables.iter().map(|table| table.values.iter().max().copied().unwrap_or(0)).sum::<Int>()
    }
}

impl<N> Table<N> {
    #[expect(clippy::arithmetic_side_effects, reason = "a position in the table, which is in memory")]
    fn index(&self, choice: &[u32], sizes: &[usize]) -> usize {
        self.slots
            .iter()
            .fold(0, |index, slot| index * sizes[*slot as usize] + choice[*slot as usize] as usize)
    }
}

impl<N: Number> Linear<N> {
    pub fn constant(constant: N) -> Self {
        Self { coefficients: Vec::new(), quantity: Quantity::constant(constant) }
    }

    pub fn variable(variable: NumericId) -> Self {
        Self { coefficients: vec![(variable, N::one())], quantity: Quantity::constant(N::zero()) }
    }

    pub fn add(&mut self, other: &Self) {
        for (variable, factor) in &other.coefficients {
            self.add_coefficient(*variable, factor.clone());
        }
        self.quantity.add(&other.quantity);
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "where they are machine integers, the numbers of a quantity fit together (TaskNumber::fits), whatever their signs"
    )]
    fn add_coefficient(&mut self, variable: NumericId, factor: N) {
        match self.coefficients.binary_search_by_key(&variable, |(v, _)| *v) {
            Ok(position) => {
                let sum = self.coefficients[position].1.clone() + factor;
                if sum.is_zero() {
                    self.coefficients.remove(position);
                } else {
                    self.coefficients[position].1 = sum;
                }
            }
            Err(position) => self.coefficients.insert(position, (variable, factor)),
        }
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "where they are machine integers, the numbers of a quantity fit together (TaskNumber::fits), whatever their signs"
    )]
    pub(crate) fn scale(&mut self, factor: &N) {
        if factor.is_zero() {
            *self = Self::constant(N::zero());
            return;
        }
        for (_, coefficient) in &mut self.coefficients {
            *coefficient = coefficient.clone() * factor.clone();
        }
        self.quantity.scale(factor);
    }

    #[expect(clippy::arithmetic_side_effects, reason = "the negation of 1")]
    #[must_use]
    pub fn negated(mut self) -> Self {
        self.scale(&-N::one());
        self
    }
}
