//! Generates the Rust modules `[VARIANT::]PACKAGE::{msg, srv, action}` of interfaces, their type hashes, and tables of
//! types and definitions.

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write;

use crate::definition::Definitions;
use crate::types::definition::{Base, Constant, Count, Field, Interface, Part, Primitive};
use crate::types::description::{self, Descriptions};

/// Type hashes by variant (`None` for the default) and full name.
pub type Hashes = BTreeMap<(Option<String>, String), String>;

const KEYWORDS: [&str; 1] = ["type"];

type Modules<'i> = BTreeMap<Option<&'i str>, BTreeMap<&'i str, BTreeMap<&'i str, String>>>;

pub fn modules(interfaces: &[Interface], hashes: &Hashes) -> Result<String, Box<dyn Error>> {
    let mut modules = Modules::new();
    for interface in interfaces {
        let packages = modules.entry(interface.variant.as_deref()).or_default();
        let text = packages.entry(&interface.package).or_default().entry(interface.folder).or_default();
        for part in &interface.parts {
            structure(text, interface, part, interfaces, hashes)?;
        }
        whole(text, interface, hashes)?;
    }
    let mut text = String::new();
    for (variant, packages) in modules {
        if let Some(variant) = variant {
            writeln!(text, "/// Interfaces that are otherwise in `{variant}`.\npub mod {variant} {{")?;
        }
        for (package, folders) in packages {
            writeln!(text, "/// Interfaces of the package `{package}`.\npub mod {package} {{")?;
            for (folder, body) in folders {
                writeln!(
                    text,
                    "/// What is defined in `{package}/{folder}`.\npub mod {folder} {{\n{body}}}"
                )?;
            }
            writeln!(text, "}}")?;
        }
        if variant.is_some() {
            writeln!(text, "}}")?;
        }
    }
    Ok(text)
}

/// Returns the hashes of all types of all interfaces, including the derived types of services and actions.
pub fn hashes(interfaces: &[Interface]) -> Result<Hashes, Box<dyn Error>> {
    let mut common = Descriptions::new();
    for interface in interfaces.iter().filter(|interface| interface.variant.is_none()) {
        description::describe(interface, &mut common);
    }
    let mut hashes = Hashes::new();
    for name in common.keys() {
        hashes.insert((None, name.clone()), description::hash(name, &common)?);
    }
    for interface in interfaces.iter().filter(|interface| interface.variant.is_some()) {
        let mut own = Descriptions::new();
        description::describe(interface, &mut own);
        // A variant may refer to common types.
        let mut all = common.clone();
        all.extend(own.clone());
        for name in own.keys() {
            hashes.insert((interface.variant.clone(), name.clone()), description::hash(name, &all)?);
        }
    }
    Ok(hashes)
}

/// Returns the text of a slice with the name and the definition of each interface that is no variant.
pub fn texts(definitions: &Definitions) -> String {
    let common = definitions.iter().filter(|(interface, _)| interface.variant.is_none());
    let lines: Vec<String> =
        common.map(|(interface, text)| format!("({:?}, {text:?}),", interface.full_name())).collect();
    format!("&[\n{}\n]", lines.join("\n"))
}

/// Returns the text of a slice with one entry for each structure, `Entry::of::<T>(variant, name)`, and for
/// each other type that has a hash, `Entry::hash(variant, name, hash)`.
pub fn table(interfaces: &[Interface], hashes: &Hashes) -> String {
    let mut lines = Vec::new();
    let mut structures = Vec::new();
    for interface in interfaces {
        for part in &interface.parts {
            let name = format!("{}{}", interface.full_name(), part.suffix);
            let path = format!("metaplan_ros::interfaces::{}", path(interface, part));
            lines.push(format!("Entry::of::<{path}>({:?}, {name:?}),", interface.variant));
            structures.push((interface.variant.clone(), name));
        }
    }
    let others = hashes.iter().filter(|(key, _)| !structures.contains(key));
    lines.extend(
        others.map(|((variant, name), hash)| format!("Entry::hash({variant:?}, {name:?}, {hash:?}),")),
    );
    format!("&[\n{}\n]", lines.join("\n"))
}

fn rust_name(interface: &Interface, part: &Part) -> String {
    format!("{}{}", interface.name, part.suffix.trim_start_matches('_'))
}

fn path(interface: &Interface, part: &Part) -> String {
    let variant = interface.variant.as_ref().map(|variant| format!("{variant}::")).unwrap_or_default();
    format!("{variant}{}::{}::{}", interface.package, interface.folder, rust_name(interface, part))
}

fn hash<'h>(hashes: &'h Hashes, interface: &Interface, suffix: &str) -> Result<&'h str, Box<dyn Error>> {
    let key = (interface.variant.clone(), format!("{}{suffix}", interface.full_name()));
    Ok(hashes.get(&key).ok_or_else(|| format!("no hash of {}", key.1))?)
}

