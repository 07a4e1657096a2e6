//! What an engine has concluded, in the nouns of TOMASys: functions, designs, components, attributes, actions.
//!
//! [`View`] reads; [`change`] builds the updates that keep an engine's knowledge in step with the robot; [`check`] tells
//! authors what looks like a mistake. All know the vocabularies in real use through one table. Individuals are given by IRI and by local name, lists are sorted
//! by IRI, numbers are exact.

pub mod change;
mod check;
pub(crate) mod facts;
pub(crate) mod terms;

pub use check::check;

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::rc::Rc;

use num_rational::BigRational;
use rules::{Engine, Literal, Symbol, Value};

use crate::vocab::local_name;
use terms::Term;

/// An individual: its IRI, and the last part of it, or what it is called here.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Individual {
    /// The IRI.
    pub iri: String,
    /// Its local name; the name that a view was told to call it by, if there is one.
    pub name: String,
}

/// What individuals are called in place of their local names, by IRI.
pub type CalledNames = BTreeMap<String, String>;

impl Individual {
    pub(crate) fn new(iri: &str) -> Self {
        Self { iri: iri.to_owned(), name: local_name(iri).to_owned() }
    }
}

/// A way to solve a function.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FunctionDesign {
    /// Which design.
    pub individual: Individual,
    /// The functions that it solves: one, unless the knowledge base says that several are the same.
    pub solves: Vec<Individual>,
    /// The components that it requires.
    pub components: Vec<Individual>,
    /// Estimated values by the local name of their attribute type, in the type's unit.
    pub estimations: BTreeMap<String, BigRational>,
    /// Bounds on measured attributes.
    pub requirements: Vec<Requirement>,
    /// False where the knowledge base concludes or states that the design cannot be used now.
    pub available: bool,
    /// Its utility or efficacy, where there is one; larger is better.
    pub utility: Option<BigRational>,
}

/// Bounds that a measured attribute must keep.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Requirement {
    /// Local name of the attribute type.
    pub attribute: String,
    /// The least allowed value.
    pub minimum: Option<BigRational>,
    /// The greatest allowed value.
    pub maximum: Option<BigRational>,
}

/// A part of the robot that can fail.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Component {
    /// Which component.
    pub individual: Individual,
    /// Its status, as the knowledge base writes it (`FALSE`, `RECOVERED`, `ERROR`, `false`, …), if known.
    pub status: Option<String>,
}

/// A value that sensors report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Measurement {
    /// The individual that holds the value.
    pub individual: Individual,
    /// Local name of the attribute type.
    pub attribute: String,
    /// The value, if there is one yet, in the type's unit.
    pub value: Option<BigRational>,
}

/// An action of the task plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Action {
    /// Which action.
    pub individual: Individual,
    /// The functions that must be solved while it runs.
    pub requires: Vec<Individual>,
    /// Bounds that the designs must keep which are chosen for these functions.
    pub quality: Vec<Quality>,
}

/// Bounds on an estimated attribute of the designs that are chosen for an action.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Quality {
    /// The individual that states the bounds.
    pub individual: Individual,
    /// The attribute and its bounds.
    pub bounds: Requirement,
    /// The predicate of the planning domain that says where the bounds count; everywhere if there is none.
    pub context: Option<String>,
}

/// Values by subject.
type Edges = Rc<HashMap<Symbol, Vec<Symbol>>>;

/// A view on everything that holds in an engine.
#[derive(Debug)]
pub struct View<'a> {
    engine: &'a Engine,
    /// What individuals are called in place of their local names.
    called: Option<&'a CalledNames>,
    /// Properties that have been read, by name and direction.
    edges: RefCell<HashMap<(&'static str, bool), Edges>>,
}

impl<'a> View<'a> {
    /// Looks at an engine.
    pub fn new(engine: &'a Engine) -> Self {
        Self { engine, called: None, edges: RefCell::default() }
    }

    /// The same view, in which individuals have other names.
    #[must_use]
    pub fn calling(self, called: &'a CalledNames) -> Self {
        Self { called: (!called.is_empty()).then_some(called), ..self }
    }

