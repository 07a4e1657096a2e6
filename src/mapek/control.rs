//! The adaptation loop: passes each observation through the stages Monitor, Analyze, Plan and Execute, and returns
//! answers.

use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

use planner::Limits;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use tracing::info_span;

use crate::knowledge::Knowledge;
use crate::mapek::adapt::Adaptation;
use crate::mapek::analyze::{Findings, analyze, analyze_change, availability, available};
use crate::mapek::answer::{Answer, Command, DesignChange, Effect};
use crate::mapek::ask::Outcome;
use crate::mapek::beliefs::{Beliefs, Retry};
use crate::mapek::deadlines::{self, handle_overdue};
use crate::mapek::digest::{self, digest};
use crate::mapek::effects::{objectives, reconfigure, request};
use crate::mapek::event::{Event, Observation};
use crate::mapek::execute::execute;
use crate::mapek::fields::Refusal;
use crate::mapek::monitor::{Base, Changes, Monitor};
use crate::mapek::plan::Planner;
use crate::mapek::react::react;
use crate::mapek::record::{self, Decision, Snapshot};
use crate::mapek::settings::Settings;
use crate::mapek::step::PlannedStep;
use crate::mapek::watch::Watch;
use crate::message::{Errors, Message};
use crate::mission::Mission;

/// Limit on reasoning steps per update of the knowledge base; see [`rules::Limits`]. The robot waits during reasoning.
const MAX_REASONING_STEPS: u64 = 100_000_000;

/// Maximum number of names and values that may be added to the knowledge base after the start, or after it was last
/// rebuilt. Above it, the knowledge base is rebuilt without the names and values that are not used any more.
const MAX_GROWTH: usize = 1024;

/// Upper limit on the time stated in a line, measured from the clock or from the time of the previous line, whichever
/// is later. A line with a later time is refused.
const MAX_TIME_STEP: Duration = Duration::from_secs(1_000_000);

const NANOSECONDS_PER_MICROSECOND: u32 = 1000;

/// Returns the time at which a line is handled. `previous` is the time of the previous line, `now` the time of the
/// clock, and `has_times` states whether earlier lines had times. The time of the clock is used if the line states no
/// time. It is also used if the line is not understood and earlier lines had no times, because its time may be a time
/// of day. If the stated time is too late (see [`MAX_TIME_STEP`]), it is ignored, and an error is returned, too. The
/// returned time is never before `previous`. It is in whole microseconds, as in snapshots, so that a restored loop
/// decides in the same way.
pub(crate) fn time_of_line(
    previous: Duration,
    now: Duration,
    observation: &Observation,
    has_times: bool,
) -> (Duration, Option<Answer>) {
    let counts = has_times || observation.events.iter().any(Result::is_ok);
    let stated_time = observation.time.filter(|_| counts);
    let microseconds =
        |time: Duration| Duration::new(time.as_secs(), time.subsec_micros() * NANOSECONDS_PER_MICROSECOND);
    let (previous, now, stated_time) =
        (microseconds(previous), microseconds(now), stated_time.map(microseconds));
    let latest = previous.max(now).saturating_add(MAX_TIME_STEP);
    match stated_time {
        Some(time) if time > latest => {
            let message = format!(
                "`time` is {} s, but may be at most {} s: it is in seconds since the start of the mission and may \
                 increase by at most a million",
                time.as_secs_f64(),
                latest.as_secs()
            );
            (previous.max(now), Some(Answer::Error { code: "M308".to_owned(), message }))
        }
        stated_time => (previous.max(stated_time.unwrap_or(now)), None),
    }
}

#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct Agenda {
    changes: Changes,
    findings: Findings,
    /// Whether the loop has just started. Without changes, the first deliberation then skips [`Adaptation::adapt`].
    is_start: bool,
}

/// Copy of the state that deliberation can change until it stops because a plan is missing.
#[derive(Debug)]
pub(super) struct Checkpoint {
    agenda: Option<Agenda>,
    improvement_causes: (BTreeSet<String>, Duration),
    failures: Option<(PlannedStep, u32)>,
    plan: Option<VecDeque<PlannedStep>>,
    retry: Option<Retry>,
    flags: [bool; 3],
}

