//! The whole, end to end: the program run as its users run it.

mod certificate;
mod certificate_numbers;
mod check;
mod cli;
mod client;
mod common;
mod concurrent;
mod doubts;
mod explain;
mod export;
mod journal;
mod limits;
mod manifest;
mod mutation;
mod names;
mod probabilistic;
mod real;
mod reason;
mod reference;
mod routes;
mod run;
mod simulate;
mod ugv;
mod uuv;
mod validate;
mod verifier;
