//! What observations have changed: from the monitor to the analysis and the planning.

use crate::mapek::answer::Answer;

/// What a line has changed, for the analysis.
#[derive(Debug, Clone, Default)]
#[expect(clippy::struct_excessive_bools, reason = "each is a fact of its own")]
pub(super) struct Changes {
    /// What the knowledge base says.
    pub(super) base: Base,
    /// Facts or values of the problem.
    pub(super) facts: bool,
    /// Facts of the problem, and not only values.
    pub(super) predicates: bool,
    /// What is to be reached: plans for another goal are of no use any more.
    pub(super) goal: bool,
    /// Values of the problem that were reported and differ from the expected ones.
    pub(super) values: bool,
    /// An action has ended.
    pub(super) ended: bool,
    /// The action under way has got another design that nobody here has asked for.
    pub(super) observed: bool,
    /// Why the action under way cannot go on as it was; a safe effect was asked for.
    pub(super) upset: Vec<String>,
    /// Reasons to plan whatever the plan is like: sentences.
    pub(super) must: Vec<String>,
    /// Reports that filters have held back, and sensors that are silent.
    pub(super) filtered: Vec<Answer>,
}

/// What has changed in the knowledge base.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Base {
    #[default]
    Nothing,
    /// What is stated, or follows.
    Stated,
    /// That from which availability and statuses are read.
    Watched,
}

impl Changes {
    /// Whether anything has changed, though the line was not taken over as a whole.
    pub(super) fn any(&self) -> bool {
        self.base > Base::Nothing || self.facts || self.predicates || !self.must.is_empty()
    }

    /// Returns `true` if another question is to be planned for than before.
    pub(super) fn is_news(&self) -> bool {
        self.facts || self.goal || self.ended || !self.upset.is_empty() || !self.must.is_empty()
    }

    /// Adds what has changed since.
    pub(super) fn extend(&mut self, later: Self) {
        let Self { base, facts, predicates, goal, values, ended, observed, upset, must, filtered } = later;
        self.base = self.base.max(base);
        self.facts |= facts;
        self.predicates |= predicates;
        self.goal |= goal;
        self.values |= values;
        self.ended |= ended;
        self.observed |= observed;
        self.upset.extend(upset);
        self.must.extend(must);
        self.filtered.extend(filtered);
    }
}
