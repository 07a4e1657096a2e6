//! Constraints on the states that a plan goes through, and preferences, judged by their definition \[1\].
//!
//! A trajectory is a sequence of states with their times: the initial state at 0, and one state after each happening. A condition that
//! is undefined in a state does not hold in it.
//!
//! \[1\] A. Gerevini, P. Haslum, D. Long, A. Saetti, Y. Dimopoulos: Deterministic planning in the fifth international planning
//! competition: PDDL3 and experimental evaluation of the planners, Artificial Intelligence 173, 2009, section 2.

use num_rational::BigRational;

use crate::ast::{Condition, ConditionTime, Name, Preference, Trajectory};
use crate::print::constraint_text;

use super::evaluate::{Bindings, Evaluator, Undefined};
use super::execute::{Execution, undefined_violation};
use super::record::{Moment, constraints};
use super::running::Running;
use super::verdict::{Violation, ViolationKind};
use super::world::World;

impl<'e, 'p> Execution<'e, 'p> {
    /// Counts the preferences of an action that do not hold when it starts or ends.
    pub(super) fn prefer(
        &mut self,
        running: &Running<'e, 'p>,
        when: ConditionTime,
        time: &BigRational,
    ) -> Result<(), Box<Violation>> {
        let mut violated = Vec::new();
        for preference in running.instance.action.preferences.iter().filter(|own| own.time == when) {
            let mut bindings = running.instance.bindings.clone();
            let evaluator = self.evaluator(Some(&running.duration));
            let count = count_violated(&evaluator, preference, &mut bindings)
                .map_err(|undefined| undefined_violation(running.step, time, &undefined))?;
            violated.extend(std::iter::repeat_n(preference.name.name.clone(), count));
        }
        self.record.violated.extend(violated);
        Ok(())
    }

    /// How often preferences are violated, each name as often as it is.
    ///
    /// # Errors
    /// A constraint that has to hold does not.
    pub(super) fn judge(&self, time: &BigRational) -> Result<Vec<Name>, Box<Violation>> {
        let mut violated = self.record.violated.clone();
        let judge = Judge { world: self.world, moments: &self.record.moments };
        for constraint in constraints(self.world) {
            let mut unmet = 0_usize;
            judge.world.each(&constraint.variables, &mut Bindings::default(), &mut |bindings| {
                if !judge.follows(&constraint.trajectory, bindings) {
                    unmet = unmet.saturating_add(1);
                }
                true
            });
            match &constraint.preference {
                Some(name) => violated.extend(std::iter::repeat_n(name.name.clone(), unmet)),
                None if unmet == 0 => {}
                None => {
                    return Err(Box::new(Violation {
                        step: None,
                        action: None,
                        time: time.clone(),
                        kind: ViolationKind::Constraint,
                        message: format!(
                            "the plan does not keep the constraint {}",
                            constraint_text(constraint)
                        ),
                        unmet: Vec::new(),
                    }));
                }
            }
        }
        Ok(violated)
    }
}

/// How many instances of a preference do not hold.
fn count_violated<'p>(
    evaluator: &Evaluator<'_, 'p>,
    preference: &'p Preference,
    bindings: &mut Bindings<'p>,
) -> Result<usize, Undefined> {
    let (mut count, mut undefined) = (0_usize, None);
    evaluator.world.each(&preference.variables, bindings, &mut |bindings| {
        match evaluator.holds(&preference.condition, bindings) {
            Ok(true) => {}
            Ok(false) => count = count.saturating_add(1),
            Err(reason) => undefined = Some(reason),
        }
        true
    });
    undefined.map_or(Ok(count), Err)
}

/// A trajectory in the light of the definition.
struct Judge<'j, 'p> {
    world: &'j World<'p>,
    moments: &'j [Moment],
}

impl<'p> Judge<'_, 'p> {
    /// The states in which a condition holds, one flag for each.
    fn holds(&self, condition: &'p Condition, bindings: &mut Bindings<'p>) -> Vec<bool> {
        let holds = |moment: &Moment| {
            Evaluator::new(self.world, &moment.state).holds(condition, bindings) == Ok(true)
        };
        self.moments.iter().map(holds).collect()
    }

    fn follows(&self, trajectory: &'p Trajectory, bindings: &mut Bindings<'p>) -> bool {
        let times: Vec<&BigRational> = self.moments.iter().map(|moment| &moment.time).collect();
        match trajectory {
            Trajectory::And(parts) => parts.iter().all(|part| self.follows(part, bindings)),
            Trajectory::ForAll(variables, body) => {
                self.world.each(variables, bindings, &mut |bindings| self.follows(body, bindings))
            }
            Trajectory::AtEnd(what) => self.holds(what, bindings).last() == Some(&true),
            Trajectory::Always(what) => self.holds(what, bindings).iter().all(|holds| *holds),
            Trajectory::Sometime(what) => self.holds(what, bindings).contains(&true),
            Trajectory::AtMostOnce(what) => {
                let holds = self.holds(what, bindings);
                let first = holds.iter().position(|holds| *holds).unwrap_or(holds.len());
                !holds.iter().skip(first).skip_while(|holds| **holds).any(|holds| *holds)
            }
            Trajectory::SometimeAfter(first, second) => {
                let (first, second) = (self.holds(first, bindings), self.holds(second, bindings));
                (0..first.len()).all(|i| !first[i] || second[i..].contains(&true))
            }
            Trajectory::SometimeBefore(first, second) => {
                let (first, second) = (self.holds(first, bindings), self.holds(second, bindings));
                (0..first.len()).all(|i| !first[i] || second[..i].contains(&true))
            }
            Trajectory::Within(time, what) => {
                self.holds(what, bindings).iter().zip(times).any(|(holds, reached)| *holds && reached <= time)
            }
            Trajectory::AlwaysWithin(time, first, second) => {
                let (first, second) = (self.holds(first, bindings), self.holds(second, bindings));
                let soon = |i: usize| (i..second.len()).any(|j| second[j] && times[j] - times[i] <= *time);
                (0..first.len()).all(|i| !first[i] || soon(i))
            }
            Trajectory::HoldDuring(from, until, what) => {
                let holds = self.holds(what, bindings);
                lasts(&holds, &times, from, |time| time < until)
            }
            Trajectory::HoldAfter(from, what) => lasts(&self.holds(what, bindings), &times, from, |_| true),
        }
    }
}

/// Whether a condition holds in the state that there is at a time, and in those that are reached from then on, as long as `is_asked`.
fn lasts(
    holds: &[bool],
    times: &[&BigRational],
    from: &BigRational,
    is_asked: impl Fn(&BigRational) -> bool,
) -> bool {
    let there = times.iter().rposition(|time| *time <= from);
    let later = || holds.iter().zip(times).filter(|(_, time)| **time >= from && is_asked(time));
    there.is_none_or(|there| holds[there]) && later().all(|(holds, _)| *holds)
}
