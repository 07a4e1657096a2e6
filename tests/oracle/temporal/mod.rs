//! Generator A: everything temporal and logical, one after another and overlapping.

mod best;
mod execute;
mod happening;
mod make;
mod model;
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

#[test]
fn actions_one_after_another() {
    run(2000, |seed| vec![sequential(seed)]).finish();
}
