//! Chaos test: three servers, four workers and a thousand robots, with faults at random times.
//! Every robot must receive the answers that a single local loop gives. The test `figures` measures
//! rates and times without faults.
//!
//! Ignored by default, because it needs `nats-server` (2.11 or newer), given by `NATS_SERVER` or
//! found in the search path. Further variables: `SCHEDULES` (20), `SEED` (1), `ROBOTS` (1000),
//! `EVENTS` per robot (100; 20 in `figures`), sent within about `SECONDS` (20). The seed determines the faults,
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

use metaplan_fleet::robots::{Sender, status};
use metaplan_fleet::store::nats::{Access, Layout, Nats};
use metaplan_fleet::store::{Message, Store as _, Stored, Stream};
use metaplan_fleet::wire::{Address, Decided, partition_of};
use serde_json::json;

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
    let cluster = Cluster::begin(seed);
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
/// numbers of the events of each robot.
async fn send(store: &Nats, robots: usize, scripts: &[Script], pause: u64) -> BTreeMap<usize, Vec<u64>> {
    let mut senders = tokio::task::JoinSet::new();
    for robot in 0..robots {
        let mut sender = Sender::new(store.clone(), &name(robot), "");
        let events = scripts[robot % scripts.len()].1.clone();
        senders.spawn(async move {
            let mut sequences = Vec::new();
            for event in &events {
                if pause > 0 {
                    tokio::time::sleep(Duration::from_millis(fastrand::u64(0..=pause))).await;
                }
                sequences.push(sender.send(event).await.expect("events are short"));
            }
            (robot, sequences)
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
    let sequences = send(&store, robots, scripts, number("SECONDS", 20) * 2000 / lines as u64).await;
    let expected = sequences.values().map(Vec::len).sum::<usize>();
    let said = begun.elapsed();
    // From here on no faults are injected, and the remaining events are decided.
    over.store(true, Ordering::Relaxed);
    let what = trouble.join().expect("trouble ends");
    let attacks = attacker.await.expect("attacks end");
    let mut decided = 0;
    for _ in 0..900 {
        decided = 0;
        for partition in 0..PARTITIONS {
            let messages = read(&store, partition).await;
            decided += messages.iter().filter(|message| !has_plan_only(message)).count();
        }
        // The event of a decision that lacks its plan is not discarded.
        if decided >= expected && store.count(Stream::Events).await == Ok(0) {
            break;
        }
        tokio::time::sleep(Duration::from_secs(1)).await;
    }
    println!(
        "seed {seed}: {expected} events of {robots} robots said in {:.1} s, decided after {:.1} s; {attacks} attacks; {what}",
        said.as_secs_f64(),
        begun.elapsed().as_secs_f64()
    );
    if decided < expected {
        println!("{:?}", status(&store).await);
    }
    assert_eq!(decided, expected, "seed {seed}: {}", cluster.logs());
    verify(&store, &sequences, scripts, seed).await;
}

/// Checks that every robot received the answers of a single local loop to its events, which have these sequence
/// numbers, in order and once, and that handled events are discarded.
async fn verify(store: &Nats, sequences: &BTreeMap<usize, Vec<u64>>, scripts: &[Script], seed: u64) {
    let mut made: BTreeMap<String, Vec<Decided>> = BTreeMap::new();
    for partition in 0..PARTITIONS {
        for message in read(store, partition).await {
            let robot = Address::parse(&message.subject).expect("an address").robot;
            made.entry(robot).or_default().push(Decided::parse(&message.payload).expect("a decision"));
        }
    }
    assert_eq!(made.len(), sequences.len(), "seed {seed}");
    for (robot, sequences) in sequences {
        let (name, (mission, events)) = (name(*robot), &scripts[robot % scripts.len()]);
        let label = format!("seed {seed}, {name}");
        scripts::assert_replayed(&label, mission, events, &made[&name], sequences);
    }
    for _ in 0..90 {
        if store.count(Stream::Events).await == Ok(0) {
            return;
        }
        tokio::time::sleep(Duration::from_secs(1)).await;
    }
    panic!("seed {seed}: {:?} events are not discarded", store.count(Stream::Events).await);
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

/// Measures events per second, the time of a single event, and memory for 1, 2 and 4 workers (variable `WORKERS`).
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs nats-server and an idle machine; figures mean something in a release build only"]
async fn figures() {
    if !cluster::is_possible() {
        return;
    }
    let (robots, lines) = (number("ROBOTS", 1000) as usize, number("EVENTS", 20) as usize);
    let scripts = scripts(robots, lines);
    let list = std::env::var("WORKERS").unwrap_or_else(|_| "1,2,4".to_owned());
    for workers in list.split(',').filter_map(|text| text.parse::<usize>().ok()) {
        let (cluster, store) = Box::pin(begin(0, workers, 10)).await;
        tokio::time::sleep(Duration::from_secs(15)).await;
        let begun = Instant::now();
        send(&store, robots, &scripts, 0).await;
        let said = begun.elapsed();
        while store.count(Stream::Decisions).await.expect("it can be read") < (robots * lines) as u64 {
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
        let (decided, late) = (begun.elapsed(), calm(&store, robots.min(50)).await);
        let rate = |time: Duration| (robots * lines) as f64 / time.as_secs_f64();
        let memory = |kind: &str, count: usize| {
            (0..count).map(|number| cluster.memory(&format!("{kind}{number}"))).max().unwrap_or_default()
        };
        println!(
            "{workers} workers, {robots} robots: events said at {:.0}/s, decided at {:.0}/s; one at a time median {:.1} ms, 99 percent {:.1} ms; memory {} MB each, servers {} MB",
            rate(said),
            rate(decided),
            late[late.len() / 2],
            late[late.len() * 99 / 100],
            memory("w", workers),
            memory("s", 3),
        );
    }
}

/// Sends events of otherwise idle robots, one at a time, which alternately fail and restore a
/// component. Returns the times from sending to the visible decision in milliseconds, sorted.
async fn calm(store: &Nats, robots: usize) -> Vec<f64> {
    let mut late = Vec::new();
    for number in 0..200 {
        let mut sender = Sender::new(store.clone(), &name(number % robots), &format!("calm{number}."));
        let subject = sender.address().to_string();
        let event = status_event("c_kinect", (number / robots).is_multiple_of(2));
        let begun = Instant::now();
        let sequence = sender.send(&event).await.expect("the event is short");
        loop {
            let last = store.last(Stream::Decisions, &subject).await.expect("it can be read");
            if last.and_then(|last| Decided::parse(&last.payload)).is_some_and(|last| last.event == sequence)
            {
                break;
            }
            tokio::time::sleep(Duration::from_micros(200)).await;
        }
        late.push(begun.elapsed().as_secs_f64() * 1000.0);
    }
    late.sort_by(f64::total_cmp);
    late
}
