//! Chaos test: three servers, four workers and a thousand robots, with faults at random times.
//! Every robot must receive the answers that a single local loop gives. The test `figures` measures
//! latencies without faults.
//!
//! Ignored by default, because it needs `nats-server` (2.11 or newer), given by `NATS_SERVER` or
//! found in the search path. Further variables: `SCHEDULES` (20), `SEED` (1), `ROBOTS` (1000),
//! `EVENTS` per robot (100), sent within about `SECONDS` (20). The seed determines the faults,
//! but their timing depends on the machine.

#![expect(clippy::print_stdout, reason = "what was done to whom is said while it is done")]

mod cluster;
#[path = "../local/common.rs"]
mod common;
#[path = "../local/scripts.rs"]
mod scripts;
mod wires;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use futures::StreamExt as _;
use metaplan_fleet::robots::{Sender, status};
use metaplan_fleet::store::nats::{Access, Layout, Nats};
use metaplan_fleet::store::{Message, Store as _, Stored, Stream};
use metaplan_fleet::wire::{Address, Decided, partition_of};
use serde_json::json;
use tokio::sync::mpsc;

use cluster::Cluster;

const PARTITIONS: u32 = 32;
const LEASE: u64 = 2;
const WORKERS: usize = 4;

fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

fn name(robot: usize) -> String {
    format!("robot-{robot}")
}

fn status_event(component: &str, is_lost: bool) -> String {
    let status = if is_lost { "FALSE" } else { "OK" };
    json!({"event": "component_status", "component": component, "status": status}).to_string()
}

