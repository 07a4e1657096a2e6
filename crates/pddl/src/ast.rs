//! The abstract syntax tree of PDDL. The parser builds it; names are not resolved in it.
//!
//! The tree keeps the source position of every element that a message may have to point at. Names keep the
//! spelling of the file and are compared without regard to case, as PDDL requires \[1\].
//!
//! \[1\] M. Fox, D. Long: PDDL2.1, an extension to PDDL for expressing temporal planning domains, JAIR 20, 2003.

use std::fmt;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

use num_rational::BigRational;

/// A region of one source text, in bytes from its beginning; `end` is exclusive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Span {
    /// Offset of the first byte.
    pub start: u32,
    /// Offset of the byte after the last one.
    pub end: u32,
}

/// A PDDL name as written. Equality, order and hash ignore ASCII case.
#[derive(Clone)]
pub struct Name(Arc<str>);

impl Name {
    /// Creates a name with the given spelling.
    pub fn new(written: &str) -> Self {
        Self(written.into())
    }

    /// Returns the spelling in the source.
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
        // Eight bytes at a time: in files of megabytes, most of the text is names and hashing them is a hot
        // spot.
        for chunk in self.0.as_bytes().chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            state.write_u64(u64::from_le_bytes(word.map(|byte| byte.to_ascii_lowercase())));
        }
        // End marker, as in the `Hash` implementation of `str`: names in a tuple must not run together.
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

/// A name with its position in the source.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Identifier {
    /// The name.
    pub name: Name,
    /// Position of the name.
    pub span: Span,
}

/// Creates an identifier for a name that occurs in no file. Its span is empty.
impl From<Name> for Identifier {
    fn from(name: Name) -> Self {
        Self { name, span: Span::default() }
    }
}

/// Type of a typed-list entry: one type name, or several for `either`. The type `object` is represented by an
/// empty list, except within `either`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TypeExpression {
    /// Names of the alternative types.
    pub alternatives: Vec<Identifier>,
}

/// An entry of a typed list. Variables are stored without their question mark.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TypedName {
    /// Declared variable, object or type.
    pub identifier: Identifier,
    /// Type of the entry.
    pub r#type: TypeExpression,
}

/// A domain file.
#[derive(Debug, Clone)]
pub struct Domain {
    /// `(domain NAME)`.
    pub name: Identifier,
    /// Requirement flags, without the colon.
    pub requirements: Vec<Identifier>,
    /// `:types`.
    pub types: Vec<TypedName>,
    /// `:constants`.
    pub constants: Vec<TypedName>,
    /// Predicates of `:predicates`, and those that represent object fluents.
    pub predicates: Vec<Declaration>,
    /// Numeric functions of `:functions`.
    pub functions: Vec<Declaration>,
    /// Names of predicates that represent functions with objects as values. The last argument is the value.
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
    /// Name of the predicate or function.
    pub identifier: Identifier,
    /// Typed parameters.
    pub parameters: Vec<TypedName>,
}

/// `(:derived (HEAD PARAMETERS) CONDITION)`.
#[derive(Debug, Clone)]
pub struct Derived {
    /// Derived predicate, with the variables that the body may use.
    pub head: Declaration,
    /// Condition under which the predicate holds.
    pub condition: Condition,
    /// Extent of the whole axiom.
    pub span: Span,
}

/// An action schema.
#[derive(Debug, Clone)]
pub struct Action {
    /// Name of the schema. Several schemas may have the same name.
    pub identifier: Identifier,
    /// Typed parameters.
    pub parameters: Vec<TypedName>,
    /// Conditions, effects and duration.
    pub body: ActionBody,
    /// Preferences among the conditions.
    pub preferences: Vec<Preference>,
    /// Extent of the whole schema.
    pub span: Span,
}

