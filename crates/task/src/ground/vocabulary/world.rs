//! Initial facts and values of a task, and the tables of fluent atoms and numeric variables that grounding
//! creates.

use std::num::Wrapping;

use indexmap::IndexMap;
use num_traits::Zero;
use rustc_hash::{FxBuildHasher, FxHashMap};

use crate::error::{Error, Place};
use crate::ground::vocabulary::atom::{AtomId, AtomSet, Binding, Key};
use crate::ground::vocabulary::eval_error::Failure;
use crate::ground::vocabulary::reached::RelaxedReachability;
use crate::lifted::{Arguments, Function, FunctionId, Lifted, ObjectId, PredicateId, Rational, Term};
use crate::limits::{Interrupted, Limits};
use crate::number::dense;
use crate::task::quantity::NumericId;
use pddl::ast::Name;

const BETWEEN_LOOKS: u32 = 256;

type AtomIndex<K> = IndexMap<(K, Arguments), (), FxBuildHasher>;

type Rows = FxHashMap<Arguments, Vec<Arguments>>;

/// Working data of grounding: the lifted task, its facts and values, the ids of atoms and numeric variables,
/// and the limits.
pub struct World<'a> {
    pub(crate) lifted: &'a Lifted,
    pub(crate) limits: &'a Limits,
    pub(crate) reached: &'a RelaxedReachability,
    facts: AtomSet,
    values: IndexMap<(FunctionId, Arguments), Rational, FxBuildHasher>,
    pub atoms: AtomIndex<PredicateId>,
    pub numerics: AtomIndex<FunctionId>,
    /// Tuples of a predicate, indexed by their values in some columns. The key holds the predicate and the set
    /// of these columns (bit i for column i).
    joins: FxHashMap<(PredicateId, u64), Rows>,
    visited: Wrapping<u32>,
}

impl<'a> World<'a> {
    pub fn new(lifted: &'a Lifted, reached: &'a RelaxedReachability, limits: &'a Limits) -> Self {
        Self {
            lifted,
            limits,
            reached,
            facts: lifted.facts.iter().chain(&reached.derived).cloned().collect(),
            values: lifted
                .values
                .iter()
                .map(|(f, args, value)| ((*f, args.clone()), value.clone()))
                .collect(),
            atoms: IndexMap::default(),
            numerics: IndexMap::default(),
            joins: FxHashMap::default(),
            visited: Wrapping(0),
        }
    }

    pub(crate) fn visit(&mut self) -> Result<(), Interrupted> {
        self.visited += 1;
        if self.visited.0.is_multiple_of(BETWEEN_LOOKS) {
            self.limits.check()?;
        }
        Ok(())
    }

    fn relation(&self, predicate: PredicateId) -> Vec<Arguments> {
        let facts =
            if self.lifted.predicates[predicate.index()].fluent { &self.reached.atoms } else { &self.facts };
        facts.iter().filter(|(own, _)| *own == predicate).map(|(_, arguments)| arguments.clone()).collect()
    }

    /// Returns the tuples of a predicate that match the objects and bound variables among `terms`, in
    /// ascending order.
    pub(crate) fn rows(
        &mut self,
        predicate: PredicateId,
        terms: &[Term],
        binding: &Binding,
    ) -> Vec<Arguments> {
        let value = |term: &Term| match term {
            Term::Object(object) => Some(*object),
            Term::Parameter(variable) => binding[*variable as usize],
        };
        let columns = terms.iter().enumerate().filter(|(_, term)| value(term).is_some());
        // A 64-bit mask suffices, because guards have at most 64 columns (see `Join::next_guard`).
        let mask = columns.fold(0_u64, |mask, (column, _)| mask | (1 << column));
        let key: Vec<ObjectId> = terms.iter().filter_map(value).collect();
        // The index for a set of columns is built at its first use.
        if !self.joins.contains_key(&(predicate, mask)) {
            let mut rows = Rows::default();
            for row in self.relation(predicate) {
                let key = row.iter().enumerate().filter(|(column, _)| mask & (1 << column) != 0);
                rows.entry(key.map(|(_, object)| *object).collect()).or_default().push(row);
            }
            for rows in rows.values_mut() {
                rows.sort_unstable();
            }
            self.joins.insert((predicate, mask), rows);
        }
        self.joins[&(predicate, mask)].get(key.as_slice()).cloned().unwrap_or_default()
    }

    pub(crate) fn is_reached(&self, predicate: PredicateId, arguments: &[ObjectId]) -> bool {
        self.reached.atoms.contains(&Key(predicate, arguments))
    }

    pub(crate) fn holds_initially(&self, predicate: PredicateId, arguments: &[ObjectId]) -> bool {
        self.facts.contains(&Key(predicate, arguments))
    }

