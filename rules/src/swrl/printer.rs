//! Prints rules as text. [`super::parse_rules`] parses the text to rules with the same labels and atoms, except for
//! names of variables, labels and IRIs that the syntax cannot express. A relation atom of `owl:sameAs` or
//! `owl:differentFrom` becomes a comparison. Built-ins defined by the caller also need `Syntax::built_ins`.

use std::fmt::Write;

use super::prefixes::Prefixes;
use crate::builtin::{BuiltIn, SWRLB};
use crate::literal::Literal;
use crate::rule::{Atom, Program, Rule, Term, Variable};
use crate::symbol::{Symbol, Symbols, Value};

/// Prints one rule per line, with labels. IRIs are abbreviated by the prefixes, which are declared first,
/// except the predefined ones.
pub fn print_rules(program: &Program, symbols: &Symbols, prefixes: &Prefixes) -> String {
    let mut text = String::new();
    for (prefix, iri) in prefixes.iter().filter(|&(prefix, iri)| Prefixes::default().get(prefix) != Some(iri))
    {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "@prefix {prefix}: <{iri}> .");
    }
    let printer = Printer { symbols, prefixes };
    for rule in &program.rules {
        let _ = writeln!(text, "{}", printer.rule(rule));
    }
    text
}

struct Printer<'a> {
    symbols: &'a Symbols,
    prefixes: &'a Prefixes,
}

impl Printer<'_> {
    fn rule(&self, rule: &Rule) -> String {
        // `]` ends a label, and a label has no escapes.
        let label = rule.identity.label_line().map(|label| format!("[{}] ", label.replace(']', ")")));
        let label = label.unwrap_or_default();
        let (body, head) = (self.atoms(rule, &rule.body), self.atoms(rule, &rule.head));
        let space = |text: &str| if text.is_empty() { "" } else { " " };
        format!("{label}{body}{}->{}{head} .", space(&body), space(&head))
    }

    fn atoms(&self, rule: &Rule, atoms: &[Atom]) -> String {
        atoms.iter().map(|atom| self.atom(rule, atom)).collect::<Vec<_>>().join(" ^ ")
    }

    fn atom(&self, rule: &Rule, atom: &Atom) -> String {
        if let Some((negation, value, datatype)) = self.data_range(atom) {
            return format!("{negation}{}({})", self.name(datatype), self.term(rule, value));
        }
        if let Atom::Aggregate { aggregate, result, body } = atom {
            let value = aggregate.value().map(|value| format!("{} | ", self.term(rule, value)));
            let (result, name) = (self.term(rule, *result), aggregate.name());
            let (value, body) = (value.unwrap_or_default(), self.atoms(rule, body));
            return format!("{result} = {name} {{ {value}{body} }}");
        }
        let name = match atom {
            Atom::Aggregate { .. } => String::new(),
            Atom::Relation { predicate, .. } => self.constant(*predicate),
            Atom::Not { predicate, .. } => format!("not {}", self.constant(*predicate)),
            Atom::BuiltIn { built_in, .. } => self.built_in(*built_in),
            Atom::NotBuiltIn { built_in, .. } => format!("not {}", self.built_in(*built_in)),
            Atom::Same(..) => "sameAs".into(),
            Atom::Different(..) => "differentFrom".into(),
            Atom::NotSame(..) => "not sameAs".into(),
            Atom::NotDifferent(..) => "not differentFrom".into(),
        };
        let arguments: Vec<String> = atom.terms().into_iter().map(|term| self.term(rule, term)).collect();
        format!("{name}({})", arguments.join(", "))
    }

    fn built_in(&self, built_in: BuiltIn) -> String {
        match built_in {
            BuiltIn::Custom(_) => self.name(built_in.name()),
            _ => self.name(&format!("{SWRLB}{}", built_in.name())),
        }
    }

    fn data_range(&self, atom: &Atom) -> Option<(&'static str, Term, &str)> {
        let (negation, arguments) = match atom {
            Atom::BuiltIn { built_in: BuiltIn::DataRange, arguments } => ("", arguments),
            Atom::BuiltIn { built_in: BuiltIn::OutsideDataRange, arguments } => ("not ", arguments),
            _ => return None,
        };
        let [value, Term::Constant(datatype)] = arguments.as_slice() else { return None };
        match self.symbols.value(*datatype) {
            Value::Literal(Literal::Uri(iri)) => Some((negation, *value, iri)),
            _ => None,
        }
    }

    fn term(&self, rule: &Rule, term: Term) -> String {
        match term {
            Term::Variable(variable) => format!("?{}", variable_name(rule, variable)),
            Term::Constant(symbol) => self.constant(symbol),
        }
    }

    fn constant(&self, symbol: Symbol) -> String {
        match self.symbols.value(symbol) {
            Value::Name(name) => self.name(name),
            Value::Literal(literal) => literal.to_string(),
        }
    }

    fn name(&self, iri: &str) -> String {
        let plain = |text: &str| {
            let mut characters = text.chars();
            characters.next().is_some_and(|c| c.is_alphabetic() || c == '_')
                && characters.all(|c| c.is_alphanumeric() || c == '_')
        };
        // The longest matching namespace gives the shortest name.
        let longest = self.prefixes.iter().filter(|(_, base)| iri.strip_prefix(base).is_some_and(plain));
        match longest.max_by_key(|(_, base)| base.len()) {
            Some((prefix, base)) => format!("{prefix}:{}", &iri[base.len()..]),
            None => format!("<{iri}>"),
        }
    }
}

/// Returns the name of a variable, if the name can be parsed and is unique in the rule, and otherwise a
/// name made of the variable's number.
fn variable_name(rule: &Rule, variable: Variable) -> String {
    let name = rule.variable_name(variable);
    let readable = !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '_' || c == '-');
    let number = usize::from(variable.0);
    let unique =
        !rule.variables.iter().enumerate().any(|(other, existing)| other != number && **existing == *name);
    if readable && unique {
        return name;
    }
    let mut spelled = format!("_{number}");
    while rule.variables.iter().any(|existing| **existing == *spelled) {
        spelled.push('_');
    }
    spelled
}
