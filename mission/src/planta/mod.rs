//! PLANTA's form: a domain that mentions what its knowledge base concludes and declares none of it.
//!
//! PLANTA \[1\] keeps what robots are in OWL and lets its domains ask for it by names: `(solvesF ?fd ?f)` for what the knowledge base
//! states, `(inferred-Fd_realisability ?fd false_boolean)` for what is stated or follows. Its `OWLToPDDL` \[2\] writes the rest into
//! the files before each planning: types, constants, predicates, axioms and rules as derived predicates, assertions as initial
//! facts, and how numbers compare. This room does the same inside, with the same names.
//!
//! What depends on nothing that an action changes is decided here, once for a situation (`fold`): its derived predicates become
//! initial facts.
//!
//! \[1\] G. Rezende Silva et al.: PLANTA, `kas-lab/suave_planta` and `kas-lab/navigation_planta`.
//! \[2\] `remaro-network/dlToPlanning`.

mod clause;
mod fold;
mod mentioned;
mod names;
mod settle;
mod swrl;
mod terms;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use ontology::Ontology;
use pddl::ast::{
    Declaration, Domain, Identifier, InitialElement, Name, Problem, Term, TypeExpression, TypedName,
};
use pddl::{Source, TypeHierarchy};
use rules::{Engine, Fact, Value};

use crate::message::{Message, did_you_mean};
use fold::{Folded, Said};
use names::{EQUAL, LESS, NUMBER_TYPES};
use settle::Guards;
pub use terms::Terms;
use terms::{atom, identifier, untyped};

/// What an ontology adds to a domain in general, if the domain asks for it: it mentions predicates that it does not declare, and
/// one of them is `inferred-…` or named as a class or a property.
pub(crate) fn wanted(ontology: &Ontology, domain: &str) -> Option<Terms> {
    let source = Source::new("domain", domain);
    let missing = mentioned::undeclared(&pddl::parse_domain(&source).0?);
    if missing.is_empty() {
        return None;
    }
    let terms = Terms::new(ontology);
    let inferred = |name: &Name| name.as_str().to_ascii_lowercase().starts_with("inferred-");
    missing.iter().any(|name| inferred(name) || terms.has(name)).then_some(terms)
}

/// What a knowledge base adds to a domain and a problem in PLANTA's form.
#[derive(Debug, Clone)]
pub(crate) struct Planta {
    terms: Arc<Terms>,
    /// The type of numbers.
    number: Name,
    /// What is taken for granted of facts that actions change.
    guards: Guards,
    folded: Folded,
    /// The completed domain with all axioms.
    whole: Option<Arc<Domain>>,
}

impl Planta {
    /// Completes a domain; what is questionable about that is returned, too.
    pub(crate) fn new(
        terms: &Arc<Terms>,
        domain: &Domain,
        problem: &mut Problem,
        (engine, stated): (&Engine, Vec<Fact>),
    ) -> (Self, Domain, Vec<Message>) {
        let mut own = Terms::clone(terms);
        let mut warnings = std::mem::take(&mut own.warnings);
        warnings.extend(drop_repeated(domain, problem));
        let mentioned = mentioned::Mentioned::by_domain(domain).and_problem(problem);
        let types = mentioned::types(domain, problem);
        let known = |r#type: &&&str| types.contains(&Name::new(r#type));
        let number = Name::new(NUMBER_TYPES.iter().find(known).unwrap_or(&NUMBER_TYPES[0]));
        own.name_numbers(domain, problem, &mentioned.objects);
        let mut completed = domain.clone();
        own.declare_types(&mut completed, problem, &number, &mut warnings);
        own.declare_constants(&mut completed, problem, &number, &mentioned.objects);
        own.declare_predicates(&mut completed);
        // The domain's own axioms come last, as they do in what `OWLToPDDL` writes.
        let rules = own.derived.iter().cloned().chain(std::mem::take(&mut completed.derived));
        completed.derived = rules.collect();
        let mut guards = settle::guards(domain, &mentioned.changed, &mentioned.timed);
        let derived = own.derived.clone();
        let mut planta = Self {
            terms: Arc::new(own),
            number,
            guards: Guards::new(),
            folded: Folded::default(),
            whole: None,
        };
        let facts = planta.stated(engine, stated.into_iter()).chain(problem.init.iter().filter_map(spelled));
        let facts: BTreeSet<Said> = facts.collect();
        guards.retain(|guard| facts.iter().all(|fact| settle::keeps(fact, guard, &facts)));
        let mut known: BTreeSet<Name> = planta.terms.predicates.keys().cloned().collect();
        known.extend([LESS, EQUAL].map(Name::new));
        planta.folded = Folded::new(&derived, domain, &mentioned.changed, &guards, known);
        planta.guards = guards;
        planta.whole = Some(Arc::new(completed.clone()));
        planta.folded.shorten(&mut completed);
        mentioned::keep_asked(&mut completed, problem);
        (planta, completed, warnings)
    }