/// The adaptation loop of one robot.
#[derive(Debug, Clone)]
pub struct Loop {
    settings: Settings,
    pub(super) beliefs: Beliefs,
    pub(super) monitor: Monitor,
    pub(super) planner: Planner,
    agenda: Option<Agenda>,
    /// Number of reactions that may have changed the planning problem, which identifies the current problem.
    pub(super) question: u64,
    pub(super) digest: String,
    /// Number of names and values that the knowledge base had in addition to those of its documents when it was last
    /// rebuilt; 0 before.
    rebuilt_growth: usize,
}

impl Loop {
    /// Creates the loop of a mission.
    ///
    /// # Errors
    /// The filled problem does not fit the domain, the mission [depends on its past](Mission::depends_on_past), or the
    /// knowledge is inconsistent.
    pub fn new(mission: Mission, settings: Settings) -> Result<Self, Errors> {
        mission.filled()?;
        let unsupported = mission.depends_on_past();
        if !unsupported.is_empty() {
            return Err(unsupported.into());
        }
        let contradictions = mission.knowledge().map(Knowledge::contradictions).unwrap_or_default();
        if let Some(first) = contradictions.first() {
            let text =
                format!("the knowledge is inconsistent: {}: {}", first.violated, first.facts.join(", "));
            return Err(vec![Message::error("M110", text)].into());
        }
        let monitor = Monitor::new(&mission, &settings);
        let digest = digest(&mission, &settings);
        let planner = Planner { time_limit: settings.time_limit, ..Planner::default() };
        let mut beliefs = Beliefs::new(mission);
        if let Some(base) = beliefs.mission.knowledge_mut() {
            base.limit(MAX_REASONING_STEPS);
        }
        beliefs.filters = monitor.filters().states(beliefs.mission.knowledge());
        if let Some(base) = beliefs.mission.knowledge() {
            beliefs.available = available(base);
        }
        let agenda = Some(Agenda { is_start: true, ..Agenda::default() });
        Ok(Self { settings, beliefs, monitor, planner, agenda, question: 0, digest, rebuilt_growth: 0 })
    }

    /// Returns the settings of the loop.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns the state of the loop.
    pub fn beliefs(&self) -> &Beliefs {
        &self.beliefs
    }

    /// Returns the availability of all designs of the knowledge base, with the reasons for unavailability.
    pub fn designs(&self) -> Vec<DesignChange> {
        let Some(knowledge) = self.beliefs.mission.knowledge() else { return Vec::new() };
        let designs = knowledge.catalogue().designs().iter().map(|design| design.individual.name.as_str());
        designs
            .map(|design| availability(knowledge, design, self.beliefs.available.contains(design)))
            .collect()
    }

    /// Returns a handle by which another thread reads the progress of planning.
    pub fn watch(&self) -> Watch {
        self.planner.watch.clone()
    }

    /// Runs the first deliberation: searches for the first plan and requests its first action.
    pub fn start(&mut self) -> Vec<Answer> {
        self.deliberate()
    }

    /// Handles an observation: runs [`react`](Self::react) and [`deliberate`](Self::deliberate). `now` is the time
    /// since the start of the mission and must not decrease.
    ///
    /// ```
    /// use std::{path::Path, time::Duration};
    /// use metaplan::mapek::{Loop, Observation};
    /// use metaplan::setup::Setup;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let Setup { mission, settings, .. } = Setup::read(Path::new("missions/ugv.toml"))?;
    /// let mut control = Loop::new(mission, settings)?;
    /// control.start();
    /// let event = r#"{"event": "component_status", "component": "c_kinect", "status": "FALSE"}"#;
    /// let answers = control.handle(&Observation::parse(event), Duration::from_secs(3));
    /// assert!(answers.iter().any(|answer| answer.to_json()["answer"] == "plan_found"));
    /// # Ok(())
    /// # }
    /// ```
    pub fn handle(&mut self, observation: &Observation, now: Duration) -> Vec<Answer> {
        let mut answers = self.react(observation, now);
        answers.extend(self.deliberate());
        answers
    }

