//! The whole, end to end: the program run as its users run it.

mod certificate;
mod cli;
mod common;
mod export;
mod probabilistic;
mod real;
mod reason;
mod reference;
mod ugv;
mod uuv;
mod validate;
