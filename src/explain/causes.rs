//! Causes that rule a design out, and minimal sets of alterations that make the design available. For an available
//! design: single alterations that make it unavailable. An alteration is a recovery or failure of a component, or a
//! change of a measurement.
//!
//! Sets of alterations are tried in ascending order of size, up to a maximum number, by reasoning
//! with a copy of the knowledge base. So each listed set is known to suffice, but some sets may be
//! missing. These sets are the diagnoses of \[1\]. Each alteration of a set removes one cause. To
//! explain a cause, all other alterations of its set are applied. The conclusions that still rule
//! the design out are due to this cause.
//!
//! \[1\] R. Reiter: A theory of diagnosis from first principles, Artificial Intelligence 32, 1987.

use num_rational::BigRational;
use ontology::tomasys::change::{Status as Component, is_failed};
use ontology::tomasys::{FunctionDesign, Requirement};
use planner::Limits;
use std::cell::Cell;
use std::cmp::Ordering;

use crate::explain::parts::{Alteration, BestPlan, Change, Repair, Target};
use crate::explain::rule_bounds::{RuleBounds, rule_bounds};
use crate::explain::solve::best;
use crate::explain::thresholds::measured;
use crate::knowledge::Knowledge;
use crate::mapek::ruled_out;
use crate::message::Errors;
use crate::mission::Mission;
use crate::mission::numbers::against;

const MAX_TRIED: usize = 2_000;

/// Entry of [`Availability::unexamined`].
const INITIAL_STATE: &str = "changes of the initial state of the problem";

/// Availability of one design and its causes, derived without planning.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Availability {
    /// Local name of the design.
    pub design: String,
    /// Local names of the functions that the design solves.
    pub functions: Vec<String>,
    /// `true` if the design is available in the initial state.
    pub available: bool,
    /// Rules and facts that rule the design out, and reasons why some actions could not use the design even if it were
    /// available.
    pub because: Vec<String>,
    /// Failed components and measurements that contribute to ruling the design out.
    pub causes: Vec<Cause>,
    /// If the design is unavailable: minimal sets of alterations that make it available; some may be missing if
    /// there are many. All alterations of a set together suffice, and none of them was found to be superfluous.
    /// If the design is available: sets of one alteration, each of which makes it unavailable.
    pub ways: Vec<Vec<Alteration>>,
    /// Alterations that were not examined, in words. If this list is empty and `ways` is empty, too, no recoveries and
    /// no changes of measurements make the design available.
    pub unexamined: Vec<String>,
}

struct Ways {
    sets: Vec<Vec<Alteration>>,
    unexamined: Vec<String>,
}

/// A failed component or a measurement that contributes to ruling a design out.
#[derive(Debug, Clone)]
pub struct Cause {
    /// The alteration that removes this cause; other causes may remain.
    pub alteration: Alteration,
    /// The rules and facts by which this cause alone rules the design out. They are derived after
    /// the other alterations of a minimal set.
    pub because: Vec<String>,
    /// The knowledge base after the other alterations of the minimal set.
    pub knowledge: Knowledge,
}

impl PartialEq for Cause {
    fn eq(&self, other: &Self) -> bool {
        (&self.alteration, &self.because) == (&other.alteration, &other.because)
    }
}

/// The causes found that rule a design out.
#[derive(Debug, Clone)]
pub struct Causes {
    /// The causes. Empty if the design is available, or if no cause was found.
    pub causes: Vec<Cause>,
    /// `true` if the design becomes available when all these causes are removed: exactly one minimal set of
    /// alterations was found. Other sets may be missing.
    pub suffice_together: bool,
}

/// Returns the failed components and measurements that are found to contribute to ruling a design out. Some may be
/// missing, since the number of sets of alterations that are tried is limited.
pub fn causes(knowledge: &Knowledge, design: &FunctionDesign) -> Causes {
    if design.available {
        return Causes { causes: Vec::new(), suffice_together: false };
    }
    let ways = ways(knowledge, design).sets;
    let causes = causes_of(knowledge, design, &ways);
    let suffice_together = matches!(&ways[..], [way] if way.len() == causes.len());
    Causes { causes, suffice_together }
}

