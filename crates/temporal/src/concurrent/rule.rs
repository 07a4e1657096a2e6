//! A rule of a relaxed task: conditions, effects and cost.

use rustc_hash::FxHashMap;

use task::number::Int;
use task::task::OperatorId;

/// A fact, a clause, or a numeric condition.
pub(super) type Proposition = u32;

/// From what is required to what is brought about.
#[derive(Debug, Clone, Default)]
pub(super) struct Rule {
    /// Ascending.
    pub(super) needs: Vec<Proposition>,
    pub(super) adds: Vec<Proposition>,
    /// All that it is sure to set.
    pub(super) sets: Vec<Proposition>,
    pub(super) raises: Vec<NumericEffect>,
    pub(super) weight: u32,
    pub(super) origin: Option<OperatorId>,
}

impl Rule {
    /// The same where another fact holds before and after it. `numbers` are the conjunctions of that fact by what they say besides.
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

/// A numeric condition by position, and how much a rule adds to it; none if that depends on the state.
pub(super) type NumericEffect = (u32, Option<Int>);
