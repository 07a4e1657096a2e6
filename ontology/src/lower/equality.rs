//! Equality and difference of individuals as rules: table 4 of OWL 2 RL, instantiated for the relations in use.
//!
//! OWL makes no unique-name assumption: two names may stand for one individual, and a functional property with two
//! values says that they do. `sameAs` is then an equivalence (eq-sym, eq-trans) under which every relation is closed
//! (eq-rep-s, eq-rep-o). Pairs of one name with itself are not derived; nothing needs them. `differentFrom` is what
//! is stated, and what follows from disjoint classes and from different values of functional properties; it is
//! derived only where some rule asks for it.
//!
//! The engine itself compares symbols. So under the unique-name assumption of [`Equality::UniqueNames`] no rule of
//! this file is needed: a functional object property then concludes nothing, and any two names differ.

use std::collections::BTreeSet;

use rules::{Atom, Rule, RuleIdentity, Symbol, Term};

use super::context::{Context, Variables};
use super::{AXIOM_SOURCE, INTERNAL};
use crate::owl::{AnnotatedAxiom, Axiom, Characteristic, ClassExpression};
use crate::vocab::owl;

/// Whether two names can stand for one individual.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Equality {
    /// They can: the semantics of OWL.
    #[default]
    Owl,
    /// They cannot: the semantics of databases and of PDDL.
    UniqueNames,
}

/// Adds the rules for equality, if anything concludes or states that two names are one, and for difference, if
/// anything asks.
pub(crate) fn lower(axioms: &[AnnotatedAxiom], context: &mut Context) {
    let (same, different) = (context.name(owl::SAME_AS), context.name(owl::DIFFERENT_FROM));
    let heads = |rule: &Rule| rule.head.iter().any(|atom| matches!(atom, Atom::Same(..)));
    let asks = |rule: &Rule| {
        rule.body
            .iter()
            .any(|atom| matches!(atom, Atom::Relation { predicate, .. } if *predicate == different))
    };
    let merges = context.rules.iter().any(heads) || context.facts.iter().any(|fact| fact.predicate == same);
    if context.rules.iter().any(asks) {
        difference(axioms, context);
    }
    if merges {
        equality(context, same, different);
    }
}

fn identity(label: &str, position: usize) -> RuleIdentity {
    RuleIdentity { source: AXIOM_SOURCE.into(), label: Some(label.into()), position: position as u32 }
}

/// `sameAs` is an equivalence, no two individuals are both same and different, and relations respect `sameAs`.
fn equality(context: &mut Context, same: Symbol, different: Symbol) {
    let mut v = Variables::default();
    let (x, y, z) = (v.fresh("x"), v.fresh("y"), v.fresh("z"));
    let atom = |predicate, first, second| Atom::relation(predicate, [first, second]);
    let is = |first, second| atom(same, first, second);
    context.rule(&identity("eq-sym", 0), vec![is(y, x)], vec![is(x, y)], &v);
    let chain = vec![is(x, y), is(y, z), Atom::Different(x, z)];
    context.rule(&identity("eq-trans", 0), vec![is(x, z)], chain, &v);
    context.rule(&identity("eq-diff1", 0), Vec::new(), vec![is(x, y), atom(different, x, y)], &v);
    context.rule(&identity("eq-diff1", 1), Vec::new(), vec![atom(different, x, x)], &v);
    for (relation, arity) in relations(context, same) {
        let position = relation.index();
        if arity == 1 {
            let body = vec![Atom::relation(relation, [x]), is(x, y)];
            context.rule(&identity("eq-rep-c", position), vec![Atom::relation(relation, [y])], body, &v);
        } else {
            let edge = || atom(relation, x, y);
            let subject = vec![edge(), is(x, z)];
            context.rule(&identity("eq-rep-s", position), vec![atom(relation, z, y)], subject, &v);
            let object = vec![edge(), is(y, z)];
            context.rule(&identity("eq-rep-o", position), vec![atom(relation, x, z)], object, &v);
        }
    }
}

/// Classes and properties that rules and facts mention, in a fixed order.
fn relations(context: &Context, same: Symbol) -> BTreeSet<(Symbol, usize)> {
    let atoms = context.rules.iter().flat_map(|rule| rule.head.iter().chain(&rule.body));
    let mentioned = atoms.filter_map(|atom| match atom {
        Atom::Relation { predicate, arguments } => Some((*predicate, arguments.len())),
        _ => None,
    });
    let stated = context.facts.iter().map(|fact| (fact.predicate, fact.arguments.len()));
    let internal =
        |symbol| context.symbols.value(symbol).as_name().is_none_or(|name| name.starts_with(INTERNAL));
    let all = mentioned.chain(stated).filter(|(symbol, _)| *symbol != same && !internal(*symbol));
    all.collect()
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
