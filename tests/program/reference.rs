//! Exact optima of generated instances, known from several planners and an exact oracle.
//!
//! `cargo test --release --test program reference -- --ignored --nocapture` prints one line for each instance: its name, the cost,
//! what proves it, and the time of the whole program; then how long the same takes with a certificate, and verifying that. Needs python3 (its standard library only) for the generators.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use crate::common::metaplan_in;
use crate::real::shared;

/// The rows of a table with a header, each as a look-up by column name.
fn table(file: &Path) -> Vec<Vec<(String, String)>> {
    let text = std::fs::read_to_string(file).expect("the table");
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let header = lines.next().expect("a header");
    lines.map(|row| header.iter().cloned().zip(row).collect()).collect()
}

fn cell<'a>(row: &'a [(String, String)], column: &str) -> &'a str {
    row.iter().find(|(name, _)| name == column).map_or("", |(_, value)| value)
}

fn generate(script: &Path, arguments: &[&str]) {
    let output = Command::new("python3").arg(script).args(arguments).output().expect("python3 runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Plans an instance; the cost, or the status where there is no plan, and a line about it.
fn plan(directory: &Path, name: &str) -> (String, String) {
    let started = Instant::now();
    let (domain, problem) = (format!("{name}.domain.pddl"), format!("{name}.problem.pddl"));
    let outcome = metaplan_in(
        directory,
        &["plan", &domain, &problem, "--format", "json", "--quiet", "--time-limit", "60"],
        "",
    );
    let answer = outcome.json();
    let status = answer["status"].as_str().expect("a status").to_owned();
    let result = if status == "optimal" { answer["cost"].to_string() } else { status };
    let seconds = started.elapsed().as_secs_f64();
    let line = format!(
        "{name} {result} by {} in {seconds:.2} s, {}",
        answer["proof"]["by"].as_str().unwrap_or("nothing"),
        verified(directory, name)
    );
    (result, line)
}

/// Plans once more with a certificate, and verifies it; what that takes.
fn verified(directory: &Path, name: &str) -> String {
    let (domain, problem) = (format!("{name}.domain.pddl"), format!("{name}.problem.pddl"));
    let certificate = format!("{name}.certificate");
    let started = Instant::now();
    let arguments = ["plan", &domain, &problem, "--quiet", "--certificate", &certificate];
    let planned = metaplan_in(directory, &arguments, "");
    let planning = started.elapsed().as_secs_f64();
    assert!(directory.join(&certificate).exists(), "{name}: no certificate: {planned:#?}");
    let started = Instant::now();
    let outcome = metaplan_in(directory, &["verify", &certificate], "");
    let verifying = started.elapsed().as_secs_f64();
    assert_eq!(outcome.status, 0, "{name}: {outcome:#?}");
    let argument = outcome.stdout.lines().find(|line| line.starts_with("argument")).unwrap_or_default();
    format!(
        "certified in {planning:.2} s, verified in {verifying:.2} s ({:.1}): {argument}",
        verifying / planning
    )
}

#[allow(clippy::print_stdout)]
fn report(lines: &[(String, String, String)]) {
    let mut text = String::new();
    for (_, _, line) in lines {
        let _ = writeln!(text, "{line}");
    }
    println!("{text}");
    let wrong: Vec<_> = lines.iter().filter(|(found, expected, _)| found != expected).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
#[ignore = "takes a minute in a release build, and needs python3"]
fn generated_missions() {
    let Some(shared) = shared() else { return };
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().display().to_string();
    let mut lines = Vec::new();
    for row in table(&shared.join("reference/optimal_costs.csv")) {
        let name = cell(&row, "name");
        let mut arguments = vec!["--enc", "c,n", "--out", &out, "--name", name];
        for option in ["family", "n", "m", "k", "seed", "goals", "reconf", "metric"] {
            let value = cell(&row, option);
            if !value.is_empty() {
                let flag = ["--family", "--n", "--m", "--k", "--seed", "--goals", "--reconf", "--metric"];
                arguments
                    .extend([flag.into_iter().find(|flag| &flag[2..] == option).expect("a flag"), value]);
            }
        }
        generate(&shared.join("tools/gen_ratpa.py"), &arguments);
        for (encoding, column) in [("c", "optimal_cost_c"), ("n", "optimal_cost_bnfo")] {
            let (found, line) = plan(directory.path(), &format!("{name}.{encoding}"));
            lines.push((found, cell(&row, column).to_owned(), line));
        }
    }
    report(&lines);
}

#[test]
#[ignore = "takes a minute in a release build, and needs python3"]
fn missions_with_a_battery_that_binds() {
    let Some(shared) = shared() else { return };
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().display().to_string();
    let summary = shared.join("reference/p2cp3_summary.json").display().to_string();
    let mut lines = Vec::new();
    for row in table(&shared.join("reference/camara_pairs.csv")) {
        let (start, goal, battery, fail) =
            (cell(&row, "start"), cell(&row, "goal"), cell(&row, "battery_mj"), cell(&row, "fail"));
        let mut arguments = vec![summary.as_str(), "--start", start, "--goal", goal, "--battery", battery];
        arguments.extend(["--fail", fail, "--out", &out, "--no-oracle"]);
        generate(&shared.join("tools/gen_camara.py"), &arguments);
        let suffix = if fail.is_empty() { String::new() } else { format!("_no_{}", fail.replace(' ', "_")) };
        let (found, line) = plan(directory.path(), &format!("camara_{start}_{goal}_b{battery}{suffix}"));
        lines.push((found, cell(&row, "optimal_time_ms").to_owned(), line));
    }
    report(&lines);
}
