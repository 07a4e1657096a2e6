//! Bindings of PDDL symbols to queries on the knowledge base. Fills a problem with the results of
//! these queries.
//!
//! The defaults fit the names of the Metaplan paper and of the files of kas-lab. A type is bound to
//! a class, a predicate to a relation between designs, functions and actions, and a numeric
//! function to an estimated or measured attribute.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::fmt;

use num_rational::BigRational;

use ontology::tomasys::{Action, FunctionDesign, Individual, View};
use ontology::vocab::local_name;
use pddl::TypeHierarchy;
use pddl::ast::{
    Atom, Declaration, Domain, Identifier, InitialElement, Name, Problem, Span, Term, TypeExpression,
    TypedName,
};

use crate::called::{Names, Place};
use crate::knowledge::{Catalogue, Knowledge};
use crate::message::Message;
use crate::visible::visible;

/// Predicates `(p DESIGN FUNCTION)` that are bound to `solves` by default. Explicit bindings add
/// further predicates.
const SOLVES: [&str; 4] = ["fd_solve_f", "fd_solves_f", "inferred-SolvesF", "solvesF"];

/// The knowledge-base query that a PDDL symbol is bound to.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Query {
    /// Type: the individuals of a class, given by local name or IRI.
    Class(String),
    /// Predicate `(p DESIGN FUNCTION)`: pairs of a design and a function that the design solves.
    Solves,
    /// Predicate `(p DESIGN)`: the available designs.
    Available,
    /// Predicate `(p ACTION FUNCTION…)`: the functions that each action requires. With a name, only
    /// the action of this name.
    Requires(Option<String>),
    /// Numeric function of a design: the estimated value of an attribute.
    Estimation(String),
    /// Numeric function without parameters: the measured value of an attribute.
    Measured(String),
    /// Numeric function without parameters in a plain domain (without a type of designs): the sum
    /// of an attribute over the designs that are chosen for an action.
    Chosen(String),
    /// Numeric function without parameters in a plain domain (without a type of designs): the sum of an attribute
    /// over the newly chosen designs of an action, i.e. the designs that replace another design of their function.
    Reconfigured(String),
    /// Action schema of a plain domain (without a type of designs): the corresponding action of the
    /// knowledge base.
    Action(String),
}

/// Bindings of PDDL symbols to queries on the knowledge base, and object names of individuals.
#[derive(Clone, Default)]
pub struct Bindings {
    own: BTreeMap<Name, Query>,
    written: BTreeMap<String, String>,
    names: Names,
    places: BTreeMap<String, Place>,
}

/// Omits the places, so that the text does not depend on where the bindings are written.
impl fmt::Debug for Bindings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { own, written, names, places: _ } = self;
        let mut fields = f.debug_struct("Bindings");
        fields.field("own", own).field("written", written).field("names", names).finish()
    }
}

impl Bindings {
    /// Returns the default bindings, overridden by the explicit bindings `own`. `own` maps PDDL symbols to queries,
    /// e.g. `speed` to `measured:speed`.
    ///
    /// ```
    /// use std::collections::BTreeMap;
    /// use metaplan_mission::Bindings;
    ///
    /// assert!(Bindings::with(&BTreeMap::from([("speed".to_owned(), "no such query".to_owned())])).is_err());
    /// ```
    ///
    /// # Errors
    /// Describes the first value in `own` that is not a query.
    pub fn with(own: &BTreeMap<String, String>) -> Result<Self, String> {
        let parse =
            |(symbol, query): (&String, &String)| Ok((Name::new(symbol), parse_query(symbol, query)?));
        let (parsed, written) = (own.iter().map(parse).collect::<Result<_, String>>()?, own.clone());
        Ok(Self { own: parsed, written, ..Self::default() })
    }

    /// Returns these bindings with the places of the explicit bindings, by PDDL symbol.
    #[must_use]
    pub fn placed(self, places: BTreeMap<String, Place>) -> Self {
        Self { places, ..self }
    }

