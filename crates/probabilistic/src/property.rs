//! Parses properties and property files in PRISM's syntax.
//!
//! Examples: `Pmax=? [ F "goal" ]`, `P>=0.9 [ !hit U "goal" ]`, `R{"time"}min=? [ F "goal" ]`,
//! `R{"time"}min=? [ C<=10 ]`, `multi(R{"time"}min=? [ F "goal" ], Pmax=? [ F "safe" ])`,
//! `filter(max, P=? [ F "goal" ], "start")`. Properties can also occur in numeric and Boolean
//! expressions: `1 - Pmax=? [ F "goal" ]`.

mod file;
mod grammar;

pub use crate::prism::ast::{Filter, Path, Property, Question, RewardPath, StepBound, Steps, Temporal};
pub use file::{Declarations, File, Listed, parse_file};
pub use grammar::parse;
