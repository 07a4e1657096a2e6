//! What a certificate claims, checked part by part.

use std::fs;
use std::io::BufReader;
use std::path::Path;

use encodings::pddl::ast::{Domain, Name, Problem};
use encodings::pddl::{self, Source};
use encodings::validate::{Options, PlanText, validate};
use encodings::{
    Checked, Faithful, GroundConfig, Limits, RefutationInputs, check_certificate, check_refutation,
    describes, faithful, ground, verification_conditions,
};
use num_rational::BigRational;

use super::files::{read, text};
use super::{
    ARGUMENT, Claim, DOMAIN, Manifest, PLAN, PROBLEM, Part, Refutation, Report, STREAMED, TASK, derivations,
    knowledge,
};
use crate::measure::measure;
use crate::message::Message;
use crate::mission::Mission;

/// Checks a certificate without trusting what wrote it, and whether it is about a mission, if one is given. Where the files have to be grounded again, `limits` is asked when that
/// has to end.
pub fn verify(directory: &Path, mission: Option<&Mission>, limits: &dyn Fn() -> Limits) -> Report {
    let mut report = Report { claim: None, parts: Vec::new() };
    match read(directory) {
        Ok((manifest, contents)) => {
            report.claim = Some(manifest.claim.clone());
            let bytes: u64 = manifest.files.iter().map(|file| file.bytes).sum();
            let files = format!("{} files, {bytes} bytes, as the manifest has them", manifest.files.len());
            report.parts.push(Part { part: "files", result: Ok(files) });
            report.parts.extend(parts(directory, &manifest, &contents, limits));
            if let Some(mission) = mission {
                let written = written(&contents);
                let domain = text(&contents, DOMAIN);
                let result = knowledge::about(written.as_ref(), (domain, text(&contents, PROBLEM)), mission);
                report.parts.push(Part { part: "mission", result });
            }
        }
        Err(reason) => report.parts.push(Part { part: "files", result: Err(reason) }),
    }
    report
}

