//! `metaplan convert`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use metaplan::message::Message;
use ontology::OutputSyntax;

use crate::cli::common::{Common, Exit, Failure};
use crate::cli::limits::TimeLimit;
use crate::cli::output;
use crate::cli::situation::Imports;

/// Arguments of `convert`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Knowledge bases in any syntax, told by their content; they are written as one, with all that they import.
    #[arg(required = true, value_name = "KB")]
    documents: Vec<PathBuf>,
    /// What to write.
    #[arg(long = "to", value_enum, value_name = "SYNTAX")]
    syntax: Syntax,
    #[command(flatten)]
    imports: Imports,
    #[command(flatten)]
    time: TimeLimit,
    /// The file to write; standard output by default.
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// A syntax of knowledge bases.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Syntax {
    /// RDF/XML, every triple.
    Rdfxml,
    /// Turtle, every triple.
    Turtle,
    /// N-Triples, every triple, sorted.
    Ntriples,
    /// OWL/XML, what was understood.
    Owlxml,
    /// OWL 2 functional-style syntax, what was understood.
    Functional,
}

/// Runs the command.
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
