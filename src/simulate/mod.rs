//! A mission with a simulated robot: how ways of control fare in the same world.
//!
//! [`simulate`] runs one mission to its end, by the goal, by the end of the robot, or by the end of the time. The figures
//! are those of the mission (accomplished, its metric), those that SUAVE reports \[1\], and how undecided the control was
//! (reconfigurations, distinct configurations).
//!
//! - \[1\] Rezende Silva et al., SUAVE: an exemplar for self-adaptive underwater vehicles, SEAMS 2023.

mod baseline;
mod report;
mod settings;
mod statistics;
mod world;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

use crate::mapek::{Answer, Command, Event, Loop, Observation, Settings};
use crate::message::{Errors, Message};
use crate::mission::Mission;

pub use baseline::Strategy;
pub use report::{Run, SUAVE_COLUMNS};
pub use settings::{Disturbance, RandomFailure, Signal, Simulation, Suave};
pub use statistics::Sample;

use baseline::Controller;
use world::World;

/// The seconds of a loop's clock in a unit of the domain's time: a minute, as the shipped missions have it.
const SECONDS: f64 = 60.0;

/// Runs one mission with a loop that is as eager as `control` says; `log` hears of every observation and every answer, at its time in seconds.
///
/// # Errors
/// The mission or the scenario does not fit.
pub fn simulate(
    mission: &Mission,
    control: &Settings,
    settings: &Simulation,
    strategy: Strategy,
    seed: u64,
    log: &mut dyn FnMut(&Observation, &[Answer]),
) -> Result<Run, Errors> {
    if let Some(mistake) = settings.mistake() {
        return Err(vec![Message::error("M135", format!("the simulation cannot be run: {mistake}"))].into());
    }
    let control = Loop::new(mission.clone(), control.clone())?;
    let mut stage = Stage {
        world: World::new(mission.clone(), settings.clone(), seed),
        controller: Controller::new(strategy, control, seed),
        configuration: BTreeMap::new(),
        configurations: BTreeSet::new(),
        upset: None,
        run: Run { strategy, seed, ..Run::default() },
    };
    stage.play(settings, log)?;
    Ok(stage.finish())
}

/// A world, who controls it, and what is noted of both.
struct Stage {
    world: World,
    controller: Controller,
    configuration: BTreeMap<String, String>,
    configurations: BTreeSet<BTreeMap<String, String>>,
    /// Since when the action under way cannot go on, with nothing done about it.
    upset: Option<f64>,
    run: Run,
}

impl Stage {
    fn play(
        &mut self,
        settings: &Simulation,
        log: &mut dyn FnMut(&Observation, &[Answer]),
    ) -> Result<(), Message> {
        let mut queue: VecDeque<Event> = self.world.first_look()?.into();
        // What is seen at first is known before the first plan.
        let early: Vec<Event> = queue.drain(..).collect();
        let answers = self.controller.start();
        let begun = Observation::from(Event::Tick);
        log(&begun, &answers);
        self.take(&answers, &mut queue);
        queue.extend(early);
        loop {
            while let Some(event) = queue.pop_front() {
                self.count(&event);
                let observation = Observation { time: Some(self.now()), ..Observation::from(event.clone()) };
                let answers = self.controller.handle(event, self.now());
                log(&observation, &answers);
                self.take(&answers, &mut queue);
            }
            let over =
                self.world.time >= settings.time_budget || self.controller.is_done() || self.world.lost;
            if self.world.reached() || over {
                return Ok(());
            }
            queue.extend(self.world.pass()?);
            self.look();
        }
    }

    fn now(&self) -> Duration {
        Duration::from_secs_f64(self.world.time * SECONDS)
    }

    fn count(&mut self, event: &Event) {
        match event {
            Event::Failed { .. } => self.run.failed += 1,
            Event::Cancelled { .. } => self.run.cancelled += 1,
            Event::Succeeded { .. } => self.run.actions += 1,
            _ => {}
        }
    }

    /// Notes when the action under way has come to a stand.
    fn look(&mut self) {
        if self.upset.is_none() && !self.world.goes_on() {
            self.upset = Some(self.world.time);
        }
    }

    /// Carries out what was decided.
    fn take(&mut self, answers: &[Answer], queue: &mut VecDeque<Event>) {
        for effect in answers.iter().filter_map(Answer::effect) {
            if let Command::Reconfigure { function, from, to } = &effect.command {
                self.run.reconfigurations += usize::from(from.is_some());
                self.configuration.insert(function.clone(), to.clone());
            }
            if matches!(effect.command, Command::Request { .. }) {
                self.configurations.insert(self.configuration.clone());
            }
            if let Some(since) = self.upset.take() {
                self.run.reactions.push(self.world.time - since);
            }
            queue.extend(self.world.obey(effect));
            self.look();
        }
    }

    fn finish(self) -> Run {
        Run {
            accomplished: self.world.reached(),
            lost: self.world.lost,
            cost: self.world.cost(),
            time: self.world.time,
            found: self.world.found,
            distance: self.world.distance(),
            distinct: self.configurations.len(),
            plans: self.controller.plans,
            ..self.run
        }
    }
}
