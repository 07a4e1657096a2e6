//! A knowledge base at run time: OWL documents and rule files in a Datalog engine, updated with
//! reports of the robot.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use num_rational::BigRational;
use ontology::runtime::{Mode, NewObjective, Runtime};
use ontology::tomasys::change::Status;
use ontology::tomasys::{CalledNames, Individual, View};
use ontology::vocab::{local_name, tomasys};
use ontology::{Annotation, EntityKind, Equality, Iri};
use rules::{Delta, Engine, Fact, Literal, Program, Symbols};
use tracing::info_span;

use crate::file::{discreet, quoted};
use crate::knowledge::catalogue::Catalogue;
use crate::knowledge::sources::{Sources, Stated};
use crate::knowledge::statement::{Statement, Statements};
use crate::knowledge::value_reads::{ValueRead, is_read, value_reads};
use crate::knowledge::waiting::Waiting;
use crate::message::{Errors, Message};
use crate::planta::Terms;

/// Number of equal names of an individual up to which all pairs of names are listed.
const MANY_NAMES: usize = 32;

/// Knowledge about a robot: assertions and the facts inferred from them.
#[derive(Debug, Clone)]
pub struct Knowledge {
    pub(super) runtime: Runtime,
    pub(super) catalogue: OnceLock<Arc<Catalogue>>,
    value_reads: OnceLock<Arc<[Vec<ValueRead>]>>,
    pub(super) waiting: Waiting,
    /// State of the documents as read and revised, without reports. Shares all unchanged data with `runtime`.
    origin: Runtime,
    rule_count: usize,
    warnings: Vec<Message>,
    pub(super) sources: Sources,
    pub(super) called: Arc<CalledNames>,
    entities: Arc<[(EntityKind, Iri)]>,
    documents: Arc<[String]>,
    annotations: Arc<[(Iri, Annotation)]>,
    terms: Option<Arc<Terms>>,
    /// Contents of the documents and rule files.
    documented: Arc<ontology::Stated>,
    /// Asserted facts. Set only for an engine that was created from all facts of a proof, and therefore does not
    /// distinguish asserted from inferred facts.
    stated: Option<Arc<[Fact]>>,
}

/// A contradiction in the knowledge base: facts that violate an axiom or rule, or an invalid literal.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Contradiction {
    /// Violated axiom or rule, or a sentence about an invalid or unequal literal.
    pub violated: String,
    /// Facts that together cause the contradiction.
    pub facts: Vec<String>,
}

impl Knowledge {
    /// Reads documents and rules, with OWL's semantics of equality between individuals.
    ///
    /// # Errors
    /// All errors of the sources. Without such errors: inference exceeds its limits.
    pub fn read(sources: &Sources) -> Result<Self, Errors> {
        Self::read_as(sources, Equality::Owl)
    }

    /// Like [`Knowledge::read`], but with the given semantics of equality between individuals.
    ///
    /// # Errors
    /// As for [`Knowledge::read`].
    pub fn read_as(sources: &Sources, equality: Equality) -> Result<Self, Errors> {
        Self::of_stated(sources, Stated::read(sources, equality)?)
    }

    /// Like [`Knowledge::read`], but for a given domain text. If the domain is in PLANTA's form, that
    /// is, uses undeclared names of the ontology, keeps the translation of the ontology to PDDL and
    /// assumes unique names.
    ///
    /// # Errors
    /// As for [`Knowledge::read`].
    pub fn read_for(sources: &Sources, domain: &str) -> Result<Self, Errors> {
        Self::of_stated(sources, Stated::read_for(sources, domain)?)
    }

