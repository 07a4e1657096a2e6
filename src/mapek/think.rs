//! Planning in parallel to the loop: a copy of the loop plans on another thread while the loop reacts to observations.
//!
//! The copy records each planning problem (*question*) with its outcome. If no observation has changed the
//! question in the meantime, the loop uses the recorded outcomes without a search. Progress of the action under
//! way, ticks, and repeated reports do not change the question; after such progress, however, the plan is no
//! longer reported as optimal, or its absence as proved. Plans for a changed question are used only after several
//! cancelled searches in a row, and only if they fit the situation. The absence of a plan that continues is used only
//! after several results for changed questions in a row, and does not count as proved.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use planner::Limits;

use crate::mapek::answer::Answer;
use crate::mapek::ask::Outcome;
use crate::mapek::control::Loop;
use crate::mapek::event::{Event, Observation};
use crate::mapek::live::Live;
use crate::mapek::memo::StoredQuestion;
use crate::mapek::plan::Prepared;

/// A copy of an adaptation loop that computes plans on another thread.
#[derive(Debug)]
pub struct Thinker {
    control: Loop,
    limits: Limits,
}

/// Plans computed by a [`Thinker`].
#[derive(Debug)]
pub struct Thoughts {
    question: u64,
    /// Checksum of the mission and the settings of the loop that planned.
    digest: String,
    answers: Vec<(StoredQuestion, Outcome)>,
    is_stopped: bool,
    live: Live,
}

impl Thinker {
    /// Returns a handle to the search that [`Self::think`] will run.
    pub fn handle(&self) -> SearchHandle {
        SearchHandle { question: self.control.question, stop: self.limits.interrupt(), is_cancelled: false }
    }

    /// Computes the plans for the pending decisions of the copied loop. [`Loop::deliberate_with`] applies them to the
    /// loop.
    pub fn think(mut self) -> Thoughts {
        self.control.planner.question_log = Some(Vec::new());
        self.control.deliberate();
        let answers = self.control.planner.question_log.take().unwrap_or_default();
        let Loop { question, digest, planner, .. } = self.control;
        Thoughts { question, digest, answers, is_stopped: self.limits.reached(), live: planner.live }
    }
}

/// A search for plans on another thread. Dropping the handle interrupts the search.
#[derive(Debug)]
pub struct SearchHandle {
    question: u64,
    stop: Arc<AtomicBool>,
    is_cancelled: bool,
}

impl Drop for SearchHandle {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// The search for plans that runs in parallel to a loop, and the policy for cancelling it.
///
/// A search is cancelled when the planning problem has changed. After a few consecutive cancelled searches, the next one
/// runs to its end, because otherwise observations that change the problem all the time would prevent every plan.
#[derive(Debug, Default)]
pub struct ParallelSearch {
    running: Option<SearchHandle>,
    cancelled: u32,
}

/// Number of consecutive cancelled searches after which a changed problem does not cancel the next one. A
/// search without a current problem is always cancelled.
const MAX_CANCELLED: u32 = 3;

impl ParallelSearch {
    /// Registers a search that begins. An earlier search that is still registered is interrupted.
    pub fn begin(&mut self, search: SearchHandle) {
        self.running = Some(search);
    }

    /// Returns `true` from the start of a search to [`Self::end`] or [`Self::interrupt`].
    pub fn is_running(&self) -> bool {
        self.running.is_some()
    }

    /// Cancels the search if `question`, the number of the current planning problem, is not the one it solves, unless too
    /// many searches in a row were cancelled. Without a current problem, always cancels it.
    pub fn update(&mut self, question: Option<u64>) {
        let Some(running) = &mut self.running else { return };
        let is_outdated =
            question.is_none_or(|question| question != running.question && self.cancelled < MAX_CANCELLED);
        if is_outdated {
            running.is_cancelled = true;
            running.stop.store(true, Ordering::Relaxed);
        }
    }

