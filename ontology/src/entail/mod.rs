//! Whether statements follow from what an engine holds: assertions by look-up; axioms about classes and properties by
//! *fresh individuals*, of which no more is said than the axiom's condition, and by *refutation*, where the opposite is
//! assumed until it contradicts.
//!
//! What is shown follows, because each conclusion of the rules is sound for the individuals that were assumed. What is not
//! shown may follow nevertheless: the rules are those of OWL 2 RL.

mod assume;
mod axiom;
mod prover;
mod query;
mod range;
mod schema;

use rules::{Engine, Error, Fact};

use crate::error::Warning;
use crate::horned::UNUSED_CLASS;
use crate::owl::{ANONYMOUS, Annotation, AnnotationValue, Axiom, Iri, Ontology};
use crate::vocab::owl;
use prover::{Prover, contradiction};

pub use prover::Answer;
pub use schema::{Schema, SchemaEntity, schema};

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
