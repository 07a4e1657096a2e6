//! Executes sequential plans at exact times, by the definition of a plan.

use super::happening::{End, Obstacle, State, World, fit};
use super::model::{Body, Measure, Q, q};

pub fn execute(world: &World, steps: &[(usize, Q, Q)]) -> Result<Q, Obstacle> {
    let mut run = Run { world, state: world.initial.clone(), applied: 0 };
    let (mut clock, mut total) = (q(0), q(0));
    run.events(q(0))?;
    for (instance, start, duration) in steps {
        if *start < clock {
            return Err(Obstacle::Blocked("an action starts before the one before it has ended"));
        }
        run.events(*start)?;
        let (action, objects) = &world.instances[*instance];
        let required = match &world.task.actions[*action].body {
            Body::Instantaneous(_) => q(0),
            Body::Durative { duration, .. } => world.value(duration, &run.state, objects)?,
        };
        // Durations are compared exactly, without tolerance.
        if required != *duration || required < q(0) {
            return Err(Obstacle::Blocked("the duration is another, or negative"));
        }
        clock = fit(start + duration)?;
        if required == q(0) {
            run.happening(*instance, End::Both, *start)?;
        } else {
            run.happening(*instance, End::Start, *start)?;
            run.running(*instance, clock)?;
            run.happening(*instance, End::Finish, clock)?;
        }
        total = fit(total + duration)?;
    }
    goal(world, &run.state)?;
    value(world, &run.state, total, steps.len())
}

/// Checks that the goal holds in a state. An undefined goal does not hold.
pub fn goal(world: &World, state: &State) -> Result<(), Obstacle> {
    match world.holds(&world.task.goal, state, &[]) {
        Ok(true) => Ok(()),
        Ok(false) | Err(Obstacle::Blocked(_)) => Err(Obstacle::Blocked("the goal does not hold")),
        Err(Obstacle::TooLarge) => Err(Obstacle::TooLarge),
    }
}

pub fn value(world: &World, state: &State, time: Q, steps: usize) -> Result<Q, Obstacle> {
    match &world.task.measure {
        Measure::Steps => Ok(q(steps as i64)),
        Measure::Time => Ok(time),
        Measure::Metric { time: weight, functions, .. } => {
            let mut sum = fit(*weight * time)?;
            for (weight, function) in functions {
                let value = state.values[world.value_of(*function)]
                    .ok_or(Obstacle::Blocked("the metric is undefined"))?;
                sum = fit(sum + weight * value)?;
            }
            Ok(sum)
        }
    }
}

struct Run<'w> {
    world: &'w World,
    state: State,
    applied: usize,
}

impl Run<'_> {
    fn events(&mut self, until: Q) -> Result<(), Obstacle> {
        while let Some((_, event)) = self.world.events.get(self.applied).filter(|(time, _)| *time <= until) {
            self.state = event.apply(&self.state)?;
            self.applied += 1;
        }
        Ok(())
    }

    fn happening(&mut self, instance: usize, end: End, time: Q) -> Result<(), Obstacle> {
        self.events(time)?;
        let happening = self.world.happening(instance, end, &self.state)?;
        let interferes = self
            .world
            .events
            .iter()
            .any(|(event_time, event)| *event_time == time && event.interferes(&happening));
        if interferes {
            return Err(Obstacle::Blocked("an event at the same time interferes"));
        }
        self.state = happening.apply(&self.state)?;
        Ok(())
    }

    /// Checks the condition over all after the start and after each event before the end.
    fn running(&mut self, instance: usize, end: Q) -> Result<(), Obstacle> {
        let (action, objects) = &self.world.instances[instance];
        let Body::Durative { over_all, .. } = &self.world.task.actions[*action].body else { return Ok(()) };
        loop {
            if !self.world.holds(over_all, &self.state, objects)? {
                return Err(Obstacle::Blocked("a condition over all does not hold"));
            }
            let Some((time, _)) = self.world.events.get(self.applied).filter(|(time, _)| *time < end) else {
                return Ok(());
            };
            self.events(*time)?;
        }
    }
}