fn structure(
    text: &mut String,
    interface: &Interface,
    part: &Part,
    all: &[Interface],
    hashes: &Hashes,
) -> Result<(), Box<dyn Error>> {
    let name = rust_name(interface, part);
    let full_name = format!("{}{}", interface.full_name(), part.suffix);
    writeln!(text, "/// The structure `{full_name}`.")?;
    writeln!(text, "#[derive(Debug, Clone, Default, PartialEq, ::serde::Serialize, ::serde::Deserialize)]")?;
    writeln!(text, "pub struct {name} {{")?;
    for field in &part.fields {
        let raw = if KEYWORDS.contains(&field.name.as_str()) { "r#" } else { "" };
        let kind = rust_type(field, interface, all)?;
        writeln!(text, "/// The field `{0}`.\npub {raw}{0}: {kind},", field.name)?;
    }
    writeln!(text, "}}")?;
    constants(text, &name, &part.constants)?;
    let hash = hash(hashes, interface, part.suffix)?;
    writeln!(
        text,
        "impl ::ros2_client::Message for {name} {{}}\n\
         impl crate::interfaces::Structure for {name} {{\n\
         const TYPE: &'static str = {full_name:?};\nconst RIHS01: &'static str = {hash:?};\n}}"
    )?;
    Ok(())
}

fn constants(text: &mut String, name: &str, constants: &[Constant]) -> Result<(), Box<dyn Error>> {
    if constants.is_empty() {
        return Ok(());
    }
    writeln!(text, "impl {name} {{")?;
    for Constant { name, kind, value } in constants {
        let kind = primitive(*kind);
        writeln!(text, "/// The value `{name}`.\npub const {name}: {kind} = {value};")?;
    }
    writeln!(text, "}}")?;
    Ok(())
}

/// Writes the trait implementation of a message, or the type of a service or action with its trait implementation.
fn whole(text: &mut String, interface: &Interface, hashes: &Hashes) -> Result<(), Box<dyn Error>> {
    let Interface { package, folder, name, .. } = interface;
    let of = |suffix: &str| hash(hashes, interface, suffix);
    let names = format!("const PACKAGE: &'static str = {package:?};\nconst NAME: &'static str = {name:?};");
    if *folder == "msg" {
        writeln!(text, "impl crate::interfaces::Msg for {name} {{\n{names}\n}}")?;
        return Ok(());
    }
    writeln!(text, "/// `{}`.", interface.full_name())?;
    writeln!(text, "#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]\npub struct {name};")?;
    if *folder == "srv" {
        writeln!(
            text,
            "impl crate::interfaces::Service for {name} {{\n\
             type Request = {name}Request;\ntype Response = {name}Response;\n{names}\n}}"
        )?;
    } else {
        let service = |suffix: &str| -> Result<String, Box<dyn Error>> {
            let (request, response) = (of(&format!("{suffix}_Request"))?, of(&format!("{suffix}_Response"))?);
            Ok(format!("crate::interfaces::ServiceHashes {{ request: {request:?}, response: {response:?} }}"))
        };
        writeln!(
            text,
            "impl crate::interfaces::Action for {name} {{\n\
             type Goal = {name}Goal;\ntype Result = {name}Result;\ntype Feedback = {name}Feedback;\n{names}\n\
             const SEND_GOAL_RIHS01: crate::interfaces::ServiceHashes = {};\n\
             const GET_RESULT_RIHS01: crate::interfaces::ServiceHashes = {};\n\
             const FEEDBACK_RIHS01: &'static str = {:?};\n}}",
            service("_SendGoal")?,
            service("_GetResult")?,
            of("_FeedbackMessage")?
        )?;
    }
    Ok(())
}

fn primitive(kind: Primitive) -> &'static str {
    match kind {
        Primitive::Bool => "bool",
        Primitive::Byte | Primitive::Char | Primitive::Uint8 => "u8",
        Primitive::Int8 => "i8",
        Primitive::Uint16 => "u16",
        Primitive::Int16 => "i16",
        Primitive::Uint32 => "u32",
        Primitive::Int32 => "i32",
        Primitive::Uint64 => "u64",
        Primitive::Int64 => "i64",
        Primitive::Float32 => "f32",
        Primitive::Float64 => "f64",
        Primitive::String => "::std::string::String",
    }
}

/// Returns the Rust type of a field. The maximum length of a sequence or string changes neither the
/// serialised bytes nor the Rust type.
fn rust_type(field: &Field, interface: &Interface, all: &[Interface]) -> Result<String, Box<dyn Error>> {
    let single = match &field.kind.base {
        Base::Primitive(kind) => primitive(*kind).to_owned(),
        Base::Message(name) => nested_type(name, interface, all)?,
    };
    Ok(match field.kind.count {
        Count::One => single,
        Count::Fixed(size) => format!("[{single}; {size}]"),
        Count::Bounded(_) | Count::Unbounded => format!("::std::vec::Vec<{single}>"),
    })
}

/// Returns the path of a message that an interface refers to: the message of the interface's variant if there is one,
/// otherwise the common message.
fn nested_type(full_name: &str, interface: &Interface, all: &[Interface]) -> Result<String, Box<dyn Error>> {
    let find = |variant: &Option<String>| {
        all.iter().find(|other| other.variant == *variant && other.full_name() == full_name)
    };
    let found = find(&interface.variant).or_else(|| find(&None));
    let found = found.ok_or_else(|| format!("{}: there is no {full_name}", interface.full_name()))?;
    Ok(format!("crate::interfaces::{}", path(found, &found.parts[0])))
}
