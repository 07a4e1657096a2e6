//! Anytime planning: prints every reported improvement, then the verdict (e.g. that the plan is optimal) and the plan
//! in the standard format. Without files, a built-in task is planned.
//!
//! `cargo run -p metaplan-planner --example anytime -- DOMAIN PROBLEM`
#![expect(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use std::ops::ControlFlow;
use std::time::Duration;

use metaplan_planner::pddl::{Source, read};
use metaplan_planner::{Planner, Status};

const DOMAIN: &str = "(define (domain crane) (:requirements :typing :action-costs) (:types box place)
  (:predicates (on ?b - box ?p - place)) (:functions (distance ?p ?q - place) - number (total-cost) - number)
  (:action move :parameters (?b - box ?p ?q - place) :precondition (on ?b ?p)
    :effect (and (not (on ?b ?p)) (on ?b ?q) (increase (total-cost) (distance ?p ?q)))))";
const PROBLEM: &str = "(define (problem p) (:domain crane) (:objects b1 b2 - box p q r - place)
  (:init (on b1 p) (on b2 p) (= (total-cost) 0)
    (= (distance p q) 2) (= (distance q r) 2) (= (distance p r) 5) (= (distance q p) 2) (= (distance r q) 2)
    (= (distance r p) 5) (= (distance p p) 0) (= (distance q q) 0) (= (distance r r) 0))
  (:goal (and (on b1 r) (on b2 q))) (:metric minimize (total-cost)))";

fn main() -> Result<(), Box<dyn Error>> {
    let files: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let (domain, problem) = match &files[..] {
        [domain, problem, ..] => (
            Source::new(domain, std::fs::read_to_string(domain)?),
            Source::new(problem, std::fs::read_to_string(problem)?),
        ),
        _ => (Source::new("domain.pddl", DOMAIN), Source::new("problem.pddl", PROBLEM)),
    };
    let (domain, problem, _warnings) = read(&domain, &problem)?;
    let planner =
        Planner::new(&domain, &problem).time_limit(Duration::from_secs(60)).on_improvement(|better| {
            println!("cost {}, no plan below {}", better.cost, better.lower_bound);
            ControlFlow::Continue(())
        });
    let solution = planner.plan()?;
    println!("{}", solution.verdict());
    if let (Status::Optimal | Status::Feasible, Some(plan)) = (solution.status, &solution.plan) {
        print!("{plan}");
    }
    Ok(())
}
