//! Applies a function to the numbers of quantities. Tables that operators share remain shared.

use std::collections::hash_map::Entry;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::number::Rational;
use crate::task::quantity::{Quantity, Table};

type MappedTable<M> = (Arc<[Rational]>, Arc<[M]>);

/// Applies a function to the numbers of quantities. Tables that operators share remain shared.
#[derive(Debug)]
pub struct TableMap<M> {
    /// Original and mapped values by address of the table. The original is kept, so that its address is not
    /// reused.
    done: FxHashMap<*const Rational, MappedTable<M>>,
}

impl<M> Default for TableMap<M> {
    fn default() -> Self {
        Self { done: FxHashMap::default() }
    }
}

impl<M> TableMap<M> {
    /// Applies `f` to all numbers of a quantity. A shared table is mapped only once.
    ///
    /// # Errors
    /// Returns the first error of `f`.
    pub fn map<E>(
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
