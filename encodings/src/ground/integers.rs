//! Exact rationals to integers: one factor for all numbers of a kind, and each table converted once.

use std::collections::hash_map::Entry;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::error::Error;
use crate::lifted::Rational;
use crate::number::{Int, LIMIT, checked_lcm};
use crate::quantity::{Quantity, Table};

/// The values of a table, and what they are mapped to.
type Mapped<M> = (Arc<[Rational]>, Arc<[M]>);

/// Maps numbers of quantities; tables that operators share stay shared.
#[derive(Debug)]
pub(super) struct TableMap<M> {
    /// By where a table lies; it is kept, so that nothing else can come to lie there.
    done: FxHashMap<*const Rational, Mapped<M>>,
}

impl<M> TableMap<M> {
    pub(super) fn new() -> Self {
        Self { done: FxHashMap::default() }
    }

    pub(super) fn map<E>(
        &mut self,
        quantity: &Quantity<Rational>,
        f: &dyn Fn(&Rational) -> Result<M, E>,
    ) -> Result<Quantity<M>, E> {
        let mut tables = Vec::with_capacity(quantity.tables.len());
        for table in &quantity.tables {
            let values = match self.done.entry(table.values.as_ptr()) {
                Entry::Occupied(known) => &known.into_mut().1,
                Entry::Vacant(new) => {
                    let values = table.values.iter().map(f).collect::<Result<_, _>>()?;
                    &new.insert((table.values.clone(), values)).1
                }
            };
            tables.push(Table { slots: table.slots.clone(), values: values.clone() });
        }
        Ok(Quantity { constant: f(&quantity.constant)?, tables })
    }
}

/// The least factor that makes all numbers of one kind integers.
#[derive(Debug)]
pub(super) struct Denominator {
    what: &'static str,
    /// None if it is too large.
    common: Option<Int>,
    /// Tables that have been looked at.
    seen: FxHashMap<*const Rational, Arc<[Rational]>>,
}

impl Denominator {
    /// `what` names the numbers in errors.
    pub(super) fn new(what: &'static str) -> Self {
        Self { what, common: Some(1), seen: FxHashMap::default() }
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
            if let Entry::Vacant(new) = self.seen.entry(table.values.as_ptr()) {
                let values = new.insert(table.values.clone()).clone();
                values.iter().for_each(|number| self.number(number));
            }
        }
    }

    /// The conversion.
    ///
    /// # Errors
    /// `Error::Overflow` if the factor is too large.
    pub(super) fn integers(self) -> Result<Integers, Error> {
        let scale = self.common.ok_or_else(|| Error::Overflow { what: self.what.into() })?;
        Ok(Integers { what: self.what, scale, tables: TableMap::new() })
    }
}

/// Turns numbers of one kind into integers.
#[derive(Debug)]
pub(super) struct Integers {
    what: &'static str,
    pub(super) scale: Int,
    tables: TableMap<Int>,
}

impl Integers {
    pub(super) fn number(&self, number: &Rational) -> Result<Int, Error> {
        integer(number, self.scale, self.what)
    }

    pub(super) fn quantity(&mut self, quantity: &Quantity<Rational>) -> Result<Quantity<Int>, Error> {
        let (scale, what) = (self.scale, self.what);
        self.tables.map(quantity, &|number| integer(number, scale, what))
    }
}

fn integer(number: &Rational, scale: Int, what: &str) -> Result<Int, Error> {
    let scaled = (number.clone() * &Rational::from_integer(scale)).to_int();
    scaled.filter(|integer| integer.abs() < LIMIT).ok_or_else(|| Error::Overflow { what: what.into() })
}
