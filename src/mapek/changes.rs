//! Record of the changes caused by observations, passed from the monitor to analysis and planning.

use serde::{Deserialize, Serialize};

use crate::mapek::answer::Answer;

#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[expect(clippy::struct_excessive_bools, reason = "each is a fact of its own")]
pub(super) struct Changes {
    pub(super) base: Base,
    /// Whether inputs of planning may have changed, other than the goal, the availability of designs and statuses
    /// (see `base`). Such inputs are facts and values of the problem, other facts of the knowledge base, and the
    /// designs of the action under way. Also `true` after an action that ended without success. Effects of the
    /// progress and success of actions do not count.
    pub(super) facts: bool,
    /// Whether a report has changed facts of the problem or a design of the action under way, and not only values.
    pub(super) predicates: bool,
    pub(super) goal: bool,
    /// Whether a report has changed values of the problem, or other inputs of planning in the knowledge base.
    pub(super) values: bool,
    pub(super) ended: bool,
    /// Number of observations after which the next deliberation may need a plan.
    #[serde(default)]
    pub(super) news: u32,
    /// Whether a function of the action under way was reported with a design that the loop has not requested.
    pub(super) observed: bool,
    /// Reasons why the action under way could not continue unchanged. For each reason, other designs or a suspension
    /// were requested.
    pub(super) interruptions: Vec<String>,
    /// Reasons to plan, as sentences, that apply even if the current plan is valid.
    pub(super) reasons: Vec<String>,
    /// Answers about filtered reports. The reaction takes them out before it stores these changes for the next
    /// deliberation.
    #[serde(skip)]
    pub(super) filtered: Vec<Answer>,
}

/// Adds those sentences that the list does not contain. A status that changes back and forth during a long search gives
/// equal sentences again and again.
pub(super) fn add_new(sentences: &mut Vec<String>, added: Vec<String>) {
    for sentence in added {
        if !sentences.contains(&sentence) {
            sentences.push(sentence);
        }
    }
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) enum Base {
    #[default]
    Nothing,
    /// Statements or conclusions may have changed, but none that determine availability or statuses.
    Stated,
    /// Statements that determine availability or statuses may have changed.
    Watched,
}

impl Changes {
    pub(super) fn any(&self) -> bool {
        self.base > Base::Nothing || self.facts || self.predicates || !self.reasons.is_empty()
    }

    /// Returns `true` if the next deliberation may need a plan, because the planning problem has changed or an action
    /// has ended.
    pub(super) fn is_news(&self) -> bool {
        self.facts || self.goal || self.ended || !self.interruptions.is_empty() || !self.reasons.is_empty()
    }

    pub(super) fn extend(&mut self, later: Self) {
        let Self {
            base,
            facts,
            predicates,
            goal,
            values,
            ended,
            news,
            observed,
            interruptions,
            reasons,
            filtered,
        } = later;
        self.base = self.base.max(base);
        self.facts |= facts;
        self.predicates |= predicates;
        self.goal |= goal;
        self.values |= values;
        self.ended |= ended;
        self.news = self.news.saturating_add(news);
        self.observed |= observed;
        add_new(&mut self.interruptions, interruptions);
        add_new(&mut self.reasons, reasons);
        self.filtered.extend(filtered);
    }
}
