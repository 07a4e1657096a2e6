//! Studies: one command again and again, with every combination of what is varied; in shards, on any number of machines.
//!
//! A [`Study`] is the product of its variations. Its runs are numbered, and a [`Shard`] is every N-th of them. Each run is a process of
//! its own, so that one that fails takes nothing with it, and leaves one line in the shard's file. A line is whole or it is not there: who
//! goes on after a kill does again what has none. [`Table`] puts the lines of all shards together.

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