    /// The named individuals of a class, by its IRI.
    pub fn individuals_of(&self, class_iri: &str) -> Vec<Individual> {
        let Some(class) = self.engine.symbols().find_name(class_iri) else { return Vec::new() };
        let members = self.engine.matching(class, &[None]).filter_map(|row| self.individual(row[0]));
        sorted(members)
    }

    /// The named individuals of all classes with that local name, in whatever vocabulary.
    pub fn individuals_of_class_named(&self, class_name: &str) -> Vec<Individual> {
        let is_class = |&(predicate, arity): &(Symbol, usize)| {
            arity == 1 && self.name(predicate).is_some_and(|iri| local_name(iri) == class_name)
        };
        let classes = self.engine.predicates().filter(is_class);
        let members = classes.flat_map(|(class, _)| self.engine.matching(class, &[None]));
        sorted(members.filter_map(|row| self.individual(row[0])))
    }

    /// The values of a property of an individual, both by IRI: individuals first, then literals, each sorted.
    pub fn values(&self, subject_iri: &str, property_iri: &str) -> Vec<Value> {
        let symbols = self.engine.symbols();
        let (Some(subject), Some(property)) =
            (symbols.find_name(subject_iri), symbols.find_name(property_iri))
        else {
            return Vec::new();
        };
        let pattern = [Some(subject), None];
        let mut values: Vec<Value> =
            self.engine.matching(property, &pattern).map(|row| symbols.value(row[1]).clone()).collect();
        values.sort_by_cached_key(|value| (value.as_literal().is_some(), value.to_string()));
        values
    }

    /// All functions.
    pub fn functions(&self) -> Vec<Individual> {
        self.members(terms::FUNCTION)
    }

    /// All quality attribute types.
    pub fn attribute_types(&self) -> Vec<Individual> {
        self.members(terms::ATTRIBUTE_TYPE)
    }

    /// All function designs, with what is known of them.
    pub fn function_designs(&self) -> Vec<FunctionDesign> {
        self.members(terms::FUNCTION_DESIGN).into_iter().map(|design| self.function_design(design)).collect()
    }

    /// All components with their status.
    pub fn components(&self) -> Vec<Component> {
        let status = |component: &Individual| {
            let value = self.literals(&component.iri, terms::STATUS).into_iter().next();
            value.map(Literal::lexical)
        };
        let components = self.members(terms::COMPONENT).into_iter();
        components.map(|individual| Component { status: status(&individual), individual }).collect()
    }

    /// All measured values: those that say so, and those named `obs_…` as MROS names them.
    pub fn measurements(&self) -> Vec<Measurement> {
        let measured = |value: &Individual| {
            value.name.starts_with("obs_")
                || self.literals(&value.iri, terms::IS_MEASURED).contains(&&Literal::Boolean(true))
        };
        let measurement = |individual: Individual| {
            let attribute = self.objects(&individual.iri, terms::IS_TYPE).into_iter().next()?.name;
            let value = self.number(&individual.iri, terms::HAS_VALUE);
            Some(Measurement { individual, attribute, value })
        };
        self.members(terms::QA_VALUE).into_iter().filter(measured).filter_map(measurement).collect()
    }

    /// All actions with the functions that they require.
    pub fn actions(&self) -> Vec<Action> {
        let action = |individual: Individual| {
            let requires = self.objects(&individual.iri, terms::REQUIRES_F);
            let quality = self.objects(&individual.iri, terms::REQUIRES_QUALITY).into_iter();
            let quality = quality.filter_map(|individual| {
                let context = self.literals(&individual.iri, terms::IN_CONTEXT).into_iter().next();
                let bounds = self.requirement(&individual)?;
                Some(Quality { bounds, context: context.map(Literal::lexical), individual })
            });
            Action { requires, quality: quality.collect(), individual }
        };
        self.members(terms::ACTION).into_iter().map(action).collect()
    }

    fn requirement(&self, individual: &Individual) -> Option<Requirement> {
        let attribute = self.objects(&individual.iri, terms::IS_TYPE).into_iter().next()?.name;
        let minimum = self.number(&individual.iri, terms::HAS_MINIMUM);
        let maximum = self.number(&individual.iri, terms::HAS_MAXIMUM);
        Some(Requirement { attribute, minimum, maximum })
    }

