//! Tests of reading, reasoning and writing knowledge bases.

mod clauses;
mod common;
mod entail;
mod field;
mod golden;
mod hermit;
mod kb;
mod lower;
mod meaning;
mod model;
mod mutations;
mod read;
mod real;
mod real_tomasys;
mod revise;
mod robust;
mod runtime;
mod syntaxes;
mod trace;
mod w3c;
mod write;
