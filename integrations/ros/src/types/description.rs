//! Computes type descriptions and type hashes (RIHS01) of interfaces.
//!
//! A service has four types, an action thirteen. The types of an action's services and feedback
//! topic are derived here in the same way as by rosidl [1]. The hash of a type is the SHA-256 of
//! the JSON description of the type and of all types that it refers to [2].
//!
//! [1] REP-2011, Evolving Message Types. [2] REP-2016, ROS 2 Interface Type Descriptions.

use std::collections::BTreeMap;

use hiroz_schema::{
    FieldDescription, FieldTypeDescription, TypeDescription, TypeDescriptionMsg, TypeId, calculate_hash,
};

use super::definition::{Base, Count, Field, Interface, Primitive};

/// Type descriptions by the full name of the type.
pub type Descriptions = BTreeMap<String, TypeDescription>;

const TIME: &str = "builtin_interfaces/msg/Time";
const UUID: &str = "unique_identifier_msgs/msg/UUID";

/// Returns the type hash, `RIHS01_…`, of a type. Fails if the description of the type, or of a type
/// that it refers to, is missing.
pub fn hash(name: &str, all: &Descriptions) -> Result<String, String> {
    let mut referenced = Descriptions::new();
    collect(name, all, &mut referenced)?;
    let type_description = referenced.remove(name).ok_or("no description")?;
    let message = TypeDescriptionMsg {
        type_description,
        referenced_type_descriptions: referenced.into_values().collect(),
    };
    Ok(calculate_hash(&message).to_rihs_string())
}

/// Adds the description of a type and of all types that it refers to, directly or indirectly, to
/// `found`.
fn collect(name: &str, all: &Descriptions, found: &mut Descriptions) -> Result<(), String> {
    if found.contains_key(name) {
        return Ok(());
    }
    let description = all.get(name).ok_or_else(|| format!("there is no definition of {name}"))?;
    found.insert(name.to_owned(), description.clone());
    let nested = description.fields.iter().map(|field| &field.field_type.nested_type_name);
    nested.filter(|name| !name.is_empty()).try_for_each(|name| collect(name, all, found))
}

/// Adds the descriptions of an interface and of its derived types.
pub fn describe(interface: &Interface, all: &mut Descriptions) {
    let name = interface.full_name();
    for part in &interface.parts {
        add(all, format!("{name}{}", part.suffix), part.fields.iter().map(described).collect());
    }
    match interface.folder {
        "srv" => service(all, &name),
        "action" => action(all, &name),
        _ => {}
    }
}

fn described(field: &Field) -> FieldDescription {
    let kind = &field.kind;
    let (base, nested_type_name) = match &kind.base {
        Base::Primitive(primitive) => (type_id(*primitive, kind.string_bound.is_some()), String::new()),
        Base::Message(name) => (TypeId::NESTED_TYPE, name.clone()),
    };
    let (offset, capacity) = match kind.count {
        Count::One => (0, 0),
        Count::Fixed(size) => (TypeId::ARRAY_OFFSET, size),
        Count::Bounded(size) => (TypeId::BOUNDED_SEQUENCE_OFFSET, size),
        Count::Unbounded => (TypeId::UNBOUNDED_SEQUENCE_OFFSET, 0),
    };
    let field_type = FieldTypeDescription {
        type_id: base + offset,
        capacity: capacity.into(),
        string_capacity: kind.string_bound.unwrap_or(0).into(),
        nested_type_name,
    };
    described_as(&field.name, field_type)
}

fn type_id(primitive: Primitive, is_bounded: bool) -> u8 {
    match primitive {
        Primitive::Bool => TypeId::BOOL,
        Primitive::Byte => TypeId::BYTE,
        Primitive::Char | Primitive::Uint8 => TypeId::UINT8,
        Primitive::Int8 => TypeId::INT8,
        Primitive::Int16 => TypeId::INT16,
        Primitive::Uint16 => TypeId::UINT16,
        Primitive::Int32 => TypeId::INT32,
        Primitive::Uint32 => TypeId::UINT32,
        Primitive::Int64 => TypeId::INT64,
        Primitive::Uint64 => TypeId::UINT64,
        Primitive::Float32 => TypeId::FLOAT32,
        Primitive::Float64 => TypeId::FLOAT64,
        Primitive::String if is_bounded => TypeId::BOUNDED_STRING,
        Primitive::String => TypeId::STRING,
    }
}

fn described_as(name: &str, field_type: FieldTypeDescription) -> FieldDescription {
    FieldDescription { name: name.to_owned(), field_type, default_value: String::new() }
}

fn nested(name: &str, type_name: impl Into<String>) -> FieldDescription {
    described_as(name, FieldTypeDescription::nested(TypeId::NESTED_TYPE, type_name))
}

fn primitive(name: &str, type_id: u8) -> FieldDescription {
    described_as(name, FieldTypeDescription::primitive(type_id))
}

fn add(all: &mut Descriptions, type_name: String, fields: Vec<FieldDescription>) {
    all.insert(type_name.clone(), TypeDescription { type_name, fields });
}

/// Adds the event type of a service and the type of the whole service. The types of request and
/// response already exist.
fn service(all: &mut Descriptions, name: &str) {
    let part = |suffix: &str| format!("{name}_{suffix}");
    let at_most_one = |field: &str, suffix: &str| {
        let id = TypeId::NESTED_TYPE_BOUNDED_SEQUENCE;
        described_as(field, FieldTypeDescription::nested_array(id, 1, part(suffix)))
    };
    let event = vec![
        nested("info", "service_msgs/msg/ServiceEventInfo"),
        at_most_one("request", "Request"),
        at_most_one("response", "Response"),
    ];
    add(all, part("Event"), event);
    let whole = vec![
        nested("request_message", part("Request")),
        nested("response_message", part("Response")),
        nested("event_message", part("Event")),
    ];
    add(all, name.to_owned(), whole);
}

/// Adds the types of the services and of the feedback topic of an action, and the type of the whole
/// action. The types of goal, result and feedback already exist.
fn action(all: &mut Descriptions, name: &str) {
    let part = |suffix: &str| format!("{name}_{suffix}");
    let id = || nested("goal_id", UUID);
    add(all, part("SendGoal_Request"), vec![id(), nested("goal", part("Goal"))]);
    add(all, part("SendGoal_Response"), vec![primitive("accepted", TypeId::BOOL), nested("stamp", TIME)]);
    service(all, &part("SendGoal"));
    add(all, part("GetResult_Request"), vec![id()]);
    add(
        all,
        part("GetResult_Response"),
        vec![primitive("status", TypeId::INT8), nested("result", part("Result"))],
    );
    service(all, &part("GetResult"));
    add(all, part("FeedbackMessage"), vec![id(), nested("feedback", part("Feedback"))]);
    let whole = [
        ("goal", "Goal"),
        ("result", "Result"),
        ("feedback", "Feedback"),
        ("send_goal_service", "SendGoal"),
        ("get_result_service", "GetResult"),
        ("feedback_message", "FeedbackMessage"),
    ];
    add(all, name.to_owned(), whole.map(|(field, suffix)| nested(field, part(suffix))).into());
}
