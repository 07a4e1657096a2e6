//! Why a design is available or not, why it is chosen or not, and what would have to be measured for another answer.
//!
//! "Why not this one?" is answered by planning again: with the design in question as the only one for its functions, and, if
//! it is not available, as if it were. The difference of the metrics is what the answer is worth. "What would change
//! it?" is answered by trying the values at which a requirement begins or ceases to hold, and, for values of the problem such as
//! a battery, by bisection between a value with the same plan and one with another.

use std::collections::BTreeSet;

use encodings::{Config, Limits, Status, optimize};
use num_rational::BigRational;
use ontology::tomasys::change::Status as Component;
use ontology::tomasys::{FunctionDesign, Individual};
use ontology::vocab::local_name;

use crate::mapek::{PlannedStep, ruled_out};
use crate::message::{Errors, Message};
use crate::mission::numbers::against;
use crate::mission::{Mission, ground_with};
use crate::number;

/// How finely values are told apart, as a part of the value.
const FINENESS: i64 = 1000;

/// The best plan for a mission under some condition.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct BestPlan {
    /// The metric of the best plan, in its unit; none where there is no plan.
    pub cost: Option<BigRational>,
    /// Whether that is proved.
    pub proved: bool,
    /// The plan.
    pub steps: Vec<PlannedStep>,
}

/// All about one design.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct DesignExplanation {
    /// Its local name.
    pub design: String,
    /// The functions that it solves.
    pub functions: Vec<String>,
    /// Whether it is available.
    pub available: bool,
    /// The rules and facts that rule it out.
    pub because: Vec<String>,
    /// The steps of the best plan that use it, from 1.
    pub used: Vec<usize>,
    /// The best plan in which no other design solves its functions; as if it were available if it is not.
    pub alone: BestPlan,
    /// The best plan without it.
    pub without: BestPlan,
    /// What would have to change for it to be available, or to be so no more.
    pub changes: Vec<Change>,
}

/// A change that leads to another answer.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Change {
    /// The attribute, function or component.
    pub name: String,
    /// Its value now; none for a component.
    pub from: Option<BigRational>,
    /// What it would have to be.
    pub to: Target,
    /// The answer then.
    pub then: BestPlan,
}

/// What a value would have to be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Target {
    /// At least this.
    AtLeast(BigRational),
    /// At most this.
    AtMost(BigRational),
    /// More than this.
    Above(BigRational),
    /// Less than this.
    Below(BigRational),
    /// A component that has failed works again.
    Recovered,
    /// A component that works fails.
    Failed,
}

/// The best plan for a mission as it is.
///
/// # Errors
/// The mission cannot be planned for.
pub fn best(mission: &Mission, limits: &Limits) -> Result<BestPlan, Errors> {
    solve(mission, limits, &|_, available| available)
}

/// The best plan where `allowed` says, of each design and whether it is available, whether it may be used.
fn solve(
    mission: &Mission,
    limits: &Limits,
    allowed: &dyn Fn(&str, bool) -> bool,
) -> Result<BestPlan, Errors> {
    let (mut problem, _) = mission.filled()?;
    let domain = mission.allow(&mut problem, allowed);
    let task = ground_with(mission, &domain, &problem, &[], limits)?;
    let config = Config::default().with_limits(limits.clone());
    let solution = optimize(&task, &config, &mut |_| {});
    let proved = matches!(solution.status, Status::Optimal | Status::Unsolvable);
    let steps = solution.plan.iter().flat_map(|plan| &plan.steps);
    let steps = steps.map(|step| PlannedStep::new(mission, step)).collect();
    Ok(BestPlan { cost: solution.plan.map(|plan| number::of_plan(&plan.cost)), proved, steps })
}

