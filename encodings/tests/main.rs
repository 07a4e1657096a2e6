//! SAT encodings and solvers against oracles.

mod formulas;
mod solvers;
