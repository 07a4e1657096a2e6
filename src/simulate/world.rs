//! The simulated robot: its true state, which changes with time, by disturbances and by the running action.
//!
//! Conditions, durations and effects of actions follow the mission's own domain, with a seeded deviation of the
//! duration. An action stalls while it is suspended, and while its conditions, such as the availability of its designs,
//! do not hold for its remaining part. It fails when it has stalled for the simulation's `patience`. The seed alone
//! determines everything random, so all strategies face the same world.

use std::borrow::Cow;
use std::collections::BTreeMap;

use num_rational::BigRational;
use ontology::tomasys::change::Status;
use pddl::ast::{Condition, Direction, Domain, Problem};
use pddl::validate::{Options, PlanText, ValueChange, advance, metric_after, validate};

use crate::mapek::{Command, Effect, Event, PlannedStep, Remainder, gradual_functions, resume};
use crate::message::Message;
use crate::mission::Mission;
use crate::number;
use crate::simulate::check::Watched;
use crate::simulate::settings::{Disturbance, Simulation};

/// Times and shares are rounded to multiples of 1 / `GRAIN`.
const GRAIN: f64 = 1e6;

#[derive(Debug, Clone)]
struct Job {
    action: u64,
    step: PlannedStep,
    /// Completed share of the action, from 0 to 1.
    progress: f64,
    /// Changes of values by the progress. The keys are the texts of the functions.
    applied: BTreeMap<String, BigRational>,
    /// Duration for which the action has stalled without interruption.
    waited: f64,
    suspended: bool,
}

#[derive(Debug, Clone)]
struct ComponentChange {
    time: f64,
    component: String,
    status: Status,
}

#[derive(Debug, Clone)]
pub struct World {
    truth: Mission,
    settings: Simulation,
    watched: Watched,
    seed: u64,
    /// Time since the start of the mission, in the domain's time unit.
    pub time: f64,
    job: Option<Job>,
    phases: Vec<f64>,
    component_changes: Vec<ComponentChange>,
    /// Time of each disturbance. `None` if its condition has not held yet; infinite after the
    /// disturbance has happened.
    times: Vec<Option<f64>>,
    /// `true` after the lifeline, a numeric function such as `battery`, has reached 0.
    pub lost: bool,
    /// Greatest completed share of the action that inspects the pipeline, from 0 to 1.
    pub inspected: f64,
    pub found: Option<f64>,
}

fn exact(value: f64) -> BigRational {
    // Infinite values do not pass the checks of the settings.
    let scaled = BigRational::from_float((value * GRAIN).round()).unwrap_or_default();
    scaled / BigRational::from_integer((GRAIN as i64).into())
}

fn rounded(value: f64) -> f64 {
    (value * GRAIN).round() / GRAIN
}

impl World {
    pub fn new(truth: Mission, settings: Simulation, watched: Watched, seed: u64) -> Self {
        let mut random = fastrand::Rng::with_seed(seed);
        let phases =
            settings.signals.iter().map(|signal| signal.phase.unwrap_or_else(|| random.f64())).collect();
        let mut component_changes = Vec::new();
        for failure in &settings.failures {
            let mut time = 0.0;
            loop {
                // Inverse transform sampling of an exponential distribution.
                time += -(1.0 - random.f64()).ln() * failure.mean_time;
                if time > settings.time_budget {
                    break;
                }
                let component = failure.component.clone();
                component_changes.push(ComponentChange {
                    time: rounded(time),
                    component: component.clone(),
                    status: Status::Failed,
                });
                let Some(recovery) = failure.recovery else { break };
                time += recovery;
                component_changes.push(ComponentChange {
                    time: rounded(time),
                    component,
                    status: Status::Recovered,
                });
            }
        }
        // The changes were generated one component after the other.
        component_changes.sort_by(|left, right| left.time.total_cmp(&right.time));
        let times = settings
            .events
            .iter()
            .map(|event| event.at.map(|at| rounded(at + random.f64() * event.within)))
            .collect();
        Self {
            truth,
            settings,
            watched,
            seed,
            time: 0.0,
            job: None,
            phases,
            component_changes,
            times,
            lost: false,
            inspected: 0.0,
            found: None,
        }
    }

