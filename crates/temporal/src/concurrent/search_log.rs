//! Reports and statistics of a temporal search: better plans, rising lower bounds, counts of each part.

use std::time::Instant;

use task::number::{Int, Rational};
use task::plan::solution::{Improvement, Moment, PlannerPart, Statistics};

use crate::concurrent::temporal_task::TemporalTask;

/// Bounds are noted that are one part in so many higher than the one before.
const REPORT_STEP: Int = 100;

/// What has happened so far in one run.
pub(super) struct Record<'r> {
    concurrent: &'r TemporalTask,
    report: &'r mut dyn FnMut(Improvement),
    started: Instant,
    /// The metric of the best plan, in integers, and what none can get below, as they were noted last.
    noted: Option<(Option<Rational>, Rational)>,
    cost: Option<Rational>,
    /// Where the search leaves plans out: what could be said of all plans before it began.
    ceiling: Option<Rational>,
    pub(super) statistics: Statistics,
}

impl<'r> Record<'r> {
    pub(super) fn new(
        concurrent: &'r TemporalTask,
        started: Instant,
        report: &'r mut dyn FnMut(Improvement),
    ) -> Self {
        let statistics = Statistics { operators: concurrent.task.operators.len(), ..Statistics::default() };
        Self { concurrent, report, started, noted: None, cost: None, ceiling: None, statistics }
    }

    /// What no plan can get below, before the search has begun.
    pub(super) fn begin(&mut self, root: Rational) {
        self.ceiling = (!self.concurrent.is_exact).then(|| root.clone());
        self.report_lower_bound(root);
    }

    /// Notes a better plan of so many happenings, and what none can get below.
    pub(super) fn improve(&mut self, value: &Rational, horizon: usize, lower: Rational, part: PlannerPart) {
        self.statistics.found_by = Some(part);
        self.cost = Some(value.clone());
        let lower = self.report_lower_bound(lower);
        if self.concurrent.is_whole {
            (self.report)(Improvement {
                cost: self.concurrent.measure.metric(value),
                lower_bound: self.concurrent.measure.metric(&lower),
                horizon,
            });
        }
    }

    /// Notes what no plan can get below, and returns what of that can be claimed.
    pub(super) fn report_lower_bound(&mut self, lower: Rational) -> Rational {
        let known = self.ceiling.iter().chain(&self.cost);
        let lower = known.fold(lower, |lower, known| if *known < lower { known.clone() } else { lower });
        let is_news = self.noted.as_ref().is_none_or(|(known, bound)| {
            let more = lower.clone() - bound;
            *known != self.cost
                || more.clone() * Rational::from_integer(REPORT_STEP) > *bound
                || more.is_positive() && self.cost.as_ref() == Some(&lower)
        });
        if is_news && self.concurrent.is_whole {
            self.noted = Some((self.cost.clone(), lower.clone()));
            let metric = |total| self.concurrent.measure.metric(total);
            let moment = Moment {
                time: self.started.elapsed(),
                cost: self.cost.as_ref().map(metric),
                lower_bound: metric(&lower),
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
