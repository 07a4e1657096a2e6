//! The loop itself: an observation goes through the stations, one after the other, and answers come out.

use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

use planner::Limits;
use serde_json::Value;
use tracing::info_span;

use crate::knowledge::Knowledge;
use crate::mapek::adapt::Adapting;
use crate::mapek::analyze::{Findings, analyze, available, follow, judged};
use crate::mapek::answer::{Answer, Command, DesignChange, Effect};
use crate::mapek::ask::Outcome;
use crate::mapek::beliefs::{Beliefs, Retry};
use crate::mapek::deadlines::{self, overdue};
use crate::mapek::digest::digest;
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

/// What follows from an observation is to be found in so many steps; see [`rules::Limits`]. A robot waits meanwhile.
const STEPS: u64 = 100_000_000;

/// So many names and values may be interned before the knowledge is made anew without what is not used any more.
const GROWTH: usize = 1024;

/// Upper limit on the step from the time of one line to that of the next. Sequence numbers skip no more than a million either.
const MAX_TIME_STEP: Duration = Duration::from_secs(1_000_000);

/// What there is to deliberate on.
#[derive(Debug, Clone, Default)]
struct Agenda {
    changes: Changes,
    findings: Findings,
    /// Whether the loop has not begun: nothing has changed that could be adapted to.
    is_start: bool,
}

/// What deliberation changes before the first plan is asked for.
#[derive(Debug)]
pub(super) struct Checkpoint {
    agenda: Option<Agenda>,
    hopes: (BTreeSet<String>, Duration),
    failures: Option<(PlannedStep, u32)>,
    plan: Option<VecDeque<PlannedStep>>,
    retry: Option<Retry>,
    flags: [bool; 2],
}

/// The adaptation loop of one robot.
#[derive(Debug, Clone)]
pub struct Loop {
    settings: Settings,
    pub(super) beliefs: Beliefs,
    monitor: Monitor,
    pub(super) planner: Planner,
    /// What has changed since the last deliberation, if anything has.
    agenda: Option<Agenda>,
    /// Number of times that the question for the planner has changed.
    pub(super) question: u64,
    digest: String,
}

