//! Lists the designs for an objective, with the reasons that exclude them and their utility, both as in MROS.
//! Also lists the requirements that each design misses, which MROS does not use for its choice.
//!
//! A design is excluded if it is unavailable, if the error log contains its failure for the objective, or if
//! a measurement excludes one of its estimations. The last condition compares both values by the attribute's
//! `qa_comparison_operator` (`<` excludes the design if the measured value is below the estimation). An
//! attribute without a measurement excludes no design. MROS raises an exception in this case, and for a
//! design that violates two attributes.
//!
//! The utility is PLANTA's `fd_utility` if the knowledge base concludes or states one value of it. Otherwise it is the
//! estimation of the attribute type `performance` if there is exactly one, or else 0.001. If the caller names an
//! attribute, its estimation is the utility instead.
//!
//! Each design also has the requirements of the objective that its estimations do not meet, without those on
//! attributes with a comparison operator. Only the rules of the knowledge base define on which side of a
//! bound a value has to be: for MROS's `QAenergy`, a value above the bound is an error. Therefore the rules
//! are evaluated on a copy of the engine, in which the objective is grounded with the design. The estimation
//! is asserted as the measured value. The requirement is missed if the objective is then in error.

use std::collections::BTreeMap;

use num_rational::BigRational;
use rules::{Delta, Symbol};

use super::knowledge::Runtime;
use crate::error::Error;
use crate::tomasys::Individual;
use crate::tomasys::change;
use crate::tomasys::facts::Facts;
use crate::tomasys::terms::{self, term_for};
use crate::vocab::tomasys;

/// A design for an objective.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Candidate {
    /// The design.
    pub design: Individual,
    /// Utility; larger is better.
    pub utility: BigRational,
    /// Reasons that exclude the design; empty if the design can be selected.
    pub rejections: Vec<Rejection>,
    /// Requirements of the objective that the estimations of the design do not meet.
    pub missed: Vec<Missed>,
}

/// A reason that excludes a design.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Rejection {
    /// The knowledge base concludes or states that the design cannot be used now.
    Unavailable,
    /// The error log contains a failure of the design for this objective.
    Failed,
    /// The comparison of a measurement with an estimation excludes the design.
    Violates {
        /// Local name of the attribute type.
        attribute: String,
        /// Measured value, in the unit of the attribute type.
        measured: BigRational,
        /// Comparison operator. The design is excluded because `measured operator estimation` is true.
        operator: String,
        /// Estimated value of the design.
        estimation: BigRational,
    },
}

/// A requirement of an objective that an estimation of a design does not meet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Missed {
    /// Local name of the attribute type.
    pub attribute: String,
    /// Estimated value of the design, in the unit of the attribute type.
    pub estimation: BigRational,
    /// The bound that the objective requires.
    pub bound: BigRational,
    /// Error status that the objective would have if the estimation were measured, such as `IN_ERROR_NFR`.
    pub status: String,
}

impl Runtime {
    /// Returns the designs that solve an objective's function, sorted by IRI. The utility of a design is
    /// its estimation of the attribute type with the local name `utility_attribute` (0 without an
    /// estimation), or MROS's utility if `utility_attribute` is `None`.
    ///
    /// # Errors
    /// Returns [`Error::Unknown`] if there is no such objective, [`Error::Engine`] if the rules exceed their
    /// limits.
    pub fn candidates(
        &self,
        objective: &str,
        utility_attribute: Option<&str>,
    ) -> Result<Vec<Candidate>, Error> {
        let facts = self.facts();
        let (symbol, _) = self.all_facts().find("objective", terms::OBJECTIVE, objective)?;
        let mut candidates = Vec::new();
        for design in self.designs_of(facts, &facts.objects(symbol, terms::TYPE_F)) {
            let (rejections, missed) = (rejections(facts, design, symbol), self.missed(symbol, design)?);
            let utility = match utility_attribute {
                None => utility(facts, design),
                Some(attribute) => self.estimation(design, attribute).unwrap_or_default(),
            };
            candidates.push(Candidate { design: self.individual(design), utility, rejections, missed });
        }
        Ok(candidates)
    }

    /// Returns the available designs of one function or of all functions, sorted by IRI. In latch mode, these
    /// are the designs that MROS regards as available; [`Runtime::view`] shows the current conclusions instead.
    ///
    /// # Errors
    /// Returns [`Error::Unknown`] if there is no such function.
    pub fn available_designs(&self, function: Option<&str>) -> Result<Vec<Individual>, Error> {
        let facts = self.facts();
        let functions = match function {
            Some(name) => vec![self.all_facts().find("function", terms::FUNCTION, name)?.0],
            None => facts.members(terms::FUNCTION),
        };
        let mut designs = self.designs_of(facts, &functions);
        designs.retain(|&design| is_available(facts, design));
        Ok(designs.into_iter().map(|design| self.individual(design)).collect())
    }

