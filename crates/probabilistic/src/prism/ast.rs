//! Syntax tree of PRISM models (Markov chains and Markov decision processes) and of properties.

use num_rational::BigRational;

use crate::error::{Diagnostic, Place};
use crate::solve::Direction;

/// An expression with its position.
#[derive(Debug, Clone, PartialEq)]
pub struct Expr {
    /// The kind of expression, with its operands.
    pub kind: ExprKind,
    /// Position where the expression starts; line 0 if the expression was not parsed.
    pub place: Place,
}

/// The kinds of expressions.
#[derive(Debug, Clone, PartialEq)]
pub enum ExprKind {
    /// A Boolean literal: `true` or `false`.
    Bool(bool),
    /// An integer literal.
    Int(i64),
    /// A rational number. In a text, a literal with a decimal point or an exponent.
    Number(BigRational),
    /// The name of a constant, formula or variable.
    Name(String),
    /// The name of a label; in quotation marks in the text.
    Label(String),
    /// `!`: negation.
    Not(Box<Expr>),
    /// `-`: unary minus.
    Negative(Box<Expr>),
    /// A binary operator with its left and right operand.
    Binary(BinaryOp, Box<Expr>, Box<Expr>),
    /// `condition ? then : otherwise`.
    If(Box<Expr>, Box<Expr>, Box<Expr>),
    /// A function with its arguments.
    Call(Function, Vec<Expr>),
    /// The value or truth value of a property; in properties only.
    Property(Box<Property>),
    /// A path formula; within the brackets of properties only.
    Temporal(Box<Temporal>),
}

/// A property.
#[derive(Debug, Clone, PartialEq)]
pub enum Property {
    /// `P`: the probability of a path formula.
    Probability(Question, Path),
    /// `R`: an expected reward. The optional text is the name of the reward structure; the first structure is the
    /// default.
    Reward(Question, Option<String>, RewardPath),
    /// `S`: the long-run fraction of time spent in the states that satisfy the expression.
    SteadyState(Question, Expr),
    /// `multi`: several objectives, which are optimised together.
    Multi(Vec<Self>),
    /// `filter`: an aggregate of the values of the first expression. The second expression selects the states; all
    /// states are selected if it is absent.
    Filter(Filter, Expr, Option<Expr>),
    /// A numeric or Boolean expression over state variables and nested properties.
    Expression(Expr),
    /// An unsupported property, with the reason. The other properties of its file can still be checked.
    Refused(Diagnostic),
}

impl Property {
    /// Returns the operator and the limit of the bound of a `P`, `R` or `S` operator. `None` if it has no bound, and for
    /// other properties.
    pub fn bound(&self) -> Option<&(BinaryOp, Expr)> {
        match self {
            Self::Probability(question, _) | Self::Reward(question, ..) | Self::SteadyState(question, _) => {
                question.bound.as_ref()
            }
            _ => None,
        }
    }
}

/// The aggregate function of a filter.
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
    /// The value in the first of the selected states, ordered by the values of the variables.
    First,
    /// The value in the only selected state.
    State,
    /// The least and the greatest value over the selected states.
    Range,
    /// The selected states with their values, without states of value zero or false.
    Print,
    /// All selected states with their values.
    PrintAll,
    /// The selected states that have the least value.
    ArgMin,
    /// The selected states that have the greatest value.
    ArgMax,
}

/// The query of an operator `P`, `R` or `S`: its value (`=?`), or whether its value satisfies a bound.
#[derive(Debug, Clone, PartialEq)]
pub struct Question {
    /// The requested optimum: minimum or maximum over all policies. `None` if it is not given: the model is
    /// then a Markov chain, or the bound determines the direction.
    pub direction: Option<Direction>,
    /// Comparison operator and bound; `None` to query the value.
    pub bound: Option<(BinaryOp, Expr)>,
}

/// A path formula.
#[derive(Debug, Clone, PartialEq)]
pub enum Path {
    /// The first state of the path satisfies the expression.
    State(Expr),
    /// The path does not satisfy the inner formula.
    Not(Box<Self>),
    /// `X`: the second state of the path satisfies the expression.
    Next(Expr),
    /// `U`, and `F` with `true` as left operand: the right operand eventually holds within the bounds, and the left
    /// operand holds until then.
    Until(Expr, Expr, Option<Box<Steps>>),
    /// `G`: the expression always holds, or within the bounds if there are any.
    Globally(Expr, Option<Box<Steps>>),
    /// `W`: `U` holds, or the left operand always holds (or within the bounds if there are any).
    WeakUntil(Expr, Expr, Option<Box<Steps>>),
    /// `R`: the right operand holds always (or within the bounds if there are any), or up to and including the
    /// first state in which the left operand holds.
    Release(Expr, Expr, Option<Box<Steps>>),
    /// `G F`: the expression holds infinitely often.
    Repeatedly(Expr),
    /// `F G`: the expression eventually holds forever.
    Persistently(Expr),
}