    pub fn obey(&mut self, effect: &Effect) -> Vec<Event> {
        match &effect.command {
            Command::Request { step } => {
                let (action, step) = (effect.action, step.clone());
                self.job = Some(Job {
                    action,
                    step,
                    progress: 0.0,
                    applied: BTreeMap::new(),
                    waited: 0.0,
                    suspended: false,
                });
                vec![Event::Started { action: effect.action }]
            }
            Command::Reconfigure { function, to, .. } => {
                if let Some(job) = self.job.as_mut().filter(|job| job.action == effect.action) {
                    job.step = job.step.with_design(function, to);
                }
                vec![Event::Acknowledged { effect: effect.number }]
            }
            Command::Cancel { .. } => match self.job.take_if(|job| job.action == effect.action) {
                Some(_) => vec![Event::Cancelled { action: effect.action }],
                None => Vec::new(),
            },
            Command::Suspend { .. } | Command::Resume { .. } => {
                if let Some(job) = self.job.as_mut().filter(|job| job.action == effect.action) {
                    job.suspended = matches!(effect.command, Command::Suspend { .. });
                }
                vec![Event::Acknowledged { effect: effect.number }]
            }
        }
    }

    /// Returns `true` if the running action can proceed, or if no action is running.
    pub fn goes_on(&self) -> bool {
        self.job.as_ref().is_none_or(|job| self.remaining_time(job).is_some())
    }

    /// Returns the time that the remaining part of an action takes, or `None` if the action is
    /// suspended or its conditions do not hold.
    fn remaining_time(&self, job: &Job) -> Option<f64> {
        if job.suspended {
            return None;
        }
        let progress = &exact(job.progress);
        let remainder = Remainder { step: &job.step, progress, applied: &job.applied, has_started: true };
        let problem = self.truth.current();
        let (domain, problem) = resume(self.truth.domain(), Cow::Borrowed(&*problem), &remainder);
        let advance = advance(&domain, &problem, &job.step.to_plan_step(), false).ok()?;
        Some(number::to_f64(&advance.duration) * self.slowness(&job.step))
    }

    /// Returns the ratio of the real to the expected duration of an action in this world. The ratio
    /// depends on the seed and on the action without its designs.
    fn slowness(&self, step: &PlannedStep) -> f64 {
        let mut text = step.action.clone();
        for word in step.context().into_iter().flatten() {
            text.push(' ');
            text += word;
        }
        let seed =
            self.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ u64::from(crc32fast::hash(text.as_bytes()));
        1.0 + self.settings.noise * (2.0 * fastrand::Rng::with_seed(seed).f64() - 1.0)
    }

    /// Advances time by one step of the simulation, or to the end of the running action if this is sooner. Returns the
    /// events that happen until then.
    pub fn pass(&mut self) -> Result<Vec<Event>, Message> {
        let mut events = Vec::new();
        let remaining = self.job.as_ref().and_then(|job| self.remaining_time(job));
        let step = remaining.map_or(self.settings.step, |remaining| remaining.min(self.settings.step));
        self.time = rounded(self.time + step);
        self.work(step, remaining, &mut events);
        self.disturb(&mut events)?;
        // A disturbance can fulfil the condition of another one, also while no action makes progress.
        self.watch();
        self.swing(&mut events)?;
        events.push(Event::Tick);
        Ok(events)
    }

