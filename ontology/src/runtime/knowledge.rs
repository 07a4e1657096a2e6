//! Run-time knowledge: an engine, and the reports that update it.

use std::collections::{BTreeMap, BTreeSet};

use rules::{Delta, Derivation, Engine, Fact, Literal, Program, Symbol, Violation};

use crate::error::Error;
use crate::lower::INTERNAL;
use crate::tomasys::change::{self, Status};
use crate::tomasys::facts::Facts;
use crate::tomasys::terms::{self, Term};
use crate::tomasys::{Individual, View};
use crate::vocab::owl;

/// Treatment of a derived fact whose premises no longer hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// The conclusion is retracted.
    #[default]
    Retract,
    /// The conclusion remains, as in the MROS reasoner. Each [`Runtime::conclude`] without violations turns conclusions
    /// into assertions, and only assertions count for queries. The realisability of all designs is removed when a
    /// component that had failed or recovered reports again. The status of a grounding is removed with the
    /// grounding, and the status of an objective when the objective is grounded. A failure in a design's
    /// error log is removed only with the objective.
    Latch,
}

/// An engine with the reports of a robot, and the state that [`Mode::Latch`] requires.
#[derive(Clone, Debug)]
pub struct Runtime {
    pub(super) engine: Engine,
    pub(super) mode: Mode,
    /// In latch mode, facts that may have been derived since conclusions were last turned into assertions.
    pub(super) pending: BTreeSet<Fact>,
    /// Maps each latched fact, i.e. each conclusion that became an assertion, to its derivation.
    pub(super) reasons: BTreeMap<Fact, Derivation>,
    /// Relations that may have asserted facts, with their arities.
    pub(super) relations: BTreeSet<(Symbol, usize)>,
}

impl Runtime {
    /// Creates a runtime from an engine.
    pub fn new(engine: Engine, mode: Mode) -> Self {
        let relations = engine.predicates().collect();
        let pending = match mode {
            Mode::Retract => BTreeSet::new(),
            // The initial conclusions become assertions at the end of the first cycle without violations, but not
            // equalities.
            Mode::Latch => engine.inferred_in_brief(1).into_iter().collect(),
        };
        Self { engine, mode, pending, reasons: BTreeMap::new(), relations }
    }

    /// Returns the engine, for queries of facts and derivations.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// Returns the engine, for interning names. Changes of facts must use [`Runtime::apply`].
    pub fn engine_mut(&mut self) -> &mut Engine {
        &mut self.engine
    }

