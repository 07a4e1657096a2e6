//! Monitor (of MAPE-K): applies events reported by the managed system to the beliefs.

use std::collections::{BTreeSet, HashMap, HashSet};

use num_rational::BigRational;
use ontology::vocab::local_name;
use pddl::ast::{Domain, Problem};
use pddl::validate::{Advance, ValueChange, Violation, advance, advance_defined};
use rules::{Delta, Fact};

use crate::knowledge::{RobotReport, VALUE_PROPERTIES};
use crate::mapek::acknowledge::{Failure, Receipt};
use crate::mapek::answer::{Command, Effect};
use crate::mapek::beliefs::{Beliefs, Running};
pub(super) use crate::mapek::changes::{Base, Changes};
use crate::mapek::event::Event;
use crate::mapek::fields::Refusal;
use crate::mapek::filter::Filters;
use crate::mapek::resume::gradual_functions;
use crate::mapek::settings::Settings;
use crate::mapek::step::PlannedStep;
use crate::message::{Message, did_you_mean};
use crate::mission::Mission;
use crate::number;

/// Local names of the TOMASys properties that determine the availability of designs and the statuses of objectives.
const WATCHED: [&str; 5] = ["fd_realisability", "fd_available", "o_status", "o_updatable", "fg_status"];

/// Local names of further TOMASys properties and classes on which plans depend.
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

#[derive(Debug, Clone)]
pub(super) struct Monitor {
    pub(super) attributes: BTreeSet<String>,
    /// Attributes whose measured value cannot have an effect. Their measurements are refused.
    pub(super) unused_attributes: BTreeSet<String>,
    pub(super) filters: Filters,
    pub(super) components: HashMap<String, String>,
}

impl Monitor {
    pub(super) fn new(mission: &Mission, settings: &Settings) -> Self {
        let kinds =
            mission.knowledge().map(|knowledge| knowledge.view().attribute_types()).unwrap_or_default();
        let filters = Filters::new(&settings.filters, mission.knowledge());
        let unused_kinds =
            kinds.iter().filter(|kind| !filters.has(&kind.name) && !mission.uses_measurement(&kind.name));
        let unused_attributes = unused_kinds.flat_map(|kind| [kind.iri.clone(), kind.name.clone()]).collect();
        let attributes = kinds.into_iter().flat_map(|kind| [kind.iri, kind.name]).collect();
        Self { attributes, unused_attributes, filters, components: HashMap::new() }
    }

    pub(super) fn filters(&self) -> &Filters {
        &self.filters
    }

    /// Applies the changes of belief that are due without an event, e.g. reports that filters have held back. Returns
    /// refusals of changes that do not fit the mission.
    pub(super) fn elapse(&mut self, beliefs: &mut Beliefs, changes: &mut Changes) -> Vec<Refusal> {
        let due = self.filters.elapse(&mut beliefs.filters, beliefs.now, &mut changes.filtered);
        let mut update = BeliefUpdate { monitor: self, beliefs, changes };
        due.into_iter().filter_map(|accepted| update.accept(accepted).err()).collect()
    }

    pub(super) fn apply(
        &mut self,
        beliefs: &mut Beliefs,
        event: &Event,
        changes: &mut Changes,
    ) -> Result<(), Refusal> {
        BeliefUpdate { monitor: self, beliefs, changes }.apply(event)
    }
}

pub(super) struct BeliefUpdate<'a> {
    pub(super) monitor: &'a mut Monitor,
    pub(super) beliefs: &'a mut Beliefs,
    pub(super) changes: &'a mut Changes,
}

