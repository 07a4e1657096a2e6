//! Writes the certificate of a single plan, or of the absence of plans.

use std::fs;
use std::io::{BufRead, BufReader, BufWriter};
use std::path::Path;

use certificate::{Claimed, Faithful, GroundTask, witnessed};
use num_rational::BigRational;
use pddl::ast::{Domain, Problem};
use pddl::{print_domain, print_problem};
use planner::{
    Certificate, ExactTask, Limits, NoCertificate, RefutationOutputs, Solution, Task, attempts, certify,
    certify_exact, refute,
};
use serde::Serialize;
use tracing::info_span;

use ::verify::Claim;
use ::verify::digest::{digest, digest_of};
use ::verify::files::text;
use ::verify::manifest::{
    ARGUMENT, DOMAIN, FORMAT, FORMULA, File, HINTS, LEGEND, Manifest, PLAN, PROBLEM, PROOF, PROOF_LIMIT,
    Refutation, STREAMED, TASK, TEXT_LIMIT, WITNESS,
};
use ::verify::plan::plan as executed;
use ::verify::task::read_pddl;

use super::knowledge;
use crate::file::create_directory;
use crate::message::Message;
use crate::mission::Mission;

const DRAFT: &str = "draft.drat";

/// Reference to a ground task, with integers or with rationals.
#[derive(Debug, Clone, Copy)]
pub enum Ground<'c> {
    /// A task with integers.
    Integers(&'c Task),
    /// A task with rationals of any size.
    Exact(&'c ExactTask),
}

impl Ground<'_> {
    fn certify(self, solution: &Solution, limits: &Limits) -> Result<Certificate, NoCertificate> {
        match self {
            Self::Integers(task) => certify(task, solution, limits),
            Self::Exact(task) => certify_exact(task, solution, limits),
        }
    }

    fn is_timed(self) -> bool {
        match self {
            Self::Integers(task) => task.is_timed(),
            Self::Exact(task) => task.is_timed(),
        }
    }
}

/// Input of [`write()`]: the mission, its task and the solution to certify.
#[derive(Debug, Clone, Copy)]
pub struct Contents<'c> {
    /// The mission.
    pub mission: &'c Mission,
    /// The problem as it was planned, with the metric that was optimised.
    pub problem: &'c Problem,
    /// The ground task of domain and problem.
    pub task: Ground<'c>,
    /// The solution of the task, whose status the certificate proves.
    pub solution: &'c Solution,
    /// The plan in terms of the mission's domain: one line per action, with start and duration if actions take
    /// time. Empty without a plan.
    pub plan: &'c str,
}

impl Contents<'_> {
    fn metric(&self, limits: &Limits) -> Result<Option<BigRational>, String> {
        let Some(found) = &self.solution.plan else { return Ok(None) };
        let (domain, cost) = (self.mission.domain(), found.cost.to_string());
        executed(domain, self.problem, self.task.is_timed(), self.plan, &cost, &|| limits.reached())
            .map(|(_, metric)| Some(metric))
    }
}

/// Writes the certificate of a solution into a new directory.
///
/// # Errors
/// The solution has no certificate, or one that is too large or would be rejected (M120); the knowledge base
/// cannot be read again; or the directory cannot be written (M109).
pub fn write(directory: &Path, contents: &Contents<'_>, limits: &Limits) -> Result<(), Message> {
    write_with(directory, contents, knowledge::files(contents.mission, limits)?.into_iter().flatten(), limits)
}

