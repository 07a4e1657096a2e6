//! The configuration loop: asserts the robot's reports in the knowledge base, and chooses and requests designs for
//! objectives that need a design.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use ontology::tomasys::change::Status;
use planner::Limits;
use serde::Serialize;

use crate::configure::choice::{Choice, Verdict, current};
use crate::configure::configurator::{Configurator, Goal};
use crate::knowledge::{Fault, RobotReport};
use crate::mapek::{
    Accepted, Answer, Event, FilterSettings, FilterStates, Filters, Numbers, Observation, Refusal,
    Unrecorded, available, changes, doubts, inferred, time_of_line,
};
use crate::message::Message;

/// A line of output, in the format `metaplan-events/1`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum KeeperAnswer {
    /// An answer that the planning loop of [`crate::mapek`] gives, too.
    Loop(Answer),
    /// A requested change of an objective's design, or the report that no design was chosen for it.
    Service(Service),
}

/// A requested change of an objective's design, or the report that no design was chosen for it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "answer")]
#[non_exhaustive]
pub enum Service {
    /// A request to change the design of a function.
    #[serde(rename = "reconfigure")]
    Reconfigure {
        /// The objective.
        objective: String,
        /// Function of the objective, if it has one.
        function: Option<String>,
        /// The previous design, if there was one.
        from: Option<String>,
        /// The new design. `None` if the objective was removed, or has to give up its design for other objectives.
        to: Option<String>,
        /// Reasons, as sentences: why the objective needs a design, why better designs were not chosen, and which
        /// requirements the new design misses. If the objective was removed, the only reason is the removal.
        because: Vec<String>,
        /// `true` if it is proved that no choice for all objectives in need is better, or if the objective was
        /// removed.
        optimal: bool,
        /// Number by which acknowledgements refer to this change, from 1.
        effect: u64,
        /// `true` if the change may have been requested before the program was restarted.
        #[serde(skip_serializing_if = "std::ops::Not::not")]
        repeated: bool,
    },
    /// No design was chosen for the objective, usually because none can serve it now. The objective keeps its design,
    /// if any, unless a line before requests to give it up.
    #[serde(rename = "unserved")]
    Unserved {
        /// The objective.
        objective: String,
        /// Function of the objective, if it has one.
        function: Option<String>,
        /// Reasons, as sentences: why the objective needs a design, and why each design was not chosen.
        because: Vec<String>,
    },
}

impl From<Answer> for KeeperAnswer {
    fn from(answer: Answer) -> Self {
        Self::Loop(answer)
    }
}

impl Service {
    #[must_use]
    pub(super) fn repeated(mut self) -> Self {
        if let Self::Reconfigure { repeated, .. } = &mut self {
            *repeated = true;
        }
        self
    }
}

/// Maximum number of stored changes of designs. If there are more, the oldest ones are dropped and cannot be undone.
const MAX_CHANGES: usize = 256;

/// A requested change of an objective's design. If the change fails, it is undone, even after its acknowledgement.
#[derive(Debug, Clone)]
pub(super) struct PendingChange {
    pub(super) objective: String,
    pub(super) from: Option<String>,
    pub(super) to: String,
}

/// Adaptation loop for the functions of a robot, without a task plan.
#[derive(Debug, Clone)]
pub struct Keeper {
    pub(super) configurator: Configurator,
    pub(super) limit: Option<Duration>,
    pub(super) numbers: Numbers,
    pub(super) effects: u64,
    pub(super) pending_changes: BTreeMap<u64, PendingChange>,
    /// Latest requested change of each objective, by effect number. Acknowledged and failed changes are removed.
    pub(super) outstanding: BTreeMap<u64, Service>,
    pub(super) available: BTreeSet<String>,
    pub(super) statuses: BTreeMap<String, Vec<String>>,
    pub(super) violated: BTreeSet<String>,
    pub(super) fault: Option<Fault>,
    pub(super) unserved: BTreeMap<String, Vec<String>>,
    pub(super) filters: Filters,
    pub(super) unrecorded: Unrecorded,
    pub(super) states: FilterStates,
    pub(super) has_begun: bool,
    pub(super) lines: u64,
    pub(super) has_times: bool,
    pub(super) now: Duration,
}

