//! Benchmark: slowdown of planning, certifying and verifying if all numbers of a mission are
//! replaced by decimals of 16 significant digits.
//!
//! The missions come from a script in the test data (needs python3). Distances are multiplied by
//! square roots. A decimal is added to the charge and the capacity of the battery. Other numbers
//! are multiplied by decimals. Consumption does not grow, so a solvable mission remains solvable.
//! The factors are close to 1, so that the same designs can be used.
//!
//! There are two variants. The factors in the domain (weights of the metric) remain integers, or
//! they become decimals as well. Products of three numbers of 16 digits exceed the planner's
//! integers, so the second variant is planned with rational numbers.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use test_resources::{data, python};

const DIGITS: usize = 16;
const MISSIONS: usize = 50;
/// Variants: name, whether the factors in the domain (weights of the metric) are replaced as well, and the maximum
/// slowdown (geometric mean).
const KINDS: [(&str, bool, f64); 2] = [("decimals", false, 3.0), ("all", true, 3.0)];
/// Exit status that is shown for a proved plan without a certificate.
const NO_CERTIFICATE: i32 = 120;
/// Lower limit of a measured time in seconds. Below it, the start of the process dominates.
const MIN_SECONDS: f64 = 0.002;

/// Returns a pseudorandom number in [0, 1) that depends only on `name` (FNV hash with a final mix).
fn fraction(name: &str) -> f64 {
    let hash = name.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    ((hash ^ (hash >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 11) as f64 / (1_u64 << 53) as f64
}

fn written(value: f64) -> String {
    let integer_digits = value.log10().floor() as i64 + 1;
    format!("{value:.digits$}", digits = (DIGITS as i64 - integer_digits).max(0) as usize)
}

fn magnified(function: &str, arguments: &[&str], value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    // A distance is the same in both directions, so the order of the places is ignored.
    let mut sorted = arguments.to_vec();
    if function == "dist" {
        sorted.sort_unstable();
    }
    let fraction_of_name = fraction(&format!("{function} {}", sorted.join(" ")));
    written(match function {
        "dist" => value * (1.0 - fraction_of_name / 20.0).sqrt(),
        // Battery and capacity grow by the same number, so that recharging still fills the battery.
        "battery" | "capacity" => value + fraction("battery") / 4.0,
        "visibility" => value * (1.0 + fraction_of_name / 50.0),
        _ => value * (1.0 - fraction_of_name / 50.0),
    })
}

fn problem(text: &str) -> String {
    let mut parts = text.split("(= (");
    let mut magnified_text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (call, remainder) = part.split_once(") ").expect("a value follows a function");
        let (number, remainder) = remainder.split_once(')').expect("a value ends");
        let mut names = call.split(' ');
        let function = names.next().expect("a function");
        let value = magnified(function, &names.collect::<Vec<_>>(), number.parse().expect("a number"));
        let _ = write!(magnified_text, "(= ({call}) {value}){remainder}");
    }
    magnified_text
}

/// Replaces in the text of a domain the value to which the battery is charged and, with `factors`, all other
/// numbers.
fn domain(text: &str, factors: bool) -> String {
    let mut words = Vec::new();
    for (position, word) in text.split(' ').enumerate() {
        let digits = word.trim_end_matches([')', '\n']);
        let suffix = &word[digits.len()..];
        match digits.parse::<f64>() {
            Ok(value) if factors || words.last().is_some_and(|word| word == "(battery)") => {
                let charged = words.last().is_some_and(|word| word == "(battery)");
                let function = if charged { "battery".to_owned() } else { format!("factor {position}") };
                words.push(magnified(&function, &[], value) + suffix);
            }
            _ => words.push(word.to_owned()),
        }
    }
    words.join(" ")
}

/// Exit status, and processor time in seconds.
struct Run {
    status: i32,
    time: f64,
}

/// Unless `once`, a run under 1 s is repeated twice, and the median counts.
fn run(arguments: &[&str], once: bool) -> Run {
    let script = "import resource as r, subprocess as s, sys\n\
        def once():\n \
        u = lambda: sum(r.getrusage(r.RUSAGE_CHILDREN)[:2])\n \
        t = u()\n \
        c = s.run(sys.argv[2:], stdout=s.DEVNULL, stderr=s.DEVNULL).returncode\n \
        return u() - t, c\n\
        runs = [once()]\n\
        if runs[0][0] < 1 and sys.argv[1] == 'thrice': runs += [once(), once()]\n\
        print(*sorted(runs)[len(runs) // 2])";
    let mut python = Command::new("python3");
    let times = if once { "once" } else { "thrice" };
    python.args(["-c", script, times, env!("CARGO_BIN_EXE_metaplan")]).args(arguments);
    let output = python.output().expect("python3 runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let (time, status) = text.trim().split_once(' ').unwrap_or_else(|| panic!("{output:?}"));
    Run { status: status.parse().expect("a status"), time: time.parse().expect("a time") }
}

fn plan_arguments(directory: &Path, name: &str) -> [String; 6] {
    let file = |part: &str| directory.join(format!("{name}.{part}.pddl")).display().to_string();
    let [plan, quiet, limit, seconds] = ["plan", "--quiet", "--time-limit", "60"].map(str::to_owned);
    [plan, quiet, limit, seconds, file("domain"), file("problem")]
}

fn all_runs(directory: &Path, name: &str) -> [Run; 3] {
    let certificate = directory.join(format!("{name}.certificate")).display().to_string();
    let _ = std::fs::remove_dir_all(&certificate);
    let arguments = plan_arguments(directory, name);
    let plan = arguments.each_ref().map(String::as_str);
    let planned = run(&plan, false);
    let mut certified = run(&[&plan[..], &["--certificate", &certificate]].concat(), true);
    if certified.status == 0 && !Path::new(&certificate).exists() {
        certified.status = NO_CERTIFICATE;
    }
    let verified = run(&["verify", &certificate], false);
    [planned, certified, verified]
}

/// Parameters: family, places or pipelines, designs, functions, goals, seed.
fn sizes() -> Vec<[usize; 6]> {
    let mut sizes = Vec::new();
    for seed in 1..=4 {
        for (places, designs, functions, goals) in [
            (10, 6, 1, 1),
            (10, 3, 2, 2),
            (20, 6, 1, 2),
            (20, 12, 2, 1),
            (30, 6, 3, 1),
            (50, 6, 1, 1),
            (50, 12, 1, 2),
            (80, 6, 2, 1),
        ] {
            sizes.push([0, places, designs, functions, goals, seed]);
        }
        for (pipelines, designs, functions) in [(1, 6, 2), (2, 6, 1), (3, 6, 2), (3, 3, 1)] {
            sizes.push([1, pipelines, designs, functions, 1, seed]);
        }
    }
    sizes.push([0, 100, 6, 2, 1, 1]);
    sizes.push([0, 200, 6, 1, 1, 1]);
    sizes.truncate(MISSIONS);
    sizes
}

/// Returns the name of the mission; `None` if python3 does not start.
fn generate(tool: &Path, directory: &Path, size: &[usize; 6], encoding: &str) -> Option<String> {
    let [family, n, m, k, goals, seed] = size;
    let family = ["ugv", "uuv"][*family];
    let name = format!("{family}-n{n}-m{m}-k{k}-g{goals}-s{seed}");
    let mut python = Command::new("python3");
    python
        .arg(tool)
        .args(["--family", family, "--enc", encoding, "--name", &name])
        .arg("--out")
        .arg(directory);
    for (option, value) in [("--n", n), ("--m", m), ("--k", k), ("--goals", goals), ("--seed", seed)] {
        python.arg(option).arg(value.to_string());
    }
    let output = python.output().ok()?;
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    let name = format!("{name}.{encoding}");
    let read = |part: &str| {
        std::fs::read_to_string(directory.join(format!("{name}.{part}.pddl")))
            .expect("the tool has written it")
    };
    for (kind, factors, _) in KINDS {
        let texts = [("domain", domain(&read("domain"), factors)), ("problem", problem(&read("problem")))];
        for (part, text) in texts {
            std::fs::write(directory.join(format!("{name}.{kind}.{part}.pddl")), text).expect("a file");
        }
    }
    Some(name)
}

fn geometric_mean(ratios: &[f64]) -> f64 {
    (ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / ratios.len().max(1) as f64).exp()
}

#[test]
#[allow(clippy::print_stdout)]
#[ignore = "plans, certifies and verifies 150 missions: minutes, and only a release build says something"]
fn decimals_slow_planning_by_a_bounded_factor() {
    let (Some(tool), Some(_)) = (data("tools/gen_ratpa.py"), python()) else { return };
    let temporary = tempfile::tempdir().expect("a temporary directory");
    // `ORACLE_SAVE` preserves the missions and certificates.
    let directory = std::env::var_os("ORACLE_SAVE").map_or(temporary.path().to_owned(), PathBuf::from);
    let mut ratios = [const { [const { Vec::new() }; 3] }; KINDS.len()];
    let mut failures = Vec::new();
    println!(
        "mission, kind | planning: integers, decimals, ratio | certifying | verifying; processor time in seconds"
    );
    for (position, size) in sizes().iter().enumerate() {
        let encoding = ["n", "f"][position % 2];
        let Some(name) = generate(&tool, &directory, size, encoding) else { continue };
        let whole = all_runs(&directory, &name);
        for ((kind, ..), ratios) in KINDS.iter().zip(&mut ratios) {
            let digits = all_runs(&directory, &format!("{name}.{kind}"));
            let mut line = format!("{name} {kind}");
            for ((whole, digits), ratios) in whole.iter().zip(&digits).zip(ratios) {
                let ratio = digits.time.max(MIN_SECONDS) / whole.time.max(MIN_SECONDS);
                let _ = write!(line, " | {:.3} {:.3} {ratio:.2}", whole.time, digits.time);
                // A refused mission has no meaningful time, so its ratio is not counted.
                if (whole.status, digits.status) == (0, 0) {
                    ratios.push(ratio);
                } else {
                    let _ = write!(line, " (status {} {})", whole.status, digits.status);
                }
            }
            println!("{line}");
            if digits.iter().any(|run| run.status != 0) {
                failures.push(line);
            }
        }
    }
    let means = ratios.each_ref().map(|kind| kind.each_ref().map(|ratios| geometric_mean(ratios)));
    for (((kind, ..), ratios), means) in KINDS.iter().zip(&ratios).zip(&means) {
        let [planning, certifying, verifying] = means;
        let counts = ratios.each_ref().map(Vec::len);
        println!(
            "geometric means of {kind} over integers: planning {planning:.2}, certifying {certifying:.2}, verifying {verifying:.2} ({counts:?} missions)"
        );
    }
    assert!(failures.is_empty(), "not planned, certified and verified:\n{}", failures.join("\n"));
    for ((kind, _, max_ratio), means) in KINDS.iter().zip(&means) {
        assert!(
            means.iter().all(|mean| mean <= max_ratio),
            "{kind} take more than {max_ratio} times as long: {means:?}"
        );
    }
}

#[test]
fn numbers_are_magnified_in_place() {
    let text =
        "(:init (= (dist w1 w2) 3) (= (dist w2 w1) 3)\n (charger w1) (= (total-cost) 0) (= (battery) 60))";
    let new = problem(text);
    let values: Vec<&str> =
        new.split("(= (dist w").skip(1).filter_map(|part| part.split([' ', ')']).nth(3)).collect();
    assert!(new.contains("(charger w1) (= (total-cost) 0)"), "{new}");
    assert!(values.len() == 2 && values[0] == values[1] && values[0].len() == DIGITS + 1, "{values:?} {new}");
    assert!(domain("(assign (battery) 60) (* 2 (x))\n)", false).contains("(assign (battery) 60."));
    assert_eq!(written(0.5), "0.5000000000000000");
    assert_eq!(written(60.25), "60.25000000000000");
}
