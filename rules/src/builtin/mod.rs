//! Built-ins of SWRL (`swrlb`, section 8 of [1]; without those on lists) on the value spaces of XSD, with the
//! functions of `XPath` ([2]). URIs follow [3].
//!
//! Arguments of an unsuitable kind make every built-in but `notEqual` false, and never cause an error. A computed result
//! is compared with a bound first argument by *identity* of interned values, so that the outcome does not depend on the
//! evaluation order.
//!
//! A built-in that composes a value of parts (a date of year, month and day) also works backwards: it splits a known
//! value into its parts. A built-in with a sequence as result in SWRL (`tokenize`) holds for each member of the
//! sequence.
//!
//! [1] W3C Member Submission: SWRL, 2004.
//! [2] W3C `XQuery` 1.0 and `XPath` 2.0 Functions and Operators, 2007.
//! [3] RFC 3986: Uniform Resource Identifier, 2005.

mod custom;
mod evaluation;
mod library;
mod math;
mod parts;
mod pattern;
mod signature;
mod similar;
mod temporal;
mod text;
mod uri;

pub use custom::{CustomBuiltIn, Definition};
pub(crate) use signature::is_refused;
pub use signature::{BuiltIn, SWRLB};
