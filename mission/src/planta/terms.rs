//! What an ontology says in general, as PDDL: predicates, derived predicates, constants and their types.
//!
//! For each class and property there are two predicates: the plain name for what is stated (and for what actions change), the
//! inferred name for what is stated or follows. Axioms and rules become derived predicates over inferred names. Those are the
//! axioms that `OWLToPDDL` translates; of the others it is said that they are left out.

use std::collections::{BTreeMap, BTreeSet};

use ontology::vocab::{owl, pddl as annotation};
use ontology::{
    ANONYMOUS, Axiom, Characteristic, ClassExpression, EntityKind, Iri, ObjectPropertyExpression, Ontology,
};
use pddl::ast::{
    Atom, Condition, Declaration, Derived, Identifier, Name, Span, Term, TypeExpression, TypedName,
};
use rules::Literal;

use super::names::{self, Literals};
use super::swrl;
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
    /// What an ontology says.
    pub(crate) fn new(ontology: &Ontology) -> Self {
        let mut terms = Self::default();
        terms.signature(ontology);
        terms.types(ontology);
        terms.lift();
        let mut left = Vec::new();
        for annotated in &ontology.axioms {
            if let Err(kind) = terms.axiom(&annotated.axiom) {
                left.push(kind);
            }
        }
        for rule in &ontology.rules {
            match swrl::derived(rule, &mut terms) {
                Ok(derived) => terms.derived.extend(derived),
                Err(reason) => {
                    let label = rule.label.as_deref().map_or_else(String::new, |label| format!(" ({label})"));
                    let text = format!(
                        "the rule {}#{}{label} is left out of the domain: {reason}",
                        rule.ontology, rule.position
                    );
                    terms.warnings.push(Message::warning("M211", text));
                }
            }
        }
        if !left.is_empty() {
            left.sort_unstable();
            left.dedup();
            let text = format!(
                "these axioms have no form as derived predicates, and conclude nothing in the domain: {}",
                left.join(", ")
            );
            terms.warnings.push(Message::warning("M212", text));
        }
        // Rules that several documents state are one, and the order is that of the text.
        let mut derived: BTreeMap<String, Derived> = BTreeMap::new();
        for axiom in terms.derived.drain(..) {
            derived.insert(format!("{:?} {:?}", axiom.head, axiom.condition), axiom);
        }
        terms.derived = derived.into_values().collect();
        terms
    }

    /// Whether something is named so: a class or property, stated or inferred.
    pub(crate) fn has(&self, predicate: &Name) -> bool {
        self.predicates.contains_key(predicate)
    }

    /// The classes and properties.
    fn signature(&mut self, ontology: &Ontology) {
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
    fn types(&mut self, ontology: &Ontology) {
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
    fn lift(&mut self) {
        let plain: BTreeMap<Name, usize> =
            self.symbols.values().map(|name| (name.clone(), self.predicates[name])).collect();
        for (name, arity) in plain {
            let variables = &["x", "y"][..arity];
            let stated = Condition::Atom(atom(name.clone(), variables.iter().map(|v| variable(v)).collect()));
            self.derived.push(axiom(names::inferred(&name), variables, stated));
        }
    }

    /// An axiom as a derived predicate.
    ///
    /// # Errors
    /// It has no such form: what kind of axiom it is.
    fn axiom(&mut self, stated: &Axiom) -> Result<(), &'static str> {
        let [x, y, z] = [variable("x"), variable("y"), variable("z")];
        match stated {
            Axiom::SubClassOf(lower, upper) => {
                let (lower, upper) = (named(lower), named(upper));
                let (Some(lower), Some(upper)) = (lower, upper) else {
                    return Err("SubClassOf of expressions");
                };
                if !is_top(upper) && !is_top(lower) {
                    self.follows(upper, &["x"], lower, vec![x], &[])?;
                }
            }
            Axiom::SubObjectPropertyOf(lower, upper) => {
                let (Some(lower), Some(upper)) = (property(lower), property(upper)) else {
                    return Err("SubObjectPropertyOf with inverses");
                };
                self.follows(upper, &["x", "y"], lower, vec![x, y], &[])?;
            }
            Axiom::ObjectPropertyDomain(own, class) => {
                let (Some(own), Some(class)) = (property(own), named(class)) else {
                    return Err("ObjectPropertyDomain of expressions");
                };
                if !is_annotation(own) && !is_top(class) {
                    self.follows(class, &["x"], own, vec![x, y], &["y"])?;
                }
            }
            Axiom::ObjectPropertyRange(own, class) => {
                let (Some(own), Some(class)) = (property(own), named(class)) else {
                    return Err("ObjectPropertyRange of expressions");
                };
                if !is_annotation(own) && !is_top(class) {
                    self.follows(class, &["y"], own, vec![x, y], &["x"])?;
                }
            }
            Axiom::DataPropertyDomain(own, class) => {
                let Some(class) = named(class) else { return Err("DataPropertyDomain of expressions") };
                if !is_annotation(own) && !is_top(class) {
                    self.follows(class, &["x"], own, vec![x, y], &["y"])?;
                }
            }
            Axiom::DisjointClasses(classes) => {
                let classes: Option<Vec<&Iri>> = classes.iter().map(named).collect();
                self.disjoint(&classes.ok_or("DisjointClasses of expressions")?)?;
            }
            Axiom::ObjectPropertyCharacteristic(Characteristic::Functional, own) => {
                let own = property(own).ok_or("FunctionalObjectProperty of an inverse")?;
                // As `OWLToPDDL` has it, see docs/decisions/planta-form.md.
                self.functional(own, Condition::Equal(y, z, Span::default()))?;
            }
            Axiom::FunctionalDataProperty(own) => {
                let equal = Condition::Equal(y, z, Span::default());
                let plain = self.functional(own, Condition::Not(Box::new(equal)))?;
                self.functional.insert(plain);
            }
            // Statements are no axioms in general, and what a literal's datatype is PDDL cannot say.
            Axiom::ClassAssertion(ClassExpression::Class(_), _)
            | Axiom::ObjectPropertyAssertion(ObjectPropertyExpression::Property(_), ..)
            | Axiom::DataPropertyAssertion(..)
            | Axiom::DataPropertyRange(..)
            | Axiom::DifferentIndividuals(_) => {}
            other => return Err(kind(other)),
        }
        Ok(())
    }

    /// `head(parameters) ← body(arguments)`, with bound variables.
    fn follows(
        &mut self,
        head: &Iri,
        parameters: &[&str],
        body: &Iri,
        arguments: Vec<Term>,
        bound: &[&str],
    ) -> Result<(), &'static str> {
        let clash = |_| "axioms of names that are a class and a property";
        let head = self.plain(head, parameters.len()).map_err(clash)?;
        let condition = self.inferred(body, arguments).map_err(clash)?;
        self.derived.push(axiom(names::inferred(&head), parameters, exists(bound, condition)));
        Ok(())
    }

    fn disjoint(&mut self, classes: &[&Iri]) -> Result<(), &'static str> {
        let mut alternatives = Vec::new();
        for (position, left) in classes.iter().enumerate() {
            for right in &classes[position + 1..] {
                let both = [*left, *right].map(|class| self.inferred(class, vec![variable("x")]));
                let both: Result<Vec<Condition>, String> = both.into_iter().collect();
                alternatives.push(Condition::And(both.map_err(|_| "DisjointClasses of punned names")?));
            }
        }
        self.contradiction(exists(&["x"], Condition::Or(alternatives)));
        Ok(())
    }

    fn functional(&mut self, own: &Iri, test: Condition) -> Result<Name, &'static str> {
        let plain = self.plain(own, 2).map_err(|_| "functional properties that are classes, too")?;
        let inferred = names::inferred(&plain);
        let value = |v: &str| Condition::Atom(atom(inferred.clone(), vec![variable("x"), variable(v)]));
        let body = Condition::And(vec![value("y"), value("z"), test]);
        self.contradiction(exists(&["x", "y", "z"], body));
        Ok(plain)
    }

    fn contradiction(&mut self, body: Condition) {
        self.predicates.insert(Name::new(names::INCONSISTENT), 0);
        self.derived.push(axiom(Name::new(names::INCONSISTENT), &[], body));
    }
}