/// Bounds of a temporal operator, on the number of steps or on an accumulated reward.
#[derive(Debug, Clone, PartialEq)]
pub struct Steps {
    /// The lower bound, if there is one.
    pub least: Option<StepBound>,
    /// The upper bound, if there is one.
    pub most: Option<StepBound>,
    /// Bounded quantity: the number of steps (`None`), or the reward of the structure with this name.
    /// `Some(None)` selects the first structure.
    pub reward: Option<Option<String>>,
}

/// A bound on the number of steps or on an accumulated reward.
#[derive(Debug, Clone, PartialEq)]
pub struct StepBound {
    /// The expression of the limit.
    pub limit: Expr,
    /// Whether the limit itself is excluded (`<` or `>`).
    pub strict: bool,
}

/// The aggregate of the rewards along a path. Its expected value is computed.
#[derive(Debug, Clone, PartialEq)]
pub enum RewardPath {
    /// `F`: the sum until a state that satisfies the expression is reached.
    Reach(Expr),
    /// `C<=k`: the sum over the first k steps.
    Steps(StepBound),
    /// `C`: the sum over the infinite path.
    Total,
    /// `I=k`: the state reward of the state after exactly k steps.
    Instant(Expr),
    /// `S`: the long-run average reward per step.
    LongRun,
}

/// A temporal operator with its operands. The left operand of a unary operator is `true`.
#[derive(Debug, Clone, PartialEq)]
pub struct Temporal {
    /// The letter of the operator: `X`, `F`, `G`, `U`, `W` or `R`.
    pub letter: char,
    /// The bounds on steps or reward, if there are any.
    pub steps: Option<Box<Steps>>,
    /// The left operand.
    pub left: Expr,
    /// The right operand.
    pub right: Expr,
}

/// A binary operator.
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
    /// Returns `true` if the operands and the result of the operator are numbers.
    pub fn is_arithmetic(self) -> bool {
        matches!(self, Self::Plus | Self::Minus | Self::Times | Self::Divide)
    }

    /// Returns the symbol and the precedence; operators with a greater precedence bind more tightly.
    pub fn sign(self) -> (&'static str, u8) {
        match self {
            Self::Implies => ("=>", 2),
            Self::Iff => ("<=>", 3),
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

    /// All binary operators.
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

/// A built-in function.
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
    /// All built-in functions with their names.
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

    /// Returns the name in the PRISM language.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, function)| *function == self).map_or("", |(name, _)| name)
    }
}

/// The type of a constant or an expression.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are those of the types")]
pub enum Type {
    Bool,
    Int,
    Double,
}

impl Type {
    /// Returns the keyword of the type in the PRISM language.
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

/// The declaration of a constant. The user must set the value of an undefined constant.
#[derive(Debug, Clone, PartialEq)]
pub struct Constant {
    /// The name.
    pub name: String,
    /// The type.
    pub kind: Type,
    /// The expression of the value; `None` for an undefined constant.
    pub value: Option<Expr>,
    /// Position of the name.
    pub place: Place,
}

/// A named expression: a formula or a label.
#[derive(Debug, Clone, PartialEq)]
pub struct Named {
    /// The name.
    pub name: String,
    /// The expression that defines the formula or label.
    pub expression: Expr,
    /// Position of the name.
    pub place: Place,
}

/// The declaration of a variable.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// The name.
    pub name: String,
    /// Least and greatest value; `None` for Boolean variables.
    pub range: Option<(Expr, Expr)>,
    /// The initial value; the default is `false` or the least value.
    pub initial: Option<Expr>,
    /// Position of the name.
    pub place: Place,
}

/// A probabilistic alternative of a command, with its assignments.
#[derive(Debug, Clone, PartialEq)]
pub struct Update {
    /// The probability of the alternative; `None` for 1.
    pub probability: Option<Expr>,
    /// The assignments: variable, new value, and position of the assignment.
    pub assignments: Vec<(String, Expr, Place)>,
}

