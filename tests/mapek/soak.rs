//! Long-running tests and benchmarks: `cargo test --release --test mapek -- --ignored --nocapture`.

#![expect(clippy::print_stdout, reason = "figures are what these tests are for")]

use std::io::Write as _;
use std::time::{Duration, Instant};

use metaplan::journal::{Journal, Policy, Sync};
use metaplan::mapek::{Answer, Loop};

use crate::common::{control, feed};
use crate::fuzz::{Fuzz, WORLDS, step};

/// Default length of the soak test in seconds. `METAPLAN_SOAK_SECONDS` overrides it.
const SOAK_SECONDS: u64 = 3600;

/// Number of events between two comparisons with a recomputed knowledge base. At 1, the comparisons would
/// take most of the time.
const COMPARE_EVERY: usize = 3;

/// Returns the resident memory of this process in kilobytes; `None` without `/proc`.
pub fn resident() -> Option<usize> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// Returns the processor time of this process; `None` without `/proc`.
pub fn processor_time() -> Option<Duration> {
    let status = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The fields after the name in parentheses contain user and system time in hundredths of a second.
    let fields: Vec<&str> = status.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks: u64 = fields.get(11)?.parse::<u64>().ok()? + fields.get(12)?.parse::<u64>().ok()?;
    Some(Duration::from_millis(ticks * 10))
}

#[test]
#[ignore = "takes an hour"]
fn invariants_hold_for_an_hour_of_random_events() {
    let seconds = std::env::var("METAPLAN_SOAK_SECONDS").ok().and_then(|text| text.parse().ok());
    let length = Duration::from_secs(seconds.unwrap_or(SOAK_SECONDS));
    let start = Instant::now();
    let mut loops: Vec<_> = WORLDS
        .iter()
        .map(|world| {
            let mut fuzz = Fuzz::new(world, 7);
            fuzz.compare_every = COMPARE_EVERY;
            (fuzz.begin(), fuzz)
        })
        .collect();
    let (mut number, mut memory, mut reported) = (0, Vec::new(), Duration::ZERO);
    while start.elapsed() < length {
        for (control, fuzz) in &mut loops {
            step(control, fuzz, number);
        }
        number += 1;
        if start.elapsed() >= reported {
            reported += length / 60;
            memory.extend(resident());
            // A closed pipe or a full disk must not end the test.
            let _ = writeln!(
                std::io::stdout(),
                "{:>5} s: {} events, {} comparisons from scratch, {:?} kB",
                start.elapsed().as_secs(),
                2 * number,
                2 * number.div_ceil(COMPARE_EVERY),
                memory.last()
            );
        }
    }
    // The caches are full after a tenth of the time.
    let tenth = memory.len() / 10;
    if let (Some(early), Some(late)) = (memory[tenth..].iter().take(12).max(), memory.last()) {
        assert!(*late <= early + early / 5, "memory has grown from {early} to {late} kB");
    }
}

#[test]
#[ignore = "measures; only a release build is of interest"]
fn reaction_times() {
    for world in &WORLDS {
        let mut fuzz = Fuzz::new(world, 1);
        let mut control = fuzz.begin();
        let mut times: Vec<Duration> = Vec::new();
        let mut adaptations: Vec<Duration> = Vec::new();
        for _ in 0..10_000 {
            let (line, _) = fuzz.next(&control);
            let start = Instant::now();
            let answers = feed(&mut control, &line);
            let text: String = answers.iter().map(|answer| answer.to_json().to_string()).collect();
            let time = start.elapsed();
            let _ = control.decision(&answers);
            times.push(time);
            if text.contains("plan_requested") {
                adaptations.push(time);
            }
        }
        report(world.mission, "all events", &mut times);
        report(world.mission, "events that led to planning", &mut adaptations);
        let limit = |share: usize| times[times.len() * share / 100];
        assert!(limit(50) < Duration::from_millis(5), "median");
        assert!(limit(99) < Duration::from_millis(20), "p99");
    }
}

struct Rate {
    subject: &'static str,
    reports: [&'static str; 2],
    before: &'static [&'static str],
    /// Minimum number of lines per second of processor time, without and with a journal.
    least: [u64; 2],
}

