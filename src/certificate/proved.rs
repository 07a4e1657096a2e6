//! Runs the proved checker (`proved/`, extracted from Coq) on a certificate, and compares its answer with that of
//! `metaplan-verify`.
//!
//! `metaplan-proved-prepare` writes evidence for the claim and need not be trusted. One of two other programs checks
//! the evidence with the function about which theorems are proved: `metaplan-proved-check` for a plan or its absence
//! (theorems `optimal` and `unsolvable`, or `timed_optimal` if there are timed initial literals), and
//! `metaplan-proved-front` for a Pareto front (theorem `front_optimal`). If the certificate has a knowledge base,
//! `metaplan-proved-knowledge` checks the derivations of its facts (theorem `knowledge`), and `metaplan-proved-mission`
//! checks the claim for the problem that follows from them (theorems `mission_optimal`
//! and `mission_front`).

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use ::verify::front::{member_directory, read_members};
use ::verify::manifest::{FRONT as FRONT_FILE, PLAN};
use ::verify::{Claim, Verification, VerifiedPart};

use crate::message::Message;

const PREPARE: &str = "metaplan-proved-prepare";
const CHECK: &str = "metaplan-proved-check";
const FRONT: &str = "metaplan-proved-front";
const KNOWLEDGE: &str = "metaplan-proved-knowledge";
const MISSION: &str = "metaplan-proved-mission";
/// Exit status of the programs on success. The next two constants are other exit statuses of all programs but
/// `metaplan-proved-prepare`, as defined in `proved/ocaml/check.ml`, `check_front.ml`, `check_knowledge.ml` and
/// `check_mission.ml`.
const PROVED: i32 = 0;
const REJECTED: i32 = 3;
const NOT_PROVED: i32 = 30;

const POLL_INTERVAL: Duration = Duration::from_millis(5);
/// Maximum resident memory of each program, in kilobytes of 2^10 bytes.
const MEMORY_LIMIT: u64 = 4 << 20;
const TIMED: &str = "proved, with timed initial literals: ";
const UNTIMED: &str = "proved: ";
/// First words of the statement about the facts of a knowledge base.
const FACTS: &str = "proved: exactly the ";
/// First words of the statement about the problem of a mission. The second one has them if the metric is not that of
/// the mission.
const MISSION_PROBLEM: &str = "proved: for the problem that follows from the knowledge base: ";
const OTHER_METRIC: &str =
    "proved: for the problem that follows from the knowledge base, with another metric than the mission's: ";
const COVERED_PARTS: [&str; 3] = ["task", "plan", "argument"];
const COVERED_FRONT_PARTS: [&str; 2] = ["point", "front"];
const DERIVATIONS: &str = "derivations";
const FROM_KNOWLEDGE: &str = "knowledge";

/// Paths of the programs of the proved checker.
#[derive(Debug, Clone)]
pub struct ProvedChecker {
    prepare: PathBuf,
    check: PathBuf,
    front: PathBuf,
    knowledge: PathBuf,
    mission: PathBuf,
}

/// Answer of the proved checker to a certificate, after the comparison with `metaplan-verify`.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Theorem {
    /// The claim follows from a theorem.
    Holds {
        /// Name of the theorem in `proved/Optimal.v`, `proved/Fronts.v` or `proved/TimelineProof.v`.
        name: &'static str,
        /// The proved statement, as the program prints it.
        statement: String,
        /// Parts of the verification that the theorem covers.
        parts: Vec<&'static str>,
        /// For a certificate with a knowledge base: the statement of theorem `knowledge` about the derivations, or the
        /// reason why the theorem does not apply.
        derivations: Option<Result<String, String>>,
        /// For a certificate with a knowledge base: the statement of theorem `mission_optimal` or `mission_front` about
        /// the problem that follows from it, or the reason why the theorem does not apply.
        mission: Option<Result<String, String>>,
    },
    /// It is not shown that the claim follows from the theorem, for the given reason: for example, the proved checker
    /// does not cover a construct.
    None(String),
}

