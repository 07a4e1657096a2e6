//! The PRISM language: parses a text to a model, computes successors of states, and writes a model as text.
//!
//! Supported are Markov chains and Markov decision processes of the PRISM manual
//! (prismmodelchecker.org/manual/ThePRISMLanguage): modules with variables of finite range, renamed modules,
//! synchronisation on actions, global variables, constants, formulas, rewards, labels, and `init … endinit`. Any
//! other construct is an error with its position.

pub mod ast;
mod behaviour;
mod build;
mod code;
mod command;
mod compile;
pub(crate) mod expression;
mod guard;
pub(crate) mod lexer;
mod memo;
mod model;
mod parser;
mod remembered;
mod rename;
mod reserved;
mod run;
mod starts;
mod state;
mod write;

pub(crate) use code::Code;
pub use compile::Settings;
pub(crate) use compile::{MAX_DEPTH, MAX_LEVELS, Names};
pub use model::Program;
pub use parser::parse;
pub(crate) use parser::{constant_declaration, named_expression};
pub use remembered::Remembered;
pub use reserved::is_reserved;
pub use state::{Packed, Valuation};
pub(crate) use write::decimal;
pub use write::{identifier, write};
