//! Simulates missions with a robot model, to compare control strategies in the same world.
//!
//! An [`Experiment`] runs one mission until the goal is reached, the robot is lost, the strategy gives up, or the time
//! budget is used up. The results are the success and the metric of the mission, the figures that SUAVE reports \[1\],
//! and the stability of the control (reconfigurations, distinct configurations).
//!
//! - \[1\] Rezende Silva et al., SUAVE: an exemplar for self-adaptive underwater vehicles, SEAMS 2023.

mod admissible;
mod baseline;
mod check;
mod report;
mod settings;
mod statistics;
mod world;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

use planner::Limits;

use crate::mapek::{Answer, Command, Event, Loop, Observation, Settings};
use crate::message::{Errors, Message};
use crate::mission::{Mission, TimeUnit, numbers};

pub use baseline::Strategy;
pub use report::{Ending, Run, SUAVE_COLUMNS};
pub use settings::{Disturbance, RandomFailure, Signal, Simulation, Suave};
pub use statistics::Sample;

use baseline::Controller;
use check::Watched;
use world::World;

/// A mission with the simulated environment of its robot. It can be run repeatedly.
///
/// ```
/// use std::path::Path;
/// use metaplan::{planner::Limits, setup::Setup, simulate::Strategy};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let experiment = Setup::read(Path::new("missions/ugv.toml"))?.experiment("kinect_at_wp2")?;
/// let run = experiment.run(Strategy::Joint, 1, &Limits::none(), &mut |_, _| {})?;
/// assert!(run.is_some_and(|run| run.accomplished));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Experiment {
    mission: Mission,
    control: Settings,
    simulation: Simulation,
    watched: Watched,
    time_unit: TimeUnit,
}

impl Experiment {
    /// Prepares a mission for simulation. `mission` is in the situation of a scenario, `control`
    /// has the settings of the loop, `simulation` the settings of the environment. `time_unit` is
    /// the unit of the domain's times; the clock of the loop is in seconds.
    ///
    /// # Errors
    /// All mistakes in the settings of the simulation.
    pub fn new(
        mission: Mission,
        control: Settings,
        simulation: Simulation,
        time_unit: TimeUnit,
    ) -> Result<Self, Errors> {
        let (watched, mistakes) = simulation.watched(&mission);
        Errors::unless_empty(mistakes.into_iter().map(|mistake| mistake.message))?;
        Ok(Self { mission, control, simulation, watched, time_unit })
    }

    /// Returns the mission in its initial situation.
    pub fn mission(&self) -> &Mission {
        &self.mission
    }

    /// Adds warnings about probable mistakes in the numbers of the mission, such as missing values.
    pub fn note_doubts(&mut self) {
        numbers::note_doubts(&mut self.mission);
    }

    /// Returns the unit of all times of a [`Run`]. Times in the log are in seconds.
    pub fn time_unit(&self) -> TimeUnit {
        self.time_unit
    }

    /// Runs the mission once with a strategy. `log` is called with every observation and the
    /// answers to it, with times in seconds. Returns `None` if a limit of `limits` was reached
    /// before the end of the mission.
    ///
    /// # Errors
    /// The problem, or a disturbance or signal of the scenario, does not fit the mission; or the knowledge is
    /// inconsistent.
    pub fn run(
        &self,
        strategy: Strategy,
        seed: u64,
        limits: &Limits,
        log: &mut dyn FnMut(&Observation, &[Answer]),
    ) -> Result<Option<Run>, Errors> {
        let mut control = Loop::new(self.mission.clone(), self.control.clone())?;
        control.limit(limits.clone());
        let world = World::new(self.mission.clone(), self.simulation.clone(), self.watched.clone(), seed);
        let mut stage = Stage {
            world,
            controller: Controller::new(strategy, control, seed),
            second: self.time_unit.seconds(),
            time_budget: self.simulation.time_budget,
            configuration: BTreeMap::new(),
            configurations: BTreeSet::new(),
            stalled_since: None,
            run: Run { strategy, seed, time_unit: self.time_unit, ..Run::default() },
        };
        let ending = stage.play(limits, log)?;
        Ok(ending.map(|ending| stage.finish(ending)))
    }
}

