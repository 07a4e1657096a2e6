//! What a certificate claims, checked part by part.

use std::fs;
use std::io::BufReader;
use std::path::Path;

use certificate::{Checked, Faithful, Inputs, check, check_refutation, faithful, verification_conditions};
use encodings::{Exact, Limits};
use num_rational::BigRational;
use num_traits::Zero;
use pddl::Source;
use pddl::ast::{ActionBody, Comparison, Domain, InitialElement, Name, Problem};
use pddl::validate::{Options, PlanText, validate};

use super::files::{read, text};
use super::manifest::{
    ARGUMENT, Claim, DOMAIN, Manifest, PLAN, PROBLEM, Refutation, STREAMED, TASK, Verification, VerifiedPart,
    WITNESS,
};
use super::{derivations, knowledge};
use crate::measure::measure;
use crate::message::Message;
use crate::mission::Mission;

/// Checks a certificate without trusting what wrote it, and whether it is about a mission, if one is given. The comparison of the task
/// with the files ends when the limits say so.
pub fn verify(directory: &Path, mission: Option<&Mission>, limits: &Limits) -> Verification {
    let mut report = Verification { claim: None, parts: Vec::new() };
    match read(directory) {
        Ok((manifest, contents)) => {
            report.claim = Some(manifest.claim.clone());
            let bytes: u64 = manifest.files.iter().map(|file| file.bytes).sum();
            let files = format!("{} files, {bytes} bytes, as the manifest has them", manifest.files.len());
            report.parts.push(VerifiedPart { part: "files", result: Ok(files) });
            report.parts.extend(parts(directory, &manifest, &contents, limits));
            if let Some(mission) = mission {
                let written = written(&contents);
                let domain = text(&contents, DOMAIN);
                let result = knowledge::about(written.as_ref(), (domain, text(&contents, PROBLEM)), mission);
                report.parts.push(VerifiedPart { part: "mission", result });
            }
        }
        Err(reason) => report.parts.push(VerifiedPart { part: "files", result: Err(reason) }),
    }
    report
}

/// The argument of a certificate as verification conditions in SMT-LIB 2; it is not checked here.
///
/// # Errors
/// The certificate cannot be read, or its task has derived variables, for which there are no such conditions.
pub fn conditions(directory: &Path, limits: &Limits) -> Result<String, Message> {
    let wrong = |reason: String| Message::at("M121", &directory.display().to_string(), None, reason);
    let (Manifest { claim, .. }, contents) = read(directory).map_err(wrong)?;
    let text = |name: &str| text(&contents, name);
    let metric = match &claim {
        Claim::Unsolvable => None,
        Claim::Optimal { metric } => {
            let (domain, problem) = read_pddl(text(DOMAIN), text(PROBLEM)).map_err(wrong)?;
            let (_, timed) =
                same_task(&domain, &problem, (text(TASK), text(WITNESS)), limits).map_err(wrong)?;
            Some(plan(&domain, &problem, timed, text(PLAN), metric).map_err(wrong)?.1)
        }
    };
    verification_conditions(text(TASK), text(ARGUMENT), metric.as_ref())
        .map_err(|fault| wrong(fault.to_string()))?
        .ok_or_else(|| wrong("a task with derived predicates has no verification conditions".to_owned()))
}

fn parts(
    directory: &Path,
    manifest: &Manifest,
    contents: &[(String, String)],
    limits: &Limits,
) -> Vec<VerifiedPart> {
    let Manifest { claim, refutation, .. } = manifest;
    let text = |name: &str| text(contents, name);
    let (domain, problem) = match read_pddl(text(DOMAIN), text(PROBLEM)) {
        Ok(read) => read,
        Err(reason) => return vec![VerifiedPart { part: "files", result: Err(reason) }],
    };
    let mut parts = Vec::new();
    if let Some(written) = written(contents) {
        let [derivations, filled] = knowledge::check(&written, &domain, &problem);
        parts.push(VerifiedPart { part: "derivations", result: derivations });
        parts.push(VerifiedPart { part: "knowledge", result: filled });
    }
    let (same, timed) = match same_task(&domain, &problem, (text(TASK), text(WITNESS)), limits) {
        Ok((said, timed)) => (Ok(said), timed),
        // Whatever it is, it is not verified.
        Err(reason) => (Err(reason), false),
    };
    parts.push(VerifiedPart { part: "task", result: same });
    let metric = match claim {
        Claim::Unsolvable => None,
        Claim::Optimal { metric } => {
            let checked = plan(&domain, &problem, timed, text(PLAN), metric);
            let (result, value) = match checked {
                Ok((said, value)) => (Ok(said), Some(value)),
                Err(reason) => (Err(reason), None),
            };
            parts.push(VerifiedPart { part: "plan", result });
            let Some(value) = value else { return parts };
            Some(value)
        }
    };
    let checked = check(text(TASK), text(ARGUMENT), metric.as_ref());
    let result = checked.map_err(|fault| fault.to_string()).map(|Checked { labels, potentials, needs }| {
        format!("no plan is better: induction over {labels} labels, with {potentials} potentials and {needs} needs")
    });
    parts.push(VerifiedPart { part: "argument", result });
    let documents = (text(TASK), text(ARGUMENT));
    parts.extend(match refutation {
        Refutation::Steps(steps) => refuted(directory, documents, metric.as_ref(), *steps),
        Refutation::None(reason) => {
            vec![VerifiedPart {
                part: "formula",
                result: Ok(format!("none, the claim rests on the argument: {reason}")),
            }]
        }
    });
    parts
}

