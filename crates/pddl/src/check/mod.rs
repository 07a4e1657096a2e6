//! Names and types of a domain and a problem: everything used is declared, and used as declared.

mod action;
mod condition;
mod declarations;
mod initial;
mod soft;
mod symbols;

use rustc_hash::FxHashSet;

use super::ast::{Domain, Metric, Name, Problem, Span, TypedName};
use super::diagnostic::{Diagnostic, Severity, Sink};
use super::source::Source;
use symbols::Symbols;

/// The codes of messages about names that are declared nowhere.
const UNDECLARED: [&str; 5] = ["P120", "P121", "P122", "P123", "P136"];

/// How many predicates of `OWLToPDDL` must be undeclared for a domain to be one of its inputs.
const TEMPLATE_EVIDENCE: usize = 3;

/// Checks a domain without a problem.
pub fn check_domain(domain: &Domain, source: &Source) -> Vec<Diagnostic> {
    let symbols = Symbols::of(domain, None);
    check_domain_with(domain, source, &symbols).0
}

/// Checks a domain and a problem, each against its source; the domain's messages come first.
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
    let mut found = checker.sink.finish();
    if is_template {
        found.retain(|diagnostic| !UNDECLARED.contains(&diagnostic.code));
    }
    diagnostics.append(&mut found);
    diagnostics
}

/// The messages about an objective that stands in neither file.
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

/// The messages about a domain, and whether it is a template that `OWLToPDDL` still has to complete.
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
    let evidence = checker.undeclared_inferred.len();
    let mut diagnostics = checker.sink.finish();
    let is_template = evidence >= TEMPLATE_EVIDENCE;
    if is_template {
        diagnostics.retain(|diagnostic| !UNDECLARED.contains(&diagnostic.code));
        diagnostics.insert(0, template_message(domain, source, evidence));
    }
    (diagnostics, is_template)
}

fn template_message(domain: &Domain, source: &Source, evidence: usize) -> Diagnostic {
    let message = format!(
        "this domain asks a knowledge base, as inputs of OWLToPDDL do: {evidence} predicates named `inferred-…` are declared nowhere"
    );
    let mut diagnostic = Diagnostic::new(source, domain.name.span, Severity::Error, "P134", message);
    diagnostic.help(
        "give the knowledge base, which has the rest: `--kb FILE`, or `[knowledge]` in a mission's manifest",
    );
    diagnostic
}

/// What the parts of the checker share.
struct Checker<'a> {
    symbols: &'a Symbols<'a>,
    sink: Sink<'a>,
    /// Predicates that `OWLToPDDL` would add.
    undeclared_inferred: FxHashSet<&'a Name>,
    /// Whether this is the domain, where only its constants should be used.
    in_domain: bool,
    /// Whether `?duration` has a meaning here.
    in_durative_action: bool,
}

/// The variables that can be used, innermost last.
type Scope<'a> = Vec<&'a TypedName>;

impl<'a> Checker<'a> {
    fn new(symbols: &'a Symbols<'a>, source: &'a Source) -> Self {
        let undeclared_inferred = FxHashSet::default();
        let sink = Sink::new(source);
        Self { symbols, sink, undeclared_inferred, in_domain: false, in_durative_action: false }
    }

    /// Reports a name that is declared nowhere, with the nearest of the known ones.
    fn undeclared<'n>(
        &mut self,
        code: &'static str,
        span: Span,
        what: &str,
        name: &Name,
        known: impl IntoIterator<Item = &'n Name>,
    ) -> &mut Diagnostic {
        let help = if self.sink.is_full() { None } else { did_you_mean(name.as_str(), known) };
        let diagnostic = self.sink.error(code, span, format!("unknown {what} `{name}`"));
        diagnostic.help = help;
        diagnostic
    }
}

/// The most names that are compared for a proposal.
const PROPOSALS_LIMIT: usize = 5_000;

fn did_you_mean<'n>(written: &str, known: impl IntoIterator<Item = &'n Name>) -> Option<String> {
    let mut known: Vec<&str> = known.into_iter().take(PROPOSALS_LIMIT).map(Name::as_str).collect();
    known.sort_unstable();
    diagnostics::nearest(written, known).map(|name| format!("did you mean `{name}`?"))
}
