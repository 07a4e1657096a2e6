//! The loop: what the robot reports goes into the knowledge base, and where objectives are in need, designs are chosen and asked for.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use ontology::tomasys::change::Status;
use planner::Limits;
use serde::Serialize;

use crate::configure::choice::{Choice, Verdict, current};
use crate::configure::configurator::{Configurator, Goal};
use crate::knowledge::{Fault, RobotReport};
use crate::mapek::{
    Accepted, Answer, Event, FilterSettings, FilterStates, Filters, Numbers, Observation, Refusal, available,
    changes, doubts, inferred,
};
use crate::message::Message;

/// One line of output, in the format `metaplan-events/1`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum KeeperAnswer {
    /// As the loop with a plan says it.
    Loop(Answer),
    /// What becomes of an objective.
    Service(Service),
}

/// What becomes of an objective.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "answer")]
#[non_exhaustive]
pub enum Service {
    /// A function is to get another design.
    #[serde(rename = "reconfigure")]
    Reconfigure {
        /// The objective.
        objective: String,
        /// Its function.
        function: Option<String>,
        /// The design before, if there was one.
        from: Option<String>,
        /// The design from now on; none where the objective was given up.
        to: Option<String>,
        /// Why now, and why the designs that are worth more were not taken: sentences.
        because: Vec<String>,
        /// Whether it is proved that no choice for all objectives in need is better.
        optimal: bool,
        /// Its number, from 1.
        effect: u64,
    },
    /// No design can serve an objective now. It keeps the one that it has, if any.
    #[serde(rename = "unserved")]
    Unserved {
        /// The objective.
        objective: String,
        /// Its function.
        function: Option<String>,
        /// Why each of the designs cannot: sentences.
        because: Vec<String>,
    },
}

/// Upper limit on the changes of design that are kept to be undone.
const MAX_CHANGES: usize = 256;

/// A change of design that was asked for, to be undone if it fails, also after its acknowledgement.
#[derive(Debug, Clone)]
struct Asked {
    objective: String,
    from: Option<String>,
    to: String,
}

/// Keeps the functions of a robot served.
#[derive(Debug, Clone)]
pub struct Keeper {
    configurator: Configurator,
    limit: Option<Duration>,
    /// Numbers of lines that were seen.
    numbers: Numbers,
    effects: u64,
    asked: BTreeMap<u64, Asked>,
    available: BTreeSet<String>,
    statuses: BTreeMap<String, Vec<String>>,
    violated: BTreeSet<String>,
    fault: Option<Fault>,
    /// What was said last of objectives that no design can serve.
    unserved: BTreeMap<String, Vec<String>>,
    filters: Filters,
    states: FilterStates,
    /// Time of the last line, since the start.
    now: Duration,
}

impl Keeper {
    /// Takes charge; for each choice there is so much time. Every report is believed at once.
    pub fn new(configurator: Configurator, limit: Option<Duration>) -> Self {
        let available = available(configurator.knowledge());
        let filters = Filters::new(&FilterSettings::none(), Some(configurator.knowledge()));
        Self {
            limit,
            numbers: Numbers::default(),
            effects: 0,
            asked: BTreeMap::new(),
            available,
            statuses: BTreeMap::new(),
            violated: BTreeSet::new(),
            fault: None,
            unserved: BTreeMap::new(),
            states: filters.states(Some(configurator.knowledge())),
            filters,
            configurator,
            now: Duration::ZERO,
        }
    }

    /// The same with filters of what is measured and of what components report.
    #[must_use]
    pub fn with_filters(self, settings: &FilterSettings) -> Self {
        let filters = Filters::new(settings, Some(self.configurator.knowledge()));
        let states = filters.states(Some(self.configurator.knowledge()));
        Self { filters, states, ..self }
    }

    /// Time since the start at which a filter needs a tick, if nothing else is reported.
    pub fn due(&self) -> Option<Duration> {
        self.filters.due(&self.states)
    }

