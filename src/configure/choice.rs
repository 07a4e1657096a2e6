//! Which designs are chosen, and what is said of those that are not.

use std::collections::{BTreeMap, BTreeSet};

use num_rational::BigRational;
use num_traits::Zero as _;
use ontology::runtime::{Missed, Objective, Rejection};
use planner::{DesignChoice, Limits, configure};

use crate::knowledge::Knowledge;
use crate::mapek::ruled_out;
use crate::message::Message;
use crate::number::decimal;

/// What a design is worth.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Worth {
    /// As MROS has it: what the knowledge base concludes, or else the estimated `performance`, or else 0.001.
    #[default]
    Mros,
    /// The estimation of an attribute type, by local name; the more, the better.
    Most(String),
    /// The estimation of an attribute type, by local name; the less, the better.
    Least(String),
}

/// What is wanted of a configuration as a whole.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Wishes {
    /// What a design is worth.
    pub worth: Worth,
    /// Attribute types by local name, and what the estimations of all chosen designs may come to in sum, in the type's unit.
    pub budgets: Vec<(String, BigRational)>,
    /// Components, by local name, that only one design can use at a time.
    pub exclusive: BTreeSet<String>,
}

/// What has been chosen for all objectives in need.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Configuration {
    /// For each objective in need, sorted by name.
    pub choices: Vec<Choice>,
    /// What the chosen designs are worth in sum.
    pub utility: BigRational,
    /// Whether it is proved that no choice serves more functions, or as many with more utility; a limit was reached if not.
    pub optimal: bool,
}

/// What has been chosen for an objective.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Choice {
    /// The objective, by local name.
    pub objective: String,
    /// Its function, by local name, if it has one.
    pub function: Option<String>,
    /// Why it is in need: its statuses, `updatable`, `always improve`, or `ungrounded`.
    pub need: Vec<String>,
    /// The design before, by local name.
    pub before: Option<String>,
    /// The design from now on, by local name, if any can be used.
    pub design: Option<String>,
    /// All designs of the function, in the order of preference.
    pub considered: Vec<Considered>,
}

/// A design of an objective's function.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Considered {
    /// Its local name.
    pub design: String,
    /// What it is worth; larger is better.
    pub utility: BigRational,
    /// The requirements of the objective that it is estimated to miss, in sentences.
    pub missed: Vec<String>,
    /// What became of it.
    pub verdict: Verdict,
}

/// What became of a design.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// It is chosen.
    Chosen,
    /// It cannot be used for the objective now: why, in sentences.
    RuledOut(Vec<String>),
    /// It misses more requirements, or as many and is worth no more.
    Less,
    /// It would be better, but not together with what else is chosen: why, in a sentence.
    Together(String),
}

/// An objective and its designs, in the order of preference.
struct Group {
    objective: Objective,
    candidates: Vec<Offer>,
}

/// A design as the choice sees it.
struct Offer {
    design: String,
    utility: BigRational,
    rejections: Vec<Rejection>,
    missed: Vec<String>,
    choice: DesignChoice,
    components: Vec<String>,
}

impl Group {
    fn current(&self) -> Option<&str> {
        current(&self.objective)
    }
}

/// The design that provides an objective's function now.
pub(super) fn current(objective: &Objective) -> Option<&str> {
    let designs = objective.groundings.iter().filter_map(|grounding| grounding.design.as_ref());
    designs.map(|design| design.name.as_str()).next()
}

/// Chooses for the objectives in need; the others keep what they have.
///
/// # Errors
/// A rule runs away.
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
        if wants {
            needing.push(group);
        } else {
            let current = group.current().map(ToOwned::to_owned);
            group.candidates.retain(|offer| Some(&offer.design) == current.as_ref());
            fixed.push(group);
        }
    }
    let kept: Vec<&Offer> = fixed.iter().filter_map(|group| group.candidates.first()).collect();
    let left: Vec<BigRational> = wishes
        .budgets
        .iter()
        .enumerate()
        .map(|(budget, (_, most))| {
            most - kept.iter().map(|offer| &offer.choice.demands[budget]).sum::<BigRational>()
        })
        // What is in use and stays takes no more than there is.
        .map(|left| left.max(BigRational::zero()))
        .collect();
    let taken: BTreeSet<usize> = kept.iter().flat_map(|offer| offer.choice.components.clone()).collect();
    let usable = |offer: &Offer| offer.rejections.is_empty() && offer.choice.components.is_disjoint(&taken);
    let mut positions: Vec<Vec<usize>> = Vec::with_capacity(needing.len());
    let mut functions: Vec<Vec<DesignChoice>> = Vec::with_capacity(needing.len());
    for group in &needing {
        let usable = group.candidates.iter().enumerate().filter(|(_, offer)| usable(offer));
        let (at, choices) = usable.map(|(at, offer)| (at, offer.choice.clone())).unzip();
        positions.push(at);
        functions.push(choices);
    }
    let chosen = configure(&functions, &left, limits);
    let designs: Vec<Option<usize>> =
        chosen.designs.iter().zip(&positions).map(|(own, at)| own.map(|own| at[own])).collect();
    let whole = Whole { knowledge, wishes, needing: &needing, designs: &designs, kept: &kept, left: &left };
    let choices = (0..needing.len()).map(|at| whole.choice(at)).collect();
    Ok(Configuration { choices, utility: chosen.utility, optimal: chosen.optimal })
}

