//! Collects all parse errors in a line of numbers as one error.
//!
//! `cargo run -p metaplan-diagnostics --example numbers -- "1 2 x 300"`
#![expect(clippy::print_stdout, reason = "an example prints")]

use std::num::ParseIntError;

use diagnostics::Errors;

fn numbers(line: &str) -> Result<Vec<u8>, Errors<ParseIntError>> {
    let (read, wrong): (Vec<_>, Vec<_>) =
        line.split_whitespace().map(str::parse::<u8>).partition(Result::is_ok);
    Errors::unless_empty(wrong.into_iter().filter_map(Result::err))?;
    Ok(read.into_iter().flatten().collect())
}

fn main() {
    let line = std::env::args().nth(1).filter(|word| !word.starts_with('-'));
    match numbers(line.as_deref().unwrap_or("1 2 x 300")) {
        Ok(numbers) => println!("{numbers:?}"),
        Err(wrong) => println!("{} errors:\n{wrong}", wrong.len()),
    }
}
