//! The syntax tree of a PRISM model: the fragment of Markov chains and decision processes.

use num_rational::BigRational;

use crate::error::{Diagnostic, Place};
use crate::solve::Direction;

/// An expression and where it starts.
#[derive(Debug, Clone, PartialEq)]
pub struct Expr {
    /// What it is.
    pub kind: ExprKind,
    /// Where it starts; line 0 for expressions that were not read.
    pub place: Place,
}

/// What an expression is.
#[derive(Debug, Clone, PartialEq)]
pub enum ExprKind {
    /// `true`, `false`.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A number that is written with a point or an exponent.
    Number(BigRational),
    /// A constant, formula or variable.
    Name(String),
    /// A label; in properties only.
    Label(String),
    /// `!`.
    Not(Box<Expr>),
    /// `-`.
    Negative(Box<Expr>),
    /// An operator between two expressions.
    Binary(BinaryOp, Box<Expr>, Box<Expr>),
    /// `condition ? then : otherwise`.
    If(Box<Expr>, Box<Expr>, Box<Expr>),
    /// A function.
    Call(Function, Vec<Expr>),
    /// The value of a property, or whether it holds; in properties only.
    Property(Box<Property>),
    /// Whether a path is as it says; within the brackets of properties only.
    Temporal(Box<Temporal>),
}

/// What is asked of a model.
#[derive(Debug, Clone, PartialEq)]
pub enum Property {
    /// `P`: a probability.
    Probability(Question, Path),
    /// `R`: an expected reward, with the name of its structure where there is one.
    Reward(Question, Option<String>, RewardPath),
    /// `S`: in which share of the time, in the long run, states hold.
    SteadyState(Question, Expr),
    /// Several objectives at once.
    Multi(Vec<Self>),
    /// Something of the values of a property in some states; all of them unless it says which.
    Filter(Filter, Expr, Option<Expr>),
    /// A number or a truth value that is made of properties and of what holds in a state.
    Expression(Expr),
    /// One that is not handled, and why; it stands in a file, where others are answered.
    Refused(Diagnostic),
}

/// What a filter makes of the values in several states.
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
    /// The value in the first of the states, by the values of the variables.
    First,
    /// The value in the only state.
    State,
    /// The least and the greatest value.
    Range,
    /// The states with their values, without those that are zero or false.
    Print,
    /// The states with their values.
    PrintAll,
    /// The states with the least value.
    ArgMin,
    /// The states with the greatest value.
    ArgMax,
}

/// For the value, or whether it keeps a bound.
#[derive(Debug, Clone, PartialEq)]
pub struct Question {
    /// Least or greatest; none where the model has one policy only, or the bound says it.
    pub direction: Option<Direction>,
    /// The bound; none for the value.
    pub bound: Option<(BinaryOp, Expr)>,
}

/// Paths.
#[derive(Debug, Clone, PartialEq)]
pub enum Path {
    /// The first state is one of these.
    State(Expr),
    /// The path is not of that kind.
    Not(Box<Self>),
    /// `X`: in the next state.
    Next(Expr),
    /// `U`, and `F` with `true` on the left: the right one holds some day (in so many steps), the left one until then.
    Until(Expr, Expr, Option<Box<Steps>>),
    /// `G`: always (in so many steps).
    Globally(Expr, Option<Box<Steps>>),
    /// `W`: `U`, or the left one holds always.
    WeakUntil(Expr, Expr, Option<Box<Steps>>),
    /// `R`: the right one holds until the left one does, too, or always.
    Release(Expr, Expr, Option<Box<Steps>>),
    /// `G F`: again and again.
    Repeatedly(Expr),
    /// `F G`: from some day on.
    Persistently(Expr),
}

/// Bounds on the number of steps, or on a reward that is earned on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct Steps {
    /// At least so many, or more than that.
    pub least: Option<StepBound>,
    /// At most so many, or less than that.
    pub most: Option<StepBound>,
    /// The reward that is bounded in place of the steps, with its name where it has one.
    pub reward: Option<Option<String>>,
}

