//! Samples with preferences and constraints of PDDL 3 in sequential plans, from the planner's own tests.

#[path = "../../../crates/planner/tests/preferences/generate.rs"]
mod generate;
#[path = "../../../crates/planner/tests/preferences/model.rs"]
#[allow(dead_code, reason = "the planner's own tests ask more of it")]
mod model;

use super::{Reference, Sample, of_texts, whole};
use generate::Generator;
use testing::random::Random;

pub fn sample(seed: u64) -> Sample {
    let task = Generator(Random(seed)).task();
    let reference = Reference::Some(task.best().map(whole));
    of_texts(&task.domain(), &task.problem(), task.maximize, reference)
}