struct Stage {
    world: World,
    controller: Controller,
    /// Length of the domain's time unit in seconds.
    second: f64,
    time_budget: f64,
    configuration: BTreeMap<String, String>,
    configurations: BTreeSet<BTreeMap<String, String>>,
    /// Time at which the running action stalled, in the domain's time unit, if the controller has not reacted since.
    stalled_since: Option<f64>,
    run: Run,
}

impl Stage {
    /// Returns the reason for the end of the mission, or `None` if a limit is reached first.
    fn play(
        &mut self,
        limits: &Limits,
        log: &mut dyn FnMut(&Observation, &[Answer]),
    ) -> Result<Option<Ending>, Message> {
        let mut queue: VecDeque<Event> = self.world.first_look()?.into();
        // The controller receives the observations of time 0 after its first plan, and after the
        // events that its first answers cause.
        let early: Vec<Event> = queue.drain(..).collect();
        let answers = self.controller.start();
        let begun = Observation::from(Event::Tick);
        log(&begun, &answers);
        self.take(&answers, &mut queue);
        queue.extend(early);
        loop {
            while let Some(event) = queue.pop_front() {
                // A plan that a limit has cut short would falsify the result.
                if limits.reached() {
                    return Ok(None);
                }
                self.count(&event);
                let observation = Observation { time: Some(self.now()), ..Observation::from(event.clone()) };
                let answers = self.controller.handle(event, self.now());
                log(&observation, &answers);
                self.take(&answers, &mut queue);
            }
            if limits.reached() {
                return Ok(None);
            }
            if let Some(ending) = self.ending() {
                return Ok(Some(ending));
            }
            queue.extend(self.world.pass()?);
            self.record_stall();
        }
    }

    fn ending(&self) -> Option<Ending> {
        if self.world.reached() {
            Some(Ending::Goal)
        } else if self.world.lost {
            Some(Ending::Lost)
        } else if self.controller.is_done() {
            Some(Ending::GaveUp)
        } else {
            (self.world.time >= self.time_budget).then_some(Ending::Time)
        }
    }

    fn now(&self) -> Duration {
        Duration::from_secs_f64(self.world.time * self.second)
    }

    fn count(&mut self, event: &Event) {
        match event {
            Event::Failed { .. } => self.run.failed += 1,
            Event::Cancelled { .. } => self.run.cancelled += 1,
            Event::Succeeded { .. } => self.run.actions += 1,
            _ => {}
        }
    }

    fn record_stall(&mut self) {
        if self.stalled_since.is_none() && !self.world.goes_on() {
            self.stalled_since = Some(self.world.time);
        }
    }

    fn take(&mut self, answers: &[Answer], queue: &mut VecDeque<Event>) {
        for effect in answers.iter().filter_map(Answer::effect) {
            if let Command::Reconfigure { function, from, to } = &effect.command {
                self.run.reconfigurations += usize::from(from.is_some());
                self.configuration.insert(function.clone(), to.clone());
            }
            if matches!(effect.command, Command::Request { .. }) {
                self.configurations.insert(self.configuration.clone());
            }
            if let Some(since) = self.stalled_since.take() {
                self.run.reactions.push(self.world.time - since);
            }
            queue.extend(self.world.obey(effect));
            self.record_stall();
        }
    }

    fn finish(self, ending: Ending) -> Run {
        Run {
            accomplished: ending == Ending::Goal,
            lost: self.world.lost,
            ending,
            cost: self.world.cost(),
            maximize: self.world.maximizes(),
            time: self.world.time,
            found: self.world.found,
            distance: self.world.distance(),
            distinct: self.configurations.len(),
            plans: self.controller.plans,
            ..self.run
        }
    }
}
