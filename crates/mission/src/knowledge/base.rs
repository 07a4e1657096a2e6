//! A knowledge base at run time: OWL documents and rule files in an engine, kept in step with the robot.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use num_rational::BigRational;
use ontology::runtime::{Mode, NewObjective, Runtime};
use ontology::tomasys::change::Status;
use ontology::tomasys::{CalledNames, View};
use ontology::vocab::local_name;
use ontology::{Annotation, EntityKind, Equality, Iri};
use rules::{Delta, Engine, Fact, Literal, Program, Symbols};
use tracing::info_span;

use crate::file::{discreet, quoted};
use crate::knowledge::catalogue::Catalogue;
use crate::knowledge::sources::{Sources, Stated};
use crate::knowledge::statement::{Statement, Statements};
use crate::knowledge::waiting::Waiting;
use crate::message::{Errors, Message};
use crate::planta::Terms;

/// From so many names of one individual on, not all of their pairs are listed.
const MANY_NAMES: usize = 32;

/// Knowledge about a robot: what is stated, and what follows.
#[derive(Debug, Clone)]
pub struct Knowledge {
    pub(super) runtime: Runtime,
    /// What was last read of `runtime`, in step with it.
    pub(super) catalogue: OnceLock<Arc<Catalogue>>,
    /// What was told and nothing follows from yet.
    pub(super) waiting: Waiting,
    /// As it was read; shares with `runtime` what has not changed since.
    origin: Runtime,
    rule_count: usize,
    warnings: Vec<Message>,
    pub(super) sources: Sources,
    /// What individuals are called in place of their local names.
    pub(super) called: Arc<CalledNames>,
    entities: Arc<[(EntityKind, Iri)]>,
    /// The names of all documents, those that are imported among them.
    documents: Arc<[String]>,
    annotations: Arc<[(Iri, Annotation)]>,
    /// What the documents add to a domain in PLANTA's form, if they were read for one.
    terms: Option<Arc<Terms>>,
    /// What the documents and rule files state.
    documented: Arc<ontology::Stated>,
    /// What is stated, if what holds is not told apart from it by the engine.
    stated: Option<Arc<[Fact]>>,
}

/// Something that the knowledge contradicts.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Contradiction {
    /// The axiom or rule that is violated.
    pub violated: String,
    /// The facts that violate it together.
    pub facts: Vec<String>,
}

impl Knowledge {
    /// Reads documents and rules.
    ///
    /// # Errors
    /// All that is wrong with them.
    pub fn read(sources: &Sources) -> Result<Self, Errors> {
        Self::read_as(sources, Equality::Owl)
    }

    /// As [`Knowledge::read`], where two names may stand for one individual, as in OWL, or never.
    ///
    /// # Errors
    /// All that is wrong with the sources.
    pub fn read_as(sources: &Sources, equality: Equality) -> Result<Self, Errors> {
        Self::of_stated(sources, Stated::read(sources, equality)?)
    }

    /// As [`Knowledge::read`], for a domain: if it is in PLANTA's form, what the documents add to it is kept, and every name is
    /// an individual of its own.
    ///
    /// # Errors
    /// All that is wrong with the sources.
    pub fn read_for(sources: &Sources, domain: &str) -> Result<Self, Errors> {
        Self::of_stated(sources, Stated::read_for(sources, domain)?)
    }

