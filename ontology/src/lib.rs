//! Reads OWL 2 knowledge bases of a robot and lowers them to rules and facts.
//!
//! [`read_files`] reads RDF/XML, Turtle, N-Triples, OWL/XML and functional-style documents with their imports into an
//! [`Ontology`]. [`lower`](lower()) translates it to a `rules::Program` and facts. [`tomasys`] is the typed view of
//! the conclusions of an engine. [`runtime`] updates an engine with the reports of a robot. [`kb`] contains the
//! embedded knowledge bases.
//!
//! Absent: PDDL, plans, clocks and network access.

pub mod vocab;

mod owl;

mod codes;
mod contents;
mod error;
mod functional;
mod graph;
mod horned;
mod lower;
mod names;
mod normalize;
mod ntriples;
mod read;
mod revise;
mod triples;
mod write;

pub mod entail;
pub mod kb;
pub mod runtime;
pub mod tomasys;

pub use codes::CODES;
pub use error::{Error, Errors, Position, Warning};
pub use lower::{AXIOM_SOURCE, Equality, INTERNAL, Lowered, lower, lower_together, lower_with};
pub use ntriples::ntriples;
pub use owl::*;
pub use read::{ReadOptions, Syntax, read_files, read_text};
pub use revise::{Change, Stated};
pub use write::{OutputSyntax, convert_files, turtle};
pub use {num_rational::BigRational, rules};

/// Compiles and runs the example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
