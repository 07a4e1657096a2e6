//! Monitor: events to changes of what is believed.

use num_rational::BigRational;
use ontology::vocab::local_name;
use pddl::ast::{InitialElement, Problem};
use pddl::validate::{Advance, advance};
use rules::{Delta, Fact};

use super::Loop;
use super::event::{Event, Fault};
use super::knowledge::Running;
use super::number;
use super::step::PlannedStep;
use crate::knowledge::Report;
use crate::message::{Message, did_you_mean};

/// What a line has changed, for the analysis.
#[derive(Debug, Default)]
pub(super) struct Changes {
    /// What the knowledge base says.
    pub(super) base: Base,
    /// Facts or values of the problem.
    pub(super) facts: bool,
    /// Facts of the problem, and not only values.
    pub(super) predicates: bool,
    /// Reasons to plan whatever the plan is like: sentences.
    pub(super) must: Vec<String>,
}

/// What has changed in the knowledge base.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Base {
    #[default]
    Nothing,
    /// What is stated, or follows.
    Stated,
    /// That from which availability and statuses are read.
    Watched,
}

impl Changes {
    /// Whether anything has changed, though the line was not taken over as a whole.
    pub(super) fn any(&self) -> bool {
        self.base > Base::Nothing || self.facts || self.predicates || !self.must.is_empty()
    }
}

/// The properties from which availability and statuses are read, by local name.
const WATCHED: [&str; 5] = ["fd_realisability", "fd_available", "o_status", "o_updatable", "fg_status"];

/// What else of the knowledge base plans rest on, by local name.
const PLANNED: [&str; 9] = [
    "solvesF",
    "requiresF",
    "hasQAestimation",
    "isQAtype",
    "hasMinimum",
    "hasMaximum",
    "requiresQuality",
    "inContext",
    "FunctionDesign",
];

/// Values, by local name: those that were not reported are estimations.
const VALUES: [&str; 2] = ["hasValue", "qa_has_value"];

impl Loop {
    /// Takes an event over.
    ///
    /// # Errors
    /// Why it changes nothing.
    pub(super) fn monitor(&mut self, event: &Event, changes: &mut Changes) -> Result<(), Fault> {
        match event {
            Event::Measured { attribute, value } => self.measured(attribute, value, changes),
            Event::Component { component, status } => {
                let Some(knowledge) = self.knowledge.mission.knowledge_mut() else {
                    let text = format!("there is no knowledge base that has a component `{component}`");
                    return Err(Fault::new("M306", text));
                };
                let was_known = knowledge.fault().is_none();
                let delta = knowledge
                    .take(component, Report::Component(*status))
                    .map_err(|message| fault(&message))?;
                self.note(&delta, was_known, changes);
                Ok(())
            }
            Event::Started { action } => self.running(*action).map(|_| ()),
            Event::Progress { action, fraction } => {
                self.running(*action)?;
                self.progress(fraction)
            }
            Event::Succeeded { action } => self.succeeded(*action, changes),
            Event::Failed { action, reason } => {
                let reason = if reason.is_empty() { String::new() } else { format!(": {reason}") };
                self.failed(*action, changes)?;
                changes.must.push(format!("action {action} has failed{reason}"));
                Ok(())
            }
            Event::Cancelled { action } => {
                self.ended_early(*action, changes)?;
                changes.must.push(format!("action {action} was cancelled"));
                Ok(())
            }
            Event::Goal { goal } => {
                let condition = self.knowledge.mission.goal(goal).map_err(|messages| first(&messages))?;
                self.knowledge.mission.set_goal(condition);
                self.knowledge.goal = Some(goal.clone());
                self.planner.memo.forget();
                changes.must.push("the goal has changed".to_owned());
                Ok(())
            }
            Event::Fact { name, value } => self.fact(name, value, changes),
            Event::Acknowledged { effect } => match self.knowledge.outstanding.remove(effect) {
                Some(_) => Ok(()),
                None if *effect >= 1 && *effect <= self.knowledge.effects => Ok(()),
                None => Err(Fault::new("M305", format!("there was no effect {effect}"))),
            },
            Event::Tick => Ok(()),
        }
    }