/// `(preference NAME CONDITION)` among the conditions of an action. A violated preference is counted; it does
/// not prevent the action.
#[derive(Debug, Clone)]
pub struct Preference {
    /// Variables of the quantifiers that enclose the preference. Each violated instance counts as one
    /// violation.
    pub variables: Vec<TypedName>,
    /// Name of the preference. Several preferences may have the same name.
    pub name: Identifier,
    /// Time at which the condition should hold. `AtStart` in an instantaneous action.
    pub time: ConditionTime,
    /// Desired condition.
    pub condition: Condition,
    /// Extent of the whole preference.
    pub span: Span,
}

/// Constraint on the trajectory of a plan, that is, on its sequence of states.
#[derive(Debug, Clone)]
pub struct Constraint {
    /// Variables of the quantifiers that enclose the constraint. If the constraint is a preference, each
    /// violated instance counts as one violation.
    pub variables: Vec<TypedName>,
    /// Name, if the constraint is a preference. Several preferences may have the same name; `(is-violated
    /// NAME)` is the number of their violated instances. A constraint without a name is mandatory.
    pub preference: Option<Identifier>,
    /// Modal formula that the trajectory must satisfy. A preference of the goal is stored as
    /// [`Trajectory::AtEnd`].
    pub trajectory: Trajectory,
    /// Extent of the whole constraint.
    pub span: Span,
}

/// Modal formula over the trajectory of a plan (A. Gerevini, P. Haslum, D. Long, A. Saetti, Y. Dimopoulos:
/// Deterministic planning in the fifth international planning competition: PDDL3, Artificial Intelligence
/// 173, 2009).
#[derive(Debug, Clone)]
pub enum Trajectory {
    /// `(and …)`.
    And(Vec<Trajectory>),
    /// `(forall (…) …)`.
    ForAll(Vec<TypedName>, Box<Trajectory>),
    /// `(at end A)`: A holds in the last state.
    AtEnd(Condition),
    /// `(always A)`: A holds in every state.
    Always(Condition),
    /// `(sometime A)`: A holds in some state.
    Sometime(Condition),
    /// `(at-most-once A)`: the states in which A holds, if any, are consecutive.
    AtMostOnce(Condition),
    /// `(sometime-after A B)`: for every state with A, B holds in this or a later state.
    SometimeAfter(Condition, Condition),
    /// `(sometime-before A B)`: for every state with A, B holds in an earlier state.
    SometimeBefore(Condition, Condition),
    /// `(within T A)`: A holds in a state that is reached by time T.
    Within(BigRational, Condition),
    /// `(always-within T A B)`: for every state with A, B holds in this or a later state at most T time units
    /// later.
    AlwaysWithin(BigRational, Condition, Condition),
    /// `(hold-during T U A)`: A holds from time T until just before time U.
    HoldDuring(BigRational, BigRational, Condition),
    /// `(hold-after T A)`: A holds from time T on.
    HoldAfter(BigRational, Condition),
}

/// Conditions, effects and duration of an action.
#[derive(Debug, Clone)]
#[expect(clippy::large_enum_variant, reason = "a domain has few actions, and patterns stay flat")]
pub enum ActionBody {
    /// `:action`.
    Instantaneous {
        /// `:precondition` without its preferences, together with the conditions that object fluents in the effect
        /// impose. An empty conjunction if there are no such conditions.
        precondition: Condition,
        /// `:effect`.
        effect: Effect,
    },
    /// `:durative-action`.
    Durative {
        /// `:duration`: constraints on `?duration`. All of them must hold.
        duration: Vec<DurationConstraint>,
        /// Conjuncts of `:condition` without its preferences, each with its time, and the conditions that
        /// object fluents in the effects impose.
        conditions: Vec<(ConditionTime, Condition)>,
        /// Conjuncts of `:effect`, each with its time.
        effects: Vec<(EffectTime, Effect)>,
    },
}