/// The argument of a certificate as verification conditions in SMT-LIB 2; it is not checked here.
///
/// # Errors
/// The certificate cannot be read, or its task has derived variables, for which there are no such conditions.
pub fn conditions(directory: &Path, limits: &dyn Fn() -> Limits) -> Result<String, Message> {
    let wrong = |reason: String| Message::at("M121", &directory.display().to_string(), None, reason);
    let (Manifest { claim, solves, .. }, contents) = read(directory).map_err(wrong)?;
    let text = |name: &str| text(&contents, name);
    let metric = match &claim {
        Claim::Unsolvable => None,
        Claim::Optimal { metric } => {
            let (domain, problem) = read_pddl(text(DOMAIN), text(PROBLEM)).map_err(wrong)?;
            let (_, timed) = same_task(&domain, &problem, &solves, text(TASK), limits).map_err(wrong)?;
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
    limits: &dyn Fn() -> Limits,
) -> Vec<Part> {
    let Manifest { claim, solves, refutation, .. } = manifest;
    let text = |name: &str| text(contents, name);
    let (domain, problem) = match read_pddl(text(DOMAIN), text(PROBLEM)) {
        Ok(read) => read,
        Err(reason) => return vec![Part { part: "files", result: Err(reason) }],
    };
    let mut parts = Vec::new();
    if let Some(written) = written(contents) {
        let [derivations, filled] = knowledge::check(&written, &domain, &problem);
        parts.push(Part { part: "derivations", result: derivations });
        parts.push(Part { part: "knowledge", result: filled });
    }
    let (same, timed) = match same_task(&domain, &problem, solves, text(TASK), limits) {
        Ok((said, timed)) => (Ok(said), timed),
        // Whatever it is, it is not verified.
        Err(reason) => (Err(reason), false),
    };
    parts.push(Part { part: "task", result: same });
    let metric = match claim {
        Claim::Unsolvable => None,
        Claim::Optimal { metric } => {
            let checked = plan(&domain, &problem, timed, text(PLAN), metric);
            let (result, value) = match checked {
                Ok((said, value)) => (Ok(said), Some(value)),
                Err(reason) => (Err(reason), None),
            };
            parts.push(Part { part: "plan", result });
            let Some(value) = value else { return parts };
            Some(value)
        }
    };
    let checked = check_certificate(text(TASK), text(ARGUMENT), metric.as_ref());
    let result = checked.map_err(|fault| fault.to_string()).map(|Checked { labels, potentials, needs }| {
        format!("no plan is better: induction over {labels} labels, with {potentials} potentials and {needs} needs")
    });
    parts.push(Part { part: "argument", result });
    let documents = (text(TASK), text(ARGUMENT));
    parts.extend(match refutation {
        Refutation::Steps(steps) => refuted(directory, documents, metric.as_ref(), *steps),
        Refutation::None(reason) => {
            vec![Part {
                part: "formula",
                result: Ok(format!("none, the claim rests on the argument: {reason}")),
            }]
        }
    });
    parts
}

/// What a certificate says about knowledge, if it does.
fn written(contents: &[(String, String)]) -> Option<knowledge::Written<'_>> {
    contents.iter().any(|(name, _)| name == knowledge::ORIGIN).then(|| knowledge::Written {
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
) -> Vec<Part> {
    let open = |name: &str| fs::File::open(directory.join(name)).map(BufReader::new);
    let opened = STREAMED.map(open);
    let [Ok(mut formula), Ok(mut legend), Ok(mut proof), Ok(mut hints)] = opened else {
        return vec![Part { part: "formula", result: Err("it cannot be read".to_owned()) }];
    };
    let inputs =
        RefutationInputs { formula: &mut formula, legend: &mut legend, proof: &mut proof, hints: &mut hints };
    let checked = check_refutation(documents, metric, steps, inputs).into_iter();
    checked.map(|(part, result)| Part { part, result }).collect()
}

fn read_pddl(domain: &str, problem: &str) -> Result<(Domain, Problem), String> {
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
    let plan = PlanText::parse(&Source::new(PLAN, text))
        .map_err(|found| found.first().map_or_else(String::new, |diagnostic| diagnostic.message.clone()))?;
    let verdict = validate(domain, problem, &plan, &Options::default());
    if let Some(violation) = verdict.violation {
        return Err(violation.message);
    }
    let steps = plan.steps.len();
    let value = measure(problem, &verdict, steps, timed).ok_or("the metric has no value after the plan")?;
    let decimal = rules::Decimal::from_rational(&value);
    let is_decimal = decimal.to_rational() == value && decimal.to_string() == claimed;
    if value.to_string() != claimed && !is_decimal {
        return Err(format!("its metric is {value}, where {claimed} is claimed"));
    }
    Ok((format!("{steps} steps, valid, metric {claimed}"), value))
}

/// Whether the task stands for the files, and whether its operators take time: instance by instance, or else by grounding
/// the files again.
fn same_task(
    domain: &Domain,
    problem: &Problem,
    solves: &[String],
    written: &str,
    limits: &dyn Fn() -> Limits,
) -> Result<(String, bool), String> {
    let reason = match faithful(domain, problem, written) {
        Faithful::Yes { instances, idle, timed } => {
            let said = format!(
                "it stands for the files: {instances} instances of actions, {idle} of which change nothing that it knows"
            );
            return Ok((said, timed));
        }
        Faithful::Unknown(reason) => reason,
        Faithful::No(reason) => return Err(reason),
        _ => "another construct".to_owned(),
    };
    let solves = solves.iter().map(|name| Name::new(name)).collect();
    let config = GroundConfig { solves, limits: limits(), ..GroundConfig::default() };
    let task = ground(domain, problem, &config)
        .map_err(|errors| errors.first().map_or_else(String::new, ToString::to_string))?;
    if describes(written, &task) {
        let said = format!(
            "what the files ground to: {} operators; not compared instance by instance: {reason}",
            task.operator_count()
        );
        Ok((said, task.is_timed()))
    } else {
        Err(format!("the files ground to another task ({reason})"))
    }
}
