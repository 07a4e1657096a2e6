//! Parses properties in PRISM's syntax.
//!
//! `Pmax=? [ F "goal" ]`, `P>=0.9 [ !hit U "goal" ]`, `R{"time"}min=? [ F "goal" ]`, `R{"time"}min=? [ C<=10 ]`,
//! `multi(R{"time"}min=? [ F "goal" ], Pmax=? [ F "safe" ])`, `filter(max, P=? [ F "goal" ], "start")`, and numeric and
//! Boolean expressions over properties: `1 - Pmax=? [ F "goal" ]`.

mod file;
mod grammar;

pub use crate::prism::ast::{Filter, Path, Property, Question, RewardPath, StepBound, Steps, Temporal};
pub use file::{Declarations, File, Listed, parse_file};
pub use grammar::parse;