impl Theorem {
    /// Returns the answer for a certificate with this result of all checks. The parts that a theorem covers do not
    /// suffice if another part is rejected.
    #[must_use]
    pub fn of_verified(self, report: &Verification) -> Self {
        match self {
            Self::Holds { .. } if !report.verified() => {
                Self::None("the certificate is not verified".to_owned())
            }
            theorem => theorem,
        }
    }
}

impl ProvedChecker {
    /// Finds the programs in `folder` if it is given. Otherwise finds them in the directory of the running program or in
    /// a directory of `PATH`. The programs for fronts, knowledge bases and missions are not needed for other certificates,
    /// and may be absent.
    ///
    /// # Errors
    /// M145: no directory has both programs for certificates of a plan.
    pub fn find(folder: Option<&Path>) -> Result<Self, Message> {
        let candidates = if let Some(folder) = folder {
            vec![folder.to_owned()]
        } else {
            let running = std::env::current_exe().ok();
            let beside = running.as_deref().and_then(Path::parent).map(Path::to_owned);
            let path = std::env::var_os("PATH").unwrap_or_default();
            beside.into_iter().chain(std::env::split_paths(&path)).collect()
        };
        let program = |folder: &Path, name| folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
        candidates
            .iter()
            .map(|folder| Self {
                prepare: program(folder, PREPARE),
                check: program(folder, CHECK),
                front: program(folder, FRONT),
                knowledge: program(folder, KNOWLEDGE),
                mission: program(folder, MISSION),
            })
            .find(|checker| checker.prepare.is_file() && checker.check.is_file())
            .ok_or_else(|| {
                let place = match folder {
                    Some(folder) => folder.display().to_string(),
                    None => "the directory of this program or PATH".to_owned(),
                };
                let text = format!(
                    "the programs `{PREPARE}` and `{CHECK}` are not in {place}: `sh proved/build.sh` in the source code builds them (it needs Coq and OCaml); then add `proved/ocaml` to PATH, or use `--proved=FOLDER`"
                );
                Message::error("M145", text)
            })
    }

    /// Runs the proved checker on the certificate in `directory`. `report` is the result of `metaplan-verify` for
    /// this certificate. If the two checkers disagree, adds a failed part `theorem` to the report. Ends the programs
    /// as soon as `stop` returns `true`.
    ///
    /// # Errors
    /// M145: a program cannot be run, or a temporary file cannot be written or read.
    pub fn compare(
        &self,
        directory: &Path,
        report: &mut Verification,
        stop: &dyn Fn() -> bool,
    ) -> Result<Theorem, Message> {
        let Some(claim) = &report.claim else {
            return Ok(Theorem::None("the files of the certificate cannot be read".to_owned()));
        };
        let (name, covered) = match claim {
            Claim::Optimal { .. } => ("optimal", &COVERED_PARTS[..]),
            Claim::Unsolvable => ("unsolvable", &COVERED_PARTS[..]),
            Claim::Front(_) => ("front_optimal", &COVERED_FRONT_PARTS[..]),
        };
        if let Err(reason) = require_read(directory, claim) {
            return Ok(Theorem::None(reason));
        }
        let folder = tempfile::tempdir().map_err(|error| failed("a temporary directory", &error))?;
        let answer = self.answer(directory, claim, folder.path(), stop)?;
        let accepted = covered.iter().all(|part| {
            let has_part = *part != "plan" || *claim != Claim::Unsolvable;
            let mut results = report.parts.iter().filter(|verified| verified.part == *part).peekable();
            !has_part || (results.peek().is_some() && results.all(|verified| verified.result.is_ok()))
        });
        let disagreement = match answer {
            Answer::None(reason) => return Ok(Theorem::None(reason)),
            Answer::Rejected if !accepted => return Ok(Theorem::None("not proved".to_owned())),
            Answer::Rejected => "the proved checker does not accept this certificate".to_owned(),
            Answer::Accepted(statement) if !states(&statement, claim) => {
                format!("the proved checker proves something else: {statement}")
            }
            Answer::Accepted(statement) if accepted => {
                let name = if statement.starts_with(TIMED) { "timed_optimal" } else { name };
                let parts = report.parts.iter().map(|part| part.part);
                let mut parts: Vec<_> = parts.filter(|part| covered.contains(part)).collect();
                // The checks of the points of a front have the same name, which is listed once.
                parts.dedup();
                let verified = report.parts.iter().find(|part| part.part == DERIVATIONS);
                let derivations = verified.map(|_| self.knowledge(directory, stop)).transpose()?;
                if let (Some(VerifiedPart { result: Err(_), .. }), Some(Ok(accepted))) =
                    (verified, &derivations)
                {
                    format!("the proved checker accepts the derivations ({accepted})")
                } else {
                    let verified = report.parts.iter().find(|part| part.part == FROM_KNOWLEDGE);
                    let mission = |part: &VerifiedPart| {
                        self.mission(directory, claim, part.result.is_ok(), folder.path(), stop)
                    };
                    let mission = verified.map(mission).transpose()?;
                    return Ok(Theorem::Holds { name, statement, parts, derivations, mission });
                }
            }
            Answer::Accepted(statement) => {
                format!("the proved checker accepts this certificate ({statement})")
            }
        };
        let reason = format!("the checkers disagree: {disagreement}");
        report.parts.push(VerifiedPart { part: "theorem", result: Err(reason.clone()) });
        Ok(Theorem::None(reason))
    }

