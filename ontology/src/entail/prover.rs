//! The prover's knowledge base, and constructors for facts that are assumed or proved.

use rules::{Atom, Engine, Error, Fact, Literal, Program, Rule, Symbol};

use crate::owl::{Iri, ObjectPropertyExpression};
use crate::vocab::owl;

/// Result of the proof of a statement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The statement is entailed; the text is the explanation.
    Follows(String),
    /// The statement was not proved; the text is the reason.
    Open(&'static str),
}

pub(super) fn contradiction(engine: &Engine) -> Option<String> {
    let violation = engine.violations().into_iter().next()?;
    let facts: Vec<_> =
        violation.supports.iter().map(|fact| fact.display(engine.symbols()).to_string()).collect();
    let violated = match &violation.cause {
        rules::Cause::Constraint(identity) => {
            identity.label.as_deref().map_or_else(|| identity.to_string(), ToOwned::to_owned)
        }
        rules::Cause::IllTyped(literal) => format!("the value {}", engine.symbols().value(*literal)),
        _ => "two values that would be one".to_owned(),
    };
    Some(format!("{violated} is violated by {}", facts.join(", ")))
}

pub(super) struct Prover {
    /// In this engine, `owl:sameAs` is equality.
    pub(super) base: Engine,
    /// `base` for proofs from assumptions; see [`monotone`].
    pub(super) monotone: Engine,
}

pub(super) type ProofResult = Result<Option<String>, Error>;

impl Prover {
    pub(super) fn new(engine: &Engine) -> Result<Self, Error> {
        let mut base = engine.clone();
        if !engine.program().equality {
            let program = Program { equality: true, ..engine.program().clone() };
            base.set_program(program).map_err(|errors| errors.into_vec().remove(0))?;
        }
        let monotone = monotone(&base)?;
        Ok(Self { base, monotone })
    }

    /// Returns the name of a fresh individual, which occurs nowhere else. `number` distinguishes
    /// the fresh individuals of one proof.
    pub(super) fn fresh(number: usize) -> Iri {
        format!("urn:metaplan:any:{number}").into()
    }
}

pub(super) fn member(engine: &mut Engine, class: &str, individual: &str) -> Fact {
    let symbols = engine.symbols_mut();
    Fact::new(symbols.name(class), [symbols.name(individual)])
}

pub(super) fn edge(engine: &mut Engine, property: &ObjectPropertyExpression, from: &str, to: &str) -> Fact {
    let symbols = engine.symbols_mut();
    let (from, to) = (symbols.name(from), symbols.name(to));
    match property {
        ObjectPropertyExpression::Property(iri) => Fact::new(symbols.name(iri), [from, to]),
        ObjectPropertyExpression::Inverse(iri) => Fact::new(symbols.name(iri), [to, from]),
    }
}

pub(super) fn value(engine: &mut Engine, property: &str, from: &str, value: Literal) -> Fact {
    let symbols = engine.symbols_mut();
    Fact::new(symbols.name(property), [symbols.name(from), symbols.literal(value)])
}

pub(super) fn same(engine: &mut Engine, left: &str, right: &str) -> Fact {
    let symbols = engine.symbols_mut();
    Fact::new(symbols.name(owl::SAME_AS), [symbols.name(left), symbols.name(right)])
}

pub(super) fn literal(literal: &crate::owl::Literal) -> Literal {
    Literal::parse(&literal.lexical, literal.datatype.as_deref(), literal.language.as_deref())
}

/// Returns a copy of the engine without the rules that have a negation or an aggregate. These rules draw conclusions from
/// the absence of facts, but facts about a fresh individual are absent because it represents all individuals.
pub(super) fn monotone(engine: &Engine) -> Result<Engine, Error> {
    let is_monotone =
        |rule: &Rule| !rule.body.iter().any(|atom| matches!(atom, Atom::Not { .. } | Atom::Aggregate { .. }));
    let (mut copy, program) = (engine.clone(), engine.program());
    if !program.rules.iter().all(is_monotone) {
        let rules = program.rules.iter().filter(|rule| is_monotone(rule)).cloned().collect();
        copy.set_program(Program { rules, equality: program.equality })
            .map_err(|errors| errors.into_vec().remove(0))?;
    }
    Ok(copy)
}

/// Returns a copy of the engine with assumed facts, and with the rules of [`monotone`].
pub(super) fn with_facts(engine: &Engine, facts: impl IntoIterator<Item = Fact>) -> Result<Engine, Error> {
    let mut copy = monotone(engine)?;
    let insert = facts.into_iter().collect();
    copy.apply(rules::Delta { insert, delete: Vec::new() })?;
    Ok(copy)
}

pub(super) fn explain(engine: &Engine, fact: &Fact) -> Option<String> {
    // The engine does not store that an individual is the same as itself.
    if fact.arguments.len() == 2
        && fact.arguments[0] == fact.arguments[1]
        && is_same_as(engine, fact.predicate)
    {
        return Some("everything is the same as itself\n".to_owned());
    }
    engine.why(fact).map(|derivation| derivation.display(engine.symbols()).to_string())
}

fn is_same_as(engine: &Engine, predicate: Symbol) -> bool {
    engine.symbols().value(predicate).as_name() == Some(owl::SAME_AS)
}
