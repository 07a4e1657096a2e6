//! The model checker beside Storm: values on random models and on our mission, JANI, and speed on co-adaptation models.
//!
//! `python3 -m venv storm && storm/bin/pip install stormpy==2.0.0`, then
//! `STORM_PYTHON=storm/bin/python cargo test --release --test storm -- --ignored --nocapture`.

#![allow(clippy::print_stdout)]

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use metaplan::mission::Mission;
use metaplan::probabilistic::{Battery, Coadaptation, Process, Risk, program};
use probabilistic::check::{Answer, Exactness, Options, Outcome, check};
use probabilistic::explore::{Bounds, explore};
use probabilistic::prism::ast::{
    BinaryOp, Command as Guarded, Expr, ExprKind, Model, ModelKind, Module, Named, RewardItem, Rewards,
    Update, Variable,
};
use probabilistic::solve::solve;
use probabilistic::{Direction, Place, Problem, jani, prism, property};
use serde_json::{Value, json};

/// Reads lines of JSON with `file`, `property` and `exact`, and answers each with the value or why there is none.
const SCRIPT: &str = r#"
import json, sys, time, resource
import stormpy
from stormpy import environments as E
for line in sys.stdin:
    q = json.loads(line); out = {}
    try:
        t = time.perf_counter()
        if q["file"].endswith(".jani"):
            p = stormpy.parse_jani_model(q["file"]); p = p[0] if isinstance(p, tuple) else p
        else:
            p = stormpy.parse_prism_program(q["file"], prism_compatibility=True)
        props = stormpy.parse_properties(q["property"], p)
        out["parse"] = time.perf_counter() - t; t = time.perf_counter()
        build = stormpy.build_model[stormpy.Rational] if q["exact"] else stormpy.build_model
        m = build(p, options=stormpy.BuilderOptions(props))
        out["build"] = time.perf_counter() - t; t = time.perf_counter()
        r = stormpy.model_checking(m, props[0], environment=E.exact() if q["exact"] else E.sound())
        out["check"] = time.perf_counter() - t
        v = float(r.get_value(m.initial_states[0])) if not q["exact"] else r.get_value(m.initial_states[0])
        f = float(v); out["value"] = None if f == float("inf") else f
        out["states"], out["transitions"] = m.nr_states, m.nr_transitions
    except Exception as e:
        out["error"] = str(e)
    out["memory"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    print(json.dumps(out), flush=True)
"#;

/// Storm's answers; none where it is not installed.
fn storm(questions: &[Value]) -> Option<Vec<Value>> {
    let python = std::env::var("STORM_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let installed = Command::new(&python).args(["-c", "import stormpy"]).output().ok()?.status.success();
    if !installed {
        println!(
            "skipped: no stormpy; python3 -m venv storm && storm/bin/pip install stormpy==2.0.0, STORM_PYTHON=storm/bin/python"
        );
        return None;
    }
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

struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % bound
    }
}

fn place() -> Place {
    Place::default()
}

fn equals(name: &str, value: usize) -> Expr {
    Expr::name(name).op(BinaryOp::Equal, Expr::int(value as i64))
}

/// A module over `variable` with random commands; actions are shared with the other module.
fn module(random: &mut Random, name: &str, variable: &str, size: usize, actions: &[&str]) -> Module {
    let mut commands = Vec::new();
    for state in 0..size {
        for _ in 0..random.below(4) {
            let action = random.below(actions.len() + 1);
            let ends = 1 + random.below(3);
            let mut left = 100;
            let mut updates = Vec::new();
            for end in 0..ends {
                let share = if end + 1 == ends { left } else { random.below(left + 1) };
                left -= share;
                let probability = Expr::int(share as i64).op(BinaryOp::Divide, Expr::int(100));
                let target = Expr::int(random.below(size) as i64);
                updates.push(Update {
                    probability: Some(probability),
                    assignments: vec![(variable.to_owned(), target, place())],
                });
            }
            commands.push(Guarded {
                action: actions.get(action).map(|action| (*action).to_owned()),
                guard: equals(variable, state),
                updates,
                place: place(),
            });
        }
    }
    let range = Some((Expr::int(0), Expr::int(size as i64 - 1)));
    let variable = Variable { name: variable.to_owned(), range, initial: Some(Expr::int(0)), place: place() };
    Module { name: name.to_owned(), variables: vec![variable], commands, place: place() }
}

fn random_model(random: &mut Random) -> Model {
    let (m, n) = (2 + random.below(8), 1 + random.below(4));
    let modules = vec![
        module(random, "first", "s", m, &["a", "b"]),
        module(random, "second", "t", n.max(2), &["b", "c"]),
    ];
    let used: Vec<String> =
        modules.iter().flat_map(|m| &m.commands).filter_map(|c| c.action.clone()).collect();
    let mut items = Vec::new();
    for action in ["a", "b", "c"] {
        if used.iter().any(|known| known == action) && random.below(3) > 0 {
            items.push(RewardItem {
                action: Some(Some(action.to_owned())),
                guard: Expr::bool(true),
                reward: Expr::int(random.below(5) as i64),
                place: place(),
            });
        }
    }
    items.push(RewardItem {
        action: None,
        guard: equals("s", random.below(m)),
        reward: Expr::int(random.below(3) as i64),
        place: place(),
    });
    Model {
        kind: if random.below(5) == 0 { ModelKind::Dtmc } else { ModelKind::Mdp },
        remark: String::new(),
        constants: Vec::new(),
        formulas: Vec::new(),
        globals: Vec::new(),
        modules,
        rewards: vec![Rewards { name: "cost".to_owned(), items, place: place() }],
        labels: vec![
            Named { name: "goal".to_owned(), expression: equals("s", m - 1), place: place() },
            Named {
                name: "good".to_owned(),
                expression: Expr::new(ExprKind::Not(Box::new(equals("t", 1)))),
                place: place(),
            },
        ],
    }
}

fn questions(kind: ModelKind) -> &'static [&'static str] {
    match kind {
        ModelKind::Mdp => &[
            "Pmax=? [ F \"goal\" ]",
            "Pmin=? [ F \"goal\" ]",
            "R{\"cost\"}min=? [ F \"goal\" ]",
            "R{\"cost\"}max=? [ F \"goal\" ]",
            "Pmax=? [ \"good\" U \"goal\" ]",
            "Pmax=? [ F<=5 \"goal\" ]",
        ],
        ModelKind::Dtmc => &["P=? [ F \"goal\" ]", "R{\"cost\"}=? [ F \"goal\" ]"],
    }
}

