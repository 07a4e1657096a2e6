//! Typed view of an engine's facts, in the terms of TOMASys: functions, designs, components, attributes,
//! actions.
//!
//! [`View`] reads facts. [`change`] builds updates from reports of the robot. [`check`] reports probable
//! mistakes of a model. All of them use one table of the vocabularies in use. Individuals have an IRI and a
//! local name, lists are sorted by IRI, and numbers are exact.

pub mod change;
mod check;
pub(crate) mod facts;
pub(crate) mod terms;

pub use check::check;

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::rc::Rc;

use num_rational::BigRational;
use rules::{Engine, Fact, Literal, Symbol, Value};

use crate::vocab::{local_name, owl};
use terms::Term;

/// An individual with its IRI and name.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Individual {
    /// The IRI.
    pub iri: String,
    /// Local name, or the name that the view assigns to the IRI.
    pub name: String,
}

/// Maps the IRIs of individuals to names that replace their local names.
pub type CalledNames = BTreeMap<String, String>;

impl Individual {
    pub(crate) fn new(iri: &str) -> Self {
        Self { iri: iri.to_owned(), name: local_name(iri).to_owned() }
    }
}

/// A function design: one way to provide a function.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FunctionDesign {
    /// The design.
    pub individual: Individual,
    /// The functions that the design solves: usually one. There are several if, for example, the knowledge
    /// base states that these functions are the same.
    pub solves: Vec<Individual>,
    /// The components that the design requires.
    pub components: Vec<Individual>,
    /// Maps the name of each estimated attribute type to the estimated value, in the unit of the type. Of several
    /// values, this is the largest.
    pub estimations: BTreeMap<String, BigRational>,
    /// Bounds on measured attributes.
    pub requirements: Vec<Requirement>,
    /// `false` if the knowledge base concludes or states that the design cannot be used now.
    pub available: bool,
    /// Utility or efficacy, if known; larger is better.
    pub utility: Option<BigRational>,
}

/// Bounds on the value of an attribute.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Requirement {
    /// Name of the attribute type (as in `Individual::name`).
    pub attribute: String,
    /// Minimum, inclusive; `None` without a minimum.
    pub minimum: Option<BigRational>,
    /// Maximum, inclusive; `None` without a maximum.
    pub maximum: Option<BigRational>,
}

/// A part of the robot that can fail.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Component {
    /// The component.
    pub individual: Individual,
    /// Status in the spelling of the knowledge base (`FALSE`, `RECOVERED`, `ERROR`, `false`, …), if known.
    pub status: Option<String>,
}

/// A measured value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Measurement {
    /// The individual that holds the value.
    pub individual: Individual,
    /// Name of the attribute type (as in `Individual::name`).
    pub attribute: String,
    /// The value in the unit of the attribute type, if there is one.
    pub value: Option<BigRational>,
}

/// An estimated value of a design.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Estimation {
    /// The individual that holds the value.
    pub individual: Individual,
    /// Name of the attribute type (as in `Individual::name`).
    pub attribute: String,
    /// The value in the unit of the attribute type.
    pub value: BigRational,
}

/// An individual of the class Action: the knowledge base states which functions this kind of action requires.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Action {
    /// The action.
    pub individual: Individual,
    /// The functions that are required while the action runs. Of functions that are stated to be the same, only the
    /// first one.
    pub requires: Vec<Individual>,
    /// Bounds on estimated attributes of the designs that are selected for these functions.
    pub quality: Vec<Quality>,
}

/// Bounds on an estimated attribute of the designs that are selected for an action.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Quality {
    /// The individual with the bounds.
    pub individual: Individual,
    /// The attribute and its bounds.
    pub bounds: Requirement,
    /// Predicate of the planning domain that is true where the bounds apply; `None` if they apply everywhere.
    pub context: Option<String>,
}

/// Maps each subject of a property to its values, or each value to its subjects.
type Edges = Rc<HashMap<Symbol, Vec<Symbol>>>;

/// A view of all facts that hold in an engine.
#[derive(Debug)]
pub struct View<'a> {
    engine: &'a Engine,
    called: Option<&'a CalledNames>,
    /// Cache of property values, by the IRI of the property and the direction (`true` from values to
    /// subjects).
    edges: RefCell<HashMap<(&'static str, bool), Edges>>,
}

impl<'a> View<'a> {
    /// Creates a view of an engine.
    pub fn new(engine: &'a Engine) -> Self {
        Self { engine, called: None, edges: RefCell::default() }
    }

    /// Replaces the local names of individuals by the names that `called` assigns to their IRIs.
    #[must_use]
    pub fn calling(self, called: &'a CalledNames) -> Self {
        Self { called: (!called.is_empty()).then_some(called), ..self }
    }

    /// Returns the individuals of the class with this IRI, including anonymous ones, sorted by IRI.
    pub fn individuals_of(&self, class_iri: &str) -> Vec<Individual> {
        let Some(class) = self.engine.symbols().find_name(class_iri) else { return Vec::new() };
        let members = self.engine.matching(class, &[None]).filter_map(|row| self.individual(row[0]));
        sorted(members)
    }

    /// Returns the individuals of all classes with this local name, in any namespace, including anonymous ones, sorted
    /// by IRI.
    pub fn individuals_of_class_named(&self, class_name: &str) -> Vec<Individual> {
        let is_class = |&(predicate, arity): &(Symbol, usize)| {
            arity == 1 && self.name(predicate).is_some_and(|iri| local_name(iri) == class_name)
        };
        let classes = self.engine.predicates().filter(is_class);
        let members = classes.flat_map(|(class, _)| self.engine.matching(class, &[None]));
        sorted(members.filter_map(|row| self.individual(row[0])))
    }

