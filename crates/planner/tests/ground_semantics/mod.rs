//! Compares the library with an independent interpreter on random lifted tasks with most language constructs:
//! printing and reading, the validator, and the ground task.

mod generate;
mod ground;
mod interfere;
mod interpret;
mod model;
mod mutate;
mod text;

use proptest::prelude::*;

use generate::{ALL, Draw, PLANNED};

fn bytes() -> impl Strategy<Value = Vec<u8>> {
    prop::collection::vec(any::<u8>(), 0..600)
}

fn check_text(bytes: &[u8]) -> bool {
    let mut draw = Draw::new(bytes, ALL);
    let task = draw.task();
    let trees = text::trees(&task);
    text::check_printing(&trees.0, &trees.1);
    let plan = draw.plan(&task);
    text::check_plan(&task, &trees, &plan)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn printing_is_undone_by_reading_and_plans_are_judged_alike(bytes in bytes()) {
        check_text(&bytes);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    #[ignore = "takes minutes"]
    fn many_are_judged_alike(bytes in bytes()) {
        check_text(&bytes);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_changed_plan_that_the_interpreter_rejects_is_rejected(bytes in bytes()) {
        mutate::check(&mut Draw::new(&bytes, ALL));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 50_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    #[ignore = "takes minutes; in release"]
    fn many_changed_plans_are_judged_alike(bytes in bytes()) {
        mutate::check(&mut Draw::new(&bytes, ALL));
    }
}

fn check_ground(bytes: &[u8]) -> bool {
    let task = Draw::new(bytes, PLANNED).task();
    ground::check(&task, &text::trees(&task)).is_some()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_ground_task_behaves_like_the_lifted_task(bytes in bytes()) {
        check_ground(&bytes);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 50_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    #[ignore = "takes minutes"]
    fn many_ground_tasks_behave_like_the_lifted_tasks(bytes in bytes()) {
        check_ground(&bytes);
    }
}

/// Returns pseudo-random bytes that depend only on the seed (`SplitMix64`).
fn fixed_bytes(seed: u64) -> Vec<u8> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    };
    (0..75).flat_map(|_| next().to_le_bytes()).collect()
}

#[test]
fn generated_tasks_are_not_trivial() {
    let seeds = 0..120;
    let valid = seeds.clone().filter(|seed| check_text(&fixed_bytes(*seed))).count();
    let ground = seeds.filter(|seed| check_ground(&fixed_bytes(*seed))).count();
    assert!(valid > 10 && ground > 60, "{valid} plans are valid, {ground} tasks are ground");
    let counts = (0..120).map(|seed| mutate::check(&mut Draw::new(&fixed_bytes(seed), ALL)));
    let (valid, invalid) = counts.fold((0, 0), |sum, pair| (sum.0 + pair.0, sum.1 + pair.1));
    assert!(valid > 20 && invalid > 100, "{valid} changed plans are valid, {invalid} are not");
}
