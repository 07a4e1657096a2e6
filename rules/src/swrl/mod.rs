//! Parser and printer of rule text: the human-readable syntax of SWRL in the form of Protégé ([1], section
//! 2.2).
//!
//! ```text
//! @prefix t: <http://metacontrol.org/tomasys#> .
//! # A comment.
//! [S2] t:Binding(?b) ^ t:binding_component(?b, ?c) ^ t:c_status(?c, "FALSE") -> t:b_status(?b, false) .
//! [idle] t:Objective(?o) ^ not t:o_status(?o, "IN_ERROR_NFR") -> t:idle(?o, true) .
//! ```
//!
//! `^`, `∧` and `,` separate atoms. `->` or `→` separates body and head. The full stop is required after an
//! empty head, except at the end of the text; otherwise it is optional. `sameAs`, `differentFrom` and the
//! built-ins of `swrlb:` have their SWRL meaning. `[…]` is the label of a rule. Negation as failure (`not`)
//! and aggregates (`?n = count { … }`) are extensions of SWRL.
//!
//! [1] W3C Member Submission: SWRL, 2004.

mod foreign;
mod lexer;
mod parser;
mod prefixes;
mod printer;

pub use parser::{Syntax, parse_rules, parse_rules_as, parse_rules_together};
pub use prefixes::Prefixes;
pub use printer::print_rules;
