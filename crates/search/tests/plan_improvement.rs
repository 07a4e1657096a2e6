//! Checks of the improvement of plans by segments against the definition of a plan and explicit optima.

use metaplan_search::satisfice::Satisficer;
use task::context::Context;
use task::limits::Limits;
use task::plan::ground::{GroundPlan, GroundStep, cost, replay};
use task::task::{OperatorId, Task};
use testing::missions::Mission;
use testing::random::Random;
use testing::{depot, fleet, ground_text, optimum};

/// Work units for all improvements of one plan.
const WORK: u64 = 20_000_000;

fn random_plan(task: &Task, random: &mut Random) -> Option<GroundPlan> {
    let (mut state, mut steps) = (task.initial.clone(), Vec::new());
    while !task.is_goal(&state) {
        let ids = OperatorId::all(task.operators.len());
        let candidates = ids.flat_map(|operator| {
            let choices = task.operators[operator.index()].admitted_combinations();
            choices.map(move |choice| GroundStep { operator, choice })
        });
        let mut candidates: Vec<GroundStep> = candidates
            .filter(|step| task.operators[step.operator.index()].applicable(&state, &step.choice))
            .collect();
        if candidates.is_empty() || steps.len() > 200 {
            return None;
        }
        let step = candidates.swap_remove(random.below(candidates.len() as u64) as usize);
        state = task.successor(&task.operators[step.operator.index()], &state, &step.choice)?;
        steps.push(step);
    }
    let cost = cost(task, &steps)?;
    Some(GroundPlan { steps, cost })
}

/// Improves plans of random walks. Returns the number of plans that became cheaper, and the number
/// of plans that are optimal afterwards.
fn improve(text: &(String, String), seed: u64) -> (usize, usize) {
    let task = ground_text(text.clone());
    if task.unreachable.is_some() {
        return (0, 0);
    }
    let limits = Limits::none();
    let mut random = Random(seed);
    let (mut cheaper, mut optimal) = (0, 0);
    let Some(least) = optimum(&task) else { return (0, 0) };
    for plan in (0..4).filter_map(|_| random_plan(&task, &mut random)) {
        let satisficer = Satisficer::new(Context::new(&task, &limits)).expect("no limit");
        let Some(mut satisficer) = satisficer else { continue };
        let (first, mut best) = (plan.cost, plan);
        let mut work = WORK;
        while let Some(better) = satisficer.improve(&best, &mut work).expect("no limit") {
            let executed = replay(&task, &better.steps).map(|(_, cost)| cost);
            assert_eq!(executed, Some(better.cost), "not a plan of this cost: {better:?}: {text:?}");
            assert!(better.cost < best.cost && better.cost >= least, "{better:?} after {best:?}: {text:?}");
            best = better;
        }
        cheaper += usize::from(best.cost < first);
        optimal += usize::from(best.cost == least);
    }
    (cheaper, optimal)
}

fn improve_all(texts: impl Iterator<Item = (String, String)>) -> (usize, usize) {
    let counts = texts.zip(0..).map(|(text, seed)| improve(&text, seed));
    counts.fold((0, 0), |sum, count| (sum.0 + count.0, sum.1 + count.1))
}

#[test]
fn improved_plans_are_executable_and_cheaper() {
    // Derived variables, conditional effects, disjunctions and numbers; deliveries; designs and numbers.
    let mission = |seed| {
        let mission = Mission::random(seed);
        (mission.domain(), mission.problem())
    };
    let results = [
        ("fleet", improve_all((0..15).map(fleet))),
        ("depot", improve_all((0..15).map(depot))),
        ("mission", improve_all((0..60).map(mission))),
    ];
    for (name, (cheaper, optimal)) in results {
        assert!(cheaper >= 5 && optimal >= 5, "{name}: {cheaper} cheaper plans, {optimal} optimal plans");
    }
}

/// The plan claims a cost of 0, so no segment can be replaced.
#[test]
fn segments_that_cannot_be_replaced_are_not_searched_forever() {
    let task = ground_text(depot(0));
    let limits = Limits::none();
    let plan = random_plan(&task, &mut Random(1)).expect("a plan");
    let plan = GroundPlan { cost: 0, ..plan };
    let mut satisficer =
        Satisficer::new(Context::new(&task, &limits)).expect("no limit").expect("few designs");
    assert_eq!(satisficer.improve(&plan, &mut (10 * WORK)), Ok(None));
    assert!(!satisficer.can_improve(), "the search has not ended");
}
