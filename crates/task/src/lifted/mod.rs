//! The lifted task, and the detection of parameters that are function designs.

pub mod configuration;
mod task;

pub use crate::number::Rational;
pub use task::{
    Arguments, Axiom, Bound, Change, DurationChoice, Effect, Event, Expression, Formula, Function,
    FunctionId, Joint, Lifted, Metric, ObjectId, Parameter, Predicate, PredicateId, Schema, Term, Time,
};
