//! The command `metaplan convert`, which merges knowledge bases and writes them in another syntax.

use std::path::PathBuf;

use crate::message::Message;
use clap::{Args, ValueEnum};
use ontology::OutputSyntax;

use crate::cli::common::{Common, Exit, Failure};
use crate::cli::limits::TimeLimit;
use crate::cli::output;
use crate::cli::situation::Imports;

/// Arguments of `convert`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Knowledge bases in any syntax, which is recognised by content. They are merged with their imports.
    #[arg(required = true, value_name = "KB")]
    documents: Vec<PathBuf>,
    /// Output format.
    #[arg(long = "to", value_enum, value_name = "SYNTAX")]
    syntax: Syntax,
    #[command(flatten)]
    imports: Imports,
    #[command(flatten)]
    time: TimeLimit,
    /// Output file. Default: standard output.
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// A syntax of knowledge bases.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Syntax {
    /// RDF/XML, with every triple.
    Rdfxml,
    /// Turtle, with every triple.
    Turtle,
    /// N-Triples, with every triple, sorted.
    Ntriples,
    /// OWL/XML, with all axioms that were recognised.
    Owlxml,
    /// OWL 2 functional-style syntax, with all axioms that were recognised.
    Functional,
}

pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let _guard = arguments.time.guard(common)?;
    let syntax = match arguments.syntax {
        Syntax::Rdfxml => OutputSyntax::RdfXml,
        Syntax::Turtle => OutputSyntax::Turtle,
        Syntax::Ntriples => OutputSyntax::NTriples,
        Syntax::Owlxml => OutputSyntax::OwlXml,
        Syntax::Functional => OutputSyntax::Functional,
    };
    let (text, warnings) =
        ontology::convert_files(&arguments.documents, &arguments.imports.options(), syntax)
            .map_err(|errors| errors.iter().map(Message::from_ontology).collect::<Vec<_>>())?;
    let warnings: Vec<_> = warnings.iter().map(Message::from_ontology_warning).collect();
    output::warnings(common, &warnings);
    match output::file_named(arguments.output.as_ref()) {
        Some(file) => output::write_file(file, &text)?,
        None => output::document(&text),
    }
    Ok(Exit::Done)
}
