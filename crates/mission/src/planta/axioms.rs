//! Translates OWL axioms to derived predicates, for the kinds of axioms that `OWLToPDDL`
//! translates. Most other axioms are reported as left out.

use std::collections::BTreeMap;

use ontology::{Axiom, Characteristic, ClassExpression, Iri, ObjectPropertyExpression, Ontology};
use pddl::ast::{Condition, Derived, Name, Span, Term};

use super::names;
use super::swrl;
use super::syntax::{atom, axiom, exists, variable};
use super::terms::{Terms, is_annotation, is_bottom, is_top};
use crate::message::Message;

impl Terms {
    pub(crate) fn new(ontology: &Ontology) -> Self {
        let mut terms = Self::default();
        terms.signature(ontology);
        terms.types(ontology);
        terms.lift();
        let mut skipped = Vec::new();
        for annotated in &ontology.axioms {
            if let Err(kind) = terms.axiom(&annotated.axiom) {
                skipped.push(kind);
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
        terms.merged_predicates();
        if !skipped.is_empty() {
            skipped.sort_unstable();
            skipped.dedup();
            let text = format!(
                "these axioms cannot be expressed as derived predicates and have no effect in the domain: {}",
                skipped.join(", ")
            );
            terms.warnings.push(Message::warning("M212", text));
        }
        // The map removes rules that several documents repeat, and sorts them by their text.
        let mut derived: BTreeMap<String, Derived> = BTreeMap::new();
        for axiom in terms.derived.drain(..) {
            derived.insert(format!("{:?} {:?}", axiom.head, axiom.condition), axiom);
        }
        terms.derived = derived.into_values().collect();
        terms
    }

    /// Translates an axiom and adds the resulting derived predicates. If the axiom has no translation, returns its kind
    /// as an error.
    fn axiom(&mut self, stated: &Axiom) -> Result<(), &'static str> {
        let [x, y, z] = [variable("x"), variable("y"), variable("z")];
        match stated {
            Axiom::SubClassOf(lower, upper) => {
                let (lower, upper) = (named(lower), named(upper));
                let (Some(lower), Some(upper)) = (lower, upper) else {
                    return Err("SubClassOf of expressions");
                };
                if is_bottom(upper) && !is_bottom(lower) || is_top(lower) && !is_top(upper) {
                    return Err("SubClassOf of owl:Thing or to owl:Nothing");
                }
                if !is_top(upper) && !is_bottom(lower) {
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
                if is_bottom(class) {
                    return Err("ObjectPropertyDomain owl:Nothing");
                }
                if !is_annotation(own) && !is_top(class) {
                    self.follows(class, &["x"], own, vec![x, y], &["y"])?;
                }
            }
            Axiom::ObjectPropertyRange(own, class) => {
                let (Some(own), Some(class)) = (property(own), named(class)) else {
                    return Err("ObjectPropertyRange of expressions");
                };
                if is_bottom(class) {
                    return Err("ObjectPropertyRange owl:Nothing");
                }
                if !is_annotation(own) && !is_top(class) {
                    self.follows(class, &["y"], own, vec![x, y], &["x"])?;
                }
            }
            Axiom::DataPropertyDomain(own, class) => {
                let Some(class) = named(class) else { return Err("DataPropertyDomain of expressions") };
                if is_bottom(class) {
                    return Err("DataPropertyDomain owl:Nothing");
                }
                if !is_annotation(own) && !is_top(class) {
                    self.follows(class, &["x"], own, vec![x, y], &["y"])?;
                }
            }
            Axiom::DisjointClasses(classes) => {
                let classes: Option<Vec<&Iri>> = classes.iter().map(named).collect();
                self.disjoint(&classes.ok_or("DisjointClasses of expressions")?)?;
            }
            Axiom::ObjectPropertyCharacteristic(Characteristic::Functional, functional_property) => {
                let functional_property =
                    property(functional_property).ok_or("FunctionalObjectProperty of an inverse")?;
                // The translation is that of `OWLToPDDL`, see docs/decisions/planta-form.md.
                self.functional(functional_property, Condition::Equal(y, z, Span::default()))?;
            }
            Axiom::FunctionalDataProperty(own) => {
                let equal = Condition::Equal(y, z, Span::default());
                let plain = self.functional(own, Condition::Not(Box::new(equal)))?;
                self.functional.insert(plain);
            }
            // Assertions are translated to initial facts elsewhere. PDDL cannot express the
            // datatype of a literal, and objects with different names are different in PDDL.
            Axiom::ClassAssertion(ClassExpression::Class(_), _)
            | Axiom::ObjectPropertyAssertion(ObjectPropertyExpression::Property(_), ..)
            | Axiom::DataPropertyAssertion(..)
            | Axiom::DataPropertyRange(..)
            | Axiom::DifferentIndividuals(_) => {}
            other => return Err(kind(other)),
        }
        Ok(())
    }

    /// Adds the derived predicate `head(parameters) ← ∃ bound. body(arguments)`.
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
                let atoms = [*left, *right].map(|class| self.inferred(class, vec![variable("x")]));
                let atoms: Result<Vec<Condition>, String> = atoms.into_iter().collect();
                alternatives.push(Condition::And(atoms.map_err(|_| "DisjointClasses of punned names")?));
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
