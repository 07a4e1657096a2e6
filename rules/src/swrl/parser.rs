//! Recursive-descent parser of rule texts. After an error, the parser continues with the next rule, so that the
//! errors of several rules are reported together.

use std::sync::Arc;

use super::foreign::{ForeignAtom, unknown};
use super::lexer::{Fault, Spanned, Token, tokens};
use super::prefixes::Prefixes;
use crate::builtin::{BuiltIn, SWRLB, is_refused};
use crate::error::{Error, Errors};
use crate::literal::{Literal, XSD, is_datatype};
use crate::rule::{Aggregate, Atom, Program, Rule, RuleIdentity, Term, Variable};
use crate::symbol::{Symbol, Symbols};

const LIBRARIES: [&str; 2] =
    ["http://swrl.stanford.edu/ontologies/built-ins/", "http://sqwrl.stanford.edu/ontologies/built-ins/"];

/// Syntax options of rule texts.
#[derive(Clone, PartialEq, Eq, Default, Debug)]
pub struct Syntax {
    /// If `true`, the extensions of SWRL (`not` and aggregates) are rejected.
    pub swrl_only: bool,
    /// Built-ins in addition to those of SWRL, see [`BuiltIn::custom`].
    pub built_ins: Vec<BuiltIn>,
}

/// Parses rules. `source` names the text in rule identities and errors. Prefix declarations of the text
/// supplement or override `prefixes`.
///
/// ```
/// use metaplan_rules::{Prefixes, Symbols, parse_rules};
///
/// let wrong = parse_rules("Lamp(?l -> Dark(?l) .", "lamps.swrl", &mut Symbols::new(), &Prefixes::new()).expect_err("no bracket");
/// assert!(wrong.to_string().starts_with("lamps.swrl:1:"));
/// ```
///
/// # Errors
/// Returns the errors of the text: R101, R102, R104. After the first error in a rule, the parser skips the text up to
/// the next full stop, label or prefix declaration.
pub fn parse_rules(
    text: &str,
    source: &str,
    symbols: &mut Symbols,
    prefixes: &Prefixes,
) -> Result<Program, Errors> {
    parse_rules_as(text, source, symbols, prefixes, &Syntax::default())
}

/// Parses rules like [`parse_rules`], with syntax options.
///
/// # Errors
/// Returns the errors of [`parse_rules`], and R105 for an extension of SWRL if [`Syntax::swrl_only`] is set.
pub fn parse_rules_as(
    text: &str,
    source: &str,
    symbols: &mut Symbols,
    prefixes: &Prefixes,
    syntax: &Syntax,
) -> Result<Program, Errors> {
    parse(text, source, symbols, prefixes, syntax).map(|(program, _)| program)
}

/// Parses several rule texts about one ontology; `texts` contains pairs of source name and text. A relation in a body
/// that no rule of any text derives has to be a class (one argument) or a property (two arguments). If an atom has
/// another number of arguments, or a literal as its first one, its relation is reported as an unknown built-in.
///
/// # Errors
/// Returns the errors of [`parse_rules_as`] for each text. Without errors, returns R104 for unknown
/// built-ins of any namespace.
pub fn parse_rules_together(
    texts: &[(&str, &str)],
    symbols: &mut Symbols,
    prefixes: &Prefixes,
    syntax: &Syntax,
) -> Result<Program, Errors> {
    let (mut program, mut foreign, mut errors) = (Program::default(), Vec::new(), Vec::new());
    for (source, text) in texts {
        match parse(text, source, symbols, prefixes, syntax) {
            Ok((text_program, atoms)) => {
                foreign.extend(atoms.into_iter().map(|atom| (*source, atom)));
                program.rules.extend(text_program.rules);
            }
            Err(text_errors) => errors.extend(text_errors),
        }
    }
    // Only the complete program shows which relations are derived.
    if errors.is_empty() {
        errors = unknown(foreign, &program, symbols);
    }
    if errors.is_empty() { Ok(program) } else { Err(errors.into()) }
}