/// Our value, with bounds; infinite as none.
fn ours(model: &Model, text: &str, exactness: Exactness) -> Option<(f64, f64, f64)> {
    let options = Options { exactness, ..Options::default() };
    let report = check(model, &property::parse(text).expect("a property"), &options).expect("an answer");
    match report.outcome {
        Outcome::Value(Answer::Finite(quantity)) => Some((quantity.value, quantity.lower, quantity.upper)),
        Outcome::Value(Answer::Infinite) => None,
        other => panic!("{text}: {other:?}"),
    }
}

fn compare(what: &str, found: Option<(f64, f64, f64)>, storm: &Value) {
    assert!(storm["error"].is_null(), "{what}: {storm}");
    match (found, storm["value"].as_f64()) {
        (None, None) => {}
        (Some((value, lower, upper)), Some(expected)) => {
            let tolerance = 1e-6 * expected.abs().max(1.0);
            assert!((value - expected).abs() <= tolerance, "{what}: {value}, Storm {expected}");
            assert!(
                lower - 1e-12 * expected.abs() <= expected && expected <= upper + 1e-12 * expected.abs(),
                "{what}: [{lower}, {upper}], Storm {expected}"
            );
            assert!(upper - lower <= tolerance, "{what}: [{lower}, {upper}]");
        }
        other => panic!("{what}: {other:?}"),
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
    let mut random = Random(3);
    let (mut asked, mut expected) = (Vec::new(), Vec::new());
    let mut infinite = 0;
    for number in 0..200 {
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
            for file in [&prism_file, &jani_file] {
                asked.push(json!({ "file": file, "property": question, "exact": true }));
                expected.push((format!("{question}\n{text}"), exact, rounded));
            }
        }
    }
    let Some(answers) = storm(&asked) else { return };
    assert_eq!(answers.len(), asked.len());
    let mut refused = 0;
    for (((what, exact, rounded), answer), question) in expected.iter().zip(&answers).zip(&asked) {
        if question["file"]
            .as_str()
            .is_some_and(|file| Path::new(file).extension().is_some_and(|e| e == "jani"))
            && !answer["error"].is_null()
        {
            refused += 1;
            println!("JANI refused: {answer}");
            continue;
        }
        compare(what, *exact, answer);
        compare(what, *rounded, answer);
    }
    println!(
        "{} answers agree with Storm, {infinite} of ours infinite, {refused} JANI files refused",
        answers.len() - refused
    );
    assert_eq!(refused, 0);
}

