//! Compares the speed of reading and grounding with the translator of Fast Downward, and measures the size of
//! ground tasks.
//!
//! Times are CPU times of this thread and of the translator's process, so other work on the machine has
//! little influence.

#![expect(clippy::print_stdout, reason = "measurements are shown")]

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use metaplan_planner::{GroundConfig, Task, ground};
use pddl::{Source, read};
use test_resources::data;

fn cpu_time() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<f64>().ok()? / 1e9)
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let before = cpu_time().unwrap_or_default();
    let result = work();
    (result, cpu_time().unwrap_or_default() - before)
}

fn task(domain: String, problem: String) -> Task {
    let read = read(&Source::new("domain", domain), &Source::new("problem", problem));
    let (domain, problem, _) = read.unwrap_or_else(|found| panic!("{found:?}"));
    ground(&domain, &problem, &GroundConfig::default()).unwrap_or_else(|errors| panic!("{errors:?}"))
}

/// A ring of places. Moving requires `k` functions with `m` designs each.
fn ring(places: usize, k: usize, m: usize) -> (String, String) {
    let all = |part: &dyn Fn(usize) -> String| (0..k).map(part).collect::<Vec<_>>().join(" ");
    let energy = all(&|i| format!("(energy ?fd{i})"));
    let domain = format!(
        "(define (domain ring) (:types place function design)
          (:predicates (at ?p - place) (way ?a ?b - place) (needs {}) (fd_solve_f ?d - design ?f - function)
            (fd_available ?d - design))
          (:functions (battery) (total-cost) (energy ?d - design) (distance ?a ?b - place))
          (:action go :parameters ({} {} ?a ?b - place)
            :precondition (and (at ?a) (way ?a ?b) (needs {}) {} (>= (battery) (* (distance ?a ?b) (+ 0 {energy}))))
            :effect (and (not (at ?a)) (at ?b) (decrease (battery) (* (distance ?a ?b) (+ 0 {energy})))
              (increase (total-cost) (* (distance ?a ?b) (+ 0 {energy}))))))",
        all(&|i| format!("?f{i} - function")),
        all(&|i| format!("?f{i} - function")),
        all(&|i| format!("?fd{i} - design")),
        all(&|i| format!("?f{i}")),
        all(&|i| format!("(fd_solve_f ?fd{i} ?f{i}) (fd_available ?fd{i})")),
    );
    let mut objects = String::new();
    let mut init =
        format!("(at p0) (= (battery) 100000) (= (total-cost) 0) (needs {})", all(&|i| format!("f{i}")));
    for place in 0..places {
        let _ = write!(objects, " p{place} - place");
        let next = (place + 1) % places;
        let _ = write!(init, " (way p{place} p{next}) (= (distance p{place} p{next}) {})", 1 + place % 3);
    }
    for function in 0..k {
        let _ = write!(objects, " f{function} - function");
        for design in 0..m {
            let name = format!("d{function}_{design}");
            let _ = write!(objects, " {name} - design");
            let _ = write!(
                init,
                " (fd_solve_f {name} f{function}) (fd_available {name}) (= (energy {name}) {})",
                1 + design
            );
        }
    }
    let problem = format!(
        "(define (problem p) (:domain ring) (:objects{objects}) (:init {init}) (:goal (at p{})) (:metric minimize (total-cost)))",
        places - 1
    );
    (domain, problem)
}

#[test]
fn ground_size_is_linear_in_the_number_of_functions() {
    let sizes: Vec<_> = (1..=4)
        .map(|k| {
            let (domain, problem) = ring(12, k, 6);
            let task = task(domain, problem);
            assert_eq!(task.operator_count(), 12, "k = {k}");
            // The length of the debug text approximates the memory use.
            format!("{task:?}").len()
        })
        .collect();
    let steps: Vec<_> = sizes.windows(2).map(|pair| pair[1] - pair[0]).collect();
    println!("sizes for k = 1 to 4: {sizes:?}");
    let (least, most) = (steps.iter().min().copied(), steps.iter().max().copied());
    assert!(most.zip(least).is_some_and(|(most, least)| most * 10 <= least * 11), "{sizes:?}");
}

fn large_problem(bytes: usize) -> String {
    let mut text = String::from("(define (problem large) (:domain d)\n  (:objects");
    let places = 1000;
    for place in 0..places {
        let _ = write!(text, " waypoint_{place}");
    }
    text.push_str(" - place)\n  (:init\n");
    let mut number = 0_usize;
    while text.len() < bytes {
        let (from, to) = (number % places, (number / places * 7 + number) % places);
        let _ = writeln!(text, "    (link waypoint_{from} waypoint_{to} n{})", number / places);
        let _ = writeln!(
            text,
            "    (= (distance waypoint_{from} waypoint_{to} n{}) {}.25)",
            number / places,
            number % 97
        );
        number += 1;
    }
    let levels: Vec<_> = (0..=number / places).map(|level| format!("n{level}")).collect();
    let _ = write!(text, "  )\n  (:goal (link waypoint_0 waypoint_1 n0)))");
    text.replacen(" - place)", &format!(" {} - place)", levels.join(" ")), 1)
}