    /// Applies an observation to the beliefs, unless it is refused. If the action under way cannot continue unchanged,
    /// requests a safe effect: other designs for its remainder, or suspension. Also handles effects and actions whose
    /// deadline has passed. Does not search for a plan, so that the reaction is not delayed.
    ///
    /// Call [`deliberate`](Self::deliberate) after one or several observations.
    pub fn react(&mut self, observation: &Observation, now: Duration) -> Vec<Answer> {
        let _span = info_span!("react", line = self.beliefs.lines + 1).entered();
        let mut answers = Vec::new();
        // Computed plans that no decision has recorded are obsolete.
        self.planner.computed.clear();
        self.beliefs.lines += u64::from(!observation.is_timer);
        let has_times = self.beliefs.has_times;
        let (time, refusal_of_time) = time_of_line(self.beliefs.now, now, observation, has_times);
        self.beliefs.now = time;
        if let Some(refusal) =
            observation.sequence.and_then(|sequence| self.beliefs.numbers.refused(sequence))
        {
            return vec![refusal];
        }
        if let Some(refusal) = refusal_of_time {
            return vec![refusal];
        }
        let mut changes = Changes::default();
        let mut understood = false;
        // Held reports that are due precede the events of this line.
        let due = self.monitor.elapse(&mut self.beliefs, &mut changes);
        answers.extend(due.into_iter().map(refused));
        let due_news = u32::from(changes.is_news());
        for event in &observation.events {
            let outcome =
                event.clone().and_then(|event| self.monitor.apply(&mut self.beliefs, &event, &mut changes));
            match outcome {
                Ok(()) => understood = true,
                Err(refusal) => answers.push(refused(refusal)),
            }
        }
        for effect in handle_overdue(&mut self.beliefs, &self.settings, &mut answers) {
            self.abandon(effect, &mut changes);
        }
        answers.append(&mut changes.filtered);
        // A refused line must not stop the timers: its time may be a time of day.
        self.beliefs.has_times |= understood && observation.time.is_some();
        // A refused line does not use up its number, so that a corrected line can have it.
        if understood || changes.any() {
            if let Some(sequence) = observation.sequence.filter(|_| understood) {
                self.beliefs.numbers.insert(sequence);
            }
            // Before the analysis, the knowledge base must contain the observed design as the one in use (function
            // grounding).
            if let Some(running) = self.beliefs.running.as_ref().filter(|_| changes.observed) {
                let step = running.step.clone();
                objectives(&mut self.beliefs, Some(&step), &mut answers);
            }
            let findings = analyze_change(&mut self.beliefs, changes.base, &mut answers);
            react(&mut self.beliefs, &self.settings, &findings, &mut changes, &mut answers);
            let is_news = changes.is_news() || !findings.is_empty();
            // A held report that is due counts in addition to the events of the line, such as a failure.
            changes.news = due_news + u32::from(is_news);
            self.question += u64::from(is_news);
            self.beliefs.considered = self.beliefs.now;
            let agenda = self.agenda.get_or_insert_default();
            agenda.changes.extend(changes);
            agenda.findings.extend(findings);
        }
        answers
    }

    /// Searches for a plan if the changes since the last call require one, adopts the plan, and requests the next
    /// action. Can take several times the time limit of plans. Does nothing if no deliberation is
    /// [pending](Self::has_agenda).
    pub fn deliberate(&mut self) -> Vec<Answer> {
        let _span = info_span!("deliberate", line = self.beliefs.lines).entered();
        let mut answers = Vec::new();
        self.planner.computed.clear();
        let Some(Agenda { changes, findings, is_start }) = self.agenda.take() else { return answers };
        let mut adaptation = self.adaptation();
        if !is_start || changes.is_news() || !findings.is_empty() {
            adaptation.adapt(changes, findings, &mut answers);
        }
        execute(&mut adaptation, &mut answers);
        if !adaptation.planner.is_missing {
            adaptation.release(&mut answers);
        }
        self.compact_knowledge();
        answers
    }

    /// Returns `true` if deliberation is pending: observations were applied since the last deliberation, or the loop
    /// has not started.
    pub fn has_agenda(&self) -> bool {
        self.agenda.is_some()
    }

