//! PLANTA's form: a domain that mentions what its knowledge base concludes and declares none of it.
//!
//! PLANTA \[1\] keeps what robots are in OWL and lets its domains ask for it by names: `(solvesF ?fd ?f)` for what the knowledge base
//! states, `(inferred-Fd_realisability ?fd false_boolean)` for what is stated or follows. Its `OWLToPDDL` \[2\] writes the rest into
//! the files before each planning: types, constants, predicates, axioms and rules as derived predicates, assertions as initial
//! facts, and how numbers compare. This module does the same inside, with the same names.
//!
//! \[1\] G. Rezende Silva et al.: PLANTA, `kas-lab/suave_planta` and `kas-lab/navigation_planta`.
//! \[2\] `remaro-network/dlToPlanning`.

mod axioms;
mod complete;
mod mentioned;
mod names;
mod swrl;
mod syntax;
mod terms;

use std::collections::{BTreeSet, HashSet};
use std::sync::Arc;

use ontology::Ontology;
use pddl::ast::{Domain, InitialElement, Name, Problem, Term};
use pddl::{Mentioned, Source};
use rules::{Engine, Fact, Literal, Value};

use crate::message::{Message, did_you_mean};
use complete::drop_repeated;
use names::{EQUAL, LESS, NUMBER_TYPES, UNGROUND, UNREALISABLE};
use syntax::{Fact as PddlFact, atom, object};
pub use terms::Terms;

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
    /// The predicates that the knowledge base or a comparison of numbers has something to say of.
    known: HashSet<Name>,
}

impl Planta {
    /// Completes a domain; what is questionable about that is returned, too.
    pub(crate) fn new(
        terms: &Arc<Terms>,
        domain: &Domain,
        problem: &mut Problem,
    ) -> (Self, Domain, Vec<Message>) {
        let mut own = Terms::clone(terms);
        let mut warnings = std::mem::take(&mut own.warnings);
        warnings.extend(drop_repeated(domain, problem));
        let mentioned = Mentioned::by_domain(domain).and_problem(problem);
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
        let known = own.predicates.keys().cloned().chain([LESS, EQUAL].map(Name::new)).collect();
        (Self { terms: Arc::new(own), number, known }, completed, warnings)
    }

    /// The predicates about which the knowledge base or a comparison of numbers says something.
    pub(crate) fn known(&self) -> &HashSet<Name> {
        &self.known
    }

    /// Predicates that a completed domain asks for and that neither it nor the knowledge base has.
    pub(crate) fn unknown(completed: &Domain) -> Vec<Message> {
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

    /// Adds to a problem what is stated now and how numbers compare; returns warnings.
    pub(crate) fn fill(
        &self,
        domain: &Domain,
        problem: &mut Problem,
        engine: &Engine,
        stated: impl Iterator<Item = Fact>,
    ) -> Vec<Message> {
        let mut facts: BTreeSet<PddlFact> = self.stated(engine, stated).collect();
        let messages = self.replace_values(problem, &facts);
        let said: BTreeSet<PddlFact> = self.said(problem).collect();
        let constants = domain.constants.iter().chain(&problem.objects);
        let mut known: BTreeSet<Name> = constants.map(|object| object.identifier.name.clone()).collect();
        for name in facts.iter().flat_map(|(_, arguments)| arguments) {
            if known.insert(name.clone()) {
                let r#type = names::number(name).map(|_| self.number.clone());
                problem.objects.push(object(name.clone(), r#type));
            }
        }
        facts.extend(Self::comparisons(domain, &known));
        problem.init.extend(facts.difference(&said).map(|(predicate, arguments)| {
            let arguments = arguments.iter().map(|name| Term::Constant(name.clone().into()));
            InitialElement::Fact(atom(predicate.clone(), arguments.collect()))
        }));
        messages
    }

    /// Says anew in a filled problem which designs are available: of the others it holds that they cannot be realised. The domain
    /// that is returned concludes nothing about that. That a function is not grounded is not a design that somebody could do without.
    pub(crate) fn allow<'d>(
        &self,
        domain: &Domain,
        problem: &mut Problem,
        designs: impl Iterator<Item = (&'d str, bool)>,
    ) -> Domain {
        let (predicate, no) = (Name::new(UNREALISABLE), self.terms.literals.name(&Literal::Boolean(false)));
        let mut domain = domain.clone();
        domain.derived.retain(|own| own.head.identifier.name != predicate);
        for (design, available) in designs.filter(|(design, _)| *design != UNGROUND) {
            let arguments = vec![names::plain(design), no.clone()];
            let own = Some((predicate.clone(), arguments.clone()));
            problem.init.retain(|element| element.fact() != own);
            if !available {
                let arguments: Vec<Term> =
                    arguments.into_iter().map(|name| Term::Constant(name.into())).collect();
                problem.init.push(InitialElement::Fact(atom(predicate.clone(), arguments)));
            }
        }
        domain
    }

    /// Whether the knowledge base or a comparison of numbers has something to say of a predicate.
    fn is_known(&self, predicate: &Name) -> bool {
        self.known.contains(predicate)
    }

    /// What a problem states of such predicates: all else is of maps and tasks, and there may be very much of it.
    fn said(&self, problem: &Problem) -> impl Iterator<Item = PddlFact> {
        let is_known = |element: &&InitialElement| match element {
            InitialElement::Fact(atom) => self.is_known(&atom.predicate.name),
            _ => false,
        };
        problem.init.iter().filter(is_known).filter_map(InitialElement::fact)
    }

    /// What is stated, in PDDL.
    fn stated(&self, engine: &Engine, stated: impl Iterator<Item = Fact>) -> impl Iterator<Item = PddlFact> {
        stated.filter_map(|fact| self.fact(&fact, engine))
    }

    /// A statement in PDDL; none if it is of nothing that the ontology names.
    fn fact(&self, fact: &Fact, engine: &Engine) -> Option<PddlFact> {
        let symbols = engine.symbols();
        let predicate = self.terms.symbols.get(symbols.value(fact.predicate).as_name()?)?.clone();
        let name = |symbol: &rules::Symbol| match symbols.value(*symbol) {
            Value::Name(iri) => names::plain(iri),
            Value::Literal(literal) => self.terms.literals.name(literal),
        };
        Some((predicate, fact.arguments.iter().map(name).collect()))
    }

    /// Of properties that have one value only, that of the knowledge base counts.
    fn replace_values(&self, problem: &mut Problem, facts: &BTreeSet<PddlFact>) -> Vec<Message> {
        let mut warnings = Vec::new();
        problem.init.retain(|element| {
            let InitialElement::Fact(atom) = element else { return true };
            if !self.known.contains(&atom.predicate.name)
                || !self.terms.functional.contains(&atom.predicate.name)
            {
                return true;
            }
            let Some((predicate, arguments)) = element.fact() else { return true };
            let [subject, value] = &arguments[..] else { return true };
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
    fn comparisons(domain: &Domain, known: &BTreeSet<Name>) -> Vec<PddlFact> {
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
