//! Knowledge under assumptions, and the facts that are assumed or asked for.

use rules::{Engine, Error, Fact, Literal, Program, Symbol};

use crate::owl::{Iri, ObjectPropertyExpression};
use crate::vocab::owl;

/// What is known of a statement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// It follows; the text says from what.
    Follows(String),
    /// It was not shown to follow; the text says why not.
    Open(&'static str),
}

/// Why an engine's knowledge is inconsistent, if it is.
pub(super) fn contradiction(engine: &Engine) -> Option<String> {
    let violation = engine.violations().into_iter().next()?;
    let facts: Vec<_> =
        violation.supports.iter().map(|fact| fact.display(engine.symbols()).to_string()).collect();
    let what = match &violation.cause {
        rules::Cause::Constraint(identity) => {
            identity.label.as_deref().map_or_else(|| identity.to_string(), ToOwned::to_owned)
        }
        rules::Cause::IllTyped(literal) => format!("the value {}", engine.symbols().value(*literal)),
        _ => "two values that would be one".to_owned(),
    };
    Some(format!("{what} is violated by {}", facts.join(", ")))
}

/// Knowledge under assumptions.
pub(super) struct Prover {
    /// The knowledge, with equality.
    pub(super) base: Engine,
}

/// What shows a goal, or nothing.
pub(super) type Shown = Result<Option<String>, Error>;

impl Prover {
    pub(super) fn new(engine: &Engine) -> Result<Self, Error> {
        let mut base = engine.clone();
        if !engine.program().equality {
            let program = Program { equality: true, ..engine.program().clone() };
            base.set_program(program).map_err(|errors| errors.into_vec().remove(0))?;
        }
        Ok(Self { base })
    }

    /// A name that nothing else has; `number` tells those of one question apart.
    pub(super) fn fresh(number: usize) -> Iri {
        format!("urn:metaplan:any:{number}").into()
    }
}

/// The fact that an individual is in a named class.
pub(super) fn member(engine: &mut Engine, class: &str, individual: &str) -> Fact {
    let symbols = engine.symbols_mut();
    Fact::new(symbols.name(class), [symbols.name(individual)])
}

/// The fact that a property, or its inverse, relates two individuals.
pub(super) fn edge(engine: &mut Engine, property: &ObjectPropertyExpression, from: &str, to: &str) -> Fact {
    let symbols = engine.symbols_mut();
    let (from, to) = (symbols.name(from), symbols.name(to));
    match property {
        ObjectPropertyExpression::Property(iri) => Fact::new(symbols.name(iri), [from, to]),
        ObjectPropertyExpression::Inverse(iri) => Fact::new(symbols.name(iri), [to, from]),
    }
}

/// The fact that a data property has a value.
pub(super) fn value(engine: &mut Engine, property: &str, from: &str, value: Literal) -> Fact {
    let symbols = engine.symbols_mut();
    Fact::new(symbols.name(property), [symbols.name(from), symbols.literal(value)])
}

/// The fact that two names stand for one individual.
pub(super) fn same(engine: &mut Engine, left: &str, right: &str) -> Fact {
    let symbols = engine.symbols_mut();
    Fact::new(symbols.name(owl::SAME_AS), [symbols.name(left), symbols.name(right)])
}

/// The value of a literal as written.
pub(super) fn literal(literal: &crate::owl::Literal) -> Literal {
    Literal::parse(&literal.lexical, literal.datatype.as_deref(), literal.language.as_deref())
}

/// Adds facts to a copy of what is known.
pub(super) fn with(engine: &Engine, facts: impl IntoIterator<Item = Fact>) -> Result<Engine, Error> {
    let mut copy = engine.clone();
    let insert = facts.into_iter().collect();
    copy.apply(rules::Delta { insert, delete: Vec::new() })?;
    Ok(copy)
}

/// The derivation of a fact that holds.
pub(super) fn shown(engine: &Engine, fact: &Fact) -> Option<String> {
    if fact.arguments.len() == 2 && fact.arguments[0] == fact.arguments[1] && is_same(engine, fact.predicate)
    {
        return Some("everything is the same as itself\n".to_owned());
    }
    engine.why(fact).map(|derivation| derivation.display(engine.symbols()).to_string())
}

fn is_same(engine: &Engine, predicate: Symbol) -> bool {
    engine.symbols().value(predicate).as_name() == Some(owl::SAME_AS)
}
