//! Writes certificates for the planner's claims and verifies the certificates.

use std::fs;
use std::path::{Path, PathBuf};

use metaplan::certificate::{self, Contents, Ground};
use metaplan::mission::Mission;
use num_rational::BigRational;
use pddl::ast::{InitialElement, Metric, Problem};
use planner::{Exact, ExactTask, Limits, Point, Solution, Status, Task};
use verify::digest::digest;
use verify::front::member_directory;
use verify::manifest::{FRONT, File, Front, FrontManifest};

use crate::judge::{Case, Tally, Truth, compare, plan_lines, rational, steps_of};

#[derive(Debug)]
pub enum Planned {
    Integers(Box<Task>),
    Exact(Box<ExactTask>),
}

fn without_names(message: &str) -> String {
    let mut depth = 0_usize;
    let mut outside = String::new();
    for character in message.chars() {
        match character {
            '(' => depth += 1,
            ')' => depth = depth.saturating_sub(1),
            _ if depth == 0 => outside.push(character),
            _ => {}
        }
    }
    outside
}

/// Writes and verifies a certificate for a claim of optimality or unsolvability. Verification must
/// fail if the oracle refutes the claim, and succeed otherwise. Exceeded limits, and claims without
/// a certificate, are only counted.
pub fn check(
    case: &Case,
    (mission, problem): (&Mission, &Problem),
    task: &Planned,
    solution: &Solution,
    tally: &mut Tally,
) {
    if !matches!(solution.status, Status::Optimal | Status::Unsolvable) {
        return;
    }
    let parent = tempfile::tempdir().expect("a temporary directory");
    let directory = parent.path().join("certificate");
    let plan = solution.plan.as_ref().map_or_else(String::new, |plan| plan_lines(&steps_of(plan)));
    let task = match task {
        Planned::Integers(task) => Ground::Integers(task),
        Planned::Exact(task) => Ground::Exact(task),
    };
    let contents = Contents { mission, problem, task, solution, plan: &plan };
    let limits = || Limits::none().with_time(case.limit);
    if let Err(message) = certificate::write(&directory, &contents, &limits()) {
        // Names are specific to a task. Without them, equal reasons are counted together.
        return tally.count(format!("{}: {:.120}", message.code, without_names(&message.message)));
    }
    // The time limit is generous, because a busy machine must not make verification fail.
    let limits = Limits::none().with_time(30 * case.limit);
    let report = certificate::Verifier::new(&directory).stop(|| limits.reached()).verify();
    // A claim is false if it contradicts the oracle; an optimum worse than a known plan is one such case.
    let refuted = match (&case.truth, &solution.plan) {
        (Truth::Best(best, _), Some(plan)) => rational(&plan.cost) != *best,
        (Truth::Open(Some((incumbent, _))), Some(plan)) => {
            compare(case.maximize, incumbent, &rational(&plan.cost)).is_lt()
        }
        (Truth::NoPlan, None) | (Truth::Open(None), _) => false,
        (Truth::NoPlan, Some(_)) | (Truth::NoBest(..), _) | (Truth::Best(..) | Truth::Open(_), None) => true,
    };
    let failing_part = report.parts.iter().find_map(|part| Some((part.part, part.result.as_ref().err()?)));
    match (failing_part, refuted) {
        (None, true) => tally.fail(case, "A FALSE CLAIM IS VERIFIED", &format!("{:?}", report.claim)),
        (None, false) => {
            let is_timed = problem.init.iter().any(|element| matches!(element, InitialElement::Timed(..)));
            tally.count(if is_timed { "certificate: verified, timed" } else { "certificate: verified" });
        }
        (Some((part, reason)), true) => {
            tally.count(format!("certificate of a false claim fails: {part}: {reason:.40}"));
        }
        (Some(("limits", _)), false) => tally.count("certificate: limit"),
        (Some((part, reason)), false) => {
            tally.fail(case, "a true claim is not verified", &format!("{part}: {reason}"));
        }
    }
}