impl BeliefUpdate<'_> {
    fn apply(&mut self, event: &Event) -> Result<(), Refusal> {
        match event {
            Event::Measured { attribute, value } => self.sampled(attribute, value),
            Event::Component { component, status } => self.component(component, *status),
            Event::Design { design, realisable } => {
                self.report("design", design, RobotReport::Design(*realisable))
            }
            Event::Observed { function, design } => self.observed(function, design.as_deref()),
            Event::ReconfigurationFailed { effect } => self.failed_reconfiguration(*effect),
            Event::Started { action } => self.confirm_started(*action).map(|_| ()),
            Event::Progress { action, fraction } => {
                self.confirm_started(*action)?.progressed = true;
                // Without a result, a later report applies this share, too.
                if let Some(Ok(advance)) = self.evaluate(forced) {
                    self.progress(fraction, &advance);
                }
                Ok(())
            }
            Event::Succeeded { action } => self.succeeded(*action),
            Event::Failed { action, reason } => {
                let reason = if reason.is_empty() { String::new() } else { format!(": {reason}") };
                let step = self.ended_early(*action)?.step;
                self.count_failure(step);
                self.changes.reasons.push(format!("action {action} has failed{reason}"));
                Ok(())
            }
            Event::Cancelled { action } => {
                let running = self.ended_early(*action)?;
                // A robot that cannot suspend an action reports its cancellation, possibly after the resumption.
                if !running.cancelling && !running.suspended && !running.resumed {
                    self.count_failure(running.step);
                }
                self.changes.reasons.push(format!("action {action} was cancelled"));
                Ok(())
            }
            Event::Goal { goal } => {
                let condition = self.beliefs.mission.goal(goal).map_err(|messages| first(&messages))?;
                self.beliefs.mission.set_goal(condition);
                self.beliefs.goal = Some(goal.clone());
                self.beliefs.failures = None;
                self.changes.goal = true;
                self.changes.reasons.push("the goal has changed".to_owned());
                Ok(())
            }
            Event::Fact { name, value } => self.fact(name, value),
            Event::Acknowledged { effect } => self.acknowledged(*effect),
            Event::ObjectiveAdded { .. } | Event::ObjectiveRemoved { .. } => {
                let text = format!(
                    "`{}` requires `run --configure`; here the plan determines the required functions",
                    event.kind()
                );
                Err(Refusal::new("M306", text))
            }
            Event::Tick | Event::Note { .. } => Ok(()),
        }
    }

    pub(super) fn report(&mut self, kind: &str, name: &str, report: RobotReport) -> Result<(), Refusal> {
        let Some(knowledge) = self.beliefs.mission.knowledge_mut() else {
            let text = format!("without a knowledge base there is no {kind} `{name}`");
            return Err(Refusal::new("M306", text));
        };
        let was_known = knowledge.fault().is_none();
        let delta = knowledge.take(name, report).map_err(|message| fault(&message))?;
        self.record_delta(&delta, was_known);
        Ok(())
    }

    fn acknowledged(&mut self, effect: u64) -> Result<(), Refusal> {
        match self.beliefs.acknowledge(effect) {
            Receipt::Unknown => {
                Err(Refusal::new("M305", format!("no effect with the number {effect} was requested")))
            }
            Receipt::Recorded => Ok(()),
            Receipt::Doubtful(function) => {
                let running = self.beliefs.running.as_ref();
                if running.is_some_and(|running_action| running_action.step.design(&function).is_some()) {
                    self.changes.reasons.push(format!("the current design of {function} is uncertain"));
                }
                Ok(())
            }
        }
    }

    /// Handles a report that a reconfiguration has failed: corrects the believed design of the function, and marks the
    /// requested design as unrealisable until the next report about the design. An old or repeated report changes
    /// neither.
    fn failed_reconfiguration(&mut self, effect: u64) -> Result<(), Refusal> {
        if self.beliefs.mission.knowledge().is_none() {
            return Err(Refusal::new("M306", "without a knowledge base there are no designs"));
        }
        match self.beliefs.reconfiguration_failed(effect) {
            Failure::Design(design) => self.report("design", &design, RobotReport::Design(false)),
            Failure::Stale => Ok(()),
            Failure::NotReconfiguration => Err(Refusal::new(
                "M305",
                format!("no reconfiguration with the number {effect} was requested"),
            )),
        }
    }

    pub(super) fn measured(&mut self, attribute: &str, value: &BigRational) -> Result<(), Refusal> {
        let is_known = self.monitor.attributes.contains(attribute);
        if let Some(knowledge) = self.beliefs.mission.knowledge_mut().filter(|_| is_known) {
            let was_known = knowledge.fault().is_none();
            let delta =
                knowledge.take(attribute, RobotReport::measured(value)).map_err(|message| fault(&message))?;
            // An equal measurement is not a change. Without conclusions, the delta is empty despite changes.
            let is_change = !was_known
                || knowledge.fault().is_some()
                || !(delta.insert.is_empty() && delta.delete.is_empty());
            self.record_delta(&delta, was_known);
            let functions = self.beliefs.mission.fed_by(local_name(attribute));
            self.changes.facts |= is_change && !functions.is_empty();
            for function in functions {
                if self.beliefs.mission.value(&function).is_some() {
                    self.fact(&function, &number::decimal(value))?;
                } else {
                    self.changes.values |= is_change;
                }
            }
            return Ok(());
        }
        if self.beliefs.mission.is_function(attribute) {
            return self.fact(attribute, &number::decimal(value));
        }
        let attributes: Vec<&str> =
            self.monitor.attributes.iter().map(String::as_str).filter(|name| !name.contains(':')).collect();
        let functions: Vec<&str> = self
            .beliefs
            .mission
            .domain()
            .functions
            .iter()
            .filter(|declaration| declaration.parameters.is_empty())
            .map(|declaration| declaration.identifier.name.as_str())
            .collect();
        let suggestion = did_you_mean(attribute, attributes.iter().chain(&functions).copied());
        let text = format!(
            "there is no attribute or function `{attribute}`; attributes are: {}{suggestion}",
            attributes.join(", ")
        );
        Err(Refusal::new("M306", text))
    }

    /// Records in `changes` which conclusions and plan inputs are affected by a delta of the knowledge base.
    /// `was_known` is `true` if the conclusions were complete before.
    fn record_delta(&mut self, delta: &Delta, was_known: bool) {
        let Some(knowledge) = self.beliefs.mission.knowledge() else { return };
        let is_known = knowledge.fault().is_none();
        // If the conclusions were or are incomplete, the delta does not contain all changes.
        self.changes.base =
            self.changes.base.max(if was_known && is_known { Base::Stated } else { Base::Watched });
        let engine = knowledge.engine();
        let name = |fact: &Fact| engine.symbols().value(fact.predicate).as_name().map_or("", local_name);
        let subject = |fact: &Fact| (fact.predicate, fact.arguments.first().copied());
        let replaced: HashSet<_> = delta.insert.iter().map(subject).collect();
        let insert = delta.insert.iter().map(|fact| (fact, true));
        let delete = delta.delete.iter().map(|fact| (fact, false));
        for (fact, is_insertion) in insert.chain(delete) {
            let name = name(fact);
            let mut is_input = false;
            // The analysis determines whether plans depend on a change of these properties.
            if WATCHED.contains(&name) {
                self.changes.base = Base::Watched;
            } else {
                is_input = PLANNED.contains(&name) || self.beliefs.mission.contains_fact(fact);
            }
            if VALUE_PROPERTIES.contains(&name) {
                // A derived value is an estimation, which plans depend on. A reported value is a measurement.
                is_input |= is_insertion && !engine.is_asserted(fact);
                // A value that ceases to hold may have been either.
                self.changes.facts |= !is_insertion && !replaced.contains(&subject(fact));
            }
            self.changes.facts |= is_input;
            self.changes.values |= is_input;
        }
    }

    fn running(&mut self, action: u64) -> Result<&mut Running, Refusal> {
        let running = self.beliefs.running.as_mut().filter(|running| running.action == action);
        running.ok_or_else(|| Refusal::new("M305", format!("no action {action} is under way")))
    }

    fn confirm_started(&mut self, action: u64) -> Result<&mut Running, Refusal> {
        let request = self.running(action)?.request;
        self.beliefs.confirm_request(request);
        self.beliefs.reports_actions = true;
        let now = self.beliefs.now;
        let running = self.running(action)?;
        (running.last_report, running.overdue, running.started) = (now, 0, true);
        Ok(running)
    }

    /// Removes the action under way. The effects of this action and of earlier ones are no longer outstanding, except
    /// reconfigurations, which belong to functions.
    fn end(&mut self, action: u64) -> Result<Running, Refusal> {
        self.running(action)?;
        let is_moot = |effect: &Effect| {
            effect.action <= action && !matches!(effect.command, Command::Reconfigure { .. })
        };
        self.beliefs.outstanding.retain(|_, effect| !is_moot(effect));
        let outstanding = &self.beliefs.outstanding;
        self.beliefs.waits.retain(|number, _| outstanding.contains_key(number));
        self.changes.ended = true;
        let refusal = || Refusal::new("M305", format!("no action {action} is under way"));
        self.beliefs.running.take().ok_or_else(refusal)
    }

    fn succeeded(&mut self, action: u64) -> Result<(), Refusal> {
        let request = self.running(action)?.request;
        self.beliefs.confirm_request(request);
        // The report of success counts even if conditions are violated, or if effects cannot be evaluated.
        let advance = match self.evaluate(forced) {
            Some(Err(violation)) => {
                let text = format!("the effects of action {action} are uncertain: {}", violation.message);
                self.changes.reasons.push(text);
                self.evaluate(defined)
            }
            outcome => outcome,
        };
        let advance = advance.and_then(Result::ok);
        // Completes the remaining increases and decreases.
        if let Some(advance) = &advance {
            self.progress(&BigRational::from_integer(1.into()), advance);
        }
        let running = self.end(action)?;
        if let Some(mut advance) = advance {
            // Gradual changes were applied with the progress.
            let gradual = gradual_functions(self.beliefs.mission.domain(), &running.step);
            advance.values.retain(|change| !gradual.contains(&change.function.predicate.name));
            let mut init = self.beliefs.mission.problem().init.clone();
            advance.apply(&mut init);
            self.beliefs.mission.set_init(init);
            self.assert_effects(action, &advance);
        }
        self.beliefs.failures = None;
        if running.cancelling || running.suspended {
            let expected_end = if running.cancelling { "cancelled" } else { "suspended" };
            self.changes
                .reasons
                .push(format!("action {action} should have been {expected_end}, but has succeeded"));
        }
        Ok(())
    }

    /// Counts a failure of a step. Only consecutive failures of one step count. Steps are compared without duration and
    /// cost, which depend on the situation.
    fn count_failure(&mut self, step: PlannedStep) {
        let before = self.beliefs.failures.take().filter(|(failed, _)| failed.has_same_action(&step));
        let count = before.map_or(1, |(_, count)| count + 1);
        self.beliefs.failures = Some((step, count));
    }

    /// Ends an action without success. Resources consumed by its progress remain consumed, and its other effects do not
    /// take place.
    fn ended_early(&mut self, action: u64) -> Result<Running, Refusal> {
        let running = self.end(action)?;
        self.changes.facts = true;
        Ok(running)
    }

    /// Sets the progress of the action under way, and applies the share of its increases and decreases since the
    /// previous progress. `advance` contains the effects of the whole action.
    fn progress(&mut self, fraction: &BigRational, advance: &Advance) {
        let Some(running) = &mut self.beliefs.running else { return };
        let increment = fraction - &running.progress;
        running.progress.clone_from(fraction);
        let gradual = gradual_functions(self.beliefs.mission.domain(), &running.step);
        let is_gradual = |change: &&ValueChange| gradual.contains(&change.function.predicate.name);
        for change in advance.values.iter().filter(is_gradual) {
            let name = change.text.trim_matches(['(', ')']);
            if let Some(before) = &change.before {
                // A value that the problem does not state comes from the knowledge base. From now on, the problem
                // states it.
                let now = self.beliefs.mission.value(name).unwrap_or_else(|| before.clone());
                // The value is exact, so that the end of the action has the effects that were planned.
                let value = number::bounded(&now + (&change.after - before) * &increment);
                self.beliefs.mission.set_number(name, &value);
                *running.applied.entry(name.to_owned()).or_default() += value - now;
            }
        }
    }

    /// Applies the facts that an action has added and deleted to the knowledge base.
    fn assert_effects(&mut self, action: u64, advance: &Advance) {
        match self.beliefs.mission.assert_effects(&advance.added, &advance.deleted) {
            Ok(delta) if delta == Delta::default() => {}
            Ok(_) => self.changes.base = Base::Watched,
            Err(message) => {
                let text = format!("the effects of action {action} are uncertain: {}", message.message);
                self.changes.reasons.push(text);
            }
        }
    }

    /// Evaluates the effects of a complete execution of the action under way. They are those in the state before the
    /// action: without the increases and decreases by its progress.
    fn evaluate<T>(&mut self, effects: impl Fn(&Domain, &Problem, &PlannedStep) -> T) -> Option<T> {
        let Beliefs { mission, running, .. } = &mut *self.beliefs;
        let running = running.as_ref()?;
        if running.applied.is_empty() {
            return Some(effects(mission.domain(), &mission.current(), &running.step));
        }
        // The caller changes the values of the mission, so that the cached problem becomes outdated anyway.
        let mut before = mission.take_current();
        for (name, change) in &running.applied {
            Mission::add_to_value(&mut before, name, &-change);
        }
        Some(effects(mission.domain(), &before, &running.step))
    }

    fn fact(&mut self, name: &str, value: &str) -> Result<(), Refusal> {
        let mut words = name.split_whitespace();
        let name = words.by_ref().collect::<Vec<_>>().join(" ");
        if !self.beliefs.mission.is_function(&name) {
            // A report of a known fact is not a change.
            if self.set(&name, value)? {
                self.changes.predicates = true;
                self.changes.facts = true;
            }
            return Ok(());
        }
        let wrong = || {
            Refusal::new(
                "M302",
                format!("the value of {name} is `{value}`, but should be {}", number::DECIMAL),
            )
        };
        let value = number::reported(&number::exact(value).ok_or_else(wrong)?);
        // A report of the believed value, which can have more decimals, is not a change.
        if self.beliefs.mission.value(&name).is_none_or(|believed| !number::confirms(&value, &believed)) {
            self.set(&name, &number::decimal(&value))?;
            self.changes.facts = true;
            self.changes.values = true;
        }
        Ok(())
    }

    /// Sets a fact or a value of the problem. Returns `true` if this changes the believed state. If the new fact or value
    /// does not fit the domain and the objects, restores the previous state and returns a refusal.
    fn set(&mut self, name: &str, value: &str) -> Result<bool, Refusal> {
        let mission = &mut self.beliefs.mission;
        // There is nothing to check in a report of the value of a known function without arguments. This saves a copy of
        // the initial state, which can be large.
        if !name.contains(' ') && mission.is_function(name) && mission.value(name).is_some() {
            return mission.set_in_problem(name, value).map_err(|message| fault(&message));
        }
        let before = mission.problem().init.clone();
        let is_change = mission.set_in_problem(name, value).map_err(|message| fault(&message))?;
        // A fact can also be removed.
        let is_addition =
            || mission.is_function(name) || mission.holds(name) || mission.holds(&format!("{name} {value}"));
        if is_change
            && is_addition()
            && let Err(messages) = mission.check_last_element()
        {
            mission.set_init(before);
            return Err(first(&messages));
        }
        Ok(is_change)
    }
}

