//! The best design for an objective, as MROS selects it, except that MROS stops with an exception where nothing has
//! been measured yet, where a design violates two attributes, and where no utility is above zero.
//!
//! A design is left out if it is not available, if the error log says that it failed the objective before, or if a
//! measurement stands to one of its estimations in the relation that the attribute's `qa_comparison_operator` names
//! (`<`: measured below estimated). What has not been measured rules nothing out. Among the others the greatest
//! utility wins: the estimation of the attribute type named `performance` if there is just one, or else 0.001 (PLANTA's
//! `fd_utility`, where a knowledge base concludes it). Of equals, the first by IRI wins.

use std::collections::BTreeMap;

use num_rational::BigRational;
use rules::Symbol;

use super::knowledge::Runtime;
use crate::error::Error;
use crate::tomasys::Individual;
use crate::tomasys::change;
use crate::tomasys::facts::Facts;
use crate::tomasys::terms;

/// The answer to which design is best.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// The best design, unless none is left.
    pub design: Option<Individual>,
    /// Why the other designs of the function are ruled out, by IRI; those with less utility are not listed.
    pub rejected: BTreeMap<String, Vec<Rejection>>,
}

/// Why a design is ruled out.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Rejection {
    /// The knowledge base says that it cannot be used now.
    Unavailable,
    /// It has failed this objective before.
    Failed,
    /// A measurement is on the wrong side of its estimation.
    Violates {
        /// Local name of the attribute type.
        attribute: String,
        /// What was measured, in the type's unit.
        measured: BigRational,
        /// The comparison that rules the design out, with the measurement on its left.
        operator: String,
        /// What the design is estimated to need or give.
        estimation: BigRational,
    },
}

impl Runtime {
    /// The best design for an objective now.
    ///
    /// # Errors
    /// [`Error::Unknown`] where there is no such objective.
    pub fn select(&self, objective: &str) -> Result<Selection, Error> {
        let facts = self.facts();
        let (objective, _) = self.all().find("objective", terms::OBJECTIVE, objective)?;
        let mut selection = Selection::default();
        let mut best: Option<(BigRational, Individual)> = None;
        for design in self.designs_of(facts, &facts.objects(objective, terms::TYPE_F)) {
            let individual = self.individual(design);
            let rejections = rejections(facts, design, objective);
            if !rejections.is_empty() {
                selection.rejected.insert(individual.iri, rejections);
                continue;
            }
            let utility = utility(facts, design);
            if best.as_ref().is_none_or(|(least, _)| utility > *least) {
                best = Some((utility, individual));
            }
        }
        selection.design = best.map(|(_, design)| design);
        Ok(selection)
    }

    /// The designs that the knowledge base does not rule out, of one function or of all, sorted by IRI.
    ///
    /// # Errors
    /// [`Error::Unknown`] where there is no such function.
    pub fn available_designs(&self, function: Option<&str>) -> Result<Vec<Individual>, Error> {
        let facts = self.facts();
        let functions = match function {
            Some(name) => vec![self.all().find("function", terms::FUNCTION, name)?.0],
            None => facts.members(terms::FUNCTION),
        };
        let mut designs = self.designs_of(facts, &functions);
        designs.retain(|&design| is_available(facts, design));
        Ok(designs.into_iter().map(|design| self.individual(design)).collect())
    }

    /// The designs that solve any of the functions, sorted by IRI.
    pub(super) fn designs_of(&self, facts: Facts, functions: &[Symbol]) -> Vec<Symbol> {
        let mut designs: Vec<Symbol> =
            functions.iter().flat_map(|&function| facts.subjects(function, terms::SOLVES_F)).collect();
        designs.sort_by_key(|&design| self.engine.symbols().value(design).as_name());
        designs.dedup();
        designs
    }
}

fn is_available(facts: Facts, design: Symbol) -> bool {
    !facts.is_false(design, terms::REALISABILITY) && !facts.is_false(design, terms::AVAILABLE)
}

pub(super) fn rejections(facts: Facts, design: Symbol, objective: Symbol) -> Vec<Rejection> {
    let mut rejections = Vec::new();
    if !is_available(facts, design) {
        rejections.push(Rejection::Unavailable);
    }
    if facts.objects(design, terms::ERROR_LOG).contains(&objective) {
        rejections.push(Rejection::Failed);
    }
    let estimations = facts.objects(design, terms::HAS_ESTIMATION).into_iter();
    rejections.extend(estimations.filter_map(|estimation| violation(facts, estimation)));
    rejections
}

/// What rules a design with this estimation out, if something does.
fn violation(facts: Facts, estimation: Symbol) -> Option<Rejection> {
    let &kind = facts.objects(estimation, terms::IS_TYPE).first()?;
    let operator = facts.texts(kind, terms::OPERATOR).pop()?;
    let measured =
        change::holders(facts, kind).into_iter().find_map(|holder| facts.number(holder, terms::HAS_VALUE))?;
    let estimation = facts.number(estimation, terms::HAS_VALUE)?;
    let violates = match operator.as_str() {
        "<" => measured < estimation,
        "<=" => measured <= estimation,
        ">" => measured > estimation,
        ">=" => measured >= estimation,
        _ => false,
    };
    let attribute = Individual::new(facts.name(kind)?).name;
    violates.then_some(Rejection::Violates { attribute, measured, operator, estimation })
}

pub(super) fn utility(facts: Facts, design: Symbol) -> BigRational {
    let concluded = facts.number(design, terms::CONCLUDED_UTILITY);
    let is_performance = |&value: &Symbol| {
        let kinds = facts.objects(value, terms::IS_TYPE).into_iter();
        kinds.filter_map(|kind| facts.name(kind)).any(|iri| Individual::new(iri).name == "performance")
    };
    let estimations = facts.objects(design, terms::HAS_ESTIMATION).into_iter();
    let performances: Vec<Symbol> = estimations.filter(is_performance).collect();
    let estimated = match performances[..] {
        [only] => facts.number(only, terms::HAS_VALUE),
        _ => None,
    };
    concluded.or(estimated).unwrap_or_else(|| BigRational::new(1.into(), 1000.into()))
}
