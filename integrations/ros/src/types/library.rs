//! Definitions by name: those of this package, of the settings, and of an installation of ROS.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use metaplan::message::did_you_mean;
use serde::Deserialize;

use super::definition::{Base, Count, Field, FieldType, Interface, Part, Primitive};
use super::description::{self, Descriptions};
use super::encode::{least_size, parse_value};
use super::structure::{Layout, Structure, StructureField};

static DEFINITIONS: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/definitions.rs"));

/// Upper limit on the number of single values in a message of a type. A sequence counts as one value.
const MAX_VALUES: u64 = 1_000_000;

#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(untagged)]
pub(crate) enum Definition {
    Text(String),
    File { file: PathBuf },
}

impl Definition {
    /// Returns the text. A file is relative to the directory of the settings.
    pub(crate) fn text(&self, directory: &Path) -> Result<String, String> {
        match self {
            Self::Text(text) => Ok(text.clone()),
            Self::File { file } => {
                let file = directory.join(file);
                std::fs::read_to_string(&file)
                    .map_err(|error| format!("{} cannot be read: {error}", file.display()))
            }
        }
    }
}

#[derive(Debug, PartialEq)]
pub(crate) struct MessageType {
    pub(crate) package: String,
    pub(crate) name: String,
    pub(crate) structure: Arc<Structure>,
    pub(crate) hash: String,
}

/// A service type that is known only at run time. The hashes are those of request and response.
#[derive(Debug, PartialEq)]
pub(crate) struct ServiceType {
    pub(crate) package: String,
    pub(crate) name: String,
    pub(crate) request: Arc<Structure>,
    pub(crate) response: Arc<Structure>,
    pub(crate) hashes: [String; 2],
}

#[derive(Debug, PartialEq)]
pub(crate) struct ActionType {
    pub(crate) package: String,
    pub(crate) name: String,
    pub(crate) goal: Arc<Structure>,
    pub(crate) result: Arc<Structure>,
    /// Hashes of request and response of `send_goal`.
    pub(crate) send_goal: [String; 2],
    /// Hashes of request and response of `get_result`.
    pub(crate) get_result: [String; 2],
    pub(crate) feedback: String,
}

thread_local! {
    static CURRENT: RefCell<Rc<Library>> = RefCell::default();
}

/// Definitions of the settings. Other types are looked up in this package and in the installation of ROS.
#[derive(Debug, Default)]
pub(crate) struct Library {
    given: BTreeMap<String, Interface>,
    /// Directories with `share/PACKAGE/srv/NAME.srv` and so on.
    prefixes: Vec<PathBuf>,
}

impl Library {
    /// Creates a library that also looks for definitions in the directories of `AMENT_PREFIX_PATH`.
    pub(crate) fn installed() -> Self {
        let prefixes = std::env::var_os("AMENT_PREFIX_PATH").unwrap_or_default();
        Self { given: BTreeMap::new(), prefixes: std::env::split_paths(&prefixes).collect() }
    }

    pub(crate) fn add(&mut self, name: &str, text: &str) -> Result<(), String> {
        let interface = Interface::parse(name, text)?;
        self.given.insert(name.to_owned(), interface);
        Ok(())
    }

    /// Returns the library of the enclosing [`Library::while_current`] on this thread. Outside of it, returns a
    /// library with only the types of this package.
    pub(crate) fn current() -> Rc<Self> {
        CURRENT.with_borrow(Rc::clone)
    }

    /// Executes `work` on this thread with this library as the current one. Settings are deserialised in this
    /// way, because Serde passes no context.
    pub(crate) fn while_current<T>(self, work: impl FnOnce() -> T) -> T {
        let before = CURRENT.replace(Rc::new(self));
        let result = work();
        CURRENT.set(before);
        result
    }