    pub(crate) fn can_hold(&self, predicate: PredicateId, arguments: &[ObjectId]) -> bool {
        self.holds_initially(predicate, arguments) || self.is_reached(predicate, arguments)
    }

    /// Returns the id of an atom; creates the id at the first call.
    pub fn atom(&mut self, predicate: PredicateId, arguments: &[ObjectId]) -> AtomId {
        let index = self.atoms.get_index_of(&Key(predicate, arguments));
        AtomId(dense(index.unwrap_or_else(|| self.atoms.insert_full((predicate, arguments.into()), ()).0)))
    }

    pub(crate) fn atom_key(&self, atom: AtomId) -> (&PredicateId, &[ObjectId]) {
        let ((predicate, arguments), ()) =
            self.atoms.get_index(atom.index()).expect("invariant: an atom's number is its place");
        (predicate, arguments)
    }

    pub(crate) fn is_derived(&self, atom: AtomId) -> bool {
        let predicate = self.atoms.get_index(atom.index()).map(|((predicate, _), ())| *predicate);
        predicate.is_none_or(|predicate| {
            self.lifted.predicates.get(predicate.index()).is_none_or(|predicate| predicate.derived)
        })
    }

    pub(crate) fn numeric_key(&self, variable: NumericId) -> (&FunctionId, &[ObjectId]) {
        let ((function, arguments), ()) =
            self.numerics.get_index(variable.index()).expect("invariant: a variable's number is its place");
        (function, arguments)
    }

    pub(crate) fn value(&self, function: FunctionId, arguments: &[ObjectId]) -> Option<Rational> {
        self.values.get(&Key(function, arguments)).cloned()
    }

    /// Returns the initial value of a numeric variable, or 0 if the problem specifies none (for example for
    /// `total-cost`).
    pub(crate) fn initial_value(&self, variable: NumericId) -> Rational {
        let key = self.numerics.get_index(variable.index()).map(|(key, ())| key);
        key.and_then(|(function, arguments)| self.value(*function, arguments)).unwrap_or_else(Rational::zero)
    }

    /// Returns the id of a numeric fluent and creates the id at the first call. `total-cost` and functions
    /// that may be undefined (with guard conditions) need no initial value.
    ///
    /// # Errors
    /// Any other fluent has no initial value.
    pub fn numeric(
        &mut self,
        function: FunctionId,
        arguments: &[ObjectId],
        place: Place,
    ) -> Result<NumericId, Failure> {
        if let Some(index) = self.numerics.get_index_of(&Key(function, arguments)) {
            return Ok(NumericId::of(index));
        }
        let Function { name, partial, .. } = &self.lifted.functions[function.index()];
        let is_set = *partial || *name == Name::new("total-cost");
        if !is_set && self.value(function, arguments).is_none() {
            return Err(Failure::Error(Error::NoValue { name: name.to_string(), place }));
        }
        Ok(NumericId(dense(self.numerics.insert_full((function, arguments.into()), ()).0)))
    }

    pub(crate) fn clock(&mut self, function: FunctionId) -> NumericId {
        NumericId(dense(self.numerics.insert_full((function, Box::default()), ()).0))
    }

    pub(crate) fn is_initial(&self, atom: AtomId) -> bool {
        let key = self.atoms.get_index(atom.index());
        key.is_some_and(|((predicate, arguments), ())| self.holds_initially(*predicate, arguments))
    }

    pub(crate) fn atom_name(&self, atom: AtomId) -> String {
        let key = self.atoms.get_index(atom.index());
        key.map_or_else(String::new, |((predicate, arguments), ())| self.name(*predicate, arguments))
    }

    pub(crate) fn numeric_name(&self, variable: NumericId) -> String {
        let key = self.numerics.get_index(variable.index());
        key.map_or_else(String::new, |((function, arguments), ())| {
            let symbol = self.lifted.functions.get(function.index());
            symbol.map_or_else(String::new, |symbol| self.applied(&symbol.name, arguments))
        })
    }

    pub(crate) fn name(&self, predicate: PredicateId, arguments: &[ObjectId]) -> String {
        let Some(symbol) = self.lifted.predicates.get(predicate.index()) else {
            let number = arguments.first().map_or(0, |number| number.0);
            return format!("condition {number}");
        };
        self.applied(&symbol.name, arguments)
    }

    fn applied(&self, symbol: &Name, arguments: &[ObjectId]) -> String {
        let mut text = format!("({symbol}");
        for object in arguments {
            text.push(' ');
            text.push_str(self.lifted.objects[object.index()].as_str());
        }
        text.push(')');
        text
    }
}