    /// Predicates that a completed domain asks for and that neither it nor the knowledge base has.
    pub(crate) fn unknown(&self, completed: &Domain) -> Vec<Message> {
        let declared: Vec<&str> =
            completed.predicates.iter().map(|declared| declared.identifier.name.as_str()).collect();
        let unknown = mentioned::undeclared(completed).into_iter().map(|name| {
            let meant = did_you_mean(name.as_str(), declared.iter().copied());
            let text = format!(
                "the domain asks for `{name}`, and the knowledge base has no class or property of that name{meant}"
            );
            Message::error("M215", text)
        });
        unknown.collect()
    }

    /// The completed domain with all axioms, and a problem with what is stated, from which they conclude all else: as `OWLToPDDL`
    /// writes them.
    pub(crate) fn merged(
        &self,
        problem: &Problem,
        (engine, stated): (&Engine, Vec<Fact>),
    ) -> Option<(Domain, Problem)> {
        let (whole, mut problem) = (Domain::clone(self.whole.as_ref()?), problem.clone());
        let plain = Self { folded: Folded::default(), guards: Guards::new(), ..self.clone() };
        plain.fill(&whole, &mut problem, engine, stated.into_iter());
        Some((whole, problem))
    }

    /// Adds to a problem what is stated now, how numbers compare, and what follows whatever the robot does; returns warnings.
    pub(crate) fn fill(
        &self,
        domain: &Domain,
        problem: &mut Problem,
        engine: &Engine,
        stated: impl Iterator<Item = Fact>,
    ) -> Vec<Message> {
        let mut facts: BTreeSet<Said> = self.stated(engine, stated).collect();
        let mut messages = self.replace_values(problem, &facts);
        let said: BTreeSet<Said> = problem.init.iter().filter_map(spelled).collect();
        let constants = domain.constants.iter().chain(&problem.objects);
        let mut known: BTreeSet<Name> = constants.map(|object| object.identifier.name.clone()).collect();
        for name in facts.iter().flat_map(|(_, arguments)| arguments) {
            if known.insert(name.clone()) {
                let r#type = names::number(name).map(|_| self.number.clone());
                problem.objects.push(object(name.clone(), r#type));
            }
        }
        facts.extend(self.comparisons(domain, &known));
        let hierarchy = TypeHierarchy::of(domain);
        let mut types: BTreeMap<&Name, Vec<&TypeExpression>> = BTreeMap::new();
        for declared in domain.constants.iter().chain(&problem.objects) {
            types.entry(&declared.identifier.name).or_default().push(&declared.r#type);
        }
        let is_of = |object: &Name, wanted: &Name| {
            let wanted = typed(Some(wanted.clone()));
            types.get(object).is_some_and(|own| own.iter().any(|own| hierarchy.fits(own, &wanted)))
        };
        let folded = self.folded.facts(facts.iter().chain(&said), &known, &is_of);
        facts.extend(folded);
        messages.extend(self.unguarded(&facts, &said));
        problem.init.extend(facts.difference(&said).map(|(predicate, arguments)| {
            let arguments = arguments.iter().map(|name| Term::Constant(identifier(name.clone())));
            InitialElement::Fact(atom(predicate.clone(), arguments.collect()))
        }));
        messages
    }

    /// What is stated, in PDDL.
    fn stated(&self, engine: &Engine, stated: impl Iterator<Item = Fact>) -> impl Iterator<Item = Said> {
        stated.filter_map(|fact| self.fact(&fact, engine))
    }

    /// Facts that actions change and of which not all is stated that the actions ask for: the domain was completed without them.
    fn unguarded(&self, facts: &BTreeSet<Said>, said: &BTreeSet<Said>) -> Vec<Message> {
        let all: BTreeSet<Said> = facts.union(said).cloned().collect();
        let mut messages = Vec::new();
        for fact in &all {
            for guard @ (_, position, class) in &self.guards {
                if !settle::keeps(fact, guard, &all) {
                    let (predicate, arguments) = fact;
                    let text = format!(
                        "`{}` is related by `{predicate}`, and nothing states that it is a `{class}`, as the actions ask",
                        arguments[*position]
                    );
                    messages.push(Message::error("M214", text));
                }
            }
        }
        messages
    }

    /// A statement in PDDL; none if it is of nothing that the ontology names.
    fn fact(&self, fact: &Fact, engine: &Engine) -> Option<Said> {
        let symbols = engine.symbols();
        let predicate = self.terms.symbols.get(symbols.value(fact.predicate).as_name()?)?.clone();
        let name = |symbol: &rules::Symbol| match symbols.value(*symbol) {
            Value::Name(iri) => names::plain(iri),
            Value::Literal(literal) => self.terms.literals.name(literal),
        };
        Some((predicate, fact.arguments.iter().map(name).collect()))
    }

    /// Of properties that have one value only, that of the knowledge base counts.
    fn replace_values(&self, problem: &mut Problem, facts: &BTreeSet<Said>) -> Vec<Message> {
        let mut warnings = Vec::new();
        problem.init.retain(|element| {
            let Some((predicate, arguments)) = spelled(element) else { return true };
            let [subject, value] = &arguments[..] else { return true };
            if !self.terms.functional.contains(&predicate) {
                return true;
            }
            let other = facts.iter().find(|(own, stated)| *own == predicate && stated[0] == *subject);
            match other {
                Some((_, stated)) if stated[1] != *value => {
                    let text = format!(
                        "the problem's own `({predicate} {subject} {value})` is ignored: the knowledge base says {}",
                        stated[1]
                    );
                    warnings.push(Message::warning("M202", text));
                    false
                }
                _ => true,
            }
        });
        warnings
    }

    /// How the numbers that there are compare, if anything asks for it.
    fn comparisons(&self, domain: &Domain, known: &BTreeSet<Name>) -> Vec<Said> {
        let declared =
            |name: &str| domain.predicates.iter().any(|own| own.identifier.name == Name::new(name));
        if !declared(LESS) && !declared(EQUAL) {
            return Vec::new();
        }
        let mut numbers: Vec<_> =
            known.iter().filter_map(|name| Some((names::number(name)?.as_rational()?, name))).collect();
        numbers.sort();
        let mut facts = Vec::new();
        for (position, (value, name)) in numbers.iter().enumerate() {
            facts.push((Name::new(EQUAL), vec![(*name).clone(), (*name).clone()]));
            for (greater, other) in &numbers[position + 1..] {
                let pair = vec![(*name).clone(), (*other).clone()];
                if value == greater {
                    facts.push((Name::new(EQUAL), vec![(*other).clone(), (*name).clone()]));
                    facts.push((Name::new(EQUAL), pair));
                } else {
                    facts.push((Name::new(LESS), pair));
                }
            }
        }
        facts
    }
}

impl Terms {
    /// Numbers keep the names that the files give them.
    fn name_numbers(&mut self, domain: &Domain, problem: &Problem, mentioned: &BTreeSet<Name>) {
        let declared = domain.constants.iter().chain(&problem.objects);
        let declared = declared.map(|object| &object.identifier.name);
        let mut literals = names::Literals::default();
        for name in declared.chain(mentioned) {
            if let Some(value) = names::number(name) {
                literals.insert(value, name.clone());
            }
        }
        self.literals.prefer(literals);
    }

    /// Types of individuals and numbers, and those that only objects mention.
    fn declare_types(
        &self,
        domain: &mut Domain,
        problem: &Problem,
        number: &Name,
        warnings: &mut Vec<Message>,
    ) {
        let mut known: BTreeSet<Name> = domain.types.iter().map(|own| own.identifier.name.clone()).collect();
        known
            .extend(domain.types.iter().flat_map(|own| &own.r#type.alternatives).map(|own| own.name.clone()));
        known.insert(Name::new("object"));
        let typed: BTreeSet<&Name> = self.constants.values().flatten().chain([number]).collect();
        for name in typed {
            if known.insert(name.clone()) {
                domain.types.push(object(name.clone(), None));
            }
        }
        let objects = domain.constants.iter().chain(&problem.objects);
        let mentioned: Vec<Identifier> =
            objects.flat_map(|object| object.r#type.alternatives.clone()).collect();
        for r#type in mentioned {
            if known.insert(r#type.name.clone()) {
                let text = format!(
                    "the type `{}` of objects is declared nowhere, and nothing else is of that type",
                    r#type.name
                );
                warnings.push(Message::warning("M213", text));
                domain.types.push(object(r#type.name, None));
            }
        }
    }

    /// Individuals, values, and the numbers that rules or the files name.
    fn declare_constants(
        &self,
        domain: &mut Domain,
        problem: &Problem,
        number: &Name,
        mentioned: &BTreeSet<Name>,
    ) {
        let mut known: BTreeSet<Name> =
            domain.constants.iter().map(|own| own.identifier.name.clone()).collect();
        for (name, r#type) in &self.constants {
            if known.insert(name.clone()) {
                // An object of the problem that the ontology gives no type keeps its own.
                let own = problem.objects.iter().find(|object| object.identifier.name == *name);
                let r#type = match (r#type, own) {
                    (None, Some(own)) => own.r#type.clone(),
                    (r#type, _) => typed(r#type.clone()),
                };
                domain.constants.push(TypedName { identifier: identifier(name.clone()), r#type });
            }
        }
        known.extend(problem.objects.iter().map(|object| object.identifier.name.clone()));
        let mentioned = mentioned.iter().filter(|name| names::number(name).is_some());
        for name in self.numbers.iter().chain(mentioned) {
            if known.insert(name.clone()) {
                domain.constants.push(object(name.clone(), Some(number.clone())));
            }
        }
    }

    /// Classes and properties, stated and inferred, and how numbers compare.
    fn declare_predicates(&self, domain: &mut Domain) {
        let mut known: BTreeSet<Name> =
            domain.predicates.iter().map(|own| own.identifier.name.clone()).collect();
        let compared = [LESS, EQUAL].map(|name| (Name::new(name), 2));
        let own = self.predicates.iter().map(|(name, arity)| (name.clone(), *arity));
        for (name, arity) in own.chain(compared) {
            if known.insert(name.clone()) {
                let parameters = untyped(&["x", "y"][..arity]);
                domain.predicates.push(Declaration { identifier: identifier(name), parameters });
            }
        }
    }
}

/// Objects of the problem that are constants of the domain, too, and of a type that is declared nowhere: what counts is the constant.
fn drop_repeated(domain: &Domain, problem: &mut Problem) -> Vec<Message> {
    let hierarchy = TypeHierarchy::of(domain);
    let unknown = |object: &TypedName| {
        object
            .r#type
            .alternatives
            .iter()
            .find(|own| !hierarchy.contains(&own.name))
            .map(|own| own.name.clone())
    };
    let mut warnings = Vec::new();
    problem.objects.retain(|object| {
        let name = &object.identifier.name;
        let is_constant = domain.constants.iter().any(|constant| constant.identifier.name == *name);
        let Some(r#type) = unknown(object).filter(|_| is_constant) else { return true };
        let text = format!(
            "`{name}` is a constant of the domain; its type in the problem, `{type}`, is declared nowhere"
        );
        warnings.push(Message::warning("M213", text));
        false
    });
    warnings
}

fn typed(r#type: Option<Name>) -> TypeExpression {
    TypeExpression { alternatives: r#type.into_iter().map(identifier).collect() }
}

fn object(name: Name, r#type: Option<Name>) -> TypedName {
    TypedName { identifier: identifier(name), r#type: typed(r#type) }
}

/// A fact of an initial state as names.
fn spelled(element: &InitialElement) -> Option<Said> {
    let InitialElement::Fact(atom) = element else { return None };
    let name = |term: &Term| match term {
        Term::Variable(own) | Term::Constant(own) => own.name.clone(),
    };
    Some((atom.predicate.name.clone(), atom.arguments.iter().map(name).collect()))
}