    fn of_stated(sources: &Sources, stated: Stated) -> Result<Self, Errors> {
        let Stated { symbols, program, facts, ontology, rules, equality, rule_count, mut warnings, terms } =
            stated;
        let _span = info_span!("knowledge").entered();
        let engine = Engine::with_limits(symbols, program, facts, sources.limits.clone())
            .map_err(|errors| errors.iter().map(Message::from_rules).collect::<Vec<_>>())?;
        let mistakes = ontology::tomasys::check(&ontology, &engine, equality);
        let mistakes = mistakes.iter().map(Message::from_ontology_warning);
        // In PLANTA's form, several values of a functional object property are accepted.
        warnings.extend(mistakes.filter(|warning| terms.is_none() || warning.code != "O404"));
        let runtime = Runtime::new(engine, Mode::Retract);
        let (sources, entities) = (sources.clone(), ontology.entities.as_slice().into());
        let documents = ontology.sources.iter().map(|source| source.name.clone()).collect();
        let annotations = ontology.annotations.as_slice().into();
        let documented = Arc::new(ontology::Stated::new(ontology, rules, equality));
        Ok(Self {
            documents,
            annotations,
            terms,
            documented,
            ..Self::of(runtime, rule_count, warnings, sources, entities)
        })
    }

    /// Creates knowledge without rules from all facts of a proof, both asserted and inferred.
    ///
    /// # Errors
    /// A fact has a symbol that is not in `symbols`, or more than 32 arguments.
    pub fn closed(symbols: Symbols, facts: Vec<Fact>, equality: bool) -> Result<Self, Errors> {
        let program = Program { rules: Vec::new(), equality };
        let engine = Engine::new(symbols, program, facts)
            .map_err(|errors| errors.iter().map(Message::from_rules).collect::<Vec<_>>())?;
        let runtime = Runtime::new(engine, Mode::Retract);
        Ok(Self::of(runtime, 0, Vec::new(), Sources::default(), Arc::default()))
    }

    /// Sets the translation of the ontology to PDDL, for a domain in PLANTA's form, and the asserted
    /// facts. Used after [`Knowledge::closed`].
    #[must_use]
    pub fn with_terms(self, terms: Option<Arc<Terms>>, stated: &[Fact]) -> Self {
        Self { terms, stated: Some(stated.into()), ..self }
    }

    pub(crate) fn terms(&self) -> Option<&Arc<Terms>> {
        self.terms.as_ref()
    }

    pub(crate) fn stated(&self) -> Vec<Fact> {
        let engine = self.engine();
        match &self.stated {
            Some(stated) => stated.to_vec(),
            None => engine.stated_facts(),
        }
    }

    fn of(
        runtime: Runtime,
        rule_count: usize,
        warnings: Vec<Message>,
        sources: Sources,
        entities: Arc<[(EntityKind, Iri)]>,
    ) -> Self {
        Self {
            origin: runtime.clone(),
            runtime,
            catalogue: OnceLock::new(),
            value_reads: OnceLock::new(),
            waiting: Waiting::default(),
            rule_count,
            warnings,
            sources,
            called: Arc::default(),
            entities,
            documents: Arc::default(),
            annotations: Arc::default(),
            terms: None,
            documented: Arc::default(),
            stated: None,
        }
    }

    /// Returns the warnings about the documents.
    pub fn warnings(&self) -> &[Message] {
        &self.warnings
    }

    /// Returns the entities of the documents: those that are declared, and those whose kind follows from their use.
    /// An individual without a declaration is not included.
    pub fn entities(&self) -> &[(EntityKind, Iri)] {
        &self.entities
    }

    /// Returns the annotations of entities in the documents: entity and annotation.
    pub fn annotations(&self) -> &[(Iri, Annotation)] {
        &self.annotations
    }

    /// Returns the sources of the knowledge base.
    pub fn sources(&self) -> &Sources {
        &self.sources
    }

    /// Returns the names of the documents: file paths, including imported files, and the IRIs of imported embedded
    /// knowledge bases. Documents of [`Knowledge::revise`] are not included.
    pub fn documents(&self) -> &[String] {
        &self.documents
    }

    /// Number of documents, including imports and the documents that [`Knowledge::revise`] asserted.
    pub fn document_count(&self) -> usize {
        self.documented.ontology().sources.len()
    }

