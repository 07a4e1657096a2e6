//! Signals of the robot that report components and measure attributes: the tables `[[signals]]` of `ros.toml`.
//!
//! | source | component | attribute |
//! |---|---|---|
//! | state of a lifecycle node | works in the stated state | |
//! | presence of a node | works while the node exists | |
//! | field of a message | works while the value meets a condition | the value, converted |
//! | rate of a topic | works while the rate meets a condition, by default while it is not 0 | messages per second |
//!
//! Each signal becomes a status of the loop, as if a monitor of MROS had published it.

mod settings;
mod watch;

pub(crate) use settings::Signal;
pub(crate) use watch::{Report, watch};
