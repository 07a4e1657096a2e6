//! PLANTA's form: a domain that uses inferred facts of its knowledge base without declaring their
//! predicates.
//!
//! PLANTA \[1\] describes robots in OWL. Its domains refer to the ontology by names: `(solvesF ?fd
//! ?f)` for assertions, `(inferred-Fd_realisability ?fd false_boolean)` for assertions and inferred
//! facts. Before each planning, its `OWLToPDDL` \[2\] writes the ontology into the PDDL files:
//! types, constants, predicates, axioms and rules as derived predicates, assertions as initial
//! facts, and comparisons of numbers. This module performs the same translation in memory, with the
//! same names.
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

use std::borrow::Cow;
use std::collections::{BTreeSet, HashSet};
use std::sync::Arc;

use ontology::Ontology;
use pddl::ast::{Atom, Condition, Domain, InitialElement, Name, Problem, Span, Term};
use pddl::validate::{Options, PlanText, ViolationKind, validate};
use pddl::{Mentioned, Source};
use rules::{Delta, Engine, Fact, Literal, Value};

use crate::message::{Message, did_you_mean};
use crate::withdraw::withdraw;
use complete::drop_repeated;
use names::{EQUAL, GROUNDING, LESS, NUMBER_TYPES, UNGROUND, UNREALISABLE};
use syntax::{Fact as PddlFact, atom, axiom, object, variable};
pub(crate) use terms::Merged;
pub use terms::Terms;

/// Returns the translation of an ontology to PDDL if the domain is in PLANTA's form: it uses undeclared
/// predicates, and at least one of them is `inferred-…` or has the name of a class or property. Otherwise, or
/// if the domain has no readable definition, returns `None`.
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

#[derive(Debug, Clone)]
pub(crate) struct Planta {
    terms: Arc<Terms>,
    /// Type that the domain uses for numbers.
    number: Name,
    /// Predicates of the knowledge base and of numeric comparisons.
    known: HashSet<Name>,
    /// Predicates that the domain file uses.
    used: Arc<BTreeSet<Name>>,
}

impl Planta {
    /// Completes a domain with types, constants, predicates and axioms from the knowledge base. Removes objects of
    /// the problem that repeat a constant and have an undeclared type. Returns the translation state, the completed
    /// domain, and warnings.
    pub(crate) fn new(
        terms: &Arc<Terms>,
        domain: &Domain,
        problem: &mut Problem,
    ) -> (Self, Domain, Vec<Message>) {
        let mut terms_of_mission = Terms::clone(terms);
        let mut warnings = std::mem::take(&mut terms_of_mission.warnings);
        warnings.extend(drop_repeated(domain, problem));
        let mentioned = Mentioned::by_domain(domain).and_problem(problem);
        terms_of_mission.omit_unused(&mentioned);
        let types = mentioned::types(domain, problem);
        let is_used = |r#type: &&&str| types.contains(&Name::new(r#type));
        let number = Name::new(NUMBER_TYPES.iter().find(is_used).unwrap_or(&NUMBER_TYPES[0]));
        terms_of_mission.name_numbers(domain, problem, &mentioned.objects);
        let mut completed = domain.clone();
        terms_of_mission.declare_types(&mut completed, problem, &number, &mut warnings);
        terms_of_mission.declare_constants(&mut completed, problem, &number, &mentioned.objects);
        terms_of_mission.declare_predicates(&mut completed);
        // As in the output of `OWLToPDDL`, the axioms of the domain are last.
        let rules = terms_of_mission.derived.iter().cloned().chain(std::mem::take(&mut completed.derived));
        completed.derived = rules.collect();
        let predicates =
            terms_of_mission.predicates.keys().cloned().chain([LESS, EQUAL].map(Name::new)).collect();
        let used = Arc::new(Mentioned::by_domain(domain).predicates);
        (Self { terms: Arc::new(terms_of_mission), number, known: predicates, used }, completed, warnings)
    }

    /// Returns `true` if the domain file or the goal uses the predicate of a fact: as an assertion, or as an assertion or
    /// inference.
    pub(crate) fn uses(&self, fact: &Fact, engine: &Engine, goal: &Condition) -> bool {
        let predicate =
            engine.symbols().value(fact.predicate).as_name().and_then(|iri| self.terms.symbols.get(iri));
        predicate.is_some_and(|name| {
            let spellings = [name.clone(), names::inferred(name)];
            spellings.iter().any(|name| self.used.contains(name))
                || goal.has_atom(|name| spellings.contains(name))
        })
    }

    pub(crate) fn known(&self) -> &HashSet<Name> {
        &self.known
    }