/// What the designs of the knowledge base take and are worth.
struct Offers<'a> {
    knowledge: &'a Knowledge,
    wishes: &'a Wishes,
    /// Components and estimations of designs, by IRI.
    designs: BTreeMap<String, (Vec<String>, BTreeMap<String, BigRational>)>,
}

impl<'a> Offers<'a> {
    fn new(knowledge: &'a Knowledge, wishes: &'a Wishes) -> Self {
        let designs = knowledge.view().function_designs().into_iter().map(|design| {
            let components = design.components.into_iter().map(|component| component.name).collect();
            (design.individual.iri, (components, design.estimations))
        });
        Self { knowledge, wishes, designs: designs.collect() }
    }

    fn group(&self, objective: Objective) -> Result<Group, Message> {
        let attribute = match &self.wishes.worth {
            Worth::Mros => None,
            Worth::Most(attribute) | Worth::Least(attribute) => Some(attribute.as_str()),
        };
        let found = self.knowledge.runtime().candidates(&objective.individual.iri, attribute);
        let found = found.map_err(|error| Message::from_ontology(&error))?;
        let nothing = (Vec::new(), BTreeMap::new());
        let offer = |candidate: ontology::runtime::Candidate| {
            let (components, estimations) = self.designs.get(&candidate.design.iri).unwrap_or(&nothing);
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
            };
            let (design, components) = (candidate.design.name, components.clone());
            let missed = candidate.missed.iter().map(said).collect();
            Offer { design, utility, rejections: candidate.rejections, missed, choice, components }
        };
        let mut candidates: Vec<Offer> = found.into_iter().map(offer).collect();
        let now = current(&objective).map(ToOwned::to_owned);
        // Of equals, the one that is in use is the best, and then the first by IRI.
        candidates.sort_by(|a, b| {
            let in_use = |offer: &Offer| Some(&offer.design) == now.as_ref();
            let by_requirements = a.missed.len().cmp(&b.missed.len());
            by_requirements.then_with(|| b.utility.cmp(&a.utility)).then_with(|| in_use(b).cmp(&in_use(a)))
        });
        Ok(Group { objective, candidates })
    }
}

/// What has been chosen for all, to say why.
struct Whole<'a> {
    knowledge: &'a Knowledge,
    wishes: &'a Wishes,
    needing: &'a [Group],
    /// For each group, the position of its design.
    designs: &'a [Option<usize>],
    /// What is in use and stays.
    kept: &'a [&'a Offer],
    /// What that leaves of the budgets.
    left: &'a [BigRational],
}

impl Whole<'_> {
    fn choice(&self, at: usize) -> Choice {
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
            need: need(&group.objective),
            before: group.current().map(ToOwned::to_owned),
            design: self.designs[at].map(|position| group.candidates[position].design.clone()),
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
        if self.designs[at].is_some_and(|chosen| chosen < position) {
            return Verdict::Less;
        }
        Verdict::Together(self.conflict(at, offer))
    }

    /// Why a design that could be used, and would be worth more, does not go with what else is chosen.
    fn conflict(&self, at: usize, offer: &Offer) -> String {
        let others = self.needing.iter().zip(self.designs).enumerate().filter(|(other, _)| *other != at);
        let chosen = others.filter_map(|(_, (group, design))| design.map(|design| &group.candidates[design]));
        let others: Vec<&Offer> = chosen.collect();
        for other in self.kept.iter().chain(&others) {
            if let Some(component) = self
                .wishes
                .exclusive
                .iter()
                .find(|component| [*other, offer].iter().all(|own| own.components.contains(component)))
            {
                return format!("{} uses {component}, which only one design can use", other.design);
            }
        }
        for (budget, (attribute, most)) in self.wishes.budgets.iter().enumerate() {
            let demand = |offer: &Offer| offer.choice.demands[budget].clone();
            let sum = others.iter().map(|other| demand(other)).sum::<BigRational>() + demand(offer);
            if sum > self.left[budget] {
                let whole = sum + self.kept.iter().map(|other| demand(other)).sum::<BigRational>();
                return format!(
                    "{attribute} would come to {}; the budget is {}",
                    decimal(&whole),
                    decimal(most)
                );
            }
        }
        "other functions would have to take designs that are worse in sum, or go without one".to_owned()
    }

    fn reasons(&self, design: &str, rejection: &Rejection) -> Vec<String> {
        match rejection {
            Rejection::Unavailable => {
                let because = ruled_out(self.knowledge, design);
                if because.is_empty() { vec!["it is not available".to_owned()] } else { because }
            }
            Rejection::Failed => vec!["it has failed this objective before".to_owned()],
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

/// A requirement that is missed, in a sentence.
fn said(missed: &Missed) -> String {
    let Missed { attribute, estimation, bound, status } = missed;
    format!("{attribute}: estimated {}, required {}: {status}", decimal(estimation), decimal(bound))
}

/// Why an objective is in need.
fn need(objective: &Objective) -> Vec<String> {
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
    need
}