impl Keeper {
    /// Creates the loop. `limit` is the time limit of each choice. Unless filters are added, every report is asserted
    /// at once.
    pub fn new(configurator: Configurator, limit: Option<Duration>) -> Self {
        let available = available(configurator.knowledge());
        let filters = Filters::new(&FilterSettings::none(), Some(configurator.knowledge()));
        Self {
            limit,
            numbers: Numbers::default(),
            effects: 0,
            pending_changes: BTreeMap::new(),
            outstanding: BTreeMap::new(),
            available,
            statuses: BTreeMap::new(),
            violated: BTreeSet::new(),
            fault: None,
            unserved: BTreeMap::new(),
            states: filters.states(Some(configurator.knowledge())),
            filters,
            unrecorded: Unrecorded::default(),
            configurator,
            has_begun: false,
            lines: 0,
            has_times: false,
            now: Duration::ZERO,
        }
    }

    /// Sets the filters of measurements and component reports, in place of earlier ones.
    #[must_use]
    pub fn with_filters(self, settings: &FilterSettings) -> Self {
        let filters = Filters::new(settings, Some(self.configurator.knowledge()));
        let states = filters.states(Some(self.configurator.knowledge()));
        Self { filters, states, ..self }
    }

    /// Sets the reaction to a journal that cannot be written.
    #[must_use]
    pub fn with_unrecorded(self, unrecorded: Unrecorded) -> Self {
        Self { unrecorded, ..self }
    }

    /// Returns the earliest time, since the start, at which a filter changes a belief or reports a silent sensor
    /// without a further line. Returns `None` if no filter does. The caller should handle a tick event at this time.
    pub fn due(&self) -> Option<Duration> {
        self.filters.due(&self.states)
    }

    /// Returns the time of the last line or timer event, since the start.
    pub fn now(&self) -> Duration {
        self.now
    }

    /// Returns `true` if an accepted line stated its time. Time then advances with lines only.
    pub fn has_times(&self) -> bool {
        self.has_times
    }

    /// Returns the number of received lines.
    pub fn lines(&self) -> u64 {
        self.lines
    }

    /// Returns the greatest sequence number of the accepted lines; `None` if no line has one.
    pub fn sequence(&self) -> Option<u64> {
        self.numbers.greatest()
    }

    /// Returns the gaps between sequence numbers of accepted lines, as inclusive ranges `[first, last]`; if there are
    /// more than 255, the last 255. The missing lines have not arrived yet, or were refused.
    pub fn missing(&self) -> Vec<[u64; 2]> {
        self.numbers.missing()
    }

    /// Returns the configurator, with the knowledge and the objectives.
    pub fn configurator(&self) -> &Configurator {
        &self.configurator
    }

    /// Makes the first choice of designs, and returns the answers.
    pub fn start(&mut self) -> Vec<KeeperAnswer> {
        let mut answers = Vec::new();
        self.has_begun = true;
        self.adapt(&mut answers);
        answers
    }

    /// Handles a line at its own time, or at the time of the previous line, and returns the
    /// answers.
    pub fn handle(&mut self, observation: &Observation) -> Vec<KeeperAnswer> {
        self.handle_at(observation, self.now)
    }

    /// Handles a line and returns the answers. `now`, the time since the start, is used if the line has no time of its
    /// own. Time never decreases: an earlier time is replaced by the time of the previous line. A line is refused if
    /// its sequence number was used before or is too old, or if its number or its own time is too far ahead.
    pub fn handle_at(&mut self, observation: &Observation, now: Duration) -> Vec<KeeperAnswer> {
        let mut answers = Vec::new();
        self.lines += u64::from(!observation.is_timer);
        let (time, refusal_of_time) = time_of_line(self.now, now, observation, self.has_times);
        self.now = time;
        // A line that was received before must not have an effect again.
        if let Some(refusal) = observation.sequence.and_then(|seq| self.numbers.refused(seq)) {
            return vec![KeeperAnswer::Loop(refusal)];
        }
        if let Some(refusal) = refusal_of_time {
            return vec![KeeperAnswer::Loop(refusal)];
        }
        self.elapse(&mut answers);
        let mut understood = false;
        for event in &observation.events {
            match event.clone().and_then(|event| self.take(&event, &mut answers)) {
                Ok(()) => understood = true,
                Err(Refusal { code, message }) => {
                    answers.push(KeeperAnswer::Loop(Answer::Error { code: code.to_owned(), message }));
                }
            }
        }
        self.has_times |= understood && observation.time.is_some();
        // A rejected line may be sent again with the same number.
        if understood && let Some(seq) = observation.sequence {
            self.numbers.insert(seq);
        }
        self.adapt(&mut answers);
        answers
    }

