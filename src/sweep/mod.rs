//! Parameter studies: one command is run with every combination of varied values. Runs are divided
//! into shards, which any number of machines can execute.
//!
//! A [`Study`] is the Cartesian product of its variations. Its runs are numbered, and a [`Shard`]
//! is every N-th of them. Each run is a separate process, so a run without an answer affects no
//! other run. The result of a run is one line in the shard's file. A resumed study repeats the runs
//! without a complete line. [`Table`] joins the lines of all shards.

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
