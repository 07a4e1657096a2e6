//! The ground task over atoms, which the passes of grounding transform in sequence.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ground::vocabulary::atom::AtomId;
use crate::ground::vocabulary::axiom::GroundAxiom;
use crate::ground::vocabulary::condition::GroundCondition;
use crate::ground::vocabulary::operator::GroundOperator;
use crate::ground::vocabulary::world::World;
use crate::lifted::Rational;
use crate::task::quantity::NumericId;

/// A ground task over atoms, before its atoms become finite-domain variables.
pub struct GroundTask<'a> {
    pub(crate) world: World<'a>,
    pub(crate) operators: Vec<GroundOperator>,
    pub(crate) axioms: Vec<GroundAxiom>,
    /// `None` if the goal is false in all states.
    pub(crate) goal: Option<GroundCondition>,
    /// Objectives; empty until the operator costs have been computed.
    pub(crate) objectives: Vec<GroundObjective>,
}

/// Parts of a metric that are not operator costs.
#[derive(Debug, Clone, Default)]
pub struct GroundObjective {
    /// Value of the metric in the initial state without the fluents in `rest`, negated for maximisation.
    pub(crate) offset: Rational,
    pub(crate) maximize: bool,
    /// Fluents of the metric that operator costs do not include, e.g. because of state-dependent changes, with
    /// their factors (negated for maximisation). Their final values are added to the cost of a plan.
    pub(crate) rest: Vec<(NumericId, Rational)>,
}

impl GroundTask<'_> {
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
