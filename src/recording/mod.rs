//! A run as an MCAP file \[1\], and the lines of events out of one: what Foxglove, `PlotJuggler` and `ros2 bag` read, too.
//!
//! | topic | schema | has |
//! |---|---|---|
//! | `/diagnostics` | `diagnostic_msgs/msg/DiagnosticArray`, in CDR | what was measured, and how components are, in the words of MROS's monitors |
//! | `/metaplan/events` | `metaplan.Event` | each line that the loop has heard, as it was, with its number and time |
//! | `/metaplan/inferences`, `/metaplan/plans`, `/metaplan/effects`, `/metaplan/loop` | `metaplan.Answer` | its answers as they were written, each on the topic of its kind |
//!
//! Times are those of the system's clock when the file was begun, and go on from there without ever going back. A chunk is
//! written to the file as one piece and at most [`INTERVAL`] after its first message, so that a program that is killed leaves a file of
//! whole chunks, and perhaps a part of one: all readers of MCAP get at what was written before.
//!
//! - \[1\] Foxglove: MCAP file format specification, <https://mcap.dev/spec>.

mod messages;
mod recorder;
mod replay;
mod schema;
mod unpack;
mod write;

pub use recorder::{INTERVAL, Recorder};
pub use replay::{Replay, Replayed};
pub use schema::answer_schema;
pub use write::{Form, Recording};

/// With this byte an MCAP file begins, and no line of text.
pub const FIRST_BYTE: u8 = mcap::MAGIC[0];
