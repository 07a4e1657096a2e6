//! PDDL text to syntax tree and back.
//!
//! Everything that real files contain is read, with a warning where they leave the standard; whatever is
//! wrong is reported at its place, all of it at once. No grounding, no solver and no file system here.

pub mod ast;
pub mod diagnostic;
mod names;
mod number;
pub mod parse;
mod sexp;
pub mod source;

pub use diagnostic::{Diagnostic, Severity, has_errors, render};
pub use parse::{parse_domain, parse_problem};
pub use source::{Position, Source};
