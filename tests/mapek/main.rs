//! Tests of the adaptation loop and of the configuration loop (without plans), mostly as a library: the paper's
//! experiments event by event, acknowledgements, faults and noise, the journals under crashes and damage, and
//! random events.

mod changes;
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
mod remainder;
mod runaway;
mod soak;
mod worlds;
