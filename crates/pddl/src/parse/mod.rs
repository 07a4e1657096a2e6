//! Builds the abstract syntax tree from S-expressions. The parser reports problems and continues after each of them.
//!
//! Parts that cannot be read are omitted, so a tree with errors is incomplete.

mod assigned;
mod condition;
mod domain;
mod durative;
mod effect;
mod expression;
mod fluents;
mod init;
mod object;
mod problem;
mod soft;
mod trajectory;
mod typed;

use rustc_hash::FxHashMap;

use super::ast::{Domain, Expression, Identifier, Name, Problem, Span};
use super::diagnostic::{Diagnostic, Sink};
use super::number::{Literal, literal};
use super::sexp::{self, Item};
use super::source::Source;
use fluents::Objects;

/// Parses a domain. In case of errors the tree lacks the unreadable parts. The tree is absent if the text has
/// no `(define (domain …) …)`, is too large, or is nested too deeply.
pub fn parse_domain(source: &Source) -> (Option<Domain>, Vec<Diagnostic>) {
    let parsed = domain(source);
    (parsed.tree, parsed.diagnostics)
}

/// Parses a problem. In case of errors the tree lacks the unreadable parts. The tree is absent if the text
/// has no `(define (problem …) …)`, is too large, or is nested too deeply.
pub fn parse_problem(source: &Source) -> (Option<Problem>, Vec<Diagnostic>) {
    let parsed = problem(source);
    (parsed.tree, parsed.diagnostics)
}

/// Parses a problem of a domain that may declare object fluents (functions with objects as values). In case
/// of errors the tree lacks the unreadable parts, or is absent.
pub fn parse_problem_of(domain: &Domain, source: &Source) -> (Option<Problem>, Vec<Diagnostic>) {
    let parsed = problem_of(domain, source);
    (parsed.tree, parsed.diagnostics)
}

pub(super) fn expression(source: &Source) -> Parsed<Expression> {
    parse_top(source, |parser, top| {
        let mut items: Vec<_> = top.collect();
        let first = (!items.is_empty()).then(|| items.remove(0));
        for item in items {
            parser.sink.error("P104", at_start(item), "an objective is one expression");
        }
        if first.is_none() {
            parser.sink.error("P100", Span::default(), "the expression is empty");
        }
        parser.expression(first?)
    })
}

#[derive(Debug)]
pub(super) struct Parsed<T> {
    pub(super) tree: Option<T>,
    pub(super) diagnostics: Vec<Diagnostic>,
    /// `false` if declarations may be missing because of a syntax error. A name may then seem undeclared.
    pub(super) declarations_intact: bool,
}

pub(super) fn domain(source: &Source) -> Parsed<Domain> {
    parse(source, Parser::domain)
}

pub(super) fn problem(source: &Source) -> Parsed<Problem> {
    parse(source, Parser::problem)
}

pub(super) fn problem_of(domain: &Domain, source: &Source) -> Parsed<Problem> {
    parse(source, |parser, define| {
        parser.objects = Objects::of(domain);
        parser.problem(define)
    })
}

fn parse<'s, T>(source: &'s Source, build: impl FnOnce(&mut Parser<'s>, Item<'_>) -> Option<T>) -> Parsed<T> {
    parse_top(source, |parser, top| {
        let define = parser.define(top)?;
        build(parser, define)
    })
}

fn parse_top<'s, T>(
    source: &'s Source,
    build: impl FnOnce(&mut Parser<'s>, sexp::Items<'_>) -> Option<T>,
) -> Parsed<T> {
    let mut sink = Sink::new(source);
    let tree = sexp::read(source.text(), &mut sink);
    let well_formed = !sink.has_errors();
    let mut parser = Parser {
        sink,
        names: FxHashMap::default(),
        declarations_intact: well_formed,
        has_unknown_section: false,
        objects: Objects::default(),
    };
    let tree = tree.and_then(|tree| build(&mut parser, tree.top()));
    Parsed { tree, declarations_intact: parser.declarations_intact, diagnostics: parser.sink.finish() }
}

struct Parser<'s> {
    sink: Sink<'s>,
    names: FxHashMap<Box<str>, Name>,
    declarations_intact: bool,
    /// Whether a section was reported as unknown. A missing section may then be a misspelt one.
    has_unknown_section: bool,
    objects: Objects,
}

