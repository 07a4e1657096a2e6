//! JSON answers of `metaplan reason`: inferred facts, entailed statements, explanations why assertions hold or do not
//! hold, and the hierarchy of classes and properties.

use ontology::entail::{Answer, Entailment, Schema, SchemaEntity};
use ontology::tomasys::{FunctionDesign, Individual};
use ontology::vocab::local_name;
use rules::Value;
use schemars::JsonSchema;
use serde::Serialize;

use crate::knowledge::{Contradiction, Knowledge};
use crate::message::Message;

const ENTAILS: &str = "metaplan-entails/1";

const REASON: &str = "metaplan-reason/1";

const REASONS: &str = "metaplan-reasons/1";

const SCHEMA: &str = "metaplan-schema/1";

/// Conclusions from documents and rules.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ReasonAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = REASON))]
    format: &'static str,
    /// Whether the knowledge base is consistent.
    consistent: bool,
    /// Number of rules in documents and rule files, without axioms.
    rules: usize,
    /// Inferred assertions as N-Triples, each with its final dot.
    inferred: Vec<String>,
    /// The function designs.
    designs: Vec<DesignPart>,
    /// Objectives with a status.
    objectives: Vec<ObjectivePart>,
    /// Contradictions.
    contradictions: &'a [Contradiction],
    /// Warnings: statements that are not or only partly used, with their summary `O304`, and probable
    /// mistakes (`O4xx`).
    warnings: &'a [Message],
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct DesignPart {
    /// Local name.
    name: String,
    /// IRI.
    iri: String,
    /// Functions that the design solves.
    solves: Vec<String>,
    /// Components that the design requires.
    components: Vec<String>,
    /// Whether the design is available.
    available: bool,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ObjectivePart {
    /// Local name.
    objective: String,
    /// Status, a value of `o_status`.
    status: String,
}

/// Entailment of the statements of documents.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct EntailmentAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = ENTAILS))]
    format: &'static str,
    /// Whether all statements are entailed.
    entailed: bool,
    /// The statements.
    statements: Vec<StatementPart<'a>>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct StatementPart<'a> {
    /// The statement.
    statement: &'a str,
    /// Whether the statement is entailed.
    follows: bool,
    /// Explanation.
    reason: &'a str,
}

/// Explanations why assertions hold or do not hold.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ReasonsAnswer {
    /// Name and version of this format.
    #[schemars(extend("const" = REASONS))]
    format: &'static str,
    /// One answer per assertion.
    answers: Vec<AssertionAnswer>,
}

/// Explanation why an assertion holds or does not hold.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct AssertionAnswer {
    /// The assertion, as it was given.
    pub assertion: String,
    /// Whether the query applies: the assertion holds (`--why`) or does not hold (`--why-not`).
    pub answered: bool,
    /// Explanation, in several lines.
    pub reason: String,
}

/// Inferred hierarchies of classes and properties.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct SchemaAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = SCHEMA))]
    format: &'static str,
    /// The named classes.
    classes: Vec<EntityPart<'a>>,
    /// The object properties.
    object_properties: Vec<EntityPart<'a>>,
    /// The data properties.
    data_properties: Vec<EntityPart<'a>>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct EntityPart<'a> {
    /// IRI.
    iri: &'a str,
    /// Direct superclasses or superproperties.
    direct: &'a [String],
    /// All superclasses or superproperties.
    above: &'a [String],
    /// Reason why the class or property is empty, or null.
    empty: Option<&'a str>,
}

impl<'a> ReasonAnswer<'a> {
    /// Answer with all inferred facts.
    pub fn new(knowledge: &'a Knowledge, contradictions: &'a [Contradiction]) -> Self {
        let triples = ontology::ntriples(knowledge.engine().symbols(), &knowledge.inferred());
        let objectives = statuses(knowledge).into_iter();
        Self {
            format: REASON,
            consistent: contradictions.is_empty(),
            rules: knowledge.rule_count(),
            inferred: triples.lines().map(ToOwned::to_owned).collect(),
            designs: knowledge.view().function_designs().into_iter().map(DesignPart::of).collect(),
            objectives: objectives.map(|(objective, status)| ObjectivePart { objective, status }).collect(),
            contradictions,
            warnings: knowledge.warnings(),
        }
    }
}

impl DesignPart {
    fn of(design: FunctionDesign) -> Self {
        let names = |all: Vec<Individual>| all.into_iter().map(|individual| individual.name).collect();
        Self {
            name: design.individual.name,
            iri: design.individual.iri,
            solves: names(design.solves),
            components: names(design.components),
            available: design.available,
        }
    }
}

/// Returns the objectives that have a status, as pairs of local name and status, sorted.
pub fn statuses(knowledge: &Knowledge) -> Vec<(String, String)> {
    let symbols = knowledge.engine().symbols();
    let mut assertions: Vec<_> = knowledge
        .engine()
        .facts_in_brief(1)
        .into_iter()
        .filter(|fact| match symbols.value(fact.predicate) {
            Value::Name(iri) => fact.arguments.len() == 2 && local_name(iri) == "o_status",
            Value::Literal(_) => false,
        })
        .map(|fact| {
            let subject = symbols.value(fact.arguments[0]).to_string();
            let value = match symbols.value(fact.arguments[1]) {
                Value::Literal(literal) => literal.lexical(),
                Value::Name(name) => name.to_string(),
            };
            (local_name(subject.trim_matches(['<', '>'])).to_owned(), value)
        })
        .collect();
    assertions.sort();
    assertions
}

impl<'a> EntailmentAnswer<'a> {
    /// Answer about all statements.
    pub fn new(found: &'a [Entailment]) -> Self {
        let statement = |entailment: &'a Entailment| {
            let (follows, reason): (bool, &str) = match &entailment.answer {
                Answer::Follows(reason) => (true, reason),
                Answer::Open(reason) => (false, reason),
            };
            StatementPart { statement: &entailment.statement, follows, reason }
        };
        let statements: Vec<StatementPart<'a>> = found.iter().map(statement).collect();
        let entailed = statements.iter().all(|statement| statement.follows);
        Self { format: ENTAILS, entailed, statements }
    }
}

impl ReasonsAnswer {
    /// Answer about all assertions.
    pub fn new(answers: Vec<AssertionAnswer>) -> Self {
        Self { format: REASONS, answers }
    }
}

impl<'a> SchemaAnswer<'a> {
    /// Answer with all entities of the schema.
    pub fn new(schema: &'a Schema) -> Self {
        let parts = |entities: &'a [SchemaEntity]| entities.iter().map(EntityPart::of).collect();
        Self {
            format: SCHEMA,
            classes: parts(&schema.classes),
            object_properties: parts(&schema.object_properties),
            data_properties: parts(&schema.data_properties),
        }
    }
}

impl<'a> EntityPart<'a> {
    fn of(entity: &'a SchemaEntity) -> Self {
        Self {
            iri: &entity.iri,
            direct: &entity.direct,
            above: &entity.above,
            empty: entity.empty.as_deref(),
        }
    }
}
