//! The program `metaplan`.

use std::process::ExitCode;

fn main() -> ExitCode {
    metaplan::cli::main()
}