    fn of_stated(sources: &Sources, stated: Stated) -> Result<Self, Errors> {
        let Stated { symbols, program, facts, ontology, rules, equality, rule_count, mut warnings, terms } =
            stated;
        let _span = info_span!("knowledge").entered();
        let engine = Engine::with_limits(symbols, program, facts, sources.limits.clone())
            .map_err(|errors| errors.iter().map(Message::from_rules).collect::<Vec<_>>())?;
        let mistakes = ontology::tomasys::check(&ontology, &engine);
        let mistakes = mistakes.iter().map(Message::from_ontology_warning);
        // With names that are all different, two values of a functional property are not taken for one.
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

    /// Knowledge of what holds, with no rules to conclude anything: what a proof says that follows is stated.
    ///
    /// # Errors
    /// The facts refer to other symbols.
    pub fn closed(symbols: Symbols, facts: Vec<Fact>, equality: bool) -> Result<Self, Errors> {
        let program = Program { rules: Vec::new(), equality };
        let engine = Engine::new(symbols, program, facts)
            .map_err(|errors| errors.iter().map(Message::from_rules).collect::<Vec<_>>())?;
        let runtime = Runtime::new(engine, Mode::Retract);
        let (sources, entities) = (Sources::default(), Arc::default());
        Ok(Self::of(runtime, 0, Vec::new(), sources, entities))
    }

    /// As [`Knowledge::closed`], of what was read for a domain in PLANTA's form: with what the documents add to it, and what of
    /// all that holds is stated.
    #[must_use]
    pub fn with_terms(self, terms: Option<Arc<Terms>>, stated: &[Fact]) -> Self {
        Self { terms, stated: Some(stated.into()), ..self }
    }

    /// What the documents add to a domain in PLANTA's form, if they were read for one.
    pub(crate) fn terms(&self) -> Option<&Arc<Terms>> {
        self.terms.as_ref()
    }

    /// What is stated now.
    pub(crate) fn stated(&self) -> Vec<Fact> {
        let engine = self.engine();
        match &self.stated {
            Some(stated) => stated.to_vec(),
            None => engine.facts().filter(|fact| engine.is_asserted(fact)).collect(),
        }
    }

    fn of(
        runtime: Runtime,
        rule_count: usize,
        warnings: Vec<Message>,
        sources: Sources,
        entities: Arc<[(EntityKind, Iri)]>,
    ) -> Self {
        let (catalogue, waiting, origin) = (OnceLock::new(), Waiting::default(), runtime.clone());
        let (documents, annotations) = (Arc::default(), Arc::default());
        Self {
            runtime,
            catalogue,
            waiting,
            origin,
            rule_count,
            warnings,
            sources,
            called: Arc::default(),
            entities,
            documents,
            annotations,
            terms: None,
            documented: Arc::default(),
            stated: None,
        }
    }

    /// What is questionable about the documents.
    pub fn warnings(&self) -> &[Message] {
        &self.warnings
    }

    /// The classes, properties and individuals that the documents name.
    pub fn entities(&self) -> &[(EntityKind, Iri)] {
        &self.entities
    }

    /// What the documents say in annotations of entities.
    pub fn annotations(&self) -> &[(Iri, Annotation)] {
        &self.annotations
    }

    /// What it was read from.
    pub fn sources(&self) -> &Sources {
        &self.sources
    }

    /// The names of the documents that were read: paths of files, imported ones among them.
    pub fn documents(&self) -> &[String] {
        &self.documents
    }

    /// How many rules there are: those of each document, and those of rule files; axioms do not count.
    pub fn rule_count(&self) -> usize {
        self.rule_count
    }

    /// The typed view on what holds now.
    pub fn view(&self) -> View<'_> {
        self.runtime.view().calling(&self.called)
    }

    /// Calls individuals, by IRI, otherwise than by their local names from now on.
    pub(crate) fn call(&mut self, called: CalledNames) {
        self.called = Arc::new(called);
        self.catalogue = OnceLock::new();
    }

    /// The engine, to ask for facts and derivations.
    pub fn engine(&self) -> &Engine {
        self.runtime.engine()
    }

    /// What the robot reports, as updates of the engine.
    pub fn runtime(&self) -> &Runtime {
        &self.runtime
    }

    /// As [`Knowledge::runtime`], to change it.
    pub fn runtime_mut(&mut self) -> &mut Runtime {
        self.catalogue = OnceLock::new();
        &mut self.runtime
    }