    fn function_design(&self, individual: Individual) -> FunctionDesign {
        let iri = individual.iri.as_str();
        let attribute = |value: &Individual| self.objects(&value.iri, terms::IS_TYPE).into_iter().next();
        let estimation =
            |value: &Individual| Some((attribute(value)?.name, self.number(&value.iri, terms::HAS_VALUE)?));
        let estimations = self.objects(iri, terms::HAS_ESTIMATION).iter().filter_map(estimation).collect();
        let requirements = self.objects(iri, terms::HAS_REQUIREMENT);
        let requirements = requirements.iter().filter_map(|value| self.requirement(value)).collect();
        let denied = |term| self.literals(iri, term).contains(&&Literal::Boolean(false));
        let mut components = self.objects(iri, terms::REQUIRES_C);
        components.extend(self.subjects(iri, terms::REQUIRED_BY));
        FunctionDesign {
            solves: self.objects(iri, terms::SOLVES_F),
            components: sorted(components),
            estimations,
            requirements,
            available: !denied(terms::REALISABILITY) && !denied(terms::AVAILABLE),
            utility: self.number(iri, terms::UTILITY),
            individual,
        }
    }

    fn name(&self, symbol: Symbol) -> Option<&'a str> {
        self.engine.symbols().value(symbol).as_name()
    }

    fn individual(&self, symbol: Symbol) -> Option<Individual> {
        let mut individual = Individual::new(self.name(symbol)?);
        if let Some(name) = self.called.and_then(|called| called.get(&individual.iri)) {
            individual.name.clone_from(name);
        }
        Some(individual)
    }

    fn members(&self, term: Term) -> Vec<Individual> {
        sorted(term.iter().flat_map(|class| self.individuals_of(class)))
    }

    /// The values of a property, or its subjects by value, read from the engine once.
    fn edges(&self, property: &'static str, inverse: bool) -> Edges {
        if let Some(edges) = self.edges.borrow().get(&(property, inverse)) {
            return edges.clone();
        }
        let mut edges: HashMap<Symbol, Vec<Symbol>> = HashMap::new();
        if let Some(symbol) = self.engine.symbols().find_name(property) {
            for row in self.engine.matching(symbol, &[None, None]) {
                let (from, to) = if inverse { (row[1], row[0]) } else { (row[0], row[1]) };
                edges.entry(from).or_default().push(to);
            }
        }
        let edges = Rc::new(edges);
        self.edges.borrow_mut().insert((property, inverse), edges.clone());
        edges
    }

    fn related(&self, iri: &str, term: Term, inverse: bool) -> Vec<Symbol> {
        let Some(subject) = self.engine.symbols().find_name(iri) else { return Vec::new() };
        let edges = term.iter().map(|property| self.edges(property, inverse));
        edges.flat_map(|edges| edges.get(&subject).cloned().unwrap_or_default()).collect()
    }

    fn objects(&self, iri: &str, term: Term) -> Vec<Individual> {
        sorted(self.related(iri, term, false).into_iter().filter_map(|symbol| self.individual(symbol)))
    }

    fn subjects(&self, iri: &str, term: Term) -> Vec<Individual> {
        sorted(self.related(iri, term, true).into_iter().filter_map(|symbol| self.individual(symbol)))
    }

    /// Literal values, sorted by their text.
    fn literals(&self, iri: &str, term: Term) -> Vec<&'a Literal> {
        let symbols = self.engine.symbols();
        let values = self.related(iri, term, false).into_iter();
        let mut literals: Vec<_> = values.filter_map(|symbol| symbols.value(symbol).as_literal()).collect();
        literals.sort_by_cached_key(ToString::to_string);
        literals.dedup();
        literals
    }

    fn number(&self, iri: &str, term: Term) -> Option<BigRational> {
        self.literals(iri, term).into_iter().find_map(Literal::as_rational)
    }
}

fn sorted(individuals: impl IntoIterator<Item = Individual>) -> Vec<Individual> {
    individuals.into_iter().collect::<BTreeSet<_>>().into_iter().collect()
}
