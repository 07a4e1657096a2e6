//! Comparison of the model checker with Storm: values on random models and on the co-adaptation mission
//! `camara_like`, JANI files, and speed.
//!
//! Setup: `python3 -m venv storm && storm/bin/pip install stormpy==2.0.0`. Run:
//! `STORM_PYTHON=storm/bin/python cargo test --release --test storm -- --ignored --nocapture`.
//! `SEED` and `MODELS` set the seed and the number of the random models.

#![allow(clippy::print_stdout)]

mod decided;
mod random;

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use metaplan::comparison::{Battery, Coadaptation, Process, Risk, program};
use metaplan::setup::Setup;
use probabilistic::check::{Answer, Exactness, Options, Outcome, check};
use probabilistic::explore::{Bounds, explore};
use probabilistic::prism::ast::Model;
use probabilistic::solve::solve;
use probabilistic::{Direction, Problem, jani, prism, property};
use serde_json::{Value, json};
use test_resources::{Resource, python_with};

use random::{Random, questions, random_model};

/// Python script that answers each line of JSON (`file`, `property`, `exact`) with the value or an error, and
/// with times and memory.
const SCRIPT: &str = r#"
import json, sys, time, resource
import stormpy
from stormpy import environments as E
for line in sys.stdin:
    q = json.loads(line); out = {}
    try:
        t = time.process_time()
        if q["file"].endswith(".jani"):
            p = stormpy.parse_jani_model(q["file"]); p = p[0] if isinstance(p, tuple) else p
        else:
            p = stormpy.parse_prism_program(q["file"], prism_compatibility=True)
        props = stormpy.parse_properties(q["property"], p)
        out["parse"] = time.process_time() - t; t = time.process_time()
        build = stormpy.build_model[stormpy.Rational] if q["exact"] else stormpy.build_model
        m = build(p, options=stormpy.BuilderOptions(props))
        out["build"] = time.process_time() - t; t = time.process_time()
        r = stormpy.model_checking(m, props[0], environment=E.exact() if q["exact"] else E.sound())
        out["check"] = time.process_time() - t
        v = float(r.get_value(m.initial_states[0])) if not q["exact"] else r.get_value(m.initial_states[0])
        f = float(v); out["value"] = None if f == float("inf") else f
        out["states"], out["transitions"] = m.nr_states, m.nr_transitions
    except Exception as e:
        out["error"] = str(e)
    out["memory"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    print(json.dumps(out), flush=True)
"#;

fn storm(questions: &[Value]) -> Option<Vec<Value>> {
    let python = python_with(Resource::Stormpy, "STORM_PYTHON", "stormpy")?;
    let mut child = Command::new(&python)
        .args(["-c", SCRIPT])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("python starts");
    let text = questions.iter().fold(String::new(), |mut text, question| {
        let _ = writeln!(text, "{question}");
        text
    });
    let mut pipe = child.stdin.take().expect("a pipe");
    let writer = std::thread::spawn(move || pipe.write_all(text.as_bytes()));
    let output = child.wait_with_output().expect("python ends");
    writer.join().expect("written").expect("written");
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    Some(
        text.lines()
            .filter(|line| line.starts_with('{'))
            .map(|line| serde_json::from_str(line).expect("JSON"))
            .collect(),
    )
}

/// Returns the value with its lower and upper bound; `None` if the value is infinite.
fn ours(model: &Model, text: &str, exactness: Exactness) -> Option<(f64, f64, f64)> {
    let options = Options::default().with_exactness(exactness);
    let report = check(model, &property::parse(text).expect("a property"), &options).expect("an answer");
    match report.outcome {
        Outcome::Value(Answer::Finite(quantity)) => Some((quantity.value, quantity.lower, quantity.upper)),
        Outcome::Value(Answer::Infinite) => None,
        unexpected => panic!("{text}: {unexpected:?}"),
    }
}

fn compare(label: &str, computed: Option<(f64, f64, f64)>, storm: &Value) {
    assert!(storm["error"].is_null(), "{label}: {storm}");
    match (computed, storm["value"].as_f64()) {
        (None, None) => {}
        (Some((value, lower, upper)), Some(expected)) => {
            // Storm's answers are exact here, but ours can be computed in doubles.
            let tolerance = 1e-6 * expected.abs().max(1.0);
            assert!((value - expected).abs() <= tolerance, "{label}: {value}, Storm {expected}");
            assert!(
                lower - 1e-12 * expected.abs() <= expected && expected <= upper + 1e-12 * expected.abs(),
                "{label}: [{lower}, {upper}], Storm {expected}"
            );
            assert!(upper - lower <= tolerance, "{label}: [{lower}, {upper}]");
        }
        different => panic!("{label}: {different:?}"),
    }
}

fn file(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("written");
    path.display().to_string()
}

#[test]
#[ignore = "needs Storm"]
fn random_models() {
    let folder = tempfile::tempdir().expect("a folder");
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    let mut random = Random(number("SEED").unwrap_or(3));
    let (mut queries, mut expected) = (Vec::new(), Vec::new());
    let mut infinite = 0;
    for number in 0..number("MODELS").unwrap_or(200) {
        let model = random_model(&mut random);
        let text = prism::write(&model);
        let read = prism::parse(&text).unwrap_or_else(|problems| panic!("{problems:?}\n{text}"));
        let prism_file = file(folder.path(), &format!("m{number}.prism"), &text);
        let jani_text = jani::write("m", &model).expect("JANI").to_string();
        let jani_file = file(folder.path(), &format!("m{number}.jani"), &jani_text);
        for question in questions(model.kind) {
            let [exact, rounded] =
                [Exactness::Always, Exactness::Never].map(|exactness| ours(&read, question, exactness));
            infinite += usize::from(exact.is_none());
            // Storm must compute the same values from the JANI file, which tests the export.
            for file in [&prism_file, &jani_file] {
                queries.push(json!({ "file": file, "property": question, "exact": true }));
                expected.push((format!("{question}\n{text}"), exact, rounded));
            }
        }
    }
    let Some(answers) = storm(&queries) else { return };
    assert_eq!(answers.len(), queries.len());
    let mut refused = 0;
    for (((label, exact, rounded), answer), question) in expected.iter().zip(&answers).zip(&queries) {
        if question["file"]
            .as_str()
            .is_some_and(|file| Path::new(file).extension().is_some_and(|e| e == "jani"))
            && !answer["error"].is_null()
        {
            refused += 1;
            println!("JANI refused: {answer}");
            continue;
        }
        compare(label, *exact, answer);
        compare(label, *rounded, answer);
    }
    println!(
        "{} answers agree with Storm, {infinite} of ours infinite, {refused} JANI files refused",
        answers.len() - refused
    );
    assert_eq!(refused, 0);
}

struct Case {
    property: &'static str,
    reward: Option<&'static str>,
    failures: bool,
}

const CASES: [Case; 2] = [
    Case { property: "Pmax=? [ F \"safe_goal\" ]", reward: None, failures: true },
    Case { property: "R{\"time\"}min=? [ F \"goal\" ]", reward: Some("time"), failures: false },
];

/// Returns the mission `camara_like` with another battery capacity, optionally with the size of a battery level:
/// `14000/20`.
fn larger(battery: &str, case: &Case) -> (Coadaptation, Risk) {
    let number = |text: &str| text.parse::<u32>().expect("a number");
    let (battery, unit) = battery.split_once('/').unwrap_or((battery, "1"));
    let (battery, unit) = (number(battery), number(unit));
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let Setup { mission, mut roles, .. } =
        Setup::read(&root.join("missions/camara_like.toml")).expect("a mission");
    let (problem, _) = mission.filled().expect("filled");
    roles.battery_unit = unit;
    let mut coadaptation = Coadaptation::new(&mission, &problem, &roles).expect("a process");
    coadaptation.battery = Some(Battery { initial: battery / unit, reserve: 500 / unit, unit });
    let risk = Risk { collisions: true, failures: case.failures, loss: false, battery: true };
    (coadaptation, risk)
}

/// Processor times are in seconds.
struct Run {
    states: usize,
    value: f64,
    build: f64,
    solve: f64,
}

/// Explores and solves the process directly, without its text in the PRISM language.
fn native(mission: &Coadaptation, risk: Risk, case: &Case) -> Run {
    let started = processor();
    let names: Vec<&str> = case.reward.into_iter().collect();
    let process = Process::<f64>::new(mission, risk, &names);
    let bounds = Bounds::default().with_states(100_000_000);
    let explored = explore(&process, &bounds).expect("explored");
    let build = processor() - started;
    let mut goal = fixedbitset::FixedBitSet::with_capacity(explored.mdp.states());
    for (number, state) in explored.states.iter().enumerate() {
        goal.set(number, process.is_goal(*state) && !(case.reward.is_none() && state.situation().hit));
    }
    let direction = if case.reward.is_some() { Direction::Min } else { Direction::Max };
    let rewards = case.reward.map(|_| &explored.rewards[0][..]);
    let problem = Problem::new(&explored.mdp, direction, rewards, &goal);
    let solution = solve(problem, None).expect("solved");
    let value = if solution.infinite.contains(0) { f64::INFINITY } else { solution.values[0] };
    let solve = processor() - started - build;
    Run { states: explored.mdp.states(), value, build, solve }
}

fn as_text(text: &str, case: &Case) -> Run {
    let model = prism::parse(text).expect("a model");
    let bounds = Bounds::default().with_states(100_000_000);
    let options = Options::default().with_exactness(Exactness::Never).with_bounds(bounds);
    let property = property::parse(case.property).expect("a property");
    let started = processor();
    let report = check(&model, &property, &options).expect("an answer");
    let value = match report.outcome {
        Outcome::Value(Answer::Finite(quantity)) => quantity.value,
        _ => f64::INFINITY,
    };
    // The stages are measured in wall time, so their ratio is applied to the total processor time.
    let total = processor() - started;
    let build = total * report.build.as_secs_f64() / (report.build + report.solve).as_secs_f64();
    Run { states: report.states, value, build, solve: total - build }
}

/// Runs one size in a separate process, so that its memory can be measured. Environment variables: `LEVELS`,
/// `CASE` and `SIDE` (`native` or `text`).
#[test]
#[ignore = "part of `speed_on_coadaptation_models`"]
fn one_side() {
    let Ok(levels) = std::env::var("LEVELS") else { return };
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(0_usize);
    let case = &CASES[number("CASE")];
    let (mission, risk) = larger(&levels, case);
    let run = match std::env::var("SIDE").as_deref() {
        Ok("text") => as_text(&prism::write(&program(&mission, risk)), case),
        _ => native(&mission, risk, case),
    };
    println!(
        "{}",
        json!({
            "states": run.states, "value": run.value, "build": run.build, "check": run.solve, "memory": peak(),
        })
    );
}

fn our_side(levels: &str, case: usize, side: &str) -> Value {
    let program = std::env::current_exe().expect("this program");
    let output = Command::new(program)
        .args(["one_side", "--exact", "--ignored", "--nocapture"])
        .envs([("LEVELS", levels), ("CASE", &case.to_string()), ("SIDE", side)])
        .output()
        .expect("runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let line = text.lines().find_map(|line| line.find('{').map(|at| &line[at..]));
    serde_json::from_str(line.unwrap_or_else(|| panic!("{text}"))).expect("JSON")
}

#[test]
#[ignore = "minutes; needs Storm"]
fn speed_on_coadaptation_models() {
    let folder = tempfile::tempdir().expect("a folder");
    let levels = std::env::var("LEVELS").unwrap_or_else(|_| "14000/20,14000/2,14000".to_owned());
    for (number, case) in CASES.iter().enumerate() {
        for levels in levels.split(',') {
            let (mission, risk) = larger(levels, case);
            let text = prism::write(&program(&mission, risk));
            let file = file(folder.path(), "model.prism", &text);
            let question = json!({ "file": file, "property": case.property, "exact": false });
            let sides = ["native", "text"].map(|side| (side, our_side(levels, number, side)));
            let Some(answers) = storm(&[question]) else { return };
            let storm = &answers[0];
            let seconds =
                |run: &Value| ["build", "check"].iter().filter_map(|key| run[*key].as_f64()).sum::<f64>();
            println!("{} with {levels} of battery, {} states", case.property, storm["states"]);
            println!("  Storm  {:8.3} s {:6} MB: {storm}", seconds(storm), storm["memory"]);
            for (side, run) in &sides {
                let ratio = seconds(storm) / seconds(run);
                println!("  {side:6} {:8.3} s {:6} MB, {ratio:.1}x: {run}", seconds(run), run["memory"]);
                let (computed, expected) = (run["value"].as_f64(), storm["value"].as_f64());
                let is_close =
                    computed.zip(expected).is_none_or(|(a, b)| (a - b).abs() <= 1e-6 * b.abs().max(1.0));
                assert!(computed.is_some() == expected.is_some() && is_close, "{run}, Storm {storm}");
                assert!(ratio > 10.0, "less than ten times as fast");
                assert!(run["memory"].as_u64() <= storm["memory"].as_u64(), "more memory");
            }
        }
    }
}

/// Returns the processor time of this thread in seconds, which does not depend on other processes. Returns 0
/// on systems that do not report it.
fn processor() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = text.split_whitespace().next().and_then(|word| word.parse::<f64>().ok());
    nanoseconds.unwrap_or(0.0) / 1e9
}

/// Returns the peak resident memory of this process in megabytes; 0 on systems that do not report it.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or("0");
    line.split_whitespace().next().and_then(|text| text.parse::<u64>().ok()).unwrap_or(0) / 1024
}
