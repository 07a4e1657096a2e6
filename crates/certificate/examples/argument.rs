//! Checks claims about all plans of a ground task without a planner: lower bounds on their cost, and that there is
//! no plan.
//!
//! `cargo run -p metaplan-certificate --example argument`
#![expect(clippy::print_stdout, reason = "an example prints")]

use metaplan_certificate::{Fault, check};
use num_rational::BigRational;

/// A ground task without operators whose goal holds initially.
const TASK: &str = r#"{"format": "metaplan-task/1", "objects": [], "schemas": [],
  "variables": [["(p)", "none of these"]], "basic": 1, "values": [0], "numbers": [], "fluents": [], "number_scale": 1,
  "slots": [], "uses": [], "exclusions": [], "tables": [], "operators": [], "axioms": [], "goal": {"facts": [[0, 0]]},
  "objective": {"scale": 1, "offset": 0, "maximize": false}, "time_scale": 1}"#;
const ARGUMENT: &str =
    r#"{"format": "metaplan-argument/1", "potentials": [], "needs": [], "labels": [[[0], [], 0]]}"#;

fn main() {
    for cost in [0, 1] {
        let cost = BigRational::from_integer(cost.into());
        match check(TASK, ARGUMENT, Some(&cost)) {
            Ok(_) => println!("no plan costs less than {cost}"),
            Err(fault) => println!("not proved that no plan costs less than {cost}: {fault}"),
        }
    }
    // The task has a plan, so the claim of unsolvability is not proved.
    match check(TASK, ARGUMENT, None) {
        Ok(_) => println!("there is no plan"),
        Err(Fault::Solvable(label)) => println!("there may be a plan: label {label} is a goal"),
        Err(fault) => println!("not proved: {fault}"),
    }
}
