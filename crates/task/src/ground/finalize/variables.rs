//! Assigns atoms to the values of finite-domain variables.

use rustc_hash::FxHashSet;

use crate::ground::finalize::mutex_groups;
use crate::ground::vocabulary::atom::AtomId;
use crate::ground::vocabulary::condition::GroundLiteral;
use crate::ground::vocabulary::operator::GroundOperator;
use crate::ground::vocabulary::task::GroundTask;
use crate::limits::Interrupted;
use crate::number::dense;
use crate::task::{ConditionalEffect, Fact, Literal, Variable, VariableId};

pub(super) struct Atoms {
    pub(super) variables: Vec<Variable>,
    pub(super) basic: usize,
    pub(super) initial: Vec<u32>,
    /// Fact of each atom; `None` if nothing reads the atom.
    facts: Vec<Option<Fact>>,
    /// For each variable, the value for "none of these atoms".
    pub(super) none: Vec<u32>,
    /// Mutex groups of which some facts are values of other variables, so that no variable expresses
    /// the whole group. See [`exclusive`](crate::task::Task::exclusive).
    pub(super) exclusive: Vec<Vec<Fact>>,
}

impl Atoms {
    pub(super) fn new(task: &GroundTask<'_>) -> Result<Self, Interrupted> {
        let limits = task.world.limits;
        let mut relevant = task.read_atoms();
        let mut derived: Vec<AtomId> =
            relevant.iter().copied().filter(|atom| task.world.is_derived(*atom)).collect();
        derived.sort_unstable();
        relevant.retain(|atom| !task.world.is_derived(*atom));
        let mut exclusive = Vec::new();
        let mut groups = Vec::new();
        for group in mutex_groups::groups(task, &relevant)? {
            // Some atoms of the group may be values of other variables, so the variable does not express the
            // whole group.
            if group.exclusive.len() > group.atoms.len() {
                exclusive.push(group.exclusive);
            }
            groups.push(group.atoms);
        }
        let grouped: FxHashSet<AtomId> = groups.iter().flatten().copied().collect();
        groups.extend(relevant.iter().filter(|atom| !grouped.contains(atom)).map(|atom| vec![*atom]));
        // Sorted, so that the numbers of variables are reproducible.
        groups.sort_unstable();
        let mut atoms = Self {
            variables: Vec::new(),
            basic: groups.len(),
            initial: Vec::new(),
            facts: vec![None; task.world.atoms.len()],
            none: Vec::new(),
            exclusive: Vec::new(),
        };
        // Derived variables come last, so that `basic` separates them.
        groups.extend(derived.into_iter().map(|atom| vec![atom]));
        for group in limits.watch(groups) {
            let group = group?;
            let variable = VariableId::of(atoms.variables.len());
            let mut values: Vec<String> = group.iter().map(|atom| task.world.atom_name(*atom)).collect();
            let none_value = dense(values.len());
            values.push("none of these".into());
            let mut initial = none_value;
            for (atom, value) in group.iter().zip(0..) {
                atoms.facts[atom.index()] = Some(Fact { variable, value });
                if task.world.is_initial(*atom) {
                    initial = value;
                }
            }
            atoms.variables.push(Variable { values });
            atoms.initial.push(initial);
            atoms.none.push(none_value);
        }
        let facts = |group: Vec<AtomId>| group.into_iter().filter_map(|atom| atoms.fact(atom)).collect();
        atoms.exclusive = exclusive.into_iter().map(facts).collect();
        Ok(atoms)
    }

    pub(super) fn literal(&self, (atom, positive): (AtomId, bool)) -> Literal {
        let fact = self.fact(atom).expect("invariant: atoms in conditions are read, so they have a variable");
        Literal { fact, positive }
    }

    pub(super) fn fact(&self, atom: AtomId) -> Option<Fact> {
        self.facts[atom.index()]
    }

    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    pub(super) fn effects(&self, operator: &GroundOperator) -> Vec<Fact> {
        let to_none = |fact: Fact| Fact { value: self.none[fact.variable.index()], ..fact };
        let deletes = operator.deletes.iter().filter_map(|atom| self.fact(*atom)).map(to_none);
        let adds = operator.adds.iter().filter_map(|atom| self.fact(*atom));
        let mut effects: Vec<Fact> = Vec::with_capacity(operator.deletes.len() + operator.adds.len());
        // Additions follow deletions, because adding takes precedence.
        for fact in deletes.chain(adds) {
            match effects.iter_mut().find(|existing| existing.variable == fact.variable) {
                Some(existing) => *existing = fact,
                None => effects.push(fact),
            }
        }
        let overridden = |fact: &Fact| {
            let atoms =
                operator.conditional.iter().flat_map(|effect| effect.adds.iter().chain(&effect.deletes));
            let mut facts = atoms.filter_map(|atom| self.fact(*atom));
            facts.any(|candidate| candidate.variable == fact.variable)
        };
        let required = |fact: &Fact| {
            let literals = &operator.condition.literals;
            literals.iter().any(|(atom, positive)| *positive && self.fact(*atom) == Some(*fact))
        };
        // An effect that the condition implies matters only if a conditional effect changes the same
        // variable.
        effects.retain(|fact| !required(fact) || overridden(fact));
        effects.sort_unstable();
        effects
    }

    /// Converts conditional effects; deletions precede additions. A deletion is dropped if an unconditional
    /// effect makes another atom of the variable true, because only one atom of a variable can be true.
    pub(super) fn conditional(&self, operator: &GroundOperator) -> Vec<ConditionalEffect> {
        if operator.conditional.is_empty() {
            return Vec::new();
        }
        let set: FxHashSet<VariableId> =
            operator.adds.iter().filter_map(|atom| self.fact(*atom)).map(|fact| fact.variable).collect();
        let added: FxHashSet<&AtomId> = operator.adds.iter().collect();
        let entry = |condition: &[GroundLiteral], mut effects: Vec<Fact>| {
            effects.sort_unstable();
            effects.dedup();
            let condition = condition.iter().map(|literal| self.literal(*literal)).collect();
            (!effects.is_empty()).then_some(ConditionalEffect { condition, effects })
        };
        let deletes = operator.conditional.iter().filter_map(|effect| {
            let deleted = effect.deletes.iter().filter_map(|atom| Some((atom, self.fact(*atom)?)));
            let deleted =
                deleted.filter(|(atom, fact)| added.contains(atom) || !set.contains(&fact.variable));
            let to_none = |(_, fact): (_, Fact)| Fact { value: self.none[fact.variable.index()], ..fact };
            entry(&effect.condition, deleted.map(to_none).collect())
        });
        let adds = operator.conditional.iter().filter_map(|effect| {
            entry(&effect.condition, effect.adds.iter().filter_map(|atom| self.fact(*atom)).collect())
        });
        deletes.chain(adds).collect()
    }
}
