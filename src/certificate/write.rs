//! Writes the certificate of a single plan, or of the absence of plans.

use std::fs;
use std::io::{BufRead, BufReader, BufWriter};
use std::path::Path;

use certificate::{Faithful, StepBound, check, witness};
use num_rational::BigRational;
use pddl::ast::Problem;
use pddl::{print_domain, print_problem};
use planner::{
    Certificate, ExactTask, Limits, NoCertificate, RefutationOutputs, Solution, Task, certify, certify_exact,
    refute,
};
use serde::Serialize;

use ::verify::Claim;
use ::verify::digest::digest_of;
use ::verify::files::text;
use ::verify::manifest::{
    ARGUMENT, DOMAIN, FORMAT, FORMULA, File, HINTS, LEGEND, Manifest, PLAN, PROBLEM, PROOF, PROOF_LIMIT,
    Refutation, STREAMED, TASK, TEXT_LIMIT, WITNESS,
};
use ::verify::plan::plan as executed;
use ::verify::task::{read_pddl, same_task};

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
    let mut certificate = task.certify(solution, limits).map_err(|reason| wrong(&reason))?;
    let (domain_text, problem_text) = (print_domain(mission.domain()), print_problem(problem));
    let mut witness = compared((&domain_text, &problem_text), &certificate.task, limits);
    if witness.is_err()
        && let Some(reduced) = certificate.of_false_goal()
    {
        let witness_of_goal = compared((&domain_text, &problem_text), &reduced.task, limits);
        if witness_of_goal.is_ok() {
            (certificate, witness) = (reduced, witness_of_goal);
        }
    }
    let witness = witness.map_err(|reason| wrong(&reason))?;
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
    // A certificate with an argument that `verify` would reject is not written.
    check(text(&files, TASK), text(&files, ARGUMENT), metric.as_ref()).map_err(|fault| wrong(&fault))?;
    let refutation =
        refutation(whole.path(), (text(&files, TASK), text(&files, ARGUMENT)), metric.as_ref(), limits)
            .map_err(failed)?;
    for (name, text) in &files {
        fs::write(whole.path().join(name), text).map_err(failed)?;
    }
    // Without a refutation, its files do not exist.
    let streamed = STREAMED.into_iter().filter(|_| matches!(refutation, Refutation::Steps(_)));
    let names = files.iter().map(|(name, _)| *name).chain(streamed);
    let listed = listed(whole.path(), names).map_err(failed)?;
    let manifest = Manifest { format: FORMAT.to_owned(), claim, refutation, files: listed };
    write_manifest(whole.path(), &manifest).map_err(failed)?;
    whole.commit().map_err(failed)
}

pub(super) fn listed<'n>(
    directory: &Path,
    names: impl Iterator<Item = &'n str>,
) -> std::io::Result<Vec<File>> {
    let list = |name: &str| {
        let (bytes, sha256) = digest_of(&directory.join(name))?;
        Ok(File { name: name.to_owned(), bytes, sha256 })
    };
    names.map(list).collect()
}

pub(super) fn write_manifest(directory: &Path, manifest: &impl Serialize) -> std::io::Result<()> {
    let text = serde_json::to_string_pretty(manifest)?;
    fs::write(directory.join("manifest.json"), text + "\n")
}

/// Creates the witness (an over-approximation of the reachable states). Uses it to check that the ground task agrees
/// with the PDDL files, as `verify` does. Returns an error if they differ or cannot be compared.
fn compared((domain, problem): (&str, &str), task: &str, limits: &Limits) -> Result<String, String> {
    let (domain, problem) = read_pddl(domain, problem)?;
    let witness =
        witness(&domain, &problem, task, &|| limits.reached()).map_err(|verdict| match verdict {
            Faithful::No(difference) => difference.to_string(),
            Faithful::Undecided(cause) => cause.to_string(),
            Faithful::Yes { .. } => "no witness".to_owned(),
        })?;
    same_task(&domain, &problem, (task, &witness), &|| limits.reached())?;
    Ok(witness)
}

/// Writes the formula "there is a better plan" (without `metric`: "there is a plan") and its refutation to files in
/// `directory`. Returns `Refutation::None` with the reasons if no refutation is found or its proof is too large.
fn refutation(
    directory: &Path,
    documents: (&str, &str),
    metric: Option<&BigRational>,
    limits: &Limits,
) -> std::io::Result<Refutation> {
    let create = |name: &str| fs::File::create(directory.join(name)).map(BufWriter::new);
    let written_draft = || {
        let file = fs::File::open(directory.join(DRAFT))?;
        Ok(Box::new(BufReader::new(file)) as Box<dyn BufRead>)
    };
    let remove = |names: &[&str]| names.iter().try_for_each(|name| fs::remove_file(directory.join(name)));
    let size = |name: &str| fs::metadata(directory.join(name)).map(|file| file.len());
    let mut reasons = Vec::new();
    // The second bound on the number of steps is tried only if the first one gives no refutation.
    for by in [StepBound::Spent, StepBound::Potential] {
        let outputs = RefutationOutputs {
            formula: &mut create(FORMULA)?,
            legend: &mut create(LEGEND)?,
            draft: Box::new(create(DRAFT)?),
            written_draft: &written_draft,
            proof: &mut create(PROOF)?,
            hints: &mut create(HINTS)?,
        };
        let refuted = refute(documents, metric, by, outputs, limits);
        remove(&[DRAFT])?;
        match refuted {
            Ok(_) if size(PROOF)?.max(size(HINTS)?) > PROOF_LIMIT => {
                reasons.push(format!("the proof has more than {PROOF_LIMIT} bytes"));
            }
            Ok(steps) => return Ok(Refutation::Steps(steps)),
            Err(reason) => reasons.push(reason),
        }
    }
    remove(&STREAMED)?;
    reasons.dedup();
    Ok(Refutation::None(reasons.join("; ")))
}
