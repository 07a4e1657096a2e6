//! Reports and statistics of a temporal search: improved plans, rising lower bounds, and node
//! counts.

use std::time::Instant;

use task::number::{Int, Rational};
use task::plan::solution::{Improvement, Moment, PlannerPart, Statistics};

use crate::concurrent::temporal_task::TemporalTask;
use crate::concurrent::time_number::TimeNumber;

/// A lower bound is recorded if it exceeds the last recorded bound by more than 1/`REPORT_STEP` of that
/// bound. A bound that reaches the cost of the incumbent is always recorded.
const REPORT_STEP: Int = 100;

pub(super) struct Record<'r, T: TimeNumber = Int> {
    concurrent: &'r TemporalTask<T>,
    report: &'r mut dyn FnMut(Improvement),
    started: Instant,
    /// Metric of the incumbent and lower bound at the last entry of the history, in the scale of
    /// `Measure`.
    noted: Option<(Option<Rational>, Rational)>,
    cost: Option<Rational>,
    /// Initial lower bound if the search is incomplete; later lower bounds are capped at this
    /// value, because they are not proved.
    ceiling: Option<Rational>,
    pub(super) statistics: Statistics,
}

impl<'r, T: TimeNumber> Record<'r, T> {
    pub(super) fn new(
        concurrent: &'r TemporalTask<T>,
        started: Instant,
        report: &'r mut dyn FnMut(Improvement),
    ) -> Self {
        let statistics = Statistics { operators: concurrent.task.operators.len(), ..Statistics::default() };
        Self { concurrent, report, started, noted: None, cost: None, ceiling: None, statistics }
    }

    pub(super) fn begin(&mut self, root: Rational) {
        self.ceiling = (!self.concurrent.is_exact).then(|| root.clone());
        self.report_lower_bound(root);
    }

    /// Records a better plan with the metric `value` (in the scale of `Measure`) and `horizon`
    /// happenings (actions, if durations are chosen), found by `part`, and a lower bound.
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

    /// Adds a lower bound to the history, if it has risen enough or the incumbent has changed. Adds nothing
    /// if only a part of the metric is minimised. Returns the bound after capping it at the ceiling and at
    /// the cost of the incumbent.
    pub(super) fn report_lower_bound(&mut self, lower: Rational) -> Rational {
        let caps = self.ceiling.iter().chain(&self.cost);
        let lower = caps.fold(lower, |lower, cap| if *cap < lower { cap.clone() } else { lower });
        let is_news = self.noted.as_ref().is_none_or(|(cost, bound)| {
            let rise = lower.clone() - bound;
            *cost != self.cost
                || rise.clone() * Rational::from_integer(REPORT_STEP) > *bound
                || rise.is_positive() && self.cost.as_ref() == Some(&lower)
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

    pub(super) fn end(mut self) -> Statistics {
        self.statistics.search = self.started.elapsed();
        self.statistics
    }
}