/// `(OPERATOR ?duration EXPRESSION)`, or the same in `(at start …)` or `(at end …)`.
#[derive(Debug, Clone)]
pub struct DurationConstraint {
    /// Time at which the expression is evaluated. Default: `AtStart`.
    pub time: EffectTime,
    /// Relation between `?duration` and the expression.
    pub operator: Comparison,
    /// Bound, in the domain's time unit.
    pub expression: Expression,
    /// Extent of the whole constraint.
    pub span: Span,
}

/// Time at which a condition of a durative action must hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ConditionTime {
    /// In the state in which the action starts.
    AtStart,
    /// In the open interval between start and end.
    OverAll,
    /// In the state in which the action ends.
    AtEnd,
}

/// Time at which an effect of a durative action takes place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum EffectTime {
    /// At the start of the action.
    AtStart,
    /// At the end of the action.
    AtEnd,
}

/// A variable or a constant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Term {
    /// `?x`, stored as `x`.
    Variable(Identifier),
    /// An object or a domain constant.
    Constant(Identifier),
}

impl Term {
    /// Returns the name of the variable or constant.
    pub fn name(&self) -> &Name {
        let (Self::Variable(identifier) | Self::Constant(identifier)) = self;
        &identifier.name
    }
}

/// A predicate or a numeric function applied to terms.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Atom {
    /// Predicate or function.
    pub predicate: Identifier,
    /// Arguments.
    pub arguments: Vec<Term>,
    /// Extent of the whole atom, including its parentheses if present.
    pub span: Span,
}

/// Goal description (GD) in the grammar of PDDL.
#[derive(Debug, Clone, PartialEq, Eq)]
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

/// Relation between two numbers.
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
    /// Returns the PDDL token.
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

    /// Returns `true` if the right side is a lower bound of the left one.
    #[must_use]
    pub fn is_lower_bound(self) -> bool {
        matches!(self, Self::Equal | Self::GreaterOrEqual | Self::Greater)
    }

    /// Returns the relation after an exchange of the two sides: `a < b` becomes `b > a`.
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
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Expression {
    /// A number, with its exact value.
    Number(BigRational, Span),
    /// Numeric function. In a metric also `(is-violated NAME)`, whose argument is the name of a preference.
    Fluent(Atom),
    /// `?duration`, inside durative actions.
    Duration(Span),
    /// `total-time`, inside the metric.
    TotalTime(Span),
    /// `(+ …)` and `(* …)` with one or more operands; `(- a)`, `(- a b)` and `(/ a b)`.
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
    /// `(when CONDITION EFFECT)`. In a durative action, condition and effect have the same time, which is stored
    /// with the effect in [`ActionBody::Durative`].
    When(Condition, Box<Effect>),
    /// A numeric effect.
    Assign(Assignment, Atom, Expression, Span),
}

/// Operator of a numeric effect.
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
    /// Requirement flags, without the colon.
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
    /// `(not ATOM)`: redundant, because atoms that are not stated are false.
    NegatedFact(Atom),
    /// `(= FUNCTION NUMBER)`.
    Value(Atom, BigRational, Span),
    /// `(at TIME LITERAL)`: a timed initial literal. The flag is `false` if the literal is negated.
    Timed(BigRational, Atom, bool, Span),
}

impl InitialElement {
    /// Returns the predicate and the arguments of a fact, and `None` for other elements.
    pub fn fact(&self) -> Option<(Name, Vec<Name>)> {
        let Self::Fact(atom) = self else { return None };
        Some((atom.predicate.name.clone(), atom.arguments.iter().map(Term::name).cloned().collect()))
    }
}

/// `(:metric DIRECTION EXPRESSION)`.
#[derive(Debug, Clone)]
pub struct Metric {
    /// Direction of optimisation.
    pub direction: Direction,
    /// Expression to optimise. The expression is evaluated in the final state of a plan.
    pub expression: Expression,
    /// Extent of the whole metric.
    pub span: Span,
}

/// Direction of optimisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Direction {
    /// Less is better.
    Minimize,
    /// More is better.
    Maximize,
}
