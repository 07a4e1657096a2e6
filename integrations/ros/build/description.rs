//! Computes type descriptions and type hashes (RIHS01) of interfaces.
//!
//! A service has four types, an action thirteen. The types of an action's services and feedback
//! topic are derived here in the same way as by rosidl [1]. The hash of a type is the SHA-256 of
//! the JSON description of the type and of all types that it refers to [2].
//!
//! The resolver of `hiroz_codegen` is not used, because it describes `CancelGoal` as a part of an
//! action and omits a field.
//!
//! [1] REP-2011, Evolving Message Types. [2] REP-2016, ROS 2 Interface Type Descriptions.

use std::collections::BTreeMap;
use std::error::Error;

use hiroz_codegen::hashing::{
    FieldDescription, FieldTypeDescription, TypeDescription, TypeDescriptionMsg, TypeId, calculate_hash,
    get_type_id, is_primitive_type,
};
use hiroz_codegen::types::{ArrayType, Field};

use crate::definition::Interface;

/// Type hashes by variant (`None` for the default) and full name.
pub type Hashes = BTreeMap<(Option<String>, String), String>;

type Descriptions = BTreeMap<String, TypeDescription>;

const TIME: &str = "builtin_interfaces/msg/Time";
const UUID: &str = "unique_identifier_msgs/msg/UUID";

/// Returns the hashes of all types of all interfaces, including the derived types of services and
/// actions.
pub fn hashes(interfaces: &[Interface]) -> Result<Hashes, Box<dyn Error>> {
    let mut common = Descriptions::new();
    for interface in interfaces.iter().filter(|interface| interface.variant.is_none()) {
        describe(interface, &mut common)?;
    }
    let mut hashes = Hashes::new();
    for name in common.keys() {
        hashes.insert((None, name.clone()), hash(name, &common)?);
    }
    for interface in interfaces.iter().filter(|interface| interface.variant.is_some()) {
        let mut own = Descriptions::new();
        describe(interface, &mut own)?;
        // A variant may refer to common types.
        let mut all = common.clone();
        all.extend(own.clone());
        for name in own.keys() {
            hashes.insert((interface.variant.clone(), name.clone()), hash(name, &all)?);
        }
    }
    Ok(hashes)
}

fn hash(name: &str, all: &Descriptions) -> Result<String, Box<dyn Error>> {
    let mut referenced = Descriptions::new();
    collect(name, all, &mut referenced)?;
    let own = referenced.remove(name).ok_or("no description")?;
    let message = TypeDescriptionMsg {
        type_description: own,
        referenced_type_descriptions: referenced.into_values().collect(),
    };
    Ok(calculate_hash(&message).to_rihs_string())
}

/// Adds the description of a type and of all types that it refers to, directly or indirectly, to
/// `found`.
fn collect(name: &str, all: &Descriptions, found: &mut Descriptions) -> Result<(), Box<dyn Error>> {
    if found.contains_key(name) {
        return Ok(());
    }
    let own = all.get(name).ok_or_else(|| format!("there is no definition of {name}"))?;
    found.insert(name.to_owned(), own.clone());
    let nested = own.fields.iter().map(|field| &field.field_type.nested_type_name);
    nested.filter(|name| !name.is_empty()).try_for_each(|name| collect(name, all, found))
}

fn describe(interface: &Interface, all: &mut Descriptions) -> Result<(), Box<dyn Error>> {
    let name = interface.full_name();
    for part in &interface.parts {
        let fields = part.fields.iter().map(|field| described(field, &interface.package));
        add(all, format!("{name}{}", part.suffix), fields.collect::<Result<_, _>>()?);
    }
    match interface.folder {
        "srv" => service(all, &name),
        "action" => action(all, &name),
        _ => {}
    }
    Ok(())
}

fn described(field: &Field, package: &str) -> Result<FieldDescription, Box<dyn Error>> {
    let kind = &field.field_type;
    let capacity = match kind.array {
        ArrayType::Fixed(size) | ArrayType::Bounded(size) => size as u64,
        ArrayType::Single | ArrayType::Unbounded => 0,
    };
    let package = kind.package.as_deref().unwrap_or(package);
    let nested = !is_primitive_type(&kind.base_type);
    let field_type = FieldTypeDescription {
        type_id: get_type_id(kind)?,
        capacity,
        string_capacity: kind.string_bound.unwrap_or(0) as u64,
        nested_type_name: if nested { format!("{package}/msg/{}", kind.base_type) } else { String::new() },
    };
    Ok(described_as(&field.name, field_type))
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