    fn interface(&self, name: &str) -> Result<Interface, String> {
        if let Some(interface) = self.given.get(name) {
            return Ok(interface.clone());
        }
        if let Some((_, text)) = DEFINITIONS.iter().find(|(known, _)| *known == name) {
            return Interface::parse(name, text);
        }
        if let [package, folder, short] = name.split('/').collect::<Vec<_>>()[..] {
            for prefix in self.prefixes.iter().filter(|prefix| prefix.is_absolute()) {
                let file = prefix.join("share").join(package).join(folder).join(format!("{short}.{folder}"));
                if let Ok(text) = std::fs::read_to_string(&file) {
                    return Interface::parse(name, &text)
                        .map_err(|error| format!("{}: {error}", file.display()));
                }
            }
        }
        let names = self.given.keys().map(String::as_str).chain(DEFINITIONS.iter().map(|(name, _)| *name));
        let folder = name.split('/').nth(1).map(|folder| format!("/{folder}/")).unwrap_or_default();
        let suggestion = did_you_mean(name, names.filter(|known| known.contains(&folder)));
        Err(format!(
            "the type `{name}` is not known{suggestion}; give its definition in the table `[types]`, or set \
             AMENT_PREFIX_PATH to an installation of ROS that has it"
        ))
    }

    /// Resolves an interface, which must be in the folder `folder` (`msg`, `srv` or `action`). Returns it with its
    /// structures, and the descriptions from which hashes are computed.
    fn resolve(
        &self,
        name: &str,
        folder: &str,
    ) -> Result<(Interface, Vec<Arc<Structure>>, Descriptions), String> {
        let mut resolver = Resolver { library: self, structures: BTreeMap::new(), open: BTreeSet::new() };
        if name.split('/').nth(1) != Some(folder) {
            return Err(format!("`{name}` is not a valid type name; write `package/{folder}/Name`"));
        }
        let interface = self.interface(name)?;
        let structures: Vec<_> = interface
            .parts
            .iter()
            .map(|part| resolver.structure(format!("{name}{}", part.suffix), part))
            .collect::<Result<_, _>>()?;
        for structure in &structures {
            least_size(structure, MAX_VALUES)
                .ok_or_else(|| format!("`{}` has more than {MAX_VALUES} values", structure.name))?;
        }
        // The derived types of services and actions also refer to these messages.
        let mut messages: BTreeSet<String> = resolver.structures.into_keys().collect();
        let derived = ["builtin_interfaces/msg/Time", "unique_identifier_msgs/msg/UUID"];
        messages.extend(derived.into_iter().map(str::to_owned));
        messages.insert("service_msgs/msg/ServiceEventInfo".to_owned());
        let mut descriptions = Descriptions::new();
        for message in &messages {
            description::describe(&self.interface(message)?, &mut descriptions);
        }
        description::describe(&interface, &mut descriptions);
        Ok((interface, structures, descriptions))
    }

    pub(crate) fn message(&self, name: &str) -> Result<MessageType, String> {
        let (interface, structures, descriptions) = self.resolve(name, "msg")?;
        let [structure] = parts(structures)?;
        let hash = description::hash(name, &descriptions)?;
        Ok(MessageType { package: interface.package, name: interface.name, structure, hash })
    }

    pub(crate) fn service(&self, name: &str) -> Result<ServiceType, String> {
        let (interface, structures, descriptions) = self.resolve(name, "srv")?;
        let [request, response] = parts(structures)?;
        let hashes = service_hashes(name, &descriptions)?;
        Ok(ServiceType { package: interface.package, name: interface.name, request, response, hashes })
    }

    pub(crate) fn action(&self, name: &str) -> Result<ActionType, String> {
        let (interface, structures, descriptions) = self.resolve(name, "action")?;
        let [goal, result, _] = parts(structures)?;
        Ok(ActionType {
            package: interface.package,
            name: interface.name,
            goal,
            result,
            send_goal: service_hashes(&format!("{name}_SendGoal"), &descriptions)?,
            get_result: service_hashes(&format!("{name}_GetResult"), &descriptions)?,
            feedback: description::hash(&format!("{name}_FeedbackMessage"), &descriptions)?,
        })
    }
}

fn parts<const N: usize>(structures: Vec<Arc<Structure>>) -> Result<[Arc<Structure>; N], String> {
    structures.try_into().map_err(|_| "the definition has another number of parts".to_owned())
}

fn service_hashes(name: &str, descriptions: &Descriptions) -> Result<[String; 2], String> {
    let hash = |suffix: &str| description::hash(&format!("{name}_{suffix}"), descriptions);
    Ok([hash("Request")?, hash("Response")?])
}

struct Resolver<'l> {
    library: &'l Library,
    structures: BTreeMap<String, Arc<Structure>>,
    /// Messages that are being resolved.
    open: BTreeSet<String>,
}

