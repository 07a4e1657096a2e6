//! Why a mission has no plan, as far as it is for designs that are not available: a smallest part of them that suffices.
//!
//! The facts that designs are available are taken for assumptions. The designs that are not, all together, leave no plan; one
//! after the other is made available, and stays so if there is still no plan without it. What is left is minimal: with any
//! one of them there would be a plan. This is the deletion-based search for a minimal unsatisfiable core [1], with the
//! planner, whose proofs hold for plans of every length, in the place of a SAT solver.
//!
//! [1] J. Marques-Silva, I. Lynce: On improving MUS extraction algorithms, SAT 2011.

use std::fmt;

use pddl::ast::Problem;
use planner::{Config, Status, optimize};

use ::mission::Mission;

use crate::mission::planning::ground_with;

/// What keeps an unsolvable mission from having a plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Blocking {
    /// That these designs are not available, by local name, sorted: as long as none of them is, there is no plan, however many
    /// others are; and with any one of them there would be one, were all others available, too.
    Designs(Vec<String>),
    /// Something else: there would be no plan if every design was available.
    Other,
}

/// In a sentence.
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

/// Why there is no plan for a problem that [`Mission::filled`] has made and that is proved to have none. None if the mission has
/// no knowledge base, or if a limit was reached before the reason was known.
pub fn blocking(mission: &Mission, problem: &Problem, config: &Config) -> Option<Blocking> {
    let mut config = config.clone();
    config.horizon = None;
    let config = &config;
    let designs = mission.knowledge()?.view().function_designs();
    let missing: Vec<String> =
        designs.into_iter().filter(|design| !design.available).map(|design| design.individual.name).collect();
    let mut blocking = missing.clone();
    if solvable_with(mission, problem, &missing, config)? {
        for design in &missing {
            let rest: Vec<String> = blocking.iter().filter(|name| *name != design).cloned().collect();
            let available: Vec<String> =
                missing.iter().filter(|name| !rest.contains(name)).cloned().collect();
            if !solvable_with(mission, problem, &available, config)? {
                blocking = rest;
            }
        }
        blocking.sort();
        return Some(Blocking::Designs(blocking));
    }
    Some(Blocking::Other)
}

/// Whether there is a plan with some further designs available; none if a limit was reached.
fn solvable_with(
    mission: &Mission,
    problem: &Problem,
    available: &[String],
    config: &Config,
) -> Option<bool> {
    let mut problem = problem.clone();
    // Any plan will do.
    problem.metric = None;
    let domain =
        mission.allow(&mut problem, &|design, own| own || available.iter().any(|other| other == design));
    let task = ground_with(mission, &domain, &problem, &[], &config.limits).ok()?;
    match optimize(&task, config, &mut |_| {}).status {
        Status::Optimal | Status::Feasible => Some(true),
        Status::Unsolvable => Some(false),
        Status::UnsolvableWithinHorizon | Status::Unknown => None,
    }
}
