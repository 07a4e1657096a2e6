//! Rules as data: what the engine evaluates, whatever syntax it came from.

use std::collections::BTreeSet;
use std::fmt;
use std::sync::Arc;

use crate::builtin::BuiltIn;
use crate::symbol::{Symbol, Symbols};

/// A variable, numbered within its rule from 0.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
pub struct Variable(pub u16);

/// An argument of an atom.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
pub enum Term {
    /// Ranges over the symbols that occur in facts (DL-safety holds by construction).
    Variable(Variable),
    /// A name or literal.
    Constant(Symbol),
}

/// One conjunct of a body or head.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub enum Atom {
    /// `predicate(arguments)` holds.
    Relation {
        /// Class, property or relation.
        predicate: Symbol,
        /// Any number of arguments.
        arguments: Vec<Term>,
    },
    /// `predicate(arguments)` does not hold: stratified negation as failure, in bodies only.
    Not {
        /// Class, property or relation.
        predicate: Symbol,
        /// Each variable must be bound by another atom.
        arguments: Vec<Term>,
    },
    /// A comparison or computation on literals, in bodies only.
    BuiltIn {
        /// Which.
        built_in: BuiltIn,
        /// The result comes first, as in `swrlb`.
        arguments: Vec<Term>,
    },
    /// The result is what the aggregate makes of all matches of a conjunction of its own, in bodies only.
    ///
    /// Variables that atoms outside the aggregate bind have their values there: they make the group. Without any, all
    /// matches are one group. The others are local to the aggregate.
    Aggregate {
        /// Which.
        aggregate: Aggregate,
        /// What the aggregate of the group has to equal, or a variable that it binds.
        result: Term,
        /// Any atoms but aggregates.
        body: Vec<Atom>,
    },
    /// Both terms denote the same individual.
    Same(Term, Term),
    /// The terms denote different individuals.
    Different(Term, Term),
}

/// What is made of the matches of a conjunction, each a distinct binding of all variables in it.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
pub enum Aggregate {
    /// How many matches there are; 0 where there are none.
    Count,
    /// The sum of a term over all matches, exact for decimals, else in the widest floating-point type among them; 0
    /// where there are none. No value where one is not a number.
    Sum(Term),
    /// The least value of a term. No value where there is no match, or where two values do not compare.
    Min(Term),
    /// The greatest value of a term, as for the least.
    Max(Term),
}

impl Aggregate {
    /// The word for it in rule text.
    pub fn name(self) -> &'static str {
        match self {
            Self::Count => "count",
            Self::Sum(_) => "sum",
            Self::Min(_) => "min",
            Self::Max(_) => "max",
        }
    }

    /// The aggregate of another term.
    pub(crate) fn map(self, term: &impl Fn(Term) -> Term) -> Self {
        match self {
            Self::Count => Self::Count,
            Self::Sum(value) => Self::Sum(term(value)),
            Self::Min(value) => Self::Min(term(value)),
            Self::Max(value) => Self::Max(term(value)),
        }
    }

    /// What is summed or compared.
    pub fn value(self) -> Option<Term> {
        match self {
            Self::Count => None,
            Self::Sum(value) | Self::Min(value) | Self::Max(value) => Some(value),
        }
    }
}

/// Which rule it is. Labels repeat in real knowledge bases; the position does not.
#[derive(Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
pub struct RuleIdentity {
    /// The IRI of the ontology, or the file.
    pub source: Arc<str>,
    /// What its author called it.
    pub label: Option<Arc<str>>,
    /// The position in the source, counted from 0.
    pub position: u32,
}

impl RuleIdentity {
    /// An identity without a label.
    pub fn new(source: impl Into<Arc<str>>, position: u32) -> Self {
        Self { source: source.into(), label: None, position }
    }
}

/// `source#position` and the label, if any.
impl fmt::Display for RuleIdentity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}#{}", self.source, self.position)?;
        match &self.label {
            Some(label) => write!(f, " ({label})"),
            None => Ok(()),
        }
    }
}

