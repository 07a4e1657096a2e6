//! Data formats of the messages and of the stored values, and the syntax of subjects.

use std::fmt;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::ids::Ids;

/// Version of the data format, which every decision contains.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Format {
    /// The only version.
    #[default]
    #[serde(rename = "metaplan-fleet/2")]
    V2,
}

const LONGEST_NAME: usize = 64;

/// Returns `true` if a text is a valid name of a robot, a worker or a fleet: 1 to 64 letters, digits, `-` and `_`, so
/// that the name can be part of a subject.
pub fn is_name(name: &str) -> bool {
    !name.is_empty()
        && name.len() <= LONGEST_NAME
        && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_'))
}

/// Returns the partition of a robot: the CRC-32 (ISO-HDLC, as in zlib) of its name modulo the
/// number of partitions.
///
/// ```
/// assert_eq!(metaplan_fleet::wire::partition_of("ugv-1", 64), 47);
/// ```
pub fn partition_of(robot: &str, partitions: u32) -> u32 {
    crc32fast::hash(robot.as_bytes()) % partitions.max(1)
}

/// Partition and name of a robot. As text, `PARTITION.ROBOT`, it is the end of a subject.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Address {
    /// Partition number, from 0.
    pub partition: u32,
    /// Name of the robot.
    pub robot: String,
}

impl Address {
    /// Returns the address of a robot in a fleet with this number of partitions.
    pub fn of(robot: &str, partitions: u32) -> Self {
        Self { partition: partition_of(robot, partitions), robot: robot.to_owned() }
    }

    /// Parses `PARTITION.ROBOT`. Returns `None` for any other text, including other spellings of a
    /// number.
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

/// Decision about an event and the state of the robot after it, as stored in the stream of decisions. The last
/// decision about a robot is all that a worker needs to continue.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[expect(clippy::struct_excessive_bools, reason = "they are independent fields of a message")]
pub struct Decided {
    /// Data format of the message.
    pub format: Format,
    /// Sequence number of the event in the stream of events.
    pub event: u64,
    /// Time between enrolment and event in microseconds.
    pub now: u64,
    /// Answers in the format of `metaplan run`.
    pub answers: Vec<Value>,
    /// Name of the mission, if this event has enrolled the robot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub enrolled: Option<String>,
    /// `true` if with this event the robot has changed to another version of its mission.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub migrated: bool,
    /// `true` if this event has retired the robot.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub retired: bool,
    /// `true` if the decision contains only the reaction to the event, because the search for a plan takes longer,
    /// or if it is about a migration while an earlier plan is missing. The plan follows in a decision with `planned`, or
    /// in the decision about a later event.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub planning: bool,
    /// `true` if the decision completes earlier decisions, the last of which was about this event.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub planned: bool,
    /// `true` if the plan was found for an earlier planning problem, but also fits the current one. This happens only
    /// after several searches that were cancelled.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub late: bool,
    /// Name of the worker that has decided.
    pub worker: String,
    /// State of the robot after the event: JSON, compressed with LZ4, as base64.
    #[serde(with = "packed")]
    pub state: State,
}

impl Decided {
    /// Parses a message of the stream of decisions. Returns `None` for other data or another
    /// version.
    pub fn parse(payload: &[u8]) -> Option<Self> {
        serde_json::from_slice(payload).ok()
    }
}

/// State of a robot after a decision.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Name of the robot's mission; `None` if the robot is not enrolled.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mission: Option<String>,
    /// Checksum of the version of the mission.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub digest: String,
    /// Time of enrolment in microseconds since 1970.
    #[serde(default)]
    pub enrolled: u64,
    /// Requested change to another version of the mission.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub migration: Option<Migration>,
    /// Ids of decided events. Nothing else is stored about a retired robot.
    #[serde(default, skip_serializing_if = "Ids::is_empty")]
    pub ids: Ids,
    /// Snapshot of the robot's loop, as the difference from the initial snapshot of the mission.
    #[serde(default, skip_serializing_if = "Value::is_null")]
    pub snapshot: Value,
}

mod packed {
    use base64::{Engine as _, engine::general_purpose::STANDARD};
    use serde::{Deserialize as _, Deserializer, Serializer, de::Error as _, ser::Error as _};

    use super::State;

    pub(super) fn serialize<S: Serializer>(state: &State, to: S) -> Result<S::Ok, S::Error> {
        let text = serde_json::to_vec(state).map_err(S::Error::custom)?;
        to.serialize_str(&STANDARD.encode(lz4_flex::compress_prepend_size(&text)))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<State, D::Error> {
        let bytes = STANDARD.decode(String::deserialize(from)?).map_err(D::Error::custom)?;
        let text = lz4_flex::decompress_size_prepended(&bytes).map_err(D::Error::custom)?;
        serde_json::from_slice(&text).map_err(D::Error::custom)
    }
}

/// Requested change of a robot to another version of its mission.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Migration {
    /// Point at which the robot changes.
    pub at: SafePoint,
    /// Checksum of the version.
    pub target: String,
}

/// Point at which a robot can change to another version of its mission.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SafePoint {
    /// The end of the action under way, or at once between actions.
    #[default]
    ActionEnd,
    /// The first event after which the goal is reached and no action runs.
    Goal,
}

/// Status that a worker publishes about itself.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Presence {
    /// Number of partitions that the worker runs.
    pub partitions: u32,
    /// Number of robots in memory.
    pub robots: u64,
    /// Number of events that are read but neither decided nor refused, without those of suspended robots.
    pub waiting: u64,
    /// Number of events that were decided since the worker's start.
    pub decided: u64,
    /// Number of refused events and suspensions of robots since the worker's start.
    pub refused: u64,
    /// Proportion of the threads' time that loops used since the last status, from 0 to 1.
    pub load: f64,
    /// `true` if the worker is shutting down and takes no more partitions.
    pub draining: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_have_a_unique_spelling() {
        assert_eq!(Address::parse("3.ugv-1"), Some(Address { partition: 3, robot: "ugv-1".to_owned() }));
        for wrong in ["", "3", "3.", "03.x", "+3.x", "3.x.y", "x.3", "3.a b", "3.a*", "3.>", "-1.x", "3.ö"] {
            assert_eq!(Address::parse(wrong), None, "{wrong}");
        }
        assert!(!is_name(&"x".repeat(65)));
    }

    #[test]
    fn what_is_written_is_read() {
        let state = State { digest: "0a1b".to_owned(), ..State::default() };
        let answers = vec![serde_json::json!({"answer": "plan_kept"})];
        let enrolled = Some("ugv".to_owned());
        let decided =
            Decided { event: 7, now: 12, enrolled, planning: true, answers, state, ..Decided::default() };
        let text = serde_json::to_vec(&decided).expect("plain data");
        assert_eq!(Decided::parse(&text).as_ref(), Some(&decided));
        let outdated = String::from_utf8_lossy(&text).replace("metaplan-fleet/2", "metaplan-fleet/0");
        for wrong in [&text[..50], outdated.as_bytes(), b"\xff"] {
            assert_eq!(Decided::parse(wrong), None);
        }
    }
}
