//! Converts errors to the Python exception `metaplan.Error`, which contains all messages.

use metaplan::answers::ErrorAnswer;
use metaplan::message::Message;
use pyo3::prelude::*;

/// Creates the Python exception for messages, from the JSON that the command line prints for them.
pub(crate) fn raise(py: Python<'_>, messages: &[Message]) -> PyErr {
    let json = serde_json::to_string(&ErrorAnswer::new(messages)).unwrap_or_default();
    let exception = py
        .import("metaplan._errors")
        .and_then(|module| module.getattr("Error"))
        .and_then(|class| class.call_method1("_of", (json,)));
    match exception {
        Ok(error) => PyErr::from_value(error),
        Err(error) => error,
    }
}

pub(crate) fn raise_one(py: Python<'_>, message: Message) -> PyErr {
    raise(py, &[message])
}

/// Serialises messages as JSON, in the format of error answers.
pub(crate) fn listed<'m>(messages: impl IntoIterator<Item = &'m Message>) -> String {
    let messages: Vec<Message> = messages.into_iter().cloned().collect();
    serde_json::to_string(&ErrorAnswer::new(&messages)).unwrap_or_default()
}
