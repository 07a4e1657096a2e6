//! The syntax tree of PDDL: what the parser makes of a file, before names are resolved.
//!
//! The tree keeps the source position of everything that a message may have to point at. Names keep
//! the spelling of the file and compare without regard to case, as PDDL wants it \[1\].
//!
//! \[1\] M. Fox, D. Long: PDDL2.1, an extension to PDDL for expressing temporal planning domains, JAIR 20, 2003.

use std::fmt;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

use num_rational::BigRational;

/// A region of one source text, in bytes from its beginning; `end` is exclusive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Span {
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

/// A PDDL name as written; equality, order and hash ignore ASCII case.
#[derive(Clone)]
pub struct Name(Arc<str>);

impl Name {
    /// The name with the given spelling.
    pub fn new(written: &str) -> Self {
        Self(written.into())
    }

    /// The spelling in the source.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    fn folded(&self) -> impl Iterator<Item = u8> + '_ {
        self.0.bytes().map(|byte| byte.to_ascii_lowercase())
    }
}

impl PartialEq for Name {
    fn eq(&self, other: &Self) -> bool {
        self.0.eq_ignore_ascii_case(&other.0)
    }
}

impl Eq for Name {}

impl Hash for Name {
    fn hash<H: Hasher>(&self, state: &mut H) {
        // Eight bytes at a time: files of megabytes consist of little but names.
        for chunk in self.0.as_bytes().chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            state.write_u64(u64::from_le_bytes(word.map(|byte| byte.to_ascii_lowercase())));
        }
        state.write_u8(0xff);
    }
}

impl PartialOrd for Name {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Name {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.folded().cmp(other.folded())
    }
}

impl fmt::Debug for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", &self.0)
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// A name at a place.
#[derive(Debug, Clone)]
pub struct Identifier {
    /// The name.
    pub name: Name,
    /// Where it stands.
    pub span: Span,
}

/// A name that stands in no file.
impl From<Name> for Identifier {
    fn from(name: Name) -> Self {
        Self { name, span: Span::default() }
    }
}

/// The type of a typed-list entry: one name, or `either` of several; empty means `object`, written or not.
#[derive(Debug, Clone, Default)]
pub struct TypeExpression {
    /// The alternatives.
    pub alternatives: Vec<Identifier>,
}

/// An entry of a typed list. Variables are stored without their question mark.
#[derive(Debug, Clone)]
pub struct TypedName {
    /// The variable, object or type that is introduced.
    pub identifier: Identifier,
    /// Its type.
    pub r#type: TypeExpression,
}

/// A domain file.
#[derive(Debug, Clone)]
pub struct Domain {
    /// `(domain NAME)`.
    pub name: Identifier,
    /// The requirement flags, without their colon.
    pub requirements: Vec<Identifier>,
    /// `:types`.
    pub types: Vec<TypedName>,
    /// `:constants`.
    pub constants: Vec<TypedName>,
    /// `:predicates`.
    pub predicates: Vec<Declaration>,
    /// The numeric ones of `:functions`.
    pub functions: Vec<Declaration>,
    /// Those of the predicates that stand for functions with objects as values: the value is their last argument.
    pub object_fluents: Vec<Name>,
    /// `:derived` axioms, in the order of the file.
    pub derived: Vec<Derived>,
    /// `:constraints`.
    pub constraints: Vec<Constraint>,
    /// `:action` and `:durative-action`, in the order of the file.
    pub actions: Vec<Action>,
}

/// The declaration of a predicate or of a numeric function.
#[derive(Debug, Clone)]
pub struct Declaration {
    /// Its name.
    pub identifier: Identifier,
    /// Its parameters.
    pub parameters: Vec<TypedName>,
}

/// `(:derived (HEAD PARAMETERS) CONDITION)`.
#[derive(Debug, Clone)]
pub struct Derived {
    /// The derived predicate with the variables that the body may use.
    pub head: Declaration,
    /// When it holds.
    pub condition: Condition,
    /// The whole axiom.
    pub span: Span,
}

/// An action schema.
#[derive(Debug, Clone)]
pub struct Action {
    /// Its name; two schemas may share one.
    pub identifier: Identifier,
    /// Its parameters.
    pub parameters: Vec<TypedName>,
    /// What it needs and does.
    pub body: ActionBody,
    /// The preferences among its conditions.
    pub preferences: Vec<Preference>,
    /// The whole schema.
    pub span: Span,
}

/// `(preference NAME CONDITION)` among the conditions of an action: that the condition does not hold is counted, and no more.
#[derive(Debug, Clone)]
pub struct Preference {
    /// The variables of the quantifiers that it stands below; each of their instances counts by itself.
    pub variables: Vec<TypedName>,
    /// Its name; others may have the same one.
    pub name: Identifier,
    /// When it should hold; `AtStart` in an instantaneous action.
    pub time: ConditionTime,
    /// What should hold.
    pub condition: Condition,
    /// The whole preference.
    pub span: Span,
}