type Effects = Result<Advance, Box<Violation>>;

/// Effects of a step, regardless of its conditions.
fn forced(domain: &Domain, problem: &Problem, step: &PlannedStep) -> Effects {
    advance(domain, problem, &step.to_plan_step(), true)
}

/// Effects of a step that can be evaluated, with the planned duration.
fn defined(domain: &Domain, problem: &Problem, step: &PlannedStep) -> Effects {
    advance_defined(domain, problem, &step.to_plan_step(), &step.duration)
}

fn fault(message: &Message) -> Refusal {
    Refusal::new("M306", message.message.clone())
}

fn first(messages: &[Message]) -> Refusal {
    messages.first().map_or_else(|| Refusal::new("M306", "it does not fit the mission"), fault)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{Base, Changes, Monitor};
    use crate::mapek::beliefs::Beliefs;
    use crate::mapek::event::Observation;
    use crate::mapek::settings::Settings;
    use crate::setup::Setup;

    fn check(line: &str, expected: Result<(Base, [bool; 3], &[&str]), &str>) {
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/ugv.toml");
        let mission = Setup::read(&manifest).expect("the mission is read").mission;
        let (mut monitor, mut beliefs) =
            (Monitor::new(&mission, &Settings::default()), Beliefs::new(mission));
        let mut changes = Changes::default();
        let event = Observation::parse(line).events.remove(0).expect("an event");
        let outcome = monitor.apply(&mut beliefs, &event, &mut changes);
        let result = outcome.map_err(|refusal| refusal.code);
        let Changes { base, facts, predicates, goal, reasons, .. } = &changes;
        assert_eq!(result.is_err() || line.contains("tick"), !changes.any(), "{line}");
        let reasons: Vec<&str> = reasons.iter().map(String::as_str).collect();
        let result = result.map(|()| (*base, [*facts, *predicates, *goal], &reasons[..]));
        assert_eq!(result, expected, "{line}");
    }

    #[test]
    fn events_change_the_beliefs() {
        let unchanged = [false, false, false];
        check(
            r#"{"event":"component_status","component":"c_kinect","status":"FALSE"}"#,
            Ok((Base::Watched, unchanged, &[])),
        );
        check(r#"{"event":"component_status","component":"c_nothing","status":"FALSE"}"#, Err("M306"));
        check(
            r#"{"event":"fact_changed","name":"robot_at","value":"wp2"}"#,
            Ok((Base::Nothing, [true, true, false], &[])),
        );
        check(
            r#"{"event":"goal_changed","goal":"(robot_at wp2)"}"#,
            Ok((Base::Nothing, [false, false, true], &["the goal has changed"])),
        );
        check(r#"{"event":"action_failed","action":1}"#, Err("M305"));
        check(r#"{"event":"acknowledged","effect":1}"#, Err("M305"));
        check(r#"{"event":"tick"}"#, Ok((Base::Nothing, unchanged, &[])));
    }
}
