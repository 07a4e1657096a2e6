//! Chaos test: three servers, four workers and a thousand robots, with faults at random times.
//! Every robot must receive the answers that a single local loop gives. The test `figures` measures
//! rates and times without faults.
//!
//! Ignored by default, because it needs `nats-server` (2.11 or newer), given by `NATS_SERVER` or
//! found in the search path. Further variables: `SCHEDULES` (20), `SEED` (1), `ROBOTS` (1000),
//! `EVENTS` per robot (100), sent within `SECONDS` (20). The seed determines the faults, but their
//! timing depends on the machine.

#![expect(clippy::print_stdout, reason = "what was done to whom is said while it is done")]

mod cluster;
#[path = "../local/scripts.rs"]
mod scripts;
mod wires;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use metaplan_fleet::robots::{Sender, status};
use metaplan_fleet::store::nats::{Access, Layout, Nats};
use metaplan_fleet::store::{Message, Store, Stored, Stream};
use metaplan_fleet::wire::{Address, Decided, partition_of};
use serde_json::{Value, json};

use cluster::Cluster;

const PARTITIONS: u32 = 32;
const LEASE: u64 = 2;
const WORKERS: usize = 4;

fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// Events of a robot, and the expected answers to each event.
type Script = (Vec<String>, Vec<Vec<Value>>);

/// Returns a script with the given number of events: observations of a simulated robot, then
/// failures and recoveries of a component.
fn script(number: usize, lines: usize) -> Script {
    let (mission, scenario) = scripts::SCENARIOS[number % scripts::SCENARIOS.len()];
    let (mut events, _) = scripts::play(mission, scenario, number as u64, lines);
    let component = if mission == "ugv" { "c_kinect" } else { "c_thruster_1" };
    let mut fails = true;
    while events.len() < lines {
        let status = if fails { "FALSE" } else { "OK" };
        fails = !fails;
        events
            .push(json!({"event": "component_status", "component": component, "status": status}).to_string());
    }
    let answers = scripts::alone(mission, &events);
    (events, answers)
}

async fn open(cluster: &Cluster, lease: u64) -> Nats {
    let access = Access { url: cluster.url(), ..Access::default() };
    let lease = Duration::from_secs(lease);
    let layout = Layout { fleet: "fleet".to_owned(), partitions: PARTITIONS, replicas: 3, lease };
    match Nats::open(&access, &layout, Duration::from_secs(60)).await {
        Ok(store) => store,
        Err(error) => panic!("the servers do not answer: {}: {}", error.message, cluster.logs()),
    }
}

