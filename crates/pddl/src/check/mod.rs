//! Semantic checks of a domain and a problem: symbols are declared and used with the declared types,
//! declarations do not contradict each other, and no derived predicate depends on its own negation.

mod action;
mod condition;
mod declarations;
mod initial;
mod soft;
mod symbols;

use rustc_hash::FxHashSet;

use super::ast::{Domain, InitialElement, Metric, Name, Problem, Span, TypedName};
use super::diagnostic::{Diagnostic, Severity, Sink};
use super::source::Source;
use symbols::Symbols;

const UNDECLARED_CODES: [&str; 5] = ["P120", "P121", "P122", "P123", "P136"];

/// Minimum number of undeclared names `inferred-…` for a domain to count as a template of PLANTA's `OWLToPDDL`. A
/// knowledge base provides these predicates.
const MIN_TEMPLATE_PREDICATES: usize = 3;

/// Checks a domain without a problem. Returns errors and warnings. For a template of PLANTA's
/// `OWLToPDDL` (a domain with at least three undeclared names `inferred-…`), one error P134
/// replaces the messages about undeclared types, predicates, functions and objects.
pub fn check_domain(domain: &Domain, source: &Source) -> Vec<Diagnostic> {
    let symbols = Symbols::of(domain, None);
    check_domain_with(domain, source, &symbols).0
}

/// Checks a domain and a problem. Returns errors and warnings. Messages about the domain come
/// first. For a template of PLANTA's `OWLToPDDL` (a domain with at least three undeclared names
/// `inferred-…`), one error P134 replaces the messages about undeclared types, predicates,
/// functions and objects.
pub fn check(
    domain: &Domain,
    domain_source: &Source,
    problem: &Problem,
    problem_source: &Source,
) -> Vec<Diagnostic> {
    let symbols = Symbols::of(domain, Some(problem));
    let (mut diagnostics, is_template) = check_domain_with(domain, domain_source, &symbols);
    let mut checker = Checker::new(&symbols, problem_source);
    checker.domain_name(domain, domain_source, problem);
    checker.requirements(&problem.requirements);
    checker.objects(domain, domain_source, problem);
    checker.initial_state(&problem.init);
    checker.goal(&problem.goal);
    checker.constraints(&problem.constraints);
    if let Some(metric) = &problem.metric {
        checker.metric(metric);
    }
    let mut problem_diagnostics = checker.sink.finish();
    if is_template {
        // The knowledge base declares these names later.
        problem_diagnostics.retain(|diagnostic| !UNDECLARED_CODES.contains(&diagnostic.code));
    }
    diagnostics.append(&mut problem_diagnostics);
    diagnostics
}

/// Checks only the goal of a problem. Returns errors and warnings.
pub fn check_goal(domain: &Domain, problem: &Problem, source: &Source) -> Vec<Diagnostic> {
    let symbols = Symbols::of(domain, Some(problem));
    let mut checker = Checker::new(&symbols, source);
    checker.goal(&problem.goal);
    checker.sink.finish()
}

/// Checks only one element of the initial state of a problem. Returns errors and warnings.
pub fn check_element(
    domain: &Domain,
    problem: &Problem,
    element: &InitialElement,
    source: &Source,
) -> Vec<Diagnostic> {
    let symbols = Symbols::of(domain, Some(problem));
    let mut checker = Checker::new(&symbols, source);
    checker.initial_state(std::slice::from_ref(element));
    checker.sink.finish()
}

pub(super) fn objective(
    domain: &Domain,
    problem: &Problem,
    metric: &Metric,
    source: &Source,
) -> Vec<Diagnostic> {
    let symbols = Symbols::of(domain, Some(problem));
    let mut checker = Checker::new(&symbols, source);
    checker.metric(metric);
    checker.sink.finish()
}

/// Returns the errors and warnings of a domain, and `true` if the domain is a template for PLANTA's `OWLToPDDL`.
fn check_domain_with(domain: &Domain, source: &Source, symbols: &Symbols<'_>) -> (Vec<Diagnostic>, bool) {
    let mut checker = Checker::new(symbols, source);
    checker.in_domain = true;
    checker.requirements(&domain.requirements);
    checker.types(domain);
    checker.constants(domain);
    checker.predicates_and_functions(domain);
    checker.derived(domain);
    checker.constraints(&domain.constraints);
    checker.actions(domain);
    let inferred_count = checker.undeclared_inferred.len();
    let mut diagnostics = checker.sink.finish();
    let is_template = inferred_count >= MIN_TEMPLATE_PREDICATES;
    if is_template {
        diagnostics.retain(|diagnostic| !UNDECLARED_CODES.contains(&diagnostic.code));
        diagnostics.insert(0, template_message(domain, source, inferred_count));
    }
    (diagnostics, is_template)
}

fn template_message(domain: &Domain, source: &Source, inferred_count: usize) -> Diagnostic {
    let message = format!(
        "this domain asks a knowledge base, as inputs of OWLToPDDL do: {inferred_count} predicates named `inferred-…` are declared nowhere"
    );
    let mut diagnostic = Diagnostic::new(source, domain.name.span, Severity::Error, "P134", message);
    diagnostic.help(
        "give the knowledge base, which has the rest: `--kb FILE`, or `[knowledge]` in a mission's manifest",
    );
    diagnostic
}

struct Checker<'a> {
    symbols: &'a Symbols<'a>,
    sink: Sink<'a>,
    /// Undeclared predicates and functions `inferred-…`; PLANTA's `OWLToPDDL` would declare such predicates.
    undeclared_inferred: FxHashSet<&'a Name>,
    /// `true` while a domain is checked. A domain should use only its own constants, not objects of a problem.
    in_domain: bool,
    in_durative_action: bool,
}

/// Variables in scope, innermost last.
type Scope<'a> = Vec<&'a TypedName>;

impl<'a> Checker<'a> {
    fn new(symbols: &'a Symbols<'a>, source: &'a Source) -> Self {
        let undeclared_inferred = FxHashSet::default();
        let sink = Sink::new(source);
        Self { symbols, sink, undeclared_inferred, in_domain: false, in_durative_action: false }
    }

    fn undeclared<'n>(
        &mut self,
        code: &'static str,
        span: Span,
        noun: &str,
        name: &Name,
        candidates: impl IntoIterator<Item = &'n Name>,
    ) -> &mut Diagnostic {
        let help = if self.sink.is_full() { None } else { did_you_mean(name.as_str(), candidates) };
        let diagnostic = self.sink.error(code, span, format!("unknown {noun} `{name}`"));
        diagnostic.help = help;
        diagnostic
    }
}

const MAX_CANDIDATES: usize = 5_000;

fn did_you_mean<'n>(written: &str, candidates: impl IntoIterator<Item = &'n Name>) -> Option<String> {
    let mut candidates: Vec<&str> = candidates.into_iter().take(MAX_CANDIDATES).map(Name::as_str).collect();
    // Hash maps have no stable order; messages must be deterministic.
    candidates.sort_unstable();
    diagnostics::nearest(written, candidates).map(|name| format!("did you mean `{name}`?"))
}
