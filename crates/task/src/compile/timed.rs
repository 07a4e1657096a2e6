//! Compiles trajectory constraints that mention times (`within`, `hold-during`, `hold-after`, `always-within`).
//! Actions must be allowed to overlap, because sequential plans have no times. For `always-within`, the
//! deadlines are checked once the times of a plan are known (see `deadline`). For the others, timed initial
//! literals mark the times of the constraint.
//!
//! The added conditions and effects of actions read these literals, so the happenings of these actions are
//! separated from each literal by epsilon. The literals are shifted by this separation, so that actions can
//! still happen at the specified times.

use num_rational::BigRational;
use num_traits::{Signed, Zero};
use pddl::ast::{Condition, Effect, Span};

use crate::error::{Error, File};

use super::deadline::{Deadline, LOOKED_AT};
use super::semantics::PlanSemantics;
use super::simplify::{all, any, flag, holds, not, truth};
use super::syntax_edits::unsupported;
use super::trajectory_monitors::{Addition, Monitors, decided};

impl Monitors<'_> {
    fn separation(&self, place: (File, Span)) -> Result<BigRational, Error> {
        match self.course {
            PlanSemantics::Overlapping(separation) => Ok(separation.clone()),
            PlanSemantics::Sequence => Err(unsupported(
                "a constraint on the times of states (`within`, `always-within`, `hold-during`, `hold-after`)",
                "`--concurrent`, or constraints on the order of states; `validate` supports constraints on times, too",
                place,
            )),
        }
    }

    /// Returns an auxiliary atom that is true from `time` on. A timed initial literal adds it, so `time` must be above
    /// 0.
    fn moment(&mut self, time: BigRational) -> Condition {
        let name = format!("time {time} has come");
        let is_declared = self.moments.iter().any(|(is_declared, _)| *is_declared == name);
        self.moments.extend((!is_declared).then(|| (name.clone(), time)));
        holds(&name)
    }

    pub(super) fn within(
        &mut self,
        time: &BigRational,
        what: &Condition,
        place: (File, Span),
    ) -> Result<Condition, Error> {
        let separation = self.separation(place)?;
        if time.is_negative() {
            return Ok(decided(false));
        }
        let met = self.remember("was met", self.initial.holds(what));
        let late = self.moment(time + separation);
        self.after_each(&[what], place, |touched, after| {
            let in_time = all([touched, after[0].clone(), not(late.clone())]);
            Addition::notes(in_time, Effect::Add(flag(&met)))
        })?;
        Ok(holds(&met))
    }

    /// Monitors `what`, which must hold in the state at time `from` and in all later states, until time
    /// `until` if given. Returns the condition on the last state under which the constraint is satisfied.
    pub(super) fn hold(
        &mut self,
        (from, until): (&BigRational, Option<&BigRational>),
        what: &Condition,
        hard: bool,
        place: (File, Span),
    ) -> Result<Condition, Error> {
        let separation = self.separation(place)?;
        let is_asked = |time: &BigRational| until.is_none_or(|until| time < until);
        let zero = BigRational::zero();
        if from.is_negative() && !is_asked(&zero) {
            return Ok(decided(true));
        }
        // If time 0 is in the interval, the initial state must satisfy the condition, even if a happening at time 0
        // leads to another state of this time.
        let at_first = from.is_positive() || !is_asked(&zero) || self.initial.holds(what);
        let broken = if hard { None } else { Some(self.remember("is broken", !at_first)) };
        let looked_at = self.remember("was looked at", false);
        let begun = self.moment(from.max(&zero) + &separation);
        let over = match until {
            Some(until) if until <= from || !until.is_positive() => truth(),
            Some(until) if *until <= separation => {
                let construct = "`hold-during` until a time that is not above the separation";
                return Err(unsupported(construct, "a smaller `--epsilon`", place));
            }
            Some(until) => self.moment(until - &separation),
            None => not(truth()),
        };
        self.after_each(&[what], place, |touched, after| {
            let touched = all([touched, begun.clone()]);
            let violated = all([touched.clone(), not(holds(&looked_at)), not(what.clone())]);
            let reached = all([touched.clone(), not(over.clone()), not(after[0].clone())]);
            let mut addition = Addition::notes(touched, Effect::Add(flag(&looked_at)));
            addition.forbid(any([violated, reached]), broken.as_deref());
            addition
        })?;
        let satisfied = broken.map_or(decided(at_first), |broken| not(holds(&broken)));
        Ok(all([satisfied, any([holds(&looked_at), what.clone()])]))
    }

    /// Monitors a deadline and returns a condition on the last state. For a hard constraint, this condition
    /// is always true; for a soft constraint, it requires that no deadline has begun or that the deadlines
    /// are noted as kept. The deadlines themselves are checked once the times are known.
    pub(super) fn always_within(
        &mut self,
        within: &BigRational,
        [first, second]: [&Condition; 2],
        hard: bool,
        place: (File, Span),
    ) -> Result<Condition, Error> {
        self.separation(place)?;
        for condition in [first, second] {
            self.can_be_watched(condition, place)?;
        }
        let deadline = Deadline::new(within.clone(), hard, self.deadlines.len());
        let begun = self.remember("has begun", self.initial.holds(first) && !self.initial.holds(second));
        // The added effects read both conditions. So happenings that may start the deadline are separated from
        // happenings that may end it, and a start can be delayed until after an end.
        self.after_each(&[first, second], place, |touched, after| {
            let begins = all([touched, after[0].clone(), not(after[1].clone())]);
            Addition::notes(begins, Effect::Add(flag(&begun)))
        })?;
        let (noted, last) = if hard {
            // Grounding drops atoms that nothing reads. The effect of the auxiliary action for the second
            // condition reads `begun`, so this atom is kept.
            (Effect::When(holds(&begun), Box::new(Effect::Add(flag(LOOKED_AT)))), truth())
        } else {
            let satisfied = self.remember("is kept", false);
            (Effect::Add(flag(&satisfied)), any([not(holds(&begun)), holds(&satisfied)]))
        };
        self.deadlines.push((deadline, [first.clone(), second.clone()], noted));
        Ok(last)
    }
}
