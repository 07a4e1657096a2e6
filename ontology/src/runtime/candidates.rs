//! The designs for an objective, each with its utility and the reasons that rule it out: the selection rule of MROS.
//!
//! A design is ruled out if it is not available, if the error log says that it failed the objective before, or if a
//! measurement stands to one of its estimations in the relation that the attribute's `qa_comparison_operator` names
//! (`<`: measured below estimated). An attribute that has not been measured rules nothing out; MROS stops with an
//! exception there, and where a design violates two attributes. Its utility is the estimation of the attribute type named
//! `performance` if there is exactly one, or else 0.001 (PLANTA's `fd_utility`, where a knowledge base concludes it).
//!
//! Besides, each design has the requirements of the objective that it is estimated to miss. On which side of a bound a design has to be is said by the rules of the knowledge base only (MROS's `QAenergy`:
//! above the bound is in error). So the rules are asked: on a copy, the objective is grounded with the design, and what is
//! measured of it is what it is estimated to give. A requirement is missed if the objective is in error then.

use std::collections::BTreeMap;

use num_rational::BigRational;
use rules::{Delta, Symbol};

use super::knowledge::Runtime;
use super::state::Objective;
use crate::error::Error;
use crate::tomasys::Individual;
use crate::tomasys::change;
use crate::tomasys::facts::Facts;
use crate::tomasys::terms::{self, beside};
use crate::vocab::tomasys;

/// A design for an objective.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Candidate {
    /// Which design.
    pub design: Individual,
    /// What it is worth; larger is better.
    pub utility: BigRational,
    /// Why it is ruled out; it is not if there is nothing here.
    pub rejections: Vec<Rejection>,
    /// Requirements of the objective that it is estimated to miss.
    pub missed: Vec<Missed>,
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

/// A requirement of an objective that a design is estimated to miss.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Missed {
    /// Local name of the attribute type.
    pub attribute: String,
    /// What the design is estimated to need or give, in the type's unit.
    pub estimation: BigRational,
    /// The bound that the objective requires.
    pub bound: BigRational,
    /// The status that the rules would conclude of the objective.
    pub status: String,
}

impl Runtime {
    /// The designs that solve an objective's function, sorted by IRI. What they are worth is their estimation of an attribute type,
    /// by local name; or else MROS's utility.
    ///
    /// # Errors
    /// [`Error::Unknown`] where there is no such objective, [`Error::Engine`] where the rules run away.
    pub fn candidates(&self, objective: &str, worth: Option<&str>) -> Result<Vec<Candidate>, Error> {
        let facts = self.facts();
        let (symbol, _) = self.all().find("objective", terms::OBJECTIVE, objective)?;
        let mut candidates = Vec::new();
        for design in self.designs_of(facts, &facts.objects(symbol, terms::TYPE_F)) {
            let (rejections, missed) = (rejections(facts, design, symbol), self.missed(symbol, design)?);
            let utility = match worth {
                None => utility(facts, design),
                Some(attribute) => self.estimation(design, attribute).unwrap_or_default(),
            };
            candidates.push(Candidate { design: self.individual(design), utility, rejections, missed });
        }
        Ok(candidates)
    }

    /// The designs that the knowledge base does not rule out, of one function or of all, sorted by IRI. In
    /// latch mode these are the designs that MROS takes for available; [`Runtime::view`] shows what holds instead.
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
    fn designs_of(&self, facts: Facts, functions: &[Symbol]) -> Vec<Symbol> {
        let mut designs: Vec<Symbol> =
            functions.iter().flat_map(|&function| facts.subjects(function, terms::SOLVES_F)).collect();
        designs.sort_by_key(|&design| self.engine.symbols().value(design).as_name());
        designs.dedup();
        designs
    }