    /// Returns an error for each explicit binding whose query does not fit the declarations of its symbol. The default
    /// binding of the symbol would be lost.
    pub(super) fn misfits(&self, domain: &Domain) -> Vec<Message> {
        let is_plain = !domain.types.iter().any(|declared| self.is_design(&declared.identifier.name));
        let misfit = |(symbol, query): (&String, &String)| {
            let name = Name::new(symbol);
            let kinds = kinds(domain, &name);
            let parsed = self.own.get(&name)?;
            if kinds.is_empty() || kinds.iter().any(|kind| fits(parsed, *kind, is_plain)) {
                return None;
            }
            let declared: Vec<String> = kinds.iter().map(ToString::to_string).collect();
            let text = format!(
                "`{symbol}` is bound to `{query}`, which is a query for {}, but it is {}; correct or remove the binding",
                wanted(parsed),
                declared.join(" and ")
            );
            Some(match self.places.get(symbol) {
                Some((file, place)) => Message::at("M235", file, *place, text),
                None => Message::error("M235", text),
            })
        };
        self.written.iter().filter_map(misfit).collect()
    }

    /// Returns these bindings with the given object names of individuals.
    #[must_use]
    pub fn naming(self, names: Names) -> Self {
        Self { names, ..self }
    }

    /// Returns the object names of individuals.
    pub fn names(&self) -> &Names {
        &self.names
    }

    /// Returns the explicit bindings as written: query by PDDL symbol.
    pub fn written(&self) -> &BTreeMap<String, String> {
        &self.written
    }

    /// Returns errors for the entries that a domain in PLANTA's form cannot use, because it is filled by the names of the
    /// ontology: all entries of `[bindings.names]`, and all bindings except to `solves` and `available`.
    pub(super) fn unused_in_planta(&self) -> Vec<Message> {
        let reason = "the domain is in PLANTA's form, which uses the names of the knowledge base";
        let text = format!("{reason}; remove the entry, or rename the individual or the object");
        let names = self.names.entries().iter().map(|entry| entry.wrong("M236", &text));
        let is_used = |query: &Query| matches!(query, Query::Solves | Query::Available);
        let bound = self.own.iter().filter(|(_, query)| !is_used(query)).map(|(symbol, _)| {
            Message::error("M236", format!("`{symbol}` is bound, but {reason}; remove the binding"))
        });
        names.chain(bound).collect()
    }

    /// Returns the predicates that state which design solves which function: explicitly bound ones and the
    /// default names, declared or not.
    pub fn solves(&self) -> Vec<Name> {
        let bound =
            self.own.iter().filter(|(_, query)| **query == Query::Solves).map(|(name, _)| name.clone());
        bound.chain(SOLVES.map(Name::new)).collect()
    }

