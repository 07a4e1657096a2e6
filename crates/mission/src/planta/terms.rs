//! Translation of the terminology of an ontology to PDDL: predicates, derived predicates, constants
//! and their types.
//!
//! Each class and property has two predicates: the plain name for asserted facts, which actions may
//! change, and the inferred name for asserted and inferred facts. Axioms and rules become derived
//! predicates over inferred names.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use ontology::vocab::{owl, pddl as annotation};
use ontology::{ANONYMOUS, Axiom, ClassExpression, EntityKind, Iri, ObjectPropertyExpression, Ontology};
use pddl::Mentioned;
use pddl::ast::{Condition, Derived, Name, Term};
use rules::Literal;

use super::names::{self, Literals};
use super::syntax::{atom, axiom, variable};
use crate::message::Message;

/// The terminology of an ontology, translated to PDDL.
#[derive(Debug, Clone, Default)]
pub struct Terms {
    /// Arity of each plain and each inferred predicate.
    pub(super) predicates: BTreeMap<Name, usize>,
    /// Predicate for the asserted facts of each class and property: the plain name, without `inferred-`.
    pub(super) symbols: BTreeMap<Iri, Name>,
    /// Plain predicates of functional data properties.
    pub(super) functional: BTreeSet<Name>,
    pub(super) derived: Vec<Derived>,
    /// Constants for individuals and for values other than numbers, each with its type if it has
    /// one.
    pub(super) constants: BTreeMap<Name, Option<Name>>,
    /// Names of the numbers that occur in rules.
    pub(super) numbers: BTreeSet<Name>,
    pub(super) literals: Literals,
    pub(super) warnings: Vec<Message>,
    /// Individual or value that each constant denotes.
    denoted: BTreeMap<Name, Denoted>,
    /// Sets of individuals that are stated to be the same.
    same: Vec<Vec<Iri>>,
    /// Different entities or values that have one name in PDDL.
    pub(super) merged: BTreeSet<Merged>,
}

/// Two entities or values that have one name in PDDL.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Merged {
    /// Plain predicate without which the pair is irrelevant: the predicate of both, or the property that has a value.
    pub(super) predicate: Option<Name>,
    /// `true` if the pair has the name of a predicate, `false` if it has that of an object.
    pub(super) is_predicate: bool,
    /// One of the entities.
    pub(crate) iri: Option<Iri>,
    pub(crate) text: String,
}

#[derive(Debug, Clone, PartialEq)]
enum Denoted {
    Individual(Iri),
    Value(Literal),
}

impl fmt::Display for Denoted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Individual(iri) => write!(f, "<{iri}>"),
            Self::Value(value) => write!(f, "{value}"),
        }
    }
}

impl Terms {
    pub(crate) fn has(&self, predicate: &Name) -> bool {
        self.predicates.contains_key(predicate)
    }

    /// Declares the plain and inferred predicates of all classes and properties, except PLANTA's annotations,
    /// `owl:Thing` and `owl:Nothing`.
    pub(super) fn signature(&mut self, ontology: &Ontology) {
        for (kind, arity) in
            [(EntityKind::Class, 1), (EntityKind::ObjectProperty, 2), (EntityKind::DataProperty, 2)]
        {
            for iri in ontology.entities(kind) {
                if !is_annotation(iri) && !is_top(iri) && !is_bottom(iri) {
                    // A name that is both a class and a property is reported only if an axiom or
                    // rule uses it.
                    let _ = self.plain(iri, arity);
                }
            }
        }
    }

    /// Returns the plain predicate of a class or property, and declares it if necessary. Fails if the name already has
    /// another arity.
    pub(super) fn plain(&mut self, iri: &Iri, arity: usize) -> Result<Name, String> {
        let name = names::plain(iri);
        let declared_arity = *self.predicates.entry(name.clone()).or_insert(arity);
        if declared_arity != arity {
            return Err(format!("`{name}` is a class and a property, which are one predicate in PDDL"));
        }
        self.predicates.insert(names::inferred(&name), arity);
        self.symbols.insert(iri.clone(), name.clone());
        Ok(name)
    }