/// Lines after which no planning is necessary.
const DONE: &[&str] =
    &[r#"{"event":"goal_changed","goal":"(robot_at wp1)"}"#, r#"{"event":"action_cancelled","action":1}"#];

const RATES: [Rate; 6] = [
    Rate {
        subject: "what the plan does without fails and recovers",
        reports: [CAMERA_FAILS, CAMERA_WORKS],
        before: &[],
        least: [5_000, 2_500],
    },
    Rate {
        subject: "what the plan uses fails and recovers",
        reports: [KINECT_FAILS, KINECT_WORKS],
        before: &[],
        least: [1_000, 500],
    },
    Rate {
        subject: "measurements that change nothing",
        reports: [DIM, DIMMER],
        before: &[],
        least: [20_000, 10_000],
    },
    Rate {
        subject: "measurements across a bound of the plan",
        reports: [DIM, BRIGHT],
        before: &[],
        least: [1_000, 500],
    },
    Rate {
        subject: "measurements across a bound, without a plan",
        reports: [DIM, BRIGHT],
        before: DONE,
        least: [20_000, 10_000],
    },
    Rate {
        subject: "a component fails and recovers, without a plan",
        reports: [KINECT_FAILS, KINECT_WORKS],
        before: DONE,
        least: [20_000, 10_000],
    },
];

const CAMERA_FAILS: &str = r#"{"event":"component_status","component":"c_camera","status":"FALSE"}"#;
const CAMERA_WORKS: &str = r#"{"event":"component_status","component":"c_camera","status":"TRUE"}"#;
const KINECT_FAILS: &str = r#"{"event":"component_status","component":"c_kinect","status":"FALSE"}"#;
const KINECT_WORKS: &str = r#"{"event":"component_status","component":"c_kinect","status":"TRUE"}"#;
const DIM: &str = r#"{"event":"measured","attribute":"ambient_light","value":0.5}"#;
const DIMMER: &str = r#"{"event":"measured","attribute":"ambient_light","value":0.45}"#;
const BRIGHT: &str = r#"{"event":"measured","attribute":"ambient_light","value":0.95}"#;

#[test]
#[ignore = "measures; only a release build is of interest"]
fn lines_a_second() {
    let pristine = control("ugv");
    // `METAPLAN_RATE` selects rows, for example for a profile.
    let subject = std::env::var("METAPLAN_RATE").unwrap_or_default();
    for rate in RATES.iter().filter(|rate| rate.subject.contains(&subject)) {
        for (place, with_journal) in [false, true].into_iter().enumerate() {
            let rate_measured = rate.measure(&pristine, with_journal);
            println!("{}, journal: {with_journal}: {rate_measured} a second of one core", rate.subject);
            assert!(rate_measured >= rate.least[place], "{}: {rate_measured}", rate.subject);
        }
    }
}

impl Rate {
    /// Returns the number of lines per second of processor time of one core, including serialisation of the
    /// answers.
    fn measure(&self, pristine: &Loop, with_journal: bool) -> u64 {
        let lines = 10_000;
        let mut control = pristine.clone();
        let directory = tempfile::tempdir().expect("a directory");
        let mut journal = with_journal.then(|| {
            let policy = Policy { sync: Sync::Effects, snapshot_every: 1000 };
            Journal::open(directory.path(), policy, &mut control).expect("it opens").0
        });
        let first = match &mut journal {
            Some(journal) => journal.begin(&mut control).expect("written"),
            None => control.start(),
        };
        assert!(!first.is_empty());
        let mut handle = |line: &str, now: Duration| {
            let answers = match &mut journal {
                Some(journal) => journal.handle(&mut control, line, now).expect("written"),
                None => feed(&mut control, line),
            };
            assert!(!answers.iter().any(|answer| matches!(answer, Answer::Error { .. })));
            answers.iter().map(|answer| answer.to_json().to_string().len()).sum::<usize>()
        };
        for line in self.before {
            handle(line, Duration::ZERO);
        }
        let (start, before) = (Instant::now(), processor_time());
        for number in 0..lines {
            std::hint::black_box(handle(self.reports[number % 2], start.elapsed()));
        }
        let elapsed =
            before.zip(processor_time()).map_or(start.elapsed(), |(before, now)| now.saturating_sub(before));
        (lines as f64 / elapsed.as_secs_f64()) as u64
    }
}

fn report(mission: &str, subject: &str, times: &mut [Duration]) {
    times.sort_unstable();
    let at = |share: usize| times[(times.len() - 1) * share / 1000];
    println!(
        "{mission}, {subject}: {} of them, median {:?}, p90 {:?}, p99 {:?}, p99.9 {:?}, most {:?}",
        times.len(),
        at(500),
        at(900),
        at(990),
        at(999),
        at(1000)
    );
}
