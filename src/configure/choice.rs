//! Chooses designs for the objectives that need one, and states for each candidate design why it was chosen or not.

use std::collections::{BTreeMap, BTreeSet};

use num_rational::BigRational;
use num_traits::Zero as _;
use ontology::runtime::{Missed, Objective, Rejection};
use planner::{DesignChoice, Limits, configure};

use crate::knowledge::Knowledge;
use crate::mapek::ruled_out;
use crate::message::Message;
use crate::number::decimal;

/// Definition of a design's utility.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Worth {
    /// Utility as in MROS: the value that the knowledge base infers; otherwise the design's only estimation of
    /// `performance`; otherwise, also with several estimations, 0.001.
    #[default]
    Mros,
    /// The design's estimation of the given attribute type (local name); 0 if the design has none. Larger estimations
    /// are better.
    Most(String),
    /// The negated estimation of the given attribute type (local name); 0 if the design has none. Smaller estimations
    /// are better.
    Least(String),
}

/// Utility and joint constraints for the choice of all designs of a configuration.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Wishes {
    /// Definition of a design's utility.
    pub worth: Worth,
    /// Budgets: attribute types by local name, each with a limit in its unit. The limit applies to the sum of the
    /// estimations of all designs in use. A design counts once even if it serves several objectives, and as 0 without an
    /// estimation.
    pub budgets: Vec<(String, BigRational)>,
    /// Components, by local name, that only one design can use at a time.
    pub exclusive: BTreeSet<String>,
}

/// Choices for all objectives in need.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Configuration {
    /// The choice for each objective that needs a design, sorted by the IRI of the objective.
    pub choices: Vec<Choice>,
    /// Sum of the utilities of the chosen designs.
    pub utility: BigRational,
    /// Joint constraints that are violated by the designs of objectives that keep their designs, as sentences.
    pub violated: Vec<String>,
    /// Designs without an estimation that counts as 0 although another design of the function has one, as sentences.
    pub unestimated: BTreeSet<String>,
    /// `true` if it is proved that no other choice for these objectives is better, `false` if a limit was reached
    /// before the proof. A choice is better if it serves more objectives; with equally many, if it misses fewer
    /// requirements; then if it has more utility.
    pub optimal: bool,
}

/// Choice of a design for one objective, with the alternatives.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Choice {
    /// The objective, by local name.
    pub objective: String,
    /// Function of the objective, by local name, if it has one.
    pub function: Option<String>,
    /// Reasons why the objective needs a design: its statuses, `updatable`, `always improve`, `ungrounded`, or that it
    /// is served by a design that is not available. Empty if the only reason is that the last choice or change of its
    /// design failed.
    pub need: Vec<String>,
    /// The design before the choice, by local name.
    pub before: Option<String>,
    /// The chosen design, by local name; `None` if no design was chosen.
    pub design: Option<String>,
    /// Reason why the objective cannot keep its present design either, if no design was chosen: other objectives need
    /// its components or its share of a budget.
    pub withdrawn: Option<String>,
    /// All designs of the function, the preferred ones first: fewest missed requirements, then greatest utility.
    pub considered: Vec<Considered>,
}

/// A design that was considered for an objective, with its utility and the decision on it.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Considered {
    /// Local name of the design.
    pub design: String,
    /// Utility of the design; larger is better.
    pub utility: BigRational,
    /// Requirements of the objective that the design is estimated to miss, as sentences.
    pub missed: Vec<String>,
    /// Decision on the design.
    pub verdict: Verdict,
}

/// Decision on a design.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// The design is chosen.
    Chosen,
    /// The design is unusable for the objective now; the reasons are sentences.
    RuledOut(Vec<String>),
    /// The design is not better than the chosen one: it misses more requirements, or equally many without more utility.
    Less,
    /// The design is usable and preferred to the chosen one, if any, but conflicts with designs of other objectives, or
    /// a limit was reached before it was considered. The reason is a sentence.
    Together(String),
}

struct Group {
    objective: Objective,
    candidates: Vec<Offer>,
}

