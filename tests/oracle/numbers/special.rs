//! Hand-made tasks with hundreds of designs, and with more designs than fit into 16 bits.

use std::time::Duration;

use crate::judge::{Tally, judge};

use super::model::{Action, Condition, Effect, Expr, Happening, Task, Term, applied, decimal, whole};
use super::model::{Change, Number};
use super::{Budget, Puzzle};

/// Each design costs `step` less than the previous design.
fn many_designs(count: i64, step: &Number) -> Task {
    let types = ["function", "functiondesign"].map(str::to_owned).to_vec();
    let mut task = Task { types, ..Task::default() };
    let solves = task.predicate("fd_solve_f", &[1, 0]);
    let available = task.predicate("fd_available", &[1]);
    let done = task.predicate("done", &[]);
    let usage = task.function("usage", &[1]);
    let cost = task.function("total-cost", &[]);
    let function = task.object("f".to_owned(), 0);
    for position in 0..count {
        let design = task.object(format!("fd{position}"), 1);
        task.atoms.push((solves, vec![design, function]));
        // The cheapest design is unavailable, so the second-cheapest design is optimal.
        if position + 1 < count {
            task.atoms.push((available, vec![design]));
        }
        task.values.push((usage, vec![design], whole(1_000_000) - whole(position) * step));
    }
    let parameters = vec![("f".to_owned(), 0), ("fd".to_owned(), 1)];
    let (function_term, design_term) = (Term::Parameter(0), Term::Parameter(1));
    let conditions = vec![
        Condition::Holds(applied(solves, &[design_term, function_term])),
        Condition::Holds(applied(available, &[design_term])),
    ];
    let effects = vec![
        Effect::Add(applied(done, &[])),
        Effect::Number(Change::Increase, applied(cost, &[]), Expr::Function(applied(usage, &[design_term]))),
    ];
    let start = Happening { conditions, effects };
    task.actions.push(Action { name: "go".to_owned(), parameters, start, lasting: None });
    task.goal.push(Condition::Holds(applied(done, &[])));
    task.metric = Some((false, Expr::Function(applied(cost, &[]))));
    task
}

fn judge_designs(count: i64, step: &str, limit: u64) {
    let task = many_designs(count, &decimal(step));
    let budget = Budget { states: 10, attempts: 1_000_000 };
    let puzzle = Puzzle::within(format!("designs-{count}"), task, &[], budget).expect("few states");
    let mut case = puzzle.case(true);
    case.limit = Duration::from_secs(limit);
    let mut tally = Tally::default();
    judge(&case, &mut tally);
    tally.finish();
}

#[test]
fn hundreds_of_designs() {
    judge_designs(300, "0.0123456789012345", 30);
}

#[test]
#[ignore = "66,000 designs of one function: seconds to minutes, much memory"]
fn design_numbers_can_exceed_16_bits() {
    judge_designs(66_000, "10", 600);
}

#[test]
#[ignore = "65,535, 65,536 and 65,537 designs of one function: seconds to minutes, much memory"]
fn design_numbers_around_the_16_bit_limit() {
    for count in [65_535, 65_536, 65_537] {
        judge_designs(count, "0.5", 600);
    }
}
