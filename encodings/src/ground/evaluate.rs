//! The world that grounding looks at, and expressions under a binding of their parameters.

use std::hash::Hash;
use std::num::Wrapping;

use indexmap::{Equivalent, IndexMap, IndexSet};
use rustc_hash::FxBuildHasher;
use smallvec::SmallVec;

use crate::configuration::{SlotParameter, slots_of_expression};
use crate::error::{Error, Place};
use crate::ground::derived::Definitions;
use crate::ground::join::JoinIndex;
use crate::ground::reach::Reached;
use crate::ground::relaxed::Candidates;
use crate::ground::residual::Residual;
use crate::lifted::{
    Arguments, Bound, Expression, Formula, FunctionId, Lifted, ObjectId, PredicateId, Rational, Term,
};
use crate::limits::{Interrupted, Limits, Pulse};
use crate::number::dense;
use crate::quantity::{Linear, NumericId, Quantity, SlotSet, Table};
use pddl::ast::Name;

/// A ground atom over a fluent predicate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct AtomId(pub(crate) u32);

impl AtomId {
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

type AtomIndex<K> = IndexMap<(K, Arguments), (), FxBuildHasher>;

/// Ground atoms, looked up without making one.
pub(crate) type AtomSet = IndexSet<(PredicateId, Arguments), FxBuildHasher>;

/// A symbol and arguments that lie elsewhere; hashes as `(K, Arguments)` does.
#[derive(Hash)]
struct Key<'k, K>(K, &'k [ObjectId]);

impl<K: PartialEq> Equivalent<(K, Arguments)> for Key<'_, K> {
    fn equivalent(&self, (symbol, arguments): &(K, Arguments)) -> bool {
        self.0 == *symbol && *self.1 == **arguments
    }
}

/// Arguments that are looked up and forgotten.
pub(crate) type Row = SmallVec<[ObjectId; 8]>;

/// The static facts and values of a task, and the fluent atoms and numeric variables met so far.
pub(crate) struct World<'a> {
    pub(crate) lifted: &'a Lifted,
    facts: AtomSet,
    values: IndexMap<(FunctionId, Arguments), Rational, FxBuildHasher>,
    reached: &'a Reached,
    pub(crate) atoms: AtomIndex<PredicateId>,
    pub(crate) numerics: AtomIndex<FunctionId>,
    pub(crate) joins: JoinIndex,
    pub(crate) definitions: Definitions,
    /// Whether the condition of an effect is evaluated, which must be defined.
    pub(crate) in_effect: bool,
    pub(crate) limits: Limits,
    /// How many bindings were visited that nothing guards, modulo 2^32.
    pub(crate) visited: Wrapping<u32>,
}

/// Why an expression has no value here.
#[derive(Debug)]
pub(crate) enum Failure {
    /// It reads a function that has no value, or divides by zero: the operator does not exist.
    Undefined,
    /// The planner cannot handle it.
    Error(Error),
}

impl From<Interrupted> for Failure {
    fn from(interrupted: Interrupted) -> Self {
        Self::Error(interrupted.into())
    }
}

/// The objects that the parameters stand for; slots are open.
pub(crate) type Binding = Vec<Option<ObjectId>>;

/// The open slots of the schema at hand with the designs that are left for each.
pub(crate) struct Slots<'a> {
    pub(crate) parameters: &'a [SlotParameter],
    pub(crate) designs: Vec<Vec<ObjectId>>,
}

impl Slots<'_> {
    /// How many designs are left for each.
    pub(crate) fn sizes(&self) -> Vec<usize> {
        self.designs.iter().map(Vec::len).collect()
    }
}

impl<'a> World<'a> {
    pub(crate) fn new(lifted: &'a Lifted, reached: &'a Reached) -> Self {
        Self {
            lifted,
            facts: lifted.facts.iter().chain(&reached.derived).cloned().collect(),
            values: lifted
                .values
                .iter()
                .map(|(f, args, value)| ((*f, args.clone()), value.clone()))
                .collect(),
            reached,
            atoms: IndexMap::default(),
            numerics: IndexMap::default(),
            joins: JoinIndex::default(),
            definitions: Definitions::default(),
            in_effect: false,
            limits: Limits::none(),
            visited: Wrapping(0),
        }
    }

