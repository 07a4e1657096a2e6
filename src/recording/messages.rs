//! ROS 2 messages in recordings: their definitions, and their encoding in CDR \[1\].
//!
//! - \[1\] OMG: DDS Interoperability Wire Protocol 2.5, 2022, section 10. The first two bytes of a message identify the
//!   representation.

use byteorder::{BigEndian, LittleEndian};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::mapek::{Event, Observation};

pub(super) const DIAGNOSTICS: &str = "diagnostic_msgs/msg/DiagnosticArray";

pub(super) const TEXT: &str = "std_msgs/msg/String";

pub(super) const TEXT_DEFINITION: &str = "string data\n";

pub(super) const DIAGNOSTICS_DEFINITION: &str = "\
std_msgs/Header header
DiagnosticStatus[] status
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: diagnostic_msgs/DiagnosticStatus
byte OK=0
byte WARN=1
byte ERROR=2
byte STALE=3
byte level
string name
string message
string hardware_id
KeyValue[] values
================================================================================
MSG: diagnostic_msgs/KeyValue
string key
string value
";

#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Text {
    pub(super) data: String,
}

#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Time {
    pub(super) sec: i32,
    pub(super) nanosec: u32,
}

#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Header {
    pub(super) stamp: Time,
    pub(super) frame_id: String,
}

#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct KeyValue {
    pub(super) key: String,
    pub(super) value: String,
}

#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct DiagnosticStatus {
    pub(super) level: u8,
    pub(super) name: String,
    pub(super) message: String,
    pub(super) hardware_id: String,
    pub(super) values: Vec<KeyValue>,
}

/// `diagnostic_msgs/msg/DiagnosticArray`. Serialised as JSON, it is an event line that the loop
/// accepts.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct DiagnosticArray {
    pub(super) header: Header,
    pub(super) status: Vec<DiagnosticStatus>,
}

const OK: u8 = 0;
const ERROR: u8 = 2;

impl DiagnosticArray {
    /// Converts the measurements and component states of an observation to a message as MROS's monitors send it.
    /// Returns `None` if the observation has neither. `time` is in nanoseconds of the system's clock.
    pub(super) fn of(observation: &Observation, time: u64) -> Option<Self> {
        let status: Vec<_> = observation.events.iter().flatten().filter_map(DiagnosticStatus::of).collect();
        let stamp = Time {
            sec: i32::try_from(time / 1_000_000_000).unwrap_or(i32::MAX),
            nanosec: (time % 1_000_000_000) as u32,
        };
        (!status.is_empty()).then(|| Self { header: Header { stamp, frame_id: String::new() }, status })
    }
}

impl DiagnosticStatus {
    fn of(event: &Event) -> Option<Self> {
        let fields = event.to_json();
        let (message, key, value) = match event {
            Event::Measured { attribute, .. } => ("QA status", attribute, fields["value"].to_string()),
            Event::Component { component, .. } => {
                ("Component status", component, fields["status"].as_str().unwrap_or_default().to_owned())
            }
            _ => return None,
        };
        let level = if value == "FALSE" { ERROR } else { OK };
        let values = vec![KeyValue { key: key.clone(), value }];
        Some(Self { level, message: message.to_owned(), values, ..Self::default() })
    }
}

/// Encodes a message in plain CDR, little-endian, with the encapsulation header.
pub(super) fn to_cdr(message: &impl Serialize) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    // Encoding cannot fail for numbers, texts and lists of them.
    bytes.extend(cdr_encoding::to_vec::<_, LittleEndian>(message).unwrap_or_default());
    bytes
}

/// Decodes a message from plain CDR with either byte order. Returns a description of the fault if
/// the bytes do not encode the type.
pub(super) fn from_cdr<M: DeserializeOwned>(bytes: &[u8]) -> Result<M, String> {
    let read = match bytes {
        [0, 0, _, _, content @ ..] => cdr_encoding::from_bytes::<M, BigEndian>(content),
        [0, 1, _, _, content @ ..] => cdr_encoding::from_bytes::<M, LittleEndian>(content),
        _ => return Err("it is not in plain CDR".to_owned()),
    };
    read.map(|(message, _)| message).map_err(|error| error.to_string())
}
