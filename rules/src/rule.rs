//! Abstract syntax of rules, independent of the text syntax.

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
    /// A variable. Its values are symbols of facts and rules and computed literals, never unnamed individuals, so every
    /// rule is DL-safe.
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
        /// The built-in.
        built_in: BuiltIn,
        /// In the order of `swrlb`: the result of a function comes first. A built-in that composes a value of parts can
        /// also compute the parts, i.e. the other arguments, from the first one.
        arguments: Vec<Term>,
    },
    /// The built-in does not hold: negation as failure, in bodies only. It thus also holds if an argument is of an
    /// unsuitable kind, for example an individual or, for a comparison with a number, a string.
    NotBuiltIn {
        /// The built-in.
        built_in: BuiltIn,
        /// Each variable must be bound by another atom.
        arguments: Vec<Term>,
    },
    /// `result` is the aggregate of all matches of a nested conjunction, in bodies only.
    ///
    /// Variables of the nested conjunction that outer atoms bind, too, form the group: each group has its own value.
    /// Without such variables, all matches form one group. All other variables are local to the aggregate.
    Aggregate {
        /// The aggregate.
        aggregate: Aggregate,
        /// Required value of the aggregate, or a variable that it binds.
        result: Term,
        /// Conjunction without aggregates.
        body: Vec<Atom>,
    },
    /// Both terms denote the same individual or value. In a head: concludes `owl:sameAs`.
    Same(Term, Term),
    /// In a body: the terms differ for certain. Names are unique by default, so two different names differ, except
    /// those of [fresh individuals](Symbols::fresh_name); literals are compared by value. With
    /// [`Program::with_equality`](crate::Program::with_equality), the atom matches facts of `owl:differentFrom`
    /// instead.
    ///
    /// In a head: concludes `owl:differentFrom`.
    Different(Term, Term),
    /// The terms are not known to denote the same individual: negation as failure of [`Atom::Same`], in bodies only.
    /// Each variable must be bound by another atom.
    NotSame(Term, Term),
    /// The terms are not known to differ: negation as failure of [`Atom::Different`], in bodies only. Each variable
    /// must be bound by another atom.
    NotDifferent(Term, Term),
}

/// Aggregate function over the matches of a conjunction. Each match is a distinct binding of all its
/// variables.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
pub enum Aggregate {
    /// Number of matches, possibly 0.
    Count,
    /// Sum of a term over all matches; 0 without matches. The sum is exact for decimals, and otherwise
    /// has the widest floating-point type among the values. There is no sum if a value is not a number.
    Sum(Term),
    /// Minimum of a term over all matches. There is no minimum without matches, or if a value is an individual or not
    /// comparable with it, such as text among numbers.
    Min(Term),
    /// Maximum of a term over all matches. There is no maximum without matches, or if a value is an individual or not
    /// comparable with it, such as text among numbers.
    Max(Term),
}

impl Aggregate {
    /// Returns the keyword of the aggregate in rule text.
    pub fn name(self) -> &'static str {
        match self {
            Self::Count => "count",
            Self::Sum(_) => "sum",
            Self::Min(_) => "min",
            Self::Max(_) => "max",
        }
    }

    pub(crate) fn map(self, term: &impl Fn(Term) -> Term) -> Self {
        match self {
            Self::Count => Self::Count,
            Self::Sum(value) => Self::Sum(term(value)),
            Self::Min(value) => Self::Min(term(value)),
            Self::Max(value) => Self::Max(term(value)),
        }
    }

    /// Returns the aggregated term; `None` for `count`.
    pub fn value(self) -> Option<Term> {
        match self {
            Self::Count => None,
            Self::Sum(value) | Self::Min(value) | Self::Max(value) => Some(value),
        }
    }
}

/// Identity of a rule. Labels are often ambiguous in real knowledge bases; the position is unique within
/// the source.
#[derive(Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
pub struct RuleIdentity {
    /// IRI of an ontology, name of a file, or a fixed name for generated rules.
    pub source: Arc<str>,
    /// Label given by the author.
    pub label: Option<Arc<str>>,
    /// Position of the rule in the source, counted from 0.
    pub position: u32,
}

impl RuleIdentity {
    /// Creates an identity without a label.
    pub fn new(source: impl Into<Arc<str>>, position: u32) -> Self {
        Self { source: source.into(), label: None, position }
    }

    pub(crate) fn label_line(&self) -> Option<String> {
        self.label.as_ref().map(|label| label.replace(['\n', '\r'], " "))
    }
}

/// Formats the identity in one line as `source#position`, followed by the label in parentheses, if there is one.
impl fmt::Display for RuleIdentity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}#{}", self.source, self.position)?;
        match self.label_line() {
            Some(label) => write!(f, " ({label})"),
            None => Ok(()),
        }
    }
}

