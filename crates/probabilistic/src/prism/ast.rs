//! Syntax tree of PRISM models (Markov chains and decision processes) and properties.

use num_rational::BigRational;

use crate::error::{Diagnostic, Place};
use crate::solve::Direction;

/// An expression with its position.
#[derive(Debug, Clone, PartialEq)]
pub struct Expr {
    /// The kind and operands.
    pub kind: ExprKind,
    /// Start of the expression; line 0 for expressions that were not parsed.
    pub place: Place,
}

/// The kinds of expressions.
#[derive(Debug, Clone, PartialEq)]
pub enum ExprKind {
    /// `true`, `false`.
    Bool(bool),
    /// An integer.
    Int(i64),
    /// A number with a decimal point or an exponent.
    Number(BigRational),
    /// A constant, formula or variable.
    Name(String),
    /// A label; in properties only.
    Label(String),
    /// `!`.
    Not(Box<Expr>),
    /// `-`.
    Negative(Box<Expr>),
    /// A binary operation.
    Binary(BinaryOp, Box<Expr>, Box<Expr>),
    /// `condition ? then : otherwise`.
    If(Box<Expr>, Box<Expr>, Box<Expr>),
    /// A function call.
    Call(Function, Vec<Expr>),
    /// The value or truth value of a property; in properties only.
    Property(Box<Property>),
    /// A path formula; within the brackets of properties only.
    Temporal(Box<Temporal>),
}

/// A property.
#[derive(Debug, Clone, PartialEq)]
pub enum Property {
    /// `P`: a probability.
    Probability(Question, Path),
    /// `R`: an expected reward, with the name of its structure if there is one.
    Reward(Question, Option<String>, RewardPath),
    /// `S`: the long-run fraction of time in some states.
    SteadyState(Question, Expr),
    /// `multi`: several objectives.
    Multi(Vec<Self>),
    /// An aggregate of the values of a property over some states, or over all states.
    Filter(Filter, Expr, Option<Expr>),
    /// A numeric or Boolean expression over properties and states.
    Expression(Expr),
    /// A property that is not supported, with the reason; other properties of its file can be
    /// checked.
    Refused(Diagnostic),
}

/// The aggregation of a filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are those of the operators")]
pub enum Filter {
    Min,
    Max,
    Sum,
    Average,
    Count,
    ForAll,
    Exists,
    /// The value in the first state, ordered by the values of the variables.
    First,
    /// The value in the only state.
    State,
    /// The least and the greatest value.
    Range,
    /// The states with their values, except those with value zero or false.
    Print,
    /// The states with their values.
    PrintAll,
    /// The states with the least value.
    ArgMin,
    /// The states with the greatest value.
    ArgMax,
}

/// A query for a value, or a comparison of the value with a bound.
#[derive(Debug, Clone, PartialEq)]
pub struct Question {
    /// Minimum or maximum; `None` if the model has only one policy or the bound determines it.
    pub direction: Option<Direction>,
    /// The bound; `None` to query the value.
    pub bound: Option<(BinaryOp, Expr)>,
}

/// Path formulas.
#[derive(Debug, Clone, PartialEq)]
pub enum Path {
    /// A condition on the first state.
    State(Expr),
    /// Negation.
    Not(Box<Self>),
    /// `X`: in the next state.
    Next(Expr),
    /// `U`, and `F` with `true` on the left: the right operand eventually holds (within the
    /// bounds), and the left one until then.
    Until(Expr, Expr, Option<Box<Steps>>),
    /// `G`: always (within the bounds).
    Globally(Expr, Option<Box<Steps>>),
    /// `W`: `U`, or the left operand always holds.
    WeakUntil(Expr, Expr, Option<Box<Steps>>),
    /// `R`: the right operand holds up to and including the first state of the left one, or
    /// always.
    Release(Expr, Expr, Option<Box<Steps>>),
    /// `G F`: infinitely often.
    Repeatedly(Expr),
    /// `F G`: eventually always.
    Persistently(Expr),
}

/// Bounds on the number of steps or on an accumulated reward.
#[derive(Debug, Clone, PartialEq)]
pub struct Steps {
    /// The lower bound.
    pub least: Option<StepBound>,
    /// The upper bound.
    pub most: Option<StepBound>,
    /// The bounded reward, with its name if it has one; `None` if steps are bounded.
    pub reward: Option<Option<String>>,
}

/// A bound on the number of steps.
#[derive(Debug, Clone, PartialEq)]
pub struct StepBound {
    /// The limit.
    pub limit: Expr,
    /// `true` if the limit itself is excluded.
    pub strict: bool,
}

