//! RDF literals as values: lexical forms in, members of the XSD value spaces out ([1], [2]).
//!
//! Equality is *identity* of values: `"1.50"^^xsd:decimal`, `"1.5"^^xsd:decimal` and, where integral, every integer
//! type coincide; `"0"^^xsd:boolean` is `false`; a plain literal is an `xsd:string`. `xsd:float` and `xsd:double`
//! are value spaces of their own (a float never *is* a decimal), but comparisons promote as `XPath` does: decimal to
//! float, decimal or float to double. Values can be equal in that order without being identical ([3], sections 4.2 and
//! 4.7): the two zeros of a floating-point type, one instant in two time zones.
//!
//! Of the values of a datatype that has no meaning here nothing is known but that equal forms are one value: whether two
//! forms are one value, or lie in another datatype, is undecided ([`Literal::differs`], [`Literal::membership`]).
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