/// The kind of an axiom, as the specification names it.
fn kind(axiom: &Axiom) -> &'static str {
    match axiom {
        Axiom::EquivalentClasses(_) => "EquivalentClasses",
        Axiom::DisjointUnion(..) => "DisjointUnion",
        Axiom::SubPropertyChainOf(..) => "SubPropertyChainOf",
        Axiom::EquivalentObjectProperties(_) => "EquivalentObjectProperties",
        Axiom::DisjointObjectProperties(_) => "DisjointObjectProperties",
        Axiom::InverseObjectProperties(..) => "InverseObjectProperties",
        Axiom::ObjectPropertyCharacteristic(characteristic, _) => match characteristic {
            Characteristic::Functional => "FunctionalObjectProperty",
            Characteristic::InverseFunctional => "InverseFunctionalObjectProperty",
            Characteristic::Reflexive => "ReflexiveObjectProperty",
            Characteristic::Irreflexive => "IrreflexiveObjectProperty",
            Characteristic::Symmetric => "SymmetricObjectProperty",
            Characteristic::Asymmetric => "AsymmetricObjectProperty",
            Characteristic::Transitive => "TransitiveObjectProperty",
        },
        Axiom::SubDataPropertyOf(..) => "SubDataPropertyOf",
        Axiom::EquivalentDataProperties(_) => "EquivalentDataProperties",
        Axiom::DisjointDataProperties(_) => "DisjointDataProperties",
        Axiom::DatatypeDefinition(..) => "DatatypeDefinition",
        Axiom::HasKey(..) => "HasKey",
        Axiom::SameIndividual(_) => "SameIndividual",
        Axiom::NegativeObjectPropertyAssertion(..) | Axiom::NegativeDataPropertyAssertion(..) => {
            "negative assertions"
        }
        _ => "assertions of expressions",
    }
}

