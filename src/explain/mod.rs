//! Explanations: why a design is available or unavailable, why it is chosen or not chosen, and which changes lead to
//! another plan.
//!
//! Availability is explained by reasoning without planning: [`availability`]. "Why is this design not chosen?" is
//! answered by planning again with this design as the only one for its functions, as if it were available. The
//! metric of this plan minus that of the best plan is the price of the design. "What would change the plan?" is
//! answered by planning with other values. A measured attribute is set to the values at which a requirement begins
//! or ceases to hold, or at which the outcome of a comparison with a number in a rule changes. The value of a
//! numeric function without parameters, such as a battery, is varied in growing steps, then by bisection between a
//! value with the current plan and a value with another plan.

mod causes;
mod parts;
mod rule_bounds;
mod solve;
mod thresholds;

use std::borrow::Cow;
use std::collections::BTreeSet;

use ontology::tomasys::{FunctionDesign, Individual};
use ontology::vocab::local_name;
use pddl::Mentioned;
use pddl::ast::{Domain, Problem};
use planner::Limits;

use crate::mapek::PlannedStep;
use crate::message::{Errors, Message};
use crate::mission::Mission;

use solve::solve;

pub(crate) use causes::disagreement;
pub use causes::{Availability, Cause, Causes, causes};
pub use parts::{Alteration, BestPlan, Change, Repair, Target};
pub use solve::best;
pub use thresholds::{SmallestChanges, smallest_changes};

/// Explanation of the availability and the choice of one design.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct DesignExplanation {
    /// Availability of the design and its causes, derived without planning.
    pub availability: Availability,
    /// The best plan for the mission in its current situation.
    pub best: BestPlan,
    /// Numbers of the steps of `best` that use the design, from 1.
    pub used: Vec<usize>,
    /// The best plan with this design as the only one for its functions. If the design is unavailable, it is assumed to
    /// be available. Other designs that only the problem states keep their availability.
    pub alone: BestPlan,
    /// The best plan if the design is not available.
    pub without: BestPlan,
    /// For each set of alterations in [`Availability::ways`], the best plan after all alterations
    /// of the set.
    pub repairs: Vec<Repair>,
    /// Each single alteration in [`Availability::ways`], with the best plan after this alteration
    /// alone.
    pub changes: Vec<Change>,
    /// `true` if each plan of the explanation is proved optimal, or proved not to exist. `false`, for example,
    /// if a limit was reached or reasoning failed.
    pub complete: bool,
}

fn find<'m>(mission: &'m Mission, name: &str) -> Result<(&'m FunctionDesign, &'m [FunctionDesign]), Errors> {
    let designs = mission.knowledge().map(|knowledge| knowledge.catalogue().designs()).unwrap_or_default();
    let named = designs.iter().find(|design| design.individual.name == name);
    let is_meant = |design: &&FunctionDesign| {
        [local_name(&design.individual.iri), &design.individual.iri].contains(&name)
    };
    if let Some(found) = named.or_else(|| designs.iter().find(is_meant)) {
        return Ok((found, designs));
    }
    let names: Vec<&str> = designs.iter().map(|design| design.individual.name.as_str()).collect();
    let suggestion = crate::message::did_you_mean(name, names.iter().map(|name| &**name));
    let text = format!("there is no design `{name}`; there are: {}{suggestion}", names.join(", "));
    Err(vec![Message::error("M112", text)].into())
}

/// Explains, by reasoning without planning, whether the design with this local name or IRI is
/// available.
///
/// # Errors
/// M112 if the design does not exist.
pub fn availability(mission: &Mission, name: &str) -> Result<Availability, Errors> {
    let (found, _) = find(mission, name)?;
    Ok(causes::availability(mission, found))
}

