//! Measures the engine in one run, mostly as ratios:
//! - TOMASys rules from scratch, against a worklist written by hand for these rules;
//! - transitive closure from scratch, in derived paths per second;
//! - single updates of a large knowledge base, against those of a small one;
//! - equality by representatives, against equality by rules.
//!
//! Times from scratch are processor time of the thread (Linux), so that other load on the machine has little
//! influence. Times of updates and of equality are wall-clock times.

#![allow(clippy::print_stdout, reason = "a program whose result is what it prints")]

mod equality;
mod updates;
mod worklist;

use std::time::Duration;

use metaplan_rules::{Engine, Fact, Prefixes, Program, Symbols, parse_rules};

pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % bound
    }
}

pub(crate) type Task = (Symbols, Program, Vec<Fact>);

pub(crate) fn processor_time() -> Duration {
    let statistics = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux");
    let nanoseconds = statistics.split(' ').next().and_then(|field| field.parse().ok());
    Duration::from_nanos(nanoseconds.expect("nanoseconds on the processor"))
}

pub(crate) fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Processor time of a function in seconds, and its result.
pub(crate) fn timed<T>(run: impl FnOnce() -> T) -> (f64, T) {
    let start = processor_time();
    let result = run();
    (processor_time().as_secs_f64() - start.as_secs_f64(), result)
}

fn closure() -> Task {
    let mut symbols = Symbols::new();
    let rules = "edge(?x, ?y) -> path(?x, ?y) path(?x, ?y) ^ edge(?y, ?z) -> path(?x, ?z)";
    let program = parse_rules(rules, "closure", &mut symbols, &Prefixes::new()).expect("rules");
    let (edge, mut random) = (symbols.name("edge"), Random(1));
    let mut node = || symbols.name(&format!("n{}", random.below(1000)));
    let edges = (0..5000).map(|_| Fact::new(edge, [node(), node()])).collect();
    (symbols, program, edges)
}

fn main() {
    let designs = 72_000;
    let task = worklist::knowledge_base(designs);
    let (mut ours, mut theirs, mut derived) = (Vec::new(), Vec::new(), 0);
    for _ in 0..5 {
        let (symbols, program, facts) = task.clone();
        let stated = facts.len();
        let (time, engine) = timed(|| Engine::new(symbols, program, facts).expect("safe rules"));
        ours.push(time);
        derived = engine.facts().count() - stated;
        let (time, count) = timed(|| worklist::run(&task.0, &task.2));
        theirs.push(time);
        assert_eq!(count, derived, "the worklist derives the same");
    }
    let (ours, theirs) = (median(ours), median(theirs));
    println!("TOMASys from scratch: {} facts stated, {derived} derived", task.2.len());
    println!("  engine {:.0} ms, worklist {:.0} ms, ratio {:.2}", ours * 1e3, theirs * 1e3, ours / theirs);

    let (mut times, mut paths) = (Vec::new(), 0);
    for _ in 0..5 {
        let (symbols, program, facts) = closure();
        let (time, engine) = timed(|| Engine::new(symbols, program, facts).expect("safe rules"));
        times.push(time);
        paths = engine.facts().filter(|fact| !engine.is_asserted(fact)).count();
    }
    let rate = paths as f64 / median(times) / 1e6;
    println!("transitive closure from scratch: {paths} paths, {rate:.2} million a second");

    updates::compare();
    equality::compare();
}
