//! Static facts and values, and the fluent atoms and numeric variables found so far.

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

/// Number of steps of enumerations between two looks at the limits.
const BETWEEN_LOOKS: u32 = 256;

type AtomIndex<K> = IndexMap<(K, Arguments), (), FxBuildHasher>;

/// Rows of a relation by the values of some of its columns.
type Rows = FxHashMap<Arguments, Vec<Arguments>>;

/// What grounding looks at, and when it has to stop.
pub struct World<'a> {
    pub(crate) lifted: &'a Lifted,
    pub(crate) limits: &'a Limits,
    pub(crate) reached: &'a RelaxedReachability,
    facts: AtomSet,
    values: IndexMap<(FunctionId, Arguments), Rational, FxBuildHasher>,
    pub atoms: AtomIndex<PredicateId>,
    pub numerics: AtomIndex<FunctionId>,
    /// For a predicate and a set of columns (bit i for column i): rows by the values in those columns.
    joins: FxHashMap<(PredicateId, u64), Rows>,
    /// Steps of enumerations so far, modulo 2^32.
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

    /// Notes a step of an enumeration. Checks the limits every few hundred steps.
    pub(crate) fn visit(&mut self) -> Result<(), Interrupted> {
        self.visited += 1;
        if self.visited.0.is_multiple_of(BETWEEN_LOOKS) {
            self.limits.check()?;
        }
        Ok(())
    }

    /// The rows of a relation: of a static one those that hold, of a fluent one those that can ever hold.
    fn relation(&self, predicate: PredicateId) -> Vec<Arguments> {
        let facts =
            if self.lifted.predicates[predicate.index()].fluent { &self.reached.atoms } else { &self.facts };
        facts.iter().filter(|(own, _)| *own == predicate).map(|(_, arguments)| arguments.clone()).collect()
    }

    /// The rows of a relation that agree with the bound terms, in ascending order.
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
        let mask = columns.fold(0_u64, |mask, (column, _)| mask | (1 << column));
        let key: Vec<ObjectId> = terms.iter().filter_map(value).collect();
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

    /// Whether a fluent atom holds in some state of the delete relaxation.
    pub(crate) fn is_reached(&self, predicate: PredicateId, arguments: &[ObjectId]) -> bool {
        self.reached.atoms.contains(&Key(predicate, arguments))
    }

    pub(crate) fn holds_initially(&self, predicate: PredicateId, arguments: &[ObjectId]) -> bool {
        self.facts.contains(&Key(predicate, arguments))
    }

    /// Whether an atom holds in some state of the delete relaxation.
    pub(crate) fn can_hold(&self, predicate: PredicateId, arguments: &[ObjectId]) -> bool {
        self.holds_initially(predicate, arguments) || self.is_reached(predicate, arguments)
    }

    pub fn atom(&mut self, predicate: PredicateId, arguments: &[ObjectId]) -> AtomId {
        let known = self.atoms.get_index_of(&Key(predicate, arguments));
        AtomId(dense(known.unwrap_or_else(|| self.atoms.insert_full((predicate, arguments.into()), ()).0)))
    }

    /// The predicate and the arguments of an atom.
    pub(crate) fn atom_key(&self, atom: AtomId) -> (&PredicateId, &[ObjectId]) {
        let ((predicate, arguments), ()) =
            self.atoms.get_index(atom.index()).expect("invariant: an atom's number is its place");
        (predicate, arguments)
    }

    /// Whether an atom follows from others.
    pub(crate) fn is_derived(&self, atom: AtomId) -> bool {
        let predicate = self.atoms.get_index(atom.index()).map(|((predicate, _), ())| *predicate);
        predicate.is_none_or(|predicate| {
            self.lifted.predicates.get(predicate.index()).is_none_or(|predicate| predicate.derived)
        })
    }

    /// The function and the arguments of a numeric variable.
    pub(crate) fn numeric_key(&self, variable: NumericId) -> (&FunctionId, &[ObjectId]) {
        let ((function, arguments), ()) =
            self.numerics.get_index(variable.index()).expect("invariant: a variable's number is its place");
        (function, arguments)
    }

    /// The initial value of a numeric fluent, or the value of a static function.
    pub(crate) fn value(&self, function: FunctionId, arguments: &[ObjectId]) -> Option<Rational> {
        self.values.get(&Key(function, arguments)).cloned()
    }

    /// The initial value of a numeric variable; 0 for a `total-cost` to which the file gives none.
    pub(crate) fn initial_value(&self, variable: NumericId) -> Rational {
        let key = self.numerics.get_index(variable.index()).map(|(key, ())| key);
        key.and_then(|(function, arguments)| self.value(*function, arguments)).unwrap_or_else(Rational::zero)
    }

    /// The variable of a numeric fluent, which must have a value from the start; `total-cost` begins at 0.
    ///
    /// # Errors
    /// Fails when the fluent has no initial value.
    pub fn numeric(
        &mut self,
        function: FunctionId,
        arguments: &[ObjectId],
        place: Place,
    ) -> Result<NumericId, Failure> {
        if let Some(known) = self.numerics.get_index_of(&Key(function, arguments)) {
            return Ok(NumericId::of(known));
        }
        let Function { name, partial, .. } = &self.lifted.functions[function.index()];
        let is_set = *partial || *name == Name::new("total-cost");
        if !is_set && self.value(function, arguments).is_none() {
            return Err(Failure::Error(Error::NoValue { name: name.to_string(), place }));
        }
        Ok(NumericId(dense(self.numerics.insert_full((function, arguments.into()), ()).0)))
    }

    /// The clock, which begins at 0.
    pub(crate) fn clock(&mut self, function: FunctionId) -> NumericId {
        NumericId(dense(self.numerics.insert_full((function, Box::default()), ()).0))
    }

    /// Whether an atom holds at the start.
    pub(crate) fn is_initial(&self, atom: AtomId) -> bool {
        let key = self.atoms.get_index(atom.index());
        key.is_some_and(|((predicate, arguments), ())| self.holds_initially(*predicate, arguments))
    }

    /// `(predicate arguments)` as PDDL writes it.
    pub(crate) fn atom_name(&self, atom: AtomId) -> String {
        let found = self.atoms.get_index(atom.index());
        found.map_or_else(String::new, |((predicate, arguments), ())| self.name(*predicate, arguments))
    }

    /// `(function arguments)` as PDDL writes it.
    pub(crate) fn numeric_name(&self, variable: NumericId) -> String {
        let found = self.numerics.get_index(variable.index());
        found.map_or_else(String::new, |((function, arguments), ())| {
            let symbol = self.lifted.functions.get(function.index());
            symbol.map_or_else(String::new, |symbol| self.applied(&symbol.name, arguments))
        })
    }

    /// A predicate with arguments as PDDL writes it; that of a named part of a condition has no name in the files.
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