    /// Number of rules in documents and rule files, without axioms. [`Knowledge::revise`] does not change it.
    pub fn rule_count(&self) -> usize {
        self.rule_count
    }

    /// Returns a typed view of the current facts.
    pub fn view(&self) -> View<'_> {
        self.runtime.view().calling(&self.called)
    }

    /// Sets the object names of individuals (object name by IRI), which replace their local names.
    pub(crate) fn call(&mut self, called: CalledNames) {
        self.called = Arc::new(called);
        self.catalogue = OnceLock::new();
    }

    /// Returns the engine, for queries of facts and derivations.
    pub fn engine(&self) -> &Engine {
        self.runtime.engine()
    }

    /// Returns the runtime, which translates reports of the robot to updates of the engine.
    pub fn runtime(&self) -> &Runtime {
        &self.runtime
    }

    /// Returns the runtime for modification. Discards the cached designs, actions, measured values and reads of
    /// values.
    pub fn runtime_mut(&mut self) -> &mut Runtime {
        (self.catalogue, self.value_reads) = (OnceLock::new(), OnceLock::new());
        &mut self.runtime
    }

    /// Returns the designs, actions and measured values of the knowledge base for planning. The result is computed
    /// on first use and cached.
    pub fn catalogue(&self) -> &Catalogue {
        self.catalogue.get_or_init(|| Arc::new(Catalogue::new(&self.view())))
    }

    /// Returns the reads of values by each rule and axiom, in the order of the program. The result is computed on first
    /// use and cached.
    pub fn value_reads(&self) -> &[Vec<ValueRead>] {
        self.value_reads.get_or_init(|| value_reads(self.engine()))
    }

    /// Returns `true` if a measured value of the attribute can have an effect: the attribute has a measurement, a
    /// design has a bound on it, it has a comparison operator, or a rule or an axiom can read its value. Also if the
    /// domain is in PLANTA's form, which can refer to all values. The attribute is given by the IRI or local name of
    /// its type. Axioms that only report contradictions do not count.
    pub fn uses_measurement(&self, attribute: &str) -> bool {
        let Some(kind) = self.attribute(attribute) else { return false };
        let catalogue = self.catalogue();
        let mut requirements = catalogue.designs().iter().flat_map(|design| &design.requirements);
        self.terms().is_some()
            || catalogue.measurements().iter().any(|measurement| measurement.attribute == kind.name)
            || requirements.any(|bound| bound.attribute == kind.name)
            || !self.view().values(&kind.iri, tomasys::QA_COMPARISON_OPERATOR).is_empty()
            || is_read(self.engine(), self.value_reads(), &kind.iri)
    }

    pub(super) fn follow(&mut self, delta: &Delta) {
        let engine = self.runtime.engine();
        if self.catalogue.get_mut().is_some_and(|own| !Arc::make_mut(own).follow(delta, engine)) {
            self.catalogue = OnceLock::new();
        }
    }

    /// Returns the change of facts of a successful update, after applying the change to the cache of queries.
    /// Converts an error to a message.
    fn changed(&mut self, outcome: Result<Delta, ontology::Error>) -> Result<Delta, Message> {
        let delta = outcome.map_err(|error| Message::from_ontology(&error))?;
        self.follow(&delta);
        Ok(delta)
    }

    fn called_so(&self, name: &str) -> Option<&str> {
        let is_so = |(_, own): &(&String, &String)| own.eq_ignore_ascii_case(name);
        self.called.iter().find(is_so).map(|(iri, _)| iri.as_str())
    }

    /// Returns the local name of a component, given by IRI, local name or object name. `None` if
    /// there is no such component.
    pub fn known_component(&self, name: &str) -> Option<String> {
        self.component_named(&self.component(name))
    }

    fn component_named(&self, name: &str) -> Option<String> {
        let mut components =
            self.runtime.view().components().into_iter().map(|component| component.individual);
        Some(components.find(|component| component.name == name || component.iri == name)?.name)
    }

    /// Resolves an object name to the IRI of its individual. Returns `name` itself if a component
    /// has this IRI or local name, or if no individual has this object name.
    pub(super) fn component(&self, name: &str) -> String {
        let iri = self.called_so(name).filter(|_| self.component_named(name).is_none());
        iri.unwrap_or(name).to_owned()
    }

    /// Marks a component as failed, given by IRI, local name or object name.
    ///
    /// # Errors
    /// There is no such component, or inference exceeds its limits.
    pub fn fail(&mut self, component: &str) -> Result<(), Message> {
        self.report(component, Status::Failed).map(|_| ())
    }

    /// Sets the status of a component, given by IRI, local name or object name. Returns the change
    /// of all facts. The report is asserted even if it causes [`Knowledge::contradictions`].
    ///
    /// # Errors
    /// There is no such component, or inference exceeds its limits.
    pub fn report(&mut self, component: &str, status: Status) -> Result<Delta, Message> {
        let outcome = self.runtime.report_component(&self.component(component), status);
        self.changed(outcome)
    }

    /// Sets the measured value of an attribute, given by the IRI or local name of its type. Returns
    /// the change of all facts.
    ///
    /// # Errors
    /// There is no such attribute, the value is not a number, or inference exceeds its limits.
    pub fn measure(&mut self, attribute: &str, value: &str) -> Result<Delta, Message> {
        let literal = Literal::parse(value, Some("http://www.w3.org/2001/XMLSchema#decimal"), None);
        if literal.as_rational().is_none() {
            return Err(Message::error(
                "M102",
                format!("the value `{value}` of {attribute} is not a decimal number"),
            ));
        }
        let outcome = self.runtime.measure(attribute, literal);
        self.changed(outcome)
    }

    /// Sets the measured value of an attribute to a number. Returns the change of all facts. The
    /// report is asserted even if it causes [`Knowledge::contradictions`].
    ///
    /// # Errors
    /// There is no such attribute, or inference exceeds its limits.
    pub fn observe(&mut self, attribute: &str, value: &BigRational) -> Result<Delta, Message> {
        let literal = Literal::Decimal(rules::Decimal::from_rational(value));
        let outcome = self.runtime.measure(attribute, literal);
        self.changed(outcome)
    }

    /// Replaces the objectives of the robot that are named `o_<function>`, where `<function>` is the name of
    /// their function. `configuration` lists the functions, each with the design that grounds it, by their
    /// object names. Component statuses are unchanged.
    ///
    /// # Errors
    /// There is no such function or design, or inference exceeds its limits.
    pub fn pursue(&mut self, configuration: &[(String, String)]) -> Result<(), Message> {
        self.pursue_now(configuration).map_err(|error| Message::from_ontology(&error))
    }

    pub(super) fn pursue_now(&mut self, configuration: &[(String, String)]) -> Result<(), ontology::Error> {
        let local = |name: &String| {
            self.called_so(name).map_or_else(|| name.clone(), |iri| local_name(iri).to_owned())
        };
        let configuration: Vec<(String, String)> =
            configuration.iter().map(|(function, design)| (local(function), local(design))).collect();
        let name = |function: &str| format!("o_{function}");
        let objectives = self.runtime.objectives();
        for objective in &objectives {
            let function = objective.function.as_ref().map(|function| function.name.as_str());
            let ours = function.is_some_and(|function| objective.individual.name == name(function));
            let is_objective = configuration.iter().any(|(name, _)| Some(name.as_str()) == function);
            if ours && !is_objective {
                let delta = self.runtime.remove_objective(&objective.individual.iri)?;
                self.follow(&delta);
            }
        }
        for (function, design) in &configuration {
            let objective = name(function);
            let existing = objectives.iter().find(|existing| existing.individual.name == objective);
            let grounded = existing.is_some_and(|existing| {
                existing.groundings.iter().any(|g| g.design.as_ref().is_some_and(|d| d.name == *design))
            });
            if existing.is_none() {
                let new = NewObjective {
                    name: &objective,
                    function,
                    requirements: Vec::new(),
                    always_improve: false,
                };
                let delta = self.runtime.add_objective(&new)?;
                self.follow(&delta);
            }
            if !grounded {
                let delta = self.runtime.assign(&objective, design)?;
                self.follow(&delta);
            }
        }
        Ok(())
    }

    /// Returns the differences between the current assertions and the assertions of the documents,
    /// sorted.
    pub fn statements(&self) -> Statements {
        let stated = |runtime: &Runtime| -> BTreeSet<Statement> {
            let engine = runtime.engine();
            engine.stated_facts().iter().map(|fact| Statement::of(engine, fact)).collect()
        };
        let (before, now) = (stated(&self.origin), stated(&self.runtime));
        Statements {
            added: now.difference(&before).cloned().collect(),
            removed: before.difference(&now).cloned().collect(),
        }
    }

    /// Resets the knowledge to the documents and applies the differences. Everything else that was added to the engine
    /// since is discarded, e.g. interned names of former measured values. Pending reports remain.
    ///
    /// # Errors
    /// Inference exceeds its limits; the knowledge is then unchanged.
    pub fn restore(&mut self, statements: &Statements) -> Result<(), Message> {
        let mut runtime = self.origin.clone();
        let mut facts = |statements: &[Statement]| -> Vec<Fact> {
            statements.iter().map(|statement| statement.intern(runtime.engine_mut().symbols_mut())).collect()
        };
        let delta = Delta { insert: facts(&statements.added), delete: facts(&statements.removed) };
        runtime.apply(delta).map_err(|error| Message::from_ontology(&error))?;
        let limits = self.runtime.engine().limits().clone();
        runtime.engine_mut().set_limits(limits);
        self.runtime = runtime;
        self.catalogue = OnceLock::new();
        Ok(())
    }

    /// Restores the differences of another version of this knowledge, see [`Knowledge::restore`]. If a value or status
    /// differs there, it replaces the one that the documents of this version state.
    ///
    /// # Errors
    /// Inference exceeds its limits; the knowledge is then unchanged.
    pub fn restore_over(&mut self, statements: &Statements) -> Result<(), Message> {
        let place =
            |statement: &Statement| Some((statement.predicate.clone(), statement.arguments.first()?.clone()));
        let differing = statements.added.iter().chain(&statements.removed).filter(|change| change.is_state());
        let places: BTreeSet<_> = differing.filter_map(place).collect();
        let engine = self.origin.engine();
        let stated = engine.stated_facts();
        let stated = stated.iter().map(|fact| Statement::of(engine, fact));
        let mut merged = statements.clone();
        merged.removed.extend(stated.filter(|own| place(own).is_some_and(|place| places.contains(&place))));
        self.restore(&merged)
    }

    /// Number of names and values that were interned since the documents were read or revised.
    pub fn growth(&self) -> usize {
        let count = |runtime: &Runtime| runtime.engine().symbols().len();
        count(&self.runtime).saturating_sub(count(&self.origin))
    }

    /// Returns `true` if an attribute type has this local name or IRI.
    pub fn has_attribute(&self, name: &str) -> bool {
        self.attribute(name).is_some()
    }

    fn attribute(&self, name: &str) -> Option<Individual> {
        self.view().attribute_types().into_iter().find(|kind| kind.name == name || kind.iri == name)
    }

    /// Inserts and deletes assertions.
    ///
    /// # Errors
    /// Inference exceeds its limits.
    pub fn apply(&mut self, delta: Delta) -> Result<(), Message> {
        let outcome = self.runtime.apply(delta);
        self.changed(outcome).map(|_| ())
    }

    /// Applies the change of assertions that `change` returns for the present assertions. Returns the change of all facts.
    ///
    /// # Errors
    /// Inference exceeds its limits; the knowledge is then unchanged.
    pub(crate) fn change_assertions(
        &mut self,
        change: impl FnOnce(&[Fact], &mut Engine) -> Delta,
    ) -> Result<Delta, Message> {
        let stated = self.stated();
        let delta = change(&stated, self.runtime.engine_mut());
        if delta == Delta::default() {
            return Ok(delta);
        }
        let outcome = self.runtime.apply(delta);
        self.changed(outcome)
    }

    /// Adds the assertions, axioms and rules of the documents in `asserted` and removes those of
    /// the documents in `retracted`, except declarations. Reports of the robot stay. A statement that
    /// occurs in both lists is kept. Imports of these documents are not followed. Returns the
    /// warnings, which are also added to [`Knowledge::warnings`].
    ///
    /// # Errors
    /// Errors of the documents, a retracted anonymous individual, or exceeded limits of inference. The knowledge is
    /// then unchanged.
    pub fn revise(&mut self, asserted: &[PathBuf], retracted: &[PathBuf]) -> Result<Vec<Message>, Errors> {
        let read = self.documented.change(asserted, retracted, self.runtime.engine_mut());
        let change = read.map_err(|errors| {
            let messages = errors.iter().map(Message::from_ontology).collect();
            Errors::from(quoted(discreet(messages)))
        })?;
        // Snapshots are restored relative to `origin`, so `origin` must be revised as well.
        let (mut runtime, mut origin) = (self.runtime.clone(), self.origin.clone());
        origin.engine_mut().adopt_symbols(self.runtime.engine());
        for runtime in [&mut runtime, &mut origin] {
            runtime
                .revise(change.delta.clone(), change.program.clone())
                .map_err(|errors| errors.iter().map(Message::from_rules).collect::<Vec<_>>())?;
        }
        (self.runtime, self.origin) = (runtime, origin);
        (self.catalogue, self.value_reads) = (OnceLock::new(), OnceLock::new());
        let ontology = change.stated.ontology();
        self.entities = ontology.entities.as_slice().into();
        self.annotations = ontology.annotations.as_slice().into();
        self.documented = Arc::new(change.stated);
        let warnings: Vec<Message> = change.warnings.iter().map(Message::from_ontology_warning).collect();
        self.warnings.extend(warnings.iter().cloned());
        Ok(warnings)
    }

    /// Returns all facts that hold, in the order of symbols. If an individual has more than 32 equal names, only the pairs
    /// with its first name are listed.
    pub fn facts(&self) -> Vec<Fact> {
        let mut facts = self.engine().facts_in_brief(MANY_NAMES);
        facts.sort_unstable();
        facts
    }

    /// Returns the inferred facts in an order that depends only on the sources and on the later
    /// updates. If an individual has more than 32 equal names, only the pairs with its first name are
    /// listed.
    pub fn inferred(&self) -> Vec<Fact> {
        self.engine().inferred_in_brief(MANY_NAMES)
    }

    /// Returns all contradictions; empty if the knowledge is consistent.
    pub fn contradictions(&self) -> Vec<Contradiction> {
        let symbols = self.engine().symbols();
        let violations = self.engine().violations().into_iter();
        violations
            .map(|violation| Contradiction {
                violated: violation.cause.display(symbols).to_string(),
                facts: violation.supports.iter().map(|fact| shown(fact, symbols)).collect(),
            })
            .collect()
    }
}

/// Formats a fact. Membership in an internal group of mutually exclusive individuals is written in
/// words.
fn shown(fact: &Fact, symbols: &Symbols) -> String {
    let name = symbols.value(fact.predicate).as_name().unwrap_or_default();
    match fact.arguments[..] {
        [member, number] if name.starts_with(ontology::INTERNAL) => {
            let number = symbols.value(number).as_literal().map(Literal::lexical).unwrap_or_default();
            format!("{} is member {number} of those that exclude each other", symbols.value(member))
        }
        _ => fact.display(symbols).to_string(),
    }
}
