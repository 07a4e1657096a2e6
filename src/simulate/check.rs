//! Checks the names and numbers in the section `simulation` of a scenario against its mission.

use pddl::ast::Condition;

use super::settings::{Disturbance, RandomFailure, Signal, Simulation, Suave};
use crate::manifest::{Key, Part};
use crate::message::{Message, did_you_mean};
use crate::mission::conditions::{self, Fault, written};
use crate::mission::{Mission, Mistake, setting};

/// Maximum of times, so that a clock in microseconds can hold them in each time unit.
const MAX_TIME: f64 = 1e9;
/// Maximum of the expected number of random failures of a component in a mission: the time budget, divided by
/// the mean time between failures.
const MAX_FAILURES: f64 = 1e6;

#[derive(Debug, Clone, Default)]
pub(super) struct Watched {
    /// Condition of each event, in the order of the events. `None` for an event with a time.
    pub(super) events: Vec<Option<Condition>>,
    /// Numeric function that ends the mission when it reaches 0, in the validator's notation.
    pub(super) lifeline: Option<String>,
    pub(super) found: Option<Condition>,
    /// Numeric function with the length of the pipeline, without parentheses.
    pub(super) length: Option<String>,
}

struct Checker<'m> {
    mission: &'m Mission,
    mistakes: Vec<Mistake>,
}

impl Simulation {
    /// Returns all mistakes in this section, checked against a mission in the scenario's situation.
    pub fn mistakes(&self, mission: &Mission) -> Vec<Mistake> {
        self.watched(mission).1
    }

    pub(super) fn watched(&self, mission: &Mission) -> (Watched, Vec<Mistake>) {
        let mut checker = Checker { mission, mistakes: Vec::new() };
        checker.numbers(self);
        let mut watched = Watched {
            events: (0..).zip(&self.events).map(|(index, event)| checker.event(index, event, self)).collect(),
            ..Watched::default()
        };
        if let Some(lifeline) = &self.lifeline {
            watched.lifeline = checker.function(&["lifeline".into()], lifeline);
        }
        for (index, signal) in self.signals.iter().enumerate() {
            checker.signal(index, signal);
        }
        for (index, failure) in self.failures.iter().enumerate() {
            checker.failure(index, failure, self);
        }
        if let Some(suave) = &self.suave {
            checker.suave(suave, &mut watched);
        }
        (watched, checker.mistakes)
    }
}

