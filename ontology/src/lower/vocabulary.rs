//! Semantics of OWL's own classes and properties: `owl:Thing`, `owl:Nothing`, `owl:topObjectProperty`, the bottom
//! properties, and `differentFrom`.
//!
//! Constraints forbid members of `owl:Nothing` and of the bottom properties in every knowledge base.
//! `owl:Thing` contains every individual that the knowledge base names or describes. Its facts are derived only
//! if a rule or fact depends on them.

use std::collections::BTreeSet;

use rules::{Atom, RuleIdentity, Symbol, Term};

use super::context::{AXIOM_SOURCE, Context, Variables};
use crate::owl::{Axiom, EntityKind, Iri, Ontology};
use crate::vocab::owl;

fn identity(label: &str) -> RuleIdentity {
    RuleIdentity { source: AXIOM_SOURCE.into(), label: Some(label.into()), position: 0 }
}

pub(crate) fn lower(ontology: &Ontology, context: &mut Context) {
    let mut variables = Variables::default();
    let (x, y) = (variables.fresh("x"), variables.fresh("y"));
    let forbidden = [
        ("cls-nothing2", owl::NOTHING, vec![x]),
        ("eq-diff1", owl::DIFFERENT_FROM, vec![x, x]),
        ("owl:bottomObjectProperty", owl::BOTTOM_OBJECT_PROPERTY, vec![x, y]),
        ("owl:bottomDataProperty", owl::BOTTOM_DATA_PROPERTY, vec![x, y]),
    ];
    for (label, name, arguments) in forbidden {
        let atom = Atom::relation(context.name(name), arguments);
        context.rule(&identity(label), Vec::new(), vec![atom], &variables);
    }
    if mentioned_symbol(context, owl::TOP_OBJECT_PROPERTY).is_some() {
        let body = vec![context.relation(owl::THING, [x]), context.relation(owl::THING, [y])];
        let head = vec![context.relation(owl::TOP_OBJECT_PROPERTY, [x, y])];
        context.rule(&identity("owl:topObjectProperty"), head, body, &variables);
    }
    if let Some(thing) = mentioned_symbol(context, owl::THING) {
        things(ontology, thing, context);
    }
}

/// Returns the symbol of `name` if a rule or fact mentions it. The symbol table alone is not sufficient,
/// because it keeps the names of documents that have been retracted.
fn mentioned_symbol(context: &Context, name: &str) -> Option<Symbol> {
    let symbol = context.symbols.find_name(name)?;
    let mentions = |atom: &Atom| {
        let predicate = match atom {
            Atom::Relation { predicate, .. } | Atom::Not { predicate, .. } => Some(*predicate),
            _ => None,
        };
        predicate == Some(symbol) || atom.terms().contains(&Term::Constant(symbol))
    };
    let mut atoms = context.rules.iter().flat_map(|rule| rule.head.iter().chain(&rule.body));
    let in_rules = atoms.any(|atom| mentions(atom) || atom.parts().iter().any(mentions));
    let in_facts =
        || context.facts.iter().any(|fact| fact.predicate == symbol || fact.arguments.contains(&symbol));
    (in_rules || in_facts()).then_some(symbol)
}

fn things(ontology: &Ontology, thing: Symbol, context: &mut Context) {
    let mut variables = Variables::default();
    let (x, y) = (variables.fresh("x"), variables.fresh("y"));
    let (label, mut names): (_, BTreeSet<Symbol>) = (identity("owl:Thing"), BTreeSet::new());
    let add_member_rule = |context: &mut Context, iri: &str, arguments: Vec<Term>, member: Term| {
        let atom = Atom::relation(context.name(iri), arguments);
        context.rule(&label, vec![Atom::relation(thing, [member])], vec![atom], &variables);
    };
    let built_in = [owl::THING, owl::NOTHING, owl::TOP_OBJECT_PROPERTY, owl::BOTTOM_OBJECT_PROPERTY];
    let entities: Vec<&(EntityKind, Iri)> =
        ontology.entities.iter().filter(|(_, iri)| !built_in.contains(&&**iri)).collect();
    for (kind, iri) in entities {
        match kind {
            EntityKind::Class => add_member_rule(context, iri, vec![x], x),
            EntityKind::DataProperty => add_member_rule(context, iri, vec![x, y], x),
            EntityKind::ObjectProperty => {
                add_member_rule(context, iri, vec![x, y], x);
                add_member_rule(context, iri, vec![x, y], y);
            }
            EntityKind::NamedIndividual => {
                names.insert(context.name(iri));
            }
            EntityKind::AnnotationProperty | EntityKind::Datatype => {}
        }
    }
    add_member_rule(context, owl::DIFFERENT_FROM, vec![x, y], x);
    add_member_rule(context, owl::DIFFERENT_FROM, vec![x, y], y);
    for annotated in &ontology.axioms {
        match &annotated.axiom {
            Axiom::SameIndividual(individuals) => {
                names.extend(individuals.iter().map(|individual| context.name(individual)));
            }
            Axiom::ClassAssertion(_, individual) => {
                names.insert(context.name(individual));
            }
            _ => {}
        }
    }
    let atoms = context.rules.iter().flat_map(|rule| rule.head.iter().chain(&rule.body));
    let terms = atoms.flat_map(|atom| match atom {
        Atom::Relation { .. } | Atom::Same(..) | Atom::Different(..) => atom.terms(),
        _ => Vec::new(),
    });
    names.extend(terms.filter_map(|term| match term {
        // Literals are not individuals.
        Term::Constant(symbol) => context.symbols.value(symbol).as_name().map(|_| symbol),
        Term::Variable(_) => None,
    }));
    for name in names {
        context.state(thing, [name]);
    }
}