/// A number of steps.
#[derive(Debug, Clone, PartialEq)]
pub struct StepBound {
    /// The number.
    pub limit: Expr,
    /// Whether the number itself is excluded.
    pub strict: bool,
}

/// Over what a reward is summed.
#[derive(Debug, Clone, PartialEq)]
pub enum RewardPath {
    /// `F`: until a state is reached.
    Reach(Expr),
    /// `C<=k`: over so many steps.
    Steps(StepBound),
    /// `C`: for ever.
    Total,
    /// `I=k`: that of the state after so many steps.
    Instant(Expr),
    /// `S`: the average of a step in the long run.
    LongRun,
}

/// A temporal operator with what it is applied to; the left side is `true` for operators that have one side.
#[derive(Debug, Clone, PartialEq)]
pub struct Temporal {
    /// The letter of the operator.
    pub letter: char,
    /// Its bounds.
    pub steps: Option<Box<Steps>>,
    /// Its left side.
    pub left: Expr,
    /// Its right side.
    pub right: Expr,
}

/// Operators between two expressions.
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
    /// Whether it makes a number of two.
    pub fn is_arithmetic(self) -> bool {
        matches!(self, Self::Plus | Self::Minus | Self::Times | Self::Divide)
    }

    /// How it is written, and how strongly it binds.
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

    /// All of them.
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
    /// All of them with their names.
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

    /// Its name.
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
    /// How it is written.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bool => "bool",
            Self::Int => "int",
            Self::Double => "double",
        }
    }
}

/// What kind of process a model is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    /// Markov decision process.
    Mdp,
    /// Discrete-time Markov chain.
    Dtmc,
}

/// A constant; without value it is set from outside.
#[derive(Debug, Clone, PartialEq)]
pub struct Constant {
    /// Its name.
    pub name: String,
    /// Its type.
    pub kind: Type,
    /// Its value.
    pub value: Option<Expr>,
    /// Where its name stands.
    pub place: Place,
}

/// A name and the expression that it stands for: a formula or a label.
#[derive(Debug, Clone, PartialEq)]
pub struct Named {
    /// Its name.
    pub name: String,
    /// What it stands for.
    pub expression: Expr,
    /// Where its name stands.
    pub place: Place,
}

/// A variable.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Its name.
    pub name: String,
    /// Least and greatest value; none for truth values.
    pub range: Option<(Expr, Expr)>,
    /// Its value at the start: otherwise false, or the least.
    pub initial: Option<Expr>,
    /// Where its name stands.
    pub place: Place,
}

/// What can happen with some probability.
#[derive(Debug, Clone, PartialEq)]
pub struct Update {
    /// With which probability; none for certainty.
    pub probability: Option<Expr>,
    /// Variables and their new values.
    pub assignments: Vec<(String, Expr, Place)>,
}

/// A guarded command.
#[derive(Debug, Clone, PartialEq)]
pub struct Command {
    /// The action on which modules synchronise.
    pub action: Option<String>,
    /// When it can happen.
    pub guard: Expr,
    /// What happens.
    pub updates: Vec<Update>,
    /// Where it starts.
    pub place: Place,
}

/// A module.
#[derive(Debug, Clone, PartialEq)]
pub struct Module {
    /// Its name.
    pub name: String,
    /// Its variables.
    pub variables: Vec<Variable>,
    /// Its commands.
    pub commands: Vec<Command>,
    /// Where its name stands.
    pub place: Place,
}

/// For which states or transitions a reward is given.
#[derive(Debug, Clone, PartialEq)]
pub struct RewardItem {
    /// None for a reward of states; else the action of the transitions, none for those without name.
    pub action: Option<Option<String>>,
    /// In which states.
    pub guard: Expr,
    /// How much.
    pub reward: Expr,
    /// Where it starts.
    pub place: Place,
}

