//! Constraints on times with overlapping actions: timed initial literals mark the times.
//!
//! Happenings read these literals, so they are separated from them. The literals are therefore
//! shifted by the separation, so that happenings at the specified time remain possible.

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
    /// Returns the separation of interfering happenings.
    fn separation(&self, place: (File, Span)) -> Result<BigRational, Error> {
        match self.course {
            PlanSemantics::Overlapping(separation) => Ok(separation.clone()),
            PlanSemantics::Sequence => Err(unsupported(
                "a constraint on the times of states (`within`, `always-within`, `hold-during`, `hold-after`)",
                "`--concurrent`, or constraints on the order of states; `validate` judges those on times, too",
                place,
            )),
        }
    }

    /// Returns the atom that is added at a time above 0.
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

    /// Monitors a condition that must hold in the state at a time and in all later states,
    /// optionally until another time.
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
        // The initial state and a later one may both have time 0.
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

    /// During search, the constraint counts as satisfied while no deadline is pending. The
    /// deadlines are checked when the times are known.
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
        // Starts of the deadline are separated from its ends, so that a start can be delayed after
        // the end.
        self.after_each(&[first, second], place, |touched, after| {
            let begins = all([touched, after[0].clone(), not(after[1].clone())]);
            Addition::notes(begins, Effect::Add(flag(&begun)))
        })?;
        let (noted, last) = if hard {
            // The search evaluates this effect to detect pending deadlines; the action is never
            // executed.
            (Effect::When(holds(&begun), Box::new(Effect::Add(flag(LOOKED_AT)))), truth())
        } else {
            let satisfied = self.remember("is kept", false);
            (Effect::Add(flag(&satisfied)), any([not(holds(&begun)), holds(&satisfied)]))
        };
        self.deadlines.push((deadline, [first.clone(), second.clone()], noted));
        Ok(last)
    }
}