impl Loop {
    /// Takes charge of a mission.
    ///
    /// # Errors
    /// The mission cannot be planned for: what the knowledge base contributes does not fit the domain, or the knowledge
    /// contradicts itself.
    pub fn new(mission: Mission, settings: Settings) -> Result<Self, Errors> {
        mission.filled()?;
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
            base.limit(STEPS);
        }
        beliefs.filters = monitor.filters().states(beliefs.mission.knowledge());
        if let Some(base) = beliefs.mission.knowledge() {
            beliefs.available = available(base);
        }
        let agenda = Some(Agenda { is_start: true, ..Agenda::default() });
        Ok(Self { settings, beliefs, monitor, planner, agenda, question: 0, digest })
    }

    /// What the loop believes and has asked for.
    pub fn beliefs(&self) -> &Beliefs {
        &self.beliefs
    }

    /// All designs of the knowledge base, each with why it is not available, if it is not.
    pub fn designs(&self) -> Vec<DesignChange> {
        let Some(knowledge) = self.beliefs.mission.knowledge() else { return Vec::new() };
        let designs = knowledge.catalogue().designs().iter().map(|own| own.individual.name.as_str());
        designs.map(|design| judged(knowledge, design, self.beliefs.available.contains(design))).collect()
    }

    /// To look at how planning goes, from another thread.
    pub fn watch(&self) -> Watch {
        self.planner.watch.clone()
    }

    /// Makes the first plan and requests the first action.
    pub fn start(&mut self) -> Vec<Answer> {
        self.deliberate()
    }

    /// Takes an observation over, at a time since the start of the mission that never goes back, and says what follows:
    /// [`react`](Self::react) and [`deliberate`](Self::deliberate) at once.
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

    /// Takes an observation over, and asks for a safe effect if the action under way cannot go on as it is: other designs with which
    /// what is left of it can be done, or a standstill. Nothing is planned, whatever the time limit of plans.
    ///
    /// Several observations may be reacted to before [`deliberate`](Self::deliberate) is called.
    pub fn react(&mut self, observation: &Observation, now: Duration) -> Vec<Answer> {
        let _span = info_span!("react", line = self.beliefs.lines + 1).entered();
        let mut answers = Vec::new();
        // Plans that nobody has asked for are of no use to anybody.
        self.planner.made.clear();
        self.beliefs.lines += u64::from(!observation.is_timer);
        let latest = self.beliefs.now.max(now).saturating_add(MAX_TIME_STEP);
        self.beliefs.now =
            self.beliefs.now.max(observation.time.filter(|time| *time <= latest).unwrap_or(now));
        if let Some(refusal) =
            observation.sequence.and_then(|sequence| self.beliefs.numbers.refused(sequence))
        {
            return vec![refusal];
        }
        if let Some(time) = observation.time.filter(|time| *time > latest) {
            let text = format!(
                "`time` is {} s, but may be {} s at most: it is in seconds since the start of the mission, and skips a million at \
                 most",
                time.as_secs_f64(),
                latest.as_secs()
            );
            return vec![Answer::Error { code: "M308".to_owned(), message: text }];
        }
        let mut changes = Changes::default();
        let mut understood = false;
        let due = self.monitor.elapse(&mut self.beliefs, &mut changes);
        answers.extend(due.into_iter().map(refused));
        for event in &observation.events {
            let outcome =
                event.clone().and_then(|event| self.monitor.take(&mut self.beliefs, &event, &mut changes));
            match outcome {
                Ok(()) => understood = true,
                Err(refusal) => answers.push(refused(refusal)),
            }
        }
        for effect in overdue(&mut self.beliefs, &self.settings, &mut answers) {
            self.give_up(effect, &mut changes);
        }
        answers.append(&mut changes.filtered);
        if changes.goal {
            self.planner.memo.forget();
        }
        if understood || changes.any() {
            if let Some(sequence) = observation.sequence {
                self.beliefs.numbers.insert(sequence);
            }
            if let Some(running) = self.beliefs.running.as_ref().filter(|_| changes.observed) {
                let step = running.step.clone();
                objectives(&mut self.beliefs, Some(&step), &mut answers);
            }
            let findings = follow(&mut self.beliefs, changes.base, &mut answers);
            react(&mut self.beliefs, &self.settings, &findings, &mut changes, &mut answers);
            self.question += u64::from(changes.is_news() || !findings.is_empty());
            let agenda = self.agenda.get_or_insert_default();
            agenda.changes.extend(changes);
            agenda.findings.extend(findings);
        }
        answers
    }

    /// Plans if what was reacted to calls for it, adopts the plan, and requests the next action. This may take as long as the time
    /// limit of plans allows, several times. Without anything to deliberate on it does nothing.
    pub fn deliberate(&mut self) -> Vec<Answer> {
        let _span = info_span!("deliberate", line = self.beliefs.lines).entered();
        let mut answers = Vec::new();
        self.planner.made.clear();
        let Some(Agenda { changes, findings, is_start }) = self.agenda.take() else { return answers };
        let mut adapting = self.adapting();
        if !is_start || changes.is_news() || !findings.is_empty() {
            adapting.adapt(changes, findings, &mut answers);
        }
        execute(&mut adapting, &mut answers);
        if !adapting.planner.is_missing {
            adapting.release(&mut answers);
        }
        self.forget();
        answers
    }

    /// Returns `true` if something was reacted to and not deliberated on.
    pub fn has_agenda(&self) -> bool {
        self.agenda.is_some()
    }

    /// A reconfiguration that was not acknowledged in time counts as failed, and it is not known which design the function has.
    fn give_up(&mut self, effect: u64, changes: &mut Changes) {
        let Some(Command::Reconfigure { function, to, .. }) =
            self.beliefs.outstanding.get(&effect).map(|effect| effect.command.clone())
        else {
            return;
        };
        let failed = Event::ReconfigurationFailed { effect };
        // Without a knowledge base there is nothing to be noted of the design.
        let _ = self.monitor.take(&mut self.beliefs, &failed, changes);
        self.beliefs.outstanding.remove(&effect);
        self.beliefs.waits.remove(&effect);
        self.beliefs.configuration.remove(&function);
        // It may still arrive, and be acknowledged.
        self.beliefs.receipts.supersede(effect, function, to);
    }

    /// What deliberation changes before the first plan is asked for.
    pub(super) fn checkpoint(&self) -> Checkpoint {
        let known = &self.beliefs;
        Checkpoint {
            agenda: self.agenda.clone(),
            hopes: (known.hopes.clone(), known.hoped),
            failures: known.failures.clone(),
            plan: known.plan.clone(),
            retry: known.retry,
            flags: [known.stuck, known.reached],
        }
    }

    /// Goes back to where no plan had been asked for.
    pub(super) fn roll_back(&mut self, to: Checkpoint) {
        let known = &mut self.beliefs;
        self.agenda = to.agenda;
        (known.hopes, known.hoped) = to.hopes;
        known.failures = to.failures;
        (known.plan, known.retry) = (to.plan, to.retry);
        [known.stuck, known.reached] = to.flags;
        self.planner.made.clear();
    }

    /// The station that decides.
    fn adapting(&mut self) -> Adapting<'_> {
        Adapting { beliefs: &mut self.beliefs, planner: &mut self.planner, settings: &self.settings }
    }

    /// Time since the start of the mission at which something becomes due without an event: a report that a filter holds
    /// back, a sensor that counts as silent, a better plan, another search after one that was cut short, or a deadline. A tick or a [timer](Observation::timer) at that
    /// time takes it.
    pub fn due(&self) -> Option<Duration> {
        let hope = self.beliefs.hoped.saturating_add(self.settings.settle);
        let hope = (!self.beliefs.hopes.is_empty() && hope > self.beliefs.now).then_some(hope);
        let retry = self.beliefs.retry.map(|own| own.at).filter(|at| *at > self.beliefs.now);
        let filters = self.monitor.filters().due(&self.beliefs.filters);
        let deadline = deadlines::due(&self.beliefs, &self.settings);
        filters.into_iter().chain(hope).chain(retry).chain(deadline).min()
    }

    /// Effects that were asked for and not acknowledged, to be asked for again after a restart.
    pub fn repeat(&self) -> Vec<Answer> {
        let again = |effect: &Effect| Answer::Effect(Effect { repeated: true, ..effect.clone() });
        self.beliefs.outstanding().map(again).collect()
    }

    /// A checksum of the mission before anything has happened, to tell missions apart.
    pub fn digest(&self) -> String {
        self.digest.clone()
    }

    /// Makes the knowledge anew where its history takes up memory.
    fn forget(&mut self) {
        let Some(base) = self.beliefs.mission.knowledge_mut().filter(|base| base.growth() > GROWTH) else {
            return;
        };
        let statements = base.statements();
        // What was consistent and came to an end does so again.
        let _ = base.restore(&statements);
    }
}

