//! What is known at run time: an engine, and the reports that change what it knows.

use std::collections::{BTreeMap, BTreeSet};

use rules::{Delta, Derivation, Engine, Fact, Literal, Program, Symbol, Violation};

use crate::error::Error;
use crate::lower::INTERNAL;
use crate::tomasys::change::{self, Status};
use crate::tomasys::facts::Facts;
use crate::tomasys::terms::{self, Term};
use crate::tomasys::{Individual, View};
use crate::vocab::owl;

/// What becomes of a conclusion whose cause is gone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// It goes too.
    #[default]
    Retract,
    /// It stays, as with the MROS reasoner: each [`Runtime::conclude`] turns conclusions into statements, and only
    /// those count for queries. A design's realisability is forgotten when a component that had failed or recovered
    /// reports again, a grounding's status with the grounding, an objective's status when it is grounded, and a
    /// design's error log never.
    Latch,
}

/// Knowledge at run time.
#[derive(Clone, Debug)]
pub struct Runtime {
    pub(super) engine: Engine,
    pub(super) mode: Mode,
    /// In latch mode, facts that may have become conclusions since the last cycle.
    pub(super) pending: BTreeSet<Fact>,
    /// Why latched statuses were concluded.
    pub(super) reasons: BTreeMap<Fact, Derivation>,
    /// Relations that have statements, with their arity.
    pub(super) relations: BTreeSet<(Symbol, usize)>,
}

impl Runtime {
    /// Takes over an engine.
    pub fn new(engine: Engine, mode: Mode) -> Self {
        let facts: Vec<Fact> = engine.facts().collect();
        let relations = facts.iter().map(|fact| (fact.predicate, fact.arguments.len())).collect();
        let pending = match mode {
            Mode::Retract => BTreeSet::new(),
            Mode::Latch => facts.into_iter().filter(|fact| !engine.is_asserted(fact)).collect(),
        };
        Self { engine, mode, pending, reasons: BTreeMap::new(), relations }
    }

    /// The engine, to ask for facts and derivations.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// The engine, to intern names; changes of facts go through [`Runtime::apply`].
    pub fn engine_mut(&mut self) -> &mut Engine {
        &mut self.engine
    }

