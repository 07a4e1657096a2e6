//! The commands `metaplan completions` and `metaplan man`. Their output is generated from the description of the
//! command line.

use std::path::PathBuf;

use crate::message::Message;
use clap::{Args, Command};
use clap_complete::Shell;

use crate::cli::common::{Exit, Failure};
use crate::cli::output;

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The shell.
    #[arg(value_enum)]
    shell: Shell,
}

/// Arguments of `man`.
#[derive(Debug, Args)]
pub struct ManArguments {
    /// Directory for the pages.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

pub fn run(arguments: &Arguments, mut command: Command) -> Exit {
    let name = command.get_name().to_owned();
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, name, &mut script);
    output::document(&String::from_utf8_lossy(&script));
    Exit::Done
}

pub fn man(arguments: &ManArguments, command: Command) -> Result<Exit, Failure> {
    let directory = &arguments.output;
    output::make_directory(directory)?;
    clap_mangen::generate_to(command, directory).map_err(|error| {
        let text = format!("the pages cannot be written: {}", error.kind());
        Message::at("M109", &directory.display().to_string(), None, text)
    })?;
    Ok(Exit::Done)
}