/// A reward structure.
#[derive(Debug, Clone, PartialEq)]
pub struct Rewards {
    /// Its name, perhaps empty.
    pub name: String,
    /// Its items, which are added up.
    pub items: Vec<RewardItem>,
    /// Where it starts.
    pub place: Place,
}

/// A model.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// What kind of process it is.
    pub kind: ModelKind,
    /// A remark that stands before it, perhaps empty.
    pub remark: String,
    /// Its constants.
    pub constants: Vec<Constant>,
    /// Its formulas.
    pub formulas: Vec<Named>,
    /// Variables of no module.
    pub globals: Vec<Variable>,
    /// Its modules.
    pub modules: Vec<Module>,
    /// Its rewards.
    pub rewards: Vec<Rewards>,
    /// Its labels.
    pub labels: Vec<Named>,
    /// `init … endinit`: where it can start.
    pub initial: Option<Expr>,
}

impl Expr {
    /// An expression that was not read.
    pub fn new(kind: ExprKind) -> Self {
        Self { kind, place: Place::default() }
    }

    /// A name.
    pub fn name(name: &str) -> Self {
        Self::new(ExprKind::Name(name.to_owned()))
    }

    /// A whole number.
    pub fn int(value: i64) -> Self {
        Self::new(ExprKind::Int(value))
    }

    /// A truth value.
    pub fn bool(value: bool) -> Self {
        Self::new(ExprKind::Bool(value))
    }

    /// An operation.
    #[must_use]
    pub fn op(self, op: BinaryOp, other: Self) -> Self {
        Self::new(ExprKind::Binary(op, Box::new(self), Box::new(other)))
    }

    /// The names that occur in it.
    pub fn names<'a>(&'a self, found: &mut Vec<(&'a str, Place)>) {
        match &self.kind {
            ExprKind::Name(name) => found.push((name, self.place)),
            ExprKind::Not(inner) | ExprKind::Negative(inner) => inner.names(found),
            ExprKind::Binary(_, left, right) => {
                left.names(found);
                right.names(found);
            }
            ExprKind::If(condition, then, otherwise) => {
                for part in [condition, then, otherwise] {
                    part.names(found);
                }
            }
            ExprKind::Call(_, arguments) => arguments.iter().for_each(|argument| argument.names(found)),
            ExprKind::Bool(_)
            | ExprKind::Int(_)
            | ExprKind::Number(_)
            | ExprKind::Label(_)
            | ExprKind::Property(_)
            | ExprKind::Temporal(_) => {}
        }
    }

    /// The same with each name replaced, where the function has something for it.
    #[must_use]
    pub fn replace(&self, with: &dyn Fn(&str) -> Option<Self>) -> Self {
        self.rewrite(&mut |part| match &part.kind {
            ExprKind::Name(name) => Some(with(name).unwrap_or_else(|| part.clone())),
            _ => None,
        })
    }

    /// The same with each part replaced, where the function has something for it; larger parts are asked for first.
    #[must_use]
    pub fn rewrite(&self, with: &mut dyn FnMut(&Self) -> Option<Self>) -> Self {
        if let Some(other) = with(self) {
            return other;
        }
        let mut again = |part: &Self| Box::new(part.rewrite(with));
        let kind = match &self.kind {
            ExprKind::Not(inner) => ExprKind::Not(again(inner)),
            ExprKind::Negative(inner) => ExprKind::Negative(again(inner)),
            ExprKind::Binary(op, left, right) => ExprKind::Binary(*op, again(left), again(right)),
            ExprKind::If(condition, then, otherwise) => {
                ExprKind::If(again(condition), again(then), again(otherwise))
            }
            ExprKind::Call(function, arguments) => {
                ExprKind::Call(*function, arguments.iter().map(|argument| *again(argument)).collect())
            }
            other => other.clone(),
        };
        Self { kind, place: self.place }
    }
}