    /// The typed view on everything that holds now.
    pub fn view(&self) -> View<'_> {
        View::new(&self.engine)
    }

    /// Changes statements and returns what holds from now on, and what no more.
    ///
    /// # Errors
    /// [`Error::Engine`] where the rules run away; nothing has changed then.
    pub fn apply(&mut self, delta: Delta) -> Result<Delta, Error> {
        self.relations.extend(delta.insert.iter().map(|fact| (fact.predicate, fact.arguments.len())));
        if self.mode == Mode::Retract {
            return Ok(self.engine.apply(delta)?);
        }
        // A statement that is taken back may still be a conclusion.
        let deleted = delta.delete.clone();
        let net = self.engine.apply(delta)?;
        for fact in &deleted {
            self.reasons.remove(fact);
        }
        self.pending.extend(deleted.into_iter().chain(net.insert.iter().cloned()));
        Ok(net)
    }

    /// Changes statements and rules in one step, as [`crate::Stated::change`] has them.
    ///
    /// # Errors
    /// As [`Engine::change`]; nothing has changed then.
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

    /// Ends a cycle: returns what contradicts itself and, in latch mode and if nothing does, turns what was concluded
    /// into statements. The MROS reasoner adapts nothing while there is a contradiction.
    ///
    /// # Errors
    /// As [`Runtime::apply`].
    pub fn conclude(&mut self) -> Result<Vec<Violation>, Error> {
        let violations = self.engine.violations();
        if self.mode == Mode::Latch && violations.is_empty() {
            let pending = std::mem::take(&mut self.pending).into_iter();
            let insert: Vec<Fact> = pending.filter(|fact| self.is_latched(fact)).collect();
            let reasons: Vec<_> =
                insert.iter().filter_map(|fact| Some((fact.clone(), self.engine.why(fact)?))).collect();
            self.relations.extend(insert.iter().map(|fact| (fact.predicate, fact.arguments.len())));
            self.engine.apply(Delta { insert, delete: Vec::new() })?;
            self.reasons.extend(reasons);
        }
        Ok(violations)
    }

    /// Whether a fact is a conclusion about individuals, as a reasoner writes it back.
    fn is_latched(&self, fact: &Fact) -> bool {
        let name = self.engine.symbols().value(fact.predicate).as_name().unwrap_or_default();
        let written = !name.starts_with(INTERNAL) && ![owl::SAME_AS, owl::DIFFERENT_FROM].contains(&name);
        written && self.engine.holds(fact) && !self.engine.is_asserted(fact)
    }

    /// A component has a status from now on.
    ///
    /// # Errors
    /// [`Error::Unknown`] where the knowledge base has no such component; [`Error::Engine`].
    pub fn report_component(&mut self, component: &str, status: Status) -> Result<Delta, Error> {
        let delta = change::component_status(&mut self.engine, component, status)?;
        self.report(component, delta)
    }

    /// As [`Runtime::report_component`], with the status in the reporter's spelling.
    ///
    /// # Errors
    /// As [`Runtime::report_component`].
    pub fn report_component_as(&mut self, component: &str, status: Literal) -> Result<Delta, Error> {
        let delta = change::component_report(&mut self.engine, component, status)?;
        self.report(component, delta)
    }

    /// A component has no known status from now on.
    ///
    /// # Errors
    /// As [`Runtime::report_component`].
    pub fn clear_component(&mut self, component: &str) -> Result<Delta, Error> {
        let delta = change::clear_component_status(&mut self.engine, component)?;
        self.report(component, delta)
    }

    /// Applies a component's report; in latch mode designs get another chance if it had failed or recovered before.
    fn report(&mut self, component: &str, mut delta: Delta) -> Result<Delta, Error> {
        let facts = self.facts();
        let (component, _) = self.all().find("component", terms::COMPONENT, component)?;
        let known = |status: &String| change::is_failed(status) || change::is_recovered(status);
        if self.mode == Mode::Latch && facts.texts(component, terms::STATUS).iter().any(known) {
            for design in self.all().members(terms::FUNCTION_DESIGN) {
                delta.delete.extend(self.statements(design, terms::REALISABILITY));
            }
        }
        self.apply(delta)
    }

    /// An attribute was measured.
    ///
    /// # Errors
    /// [`Error::Unknown`] where the knowledge base has no such attribute type, [`Error::NotANumber`],
    /// [`Error::Engine`].
    pub fn measure(&mut self, attribute: &str, value: Literal) -> Result<Delta, Error> {
        if value.as_rational().is_none() {
            return Err(Error::NotANumber { attribute: attribute.to_owned(), value: value.lexical() });
        }
        let delta = change::measured_value(&mut self.engine, attribute, value)?;
        self.apply(delta)
    }

    /// What counts for queries: in latch mode what is stated, otherwise all that holds.
    pub(super) fn facts(&self) -> Facts<'_> {
        Facts::stated(&self.engine, self.mode == Mode::Latch)
    }

    /// Everything that holds.
    pub(super) fn all(&self) -> Facts<'_> {
        Facts::new(&self.engine)
    }

    pub(super) fn individual(&self, symbol: Symbol) -> Individual {
        Individual::new(self.facts().name(symbol).unwrap_or_default())
    }

    /// The stated values of a property, as facts.
    pub(super) fn statements(&self, subject: Symbol, property: Term) -> Vec<Fact> {
        let mut found = Vec::new();
        for predicate in property.iter().filter_map(|name| self.engine.symbols().find_name(name)) {
            found.extend(change::replace(&self.engine, predicate, subject, None).delete);
        }
        found
    }

    /// All statements that mention an individual.
    pub(super) fn mentions(&self, individual: Symbol) -> Vec<Fact> {
        let mut found = Vec::new();
        for &(predicate, arity) in &self.relations {
            for place in 0..arity {
                let pattern: Vec<_> = (0..arity).map(|i| (i == place).then_some(individual)).collect();
                let rows = self.engine.matching(predicate, &pattern);
                let facts = rows.map(|row| Fact::new(predicate, row.iter().copied()));
                found.extend(facts.filter(|fact| self.engine.is_asserted(fact)));
            }
        }
        found
    }
}