/// Returns a cause for each different alteration in `ways`. Omits causes with which reasoning
/// fails. The reasons of a cause are the conclusions that still rule the design out after all other
/// alterations of its set.
fn causes_of(knowledge: &Knowledge, design: &FunctionDesign, ways: &[Vec<Alteration>]) -> Vec<Cause> {
    let mut causes: Vec<Cause> = Vec::new();
    for (way, alteration) in ways.iter().flat_map(|way| way.iter().map(move |alteration| (way, alteration))) {
        let is_known = causes.iter().any(|cause| cause.alteration == *alteration);
        let remaining = way.iter().filter(|other| *other != alteration);
        if let Some(knowledge) = altered(knowledge, remaining).filter(|_| !is_known) {
            let because = ruled_out(&knowledge, &design.individual.name);
            causes.push(Cause { alteration: alteration.clone(), because, knowledge });
        }
    }
    causes
}

/// Returns minimal sets of alterations that make a design available (see [`repairs`]). Alterations that concern only
/// other designs are tried only if the alterations that concern this design do not suffice.
fn ways(knowledge: &Knowledge, design: &FunctionDesign) -> Ways {
    let bounds = rule_bounds(knowledge);
    let mut unexamined = bounds.unexamined.clone();
    let candidates = candidates(knowledge, design, &bounds);
    let (sets, _) = repairs(knowledge, design, &candidates);
    if !sets.is_empty() {
        return Ways { sets: nearest(&sets), unexamined };
    }
    // Rules may depend on more than the design's own requirements.
    let (sets, all_tried) = repairs(knowledge, design, &all_candidates(knowledge, candidates, &bounds));
    if sets.is_empty() && !all_tried {
        unexamined.push("some combinations of changes".to_owned());
    }
    Ways { sets: nearest(&sets), unexamined }
}

/// Returns the sets that imply no other set. For example, `above 8` is omitted if `above 7` suffices. Sets that
/// imply each other, such as those for two measurements of an attribute, are all kept.
fn nearest(sets: &[Vec<Alteration>]) -> Vec<Vec<Alteration>> {
    let implies = |set: &[Alteration], other: &[Alteration]| {
        other.iter().all(|needed| set.iter().any(|alteration| alteration.implies(needed)))
    };
    let is_nearest =
        |set: &&Vec<Alteration>| sets.iter().all(|other| !implies(set, other) || implies(other, set));
    sets.iter().filter(is_nearest).cloned().collect()
}

/// Returns the reason why a design is available or not if the knowledge base alone has another conclusion than the
/// axioms of the domain. `None` if they agree.
pub fn disagreement(design: &FunctionDesign, available: bool) -> Option<&'static str> {
    (available != design.available).then_some(if available {
        "the knowledge base rules it out, but in the initial state the axioms of the domain do not"
    } else {
        "in the initial state the axioms of the domain rule it out, but the knowledge base alone does not"
    })
}

pub(super) fn availability(mission: &Mission, design: &FunctionDesign) -> Availability {
    let available = mission.is_available(&mission.current(), design);
    let mut availability = Availability {
        design: design.individual.name.clone(),
        functions: design.solves.iter().map(|function| function.name.clone()).collect(),
        available,
        // Reasons why some actions could not use the design even if it were available.
        because: against(mission, &design.individual.name),
        causes: Vec::new(),
        ways: Vec::new(),
        unexamined: Vec::new(),
    };
    let Some(knowledge) = mission.knowledge() else { return availability };
    if let Some(text) = disagreement(design, available) {
        availability.because.push(text.to_owned());
        availability.unexamined.push(INITIAL_STATE.to_owned());
        return availability;
    }
    if design.available {
        let loses = |alteration: &Alteration| {
            altered(knowledge, [alteration]).is_some_and(|knowledge| !is_available(&knowledge, design))
        };
        let bounds = rule_bounds(knowledge);
        let candidates = candidates(knowledge, design, &bounds).into_iter();
        let ways: Vec<_> = candidates.filter(loses).map(|alteration| vec![alteration]).collect();
        availability.ways = nearest(&ways);
        availability.unexamined = bounds.unexamined;
        availability.confirm(mission, design);
        return availability;
    }
    let Ways { sets, unexamined } = ways(knowledge, design);
    availability.ways = sets;
    availability.unexamined = unexamined;
    availability.confirm(mission, design);
    availability.causes = causes_of(knowledge, design, &availability.ways);
    let derived = ruled_out(knowledge, &design.individual.name);
    for line in availability.causes.iter().flat_map(|cause| &cause.because).chain(&derived) {
        if !availability.because.contains(line) {
            availability.because.push(line.clone());
        }
    }
    availability
}

