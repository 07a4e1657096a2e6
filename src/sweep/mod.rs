//! Parameter studies: one command with every combination of varied values, in shards, on any number
//! of machines.
//!
//! A [`Study`] is the product of its variations. Its runs are numbered, and a [`Shard`] is every
//! N-th of them. Each run is a separate process, so a failed run affects no other, and writes one
//! line to the shard's file. A resumed study repeats the runs without a complete line. [`Table`]
//! joins the lines of all shards.

mod answer;
mod process;
mod results;
mod study;
mod table;

pub use answer::SweepAnswer;
pub use process::perform;
pub use results::{Line, Results, read_lines};
pub use study::{Planned, Shard, Study, schema};
pub use table::{Cell, Group, Row, Table};
