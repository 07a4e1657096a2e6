//! The lifted task, and which of its parameters are function designs.

pub(crate) mod configuration;
mod task;

pub(crate) use crate::number::Rational;
pub(crate) use task::{
    Arguments, Axiom, Bound, Change, Effect, Event, Expression, Formula, Function, FunctionId, Joint, Lifted,
    Metric, ObjectId, Parameter, Predicate, PredicateId, Schema, Term, Time,
};
