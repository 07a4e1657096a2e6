//! Encoded data in place of a typed message. The client library needs a message type at compile time; [`Raw`] represents
//! messages whose types are known only at run time.

use std::fmt;

use serde::de::{Deserialize, Deserializer, SeqAccess, Visitor};
use serde::ser::{Serialize, SerializeTuple as _, Serializer};

use crate::interfaces;

/// Encoded data with their padding. They must be written at a multiple of eight bytes, so that the padding remains
/// correct.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Raw(pub(crate) Vec<u8>);

impl Serialize for Raw {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        self.0.iter().try_for_each(|byte| tuple.serialize_element(byte))?;
        tuple.end()
    }
}

impl<'de> Deserialize<'de> for Raw {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_tuple(usize::MAX, Remaining)
    }
}

struct Remaining;

impl<'de> Visitor<'de> for Remaining {
    type Value = Raw;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("data")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Raw, A::Error> {
        let mut bytes = Vec::new();
        // The tuple is longer than all data, so the end of the data is reported as an error.
        while let Ok(Some(byte)) = sequence.next_element() {
            bytes.push(byte);
        }
        Ok(Raw(bytes))
    }
}

impl ros2_client::Message for Raw {}

/// Type and hash are empty, because they differ between the uses of encoded data.
impl interfaces::Structure for Raw {
    const TYPE: &'static str = "";
    const RIHS01: &'static str = "";
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct AnyService;

impl interfaces::Service for AnyService {
    type Request = Raw;
    type Response = Raw;
    const PACKAGE: &'static str = "";
    const NAME: &'static str = "";
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct AnyAction;

const NO_HASHES: interfaces::ServiceHashes = interfaces::ServiceHashes { request: "", response: "" };

impl interfaces::Action for AnyAction {
    type Goal = Raw;
    type Result = Raw;
    type Feedback = Raw;
    const PACKAGE: &'static str = "";
    const NAME: &'static str = "";
    const SEND_GOAL_RIHS01: interfaces::ServiceHashes = NO_HASHES;
    const GET_RESULT_RIHS01: interfaces::ServiceHashes = NO_HASHES;
    const FEEDBACK_RIHS01: &'static str = "";
}
