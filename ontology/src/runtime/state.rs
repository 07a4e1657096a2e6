//! Queries of an adaptation loop: objectives, their statuses with reasons, and groundings.

use rules::{Derivation, Fact, Literal, Symbol};

use super::knowledge::Runtime;
use crate::error::Error;
use crate::tomasys::Individual;
use crate::tomasys::facts::Facts;
use crate::tomasys::terms::{self, Term};

/// Statuses of an objective that require another design, in MROS and its predecessor Metacontrol.
const ERRORS: [&str; 6] =
    ["IN_ERROR_COMPONENT", "IN_ERROR_FR", "IN_ERROR_NFR", "INTERNAL_ERROR", "EXTERNAL_ERROR", "UPDATABLE"];

/// An objective and its state.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Objective {
    /// The objective.
    pub individual: Individual,
    /// The function to provide, if one is stated.
    pub function: Option<Individual>,
    /// Statuses that are stated or concluded (`UNGROUNDED`, `IN_ERROR_COMPONENT`, …); empty if there is no problem.
    /// Several statuses are a contradiction only if the knowledge base declares `o_status` functional.
    pub statuses: Vec<String>,
    /// `true` if a component has recovered, so that a better design may be available.
    pub updatable: bool,
    /// `true` if a better design is searched even while the objective has no problem.
    pub always_improve: bool,
    /// Designs in use for the objective.
    pub groundings: Vec<Grounding>,
}

impl Objective {
    /// Returns `true` if a status of the objective requires another design, for example `IN_ERROR_FR`.
    pub fn is_in_error(&self) -> bool {
        self.error().is_some()
    }

    pub(super) fn error(&self) -> Option<&str> {
        self.statuses.iter().map(String::as_str).find(|status| ERRORS.contains(status))
    }

    /// Returns `true` if a design should be selected for the objective now.
    pub fn wants_design(&self) -> bool {
        self.is_in_error()
            || self.updatable
            || self.always_improve
            || self.statuses.iter().any(|status| status == "UNGROUNDED")
    }
}

/// A design in use for an objective.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Grounding {
    /// The grounding.
    pub individual: Individual,
    /// The design, if one is stated.
    pub design: Option<Individual>,
    /// Statuses that are stated or concluded; empty if there is no problem.
    pub statuses: Vec<String>,
    /// Measurements linked to the grounding: the individual that holds the value, and the value, if there is one.
    pub measurements: Vec<(Individual, Option<Literal>)>,
}

impl Runtime {
    /// Returns all objectives, sorted by IRI.
    pub fn objectives(&self) -> Vec<Objective> {
        let facts = self.facts();
        let mut objectives: Vec<Objective> =
            facts.members(terms::OBJECTIVE).into_iter().map(|symbol| self.objective(facts, symbol)).collect();
        objectives.sort_by(|a, b| a.individual.cmp(&b.individual));
        objectives
    }

    /// Returns one derivation for each status of an objective and for each value of its `o_updatable`. If a
    /// status or value was latched (kept as an assertion), the derivation is the one at that time.
    ///
    /// # Errors
    /// Returns [`Error::Unknown`] if there is no such objective.
    pub fn why(&self, objective: &str) -> Result<Vec<Derivation>, Error> {
        let (objective, _) = self.all_facts().find("objective", terms::OBJECTIVE, objective)?;
        let mut derivations = Vec::new();
        for property in [terms::OBJECTIVE_STATUS, terms::UPDATABLE] {
            for fact in self.property_facts(objective, property) {
                let latched = self.reasons.get(&fact).cloned();
                derivations.extend(latched.or_else(|| self.engine.why(&fact)));
            }
        }
        Ok(derivations)
    }

    fn property_facts(&self, subject: Symbol, property: Term) -> Vec<Fact> {
        let values = self.facts().objects(subject, property);
        let symbols = self.engine.symbols();
        let predicates = property.iter().filter_map(|name| symbols.find_name(name));
        let facts = predicates.flat_map(|p| values.iter().map(move |&value| Fact::new(p, [subject, value])));
        facts.filter(|fact| self.engine.holds(fact)).collect()
    }

    fn objective(&self, facts: Facts, symbol: Symbol) -> Objective {
        let function =
            facts.objects(symbol, terms::TYPE_F).first().map(|&function| self.individual(function));
        let groundings = facts.subjects(symbol, terms::SOLVES_O).into_iter();
        let mut groundings: Vec<_> = groundings.map(|grounding| self.grounding(facts, grounding)).collect();
        groundings.sort_by(|a, b| a.individual.cmp(&b.individual));
        Objective {
            individual: self.individual(symbol),
            function,
            statuses: facts.texts(symbol, terms::OBJECTIVE_STATUS),
            updatable: facts.is_true(symbol, terms::UPDATABLE),
            always_improve: facts.is_true(symbol, terms::ALWAYS_IMPROVE),
            groundings,
        }
    }

    fn grounding(&self, facts: Facts, symbol: Symbol) -> Grounding {
        let design = facts.objects(symbol, terms::TYPE_FD).first().map(|&design| self.individual(design));
        let holders = facts.objects(symbol, terms::HAS_QA_VALUE).into_iter();
        let value = |holder| facts.literals(holder, terms::HAS_VALUE).first().map(|&value| value.clone());
        let mut measurements: Vec<_> =
            holders.map(|holder| (self.individual(holder), value(holder))).collect();
        measurements.sort_by(|a, b| a.0.cmp(&b.0));
        let statuses = facts.texts(symbol, terms::GROUNDING_STATUS);
        Grounding { individual: self.individual(symbol), design, statuses, measurements }
    }
}
