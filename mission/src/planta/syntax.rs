//! Parts of PDDL that stand in no file.

use pddl::ast::{
    Atom, Condition, Declaration, Derived, Identifier, Name, Span, Term, TypeExpression, TypedName,
};

/// A ground fact: predicate and arguments.
pub(super) type Fact = (Name, Vec<Name>);

pub(super) fn identifier(name: Name) -> Identifier {
    Identifier { name, span: Span::default() }
}

pub(super) fn variable(name: &str) -> Term {
    Term::Variable(identifier(Name::new(name)))
}

pub(super) fn atom(predicate: Name, arguments: Vec<Term>) -> Atom {
    Atom { predicate: identifier(predicate), arguments, span: Span::default() }
}

/// Entries of a typed list that may be anything.
pub(super) fn untyped(names: &[&str]) -> Vec<TypedName> {
    let entry = |name: &&str| TypedName {
        identifier: identifier(Name::new(name)),
        r#type: TypeExpression::default(),
    };
    names.iter().map(entry).collect()
}

/// A condition in which some variables may stand for anything.
pub(super) fn exists(bound: &[&str], condition: Condition) -> Condition {
    if bound.is_empty() { condition } else { Condition::Exists(untyped(bound), Box::new(condition)) }
}

/// A derived predicate.
pub(super) fn axiom(head: Name, parameters: &[&str], condition: Condition) -> Derived {
    let head = Declaration { identifier: identifier(head), parameters: untyped(parameters) };
    Derived { head, condition, span: Span::default() }
}

pub(super) fn typed(r#type: Option<Name>) -> TypeExpression {
    TypeExpression { alternatives: r#type.into_iter().map(identifier).collect() }
}

pub(super) fn object(name: Name, r#type: Option<Name>) -> TypedName {
    TypedName { identifier: identifier(name), r#type: typed(r#type) }
}
