//! The loop: what the robot reports goes into the knowledge base, and where objectives are in need, designs are chosen and asked for.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use encodings::Limits;
use ontology::runtime::Objective;
use serde::Serialize;

use crate::configure::choice::{Choice, Verdict, current};
use crate::configure::configurator::{Configurator, Goal};
use crate::knowledge::{Contradiction, RobotReport};
use crate::mapek::{
    DesignChange, Event, Numbers, ObjectiveChange, Observation, Place, Refusal, available, ruled_out,
    why_objective,
};
use crate::message::Message;

/// One line of output, in the format `metaplan-events/1`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "answer")]
#[non_exhaustive]
pub enum KeeperAnswer {
    /// What follows has changed.
    #[serde(rename = "inferred")]
    Inferred {
        /// Designs whose availability has changed.
        designs: Vec<DesignChange>,
        /// Objectives whose status has changed.
        objectives: Vec<ObjectiveChange>,
    },
    /// What is known contradicts itself, or does so no more. Nothing is chosen meanwhile.
    #[serde(rename = "contradicted")]
    Contradicted {
        /// All contradictions from now on.
        contradictions: Vec<Contradiction>,
    },
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
    /// The line was seen before and has changed nothing.
    #[serde(rename = "duplicate")]
    Duplicate {
        /// Its number.
        seq: u64,
    },
    /// The line has changed nothing: its number is so old that nobody knows whether it was seen.
    #[serde(rename = "stale")]
    Stale {
        /// Its number.
        seq: u64,
        /// Up to which number lines are too old, in a sentence.
        because: String,
    },
    /// The line, or a part of it, has changed nothing.
    #[serde(rename = "error")]
    Error {
        /// A stable code.
        code: String,
        /// One sentence.
        message: String,
    },
}

/// A change of design that was asked for, to be undone if it fails.
#[derive(Debug, Clone)]
struct Asked {
    objective: String,
    from: Option<String>,
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
    violated: Vec<Contradiction>,
    /// What was said last of objectives that no design can serve.
    unserved: BTreeMap<String, Vec<String>>,
}