/// Explains availability and choice of the design with this local name or IRI. At a limit, returns
/// the partial results.
///
/// ```
/// use std::path::Path;
/// use metaplan::{planner::Limits, explain, setup::Setup};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut mission = Setup::read(Path::new("missions/ugv.toml"))?.mission;
/// mission.fail("c_kinect")?;
/// let explanation = explain::design(&mission, "fd_amcl_kinect", &Limits::none())?;
/// assert!(!explanation.availability.available && !explanation.availability.because.is_empty());
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// There is no such design, or the mission cannot be planned for.
pub fn design(mission: &Mission, name: &str, limits: &Limits) -> Result<DesignExplanation, Errors> {
    availability(mission, name)?.plan(mission, limits, &mut |_| {})
}

impl Availability {
    /// Extends the explanation of the availability by plans, in this order: the best plan now, the
    /// best plans after each set of alterations in [`Availability::ways`], the best plan with the
    /// design as the only one for its functions, the best plan without it, and the best plans after
    /// each single alteration. `hear` is called with a short description of the next plan or plans before they
    /// are searched for.
    ///
    /// # Errors
    /// The mission cannot be planned for.
    pub fn plan(
        self,
        mission: &Mission,
        limits: &Limits,
        hear: &mut dyn FnMut(&str),
    ) -> Result<DesignExplanation, Errors> {
        let (found, designs) = find(mission, &self.design)?;
        let name = self.design.as_str();
        hear("the best plan");
        let best = best(mission, limits)?;
        let uses = |step: &PlannedStep| step.configuration.iter().any(|(_, design)| design == name);
        let used = (1..).zip(&best.steps).filter(|(_, step)| uses(step)).map(|(number, _)| number).collect();
        let mut repairs = Vec::new();
        for (way, number) in self.ways.iter().zip(1..) {
            hear(&format!("change {number} of {}", self.ways.len()));
            let then = causes::in_situation(mission, way, limits)?;
            repairs.push(Repair { alterations: way.clone(), then });
        }
        hear("it as the only design");
        let alone = solve(mission, limits, &|problem| only_design(mission, found, designs, problem))?;
        hear("without it");
        let is_excluded = |design: &str| (design == name).then_some(false);
        let without = solve(mission, limits, &|problem| mission.allow(problem, &is_excluded))?;
        hear("single changes");
        let changes = causes::singly(mission, &repairs, limits)?;
        let plans = [&best, &alone, &without].into_iter();
        let plans = plans.chain(repairs.iter().map(|repair| &repair.then));
        let complete = plans.chain(changes.iter().map(|change| &change.then)).all(|plan| plan.proved);
        Ok(DesignExplanation { availability: self, best, used, alone, without, repairs, changes, complete })
    }
}

/// Changes a filled problem so that `design` is available and the only one of `designs` for its functions. Returns the
/// domain for this problem. A design that also solves other functions is kept for these if conditions of the domain
/// read which design solves which function.
fn only_design<'m>(
    mission: &'m Mission,
    design: &'m FunctionDesign,
    designs: &'m [FunctionDesign],
    problem: &mut Problem,
) -> Cow<'m, Domain> {
    let name_of = |design: &'m FunctionDesign| design.individual.name.as_str();
    let is_shared = |function: &Individual| design.solves.contains(function);
    let read = Mentioned::by_domain(mission.domain()).predicates;
    let is_solved_read = mission.solves().iter().any(|predicate| read.contains(predicate));
    let rivals = designs.iter().filter(|rival| rival.individual != design.individual);
    let rivals = rivals.filter(|rival| rival.solves.iter().any(is_shared));
    let (partial, full): (Vec<_>, Vec<_>) =
        rivals.partition(|rival| is_solved_read && !rival.solves.iter().all(is_shared));
    let full: BTreeSet<&str> = full.into_iter().map(name_of).collect();
    let mut domain = mission.allow(problem, &|candidate| {
        if candidate == name_of(design) { Some(true) } else { full.contains(candidate).then_some(false) }
    });
    let partial: Vec<&str> = partial.into_iter().map(name_of).collect();
    let functions: Vec<&str> = design.solves.iter().map(|function| function.name.as_str()).collect();
    mission.withdraw_functions(&mut domain, problem, &partial, &functions);
    domain
}
