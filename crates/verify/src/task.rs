//! Reads the PDDL files of a certificate and checks that its ground task is faithful to them.

use certificate::{Difference, Faithful, Fault, GroundTask, faithful_to};
use pddl::Source;
use pddl::ast::{Domain, Problem};

use crate::manifest::{DOMAIN, PROBLEM};

/// Parses the domain and the problem of a certificate.
///
/// # Errors
/// The message of the first error in the texts.
pub fn read_pddl(domain: &str, problem: &str) -> Result<(Domain, Problem), String> {
    let parsed = pddl::read(&Source::new(DOMAIN, domain), &Source::new(PROBLEM, problem));
    let first = |errors: pddl::Errors| errors.first().map_or_else(String::new, |error| error.message.clone());
    parsed.map(|(domain, problem, _)| (domain, problem)).map_err(first)
}

/// Checks that a ground task is faithful to its PDDL files. Returns a summary, and `true` if plans are measured
/// by time, because there is no metric and actions take time. The check is aborted when `stop` returns `true`.
///
/// # Errors
/// The first difference, or the reason why the check is undecided.
pub fn same_task(
    domain: &Domain,
    problem: &Problem,
    (task, witness): (&Result<GroundTask, Fault>, &str),
    stop: &dyn Fn() -> bool,
) -> Result<(String, bool), String> {
    let task = task.as_ref().map_err(|fault| Difference::from(fault).to_string())?;
    match faithful_to(domain, problem, task, witness, stop) {
        Faithful::Yes { instances, idle, timed } => {
            let summary = format!(
                "it represents the files: {instances} instances of actions may be executable, {idle} of which change \
                 no variable of the task"
            );
            Ok((summary, timed))
        }
        Faithful::No(difference) => Err(difference.to_string()),
        Faithful::Undecided(cause) => Err(cause.to_string()),
    }
}
