//! Samples with object fluents (functions whose values are objects), from the planner's own tests.

#[path = "../../../crates/planner/tests/object_fluents/generate.rs"]
mod generate;
#[path = "../../../crates/planner/tests/object_fluents/model.rs"]
#[allow(dead_code, reason = "the planner's own tests ask more of it")]
mod model;

use super::{Reference, Sample, of_texts, whole};
use generate::Generator;
use testing::random::Random;

pub fn sample(seed: u64) -> Sample {
    let task = Generator(Random(seed)).task();
    let reference = Reference::UpTo(model::REACH.into(), task.best().map(|cost| whole(cost.into())));
    of_texts(&task.domain(), &task.problem(), false, reference)
}
