//! The lifted task: PDDL with its names resolved to ids, and negation pushed inwards.
//!
//! Objects, predicates, functions and parameters are dense ids in the order of their declaration, so that
//! nothing further on depends on how anything is named. A durative action keeps its two halves; `ground`
//! composes them into one operator, because actions execute one after another.

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
    /// Initial facts in the order of the file, without repetitions.
    pub(crate) facts: Vec<(PredicateId, Arguments)>,
    pub(crate) values: Vec<(FunctionId, Arguments, Rational)>,
    /// What happens by itself, in the order of time.
    pub events: Vec<Event>,
    pub time: Time,
    pub goal: Formula,
    /// How many variables the quantifiers of the goal bind.
    pub(crate) goal_variables: usize,
    /// What plans are measured by, the most important first; empty if the files do not say.
    pub metrics: Vec<Metric>,
}

/// A predicate; it is a fluent if an action adds or deletes it, or if it is derived from fluents; else static.
#[derive(Debug, Clone)]
pub struct Predicate {
    pub name: Name,
    pub arity: usize,
    pub fluent: bool,
    pub derived: bool,
    /// Says that an instance of a schema is under way; it has the parameters of the schema, and no name in the files.
    pub running: bool,
}

/// A numeric function; it is a fluent if an action changes it, else static.
#[derive(Debug, Clone)]
pub struct Function {
    pub name: Name,
    pub fluent: bool,
    /// Whether it may have no value; conditions see to it that it is not read then.
    pub partial: bool,
}

/// An action schema with its parameters as `Term::Parameter` indices.
#[derive(Debug, Clone)]
pub struct Schema {
    pub name: Name,
    pub parameters: Vec<Parameter>,
    /// Parameters and the variables that quantifiers bind.
    pub variables: usize,
    /// Must hold before the action.
    pub start_condition: Formula,
    pub start_effects: Vec<Effect>,
    /// Must hold after the start effects: `over all` and `at end` of a durative action.
    pub middle_condition: Formula,
    /// The part of it that must hold from the start to the end; the planner asks only if something happens by itself.
    pub over_all: Formula,
    /// The part of it that must hold at the end.
    pub at_end: Formula,
    pub end_effects: Vec<Effect>,
    /// Duration in the domain's time unit; none for an instantaneous action.
    pub duration: Option<Expression>,
    /// Set if the planner has chosen the duration, as short as it may be.
    pub is_chosen: bool,
    /// Set if start and end of a durative action are one happening, because its duration is 0.
    pub joint: Option<Box<Joint>>,
    /// The position of the action in the domain; several schemas may stand for one.
    pub action: u32,
    pub place: Place,
}

/// What belongs to the start and what to the end of a happening that is both.
#[derive(Debug, Clone)]
pub struct Joint {
    /// The condition of the start.
    pub(crate) start: Formula,
    /// The condition of the end.
    pub(crate) end: Formula,
    /// How many of the effects, the first ones, are those of the start.
    pub(crate) start_effects: usize,
}

/// What stands for time in a task in which something happens by itself.
#[derive(Debug, Clone, Copy)]
pub struct Time {
    pub(crate) clock: FunctionId,
    /// A time so short that nothing that begins or ends later than something else does so less than twice this later.
    pub(crate) moment: FunctionId,
    /// `(phase NUMBER)`: how many events have taken place.
    pub phase: PredicateId,
    /// The object for phase 0; those of the others follow.
    pub first_phase: ObjectId,
    pub waited: PredicateId,
}

/// Timed initial literals of one time: each becomes true or false then.
#[derive(Debug, Clone)]
pub struct Event {
    /// In the domain's time unit, from the start of the plan.
    pub time: Rational,
    pub changes: Vec<(PredicateId, Arguments, bool)>,
}

/// A rule of a derived predicate: the atom over the parameters holds where the condition does.
#[derive(Debug, Clone)]
pub struct Axiom {
    pub(crate) predicate: PredicateId,
    pub(crate) parameters: Vec<Parameter>,
    /// Parameters and the variables that quantifiers bind.
    pub(crate) variables: usize,
    pub condition: Formula,
}

/// A parameter and the objects that its type admits, ascending.
#[derive(Debug, Clone)]
pub struct Parameter {
    pub(crate) candidates: Arc<[ObjectId]>,
}

/// A variable that a quantifier binds, numbered after the parameters, and the objects that it ranges over, ascending.
#[derive(Debug, Clone)]
pub struct Bound {
    pub(crate) variable: u32,
    pub(crate) candidates: Arc<[ObjectId]>,
}

/// A schema parameter or bound variable, or an object.
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
    /// The condition that always holds.
    pub const fn truth() -> Self {
        Self::And(Vec::new())
    }

    /// The negation, in negation normal form again.
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

/// An effect: for all objects that the bound variables range over, the change if the condition holds.
#[derive(Debug, Clone)]
pub struct Effect {
    pub bound: Vec<Bound>,
    pub condition: Formula,
    pub change: Change,
}

/// What an effect changes.
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

/// What a plan is measured by.
#[derive(Debug, Clone)]
pub struct Metric {
    pub direction: Direction,
    pub expression: Expression,
    pub place: Place,
}