    /// Runs the program for knowledge bases. Returns the proved statement; an error if nothing is proved, with the reason.
    fn knowledge(
        &self,
        directory: &Path,
        stop: &dyn Fn() -> bool,
    ) -> Result<Result<String, String>, Message> {
        if !self.knowledge.is_file() {
            return Ok(Err(format!("the program `{KNOWLEDGE}` is missing")));
        }
        let folder = tempfile::tempdir().map_err(|error| failed("a temporary directory", &error))?;
        let (output, errors) = (folder.path().join("output"), folder.path().join("errors"));
        let mut check = Command::new(&self.knowledge);
        check.arg(directory);
        Ok(match checked(check, KNOWLEDGE, &output, &errors, stop)? {
            Answer::Accepted(statement) if statement.starts_with(FACTS) => Ok(statement),
            Answer::Accepted(_) => Err(format!("`{KNOWLEDGE}` prints no statement about the facts")),
            Answer::Rejected => Err("the proved checker does not accept the derivations".to_owned()),
            Answer::None(reason) => Err(reason),
        })
    }

    /// Runs the program for missions on the evidence in `folder`. Returns the proved statement; an error if nothing is
    /// proved, with the reason. `is_verified` is the result of `metaplan-verify` for the part `knowledge`.
    fn mission(
        &self,
        directory: &Path,
        claim: &Claim,
        is_verified: bool,
        folder: &Path,
        stop: &dyn Fn() -> bool,
    ) -> Result<Result<String, String>, Message> {
        if !self.mission.is_file() {
            return Ok(Err(format!("the program `{MISSION}` is missing")));
        }
        let mut check = Command::new(&self.mission);
        let last = match claim {
            Claim::Front(front) => front.points.len(),
            Claim::Optimal { .. } | Claim::Unsolvable => 0,
        };
        check.arg(directory).args((0..=last).map(|position| evidence_file(folder, position)));
        let (output, errors) = (folder.join("mission"), folder.join("errors"));
        Ok(match checked(check, MISSION, &output, &errors, stop)? {
            Answer::Accepted(statement) if !states_for_mission(&statement, claim) => {
                Err(format!("`{MISSION}` proves something else: {statement}"))
            }
            // The theorem is about the mission's files. It also holds if the problem of the certificate has other facts
            // that do not matter.
            Answer::Accepted(_) if !is_verified => {
                Err("the problem of the certificate does not follow from the knowledge base".to_owned())
            }
            Answer::Accepted(statement) => Ok(statement),
            Answer::Rejected => Err("the proved checker does not accept the mission".to_owned()),
            Answer::None(reason) => Err(reason),
        })
    }

