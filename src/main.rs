//! The command line of Metaplan.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main()
}
