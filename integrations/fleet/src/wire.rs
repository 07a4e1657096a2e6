//! Data formats of the messages and of the stored values, and the syntax of subjects.

use std::fmt;

use metaplan::mapek::Decision;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::ids::Ids;

/// Version of the data format, which every decision contains.
pub const FORMAT: &str = "metaplan-fleet/1";

const LONGEST_NAME: usize = 64;

/// Returns `true` if a text is a valid name of a robot: 1 to 64 letters, digits, `-` and `_`, so
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

/// Decision about an event, as stored in the stream of decisions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Decided {
    /// Data format of the message, equal to [`FORMAT`].
    pub format: String,
    /// Sequence number of the event in the stream of events.
    pub event: u64,
    /// Time between enrolment and event in microseconds.
    pub now: u64,
    /// Name of the mission, if this event has enrolled the robot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub enrolled: Option<String>,
    /// `true` if this event has retired the robot.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub retired: bool,
    /// `true` if with this event the robot has changed to another version of its mission.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub migrated: bool,
    /// Checksum of a version of the mission: the version with which this event has enrolled the robot, or the one to
    /// which the robot has changed, or could not change, after this event.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub digest: Option<String>,
    /// Checksum of the version of the mission to which the robot changes at the next safe point, if this
    /// event has requested that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// `true` if earlier events of the robot that have no decision are refused, because the robot was
    /// suspended when this event retired it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub skips: bool,
    /// Ids of decided events, if this event has retired the robot. Nothing else is stored about a
    /// retired robot.
    #[serde(default, skip_serializing_if = "Ids::is_empty")]
    pub ids: Ids,
    /// Answers in the format of `metaplan run`.
    pub answers: Vec<Value>,
    /// Plans that were made for the decision, so that another worker can replay the decision
    /// without planning.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub plans: Vec<Value>,
    /// Name of the worker that has decided.
    pub worker: String,
    /// The partition's [`Progress::epoch`] at the time of the decision.
    pub epoch: u64,
}

impl Decided {
    /// Returns the answers and plans as a decision of the loop.
    pub fn decision(&self) -> Decision {
        Decision { answers: self.answers.clone(), plans: self.plans.clone() }
    }

    /// Parses a message of the stream of decisions. Returns `None` for other data or another
    /// version.
    pub fn parse(payload: &[u8]) -> Option<Self> {
        serde_json::from_slice(payload).ok().filter(|decided: &Self| decided.format == FORMAT)
    }
}

/// Stored position of a partition, from which a new owner recovers. Each write requires the
/// revision of the previous write, which rejects writes of former owners.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Progress {
    /// Number of times that a worker has taken over the partition, or has recovered it again.
    pub epoch: u64,
    /// Sequence number up to which the effects of all events are contained in snapshots, except for
    /// robots with [`Saved::behind`].
    pub events: u64,
    /// Sequence number up to which all decisions are contained in snapshots, except for robots with
    /// [`Saved::behind`].
    pub decisions: u64,
    /// Revision of the last snapshot. A reader of snapshots has to wait for this revision, because
    /// it may read from a server that lags behind.
    pub snapshots: u64,
}

/// Snapshot of a robot after an event.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Saved {
    /// Name of the robot's mission; `None` if the robot is not enrolled.
    pub mission: Option<String>,
    /// Checksum of the mission's files and settings.
    #[serde(default)]
    pub digest: String,
    /// Time of enrolment in microseconds since 1970.
    pub enrolled: u64,
    /// Sequence number of the last event whose effect the snapshot contains.
    pub event: u64,
    /// Sequence number of the last decision that the snapshot contains.
    pub decision: u64,
    /// Snapshot of the robot's loop.
    #[serde(default)]
    pub known: Value,
    /// Requested change to another version of the mission.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub migration: Option<Migration>,
    /// Ids of decided events.
    #[serde(default, skip_serializing_if = "Ids::is_empty")]
    pub ids: Ids,
    /// `true` if the progress of the partition does not wait for this robot. A new owner has to read
    /// the later events and decisions of the robot separately.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub behind: bool,
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
    /// The first event after the robot has reached its goal.
    Goal,
}

/// Status that a worker publishes about itself.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Presence {
    /// Number of partitions that the worker owns.
    pub partitions: u32,
    /// Number of robots in these partitions.
    pub robots: u64,
    /// Number of robots whose loops are loaded in memory.
    pub warm: u64,
    /// Number of events that are read but not decided.
    pub waiting: u64,
    /// Number of events that were decided or replayed since the worker's start.
    pub decided: u64,
    /// Number of refused events, stopped robots and unreadable stored messages since the worker's
    /// start.
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
        let decided = Decided {
            format: FORMAT.to_owned(),
            event: 7,
            now: 12,
            enrolled: Some("ugv".to_owned()),
            retired: false,
            migrated: false,
            digest: Some("0a1b".to_owned()),
            target: None,
            skips: false,
            ids: Ids::default(),
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
