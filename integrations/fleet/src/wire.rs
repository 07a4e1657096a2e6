//! What is written into streams and buckets, and how subjects are spelled.

use std::fmt;

use metaplan::mapek::Decision;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The version of what is written.
pub const FORMAT: &str = "metaplan-fleet/1";

/// The longest name of a robot, in bytes.
const LONGEST_NAME: usize = 64;

/// A robot's name is one token of a subject: letters, digits, `-` and `_`, at most 64 of them.
pub fn is_name(name: &str) -> bool {
    !name.is_empty()
        && name.len() <= LONGEST_NAME
        && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_'))
}

/// The partition that a robot belongs to: the CRC-32 (ISO-HDLC, as zlib has it) of its name modulo their number.
///
/// ```
/// assert_eq!(metaplan_fleet::wire::partition_of("ugv-1", 64), 47);
/// ```
pub fn partition_of(robot: &str, partitions: u32) -> u32 {
    crc32fast::hash(robot.as_bytes()) % partitions.max(1)
}

/// A partition and a robot, as the end of a subject.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Address {
    /// From 0.
    pub partition: u32,
    /// The robot's name.
    pub robot: String,
}

impl Address {
    /// Where a robot is.
    pub fn of(robot: &str, partitions: u32) -> Self {
        Self { partition: partition_of(robot, partitions), robot: robot.to_owned() }
    }

    /// Reads `PARTITION.ROBOT`.
    pub fn parse(text: &str) -> Option<Self> {
        let (partition, robot) = text.split_once('.')?;
        let address = Self { partition: partition.parse().ok()?, robot: robot.to_owned() };
        (is_name(robot) && address.to_string() == text).then_some(address)
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.partition, self.robot)
    }
}

/// What one event has led to, as it is appended to the robot's decisions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Decided {
    /// [`FORMAT`].
    pub format: String,
    /// The sequence of the event in the stream of events.
    pub event: u64,
    /// The time since the robot was enrolled, in microseconds.
    pub now: u64,
    /// The mission that the robot has from now on, if this event has enrolled it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub enrolled: Option<String>,
    /// Whether this event has retired the robot.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub retired: bool,
    /// The answers, as `metaplan run` gives them.
    pub answers: Vec<Value>,
    /// The plans that were made, for whoever takes over.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub plans: Vec<Value>,
    /// Who has decided, and in which term of its lease.
    pub worker: String,
    /// Grows with every change of the lease.
    pub epoch: u64,
}

impl Decided {
    /// Answers and plans, as the loop has them.
    pub fn decision(&self) -> Decision {
        Decision { answers: self.answers.clone(), plans: self.plans.clone() }
    }

    /// Reads a message of the stream of decisions.
    pub fn parse(payload: &[u8]) -> Option<Self> {
        serde_json::from_slice(payload).ok().filter(|decided: &Self| decided.format == FORMAT)
    }
}

/// How far a partition has come: what a new owner begins with. Its revision in the bucket fences former owners.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Progress {
    /// Grows with every change of the lease.
    pub epoch: u64,
    /// All events up to this sequence are contained in snapshots.
    pub events: u64,
    /// All decisions up to this sequence are contained in snapshots.
    pub decisions: u64,
    /// The revision of the last snapshot; who reads snapshots reads at least up to it.
    pub snapshots: u64,
}

/// A robot as it was after an event.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Saved {
    /// Its mission; none where it was retired.
    pub mission: Option<String>,
    /// The checksum of the mission's files and settings.
    #[serde(default)]
    pub digest: String,
    /// When it was enrolled, in microseconds since 1970.
    pub enrolled: u64,
    /// The last event that it contains.
    pub event: u64,
    /// The last decision that it contains.
    pub decision: u64,
    /// All that its loop knows.
    #[serde(default)]
    pub known: Value,
}

/// What a worker says of itself.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Presence {
    /// Partitions that it has.
    pub partitions: u32,
    /// Robots in them.
    pub robots: u64,
    /// Robots that are kept ready, not only as snapshots.
    pub warm: u64,
    /// Events that it has read and not decided.
    pub waiting: u64,
    /// Events decided since it began.
    pub decided: u64,
    /// Events refused since it began.
    pub refused: u64,
    /// The share of its threads' time that loops have taken in the last seconds, from 0 to 1.
    pub load: f64,
    /// Whether it takes no more partitions.
    pub draining: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_spelled_one_way() {
        assert_eq!(Address::parse("3.ugv-1"), Some(Address { partition: 3, robot: "ugv-1".to_owned() }));
        for wrong in ["", "3", "3.", "03.x", "+3.x", "3.x.y", "x.3", "3.a b", "3.a*", "3.>", "-1.x", "3.ö"] {
            assert_eq!(Address::parse(wrong), None, "{wrong}");
        }
        assert!(!is_name(&"x".repeat(65)));
    }

    #[test]
    fn what_is_written_is_read() {
        let decided = Decided {
            format: FORMAT.to_owned(),
            event: 7,
            now: 12,
            enrolled: Some("ugv".to_owned()),
            retired: false,
            answers: vec![serde_json::json!({"answer": "plan_kept"})],
            plans: Vec::new(),
            worker: "w".to_owned(),
            epoch: 3,
        };
        let text = serde_json::to_vec(&decided).expect("plain data");
        assert_eq!(Decided::parse(&text), Some(decided));
        assert_eq!(Decided::parse(b"{\"format\": \"metaplan-fleet/0\"}"), None);
        assert_eq!(Decided::parse(b"\xff"), None);
    }
}
