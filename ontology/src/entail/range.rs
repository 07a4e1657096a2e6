//! Proves data property ranges. A fresh value of the property is assumed. The intersection of the datatypes
//! that constraints require of this value must be contained in the range.

use rules::{Atom, BuiltIn, Literal, Rule, Symbol, Term, is_subsumed};

use super::assume::refuted;
use super::prover::{ProofResult, Prover, value, with_facts};
use crate::owl::{DataRange, Iri};

impl Prover {
    pub(super) fn range(&self, property: &Iri, range: &DataRange) -> ProofResult {
        let mut copy = self.monotone.clone();
        let assumed = value(&mut copy, property, &Self::fresh(0), Literal::fresh(1));
        let object = assumed.arguments[1];
        let copy = with_facts(&copy, [assumed])?;
        if let Some(reason) = refuted(std::slice::from_ref(&copy)) {
            return Ok(Some(reason));
        }
        let has_value = |predicate: Symbol| copy.matching(predicate, &[None, Some(object)]).next().is_some();
        let constraints = copy.program().rules.iter().filter_map(datatype_constraint);
        let applicable = constraints.filter(|(predicate, _)| has_value(*predicate));
        let datatypes: Vec<&str> = applicable
            .filter_map(|(_, datatype)| match copy.symbols().value(datatype).as_literal() {
                Some(Literal::Uri(iri)) => Some(&**iri),
                _ => None,
            })
            .collect();
        let names: Vec<String> = datatypes.iter().map(|iri| format!("<{iri}>")).collect();
        let reason = || format!("each of its values lies in {}\n", names.join(" and "));
        Ok(contains(&datatypes, range).then(reason))
    }
}

fn contains(datatypes: &[&str], range: &DataRange) -> bool {
    match range {
        DataRange::Datatype(iri) => is_subsumed(datatypes, iri),
        DataRange::IntersectionOf(ranges) => ranges.iter().all(|range| contains(datatypes, range)),
        DataRange::UnionOf(ranges) => ranges.iter().any(|range| contains(datatypes, range)),
        _ => false,
    }
}

/// Returns the property and the datatype of a constraint that restricts the values of the property to the datatype
/// for all individuals, without another condition; `None` for other rules.
fn datatype_constraint(rule: &Rule) -> Option<(Symbol, Symbol)> {
    let (predicate, object, arguments) = match &rule.body[..] {
        [
            Atom::Relation { predicate, arguments: edge },
            Atom::BuiltIn { built_in: BuiltIn::OutsideDataRange, arguments },
        ] => match edge[..] {
            [Term::Variable(subject), Term::Variable(object)] if subject != object => {
                (*predicate, Term::Variable(object), arguments)
            }
            _ => return None,
        },
        _ => return None,
    };
    match (arguments[..].as_ref(), rule.head.is_empty()) {
        ([tested, Term::Constant(datatype)], true) if *tested == object => Some((predicate, *datatype)),
        _ => None,
    }
}
