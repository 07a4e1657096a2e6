//! Certificates on disk: a directory with all that is needed to check that a plan is optimal, or that there is none.
//!
//! | file | holds |
//! |---|---|
//! | `manifest.json` | the claim, and the size and SHA-256 of every other file |
//! | `domain.pddl`, `problem.pddl` | the files as they were planned with: availability and values filled in |
//! | `plan.txt` | the plan; missing if there is none |
//! | `knowledge.nt`, `origin.json` | the knowledge base, rules, bindings, and what has changed since they were read; missing if there is no knowledge base |
//! | `derivations.json` | everything that follows from them, with the rule, its bindings and what it rests on; missing likewise |
//! | `task.json` | the ground task |
//! | `argument.json` | why no plan is cheaper: labels, potentials, needs (see `encodings::check_certificate`) |

mod derivations;
mod knowledge;

use std::fmt::Write as _;
use std::fs;
use std::io::Read as _;
use std::path::Path;

use encodings::pddl::ast::{ActionBody, Domain, Name, Problem};
use encodings::pddl::{self, Source, print_domain, print_problem};
use encodings::validate::{Options, PlanText, validate};
use encodings::{
    Checked, GroundConfig, Limits, Solution, Status, Task, certify, check_certificate, describes, ground,
    verification_conditions,
};
use num_rational::BigRational;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use crate::message::Message;
use crate::mission::Mission;

const FORMAT: &str = "metaplan-certificate/1";
/// All files together are at most this large, in bytes.
const SIZE_LIMIT: u64 = 1 << 30;
const DOMAIN: &str = "domain.pddl";
const PROBLEM: &str = "problem.pddl";
const PLAN: &str = "plan.txt";
const TASK: &str = "task.json";
const ARGUMENT: &str = "argument.json";

/// What a certificate claims, and of which files it consists.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Manifest {
    format: String,
    claim: Claim,
    /// Predicates that say which design solves which function: the slots of the ground task come from them.
    solves: Vec<String>,
    files: Vec<File>,
}

/// What is claimed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Claim {
    /// The plan is valid, this is its metric, and no plan has a better one.
    Optimal {
        /// Exact: a decimal or a fraction.
        metric: String,
    },
    /// There is no plan.
    Unsolvable,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: String,
    bytes: u64,
    sha256: String,
}

/// What came of one part of a verification.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Part {
    /// `files`, `derivations`, `knowledge`, `plan`, `task` or `argument`.
    pub part: &'static str,
    /// What was checked; or why it fails, with the first thing that is wrong.
    pub result: Result<String, String>,
}

/// What came of a verification.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Report {
    /// The claim; none if the manifest does not say.
    pub claim: Option<Claim>,
    /// In order; what rests on a part that fails is left out.
    pub parts: Vec<Part>,
}

impl Report {
    /// Whether the claim is proved.
    pub fn verified(&self) -> bool {
        self.claim.is_some() && self.parts.iter().all(|part| part.result.is_ok())
    }
}

/// What a certificate is about.
#[derive(Debug, Clone, Copy)]
pub struct Contents<'c> {
    /// The mission.
    pub mission: &'c Mission,
    /// The problem as it was planned, with its metric.
    pub problem: &'c Problem,
    /// What they ground to.
    pub task: &'c Task,
    /// What was found.
    pub solution: &'c Solution,
    /// The plan as lines with start and duration, for the mission's domain.
    pub plan: &'c str,
}

/// Writes the certificate of a solution into a directory that does not exist yet.
///
/// # Errors
/// The solution has no certificate, or the directory cannot be written.
pub fn write(directory: &Path, contents: &Contents<'_>, limits: &Limits) -> Result<(), Message> {
    let Contents { mission, problem, task, solution, plan } = *contents;
    let name = directory.display().to_string();
    let Some(certificate) = certify(task, solution, limits) else {
        let reason = match solution.status {
            Status::Optimal | Status::Unsolvable => {
                "the proof is not of a kind that certificates can express: several objectives, actions that improve the \
                 metric, or a search that does not end within the limits"
            }
            _ => "nothing is proved for plans of any length",
        };
        return Err(Message::error("M120", format!("no certificate: {reason}")));
    };
    let mut files = vec![
        (DOMAIN, print_domain(mission.domain())),
        (PROBLEM, print_problem(problem)),
        (TASK, certificate.task),
        (ARGUMENT, certificate.argument),
    ];
    files.extend(knowledge::files(mission)?.into_iter().flatten());
    let claim = match &solution.plan {
        Some(found) => {
            files.push((PLAN, plan.to_owned()));
            Claim::Optimal { metric: found.cost.to_string() }
        }
        None => Claim::Unsolvable,
    };
    let listed = files.iter().map(|(name, text)| File {
        name: (*name).to_owned(),
        bytes: text.len() as u64,
        sha256: digest(text.as_bytes()),
    });
    let solves = mission.solves().iter().map(ToString::to_string).collect();
    let manifest = Manifest { format: FORMAT.to_owned(), claim, solves, files: listed.collect() };
    let mut text = serde_json::to_string_pretty(&manifest)
        .map_err(|error| Message::error("M120", format!("no certificate: {error}")))?;
    text.push('\n');
    files.push(("manifest.json", text));
    let parent = directory.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let written = tempfile::tempdir_in(parent).and_then(|whole| {
        for (name, text) in &files {
            fs::write(whole.path().join(name), text)?;
        }
        // Only an empty directory is replaced.
        fs::rename(whole.path(), directory)
    });
    written.map_err(|error| Message::at("M109", &name, None, format!("cannot be written: {}", error.kind())))
}