/// Explains one design, by its local name.
///
/// ```
/// use std::path::Path;
/// use metaplan::{encodings::Limits, explain, setup::Setup};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut mission = Setup::read(Path::new("missions/ugv.toml"))?.mission;
/// mission.fail("c_kinect")?;
/// let found = explain::design(&mission, "fd_amcl_kinect", &Limits::none())?;
/// assert!(!found.available && !found.because.is_empty());
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// There is no such design, or the mission cannot be planned for.
pub fn design(mission: &Mission, name: &str, limits: &Limits) -> Result<DesignExplanation, Errors> {
    let designs =
        mission.knowledge().map(|knowledge| knowledge.view().function_designs()).unwrap_or_default();
    let named = || designs.iter().find(|design| design.individual.name == name);
    let known = || {
        designs
            .iter()
            .find(|design| [local_name(&design.individual.iri), &design.individual.iri].contains(&name))
    };
    let Some(found) = named().or_else(known) else {
        let known: Vec<&str> = designs.iter().map(|design| design.individual.name.as_str()).collect();
        let meant = crate::message::did_you_mean(name, known.iter().map(|own| &**own));
        let text = format!("there is no design `{name}`; there are: {}{meant}", known.join(", "));
        return Err(vec![Message::error("M112", text)].into());
    };
    let name = found.individual.name.as_str();
    let rivals: BTreeSet<&str> = designs
        .iter()
        .filter(|other| other.solves.iter().any(|function| found.solves.contains(function)))
        .map(|other| other.individual.name.as_str())
        .collect();
    let steps = best(mission, limits)?.steps;
    let uses = |step: &PlannedStep| step.configuration.iter().any(|(_, design)| design == name);
    let used = (1..).zip(&steps).filter(|(_, step)| uses(step)).map(|(number, _)| number).collect();
    Ok(DesignExplanation {
        design: name.to_owned(),
        functions: found.solves.iter().map(|function| function.name.clone()).collect(),
        available: found.available,
        because: because(mission, name),
        used,
        alone: solve(mission, limits, &|other, available| {
            other == name || available && !rivals.contains(other)
        })?,
        without: solve(mission, limits, &|other, available| other != name && available)?,
        changes: availability_changes(mission, found, limits)?,
    })
}

/// What rules a design out, and why it could not be used though it were available.
fn because(mission: &Mission, name: &str) -> Vec<String> {
    let ruled_out = mission.knowledge().map(|knowledge| ruled_out(knowledge, name)).unwrap_or_default();
    ruled_out.into_iter().chain(against(mission, name)).collect()
}

/// For each measured attribute and each value of the problem the smallest changes, upwards and downwards, that lead to
/// another plan.
///
/// # Errors
/// The mission cannot be planned for.
pub fn smallest_changes(mission: &Mission, limits: &Limits) -> Result<Vec<Change>, Errors> {
    let base = best(mission, limits)?;
    let mut changes = Vec::new();
    for (attribute, from) in measured(mission) {
        for upwards in [false, true] {
            for target in thresholds(mission, &attribute, &from, upwards) {
                let then = with_value(mission, &attribute, &target.example(), limits)?;
                if is_other(&then, &base) {
                    changes.push(Change {
                        name: attribute.clone(),
                        from: Some(from.clone()),
                        to: target,
                        then,
                    });
                    break;
                }
            }
        }
    }
    for (function, from) in mission.values() {
        for upwards in [false, true] {
            changes.extend(bisect(mission, &function, &from, upwards, &base, limits)?);
        }
    }
    Ok(changes)
}

/// Whether another plan is the answer.
fn is_other(one: &BestPlan, other: &BestPlan) -> bool {
    let key = |step: &PlannedStep| (step.action.clone(), step.arguments.clone());
    !one.steps.iter().map(key).eq(other.steps.iter().map(key)) || one.cost.is_some() != other.cost.is_some()
}

fn measured(mission: &Mission) -> Vec<(String, BigRational)> {
    let Some(knowledge) = mission.knowledge() else { return Vec::new() };
    let measurements = knowledge.view().measurements().into_iter();
    measurements.filter_map(|measurement| Some((measurement.attribute, measurement.value?))).collect()
}

/// The values of an attribute at which a requirement begins or ceases to hold, the nearest first.
fn thresholds(mission: &Mission, attribute: &str, from: &BigRational, upwards: bool) -> Vec<Target> {
    let designs =
        mission.knowledge().map(|knowledge| knowledge.view().function_designs()).unwrap_or_default();
    let requirements = designs.iter().flat_map(|design| &design.requirements);
    let mut targets: Vec<Target> = Vec::new();
    for requirement in requirements.filter(|requirement| requirement.attribute == attribute) {
        if let Some(minimum) = &requirement.minimum {
            match (upwards, from < minimum) {
                (true, true) => targets.push(Target::AtLeast(minimum.clone())),
                (false, false) => targets.push(Target::Below(minimum.clone())),
                _ => {}
            }
        }
        if let Some(maximum) = &requirement.maximum {
            match (upwards, from > maximum) {
                (false, true) => targets.push(Target::AtMost(maximum.clone())),
                (true, false) => targets.push(Target::Above(maximum.clone())),
                _ => {}
            }
        }
    }
    let distance = |target: &Target| {
        let distance = target.example() - from;
        if upwards { distance } else { -distance }
    };
    targets.sort_by_key(distance);
    targets.dedup();
    targets
}