    /// Returns the condition that an asserted or inferred fact of a class or property holds for
    /// `arguments`.
    pub(super) fn inferred(&mut self, iri: &Iri, arguments: Vec<Term>) -> Result<Condition, String> {
        let plain = self.plain(iri, arguments.len())?;
        Ok(Condition::Atom(atom(names::inferred(&plain), arguments)))
    }

    /// Collects the constants: named individuals with their types, and values in assertions, except numbers.
    pub(super) fn types(&mut self, ontology: &Ontology) {
        let (mut kinds, mut spelled) = (BTreeMap::new(), BTreeMap::new());
        let same_individuals = ontology.axioms.iter().filter_map(|annotated| match &annotated.axiom {
            Axiom::SameIndividual(individuals) => Some(individuals.clone()),
            _ => None,
        });
        self.same = same_individuals.collect();
        for annotated in &ontology.axioms {
            match &annotated.axiom {
                Axiom::ObjectPropertyAssertion(ObjectPropertyExpression::Property(property), own, r#type)
                    if **property == *annotation::HAS_PDDL_TYPE =>
                {
                    kinds.insert(own.clone(), r#type.clone());
                }
                Axiom::DataPropertyAssertion(property, r#type, name)
                    if **property == *annotation::PDDL_NAME =>
                {
                    spelled.insert(r#type.clone(), Name::new(&name.lexical.to_lowercase()));
                }
                Axiom::ClassAssertion(ClassExpression::Class(class), own) if !is_annotation(class) => {
                    self.individual(own);
                }
                Axiom::ObjectPropertyAssertion(_, own, other) => {
                    self.individual(own);
                    self.individual(other);
                }
                Axiom::DataPropertyAssertion(property, own, value) => {
                    self.individual(own);
                    self.constant_of(value, false, Some(names::plain(property)));
                }
                _ => {}
            }
        }
        for (individual, kind) in kinds {
            self.individual(&individual);
            self.constants.insert(names::plain(&individual), spelled.get(&kind).cloned());
        }
    }

    pub(super) fn individual(&mut self, iri: &Iri) -> Name {
        let name = names::plain(iri);
        self.denote(&name, Denoted::Individual(iri.clone()), None);
        if !iri.starts_with(ANONYMOUS) {
            self.constants.entry(name.clone()).or_insert(None);
        }
        name
    }

    /// Returns the constant of a literal in a rule, and declares it.
    pub(super) fn literal(&mut self, literal: &ontology::Literal) -> Name {
        self.constant_of(literal, true, None)
    }

    /// Returns the constant of a literal, and declares it. Numbers are declared only if they occur
    /// in rules. `property` is the plain predicate of the assertion in which the literal occurs.
    fn constant_of(&mut self, literal: &ontology::Literal, in_rule: bool, property: Option<Name>) -> Name {
        let (datatype, language) = (literal.datatype.as_deref(), literal.language.as_deref());
        let value = Literal::parse(&literal.lexical, datatype, language);
        // PLANTA's domains contain `false_boolean`, however the knowledge base spells this value.
        let lexical: &str =
            if matches!(value, Literal::Boolean(_)) { &value.lexical() } else { &literal.lexical };
        self.literals.insert(value.clone(), names::literal(lexical, datatype));
        let name = self.literals.name(&value);
        self.denote(&name, Denoted::Value(value.clone()), property);
        if !value.is_numeric() {
            self.constants.entry(name.clone()).or_insert(None);
        } else if in_rule {
            self.numbers.insert(name.clone());
        }
        name
    }

    /// Records the individual or value of a constant. Reports it if the constant already denotes another one.
    /// `predicate` is [`Merged::predicate`].
    fn denote(&mut self, name: &Name, denoted: Denoted, predicate: Option<Name>) {
        let Some(other) = self.denoted.get(name) else {
            self.denoted.insert(name.clone(), denoted);
            return;
        };
        let is_same = match (other, &denoted) {
            (Denoted::Individual(other), Denoted::Individual(iri)) => self.are_same(other, iri),
            (other, denoted) => other == denoted,
        };
        if !is_same {
            let iri = match &denoted {
                Denoted::Individual(iri) => Some(iri.clone()),
                Denoted::Value(_) => None,
            };
            let text = one_name(name, &other.to_string(), &denoted.to_string());
            self.merged.insert(Merged { predicate, is_predicate: false, iri, text });
        }
    }

    /// Returns `true` if two individuals are the same by a chain of statements.
    fn are_same(&self, first: &Iri, second: &Iri) -> bool {
        let (mut reached, mut pending) = (BTreeSet::from([first]), vec![first]);
        while let Some(iri) = pending.pop() {
            for other in self.same.iter().filter(|same| same.contains(iri)).flatten() {
                if reached.insert(other) {
                    pending.push(other);
                }
            }
        }
        reached.contains(second)
    }

    /// Reports different classes and properties that have one predicate.
    pub(super) fn merged_predicates(&mut self) {
        let mut first_by_name: BTreeMap<&Name, &Iri> = BTreeMap::new();
        for (iri, name) in &self.symbols {
            match first_by_name.get(name) {
                Some(first) => {
                    let text = one_name(name, &format!("<{first}>"), &format!("<{iri}>"));
                    let (predicate, iri) = (Some(name.clone()), Some(iri.clone()));
                    self.merged.insert(Merged { predicate, is_predicate: true, iri, text });
                }
                None => {
                    first_by_name.insert(name, iri);
                }
            }
        }
    }

    /// Omits the pairs of entities with one name that are irrelevant for a domain and a problem that mention
    /// `mentioned`. Removes the predicates of these pairs, so that a later mention is an error.
    pub(super) fn omit_unused(&mut self, mentioned: &Mentioned) {
        if self.merged.is_empty() {
            return;
        }
        let relevant = self.used(mentioned);
        let is_used = |name: &Name| relevant.contains(name) || relevant.contains(&names::inferred(name));
        let unused_predicates: BTreeSet<Name> = self
            .merged
            .iter()
            .filter(|pair| pair.is_predicate)
            .filter_map(|pair| pair.predicate.clone())
            .filter(|name| !is_used(name))
            .collect();
        self.merged.retain(|pair| pair.predicate.as_ref().is_none_or(is_used));
        self.symbols.retain(|_, name| !unused_predicates.contains(name));
        self.predicates.retain(|name, _| {
            !unused_predicates.iter().any(|own| own == name || names::inferred(own) == *name)
        });
        if !unused_predicates.is_empty() {
            self.derived.retain(|axiom| relevant.contains(&axiom.head.identifier.name));
        }
    }

    /// Returns the mentioned predicates, and those on which their axioms depend.
    fn used(&self, mentioned: &Mentioned) -> BTreeSet<Name> {
        let mut predicates = mentioned.predicates.clone();
        loop {
            let mut bodies = Mentioned::default();
            for axiom in self.derived.iter().filter(|axiom| predicates.contains(&axiom.head.identifier.name))
            {
                bodies.condition(&axiom.condition);
            }
            let count = predicates.len();
            predicates.extend(bodies.predicates);
            if predicates.len() == count {
                return predicates;
            }
        }
    }

    /// Adds an axiom for each class and property: the inferred predicate holds for asserted facts.
    pub(super) fn lift(&mut self) {
        let plain: BTreeMap<Name, usize> =
            self.symbols.values().map(|name| (name.clone(), self.predicates[name])).collect();
        for (name, arity) in plain {
            let variables = &["x", "y"][..arity];
            let stated = Condition::Atom(atom(name.clone(), variables.iter().map(|v| variable(v)).collect()));
            self.derived.push(axiom(names::inferred(&name), variables, stated));
        }
    }
}

fn one_name(name: &Name, first: &str, second: &str) -> String {
    format!(
        "`{name}` would be both {first} and {second}, because PDDL ignores namespaces and case and allows fewer \
         characters; rename one of them in the knowledge base"
    )
}

pub(super) fn is_annotation(iri: &str) -> bool {
    iri.starts_with(annotation::NS)
}

pub(super) fn is_top(iri: &str) -> bool {
    iri == owl::THING
}

pub(super) fn is_bottom(iri: &str) -> bool {
    iri == owl::NOTHING
}
