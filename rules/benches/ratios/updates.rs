//! Failure and recovery of a component, in a small and in a large knowledge base.

use std::time::Instant;

use metaplan_rules::{Delta, Engine, Fact, Literal};

use super::{median, worklist};

const ROUNDS: usize = 2000;

/// Median time of one update in seconds, number of changed facts, and number of stated facts.
fn update(designs: u64) -> (f64, usize, usize) {
    let (mut symbols, program, facts) = worklist::knowledge_base(designs);
    let (stated, failed) = (facts.len(), symbols.literal(Literal::string("FALSE")));
    let status = symbols.name("http://metacontrol.org/tomasys#c_status");
    let status = Fact::new(status, [symbols.name("c3"), failed]);
    let mut engine = Engine::new(symbols, program, facts).expect("safe rules");
    let (mut times, mut changed) = (Vec::new(), 0);
    for round in 0..ROUNDS {
        let (mut insert, mut delete) = (Vec::new(), Vec::new());
        if round % 2 == 0 { &mut insert } else { &mut delete }.push(status.clone());
        let start = Instant::now();
        let change = engine.apply(Delta { insert, delete }).expect("no budget needed");
        times.push(start.elapsed().as_secs_f64());
        changed = change.insert.len() + change.delete.len();
    }
    (median(times), changed, stated)
}

pub(crate) fn compare() {
    let ((small, changed, small_size), (large, large_changed, large_size)) = (update(70), update(72_000));
    assert_eq!(changed, large_changed);
    println!("a component fails or recovers, {changed} facts change");
    let ratio = large / small;
    println!(
        "  {small_size} facts {:.1} us, {large_size} facts {:.1} us, ratio {ratio:.2}",
        small * 1e6,
        large * 1e6
    );
}
