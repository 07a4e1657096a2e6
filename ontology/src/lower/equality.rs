//! Equality and difference of individuals: table 4 of OWL 2 RL.
//!
//! OWL makes no unique name assumption: two names can denote the same individual. If a functional property has two
//! values, for example, both names denote one individual. The engine then treats `sameAs` as equality. `differentFrom`
//! holds if it is stated, if a rule of the knowledge base concludes it, or if it follows from `DisjointClasses`,
//! from different values of functional properties, or from different subjects of inverse functional ones. Differences
//! of the last three kinds, and those of large stated sets, are derived only if a rule depends on `differentFrom`.
//!
//! Under the unique name assumption ([`UniqueNames`](super::Equality::UniqueNames)) any two names differ, and the only
//! rule of this file is the constraint that no two names are the same. A functional object property, an object
//! cardinality of at most 1, a key, and a class of listed individuals become constraints, too. Without the check
//! ([`UncheckedUniqueNames`](super::Equality::UncheckedUniqueNames)) none of these has a consequence.

use std::collections::HashSet;

use rules::{Atom, Rule, RuleIdentity, Symbol, Term};

use super::context::{AXIOM_SOURCE, Context, Variables};
use super::groups;
use crate::error::Warning;
use crate::owl::{AnnotatedAxiom, Axiom, Characteristic, ClassExpression, EntityKind};
use crate::vocab::owl;

/// Adds the rules of difference if a rule depends on `differentFrom`. Returns `true` if a rule or fact can
/// make two names equal. In this case it also calls [`entities`].
pub(crate) fn lower(axioms: &[AnnotatedAxiom], context: &mut Context) -> bool {
    let (same_as, different) = (context.name(owl::SAME_AS), context.name(owl::DIFFERENT_FROM));
    let merges_names = |rule: &Rule| rule.head.iter().any(|atom| matches!(atom, Atom::Same(..)));
    let depends = |rule: &Rule| {
        // The constraint against `differentFrom(x, x)` alone does not require derived differences.
        let is_difference = |atom: &Atom| match atom {
            Atom::Relation { predicate, arguments } | Atom::Not { predicate, arguments } => {
                *predicate == different && arguments.first() != arguments.last()
            }
            _ => false,
        };
        rule.body.iter().any(|atom| is_difference(atom) || atom.parts().iter().any(is_difference))
    };
    let merges =
        context.rules.iter().any(merges_names) || context.facts.iter().any(|fact| fact.predicate == same_as);
    if context.rules.iter().any(depends) {
        difference(axioms, context);
    }
    if merges {
        entities(context);
    }
    merges
}

/// Adds the constraint that no two different names are the same, for the unique name assumption.
pub(crate) fn forbid(context: &mut Context) {
    let mut variables = Variables::default();
    let (x, y) = (variables.fresh("x"), variables.fresh("y"));
    let body = vec![context.relation(owl::SAME_AS, [x, y]), Atom::Different(x, y)];
    context.rule(&identity("unique names", 0), Vec::new(), body, &variables);
}