struct Offer {
    design: String,
    utility: BigRational,
    rejections: Vec<Rejection>,
    missed: Vec<String>,
    choice: DesignChoice,
    components: Vec<String>,
    /// Attributes of the utility and of budgets for which the design has no estimation.
    unestimated: BTreeSet<String>,
}

impl Offer {
    fn has_design_of(&self, other: &Self) -> bool {
        self.choice.identity.is_some() && self.choice.identity == other.choice.identity
    }
}

/// Returns one offer of each design, except designs in `kept`. A design that serves several objectives uses its
/// components and its share of the budgets once.
fn distinct<'o>(offers: impl Iterator<Item = &'o Offer>, kept: &[&Offer]) -> Vec<&'o Offer> {
    let mut designs: BTreeSet<usize> = kept.iter().filter_map(|offer| offer.choice.identity).collect();
    offers.filter(|offer| offer.choice.identity.is_none_or(|design| designs.insert(design))).collect()
}

impl Group {
    /// Returns the usable designs without an estimation that another design of the function has, as sentences.
    fn unestimated(&self) -> impl Iterator<Item = String> {
        let is_estimated =
            |attribute: &&String| self.candidates.iter().any(|offer| !offer.unestimated.contains(*attribute));
        let usable = self.candidates.iter().filter(|offer| offer.rejections.is_empty());
        usable.flat_map(move |offer| {
            let attributes = offer.unestimated.iter().filter(is_estimated);
            attributes.map(move |attribute| {
                format!("the design `{}` has no estimation of `{attribute}`, so 0 is assumed", offer.design)
            })
        })
    }

    fn current(&self) -> Option<&str> {
        current(&self.objective)
    }

    /// Returns the design in use, by local name, if the knowledge base concludes or states that it is not available.
    fn unavailable_design(&self) -> Option<&str> {
        let current = self.current()?;
        let is_unavailable =
            |offer: &Offer| offer.design == current && offer.rejections.contains(&Rejection::Unavailable);
        self.candidates.iter().any(is_unavailable).then_some(current)
    }
}

pub(super) fn current(objective: &Objective) -> Option<&str> {
    let designs = objective.groundings.iter().filter_map(|grounding| grounding.design.as_ref());
    designs.map(|design| design.name.as_str()).next()
}