impl Keeper {
    /// Takes charge; for each choice there is so much time.
    pub fn new(configurator: Configurator, limit: Option<Duration>) -> Self {
        let available = available(configurator.knowledge());
        Self {
            configurator,
            limit,
            numbers: Numbers::default(),
            effects: 0,
            asked: BTreeMap::new(),
            available,
            statuses: BTreeMap::new(),
            violated: Vec::new(),
            unserved: BTreeMap::new(),
        }
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

    /// Takes a line over and says what follows.
    pub fn handle(&mut self, observation: &Observation) -> Vec<KeeperAnswer> {
        let mut answers = Vec::new();
        if let Some(refusal) = observation.sequence.and_then(|seq| self.refused(seq)) {
            return vec![refusal];
        }
        let mut understood = false;
        for event in &observation.events {
            match event.clone().and_then(|event| self.take(&event, &mut answers)) {
                Ok(()) => understood = true,
                Err(Refusal { code, message }) => {
                    answers.push(KeeperAnswer::Error { code: code.to_owned(), message });
                }
            }
        }
        if understood && let Some(seq) = observation.sequence {
            self.numbers.insert(seq);
        }
        self.adapt(&mut answers);
        answers
    }

    /// The answer to a line that changes nothing because of its number.
    fn refused(&self, seq: u64) -> Option<KeeperAnswer> {
        match self.numbers.place(seq) {
            Place::New => None,
            Place::Seen => Some(KeeperAnswer::Duplicate { seq }),
            Place::Stale(mark) => {
                let because = format!(
                    "too many numbers are missing: of those up to {mark} it is not known any more which were seen"
                );
                Some(KeeperAnswer::Stale { seq, because })
            }
            Place::Ahead(most) => {
                let message =
                    format!("the number {seq} is too far ahead; the greatest that can be is {most}");
                Some(KeeperAnswer::Error { code: "M307".to_owned(), message })
            }
        }
    }

    fn take(&mut self, event: &Event, answers: &mut Vec<KeeperAnswer>) -> Result<(), Refusal> {
        let refused = |message: Message| Refusal::new("M306", message.message.clone());
        let knowledge = self.configurator.knowledge_mut();
        match event {
            Event::Measured { attribute, value } => {
                knowledge.take(attribute, RobotReport::measured(value)).map_err(refused)?;
            }
            Event::Component { component, status } => {
                knowledge.take(component, RobotReport::Component(*status)).map_err(refused)?;
            }
            Event::ObjectiveAdded { objective, function, requirements, always_improve } => {
                let (name, function) = (objective.clone(), function.clone());
                let (requirements, always_improve) = (requirements.clone(), *always_improve);
                let goal = Goal { name, function, requirements, always_improve };
                self.configurator.pursue(&goal).map_err(refused)?;
            }
            Event::ObjectiveRemoved { objective } => self.give_up(objective, answers)?,
            Event::Acknowledged { effect } => {
                self.asked.remove(effect).ok_or_else(|| unknown_effect(*effect))?;
            }
            Event::ReconfigurationFailed { effect } => {
                let Asked { objective, from } =
                    self.asked.remove(effect).ok_or_else(|| unknown_effect(*effect))?;
                self.configurator.revert(&objective, from.as_deref()).map_err(refused)?;
            }
            Event::Tick => {}
            other => {
                let text = format!("`{}` is about plans, and here there is none", other.kind());
                return Err(Refusal::new("M306", text));
            }
        }
        Ok(())
    }

    fn give_up(&mut self, name: &str, answers: &mut Vec<KeeperAnswer>) -> Result<(), Refusal> {
        let objectives = self.configurator.objectives();
        let is_it = |own: &&Objective| own.individual.name == name || own.individual.iri == name;
        let found = objectives.iter().find(is_it);
        self.configurator.give_up(name).map_err(|message| Refusal::new("M306", message.message.clone()))?;
        if let Some(objective) = found
            && let Some(design) = current(objective)
        {
            self.effects += 1;
            answers.push(KeeperAnswer::Reconfigure {
                objective: objective.individual.name.clone(),
                function: objective.function.as_ref().map(|function| function.name.clone()),
                from: Some(design.to_owned()),
                to: None,
                because: vec!["the objective was given up".to_owned()],
                optimal: true,
                effect: self.effects,
            });
        }
        self.asked.retain(|_, asked| asked.objective != name);
        self.unserved.remove(name);
        Ok(())
    }

    /// Reports what follows, and chooses for the objectives in need.
    fn adapt(&mut self, answers: &mut Vec<KeeperAnswer>) {
        self.infer(answers);
        let contradictions = self.configurator.knowledge().contradictions();
        if contradictions != self.violated {
            self.violated.clone_from(&contradictions);
            answers.push(KeeperAnswer::Contradicted { contradictions });
        }
        // MROS adapts nothing while there is a contradiction, and where it is not known what follows nothing is available.
        if !self.violated.is_empty() || self.configurator.knowledge().fault().is_some() {
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
                answers.push(KeeperAnswer::Unserved { objective, function, because });
            }
            return;
        };
        self.unserved.remove(&objective);
        if choice.before.as_ref() != Some(design) {
            self.effects += 1;
            self.asked.retain(|_, asked| asked.objective != objective);
            let asked = Asked { objective: objective.clone(), from: choice.before.clone() };
            self.asked.insert(self.effects, asked);
            let (from, to) = (choice.before.clone(), choice.design.clone());
            let (because, effect) = (said(choice), self.effects);
            answers.push(KeeperAnswer::Reconfigure {
                objective,
                function,
                from,
                to,
                because,
                optimal,
                effect,
            });
        }
    }

    /// Reports designs and objectives of which something else follows than before.
    fn infer(&mut self, answers: &mut Vec<KeeperAnswer>) {
        let knowledge = self.configurator.knowledge();
        let now = available(knowledge);
        let changed = self.available.symmetric_difference(&now);
        let designs: Vec<DesignChange> = changed
            .map(|design| {
                let available = now.contains(design);
                let because = if available { Vec::new() } else { ruled_out(knowledge, design) };
                DesignChange { design: design.clone(), available, because }
            })
            .collect();
        let in_error = knowledge.runtime().objectives().into_iter().filter(Objective::is_in_error);
        let statuses: BTreeMap<String, Vec<String>> =
            in_error.map(|objective| (objective.individual.name, objective.statuses)).collect();
        let names: BTreeSet<&String> = statuses.keys().chain(self.statuses.keys()).collect();
        let changed = names.into_iter().filter(|name| statuses.get(*name) != self.statuses.get(*name));
        let objectives: Vec<ObjectiveChange> = changed
            .map(|name| ObjectiveChange {
                objective: name.clone(),
                statuses: statuses.get(name).cloned().unwrap_or_default(),
                because: why_objective(knowledge, name),
            })
            .collect();
        self.available = now;
        self.statuses = statuses;
        if !designs.is_empty() || !objectives.is_empty() {
            answers.push(KeeperAnswer::Inferred { designs, objectives });
        }
    }
}

fn wrong(message: &Message) -> KeeperAnswer {
    KeeperAnswer::Error { code: message.code.clone(), message: message.message.clone() }
}

fn unknown_effect(effect: u64) -> Refusal {
    Refusal::new("M305", format!("no effect {effect} is waited for"))
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
