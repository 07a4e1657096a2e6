//! The lifted task: PDDL with names resolved to ids, in negation normal form.
//!
//! Objects, predicates, functions and parameters are dense ids in declaration order, so later
//! stages are independent of names. A durative action keeps its start and end. `ground` composes
//! both into a single operator, because execution is sequential.

use std::sync::Arc;

use crate::error::Place;
use crate::number::Rational;
use pddl::ast::{Assignment, Comparison, Direction, Name};

/// An object or constant, by order of declaration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ObjectId(pub u32);

/// A predicate, by order of declaration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PredicateId(pub u32);

/// A numeric function, by order of declaration.
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

/// A lifted task.
#[derive(Debug)]
pub struct Lifted {
    pub(crate) objects: Vec<Name>,
    pub predicates: Vec<Predicate>,
    pub functions: Vec<Function>,
    pub schemas: Vec<Schema>,
    pub axioms: Vec<Axiom>,
    /// Initial facts in the order of the file, without duplicates.
    pub(crate) facts: Vec<(PredicateId, Arguments)>,
    pub(crate) values: Vec<(FunctionId, Arguments, Rational)>,
    /// Timed initial literals in chronological order.
    pub events: Vec<Event>,
    pub time: Time,
    pub goal: Formula,
    /// Number of variables that the quantifiers of the goal bind.
    pub(crate) goal_variables: usize,
    /// Metrics in lexicographic order; empty if the files have none.
    pub metrics: Vec<Metric>,
}

/// A predicate. It is a fluent if an action changes it or if it is derived from fluents, otherwise
/// static.
#[derive(Debug, Clone)]
pub struct Predicate {
    pub name: Name,
    pub arity: usize,
    pub fluent: bool,
    pub derived: bool,
    /// `true` if the predicate marks running instances of a schema. It has the parameters of the
    /// schema, and no name in the files.
    pub running: bool,
}

/// A numeric function. It is a fluent if an action changes it, otherwise static.
#[derive(Debug, Clone)]
pub struct Function {
    pub name: Name,
    pub fluent: bool,
    /// `true` if it may be undefined. Conditions then guard its uses.
    pub partial: bool,
}

/// An action schema, whose parameters are `Term::Parameter` indices.
#[derive(Debug, Clone)]
pub struct Schema {
    pub name: Name,
    pub parameters: Vec<Parameter>,
    /// Number of parameters and bound variables.
    pub variables: usize,
    /// Condition before the action.
    pub start_condition: Formula,
    pub start_effects: Vec<Effect>,
    /// Condition after the start effects: `over all` and `at end` of a durative action.
    pub middle_condition: Formula,
    /// Part of the condition for the whole interval, used only with timed events.
    pub over_all: Formula,
    /// Part of the condition at the end.
    pub at_end: Formula,
    pub end_effects: Vec<Effect>,
    /// Duration in the domain's time unit; `None` for an instantaneous action.
    pub duration: Option<Expression>,
    /// `true` if the planner has chosen the shortest admissible duration.
    pub is_chosen: bool,
    /// Set if start and end of a durative action are simultaneous, because its duration is 0.
    pub joint: Option<Box<Joint>>,
    /// Position of the action in the domain. Several schemas may represent an action.
    pub action: u32,
    pub place: Place,
}

/// Parts of a simultaneous start and end.
#[derive(Debug, Clone)]
pub struct Joint {
    /// Condition of the start.
    pub(crate) start: Formula,
    /// Condition of the end.
    pub(crate) end: Formula,
    /// Number of leading effects that belong to the start.
    pub(crate) start_effects: usize,
}

/// Auxiliary symbols for time in a task with timed events.
#[derive(Debug, Clone, Copy)]
pub struct Time {
    pub(crate) clock: FunctionId,
    /// Duration of a moment: distinct times differ by at least two moments.
    pub(crate) moment: FunctionId,
    /// `(phase NUMBER)`: number of past events.
    pub phase: PredicateId,
    /// Object of phase 0; the objects of later phases follow.
    pub first_phase: ObjectId,
    pub waited: PredicateId,
}

/// Timed initial literals of the same time.
#[derive(Debug, Clone)]
pub struct Event {
    /// Time from the start of the plan, in the domain's time unit.
    pub time: Rational,
    pub changes: Vec<(PredicateId, Arguments, bool)>,
}

/// A rule of a derived predicate: the atom over the parameters holds if the condition does.
#[derive(Debug, Clone)]
pub struct Axiom {
    pub(crate) predicate: PredicateId,
    pub(crate) parameters: Vec<Parameter>,
    /// Number of parameters and bound variables.
    pub(crate) variables: usize,
    pub condition: Formula,
}

/// A parameter with the objects of its type, ascending.
#[derive(Debug, Clone)]
pub struct Parameter {
    pub(crate) candidates: Arc<[ObjectId]>,
}

/// A bound variable, numbered after the parameters, with the objects of its type, ascending.
#[derive(Debug, Clone)]
pub struct Bound {
    pub(crate) variable: u32,
    pub(crate) candidates: Arc<[ObjectId]>,
}

/// A schema parameter, bound variable or object.
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

    /// Returns the negation in negation normal form.
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

/// An effect: the change for all objects of the bound variables for which the condition holds.
#[derive(Debug, Clone)]
pub struct Effect {
    pub bound: Vec<Bound>,
    pub condition: Formula,
    pub change: Change,
}

/// Change of an effect.
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

/// Metric of plans.
#[derive(Debug, Clone)]
pub struct Metric {
    pub direction: Direction,
    pub expression: Expression,
    pub place: Place,
}