/// Our mission with more battery levels; everything uncertain.
fn larger(levels: u32) -> (Coadaptation, Risk) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mission, _) = Mission::read(&root.join("missions/camara_like.toml")).expect("a mission");
    let (problem, _) = mission.filled().expect("filled");
    let mut roles = mission.roles().clone();
    roles.battery_unit = 1;
    let mut coadaptation = Coadaptation::new(&mission, &problem, &roles).expect("a process");
    coadaptation.battery = Some(Battery { initial: levels, reserve: 500, unit: 1 });
    let risk = Risk { collisions: true, failures: true, loss: false, battery: true };
    (coadaptation, risk)
}

/// Explores and solves natively: least time where it is finite, else the greatest probability.
fn native(mission: &Coadaptation, risk: Risk) -> (usize, usize, f64, f64) {
    let started = Instant::now();
    let process = Process::<f64>::new(mission, risk, &[]);
    let bounds = Bounds { states: 100_000_000, ..Bounds::default() };
    let explored = explore(&process, &bounds).expect("explored");
    let mut goal = fixedbitset::FixedBitSet::with_capacity(explored.mdp.states());
    for (number, state) in explored.states.iter().enumerate() {
        goal.set(number, process.is_goal(*state) && !state.situation().hit);
    }
    let problem = Problem {
        mdp: &explored.mdp,
        direction: Direction::Max,
        rewards: None,
        terminal: &goal,
        terminal_values: None,
        blocked: None,
        allowed: None,
    };
    let solution = solve(problem, None).expect("solved");
    (
        explored.mdp.states(),
        explored.mdp.transition_count(),
        solution.values[0],
        started.elapsed().as_secs_f64(),
    )
}

#[test]
#[ignore = "minutes; needs Storm"]
fn speed_on_coadaptation_models() {
    let folder = tempfile::tempdir().expect("a folder");
    let levels = std::env::var("LEVELS").unwrap_or_else(|_| "9000,14000".to_owned());
    for levels in levels.split(',').map(|levels| levels.parse().expect("a number")) {
        let (mission, risk) = larger(levels);
        let before = peak();
        let (states, transitions, value, seconds) = native(&mission, risk);
        let ours = peak();
        let text = prism::write(&program(&mission, risk));
        let file = file(folder.path(), "model.prism", &text);
        let question = json!({ "file": file, "property": "Pmax=? [ F \"safe_goal\" ]", "exact": false });
        let Some(answers) = storm(&[question]) else { return };
        let answer = &answers[0];
        let theirs: f64 = ["parse", "build", "check"].iter().filter_map(|key| answer[*key].as_f64()).sum();
        println!(
            "{levels} levels: {states} states, {transitions} transitions; ours {seconds:.2} s, {ours} MB ({before} before); \
             Storm {theirs:.2} s, {} MB, {} states; ratio {:.1}",
            answer["memory"],
            answer["states"],
            theirs / seconds
        );
        let expected = answer["value"].as_f64().unwrap_or(f64::NAN);
        assert!((value - expected).abs() < 1e-6, "{value}, Storm {expected}");
        assert!(theirs > 10.0 * seconds, "less than ten times as fast");
    }
}

/// The greatest resident memory so far, in megabytes.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or("0");
    line.split_whitespace().next().and_then(|text| text.parse::<u64>().ok()).unwrap_or(0) / 1024
}