impl Resolver<'_> {
    fn message(&mut self, name: &str) -> Result<Arc<Structure>, String> {
        if let Some(structure) = self.structures.get(name) {
            return Ok(Arc::clone(structure));
        }
        if !self.open.insert(name.to_owned()) {
            return Err(format!("`{name}` contains itself"));
        }
        let interface = self.library.interface(name)?;
        let part = interface.parts.first().ok_or_else(|| format!("`{name}` has no fields"))?;
        let structure = self.structure(name.to_owned(), part)?;
        self.open.remove(name);
        self.structures.insert(name.to_owned(), Arc::clone(&structure));
        Ok(structure)
    }

    fn structure(&mut self, name: String, part: &Part) -> Result<Arc<Structure>, String> {
        let mut fields = Vec::new();
        for Field { name: field, kind, default } in &part.fields {
            let layout = self.layout(kind)?;
            let default = match default {
                None => None,
                Some(text) => {
                    let wrong = || format!("`{name}`: the default value of `{field}` is wrong: {text}");
                    Some(parse_value(text, &layout).ok_or_else(wrong)?)
                }
            };
            fields.push(StructureField { name: field.clone(), layout, default });
        }
        let constant = |constant: &super::definition::Constant| {
            let value = parse_value(&constant.value, &single(constant.kind, None));
            let wrong = || format!("`{name}`: the constant `{}` is wrong: {}", constant.name, constant.value);
            value.map(|value| (constant.name.clone(), value)).ok_or_else(wrong)
        };
        let constants = part.constants.iter().map(constant).collect::<Result<_, _>>()?;
        Ok(Arc::new(Structure { name, fields, constants }))
    }

    fn layout(&mut self, kind: &FieldType) -> Result<Layout, String> {
        let element = match &kind.base {
            Base::Primitive(primitive) => single(*primitive, kind.string_bound),
            Base::Message(name) => Layout::Structure(self.message(name)?),
        };
        let element = Box::new(element);
        Ok(match kind.count {
            Count::One => *element,
            Count::Fixed(size) => Layout::Array(element, size),
            Count::Bounded(greatest) => Layout::Sequence { element, greatest_length: Some(greatest) },
            Count::Unbounded => Layout::Sequence { element, greatest_length: None },
        })
    }
}