/// Chooses designs for the objectives for which `is_in_need` returns `true` and for those whose design is not
/// available. The other objectives keep their designs. At a limit, returns the best choice found.
pub(super) fn choose(
    knowledge: &Knowledge,
    wishes: &Wishes,
    is_in_need: &dyn Fn(&Objective) -> bool,
    limits: &Limits,
) -> Result<Configuration, Message> {
    let offers = Offers::new(knowledge, wishes);
    let (mut needing, mut fixed) = (Vec::new(), Vec::new());
    for objective in knowledge.runtime().objectives() {
        let wants = is_in_need(&objective);
        let mut group = offers.group(objective)?;
        // The shipped rules infer an error of the objective only from components and requirements. Other rules and
        // reports about the design make the design unavailable without an error.
        if wants || group.unavailable_design().is_some() {
            needing.push(group);
        } else {
            let current = group.current().map(ToOwned::to_owned);
            // The design that an objective keeps still uses its components and its share of the budgets.
            group.candidates.retain(|offer| Some(&offer.design) == current.as_ref());
            fixed.push(group);
        }
    }
    let fixed_offers = distinct(fixed.iter().filter_map(|group| group.candidates.first()), &[]);
    let remaining: Vec<BigRational> = wishes
        .budgets
        .iter()
        .enumerate()
        .map(|(budget, (_, most))| {
            most - fixed_offers.iter().map(|offer| &offer.choice.demands[budget]).sum::<BigRational>()
        })
        // Designs that stay in use may exceed the budget already.
        .map(|remaining| remaining.max(BigRational::zero()))
        .collect();
    let used_components: BTreeSet<usize> =
        fixed_offers.iter().flat_map(|offer| offer.choice.components.clone()).collect();
    let is_kept = |offer: &Offer| fixed_offers.iter().any(|kept| kept.has_design_of(offer));
    let usable = |offer: &Offer| {
        offer.rejections.is_empty()
            && (is_kept(offer) || offer.choice.components.is_disjoint(&used_components))
    };
    let choice = |offer: &Offer| {
        let mut choice = offer.choice.clone();
        if is_kept(offer) {
            (choice.demands, choice.components) = (Vec::new(), BTreeSet::new());
        }
        choice
    };
    let mut positions: Vec<Vec<usize>> = Vec::with_capacity(needing.len());
    let mut functions: Vec<Vec<DesignChoice>> = Vec::with_capacity(needing.len());
    for group in &needing {
        let usable = group.candidates.iter().enumerate().filter(|(_, offer)| usable(offer));
        let (at, choices) = usable.map(|(at, offer)| (at, choice(offer))).unzip();
        positions.push(at);
        functions.push(choices);
    }
    let chosen = configure(&functions, &remaining, limits);
    let designs: Vec<Option<usize>> = chosen
        .designs
        .iter()
        .zip(&positions)
        .map(|(chosen_index, at)| chosen_index.map(|chosen_index| at[chosen_index]))
        .collect();
    let violated = violated(wishes, &fixed_offers);
    let whole = Whole {
        knowledge,
        wishes,
        needing: &needing,
        designs: &designs,
        kept: &fixed_offers,
        left: &remaining,
    };
    let mut withdrawn = whole.withdrawn();
    let choices = (0..needing.len()).map(|at| whole.choice(at, withdrawn.remove(&at))).collect();
    let unestimated = needing.iter().flat_map(Group::unestimated).collect();
    Ok(Configuration { choices, utility: chosen.utility, violated, unestimated, optimal: chosen.optimal })
}

/// Returns the joint constraints that the designs in use violate without the designs to choose, as sentences.
fn violated(wishes: &Wishes, kept: &[&Offer]) -> Vec<String> {
    let mut violated = Vec::new();
    for component in &wishes.exclusive {
        let users = kept.iter().filter(|offer| offer.components.contains(component));
        let users: BTreeSet<&str> = users.map(|offer| offer.design.as_str()).collect();
        if users.len() > 1 {
            let users: Vec<&str> = users.into_iter().collect();
            violated.push(format!("{} use {component}, which only one design can use", users.join(" and ")));
        }
    }
    for (budget, (attribute, most)) in wishes.budgets.iter().enumerate() {
        let sum = kept.iter().map(|offer| &offer.choice.demands[budget]).sum::<BigRational>();
        if sum > *most {
            let (sum, most) = (decimal(&sum), decimal(most));
            violated.push(format!("{attribute} is {sum} in total; the budget is {most}"));
        }
    }
    violated
}

struct Offers<'a> {
    knowledge: &'a Knowledge,
    wishes: &'a Wishes,
    /// Designs by IRI.
    designs: BTreeMap<String, DesignEntry>,
}

#[derive(Default)]
struct DesignEntry {
    number: Option<usize>,
    components: Vec<String>,
    estimations: BTreeMap<String, BigRational>,
}

impl<'a> Offers<'a> {
    fn new(knowledge: &'a Knowledge, wishes: &'a Wishes) -> Self {
        let designs = knowledge.view().function_designs().into_iter().enumerate().map(|(number, design)| {
            let components = design.components.into_iter().map(|component| component.name).collect();
            let entry = DesignEntry { number: Some(number), components, estimations: design.estimations };
            (design.individual.iri, entry)
        });
        Self { knowledge, wishes, designs: designs.collect() }
    }

