//! Tests with up to a hundred robots in one process, each with a loop over SUAVE's own knowledge base.
#![expect(clippy::print_stdout, reason = "figures are what these tests are for")]

use std::time::{Duration, Instant};

use metaplan::mapek::{Answer, Loop, Observation};
use metaplan::setup::Setup;

use crate::soak::{processor_time, resident};

const ROBOTS: usize = 100;

const MANIFEST: &str = r#"
name = "suave_fleet"

[knowledge]
files = ["REAL/suave/suave.owl"]
rules = ["coadaptation", "visibility.swrl"]
directories = ["REAL/mros_ontology", "REAL/mc_mdl_tomasys"]

[planning]
domain = "domain.pddl"
problem = "problem.pddl"
"#;

const RULES: &str = r"
@prefix t: <http://metacontrol.org/tomasys#> .
@prefix s: <http://www.metacontrol.org/suave#> .
[too murky]
t:hasQAestimation(?fd, ?qa) ^ t:isQAtype(?qa, s:water_visibility) ^ t:hasValue(?qa, ?needed)
    ^ t:hasValue(s:obs_water_visibility, ?measured) ^ swrlb:lessThan(?measured, ?needed)
    -> t:fd_realisability(?fd, false) .
";

const DOMAIN: &str = "
(define (domain suave) (:requirements :typing :fluents :durative-actions)
  (:types function functiondesign)
  (:predicates (found) (inspected) (fd_solve_f ?fd - functiondesign ?f - function) (fd_available ?fd - functiondesign))
  (:constants f_generate_search_path f_maintain_motion f_follow_pipeline - function)
  (:durative-action search :parameters (?fd1 ?fd2 - functiondesign) :duration (= ?duration 10)
    :condition (and (at start (fd_solve_f ?fd1 f_generate_search_path)) (at start (fd_solve_f ?fd2 f_maintain_motion))
      (over all (fd_available ?fd1)) (over all (fd_available ?fd2)))
    :effect (at end (found)))
  (:durative-action follow :parameters (?fd1 ?fd2 - functiondesign) :duration (= ?duration 10)
    :condition (and (at start (found)) (at start (fd_solve_f ?fd1 f_follow_pipeline))
      (at start (fd_solve_f ?fd2 f_maintain_motion)) (over all (fd_available ?fd1)) (over all (fd_available ?fd2)))
    :effect (at end (inspected))))
";

const PROBLEM: &str = "
(define (problem fleet) (:domain suave) (:init) (:goal (inspected)) (:metric minimize (total-time)))
";

pub fn files() -> Option<tempfile::TempDir> {
    let real = test_resources::data("real/owl")?;
    let directory = tempfile::tempdir().expect("a directory");
    let manifest = MANIFEST.replace("REAL", &real.display().to_string());
    let files = [
        ("m.toml", manifest.as_str()),
        ("visibility.swrl", RULES),
        ("domain.pddl", DOMAIN),
        ("problem.pddl", PROBLEM),
    ];
    for (name, text) in files {
        std::fs::write(directory.path().join(name), text).expect("a file");
    }
    Some(directory)
}

fn fleet() -> Option<Vec<Loop>> {
    let directory = files()?;
    let Setup { mission, settings, .. } =
        Setup::read(&directory.path().join("m.toml")).expect("the mission is read");
    let first = Loop::new(mission, settings).expect("the mission can be planned for");
    Some(vec![first; ROBOTS])
}

fn measurement(robot: usize, round: usize) -> Observation {
    let turn = round as f64 / 80.0 + robot as f64 / ROBOTS as f64;
    let value = 2.25 + 1.5 * (std::f64::consts::TAU * turn).sin();
    Observation::parse(&format!(r#"{{"event":"measured","attribute":"water_visibility","value":{value}}}"#))
}

fn feed(fleet: &mut [Loop], rounds: std::ops::Range<usize>) -> (Vec<Duration>, usize) {
    let (mut times, mut reconfigurations) = (Vec::new(), 0);
    for round in rounds {
        for (robot, control) in fleet.iter_mut().enumerate() {
            let observation = measurement(robot, round);
            let start = Instant::now();
            let answers = control.handle(&observation, Duration::from_secs(round as u64));
            times.push(start.elapsed());
            let _ = control.decision(&answers);
            reconfigurations += answers.iter().filter(|answer| answer.effect().is_some()).count();
            assert!(!answers.iter().any(|answer| matches!(answer, Answer::Error { .. })), "{answers:?}");
        }
    }
    (times, reconfigurations)
}

#[test]
fn every_robot_adapts_independently() {
    let Some(mut fleet) = fleet() else { return };
    fleet.truncate(4);
    for control in &mut fleet {
        control.start();
    }
    let (_, reconfigurations) = feed(&mut fleet, 0..80);
    assert!(reconfigurations >= fleet.len() * 2, "{reconfigurations}");
    let engines: Vec<_> = fleet.iter().map(Loop::snapshot).collect();
    assert!(engines.windows(2).any(|pair| pair[0] != pair[1]));
}

#[test]
#[ignore = "measures; only a release build is of interest"]
fn a_hundred_robots_process_ten_thousand_events_a_second() {
    let Some(mut fleet) = fleet() else { return };
    for control in &mut fleet {
        control.start();
    }
    println!("{ROBOTS} robots: {:?} kB", resident());
    let (mut rate, mut memory) = (f64::INFINITY, Vec::new());
    for part in 0..10 {
        let (start, worked) = (Instant::now(), processor_time());
        let (mut times, reconfigurations) = feed(&mut fleet, part * 1000..(part + 1) * 1000);
        let events = times.len();
        let wall = start.elapsed();
        let work = processor_time().zip(worked).map_or(wall, |(now, before)| now.saturating_sub(before));
        let speed = |time: Duration| events as f64 / time.as_secs_f64();
        rate = rate.min(speed(work));
        memory.extend(resident());
        times.sort_unstable();
        let at = |share: usize| times[(events - 1) * share / 1000];
        println!(
            "{events} events, {:.0} a second of processor time, {:.0} a second, median {:?}, p99 {:?}, p99.9 {:?}, \
             {reconfigurations} reconfigurations, {:?} kB",
            speed(work),
            speed(wall),
            at(500),
            at(990),
            at(999),
            memory.last()
        );
    }
    assert!(rate >= 10_000.0, "{rate} events a second of processor time");
    let half = memory.len() / 2;
    if let (Some(early), Some(late)) = (memory[..half].iter().max(), memory.last()) {
        assert!(*late <= early + early / 5, "memory has grown from {early} to {late} kB");
    }
}
