//! Rules of the delete relaxation: conditions, effects and cost.

use rustc_hash::FxHashMap;

use task::number::Int;
use task::task::OperatorId;

/// Proposition of the delete relaxation: a fact, a clause, a numeric condition, or a conjunction of
/// two facts.
pub(super) type Proposition = u32;

#[derive(Debug, Clone, Default)]
pub(super) struct Rule {
    /// Conditions of the rule, in ascending order.
    pub(super) needs: Vec<Proposition>,
    pub(super) adds: Vec<Proposition>,
    /// Over-all conditions of the action, ascending. Empty except for ends of actions in
    /// [`TemporalRelaxation::admissible`](super::temporal_relaxation::TemporalRelaxation::admissible).
    pub(super) over_all: Vec<Proposition>,
    /// Facts that certainly hold after the rule, because the happening sets their variables. All other values of these
    /// variables are deleted. Empty for clauses, derived facts, and copies by [`Rule::with`].
    pub(super) sets: Vec<Proposition>,
    pub(super) raises: Vec<NumericEffect>,
    pub(super) weight: u32,
    /// Operator from which the rule was made; `None` for clauses and derived facts.
    pub(super) origin: Option<OperatorId>,
}

impl Rule {
    /// Copy of the rule for states in which `fact` holds before and after the rule. `needs` are the
    /// conditions of the rule. `numbers` maps a proposition to its conjunction with `fact`; other
    /// effects are dropped.
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

/// Index of a numeric condition, and the amount that a rule adds to its expression. The amount is
/// `None` if it depends on the state or overflows.
pub(super) type NumericEffect = (u32, Option<Int>);