    fn abandon(&mut self, effect: u64, changes: &mut Changes) {
        let Some(Command::Reconfigure { function, to, .. }) =
            self.beliefs.outstanding.get(&effect).map(|effect| effect.command.clone())
        else {
            return;
        };
        let failed = Event::ReconfigurationFailed { effect };
        // The event is refused without a knowledge base, where the design cannot be marked as not realisable.
        let _ = self.monitor.apply(&mut self.beliefs, &failed, changes);
        self.beliefs.outstanding.remove(&effect);
        self.beliefs.waits.remove(&effect);
        self.beliefs.configuration.remove(&function);
        // The request may still arrive and be acknowledged.
        self.beliefs.receipts.supersede(effect, function, to);
    }

    pub(super) fn checkpoint(&self) -> Checkpoint {
        let beliefs = &self.beliefs;
        Checkpoint {
            agenda: self.agenda.clone(),
            improvement_causes: (beliefs.improvement_causes.clone(), beliefs.improvement_since),
            failures: beliefs.failures.clone(),
            plan: beliefs.plan.clone(),
            retry: beliefs.retry,
            flags: [beliefs.stuck, beliefs.reached, beliefs.unproved],
        }
    }

    /// Restores the state at the checkpoint. Deliberation must have stopped since then because a plan was missing:
    /// requests and changes that follow a plan are not undone.
    pub(super) fn roll_back(&mut self, to: Checkpoint) {
        let beliefs = &mut self.beliefs;
        self.agenda = to.agenda;
        (beliefs.improvement_causes, beliefs.improvement_since) = to.improvement_causes;
        beliefs.failures = to.failures;
        (beliefs.plan, beliefs.retry) = (to.plan, to.retry);
        [beliefs.stuck, beliefs.reached, beliefs.unproved] = to.flags;
        self.planner.computed.clear();
    }

    fn adaptation(&mut self) -> Adaptation<'_> {
        Adaptation { beliefs: &mut self.beliefs, planner: &mut self.planner, settings: &self.settings }
    }

    /// Returns the next time, since the start of the mission, at which the loop must act without an event: a filter
    /// releases a report, a sensor becomes silent, a search is due, or a deadline passes. The caller should handle a
    /// tick or a [timer](Observation::timer) at that time. Returns `None` if nothing is scheduled.
    pub fn due(&self) -> Option<Duration> {
        // Times are compared with `considered` instead of `now`: a refused line advances the time, but decides nothing
        // that has become due.
        let improvement = self.beliefs.improvement_since.saturating_add(self.settings.settle);
        let improvement = (!self.beliefs.improvement_causes.is_empty()
            && improvement > self.beliefs.considered)
            .then_some(improvement);
        let retry = self.beliefs.retry.map(|retry| retry.at).filter(|at| *at > self.beliefs.considered);
        let filters = self.monitor.filters().due(&self.beliefs.filters);
        let deadline = deadlines::due(&self.beliefs, &self.settings);
        filters.into_iter().chain(improvement).chain(retry).chain(deadline).min()
    }

    /// Returns the [outstanding](Beliefs::outstanding) effects as answers, to be requested again after a restart.
    pub fn repeat(&self) -> Vec<Answer> {
        let again = |effect: &Effect| Answer::Effect(Effect { repeated: true, ..effect.clone() });
        self.beliefs.outstanding().map(again).collect()
    }

    /// Returns the checksum of the initial mission, the settings, and the version of the program, which identifies them
    /// in a journal.
    pub fn digest(&self) -> String {
        digest::versioned(&self.digest)
    }

    /// Returns the checksum of the initial mission and the settings. It is usually the same in other versions of the
    /// program.
    pub fn inputs_digest(&self) -> String {
        self.digest.clone()
    }

    fn compact_knowledge(&mut self) {
        let growth = self.beliefs.mission.knowledge().map_or(0, Knowledge::growth);
        let is_due = growth > self.rebuilt_growth + MAX_GROWTH;
        let Some(base) = self.beliefs.mission.knowledge_mut().filter(|_| is_due) else { return };
        let statements = base.statements();
        // If the restoration exceeds the reasoning budget, the knowledge base stays unchanged.
        let _ = base.restore(&statements);
        self.rebuilt_growth = base.growth();
    }
}

fn refused(Refusal { code, message }: Refusal) -> Answer {
    Answer::Error { code: code.to_owned(), message }
}