/// If the body holds, every head atom holds. An empty head is an integrity constraint, an empty body states facts.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Rule {
    /// Which rule it is.
    pub identity: RuleIdentity,
    /// Conclusions.
    pub head: Vec<Atom>,
    /// Conditions.
    pub body: Vec<Atom>,
    /// The name of each variable, without question mark, for printing; may be shorter than the variables used.
    pub variables: Vec<Box<str>>,
}

impl Rule {
    /// A rule whose variables have no names of their own.
    pub fn new(identity: RuleIdentity, head: Vec<Atom>, body: Vec<Atom>) -> Self {
        Self { identity, head, body, variables: Vec::new() }
    }

    /// How many variables the rule uses: one more than the largest number in it.
    pub fn variable_count(&self) -> usize {
        let terms = self.head.iter().chain(&self.body).flat_map(Atom::terms);
        terms.filter_map(Term::as_variable).map(|v| usize::from(v.0) + 1).max().unwrap_or(0)
    }

    /// The name of a variable, without question mark.
    pub fn variable_name(&self, variable: Variable) -> String {
        self.variables
            .get(usize::from(variable.0))
            .map_or_else(|| format!("v{}", variable.0), ToString::to_string)
    }
}

/// Rules that are evaluated together.
#[derive(Clone, PartialEq, Eq, Default, Debug)]
pub struct Program {
    /// In any order.
    pub rules: Vec<Rule>,
    /// Whether `owl:sameAs` is equality, see [`Program::with_equality`]: what holds of an individual holds
    /// of all its names. Otherwise it is a relation like any other, and every name stands for an individual of its own.
    pub equality: bool,
}

impl Program {
    /// The relations that heads conclude, with the number of their arguments.
    pub(crate) fn concluded(&self, symbols: &Symbols) -> BTreeSet<(String, usize)> {
        relations(self.rules.iter().flat_map(|rule| &rule.head), symbols)
    }

    /// The relations that bodies ask for, with the number of their arguments.
    pub(crate) fn asked(&self, symbols: &Symbols) -> BTreeSet<(String, usize)> {
        let bodies = self.rules.iter().flat_map(|rule| &rule.body);
        relations(bodies.flat_map(|atom| std::iter::once(atom).chain(atom.parts())), symbols)
    }
}

/// The relations of some atoms.
fn relations<'a>(atoms: impl Iterator<Item = &'a Atom>, symbols: &Symbols) -> BTreeSet<(String, usize)> {
    let relation = |atom: &Atom| match atom {
        Atom::Relation { predicate, arguments } | Atom::Not { predicate, arguments } => {
            symbols.value(*predicate).as_name().map(|name| (name.to_owned(), arguments.len()))
        }
        _ => None,
    };
    atoms.filter_map(relation).collect()
}

impl Term {
    /// The variable, where the term is one.
    pub fn as_variable(self) -> Option<Variable> {
        match self {
            Self::Variable(variable) => Some(variable),
            Self::Constant(_) => None,
        }
    }
}

impl From<Variable> for Term {
    fn from(variable: Variable) -> Self {
        Self::Variable(variable)
    }
}

impl From<Symbol> for Term {
    fn from(symbol: Symbol) -> Self {
        Self::Constant(symbol)
    }
}

impl Atom {
    /// `predicate(arguments)`.
    pub fn relation(predicate: Symbol, arguments: impl IntoIterator<Item = Term>) -> Self {
        Self::Relation { predicate, arguments: arguments.into_iter().collect() }
    }

    /// The atoms within an aggregate, none of any other atom.
    pub fn parts(&self) -> &[Self] {
        match self {
            Self::Aggregate { body, .. } => body,
            _ => &[],
        }
    }

    /// The arguments, in order; of an aggregate, its result, its value and the arguments of its atoms.
    pub fn terms(&self) -> Vec<Term> {
        match self {
            Self::Aggregate { aggregate, result, body } => {
                let own = std::iter::once(*result).chain(aggregate.value());
                own.chain(body.iter().flat_map(Self::terms)).collect()
            }
            Self::Relation { arguments, .. }
            | Self::Not { arguments, .. }
            | Self::BuiltIn { arguments, .. } => arguments.clone(),
            Self::Same(left, right) | Self::Different(left, right) => vec![*left, *right],
        }
    }
}