    /// Writes evidence to files in `folder`, and runs the program for the claim.
    fn answer(
        &self,
        directory: &Path,
        claim: &Claim,
        folder: &Path,
        stop: &dyn Fn() -> bool,
    ) -> Result<Answer, Message> {
        let errors = folder.join("errors");
        let (certificates, checker, name) = match claim {
            Claim::Front(front) => {
                let members = 0..=front.points.len();
                let members = members.map(|position| member_directory(directory, position)).collect();
                (members, &self.front, FRONT)
            }
            Claim::Optimal { .. } | Claim::Unsolvable => (vec![directory.to_owned()], &self.check, CHECK),
        };
        let mut check = Command::new(checker);
        check.arg(directory);
        for (certificate, position) in certificates.iter().zip(0_usize..) {
            let evidence = evidence_file(folder, position);
            let mut prepare = Command::new(&self.prepare);
            prepare.arg(certificate);
            match run(prepare, &evidence, &errors, stop)? {
                Ended::Status(PROVED) => {}
                Ended::Status(_) => return Ok(Answer::None(reason(&errors)?)),
                Ended::Other(reason) => return Ok(Answer::None(format!("`{PREPARE}` {reason}"))),
            }
            check.arg(&evidence);
        }
        checked(check, name, &folder.join("output"), &errors, stop)
    }
}

fn evidence_file(folder: &Path, position: usize) -> PathBuf {
    folder.join(format!("evidence{position}"))
}

/// Runs a program that checks with a proved function, and interprets its exit status.
fn checked(
    check: Command,
    name: &str,
    output: &Path,
    errors: &Path,
    stop: &dyn Fn() -> bool,
) -> Result<Answer, Message> {
    Ok(match run(check, output, errors, stop)? {
        Ended::Status(PROVED) => Answer::Accepted(read(output)?),
        Ended::Status(NOT_PROVED) => Answer::Rejected,
        Ended::Status(REJECTED) => Answer::None(reason(output)?),
        Ended::Status(status) => Answer::None(format!("`{name}` ended with status {status}")),
        Ended::Other(reason) => Answer::None(format!("`{name}` {reason}")),
    })
}

enum Answer {
    Accepted(String),
    Rejected,
    /// The checker has decided nothing, for the given reason.
    None(String),
}

enum Ended {
    Status(i32),
    Other(String),
}

/// Returns an error if the programs would open a file of the certificate that `metaplan-verify` has not read: it could
/// be a link or a pipe.
fn require_read(directory: &Path, claim: &Claim) -> Result<(), String> {
    let foreign = match claim {
        Claim::Front(front) => return read_members(directory, front),
        Claim::Optimal { .. } => &[FRONT_FILE][..],
        Claim::Unsolvable => &[PLAN, FRONT_FILE][..],
    };
    match foreign.iter().find(|name| directory.join(name).symlink_metadata().is_ok()) {
        Some(name) => Err(format!("`{name}` does not belong to the certificate")),
        None => Ok(()),
    }
}

/// Returns `true` if the statement of the proved checker equals the claim of the certificate. They can differ,
/// because the program takes its claim from the untrusted evidence.
fn states(statement: &str, claim: &Claim) -> bool {
    let statement = statement.strip_prefix(TIMED).or_else(|| statement.strip_prefix(UNTIMED));
    statement.is_some_and(|statement| is_claim(statement, claim))
}

/// Returns `true` if the statement of the proved checker about a mission equals the claim of the certificate.
fn states_for_mission(statement: &str, claim: &Claim) -> bool {
    let statement = statement.strip_prefix(MISSION_PROBLEM).or_else(|| statement.strip_prefix(OTHER_METRIC));
    statement.is_some_and(|statement| is_claim(statement, claim))
}

fn is_claim(statement: &str, claim: &Claim) -> bool {
    match claim {
        Claim::Unsolvable => statement == "there is no plan",
        Claim::Front(front) => {
            let values: Vec<_> = front.points.iter().map(|values| values.join(" ")).collect();
            statement == format!("the front has exactly these values: {}", values.join(", "))
        }
        Claim::Optimal { metric } => statement
            .strip_prefix("the plan of ")
            .and_then(|text| text.strip_suffix(&format!(" steps is optimal, metric {metric}")))
            .is_some_and(|count| count.parse::<usize>().is_ok()),
    }
}

