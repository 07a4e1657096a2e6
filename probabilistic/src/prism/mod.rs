//! The PRISM language: text to a model, a model to successors of states, and back to text.
//!
//! The fragment of Markov chains and decision processes of the manual (prismmodelchecker.org/manual/ThePRISMLanguage):
//! modules with variables of finite range, renamed modules, synchronisation on actions, constants, formulas, rewards,
//! labels. Anything else is refused with its place.

pub mod ast;
mod build;
mod code;
mod compile;
pub(crate) mod expression;
mod guard;
pub(crate) mod lexer;
mod model;
mod parser;
mod rename;
mod run;
mod state;
mod write;

pub(crate) use code::Code;
pub(crate) use compile::Names;
pub use compile::Settings;
pub use model::Program;
pub use parser::parse;
pub use state::{Packed, Valuation};
pub(crate) use write::decimal;
pub use write::{identifier, write};

/// The words that PRISM keeps for itself, and those that Storm does besides.
const RESERVED: [&str; 50] = [
    "A",
    "bool",
    "clock",
    "const",
    "csg",
    "ctmc",
    "C",
    "double",
    "dtmc",
    "E",
    "endinit",
    "endinvariant",
    "endmodule",
    "endobservables",
    "endrewards",
    "endsystem",
    "false",
    "formula",
    "filter",
    "func",
    "F",
    "global",
    "G",
    "init",
    "invariant",
    "I",
    "int",
    "label",
    "max",
    "mdp",
    "min",
    "module",
    "X",
    "nondeterministic",
    "observable",
    "observables",
    "of",
    "Pmax",
    "Pmin",
    "P",
    "pomdp",
    "popta",
    "probabilistic",
    "prob",
    "pta",
    "rate",
    "rewards",
    "Rmax",
    "Rmin",
    "true",
];

/// More of them.
const RESERVED_TOO: [&str; 16] = [
    "R",
    "S",
    "stochastic",
    "system",
    "U",
    "W",
    "smg",
    "floor",
    "ceil",
    "round",
    "pow",
    "mod",
    "log",
    "ma",
    "player",
    "endplayer",
];

/// Whether a word cannot be a name.
pub fn is_reserved(word: &str) -> bool {
    RESERVED.contains(&word) || RESERVED_TOO.contains(&word)
}
