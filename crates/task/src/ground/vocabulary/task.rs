//! The task over atoms, which the passes transform one after another.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ground::vocabulary::atom::AtomId;
use crate::ground::vocabulary::axiom::GroundAxiom;
use crate::ground::vocabulary::condition::GroundCondition;
use crate::ground::vocabulary::operator::GroundOperator;
use crate::ground::vocabulary::world::World;
use crate::lifted::Rational;
use crate::task::quantity::NumericId;

/// The task over atoms.
pub struct GroundTask<'a> {
    pub(crate) world: World<'a>,
    pub(crate) operators: Vec<GroundOperator>,
    /// Rules of derived atoms.
    pub(crate) axioms: Vec<GroundAxiom>,
    /// `None` if the goal is false in all states.
    pub(crate) goal: Option<GroundCondition>,
    /// Objectives; empty until operators have their costs.
    pub(crate) objectives: Vec<GroundObjective>,
}

/// Relation between operator costs and the metric.
#[derive(Debug, Clone, Default)]
pub struct GroundObjective {
    /// Metric of the initial state (negated for maximisation).
    pub(crate) offset: Rational,
    pub(crate) maximize: bool,
    /// Fluents with state-dependent changes and their factors (negated for maximisation). Their
    /// final values are added.
    pub(crate) rest: Vec<(NumericId, Rational)>,
}

impl GroundTask<'_> {
    /// Returns the atoms that conditions read, directly or through rules.
    pub(crate) fn read_atoms(&self) -> FxHashSet<AtomId> {
        let conditions = self.operators.iter().map(|operator| &operator.condition).chain(&self.goal);
        let conditional = self.operators.iter().flat_map(|operator| &operator.conditional);
        let conditional = conditional.flat_map(|effect| effect.condition.iter().map(|(atom, _)| *atom));
        let mut direct = vec![false; self.world.atoms.len()];
        for atom in conditions.flat_map(GroundCondition::atoms).chain(conditional) {
            direct[atom.index()] = true;
        }
        let direct = direct.into_iter().zip(0..).filter(|(read, _)| *read);
        let mut read: FxHashSet<AtomId> = direct.map(|(_, atom)| AtomId(atom)).collect();
        let mut bodies: FxHashMap<AtomId, Vec<&GroundCondition>> = FxHashMap::default();
        for axiom in &self.axioms {
            bodies.entry(axiom.head).or_default().push(&axiom.body);
        }
        let mut open: Vec<AtomId> = read.iter().copied().collect();
        while let Some(atom) = open.pop() {
            let below = bodies.get(&atom).into_iter().flatten().flat_map(|body| body.atoms());
            open.extend(below.filter(|atom| read.insert(*atom)));
        }
        read
    }
}