    fn group(&self, objective: Objective) -> Result<Group, Message> {
        let attribute = match &self.wishes.worth {
            Worth::Mros => None,
            Worth::Most(attribute) | Worth::Least(attribute) => Some(attribute.as_str()),
        };
        let candidates_of_objective =
            self.knowledge.runtime().candidates(&objective.individual.iri, attribute);
        let candidates_of_objective =
            candidates_of_objective.map_err(|error| Message::from_ontology(&error))?;
        let unknown = DesignEntry::default();
        let offer = |candidate: ontology::runtime::Candidate| {
            let DesignEntry { number, components, estimations } =
                self.designs.get(&candidate.design.iri).unwrap_or(&unknown);
            // The optimizer maximises, so the sign of a minimised attribute is changed.
            let worth = candidate.utility;
            let utility = if matches!(self.wishes.worth, Worth::Least(_)) { -worth } else { worth };
            let demand =
                |(attribute, _): &(String, _)| estimations.get(attribute).cloned().unwrap_or_default();
            let exclusive = self.wishes.exclusive.iter().enumerate();
            let used = exclusive.filter(|(_, component)| components.contains(component));
            let choice = DesignChoice {
                missed: candidate.missed.len(),
                utility: utility.clone(),
                demands: self.wishes.budgets.iter().map(demand).collect(),
                components: used.map(|(number, _)| number).collect(),
                identity: *number,
            };
            let (design, components) = (candidate.design.name, components.clone());
            let missed = candidate.missed.iter().map(requirement_text).collect();
            let compared =
                attribute.into_iter().chain(self.wishes.budgets.iter().map(|(name, _)| name.as_str()));
            let unestimated = compared.filter(|name| !estimations.contains_key(*name)).map(ToOwned::to_owned);
            let unestimated = unestimated.collect();
            let rejections = candidate.rejections;
            Offer { design, utility, rejections, missed, choice, components, unestimated }
        };
        let mut candidates: Vec<Offer> = candidates_of_objective.into_iter().map(offer).collect();
        let now = current(&objective).map(ToOwned::to_owned);
        // Ties are broken in favour of the design in use, then by IRI.
        candidates.sort_by(|a, b| {
            let in_use = |offer: &Offer| Some(&offer.design) == now.as_ref();
            let by_requirements = a.missed.len().cmp(&b.missed.len());
            by_requirements.then_with(|| b.utility.cmp(&a.utility)).then_with(|| in_use(b).cmp(&in_use(a)))
        });
        Ok(Group { objective, candidates })
    }
}

struct Whole<'a> {
    knowledge: &'a Knowledge,
    wishes: &'a Wishes,
    needing: &'a [Group],
    /// For each group, the index of the chosen design among the candidates; `None` if no design was chosen.
    designs: &'a [Option<usize>],
    kept: &'a [&'a Offer],
    /// Remaining budgets after the demands of the kept designs; at least 0.
    left: &'a [BigRational],
}