impl Target {
    /// A value that is as asked for, as near as can be told apart; 0 for components.
    fn example(&self) -> BigRational {
        let little = BigRational::new(1.into(), 1_000_000.into());
        match self {
            Self::AtLeast(bound) | Self::AtMost(bound) => bound.clone(),
            Self::Above(bound) => bound + little,
            Self::Below(bound) => bound - little,
            Self::Recovered | Self::Failed => BigRational::default(),
        }
    }
}

fn with_value(
    mission: &Mission,
    name: &str,
    value: &BigRational,
    limits: &Limits,
) -> Result<BestPlan, Errors> {
    let mut other = mission.clone();
    other.set(name, &number::decimal(value))?;
    best(&other, limits)
}

/// Looks for the nearest value of a function, on one side, with another plan.
fn bisect(
    mission: &Mission,
    function: &str,
    from: &BigRational,
    upwards: bool,
    base: &BestPlan,
    limits: &Limits,
) -> Result<Option<Change>, Errors> {
    let zero = BigRational::default();
    if *from <= zero {
        return Ok(None);
    }
    let whole = |value: i64| BigRational::from_integer(value.into());
    let (mut same, mut other) = (from.clone(), None);
    for percent in [1, 2, 5, 10, 20, 50, 100] {
        let part = from * whole(percent) / whole(100);
        let value = if upwards { from + part } else { from - part };
        let then = with_value(mission, function, &value, limits)?;
        if is_other(&then, base) {
            other = Some((value, then));
            break;
        }
        same = value;
    }
    let Some((mut value, mut then)) = other else { return Ok(None) };
    let fine = from / whole(FINENESS);
    while (if upwards { &value - &same } else { &same - &value }) > fine {
        let middle = number::rounded(&((&value + &same) / whole(2)));
        let between = with_value(mission, function, &middle, limits)?;
        if is_other(&between, base) {
            (value, then) = (middle, between);
        } else {
            same = middle;
        }
    }
    let to = if upwards { Target::AtLeast(value) } else { Target::AtMost(value) };
    Ok(Some(Change { name: function.to_owned(), from: Some(from.clone()), to, then }))
}

/// What makes a design available: all that rules it out, each with the change that takes it away. What makes it
/// unavailable: each change that does so by itself.
fn availability_changes(
    mission: &Mission,
    design: &FunctionDesign,
    limits: &Limits,
) -> Result<Vec<Change>, Errors> {
    let Some(knowledge) = mission.knowledge() else { return Ok(Vec::new()) };
    let mut changes = Vec::new();
    for component in knowledge.view().components() {
        if !design.components.contains(&component.individual) {
            continue;
        }
        let failed = matches!(component.status.as_deref(), Some("FALSE" | "ERROR" | "false"));
        if failed == design.available {
            continue;
        }
        let mut other = mission.clone();
        let status = if failed { Component::Recovered } else { Component::Failed };
        let Individual { iri, name } = component.individual;
        if let Some(knowledge) = other.knowledge_mut() {
            knowledge.report(&iri, status)?;
        }
        let to = if failed { Target::Recovered } else { Target::Failed };
        changes.push(Change { name, from: None, to, then: best(&other, limits)? });
    }
    for (attribute, from) in measured(mission) {
        for requirement in design.requirements.iter().filter(|requirement| requirement.attribute == attribute)
        {
            let minimum =
                requirement.minimum.iter().filter_map(|minimum| match (design.available, from < *minimum) {
                    (true, false) => Some(Target::Below(minimum.clone())),
                    (false, true) => Some(Target::AtLeast(minimum.clone())),
                    _ => None,
                });
            let maximum =
                requirement.maximum.iter().filter_map(|maximum| match (design.available, from > *maximum) {
                    (true, false) => Some(Target::Above(maximum.clone())),
                    (false, true) => Some(Target::AtMost(maximum.clone())),
                    _ => None,
                });
            for to in minimum.chain(maximum) {
                let then = with_value(mission, &attribute, &to.example(), limits)?;
                changes.push(Change { name: attribute.clone(), from: Some(from.clone()), to, then });
            }
        }
    }
    Ok(changes)
}
