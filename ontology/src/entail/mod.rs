//! Tries to prove that statements are entailed by the facts and rules of an engine. Assertions of named classes and
//! properties are looked up. Most other axioms are proved with *fresh individuals*, about which only the
//! axiom's condition is assumed, or by *refutation*: the negation is assumed and contradicts the knowledge.
//!
//! The procedure is sound, because proofs use only rules that are sound for the assumed individuals. Keys apply to
//! fresh individuals only in proofs of keys, and rules with a negation or an aggregate take no part in proofs from assumptions. No
//! built-in holds for a fresh value, except a data range that contains all values. Fresh values and individuals differ
//! only if this is assumed. The procedure is incomplete, because the rules are those of OWL 2 RL.

mod assume;
mod axiom;
mod prover;
mod query;
mod range;
mod schema;
mod tautology;

use std::fmt::Debug;

use rules::{Engine, Error, Fact};

use crate::error::Warning;
use crate::horned::UNUSED_CLASS;
use crate::owl::{ANONYMOUS, Annotation, AnnotationValue, Axiom, ClassExpression, Iri, Ontology};
use crate::vocab::owl;
use prover::Prover;

pub use prover::Answer;
pub use schema::{Schema, SchemaEntity, schema};
pub use tautology::tautology;

/// A statement and the result of its proof.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entailment {
    /// The axiom in functional-style syntax, or all axioms of a conjunctive query. Rules and unread statements are
    /// given as text in another form.
    pub statement: String,
    /// Result of the proof.
    pub answer: Answer,
}

/// Tries to prove every axiom of `conclusions`. Axioms with anonymous individuals, which are existential
/// variables, are proved together as one conjunctive query. Axioms with anonymous individuals within expressions,
/// rules and unread statements are reported as not proved. For annotations see [`annotations`].
///
/// # Errors
/// Returns an error if the evaluation of the rules exceeds its budget or is interrupted.
pub fn entailments(engine: &Engine, conclusions: &Ontology) -> Result<Vec<Entailment>, Error> {
    let prover = Prover::new(engine)?;
    let inconsistency = prover.inconsistency.as_ref();
    let mut entailments = Vec::new();
    let (open, closed): (Vec<_>, Vec<_>) =
        conclusions.axioms.iter().map(|annotated| &annotated.axiom).partition(|axiom| is_open(axiom));
    for axiom in closed {
        // Inconsistent knowledge entails every statement.
        let answer = match inconsistency {
            Some(reason) => Answer::Follows(format!("everything does, because {reason}\n")),
            None if has_nested_anonymous(axiom) => {
                Answer::Open("an anonymous individual within an expression is not decided")
            }
            None => prover.axiom(axiom)?,
        };
        entailments.push(Entailment { statement: axiom.to_string(), answer });
    }
    if !open.is_empty() {
        let answer = match inconsistency {
            Some(reason) => Answer::Follows(format!("everything does, because {reason}\n")),
            None => prover.conjunctive_query(&open)?,
        };
        let statement = open.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
        entailments.push(Entailment { statement, answer });
    }
    for rule in &conclusions.rules {
        entailments.push(Entailment {
            statement: rule.to_string(),
            answer: Answer::Open("rules are not asked for"),
        });
    }
    entailments.extend(conclusions.warnings.iter().filter_map(unread));
    Ok(entailments)
}

/// Decides for every annotation of `conclusions` if it occurs in `stated`, about its subject or about an
/// individual equal to its subject. No other annotation is entailed.
pub fn annotations(engine: &Engine, stated: &[(Iri, Annotation)], conclusions: &Ontology) -> Vec<Entailment> {
    conclusions
        .annotations
        .iter()
        .map(|annotation| annotation_entailment(engine, annotation, stated))
        .collect()
}

fn annotation_entailment(
    engine: &Engine,
    (subject, conclusion): &(Iri, Annotation),
    stated: &[(Iri, Annotation)],
) -> Entailment {
    let is_same = |other: &Iri| {
        let names = [owl::SAME_AS, other, subject].map(|name| engine.symbols().find_name(name));
        let [Some(predicate), Some(other), Some(subject)] = names else { return false };
        engine.holds(&Fact::new(predicate, [other, subject]))
    };
    let witness = stated
        .iter()
        .find(|(other, annotation)| annotation == conclusion && (other == subject || is_same(other)));
    let answer = match witness {
        Some((other, _)) if other == subject => Answer::Follows("it is stated\n".to_owned()),
        Some((other, _)) => Answer::Follows(format!("it is stated of <{other}>, which is the same\n")),
        None => Answer::Open("it is an annotation that is not stated"),
    };
    let Annotation { property, value } = conclusion;
    let value = match value {
        AnnotationValue::Literal(literal) => literal.to_string(),
        AnnotationValue::Iri(iri) => format!("<{iri}>"),
    };
    Entailment { statement: format!("AnnotationAssertion(<{property}> <{subject}> {value})"), answer }
}

/// Reports a statement of the conclusions as not proved, if the warning states that it could not be read. Returns
/// `None` for other warnings, and for an unused class expression, which claims nothing.
fn unread(warning: &Warning) -> Option<Entailment> {
    let statement = match warning {
        Warning::Unread { statement, .. } if statement.starts_with(UNUSED_CLASS) => return None,
        Warning::Unread { statement, .. } => statement.clone(),
        Warning::UnreadRule { ontology, position, .. } => format!("rule <{ontology}>#{position}"),
        _ => return None,
    };
    Some(Entailment { statement, answer: Answer::Open("it could not be read") })
}

/// Returns `true` if the axiom is a part of the conjunctive query.
fn is_open(axiom: &Axiom) -> bool {
    has_anonymous(axiom) && !has_nested_anonymous(axiom)
}

/// Returns `true` if an anonymous individual may occur in a class expression or in a negative assertion. A
/// conjunctive query does not replace it there.
fn has_nested_anonymous(axiom: &Axiom) -> bool {
    let is_anonymous = |part: &dyn Debug| format!("{part:?}").contains(ANONYMOUS);
    match axiom {
        Axiom::ClassAssertion(ClassExpression::Class(_), _)
        | Axiom::ObjectPropertyAssertion(..)
        | Axiom::DataPropertyAssertion(..)
        | Axiom::SameIndividual(_)
        | Axiom::DifferentIndividuals(_) => false,
        Axiom::ClassAssertion(class, _) => is_anonymous(class),
        _ => is_anonymous(axiom),
    }
}

fn has_anonymous(axiom: &Axiom) -> bool {
    let is_anonymous = |iri: &Iri| iri.starts_with(ANONYMOUS);
    match axiom {
        Axiom::ClassAssertion(_, individual) | Axiom::DataPropertyAssertion(_, individual, _) => {
            is_anonymous(individual)
        }
        Axiom::ObjectPropertyAssertion(_, from, to) => is_anonymous(from) || is_anonymous(to),
        Axiom::SameIndividual(names) | Axiom::DifferentIndividuals(names) => names.iter().any(is_anonymous),
        _ => false,
    }
}