impl Availability {
    /// In PLANTA's form, omits the sets of alterations after which the axioms of the domain do not change the
    /// availability of the design, for example because of facts of the problem.
    fn confirm(&mut self, mission: &Mission, design: &FunctionDesign) {
        if mission.completed_predicates().is_none() {
            return;
        }
        let changes = |way: &Vec<Alteration>| {
            let mut mission = mission.clone();
            let knowledge = mission.knowledge_mut()?;
            *knowledge = altered(knowledge, way)?;
            Some(mission.is_available(&mission.current(), design) != self.available)
        };
        let (sufficient, insufficient): (Vec<_>, Vec<_>) =
            self.ways.iter().cloned().partition(|way| changes(way) == Some(true));
        self.ways = sufficient;
        if !insufficient.is_empty() {
            self.unexamined.push(INITIAL_STATE.to_owned());
        }
    }
}

/// Returns minimal sets of `candidates` that make a design available (see [`minimal`]). After the largest sets, at most
/// [`MAX_TRIED`] sets are tried, small ones first, so some minimal sets may be missing. Also returns `true` if all sets
/// were tried, and reasoning did not fail.
fn repairs(
    knowledge: &Knowledge,
    design: &FunctionDesign,
    candidates: &[Alteration],
) -> (Vec<Vec<Alteration>>, bool) {
    let has_failed = Cell::new(false);
    let suffice = |set: &[&Alteration]| {
        let altered = altered(knowledge, set.iter().copied());
        has_failed.set(has_failed.get() || altered.is_none());
        altered.is_some_and(|knowledge| is_available(&knowledge, design))
    };
    let available_changes: Vec<&Alteration> = candidates.iter().collect();
    let selections = selections(&available_changes);
    let whole = selections.iter().find(|selection| suffice(selection)).cloned();
    // An alteration that no others can replace is in every set.
    let is_only = |alteration: &Alteration| {
        available_changes.iter().filter(|other| other.name == alteration.name).count() == 1
    };
    let suffices_without = |selection: &[&Alteration], alteration: &Alteration| {
        let remainder: Vec<&Alteration> =
            selection.iter().copied().filter(|other| *other != alteration).collect();
        suffice(&remainder)
    };
    let (needed, rest): (Vec<&Alteration>, Vec<&Alteration>) = if whole.is_some() {
        let is_needed = |alteration: &&Alteration| {
            is_only(alteration) && !selections.iter().any(|selection| suffices_without(selection, alteration))
        };
        available_changes.iter().copied().partition(is_needed)
    } else {
        (Vec::new(), available_changes.clone())
    };
    let mut minimal_sets: Vec<Vec<&Alteration>> = Vec::new();
    let all_positions = std::iter::once(Vec::new()).chain(subsets(rest.len()));
    for positions in all_positions.take(MAX_TRIED) {
        let is_in = |alteration: &&Alteration| {
            needed.contains(alteration) || positions.iter().any(|position| rest[*position] == *alteration)
        };
        let set: Vec<&Alteration> = available_changes.iter().copied().filter(is_in).collect();
        // Supersets of a minimal set are not minimal.
        let contains = |subset: &Vec<&Alteration>| subset.iter().all(|alteration| set.contains(alteration));
        // A value cannot be altered to two targets at once.
        let is_twice = |(at, alteration): (usize, &&Alteration)| {
            set[..at].iter().any(|other| other.name == alteration.name)
        };
        let is_open =
            !set.is_empty() && !set.iter().enumerate().any(is_twice) && !minimal_sets.iter().any(contains);
        if is_open && suffice(&set) {
            // Availability need not be monotone, so the set is minimised although smaller sets were
            // tried before.
            minimal_sets.push(minimal(set, &suffice));
        }
    }
    if minimal_sets.is_empty()
        && let Some(whole) = whole
    {
        minimal_sets.push(minimal(whole, &suffice));
    }
    let sets = minimal_sets.into_iter().map(|set| set.into_iter().cloned().collect()).collect();
    // The empty set is tried in addition to the subsets.
    let all_tried = subsets(rest.len()).nth(MAX_TRIED - 1).is_none();
    (sets, all_tried && !has_failed.get())
}