impl Checker<'_> {
    fn add(&mut self, path: Vec<Key>, part: Part, message: Message) {
        self.mistakes.push(Mistake { path, part, message });
    }

    fn wrong(&mut self, path: Vec<Key>, text: impl Into<String>) {
        self.add(path, Part::Value, Message::error("M135", text));
    }

    fn faults(&mut self, path: &[Key], faults: Vec<Fault>) {
        for Fault { offset, message } in faults {
            self.add(path.to_vec(), offset.map_or(Part::Value, Part::Inside), message);
        }
    }

    fn numbers(&mut self, simulation: &Simulation) {
        for (name, value) in [
            ("step", simulation.step),
            ("time_budget", simulation.time_budget),
            ("patience", simulation.patience),
        ] {
            self.positive(vec![name.into()], value);
        }
        if !(0.0..1.0).contains(&simulation.noise) {
            let text = format!("`noise` is {}, but should be at least 0 and below 1", simulation.noise);
            self.wrong(vec!["noise".into()], text);
        }
        if simulation.step > 0.0 && simulation.time_budget / simulation.step > 1e6 {
            self.wrong(vec!["time_budget".into()], "`time_budget` is more than a million times `step`");
        }
        let seconds = simulation.time_budget.max(simulation.step);
        if seconds.is_finite() && seconds > MAX_TIME {
            let text = format!("`time_budget` and `step` should be at most {MAX_TIME:e}");
            self.wrong(vec!["time_budget".into()], text);
        }
    }

    fn positive(&mut self, path: Vec<Key>, value: f64) {
        if !(value.is_finite() && value > 0.0) {
            let text = format!("{} is {value}, but should be positive", last(&path));
            self.wrong(path, text);
        }
    }

    fn not_negative(&mut self, path: Vec<Key>, value: f64) {
        if !(value.is_finite() && value >= 0.0) {
            let text = format!("{} is {value}, but should be at least 0", last(&path));
            self.wrong(path, text);
        }
    }

    fn event(&mut self, index: usize, event: &Disturbance, simulation: &Simulation) -> Option<Condition> {
        let path = |rest: &[&str]| -> Vec<Key> {
            let begin = ["events".into(), index.into()];
            begin.into_iter().chain(rest.iter().map(|key| Key::from(*key))).collect()
        };
        match (event.at, &event.when) {
            (None, None) => {
                let text = "the event has neither `at` nor `when`, so it never takes place; give it the time `at`, or the \
                            condition `when`";
                self.wrong(path(&[]), text);
            }
            (Some(_), Some(_)) => {
                let text = "the event has both `at` and `when`; split it into two events, or remove one of the \
                            two keys";
                self.wrong(path(&["when"]), text);
            }
            (Some(at), None) => {
                self.not_negative(path(&["at"]), at);
                if at > simulation.time_budget {
                    let text = format!(
                        "`at` is {at}, but the mission ends at {} (`time_budget`), so the event never takes place",
                        simulation.time_budget
                    );
                    self.wrong(path(&["at"]), text);
                }
            }
            (None, Some(_)) => {}
        }
        self.not_negative(path(&["within"]), event.within);
        if event.fail.is_empty() && event.recover.is_empty() && event.set.is_empty() {
            let text = "the event does nothing: it has none of `fail`, `recover` and `set`";
            self.wrong(path(&[]), text);
        }
        for (list, components) in [("fail", &event.fail), ("recover", &event.recover)] {
            for (number, component) in components.iter().enumerate() {
                let mut path = path(&[list]);
                path.push(number.into());
                self.component(path, component);
            }
        }
        for (name, value) in &event.set {
            let wrong = setting(&mut self.mission.clone(), name, value, || path(&["set", name]));
            self.mistakes.extend(wrong);
        }
        let when = event.when.as_ref()?;
        conditions::condition(self.mission, when).map_err(|wrong| self.faults(&path(&["when"]), wrong)).ok()
    }

    fn component(&mut self, path: Vec<Key>, component: &str) {
        if let Err(message) = self.mission.clone().fail(component) {
            self.add(path, Part::Value, message);
        }
    }

    fn function(&mut self, path: &[Key], text: &str) -> Option<String> {
        match conditions::function(self.mission, text) {
            Ok(atom) => Some(written(&atom)),
            Err(faults) => {
                self.faults(path, faults);
                None
            }
        }
    }

    fn signal(&mut self, index: usize, signal: &Signal) {
        let path = |key: &str| -> Vec<Key> { vec!["signals".into(), index.into(), key.into()] };
        let knowledge = self.mission.knowledge();
        if !knowledge.is_some_and(|knowledge| knowledge.has_attribute(&signal.attribute)) {
            let attributes =
                knowledge.map(|knowledge| knowledge.view().attribute_types()).unwrap_or_default();
            let attributes = attributes.iter().map(|attribute| attribute.name.as_str());
            let suggestion = did_you_mean(&signal.attribute, attributes);
            let text = format!("the knowledge base has no attribute `{}`{suggestion}", signal.attribute);
            self.wrong(path("attribute"), text);
        }
        self.positive(path("period"), signal.period);
        for (name, value) in [("mean", signal.mean), ("amplitude", signal.amplitude)] {
            if !value.is_finite() {
                self.wrong(path(name), format!("`{name}` is {value}, but should be a number"));
            }
        }
        if let Some(phase) = signal.phase.filter(|phase| !(0.0..=1.0).contains(phase)) {
            self.wrong(path("phase"), format!("`phase` is {phase}, but should be from 0 to 1"));
        }
    }

    fn failure(&mut self, index: usize, failure: &RandomFailure, simulation: &Simulation) {
        let path = |key: &str| -> Vec<Key> { vec!["failures".into(), index.into(), key.into()] };
        self.component(path("component"), &failure.component);
        self.positive(path("mean_time"), failure.mean_time);
        if let Some(recovery) = failure.recovery {
            self.not_negative(path("recovery"), recovery);
            if simulation.time_budget / (failure.mean_time + recovery) > MAX_FAILURES {
                let text = "the component fails more than a million times within `time_budget`";
                self.wrong(path("mean_time"), text);
            }
        }
    }

    fn suave(&mut self, suave: &Suave, watched: &mut Watched) {
        let path = |key: &str| -> Vec<Key> { vec!["suave".into(), key.into()] };
        match conditions::condition(self.mission, &suave.found) {
            Ok(condition) => watched.found = Some(condition),
            Err(faults) => self.faults(&path("found"), faults),
        }
        let actions = || self.mission.domain().actions.iter().map(|action| action.identifier.name.as_str());
        if !actions().any(|action| action.eq_ignore_ascii_case(&suave.inspect)) {
            let suggestion = did_you_mean(&suave.inspect, actions());
            self.wrong(path("inspect"), format!("the domain has no action `{}`{suggestion}", suave.inspect));
        }
        let length = self.function(&path("length"), &suave.length);
        watched.length = length.map(|length| length.trim_matches(['(', ')']).to_owned());
    }
}

fn last(path: &[Key]) -> String {
    match path.last() {
        Some(Key::Name(name)) => format!("`{name}`"),
        _ => "it".to_owned(),
    }
}
