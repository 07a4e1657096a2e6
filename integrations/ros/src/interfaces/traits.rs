//! Compile-time description of an interface: its name, its parts and its type hash.
//!
//! A type hash (RIHS01, [1]) is the identification of a type that ROS 2 since Iron puts into an endpoint's
//! user data; Humble has none.
//!
//! [1] REP-2011, Evolving Message Types; REP-2016, ROS 2 Interface Type Descriptions.

use ros2_client::Message;

/// A serialised unit: a message, or a part of a service or an action.
pub trait Structure: Message + Clone + Default + Send + Sync + 'static {
    /// Name of the type, as in `std_srvs/srv/Trigger_Response`.
    const TYPE: &'static str;
    /// Type hash, as in `RIHS01_f49f…`.
    const RIHS01: &'static str;
}

/// A message of a topic.
pub trait Msg: Structure {
    /// Package, as in `std_msgs`.
    const PACKAGE: &'static str;
    /// Name, as in `String`.
    const NAME: &'static str;
}

/// A service.
pub trait Service {
    /// Request of the client.
    type Request: Structure;
    /// Reply of the server.
    type Response: Structure;
    /// Package, as in `std_srvs`.
    const PACKAGE: &'static str;
    /// Name, as in `Trigger`.
    const NAME: &'static str;
}

/// Type hashes of the two topics of a service. ROS 2 announces on each topic the hash of the message on that
/// topic (`rmw_create_service` and `rmw_create_client` of `rmw_fastrtps_cpp` and `rmw_cyclonedds_cpp`), not
/// the hash of the service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ServiceHashes {
    /// Hash of the request message.
    pub request: &'static str,
    /// Hash of the response message.
    pub response: &'static str,
}

impl ServiceHashes {
    /// Type hashes of the topics of a service.
    pub const fn of<S: Service>() -> Self {
        Self { request: S::Request::RIHS01, response: S::Response::RIHS01 }
    }
}

/// An action.
pub trait Action {
    /// Goal of the client.
    type Goal: Structure;
    /// Result of the action.
    type Result: Structure;
    /// Intermediate feedback.
    type Feedback: Structure;
    /// Package, as in `nav2_msgs`.
    const PACKAGE: &'static str;
    /// Name, as in `NavigateToPose`.
    const NAME: &'static str;
    /// Type hashes of the service `send_goal`.
    const SEND_GOAL_RIHS01: ServiceHashes;
    /// Type hashes of the service `get_result`.
    const GET_RESULT_RIHS01: ServiceHashes;
    /// Type hash of the topic `feedback`.
    const FEEDBACK_RIHS01: &'static str;
}