/// A rule: if the body holds, every head atom holds. A rule with an empty head is an integrity constraint. The head
/// of a rule with an empty body always holds.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Rule {
    /// Identity of the rule.
    pub identity: RuleIdentity,
    /// Conclusions.
    pub head: Vec<Atom>,
    /// Conditions.
    pub body: Vec<Atom>,
    /// Names of the variables, without question mark, for output. The list may be shorter than the number
    /// of variables.
    pub variables: Vec<Box<str>>,
}

impl Rule {
    /// Creates a rule whose variables have no names.
    pub fn new(identity: RuleIdentity, head: Vec<Atom>, body: Vec<Atom>) -> Self {
        Self { identity, head, body, variables: Vec::new() }
    }

    /// Returns the number of variables: one more than the largest variable number in the rule.
    pub fn variable_count(&self) -> usize {
        let terms = self.head.iter().chain(&self.body).flat_map(Atom::terms);
        terms.filter_map(Term::as_variable).map(|v| usize::from(v.0) + 1).max().unwrap_or(0)
    }

    /// Returns the name of a variable, without question mark; `v3` for a variable with number 3 and no name.
    pub fn variable_name(&self, variable: Variable) -> String {
        self.variables
            .get(usize::from(variable.0))
            .map_or_else(|| format!("v{}", variable.0), ToString::to_string)
    }
}

/// A set of rules that are evaluated together.
#[derive(Clone, PartialEq, Eq, Default, Debug)]
pub struct Program {
    /// Rules in any order.
    pub rules: Vec<Rule>,
    /// `true` if `owl:sameAs` is equality, see [`Program::with_equality`]: all names of an individual then
    /// share its facts. Otherwise `owl:sameAs` is an ordinary relation, and different names denote
    /// different individuals.
    pub equality: bool,
}

impl Program {
    pub(crate) fn concluded(&self, symbols: &Symbols) -> BTreeSet<(String, usize)> {
        relations(self.rules.iter().flat_map(|rule| &rule.head), symbols)
    }

    pub(crate) fn queried(&self, symbols: &Symbols) -> BTreeSet<(String, usize)> {
        let bodies = self.rules.iter().flat_map(|rule| &rule.body);
        relations(bodies.flat_map(|atom| std::iter::once(atom).chain(atom.parts())), symbols)
    }
}

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
    /// Returns the variable if the term is a variable.
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
    /// Creates the atom `predicate(arguments)`.
    pub fn relation(predicate: Symbol, arguments: impl IntoIterator<Item = Term>) -> Self {
        Self::Relation { predicate, arguments: arguments.into_iter().collect() }
    }

    /// Returns the atoms within an aggregate; empty for any other atom.
    pub fn parts(&self) -> &[Self] {
        match self {
            Self::Aggregate { body, .. } => body,
            _ => &[],
        }
    }

    /// Returns `true` if the atom is a negation as failure.
    pub fn is_negated(&self) -> bool {
        matches!(
            self,
            Self::Not { .. } | Self::NotBuiltIn { .. } | Self::NotSame(..) | Self::NotDifferent(..)
        )
    }

    /// Returns the negation as failure of the atom. The negation of a data range is the test that the value certainly
    /// lies outside the range. An aggregate or a negated atom has no negation, and is returned unchanged.
    #[must_use]
    pub fn negated(self) -> Self {
        match self {
            Self::Relation { predicate, arguments } => Self::Not { predicate, arguments },
            Self::BuiltIn { built_in: BuiltIn::DataRange, arguments } => {
                Self::BuiltIn { built_in: BuiltIn::OutsideDataRange, arguments }
            }
            Self::BuiltIn { built_in, arguments } => Self::NotBuiltIn { built_in, arguments },
            Self::Same(left, right) => Self::NotSame(left, right),
            Self::Different(left, right) => Self::NotDifferent(left, right),
            other => other,
        }
    }

    /// Returns the arguments in order. For an aggregate: its result, its aggregated term and the
    /// arguments of its atoms.
    pub fn terms(&self) -> Vec<Term> {
        match self {
            Self::Aggregate { aggregate, result, body } => {
                let terms = std::iter::once(*result).chain(aggregate.value());
                terms.chain(body.iter().flat_map(Self::terms)).collect()
            }
            Self::Relation { arguments, .. }
            | Self::Not { arguments, .. }
            | Self::BuiltIn { arguments, .. }
            | Self::NotBuiltIn { arguments, .. } => arguments.clone(),
            Self::Same(left, right)
            | Self::Different(left, right)
            | Self::NotSame(left, right)
            | Self::NotDifferent(left, right) => vec![*left, *right],
        }
    }
}
