//! Determines whether the measured value of an attribute can have an effect.

use ontology::AXIOM_SOURCE;
use ontology::vocab::{local_name, tomasys};
use rules::{Atom, Rule, Symbol, Symbols, Term};

use crate::knowledge::base::Knowledge;

impl Knowledge {
    /// Returns `true` if a measured value of the attribute can have an effect: the attribute has a measurement, a
    /// design has a bound on it, it has a comparison operator, or a rule or an axiom can read its value. Also if the
    /// domain is in PLANTA's form, which can refer to all values. The attribute is given by the IRI or local name of
    /// its type. Constraints do not count, because they only report contradictions.
    pub fn uses_measurement(&self, attribute: &str) -> bool {
        let view = self.view();
        let kinds = view.attribute_types();
        let Some(kind) = kinds.iter().find(|kind| kind.iri == attribute || kind.name == attribute) else {
            return false;
        };
        if self.terms().is_some()
            || view.measurements().iter().any(|measurement| measurement.attribute == kind.name)
            || view
                .function_designs()
                .iter()
                .any(|design| design.requirements.iter().any(|bound| bound.attribute == kind.name))
            || !view.values(&kind.iri, tomasys::QA_COMPARISON_OPERATOR).is_empty()
        {
            return true;
        }
        let engine = self.engine();
        engine.program().rules.iter().any(|rule| can_read(engine.symbols(), rule, &kind.iri))
    }
}

/// Returns `true` if a rule can read a measurement of an attribute for which no design has a requirement, and which
/// has no comparison operator. The result may also be `true` for a rule that cannot.
fn can_read(symbols: &Symbols, rule: &Rule, attribute: &str) -> bool {
    if *rule.identity.source == *AXIOM_SOURCE && !concludes_more(symbols, rule) {
        return false;
    }
    let conditions: Vec<(&str, &[Term])> = rule
        .body
        .iter()
        .filter_map(|atom| match atom {
            Atom::Relation { predicate, arguments } => {
                Some((local(symbols, *predicate), arguments.as_slice()))
            }
            _ => None,
        })
        .collect();
    relations(&rule.body).into_iter().any(|(predicate, arguments)| {
        let holder = match (local(symbols, predicate), arguments) {
            ("hasValue" | "qa_has_value" | "isMeasured", [holder, _]) | ("hasQAvalue", [_, holder]) => {
                *holder
            }
            _ => return false,
        };
        can_hold(symbols, &conditions, holder, attribute)
    })
}

/// Returns `true` if the conditions of a rule allow that the term denotes a measurement of the attribute.
fn can_hold(symbols: &Symbols, conditions: &[(&str, &[Term])], holder: Term, attribute: &str) -> bool {
    if let Term::Constant(symbol) = holder {
        // The measurement that the first report creates.
        return local(symbols, symbol).strip_prefix("obs_") == Some(local_name(attribute));
    }
    let links = |name: &str, to: Term| {
        conditions.iter().any(|(predicate, arguments)| *predicate == name && arguments.get(1) == Some(&to))
    };
    if links("hasQAestimation", holder) {
        return false;
    }
    let is_bounded = |kind: Term| {
        conditions.iter().any(|(predicate, arguments)| match (*predicate, *arguments) {
            ("isQAtype", [subject, object]) => *object == kind && links("hasRequirement", *subject),
            ("qa_comparison_operator", [subject, _]) => *subject == kind,
            _ => false,
        })
    };
    conditions.iter().all(|(predicate, arguments)| match (*predicate, *arguments) {
        ("isQAtype", [subject, kind]) if *subject == holder => match *kind {
            Term::Constant(symbol) => symbols.value(symbol).as_name() == Some(attribute),
            Term::Variable(_) => !is_bounded(*kind),
        },
        _ => true,
    })
}

/// Returns `true` if the rule of an axiom concludes more than that a value exists: it has several conditions, or
/// copies the value. Domains, ranges and equalities do not.
fn concludes_more(symbols: &Symbols, rule: &Rule) -> bool {
    relations(&rule.head).into_iter().any(|(predicate, arguments)| {
        let name = symbols.value(predicate).as_name().unwrap_or_default();
        let is_copy = ["hasValue", "qa_has_value", "isMeasured", "hasQAvalue"].contains(&local_name(name));
        let is_new = !name.starts_with("http://www.w3.org/") && !is_copy;
        is_new && (rule.body.len() > 1 || arguments.len() > 1)
    })
}

fn local(symbols: &Symbols, symbol: Symbol) -> &str {
    symbols.value(symbol).as_name().map_or("", local_name)
}

/// Returns the relations of a conjunction, also those that are negated or in aggregates.
fn relations(atoms: &[Atom]) -> Vec<(Symbol, &[Term])> {
    let mut relations_of_atoms = Vec::new();
    for atom in atoms {
        match atom {
            Atom::Relation { predicate, arguments } | Atom::Not { predicate, arguments } => {
                relations_of_atoms.push((*predicate, arguments.as_slice()));
            }
            Atom::Aggregate { body, .. } => relations_of_atoms.extend(relations(body)),
            Atom::BuiltIn { .. } | Atom::Same(..) | Atom::Different(..) => {}
        }
    }
    relations_of_atoms
}