    /// Registers the end of the search. Returns `true` if it was cancelled or [interrupted](Self::interrupt), so that its
    /// plans cannot be used.
    pub fn end(&mut self) -> bool {
        let Some(running) = self.running.take() else { return true };
        self.cancelled += u32::from(running.is_cancelled);
        running.is_cancelled
    }

    /// Returns `true` if plans for an outdated problem should be used if they fit the current situation, because too many
    /// searches in a row were cancelled.
    pub fn accepts_late_plans(&self) -> bool {
        self.cancelled >= MAX_CANCELLED
    }

    /// Registers that the loop has a plan, or needs none: later searches can be cancelled again.
    pub fn reset(&mut self) {
        self.cancelled = 0;
    }

    /// Interrupts the search. Its result must be ignored: [`Self::end`] then returns `true`.
    pub fn interrupt(&mut self) {
        self.running = None;
    }
}

impl Loop {
    /// Copies the loop for planning on another thread.
    pub fn thinker(&self) -> Thinker {
        let (mut control, limits) = (self.clone(), Limits::none());
        control.planner.limits = limits.clone();
        Thinker { control, limits }
    }

    /// Returns `true` if `thoughts` are plans for the loop's current planning problem, and planning was not
    /// interrupted.
    pub fn is_answered_by(&self, thoughts: &Thoughts) -> bool {
        self.is_usable(thoughts) && thoughts.question == self.question
    }

    /// Returns `true` if planning was not interrupted and the loop that planned has the same mission and settings as this
    /// loop. The loops of two versions of a mission number their planning problems independently.
    fn is_usable(&self, thoughts: &Thoughts) -> bool {
        !thoughts.is_stopped && thoughts.digest == self.digest
    }

    /// Keeps the incremental planner of a search on another thread, so that the next search need not ground the mission
    /// again. Its data depend on the mission only, so those of a cancelled search are kept, too. They take memory.
    pub fn keep_planner(&mut self, thoughts: &Thoughts) {
        if let Live::Ready(_) = &thoughts.live
            && thoughts.digest == self.digest
        {
            self.planner.live = thoughts.live.clone();
        }
    }

    /// Returns `true` if an observation mentions an action or an effect whose number has not been used in a request
    /// yet.
    pub fn is_ahead(&self, observation: &Observation) -> bool {
        let beliefs = self.beliefs();
        observation.events.iter().flatten().any(|event| match event {
            Event::Started { action }
            | Event::Succeeded { action }
            | Event::Failed { action, .. }
            | Event::Cancelled { action }
            | Event::Progress { action, .. } => *action > beliefs.actions,
            Event::Acknowledged { effect } | Event::ReconfigurationFailed { effect } => {
                *effect > beliefs.effects
            }
            _ => false,
        })
    }

    /// Returns the number of the current planning problem. Plans for another number are obsolete.
    pub fn question(&self) -> u64 {
        self.question
    }

    /// Runs [`Loop::deliberate`] if no search is necessary. Otherwise returns `None`, and the loop is unchanged.
    pub fn deliberate_at_once(&mut self) -> Option<Vec<Answer>> {
        if !self.has_agenda() {
            return Some(Vec::new());
        }
        let before = self.checkpoint();
        self.planner.forbids_search = true;
        let answers = self.deliberate();
        self.planner.forbids_search = false;
        if std::mem::take(&mut self.planner.is_missing) {
            self.roll_back(before);
            return None;
        }
        self.planner.prepared.late_results = 0;
        Some(answers)
    }

