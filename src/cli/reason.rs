//! The command `metaplan reason`, which prints the conclusions of knowledge bases and answers queries about them.

use std::fmt::Write as _;
use std::path::PathBuf;

use crate::answers::{ReasonAnswer, statuses};
use crate::knowledge::{Contradiction, Knowledge, Sources};
use crate::message::Message;
use clap::Args;
use ontology::Equality;
use rules::{DEFAULT_STEP_BUDGET, Limits};

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::limits::TimeLimit;
use crate::cli::output;
use crate::cli::progress::during;
use crate::cli::reason_ask::Questions;
use crate::cli::situation::{Imports, consistent};
use crate::cli::values::setting;

/// Arguments of `reason`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Knowledge bases (OWL in RDF/XML, Turtle, N-Triples, OWL/XML or functional syntax); `-` is standard input.
    #[arg(required = true, value_name = "KB")]
    documents: Vec<PathBuf>,
    /// Additional rules: a file, `coadaptation` or `tomasys` (repeatable).
    #[arg(long = "rules", value_name = "FILE")]
    rules: Vec<String>,
    #[command(flatten)]
    imports: Imports,
    /// Add the statements of a document: assertions, axioms and rules (repeatable).
    #[arg(long, value_name = "FILE")]
    assert: Vec<PathBuf>,
    /// Remove the statements of a document: assertions, axioms and rules (repeatable).
    #[arg(long, value_name = "FILE")]
    retract: Vec<PathBuf>,
    /// Set a measured attribute to a value (repeatable).
    #[arg(long = "set", value_name = "ATTRIBUTE=VALUE", value_parser = setting)]
    set: Vec<(String, String)>,
    /// Mark a component as failed (repeatable).
    #[arg(long, value_name = "COMPONENT")]
    fail: Vec<String>,
    /// Assume that different names denote different individuals, as in PDDL but not in OWL.
    #[arg(long)]
    unique_names: bool,
    /// Maximum number of inference steps of one evaluation of the rules. The rules are evaluated again when they derive
    /// that individuals are equal. If the number is exceeded, the error names the rule that was being
    /// evaluated then; often this rule does not terminate.
    #[arg(long, value_name = "N", default_value_t = DEFAULT_STEP_BUDGET)]
    step_limit: u64,
    #[command(flatten)]
    questions: Questions,
    #[command(flatten)]
    time: TimeLimit,
}

pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let _guard = arguments.time.guard(common)?;
    let mut knowledge = during("reasoning", common, || read(arguments))?;
    output::warnings(common, knowledge.warnings());
    if !arguments.assert.is_empty() || !arguments.retract.is_empty() {
        let revision =
            during("reasoning", common, || knowledge.revise(&arguments.assert, &arguments.retract))?;
        output::warnings(common, &revision);
    }
    for component in &arguments.fail {
        knowledge.fail(component).map_err(Failure::usage)?;
    }
    for (attribute, value) in &arguments.set {
        knowledge.measure(attribute, value).map_err(Failure::usage)?;
    }
    if let Some(exit) = arguments.questions.answer(&mut knowledge, &arguments.imports, common)? {
        return Ok(exit);
    }
    let contradictions = knowledge.contradictions();
    match common.format {
        Format::Ntriples => {
            output::document(&ontology::ntriples(knowledge.engine().symbols(), &knowledge.inferred()));
        }
        Format::Turtle => {
            let triples = ontology::ntriples(knowledge.engine().symbols(), &knowledge.inferred());
            output::document(&ontology::turtle(&triples).map_err(|error| Message::from_ontology(&error))?);
        }
        Format::Json => output::json_answer(&ReasonAnswer::new(&knowledge, &contradictions)),
        Format::Text => output::answer(&text(&knowledge, &contradictions)),
    }
    if !contradictions.is_empty() && matches!(common.format, Format::Ntriples | Format::Turtle) {
        return consistent(Some(&knowledge)).map(|()| Exit::Done);
    }
    Ok(if contradictions.is_empty() { Exit::Done } else { Exit::Inconsistent })
}

fn read(arguments: &Arguments) -> Result<Knowledge, Failure> {
    let equality = if arguments.unique_names { Equality::UniqueNames } else { Equality::Owl };
    let (documents, rules) = (arguments.documents.clone(), arguments.rules.clone());
    let limits = Limits { steps: arguments.step_limit, ..Limits::default() };
    let sources = Sources { documents, rules, options: arguments.imports.options(), limits };
    Ok(Knowledge::read_as(&sources, equality)?)
}

fn text(knowledge: &Knowledge, contradictions: &[Contradiction]) -> String {
    let mut text = String::new();
    for contradiction in contradictions {
        let _ = writeln!(text, "inconsistent: {}", contradiction.violated);
        for fact in &contradiction.facts {
            let _ = writeln!(text, "    {fact}");
        }
    }
    let inferred = ontology::ntriples(knowledge.engine().symbols(), &knowledge.inferred());
    let rules = output::counted(knowledge.rule_count(), "rule");
    let _ = writeln!(text, "{rules}, {}", output::counted(inferred.lines().count(), "inferred assertion"));
    text += &inferred;
    let view = knowledge.view();
    let designs = view.function_designs();
    if !designs.is_empty() {
        let rows = designs.iter().map(|design| {
            let list = |all: &[ontology::tomasys::Individual]| {
                all.iter().map(|i| i.name.as_str()).collect::<Vec<_>>().join(", ")
            };
            let available = if design.available { "available" } else { "not available" };
            vec![
                list(&design.solves),
                design.individual.name.clone(),
                available.to_owned(),
                list(&design.components),
            ]
        });
        text.push('\n');
        text += &output::table(&["function", "design", "", "components"], rows);
    }
    let objectives = statuses(knowledge);
    if !objectives.is_empty() {
        text.push('\n');
        let rows = objectives.into_iter().map(|(objective, status)| vec![objective, status]);
        text += &output::table(&["objective", "status"], rows);
    }
    text
}
