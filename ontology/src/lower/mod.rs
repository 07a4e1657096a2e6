//! Lowers an [`Ontology`] to the input of the rule engine: assertions become facts, axioms of OWL 2 RL and SWRL
//! rules become rules, and every axiom without a rule form is reported.
//!
//! A class is a unary relation and a property a binary one, both named by their IRI. The rules for axioms are
//! the rules of the OWL 2 RL profile [1], instantiated with the classes and properties of each axiom. Thus the
//! engine indexes by class and property instead of joining with a schema. `sameAs` and `differentFrom` are
//! relations; functional and inverse functional object properties conclude equality. An axiom that forbids something
//! becomes a rule with an empty head, an integrity constraint.
//!
//! Axioms outside of OWL 2 RL are lowered in part if possible (for example one direction of an equivalence),
//! and the remaining part is reported. With the semantics of OWL ([`Equality::Owl`]), conclusions are
//! therefore sound and possibly incomplete.
//!
//! - [1] OWL 2 Web Ontology Language Profiles, W3C 2012, section 4.3.

mod axiom;
mod class;
mod context;
mod equality;
mod groups;
mod inclusion;
mod range;
mod swrl;
mod vocabulary;

use std::collections::HashSet;

use rules::{Atom, Error, Fact, Program, Rule, RuleIdentity, Symbols, Term};
use tracing::field::Empty;
use tracing::info_span;

use crate::error::Warning;
use crate::owl::{AnnotatedAxiom, DataRange, EntityKind, Iri, Ontology};
use context::{Conjunction, Context, cross};

pub use context::{AXIOM_SOURCE, Equality, INTERNAL};

/// An ontology as rules and facts.
#[derive(Clone, Debug)]
pub struct Lowered {
    /// SWRL rules of the knowledge base, then rules lowered from axioms, then the semantics of OWL's own
    /// vocabulary, then additional rules.
    pub program: Program,
    /// Facts of the assertions, of auxiliary relations (for example the members of enumerations) and, if a rule
    /// depends on it, of `owl:Thing`.
    pub facts: Vec<Fact>,
    /// Number of SWRL rules omitted because an equal rule occurs before, in any of the ontologies.
    pub duplicates: usize,
    /// Warnings about axioms and rules that are not used in full, and about rules that are used although their
    /// annotation disables them.
    pub warnings: Vec<Warning>,
}

/// Lowers an ontology to rules and facts with the semantics of OWL. Names and literals are interned in
/// `symbols`.
pub fn lower(ontology: &Ontology, symbols: &mut Symbols) -> Lowered {
    lower_with(ontology, Equality::Owl, symbols)
}

/// Lowers an ontology under the given semantics of names; see [`lower()`].
pub fn lower_with(ontology: &Ontology, equality: Equality, symbols: &mut Symbols) -> Lowered {
    lower_together(ontology, Vec::new(), equality, symbols)
}

/// Lowers an ontology like [`lower_with`], together with additional rules, whose names are in `symbols`. In the
/// additional rules, `owl:Thing`, `owl:Nothing`, datatypes, `sameAs` and `differentFrom` have the semantics of OWL (the last two
/// only under [`Equality::Owl`]). These rules come last in the program.
pub fn lower_together(
    ontology: &Ontology,
    additional: Vec<Rule>,
    equality: Equality,
    symbols: &mut Symbols,
) -> Lowered {
    let span = info_span!("lower", rules = Empty, facts = Empty).entered();
    let mut context = Context::new(symbols, equality, ontology);
    let duplicates = swrl::lower(&ontology.rules, &mut context);
    axiom::lower_rules(&ontology.axioms, &mut context);
    class::lower_inclusions(&mut context, ontology.axioms.len());
    context.drop_unusable();
    let auxiliary = std::mem::take(&mut context.auxiliary);
    context.rules.extend(auxiliary);
    axiom::lower_assertions(&ontology.axioms, &mut context);
    let before_additional = context.rules.len();
    context.add_rules(additional);
    let after_additional = context.rules.len();
    vocabulary::lower(ontology, &mut context);
    let equality = match equality {
        Equality::Owl => equality::lower(&ontology.axioms, &mut context),
        Equality::UniqueNames => {
            equality::forbid(&mut context);
            false
        }
        Equality::UncheckedUniqueNames => false,
    };
    // The rules of `vocabulary` and `equality` move in front of the additional rules.
    context.rules[before_additional..].rotate_left(after_additional - before_additional);
    let Context { rules, facts, mut warnings, .. } = context;
    span.record("rules", rules.len()).record("facts", facts.len());
    warnings.sort();
    warnings.dedup();
    Lowered { program: Program { rules, equality }, facts, duplicates, warnings }
}

/// Lowers only assertions about named classes and properties, `sameAs` and `differentFrom`, in the order of
/// the axioms.
pub(crate) fn lower_assertions(axioms: &[AnnotatedAxiom], symbols: &mut Symbols) -> Vec<Fact> {
    let mut context = Context::new(symbols, Equality::Owl, &Ontology::default());
    axiom::lower_assertions(axioms, &mut context);
    context.facts
}