const LARGE_DOMAIN: &str = "(define (domain d) (:types place) (:predicates (link ?a ?b ?c - place))
  (:functions (distance ?a ?b ?c - place)))";

#[test]
#[ignore = "measures; in release"]
fn ten_megabytes_are_read_in_less_than_a_second() {
    let problem = Source::new("problem", large_problem(10_000_000));
    let domain = Source::new("domain", LARGE_DOMAIN);
    let (parsed, seconds) = timed(|| pddl::parse_problem(&problem));
    assert!(parsed.1.is_empty(), "{:?}", parsed.1.first());
    let (found, with_check) = timed(|| read(&domain, &problem));
    assert!(found.is_ok_and(|(_, _, found)| found.is_empty()));
    println!(
        "{} bytes: parsed in {seconds:.2} s, parsed and checked in {with_check:.2} s of CPU",
        problem.text().len()
    );
    assert!(with_check < 1.0, "{with_check} s");
}

/// CPU time of the translator of Fast Downward in seconds, or `None` if it fails or does not finish
/// in time.
fn translator(python: &str, directory: &Path, name: &str) -> Option<f64> {
    let script = "import resource, subprocess, sys
command = [sys.executable, '-m', 'fast_downward.translate', *sys.argv[1:3]]
try:
    subprocess.run(command, check=True, timeout=600, stdout=subprocess.DEVNULL)
except subprocess.TimeoutExpired: sys.exit('no end within 600 s')
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(used.ru_utime + used.ru_stime)";
    let file = |kind: &str| format!("{name}.{kind}.pddl");
    let output = Command::new(python)
        .args(["-c", script, &file("domain"), &file("problem")])
        .current_dir(directory)
        .output()
        .expect("Python starts");
    let text = String::from_utf8_lossy(&output.stdout);
    let seconds = text.trim().parse().ok();
    if seconds.is_none() {
        println!("{name}: the translator fails: {}", String::from_utf8_lossy(&output.stderr));
    }
    seconds
}

/// Tests the largest instances, for which the speed-up is asserted, and smaller instances for comparison. The
/// environment variable `METAPLAN_PEERS` must name a Python with the translator (`python3 -m venv peers;
/// peers/bin/pip install up-fast-downward`, then `METAPLAN_PEERS=peers/bin/python`).
#[test]
#[ignore = "measures beside a peer; in release"]
fn reading_and_grounding_compared_with_the_translator_of_fast_downward() {
    let Ok(python) = std::env::var("METAPLAN_PEERS") else { panic!("METAPLAN_PEERS names no Python") };
    let Some(tool) = data("tools/gen_ratpa.py") else { return };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("speed");
    std::fs::create_dir_all(&folder).expect("a folder");
    let rows = [
        (200, 12, 2, "c"),
        (200, 12, 2, "n"),
        (200, 12, 2, "o"),
        (200, 12, 2, "f"),
        (200, 12, 2, "b"),
        (200, 12, 1, "c"),
        (200, 12, 1, "b"),
        (50, 6, 2, "c"),
        (50, 6, 1, "c"),
        (50, 6, 1, "b"),
    ];
    let mut slow = Vec::new();
    for (n, m, k, encoding) in rows {
        let name = format!("ugv-{n}-{m}-{k}");
        let large = (n, m, k) == (200, 12, 2);
        let [n, m, k] = [n, m, k].map(|number: usize| number.to_string());
        let arguments =
            [["--n", &n, "--m", &m], ["--k", &k, "--enc", encoding], ["--name", &name, "--seed", "1"]];
        let made = Command::new("python3")
            .arg(&tool)
            .args(arguments.as_flattened())
            .arg("--out")
            .arg(&folder)
            .output();
        assert!(made.is_ok_and(|made| made.status.success()), "the script makes {name}");
        let name = format!("{name}.{encoding}");
        let text =
            |kind: &str| std::fs::read_to_string(folder.join(format!("{name}.{kind}.pddl"))).expect("a file");
        let (domain, problem) = (text("domain"), text("problem"));
        // Small problems are repeated, because the system measures time in ticks.
        let runs = if problem.len() < 200_000 { 100 } else { 1 };
        let again = || (1..runs).for_each(|_| drop(task(domain.clone(), problem.clone())));
        let (task, seconds) = timed(|| {
            again();
            task(domain.clone(), problem.clone())
        });
        let ours = seconds / f64::from(runs);
        let peer = translator(&python, &folder, &name);
        let ratio = peer.map_or("the translator does not end".to_owned(), |peer| {
            format!("{peer:.2} s, ratio {:.0}", peer / ours)
        });
        println!(
            "{name}: {} operators, {ours:.3} s; Fast Downward's translator {ratio}",
            task.operator_count()
        );
        if large && peer.is_some_and(|peer| peer < 20.0 * ours) {
            slow.push(format!("{name}: {ratio}"));
        }
    }
    assert!(slow.is_empty(), "{slow:?}");
}
