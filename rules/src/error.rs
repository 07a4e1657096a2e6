//! Errors of rules and updates, with one numbered variant per cause.

use crate::builtin::{BuiltIn, SWRLB};
use crate::rule::RuleIdentity;

/// Errors of a set of rules or of an update.
pub type Errors = diagnostics::Errors<Error>;

/// An error. R1xx: rule text; R2xx: a rule; R3xx: facts, or an evaluation that was stopped.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The text is not a well-formed rule.
    #[error("{file}:{line}:{column}: R101 {message}")]
    Syntax {
        /// Name of the rule text, as given by the caller.
        file: String,
        /// Line, counted from 1.
        line: u32,
        /// Column in characters, counted from 1.
        column: u32,
        /// Description of the error, usually the expected and the actual token.
        message: String,
    },
    /// An undeclared prefix.
    #[error("{file}:{line}:{column}: R102 undeclared prefix `{prefix}:`")]
    UndeclaredPrefix {
        /// Name of the rule text, as given by the caller.
        file: String,
        /// Line, counted from 1.
        line: u32,
        /// Column in characters, counted from 1.
        column: u32,
        /// Undeclared prefix, without the colon.
        prefix: String,
    },
    /// A `swrlb` name without a built-in.
    #[error("{file}:{line}:{column}: R104 there is no built-in `{name}`{}", did_you_mean(&format!("{SWRLB}{name}")))]
    UnknownBuiltIn {
        /// Name of the rule text, as given by the caller.
        file: String,
        /// Line, counted from 1.
        line: u32,
        /// Column in characters, counted from 1.
        column: u32,
        /// Local name.
        name: String,
    },
    /// A `swrlb` built-in on lists.
    #[error(
        "{file}:{line}:{column}: R104 built-in `{name}` works on lists, which the engine does not support"
    )]
    RefusedBuiltIn {
        /// Name of the rule text, as given by the caller.
        file: String,
        /// Line, counted from 1.
        line: u32,
        /// Column in characters, counted from 1.
        column: u32,
        /// Local name.
        name: String,
    },
    /// A predicate in the namespace of a known built-in library, which denotes no supported built-in.
    #[error(
        "{file}:{line}:{column}: R104 built-in <{name}> belongs to a library that the engine does not have{}",
        did_you_mean(name)
    )]
    ForeignBuiltIn {
        /// Name of the rule text, as given by the caller.
        file: String,
        /// Line, counted from 1.
        line: u32,
        /// Column in characters, counted from 1.
        column: u32,
        /// IRI of the built-in.
        name: String,
    },
    /// A relation atom whose arguments fit neither a class nor a property, and whose relation no rule derives.
    #[error(
        "{file}:{line}:{column}: R104 <{name}> with {count} arguments is not a class, a property or anything that a rule \
         concludes, and a built-in of this name is not known"
    )]
    UnknownRelation {
        /// Name of the rule text, as given by the caller.
        file: String,
        /// Line, counted from 1.
        line: u32,
        /// Column in characters, counted from 1.
        column: u32,
        /// IRI of the relation.
        name: String,
        /// Number of arguments.
        count: usize,
    },
    /// An atom outside plain SWRL, although [`crate::Syntax::swrl_only`] is set.
    #[error("{file}:{line}:{column}: R105 {what} is not SWRL")]
    NotSwrl {
        /// Name of the rule text, as given by the caller.
        file: String,
        /// Line, counted from 1.
        line: u32,
        /// Column in characters, counted from 1.
        column: u32,
        /// The kind of atom.
        what: &'static str,
    },
    /// A head variable that no body atom binds.
    #[error("R202 rule {rule}: variable ?{variable} in the head is not bound by the body")]
    UnsafeHead {
        /// The rule.
        rule: RuleIdentity,
        /// Name of the variable, without question mark.
        variable: String,
    },
    /// A variable of the body that no atom binds, for example because it occurs only in negated atoms and comparisons.
    #[error("R203 rule {rule}: variable ?{variable} is only tested, never bound")]
    UnsafeBody {
        /// The rule.
        rule: RuleIdentity,
        /// Name of the variable, without question mark.
        variable: String,
    },
    /// A built-in with too few or too many arguments.
    #[error("R204 rule {rule}: built-in {built_in} does not take {count} arguments")]
    BuiltInArity {
        /// The rule.
        rule: RuleIdentity,
        /// Local name of the built-in, or IRI of a custom built-in.
        built_in: &'static str,
        /// Number of arguments.
        count: usize,
    },
    /// A head atom that no rule can derive, such as a built-in.
    #[error("R205 rule {rule}: a head may not contain {what}")]
    HeadAtom {
        /// The rule.
        rule: RuleIdentity,
        /// The kind of atom.
        what: &'static str,
    },
    /// Negation through recursion.
    #[error(
        "R206 rule {rule}: `not {predicate}` depends on its own conclusion, so the rules have no stratification"
    )]
    Unstratified {
        /// A rule on the cycle.
        rule: RuleIdentity,
        /// The negated predicate.
        predicate: String,
    },
    /// An atom with more arguments, or an aggregate with more variables, than the engine supports.
    #[error("R207 rule {rule}: {count} arguments, at most 32 are supported")]
    Arity {
        /// The rule.
        rule: RuleIdentity,
        /// Number of arguments; for an aggregate, number of the variables within it.
        count: usize,
    },
    /// An aggregate through recursion.
    #[error(
        "R208 rule {rule}: its {aggregate} depends on its own conclusion, so the rules have no stratification"
    )]
    UnstratifiedAggregate {
        /// A rule on the cycle.
        rule: RuleIdentity,
        /// Name of the aggregate.
        aggregate: &'static str,
    },
    /// A nested aggregate.
    #[error("R209 rule {rule}: an aggregate within an aggregate; compute the inner one in a separate rule")]
    NestedAggregate {
        /// The rule.
        rule: RuleIdentity,
    },
    /// An invalid regular expression.
    #[error("R210 rule {rule} has a pattern that cannot be used, {fault}")]
    Pattern {
        /// The rule.
        rule: RuleIdentity,
        /// The pattern in quotes, with the error.
        fault: Box<str>,
    },
    /// The step budget is exhausted. The engine is in its state before the update.
    #[error("R301 step budget of {budget} exhausted, last in rule {rule}{}", value_note(value.as_deref()))]
    BudgetExhausted {
        /// The rule that was being evaluated.
        rule: RuleIdentity,
        /// Budget in steps.
        budget: u64,
        /// Abbreviated last computed value, if new values used up the budget.
        value: Option<Box<str>>,
    },
    /// The evaluation was interrupted. The engine is in its state before the update.
    #[error("R304 interrupted, last in rule {rule}")]
    Interrupted {
        /// The rule that was being planned or evaluated.
        rule: RuleIdentity,
    },
    /// A fact or rule with a symbol that is not interned.
    #[error("R302 symbol number {index} is not in the engine's symbols")]
    UnknownSymbol {
        /// Number of the symbol.
        index: usize,
    },
    /// A fact with more arguments than the engine supports.
    #[error("R303 a fact with {count} arguments, at most 32 are supported")]
    FactArity {
        /// Number of arguments.
        count: usize,
    },
}