    /// Returns the pairs of different entities or values of the knowledge base that have one name in PDDL.
    pub(crate) fn merged(&self) -> &BTreeSet<Merged> {
        &self.terms.merged
    }

    pub(crate) fn unknown(completed: &Domain) -> Vec<Message> {
        let declared: Vec<&str> =
            completed.predicates.iter().map(|declared| declared.identifier.name.as_str()).collect();
        let errors = mentioned::undeclared(completed).into_iter().map(|name| {
            let suggestion = did_you_mean(name.as_str(), declared.iter().copied());
            let text = format!(
                "the domain uses `{name}`, but the knowledge base has no class or property of that name{suggestion}"
            );
            Message::error("M215", text)
        });
        errors.collect()
    }

    /// Adds the asserted facts `stated`, their objects, and the comparisons of numbers to a problem. Removes the
    /// problem's values of functional data properties that contradict these facts. Returns warnings.
    pub(crate) fn fill(
        &self,
        domain: &Domain,
        problem: &mut Problem,
        engine: &Engine,
        stated: impl Iterator<Item = Fact>,
    ) -> Vec<Message> {
        let mut facts: BTreeSet<PddlFact> = self.stated(engine, stated).collect();
        let messages = self.replace_values(problem, &facts);
        let problem_facts: BTreeSet<PddlFact> = self.said(problem).collect();
        let constants = domain.constants.iter().chain(&problem.objects);
        let mut names: BTreeSet<Name> = constants.map(|object| object.identifier.name.clone()).collect();
        for name in facts.iter().flat_map(|(_, arguments)| arguments) {
            if names.insert(name.clone()) {
                let r#type = names::number(name).map(|_| self.number.clone());
                problem.objects.push(object(name.clone(), r#type));
            }
        }
        facts.extend(Self::comparisons(domain, &names));
        problem.init.extend(facts.difference(&problem_facts).map(|(predicate, arguments)| {
            let arguments = arguments.iter().map(|name| Term::Constant(name.clone().into()));
            InitialElement::Fact(atom(predicate.clone(), arguments.collect()))
        }));
        messages
    }

    /// Returns the change of the assertions `stated` by an action that adds and deletes facts. Deleted facts are not
    /// asserted any more. An added value of a functional data property replaces the asserted value.
    pub(crate) fn effects(
        &self,
        stated: &[Fact],
        engine: &mut Engine,
        (added, deleted): (&[Atom], &[Atom]),
    ) -> Delta {
        let mut delta = Delta::default();
        for fact in stated {
            let Some((predicate, arguments)) = self.fact(fact, engine) else { continue };
            let is_deleted = |atom: &Atom| {
                atom.predicate.name == predicate && atom.arguments.iter().map(Term::name).eq(&arguments)
            };
            let new_value = |atom: &Atom| match &atom.arguments[..] {
                [subject, value] if atom.predicate.name == predicate && subject.name() == &arguments[0] => {
                    Some(value.name().clone())
                }
                _ => None,
            };
            let is_functional = self.terms.functional.contains(&predicate);
            let new_value = added.iter().find_map(new_value).filter(|_| is_functional);
            if new_value.is_some() || deleted.iter().any(is_deleted) {
                delta.delete.push(fact.clone());
            }
            // Other values, such as texts, remain facts of the problem only.
            if let Some(number) = new_value.as_ref().and_then(names::number) {
                let number = engine.symbols_mut().literal(number);
                delta.insert.push(Fact::new(fact.predicate, [fact.arguments[0], number]));
            }
        }
        delta
    }

    /// Makes designs of a filled problem realisable (`true`) or unrealisable (`false`) in every state, and returns the
    /// domain for this problem. The axioms decide about all other designs. `fd_unground` marks a function without a
    /// design and is no design itself, so it is skipped.
    pub(crate) fn allow<'d>(
        &self,
        domain: &'d Domain,
        problem: &mut Problem,
        designs: impl Iterator<Item = (&'d str, bool)>,
    ) -> Cow<'d, Domain> {
        let predicate = Name::new(UNREALISABLE);
        let is_object = |name: &Name| {
            domain.constants.iter().chain(&problem.objects).any(|object| object.identifier.name == *name)
        };
        let is_declared = domain.predicates.iter().any(|declared| declared.identifier.name == predicate);
        let no = self.no();
        // No condition can read the realisability.
        if !is_declared || !is_object(&no) {
            return Cow::Borrowed(domain);
        }
        let designs = designs.filter(|(design, _)| *design != UNGROUND);
        let designs = designs.map(|(design, available)| (names::plain(design), available));
        let (permitted, forbidden): (Vec<_>, Vec<_>) =
            designs.filter(|(design, _)| is_object(design)).partition(|(_, available)| *available);
        let permitted: Vec<Name> = permitted.into_iter().map(|(design, _)| design).collect();
        let mut domain = Cow::Borrowed(domain);
        withdraw(&mut domain, problem, &predicate, (&permitted, std::slice::from_ref(&no)));
        let is_derived = domain.derived.iter().any(|axiom| axiom.head.identifier.name == predicate);
        for (design, _) in forbidden {
            let [design, no] = [design, no.clone()].map(|name| Term::Constant(name.into()));
            if is_derived {
                let equal = |name, value| Condition::Equal(variable(name), value, Span::default());
                let condition = Condition::And(vec![equal("x", design), equal("y", no)]);
                domain.to_mut().derived.push(axiom(predicate.clone(), &["x", "y"], condition));
            } else {
                problem.init.push(InitialElement::Fact(atom(predicate.clone(), vec![design, no])));
            }
        }
        domain
    }

    /// Returns `true` if a design is realisable in the initial state of a filled problem, by the axioms of the domain.
    pub(crate) fn is_available(&self, domain: &Domain, problem: &Problem, design: &str) -> bool {
        let arguments = [names::plain(design), self.no()].map(|name| Term::Constant(name.into()));
        let unrealisable = Condition::Atom(atom(Name::new(UNREALISABLE), arguments.into()));
        let goal = Condition::Not(Box::new(unrealisable));
        let problem = Problem { goal, ..problem.clone() };
        let verdict = validate(domain, &problem, &PlanText::default(), &Options::default());
        verdict.violation.is_none_or(|violation| violation.kind != ViolationKind::Goal)
    }

    /// Name of the value `false`.
    fn no(&self) -> Name {
        self.terms.literals.name(&Literal::Boolean(false))
    }

    /// Withdraws that `designs` solve `functions`, by the `predicates`, and that they are configured for them at the
    /// start. Skips `fd_unground`.
    pub(crate) fn withdraw_functions(
        domain: &mut Cow<'_, Domain>,
        problem: &mut Problem,
        predicates: &[Name],
        (designs, functions): (&[&str], &[&str]),
    ) {
        let objects = |names: &[&str]| -> Vec<Name> {
            names.iter().filter(|name| **name != UNGROUND).map(|name| names::plain(name)).collect()
        };
        let (designs, functions) = (objects(designs), objects(functions));
        for predicate in predicates {
            withdraw(domain, problem, predicate, (&designs, &functions));
        }
        withdraw(domain, problem, &Name::new(GROUNDING), (&functions, &designs));
    }

    fn is_known(&self, predicate: &Name) -> bool {
        self.known.contains(predicate)
    }

    /// Returns the facts of the problem whose predicates belong to the knowledge base or to numeric
    /// comparisons. All other facts describe maps and tasks and may be very numerous.
    fn said(&self, problem: &Problem) -> impl Iterator<Item = PddlFact> {
        let is_known = |element: &&InitialElement| match element {
            InitialElement::Fact(atom) => self.is_known(&atom.predicate.name),
            _ => false,
        };
        problem.init.iter().filter(is_known).filter_map(InitialElement::fact)
    }

    fn stated(&self, engine: &Engine, stated: impl Iterator<Item = Fact>) -> impl Iterator<Item = PddlFact> {
        stated.filter_map(|fact| self.fact(&fact, engine))
    }

    fn fact(&self, fact: &Fact, engine: &Engine) -> Option<PddlFact> {
        let symbols = engine.symbols();
        let predicate = self.terms.symbols.get(symbols.value(fact.predicate).as_name()?)?.clone();
        let name = |symbol: &rules::Symbol| match symbols.value(*symbol) {
            Value::Name(iri) => names::plain(iri),
            Value::Literal(literal) => self.terms.literals.name(literal),
        };
        Some((predicate, fact.arguments.iter().map(name).collect()))
    }

    /// Removes the problem's values of functional data properties for which the knowledge base has a different
    /// value. Returns warnings.
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
            let base_values = || {
                let base_facts = facts.iter().filter(|(own, stated)| *own == predicate && stated[0] == *subject);
                base_facts.map(|(_, stated)| &stated[1])
            };
            match base_values().next() {
                Some(base_value) if base_values().all(|base_value| base_value != value) => {
                    let text = format!(
                        "the problem's own `({predicate} {subject} {value})` is ignored: the knowledge base says {base_value}"
                    );
                    warnings.push(Message::warning("M202", text));
                    false
                }
                _ => true,
            }
        });
        warnings
    }

    /// Returns the facts `lessThan` and `equalTo` that hold for pairs of numbers in `known`. Empty
    /// if the domain declares neither predicate.
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
