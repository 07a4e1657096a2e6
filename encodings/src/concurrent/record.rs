//! What a search over happenings reports and counts: better plans, bounds that rise, and figures of each part.

use std::time::Instant;

use crate::concurrent::compile::Concurrent;
use crate::concurrent::search::Sequence;
use crate::number::Int;
use crate::plan::solution::{Improvement, Moment, Part, Statistics};

/// Bounds are noted that are this part higher than the one before.
const PART: Int = 100;

/// What has happened so far in one run.
pub(super) struct Record<'r> {
    concurrent: &'r Concurrent,
    report: &'r mut dyn FnMut(Improvement),
    started: Instant,
    /// The metric of the best plan, in integers, and what none can get below, as they were noted last.
    noted: Option<(Option<Int>, Int)>,
    cost: Option<Int>,
    /// Where the search leaves plans out: what could be said of all plans before it began.
    ceiling: Option<Int>,
    pub(super) statistics: Statistics,
}

impl<'r> Record<'r> {
    pub(super) fn new(
        concurrent: &'r Concurrent,
        started: Instant,
        report: &'r mut dyn FnMut(Improvement),
    ) -> Self {
        let statistics = Statistics { operators: concurrent.task.operators.len(), ..Statistics::default() };
        Self { concurrent, report, started, noted: None, cost: None, ceiling: None, statistics }
    }

    /// What no plan can get below, before the search has begun.
    pub(super) fn begin(&mut self, root: Int) {
        self.ceiling = (!self.concurrent.is_exact).then_some(root);
        self.rise(root);
    }

    /// Notes a better plan, and what none can get below.
    pub(super) fn improve(&mut self, sequence: &Sequence, lower: Int, part: Part) {
        self.statistics.found_by = Some(part);
        self.cost = Some(sequence.value.0);
        let lower = self.rise(lower);
        // What is compared is only a part of such a metric.
        if self.concurrent.task.objective.rest.is_empty() {
            (self.report)(Improvement {
                cost: self.concurrent.measure.metric(sequence.value.0),
                lower_bound: self.concurrent.measure.metric(lower),
                horizon: sequence.happenings.len(),
            });
        }
    }

    /// Notes what no plan can get below, and returns what of that can be claimed.
    pub(super) fn rise(&mut self, lower: Int) -> Int {
        let lower = self.ceiling.map_or(lower, |ceiling| ceiling.min(lower));
        let lower = self.cost.map_or(lower, |cost| cost.min(lower));
        let is_news = self.noted.is_none_or(|(known, bound)| {
            let more = lower.saturating_sub(bound);
            known != self.cost || more > bound / PART || more > 0 && self.cost == Some(lower)
        });
        if is_news && self.concurrent.task.objective.rest.is_empty() {
            self.noted = Some((self.cost, lower));
            let metric = |total| self.concurrent.measure.metric(total);
            let moment = Moment {
                time: self.started.elapsed(),
                cost: self.cost.map(metric),
                lower_bound: metric(lower),
            };
            self.statistics.history.push(moment);
        }
        lower
    }

    /// The figures of the run, which ends now.
    pub(super) fn end(mut self) -> Statistics {
        self.statistics.search = self.started.elapsed();
        self.statistics
    }
}