    pub(super) fn class(&self, name: &Name) -> Option<String> {
        match self.r#type(name) {
            Some(Query::Class(class)) => Some(class),
            _ => None,
        }
    }

    pub(super) fn is_requirement(&self, predicate: &Name) -> bool {
        matches!(self.predicate(predicate), Some(Query::Requires(_)))
    }

    pub(super) fn is_design(&self, name: &Name) -> bool {
        self.class(name).is_some_and(|class| local_name(&class) == "FunctionDesign")
    }

    /// Returns `true` if the action schema `name` of a plain domain (without a type of designs) corresponds
    /// to the action `known` of the knowledge base. Without an explicit binding, the names must agree, except
    /// that the action may have the prefix `a_`.
    pub(super) fn is_action(&self, name: &Name, known: &Individual) -> bool {
        both(known).iter().any(|local| match self.own.get(name) {
            Some(Query::Action(own)) => own == local || *own == known.iri,
            _ => Name::new(local) == *name || Name::new(local) == Name::new(&format!("a_{name}")),
        })
    }

    /// Returns `true` if a predicate states the required functions of the action `known` of the
    /// knowledge base.
    pub(super) fn says_needs(&self, predicate: &Name, known: &Individual) -> bool {
        match self.predicate(predicate) {
            Some(Query::Requires(None)) => true,
            Some(Query::Requires(Some(action))) => both(known).iter().any(|known| {
                [Name::new(known), Name::new(known.strip_prefix("a_").unwrap_or(known))]
                    .contains(&Name::new(&action))
            }),
            _ => false,
        }
    }

    pub(super) fn chosen(&self, name: &Name) -> Option<String> {
        match self.own.get(name) {
            Some(Query::Chosen(attribute)) => Some(attribute.clone()),
            _ => None,
        }
    }

    pub(super) fn reconfigured(&self, name: &Name) -> Option<String> {
        match self.own.get(name) {
            Some(Query::Reconfigured(attribute)) => Some(attribute.clone()),
            _ => None,
        }
    }

    /// Returns `true` if a predicate is bound to the availability of designs.
    pub fn is_availability(&self, predicate: &Name) -> bool {
        self.predicate(predicate) == Some(Query::Available)
    }

    /// Returns `true` if a predicate is bound to a query, explicitly or by default.
    pub(super) fn is_bound_predicate(&self, predicate: &Name) -> bool {
        self.predicate(predicate).is_some()
    }

    pub(super) fn is_measured(&self, declared: &Declaration, attribute: &str) -> bool {
        let query = self.function(declared);
        declared.parameters.is_empty() && matches!(query, Query::Measured(name) if name == attribute)
    }

    fn r#type(&self, name: &Name) -> Option<Query> {
        self.own.get(name).cloned().or_else(|| {
            let class = match name.as_str().to_ascii_lowercase().as_str() {
                "function" => "Function",
                "functiondesign" | "function_design" | "function-design" => "FunctionDesign",
                "action" => "Action",
                "component" => "Component",
                _ => return None,
            };
            Some(Query::Class(class.to_owned()))
        })
    }

    fn predicate(&self, name: &Name) -> Option<Query> {
        self.own.get(name).cloned().or_else(|| {
            let name = name.as_str().to_ascii_lowercase();
            match name.as_str() {
                "fd_available" => Some(Query::Available),
                "a_req_f" => Some(Query::Requires(None)),
                other if self.solves().contains(&Name::new(other)) => Some(Query::Solves),
                other => {
                    other.strip_suffix("_requires_f").map(|action| Query::Requires(Some(action.to_owned())))
                }
            }
        })
    }

    fn function(&self, declared: &Declaration) -> Query {
        let name = &declared.identifier.name;
        self.own.get(name).cloned().unwrap_or_else(|| {
            let name = name.as_str().to_owned();
            if declared.parameters.is_empty() { Query::Measured(name) } else { Query::Estimation(name) }
        })
    }
}

/// A declaration of a symbol.
#[derive(Clone, Copy)]
enum Kind {
    Type,
    /// With the number of parameters.
    Predicate(usize),
    /// With the number of parameters.
    Function(usize),
    Action,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plural = |count: &usize| if *count == 1 { "" } else { "s" };
        match self {
            Self::Type => f.write_str("a type"),
            Self::Predicate(count) => write!(f, "a predicate with {count} parameter{}", plural(count)),
            Self::Function(count) => write!(f, "a numeric function with {count} parameter{}", plural(count)),
            Self::Action => f.write_str("an action"),
        }
    }
}

/// Returns the declarations of a symbol. Names of different kinds may be equal.
fn kinds(domain: &Domain, name: &Name) -> Vec<Kind> {
    let arity = |declared: &[Declaration]| {
        let declared = declared.iter().find(|declared| declared.identifier.name == *name);
        declared.map(|declared| declared.parameters.len())
    };
    let is_type = domain.types.iter().any(|declared| declared.identifier.name == *name);
    let is_action = domain.actions.iter().any(|action| action.identifier.name == *name);
    let kinds = [
        is_type.then_some(Kind::Type),
        arity(&domain.predicates).map(Kind::Predicate),
        arity(&domain.functions).map(Kind::Function),
        is_action.then_some(Kind::Action),
    ];
    kinds.into_iter().flatten().collect()
}

/// Returns `true` if a query can be bound to a symbol of this kind. `is_plain` states whether the domain is plain.
fn fits(query: &Query, kind: Kind, is_plain: bool) -> bool {
    match (query, kind) {
        (Query::Class(_), Kind::Type)
        | (Query::Solves, Kind::Predicate(2))
        | (Query::Available, Kind::Predicate(1))
        | (Query::Estimation(_), Kind::Function(1))
        | (Query::Measured(_), Kind::Function(0))
        | (Query::Action(_), Kind::Action) => true,
        (Query::Requires(_), Kind::Predicate(count)) => count > 0,
        (Query::Chosen(_) | Query::Reconfigured(_), Kind::Function(0)) => is_plain,
        _ => false,
    }
}

