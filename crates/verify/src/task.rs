//! The files of a certificate, and whether its ground task stands for them.

use certificate::{Faithful, faithful};
use pddl::Source;
use pddl::ast::{Domain, Problem};

use crate::manifest::{DOMAIN, PROBLEM};

/// The domain and the problem, from their texts.
///
/// # Errors
/// The first thing that is wrong with them.
pub fn read_pddl(domain: &str, problem: &str) -> Result<(Domain, Problem), String> {
    let read = pddl::read(&Source::new(DOMAIN, domain), &Source::new(PROBLEM, problem));
    let first =
        |found: pddl::Errors| found.first().map_or_else(String::new, |diagnostic| diagnostic.message.clone());
    read.map(|(domain, problem, _)| (domain, problem)).map_err(first)
}

/// Whether the task stands for the files, and whether plans are measured by time where there is no metric. The comparison ends
/// when `stop` says so.
///
/// # Errors
/// The first difference, or why it is not known.
pub fn same_task(
    domain: &Domain,
    problem: &Problem,
    (task, witness): (&str, &str),
    stop: &dyn Fn() -> bool,
) -> Result<(String, bool), String> {
    match faithful(domain, problem, task, witness, stop) {
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
