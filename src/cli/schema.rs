//! The command `metaplan schema`, which prints the JSON Schema of a format.

use crate::message::{Message, did_you_mean};
use crate::schemas::{FORMATS, schema};
use clap::Args;

use crate::cli::common::{Exit, Failure};
use crate::cli::output;

/// Arguments of `schema`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// `manifest`, `study`, `event`, `answer`, or the `format` of an answer without `metaplan-` and version,
    /// for example `plan`, `lint` or `verdict`. Without it, all formats are listed.
    #[arg(value_name = "FORMAT")]
    name: Option<String>,
}

pub fn run(arguments: &Arguments) -> Result<Exit, Failure> {
    let Some(name) = &arguments.name else {
        let rows = FORMATS.iter().map(|(format, about, _)| vec![(*format).to_owned(), (*about).to_owned()]);
        output::answer(&output::table(&["format", "of"], rows));
        return Ok(Exit::Done);
    };
    let Some(schema) = schema(name) else {
        let names: Vec<&str> = FORMATS.iter().map(|(format, ..)| *format).collect();
        let suggestion = did_you_mean(name, names.iter().copied());
        let text = format!("there is no format `{name}`; there are: {}{suggestion}", names.join(", "));
        return Err(Failure::usage(Message::error("M139", text)));
    };
    output::document(&output::pretty(&schema));
    Ok(Exit::Done)
}