/// Returns the largest selections of `changes` with at most one alteration of each value: all alterations of values
/// that occur once and, for each other value, one of its alterations or none. Returns only `changes` itself if there are
/// too many selections.
fn selections<'a>(changes: &[&'a Alteration]) -> Vec<Vec<&'a Alteration>> {
    let mut names: Vec<&str> = changes.iter().map(|alteration| alteration.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let mut selections: Vec<Vec<&Alteration>> = vec![Vec::new()];
    for name in names {
        let of_name: Vec<&Alteration> =
            changes.iter().copied().filter(|alteration| alteration.name == name).collect();
        let unchanged = if of_name.len() > 1 { selections.clone() } else { Vec::new() };
        let extended = selections.iter().flat_map(|selection| {
            of_name.iter().map(move |alteration| [&selection[..], &[*alteration]].concat())
        });
        selections = extended.chain(unchanged).collect();
        // Each alteration is tried to be omitted from each selection.
        if selections.len() * changes.len() > MAX_TRIED {
            return vec![changes.to_vec()];
        }
    }
    let in_order = |selection: Vec<&Alteration>| {
        changes.iter().copied().filter(|alteration| selection.contains(alteration)).collect()
    };
    selections.into_iter().map(in_order).collect()
}

/// Returns the non-empty subsets of the positions 0 to `count` − 1: smaller subsets first, and subsets of one
/// size in lexicographic order.
fn subsets(count: usize) -> impl Iterator<Item = Vec<usize>> {
    (1..=count).flat_map(move |size| {
        std::iter::successors(Some((0..size).collect::<Vec<usize>>()), move |last| {
            // Rightmost position that can still be advanced.
            let at = (0..size).rev().find(|at| last[*at] < count - size + at)?;
            let mut next = last.clone();
            for (position, element) in next[at..].iter_mut().zip(last[at] + 1..) {
                *position = element;
            }
            Some(next)
        })
    })
}

/// Returns a subset of `set` that still suffices, after trying once to remove each alteration. If availability is
/// monotone in the alterations, no proper subset of the result suffices.
fn minimal<'a>(
    mut set: Vec<&'a Alteration>,
    suffice: &dyn Fn(&[&'a Alteration]) -> bool,
) -> Vec<&'a Alteration> {
    // Backwards, so that removals do not shift the remaining positions.
    for position in (0..set.len()).rev() {
        let mut smaller = set.clone();
        smaller.remove(position);
        if suffice(&smaller) {
            set = smaller;
        }
    }
    set
}

/// Returns a copy of the knowledge base after the alterations, or `None` if an alteration fails,
/// for example because the rules do not terminate.
fn altered<'a>(
    knowledge: &Knowledge,
    alterations: impl IntoIterator<Item = &'a Alteration>,
) -> Option<Knowledge> {
    let mut knowledge = knowledge.clone();
    for alteration in alterations {
        let outcome = match alteration.to {
            Target::Recovered => knowledge.report(&alteration.name, Component::Recovered),
            Target::Failed => knowledge.report(&alteration.name, Component::Failed),
            _ => knowledge.observe(&alteration.name, &alteration.to.example()),
        };
        outcome.ok()?;
    }
    Some(knowledge)
}

fn is_available(knowledge: &Knowledge, design: &FunctionDesign) -> bool {
    let mut designs = knowledge.catalogue().designs().iter();
    designs.any(|candidate| candidate.individual == design.individual && candidate.available)
}

/// Computes the best plan after alterations of the situation. At a limit, returns the best plan
/// found until then. If reasoning fails with the alterations, returns no plan and no proof.
pub(super) fn in_situation(
    mission: &Mission,
    alterations: &[Alteration],
    limits: &Limits,
) -> Result<BestPlan, Errors> {
    if limits.reached() {
        return Ok(BestPlan::default());
    }
    let mut mission = mission.clone();
    if let Some(knowledge) = mission.knowledge_mut() {
        knowledge.interrupt(limits.into());
        let Some(altered) = altered(knowledge, alterations) else { return Ok(BestPlan::default()) };
        *knowledge = altered;
    }
    best(&mission, limits)
}

pub(super) fn singly(mission: &Mission, repairs: &[Repair], limits: &Limits) -> Result<Vec<Change>, Errors> {
    let mut changes: Vec<Change> = Vec::new();
    for alteration in repairs.iter().flat_map(|repair| &repair.alterations) {
        if changes.iter().any(|change| change.alteration == *alteration) {
            continue;
        }
        let alone = repairs.iter().find(|repair| repair.alterations == [alteration.clone()]);
        let then = match alone {
            Some(repair) => repair.then.clone(),
            None => in_situation(mission, std::slice::from_ref(alteration), limits)?,
        };
        changes.push(Change {
            alteration: alteration.clone(),
            within: None,
            suffices: alone.is_some(),
            then,
        });
    }
    Ok(changes)
}