    /// Runs [`Loop::deliberate`] with the plans in `thoughts`. Returns `None` and leaves the loop unchanged, except
    /// for the number of late results, if planning was interrupted, if the loop that planned has another mission, or if
    /// a plan is missing or does not fit the situation. Unless `accepts_late` is `true`, this is also the case if the
    /// planning problem has changed since.
    pub fn deliberate_with(&mut self, thoughts: Thoughts, accepts_late: bool) -> Option<Vec<Answer>> {
        if !self.is_usable(&thoughts) || !self.is_answered_by(&thoughts) && !accepts_late {
            return None;
        }
        // A checkpoint covers only changes before the first plan. Therefore, the whole loop is copied.
        let before = self.clone();
        let late_results = self.planner.prepared.late_results;
        let is_late = !self.is_answered_by(&thoughts);
        let outcomes = thoughts.answers.into();
        self.planner.prepared = Prepared { outcomes, is_late, late_results, ..Prepared::default() };
        self.planner.forbids_search = true;
        let answers = self.deliberate();
        // A plan for an earlier situation may not fit the current one. A plan that was kept although it does not fit is
        // no reason to search again.
        let misfits = || {
            self.planner.prepared.has_outdated_plan
                && self.beliefs.plan.is_some()
                && self.beliefs.violation().is_some()
        };
        if self.planner.is_missing || misfits() {
            *self = before;
            self.planner.prepared.late_results += u32::from(is_late);
            return None;
        }
        self.planner.forbids_search = false;
        self.planner.prepared = Prepared::default();
        Some(answers)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::time::Duration;

    use crate::knowledge::Fault;
    use crate::mapek::control::Loop;
    use crate::mapek::event::Observation;
    use crate::mapek::live::Live;
    use crate::mapek::think::Thoughts;
    use crate::setup::Setup;

    #[test]
    fn the_planner_of_a_search_is_kept() {
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/ugv.toml");
        let Setup { mission, settings, .. } = Setup::read(&manifest).expect("the mission is read");
        let mut control = Loop::new(mission, settings).expect("a loop");
        let thoughts = control.thinker().think();
        control.keep_planner(&thoughts);
        assert!(matches!(control.planner.live, Live::Ready(_)));
        // The planner may not have been built because the search was stopped.
        let stopped = Thoughts { live: Live::Unsuited, ..control.thinker().think() };
        control.keep_planner(&stopped);
        assert!(matches!(control.planner.live, Live::Ready(_)));
    }

    /// Otherwise, the same search would be repeated without end.
    #[test]
    fn a_kept_plan_that_does_not_fit_is_no_reason_to_search_again() {
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/ugv.toml");
        let Setup { mission, settings, .. } = Setup::read(&manifest).expect("the mission is read");
        let mut control = Loop::new(mission, settings.with_settle(Duration::ZERO)).expect("a loop");
        control.start();
        let nowhere =
            control.beliefs.mission.goal("(and (robot_at wp1) (not (robot_at wp1)))").expect("a goal");
        control.beliefs.mission.set_goal(nowhere);
        control.beliefs.improvement_causes.insert("facts".to_owned());
        control.react(&Observation::parse(r#"{"event":"tick"}"#), Duration::from_secs(1));
        assert!(control.beliefs.violation().is_some());
        assert!(control.deliberate_at_once().is_none(), "a search is needed");
        let thoughts = control.thinker().think();
        let answers = control.deliberate_with(thoughts, false).expect("the search has an answer");
        let kinds: Vec<_> = answers.iter().map(|answer| answer.to_json()["answer"].clone()).collect();
        assert_eq!(kinds, ["plan_requested", "plan_kept"]);
        assert!(!control.has_agenda());
    }

    /// Otherwise, this search, too, would be repeated without end.
    #[test]
    fn missing_conclusions_are_no_reason_to_search_again() {
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/ugv.toml");
        let Setup { mission, settings, .. } = Setup::read(&manifest).expect("the mission is read");
        let mut control = Loop::new(mission, settings).expect("a loop");
        control.start();
        control.planner.prepared.is_outdated = true;
        let goal = r#"{"event":"goal_changed","goal":"(robot_at wp2)"}"#;
        control.react(&Observation::parse(goal), Duration::from_secs(1));
        control.beliefs.fault = Some(Fault {
            code: "R301".to_owned(),
            message: "too many steps".to_owned(),
            rule: "counting".to_owned(),
        });
        let answers = control.deliberate_at_once().expect("no search is needed");
        assert!(answers.iter().any(|answer| answer.to_json()["answer"] == "plan_none"), "{answers:?}");
    }
}
