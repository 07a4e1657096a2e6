//! The master test: random programs under random scripts of changes, against naive evaluation from scratch.

mod oracle;
mod script;

use proptest::prelude::*;
use script::{RawChange, RawRule, check};

fn case() -> impl Strategy<Value = (Vec<RawRule>, Vec<RawChange>, Vec<Vec<RawChange>>)> {
    let atom = (any::<u8>(), any::<u8>(), any::<[u8; 3]>());
    let heads = prop::collection::vec((any::<u8>(), any::<[u8; 3]>()), 1..3);
    let rule = (heads, prop::collection::vec(atom, 1..5));
    let change = || (any::<bool>(), any::<u8>(), any::<[u8; 3]>());
    let start = prop::collection::vec(change(), 0..12);
    let step = prop::collection::vec(change(), 1..4);
    (prop::collection::vec(rule, 1..7), start, prop::collection::vec(step, 1..20))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]
    #[test]
    fn incremental_is_from_scratch((rules, start, script) in case()) {
        check(&rules, &start, &script);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200_000, ..ProptestConfig::default() })]
    #[test]
    #[ignore = "minutes long; run with --release"]
    fn incremental_is_from_scratch_at_length((rules, start, script) in case()) {
        check(&rules, &start, &script);
    }
}
