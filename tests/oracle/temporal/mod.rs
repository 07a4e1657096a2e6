//! Generator A: everything temporal and logical, one after another and overlapping.

mod best;
mod execute;
mod graph;
mod happening;
mod make;
mod model;
mod overlap;
mod reduce;
mod sequence;

use std::rc::Rc;
use std::time::Duration;

use num_rational::BigRational;
use num_traits::ToPrimitive as _;

use crate::judge::{Case, Mode, Step, run};
use happening::{Obstacle, World};
use make::Maker;
use model::{Measure, Q, big};

/// How many nodes the oracle visits before it gives up.
const CAP: usize = 400;
const OVERLAP_CAP: usize = 1000;

/// The oracle's terms for a plan.
fn known(world: &World, steps: &[Step]) -> Result<Vec<(usize, Q, Q)>, String> {
    let small = |number: &BigRational| {
        let (numerator, denominator) = (number.numer().to_i64(), number.denom().to_i64());
        let number = Q::new(numerator.ok_or("too large")?, denominator.ok_or("too large")?);
        happening::fit(number).map_err(|_| "too large".to_owned())
    };
    let step = |step: &Step| {
        let named = |(action, objects): &&(usize, Vec<usize>)| {
            let objects: Vec<_> = objects.iter().map(|object| format!("o{object}")).collect();
            world.task.actions[*action].name == step.action && objects == step.arguments
        };
        let instance = world.instances.iter().position(|instance| named(&instance));
        let instance = instance.ok_or_else(|| format!("no action ({} {:?})", step.action, step.arguments))?;
        Ok((instance, small(&step.start)?, small(&step.duration)?))
    };
    steps.iter().map(step).collect()
}

fn obstacle(obstacle: Obstacle) -> String {
    match obstacle {
        Obstacle::Blocked(reason) => reason.to_owned(),
        Obstacle::TooLarge => "too large".to_owned(),
    }
}

fn sequential(seed: u64) -> Case {
    let task = Maker::make(seed, None);
    let (domain, problem) = (task.domain(), task.problem());
    let maximize = matches!(task.measure, Measure::Metric { maximize: true, .. });
    let world = Rc::new(World::new(task));
    let truth = best::best(&world, CAP);
    Case {
        name: format!("temporal-{seed}"),
        domain,
        problem,
        mode: Mode::Sequential,
        maximize,
        truth,
        execute: Box::new(move |steps| {
            execute::execute(&world, &known(&world, steps)?).map(big).map_err(obstacle)
        }),
        certify: true,
        limit: Duration::from_secs(2),
    }
}

/// A task whose times are multiples of the separation.
fn concurrent(seed: u64) -> Case {
    let units = [Q::from_integer(1), Q::from_integer(1), Q::new(1, 1000), Q::new(1, 2), Q::from_integer(2)];
    let unit = units[(seed % 5) as usize];
    let task = Maker::make(seed, Some(unit));
    let (domain, problem) = (task.domain(), task.problem());
    let world = Rc::new(World::new(task));
    let truth = overlap::best(&world, unit, OVERLAP_CAP);
    Case {
        name: format!("overlap-{seed}"),
        domain,
        problem,
        mode: Mode::Concurrent(big(unit)),
        maximize: false,
        truth,
        execute: Box::new(move |steps| {
            overlap::execute(&world, &known(&world, steps)?, unit).map(big).map_err(obstacle)
        }),
        certify: false,
        limit: Duration::from_secs(2),
    }
}

#[test]
fn overlapping_actions() {
    run(2000, |seed| vec![concurrent(seed)]).finish();
}

#[test]
fn actions_one_after_another() {
    run(2000, |seed| vec![sequential(seed)]).finish();
}
