//! The built-ins of SWRL (`swrlb`), by the value spaces of XSD and the functions of `XPath` ([1], section 8).
//!
//! Arguments of an unsuitable kind make a built-in false, never an error. A computed result is compared with a bound
//! first argument by value *identity* (interned value), so that the outcome does not depend on evaluation order.
//!
//! A built-in that makes a value of its parts (a date of year, month and day) works backwards, too: the parts of a known
//! value are those from which it would be made. What SWRL has a sequence for (`tokenize`) holds of each of its members.
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