/// Adds rule eq-rep of OWL 2 RL for classes and properties that are individuals, too: names that become equal
/// have the same members. If more than [`MAX_PUNNED_NAMES`] names of a kind are individuals, too, adds a
/// warning instead. In any case, the lowering of `SameIndividual` adds rules without a condition for names
/// that are stated to be equal.
fn entities(context: &mut Context) {
    let identity = RuleIdentity { source: AXIOM_SOURCE.into(), label: Some("eq-rep".into()), position: 0 };
    let mut variables = Variables::default();
    let (x, y) = (variables.fresh("x"), variables.fresh("y"));
    let individuals: HashSet<Symbol> =
        context.facts.iter().flat_map(|fact| fact.arguments.to_vec()).collect();
    for (kind, kinds, arguments) in [
        (EntityKind::Class, "classes", vec![x]),
        (EntityKind::ObjectProperty, "object properties", vec![x, y]),
        (EntityKind::DataProperty, "data properties", vec![x, y]),
    ] {
        let symbols: Vec<Symbol> =
            context.entities_of_kind(kind).iter().map(|iri| context.name(iri)).collect();
        let punned: Vec<Symbol> = symbols.into_iter().filter(|symbol| individuals.contains(symbol)).collect();
        // The number of rules is quadratic in the number of names.
        if punned.len() > MAX_PUNNED_NAMES {
            let subject = format!("{} names of {kinds} are individuals, too", punned.len());
            let reason = "too many to ask of each pair whether it is one".to_owned();
            context.warnings.push(Warning::OutsideProfile { axiom: subject, partly: true, reason });
            continue;
        }
        for (name, second_name) in
            punned.iter().flat_map(|name| punned.iter().map(move |second_name| (*name, *second_name)))
        {
            if name != second_name {
                let same = Atom::Same(Term::Constant(name), Term::Constant(second_name));
                let body = vec![Atom::relation(name, arguments.clone()), same];
                let head = vec![Atom::relation(second_name, arguments.clone())];
                context.rule(&identity, head, body, &variables);
            }
        }
    }
}

/// Limit on the number of names of one kind that are individuals, too, because each pair of these names
/// has a rule.
const MAX_PUNNED_NAMES: usize = 32;

fn identity(label: &str, position: usize) -> RuleIdentity {
    RuleIdentity { source: AXIOM_SOURCE.into(), label: Some(label.into()), position: position as u32 }
}

fn difference(axioms: &[AnnotatedAxiom], context: &mut Context) {
    let mut variables = Variables::default();
    let (x, y, p, q) =
        (variables.fresh("x"), variables.fresh("y"), variables.fresh("p"), variables.fresh("q"));
    let differ = |context: &mut Context, first: Term, second: Term| {
        context.relation(owl::DIFFERENT_FROM, [first, second])
    };
    let (forward, backward) = (differ(context, x, y), differ(context, y, x));
    context.rule(
        &identity("differentFrom is symmetric", 0),
        vec![backward],
        vec![forward.clone()],
        &variables,
    );
    for (position, annotated) in axioms.iter().enumerate() {
        let identity = super::context::identity(&annotated.axiom, position);
        match &annotated.axiom {
            Axiom::DisjointClasses(classes) if classes.len() > groups::MAX_PAIRED_MEMBERS => {
                let member = groups::relation(context, &annotated.axiom.to_string());
                groups::differ(context, &identity, member);
            }
            Axiom::DifferentIndividuals(individuals) if individuals.len() > groups::MAX_PAIRED_MEMBERS => {
                let member = groups::relation(context, &annotated.axiom.to_string());
                groups::differ(context, &identity, member);
            }
            Axiom::DisjointClasses(classes) => {
                for (index, first) in classes.iter().enumerate() {
                    for second in &classes[index + 1..] {
                        if let (ClassExpression::Class(first), ClassExpression::Class(second)) =
                            (first, second)
                        {
                            let body = vec![context.relation(first, [x]), context.relation(second, [y])];
                            context.rule(&identity, vec![forward.clone()], body, &variables);
                        }
                    }
                }
            }
            Axiom::ObjectPropertyCharacteristic(Characteristic::Functional, property) => {
                let (first, second) = (context.property(property, x, p), context.property(property, y, q));
                let body = vec![first, second, differ(context, p, q)];
                context.rule(&identity, vec![forward.clone()], body, &variables);
            }
            Axiom::ObjectPropertyCharacteristic(Characteristic::InverseFunctional, property) => {
                let (first, second) = (context.property(property, p, x), context.property(property, q, y));
                let body = vec![first, second, differ(context, p, q)];
                context.rule(&identity, vec![forward.clone()], body, &variables);
            }
            Axiom::FunctionalDataProperty(property) => {
                let first = context.relation(property, [x, p]);
                let second = context.relation(property, [y, q]);
                let body = vec![first, second, Atom::Different(p, q)];
                context.rule(&identity, vec![forward.clone()], body, &variables);
            }
            _ => {}
        }
    }
}