    /// Handles a function that has none of its designs any more, for example after a change of its design that has
    /// failed and could not be undone. Its objectives are in need of a design again. Returns the answers.
    pub fn lose_design(&mut self, function: &str) -> Vec<KeeperAnswer> {
        let mut answers = Vec::new();
        let objectives = self.configurator.objectives().into_iter().filter(|objective| {
            objective.function.as_ref().is_some_and(|individual| individual.name == function)
        });
        for objective in objectives {
            let name = objective.individual.name;
            // A failure of an earlier change must not restore an older design.
            for change in self.pending_changes.values_mut().filter(|change| change.objective == name) {
                change.from = None;
            }
            if let Err(message) = self.configurator.revert(&name, None) {
                answers.push(wrong(&message));
            }
        }
        self.adapt(&mut answers);
        answers
    }

    fn take(&mut self, event: &Event, answers: &mut Vec<KeeperAnswer>) -> Result<(), Refusal> {
        let refused = |message: Message| Refusal::new("M306", message.message.clone());
        let knowledge = self.configurator.knowledge_mut();
        match event {
            Event::Measured { attribute, value } => {
                // A refused line must not change the state of a filter.
                if !knowledge.has_attribute(attribute) {
                    return knowledge
                        .take(attribute, RobotReport::measured(value))
                        .map(|_| ())
                        .map_err(refused);
                }
                let mut filter_answers = Vec::new();
                let value =
                    self.filters.sample(&mut self.states, self.now, attribute, value, &mut filter_answers);
                answers.extend(filter_answers.into_iter().map(KeeperAnswer::Loop));
                if let Some(value) = value {
                    knowledge.take(attribute, RobotReport::measured(&value)).map_err(refused)?;
                }
            }
            Event::Component { component, status } => self.component(component, *status, answers)?,
            Event::ObjectiveAdded { objective, function, requirements, always_improve } => {
                let (name, function) = (objective.clone(), function.clone());
                let (requirements, always_improve) = (requirements.clone(), *always_improve);
                let goal = Goal { name, function, requirements, always_improve };
                self.configurator.pursue(&goal).map_err(refused)?;
            }
            Event::ObjectiveRemoved { objective } => self.give_up(objective, answers)?,
            Event::Acknowledged { effect } => {
                self.check_effect(*effect)?;
                self.outstanding.remove(effect);
            }
            Event::ReconfigurationFailed { effect } => {
                self.check_effect(*effect)?;
                self.outstanding.remove(effect);
                self.undo(*effect).map_err(refused)?;
            }
            Event::Design { design, realisable } => {
                knowledge.take(design, RobotReport::Design(*realisable)).map_err(refused)?;
            }
            Event::Tick | Event::Note { .. } => {}
            other => {
                let text = format!("`{}` requires a plan, and `run --configure` has none", other.kind());
                return Err(Refusal::new("M306", text));
            }
        }
        Ok(())
    }

    fn component(
        &mut self,
        component: &str,
        status: Status,
        answers: &mut Vec<KeeperAnswer>,
    ) -> Result<(), Refusal> {
        let knowledge = self.configurator.knowledge_mut();
        let mut filter_answers = Vec::new();
        let is_believed = knowledge.known_component(component).is_none_or(|name| {
            self.filters.report(&mut self.states, self.now, &name, status, &mut filter_answers)
        });
        answers.extend(filter_answers.into_iter().map(KeeperAnswer::Loop));
        if is_believed {
            let result = knowledge.take(component, RobotReport::Component(status));
            result.map_err(|message| Refusal::new("M306", message.message.clone()))?;
        }
        Ok(())
    }