    /// What a design is estimated to give or need of an attribute type, by local name.
    fn estimation(&self, design: Symbol, attribute: &str) -> Option<BigRational> {
        let facts = self.facts();
        let is_of = |value: &Symbol| {
            let mut kinds = facts.objects(*value, terms::IS_TYPE).into_iter();
            kinds.any(|kind| self.individual(kind).name == attribute)
        };
        let values = facts.objects(design, terms::HAS_ESTIMATION).into_iter();
        values.filter(is_of).find_map(|value| facts.number(value, terms::HAS_VALUE))
    }

    /// The requirements of an objective that a design is estimated to miss, by the rules of the knowledge base.
    fn missed(&self, objective: Symbol, design: Symbol) -> Result<Vec<Missed>, Error> {
        let facts = self.facts();
        let mut required: BTreeMap<Symbol, BigRational> = BTreeMap::new();
        for requirement in facts.objects(objective, terms::HAS_NFR) {
            let kinds = facts.objects(requirement, terms::IS_TYPE).into_iter();
            // What is compared with measurements of the surroundings has been looked at before.
            let kind = kinds.filter(|&kind| facts.texts(kind, terms::OPERATOR).is_empty()).min();
            required.extend(kind.zip(facts.number(requirement, terms::HAS_VALUE)));
        }
        let mut missed = Vec::new();
        for (kind, bound) in required {
            let attribute = self.individual(kind).name;
            let Some(estimation) = self.estimation(design, &attribute) else { continue };
            if let Some(status) = self.tried(objective, design, kind, &estimation)? {
                missed.push(Missed { attribute, estimation, bound, status });
            }
        }
        Ok(missed)
    }

    /// The status of an objective, if it is in error, were it grounded with a design of which this is measured.
    fn tried(
        &self,
        objective: Symbol,
        design: Symbol,
        kind: Symbol,
        value: &BigRational,
    ) -> Result<Option<String>, Error> {
        let mut copy = self.clone();
        let name = self.individual(objective).iri;
        let grounding = copy.ground(&name, &self.individual(design).iri)?;
        let Some(grounding) = copy.engine.symbols().find_name(&grounding.iri) else { return Ok(None) };
        // Measurements so far are of the design before, or of the surroundings, which have been looked at.
        let delete = copy.statements(grounding, terms::HAS_QA_VALUE);
        copy.apply(Delta { insert: Vec::new(), delete })?;
        if copy.error_of(&name)?.is_some() {
            return Ok(None);
        }
        let class =
            self.all().find("quality attribute type", terms::ATTRIBUTE_TYPE, &self.individual(kind).iri)?.1;
        let holder = copy.engine.symbols_mut().name(&format!("{}estimated", tomasys::NS));
        let value =
            copy.engine.symbols_mut().literal(rules::Literal::Decimal(rules::Decimal::from_rational(value)));
        let insert = vec![
            copy.fact(beside(terms::QA_VALUE, class), [holder]),
            copy.fact(beside(terms::IS_TYPE, class), [holder, kind]),
            copy.fact(beside(terms::HAS_VALUE, class), [holder, value]),
            copy.fact(terms::HAS_QA_VALUE[0], [grounding, holder]),
        ];
        copy.apply(Delta { insert, delete: Vec::new() })?;
        copy.error_of(&name)
    }

    /// The status of an objective at the end of a cycle, if it is in error.
    fn error_of(&mut self, objective: &str) -> Result<Option<String>, Error> {
        self.conclude()?;
        let found = self.objectives().into_iter().find(|own| own.individual.iri == objective);
        Ok(found.filter(Objective::is_in_error).and_then(|own| own.statuses.into_iter().next()))
    }
}

fn is_available(facts: Facts, design: Symbol) -> bool {
    !facts.is_false(design, terms::REALISABILITY) && !facts.is_false(design, terms::AVAILABLE)
}

fn rejections(facts: Facts, design: Symbol, objective: Symbol) -> Vec<Rejection> {
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

fn utility(facts: Facts, design: Symbol) -> BigRational {
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
