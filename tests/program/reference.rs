//! Benchmark with the shipped missions, and with generated instances, whose optima are known from several planners
//! and an exact oracle.
//!
//! `cargo test --release --test program reference -- --ignored --nocapture --test-threads 1` prints one line
//! per instance. It contains name, cost, kind of proof, and processor time of the program. Then it contains
//! the time with a certificate, and the time of verification, which must be at most ten times the time of
//! planning. Needs python3 (standard library only) for generators and measurement.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use test_resources::{data, python};

use crate::common::{metaplan_in, processor_time, root};

fn table(file: &Path) -> Vec<Vec<(String, String)>> {
    let text = std::fs::read_to_string(file).expect("the table");
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let header = lines.next().expect("a header");
    lines.map(|row| header.iter().cloned().zip(row).collect()).collect()
}

fn cell<'a>(row: &'a [(String, String)], column: &str) -> &'a str {
    row.iter().find(|(name, _)| name == column).map_or("", |(_, value)| value)
}

fn generate(python: &Path, script: &Path, arguments: &[&str]) {
    let output = Command::new(python).arg(script).args(arguments).output().expect("python3 runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[derive(Debug)]
struct Row {
    /// Cost of the plan, or the status if there is no plan.
    result: String,
    expected: String,
    line: String,
    /// Processor times in seconds.
    planning: f64,
    verifying: f64,
}

fn row_of_files(directory: &Path, name: &str, expected: &str) -> Row {
    let files = [format!("{name}.domain.pddl"), format!("{name}.problem.pddl")];
    let arguments = ["plan", &files[0], &files[1], "--quiet"];
    row(directory, name, &arguments, &directory.join("certificate"), expected)
}

fn row(directory: &Path, name: &str, arguments: &[&str], certificate: &Path, expected: &str) -> Row {
    let answer = metaplan_in(directory, &[arguments, &["--format", "json"]].concat(), "").json();
    let status = answer["status"].as_str().expect("a status").to_owned();
    let result = if status == "optimal" { answer["cost"].to_string() } else { status };
    let proof_kind = answer["proof"]["by"].as_str().unwrap_or("nothing");
    let name = format!("{name} {result} by {proof_kind}");
    let mut row = timed(directory, &name, arguments, &certificate.display().to_string());
    std::fs::remove_dir_all(certificate).expect("a certificate");
    row.result = result;
    expected.clone_into(&mut row.expected);
    row
}

fn timed(directory: &Path, name: &str, arguments: &[&str], certificate: &str) -> Row {
    let planning = processor_time(directory, arguments);
    let started = Instant::now();
    let planned = metaplan_in(directory, &[arguments, &["--certificate", certificate]].concat(), "");
    let certifying = started.elapsed().as_secs_f64();
    assert!(Path::new(certificate).exists(), "{name}: no certificate: {planned:#?}");
    let outcome = metaplan_in(directory, &["verify", certificate], "");
    assert_eq!(outcome.status, 0, "{name}: {outcome:#?}");
    let verifying = processor_time(directory, &["verify", certificate]);
    let summary_lines = outcome
        .stdout
        .lines()
        .filter(|line| ["argument", "formula"].iter().any(|part| line.starts_with(part)));
    let line = format!(
        "{name} in {planning:.4} s, certified in {certifying:.2} s, verified in {verifying:.4} s ({:.1}): {}",
        verifying / planning,
        summary_lines.collect::<Vec<_>>().join("; ")
    );
    Row { result: String::new(), expected: String::new(), line, planning, verifying }
}

/// Prints the results and asserts that the costs are right. In release builds, verification must take at most
/// ten times as long as planning, or at most half a second.
#[allow(clippy::print_stdout)]
fn report(rows: &[Row]) {
    let mut text = String::new();
    for row in rows {
        let _ = writeln!(text, "{}", row.line);
    }
    let mut ratios: Vec<f64> = rows.iter().map(|row| row.verifying / row.planning).collect();
    ratios.sort_by(f64::total_cmp);
    let sum = |time: fn(&Row) -> f64| rows.iter().map(time).sum::<f64>();
    let _ = writeln!(
        text,
        "{} instances: planning {:.2} s, verifying {:.2} s; verifying takes {:.1} times as long in the median, {:.1} at worst",
        rows.len(),
        sum(|row| row.planning),
        sum(|row| row.verifying),
        ratios[ratios.len() / 2],
        ratios[ratios.len() - 1]
    );
    println!("{text}");
    let unexpected: Vec<_> = rows.iter().filter(|row| row.result != row.expected).collect();
    assert!(unexpected.is_empty(), "{unexpected:#?}");
    let slow: Vec<_> = rows.iter().filter(|row| row.verifying > (10.0 * row.planning).max(0.5)).collect();
    assert!(cfg!(debug_assertions) || slow.is_empty(), "{slow:#?}");
}

#[test]
#[ignore = "measures times, in a release build; needs python3"]
fn shipped_missions() {
    let directory = tempfile::tempdir().expect("a directory");
    let certificate = directory.path().join("certificate");
    let missions: [(&[&str], &str); 12] = [
        (&["missions/camara_like.toml"], "100.61"),
        (&["missions/camara_like.toml", "--scenario", "kinect_failure"], "100.61"),
        (&["missions/ugv.toml"], "408"),
        (&["missions/ugv.toml", "--scenario", "kinect_failure"], "412"),
        (&["missions/ugv.toml", "--scenario", "bright_sun"], "516"),
        (&["missions/ugv_plain.toml"], "408"),
        (&["missions/ugv_plain.toml", "--scenario", "kinect_failure"], "412"),
        (&["missions/uuv.toml"], "28"),
        (&["missions/uuv.toml", "--scenario", "battery_drop"], "60"),
        (&["missions/uuv.toml", "--scenario", "murky_water"], "40"),
        (&["missions/uuv_plain.toml"], "28"),
        (&["missions/uuv.toml", "--set", "battery=3"], "unsolvable"),
    ];
    let measured = missions.map(|(mission, expected)| {
        let arguments = [&["plan", "--quiet"], mission].concat();
        row(&root(), &mission.join(" "), &arguments, &certificate, expected)
    });
    report(&measured);
}

#[test]
#[ignore = "takes a minute in a release build, and needs python3"]
fn generated_missions() {
    let (Some(costs), Some(script), Some(python)) =
        (data("reference/optimal_costs.csv"), data("tools/gen_ratpa.py"), python())
    else {
        return;
    };
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().display().to_string();
    let mut rows = Vec::new();
    for line in table(&costs) {
        let name = cell(&line, "name");
        let mut arguments = vec!["--enc", "c,n", "--out", &out, "--name", name];
        for option in ["family", "n", "m", "k", "seed", "goals", "reconf", "metric"] {
            let value = cell(&line, option);
            if !value.is_empty() {
                let flag = ["--family", "--n", "--m", "--k", "--seed", "--goals", "--reconf", "--metric"];
                arguments
                    .extend([flag.into_iter().find(|flag| &flag[2..] == option).expect("a flag"), value]);
            }
        }
        generate(&python, &script, &arguments);
        for (encoding, column) in [("c", "optimal_cost_c"), ("n", "optimal_cost_bnfo")] {
            rows.push(row_of_files(directory.path(), &format!("{name}.{encoding}"), cell(&line, column)));
        }
    }
    report(&rows);
}

#[test]
#[ignore = "takes a minute in a release build, and needs python3"]
fn missions_with_a_limiting_battery() {
    let (Some(summary), Some(pairs), Some(script), Some(python)) = (
        data("reference/p2cp3_summary.json"),
        data("reference/camara_pairs.csv"),
        data("tools/gen_camara.py"),
        python(),
    ) else {
        return;
    };
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().display().to_string();
    let summary = summary.display().to_string();
    let mut rows = Vec::new();
    for line in table(&pairs) {
        let (start, goal, battery, fail) =
            (cell(&line, "start"), cell(&line, "goal"), cell(&line, "battery_mj"), cell(&line, "fail"));
        let mut arguments = vec![summary.as_str(), "--start", start, "--goal", goal, "--battery", battery];
        arguments.extend(["--fail", fail, "--out", &out, "--no-oracle"]);
        generate(&python, &script, &arguments);
        let suffix = if fail.is_empty() { String::new() } else { format!("_no_{}", fail.replace(' ', "_")) };
        let name = format!("camara_{start}_{goal}_b{battery}{suffix}");
        rows.push(row_of_files(directory.path(), &name, cell(&line, "optimal_time_ms")));
    }
    report(&rows);
}