    fn check_effect(&self, effect: u64) -> Result<(), Refusal> {
        let is_known = (1..=self.effects).contains(&effect);
        is_known
            .then_some(())
            .ok_or_else(|| Refusal::new("M305", format!("no effect with the number {effect} was requested")))
    }

    /// Undoes a failed change of design. Marks the new design as not realisable, so that the next best design is
    /// chosen. Restores the previous design, unless a later change of the same objective is stored, which then restores
    /// it if it fails, too. Does nothing if the failed change is not stored (any more).
    fn undo(&mut self, effect: u64) -> Result<(), Message> {
        let Some(PendingChange { objective, from, to }) = self.pending_changes.remove(&effect) else {
            return Ok(());
        };
        self.configurator.knowledge_mut().take(&to, RobotReport::Design(false))?;
        // A later change of the same objective has replaced this change. It begins with the design that the
        // robot has.
        let mut later = self.pending_changes.range_mut(effect..).map(|(_, later)| later);
        if let Some(later) = later.find(|later| later.objective == objective) {
            later.from = from;
            return Ok(());
        }
        self.configurator.revert(&objective, from.as_deref())
    }

    fn elapse(&mut self, answers: &mut Vec<KeeperAnswer>) {
        let mut filter_answers = Vec::new();
        let due: Vec<Accepted> = self.filters.elapse(&mut self.states, self.now, &mut filter_answers);
        answers.extend(filter_answers.into_iter().map(KeeperAnswer::Loop));
        for accepted in due {
            let (name, report) = accepted.report();
            if let Err(message) = self.configurator.knowledge_mut().take(name, report) {
                answers.push(wrong(&message));
            }
        }
    }

    fn give_up(&mut self, name: &str, answers: &mut Vec<KeeperAnswer>) -> Result<(), Refusal> {
        let objectives = self.configurator.objectives();
        let is_it = |objective: &&ontology::runtime::Objective| {
            objective.individual.name == name || objective.individual.iri == name
        };
        let objective_by_name = objectives.iter().find(is_it);
        self.configurator.give_up(name).map_err(|message| Refusal::new("M306", message.message.clone()))?;
        if let Some(objective) = objective_by_name
            && let Some(design) = current(objective)
        {
            let function = objective.function.as_ref().map(|function| function.name.clone());
            let because = vec!["the objective was removed".to_owned()];
            answers.push(self.withdraw(&objective.individual.name, function, design, (because, true)));
        }
        // A failed change of a removed objective needs no undo. Changes are recorded under the name, and events may have
        // the IRI.
        let name = objective_by_name.map_or(name, |objective| objective.individual.name.as_str());
        self.pending_changes.retain(|_, pending_changes| pending_changes.objective != name);
        self.unserved.remove(name);
        Ok(())
    }

    fn withdraw(
        &mut self,
        objective: &str,
        function: Option<String>,
        design: &str,
        (because, optimal): (Vec<String>, bool),
    ) -> KeeperAnswer {
        self.effects += 1;
        // A failure of an earlier change must not restore an older design.
        for change in self.pending_changes.values_mut().filter(|change| change.objective == objective) {
            change.from = None;
        }
        let reconfigure = Service::Reconfigure {
            objective: objective.to_owned(),
            function,
            from: Some(design.to_owned()),
            to: None,
            because,
            optimal,
            effect: self.effects,
            repeated: false,
        };
        self.request(objective, reconfigure)
    }

