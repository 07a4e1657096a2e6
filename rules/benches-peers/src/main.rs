//! Comparison of the engine with its peers, in one run: transitive closure from scratch, and single updates
//! of a status cascade.
//!
//! `cargo run --release` prints a table. Times are medians on one thread. Times from scratch are processor time
//! (Linux). The engine also records a derivation of every derived fact; no peer does.

mod closure;
mod updates;

use std::time::Duration;

pub struct Random(pub u64);

impl Random {
    pub fn below(&mut self, bound: u64) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % bound) as u32
    }
}

pub fn median(mut times: Vec<Duration>) -> Duration {
    times.sort_unstable();
    times[times.len() / 2]
}

/// Processor time of this thread, which excludes other load on the machine.
fn processor_time() -> Duration {
    let statistics = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux");
    let nanoseconds = statistics.split(' ').next().and_then(|field| field.parse().ok());
    Duration::from_nanos(nanoseconds.expect("nanoseconds on the processor"))
}

fn resident() -> String {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux");
    status
        .lines()
        .filter(|line| line.starts_with("VmRSS") || line.starts_with("VmHWM"))
        .collect::<Vec<_>>()
        .join(", ")
}

fn main() {
    let knowledge_base = updates::build(333_334);
    let memory = resident();
    println!("{} facts, {memory}", knowledge_base.facts().count());
    drop(knowledge_base);
    let edges = closure::edges();
    println!("transitive closure from scratch, {} edges", edges.len());
    let mut first = None;
    for (name, run) in closure::PEERS {
        let mut paths = 0;
        let times = (0..5).map(|_| {
            let start = processor_time();
            paths = run(&edges);
            processor_time() - start
        });
        let time = median(times.collect()).as_secs_f64();
        let ours = *first.get_or_insert(time);
        println!("{name:24} {paths:9} paths {:9.1} ms  ratio {:.2}", time * 1e3, time / ours);
    }
    for designs in [100, 10_000, 100_000] {
        println!("a component fails or recovers, {designs} designs");
        let ours = updates::engine(designs).as_secs_f64();
        let theirs = updates::differential(designs).as_secs_f64();
        for (name, time) in [("metaplan-rules", ours), ("differential-dataflow", theirs)] {
            println!("{name:24} {:9.1} us  ratio {:.2}", time * 1e6, time / ours);
        }
    }
}