/// A constraint on the trajectory of a plan: on all its states, rather than on the last one.
#[derive(Debug, Clone)]
pub struct Constraint {
    /// The variables of the quantifiers that it stands below; as a preference, each of their instances counts by itself.
    pub variables: Vec<TypedName>,
    /// The name, if it is a preference: the number of its instances that are violated is `(is-violated NAME)`. Others may have
    /// the same name. A constraint without one has to hold.
    pub preference: Option<Identifier>,
    /// What it says. A preference in the goal is about the last state.
    pub trajectory: Trajectory,
    /// The whole constraint.
    pub span: Span,
}

/// What a constraint says of the states that a plan goes through (A. Gerevini, P. Haslum, D. Long, A. Saetti, Y. Dimopoulos:
/// Deterministic planning in the fifth international planning competition: PDDL3, Artificial Intelligence 173, 2009).
#[derive(Debug, Clone)]
pub enum Trajectory {
    /// `(and …)`.
    And(Vec<Trajectory>),
    /// `(forall (…) …)`.
    ForAll(Vec<TypedName>, Box<Trajectory>),
    /// `(at end A)`: A in the last state.
    AtEnd(Condition),
    /// `(always A)`: A in every state.
    Always(Condition),
    /// `(sometime A)`: A in some state.
    Sometime(Condition),
    /// `(at-most-once A)`: the states with A, if any, follow each other.
    AtMostOnce(Condition),
    /// `(sometime-after A B)`: B in every state with A, or later.
    SometimeAfter(Condition, Condition),
    /// `(sometime-before A B)`: B before every state with A.
    SometimeBefore(Condition, Condition),
    /// `(within T A)`: A in a state that is reached at time T at the latest.
    Within(BigRational, Condition),
    /// `(always-within T A B)`: B in every state with A, or T later at most.
    AlwaysWithin(BigRational, Condition, Condition),
    /// `(hold-during T U A)`: A from time T on until time U.
    HoldDuring(BigRational, BigRational, Condition),
    /// `(hold-after T A)`: A from time T on.
    HoldAfter(BigRational, Condition),
}

/// What an action needs and does.
#[derive(Debug, Clone)]
#[expect(clippy::large_enum_variant, reason = "a domain has few actions, and patterns stay flat")]
pub enum ActionBody {
    /// `:action`.
    Instantaneous {
        /// `:precondition`; an empty conjunction where the file has none.
        precondition: Condition,
        /// `:effect`.
        effect: Effect,
    },
    /// `:durative-action`.
    Durative {
        /// `:duration`: all of these bound `?duration`.
        duration: Vec<DurationConstraint>,
        /// `:condition`, flattened: a conjunction of conditions, each at its time.
        conditions: Vec<(ConditionTime, Condition)>,
        /// `:effect`, flattened: all effects, each at its time.
        effects: Vec<(EffectTime, Effect)>,
    },
}

/// `([at start|at end] (OPERATOR ?duration EXPRESSION))`.
#[derive(Debug, Clone)]
pub struct DurationConstraint {
    /// When the expression is evaluated; `AtStart` unless the file says otherwise.
    pub time: EffectTime,
    /// How `?duration` compares with the expression.
    pub operator: Comparison,
    /// The bound, in the domain's time unit.
    pub expression: Expression,
    /// The whole constraint.
    pub span: Span,
}

/// When a condition of a durative action must hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ConditionTime {
    /// In the state in which the action starts.
    AtStart,
    /// In the open interval between start and end.
    OverAll,
    /// In the state in which the action ends.
    AtEnd,
}

/// When an effect of a durative action takes place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum EffectTime {
    /// At the start of the action.
    AtStart,
    /// At its end.
    AtEnd,
}

/// A variable or a constant.
#[derive(Debug, Clone)]
pub enum Term {
    /// `?x`, stored as `x`.
    Variable(Identifier),
    /// An object or a domain constant.
    Constant(Identifier),
}

/// A predicate or a numeric function applied to terms.
#[derive(Debug, Clone)]
pub struct Atom {
    /// The predicate or the function.
    pub predicate: Identifier,
    /// Its arguments.
    pub arguments: Vec<Term>,
    /// The whole atom, with its parentheses if it has any.
    pub span: Span,
}

/// A goal description.
#[derive(Debug, Clone)]
pub enum Condition {
    /// `(and …)`; the empty conjunction is true.
    And(Vec<Condition>),
    /// `(or …)`; the empty disjunction is false.
    Or(Vec<Condition>),
    /// `(not …)`.
    Not(Box<Condition>),
    /// `(imply A B)`.
    Imply(Box<Condition>, Box<Condition>),
    /// `(exists (…) …)`.
    Exists(Vec<TypedName>, Box<Condition>),
    /// `(forall (…) …)`.
    ForAll(Vec<TypedName>, Box<Condition>),
    /// An atom.
    Atom(Atom),
    /// `(= t1 t2)` between terms.
    Equal(Term, Term, Span),
    /// A comparison of numbers.
    Compare(Comparison, Expression, Expression, Span),
}