    fn adapt(&mut self, answers: &mut Vec<KeeperAnswer>) {
        self.infer(answers);
        let knowledge = self.configurator.knowledge();
        let doubts = doubts(knowledge, &mut self.fault, &mut self.violated);
        answers.extend(doubts.into_iter().map(KeeperAnswer::Loop));
        // MROS adapts nothing while there is a contradiction. Here the designs that the
        // contradiction rules out are unavailable, and the others serve. If reasoning itself
        // failed, no design counts as available.
        if self.fault.is_some() {
            return;
        }
        let limits = self.limit.map_or_else(Limits::none, |time| Limits::none().with_time(time));
        match self.configurator.choose(&limits) {
            Err(message) => answers.push(wrong(&message)),
            Ok(mut configuration) => {
                // Components are released before others use them.
                configuration.choices.sort_by_key(|choice| choice.withdrawn.is_none());
                for choice in configuration.choices {
                    self.adopt(&choice, configuration.optimal, answers);
                }
                self.infer(answers);
            }
        }
    }

    fn adopt(&mut self, choice: &Choice, optimal: bool, answers: &mut Vec<KeeperAnswer>) {
        let (objective, function) = (choice.objective.clone(), choice.function.clone());
        if let Err(message) = self.configurator.adopt(choice) {
            answers.push(wrong(&message));
            return;
        }
        let Some(design) = &choice.design else {
            let because = reasons_of(choice);
            if let (Some(conflict), Some(design)) = (&choice.withdrawn, &choice.before) {
                let reasons = ([&because[..], &[format!("{design}: {conflict}")]].concat(), optimal);
                answers.push(self.withdraw(&objective, function.clone(), design, reasons));
            }
            // Unchanged reasons are not reported again.
            if self.unserved.get(&objective) != Some(&because) {
                self.unserved.insert(objective.clone(), because.clone());
                answers.push(KeeperAnswer::Service(Service::Unserved { objective, function, because }));
            }
            return;
        };
        self.unserved.remove(&objective);
        if choice.before.as_ref() != Some(design) {
            self.effects += 1;
            let change = PendingChange {
                objective: objective.clone(),
                from: choice.before.clone(),
                to: design.clone(),
            };
            self.pending_changes.insert(self.effects, change);
            // The oldest change is the least likely to fail.
            if self.pending_changes.len() > MAX_CHANGES {
                self.pending_changes.pop_first();
            }
            let (from, to) = (choice.before.clone(), choice.design.clone());
            let (because, effect) = (reasons_of(choice), self.effects);
            let name = objective.clone();
            let reconfigure = Service::Reconfigure {
                objective,
                function,
                from,
                to,
                because,
                optimal,
                effect,
                repeated: false,
            };
            answers.push(self.request(&name, reconfigure));
        }
    }

    /// Stores a requested change as the outstanding change of its objective, in place of earlier changes, and returns
    /// it as an answer.
    fn request(&mut self, name: &str, reconfigure: Service) -> KeeperAnswer {
        self.outstanding.retain(
            |_, earlier| !matches!(earlier, Service::Reconfigure { objective, .. } if objective == name),
        );
        self.outstanding.insert(self.effects, reconfigure.clone());
        KeeperAnswer::Service(reconfigure)
    }

    fn infer(&mut self, answers: &mut Vec<KeeperAnswer>) {
        let knowledge = self.configurator.knowledge();
        let (designs, objectives) = changes(knowledge, &mut self.available, &mut self.statuses);
        answers.extend(inferred(designs, objectives).map(KeeperAnswer::Loop));
    }
}

fn wrong(message: &Message) -> KeeperAnswer {
    KeeperAnswer::Loop(Answer::Error { code: message.code.clone(), message: message.message.clone() })
}

/// Returns the reasons why an objective needs a design, why designs preferred to the chosen one are not used, and which
/// requirements the chosen design misses.
fn reasons_of(choice: &Choice) -> Vec<String> {
    let mut because: Vec<String> =
        choice.need.iter().map(|need| format!("{} is {need}", choice.objective)).collect();
    for considered in &choice.considered {
        match &considered.verdict {
            Verdict::Chosen => {
                because.extend(
                    considered.missed.iter().map(|missed| format!("{}: {missed}", considered.design)),
                );
                break;
            }
            Verdict::Less => break,
            Verdict::RuledOut(reasons) => {
                because.extend(reasons.iter().map(|reason| format!("{}: {reason}", considered.design)));
            }
            Verdict::Together(reason) => because.push(format!("{}: {reason}", considered.design)),
        }
    }
    because
}