    /// What planning asks for again and again.
    pub fn catalogue(&self) -> &Catalogue {
        self.catalogue.get_or_init(|| Arc::new(Catalogue::new(&self.view())))
    }

    /// Keeps the catalogue in step with what holds.
    pub(super) fn follow(&mut self, delta: &Delta) {
        let engine = self.runtime.engine();
        if self.catalogue.get_mut().is_some_and(|own| !Arc::make_mut(own).follow(delta, engine)) {
            self.catalogue = OnceLock::new();
        }
    }

    /// The outcome of a change.
    fn changed(&mut self, outcome: Result<Delta, ontology::Error>) -> Result<Delta, Message> {
        let delta = outcome.map_err(|error| Message::from_ontology(&error))?;
        self.follow(&delta);
        Ok(delta)
    }

    /// The individual that is called so, by IRI.
    fn called_so(&self, name: &str) -> Option<&str> {
        let is_so = |(_, own): &(&String, &String)| own.eq_ignore_ascii_case(name);
        self.called.iter().find(is_so).map(|(iri, _)| iri.as_str())
    }

    /// The local name of a component that is named by IRI or local name, or as the problem calls it, if there is one.
    pub fn known_component(&self, name: &str) -> Option<String> {
        let name = self.component(name);
        let components = self.runtime.view().components().into_iter().map(|own| own.individual);
        components.into_iter().find(|own| own.name == name || own.iri == name).map(|own| own.name)
    }

    /// A component as the knowledge base names it: what it has no component of that name for may be the name of an object.
    pub(super) fn component(&self, name: &str) -> String {
        let iri = self.called_so(name).filter(|_| {
            let own = self.runtime.view().components();
            !own.iter().any(|own| own.individual.name == name || own.individual.iri == name)
        });
        iri.unwrap_or(name).to_owned()
    }

    /// Marks a component, named by IRI or local name, or as the problem calls it, as failed.
    ///
    /// # Errors
    /// There is no such component.
    pub fn fail(&mut self, component: &str) -> Result<(), Message> {
        self.report(component, Status::Failed).map(|_| ())
    }

    /// A component, named by IRI or local name, or as the problem calls it, has a status from now on; returns what holds since, and what no more. What
    /// was reported holds whatever follows from it: see [`Knowledge::contradictions`].
    ///
    /// # Errors
    /// There is no such component, or a rule runs away.
    pub fn report(&mut self, component: &str, status: Status) -> Result<Delta, Message> {
        let outcome = self.runtime.report_component(&self.component(component), status);
        self.changed(outcome)
    }

    /// Sets the measured value of an attribute, named by the IRI or local name of its type; returns what holds since,
    /// and what no more.
    ///
    /// # Errors
    /// There is no such attribute, or the value is not a number.
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

    /// An attribute has a measured value from now on; returns what holds since, and what no more. What was measured holds
    /// whatever follows from it: see [`Knowledge::contradictions`].
    ///
    /// # Errors
    /// There is no such attribute, or a rule runs away.
    pub fn observe(&mut self, attribute: &str, value: &BigRational) -> Result<Delta, Message> {
        let literal = Literal::Decimal(rules::Decimal::from_rational(value));
        let outcome = self.runtime.measure(attribute, literal);
        self.changed(outcome)
    }

