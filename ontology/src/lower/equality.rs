//! Equality and difference of individuals: table 4 of OWL 2 RL.
//!
//! OWL makes no unique-name assumption: two names may stand for one individual, and a functional property with two
//! values says that they do. The engine then treats `sameAs` as equality. `differentFrom` is what is stated, and what
//! follows from disjoint classes and from different values of functional properties; it is derived only where some rule
//! asks for it.
//!
//! Under the unique-name assumption of [`UniqueNames`](super::Equality::UniqueNames) no rule of this file is needed: a functional object
//! property then concludes nothing, and any two names differ.

use std::collections::HashSet;

use rules::{Atom, Rule, RuleIdentity, Symbol, Term};

use super::context::{AXIOM_SOURCE, Context, Variables};
use super::groups;
use crate::error::Warning;
use crate::owl::{AnnotatedAxiom, Axiom, Characteristic, ClassExpression, EntityKind};
use crate::vocab::owl;

/// Whether anything concludes or states that two names are one; adds the rules for difference, if anything but the
/// constraint that forbids to differ from oneself asks.
pub(crate) fn lower(axioms: &[AnnotatedAxiom], context: &mut Context) -> bool {
    let (same, different) = (context.name(owl::SAME_AS), context.name(owl::DIFFERENT_FROM));
    let heads = |rule: &Rule| rule.head.iter().any(|atom| matches!(atom, Atom::Same(..)));
    let asks = |rule: &Rule| {
        let is_difference =
            |atom: &Atom| matches!(atom, Atom::Relation { predicate, .. } if *predicate == different);
        !(rule.head.is_empty() && rule.body.len() == 1) && rule.body.iter().any(is_difference)
    };
    let merges = context.rules.iter().any(heads) || context.facts.iter().any(|fact| fact.predicate == same);
    if context.rules.iter().any(asks) {
        difference(axioms, context);
    }
    if merges {
        entities(context);
    }
    merges
}

/// Classes and properties that are individuals, too, and may turn out to be one individual, have the same members then (eq-rep
/// of OWL 2 RL; those that are stated to be one have the same members anyway).
fn entities(context: &mut Context) {
    let identity = RuleIdentity { source: AXIOM_SOURCE.into(), label: Some("eq-rep".into()), position: 0 };
    let mut variables = Variables::default();
    let (x, y) = (variables.fresh("x"), variables.fresh("y"));
    let named: HashSet<Symbol> = context.facts.iter().flat_map(|fact| fact.arguments.to_vec()).collect();
    for (kind, kinds, arguments) in [
        (EntityKind::Class, "classes", vec![x]),
        (EntityKind::ObjectProperty, "object properties", vec![x, y]),
        (EntityKind::DataProperty, "data properties", vec![x, y]),
    ] {
        let all: Vec<Symbol> = context.all(kind).iter().map(|iri| context.name(iri)).collect();
        let punned: Vec<Symbol> = all.into_iter().filter(|symbol| named.contains(symbol)).collect();
        if punned.len() > MOST_PUNNED {
            let what = format!("{} names of {kinds} are individuals, too", punned.len());
            let reason = "too many to ask of each pair whether it is one".to_owned();
            context.warnings.push(Warning::OutsideProfile { axiom: what, partly: true, reason });
            continue;
        }
        for (one, other) in punned.iter().flat_map(|one| punned.iter().map(move |other| (*one, *other))) {
            if one != other {
                let same = Atom::Same(Term::Constant(one), Term::Constant(other));
                let body = vec![Atom::relation(one, arguments.clone()), same];
                let head = vec![Atom::relation(other, arguments.clone())];
                context.rule(&identity, head, body, &variables);
            }
        }
    }
}

/// Of so many names that stand for an individual and a class at once, each pair has a rule.
const MOST_PUNNED: usize = 32;

fn identity(label: &str, position: usize) -> RuleIdentity {
    RuleIdentity { source: AXIOM_SOURCE.into(), label: Some(label.into()), position: position as u32 }
}

/// What makes two individuals different without saying so.
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
            Axiom::DisjointClasses(classes) if classes.len() > groups::PAIRS => {
                let member = groups::relation(context, &annotated.axiom.to_string());
                groups::differ(context, &identity, member);
            }
            Axiom::DifferentIndividuals(individuals) if individuals.len() > groups::PAIRS => {
                let member = groups::relation(context, &annotated.axiom.to_string());
                groups::differ(context, &identity, member);
            }
            Axiom::DisjointClasses(classes) => {
                for (place, first) in classes.iter().enumerate() {
                    for second in &classes[place + 1..] {
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