    /// What is known, and how the objectives are served.
    pub fn configurator(&self) -> &Configurator {
        &self.configurator
    }

    /// The first choice.
    pub fn start(&mut self) -> Vec<KeeperAnswer> {
        let mut answers = Vec::new();
        self.adapt(&mut answers);
        answers
    }

    /// Takes a line over at its own time, or else at that of the line before, and says what follows.
    pub fn handle(&mut self, observation: &Observation) -> Vec<KeeperAnswer> {
        self.handle_at(observation, self.now)
    }

    /// Takes a line over, at a time since the start that never goes back, and says what follows.
    pub fn handle_at(&mut self, observation: &Observation, now: Duration) -> Vec<KeeperAnswer> {
        let mut answers = Vec::new();
        self.now = self.now.max(observation.time.unwrap_or(now));
        if let Some(refusal) = observation.sequence.and_then(|seq| self.numbers.refused(seq)) {
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
        if understood && let Some(seq) = observation.sequence {
            self.numbers.insert(seq);
        }
        self.adapt(&mut answers);
        answers
    }

    fn take(&mut self, event: &Event, answers: &mut Vec<KeeperAnswer>) -> Result<(), Refusal> {
        let refused = |message: Message| Refusal::new("M306", message.message.clone());
        let knowledge = self.configurator.knowledge_mut();
        match event {
            Event::Measured { attribute, value } => {
                let mut held = Vec::new();
                let value = self.filters.sample(&mut self.states, self.now, attribute, value, &mut held);
                answers.extend(held.into_iter().map(KeeperAnswer::Loop));
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
            Event::Acknowledged { effect } => self.check_effect(*effect)?,
            Event::ReconfigurationFailed { effect } => {
                self.check_effect(*effect)?;
                self.undo(*effect).map_err(refused)?;
            }
            Event::Design { design, realisable } => {
                knowledge.take(design, RobotReport::Design(*realisable)).map_err(refused)?;
            }
            Event::Tick | Event::Note { .. } => {}
            other => {
                let text = format!("`{}` is about plans, and here there is none", other.kind());
                return Err(Refusal::new("M306", text));
            }
        }
        Ok(())
    }

    /// Takes the status of a component over, unless its filter holds it back.
    fn component(
        &mut self,
        component: &str,
        status: Status,
        answers: &mut Vec<KeeperAnswer>,
    ) -> Result<(), Refusal> {
        let knowledge = self.configurator.knowledge_mut();
        let mut held = Vec::new();
        let is_believed = knowledge
            .known_component(component)
            .is_none_or(|name| self.filters.report(&mut self.states, self.now, &name, status, &mut held));
        answers.extend(held.into_iter().map(KeeperAnswer::Loop));
        if is_believed {
            let taken = knowledge.take(component, RobotReport::Component(status));
            taken.map_err(|message| Refusal::new("M306", message.message.clone()))?;
        }
        Ok(())
    }

    /// Refuses the number of an effect that there was not.
    fn check_effect(&self, effect: u64) -> Result<(), Refusal> {
        let is_known = (1..=self.effects).contains(&effect);
        is_known.then_some(()).ok_or_else(|| Refusal::new("M305", format!("there was no effect {effect}")))
    }

    /// Takes a change of design back: the design counts as not realisable, so that the next best is chosen. Of a change that is not
    /// known any more, or has been undone, nothing is left.
    fn undo(&mut self, effect: u64) -> Result<(), Message> {
        let Some(Asked { objective, from, to }) = self.asked.remove(&effect) else { return Ok(()) };
        self.configurator.knowledge_mut().take(&to, RobotReport::Design(false))?;
        // A later change of the same objective has replaced it.
        if self.asked.range(effect..).any(|(_, later)| later.objective == objective) {
            return Ok(());
        }
        self.configurator.revert(&objective, from.as_deref())
    }

    /// Takes over what filters have held back and what is due.
    fn elapse(&mut self, answers: &mut Vec<KeeperAnswer>) {
        let mut said = Vec::new();
        let due: Vec<Accepted> = self.filters.elapse(&mut self.states, self.now, &mut said);
        answers.extend(said.into_iter().map(KeeperAnswer::Loop));
        for accepted in due {
            let (name, report) = accepted.report();
            if let Err(message) = self.configurator.knowledge_mut().take(name, report) {
                answers.push(wrong(&message));
            }
        }
    }

    fn give_up(&mut self, name: &str, answers: &mut Vec<KeeperAnswer>) -> Result<(), Refusal> {
        let objectives = self.configurator.objectives();
        let is_it =
            |own: &&ontology::runtime::Objective| own.individual.name == name || own.individual.iri == name;
        let found = objectives.iter().find(is_it);
        self.configurator.give_up(name).map_err(|message| Refusal::new("M306", message.message.clone()))?;
        if let Some(objective) = found
            && let Some(design) = current(objective)
        {
            self.effects += 1;
            answers.push(KeeperAnswer::Service(Service::Reconfigure {
                objective: objective.individual.name.clone(),
                function: objective.function.as_ref().map(|function| function.name.clone()),
                from: Some(design.to_owned()),
                to: None,
                because: vec!["the objective was given up".to_owned()],
                optimal: true,
                effect: self.effects,
            }));
        }
        self.asked.retain(|_, asked| asked.objective != name);
        self.unserved.remove(name);
        Ok(())
    }

    /// Reports what follows, and chooses for the objectives in need.
    fn adapt(&mut self, answers: &mut Vec<KeeperAnswer>) {
        self.infer(answers);
        let knowledge = self.configurator.knowledge();
        let doubts = doubts(knowledge, &mut self.fault, &mut self.violated);
        answers.extend(doubts.into_iter().map(KeeperAnswer::Loop));
        // MROS adapts nothing while there is a contradiction. Here the designs that it rules out are not available, and the others serve.
        // Where it is not known what follows nothing is available.
        if self.fault.is_some() {
            return;
        }
        let limits = self.limit.map_or_else(Limits::none, |time| Limits::none().with_time(time));
        match self.configurator.choose(&limits) {
            Err(message) => answers.push(wrong(&message)),
            Ok(configuration) => {
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
            let because = said(choice);
            if self.unserved.get(&objective) != Some(&because) {
                self.unserved.insert(objective.clone(), because.clone());
                answers.push(KeeperAnswer::Service(Service::Unserved { objective, function, because }));
            }
            return;
        };
        self.unserved.remove(&objective);
        if choice.before.as_ref() != Some(design) {
            self.effects += 1;
            let asked =
                Asked { objective: objective.clone(), from: choice.before.clone(), to: design.clone() };
            self.asked.insert(self.effects, asked);
            if self.asked.len() > MAX_CHANGES {
                self.asked.pop_first();
            }
            let (from, to) = (choice.before.clone(), choice.design.clone());
            let (because, effect) = (said(choice), self.effects);
            answers.push(KeeperAnswer::Service(Service::Reconfigure {
                objective,
                function,
                from,
                to,
                because,
                optimal,
                effect,
            }));
        }
    }

    /// Reports designs and objectives of which something else follows than before.
    fn infer(&mut self, answers: &mut Vec<KeeperAnswer>) {
        let knowledge = self.configurator.knowledge();
        let (designs, objectives) = changes(knowledge, &mut self.available, &mut self.statuses);
        answers.extend(inferred(designs, objectives).map(KeeperAnswer::Loop));
    }
}

fn wrong(message: &Message) -> KeeperAnswer {
    KeeperAnswer::Loop(Answer::Error { code: message.code.clone(), message: message.message.clone() })
}

/// Why an objective is in need, and what speaks against the designs that are worth more than the chosen one.
fn said(choice: &Choice) -> Vec<String> {
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
