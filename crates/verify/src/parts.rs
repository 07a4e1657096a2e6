//! Checks the parts of a certificate that is not of a Pareto front: a plan is optimal, or there is no plan.

use std::fs;
use std::io::BufReader;
use std::path::Path;

use certificate::{Checked, Claimed, GroundTask, Inputs, REFUTATION_PARTS};
use pddl::ast::{Domain, Problem};

use crate::files::text;
use crate::manifest::{
    ARGUMENT, Claim, DOMAIN, Manifest, PLAN, PROBLEM, Refutation, STREAMED, TASK, VerifiedPart, WITNESS,
};
use crate::plan::plan;
use crate::task::{read_pddl, same_task};
use crate::{derivations, knowledge};

/// Reason for the rejection of a manifest that claims more than a single certificate can prove.
pub(crate) const MISPLACED: &str = "the manifest of a single certificate claims a front";

/// Checks the parts of a certificate whose files match its manifest.
pub(crate) fn parts(
    directory: &Path,
    manifest: &Manifest,
    contents: &[(String, String)],
    stop: &dyn Fn() -> bool,
) -> Vec<VerifiedPart> {
    let Manifest { claim, refutation, .. } = manifest;
    let text = |name: &str| text(contents, name);
    let (domain, problem) = match read_pddl(text(DOMAIN), text(PROBLEM)) {
        Ok(read) => read,
        Err(reason) => return vec![VerifiedPart { part: "files", result: Err(reason) }],
    };
    let mut parts = origin_parts(contents, &domain, &problem);
    let task = GroundTask::read(text(TASK));
    let (task_result, timed) = match same_task(&domain, &problem, (&task, text(WITNESS)), stop) {
        Ok((summary, timed)) => (Ok(summary), timed),
        // If the task is rejected, it is unknown whether plans are measured by time. The plan is then checked
        // as if they were not; the certificate is rejected in any case.
        Err(reason) => (Err(reason), false),
    };
    parts.push(VerifiedPart { part: "task", result: task_result });
    let metric = match claim {
        Claim::Unsolvable => None,
        Claim::Front(_) => {
            parts.push(VerifiedPart { part: "argument", result: Err(MISPLACED.to_owned()) });
            return parts;
        }
        Claim::Optimal { metric } => {
            let checked = plan(&domain, &problem, timed, text(PLAN), metric, stop);
            let (result, value) = match checked {
                Ok((summary, value)) => (Ok(summary), Some(value)),
                Err(reason) => (Err(reason), None),
            };
            parts.push(VerifiedPart { part: "plan", result });
            // Without the metric value, the remaining parts cannot be checked.
            let Some(value) = value else { return parts };
            Some(value)
        }
    };
    let claimed = task.as_ref().map_err(Clone::clone);
    let claimed = claimed.and_then(|task| Claimed::read(task, text(ARGUMENT), metric.as_ref()));
    let checked = claimed.as_ref().map_err(Clone::clone).and_then(|claimed| claimed.check(stop));
    let result = checked.map_err(|fault| fault.to_string()).map(|Checked { labels, potentials, needs }| {
        format!("no plan is better: induction over {labels} labels, with {potentials} potentials and {needs} needs")
    });
    parts.push(VerifiedPart { part: "argument", result });
    parts.extend(match (refutation, &claimed) {
        (Refutation::Steps(steps), Ok(claimed)) => refuted(directory, claimed, *steps, stop),
        (Refutation::Steps(_), Err(fault)) => {
            REFUTATION_PARTS.map(|part| VerifiedPart { part, result: Err(fault.to_string()) }).into()
        }
        (Refutation::None(reason), _) => {
            vec![VerifiedPart {
                part: "formula",
                result: Ok(format!("none, the claim rests on the argument: {reason}")),
            }]
        }
    });
    parts
}

/// Checks that the PDDL files follow from the knowledge base of the certificate, if it has one.
pub(crate) fn origin_parts(
    contents: &[(String, String)],
    domain: &Domain,
    problem: &Problem,
) -> Vec<VerifiedPart> {
    let Some(written) = written(contents) else { return Vec::new() };
    let [derivations, filled] = knowledge::check(&written, domain, problem);
    vec![
        VerifiedPart { part: "derivations", result: derivations },
        VerifiedPart { part: "knowledge", result: filled },
    ]
}

pub(crate) fn written(contents: &[(String, String)]) -> Option<knowledge::KnowledgeFiles<'_>> {
    contents.iter().any(|(name, _)| name == knowledge::ORIGIN).then(|| knowledge::KnowledgeFiles {
        document: text(contents, knowledge::DOCUMENT),
        origin: text(contents, knowledge::ORIGIN),
        derivations: text(contents, derivations::DERIVATIONS),
    })
}

fn refuted(
    directory: &Path,
    claimed: &Claimed<'_>,
    steps: usize,
    stop: &dyn Fn() -> bool,
) -> Vec<VerifiedPart> {
    let open = |name: &str| fs::File::open(directory.join(name)).map(BufReader::new);
    let opened = STREAMED.map(open);
    let [Ok(mut formula), Ok(mut legend), Ok(mut proof), Ok(mut hints)] = opened else {
        return vec![VerifiedPart { part: "formula", result: Err("it cannot be read".to_owned()) }];
    };
    let inputs = Inputs { formula: &mut formula, legend: &mut legend, proof: &mut proof, hints: &mut hints };
    let checked = claimed.check_refutation(steps, inputs, stop).into_iter();
    checked.map(|(part, result)| VerifiedPart { part, result }).collect()
}
