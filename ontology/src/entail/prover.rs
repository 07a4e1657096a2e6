//! The prover's knowledge base, and constructors for facts that are assumed or proved.

use std::collections::BTreeSet;

use rules::{Atom, Delta, Engine, Error, Fact, Literal, Program, Rule, Symbol, Symbols, Term};

use crate::lower::AXIOM_SOURCE;
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
    pub(super) monotone: Engine,
    /// Reason why the knowledge is inconsistent. The original engine is examined, too, because `base` cannot violate
    /// the unique name assumption.
    pub(super) inconsistency: Option<String>,
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
        let inconsistency = contradiction(engine).or_else(|| contradiction(&base));
        Ok(Self { base, monotone, inconsistency })
    }

    /// Returns the name of a fresh individual, which occurs nowhere else. `number` distinguishes
    /// the fresh individuals of one proof.
    pub(super) fn fresh(number: usize) -> Iri {
        Symbols::fresh_name(None, number).into()
    }
}

/// Returns the symbol of a name. Adding a name copies all symbols if a clone of the engine shares them. Therefore an
/// existing name is only looked up.
pub(super) fn symbol(engine: &mut Engine, name: &str) -> Symbol {
    engine.symbols().find_name(name).unwrap_or_else(|| engine.symbols_mut().name(name))
}

pub(super) fn member(engine: &mut Engine, class: &str, individual: &str) -> Fact {
    Fact::new(symbol(engine, class), [symbol(engine, individual)])
}

pub(super) fn edge(engine: &mut Engine, property: &ObjectPropertyExpression, from: &str, to: &str) -> Fact {
    let (from, to) = (symbol(engine, from), symbol(engine, to));
    match property {
        ObjectPropertyExpression::Property(iri) => Fact::new(symbol(engine, iri), [from, to]),
        ObjectPropertyExpression::Inverse(iri) => Fact::new(symbol(engine, iri), [to, from]),
    }
}

pub(super) fn value(engine: &mut Engine, property: &str, from: &str, value: Literal) -> Fact {
    let (property, from) = (symbol(engine, property), symbol(engine, from));
    let value = engine.symbols().find_literal(&value).unwrap_or_else(|| engine.symbols_mut().literal(value));
    Fact::new(property, [from, value])
}

pub(super) fn same(engine: &mut Engine, left: &str, right: &str) -> Fact {
    Fact::new(symbol(engine, owl::SAME_AS), [symbol(engine, left), symbol(engine, right)])
}

pub(super) fn literal(literal: &crate::owl::Literal) -> Literal {
    Literal::parse(&literal.lexical, literal.datatype.as_deref(), literal.language.as_deref())
}

/// Relation of the individuals and values to which keys apply: those in the facts of the knowledge base.
const NAMED: &str = "urn:metaplan:named";

/// Returns the fact that an individual or a value has a name, so that keys apply to it.
pub(super) fn named(engine: &mut Engine, symbol: Symbol) -> Fact {
    Fact::new(engine.symbols_mut().name(NAMED), [symbol])
}

/// Returns a copy of the engine with the rules that are sound for fresh individuals. Rules with a negation or an
/// aggregate are removed: they draw conclusions from the absence of facts, but facts about a fresh individual are absent
/// because it represents all individuals. Keys are restricted to individuals in the facts of the knowledge base: in OWL, keys
/// apply only to named individuals, and a fresh individual can be one without a name.
pub(super) fn monotone(engine: &Engine) -> Result<Engine, Error> {
    let is_closed_world = |atom: &Atom| atom.is_negated() || matches!(atom, Atom::Aggregate { .. });
    let is_monotone = |rule: &Rule| !rule.body.iter().any(is_closed_world);
    let (mut copy, program) = (engine.clone(), engine.program());
    let predicate = engine.symbols().find_name(NAMED);
    let is_restriction =
        |atom: &Atom| matches!(atom, Atom::Relation { predicate: other, .. } if Some(*other) == predicate);
    let is_open_key = |rule: &Rule| is_key(rule) && !rule.body.iter().any(is_restriction);
    let has_open_keys = program.rules.iter().any(is_open_key);
    if program.rules.iter().all(is_monotone) && !has_open_keys {
        return Ok(copy);
    }
    let mut rules: Vec<Rule> = program.rules.iter().filter(|rule| is_monotone(rule)).cloned().collect();
    if has_open_keys {
        let predicate = copy.symbols_mut().name(NAMED);
        for rule in rules.iter_mut().filter(|rule| is_open_key(rule)) {
            let atoms = rule.body.iter().filter(|atom| matches!(atom, Atom::Relation { .. }));
            let terms = atoms.flat_map(Atom::terms).filter(|term| term.as_variable().is_some());
            let variables: BTreeSet<Term> = terms.collect();
            rule.body.extend(variables.into_iter().map(|variable| Atom::relation(predicate, [variable])));
        }
        let facts = engine.facts_in_brief(1).into_iter();
        let symbols: BTreeSet<Symbol> = facts.flat_map(|fact| fact.arguments).collect();
        let insert = symbols.into_iter().map(|symbol| Fact::new(predicate, [symbol])).collect();
        copy.apply(Delta { insert, delete: Vec::new() })?;
    }
    copy.set_program(Program { rules, equality: program.equality })
        .map_err(|errors| errors.into_vec().remove(0))?;
    Ok(copy)
}

fn is_key(rule: &Rule) -> bool {
    let label = rule.identity.label.as_deref().unwrap_or_default();
    *rule.identity.source == *AXIOM_SOURCE && label.starts_with("HasKey(")
}

pub(super) fn with_facts(engine: &Engine, facts: impl IntoIterator<Item = Fact>) -> Result<Engine, Error> {
    let mut copy = monotone(engine)?;
    let insert = facts.into_iter().collect();
    copy.apply(Delta { insert, delete: Vec::new() })?;
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