    fn work(&mut self, step: f64, remaining_time: Option<f64>, events: &mut Vec<Event>) {
        let Some(mut job) = self.job.take() else { return };
        // The action has stalled.
        let Some(remaining_time) = remaining_time else {
            job.waited += step;
            if job.waited >= self.settings.patience {
                let reason = "it cannot go on".to_owned();
                events.push(Event::Failed { action: job.action, reason });
            } else {
                self.job = Some(job);
            }
            return;
        };
        job.waited = 0.0;
        // The last step ends exactly with the action.
        let whole = step >= remaining_time;
        let share = if whole { 1.0 - job.progress } else { (1.0 - job.progress) * step / remaining_time };
        job.progress = rounded(job.progress + share);
        self.use_up(&mut job, share, whole, events);
        if self
            .settings
            .suave
            .as_ref()
            .is_some_and(|suave| suave.inspect.eq_ignore_ascii_case(&job.step.action))
        {
            self.inspected = self.inspected.max(job.progress);
        }
        if whole {
            events.push(Event::Succeeded { action: job.action });
        } else {
            events.insert(0, Event::Progress { action: job.action, fraction: exact(job.progress) });
            self.job = Some(job);
        }
        self.watch();
    }

    /// Applies the effects of a share of an action: numeric increases and decreases in proportion
    /// to the share, and, if `whole`, also other changes of values and changes of facts. The effects are
    /// those in the state before the action.
    fn use_up(&mut self, job: &mut Job, share: f64, whole: bool, events: &mut Vec<Event>) {
        let mut before = (*self.truth.current()).clone();
        for (name, change) in &job.applied {
            Mission::add_to_value(&mut before, name, &-change);
        }
        let gradual = gradual_functions(self.truth.domain(), &job.step);
        let is_gradual = |change: &ValueChange| gradual.contains(&change.function.predicate.name);
        let Ok(mut advance) = advance(self.truth.domain(), &before, &job.step.to_plan_step(), true) else {
            return;
        };
        let share = exact(share);
        for change in advance.values.iter_mut().filter(|change| is_gradual(change)) {
            let name = change.text.trim_matches(['(', ')']);
            if let (Some(now), Some(before)) = (self.truth.value(name), &change.before) {
                change.after = number::bounded(&now + (&change.after - before) * &share);
                *job.applied.entry(name.to_owned()).or_default() += &change.after - now;
            }
        }
        if !whole {
            advance.values.retain(is_gradual);
            (advance.added, advance.deleted) = (Vec::new(), Vec::new());
        }
        let mut init = self.truth.problem().init.clone();
        advance.apply(&mut init);
        self.truth.set_init(init);
        for change in &advance.values {
            let lifeline = self.watched.lifeline.as_ref();
            let is_lifeline = lifeline.is_some_and(|lifeline| lifeline.eq_ignore_ascii_case(&change.text));
            self.lost |= is_lifeline && change.after <= BigRational::default();
            let name = change.text.trim_matches(['(', ')']).to_owned();
            if !whole {
                let value = number::decimal(&number::rounded(&change.after));
                events.push(Event::Fact { name, value });
            }
        }
    }

    /// Records the time at which the pipeline is found, and the loss of the robot. Schedules the disturbances
    /// whose conditions now hold for the first time.
    fn watch(&mut self) {
        let lifeline = self.watched.lifeline.as_ref();
        let value = lifeline.and_then(|lifeline| self.truth.value(lifeline.trim_matches(['(', ')'])));
        self.lost |= value.is_some_and(|value| value <= BigRational::default());
        if self.found.is_none() && self.watched.found.as_ref().is_some_and(|found| self.holds(found)) {
            self.found = Some(self.time);
        }
        for (index, event) in self.settings.events.iter().enumerate() {
            let condition = self.watched.events[index].as_ref().filter(|_| self.times[index].is_none());
            if condition.is_some_and(|condition| self.holds(condition)) {
                // A separate generator for each event keeps the delays independent of the order of
                // the events.
                let seed = self.seed.wrapping_add(index as u64 + 1);
                let delay = fastrand::Rng::with_seed(seed).f64() * event.within;
                self.times[index] = Some(rounded(self.time + delay));
            }
        }
    }

