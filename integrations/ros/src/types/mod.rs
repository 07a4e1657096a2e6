//! ROS types that are known at run time only, by their definitions: for services, actions and topics that the
//! settings name.
//!
//! A [`Library`] resolves definitions to a [`Structure`], which encodes values to CDR and reads single fields
//! of received data. [`Raw`] passes the encoded data through the client library.

mod call;
pub(crate) mod definition;
pub(crate) mod description;
mod encode;
mod field;
mod find;
mod library;
mod raw;
mod structure;

pub(crate) use call::{Answer, ServiceCall, TopicMessage};
pub(crate) use field::FieldPath;
pub(crate) use library::{ActionType, Definition, Library, MessageType, ServiceType};
pub(crate) use raw::{AnyAction, AnyService, Raw};
pub(crate) use structure::Expectation;
