//! Constraints on the times of states, where actions overlap: timed initial literals tell what time has come.
//!
//! What happens reads them, so it lies apart from them by the separation. They come so much later, or sooner, than the time that is
//! meant, so that something may happen at that time, too.

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
    /// How far apart happenings are that interfere.
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

    /// The atom that is added at a time, which is above 0.
    fn moment(&mut self, time: BigRational) -> Condition {
        let name = format!("time {time} has come");
        let known = self.moments.iter().any(|(known, _)| *known == name);
        self.moments.extend((!known).then(|| (name.clone(), time)));
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

    /// A condition that has to hold in the state that there is at a time, and in those that are reached from then on, until another time if
    /// there is one.
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
        // The initial state and one after it may both be of time 0.
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
            let left = all([touched.clone(), not(holds(&looked_at)), not(what.clone())]);
            let reached = all([touched.clone(), not(over.clone()), not(after[0].clone())]);
            let mut addition = Addition::notes(touched, Effect::Add(flag(&looked_at)));
            addition.forbid(any([left, reached]), broken.as_deref());
            addition
        })?;
        let kept = broken.map_or(decided(at_first), |broken| not(holds(&broken)));
        Ok(all([kept, any([holds(&looked_at), what.clone()])]))
    }

    /// While the search goes on, it is kept as long as nothing begins that has to end in time. What has been kept is known with the times.
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
        let own = Deadline::new(within.clone(), hard, self.deadlines.len());
        let begun = self.remember("has begun", self.initial.holds(first) && !self.initial.holds(second));
        // What begins keeps apart from what ends it, so that it can be put off until it has ended.
        self.after_each(&[first, second], place, |touched, after| {
            let begins = all([touched, after[0].clone(), not(after[1].clone())]);
            Addition::notes(begins, Effect::Add(flag(&begun)))
        })?;
        let (noted, last) = if hard {
            // The search tells by this whether it has begun; it never happens.
            (Effect::When(holds(&begun), Box::new(Effect::Add(flag(LOOKED_AT)))), truth())
        } else {
            let kept = self.remember("is kept", false);
            (Effect::Add(flag(&kept)), any([not(holds(&begun)), holds(&kept)]))
        };
        self.deadlines.push((own, [first.clone(), second.clone()], noted));
        Ok(last)
    }
}
