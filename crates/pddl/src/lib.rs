//! The language: PDDL text to syntax tree and back, and what a plan does by its definition.
//!
//! Everything that real files contain is read, with a warning where they leave the standard; whatever is
//! wrong is reported at its place, all of it at once. [`validate`] executes plans on the syntax tree, with exact numbers.
//! No grounding, no solver and no file system here.
//!
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
pub mod source;
mod strata;
mod types;
pub mod validate;
mod validator;
pub mod visit;

pub use ::num_rational::BigRational;
pub use check::{check, check_domain};
pub use codes::CODES;
pub use diagnostic::{Diagnostic, Errors, Severity, has_errors, render};
pub use excerpt::{Excerpt, Shown};
pub use mentioned::Mentioned;
pub use number::to_decimal;
pub use parse::{parse_domain, parse_problem, parse_problem_of};
pub use portable::portable;
pub use print::{print_domain, print_problem};
pub use source::{Position, Source};
pub use types::TypeHierarchy;
pub use validator::Validator;

use ast::{Direction, Domain, Metric, Problem};

/// An objective from the text of its expression, checked against a domain and a problem.
///
/// # Errors
///
/// All that is wrong with it.
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

/// A domain and a problem from their texts, with the warnings about both.
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
/// All that is wrong, together with the warnings: the domain's messages first, each file's in its order.
pub fn read(domain: &Source, problem: &Source) -> Result<(Domain, Problem, Vec<Diagnostic>), Errors> {
    let parsed_domain = parse::domain(domain);
    let parsed_problem = match &parsed_domain.tree {
        Some(tree) => parse::problem_of(tree, problem),
        None => parse::problem(problem),
    };
    let mut found = Vec::new();
    // Names are checked where what declares them was read; otherwise each error would be followed by many.
    if parsed_domain.declarations_intact {
        found = match (&parsed_domain.tree, &parsed_problem.tree) {
            (Some(tree), Some(other)) if parsed_problem.declarations_intact => {
                check(tree, domain, other, problem)
            }
            (Some(tree), _) => check_domain(tree, domain),
            (None, _) => Vec::new(),
        };
    }
    let (mut of_domain, mut of_problem) = (parsed_domain.diagnostics, parsed_problem.diagnostics);
    for diagnostic in found {
        let same_file = diagnostic.file == domain.name();
        (if same_file { &mut of_domain } else { &mut of_problem }).push(diagnostic);
    }
    of_domain.sort_by_key(|diagnostic| diagnostic.span.start);
    of_problem.sort_by_key(|diagnostic| diagnostic.span.start);
    of_domain.append(&mut of_problem);
    match (parsed_domain.tree, parsed_problem.tree) {
        (Some(tree), Some(other)) if !has_errors(&of_domain) => Ok((tree, other, of_domain)),
        _ => Err(of_domain.into()),
    }
}
