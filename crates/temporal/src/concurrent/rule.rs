//! A rule of a relaxed task: conditions, effects and cost.

use rustc_hash::FxHashMap;

use task::number::Int;
use task::task::OperatorId;

/// A fact, a clause, or a numeric condition.
pub(super) type Proposition = u32;

/// A rule of the relaxation.
#[derive(Debug, Clone, Default)]
pub(super) struct Rule {
    /// Conditions, ascending.
    pub(super) needs: Vec<Proposition>,
    pub(super) adds: Vec<Proposition>,
    /// Facts that it certainly sets.
    pub(super) sets: Vec<Proposition>,
    pub(super) raises: Vec<NumericEffect>,
    pub(super) weight: u32,
    pub(super) origin: Option<OperatorId>,
}

impl Rule {
    /// Copy of the rule for states in which `fact` holds before and after it. `numbers` maps each
    /// proposition to its conjunction with `fact`.
    pub(super) fn with(
        &self,
        fact: Proposition,
        needs: &[Proposition],
        numbers: &FxHashMap<Proposition, Proposition>,
    ) -> Self {
        let mut needs: Vec<_> = needs.iter().map(|need| *numbers.get(need).unwrap_or(need)).collect();
        needs.push(fact);
        needs.sort_unstable();
        needs.dedup();
        let adds = self.adds.iter().filter_map(|add| numbers.get(add)).copied().collect();
        Self { needs, adds, weight: self.weight, origin: self.origin, ..Self::default() }
    }
}

/// A numeric condition by index, and the amount that a rule adds to it. `None` if the amount
/// depends on the state.
pub(super) type NumericEffect = (u32, Option<Int>);