/// What a certificate says about knowledge, if it does.
fn written(contents: &[(String, String)]) -> Option<knowledge::KnowledgeFiles<'_>> {
    contents.iter().any(|(name, _)| name == knowledge::ORIGIN).then(|| knowledge::KnowledgeFiles {
        document: text(contents, knowledge::DOCUMENT),
        origin: text(contents, knowledge::ORIGIN),
        derivations: text(contents, derivations::DERIVATIONS),
    })
}

fn refuted(
    directory: &Path,
    documents: (&str, &str),
    metric: Option<&BigRational>,
    steps: usize,
) -> Vec<VerifiedPart> {
    let open = |name: &str| fs::File::open(directory.join(name)).map(BufReader::new);
    let opened = STREAMED.map(open);
    let [Ok(mut formula), Ok(mut legend), Ok(mut proof), Ok(mut hints)] = opened else {
        return vec![VerifiedPart { part: "formula", result: Err("it cannot be read".to_owned()) }];
    };
    let inputs = Inputs { formula: &mut formula, legend: &mut legend, proof: &mut proof, hints: &mut hints };
    let checked = check_refutation(documents, metric, steps, inputs).into_iter();
    checked.map(|(part, result)| VerifiedPart { part, result }).collect()
}

pub(super) fn read_pddl(domain: &str, problem: &str) -> Result<(Domain, Problem), String> {
    let read = pddl::read(&Source::new(DOMAIN, domain), &Source::new(PROBLEM, problem));
    let first = |found: Vec<pddl::Diagnostic>| {
        found.first().map_or_else(String::new, |diagnostic| diagnostic.message.clone())
    };
    read.map(|(domain, problem, _)| (domain, problem)).map_err(first)
}

/// Has the validator execute the plan. The metric is what it says.
pub(super) fn plan(
    domain: &Domain,
    problem: &Problem,
    timed: bool,
    text: &str,
    claimed: &str,
) -> Result<(String, BigRational), String> {
    let mut plan = PlanText::parse(&Source::new(PLAN, text))
        .map_err(|found| found.first().map_or_else(String::new, |diagnostic| diagnostic.message.clone()))?;
    if plan.steps.iter().all(|step| step.start.is_some()) {
        plan.steps.sort_by(|left, right| left.start.cmp(&right.start));
    }
    // One step after the other, each as long as the files say, unless they leave a choice: what is written may be rounded. Where
    // nothing happens by itself, each starts when the one before it has ended; otherwise when it is written, or a little
    // later for that reason.
    let is_timed = problem.init.iter().any(|element| matches!(element, InitialElement::Timed(..)));
    for step in &mut plan.steps {
        step.start = step.start.take().filter(|_| is_timed);
        step.duration = step.duration.take().filter(|_| is_chosen(domain, &step.action));
    }
    let tolerance = if is_timed { Options::default().tolerance } else { BigRational::zero() };
    let options = Options { tolerance, ..Options::default() };
    let verdict = validate(domain, problem, &plan, &options);
    if let Some(violation) = verdict.violation {
        return Err(violation.message);
    }
    let steps = plan.steps.len();
    let value = measure(problem, &verdict, steps, timed).ok_or("the metric has no value after the plan")?;
    // As a decimal where there is one, or as a fraction.
    if value.to_string() != claimed && Exact::from(value.clone()).to_string() != claimed {
        return Err(format!("its metric is {value}, where {claimed} is claimed"));
    }
    Ok((format!("{steps} steps, valid, metric {claimed}"), value))
}

/// Whether an action of this name has a duration that is not fixed.
fn is_chosen(domain: &Domain, name: &Name) -> bool {
    let mut bodies =
        domain.actions.iter().filter(|action| action.identifier.name == *name).map(|action| &action.body);
    bodies.any(|body| match body {
        ActionBody::Durative { duration, .. } => {
            !matches!(&duration[..], [only] if only.operator == Comparison::Equal)
        }
        ActionBody::Instantaneous { .. } => false,
    })
}

/// Whether the task stands for the files, and whether plans are measured by time where there is no metric.
pub(super) fn same_task(
    domain: &Domain,
    problem: &Problem,
    (task, witness): (&str, &str),
    limits: &Limits,
) -> Result<(String, bool), String> {
    match faithful(domain, problem, task, witness, &|| limits.reached()) {
        Faithful::Yes { instances, idle, timed } => {
            let said = format!(
                "it stands for the files: {instances} instances of actions can be executed, {idle} of which change nothing \
                 that it knows"
            );
            Ok((said, timed))
        }
        Faithful::No(difference) => Err(difference.to_string()),
        Faithful::Undecided(cause) => Err(cause.to_string()),
    }
}
