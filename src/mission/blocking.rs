//! Explains an unsolvable mission by a minimal set of unavailable designs.
//!
//! The mission with all unavailable designs has no plan. The designs are made available one by one,
//! and a design stays available if there is still no plan. The remaining set is minimal: with any
//! one of its designs there would be a plan. This is the deletion-based search for a minimal
//! unsatisfiable core [1]. The planner replaces the SAT solver; its proofs hold for plans of every
//! length.
//!
//! [1] J. Marques-Silva, I. Lynce: On improving MUS extraction algorithms, SAT 2011.

use std::fmt;

use pddl::ast::Problem;
use planner::{Config, Status, optimize};

use ::mission::Mission;

use crate::mission::planning::ground_with;

/// Reason for the unsolvability of a mission.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Blocking {
    /// Minimal set of unavailable designs, sorted by local name. The mission has no plan while all
    /// of them are unavailable, even if every other design is available. With any one of them, and
    /// all others, it has a plan.
    Designs(Vec<String>),
    /// The mission has no plan even if every design is available.
    Other,
}

/// Formats the reason as a clause.
impl fmt::Display for Blocking {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Designs(designs) => write!(
                f,
                "it is for designs that are not available: there is no plan without {}; with any one of them, and all \
                 others, there would be",
                designs.join(", ")
            ),
            Self::Other => {
                f.write_str("it is not for designs: with all of them available there would be none either")
            }
        }
    }
}

/// Explains why a problem that [`Mission::filled`] has made, and that is proved unsolvable, has no
/// plan. `None` if the mission has no knowledge base, or if a limit was reached.
pub fn blocking(mission: &Mission, problem: &Problem, config: &Config) -> Option<Blocking> {
    let mut config = config.clone();
    // A limit on the number of steps would hide longer plans.
    config.horizon = None;
    let config = &config;
    let designs = mission.knowledge()?.view().function_designs();
    let missing: Vec<String> =
        designs.into_iter().filter(|design| !design.available).map(|design| design.individual.name).collect();
    let mut blocking = missing.clone();
    if solvable_with(mission, problem, &missing, config)? {
        for design in &missing {
            let remaining: Vec<String> = blocking.iter().filter(|name| *name != design).cloned().collect();
            let available: Vec<String> =
                missing.iter().filter(|name| !remaining.contains(name)).cloned().collect();
            if !solvable_with(mission, problem, &available, config)? {
                blocking = remaining;
            }
        }
        blocking.sort();
        return Some(Blocking::Designs(blocking));
    }
    Some(Blocking::Other)
}

/// Returns `true` if there is a plan with `available` as further designs. `None` if a limit was
/// reached.
fn solvable_with(
    mission: &Mission,
    problem: &Problem,
    available: &[String],
    config: &Config,
) -> Option<bool> {
    let mut problem = problem.clone();
    // The metric does not affect solvability.
    problem.metric = None;
    let domain = mission.allow(&mut problem, &|design, is_available| {
        is_available || available.iter().any(|name| name == design)
    });
    let task = ground_with(mission, &domain, &problem, &[], &config.limits).ok()?;
    match optimize(&task, config, &mut |_| {}).status {
        Status::Optimal | Status::Feasible => Some(true),
        Status::Unsolvable => Some(false),
        Status::UnsolvableWithinHorizon | Status::Unknown => None,
    }
}
