//! Tests of missions in PLANTA's form, planned from its input files. The oracle is the complete state space of the files that PLANTA's
//! converter writes for them.

mod brute;
mod examples;
mod files;
mod random;
mod situations;
