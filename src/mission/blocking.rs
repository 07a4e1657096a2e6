//! Explains an unsolvable mission by a minimal set of unavailable designs.
//!
//! The explanation is sought if the mission has no plan, but would have one with all designs of the
//! knowledge base available. Designs are made available one by one, and a design stays available if there is still
//! no plan. The remaining set of designs is minimal: with any one of them available, there would be a plan. This is the
//! deletion-based search for a minimal unsatisfiable core [1], with the planner in place of the SAT solver; its proofs
//! hold for plans of every length.
//!
//! In PLANTA's form, actions can make a design unavailable, so all designs are tried if those that are unavailable at the
//! start are not sufficient.
//!
//! [1] J. Marques-Silva, I. Lynce: On improving MUS extraction algorithms, SAT 2011.

use std::fmt;

use pddl::ast::Problem;
use planner::{Config, Status, optimize};

use ::mission::Mission;

use crate::mission::planning::ground_with;

/// Reason why a mission is unsolvable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Blocking {
    /// Minimal set of unavailable designs of the knowledge base, sorted by local name. The mission has no plan while all
    /// of them are unavailable, even if every other design of the knowledge base is available. If any one of them
    /// becomes available, in addition to all other designs of the knowledge base, the mission has a plan.
    Designs(Vec<String>),
    /// Designs of the knowledge base are not the reason: the mission has no plan even if all of them are available.
    Other,
}

/// Writes the reason as a clause that continues a sentence.
impl fmt::Display for Blocking {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Designs(designs) => write!(
                f,
                "unavailable designs are the cause: there is no plan without {}; with all other designs of the \
                 knowledge base, any one of these would be sufficient",
                designs.join(", ")
            ),
            Self::Other => f.write_str(
                "designs are not the cause: no plan exists even if all designs of the knowledge base are available",
            ),
        }
    }
}

/// Explains why an unsolvable problem has no plan. The problem was returned by [`Mission::filled`]. Returns `None` if
/// the mission has no knowledge base with designs, or if planning cannot decide within the limits.
pub fn blocking(mission: &Mission, problem: &Problem, config: &Config) -> Option<Blocking> {
    let mut config = config.clone();
    // A limit on the number of steps would hide longer plans.
    config.horizon = None;
    let config = &config;
    let designs = mission.knowledge()?.view().function_designs();
    if designs.is_empty() {
        return None;
    }
    let mut missing = Vec::new();
    for design in &designs {
        config.limits.check().ok()?;
        if !mission.is_available(problem, design) {
            missing.push(design.individual.name.clone());
        }
    }
    let mut is_solvable = solvable_with(mission, problem, &missing, config)?;
    if !is_solvable && mission.completed_predicates().is_some() && missing.len() < designs.len() {
        missing = designs.into_iter().map(|design| design.individual.name).collect();
        is_solvable = solvable_with(mission, problem, &missing, config)?;
    }
    let mut blocking = missing.clone();
    if is_solvable {
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

/// Returns `true` if there is a plan when the designs in `available` are available in addition to those that are
/// available now. `None` if the planner cannot decide this within the limits.
fn solvable_with(
    mission: &Mission,
    problem: &Problem,
    available: &[String],
    config: &Config,
) -> Option<bool> {
    let mut problem = problem.clone();
    // The metric does not affect solvability.
    problem.metric = None;
    let is_added = |design: &str| available.iter().any(|name| name == design).then_some(true);
    let domain = mission.allow(&mut problem, &is_added);
    let task = ground_with(mission, &domain, &problem, &[], &config.limits).ok()?;
    match optimize(&task, config, &mut |_| {}).status {
        Status::Optimal | Status::Feasible => Some(true),
        Status::Unsolvable => Some(false),
        Status::UnsolvableWithinHorizon | Status::Unknown => None,
    }
}
