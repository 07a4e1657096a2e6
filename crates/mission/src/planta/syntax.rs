//! Constructors for PDDL syntax trees without source locations.

use pddl::ast::{Atom, Condition, Declaration, Derived, Name, Span, Term, TypeExpression, TypedName};

pub(super) type Fact = (Name, Vec<Name>);

pub(super) fn variable(name: &str) -> Term {
    Term::Variable(Name::new(name).into())
}

pub(super) fn atom(predicate: Name, arguments: Vec<Term>) -> Atom {
    Atom { predicate: predicate.into(), arguments, span: Span::default() }
}

pub(super) fn untyped(names: &[&str]) -> Vec<TypedName> {
    let entry =
        |name: &&str| TypedName { identifier: Name::new(name).into(), r#type: TypeExpression::default() };
    names.iter().map(entry).collect()
}

pub(super) fn exists(bound: &[&str], condition: Condition) -> Condition {
    if bound.is_empty() { condition } else { Condition::Exists(untyped(bound), Box::new(condition)) }
}

pub(super) fn axiom(head: Name, parameters: &[&str], condition: Condition) -> Derived {
    let head = Declaration { identifier: head.into(), parameters: untyped(parameters) };
    Derived { head, condition, span: Span::default() }
}

pub(super) fn typed(r#type: Option<Name>) -> TypeExpression {
    TypeExpression { alternatives: r#type.into_iter().map(Into::into).collect() }
}

pub(super) fn object(name: Name, r#type: Option<Name>) -> TypedName {
    TypedName { identifier: name.into(), r#type: typed(r#type) }
}
