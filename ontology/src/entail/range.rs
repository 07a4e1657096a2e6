//! What data ranges the values of a data property lie in: the datatypes that constraints ask of any value, and what they have
//! in common.

use rules::{Atom, BuiltIn, Literal, Rule, Symbol, Term, is_subsumed};

use super::assume::refuted;
use super::prover::{Prover, Shown, value, with};
use crate::owl::{DataRange, Iri};

impl Prover {
    /// Whether all values of a property lie in a range.
    pub(super) fn range(&self, property: &Iri, range: &DataRange) -> Shown {
        let mut copy = self.base.clone();
        let any = value(&mut copy, property, &Self::fresh(0), Literal::fresh(1));
        let object = any.arguments[1];
        let copy = with(&copy, [any])?;
        if let Some(reason) = refuted(std::slice::from_ref(&copy)) {
            return Ok(Some(reason));
        }
        let has_value = |predicate: Symbol| copy.matching(predicate, &[None, Some(object)]).next().is_some();
        let constraints = copy.program().rules.iter().filter_map(datatype_constraint);
        let asked = constraints.filter(|(predicate, _)| has_value(*predicate));
        let datatypes: Vec<&str> = asked
            .filter_map(|(_, datatype)| match copy.symbols().value(datatype).as_literal() {
                Some(Literal::Uri(iri)) => Some(&**iri),
                _ => None,
            })
            .collect();
        let all: Vec<String> = datatypes.iter().map(|iri| format!("<{iri}>")).collect();
        let reason = || format!("each of its values lies in {}\n", all.join(" and "));
        Ok(contains(&datatypes, range).then(reason))
    }
}

/// Whether what lies in all of some datatypes lies in a range.
fn contains(datatypes: &[&str], range: &DataRange) -> bool {
    match range {
        DataRange::Datatype(iri) => is_subsumed(datatypes, iri),
        DataRange::IntersectionOf(ranges) => ranges.iter().all(|range| contains(datatypes, range)),
        DataRange::UnionOf(ranges) => ranges.iter().any(|range| contains(datatypes, range)),
        _ => false,
    }
}

/// The property and the datatype of a rule that says no more than that values of the property lie in the datatype.
fn datatype_constraint(rule: &Rule) -> Option<(Symbol, Symbol)> {
    let (predicate, object, arguments) = match &rule.body[..] {
        [
            Atom::Relation { predicate, arguments: edge },
            Atom::BuiltIn { built_in: BuiltIn::OutsideDataRange, arguments },
        ] => (*predicate, edge.get(1).copied()?, arguments),
        _ => return None,
    };
    let is_any = |term: Term| term.as_variable().is_some();
    match (arguments[..].as_ref(), rule.head.is_empty()) {
        ([tested, Term::Constant(datatype)], true) if *tested == object && is_any(object) => {
            Some((predicate, *datatype))
        }
        _ => None,
    }
}
