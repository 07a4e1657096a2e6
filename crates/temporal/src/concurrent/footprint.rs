//! Read and write sets of happenings, for the PDDL 2.1 rule of no moving targets \[1\].
//!
//! A happening reads every atom and number that its condition, the conditions of its effects, or assigned
//! values mention, even if the value does not matter in some states. This includes all instances of atoms with
//! quantified variables, and all atoms on which a derived predicate depends. What an effect changes is written,
//! not read.
//!
//! \[1\] M. Fox, D. Long: PDDL2.1, JAIR 20, 2003, section 8.4.

use rustc_hash::FxHashMap;

use pddl::ast::Assignment;
use task::error::Error;
use task::ground::evaluate::condition::residual;
use task::ground::evaluate::expression::ground;
use task::ground::evaluate::join::each_binding;
use task::ground::evaluate::reads::{Reads, Slot, fits};
use task::ground::vocabulary::atom::{AtomId, Binding, arguments};
use task::ground::vocabulary::eval_error::Failure;
use task::ground::vocabulary::partial_eval::Residual;
use task::ground::vocabulary::world::World;
use task::lifted::{Change, Effect, Expression, FunctionId, ObjectId, PredicateId, Rational};
use task::number::dense;
use task::task::quantity::NumericId;

/// Kind of a numeric effect. Two effects on one number commute if both are `Add` or both are
/// `Scale`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum Way {
    Assign,
    Add,
    Scale,
}

/// Read and write sets of a happening, ascending. The ids belong to the `World` of [`Footprints`],
/// not to the ground task.
#[derive(Debug, Clone, Default)]
pub(super) struct Footprint {
    pub(super) reads: Vec<AtomId>,
    pub(super) reads_numbers: Vec<NumericId>,
    pub(super) added: Vec<AtomId>,
    pub(super) deleted: Vec<AtomId>,
    pub(super) numbers: Vec<(NumericId, Way)>,
}

impl Footprint {
    /// Returns `true` if the order of two happenings matters: one writes an atom or number that the
    /// other reads, or both write an atom or number and their effects do not commute.
    pub(super) fn interferes(&self, other: &Self) -> bool {
        let clash = |(number, way): &(NumericId, Way)| {
            let mut ways = other.numbers.iter().filter(|(candidate, _)| candidate == number);
            ways.any(|(_, other_way)| other_way != way || *way == Way::Assign)
        };
        self.disturbs(other) || other.disturbs(self) || self.numbers.iter().any(clash)
    }

    /// Returns `true` if this happening writes an atom or number that `other` reads, or adds an
    /// atom that `other` deletes.
    fn disturbs(&self, other: &Self) -> bool {
        let mut written = self.added.iter().chain(&self.deleted);
        written.any(|atom| other.reads.binary_search(atom).is_ok())
            || self.added.iter().any(|atom| other.deleted.binary_search(atom).is_ok())
            || self.numbers.iter().any(|(number, _)| other.reads_numbers.binary_search(number).is_ok())
    }
}

pub(super) struct Footprints<'a> {
    world: World<'a>,
    /// `true` if some write set contains an effect whose condition depends on the state.
    pub(super) supposes: bool,
}

impl<'a> Footprints<'a> {
    pub(super) fn new(world: World<'a>) -> Self {
        Self { world, supposes: false }
    }

    /// Returns the write set of the effects for a binding of the parameters, including conditional effects
    /// that may apply. Effects whose conditions are undefined are ignored.
    ///
    /// # Errors
    /// Fails if an effect cannot be evaluated, for example because a number has no initial value, or if the
    /// computation is interrupted.
    pub(super) fn writes(&mut self, effects: &[Effect], binding: &Binding) -> Result<Footprint, Error> {
        let mut footprint = Footprint::default();
        for effect in effects {
            let mut bindings = Vec::new();
            let mut partial_binding = binding.clone();
            each_binding(&mut self.world, &effect.bound, &[], &mut partial_binding, &mut |_, binding| {
                bindings.push(binding.clone());
                true
            })?;
            for mut binding in bindings {
                match residual(&mut self.world, &effect.condition, &mut binding) {
                    Ok(Residual::True) => self.write(&effect.change, &binding, &mut footprint)?,
                    Ok(Residual::False) | Err(Failure::Undefined) => {}
                    // The effect may apply or not, depending on the state. A possible write
                    // suffices for interference.
                    Ok(_) => {
                        self.supposes = true;
                        self.write(&effect.change, &binding, &mut footprint)?;
                    }
                    Err(Failure::Error(error)) => return Err(error),
                }
            }
        }
        let Footprint { added, deleted, numbers, .. } = &mut footprint;
        for atoms in [added, deleted] {
            atoms.sort_unstable();
            atoms.dedup();
        }
        numbers.sort_unstable();
        // The ground operator exists, so its effects on one number are compatible.
        numbers.dedup();
        Ok(footprint)
    }