/// A refusal as an answer.
fn refused(Refusal { code, message }: Refusal) -> Answer {
    Answer::Error { code: code.to_owned(), message }
}

/// What the journal keeps, and what is made of it again.
impl Loop {
    /// The decision of which these are the answers, to be called once after each step.
    pub fn decision(&mut self, answers: &[Answer]) -> Decision {
        let made = std::mem::take(&mut self.planner.made);
        Decision {
            answers: answers.iter().map(Answer::to_json).collect(),
            plans: made.iter().map(Outcome::to_record).collect(),
        }
    }

    /// As [`Loop::handle`], with the plans that were made then.
    pub fn handle_again(&mut self, observation: &Observation, now: Duration, plans: &[Value]) -> Vec<Answer> {
        self.planner.recorded = plans.iter().filter_map(Outcome::from_record).collect();
        let answers = self.handle(observation, now);
        self.planner.recorded.clear();
        answers
    }

    /// Repeats [`Loop::start`] or [`Loop::deliberate`] with recorded plans.
    pub fn deliberate_again(&mut self, plans: &[Value]) -> Vec<Answer> {
        self.planner.recorded = plans.iter().filter_map(Outcome::from_record).collect();
        let answers = self.deliberate();
        self.planner.recorded.clear();
        answers
    }

    /// All that the loop knows, once it has deliberated on all that it has reacted to.
    pub fn snapshot(&self) -> Snapshot {
        record::snapshot(&self.beliefs)
    }

    /// Takes over what a loop of the same mission knew.
    ///
    /// # Errors
    /// The snapshot is damaged, or belongs to another mission.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), Message> {
        self.planner.memo.forget();
        self.agenda = None;
        record::restore(&mut self.beliefs, snapshot)
    }
}

/// The stations one by one, for those who decide otherwise: they observe, plan and request by themselves.
impl Loop {
    /// Takes an observation over without reacting to it.
    pub(crate) fn observe(&mut self, observation: &Observation, now: Duration) {
        self.beliefs.lines += 1;
        self.beliefs.now = self.beliefs.now.max(now);
        self.agenda = None;
        let mut changes = Changes::default();
        let _ = self.monitor.elapse(&mut self.beliefs, &mut changes);
        for event in observation.events.iter().flatten() {
            // What the loop would answer with an error changes nothing.
            let _ = self.monitor.take(&mut self.beliefs, event, &mut changes);
        }
        if changes.goal {
            self.planner.memo.forget();
        }
        if changes.base == Base::Watched {
            analyze(&mut self.beliefs, &mut Vec::new());
        }
    }

    /// Sets limits at which planning ends, in addition to its own time limit. A plan that these limits cut short must
    /// not be used.
    pub(crate) fn limit(&mut self, limits: Limits) {
        self.planner.limits = limits;
    }

    /// The best plan for the situation as it is believed.
    pub(crate) fn plan_anew(&mut self) -> Option<Vec<PlannedStep>> {
        let outcome = self.adapting().plan(true);
        self.planner.made.clear();
        outcome.steps
    }

    /// Requests an action without asking whether it can be done.
    pub(crate) fn request_now(&mut self, step: PlannedStep, answers: &mut Vec<Answer>) {
        request(&mut self.beliefs, step, answers);
    }

    /// Gives the action under way other designs.
    pub(crate) fn reconfigure_now(&mut self, step: PlannedStep, answers: &mut Vec<Answer>) {
        if let Some(mut running) = self.beliefs.running.take() {
            running.step = step;
            reconfigure(&mut self.beliefs, &mut running, answers);
            self.beliefs.running = Some(running);
        }
    }

    /// Whether the goal holds as far as is believed.
    pub(crate) fn is_goal(&self) -> bool {
        self.beliefs.plan.is_none() && self.beliefs.running.is_none() && self.beliefs.violation().is_none()
    }

    /// The available designs of a function, in the order of the knowledge base.
    pub(crate) fn designs_for(&self, function: &str) -> Vec<String> {
        let mut designs = self.beliefs.mission.designs_of(function);
        designs.retain(|design| self.beliefs.is_available(design));
        designs
    }
}
