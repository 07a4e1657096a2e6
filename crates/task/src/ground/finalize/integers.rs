//! Converts exact rationals to the number type of the task. For integers, numbers are multiplied by a common
//! factor for each kind of number (for example costs). Shared tables are converted only once.

use std::collections::hash_map::Entry;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::error::{Error, Place};
use crate::lifted::Rational;
use crate::number::{Int, LIMIT, checked_lcm};
use crate::task::number::TaskNumber;
use crate::task::quantity::Quantity;
use crate::task::table_map::TableMap;

#[derive(Debug, Clone, Copy)]
struct Origin {
    what: &'static str,
    place: Option<Place>,
}

impl Origin {
    fn overflow(self) -> Error {
        Error::Overflow { what: self.what.to_owned(), place: self.place }
    }
}

#[derive(Debug)]
pub(super) struct Denominator {
    origin: Origin,
    /// Least common denominator of the visited numbers; `None` on overflow.
    common: Option<Int>,
    culprit: Option<(String, Option<Place>)>,
    seen: FxHashMap<*const Rational, Arc<[Rational]>>,
}

impl Denominator {
    pub(super) fn new(what: &'static str) -> Self {
        Self::of(Origin { what, place: None })
    }

    /// Creates an empty common denominator for an objective at `place` that replaces the metric.
    pub(super) fn of_objective(place: Place) -> Self {
        Self::of(Origin { what: "the objective", place: Some(place) })
    }

    fn of(origin: Origin) -> Self {
        Self { origin, common: Some(1), culprit: None, seen: FxHashMap::default() }
    }

    pub(super) fn number(&mut self, number: &Rational) {
        if let Some(common) = self.common
            && !number.is_integer()
        {
            let next = number.denominator().and_then(|denominator| checked_lcm(common, denominator));
            self.common = next.filter(|next| *next < LIMIT);
        }
    }

    pub(super) fn quantity(&mut self, quantity: &Quantity<Rational>) {
        self.number(&quantity.constant);
        for table in &quantity.tables {
            // The stored clone keeps the table alive, so that its address stays unique.
            if let Entry::Vacant(new) = self.seen.entry(table.values.as_ptr()) {
                let values = new.insert(table.values.clone()).clone();
                values.iter().for_each(|number| self.number(number));
            }
        }
    }

    /// Records the name and source location of the most recent number if that number caused the overflow.
    pub(super) fn note(&mut self, place: impl FnOnce() -> (String, Option<Place>)) {
        if self.common.is_none() && self.culprit.is_none() {
            self.culprit = Some(place());
        }
    }

    /// Returns the conversion to `N`. Integers are scaled by the accumulated denominator; rationals are not scaled.
    pub(super) fn integers<N: TaskNumber>(self) -> Result<Integers<N>, Error> {
        let common = if N::SCALED { self.common } else { Some(1) };
        let overflow = || {
            let error = self.origin.overflow();
            self.culprit.iter().fold(error, |error, (name, place)| error.within(name, *place))
        };
        let scale = common.ok_or_else(overflow)?;
        Ok(Integers { origin: self.origin, scale, tables: TableMap::default() })
    }
}

#[derive(Debug)]
pub(super) struct Integers<N> {
    origin: Origin,
    pub(super) scale: Int,
    tables: TableMap<N>,
}

impl<N: TaskNumber> Integers<N> {
    pub(super) fn number(&self, number: &Rational) -> Result<N, Error> {
        integer(number, self.scale, self.origin)
    }

    pub(super) fn quantity(&mut self, quantity: &Quantity<Rational>) -> Result<Quantity<N>, Error> {
        let (scale, origin) = (self.scale, self.origin);
        let scaled = self.tables.map(quantity, &|number| integer(number, scale, origin))?;
        if N::fits(&scaled) { Ok(scaled) } else { Err(origin.overflow()) }
    }
}

fn integer<N: TaskNumber>(number: &Rational, scale: Int, origin: Origin) -> Result<N, Error> {
    N::from_rational(number, scale).ok_or_else(|| origin.overflow())
}

#[cfg(test)]
mod tests {
    use num_traits::Zero;

    use super::*;
    use crate::task::quantity::Table;

    fn quantity(tables: u32, number: Int) -> Quantity<Rational> {
        let values: Arc<[Rational]> = [Rational::zero(), Rational::from_integer(number)].into();
        let table = |slot| Table { slots: [slot].into_iter().collect(), values: values.clone() };
        Quantity { constant: Rational::zero(), tables: (0..tables).map(table).collect() }
    }

    #[test]
    fn sums_of_tables_beyond_the_limit_are_rejected() {
        let number = LIMIT - 1;
        for (tables, number, fits) in [
            (1, number, true),
            (31, number, true),
            (32, number, true),
            (33, number, false),
            (33, -number, false),
            (600, number, false),
            (600, 1 << 113, true),
        ] {
            let mut integers: Integers<Int> = Denominator::new("costs").integers().expect("a factor");
            let converted = integers.quantity(&quantity(tables, number));
            assert_eq!(converted.is_ok(), fits, "{tables} tables of {number}");
            if let Ok(converted) = converted {
                let (choice, sizes) = (vec![1; tables as usize], vec![2; tables as usize]);
                assert_eq!(converted.at(&choice, &sizes), Int::from(tables) * number);
            }
        }
    }
}
