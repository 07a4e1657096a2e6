//! What an ontology says in general, as PDDL: predicates, derived predicates, constants and their types.
//!
//! For each class and property there are two predicates: the plain name for what is stated (and for what actions change), the
//! inferred name for what is stated or follows. Axioms and rules become derived predicates over inferred names.

use std::collections::{BTreeMap, BTreeSet};

use ontology::vocab::{owl, pddl as annotation};
use ontology::{ANONYMOUS, Axiom, ClassExpression, EntityKind, Iri, ObjectPropertyExpression, Ontology};
use pddl::ast::{Condition, Derived, Name, Term};
use rules::Literal;

use super::names::{self, Literals};
use super::syntax::{atom, axiom, variable};
use crate::message::Message;

/// What an ontology says in general.
#[derive(Debug, Clone, Default)]
pub struct Terms {
    /// The predicates, plain and inferred, with the number of their arguments.
    pub(super) predicates: BTreeMap<Name, usize>,
    /// The plain predicates of classes and properties.
    pub(super) symbols: BTreeMap<Iri, Name>,
    /// Plain predicates of data properties that have one value only.
    pub(super) functional: BTreeSet<Name>,
    /// Axioms and rules.
    pub(super) derived: Vec<Derived>,
    /// The individuals and the values other than numbers, with the type of each that has one.
    pub(super) constants: BTreeMap<Name, Option<Name>>,
    /// The numbers that rules name.
    pub(super) numbers: BTreeSet<Name>,
    /// The names of literals.
    pub(super) literals: Literals,
    /// What is left out.
    pub(super) warnings: Vec<Message>,
}

impl Terms {
    /// Whether something is named so: a class or property, stated or inferred.
    pub(crate) fn has(&self, predicate: &Name) -> bool {
        self.predicates.contains_key(predicate)
    }

    /// The classes and properties.
    pub(super) fn signature(&mut self, ontology: &Ontology) {
        for (kind, arity) in
            [(EntityKind::Class, 1), (EntityKind::ObjectProperty, 2), (EntityKind::DataProperty, 2)]
        {
            for iri in ontology.entities(kind) {
                if !is_annotation(iri) && !is_top(iri) {
                    // Punned names are told apart by what is said of them below.
                    let _ = self.plain(iri, arity);
                }
            }
        }
    }

    /// The plain predicate of a class or property.
    ///
    /// # Errors
    /// Another one of the same name has another number of arguments.
    pub(super) fn plain(&mut self, iri: &Iri, arity: usize) -> Result<Name, String> {
        let name = names::plain(iri);
        let known = *self.predicates.entry(name.clone()).or_insert(arity);
        if known != arity {
            return Err(format!("`{name}` is a class and a property, which are one predicate in PDDL"));
        }
        self.predicates.insert(names::inferred(&name), arity);
        self.symbols.insert(iri.clone(), name.clone());
        Ok(name)
    }

    /// That a class or property holds of terms, stated or inferred.
    pub(super) fn inferred(&mut self, iri: &Iri, arguments: Vec<Term>) -> Result<Condition, String> {
        let plain = self.plain(iri, arguments.len())?;
        Ok(Condition::Atom(atom(names::inferred(&plain), arguments)))
    }

    /// Constants: named individuals with their types, and the values of statements.
    pub(super) fn types(&mut self, ontology: &Ontology) {
        let (mut kinds, mut spelled) = (BTreeMap::new(), BTreeMap::new());
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
                Axiom::DataPropertyAssertion(_, own, value) => {
                    self.individual(own);
                    self.literal(value, false);
                }
                _ => {}
            }
        }
        for (individual, kind) in kinds {
            self.constants.insert(names::plain(&individual), spelled.get(&kind).cloned());
        }
    }

    /// The constant of an individual.
    pub(super) fn individual(&mut self, iri: &Iri) -> Name {
        let name = names::plain(iri);
        if !iri.starts_with(ANONYMOUS) {
            self.constants.entry(name.clone()).or_insert(None);
        }
        name
    }

    /// The constant of a value; numbers are constants where rules name them.
    pub(super) fn literal(&mut self, literal: &ontology::Literal, in_rule: bool) -> Name {
        let (datatype, language) = (literal.datatype.as_deref(), literal.language.as_deref());
        let value = Literal::parse(&literal.lexical, datatype, language);
        self.literals.insert(value.clone(), names::literal(&literal.lexical, datatype));
        let name = self.literals.name(&value);
        if !value.is_numeric() {
            self.constants.entry(name.clone()).or_insert(None);
        } else if in_rule {
            self.numbers.insert(name.clone());
        }
        name
    }

    /// What is stated holds.
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

/// Whether an IRI is one of PLANTA's, with which ontologies say what PDDL calls things.
pub(super) fn is_annotation(iri: &str) -> bool {
    iri.starts_with(annotation::NS)
}

/// Whether an IRI is that of the class of everything, which is not a condition, or of nothing.
pub(super) fn is_top(iri: &str) -> bool {
    [owl::THING, owl::NOTHING].contains(&iri)
}