    fn measured(&mut self, attribute: &str, value: &BigRational, changes: &mut Changes) -> Result<(), Fault> {
        let is_known = self.attributes.contains(attribute);
        if let Some(knowledge) = self.knowledge.mission.knowledge_mut().filter(|_| is_known) {
            let was_known = knowledge.fault().is_none();
            let delta =
                knowledge.take(attribute, Report::measured(value)).map_err(|message| fault(&message))?;
            self.note(&delta, was_known, changes);
            if let Some(function) = self.knowledge.mission.fed_by(local_name(attribute)) {
                changes.facts = true;
                if self.value(&function).is_some() {
                    self.fact(&function, &number::decimal(value), changes)?;
                }
            }
            return Ok(());
        }
        if self.knowledge.mission.is_function(attribute) {
            return self.fact(attribute, &number::decimal(value), changes);
        }
        let known: Vec<&str> =
            self.attributes.iter().map(String::as_str).filter(|name| !name.contains(':')).collect();
        let functions: Vec<&str> = self
            .knowledge
            .mission
            .domain()
            .functions
            .iter()
            .filter(|own| own.parameters.is_empty())
            .map(|own| own.identifier.name.as_str())
            .collect();
        let meant = did_you_mean(attribute, known.iter().chain(&functions).copied());
        let text = format!(
            "there is no attribute or function `{attribute}`; attributes are: {}{meant}",
            known.join(", ")
        );
        Err(Fault::new("M306", text))
    }

    /// What a change of the knowledge base matters for; and whether it was known before what follows.
    fn note(&self, delta: &Delta, was_known: bool, changes: &mut Changes) {
        let Some(knowledge) = self.knowledge.mission.knowledge() else { return };
        let is_known = knowledge.fault().is_none();
        changes.base = changes.base.max(if was_known && is_known { Base::Stated } else { Base::Watched });
        let engine = knowledge.engine();
        let name = |fact: &Fact| engine.symbols().value(fact.predicate).as_name().map_or("", local_name);
        for fact in delta.insert.iter().chain(&delta.delete) {
            let name = name(fact);
            if WATCHED.contains(&name) {
                changes.base = Base::Watched;
            }
            changes.facts |= PLANNED.contains(&name);
        }
        let is_concluded = |fact: &Fact| VALUES.contains(&name(fact)) && !engine.is_asserted(fact);
        let is_replaced = |gone: &Fact| {
            let same = |new: &Fact| new.predicate == gone.predicate && new.arguments[0] == gone.arguments[0];
            delta.insert.iter().any(same)
        };
        let is_lost = |fact: &Fact| VALUES.contains(&name(fact)) && !is_replaced(fact);
        changes.facts |= delta.insert.iter().any(is_concluded) || delta.delete.iter().any(is_lost);
    }

    /// The action with that number, which must be under way; whatever was asked for it has arrived, then.
    fn running(&mut self, action: u64) -> Result<&mut Running, Fault> {
        let running = self.knowledge.running.as_mut().filter(|running| running.action == action);
        let Some(running) = running else {
            return Err(Fault::new("M305", format!("no action {action} is under way")));
        };
        self.knowledge
            .outstanding
            .retain(|_, effect| effect.action > action || effect.command.is_about_going_on());
        Ok(running)
    }

    /// Ends the action with that number; nothing about it is outstanding any more.
    fn end(&mut self, action: u64) -> Result<Running, Fault> {
        self.running(action)?;
        self.knowledge.outstanding.retain(|_, effect| effect.action > action);
        let none = || Fault::new("M305", format!("no action {action} is under way"));
        self.knowledge.running.take().ok_or_else(none)
    }

    fn succeeded(&mut self, action: u64, changes: &mut Changes) -> Result<(), Fault> {
        self.running(action)?;
        // What it has not used up yet is used up now; the robot knows better than our conditions whether it has succeeded.
        self.progress(&BigRational::from_integer(1.into()))?;
        let running = self.end(action)?;
        if let Some(mut advance) = self.advance(&running.step) {
            advance.values.retain(|change| change.assigned);
            let mut init = self.knowledge.mission.problem().init.clone();
            advance.apply(&mut init);
            self.knowledge.mission.set_init(init);
        }
        self.knowledge.failures = None;
        if running.cancelling || running.suspended {
            let what = if running.cancelling { "cancelled" } else { "suspended" };
            changes.must.push(format!("action {action} was to be {what}, but has succeeded"));
        }
        Ok(())
    }