/// Recording and replay of decisions, for the journal.
impl Loop {
    /// Returns the journal's record of a reaction or deliberation: its answers, and the plans computed for them. A
    /// second call returns no plans.
    pub fn decision(&mut self, answers: &[Answer]) -> Decision {
        let plans = std::mem::take(&mut self.planner.computed);
        Decision {
            answers: answers.iter().map(Answer::to_json).collect(),
            plans: plans.iter().map(Outcome::to_record).collect(),
        }
    }

    /// Replays [`Loop::handle`] with recorded plans in place of searches.
    pub fn handle_again(&mut self, observation: &Observation, now: Duration, plans: &[Value]) -> Vec<Answer> {
        self.planner.recorded = plans.iter().filter_map(Outcome::from_record).collect();
        let answers = self.handle(observation, now);
        self.planner.recorded.clear();
        answers
    }

    /// Replays [`Loop::start`] or [`Loop::deliberate`] with recorded plans in place of searches.
    pub fn deliberate_again(&mut self, plans: &[Value]) -> Vec<Answer> {
        self.planner.recorded = plans.iter().filter_map(Outcome::from_record).collect();
        let answers = self.deliberate();
        self.planner.recorded.clear();
        answers
    }

    /// Returns a snapshot of the beliefs and of the pending deliberation, if there is one.
    pub fn snapshot(&self) -> Snapshot {
        let mut snapshot = record::snapshot(&self.beliefs);
        snapshot.0["agenda"] = self.agenda_record();
        snapshot
    }

    pub(super) fn agenda_record(&self) -> Value {
        serde_json::to_value(&self.agenda).unwrap_or_default()
    }

    /// Restores the state from a snapshot of a loop of the same mission.
    ///
    /// # Errors
    /// The snapshot is damaged or does not fit the mission.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), Message> {
        self.planner.memo.clear();
        let agenda = snapshot.0.get("agenda").unwrap_or(&Value::Null);
        self.agenda = Option::deserialize(agenda).map_err(|error| {
            Message::error("M320", format!("the snapshot does not fit the mission: {error}"))
        })?;
        record::restore(&mut self.beliefs, snapshot)
    }
}

/// Single stages, for strategies of a simulation that observe, plan and request actions separately.
impl Loop {
    /// Applies an observation to the beliefs without a reaction. Discards a pending deliberation.
    pub(crate) fn observe(&mut self, observation: &Observation, now: Duration) {
        self.beliefs.lines += 1;
        self.beliefs.now = self.beliefs.now.max(now);
        self.agenda = None;
        let mut changes = Changes::default();
        let _ = self.monitor.elapse(&mut self.beliefs, &mut changes);
        for event in observation.events.iter().flatten() {
            // Refused events change nothing.
            let _ = self.monitor.apply(&mut self.beliefs, event, &mut changes);
        }
        if changes.base == Base::Watched {
            analyze(&mut self.beliefs, &mut Vec::new());
        }
    }

    /// Sets limits in addition to the time limit of plans. A plan cut short by these limits must not be used.
    pub(crate) fn limit(&mut self, limits: Limits) {
        self.planner.limits = limits;
    }

    pub(crate) fn plan_anew(&mut self) -> Option<Vec<PlannedStep>> {
        let outcome = self.adaptation().plan(true);
        self.planner.computed.clear();
        outcome.steps
    }

    /// Requests an action without a check of its conditions.
    pub(crate) fn request_now(&mut self, step: PlannedStep, answers: &mut Vec<Answer>) {
        request(&mut self.beliefs, step, answers);
    }

    pub(crate) fn reconfigure_now(&mut self, step: PlannedStep, answers: &mut Vec<Answer>) {
        if let Some(mut running) = self.beliefs.running.take() {
            running.step = step;
            reconfigure(&mut self.beliefs, &mut running, answers);
            self.beliefs.running = Some(running);
        }
    }

    pub(crate) fn is_goal(&self) -> bool {
        self.beliefs.plan.is_none() && self.beliefs.running.is_none() && self.beliefs.violation().is_none()
    }

    pub(crate) fn designs_for(&self, function: &str) -> Vec<String> {
        let mut designs = self.beliefs.mission.designs_of(function);
        designs.retain(|design| self.beliefs.is_available(design));
        designs
    }
}