/// Writes and verifies a certificate of a front. The front must be complete unless `is_wrong`, and then the
/// verification must fail. From the files of a complete front, makes and verifies false fronts, which must all be
/// rejected. With the environment variable `ORACLE_FRONTS`, all certificates are saved in this directory: the first
/// one in a folder `true`, even if the front is wrong, and the others in folders `false-N`.
pub fn check_front(
    case: &Case,
    (mission, problem): (&Mission, &Problem),
    objectives: &[Metric; 2],
    (points, is_wrong): (&[Point], bool),
    tally: &mut Tally,
) {
    let temporary = tempfile::tempdir().expect("a temporary directory");
    let parent = std::env::var_os("ORACLE_FRONTS").map_or_else(|| temporary.path().to_owned(), PathBuf::from);
    let parent = parent.join(case.name.replace('/', "-"));
    let directory = parent.join("true");
    fs::create_dir_all(&parent).expect("a directory");
    let limits = Limits::none().with_time(4 * case.limit);
    if let Err(message) =
        certificate::write_front(&directory, (mission, problem), objectives, points, &limits)
    {
        return tally.count(format!("front: {}: {:.120}", message.code, without_names(&message.message)));
    }
    let verify = |directory: &Path| {
        let limits = Limits::none().with_time(60 * case.limit);
        certificate::Verifier::new(directory).stop(|| limits.reached()).verify()
    };
    let report = verify(&directory);
    match (report.parts.iter().find_map(|part| Some((part.part, part.result.as_ref().err()?))), is_wrong) {
        (None, true) => tally.fail(case, "A FALSE FRONT IS VERIFIED", &format!("{:?}", report.claim)),
        (None, false) => tally.count("front: certificate verified"),
        (Some(_), true) => tally.count("front: certificate of a wrong front fails"),
        (Some((part, reason)), false) => {
            return tally.fail(case, "a true front is not verified", &format!("{part}: {reason}"));
        }
    }
    if is_wrong {
        return;
    }
    let text = fs::read_to_string(directory.join(FRONT)).expect("a front");
    let front = Front::parse(&text).expect("a front");
    for (number, (kind, changed, members)) in false_fronts(&front).into_iter().enumerate() {
        let target = parent.join(format!("false-{number}"));
        forge(&directory, &target, &changed, &members);
        let report = verify(&target);
        if report.verified() {
            tally.fail(case, "A FALSE FRONT IS VERIFIED", &format!("{kind}: {:?}", report.claim));
        }
        tally.count(format!("front: {kind}: rejected"));
    }
}

/// Returns false fronts, each with its kind, and the members of the true certificate that it contains.
fn false_fronts(front: &Front) -> Vec<(&'static str, Front, Vec<usize>)> {
    let count = front.points.len();
    let whole: Vec<usize> = (0..=count).collect();
    let plus = |value: &str, difference: i64| {
        let value: Exact = value.parse().expect("a number");
        Exact::from(value.to_rational() + BigRational::from_integer(difference.into())).to_string()
    };
    let mut changes = Vec::new();
    for position in 0..count {
        if count > 1 {
            let mut changed = front.clone();
            changed.points.remove(position);
            let remaining = whole.iter().copied().filter(|member| *member != position).collect();
            changes.push(("a point is missing", changed.clone(), remaining));
            // The next certificate takes the place of the last one.
            changes.push(("a point is missing", changed, whole.clone()));
        }
        for (objective, difference) in [(0, 1), (0, -1), (1, 1), (1, -1)] {
            let mut changed = front.clone();
            let value = &mut changed.points[position][objective];
            *value = plus(value, difference);
            changes.push(("a value is wrong", changed, whole.clone()));
        }
        for (objective, place) in [(0, position + 1), (1, position)] {
            let mut changed = front.clone();
            let mut dominated = changed.points[position].clone();
            dominated[objective] = plus(&dominated[objective], 1);
            changed.points.insert(place, dominated);
            let mut members = whole.clone();
            members.insert(position, position);
            changes.push(("a point is dominated", changed, members));
        }
        let mut changed = front.clone();
        changed.points.insert(position, front.points[position].clone());
        let mut members = whole.clone();
        members.insert(position, position);
        changes.push(("a point is there twice", changed, members));
    }
    changes
}

/// Writes the certificate of a front from members of another certificate.
fn forge(original: &Path, target: &Path, front: &Front, members: &[usize]) {
    let copy = |from: &Path, to: &Path| {
        fs::create_dir_all(to).expect("a directory");
        for entry in fs::read_dir(from).expect("a directory").map(|entry| entry.expect("an entry")) {
            if entry.path().is_file() {
                fs::copy(entry.path(), to.join(entry.file_name())).expect("a copy");
            }
        }
    };
    copy(original, target);
    for (place, member) in members.iter().enumerate() {
        copy(&member_directory(original, *member), &member_directory(target, place));
    }
    let text = front.text();
    let manifest = target.join("manifest.json");
    let mut document: FrontManifest =
        serde_json::from_str(&fs::read_to_string(&manifest).expect("a manifest")).expect("JSON");
    for file in document.files.iter_mut().filter(|file| file.name == FRONT) {
        *file = File { name: FRONT.to_owned(), bytes: text.len() as u64, sha256: digest(text.as_bytes()) };
    }
    fs::write(target.join(FRONT), text).expect("a file");
    fs::write(manifest, serde_json::to_string(&document).expect("JSON")).expect("a file");
}
