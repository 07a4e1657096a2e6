//! The whole, end to end: the program run as its users run it.

mod cli;
mod common;
mod real;
mod reference;
mod reason;
mod ugv;
mod uuv;