impl Context<'_> {
    /// Adds rules that come from no document. Under the semantics of OWL, two different names can denote the same
    /// individual, so a comparison of names becomes the relation `differentFrom`. A datatype of the ontology becomes a test
    /// of its values.
    fn add_rules(&mut self, additional: Vec<Rule>) {
        for mut rule in additional {
            for atom in &mut rule.body {
                atom.replace_different(&mut |left, right| self.different(left, right));
            }
            match self.conclusion_of_range(&rule).and_then(|()| self.with_ranges(&rule.body)) {
                Ok(bodies) => self.rules.extend(bodies.into_iter().map(|body| Rule { body, ..rule.clone() })),
                Err(reason) => self.warnings.push(Warning::UnusableRule {
                    ontology: rule.identity.source.to_string(),
                    position: rule.identity.position,
                    label: rule.identity.label.as_ref().map(ToString::to_string),
                    reason: reason.to_owned(),
                }),
            }
        }
    }

    fn conclusion_of_range(&self, rule: &Rule) -> Result<(), &'static str> {
        let is_range = rule.head.iter().any(|atom| self.data_range_of(atom).is_some());
        if is_range { Err("a data range as a conclusion") } else { Ok(()) }
    }

    /// Returns the datatype and the value of an atom whose predicate is a datatype of the ontology, negated or not; `None`
    /// for other atoms.
    fn data_range_of(&self, atom: &Atom) -> Option<(DataRange, Term)> {
        let (Atom::Relation { predicate, arguments } | Atom::Not { predicate, arguments }) = atom else {
            return None;
        };
        let ([value], Some(name)) = (arguments.as_slice(), self.symbols.value(*predicate).as_name()) else {
            return None;
        };
        let iri = Iri::from(name);
        let is_datatype = self.is(EntityKind::Datatype, &iri) || self.definitions.contains_key(&iri);
        (is_datatype && !self.is(EntityKind::Class, &iri)).then_some((DataRange::Datatype(iri), *value))
    }

    fn with_ranges(&mut self, body: &[Atom]) -> Result<Vec<Conjunction>, &'static str> {
        let mut bodies = vec![Vec::new()];
        for atom in body {
            let alternatives = match (self.data_range_of(atom), atom) {
                (Some((range, value)), Atom::Not { .. }) => range::violations(self, &range, &[], value)?,
                (Some((range, value)), _) => range::condition(self, &range, value)?,
                (None, Atom::Aggregate { aggregate, result, body }) => {
                    // Alternatives within an aggregate would count a match several times.
                    let [body] = self.with_ranges(body)?.try_into().map_err(|_| RANGE_IN_AGGREGATE)?;
                    vec![vec![Atom::Aggregate { aggregate: *aggregate, result: *result, body }]]
                }
                (None, _) => vec![vec![atom.clone()]],
            };
            bodies = cross(&bodies, &alternatives);
            if bodies.len() > range::MAX_RANGE_ALTERNATIVES {
                return Err("data ranges of too many alternatives");
            }
        }
        Ok(bodies)
    }

    /// Removes the rules that the engine rejects, and other rules of the same SWRL rule or axiom, with a warning. One
    /// such rule would make the engine reject the whole program. Omits the test for a rule lowered from an axiom if its body has
    /// a relation atom, or an equality with a constant: lowering then binds all variables.
    fn drop_unusable(&mut self) {
        let binds = |atom: &Atom| match atom {
            Atom::Relation { .. } => true,
            Atom::Same(left, right) => [left, right].iter().any(|term| term.as_variable().is_none()),
            _ => false,
        };
        // Checking only the remaining rules saves the time for thousands of axioms.
        let is_bound = |rule: &Rule| *rule.identity.source == *AXIOM_SOURCE && rule.body.iter().any(binds);
        let unbound = self.rules.iter().enumerate().filter(|(_, rule)| !is_bound(rule));
        // Rules of several documents can have the same identity. The index identifies a rule.
        let numbered = |(index, rule): (usize, &Rule)| {
            let identity = RuleIdentity { position: index as u32, ..rule.identity.clone() };
            Rule { identity, ..rule.clone() }
        };
        let program = Program { rules: unbound.map(numbered).collect(), ..Program::default() };
        let Err(errors) = rules::Engine::check(&program, self.symbols) else { return };
        let mut rejected = HashSet::new();
        for mut error in errors {
            let Some(identity) = rejected_rule(&mut error) else { continue };
            let index = identity.position as usize;
            *identity = self.rules[index].identity.clone();
            let identity = identity.clone();
            self.warnings.push(Warning::UnusableRule {
                ontology: identity.source.to_string(),
                position: identity.position,
                label: identity.label.as_ref().map(ToString::to_string),
                reason: error.to_string(),
            });
            rejected.insert((self.swrl_rule(index), identity));
        }
        let is_rejected = |(index, rule): (usize, &Rule)| {
            rejected.contains(&(self.swrl_rule(index), rule.identity.clone()))
        };
        let flags: Vec<bool> = self.rules.iter().enumerate().map(is_rejected).collect();
        let mut flags = flags.into_iter();
        self.rules.retain(|_| flags.next() != Some(true));
    }

    /// Identifies the SWRL rule from which the rule `index` was lowered, by its number (from 1). Rules lowered from axioms
    /// come later and have the number of the last SWRL rule; their identities tell them apart.
    fn swrl_rule(&self, index: usize) -> usize {
        self.swrl_starts.partition_point(|&start| start <= index)
    }
}

const RANGE_IN_AGGREGATE: &str = "a data range of several alternatives in an aggregate";

fn rejected_rule(error: &mut Error) -> Option<&mut RuleIdentity> {
    match error {
        Error::UnsafeHead { rule, .. }
        | Error::UnsafeBody { rule, .. }
        | Error::BuiltInArity { rule, .. }
        | Error::HeadAtom { rule, .. }
        | Error::Pattern { rule, .. }
        | Error::Unstratified { rule, .. }
        | Error::Arity { rule, .. } => Some(rule),
        _ => None,
    }
}
