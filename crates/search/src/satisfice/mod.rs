//! A plan soon: relaxed plans and landmarks guide a lazy greedy search, and then weighted A\*, as in LAMA [1].
//!
//! `relaxation` makes nodes of a task without deletes, `explore` a relaxed plan for a state, `landmarks` what every plan passes, and
//! `status` how far a state has come with these. `search` goes by them through `open` lists, over states in a `store`.
//!
//! Nothing that is found here rests on an estimate: a plan is executed by whoever takes it, and only a search that has been
//! everywhere without one says that there is none.
//!
//! [1] S. Richter, M. Westphal: The LAMA planner: guiding cost-based anytime planning with landmarks, JAIR 39, 2010.

mod explore;
mod known;
mod landmarks;
pub mod open;
pub mod queue;
mod relaxation;
mod search;
mod status;
mod store;

use task::context::Context;
use task::limits::{Interrupted, Limits};
use task::plan::ground::GroundPlan;
use task::task::OperatorId;
use task::task::number::TaskNumber;

use crate::search::{Figures, Pairs};

use known::{Known, USELESS};
use search::{Outcome, Search, Weight};

/// The searches in their order: whether costs count, and how.
const PHASES: [(bool, Weight); 6] = [
    (false, Weight::Greedy),
    (true, Weight::Greedy),
    (true, Weight::Times(5)),
    (true, Weight::Times(3)),
    (true, Weight::Times(2)),
    (true, Weight::Times(1)),
];

/// A search may take this part of the words that bytes are left for; then the next one has its turn.
const PART: usize = 16;

/// What came of going on for a while.
pub enum Advance<N> {
    /// A cheaper plan.
    Plan(GroundPlan<N>),
    /// There is no plan at all.
    Unsolvable,
    /// Nothing yet; it may go on.
    Paused,
    /// There is nothing left to be tried.
    Ended,
}

/// Searches for a plan, and then for cheaper and cheaper ones, that can be gone on with.
pub struct Satisficer<'a, N> {
    known: Known<'a, N>,
    limits: &'a Limits,
    phase: usize,
    search: Option<Search<N>>,
    /// Whether it was tried to tell dead ends by pairs of facts.
    knows_pairs: bool,
    pub figures: Figures,
}

impl<'a, N: TaskNumber> Satisficer<'a, N> {
    /// None if an operator has too many combinations of designs.
    ///
    /// # Errors
    /// When a limit is reached.
    pub fn new(context: Context<'a, N>) -> Result<Option<Self>, Interrupted> {
        let Some(known) = Known::new(context)? else { return Ok(None) };
        Ok(Some(Self {
            known,
            limits: context.limits,
            phase: 0,
            search: None,
            knows_pairs: false,
            figures: Figures::default(),
        }))
    }

    /// How often it has begun anew.
    pub fn restarts(&self) -> usize {
        self.phase
    }

    /// Looks for a plan that costs less than `limit`, or for any, until so much work is done: in nodes and propositions of the relaxed
    /// task.
    ///
    /// # Errors
    /// When a limit is reached.
    pub fn run(&mut self, limit: Option<&N>, work: u64) -> Result<Advance<N>, Interrupted> {
        let Some((priced, weight)) = PHASES.get(self.phase).copied() else { return Ok(Advance::Ended) };
        if !self.knows_pairs && self.figures.evaluated >= self.limits.thresholds().pairs {
            self.knows_pairs = true;
            self.known.pairs = Pairs::new(self.known.task, self.limits)?;
            // Estimates do not count on what is of no use any more.
            self.search = None;
        }
        let search = match &mut self.search {
            Some(search) => search,
            none => {
                let mut prices =
                    if priced { self.known.prices() } else { vec![1; self.known.task.operators.len()] };
                if let Some(pairs) = &self.known.pairs {
                    let ids = OperatorId::all(prices.len());
                    prices
                        .iter_mut()
                        .zip(ids)
                        .filter(|(_, id)| pairs.is_useless(*id))
                        .for_each(|(price, _)| *price = USELESS);
                }
                none.insert(Search::new(&mut self.known, weight, prices))
            }
        };
        let outcome = search.run(&mut self.known, limit, work, self.limits, &mut self.figures);
        let is_large = search.size() > self.limits.room() / PART;
        match outcome? {
            Outcome::Plan(plan) => {
                self.next();
                Ok(Advance::Plan(plan))
            }
            Outcome::Exhausted if limit.is_none() && !search.incomplete => Ok(Advance::Unsolvable),
            Outcome::Exhausted => {
                self.next();
                Ok(Advance::Paused)
            }
            Outcome::Paused => {
                if is_large {
                    self.next();
                }
                Ok(Advance::Paused)
            }
        }
    }

    fn next(&mut self) {
        self.phase = self.phase.saturating_add(1);
        // A greedy search by costs is the one before where all cost the same.
        let is_uniform = || {
            let prices = self.known.prices();
            prices.iter().all(|price| Some(price) == prices.first())
        };
        if PHASES.get(self.phase) == Some(&(true, Weight::Greedy)) && is_uniform() {
            self.phase = self.phase.saturating_add(1);
        }
        self.search = None;
    }
}
