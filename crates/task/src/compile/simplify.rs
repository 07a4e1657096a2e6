//! Constructors that simplify conditions, and related helpers.

use pddl::ast::{Atom, Condition, Identifier, Name, Span, Term, TypedName};

pub(super) fn identifier(name: &str) -> Identifier {
    Identifier { name: Name::new(name), span: Span::default() }
}

pub(super) fn flag(name: &str) -> Atom {
    Atom { predicate: identifier(name), arguments: Vec::new(), span: Span::default() }
}

pub(super) fn holds(name: &str) -> Condition {
    Condition::Atom(flag(name))
}

pub(super) fn truth() -> Condition {
    Condition::And(Vec::new())
}

pub(super) fn falsity() -> Condition {
    Condition::Or(Vec::new())
}

pub(super) fn is_true(condition: &Condition) -> bool {
    matches!(condition, Condition::And(parts) if parts.is_empty())
}

pub(super) fn is_false(condition: &Condition) -> bool {
    matches!(condition, Condition::Or(parts) if parts.is_empty())
}

pub(super) fn all(parts: impl IntoIterator<Item = Condition>) -> Condition {
    let mut conjuncts = Vec::new();
    for part in parts {
        match part {
            part if is_false(&part) => return falsity(),
            Condition::And(inner) => conjuncts.extend(inner),
            part => conjuncts.push(part),
        }
    }
    if conjuncts.len() == 1 { conjuncts.swap_remove(0) } else { Condition::And(conjuncts) }
}

pub(super) fn any(parts: impl IntoIterator<Item = Condition>) -> Condition {
    let mut disjuncts = Vec::new();
    for part in parts {
        match part {
            part if is_true(&part) => return truth(),
            Condition::Or(inner) => disjuncts.extend(inner),
            part => disjuncts.push(part),
        }
    }
    if disjuncts.len() == 1 { disjuncts.swap_remove(0) } else { Condition::Or(disjuncts) }
}

pub(super) fn not(condition: Condition) -> Condition {
    match condition {
        part if is_true(&part) => falsity(),
        part if is_false(&part) => truth(),
        Condition::Not(inner) => *inner,
        part => Condition::Not(Box::new(part)),
    }
}

pub(super) fn equal(left: &Term, right: &Term) -> Condition {
    match (left, right) {
        (Term::Constant(left), Term::Constant(right)) if left.name == right.name => truth(),
        (Term::Constant(_), Term::Constant(_)) => falsity(),
        (Term::Variable(left), Term::Variable(right)) if left.name == right.name => truth(),
        _ => Condition::Equal(left.clone(), right.clone(), Span::default()),
    }
}

pub(super) fn exists(variables: &[TypedName], body: Condition) -> Condition {
    if variables.is_empty() || is_false(&body) {
        return body;
    }
    Condition::Exists(variables.to_vec(), Box::new(body))
}

pub(super) fn ways(condition: Condition) -> Vec<Condition> {
    if let Condition::Or(parts) = condition { parts } else { vec![condition] }
}

/// Simplifies `condition` under the assumption that `known` holds: parts that are equal to `known`, including source
/// positions, become true. Parts below quantifiers and implications are not changed.
pub(super) fn assume(condition: &Condition, known: &Condition) -> Condition {
    if condition == known {
        return truth();
    }
    let each = |parts: &[Condition]| parts.iter().map(|part| assume(part, known)).collect::<Vec<_>>();
    match condition {
        Condition::And(parts) => all(each(parts)),
        Condition::Or(parts) => any(each(parts)),
        Condition::Not(inner) => not(assume(inner, known)),
        _ => condition.clone(),
    }
}