fn failed(what: &str, error: &dyn std::fmt::Display) -> Message {
    Message::error("M145", format!("the proved checker (`--proved`) cannot be run: {what}: {error}"))
}

fn read(file: &Path) -> Result<String, Message> {
    let bytes = fs::read(file).map_err(|error| failed(&file.display().to_string(), &error))?;
    Ok(String::from_utf8_lossy(&bytes).trim_end().to_owned())
}

fn reason(file: &Path) -> Result<String, Message> {
    let text = read(file)?;
    let line = text.lines().last().unwrap_or_default();
    let line = line.strip_prefix("rejected: ").unwrap_or(line);
    Ok(if line.is_empty() { "the program has printed no reason".to_owned() } else { line.to_owned() })
}

/// Runs a program with its output in files. Kills it when `stop` returns `true`, or at the memory
/// limit (only on platforms with `/proc`).
fn run(
    mut command: Command,
    output: &Path,
    errors: &Path,
    stop: &dyn Fn() -> bool,
) -> Result<Ended, Message> {
    let program = command.get_program().to_string_lossy().into_owned();
    let wrong = |error: &dyn std::fmt::Display| failed(&program, error);
    let create =
        |path: &Path| File::create(path).map_err(|error| failed(&path.display().to_string(), &error));
    command.stdin(Stdio::null()).stdout(create(output)?).stderr(create(errors)?);
    let mut child = command.spawn().map_err(|error| wrong(&error))?;
    loop {
        if let Some(status) = child.try_wait().map_err(|error| wrong(&error))? {
            return Ok(match status.code() {
                Some(code) => Ended::Status(code),
                None => Ended::Other("ended without an exit status; its stack may be too small".to_owned()),
            });
        }
        let is_large = memory(&child).is_some_and(|size| size > MEMORY_LIMIT);
        if is_large || stop() {
            child.kill().and_then(|()| child.wait()).map_err(|error| wrong(&error))?;
            let reason = if is_large { "needs more than 4096 MB" } else { "did not end within the limits" };
            return Ok(Ended::Other(reason.to_owned()));
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}

/// Returns the resident memory of a process in kilobytes of 2^10 bytes.
fn memory(child: &Child) -> Option<u64> {
    let text = fs::read_to_string(format!("/proc/{}/status", child.id())).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.trim().strip_suffix(" kB")?.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statement_is_compared_with_the_claim() {
        let metric = |metric: &str| Claim::Optimal { metric: metric.to_owned() };
        let optimal = "proved: the plan of 4 steps is optimal, metric 408";
        assert!(states(optimal, &metric("408")));
        assert!(!states(optimal, &metric("8")));
        assert!(!states(optimal, &Claim::Unsolvable));
        assert!(!states(
            "proved: the plan of 4 steps is optimal, metric 4 steps is optimal, metric 8",
            &metric("8")
        ));
        assert!(states("proved: there is no plan", &Claim::Unsolvable));
        let timed = "proved, with timed initial literals: ";
        assert!(states(&format!("{timed}there is no plan"), &Claim::Unsolvable));
        assert!(states(&format!("{timed}the plan of 2 steps is optimal, metric 3.5"), &metric("3.5")));
        assert!(!states(&format!("{timed}the plan of 2 steps is optimal, metric 3.5"), &metric("3")));
        assert!(!states("proved: there is no plan", &metric("8")));
        let mission = format!("{MISSION_PROBLEM}the plan of 4 steps is optimal, metric 408");
        assert!(states_for_mission(&mission, &metric("408")) && !states_for_mission(&mission, &metric("8")));
        assert!(!states(&mission, &metric("408")) && !states_for_mission(optimal, &metric("408")));
        assert!(states_for_mission(&format!("{OTHER_METRIC}there is no plan"), &Claim::Unsolvable));
    }
}