    /// Returns the constant value of an expression. Returns `None` if the expression is undefined
    /// or depends on the state.
    pub(super) fn constant(
        &mut self,
        expression: &Expression,
        binding: &Binding,
    ) -> Result<Option<Rational>, Error> {
        match ground(&mut self.world, expression, binding) {
            Ok(linear) => Ok(linear.coefficients.is_empty().then_some(linear.quantity.constant)),
            Err(Failure::Undefined) => Ok(None),
            Err(Failure::Error(error)) => Err(error),
        }
    }

    fn write(&mut self, change: &Change, binding: &Binding, into: &mut Footprint) -> Result<(), Error> {
        match change {
            Change::Add(predicate, terms) | Change::Delete(predicate, terms) => {
                let atom = self.world.atom(*predicate, &arguments(terms, binding));
                let target =
                    if matches!(change, Change::Add(..)) { &mut into.added } else { &mut into.deleted };
                target.push(atom);
            }
            Change::Assign { assignment, function, terms, place, .. } => {
                let way = match assignment {
                    Assignment::Assign => Way::Assign,
                    Assignment::Increase | Assignment::Decrease => Way::Add,
                    Assignment::ScaleUp | Assignment::ScaleDown => Way::Scale,
                };
                match self.world.numeric(*function, &arguments(terms, binding), *place) {
                    Ok(number) => into.numbers.push((number, way)),
                    Err(Failure::Undefined) => {}
                    Err(Failure::Error(error)) => return Err(error),
                }
            }
        }
        Ok(())
    }

    pub(super) fn index(&self) -> WriteIndex {
        let mut written = WriteIndex::default();
        for (index, (predicate, arguments)) in self.world.atoms.keys().enumerate() {
            let entry = written.atoms.entry(*predicate).or_default();
            entry.push((arguments.clone(), AtomId(dense(index))));
        }
        for (index, (function, arguments)) in self.world.numerics.keys().enumerate() {
            let entry = written.numbers.entry(*function).or_default();
            entry.push((arguments.clone(), NumericId(dense(index))));
        }
        written.exact = written
            .atoms
            .iter()
            .flat_map(|(predicate, rows)| {
                rows.iter().map(|(arguments, atom)| ((*predicate, arguments.to_vec()), *atom))
            })
            .collect();
        written
    }
}

type Rows<V> = Vec<(Box<[ObjectId]>, V)>;

#[derive(Default)]
pub(super) struct WriteIndex {
    atoms: FxHashMap<PredicateId, Rows<AtomId>>,
    numbers: FxHashMap<FunctionId, Rows<NumericId>>,
    exact: FxHashMap<(PredicateId, Vec<ObjectId>), AtomId>,
}

impl WriteIndex {
    /// Returns the written atoms and numbers that match the read patterns, each ascending.
    pub(super) fn look_up(&self, reads: &Reads) -> (Vec<AtomId>, Vec<NumericId>) {
        let (mut atoms, mut numbers) = (Vec::new(), Vec::new());
        for (predicate, pattern) in &reads.atoms {
            let object = |slot: &Slot| if let Slot::Object(object) = slot { Some(*object) } else { None };
            let whole =
                pattern.as_ref().and_then(|pattern| pattern.iter().map(object).collect::<Option<Vec<_>>>());
            match whole {
                Some(arguments) => atoms.extend(self.exact.get(&(*predicate, arguments))),
                None => matching(self.atoms.get(predicate), pattern.as_deref(), &mut atoms),
            }
        }
        for (function, pattern) in &reads.numbers {
            matching(self.numbers.get(function), pattern.as_deref(), &mut numbers);
        }
        atoms.sort_unstable();
        atoms.dedup();
        numbers.sort_unstable();
        numbers.dedup();
        (atoms, numbers)
    }
}

fn matching<V: Copy>(rows: Option<&Rows<V>>, pattern: Option<&[Slot]>, into: &mut Vec<V>) {
    let fits = |arguments: &[ObjectId]| pattern.is_none_or(|pattern| fits(pattern, arguments));
    into.extend(rows.into_iter().flatten().filter(|(arguments, _)| fits(arguments)).map(|(_, value)| *value));
}