    fn failed(&mut self, action: u64, changes: &mut Changes) -> Result<(), Fault> {
        let step = self.ended_early(action, changes)?.step;
        let before = self.knowledge.failures.take().filter(|(failed, _)| *failed == step);
        let count = before.map_or(1, |(_, count)| count + 1);
        self.knowledge.failures = Some((step, count));
        Ok(())
    }

    /// An action has ended before its end: what it has used up is gone, and its other effects have not taken place.
    fn ended_early(&mut self, action: u64, changes: &mut Changes) -> Result<Running, Fault> {
        let running = self.end(action)?;
        changes.facts = true;
        Ok(running)
    }

    /// So much of the action under way is done, and what that uses up is used up.
    fn progress(&mut self, fraction: &BigRational) -> Result<(), Fault> {
        let Some(running) = &mut self.knowledge.running else { return Ok(()) };
        let more = fraction - &running.progress;
        running.progress.clone_from(fraction);
        let step = running.step.clone();
        let Some(advance) = self.advance(&step) else { return Ok(()) };
        for change in advance.values.into_iter().filter(|change| !change.assigned) {
            let name = change.text.trim_matches(['(', ')']).to_owned();
            if let (Some(now), Some(before)) = (self.value(&name), change.before) {
                let value = number::rounded(&(now + (change.after - before) * &more));
                self.set(&name, &number::decimal(&value))?;
            }
        }
        Ok(())
    }

    /// What a whole action changes, whether or not its conditions hold.
    fn advance(&self, step: &PlannedStep) -> Option<Advance> {
        let mission = &self.knowledge.mission;
        advance(mission.domain(), &self.filled(), &step.to_plan_step(), true).ok()
    }

    /// The value of a function of the problem, by name and arguments.
    pub(super) fn value(&self, name: &str) -> Option<BigRational> {
        value_of(self.knowledge.mission.problem(), name)
    }

    /// A fact or a value of the problem is reported.
    fn fact(&mut self, name: &str, value: &str, changes: &mut Changes) -> Result<(), Fault> {
        let mut words = name.split_whitespace();
        let name = words.by_ref().collect::<Vec<_>>().join(" ");
        if !self.knowledge.mission.is_function(&name) {
            self.set(&name, value)?;
            changes.predicates = true;
            changes.facts = true;
            return Ok(());
        }
        let wrong = || Fault::new("M302", format!("the value `{value}` of {name} is no decimal number"));
        let value = number::rounded(&number::exact(value).ok_or_else(wrong)?);
        if self.value(&name).as_ref() != Some(&value) {
            self.set(&name, &number::decimal(&value))?;
            changes.facts = true;
        }
        Ok(())
    }

    /// Sets a fact or value of the problem, if the problem is still right then.
    fn set(&mut self, name: &str, value: &str) -> Result<(), Fault> {
        let mission = &mut self.knowledge.mission;
        let before = mission.problem().init.clone();
        mission.set_in_problem(name, value).map_err(|message| fault(&message))?;
        let key = if mission.is_function(name) { name.to_owned() } else { format!("{name} {value}") };
        if self.checked.contains(&key) {
            return Ok(());
        }
        if let Err(messages) = mission.filled() {
            mission.set_init(before);
            return Err(first(&messages));
        }
        self.checked.insert(key);
        Ok(())
    }
}

/// The value of a function that a problem states, by name and arguments.
pub(crate) fn value_of(problem: &Problem, name: &str) -> Option<BigRational> {
    let words: Vec<&str> = name.split_whitespace().collect();
    problem.init.iter().find_map(|element| match element {
        InitialElement::Value(atom, value, _) if is_named(atom, &words) => Some(value.clone()),
        _ => None,
    })
}

fn is_named(atom: &pddl::ast::Atom, words: &[&str]) -> bool {
    use pddl::ast::{Name, Term};
    let same = |(term, word): (&Term, &&str)| match term {
        Term::Constant(identifier) | Term::Variable(identifier) => identifier.name == Name::new(word),
    };
    words.split_first().is_some_and(|(symbol, arguments)| {
        atom.predicate.name == Name::new(symbol)
            && atom.arguments.len() == arguments.len()
            && atom.arguments.iter().zip(arguments).all(same)
    })
}

fn fault(message: &Message) -> Fault {
    Fault::new("M306", message.message.clone())
}

fn first(messages: &[Message]) -> Fault {
    messages.first().map_or_else(|| Fault::new("M306", "it does not fit the mission"), fault)
}
