//! Recording of runs as MCAP files \[1\], which Foxglove, `PlotJuggler` and `ros2 bag` also read, and extraction of
//! events from MCAP files.
//!
//! A recording has these topics:
//!
//! - `/diagnostics`, schema `diagnostic_msgs/msg/DiagnosticArray` in CDR: measurements and states of components, in the
//!   form of MROS's monitors.
//! - `/metaplan/events`, schema `metaplan.Event`: each input line, unchanged, with its number and time.
//! - `/metaplan/inferences`, `/metaplan/plans`, `/metaplan/effects` and `/metaplan/loop`, schema `metaplan.Answer`: the
//!   written answers, each on the topic of its kind.
//!
//! With [`Form::Text`], the schema of all `/metaplan` topics is `std_msgs/msg/String` instead. Times start from the
//! system's clock at the creation of the file, and never decrease. A chunk is written to the file as a whole, at most
//! [`INTERVAL`] after its first message. So if the program is killed, the file consists of complete chunks and perhaps
//! an incomplete one. Readers that do not need an index can read the complete chunks.
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

/// First byte of every MCAP file. No UTF-8 text begins with it.
pub const FIRST_BYTE: u8 = mcap::MAGIC[0];