async fn read(store: &Nats, stream: Stream, partition: u32) -> Vec<Stored> {
    for _ in 0..60 {
        match store.history(stream, partition, 0).await {
            Ok(messages) => return messages,
            Err(_) => tokio::time::sleep(Duration::from_millis(500)).await,
        }
    }
    panic!("partition {partition} cannot be read");
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

async fn schedule(seed: u64, robots: usize, scripts: &[Script]) {
    let cluster = Cluster::begin(seed);
    let store = Box::pin(open(&cluster, LEASE)).await;
    for worker in 0..WORKERS {
        cluster.begin_worker(worker, PARTITIONS, LEASE);
    }
    let over = Arc::new(AtomicBool::new(false));
    let begun = Instant::now();
    let trouble = {
        let (cluster, over) = (cluster.clone(), Arc::clone(&over));
        std::thread::spawn(move || cluster.trouble(seed, &over, PARTITIONS, LEASE))
    };
    let attacker = tokio::spawn(attack(store.clone(), Arc::clone(&over), seed));
    let sent = Arc::new(AtomicU64::new(0));
    let mut senders = tokio::task::JoinSet::new();
    for robot in 0..robots {
        let mut sender = Sender::new(store.clone(), &format!("robot-{robot}"), "");
        let events = scripts[robot % scripts.len()].0.clone();
        let sent = Arc::clone(&sent);
        let pause = number("SECONDS", 20) * 2000 / events.len() as u64;
        senders.spawn(async move {
            for event in &events {
                tokio::time::sleep(Duration::from_millis(fastrand::u64(0..=pause))).await;
                sender.send(event).await.expect("events are short");
                sent.fetch_add(1, Ordering::Relaxed);
            }
        });
    }
    while let Some(done) = senders.join_next().await {
        done.expect("a robot says all that it has to say");
    }
    let said = begun.elapsed();
    let expected = sent.load(Ordering::Relaxed);
    // From here on no faults are injected, and the remaining events are decided.
    over.store(true, Ordering::Relaxed);
    let what = trouble.join().expect("trouble ends");
    let attacks = attacker.await.expect("attacks end");
    let mut decided = 0;
    for _ in 0..900 {
        decided = 0;
        for partition in 0..PARTITIONS {
            decided += read(&store, Stream::Decisions, partition).await.len() as u64;
        }
        if decided >= expected {
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
        println!(
            "{}",
            serde_json::to_string(&status(&store).await.expect("it can be read")).expect("plain data")
        );
    }
    assert_eq!(decided, expected, "seed {seed}: {}", cluster.logs());
    verify(&store, robots, scripts, seed).await;
}

/// Checks that every robot has sent all its events, in order and once, and that it received the
/// answers of a single local loop.
async fn verify(store: &Nats, robots: usize, scripts: &[Script], seed: u64) {
    let mut said: BTreeMap<String, Vec<Stored>> = BTreeMap::new();
    let mut made: BTreeMap<String, Vec<Decided>> = BTreeMap::new();
    for partition in 0..PARTITIONS {
        for message in read(store, Stream::Events, partition).await {
            let robot = Address::parse(&message.subject).expect("an address").robot;
            said.entry(robot).or_default().push(message);
        }
        for message in read(store, Stream::Decisions, partition).await {
            let robot = Address::parse(&message.subject).expect("an address").robot;
            made.entry(robot).or_default().push(Decided::parse(&message.payload).expect("a decision"));
        }
    }
    assert_eq!(made.len(), robots, "seed {seed}");
    for robot in 0..robots {
        let (name, (events, answers)) = (format!("robot-{robot}"), &scripts[robot % scripts.len()]);
        // Messages that other clients have sent in the robot's name have another id, or no id.
        let prefix = format!("{name}:");
        let own = |message: &&Stored| {
            let id = message.id.as_deref().and_then(|id| id.strip_prefix(&prefix));
            id.is_some_and(|id| id.parse::<u64>().is_ok())
                && message.subject == Address::of(&name, PARTITIONS).to_string()
        };
        let said: Vec<&Stored> = said[&name].iter().filter(own).collect();
        let texts: Vec<&[u8]> = said.iter().map(|message| message.payload.as_slice()).collect();
        let wanted: Vec<&[u8]> = events.iter().map(String::as_bytes).collect();
        assert!(texts == wanted, "seed {seed}: {name} was not heard as it spoke");
        let made = &made[&name];
        let sequences: Vec<u64> = made.iter().map(|own| own.event).collect();
        let wanted: Vec<u64> = said.iter().map(|message| message.sequence).collect();
        assert_eq!(sequences, wanted, "seed {seed}: {name}: each event once, in order");
        for (own, expected) in made.iter().zip(answers) {
            let (own_answers, expected) = (scripts::essence(&own.answers), scripts::essence(expected));
            assert_eq!(own_answers, expected, "seed {seed}: {name}, event {}", own.event);
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs nats-server, and minutes"]
async fn nothing_is_lost_repeated_or_out_of_order() {
    if !cluster::is_possible() {
        return;
    }
    let (robots, lines) = (number("ROBOTS", 1000) as usize, number("EVENTS", 100) as usize);
    let scripts: Vec<Script> = (0..robots.min(24)).map(|own| script(own, lines)).collect();
    let first = number("SEED", 1);
    for seed in first..first + number("SCHEDULES", 20) {
        println!("seed {seed} begins");
        Box::pin(schedule(seed, robots, &scripts)).await;
    }
}

/// Measures events per second, latencies and memory for 1, 2 and 4 workers (variable `WORKERS`), in
/// comparison with local loops.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs nats-server and an idle machine; figures mean something in a release build only"]
async fn figures() {
    if !cluster::is_possible() {
        return;
    }
    let (robots, lines) = (number("ROBOTS", 1000) as usize, number("EVENTS", 20) as usize);
    let scripts: Vec<Script> = (0..robots.min(24)).map(|own| script(own, lines)).collect();
    let begun = Instant::now();
    let alone = scripts.iter().enumerate().map(|(own, (events, _))| {
        let (mission, _) = scripts::SCENARIOS[own % scripts::SCENARIOS.len()];
        scripts::alone(mission, events).len()
    });
    let count: usize = alone.sum();
    println!(
        "one thread of one process: {:.0} events/s, reading missions included",
        rate(count, begun.elapsed())
    );
    let list = std::env::var("WORKERS").unwrap_or_else(|_| "1,2,4".to_owned());
    for workers in list.split(',').filter_map(|text| text.parse::<usize>().ok()) {
        let cluster = Cluster::begin(0);
        let store = Box::pin(open(&cluster, 10)).await;
        for worker in 0..workers {
            cluster.begin_worker(worker, PARTITIONS, 10);
        }
        tokio::time::sleep(Duration::from_secs(8)).await;
        let (said, decided) = say_all(&store, robots, &scripts).await;
        let events = robots * lines;
        let late = latencies(&store).await;
        let calm = calm(&store, robots.min(50)).await;
        println!(
            "{workers} workers: {events} events of {robots} robots said at {:.0}/s, decided at {:.0}/s; flat out latency median {:.1} ms, 99 percent {:.1} ms; one at a time median {:.1} ms, 99 percent {:.1} ms; memory {} MB each, servers {} MB",
            rate(events, said),
            rate(events, decided),
            late[late.len() / 2],
            late[late.len() * 99 / 100],
            calm[calm.len() / 2],
            calm[calm.len() * 99 / 100],
            (0..workers).map(|own| cluster.memory(&format!("w{own}"))).max().unwrap_or_default(),
            (0..3).map(|own| cluster.memory(&format!("s{own}"))).max().unwrap_or_default(),
        );
    }
}

fn rate(count: usize, time: Duration) -> f64 {
    count as f64 / time.as_secs_f64()
}

/// Sends all events of all robots. Returns the time until all are sent, and the time until all are
/// decided.
async fn say_all(store: &Nats, robots: usize, scripts: &[Script]) -> (Duration, Duration) {
    let begun = Instant::now();
    let mut senders = tokio::task::JoinSet::new();
    for robot in 0..robots {
        let mut sender = Sender::new(store.clone(), &format!("robot-{robot}"), "");
        let events = scripts[robot % scripts.len()].0.clone();
        senders.spawn(async move {
            for event in &events {
                sender.send(event).await.expect("events are short");
            }
            events.len()
        });
    }
    let mut expected = 0;
    while let Some(done) = senders.join_next().await {
        expected += done.expect("a robot says all that it has to say");
    }
    let said = begun.elapsed();
    loop {
        let count = store.count(Stream::Decisions).await.expect("it can be read");
        if count >= expected as u64 {
            return (said, begun.elapsed());
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

/// Sends events of otherwise idle robots, one at a time, which alternately fail and restore a
/// component. Returns the times from sending to the visible decision in milliseconds, sorted.
async fn calm(store: &Nats, robots: usize) -> Vec<f64> {
    let mut late = Vec::new();
    for number in 0..200 {
        let robot = format!("robot-{}", number % robots);
        let mut sender = Sender::new(store.clone(), &robot, &format!("calm{number}."));
        let subject = sender.address().to_string();
        let known = store.last(Stream::Decisions, &subject).await.expect("it can be read");
        let known = known.map_or(0, |last| last.sequence);
        let status = if (number / robots).is_multiple_of(2) { "FALSE" } else { "OK" };
        let event =
            json!({"event": "component_status", "component": "c_kinect", "status": status}).to_string();
        let begun = Instant::now();
        sender.send(&event).await.expect("the event is short");
        while store
            .last(Stream::Decisions, &subject)
            .await
            .expect("it can be read")
            .map_or(0, |own| own.sequence)
            == known
        {
            tokio::time::sleep(Duration::from_micros(200)).await;
        }
        late.push(begun.elapsed().as_secs_f64() * 1000.0);
    }
    late.sort_by(f64::total_cmp);
    late
}

/// Returns the times between storage of an event and storage of its decision in milliseconds,
/// sorted.
async fn latencies(store: &Nats) -> Vec<f64> {
    let mut late = Vec::new();
    for partition in 0..PARTITIONS {
        let events: BTreeMap<u64, u64> =
            read(store, Stream::Events, partition).await.iter().map(|own| (own.sequence, own.time)).collect();
        for message in read(store, Stream::Decisions, partition).await {
            let decided = Decided::parse(&message.payload).expect("a decision");
            late.push((message.time - events[&decided.event]) as f64 / 1000.0);
        }
    }
    late.sort_by(f64::total_cmp);
    late
}