    fn holds(&self, condition: &Condition) -> bool {
        let goal = condition.clone();
        is_valid(
            self.truth.domain(),
            &Problem { goal, constraints: Vec::new(), ..(*self.truth.current()).clone() },
        )
    }

    fn disturb(&mut self, events: &mut Vec<Event>) -> Result<(), Message> {
        let due: Vec<usize> = (0..self.times.len())
            .filter(|&index| self.times[index].is_some_and(|time| time <= self.time))
            .collect();
        for index in due {
            // Each disturbance happens once.
            self.times[index] = Some(f64::INFINITY);
            let Disturbance { fail, recover, set, .. } = self.settings.events[index].clone();
            for (components, status) in [(fail, Status::Failed), (recover, Status::Recovered)] {
                for component in components {
                    self.report(component, status, events)?;
                }
            }
            for (name, value) in set {
                self.truth.set(&name, &value)?;
                let knowledge = self.truth.knowledge();
                let is_measured = knowledge.is_some_and(|knowledge| knowledge.uses_measurement(name.trim()));
                events.push(match number::exact(&value).filter(|_| is_measured) {
                    Some(value) => Event::Measured { attribute: name.trim().to_owned(), value },
                    None => Event::Fact { name, value },
                });
            }
        }
        while self.component_changes.first().is_some_and(|change| change.time <= self.time) {
            let change = self.component_changes.remove(0);
            self.report(change.component, change.status, events)?;
        }
        Ok(())
    }

    fn report(&mut self, component: String, status: Status, events: &mut Vec<Event>) -> Result<(), Message> {
        if let Some(knowledge) = self.truth.knowledge_mut() {
            knowledge.report(&component, status)?;
        }
        events.push(Event::Component { component, status });
        Ok(())
    }

    /// Returns the events of time 0: disturbances at this time, and the initial values of the signals.
    pub fn first_look(&mut self) -> Result<Vec<Event>, Message> {
        let mut events = Vec::new();
        self.watch();
        self.disturb(&mut events)?;
        self.swing(&mut events)?;
        Ok(events)
    }

    fn swing(&mut self, events: &mut Vec<Event>) -> Result<(), Message> {
        for (signal, phase) in self.settings.signals.iter().zip(&self.phases) {
            let turn = std::f64::consts::TAU * (self.time / signal.period + phase);
            let value = signal.mean + signal.amplitude * turn.sin();
            // Two decimals keep the exact numbers small.
            let value = exact((value * 100.0).round() / 100.0);
            if let Some(knowledge) = self.truth.knowledge_mut() {
                knowledge.observe(&signal.attribute, &value)?;
            }
            events.push(Event::Measured { attribute: signal.attribute.clone(), value });
        }
        Ok(())
    }

    pub fn reached(&self) -> bool {
        is_valid(self.truth.domain(), &self.truth.current())
    }

    /// Returns the value of the mission's metric in the current state, or the elapsed time if the mission has no metric
    /// or the value is undefined.
    pub fn cost(&self) -> f64 {
        let metric = metric_after(self.truth.domain(), &self.truth.current(), &exact(self.time));
        metric.map_or(self.time, |metric| number::to_f64(&metric))
    }

    pub fn maximizes(&self) -> bool {
        self.truth.current().metric.as_ref().is_some_and(|metric| metric.direction == Direction::Maximize)
    }

    /// Inspected length of the pipeline, in the unit of the mission's function for the length. `None` if the simulation
    /// has no such function, or the function has no value.
    pub fn distance(&self) -> Option<f64> {
        let length = self.truth.value(self.watched.length.as_ref()?)?;
        Some(number::to_f64(&length) * self.inspected)
    }
}

fn is_valid(domain: &Domain, problem: &Problem) -> bool {
    validate(domain, problem, &PlanText::default(), &Options::default()).valid
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_values_are_exact() {
        assert_eq!(exact(1e14), BigRational::from_integer(100_000_000_000_000_i64.into()));
        assert_eq!(exact(-0.25), BigRational::new((-1).into(), 4.into()));
    }
}