fn wanted(query: &Query) -> &'static str {
    match query {
        Query::Class(_) => "a type",
        Query::Solves => "a predicate with 2 parameters, a design and a function",
        Query::Available => "a predicate with 1 parameter, a design",
        Query::Requires(_) => "a predicate with an action and its functions as parameters",
        Query::Estimation(_) => "a numeric function with 1 parameter, a design",
        Query::Measured(_) => "a numeric function with 0 parameters",
        Query::Chosen(_) | Query::Reconfigured(_) => {
            "a numeric function with 0 parameters in a domain without a type of designs"
        }
        Query::Action(_) => "an action",
    }
}

fn both(known: &Individual) -> [&str; 2] {
    [&known.name, local_name(&known.iri)]
}

fn parse_query(symbol: &str, query: &str) -> Result<Query, String> {
    let (kind, name) = query.split_once(':').unwrap_or((query, ""));
    match (kind, name) {
        ("class", name) if !name.is_empty() => Ok(Query::Class(name.to_owned())),
        ("estimation", name) if !name.is_empty() => Ok(Query::Estimation(name.to_owned())),
        ("measured", name) if !name.is_empty() => Ok(Query::Measured(name.to_owned())),
        ("chosen", name) if !name.is_empty() => Ok(Query::Chosen(name.to_owned())),
        ("reconfigured", name) if !name.is_empty() => Ok(Query::Reconfigured(name.to_owned())),
        ("action", name) if !name.is_empty() => Ok(Query::Action(name.to_owned())),
        ("requires", "") => Ok(Query::Requires(None)),
        ("requires", name) => Ok(Query::Requires(Some(name.to_owned()))),
        ("solves", "") => Ok(Query::Solves),
        ("available", "") => Ok(Query::Available),
        _ => Err(format!(
            "`{symbol}` is bound to `{query}`, which is not a query; queries are `class:NAME`, `solves`, `available`, \
             `requires`, `requires:ACTION`, `estimation:ATTRIBUTE`, `measured:ATTRIBUTE`, and in plain domains `action:NAME`, `chosen:ATTRIBUTE` and \
             `reconfigured:ATTRIBUTE`"
        )),
    }
}

/// Adds to a problem the objects, facts and values that the knowledge base has for the symbols of
/// the domain. Returns warnings and errors.
///
/// Availability facts of the problem are removed with a warning, except those about the designs `own`, whose
/// availability the problem decides. Values that the problem states take precedence. Bound symbols that the domain
/// does not declare cause a warning, except those for which `stands` returns `true`: functions that the explicit
/// form of a plain domain (with design parameters) replaces.
pub(super) fn fill(
    domain: &Domain,
    problem: &mut Problem,
    knowledge: &Knowledge,
    bindings: &Bindings,
    own: &BTreeSet<Name>,
    stands: &dyn Fn(&Name) -> bool,
) -> Vec<Message> {
    let catalogue = knowledge.catalogue();
    let is_known = knowledge.fault().is_none();
    let (view, hierarchy) = (knowledge.view(), TypeHierarchy::of(domain));
    let mut fill = Fill { problem, view, known: catalogue, is_known, own, hierarchy, warnings: Vec::new() };
    let types = domain.types.iter().map(|declared| &declared.identifier.name);
    let symbols = domain.predicates.iter().chain(&domain.functions).map(|declared| &declared.identifier.name);
    let actions = domain.actions.iter().map(|action| &action.identifier.name);
    let declared: BTreeSet<&Name> = types.chain(symbols).chain(actions).collect();
    for name in bindings.own.keys().filter(|name| !declared.contains(name) && !stands(name)) {
        let text =
            format!("`{name}` is bound, but the domain declares no such type, predicate, function or action");
        fill.warnings.push(Message::warning("M204", text));
    }
    for declared in &domain.types {
        let name = &declared.identifier.name;
        if let Some(Query::Class(class)) = bindings.r#type(name) {
            fill.objects(domain, name, &class);
        }
    }
    for declared in &domain.predicates {
        match bindings.predicate(&declared.identifier.name) {
            Some(Query::Solves) if declared.parameters.len() == 2 => fill.solves(&declared.identifier.name),
            Some(Query::Available) if declared.parameters.len() == 1 => {
                fill.available(&declared.identifier.name);
            }
            Some(Query::Requires(action)) => fill.requires(declared, action.as_deref()),
            _ => {}
        }
    }
    for declared in &domain.functions {
        fill.values(domain, declared, bindings);
    }
    fill.warnings
}