impl Whole<'_> {
    fn choice(&self, at: usize, withdrawn: Option<String>) -> Choice {
        let group = &self.needing[at];
        let considered = group.candidates.iter().enumerate().map(|(position, offer)| Considered {
            design: offer.design.clone(),
            utility: offer.utility.clone(),
            missed: offer.missed.clone(),
            verdict: self.verdict(at, position, offer),
        });
        Choice {
            objective: group.objective.individual.name.clone(),
            function: group.objective.function.as_ref().map(|function| function.name.clone()),
            need: need(group),
            before: group.current().map(ToOwned::to_owned),
            design: self.designs[at].map(|position| group.candidates[position].design.clone()),
            withdrawn,
            considered: considered.collect(),
        }
    }

    fn verdict(&self, at: usize, position: usize, offer: &Offer) -> Verdict {
        if self.designs[at] == Some(position) {
            return Verdict::Chosen;
        }
        if !offer.rejections.is_empty() {
            let reasons =
                offer.rejections.iter().flat_map(|rejection| self.reasons(&offer.design, rejection));
            return Verdict::RuledOut(reasons.collect());
        }
        // Candidates are sorted by preference, so a later one is not better.
        if self.designs[at].is_some_and(|chosen| chosen < position) {
            return Verdict::Less;
        }
        let conflict = self.conflict(at, offer, &[]);
        // A preferred design that conflicts with no other design would be part of the best choice. So if there is no
        // conflict, the search ended at a limit before it found the best choice.
        let limit = || "a limit was reached before a choice with this design was found".to_owned();
        Verdict::Together(conflict.unwrap_or_else(limit))
    }

    /// Returns the objectives without a choice whose present designs conflict with the other designs in use, with the
    /// reasons.
    fn withdrawn(&self) -> BTreeMap<usize, String> {
        let (mut withdrawn, mut unserved) = (BTreeMap::new(), Vec::new());
        for (at, group) in self.needing.iter().enumerate().filter(|(at, _)| self.designs[*at].is_none()) {
            let current =
                group.candidates.iter().find(|offer| Some(offer.design.as_str()) == group.current());
            let Some(current) = current else { continue };
            match self.conflict(at, current, &unserved) {
                Some(reason) => {
                    withdrawn.insert(at, reason);
                }
                None => unserved.push(current),
            }
        }
        withdrawn
    }

    /// Returns the reason why an objective cannot have a design together with the chosen designs of other objectives,
    /// those that stay, and `unserved`, the present designs of other objectives without a choice.
    fn conflict(&self, at: usize, offer: &Offer, unserved: &[&Offer]) -> Option<String> {
        let chosen_elsewhere =
            self.needing.iter().zip(self.designs).enumerate().filter(|(other, _)| *other != at);
        let chosen = chosen_elsewhere
            .filter_map(|(_, (group, design))| design.map(|design| &group.candidates[design]));
        let chosen_elsewhere = distinct(chosen.chain(unserved.iter().copied()), self.kept);
        if self.kept.iter().chain(&chosen_elsewhere).any(|other| other.has_design_of(offer)) {
            return None;
        }
        for other in self.kept.iter().chain(&chosen_elsewhere) {
            if let Some(component) = self
                .wishes
                .exclusive
                .iter()
                .find(|component| [*other, offer].iter().all(|own| own.components.contains(component)))
            {
                return Some(format!("{} uses {component}, which only one design can use", other.design));
            }
        }
        for (budget, (attribute, most)) in self.wishes.budgets.iter().enumerate() {
            let demand = |offer: &Offer| offer.choice.demands[budget].clone();
            let sum = chosen_elsewhere.iter().map(|other| demand(other)).sum::<BigRational>() + demand(offer);
            if sum > self.left[budget] {
                let whole = sum + self.kept.iter().map(|other| demand(other)).sum::<BigRational>();
                return Some(format!(
                    "{attribute} would be {} in total; the budget is {}",
                    decimal(&whole),
                    decimal(most)
                ));
            }
        }
        None
    }

    fn reasons(&self, design: &str, rejection: &Rejection) -> Vec<String> {
        match rejection {
            Rejection::Unavailable => {
                let because = ruled_out(self.knowledge, design);
                if because.is_empty() { vec!["it is not available".to_owned()] } else { because }
            }
            Rejection::Failed => vec!["it failed for this objective before".to_owned()],
            Rejection::Violates { attribute, measured, operator, estimation } => {
                vec![format!(
                    "{attribute}: measured {} {operator} {}",
                    decimal(measured),
                    decimal(estimation)
                )]
            }
            other => vec![format!("{other:?}")],
        }
    }
}

fn requirement_text(missed: &Missed) -> String {
    let Missed { attribute, estimation, bound, status } = missed;
    format!("{attribute}: estimated {}, required {}: {status}", decimal(estimation), decimal(bound))
}

fn need(group: &Group) -> Vec<String> {
    let objective = &group.objective;
    let mut need = objective.statuses.clone();
    if objective.updatable {
        need.push("updatable".to_owned());
    }
    if objective.always_improve {
        need.push("always improve".to_owned());
    }
    if need.is_empty() && objective.groundings.is_empty() {
        need.push("ungrounded".to_owned());
    }
    if !objective.wants_design()
        && let Some(design) = group.unavailable_design()
    {
        need.push(format!("served by {design}, which is not available"));
    }
    need
}
