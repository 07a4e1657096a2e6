//! Tests of the adaptation loop as a library: the paper's experiments event by event, the journal under
//! crashes, and random events.

mod common;
mod configure;
mod damage;
mod designs;
mod experiments;
mod failures;
mod faults;
mod fleet;
mod fuzz;
mod journal;
mod keeper;
mod kill;
mod noise;
mod numbers;
mod reaction;
mod receipts;
mod runaway;
mod soak;
mod worlds;
