//! Evaluates trajectory constraints and preferences by the definition of PDDL 3 \[1\].
//!
//! A trajectory is a sequence of states with times: the initial state at 0 and the state after each
//! happening. A condition that is undefined in a state does not hold in it.
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
    /// Records the preferences of an action that are violated at the given time: its start or its end. An
    /// undefined preference is a violation of the plan.
    pub(super) fn record_preferences(
        &mut self,
        running: &Running<'e, 'p>,
        when: ConditionTime,
        time: &BigRational,
    ) -> Result<(), Box<Violation>> {
        let mut violated = Vec::new();
        for preference in
            running.instance.action.preferences.iter().filter(|preference| preference.time == when)
        {
            let mut bindings = running.instance.bindings.clone();
            let evaluator = self.evaluator(Some(&running.duration));
            let count = count_violated(&evaluator, preference, &mut bindings)
                .map_err(|undefined| undefined_violation(running.step, time, &undefined))?;
            violated.extend(std::iter::repeat_n(preference.name.name.clone(), count));
        }
        self.record.violated.extend(violated);
        Ok(())
    }

    /// Returns the violated preferences of the actions, the domain and the problem; each name occurs once per
    /// violation.
    ///
    /// # Errors
    /// Returns a violation if a mandatory constraint does not hold.
    pub(super) fn check_trajectory(&self, time: &BigRational) -> Result<Vec<Name>, Box<Violation>> {
        let mut violated = self.record.violated.clone();
        let evaluator = TrajectoryEvaluator { world: self.world, moments: &self.record.moments };
        for constraint in constraints(self.world) {
            let mut unmet = 0_usize;
            evaluator.world.each(&constraint.variables, &mut Bindings::default(), &mut |bindings| {
                if !evaluator.satisfies(&constraint.trajectory, bindings) {
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
                        message: format!("the plan violates the constraint {}", constraint_text(constraint)),
                        unmet: Vec::new(),
                    }));
                }
            }
        }
        Ok(violated)
    }
}

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

struct TrajectoryEvaluator<'j, 'p> {
    world: &'j World<'p>,
    moments: &'j [Moment],
}

impl<'p> TrajectoryEvaluator<'_, 'p> {
    fn holds(&self, condition: &'p Condition, bindings: &mut Bindings<'p>) -> Vec<bool> {
        let holds = |moment: &Moment| {
            Evaluator::new(self.world, &moment.state).holds(condition, bindings) == Ok(true)
        };
        self.moments.iter().map(holds).collect()
    }

    fn satisfies(&self, trajectory: &'p Trajectory, bindings: &mut Bindings<'p>) -> bool {
        let times: Vec<&BigRational> = self.moments.iter().map(|moment| &moment.time).collect();
        match trajectory {
            Trajectory::And(parts) => parts.iter().all(|part| self.satisfies(part, bindings)),
            Trajectory::ForAll(variables, body) => {
                self.world.each(variables, bindings, &mut |bindings| self.satisfies(body, bindings))
            }
            Trajectory::AtEnd(body) => self.holds(body, bindings).last() == Some(&true),
            Trajectory::Always(body) => self.holds(body, bindings).iter().all(|holds| *holds),
            Trajectory::Sometime(body) => self.holds(body, bindings).contains(&true),
            Trajectory::AtMostOnce(body) => {
                let holds = self.holds(body, bindings);
                // After the first block of states in which the condition holds, the condition must not hold
                // again.
                let first = holds.iter().position(|holds| *holds).unwrap_or(holds.len());
                !holds.iter().skip(first).skip_while(|holds| **holds).any(|holds| *holds)
            }
            Trajectory::SometimeAfter(first, second) => {
                let (first, second) = (self.holds(first, bindings), self.holds(second, bindings));
                let last = second.iter().rposition(|holds| *holds);
                (0..first.len()).all(|i| !first[i] || Some(i) <= last)
            }
            Trajectory::SometimeBefore(first, second) => {
                let (first, second) = (self.holds(first, bindings), self.holds(second, bindings));
                // Strictly before: the state itself does not count.
                let earliest = second.iter().position(|holds| *holds);
                (0..first.len()).all(|i| !first[i] || earliest.is_some_and(|earliest| earliest < i))
            }
            Trajectory::Within(time, body) => {
                self.holds(body, bindings).iter().zip(times).any(|(holds, reached)| *holds && reached <= time)
            }
            Trajectory::AlwaysWithin(time, first, second) => {
                let (first, second) = (self.holds(first, bindings), self.holds(second, bindings));
                // Time of the next state, from state `i` on, in which the second condition holds.
                let mut next = None;
                (0..first.len()).rev().all(|i| {
                    next = if second[i] { Some(times[i]) } else { next };
                    !first[i] || next.is_some_and(|next| next - times[i] <= *time)
                })
            }
            Trajectory::HoldDuring(from, until, body) => {
                let holds = self.holds(body, bindings);
                lasts(&holds, &times, from, |time| time < until)
            }
            Trajectory::HoldAfter(from, body) => lasts(&self.holds(body, bindings), &times, from, |_| true),
        }
    }
}

/// Returns `true` if a condition holds from the time `from` on: in the state that persists at `from`, and in every state
/// that begins at `from` or later, at a time that satisfies `is_included`. `holds` has one entry per state.
fn lasts(
    holds: &[bool],
    times: &[&BigRational],
    from: &BigRational,
    is_included: impl Fn(&BigRational) -> bool,
) -> bool {
    // Between two happenings the state of the last one persists.
    let current = times.iter().rposition(|time| *time <= from);
    let later = || holds.iter().zip(times).filter(|(_, time)| **time >= from && is_included(time));
    current.is_none_or(|current| holds[current]) && later().all(|(holds, _)| *holds)
}