    fn designs_of(&self, facts: Facts, functions: &[Symbol]) -> Vec<Symbol> {
        let mut designs: Vec<Symbol> =
            functions.iter().flat_map(|&function| facts.subjects(function, terms::SOLVES_F)).collect();
        designs.sort_by_key(|&design| self.engine.symbols().value(design).as_name());
        designs.dedup();
        designs
    }

    fn estimation(&self, design: Symbol, attribute: &str) -> Option<BigRational> {
        let facts = self.facts();
        let is_of = |value: &Symbol| {
            let mut kinds = facts.objects(*value, terms::IS_TYPE).into_iter();
            kinds.any(|kind| self.individual(kind).name == attribute)
        };
        let values = facts.objects(design, terms::HAS_ESTIMATION).into_iter();
        values.filter(is_of).find_map(|value| facts.number(value, terms::HAS_VALUE))
    }

    /// Returns the requirements of an objective that a design's estimations do not meet according to the
    /// rules. Omits requirements on attributes without an estimation, and on attributes with a comparison
    /// operator.
    fn missed(&self, objective: Symbol, design: Symbol) -> Result<Vec<Missed>, Error> {
        let facts = self.facts();
        let mut required: BTreeMap<Symbol, BigRational> = BTreeMap::new();
        for requirement in facts.objects(objective, terms::HAS_NFR) {
            let kinds = facts.objects(requirement, terms::IS_TYPE).into_iter();
            // `rejections` considers the attributes with a comparison operator.
            let kind = kinds.filter(|&kind| facts.texts(kind, terms::OPERATOR).is_empty()).min();
            required.extend(kind.zip(facts.number(requirement, terms::HAS_VALUE)));
        }
        let mut missed = Vec::new();
        for (kind, bound) in required {
            let attribute = self.individual(kind).name;
            let Some(estimation) = self.estimation(design, &attribute) else { continue };
            if let Some(status) = self.hypothetical_status(objective, design, kind, &estimation)? {
                missed.push(Missed { attribute, estimation, bound, status });
            }
        }
        Ok(missed)
    }

    /// Returns the error status that the objective would have if it were grounded with `design` and the
    /// attribute `kind` were measured as `value`. `None` if it would have no error, or an error even without
    /// this value.
    fn hypothetical_status(
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
        // Existing measurements belong to the previous design, or to the environment, which `rejections`
        // considers.
        let delete = copy.statements(grounding, terms::HAS_QA_VALUE);
        copy.apply(Delta { insert: Vec::new(), delete })?;
        // An error at this point has another cause than this attribute.
        if copy.error_status(&name)?.is_some() {
            return Ok(None);
        }
        let class = self
            .all_facts()
            .find("quality attribute type", terms::ATTRIBUTE_TYPE, &self.individual(kind).iri)?
            .1;
        let holder = copy.engine.symbols_mut().name(&format!("{}estimated", tomasys::NS));
        let value =
            copy.engine.symbols_mut().literal(rules::Literal::Decimal(rules::Decimal::from_rational(value)));
        let insert = vec![
            copy.fact(term_for(terms::QA_VALUE, class), [holder]),
            copy.fact(term_for(terms::IS_TYPE, class), [holder, kind]),
            copy.fact(term_for(terms::HAS_VALUE, class), [holder, value]),
            copy.fact(terms::HAS_QA_VALUE[0], [grounding, holder]),
        ];
        copy.apply(Delta { insert, delete: Vec::new() })?;
        copy.error_status(&name)
    }

    /// Ends a cycle of the adaptation loop (see [`Runtime::conclude`]). Returns the first status of the objective
    /// that is an error; `None` without an error.
    fn error_status(&mut self, objective: &str) -> Result<Option<String>, Error> {
        self.conclude()?;
        let objective_state = self.objectives().into_iter().find(|state| state.individual.iri == objective);
        Ok(objective_state.and_then(|state| state.error().map(str::to_owned)))
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
        [performance] => facts.number(performance, terms::HAS_VALUE),
        _ => None,
    };
    concluded.or(estimated).unwrap_or_else(|| BigRational::new(1.into(), 1000.into()))
}