impl Error {
    /// Returns the stable code of the cause.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Syntax { .. } => "R101",
            Self::UndeclaredPrefix { .. } => "R102",
            Self::UnknownBuiltIn { .. }
            | Self::RefusedBuiltIn { .. }
            | Self::ForeignBuiltIn { .. }
            | Self::UnknownRelation { .. } => "R104",
            Self::NotSwrl { .. } => "R105",
            Self::UnsafeHead { .. } => "R202",
            Self::UnsafeBody { .. } => "R203",
            Self::BuiltInArity { .. } => "R204",
            Self::HeadAtom { .. } => "R205",
            Self::Unstratified { .. } => "R206",
            Self::Arity { .. } => "R207",
            Self::UnstratifiedAggregate { .. } => "R208",
            Self::NestedAggregate { .. } => "R209",
            Self::Pattern { .. } => "R210",
            Self::BudgetExhausted { .. } => "R301",
            Self::UnknownSymbol { .. } => "R302",
            Self::FactArity { .. } => "R303",
            Self::Interrupted { .. } => "R304",
        }
    }

    /// Returns the file, line and column (counted from 1) of an error in a text; `None` for other errors.
    pub fn place(&self) -> Option<(&str, usize, usize)> {
        match self {
            Self::Syntax { file, line, column, .. }
            | Self::UndeclaredPrefix { file, line, column, .. }
            | Self::UnknownBuiltIn { file, line, column, .. }
            | Self::RefusedBuiltIn { file, line, column, .. }
            | Self::ForeignBuiltIn { file, line, column, .. }
            | Self::UnknownRelation { file, line, column, .. }
            | Self::NotSwrl { file, line, column, .. } => Some((file, *line as usize, *column as usize)),
            _ => None,
        }
    }
}

fn did_you_mean(iri: &str) -> String {
    BuiltIn::similar(iri).map_or_else(String::new, |name| format!("; did you mean `{name}`?"))
}

fn value_note(value: Option<&str>) -> String {
    value.map_or_else(String::new, |value| {
        format!(", which computes new values from its own conclusions; the last one is {value}")
    })
}
