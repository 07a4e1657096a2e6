//! The lifted task: a PDDL task whose names are resolved to ids and whose conditions are in negation normal
//! form.
//!
//! Objects, predicates, functions and parameters have dense ids in declaration order. A durative action keeps separate
//! conditions and effects for start and end; for sequential execution, `ground` composes them into a single operator.

use std::sync::Arc;

use crate::error::Place;
use crate::number::Rational;
use pddl::ast::{Assignment, Comparison, Direction, Name};

/// Id of an object or constant, in declaration order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ObjectId(pub u32);

/// Id of a predicate, in declaration order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PredicateId(pub u32);

/// Id of a numeric function, in declaration order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FunctionId(pub u32);

impl ObjectId {
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl PredicateId {
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl FunctionId {
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// The arguments of a ground atom.
pub type Arguments = Box<[ObjectId]>;

/// A lifted task: names are resolved to ids, and action schemas are not instantiated.
#[derive(Debug)]
pub struct Lifted {
    pub(crate) objects: Vec<Name>,
    pub predicates: Vec<Predicate>,
    pub functions: Vec<Function>,
    pub schemas: Vec<Schema>,
    pub axioms: Vec<Axiom>,
    /// Initial facts without duplicates: those of the file in its order, then those of auxiliary predicates. For
    /// sequential execution, timed literals at or before time 0 are also applied.
    pub(crate) facts: Vec<(PredicateId, Arguments)>,
    pub(crate) values: Vec<(FunctionId, Arguments, Rational)>,
    /// Timed initial literals in chronological order.
    pub events: Vec<Event>,
    pub time: Time,
    pub goal: Formula,
    pub(crate) goal_variables: usize,
    /// Metrics in lexicographic order; empty if the files have none.
    pub metrics: Vec<Metric>,
}

/// A predicate. It is a fluent if an action or timed event changes it, if it is derived from fluents or cannot be
/// evaluated in advance, or if it represents time; otherwise it is static.
#[derive(Debug, Clone)]
pub struct Predicate {
    pub name: Name,
    pub arity: usize,
    pub fluent: bool,
    pub derived: bool,
    /// `true` for an auxiliary predicate that marks running instances of an action schema. Its arguments are
    /// the parameters of the schema; it has no name in PDDL files.
    pub running: bool,
}

/// A numeric function. It is a fluent if an action changes it, or if it is auxiliary (times and durations); otherwise
/// it is static.
#[derive(Debug, Clone)]
pub struct Function {
    pub name: Name,
    pub fluent: bool,
    /// `true` if the function may be undefined for some arguments and thus needs no initial value. Its uses are
    /// guarded by conditions, or come after an assignment.
    pub partial: bool,
}

/// An action schema. `Term::Parameter` refers to parameters by their index.
#[derive(Debug, Clone)]
pub struct Schema {
    pub name: Name,
    pub parameters: Vec<Parameter>,
    /// Number of parameters and quantified variables, without those variables that were replaced by the only object
    /// of their type.
    pub variables: usize,
    /// Condition on the state before the action.
    pub start_condition: Formula,
    pub start_effects: Vec<Effect>,
    /// Condition on the state after the start effects: `over all` and `at end` conditions of a durative
    /// action.
    pub middle_condition: Formula,
    /// The `over all` condition, which is a part of `middle_condition`.
    pub over_all: Formula,
    /// The `at end` condition, which is a part of `middle_condition`.
    pub at_end: Formula,
    pub end_effects: Vec<Effect>,
    /// Duration in the domain's time unit; `None` for an instantaneous action.
    pub duration: Option<Expression>,
    /// Choice among the admissible durations.
    pub choice: DurationChoice,
    /// Set if start and end are simultaneous, because the duration is 0. `end_effects` then contains both
    /// sets of effects.
    pub joint: Option<Box<Joint>>,
    /// Index of the action in the domain; several schemas may represent one action. If the task is split into
    /// happenings, the index of this schema.
    pub action: u32,
    pub place: Place,
}

/// The choice among the admissible durations of an action.
#[derive(Debug, Clone, Default)]
pub enum DurationChoice {
    /// Only one duration is admissible, or the duration is an auxiliary function.
    #[default]
    None,
    /// The shortest one.
    Shortest,
    /// The longest one. The lower bounds decide whether 0 is admissible, too.
    Longest(Vec<(Comparison, Expression)>),
}

/// Separate conditions of the start and end of an action with duration 0, and the split of their effects.
#[derive(Debug, Clone)]
pub struct Joint {
    pub(crate) start: Formula,
    pub(crate) end: Formula,
    /// Number of effects of the start, which come first in `end_effects`.
    pub(crate) start_effects: usize,
}

/// Auxiliary symbols that represent time in a task with timed events.
#[derive(Debug, Clone, Copy)]
pub struct Time {
    pub(crate) clock: FunctionId,
    pub(crate) moment: FunctionId,
    /// Predicate of the current phase. Its argument is an object that represents the number of past events.
    pub phase: PredicateId,
    /// Object for 0 past events; the objects for 1, 2, … past events have the next ids.
    pub first_phase: ObjectId,
    /// True if the last step was a wait or, if actions may overlap, a timed event after time 0.
    pub waited: PredicateId,
}

/// The timed initial literals of one point in time.
#[derive(Debug, Clone)]
pub struct Event {
    /// Time from the start of the plan, in the domain's time unit.
    pub time: Rational,
    /// Changed atoms with their new truth values.
    pub changes: Vec<(PredicateId, Arguments, bool)>,
}

/// An axiom of a derived predicate: the atom over the parameters is true if the condition is true.
#[derive(Debug, Clone)]
pub struct Axiom {
    pub(crate) predicate: PredicateId,
    pub(crate) parameters: Vec<Parameter>,
    pub(crate) variables: usize,
    pub condition: Formula,
}

/// A parameter of a schema or axiom, with the ids of all objects of its type in ascending order.
#[derive(Debug, Clone)]
pub struct Parameter {
    pub(crate) candidates: Arc<[ObjectId]>,
}

/// A quantified variable with its number and the objects of its type in ascending order. Quantified variables are
/// numbered after the parameters.
#[derive(Debug, Clone)]
pub struct Bound {
    pub(crate) variable: u32,
    pub(crate) candidates: Arc<[ObjectId]>,
}

/// A parameter, a quantified variable (both by number) or an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Term {
    Parameter(u32),
    Object(ObjectId),
}

/// A condition in negation normal form.
#[derive(Debug, Clone)]
pub enum Formula {
    And(Vec<Formula>),
    Or(Vec<Formula>),
    Exists(Vec<Bound>, Box<Formula>),
    ForAll(Vec<Bound>, Box<Formula>),
    Literal { positive: bool, predicate: PredicateId, terms: Vec<Term> },
    Equal { positive: bool, left: Term, right: Term },
    Compare(Comparison, Expression, Expression, Place),
}

impl Formula {
    /// Returns the condition that is always true.
    pub const fn truth() -> Self {
        Self::And(Vec::new())
    }

    pub(crate) fn negated(&self) -> Self {
        use Comparison as Op;
        let each = |parts: &[Self]| parts.iter().map(Self::negated).collect();
        match self {
            Self::And(parts) => Self::Or(each(parts)),
            Self::Or(parts) => Self::And(each(parts)),
            Self::Exists(bound, body) => Self::ForAll(bound.clone(), Box::new(body.negated())),
            Self::ForAll(bound, body) => Self::Exists(bound.clone(), Box::new(body.negated())),
            Self::Literal { positive, predicate, terms } => {
                Self::Literal { positive: !positive, predicate: *predicate, terms: terms.clone() }
            }
            Self::Equal { positive, left, right } => {
                Self::Equal { positive: !positive, left: *left, right: *right }
            }
            Self::Compare(comparison, left, right, place) => {
                let with = |comparison| Self::Compare(comparison, left.clone(), right.clone(), *place);
                match comparison {
                    Op::Less => with(Op::GreaterOrEqual),
                    Op::LessOrEqual => with(Op::Greater),
                    Op::GreaterOrEqual => with(Op::Less),
                    Op::Greater => with(Op::LessOrEqual),
                    Op::Equal => Self::Or(vec![with(Op::Less), with(Op::Greater)]),
                }
            }
        }
    }
}

/// An effect: for all objects of the bound variables for which the condition holds, the change occurs.
#[derive(Debug, Clone)]
pub struct Effect {
    pub bound: Vec<Bound>,
    pub condition: Formula,
    pub change: Change,
}

/// The change that an effect makes: an added or deleted atom, or an assigned number.
#[derive(Debug, Clone)]
pub enum Change {
    Add(PredicateId, Vec<Term>),
    Delete(PredicateId, Vec<Term>),
    Assign {
        assignment: Assignment,
        function: FunctionId,
        terms: Vec<Term>,
        expression: Expression,
        place: Place,
    },
}

/// A numeric expression.
#[derive(Debug, Clone, PartialEq)]
pub enum Expression {
    Number(Rational),
    Function(FunctionId, Vec<Term>, Place),
    TotalTime,
    Sum(Vec<Expression>),
    Negate(Box<Expression>),
    Product(Vec<Expression>, Place),
    Quotient(Box<Expression>, Box<Expression>, Place),
}

/// A metric by which plans are compared.
#[derive(Debug, Clone)]
pub struct Metric {
    pub direction: Direction,
    pub expression: Expression,
    pub place: Place,
}