fn parse(
    text: &str,
    source: &str,
    symbols: &mut Symbols,
    prefixes: &Prefixes,
    syntax: &Syntax,
) -> Result<(Program, Vec<ForeignAtom>), Errors> {
    let (tokens, faults) = tokens(text);
    let errors = faults.into_iter().map(|fault| fault_at(source, fault)).collect();
    let source: Arc<str> = source.into();
    let (variables, foreign, prefixes) = (Vec::new(), Vec::new(), prefixes.clone());
    let mut parser = Parser {
        tokens,
        cursor: 0,
        source,
        symbols,
        prefixes,
        syntax,
        variables,
        foreign,
        errors,
        aggregate_depth: 0,
    };
    let program = parser.program();
    if parser.errors.is_empty() { Ok((program, parser.foreign)) } else { Err(parser.errors.into()) }
}

fn fault_at(source: &str, fault: Fault) -> Error {
    Error::Syntax { file: source.to_string(), line: fault.line, column: fault.column, message: fault.message }
}

const MAX_AGGREGATE_DEPTH: u8 = 2;

struct Parser<'a> {
    tokens: Vec<Spanned>,
    cursor: usize,
    source: Arc<str>,
    symbols: &'a mut Symbols,
    prefixes: Prefixes,
    syntax: &'a Syntax,
    variables: Vec<Box<str>>,
    /// Atoms that can be neither class nor property atoms, because of their arguments. Built-ins and head atoms are
    /// included; `unknown` removes them.
    foreign: Vec<ForeignAtom>,
    errors: Vec<Error>,
    aggregate_depth: u8,
}

/// Result of a parsing function. After an error, the rest of the rule is skipped.
type Parsed<T> = Result<T, Error>;