    /// Makes functions, and no others, the objectives of the robot, each grounded with a design; both as the problem calls them.
    /// Objectives of a function are named `o_<function>`. What components have reported stays as it is.
    ///
    /// # Errors
    /// There is no such function or design.
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
            let wanted = configuration.iter().any(|(wanted, _)| Some(wanted.as_str()) == function);
            if ours && !wanted {
                let delta = self.runtime.remove_objective(&objective.individual.iri)?;
                self.follow(&delta);
            }
        }
        for (function, design) in &configuration {
            let objective = name(function);
            let known = objectives.iter().find(|known| known.individual.name == objective);
            let grounded = known.is_some_and(|known| {
                known.groundings.iter().any(|g| g.design.as_ref().is_some_and(|d| d.name == *design))
            });
            if known.is_none() {
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

    /// What is stated now and was not when the documents were read, and what is stated no more; sorted.
    pub fn statements(&self) -> Statements {
        let stated = |runtime: &Runtime| -> BTreeSet<Statement> {
            let engine = runtime.engine();
            let facts = engine.facts().filter(|fact| engine.is_asserted(fact));
            facts.map(|fact| Statement::of(engine, &fact)).collect()
        };
        let (before, now) = (stated(&self.origin), stated(&self.runtime));
        Statements {
            added: now.difference(&before).cloned().collect(),
            removed: before.difference(&now).cloned().collect(),
        }
    }

    /// Knowledge as it was read, changed by these statements. All that the history since has left behind is forgotten,
    /// such as names of values that were measured once.
    ///
    /// # Errors
    /// A rule runs away; nothing has changed then.
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

    /// How many names and values have been interned since the documents were read.
    pub fn growth(&self) -> usize {
        let count = |runtime: &Runtime| runtime.engine().symbols().len();
        count(&self.runtime).saturating_sub(count(&self.origin))
    }

    /// Whether some attribute type has this local name or IRI.
    pub fn has_attribute(&self, name: &str) -> bool {
        self.view().attribute_types().iter().any(|attribute| attribute.name == name || attribute.iri == name)
    }

    /// Inserts and deletes stated facts.
    ///
    /// # Errors
    /// A rule runs away.
    pub fn apply(&mut self, delta: Delta) -> Result<(), Message> {
        let outcome = self.runtime.apply(delta);
        self.changed(outcome).map(|_| ())
    }

    /// States what the first documents say, and no more what the second ones say: assertions, axioms and rules. Afterwards
    /// everything holds that holds if the one remaining document is read. What both say is stated. Imports of these
    /// documents are not followed. Returns what is questionable about them, which [`Knowledge::warnings`] has from now on, too.
    ///
    /// # Errors
    /// All that is wrong with the documents; one retracts what has no name; a rule runs away. Nothing has changed then.
    pub fn revise(&mut self, asserted: &[PathBuf], retracted: &[PathBuf]) -> Result<Vec<Message>, Errors> {
        let read = self.documented.change(asserted, retracted, self.runtime.engine_mut());
        let change = read.map_err(|errors| {
            let messages = errors.iter().map(Message::from_ontology).collect();
            Errors::from(quoted(discreet(messages)))
        })?;
        // Restored snapshots start from what the documents say, so that these documents become part of it.
        let (mut runtime, mut origin) = (self.runtime.clone(), self.origin.clone());
        origin.engine_mut().adopt_symbols(self.runtime.engine());
        for runtime in [&mut runtime, &mut origin] {
            runtime
                .revise(change.delta.clone(), change.program.clone())
                .map_err(|errors| errors.iter().map(Message::from_rules).collect::<Vec<_>>())?;
        }
        (self.runtime, self.origin, self.catalogue) = (runtime, origin, OnceLock::new());
        let ontology = change.stated.ontology();
        self.entities = ontology.entities.as_slice().into();
        self.annotations = ontology.annotations.as_slice().into();
        self.documented = Arc::new(change.stated);
        let warnings: Vec<Message> = change.warnings.iter().map(Message::from_ontology_warning).collect();
        self.warnings.extend(warnings.iter().cloned());
        Ok(warnings)
    }

    /// What follows and is not stated, in an order that depends on what was read only. That names stand for one individual is said of an
    /// individual of more than 32 names by the pairs with its first name.
    pub fn inferred(&self) -> Vec<Fact> {
        self.engine().inferred_in_brief(MANY_NAMES)
    }

    /// All contradictions; empty if the knowledge is consistent.
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

/// A fact as text; that an individual is a member of a group is in words.
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
