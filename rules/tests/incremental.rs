//! Master test: random programs under random scripts of changes, compared with naive evaluation from
//! scratch.

use std::ops::Range;

use crate::script::{RawChange, RawRule, check};
use proptest::prelude::*;

fn scripts() -> u32 {
    std::env::var("METAPLAN_SCRIPTS").ok().and_then(|number| number.parse().ok()).unwrap_or(100_000)
}

fn case(steps: Range<usize>) -> impl Strategy<Value = (Vec<RawRule>, Vec<RawChange>, Vec<Vec<RawChange>>)> {
    let atom = (any::<u8>(), any::<u8>(), any::<[u8; 3]>());
    let heads = prop::collection::vec((any::<u8>(), any::<[u8; 3]>()), 1..3);
    let rule = (heads, prop::collection::vec(atom, 1..5));
    let change = || (any::<bool>(), any::<u8>(), any::<[u8; 3]>());
    let start = prop::collection::vec(change(), 0..12);
    let step = prop::collection::vec(change(), 1..4);
    (prop::collection::vec(rule, 1..7), start, prop::collection::vec(step, steps))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]
    #[test]
    fn incremental_equals_from_scratch((rules, start, script) in case(1..20), equality in 0..4_u8) {
        check(&rules, &start, &script, equality == 0);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: scripts(), ..ProptestConfig::default() })]
    #[test]
    #[ignore = "minutes long; run with --release; METAPLAN_SCRIPTS is their number, 100,000 by default"]
    fn long_scripts_equal_from_scratch((rules, start, script) in case(50..60), equality in 0..4_u8) {
        check(&rules, &start, &script, equality == 0);
    }
}
