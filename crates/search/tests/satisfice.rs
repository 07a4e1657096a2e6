//! Checks of the sequence of satisficing searches against exhaustive search: every plan is executable, has the
//! reported cost, and costs at least the optimum; unsolvable tasks, and no others, are reported as unsolvable.

use metaplan_search::satisfice::{Satisficer, StepResult};
use task::context::Context;
use task::limits::Limits;
use task::plan::ground::replay;
use task::thresholds::Thresholds;
use testing::missions::Mission;
use testing::{depot, fleet, ground_text, optimum};

/// Number of work units of a turn. A turn may end in the middle of a search.
const TURN: u64 = 20_000;
const TURNS: usize = 2_000;

#[derive(Default)]
struct Counts {
    unsolvable: usize,
    /// Number of tasks with at least two plans.
    improved: usize,
    optimal: usize,
}

fn check(text: &(String, String), thresholds: Thresholds, counts: &mut Counts) {
    let task = ground_text(text.clone());
    if task.unreachable.is_some() {
        return;
    }
    let limits = Limits::none().with_thresholds(thresholds);
    let least = optimum(&task);
    let satisficer = Satisficer::new(Context::new(&task, &limits)).expect("no limit");
    let Some(mut satisficer) = satisficer else { return };
    let (mut best, mut plans) = (None, 0);
    for _ in 0..TURNS {
        match satisficer.run(best.as_ref(), TURN).expect("no limit") {
            StepResult::Plan(plan) => {
                let executed = replay(&task, &plan.steps).map(|(_, cost)| cost);
                assert_eq!(executed, Some(plan.cost), "not a plan of this cost: {plan:?}: {text:?}");
                assert!(best.is_none_or(|best| plan.cost < best), "{plan:?} after {best:?}: {text:?}");
                assert!(least.is_some_and(|least| plan.cost >= least), "{plan:?}: {text:?}");
                best = Some(plan.cost);
                plans += 1;
            }
            StepResult::Unsolvable => {
                assert_eq!(least, None, "reported as unsolvable: {text:?}");
                counts.unsolvable += 1;
                return;
            }
            StepResult::Paused => {}
            StepResult::Ended => break,
        }
    }
    counts.improved += usize::from(plans > 1);
    counts.optimal += usize::from(best.is_some() && best == least);
}

#[test]
fn plans_are_executable_and_only_unsolvable_tasks_are_reported_as_unsolvable() {
    let mission = |seed| {
        let mission = Mission::random(seed);
        (mission.domain(), mission.problem())
    };
    let texts = (0..40).map(fleet).chain((0..40).map(depot)).chain((0..80).map(mission));
    let mut counts = Counts::default();
    for text in texts {
        check(&text, Thresholds::default(), &mut counts);
        check(&text, Thresholds::NONE, &mut counts);
    }
    let Counts { unsolvable, improved, optimal } = counts;
    assert!(
        unsolvable > 4 && improved > 4 && optimal > 40,
        "{unsolvable} unsolvable, {improved} improved, {optimal} optimal"
    );
}