    /// Returns the typed view of all facts that hold.
    pub fn view(&self) -> View<'_> {
        View::new(&self.engine)
    }

    /// Changes assertions. Returns the resulting change of all facts that hold.
    ///
    /// # Errors
    /// Returns [`Error::Engine`] with an error of [`Engine::apply`]; the facts are then unchanged.
    pub fn apply(&mut self, delta: Delta) -> Result<Delta, Error> {
        self.relations.extend(delta.insert.iter().map(|fact| (fact.predicate, fact.arguments.len())));
        if self.mode == Mode::Retract {
            return Ok(self.engine.apply(delta)?);
        }
        // A retracted assertion may still be a conclusion.
        let deleted = delta.delete.clone();
        let net = self.engine.apply(delta)?;
        for fact in &deleted {
            self.reasons.remove(fact);
        }
        self.pending.extend(deleted.into_iter().chain(net.insert.iter().cloned()));
        Ok(net)
    }

    /// Changes assertions and, if `program` is given, the rules in one step; see
    /// [`crate::Stated::change`].
    ///
    /// # Errors
    /// Returns the errors of [`Engine::change`]; the engine is then unchanged.
    pub fn revise(&mut self, delta: Delta, program: Option<Program>) -> Result<Delta, rules::Errors> {
        self.relations.extend(delta.insert.iter().map(|fact| (fact.predicate, fact.arguments.len())));
        let deleted = delta.delete.clone();
        let net = match program {
            Some(program) => self.engine.change(delta, program)?,
            None => self.engine.apply(delta)?,
        };
        if self.mode == Mode::Latch {
            for fact in &deleted {
                self.reasons.remove(fact);
            }
            self.pending.extend(deleted.into_iter().chain(net.insert.iter().cloned()));
        }
        Ok(net)
    }

    /// Ends a cycle of the adaptation loop and returns the violations. In latch mode without violations, turns
    /// conclusions into assertions. The MROS reasoner does not adapt while there are violations.
    ///
    /// # Errors
    /// Returns the errors of [`Runtime::apply`].
    pub fn conclude(&mut self) -> Result<Vec<Violation>, Error> {
        let violations = self.engine.violations();
        if self.mode == Mode::Latch && violations.is_empty() {
            let pending = std::mem::take(&mut self.pending).into_iter();
            // Only facts that changed since the last cycle without violations are examined.
            let insert: Vec<Fact> = pending.filter(|fact| self.is_latched(fact)).collect();
            let reasons: Vec<_> =
                insert.iter().filter_map(|fact| Some((fact.clone(), self.engine.why(fact)?))).collect();
            self.relations.extend(insert.iter().map(|fact| (fact.predicate, fact.arguments.len())));
            self.engine.apply(Delta { insert, delete: Vec::new() })?;
            self.reasons.extend(reasons);
        }
        Ok(violations)
    }

    /// Returns `true` if a fact is derived, is not asserted, and belongs to a relation that reasoners store: neither an
    /// auxiliary relation nor `sameAs` or `differentFrom`.
    fn is_latched(&self, fact: &Fact) -> bool {
        let name = self.engine.symbols().value(fact.predicate).as_name().unwrap_or_default();
        let is_stored = !name.starts_with(INTERNAL) && ![owl::SAME_AS, owl::DIFFERENT_FROM].contains(&name);
        is_stored && self.engine.holds(fact) && !self.engine.is_asserted(fact)
    }

    /// Sets the status of a component.
    ///
    /// # Errors
    /// Returns [`Error::Unknown`] if the knowledge base has no such component, or [`Error::Engine`].
    pub fn report_component(&mut self, component: &str, status: Status) -> Result<Delta, Error> {
        let delta = change::component_status(&mut self.engine, component, status)?;
        self.report(component, delta)
    }

    /// Sets the status of a component to exactly the given literal, whether or not the knowledge base allows this
    /// spelling; see [`Runtime::report_component`].
    ///
    /// # Errors
    /// Returns the errors of [`Runtime::report_component`].
    pub fn report_component_as(&mut self, component: &str, status: Literal) -> Result<Delta, Error> {
        let delta = change::component_report(&mut self.engine, component, status)?;
        self.report(component, delta)
    }

    /// Removes the status of a component.
    ///
    /// # Errors
    /// Returns the errors of [`Runtime::report_component`].
    pub fn clear_component(&mut self, component: &str) -> Result<Delta, Error> {
        let delta = change::clear_component_status(&mut self.engine, component)?;
        self.report(component, delta)
    }

    fn report(&mut self, component: &str, mut delta: Delta) -> Result<Delta, Error> {
        let facts = self.facts();
        let (component, _) = self.all_facts().find("component", terms::COMPONENT, component)?;
        let is_fault_status = |status: &String| change::is_failed(status) || change::is_recovered(status);
        // MROS does this, too: designs are available again until rules conclude the opposite.
        if self.mode == Mode::Latch && facts.texts(component, terms::STATUS).iter().any(is_fault_status) {
            for design in self.all_facts().members(terms::FUNCTION_DESIGN) {
                delta.delete.extend(self.statements(design, terms::REALISABILITY));
            }
        }
        self.apply(delta)
    }

    /// Reports the measured value of an attribute.
    ///
    /// # Errors
    /// Returns [`Error::Unknown`] if the knowledge base has no such attribute type, [`Error::NotANumber`] or
    /// [`Error::Engine`].
    pub fn measure(&mut self, attribute: &str, value: Literal) -> Result<Delta, Error> {
        if value.as_rational().is_none() {
            return Err(Error::NotANumber { attribute: attribute.to_owned(), value: value.lexical() });
        }
        let delta = change::measured_value(&mut self.engine, attribute, value)?;
        self.apply(delta)
    }

    pub(super) fn facts(&self) -> Facts<'_> {
        Facts::stated(&self.engine, self.mode == Mode::Latch)
    }

    pub(super) fn all_facts(&self) -> Facts<'_> {
        Facts::new(&self.engine)
    }

    pub(super) fn individual(&self, symbol: Symbol) -> Individual {
        Individual::new(self.facts().name(symbol).unwrap_or_default())
    }

    pub(super) fn statements(&self, subject: Symbol, property: Term) -> Vec<Fact> {
        let mut facts = Vec::new();
        for predicate in property.iter().filter_map(|name| self.engine.symbols().find_name(name)) {
            facts.extend(change::replace(&self.engine, predicate, subject, None).delete);
        }
        facts
    }

    pub(super) fn mentions(&self, individual: Symbol) -> Vec<Fact> {
        let mut mentions = Vec::new();
        for &(predicate, arity) in &self.relations {
            for column in 0..arity {
                let pattern: Vec<_> = (0..arity).map(|i| (i == column).then_some(individual)).collect();
                let rows = self.engine.matching(predicate, &pattern);
                let facts = rows.map(|row| Fact::new(predicate, row.iter().copied()));
                mentions.extend(facts.filter(|fact| self.engine.is_asserted(fact)));
            }
        }
        mentions
    }
}
