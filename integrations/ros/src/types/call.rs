//! Service calls and topic messages in the settings, of types that are known only at run time.

use std::sync::Arc;

use serde_json::{Map, Value, json};

use super::{Expectation, Library, MessageType, ServiceType};

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ServiceCall {
    pub(crate) kind: Arc<ServiceType>,
    pub(crate) request: Vec<u8>,
    pub(crate) answer: Answer,
}

/// Answer of a service that counts as success.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Answer {
    Any,
    /// The field `success` of the answer must be true.
    Success,
    Expected(Expectation),
}

impl ServiceCall {
    pub(crate) fn new(kind: &str, request: Option<&Value>, expected: Option<&Value>) -> Result<Self, String> {
        let kind = Arc::new(Library::current().service(kind)?);
        let request = kind.request.encode(request.unwrap_or(&Value::Object(Map::new())));
        let request = request.map_err(|because| format!("`request`: {because}"))?;
        let answer = Answer::new(&kind, expected)?;
        Ok(Self { kind, request, answer })
    }

    pub(crate) fn check(&self, answer: &[u8]) -> Result<(), String> {
        self.answer.check(&self.kind, answer)
    }
}

impl Answer {
    /// Reads the expected answer of a service. `None` selects [`Answer::Success`] if the answer has
    /// a truth value `success`, otherwise [`Answer::Any`].
    pub(crate) fn new(kind: &ServiceType, expected: Option<&Value>) -> Result<Self, String> {
        Ok(match expected {
            Some(expected) => {
                let expectation = Expectation::new(&kind.response, expected);
                Self::Expected(expectation.map_err(|because| format!("`expect`: {because}"))?)
            }
            None if kind.response.has_truth_value("success") => Self::Success,
            None => Self::Any,
        })
    }

    pub(crate) fn check(&self, kind: &ServiceType, answer: &[u8]) -> Result<(), String> {
        let response = &kind.response;
        let message = || {
            let text = if response.has_text("message") { response.text("message", answer) } else { None };
            text.filter(|text| !text.is_empty())
        };
        match self {
            Self::Any => Ok(()),
            Self::Success => {
                let success = Expectation::new(response, &json!({"success": true}))?;
                success.check(response, answer, 0).map_err(|because| message().unwrap_or(because))
            }
            Self::Expected(expectation) => {
                expectation.check(response, answer, 0).map_err(|because| match message() {
                    Some(message) => format!("{because}; {message}"),
                    None => because,
                })
            }
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TopicMessage {
    pub(crate) topic: String,
    pub(crate) kind: Arc<MessageType>,
    pub(crate) message: Vec<u8>,
}

impl TopicMessage {
    /// Encodes a message of the settings. Fields that the settings do not give have their default
    /// values.
    pub(crate) fn new(topic: String, kind: &str, message: Option<&Value>) -> Result<Self, String> {
        let kind = Arc::new(Library::current().message(kind)?);
        let message = kind.structure.encode(message.unwrap_or(&Value::Object(Map::new())));
        Ok(Self { topic, kind, message: message.map_err(|because| format!("`message`: {because}"))? })
    }
}