    /// The rows of a relation: of a static one those that hold, of a fluent one those that can ever hold.
    pub(crate) fn relation(&self, predicate: PredicateId) -> Vec<Arguments> {
        let facts =
            if self.lifted.predicates[predicate.index()].fluent { &self.reached.atoms } else { &self.facts };
        facts.iter().filter(|(own, _)| *own == predicate).map(|(_, arguments)| arguments.clone()).collect()
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

    pub(crate) fn atom(&mut self, predicate: PredicateId, arguments: &[ObjectId]) -> AtomId {
        let known = self.atoms.get_index_of(&Key(predicate, arguments));
        AtomId(dense(known.unwrap_or_else(|| self.atoms.insert_full((predicate, arguments.into()), ()).0)))
    }

    /// The predicate and the arguments of an atom.
    pub(crate) fn atom_key(&self, atom: AtomId) -> (&PredicateId, &[ObjectId]) {
        let ((predicate, arguments), ()) =
            self.atoms.get_index(atom.index()).expect("invariant: an atom's number is its place");
        (predicate, arguments)
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

    /// The variable of a numeric fluent, which must have a value from the start; `total-cost` begins at 0.
    pub(crate) fn numeric(
        &mut self,
        function: FunctionId,
        arguments: &[ObjectId],
        place: Place,
    ) -> Result<NumericId, Failure> {
        if let Some(known) = self.numerics.get_index_of(&Key(function, arguments)) {
            return Ok(NumericId::of(known));
        }
        let name = &self.lifted.functions[function.index()].name;
        if self.value(function, arguments).is_none() && *name != Name::new("total-cost") {
            return Err(Failure::Error(Error::Unsupported {
                construct: format!("`{name}` without an initial value"),
                instead: "a value for it in `:init`".into(),
                place,
            }));
        }
        Ok(NumericId(dense(self.numerics.insert_full((function, arguments.into()), ()).0)))
    }

    /// The clock, which begins at 0.
    pub(crate) fn clock(&mut self, function: FunctionId) -> NumericId {
        NumericId(dense(self.numerics.insert_full((function, Box::default()), ()).0))
    }

    /// The arguments under a binding that covers them.
    pub(crate) fn arguments(terms: &[Term], binding: &Binding) -> Row {
        terms
            .iter()
            .filter_map(|term| match term {
                Term::Object(object) => Some(*object),
                Term::Parameter(parameter) => binding[*parameter as usize],
            })
            .collect()
    }

    /// Evaluates an expression that mentions no open slot.
    pub(crate) fn ground(
        &mut self,
        expression: &Expression,
        binding: &Binding,
    ) -> Result<Linear<Rational>, Failure> {
        match expression {
            Expression::Number(number) => Ok(Linear::constant(number.clone())),
            // Only the metric mentions it, and takes it apart before it comes here.
            Expression::TotalTime => Err(Failure::Undefined),
            Expression::Function(function, terms, place) => {
                let arguments = Self::arguments(terms, binding);
                if self.lifted.functions[function.index()].fluent {
                    return Ok(Linear::variable(self.numeric(*function, &arguments, *place)?));
                }
                self.value(*function, &arguments).map(Linear::constant).ok_or(Failure::Undefined)
            }
            Expression::Sum(parts) => {
                let mut sum = Linear::constant(Rational::from_integer(0));
                for part in parts {
                    sum.add(&self.ground(part, binding)?);
                }
                Ok(sum)
            }
            Expression::Negate(inner) => Ok(self.ground(inner, binding)?.negated()),
            Expression::Product(parts, place) => {
                let mut product = Linear::constant(Rational::from_integer(1));
                for part in parts {
                    let factor = self.ground(part, binding)?;
                    product = multiply(product, factor, *place)?;
                }
                Ok(product)
            }
            Expression::Quotient(left, right, place) => {
                let divisor = self.ground(right, binding)?;
                if !divisor.coefficients.is_empty() {
                    return Err(Failure::Error(Error::NonLinear { place: *place }));
                }
                let divisor = divisor.quantity.constant;
                if divisor == Rational::from_integer(0) {
                    return Err(Failure::Undefined);
                }
                let mut value = self.ground(left, binding)?;
                value.scale(&divisor.recip());
                Ok(value)
            }
        }
    }

    /// Evaluates an expression with open slots: sums fall apart into tables over few slots each. Combinations
    /// for which it is undefined are handed to `undefined`, and count as 0.
    pub(crate) fn open(
        &mut self,
        expression: &Expression,
        binding: &mut Binding,
        slots: &Slots<'_>,
        undefined: &mut dyn FnMut(&SlotSet, SlotSet),
    ) -> Result<Linear<Rational>, Failure> {
        let mentioned = slots_of_expression(expression, slots.parameters);
        if mentioned.is_empty() {
            return self.ground(expression, binding);
        }
        match expression {
            Expression::Sum(parts) => {
                let mut sum = Linear::constant(Rational::from_integer(0));
                for part in parts {
                    sum.add(&self.open(part, binding, slots, undefined)?);
                }
                Ok(sum)
            }
            Expression::Negate(inner) => Ok(self.open(inner, binding, slots, undefined)?.negated()),
            Expression::Product(parts, place) => {
                let (open, closed): (Vec<_>, Vec<_>) =
                    parts.iter().partition(|part| !slots_of_expression(part, slots.parameters).is_empty());
                let [part] = open[..] else {
                    return self.table(expression, mentioned, binding, slots, undefined);
                };
                let mut product = self.open(part, binding, slots, undefined)?;
                for factor in closed {
                    let factor = self.ground(factor, binding)?;
                    if !factor.coefficients.is_empty() {
                        return Err(Failure::Error(Error::NonLinear { place: *place }));
                    }
                    product.scale(&factor.quantity.constant);
                }
                Ok(product)
            }
            _ => self.table(expression, mentioned, binding, slots, undefined),
        }
    }

    /// Evaluates an expression for each combination of designs.
    fn table(
        &mut self,
        expression: &Expression,
        mentioned: SlotSet,
        binding: &mut Binding,
        slots: &Slots<'_>,
        undefined: &mut dyn FnMut(&SlotSet, SlotSet),
    ) -> Result<Linear<Rational>, Failure> {
        let mut values = Vec::new();
        let limits = self.limits.clone();
        for_each_combination(&mentioned, slots, binding, &limits, &mut |binding, combination| {
            match self.ground(expression, binding) {
                Ok(linear) => {
                    // What a slot stands beside in a product or quotient is static: else it would be no slot.
                    assert!(linear.coefficients.is_empty(), "invariant: a table has no fluents");
                    values.push(linear.quantity.constant);
                }
                Err(Failure::Undefined) => {
                    values.push(Rational::from_integer(0));
                    undefined(&mentioned, SlotSet::from_slice(combination));
                }
                Err(other) => return Err(other),
            }
            Ok(())
        })?;
        let mut quantity = Quantity::constant(Rational::from_integer(0));
        quantity.add_table(Table { slots: mentioned, values: values.into() });
        Ok(Linear { coefficients: Vec::new(), quantity })
    }
}

/// What is done with the combinations of designs.
type Visit<'v> = dyn FnMut(&Binding, &[u32]) -> Result<(), Failure> + 'v;

/// Binds the mentioned slots to every combination of their designs, the last one fastest.
pub(crate) fn for_each_combination(
    mentioned: &[u32],
    slots: &Slots<'_>,
    binding: &mut Binding,
    limits: &Limits,
    visit: &mut Visit<'_>,
) -> Result<(), Failure> {
    fn go(
        mentioned: &[u32],
        slots: &Slots<'_>,
        binding: &mut Binding,
        chosen: &mut Vec<u32>,
        pulse: &mut Pulse<'_>,
        visit: &mut Visit<'_>,
    ) -> Result<(), Failure> {
        let Some((slot, rest)) = mentioned.split_first() else {
            pulse.beat()?;
            return visit(binding, chosen);
        };
        let parameter = slots.parameters[*slot as usize].parameter as usize;
        for (design, index) in slots.designs[*slot as usize].iter().zip(0..) {
            binding[parameter] = Some(*design);
            chosen.push(index);
            let visited = go(rest, slots, binding, chosen, pulse, visit);
            chosen.pop();
            binding[parameter] = None;
            visited?;
        }
        Ok(())
    }
    go(mentioned, slots, binding, &mut Vec::new(), &mut limits.pulse(), visit)
}

fn multiply(
    left: Linear<Rational>,
    right: Linear<Rational>,
    place: Place,
) -> Result<Linear<Rational>, Failure> {
    let (mut scaled, factor) = match (left.coefficients.is_empty(), right.coefficients.is_empty()) {
        (_, true) => (left, right),
        (true, false) => (right, left),
        (false, false) => return Err(Failure::Error(Error::NonLinear { place })),
    };
    scaled.scale(&factor.quantity.constant);
    Ok(scaled)
}

/// The objects for which a static comparison holds, one for each variable.
#[expect(clippy::arithmetic_side_effects, reason = "variables of a condition are numbered in memory")]
pub(super) fn satisfying(
    lifted: &Lifted,
    comparison: &Formula,
    variables: &[u32],
    candidates: &Candidates,
    limits: &Limits,
) -> Result<Vec<Arguments>, Interrupted> {
    let reached = Reached::default();
    let mut world = World::new(lifted, &reached);
    world.limits = limits.clone();
    let bound: Vec<_> = variables
        .iter()
        .filter_map(|v| Some(Bound { variable: *v, candidates: candidates.get(v)?.clone() }))
        .collect();
    let mut binding = vec![None; variables.iter().max().map_or(0, |v| *v as usize + 1)];
    let mut rows = Vec::new();
    world.each_binding(&bound, &[], &mut binding, &mut |world, binding| {
        if matches!(world.residual(comparison, binding), Ok(Residual::True)) {
            rows.push(variables.iter().filter_map(|v| binding[*v as usize]).collect());
        }
        true
    })?;
    // What was cut short above counts as not satisfied.
    limits.check()?;
    Ok(rows)
}
