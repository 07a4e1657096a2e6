//! Parses a domain and a problem, reports errors and warnings, and validates a plan.
//!
//! `cargo run -p metaplan-pddl --example judge -- DOMAIN PROBLEM PLAN`
#![expect(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;

use metaplan_pddl::{Source, Validator, read};

const DEFAULT_FILES: [(&str, &str); 3] = [
    (
        "domain.pddl",
        "(define (domain ferry) (:requirements :typing) (:types port)
  (:predicates (at ?p - port) (line ?from ?to - port))
  (:action sail :parameters (?from ?to - port) :precondition (and (at ?from) (line ?from ?to))
    :effect (and (not (at ?from)) (at ?to))))",
    ),
    (
        "problem.pddl",
        "(define (problem p) (:domain ferry) (:objects a b c - port)
  (:init (at a) (line a b) (line b c)) (:goal (at c)))",
    ),
    ("plan", "(sail a b)\n(sail b c)\n"),
];

fn main() -> Result<(), Box<dyn Error>> {
    let files: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let source = |index: usize| match files.get(index) {
        Some(file) => std::fs::read_to_string(file).map(|text| Source::new(file, text)),
        None => Ok(Source::new(DEFAULT_FILES[index].0, DEFAULT_FILES[index].1)),
    };
    // `read` returns the errors of both files as one value, each with its line and column.
    let (domain, problem, warnings) = read(&source(0)?, &source(1)?)?;
    for warning in &warnings {
        println!("{warning}");
    }
    let verdict = Validator::new(&domain, &problem).validate(&source(2)?)?;
    match &verdict.violation {
        None => println!("valid, total time {}", verdict.total_time),
        Some(violation) => println!("not valid: {}", violation.message),
    }
    Ok(())
}