impl Parser<'_> {
    fn define<'t>(&mut self, top: sexp::Items<'t>) -> Option<Item<'t>> {
        let mut define = None;
        for item in top {
            match define {
                None if item.is_headed("define") => define = Some(item),
                // Files of the first planning competition (1998) are Lisp sources.
                None if item.is_headed("in-package") => {
                    self.sink.warning("P104", at_start(item), "`in-package` is ignored");
                }
                _ => {
                    let subject = if item.is_list() { "this list" } else { "this word" };
                    self.sink
                        .error("P104", at_start(item), format!("{subject} stands outside of the definition"))
                        .help("a file has one `(define …)` and nothing else");
                }
            }
        }
        if define.is_none() && !self.sink.has_errors() {
            self.sink
                .error("P100", Span::default(), "the file is empty")
                .help("a domain begins with `(define (domain …)`, a problem with `(define (problem …)`");
        }
        define
    }

    fn name(&mut self, written: &str) -> Name {
        if let Some(name) = self.names.get(written) {
            return name.clone();
        }
        let name = Name::new(written);
        self.names.insert(written.into(), name.clone());
        name
    }

    fn identifier(&mut self, written: &str, span: Span) -> Identifier {
        Identifier { name: self.name(written), span }
    }

    fn name_item(&mut self, item: Item<'_>, description: &str) -> Option<Identifier> {
        match item.symbol() {
            Some(symbol) if !symbol.starts_with(['?', ':']) => Some(self.identifier(symbol, item.span())),
            Some(symbol) => {
                self.sink.error("P106", item.span(), format!("`{symbol}` is not {description}"));
                None
            }
            None => {
                self.sink.error("P106", at_start(item), format!("this is a list, expected {description}"));
                None
            }
        }
    }

    /// Reports a syntax error at the beginning of an item. `description` names the expected
    /// construct, with its article.
    fn expected(&mut self, item: Item<'_>, description: &str) -> &mut Diagnostic {
        let actual = match item.symbol() {
            Some(symbol) => format!("`{symbol}`"),
            None => match item.head() {
                Some(head) => format!("`({head} …)`"),
                None => "a list".to_owned(),
            },
        };
        let diagnostic =
            self.sink.error("P106", at_start(item), format!("expected {description}, found {actual}"));
        if item.symbol().is_some_and(|symbol| symbol.starts_with("{{") || symbol.starts_with("{%")) {
            diagnostic.help("this file is a template; give the file that is generated from it");
        }
        diagnostic
    }

    fn refuse(&mut self, item: Item<'_>, construct: &str) -> &mut Diagnostic {
        self.sink.error("P113", at_start(item), format!("{construct} are not supported"))
    }

    fn operands<'t, const N: usize>(&mut self, list: Item<'t>, form: &str) -> Option<[Item<'t>; N]> {
        let operands: Vec<_> = list.rest().collect();
        let count = operands.len();
        let operands = operands.try_into().ok();
        if operands.is_none() {
            let head = list.head().unwrap_or_default();
            let plural = if N == 1 { "" } else { "s" };
            self.sink
                .error("P108", list_start(list), format!("`{head}` takes {N} operand{plural}, found {count}"))
                .help(format!("write `{form}`"));
        }
        operands
    }

    fn number(&mut self, item: Item<'_>) -> Option<num_rational::BigRational> {
        match item.symbol().map(literal) {
            Some(Literal::Number(value)) => Some(value),
            Some(Literal::TooLong) => {
                self.sink.error("P105", item.span(), "this number is too long");
                None
            }
            _ => {
                self.expected(item, "a number");
                None
            }
        }
    }
}

/// Returns the extent to underline for an item: the whole symbol, or the parenthesis and the head of a list.
fn at_start(item: Item<'_>) -> Span {
    if item.is_list() { list_start(item) } else { item.span() }
}

#[expect(clippy::arithmetic_side_effects, reason = "a parenthesis is a byte of the text")]
fn list_start(list: Item<'_>) -> Span {
    let span = list.span();
    let end = match list.items().next() {
        Some(first) if !first.is_list() => first.span().end,
        _ => span.start + 1,
    };
    Span { start: span.start, end }
}