fn digest(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// Checks a certificate without trusting what wrote it.
pub fn verify(directory: &Path) -> Report {
    let mut report = Report { claim: None, parts: Vec::new() };
    match read(directory) {
        Ok((Manifest { claim, solves, .. }, contents)) => {
            report.claim = Some(claim.clone());
            let bytes: usize = contents.iter().map(|(_, text)| text.len()).sum();
            let files = format!("{} files, {bytes} bytes, as the manifest has them", contents.len());
            report.parts.push(Part { part: "files", result: Ok(files) });
            report.parts.extend(parts(&claim, &solves, &contents));
        }
        Err(reason) => report.parts.push(Part { part: "files", result: Err(reason) }),
    }
    report
}

/// The argument of a certificate as verification conditions in SMT-LIB 2; it is not checked here.
///
/// # Errors
/// The certificate cannot be read, or its task has derived variables, for which there are no such conditions.
pub fn conditions(directory: &Path) -> Result<String, Message> {
    let wrong = |reason: String| Message::at("M121", &directory.display().to_string(), None, reason);
    let (Manifest { claim, .. }, contents) = read(directory).map_err(wrong)?;
    let text =
        |name: &str| contents.iter().find(|(own, _)| own == name).map_or("", |(_, text)| text.as_str());
    let metric = match &claim {
        Claim::Unsolvable => None,
        Claim::Optimal { metric } => {
            let (domain, problem) = read_pddl(text(DOMAIN), text(PROBLEM)).map_err(wrong)?;
            Some(plan(&domain, &problem, text(PLAN), metric).map_err(wrong)?.1)
        }
    };
    verification_conditions(text(TASK), text(ARGUMENT), metric.as_ref())
        .map_err(|fault| wrong(fault.to_string()))?
        .ok_or_else(|| wrong("a task with derived predicates has no verification conditions".to_owned()))
}

/// The manifest, and the contents of the files, each as the manifest says.
fn read(directory: &Path) -> Result<(Manifest, Vec<(String, String)>), String> {
    let manifest = read_file(directory, "manifest.json", 1 << 20)?;
    let manifest: Manifest =
        serde_json::from_str(&manifest).map_err(|error| format!("manifest.json: {error}"))?;
    if manifest.format != FORMAT {
        return Err(format!("manifest.json: format `{}`, where `{FORMAT}` is expected", manifest.format));
    }
    let mut expected = vec![ARGUMENT, DOMAIN, PROBLEM, TASK];
    if manifest.claim != Claim::Unsolvable {
        expected.push(PLAN);
    }
    if manifest.files.iter().any(|file| file.name == knowledge::ORIGIN) {
        expected.extend([knowledge::DOCUMENT, knowledge::ORIGIN, derivations::DERIVATIONS]);
    }
    expected.sort_unstable();
    let mut names: Vec<&str> = manifest.files.iter().map(|file| file.name.as_str()).collect();
    names.sort_unstable();
    if names != expected {
        return Err(format!(
            "manifest.json: lists {}, where {} are expected",
            names.join(", "),
            expected.join(", ")
        ));
    }
    let total = manifest.files.iter().try_fold(0_u64, |sum, file| sum.checked_add(file.bytes));
    if total.is_none_or(|total| total > SIZE_LIMIT) {
        return Err(format!("manifest.json: the files are larger than {SIZE_LIMIT} bytes"));
    }
    let mut contents = Vec::new();
    for file in &manifest.files {
        let text = read_file(directory, &file.name, file.bytes)?;
        if text.len() as u64 != file.bytes {
            return Err(format!(
                "{}: has {} bytes, where {} are expected",
                file.name,
                text.len(),
                file.bytes
            ));
        }
        let found = digest(text.as_bytes());
        if found != file.sha256 {
            return Err(format!("{}: SHA-256 is {found}, where {} is expected", file.name, file.sha256));
        }
        contents.push((file.name.clone(), text));
    }
    Ok((manifest, contents))
}

/// A plain file of at most so many bytes.
fn read_file(directory: &Path, name: &str, most: u64) -> Result<String, String> {
    let path = directory.join(name);
    let wrong = |what: String| format!("{name}: {what}");
    let kind =
        fs::symlink_metadata(&path).map_err(|error| wrong(format!("cannot be read: {}", error.kind())))?;
    if !kind.is_file() {
        return Err(wrong("is no plain file".to_owned()));
    }
    if kind.len() > most {
        return Err(wrong(format!("has {} bytes, more than {most}", kind.len())));
    }
    let mut text = String::new();
    fs::File::open(&path)
        .and_then(|file| file.take(most).read_to_string(&mut text))
        .map_err(|error| wrong(format!("cannot be read: {error}")))?;
    Ok(text)
}

fn parts(claim: &Claim, solves: &[String], contents: &[(String, String)]) -> Vec<Part> {
    let text =
        |name: &str| contents.iter().find(|(own, _)| own == name).map_or("", |(_, text)| text.as_str());
    let (domain, problem) = match read_pddl(text(DOMAIN), text(PROBLEM)) {
        Ok(read) => read,
        Err(reason) => return vec![Part { part: "files", result: Err(reason) }],
    };
    let mut parts = Vec::new();
    if contents.iter().any(|(name, _)| name == knowledge::ORIGIN) {
        let written = knowledge::Written {
            document: text(knowledge::DOCUMENT),
            origin: text(knowledge::ORIGIN),
            derivations: text(derivations::DERIVATIONS),
        };
        let [derivations, filled] = knowledge::check(&written, &domain, &problem);
        parts.push(Part { part: "derivations", result: derivations });
        parts.push(Part { part: "knowledge", result: filled });
    }
    let metric = match claim {
        Claim::Unsolvable => None,
        Claim::Optimal { metric } => {
            let checked = plan(&domain, &problem, text(PLAN), metric);
            let (result, value) = match checked {
                Ok((said, value)) => (Ok(said), Some(value)),
                Err(reason) => (Err(reason), None),
            };
            parts.push(Part { part: "plan", result });
            let Some(value) = value else { return parts };
            Some(value)
        }
    };
    parts.push(Part { part: "task", result: same_task(&domain, &problem, solves, text(TASK)) });
    let checked = check_certificate(text(TASK), text(ARGUMENT), metric.as_ref());
    let result = checked.map_err(|fault| fault.to_string()).map(|Checked { labels, potentials, needs }| {
        format!("no plan is better: induction over {labels} labels, with {potentials} potentials and {needs} needs")
    });
    parts.push(Part { part: "argument", result });
    parts
}

fn read_pddl(domain: &str, problem: &str) -> Result<(Domain, Problem), String> {
    let read = pddl::read(&Source::new(DOMAIN, domain), &Source::new(PROBLEM, problem));
    let first = |found: Vec<pddl::Diagnostic>| {
        found.first().map_or_else(String::new, |diagnostic| diagnostic.message.clone())
    };
    read.map(|(domain, problem, _)| (domain, problem)).map_err(first)
}

/// Has the validator execute the plan. The metric is what it says.
fn plan(
    domain: &Domain,
    problem: &Problem,
    text: &str,
    claimed: &str,
) -> Result<(String, BigRational), String> {
    let plan = PlanText::parse(&Source::new(PLAN, text))
        .map_err(|found| found.first().map_or_else(String::new, |diagnostic| diagnostic.message.clone()))?;
    let verdict = validate(domain, problem, &plan, &Options::default());
    if let Some(violation) = verdict.violation {
        return Err(violation.message);
    }
    let steps = plan.steps.len();
    // Without a metric, plans of durative actions are measured by time, others by their length.
    let durative = domain.actions.iter().any(|action| matches!(action.body, ActionBody::Durative { .. }));
    let value = match (&problem.metric, verdict.metric) {
        (_, Some(metric)) => metric,
        (Some(_), None) => return Err("the metric has no value after the plan".to_owned()),
        (None, None) if durative => verdict.total_time,
        (None, None) => BigRational::from_integer(steps.into()),
    };
    if value.to_string() != claimed && rules::Decimal::from_rational(&value).to_string() != claimed {
        return Err(format!("its metric is {value}, where {claimed} is claimed"));
    }
    Ok((format!("{steps} steps, valid, metric {claimed}"), value))
}

/// Grounds the files again.
fn same_task(domain: &Domain, problem: &Problem, solves: &[String], written: &str) -> Result<String, String> {
    let solves = solves.iter().map(|name| Name::new(name)).collect();
    let config = GroundConfig { solves, ..GroundConfig::default() };
    let task = ground(domain, problem, &config)
        .map_err(|errors| errors.first().map_or_else(String::new, ToString::to_string))?;
    if describes(written, &task) {
        Ok(format!("what the files ground to: {} operators", task.operator_count()))
    } else {
        Err("the files ground to another task".to_owned())
    }
}