fn single(primitive: Primitive, greatest_length: Option<u32>) -> Layout {
    match primitive {
        Primitive::String => Layout::Text { greatest_length },
        other => Layout::Single(other),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::{DEFINITIONS, Library};
    use crate::interfaces::diagnostic_msgs::msg::DiagnosticArray;
    use crate::interfaces::nav2_msgs::action::NavigateToPose;
    use crate::interfaces::rcl_interfaces::msg::ParameterValue;
    use crate::interfaces::std_srvs::srv::SetBool;
    use crate::interfaces::{Action as _, ServiceHashes, Structure as _};
    use crate::types::{Expectation, FieldPath};

    const SWITCH: &str = "string[] activate_controllers\nstring[] deactivate_controllers\nint32 strictness\n\
        int32 BEST_EFFORT=1\nint32 STRICT=2\nbool activate_asap\nbuiltin_interfaces/Duration timeout\n---\nbool ok\n\
        string message";

    fn library(definitions: &[(&str, &str)]) -> Library {
        let mut library = Library::default();
        for (name, text) in definitions {
            library.add(name, text).expect(name);
        }
        library
    }

    fn encoded<T: serde::Serialize>(value: &T) -> Vec<u8> {
        cdr_encoding::to_vec::<T, byteorder::LittleEndian>(value).expect("encoded")
    }

    #[test]
    fn hashes_are_those_of_the_generated_types() {
        let library = Library::default();
        let message = library.message("diagnostic_msgs/msg/DiagnosticArray").expect("a message");
        assert_eq!(message.hash, DiagnosticArray::RIHS01);
        let service = library.service("std_srvs/srv/SetBool").expect("a service");
        let hashes = ServiceHashes::of::<SetBool>();
        assert_eq!(service.hashes, [hashes.request, hashes.response]);
        let action = library.action("nav2_msgs/action/NavigateToPose").expect("an action");
        let (sent, result) = (NavigateToPose::SEND_GOAL_RIHS01, NavigateToPose::GET_RESULT_RIHS01);
        assert_eq!(action.send_goal, [sent.request, sent.response]);
        assert_eq!(action.get_result, [result.request, result.response]);
        assert_eq!(action.feedback, NavigateToPose::FEEDBACK_RIHS01);
    }

    #[test]
    fn every_definition_of_the_package_is_resolved() {
        for (name, _) in DEFINITIONS {
            let library = Library::default();
            let resolved = match name.split('/').nth(1) {
                Some("msg") => library.message(name).map(|_| ()),
                Some("srv") => library.service(name).map(|_| ()),
                _ => library.action(name).map(|_| ()),
            };
            assert_eq!(resolved, Ok(()), "{name}");
        }
    }

    #[test]
    fn values_are_encoded_as_by_the_generated_types() {
        let library = Library::default();
        let value = ParameterValue {
            r#type: 8,
            double_value: 0.1,
            string_value: "Gewässer".to_owned(),
            byte_array_value: vec![1, 2, 3],
            integer_array_value: vec![-1, i64::MAX],
            string_array_value: vec![String::new(), "b".to_owned()],
            ..ParameterValue::default()
        };
        let kind = library.message("rcl_interfaces/msg/ParameterValue").expect("a message");
        let table = serde_json::to_value(&value).expect("JSON");
        assert_eq!(kind.structure.encode(&table), Ok(encoded(&value)));
        let find = |path: &str| {
            let path = FieldPath::parse(path).expect(path);
            kind.structure.find(&path, &encoded(&value), 0)
        };
        assert_eq!(find("double_value"), Ok(Some(json!(0.1))));
        assert_eq!(find("string_value"), Ok(Some(json!("Gewässer"))));
        assert_eq!(find("integer_array_value[1]"), Ok(Some(json!(i64::MAX))));
        assert_eq!(find("integer_array_value[2]"), Ok(None));
        assert_eq!(find("string_array_value[1]"), Ok(Some(json!("b"))));
        let cut = &encoded(&value)[..40];
        let path = FieldPath::parse("string_array_value[1]").expect("a path");
        assert!(kind.structure.find(&path, cut, 0).is_err());
    }

    #[test]
    fn fields_are_found_after_a_status() {
        let library = library(&[("p/msg/M", "int16 a\nfloat64[2] b\nPoint[] c"), ("p/msg/Point", "int64 x")]);
        let kind = library.message("p/msg/M").expect("a message");
        let whole = encoded(&(4_u8, -2_i16, [0.5, 1.5], vec![7_i64, 8]));
        for (path, expected) in [("a", json!(-2)), ("b[1]", json!(1.5)), ("c[1].x", json!(8))] {
            let path = FieldPath::parse(path).expect(path);
            assert_eq!(kind.structure.find(&path, &whole[1..], 1), Ok(Some(expected)), "{path}");
        }
    }

    #[test]
    fn requests_may_have_names_and_seconds() {
        let name = "controller_manager_msgs/srv/SwitchController";
        let service = library(&[(name, SWITCH)]).service(name).expect("a service");
        let request = json!({"activate_controllers": ["a", "bc"], "strictness": "STRICT", "timeout": 1.5});
        let expected =
            encoded(&(vec!["a", "bc"], Vec::<String>::new(), 2_i32, false, (1_i32, 500_000_000_u32)));
        assert_eq!(service.request.encode(&request), Ok(expected));
        let expectation = Expectation::new(&service.response, &json!({"ok": true})).expect("an expectation");
        assert_eq!(expectation.check(&service.response, &encoded(&(true, "")), 0), Ok(()));
        let refused = expectation.check(&service.response, &encoded(&(false, "no")), 0);
        assert_eq!(refused, Err("`ok` is false, and should be true".to_owned()));
        assert_eq!(service.response.text("message", &encoded(&(false, "no"))), Some("no".to_owned()));
    }

    #[test]
    fn expected_numbers_are_compared_as_numbers() {
        let structure =
            library(&[("p/msg/M", "float32 a\nfloat64 b")]).message("p/msg/M").expect("it").structure;
        let values = [
            (json!("-inf"), f64::NEG_INFINITY),
            (json!(-0.5), -0.5),
            (json!(-0.0), -0.0),
            (json!(0), 0.0),
            (json!(0.5), 0.5),
            (json!("inf"), f64::INFINITY),
            (json!("nan"), f64::NAN),
        ];
        for (value, expected) in &values {
            for (_, present) in &values {
                let data = encoded(&(*present as f32, *present));
                let is_met = expected.partial_cmp(present).is_some_and(std::cmp::Ordering::is_eq)
                    || expected.is_nan() && present.is_nan();
                for field in ["a", "b"] {
                    let expectation = Expectation::new(&structure, &json!({field: value})).expect("a field");
                    let result = expectation.check(&structure, &data, 0);
                    assert_eq!(result.is_ok(), is_met, "{expected} {present}: {result:?}");
                }
            }
        }
    }

    #[test]
    fn default_values_are_those_of_the_definition() {
        let text = "float32 a 0.5\nstring b \"x, y\"\nint8[2] c [1, -2]\nstring[] d ['a, b', c]\nuint8 e 0xff\nbool f true";
        let library = library(&[("p/msg/M", text)]);
        let kind = library.message("p/msg/M").expect("a message");
        let expected =
            encoded(&(0.5_f32, "x, y", [1_i8, -2], vec!["a, b".to_owned(), "c".to_owned()], 255_u8, true));
        assert_eq!(kind.structure.encode(&json!({})), Ok(expected));
    }

    #[test]
    fn wrong_values_are_rejected() {
        let text = "int8 A=1\nint8 a\nuint16 b\nbool c\nstring<=3 d\nfloat64 e\nint8[2] f\nint8[<=1] g\n\
                    builtin_interfaces/Time h";
        let library = library(&[("p/msg/M", text)]);
        let structure = library.message("p/msg/M").expect("a message").structure;
        for (value, part) in [
            (json!({"x": 1}), "no field `x`"),
            (json!({"a": 128}), "`a`: 128 is not an integer from -128 to 127"),
            (json!({"a": "B"}), "nor one of A"),
            (json!({"a": 1.5}), "not an integer"),
            (json!({"b": -1}), "from 0 to 65535"),
            (json!({"c": 1}), "neither true nor false"),
            (json!({"d": "abcd"}), "longer than 3"),
            (json!({"d": "\0"}), "character 0"),
            (json!({"d": 1}), "is not a text"),
            (json!({"e": null}), "\"nan\""),
            (json!({"e": "much"}), "is not a number"),
            (json!({"f": [1]}), "1 elements are given, 2"),
            (json!({"f": [1, 300]}), "`f`: [1]: 300"),
            (json!({"f": 1}), "is not a list"),
            (json!({"g": [1, 2]}), "more than 1"),
            (json!({"h": {"sec": "now"}}), "`h`: `sec`:"),
            (json!({"h": "now"}), "a number of seconds"),
            (json!([]), "not a table"),
        ] {
            let error = structure.encode(&value).expect_err("an error");
            assert!(error.contains(part), "{value}: {error}");
        }
        let not_finite = json!({"e": "nan"});
        assert!(structure.encode(&not_finite).is_ok());
        for (value, part) in [
            (json!({"x": 1}), "no field `x`"),
            (json!({"f": [1, 2]}), "f[0]"),
            (json!({"h": {"sec": true}}), "`h.sec`: true is not"),
            (json!(1), "a table of fields"),
        ] {
            let error = Expectation::new(&structure, &value).expect_err("an error");
            assert!(error.contains(part), "{value}: {error}");
        }
        assert_eq!(
            Expectation::new(&structure, &Value::Object(serde_json::Map::new())),
            Ok(Expectation::default())
        );
    }

    #[test]
    fn wrong_types_are_rejected() {
        let definitions = [
            ("p/msg/Loop", "Loop[] a"),
            ("p/msg/Huge", "uint8[4000000000] a"),
            ("p/msg/Large", "Larger[1000] a"),
            ("p/msg/Larger", "int64[1001] a"),
            ("p/msg/Default", "uint8 a many"),
            ("p/msg/Missing", "Nothing a"),
        ];
        let library = library(&definitions);
        for (name, part) in [
            ("p/msg/Loop", "contains itself"),
            ("p/msg/Huge", "more than 1000000 values"),
            ("p/msg/Large", "more than 1000000 values"),
            ("p/msg/Default", "the default value of `a` is wrong: many"),
            ("p/msg/Missing", "`p/msg/Nothing` is not known"),
            ("std_msgs/msg/Strin", "did you mean `std_msgs/msg/String`?"),
            ("std_srvs/srv/Empty", "package/msg/Name"),
            ("/etc/passwd", "package/msg/Name"),
        ] {
            let error = library.message(name).expect_err(name);
            assert!(error.contains(part), "{name}: {error}");
        }
    }
}