/// Whether an IRI is one of PLANTA's, with which ontologies say what PDDL calls things.
pub(super) fn is_annotation(iri: &str) -> bool {
    iri.starts_with(annotation::NS)
}

/// Whether an IRI is that of the class of everything, which is no condition, or of nothing.
pub(super) fn is_top(iri: &str) -> bool {
    [owl::THING, owl::NOTHING].contains(&iri)
}

fn named(class: &ClassExpression) -> Option<&Iri> {
    match class {
        ClassExpression::Class(iri) => Some(iri),
        _ => None,
    }
}

fn property(property: &ObjectPropertyExpression) -> Option<&Iri> {
    match property {
        ObjectPropertyExpression::Property(iri) => Some(iri),
        ObjectPropertyExpression::Inverse(_) => None,
    }
}

pub(super) fn identifier(name: Name) -> Identifier {
    Identifier { name, span: Span::default() }
}

pub(super) fn variable(name: &str) -> Term {
    Term::Variable(identifier(Name::new(name)))
}

pub(super) fn atom(predicate: Name, arguments: Vec<Term>) -> Atom {
    Atom { predicate: identifier(predicate), arguments, span: Span::default() }
}

/// Entries of a typed list that may be anything.
pub(super) fn untyped(names: &[&str]) -> Vec<TypedName> {
    let entry = |name: &&str| TypedName {
        identifier: identifier(Name::new(name)),
        r#type: TypeExpression::default(),
    };
    names.iter().map(entry).collect()
}

/// A condition in which some variables may stand for anything.
pub(super) fn exists(bound: &[&str], condition: Condition) -> Condition {
    if bound.is_empty() { condition } else { Condition::Exists(untyped(bound), Box::new(condition)) }
}

/// A derived predicate.
pub(super) fn axiom(head: Name, parameters: &[&str], condition: Condition) -> Derived {
    let head = Declaration { identifier: identifier(head), parameters: untyped(parameters) };
    Derived { head, condition, span: Span::default() }
}
