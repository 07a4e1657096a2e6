//! Whether statements follow from what an engine holds: assertions by look-up; axioms about classes and properties by
//! *fresh individuals*, of which no more is said than the axiom's condition, and by *refutation*, where the opposite is
//! assumed until it contradicts.
//!
//! What is shown follows, because each conclusion of the rules is sound for the individuals that were assumed. What is not
//! shown may follow nevertheless: the rules are those of OWL 2 RL.

mod assume;
mod axiom;
mod query;
mod range;
mod schema;

use rules::{Engine, Error, Fact, Literal, Program, Symbol};

use crate::Warning;
use crate::horned::UNUSED_CLASS;
use crate::owl::{ANONYMOUS, Annotation, AnnotationValue, Axiom, Iri, ObjectPropertyExpression, Ontology};
use crate::vocab::owl;
use assume::refuted;
pub use schema::{Schema, SchemaEntity, schema};

/// What is known of a statement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// It follows; the text says from what.
    Follows(String),
    /// It was not shown to follow; the text says why not.
    Open(&'static str),
}

/// A statement and whether it follows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entailment {
    /// The statement in functional-style syntax.
    pub statement: String,
    /// Whether it follows.
    pub answer: Answer,
}

/// Asks for every axiom of `conclusions`. Its anonymous individuals stand for any individual. What could not be read of it was
/// not shown; for its annotations see [`annotations`].
///
/// # Errors
/// A rule does not come to an end.
pub fn entailments(engine: &Engine, conclusions: &Ontology) -> Result<Vec<Entailment>, Error> {
    let prover = Prover::new(engine)?;
    let everything = contradiction(&prover.base);
    let mut found = Vec::new();
    let (open, closed): (Vec<_>, Vec<_>) =
        conclusions.axioms.iter().map(|annotated| &annotated.axiom).partition(|axiom| is_open(axiom));
    for axiom in closed {
        let answer = match &everything {
            Some(reason) => Answer::Follows(format!("everything does, because {reason}\n")),
            None => prover.axiom(axiom)?,
        };
        found.push(Entailment { statement: axiom.to_string(), answer });
    }
    if !open.is_empty() {
        let answer = match &everything {
            Some(reason) => Answer::Follows(format!("everything does, because {reason}\n")),
            None => prover.pattern(&open)?,
        };
        let statement = open.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
        found.push(Entailment { statement, answer });
    }
    for rule in &conclusions.rules {
        found.push(Entailment {
            statement: rule.to_string(),
            answer: Answer::Open("rules are not asked for"),
        });
    }
    found.extend(conclusions.warnings.iter().filter_map(unread));
    Ok(found)
}

/// Asks for every annotation of `conclusions` whether it is among those that are `stated`, of its subject or of something that
/// is the same, because nothing else follows from annotations.
pub fn annotations(engine: &Engine, stated: &[(Iri, Annotation)], conclusions: &Ontology) -> Vec<Entailment> {
    conclusions.annotations.iter().map(|annotation| annotated(engine, annotation, stated)).collect()
}

fn annotated(
    engine: &Engine,
    (subject, wanted): &(Iri, Annotation),
    stated: &[(Iri, Annotation)],
) -> Entailment {
    let is_same = |other: &Iri| {
        let names = [owl::SAME_AS, other, subject].map(|name| engine.symbols().find_name(name));
        let [Some(predicate), Some(other), Some(subject)] = names else { return false };
        engine.holds(&Fact::new(predicate, [other, subject]))
    };
    let found = stated.iter().find(|(other, own)| own == wanted && (other == subject || is_same(other)));
    let answer = match found {
        Some((other, _)) if other == subject => Answer::Follows("it is stated\n".to_owned()),
        Some((other, _)) => Answer::Follows(format!("it is stated of <{other}>, which is the same\n")),
        None => Answer::Open("it is an annotation that is not stated"),
    };
    let Annotation { property, value } = wanted;
    let value = match value {
        AnnotationValue::Literal(literal) => literal.to_string(),
        AnnotationValue::Iri(iri) => format!("<{iri}>"),
    };
    Entailment { statement: format!("AnnotationAssertion(<{property}> <{subject}> {value})"), answer }
}