/// The accumulation of a reward.
#[derive(Debug, Clone, PartialEq)]
pub enum RewardPath {
    /// `F`: until a state is reached.
    Reach(Expr),
    /// `C<=k`: over k steps.
    Steps(StepBound),
    /// `C`: over the infinite path.
    Total,
    /// `I=k`: the state reward after k steps.
    Instant(Expr),
    /// `S`: the long-run average per step.
    LongRun,
}

/// A temporal operator with its operands; the left operand of unary operators is `true`.
#[derive(Debug, Clone, PartialEq)]
pub struct Temporal {
    /// The letter of the operator.
    pub letter: char,
    /// The bounds.
    pub steps: Option<Box<Steps>>,
    /// The left operand.
    pub left: Expr,
    /// The right operand.
    pub right: Expr,
}

/// Binary operators.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are those of the operations")]
pub enum BinaryOp {
    Iff,
    Implies,
    Or,
    And,
    Equal,
    NotEqual,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    Plus,
    Minus,
    Times,
    Divide,
}

impl BinaryOp {
    /// Returns `true` for operators on numbers with a numeric result.
    pub fn is_arithmetic(self) -> bool {
        matches!(self, Self::Plus | Self::Minus | Self::Times | Self::Divide)
    }

    /// The symbol and the precedence.
    pub fn sign(self) -> (&'static str, u8) {
        match self {
            Self::Iff => ("<=>", 2),
            Self::Implies => ("=>", 3),
            Self::Or => ("|", 4),
            Self::And => ("&", 5),
            Self::Equal => ("=", 7),
            Self::NotEqual => ("!=", 7),
            Self::Less => ("<", 8),
            Self::LessEqual => ("<=", 8),
            Self::Greater => (">", 8),
            Self::GreaterEqual => (">=", 8),
            Self::Plus => ("+", 9),
            Self::Minus => ("-", 9),
            Self::Times => ("*", 10),
            Self::Divide => ("/", 10),
        }
    }

    /// All operators.
    pub const ALL: [Self; 14] = [
        Self::Iff,
        Self::Implies,
        Self::Or,
        Self::And,
        Self::Equal,
        Self::NotEqual,
        Self::Less,
        Self::LessEqual,
        Self::Greater,
        Self::GreaterEqual,
        Self::Plus,
        Self::Minus,
        Self::Times,
        Self::Divide,
    ];
}

/// Functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are those of the functions")]
pub enum Function {
    Min,
    Max,
    Floor,
    Ceil,
    Round,
    Pow,
    Mod,
    Log,
}

impl Function {
    /// All functions with their names.
    pub const ALL: [(&'static str, Self); 8] = [
        ("min", Self::Min),
        ("max", Self::Max),
        ("floor", Self::Floor),
        ("ceil", Self::Ceil),
        ("round", Self::Round),
        ("pow", Self::Pow),
        ("mod", Self::Mod),
        ("log", Self::Log),
    ];

    /// The name.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, function)| *function == self).map_or("", |(name, _)| name)
    }
}

/// Types of constants and expressions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are those of the types")]
pub enum Type {
    Bool,
    Int,
    Double,
}

impl Type {
    /// The keyword.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bool => "bool",
            Self::Int => "int",
            Self::Double => "double",
        }
    }
}

/// The kind of process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    /// Markov decision process.
    Mdp,
    /// Discrete-time Markov chain.
    Dtmc,
}

/// A constant; without a value it is undefined and set by the user.
#[derive(Debug, Clone, PartialEq)]
pub struct Constant {
    /// The name.
    pub name: String,
    /// The type.
    pub kind: Type,
    /// The value.
    pub value: Option<Expr>,
    /// Position of the name.
    pub place: Place,
}

/// A named expression: a formula or a label.
#[derive(Debug, Clone, PartialEq)]
pub struct Named {
    /// The name.
    pub name: String,
    /// The expression.
    pub expression: Expr,
    /// Position of the name.
    pub place: Place,
}

/// A variable.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// The name.
    pub name: String,
    /// Least and greatest value; `None` for Boolean variables.
    pub range: Option<(Expr, Expr)>,
    /// The initial value; by default false or the least value.
    pub initial: Option<Expr>,
    /// Position of the name.
    pub place: Place,
}

/// A probabilistic alternative of a command.
#[derive(Debug, Clone, PartialEq)]
pub struct Update {
    /// The probability; `None` for 1.
    pub probability: Option<Expr>,
    /// Variables and their new values.
    pub assignments: Vec<(String, Expr, Place)>,
}

/// A guarded command.
#[derive(Debug, Clone, PartialEq)]
pub struct Command {
    /// The action on which modules synchronise.
    pub action: Option<String>,
    /// The guard.
    pub guard: Expr,
    /// The alternatives.
    pub updates: Vec<Update>,
    /// Start of the command.
    pub place: Place,
}