/// A guarded command of a module.
#[derive(Debug, Clone, PartialEq)]
pub struct Command {
    /// The action on which modules synchronise; `None` for a command without an action.
    pub action: Option<String>,
    /// The condition under which the command is enabled.
    pub guard: Expr,
    /// The probabilistic alternatives.
    pub updates: Vec<Update>,
    /// Start of the command.
    pub place: Place,
}

/// A module: local variables and commands.
#[derive(Debug, Clone, PartialEq)]
pub struct Module {
    /// The name.
    pub name: String,
    /// The local variables of the module.
    pub variables: Vec<Variable>,
    /// The commands.
    pub commands: Vec<Command>,
    /// Position of the name.
    pub place: Place,
}

/// An item of a reward structure, for states or for transitions.
#[derive(Debug, Clone, PartialEq)]
pub struct RewardItem {
    /// `None` for a state reward. For a transition reward, the action of the rewarded commands, which is `None` for
    /// commands without an action.
    pub action: Option<Option<String>>,
    /// The condition under which the reward is earned.
    pub guard: Expr,
    /// The expression of the reward.
    pub reward: Expr,
    /// Start of the item.
    pub place: Place,
}

/// A reward structure: a sum of guarded rewards.
#[derive(Debug, Clone, PartialEq)]
pub struct Rewards {
    /// The name of the structure, possibly empty.
    pub name: String,
    /// The items; the rewards of all items whose guards hold are added.
    pub items: Vec<RewardItem>,
    /// Start of the structure.
    pub place: Place,
}

/// The syntax tree of a PRISM model.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// The kind of process.
    pub kind: ModelKind,
    /// The comment to write at the start of the file, possibly empty. Empty in parsed models.
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
    /// `init … endinit`: the condition that holds in the initial states; `None` without this declaration.
    pub initial: Option<Expr>,
}

impl Expr {
    /// Creates an expression without a position.
    pub fn new(kind: ExprKind) -> Self {
        Self { kind, place: Place::default() }
    }

    /// Creates an expression that is a name.
    pub fn name(name: &str) -> Self {
        Self::new(ExprKind::Name(name.to_owned()))
    }

    /// Creates an integer literal.
    pub fn int(value: i64) -> Self {
        Self::new(ExprKind::Int(value))
    }

    /// Creates a Boolean literal.
    pub fn bool(value: bool) -> Self {
        Self::new(ExprKind::Bool(value))
    }

    /// Creates a binary operation with `self` as its left operand.
    #[must_use]
    pub fn op(self, op: BinaryOp, other: Self) -> Self {
        Self::new(ExprKind::Binary(op, Box::new(self), Box::new(other)))
    }

    /// Returns the number of nested levels: 1 for a name or a number. Does not descend into properties and path
    /// formulas.
    pub(crate) fn levels(&self) -> usize {
        let (mut stack, mut deepest) = (vec![(self, 1_usize)], 0);
        while let Some((part, level)) = stack.pop() {
            deepest = deepest.max(level);
            let mut push = |operand| stack.push((operand, level.saturating_add(1)));
            match &part.kind {
                ExprKind::Not(inner) | ExprKind::Negative(inner) => push(inner),
                ExprKind::Binary(_, left, right) => {
                    push(left);
                    push(right);
                }
                ExprKind::If(condition, then, otherwise) => {
                    push(condition);
                    push(then);
                    push(otherwise);
                }
                ExprKind::Call(_, arguments) => arguments.iter().for_each(push),
                _ => {}
            }
        }
        deepest
    }

    /// Appends the names of constants, formulas and variables in the expression, each with its
    /// position. Does not descend into properties and path formulas.
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

    /// Returns the expression with each name outside of properties and path formulas replaced by
    /// `with(name)`. A name for which `with` returns `None` is kept.
    #[must_use]
    pub fn replace(&self, with: &dyn Fn(&str) -> Option<Self>) -> Self {
        self.rewrite(&mut |part| match &part.kind {
            ExprKind::Name(name) => Some(with(name).unwrap_or_else(|| part.clone())),
            _ => None,
        })
    }

    /// Returns the expression with subexpressions replaced by `with`, outermost first. If `with`
    /// returns `None` for a subexpression, the operands of this subexpression are rewritten. Does not
    /// descend into properties and path formulas.
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