/// How two numbers compare.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Comparison {
    /// `<`
    Less,
    /// `<=`
    LessOrEqual,
    /// `=`
    Equal,
    /// `>=`
    GreaterOrEqual,
    /// `>`
    Greater,
}

impl Comparison {
    /// The comparison as PDDL writes it.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Less => "<",
            Self::LessOrEqual => "<=",
            Self::Equal => "=",
            Self::GreaterOrEqual => ">=",
            Self::Greater => ">",
        }
    }

    /// The comparison with its sides exchanged.
    pub(crate) fn mirrored(self) -> Self {
        match self {
            Self::Less => Self::Greater,
            Self::LessOrEqual => Self::GreaterOrEqual,
            Self::Equal => Self::Equal,
            Self::GreaterOrEqual => Self::LessOrEqual,
            Self::Greater => Self::Less,
        }
    }
}

/// A numeric expression.
#[derive(Debug, Clone)]
pub enum Expression {
    /// A number, exactly as written.
    Number(BigRational, Span),
    /// A numeric function. In a metric, also `(is-violated NAME)`, whose argument is the name of a preference.
    Fluent(Atom),
    /// `?duration`, inside durative actions.
    Duration(Span),
    /// `total-time`, inside the metric.
    TotalTime(Span),
    /// `(+ …)`, `(* …)` with one or more operands; `(- a)` and `(- a b)`; `(/ a b)`.
    Operation(Arithmetic, Vec<Expression>, Span),
}

/// An arithmetic operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Arithmetic {
    /// Sum.
    Add,
    /// Difference, or negation of one operand.
    Subtract,
    /// Product.
    Multiply,
    /// Quotient.
    Divide,
}

/// An effect.
#[derive(Debug, Clone)]
pub enum Effect {
    /// `(and …)`.
    And(Vec<Effect>),
    /// An atom becomes true.
    Add(Atom),
    /// An atom becomes false.
    Delete(Atom),
    /// `(forall (…) …)`.
    ForAll(Vec<TypedName>, Box<Effect>),
    /// `(when CONDITION EFFECT)`; in a durative action both at the time of the entry they stand in.
    When(Condition, Box<Effect>),
    /// A numeric effect.
    Assign(Assignment, Atom, Expression, Span),
}

/// What a numeric effect does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Assignment {
    /// `assign`
    Assign,
    /// `increase`
    Increase,
    /// `decrease`
    Decrease,
    /// `scale-up`
    ScaleUp,
    /// `scale-down`
    ScaleDown,
}

/// A problem file.
#[derive(Debug, Clone)]
pub struct Problem {
    /// `(problem NAME)`.
    pub name: Identifier,
    /// `(:domain NAME)`.
    pub domain: Identifier,
    /// The requirement flags, without their colon.
    pub requirements: Vec<Identifier>,
    /// `:objects`.
    pub objects: Vec<TypedName>,
    /// `:init`.
    pub init: Vec<InitialElement>,
    /// `:goal`, without its preferences.
    pub goal: Condition,
    /// `:constraints`, and the preferences of the goal.
    pub constraints: Vec<Constraint>,
    /// `:metric`.
    pub metric: Option<Metric>,
}

/// One entry of `:init`.
#[derive(Debug, Clone)]
pub enum InitialElement {
    /// An atom that holds.
    Fact(Atom),
    /// `(not ATOM)`: says again what the closed world says already.
    NegatedFact(Atom),
    /// `(= FUNCTION NUMBER)`.
    Value(Atom, BigRational, Span),
    /// `(at TIME LITERAL)`: a timed initial literal; the flag is false for a negated one.
    Timed(BigRational, Atom, bool, Span),
}

impl InitialElement {
    /// Returns the predicate and the arguments of a fact; none for other elements.
    pub fn fact(&self) -> Option<(Name, Vec<Name>)> {
        let Self::Fact(atom) = self else { return None };
        let name = |term: &Term| match term {
            Term::Variable(own) | Term::Constant(own) => own.name.clone(),
        };
        Some((atom.predicate.name.clone(), atom.arguments.iter().map(name).collect()))
    }
}

/// `(:metric DIRECTION EXPRESSION)`.
#[derive(Debug, Clone)]
pub struct Metric {
    /// Whether less or more is better.
    pub direction: Direction,
    /// What is measured in the final state.
    pub expression: Expression,
    /// The whole metric.
    pub span: Span,
}

/// Whether less or more is better.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Direction {
    /// Less is better.
    Minimize,
    /// More is better.
    Maximize,
}