/// What was not read of the conclusions. A class expression that nothing is said of claims nothing.
fn unread(warning: &Warning) -> Option<Entailment> {
    let statement = match warning {
        Warning::Unread { statement, .. } if statement.starts_with(UNUSED_CLASS) => return None,
        Warning::Unread { statement, .. } => statement.clone(),
        Warning::UnreadRule { ontology, position, .. } => format!("rule <{ontology}>#{position}"),
        _ => return None,
    };
    Some(Entailment { statement, answer: Answer::Open("it could not be read") })
}

/// Whether a statement is about somebody, whoever that is.
fn is_open(axiom: &Axiom) -> bool {
    let is_anonymous = |iri: &Iri| iri.starts_with(ANONYMOUS);
    match axiom {
        Axiom::ClassAssertion(_, individual) | Axiom::DataPropertyAssertion(_, individual, _) => {
            is_anonymous(individual)
        }
        Axiom::ObjectPropertyAssertion(_, from, to) => is_anonymous(from) || is_anonymous(to),
        Axiom::SameIndividual(all) | Axiom::DifferentIndividuals(all) => all.iter().any(is_anonymous),
        _ => false,
    }
}

/// Why an engine's knowledge is inconsistent, if it is.
fn contradiction(engine: &Engine) -> Option<String> {
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
struct Prover {
    /// The knowledge, with equality.
    base: Engine,
}

/// What shows a goal, or nothing.
type Shown = Result<Option<String>, Error>;

impl Prover {
    fn new(engine: &Engine) -> Result<Self, Error> {
        let mut base = engine.clone();
        if !engine.program().equality {
            let program = Program { equality: true, ..engine.program().clone() };
            base.set_program(program).map_err(|mut errors| errors.remove(0))?;
        }
        Ok(Self { base })
    }

    /// A name that nothing else has; `number` tells those of one question apart.
    fn fresh(number: usize) -> Iri {
        format!("urn:metaplan:any:{number}").into()
    }
}

/// The fact that an individual is in a named class.
fn member(engine: &mut Engine, class: &str, individual: &str) -> Fact {
    let symbols = engine.symbols_mut();
    Fact::new(symbols.name(class), [symbols.name(individual)])
}

/// The fact that a property, or its inverse, relates two individuals.
fn edge(engine: &mut Engine, property: &ObjectPropertyExpression, from: &str, to: &str) -> Fact {
    let symbols = engine.symbols_mut();
    let (from, to) = (symbols.name(from), symbols.name(to));
    match property {
        ObjectPropertyExpression::Property(iri) => Fact::new(symbols.name(iri), [from, to]),
        ObjectPropertyExpression::Inverse(iri) => Fact::new(symbols.name(iri), [to, from]),
    }
}

/// The fact that a data property has a value.
fn value(engine: &mut Engine, property: &str, from: &str, value: Literal) -> Fact {
    let symbols = engine.symbols_mut();
    Fact::new(symbols.name(property), [symbols.name(from), symbols.literal(value)])
}

/// The fact that two names stand for one individual.
fn same(engine: &mut Engine, left: &str, right: &str) -> Fact {
    let symbols = engine.symbols_mut();
    Fact::new(symbols.name(owl::SAME_AS), [symbols.name(left), symbols.name(right)])
}

/// The value of a literal as written.
fn literal(literal: &crate::owl::Literal) -> Literal {
    Literal::parse(&literal.lexical, literal.datatype.as_deref(), literal.language.as_deref())
}

/// Adds facts to a copy of what is known.
fn with(engine: &Engine, facts: impl IntoIterator<Item = Fact>) -> Result<Engine, Error> {
    let mut copy = engine.clone();
    let insert = facts.into_iter().collect();
    copy.apply(rules::Delta { insert, delete: Vec::new() })?;
    Ok(copy)
}

/// The derivation of a fact that holds.
fn shown(engine: &Engine, fact: &Fact) -> Option<String> {
    if fact.arguments.len() == 2 && fact.arguments[0] == fact.arguments[1] && is_same(engine, fact.predicate)
    {
        return Some("everything is the same as itself\n".to_owned());
    }
    engine.why(fact).map(|derivation| derivation.display(engine.symbols()).to_string())
}

fn is_same(engine: &Engine, predicate: Symbol) -> bool {
    engine.symbols().value(predicate).as_name() == Some(owl::SAME_AS)
}