/// A module.
#[derive(Debug, Clone, PartialEq)]
pub struct Module {
    /// The name.
    pub name: String,
    /// The variables.
    pub variables: Vec<Variable>,
    /// The commands.
    pub commands: Vec<Command>,
    /// Position of the name.
    pub place: Place,
}

/// A reward item of states or transitions.
#[derive(Debug, Clone, PartialEq)]
pub struct RewardItem {
    /// `None` for a state reward; else the action of the transitions, `None` for commands without
    /// an action.
    pub action: Option<Option<String>>,
    /// The guard.
    pub guard: Expr,
    /// The reward.
    pub reward: Expr,
    /// Start of the item.
    pub place: Place,
}

/// A reward structure.
#[derive(Debug, Clone, PartialEq)]
pub struct Rewards {
    /// The name, possibly empty.
    pub name: String,
    /// The items, whose rewards are added.
    pub items: Vec<RewardItem>,
    /// Start of the structure.
    pub place: Place,
}

/// A model.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// The kind of process.
    pub kind: ModelKind,
    /// The leading comment, possibly empty.
    pub remark: String,
    /// The constants.
    pub constants: Vec<Constant>,
    /// The formulas.
    pub formulas: Vec<Named>,
    /// The global variables.
    pub globals: Vec<Variable>,
    /// The modules.
    pub modules: Vec<Module>,
    /// The reward structures.
    pub rewards: Vec<Rewards>,
    /// The labels.
    pub labels: Vec<Named>,
    /// `init … endinit`: the condition on initial states.
    pub initial: Option<Expr>,
}

impl Expr {
    /// Creates an expression without a position.
    pub fn new(kind: ExprKind) -> Self {
        Self { kind, place: Place::default() }
    }

    /// Creates a name.
    pub fn name(name: &str) -> Self {
        Self::new(ExprKind::Name(name.to_owned()))
    }

    /// Creates an integer.
    pub fn int(value: i64) -> Self {
        Self::new(ExprKind::Int(value))
    }

    /// Creates a truth value.
    pub fn bool(value: bool) -> Self {
        Self::new(ExprKind::Bool(value))
    }

    /// Creates a binary operation.
    #[must_use]
    pub fn op(self, op: BinaryOp, other: Self) -> Self {
        Self::new(ExprKind::Binary(op, Box::new(self), Box::new(other)))
    }

    /// Collects the names in the expression.
    pub fn names<'a>(&'a self, occurrences: &mut Vec<(&'a str, Place)>) {
        match &self.kind {
            ExprKind::Name(name) => occurrences.push((name, self.place)),
            ExprKind::Not(inner) | ExprKind::Negative(inner) => inner.names(occurrences),
            ExprKind::Binary(_, left, right) => {
                left.names(occurrences);
                right.names(occurrences);
            }
            ExprKind::If(condition, then, otherwise) => {
                for part in [condition, then, otherwise] {
                    part.names(occurrences);
                }
            }
            ExprKind::Call(_, arguments) => arguments.iter().for_each(|argument| argument.names(occurrences)),
            ExprKind::Bool(_)
            | ExprKind::Int(_)
            | ExprKind::Number(_)
            | ExprKind::Label(_)
            | ExprKind::Property(_)
            | ExprKind::Temporal(_) => {}
        }
    }

    /// Returns the expression with names replaced by `with`; `None` keeps a name.
    #[must_use]
    pub fn replace(&self, with: &dyn Fn(&str) -> Option<Self>) -> Self {
        self.rewrite(&mut |part| match &part.kind {
            ExprKind::Name(name) => Some(with(name).unwrap_or_else(|| part.clone())),
            _ => None,
        })
    }

    /// Returns the expression with subexpressions replaced by `with`, outermost first; `None`
    /// descends.
    #[must_use]
    pub fn rewrite(&self, with: &mut dyn FnMut(&Self) -> Option<Self>) -> Self {
        if let Some(replacement) = with(self) {
            return replacement;
        }
        let mut rewritten = |part: &Self| Box::new(part.rewrite(with));
        let kind = match &self.kind {
            ExprKind::Not(inner) => ExprKind::Not(rewritten(inner)),
            ExprKind::Negative(inner) => ExprKind::Negative(rewritten(inner)),
            ExprKind::Binary(op, left, right) => ExprKind::Binary(*op, rewritten(left), rewritten(right)),
            ExprKind::If(condition, then, otherwise) => {
                ExprKind::If(rewritten(condition), rewritten(then), rewritten(otherwise))
            }
            ExprKind::Call(function, arguments) => {
                ExprKind::Call(*function, arguments.iter().map(|argument| *rewritten(argument)).collect())
            }
            other => other.clone(),
        };
        Self { kind, place: self.place }
    }
}