/// Mission and events of a robot.
type Script = (&'static str, Vec<String>);

/// Returns scripts with the given number of events: observations of a simulated robot, then failures and recoveries of a
/// component.
fn scripts(count: usize, lines: usize) -> Vec<Script> {
    let script = |number: usize| {
        let scenario = scripts::SCENARIOS[number % scripts::SCENARIOS.len()];
        let mut events = scripts::play(scenario, number as u64, lines);
        let component = if scenario.0 == "ugv" { "c_kinect" } else { "c_thruster_1" };
        let statuses = [true, false].into_iter().cycle().map(|is_lost| status_event(component, is_lost));
        events.extend(statuses.take(lines - events.len()));
        (scenario.0, events)
    };
    (0..count.min(24)).map(script).collect()
}

async fn begin(seed: u64, workers: usize, lease: u64) -> (Cluster, Nats) {
    let cluster = Cluster::begin(seed).await;
    let access = Access { url: cluster.url(), ..Access::default() };
    let fleet = "fleet".to_owned();
    let layout = Layout { fleet, partitions: PARTITIONS, replicas: 3, history: -1, lease };
    let store = match Nats::open(&access, &layout, Duration::from_secs(60)).await {
        Ok(store) => store,
        Err(error) => panic!("the servers do not answer: {}: {}", error.message, cluster.logs()),
    };
    for worker in 0..workers {
        cluster.begin_worker(worker, PARTITIONS, lease);
    }
    (cluster, store)
}

/// Sends the events of all robots, each after a random time of at most `pause` milliseconds. Returns the sequence
/// numbers of the events of each robot, and the times at which they were sent.
async fn send(
    store: &Nats,
    session: &str,
    robots: usize,
    scripts: &[Script],
    pause: u64,
) -> BTreeMap<usize, Vec<(u64, Instant)>> {
    let mut senders = tokio::task::JoinSet::new();
    for robot in 0..robots {
        let mut sender = Sender::new(store.clone(), &name(robot), session);
        let events = scripts[robot % scripts.len()].1.clone();
        senders.spawn(async move {
            let mut sent = Vec::new();
            for event in &events {
                if pause > 0 {
                    tokio::time::sleep(Duration::from_millis(fastrand::u64(0..=pause))).await;
                }
                let begun = Instant::now();
                sent.push((sender.send(event).await.expect("events are short"), begun));
            }
            (robot, sent)
        });
    }
    senders.join_all().await.into_iter().collect()
}

async fn read(store: &Nats, partition: u32) -> Vec<Stored> {
    for _ in 0..60 {
        if let Ok(messages) = common::read(store, Stream::Decisions, partition).await {
            return messages;
        }
        tokio::time::sleep(Duration::from_millis(500)).await;
    }
    panic!("partition {partition} cannot be read");
}

fn has_plan_only(decision: &Stored) -> bool {
    String::from_utf8_lossy(&decision.payload).contains("\"planned\":true")
}

/// Sends an invalid message every 100 ms until `over` is true. Returns the number of messages that
/// were stored.
async fn attack(store: Nats, over: Arc<AtomicBool>, seed: u64) -> u64 {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut count = 0;
    while !over.load(Ordering::Relaxed) {
        let victim = format!("robot-{}", random.u32(0..50));
        let own = Address::of(&victim, PARTITIONS).to_string();
        let elsewhere = format!("{}.{victim}", (partition_of(&victim, PARTITIONS) + 1) % PARTITIONS);
        let long = format!("{{\"event\": \"tick\", \"x\": \"{}\"}}", "a".repeat(900_000));
        let (subject, id, payload) = match random.u8(0..5) {
            0 => (elsewhere, format!("{victim}:x{count}"), "{\"event\": \"retire\"}".to_owned()),
            1 => (own, format!("other:{count}"), "{\"event\": \"retire\"}".to_owned()),
            2 => ("3.stranger".to_owned(), String::new(), long),
            3 => ("3.stranger".to_owned(), String::new(), "\u{0}not JSON".to_owned()),
            _ => {
                let stranger = Address::of("stranger", PARTITIONS).to_string();
                (stranger, String::new(), "{\"event\": \"enrol\", \"mission\": \"../ugv\"}".to_owned())
            }
        };
        let message = Message { subject: &subject, id: &id, after: None, payload: payload.as_bytes() };
        count += u64::from(store.append(Stream::Events, message).await.is_ok());
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    count
}

async fn schedule(seed: u64, robots: usize, lines: usize, scripts: &[Script]) {
    let (cluster, store) = Box::pin(begin(seed, WORKERS, LEASE)).await;
    let over = Arc::new(AtomicBool::new(false));
    let begun = Instant::now();
    let trouble = {
        let (cluster, over) = (cluster.clone(), Arc::clone(&over));
        std::thread::spawn(move || cluster.trouble(seed, &over, PARTITIONS, LEASE))
    };
    let attacker = tokio::spawn(attack(store.clone(), Arc::clone(&over), seed));
    let sent = send(&store, "", robots, scripts, number("SECONDS", 20) * 2000 / lines as u64).await;
    let expected = sent.values().map(Vec::len).sum::<usize>();
    let said = begun.elapsed();
    // From here on no faults are injected, and the remaining events are decided.
    over.store(true, Ordering::Relaxed);
    let what = trouble.join().expect("trouble ends");
    let attacks = attacker.await.expect("attacks end");
    let mut decided = 0;
    let mut is_over = false;
    for _ in 0..900 {
        decided = 0;
        for partition in 0..PARTITIONS {
            let messages = read(&store, partition).await;
            decided += messages.iter().filter(|message| !has_plan_only(message)).count();
        }
        // The event of a decision that lacks its plan is not discarded.
        is_over = decided >= expected && common::has_no_events(&store).await == Ok(true);
        if is_over {
            break;
        }
        tokio::time::sleep(Duration::from_secs(1)).await;
    }
    println!(
        "seed {seed}: {expected} events of {robots} robots said in {:.1} s, decided after {:.1} s; {attacks} attacks; {what}",
        said.as_secs_f64(),
        begun.elapsed().as_secs_f64()
    );
    let status = status(&store).await;
    assert!(is_over && decided == expected, "seed {seed}: {decided} decided; {status:?}; {}", cluster.logs());
    verify(&store, &sent, scripts, seed).await;
}

/// Checks that every robot received the answers of a single local loop to its events, in order and once.
async fn verify(store: &Nats, sent: &BTreeMap<usize, Vec<(u64, Instant)>>, scripts: &[Script], seed: u64) {
    let mut made: BTreeMap<String, Vec<Decided>> = BTreeMap::new();
    for partition in 0..PARTITIONS {
        for message in read(store, partition).await {
            let robot = Address::parse(&message.subject).expect("an address").robot;
            made.entry(robot).or_default().push(Decided::parse(&message.payload).expect("a decision"));
        }
    }
    assert_eq!(made.len(), sent.len(), "seed {seed}");
    for (robot, sent) in sent {
        let sequences: Vec<u64> = sent.iter().map(|(sequence, _)| *sequence).collect();
        let (name, (mission, events)) = (name(*robot), &scripts[robot % scripts.len()]);
        let label = format!("seed {seed}, {name}");
        scripts::assert_replayed(&label, mission, events, &made[&name], &sequences);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs nats-server, and minutes"]
async fn nothing_is_lost_repeated_or_out_of_order() {
    if !cluster::is_possible() {
        return;
    }
    let (robots, lines) = (number("ROBOTS", 1000) as usize, number("EVENTS", 100) as usize);
    let scripts = scripts(robots, lines);
    let first = number("SEED", 1);
    for seed in first..first + number("SCHEDULES", 20) {
        println!("seed {seed} begins");
        Box::pin(schedule(seed, robots, lines, &scripts)).await;
    }
}

/// Measures the latency of decisions if each robot sends an event per second in the mean for `SECONDS`, without faults:
/// 90 % of the events change nothing, 9 % are about the availability of a component, and 1 % change the goal, which
/// requires a search. `WORKERS` is the number of workers (1).
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs nats-server and an idle machine; figures mean something in a release build only"]
async fn figures() {
    if !cluster::is_possible() {
        return;
    }
    let (robots, workers) = (number("ROBOTS", 1000) as usize, number("WORKERS", 1) as usize);
    let script = |seed| {
        let mut random = fastrand::Rng::with_seed(seed);
        let event = move |second: u64| match random.u8(..100) {
            0 => {
                let goal = ["(robot_at wp2)", "(robot_at wp3)"][second as usize % 2];
                json!({"event": "goal_changed", "goal": goal}).to_string()
            }
            1..10 => status_event("c_kinect", second.is_multiple_of(2)),
            _ => json!({"event": "tick"}).to_string(),
        };
        ("ugv", (0..number("SECONDS", 20)).map(event).collect())
    };
    let scripts: Vec<Script> = (0..100).map(script).collect();
    let (cluster, store) = Box::pin(begin(0, workers, 10)).await;
    let enrolment = vec![json!({"event": "enrol", "mission": "ugv"}).to_string()];
    send(&store, "first", robots, &[("ugv", enrolment)], 0).await;
    while common::has_no_events(&store).await != Ok(true) {
        tokio::time::sleep(Duration::from_secs(1)).await;
    }
    let (times, mut arrivals) = mpsc::unbounded_channel();
    for partition in 0..PARTITIONS {
        let end = store.end(Stream::Decisions, partition).await.expect("it can be read");
        let mut decisions = store.follow(Stream::Decisions, partition, end).await.expect("it can be read");
        let times = times.clone();
        tokio::spawn(async move {
            while let Some(Ok(decision)) = decisions.next().await {
                let decided = Decided::parse(&decision.payload).filter(|decided| !decided.planned);
                // The receiver is dropped at the end.
                let _ = decided.map(|decided| times.send((decided.event, Instant::now())));
            }
        });
    }
    let begun = Instant::now();
    let sent = send(&store, "second", robots, &scripts, 2000).await;
    let said = begun.elapsed().as_secs_f64();
    let sent: BTreeMap<u64, Instant> = sent.into_values().flatten().collect();
    let mut late = Vec::new();
    while late.len() < sent.len() {
        let (event, time) = arrivals.recv().await.expect("the log can be read");
        late.extend(sent.get(&event).map(|sent| (time - *sent).as_secs_f64() * 1000.0));
    }
    late.sort_by(f64::total_cmp);
    let memory = |kind: &str, count: usize| {
        (0..count).map(|number| cluster.memory(&format!("{kind}{number}"))).max().unwrap_or_default()
    };
    println!(
        "{workers} workers, {robots} robots: {} events said at {:.0}/s, decided at {:.0}/s; median {:.1} ms, 99 percent {:.1} ms, longest {:.1} ms; memory {} MB each, servers {} MB",
        sent.len(),
        sent.len() as f64 / said,
        sent.len() as f64 / begun.elapsed().as_secs_f64(),
        late[late.len() / 2],
        late[late.len() * 99 / 100],
        late[late.len() - 1],
        memory("w", workers),
        memory("s", 3),
    );
}
