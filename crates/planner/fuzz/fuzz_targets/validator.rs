//! Fuzz target: generates tasks and plans. The validator must agree with a naive interpreter on sequential
//! plans. Arbitrary plan text must be validated or rejected.

#![no_main]

#[allow(dead_code, reason = "shared with a test and another target")]
#[path = "../../tests/ground_semantics/generate.rs"]
mod generate;
#[path = "../../tests/ground_semantics/interfere.rs"]
mod interfere;
#[allow(dead_code, reason = "shared with a test and another target")]
#[path = "../../tests/ground_semantics/interpret.rs"]
mod interpret;
#[allow(dead_code, reason = "shared with a test and another target")]
#[path = "../../tests/ground_semantics/model.rs"]
mod model;
#[allow(dead_code, reason = "shared with a test and another target")]
#[path = "../../tests/ground_semantics/text.rs"]
mod text;

use libfuzzer_sys::fuzz_target;
use pddl::Source;
use pddl::validate::{Options, PlanText, validate};

fuzz_target!(|bytes: &[u8]| {
    let mut draw = generate::Draw::new(bytes, generate::ALL);
    let task = draw.task();
    let trees = text::trees(&task);
    let plan = draw.plan(&task);
    text::check_plan(&task, &trees, &plan);

    let mut lines = String::new();
    for _ in 0..draw.below(8) {
        let step =
            (draw.below(30), draw.below(3), draw.below(3), draw.below(3), draw.below(20), draw.below(5));
        let (time, action, first, second, duration, form) = step;
        let object = |object: usize| model::OBJECTS[object].0;
        let objects = [object(first), object(second)][..(form % 3)].join(" ");
        lines += &format!("{}.{}: (a{action} {objects})", time / 4, time % 4);
        lines += &if form > 1 { format!(" [{}.5]\n", duration / 3) } else { "\n".to_owned() };
    }
    let Ok(plan) = PlanText::parse(&Source::new("plan", lines)) else { return };
    for concurrent in [false, true] {
        validate(&trees.0, &trees.1, &plan, &Options::default().with_concurrent(concurrent));
    }
});