pub(super) fn write_with(
    directory: &Path,
    contents: &Contents<'_>,
    origin: impl IntoIterator<Item = (&'static str, String)>,
    limits: &Limits,
) -> Result<(), Message> {
    let Contents { mission, problem, task, solution, plan } = *contents;
    let wrong = |error: &dyn std::fmt::Display| Message::error("M120", format!("no certificate: {error}"));
    let name = directory.display().to_string();
    let mut certificate =
        info_span!("labels").in_scope(|| task.certify(solution, limits)).map_err(|reason| wrong(&reason))?;
    let (domain_text, problem_text) = (print_domain(mission.domain()), print_problem(problem));
    let (domain, read_problem) = read_pddl(&domain_text, &problem_text).map_err(|reason| wrong(&reason))?;
    let stop = || limits.reached();
    let compared = |task: &str| compared(&domain, &read_problem, task, &stop);
    let mut outcome = compared(&certificate.task);
    if outcome.is_err()
        && let Some(reduced) = certificate.of_false_goal()
    {
        let outcome_of_goal = compared(&reduced.task);
        if outcome_of_goal.is_ok() {
            (certificate, outcome) = (reduced, outcome_of_goal);
        }
    }
    let (read_task, witness) = outcome.map_err(|reason| wrong(&reason))?;
    let mut files = vec![
        (DOMAIN, domain_text),
        (PROBLEM, problem_text),
        (TASK, certificate.task),
        (WITNESS, witness),
        (ARGUMENT, certificate.argument),
    ];
    files.extend(origin);
    let claim = match &solution.plan {
        Some(found) => {
            files.push((PLAN, plan.to_owned()));
            Claim::Optimal { metric: found.cost.to_string() }
        }
        None => Claim::Unsolvable,
    };
    // The checker rejects certificates with more text.
    if files.iter().map(|(_, text)| text.len() as u64).sum::<u64>() > TEXT_LIMIT {
        return Err(wrong(&format_args!("its files have more than {TEXT_LIMIT} bytes")));
    }
    let failed = |error: std::io::Error| {
        Message::at("M109", &name, None, format!("the directory cannot be written: {}", error.kind()))
    };
    // The files are written to a temporary directory that is renamed at the end.
    let whole = create_directory(directory).map_err(failed)?;
    let metric = contents.metric(limits).map_err(|reason| wrong(&reason))?;
    let claimed = Claimed::read(&read_task, text(&files, ARGUMENT), metric.as_ref());
    let claimed = claimed.map_err(|fault| wrong(&fault))?;
    // A certificate with an argument that `verify` would reject is not written.
    info_span!("check").in_scope(|| claimed.check(&stop)).map_err(|fault| wrong(&fault))?;
    let refutation =
        info_span!("refute").in_scope(|| refutation(whole.path(), &claimed, limits)).map_err(failed)?;
    // Without a refutation, its files do not exist.
    let streamed = STREAMED.into_iter().filter(|_| matches!(refutation, Refutation::Steps(_)));
    let mut listed = write_files(whole.path(), &files).map_err(failed)?;
    for name in streamed {
        let (bytes, sha256) = digest_of(&whole.path().join(name)).map_err(failed)?;
        listed.push(File { name: name.to_owned(), bytes, sha256 });
    }
    let manifest = Manifest { format: FORMAT.to_owned(), claim, refutation, files: listed };
    write_manifest(whole.path(), &manifest).map_err(failed)?;
    whole.commit().map_err(failed)
}

/// Writes texts to files of a directory. Returns their entries in a manifest.
pub(super) fn write_files(directory: &Path, files: &[(&str, String)]) -> std::io::Result<Vec<File>> {
    let write = |(name, text): &(&str, String)| {
        fs::write(directory.join(name), text)?;
        Ok(File { name: (*name).to_owned(), bytes: text.len() as u64, sha256: digest(text.as_bytes()) })
    };
    files.iter().map(write).collect()
}

pub(super) fn write_manifest(directory: &Path, manifest: &impl Serialize) -> std::io::Result<()> {
    let text = serde_json::to_string_pretty(manifest)?;
    fs::write(directory.join("manifest.json"), text + "\n")
}

/// Reads a ground task and creates its witness (an over-approximation of the reachable states). Uses it to check that
/// the task agrees with the PDDL files, as `verify` does. Returns an error if they differ or cannot be compared.
fn compared(
    domain: &Domain,
    problem: &Problem,
    task: &str,
    stop: &dyn Fn() -> bool,
) -> Result<(GroundTask, String), String> {
    let _span = info_span!("compare").entered();
    let task = GroundTask::read(task).map_err(|fault| fault.to_string())?;
    let witness = witnessed(domain, problem, &task, stop).map_err(|verdict| match verdict {
        Faithful::No(difference) => difference.to_string(),
        Faithful::Undecided(cause) => cause.to_string(),
        Faithful::Yes { .. } => "no witness".to_owned(),
    })?;
    Ok((task, witness))
}

/// Writes the formula "there is a better plan" and its refutation to files in `directory`. Returns `Refutation::None` with
/// the reasons if no refutation is found or its proof is too large.
fn refutation(directory: &Path, claimed: &Claimed<'_>, limits: &Limits) -> std::io::Result<Refutation> {
    let create = |name: &str| fs::File::create(directory.join(name)).map(BufWriter::new);
    let written_draft = || {
        let file = fs::File::open(directory.join(DRAFT))?;
        Ok(Box::new(BufReader::new(file)) as Box<dyn BufRead>)
    };
    let remove = |names: &[&str]| names.iter().try_for_each(|name| fs::remove_file(directory.join(name)));
    let size = |name: &str| fs::metadata(directory.join(name)).map(|file| file.len());
    let mut reasons = Vec::new();
    let attempts = attempts(claimed, limits).unwrap_or_else(|reason| {
        reasons.push(reason);
        Vec::new()
    });
    let has_files = !attempts.is_empty();
    // A later formula is tried only if the earlier ones have no refutation.
    for attempt in attempts {
        let outputs = RefutationOutputs {
            formula: &mut create(FORMULA)?,
            legend: &mut create(LEGEND)?,
            draft: Box::new(create(DRAFT)?),
            written_draft: &written_draft,
            proof: &mut create(PROOF)?,
            hints: &mut create(HINTS)?,
        };
        let refuted = refute(claimed, attempt, outputs, limits);
        remove(&[DRAFT])?;
        match refuted {
            Ok(()) if size(PROOF)?.max(size(HINTS)?) > PROOF_LIMIT => {
                reasons.push(format!("the proof has more than {PROOF_LIMIT} bytes"));
            }
            Ok(()) => return Ok(Refutation::Steps(attempt.steps)),
            Err(reason) => reasons.push(reason),
        }
    }
    if has_files {
        remove(&STREAMED)?;
    }
    reasons.dedup();
    Ok(Refutation::None(reasons.join("; ")))
}
