//! Conditions of ground operators in conjunctive normal form.

use crate::ground::vocabulary::atom::AtomId;
use crate::lifted::Rational;
use crate::task::quantity::Linear;

/// A ground atom and its required truth value.
pub type GroundLiteral = (AtomId, bool);

/// A conjunction of literals, clauses and comparisons.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub struct GroundCondition {
    pub(crate) literals: Vec<GroundLiteral>,
    pub(crate) clauses: Vec<Vec<GroundLiteral>>,
    /// Linear expressions that must be ≥ 0, or > 0 if the flag is `true`.
    pub(crate) comparisons: Vec<(Linear<Rational>, bool)>,
}

impl GroundCondition {
    /// Sorts literals and the list of clauses, and removes duplicates. Returns `false` if two literals
    /// contradict each other; contradictions with clauses are not detected.
    pub(crate) fn tidy(&mut self) -> bool {
        self.literals.sort_unstable();
        self.literals.dedup();
        self.clauses.sort_unstable();
        self.clauses.dedup();
        self.literals.windows(2).all(|pair| pair[0].0 != pair[1].0)
    }

    pub(crate) fn atoms(&self) -> impl Iterator<Item = AtomId> + '_ {
        self.literals.iter().chain(self.clauses.iter().flatten()).map(|(atom, _)| *atom)
    }
}
