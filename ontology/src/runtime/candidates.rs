//! The designs for an objective, with their utility, and for each what rules it out.
//!
//! What rules a design out for [`Runtime::select`] does so here. Besides, it is said which requirements of the objective a design is
//! estimated to miss. On which side of a bound a design has to be is said by the rules of the knowledge base only (MROS's `QAenergy`:
//! above the bound is in error). So the rules are asked: on a copy, the objective is grounded with the design, and what is
//! measured of it is what it is estimated to give. A requirement is missed if the objective is in error then.

use std::collections::BTreeMap;

use num_rational::BigRational;
use rules::{Delta, Symbol};

use super::knowledge::Runtime;
use super::select::{Rejection, rejections, utility};
use super::state::Objective;
use crate::error::Error;
use crate::tomasys::Individual;
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
    /// by local name; or else what [`Runtime::select`] goes by.
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
