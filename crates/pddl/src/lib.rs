//! PDDL parser, checker and printer, and a plan validator.
//!
//! The parser accepts the extensions of real files, with a warning where they deviate from the standard, and
//! continues after an error. [`validate`] executes plans on the syntax tree with exact rational numbers.
//!
//! The crate contains neither grounding nor solvers, and does not access the file system.
#![doc = include_str!("../README.md")]
#![warn(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    clippy::arithmetic_side_effects
)]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects))]

pub mod ast;
pub mod check;
mod codes;
pub mod diagnostic;
mod excerpt;
mod mentioned;
mod number;
pub mod parse;
mod portable;
pub mod print;
mod sexp;
mod signs;
pub mod source;
mod strata;
mod types;
pub mod validate;
mod validator;
pub mod visit;

pub use ::num_rational::BigRational;
pub use check::{check, check_domain, check_element, check_goal};
pub use codes::CODES;
pub use diagnostic::{Diagnostic, Errors, Severity, has_errors, render};
pub use excerpt::{Excerpt, Shown};
pub use mentioned::Mentioned;
pub use number::{is_readable, to_decimal};
pub use parse::{parse_domain, parse_problem, parse_problem_of};
pub use portable::portable;
pub use print::{print_domain, print_expression, print_problem};
pub use signs::Signs;
pub use source::{Position, Source};
pub use types::TypeHierarchy;
pub use validator::Validator;

use ast::{Direction, Domain, Metric, Problem};

/// Parses the expression of a metric and checks it against a domain and a problem. Returns the metric.
/// Warnings are returned only together with an error.
///
/// # Errors
///
/// Returns the errors and warnings about the objective if there is an error.
pub fn read_objective(
    direction: Direction,
    expression: &Source,
    domain: &Domain,
    problem: &Problem,
) -> Result<Metric, Errors> {
    let mut parsed = parse::expression(expression);
    if let Some(tree) = parsed.tree {
        let end = source::place(expression.text().len());
        let metric = Metric { direction, expression: tree, span: ast::Span { start: 0, end } };
        parsed.diagnostics.extend(check::objective(domain, problem, &metric, expression));
        if !has_errors(&parsed.diagnostics) {
            return Ok(metric);
        }
    }
    Err(parsed.diagnostics.into())
}

/// Parses and checks a domain and a problem. Returns both trees and the warnings.
///
/// ```
/// use metaplan_pddl::{Source, read};
///
/// let domain = Source::new("d.pddl", "(define (domain d) (:predicates (open))\n  (:action go :effect (opn)))");
/// let problem = Source::new("p.pddl", "(define (problem p) (:domain d) (:goal (open)))");
/// let wrong = read(&domain, &problem).expect_err("a predicate is not declared");
/// assert_eq!((wrong.len(), wrong[0].code), (1, "P121"));
/// ```
///
/// # Errors
///
/// Returns the errors and warnings of both files if a file has an error. Diagnostics about the domain come first;
/// those about one file are sorted by position.
pub fn read(domain: &Source, problem: &Source) -> Result<(Domain, Problem, Vec<Diagnostic>), Errors> {
    let parsed_domain = parse::domain(domain);
    let parsed_problem = match &parsed_domain.tree {
        Some(tree) => parse::problem_of(tree, problem),
        None => parse::problem(problem),
    };
    let mut name_diagnostics = Vec::new();
    // Names are checked only if all declarations were read. Otherwise each syntax error would cause many
    // errors about undeclared names.
    if parsed_domain.declarations_intact {
        name_diagnostics = match (&parsed_domain.tree, &parsed_problem.tree) {
            (Some(tree), Some(problem_tree)) if parsed_problem.declarations_intact => {
                check(tree, domain, problem_tree, problem)
            }
            (Some(tree), _) => check_domain(tree, domain),
            (None, _) => Vec::new(),
        };
    }
    let (mut messages, mut problem_messages) = (parsed_domain.diagnostics, parsed_problem.diagnostics);
    for diagnostic in name_diagnostics {
        let same_file = diagnostic.file == domain.name();
        (if same_file { &mut messages } else { &mut problem_messages }).push(diagnostic);
    }
    messages.sort_by_key(|diagnostic| diagnostic.span.start);
    problem_messages.sort_by_key(|diagnostic| diagnostic.span.start);
    messages.append(&mut problem_messages);
    match (parsed_domain.tree, parsed_problem.tree) {
        (Some(tree), Some(problem_tree)) if !has_errors(&messages) => Ok((tree, problem_tree, messages)),
        _ => Err(messages.into()),
    }
}