/// Returns the individuals that [`fill`] may use as objects of a problem.
pub(super) fn individuals(
    domain: &Domain,
    knowledge: &Knowledge,
    bindings: &Bindings,
) -> BTreeSet<Individual> {
    let (view, catalogue) = (knowledge.view(), knowledge.catalogue());
    let mut individuals = BTreeSet::new();
    for declared in &domain.types {
        if let Some(class) = bindings.class(&declared.identifier.name) {
            individuals.extend(catalogue.members(&view, &class).iter().cloned());
        }
    }
    let designs = || catalogue.designs().iter();
    for declared in &domain.predicates {
        match bindings.predicate(&declared.identifier.name) {
            Some(Query::Solves) if declared.parameters.len() == 2 => {
                individuals.extend(designs().map(|design| design.individual.clone()));
                individuals.extend(designs().flat_map(|design| design.solves.iter().cloned()));
            }
            Some(Query::Available) if declared.parameters.len() == 1 => {
                individuals.extend(designs().map(|design| design.individual.clone()));
            }
            Some(Query::Requires(only)) => {
                let actions = catalogue.actions().iter();
                let fits = |action: &&Action| {
                    is_only(action, only.as_deref()) && action.requires.len() + 1 == declared.parameters.len()
                };
                for action in actions.filter(fits) {
                    individuals.insert(action.individual.clone());
                    individuals.extend(action.requires.iter().cloned());
                }
            }
            _ => {}
        }
    }
    for declared in domain.functions.iter().filter(|declared| declared.parameters.len() == 1) {
        if let Query::Estimation(attribute) = bindings.function(declared) {
            let is_estimated = |design: &&FunctionDesign| estimation(design, &attribute).is_some();
            individuals.extend(designs().filter(is_estimated).map(|design| design.individual.clone()));
        }
    }
    individuals.retain(|individual| is_pddl_name(&individual.name));
    individuals
}

/// Returns the names of the attributes whose estimations or measurements are values of the functions of a domain. The
/// problem's value of a function takes precedence over a measurement.
pub(super) fn attributes(domain: &Domain, problem: &Problem, bindings: &Bindings) -> BTreeSet<String> {
    let queries = domain.functions.iter().map(|declared| (declared, bindings.function(declared)));
    let attributes = queries.filter_map(|(declared, query)| match query {
        Query::Estimation(attribute) if declared.parameters.len() == 1 => Some(attribute),
        Query::Measured(attribute)
            if declared.parameters.is_empty() && !has_value(problem, &declared.identifier.name) =>
        {
            Some(attribute)
        }
        _ => None,
    });
    attributes.flat_map(|attribute| [plain(&attribute).to_owned(), attribute]).collect()
}

pub(super) fn has_value(problem: &Problem, function: &Name) -> bool {
    problem.init.iter().any(
        |element| matches!(element, InitialElement::Value(atom, _, _) if atom.predicate.name == *function),
    )
}

/// Returns `true` if the action has the name `only`, or if there is no such name.
pub(super) fn is_only(action: &Action, only: Option<&str>) -> bool {
    only.is_none_or(|only| both(&action.individual).iter().any(|own| only.eq_ignore_ascii_case(own)))
}

/// Returns the estimation of a design for the attribute to which a function is bound, whose name may have the prefix
/// `fd_`.
fn estimation<'d>(design: &'d FunctionDesign, attribute: &str) -> Option<&'d BigRational> {
    design.estimations.get(attribute).or_else(|| design.estimations.get(plain(attribute)))
}

pub(super) fn plain(attribute: &str) -> &str {
    attribute.strip_prefix("fd_").unwrap_or(attribute)
}