impl Parser<'_> {
    fn program(&mut self) -> Program {
        let mut program = Program::default();
        while *self.peek() != Token::End {
            let parsed = if *self.peek() == Token::Prefix {
                self.prefix().map(|()| None)
            } else {
                self.rule(program.rules.len() as u32).map(Some)
            };
            match parsed {
                Ok(rule) => program.rules.extend(rule),
                Err(error) => {
                    self.errors.push(error);
                    self.recover();
                }
            }
        }
        program
    }

    fn peek(&self) -> &Token {
        &self.tokens[self.cursor.min(self.tokens.len() - 1)].token
    }

    fn bump(&mut self) -> Token {
        let token = self.peek().clone();
        self.cursor += 1;
        token
    }

    fn accept(&mut self, token: &Token) -> bool {
        let is_match = self.peek() == token;
        self.cursor += usize::from(is_match);
        is_match
    }

    fn position(&self) -> (u32, u32) {
        let spanned = &self.tokens[self.cursor.min(self.tokens.len() - 1)];
        (spanned.line, spanned.column)
    }

    fn error(&self, expected: &str) -> Error {
        let (line, column) = self.position();
        let message = format!("expected {expected}, found {}", describe(self.peek()));
        fault_at(&self.source, Fault { message, line, column })
    }

    fn expect(&mut self, token: &Token, expected: &str) -> Parsed<()> {
        if self.accept(token) { Ok(()) } else { Err(self.error(expected)) }
    }

    /// Skips the rest of a faulty rule: past the next full stop, or up to the next label or prefix
    /// declaration.
    fn recover(&mut self) {
        loop {
            match self.peek() {
                Token::End | Token::Label(_) | Token::Prefix => return,
                Token::Stop => {
                    self.cursor += 1;
                    return;
                }
                _ => self.cursor += 1,
            }
        }
    }

    fn prefix(&mut self) -> Parsed<()> {
        self.bump();
        let Token::Name(Some(prefix), local) = self.peek().clone() else { return Err(self.error("`name:`")) };
        if !local.is_empty() {
            return Err(self.error("`name:` before a blank"));
        }
        self.bump();
        let Token::Iri(iri) = self.peek().clone() else { return Err(self.error("an IRI in angle brackets")) };
        self.bump();
        self.accept(&Token::Stop);
        self.prefixes.insert(&prefix, &iri);
        Ok(())
    }

    fn rule(&mut self, position: u32) -> Parsed<Rule> {
        self.variables.clear();
        let mut label = None;
        if let Token::Label(text) = self.peek() {
            label = Some(Arc::from(text.as_str()));
            self.bump();
        }
        let body = if *self.peek() == Token::Arrow { Vec::new() } else { self.atoms()? };
        self.expect(&Token::Arrow, "`^`, `,` or `->`")?;
        let empty = matches!(self.peek(), Token::Stop | Token::End);
        let head = if empty { Vec::new() } else { self.atoms()? };
        self.accept(&Token::Stop);
        let identity = RuleIdentity { source: Arc::clone(&self.source), label, position };
        Ok(Rule { identity, head, body, variables: std::mem::take(&mut self.variables) })
    }

    fn atoms(&mut self) -> Parsed<Vec<Atom>> {
        let mut atoms = vec![self.atom()?];
        while matches!(self.peek(), Token::And | Token::Comma) {
            self.bump();
            atoms.push(self.atom()?);
        }
        Ok(atoms)
    }

    fn atom(&mut self) -> Parsed<Atom> {
        // Only an aggregate starts with a term: `?n = count { … }`.
        let is_equation = self.tokens.get(self.cursor + 1).is_some_and(|next| next.token == Token::Equals);
        if is_equation || matches!(self.peek(), Token::Variable(_) | Token::Text(_) | Token::Number(_)) {
            return self.aggregate();
        }
        let is_not = matches!(self.peek(), Token::Name(None, name) if name == "not");
        // `not(…)` is an ordinary atom; negation needs a predicate between `not` and the parenthesis.
        let negated =
            is_not && self.tokens.get(self.cursor + 1).is_some_and(|next| next.token != Token::Open);
        self.cursor += usize::from(negated);
        let place = self.position();
        let name = self.peek().clone();
        let predicate = self.name()?;
        self.expect(&Token::Open, "`(`")?;
        let mut arguments = Vec::new();
        if !self.accept(&Token::Close) {
            arguments.push(self.term()?);
            while self.accept(&Token::Comma) {
                arguments.push(self.term()?);
            }
            self.expect(&Token::Close, "`,` or `)`")?;
        }
        self.foreign.extend(ForeignAtom::from_atom(&predicate, &arguments, place, self.symbols));
        if negated {
            self.refuse_in_swrl("negation as failure", place)?;
        }
        let atom = self.resolve(&name, predicate, arguments, place)?;
        Ok(if negated { atom.negated() } else { atom })
    }

    /// Creates the atom with a predicate and arguments: a built-in, a data range, a comparison of individuals, or a
    /// relation. `name` is the token of the predicate, and `place` its position.
    fn resolve(
        &mut self,
        name: &Token,
        predicate: String,
        mut arguments: Vec<Term>,
        place: (u32, u32),
    ) -> Parsed<Atom> {
        if let Some(&built_in) = self.syntax.built_ins.iter().find(|b| b.name() == predicate) {
            return Ok(Atom::BuiltIn { built_in, arguments });
        }
        if let Some(local) = predicate.strip_prefix(SWRLB) {
            return match BuiltIn::from_name(local) {
                Some(built_in) => Ok(Atom::BuiltIn { built_in, arguments }),
                None => Err(self.unknown_built_in(local, place)),
            };
        }
        if let Some(built_in) = BuiltIn::from_iri(&predicate) {
            self.name_expression(built_in, &mut arguments);
            return Ok(Atom::BuiltIn { built_in, arguments });
        }
        // A predicate of a built-in library is never a relation of the knowledge base. As a relation it
        // would be empty.
        if LIBRARIES.iter().any(|library| predicate.starts_with(library)) {
            let (file, (line, column)) = (self.source.to_string(), place);
            return Err(Error::ForeignBuiltIn { file, line, column, name: predicate });
        }
        if let (true, [value]) = (is_datatype(&predicate), arguments.as_slice()) {
            return Ok(self.data_range(*value, predicate));
        }
        let owl = predicate.strip_prefix("http://www.w3.org/2002/07/owl#");
        let word = match name {
            Token::Name(None, word) => Some(word.as_str()),
            _ => owl,
        };
        Ok(match (word, arguments.as_slice()) {
            (Some("sameAs"), &[left, right]) => Atom::Same(left, right),
            (Some("differentFrom"), &[left, right]) => Atom::Different(left, right),
            _ => Atom::Relation { predicate: self.symbols.name(&predicate), arguments },
        })
    }

    fn name_expression(&mut self, built_in: BuiltIn, arguments: &mut [Term]) {
        let [_, Term::Constant(text), values @ ..] = arguments else { return };
        let Some(Literal::String(expression)) = self.symbols.value(*text).as_literal() else { return };
        let name = |term: &Term| Some(&*self.variables[usize::from(term.as_variable()?.0)]);
        let names: Vec<Option<&str>> = values.iter().map(name).collect();
        if let Some(named) = built_in.with_names(expression, &names) {
            *text = self.symbols.literal(Literal::String(named.into()));
        }
    }

    /// Parses `?n = count { atoms }` or `?n = sum { term | atoms }`, and `min` and `max` likewise.
    fn aggregate(&mut self) -> Parsed<Atom> {
        let place = self.position();
        let result = self.term()?;
        self.expect(&Token::Equals, "an atom, or `=` and an aggregate")?;
        let aggregate: Option<fn(Term) -> Aggregate> = match self.peek() {
            Token::Name(None, word) => match word.as_str() {
                "count" => None,
                "sum" => Some(Aggregate::Sum),
                "min" => Some(Aggregate::Min),
                "max" => Some(Aggregate::Max),
                _ => return Err(self.error("`count`, `sum`, `min` or `max`")),
            },
            _ => return Err(self.error("`count`, `sum`, `min` or `max`")),
        };
        self.bump();
        self.expect(&Token::OpenBrace, "`{`")?;
        let aggregate = match aggregate {
            Some(aggregate) => {
                let value = self.term()?;
                self.expect(&Token::Bar, "`|`")?;
                aggregate(value)
            }
            None => Aggregate::Count,
        };
        // The check of the rules reports an aggregate within an aggregate. Here, the recursion is bounded.
        if self.aggregate_depth >= MAX_AGGREGATE_DEPTH {
            return Err(self.error("atoms that are no aggregates"));
        }
        self.aggregate_depth += 1;
        let body = self.atoms();
        self.aggregate_depth -= 1;
        let body = body?;
        self.expect(&Token::CloseBrace, "`^`, `,` or `}`")?;
        self.refuse_in_swrl("an aggregate", place)?;
        Ok(Atom::Aggregate { aggregate, result, body })
    }

    fn data_range(&mut self, value: Term, datatype: String) -> Atom {
        let datatype = self.symbols.literal(Literal::Uri(datatype.into()));
        Atom::BuiltIn { built_in: BuiltIn::DataRange, arguments: vec![value, Term::Constant(datatype)] }
    }

    fn refuse_in_swrl(&self, what: &'static str, (line, column): (u32, u32)) -> Parsed<()> {
        let file = self.source.to_string();
        if self.syntax.swrl_only { Err(Error::NotSwrl { file, line, column, what }) } else { Ok(()) }
    }

    fn unknown_built_in(&self, name: &str, (line, column): (u32, u32)) -> Error {
        let (file, name) = (self.source.to_string(), name.to_string());
        if is_refused(&name) {
            Error::RefusedBuiltIn { file, line, column, name }
        } else {
            Error::UnknownBuiltIn { file, line, column, name }
        }
    }

    fn name(&mut self) -> Parsed<String> {
        let (line, column) = self.position();
        let name = match self.peek().clone() {
            Token::Iri(iri) => iri,
            Token::Name(None, word) => format!("{}{word}", self.prefixes.get("").unwrap_or_default()),
            Token::Name(Some(prefix), local) => match self.prefixes.get(&prefix) {
                Some(iri) => format!("{iri}{local}"),
                None => {
                    return Err(Error::UndeclaredPrefix {
                        file: self.source.to_string(),
                        line,
                        column,
                        prefix,
                    });
                }
            },
            _ => return Err(self.error("a name")),
        };
        self.bump();
        Ok(name)
    }

    fn term(&mut self) -> Parsed<Term> {
        match self.peek().clone() {
            Token::Variable(name) => {
                self.bump();
                self.variable(&name)
            }
            Token::Text(_) | Token::Number(_) => self.literal().map(Term::Constant),
            Token::Name(None, word) if word == "true" || word == "false" => {
                self.bump();
                Ok(Term::Constant(self.symbols.literal(Literal::Boolean(word == "true"))))
            }
            Token::Name(..) | Token::Iri(_) => {
                let name = self.name()?;
                Ok(Term::Constant(self.symbols.name(&name)))
            }
            _ => Err(self.error("a variable, name or literal")),
        }
    }

    fn variable(&mut self, name: &str) -> Parsed<Term> {
        let existing = self.variables.iter().position(|existing| **existing == *name);
        let number = existing.unwrap_or_else(|| {
            self.variables.push(name.into());
            self.variables.len() - 1
        });
        match u16::try_from(number) {
            Ok(number) => Ok(Term::Variable(Variable(number))),
            Err(_) => Err(self.error("fewer than 65,536 variables in a rule")),
        }
    }

    /// Parses `"text"`, `"text"@en`, `"text"^^xsd:decimal`, `5`, `0.5` or `1e3`.
    fn literal(&mut self) -> Parsed<Symbol> {
        let literal = match self.bump() {
            Token::Number(text) => {
                let kind = match () {
                    () if text.contains(['e', 'E']) => "double",
                    () if text.contains('.') => "decimal",
                    () => "integer",
                };
                Literal::parse(&text, Some(&format!("{XSD}{kind}")), None)
            }
            Token::Text(text) => match self.peek().clone() {
                Token::Language(tag) => {
                    self.bump();
                    Literal::parse(&text, None, Some(&tag))
                }
                Token::Carets => {
                    self.bump();
                    let datatype = self.name()?;
                    Literal::parse(&text, Some(&datatype), None)
                }
                _ => Literal::string(&text),
            },
            _ => return Err(self.error("a literal")),
        };
        Ok(self.symbols.literal(literal))
    }
}

fn describe(token: &Token) -> String {
    match token {
        Token::Prefix => "`@prefix`".into(),
        Token::Iri(iri) => format!("`<{iri}>`"),
        Token::Name(Some(prefix), local) => format!("`{prefix}:{local}`"),
        Token::Name(None, word) => format!("`{word}`"),
        Token::Variable(name) => format!("`?{name}`"),
        Token::Text(text) => format!("\"{text}\""),
        Token::Language(tag) => format!("`@{tag}`"),
        Token::Number(text) => format!("`{text}`"),
        Token::Label(label) => format!("`[{label}]`"),
        Token::Carets => "`^^`".into(),
        Token::Open => "`(`".into(),
        Token::Close => "`)`".into(),
        Token::OpenBrace => "`{`".into(),
        Token::Bar => "`|`".into(),
        Token::CloseBrace => "`}`".into(),
        Token::Equals => "`=`".into(),
        Token::And => "`^`".into(),
        Token::Comma => "`,`".into(),
        Token::Arrow => "`->`".into(),
        Token::Stop => "`.`".into(),
        Token::End => "the end of the text".into(),
    }
}
