//! RDF literals: maps lexical forms to values of the XSD value spaces ([1], [2]).
//!
//! Equality is *identity* of values: `"1.50"^^xsd:decimal`, `"1.5"^^xsd:decimal` and, for integral values,
//! all integer types coincide. `"0"^^xsd:boolean` is `false`. A plain literal is an `xsd:string`. The value
//! spaces of `xsd:float` and `xsd:double` are disjoint from that of `xsd:decimal`. Comparisons nevertheless
//! promote like `XPath`: decimal to float, decimal or float to double. Values can be equal in this order
//! without being identical ([3], sections 4.2 and 4.7). Examples are the two zeros of a floating-point type,
//! and one instant in two time zones.
//!
//! For an unsupported datatype, only equal forms are known to denote the same value. It is undecided whether
//! two different forms denote one value, and whether a value lies in another datatype ([`Literal::differs`],
//! [`Literal::membership`]).
//!
//! [1] W3C XML Schema Definition Language 1.1 Part 2: Datatypes, 2012.
//! [2] W3C RDF 1.1 Concepts, section 5.
//! [3] W3C OWL 2 Structural Specification (Second Edition), 2012.

mod binary;
mod datatype;
mod decimal;
mod lexical;
mod membership;
mod subsumption;
mod temporal;
mod text;
mod value;

pub(crate) use datatype::{XSD, is_datatype};
pub use decimal::Decimal;
pub(crate) use decimal::ten_to;
pub use subsumption::is_subsumed;
pub use temporal::{Duration, Moment, MomentKind};
pub use value::Literal;