    /// Returns the values of a property of a subject (both given by IRI): individuals first, then
    /// literals, each sorted.
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

    /// Returns all functions, sorted by IRI.
    pub fn functions(&self) -> Vec<Individual> {
        self.members(terms::FUNCTION)
    }

    /// Returns all quality attribute types, sorted by IRI.
    pub fn attribute_types(&self) -> Vec<Individual> {
        self.members(terms::ATTRIBUTE_TYPE)
    }

    /// Returns the quality attribute types of all values and bounds, sorted by IRI.
    pub fn used_attribute_types(&self) -> Vec<Individual> {
        let edges = terms::IS_TYPE.iter().map(|property| self.edges(property, true));
        let kinds: Vec<Symbol> = edges.flat_map(|edges| edges.keys().copied().collect::<Vec<_>>()).collect();
        sorted(kinds.into_iter().filter_map(|kind| self.individual(kind)))
    }

    /// Returns `true` if two IRIs are equal, or if the facts state that they name one individual.
    pub fn are_same(&self, iri: &str, other: &str) -> bool {
        let symbol = |name: &str| self.engine.symbols().find_name(name);
        let (same_as, names) = (symbol(owl::SAME_AS), symbol(iri).zip(symbol(other)));
        iri == other
            || same_as.zip(names).is_some_and(|(same_as, (first, second))| {
                self.engine.holds(&Fact::new(same_as, [first, second]))
            })
    }

    /// Returns all function designs, sorted by IRI.
    pub fn function_designs(&self) -> Vec<FunctionDesign> {
        self.members(terms::FUNCTION_DESIGN).into_iter().map(|design| self.function_design(design)).collect()
    }

    /// Returns the estimated values of a design, given by IRI, sorted by the individuals that hold them. A value of
    /// attribute types that are stated to be the same is returned for each of them.
    pub fn estimations(&self, design_iri: &str) -> Vec<Estimation> {
        let mut estimations = Vec::new();
        for individual in self.objects(design_iri, terms::HAS_ESTIMATION) {
            let Some(value) = self.number(&individual.iri, terms::HAS_VALUE) else { continue };
            for attribute in self.objects(&individual.iri, terms::IS_TYPE) {
                let (individual, attribute, value) = (individual.clone(), attribute.name, value.clone());
                estimations.push(Estimation { individual, attribute, value });
            }
        }
        estimations
    }

    /// Returns all components with their statuses, sorted by IRI.
    pub fn components(&self) -> Vec<Component> {
        let status = |component: &Individual| {
            let value = self.literals(&component.iri, terms::STATUS).into_iter().next();
            value.map(Literal::lexical)
        };
        let components = self.members(terms::COMPONENT).into_iter();
        components.map(|individual| Component { status: status(&individual), individual }).collect()
    }

    /// Returns all measured values: quality attribute values with `isMeasured` true, and those named `obs_…` as in MROS
    /// that have no `isMeasured` and are no estimations of designs. Omits individuals without an attribute type.
    pub fn measurements(&self) -> Vec<Measurement> {
        let measured = |value: &Individual| {
            let stated = self.literals(&value.iri, terms::IS_MEASURED);
            stated.contains(&&Literal::Boolean(true))
                || stated.is_empty()
                    && value.name.starts_with("obs_")
                    && self.subjects(&value.iri, terms::HAS_ESTIMATION).is_empty()
        };
        // One for each name of the attribute.
        let measurements = |individual: Individual| {
            let value = self.number(&individual.iri, terms::HAS_VALUE);
            let attributes = self.objects(&individual.iri, terms::IS_TYPE).into_iter();
            let measurement = |attribute: Individual| Measurement {
                individual: individual.clone(),
                attribute: attribute.name,
                value: value.clone(),
            };
            attributes.map(measurement).collect::<Vec<_>>()
        };
        self.members(terms::QA_VALUE).into_iter().filter(measured).flat_map(measurements).collect()
    }

    /// Returns all actions with the functions that they require, sorted by IRI.
    pub fn actions(&self) -> Vec<Action> {
        let action = |individual: Individual| {
            let mut requires: Vec<Individual> = Vec::new();
            for function in self.objects(&individual.iri, terms::REQUIRES_F) {
                if !requires.iter().any(|first| self.are_same(&first.iri, &function.iri)) {
                    requires.push(function);
                }
            }
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
        let mut estimations = self.estimations(iri);
        // The map keeps the last value of an attribute. The order of individuals has no meaning, so it must not decide.
        estimations.sort_by(|a, b| a.value.cmp(&b.value));
        let estimations = estimations.into_iter().map(|own| (own.attribute, own.value)).collect();
        let requirements = self.objects(iri, terms::HAS_REQUIREMENT);
        let requirements = requirements.iter().filter_map(|value| self.requirement(value)).collect();
        let denied = |term| self.literals(iri, term).contains(&&Literal::Boolean(false));
        let mut components = self.objects(iri, terms::REQUIRES_C);
        // MROS states the relation from the component to the design.
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

    /// Returns the map from subjects to values of a property, or from values to subjects if `inverse`.
    /// Queries the engine only once per property and direction.
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