/// Returns alterations that may change whether a design is available: of its components and of those whose status a rule
/// reads, and of measurements. New measurements are at or just beyond the bounds in the design's requirements. Without a
/// requirement for an attribute, they are around the design's estimation. Further measurements are at or just beyond
/// bounds in rules that concern the design.
fn candidates(knowledge: &Knowledge, design: &FunctionDesign, rules: &RuleBounds) -> Vec<Alteration> {
    let is_relevant = |component: &str| {
        design.components.iter().any(|needed| needed.iri == component)
            || rules.status_reads.iter().any(|read| read.concerns(component, &design.individual.iri))
    };
    let mut alterations = components(knowledge, design.available, &is_relevant);
    for (attribute, from) in measured(knowledge) {
        let bounds = design.requirements.iter().filter(|requirement| requirement.attribute == attribute);
        for to in targets(bounds, &from, design.available) {
            alterations.push(Alteration { name: attribute.clone(), from: Some(from.clone()), to });
        }
        // Without a requirement, the design's estimation can be the bound: some vocabularies compare measurements
        // with it.
        let is_required = design.requirements.iter().any(|requirement| requirement.attribute == attribute);
        let estimated = design.estimations.get(&attribute).filter(|_| !is_required).cloned();
        for to in estimated.into_iter().flat_map(|bound| around(&bound, &from)) {
            alterations.push(Alteration { name: attribute.clone(), from: Some(from.clone()), to });
        }
    }
    let bounds = rules.bounds.iter().filter(|bound| bound.concerns(&design.individual.iri));
    for bound in bounds.filter(|bound| design.available || !bound.is_harmful) {
        if !alterations.contains(&bound.alteration) {
            alterations.push(bound.alteration.clone());
        }
    }
    alterations
}

/// Adds further alterations to `candidates_found`: the recovery of each failed component, and changes of measurements
/// that concern any design. Failures are not added.
fn all_candidates(
    knowledge: &Knowledge,
    mut candidates_found: Vec<Alteration>,
    rules: &RuleBounds,
) -> Vec<Alteration> {
    let additional =
        knowledge.catalogue().designs().iter().flat_map(|design| candidates(knowledge, design, rules));
    let bounds = rules.bounds.iter().filter(|bound| bound.is_deciding);
    let additional = additional.chain(bounds.map(|bound| bound.alteration.clone()));
    for alteration in components(knowledge, false, &|_| true).into_iter().chain(additional) {
        if alteration.to != Target::Failed && !candidates_found.contains(&alteration) {
            candidates_found.push(alteration);
        }
    }
    candidates_found
}

fn components(knowledge: &Knowledge, working: bool, is_relevant: &dyn Fn(&str) -> bool) -> Vec<Alteration> {
    let components = knowledge.view().components().into_iter();
    let components = components.filter(|component| is_relevant(&component.individual.iri));
    let components =
        components.filter(|component| component.status.as_deref().is_some_and(is_failed) != working);
    let to = if working { Target::Failed } else { Target::Recovered };
    components
        .map(|component| Alteration { name: component.individual.name, from: None, to: to.clone() })
        .collect()
}

/// Returns targets for an attribute with the value `from`. Without `hold`, violated requirements
/// become satisfied: the targets are at least the greatest violated minimum, and at most the least
/// violated maximum. With `hold`, a satisfied requirement becomes violated: the targets are below
/// the greatest satisfied minimum, and above the least satisfied maximum.
fn targets<'a>(bounds: impl Iterator<Item = &'a Requirement>, from: &BigRational, hold: bool) -> Vec<Target> {
    let (mut least, mut most): (Vec<&BigRational>, Vec<&BigRational>) = (Vec::new(), Vec::new());
    for requirement in bounds {
        least.extend(requirement.minimum.iter().filter(|minimum| (from >= minimum) == hold));
        most.extend(requirement.maximum.iter().filter(|maximum| (from <= maximum) == hold));
    }
    let (least, most) = (least.into_iter().max().cloned(), most.into_iter().min().cloned());
    let (least, most) = if hold {
        (least.map(Target::Below), most.map(Target::Above))
    } else {
        (least.map(Target::AtLeast), most.map(Target::AtMost))
    };
    least.into_iter().chain(most).collect()
}

/// Returns targets at a bound and just beyond it, as seen from the current value `from`. If the
/// value equals the bound, the targets are just below and just above it.
fn around(bound: &BigRational, from: &BigRational) -> Vec<Target> {
    let bound = bound.clone();
    match from.cmp(&bound) {
        Ordering::Less => vec![Target::AtLeast(bound.clone()), Target::Above(bound)],
        Ordering::Greater => vec![Target::AtMost(bound.clone()), Target::Below(bound)],
        Ordering::Equal => vec![Target::Below(bound.clone()), Target::Above(bound)],
    }
}