struct Fill<'a> {
    problem: &'a mut Problem,
    view: View<'a>,
    known: &'a Catalogue,
    /// `false` if inference has failed, so that the derived facts are unknown and no design counts
    /// as available.
    is_known: bool,
    own: &'a BTreeSet<Name>,
    hierarchy: TypeHierarchy,
    warnings: Vec<Message>,
}

impl Fill<'_> {
    fn objects(&mut self, domain: &Domain, r#type: &Name, class: &str) {
        let members = self.known.members(&self.view, class);
        let present = domain.constants.iter().chain(&self.problem.objects);
        let names: HashSet<&Name> = present.map(|object| &object.identifier.name).collect();
        let (mut added, mut objects) = (HashSet::new(), Vec::new());
        for Individual { iri, name } in &*members {
            let spelled = Name::new(name);
            if !is_pddl_name(name) {
                let text = format!(
                    "<{iri}> is left out: `{name}` is not a PDDL name; give it another one under `[bindings.names]`"
                );
                self.warnings.push(Message::warning("M201", text));
            } else if !names.contains(&spelled) && added.insert(spelled.clone()) {
                let alternatives = vec![identifier(r#type)];
                let r#type = TypeExpression { alternatives };
                objects.push(TypedName { identifier: identifier(&spelled), r#type });
            }
        }
        self.problem.objects.extend(objects);
    }

    fn fact(&mut self, predicate: &Name, arguments: &[&str]) {
        if arguments.iter().all(|argument| is_pddl_name(argument)) {
            self.problem.init.push(InitialElement::Fact(atom(predicate, arguments)));
        }
    }

    fn stated(&self, predicate: &Name) -> HashSet<Vec<Name>> {
        let arguments = |element: &InitialElement| match element {
            InitialElement::Fact(atom) if atom.predicate.name == *predicate => Some(names(&atom.arguments)),
            _ => None,
        };
        self.problem.init.iter().filter_map(arguments).collect()
    }

    fn solves(&mut self, predicate: &Name) {
        let stated = self.stated(predicate);
        for design in self.known.designs() {
            for function in &design.solves {
                let pair = [design.individual.name.as_str(), function.name.as_str()];
                if !stated.contains(&pair.map(Name::new)[..]) {
                    self.fact(predicate, &pair);
                }
            }
        }
    }

    fn available(&mut self, predicate: &Name) {
        let decides = |atom: &Atom| names(&atom.arguments).iter().any(|design| self.own.contains(design));
        let is_overruled = |element: &InitialElement| matches!(element, InitialElement::Fact(a) if a.predicate.name == *predicate && !decides(a));
        if self.problem.init.iter().any(is_overruled) {
            self.problem.init.retain(|element| !is_overruled(element));
            let names: Vec<String> = self.own.iter().map(|design| format!("`{design}`")).collect();
            let but = if names.is_empty() {
                String::new()
            } else {
                format!(", but not on {}, whose functions it does not know", names.join(", "))
            };
            let text =
                format!("the problem's own `{predicate}` facts are ignored: the knowledge base decides{but}");
            self.warnings.push(Message::warning("M202", text));
        }
        // After failed inference, no design counts as available, because a design may have failed whose failure is
        // not known yet.
        let is_known = self.is_known;
        for design in self.known.designs().iter().filter(|design| is_known && design.available) {
            self.fact(predicate, &[&design.individual.name]);
        }
    }

    /// Adds a fact for each action of the knowledge base: the action, followed by its required functions.
    /// Facts that the problem states are not repeated; an action that does not fit the predicate is reported.
    /// `only` restricts the facts to one action.
    fn requires(&mut self, declared: &Declaration, only: Option<&str>) {
        let stated = self.stated(&declared.identifier.name);
        for action in self.known.actions() {
            if !is_only(action, only) {
                continue;
            }
            let functions: Vec<&str> =
                action.requires.iter().map(|function| function.name.as_str()).collect();
            let symbols: Vec<&str> =
                std::iter::once(action.individual.name.as_str()).chain(functions).collect();
            if stated.contains(&symbols.iter().map(|name| Name::new(name)).collect::<Vec<_>>()) {
                // The problem already states this fact.
            } else if let Some(name) = symbols.iter().find(|name| !is_pddl_name(name)) {
                let action = &action.individual.name;
                let text = format!("`{name}` in the requirements of `{action}` is not a PDDL name");
                self.warnings.push(Message::error("M117", text));
            } else if symbols.len() == declared.parameters.len() {
                self.fact(&declared.identifier.name, &symbols);
            } else {
                let text = format!(
                    "`{}` has {} parameters, but {} requires {} functions; the action is left out",
                    declared.identifier.name,
                    declared.parameters.len(),
                    action.individual.name,
                    action.requires.len()
                );
                self.warnings.push(Message::warning("M203", text));
            }
        }
    }

    /// Returns `true` if one of these objects can be an argument of a parameter with this type.
    fn admits(&self, domain: &Domain, r#type: &TypeExpression, names: &HashSet<Name>) -> bool {
        // The designs of the knowledge base are the last objects.
        let objects = self.problem.objects.iter().rev().chain(&domain.constants);
        let mut objects = objects.filter(|object| names.contains(&object.identifier.name));
        objects.any(|object| self.hierarchy.admits(&object.r#type, r#type))
    }

    fn values(&mut self, domain: &Domain, declared: &Declaration, bindings: &Bindings) {
        let (name, query) = (&declared.identifier.name, bindings.function(declared));
        let mut values: Vec<(Vec<String>, BigRational)> = Vec::new();
        match &query {
            Query::Estimation(attribute) if declared.parameters.len() == 1 => {
                for design in self.known.designs() {
                    let value = estimation(design, attribute);
                    values.extend(value.map(|value| (vec![design.individual.name.clone()], value.clone())));
                }
                // By default, a function is bound to the attribute of its name. Without the type of designs it is
                // another function, for example of places.
                if !values.is_empty() && !bindings.own.contains_key(name) {
                    let designs: HashSet<Name> = values
                        .iter()
                        .flat_map(|(arguments, _)| arguments)
                        .map(|name| Name::new(name))
                        .collect();
                    if !self.admits(domain, &declared.parameters[0].r#type, &designs) {
                        values.clear();
                    }
                }
            }
            Query::Measured(attribute) if declared.parameters.is_empty() => {
                let measured = self.known.measurements().iter().find(|m| m.attribute == *attribute);
                values.extend(measured.and_then(|m| m.value.clone()).map(|value| (Vec::new(), value)));
            }
            _ => {}
        }
        add_values(self.problem, name, values);
    }
}

/// Adds values of a numeric function to a problem, except for arguments for which the problem states a value and
/// arguments that are not PDDL names.
pub(super) fn add_values(problem: &mut Problem, function: &Name, values: Vec<(Vec<String>, BigRational)>) {
    if values.is_empty() {
        return;
    }
    let arguments_of = |element: &InitialElement| match element {
        InitialElement::Value(atom, _, _) if atom.predicate.name == *function => Some(names(&atom.arguments)),
        _ => None,
    };
    let stated: HashSet<Vec<Name>> = problem.init.iter().filter_map(arguments_of).collect();
    for (arguments, value) in values {
        let key: Vec<Name> = arguments.iter().map(|argument| Name::new(argument)).collect();
        if !stated.contains(&key) && arguments.iter().all(|argument| is_pddl_name(argument)) {
            let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
            problem.init.push(InitialElement::Value(atom(function, &arguments), value, Span::default()));
        }
    }
}

fn names(terms: &[Term]) -> Vec<Name> {
    terms.iter().map(Term::name).cloned().collect()
}

pub(super) fn identifier(name: &Name) -> Identifier {
    Identifier { name: name.clone(), span: Span::default() }
}

/// Builds an atom whose arguments are constants.
pub fn atom(predicate: &Name, arguments: &[&str]) -> Atom {
    let constant = |argument: &&str| Term::Constant(identifier(&Name::new(argument)));
    Atom {
        predicate: identifier(predicate),
        arguments: arguments.iter().map(constant).collect(),
        span: Span::default(),
    }
}

/// Returns `true` if a name can be used as an object name: ASCII letters and digits, `-`, `_`, `.` and
/// visible non-ASCII characters.
pub(super) fn is_pddl_name(name: &str) -> bool {
    let allowed =
        |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c) || !c.is_ascii() && !c.is_whitespace();
    !name.is_empty() && name.chars().all(allowed) && visible(name) == name
}
