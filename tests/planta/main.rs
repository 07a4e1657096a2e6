//! Tests of missions in PLANTA's form, planned from the input files of PLANTA's converter or from random files. The
//! oracle is the complete state space of the converter's output files, or of the export.

mod brute;
mod examples;
mod explain;
mod files;
mod random;
mod situations;
