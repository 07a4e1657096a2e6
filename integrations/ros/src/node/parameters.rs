//! Parameters: declaration, overrides from the command line, and the services for `ros2 param`.
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use metaplan::message::{Errors, Message, did_you_mean};
use ros2_client::ParameterValue;

use crate::interfaces::rcl_interfaces::msg;
use crate::interfaces::rcl_interfaces::srv::{
    DescribeParameters, DescribeParametersResponse, GetParameterTypes, GetParameterTypesResponse,
    GetParameters, GetParametersResponse, ListParameters, ListParametersResponse, SetParameters,
    SetParametersAtomically, SetParametersAtomicallyResponse, SetParametersResponse,
};
use crate::node::{Node, Severity};

/// A declared parameter.
#[derive(Debug, Clone)]
pub struct Declared {
    /// Name, whose parts are joined with points.
    pub name: &'static str,
    /// Purpose with the unit.
    pub description: &'static str,
    /// Default value, which also determines the type.
    pub value: ParameterValue,
    /// `true` if the parameter can be set while the node runs.
    pub is_dynamic: bool,
    /// Checks a value of the right type. The error describes the allowed values.
    pub check: fn(&ParameterValue) -> Result<(), &'static str>,
}

#[expect(clippy::unnecessary_wraps, reason = "one of several checks")]
pub(crate) fn any_value(_: &ParameterValue) -> Result<(), &'static str> {
    Ok(())
}

fn duration(value: &ParameterValue) -> Result<(), &'static str> {
    match value {
        ParameterValue::Double(seconds) if Duration::try_from_secs_f64(*seconds).is_ok() => Ok(()),
        _ => Err("must be a number of seconds, 0 or more"),
    }
}

impl Declared {
    fn accept(&self, value: ParameterValue) -> Result<ParameterValue, String> {
        let value = fitting(&self.value, value)?;
        (self.check)(&value)?;
        Ok(value)
    }
}

type Table = BTreeMap<String, Declared>;

type Listener = dyn Fn(&str, &ParameterValue) + Send + Sync;

impl Node {
    /// Declares the parameters of the node and `use_sim_time`, applies the values of the command line, and serves the
    /// parameters. `changed` is called for each parameter that is set later. Returns warnings about undeclared
    /// parameters.
    ///
    /// # Errors
    /// The command line gives a value of another type or a value that the check rejects, or a topic or
    /// service cannot be created.
    pub fn declare(
        self: &Arc<Self>,
        declared: Vec<Declared>,
        changed: impl Fn(&str, &ParameterValue) + Send + Sync + 'static,
    ) -> Result<Vec<Message>, Errors> {
        let mut table: Table =
            declared.into_iter().map(|parameter| (parameter.name.to_owned(), parameter)).collect();
        table.insert(
            "use_sim_time".to_owned(),
            Declared {
                name: "use_sim_time",
                description: "Use the simulated time on /clock.",
                value: ParameterValue::Boolean(false),
                is_dynamic: true,
                check: any_value,
            },
        );
        let (mut warnings, mut errors) = (Vec::new(), Vec::new());
        for (name, value) in self.arguments.parameters(&self.name) {
            match table.get_mut(&name) {
                None => {
                    let suggestion = did_you_mean(&name, table.keys().map(String::as_str));
                    warnings.push(Message::warning(
                        "N103",
                        format!("there is no parameter `{name}`{suggestion}"),
                    ));
                }
                Some(parameter) => match parameter.accept(value) {
                    Ok(value) => parameter.value = value,
                    Err(text) => {
                        errors.push(Message::error("N103", format!("the parameter `{name}` {text}")));
                    }
                },
            }
        }
        if !errors.is_empty() {
            return Err(errors.into());
        }
        for parameter in table.values() {
            // The client library accepts undeclared parameters. Access is checked by the services
            // of this module.
            let _ = self.inner().set_parameter(parameter.name, parameter.value.clone());
        }
        let is_simulated = |value: &ParameterValue| *value == ParameterValue::Boolean(true);
        if table.get("use_sim_time").is_some_and(|parameter| is_simulated(&parameter.value)) {
            self.use_simulated_time(true)?;
        }
        let weak = Arc::downgrade(self);
        let changed = move |name: &str, value: &ParameterValue| {
            if name == "use_sim_time"
                && let Some(node) = weak.upgrade()
                && let Err(error) = node.use_simulated_time(is_simulated(value))
            {
                node.log(Severity::Error, &error.message);
            }
            changed(name, value);
        };
        self.serve_parameters(Arc::new(Mutex::new(table)), Arc::new(changed))?;
        Ok(warnings)
    }

    /// Declares a single parameter, a time in seconds that can be set while the node runs. Returns
    /// its value in milliseconds. Undeclared parameters of the command line are logged as warnings.
    pub(crate) fn declare_seconds(
        self: &Arc<Self>,
        name: &'static str,
        description: &'static str,
        seconds: f64,
    ) -> Result<Arc<AtomicU64>, Errors> {
        let time = Arc::new(AtomicU64::new(0));
        let shared = Arc::clone(&time);
        let set = move |value: &ParameterValue| {
            if let ParameterValue::Double(seconds) = value
                && let Ok(duration) = Duration::try_from_secs_f64(*seconds)
            {
                shared.store(u64::try_from(duration.as_millis()).unwrap_or(u64::MAX), Ordering::Relaxed);
            }
        };
        let value = ParameterValue::Double(seconds);
        set(&value);
        let on_set = set.clone();
        let warnings = self.declare(
            vec![Declared { name, description, value, is_dynamic: true, check: duration }],
            move |set, value| {
                if set == name {
                    on_set(value);
                }
            },
        )?;
        for warning in warnings {
            self.log(Severity::Warn, warning.text().trim_end());
        }
        self.parameter(name).iter().for_each(set);
        Ok(time)
    }

    /// Returns the value of a declared parameter.
    pub fn parameter(&self, name: &str) -> Option<ParameterValue> {
        self.inner().get_parameter(name)
    }

    fn serve_parameters(
        self: &Arc<Self>,
        table: Arc<Mutex<Table>>,
        changed: Arc<Listener>,
    ) -> Result<(), Message> {
        let read = {
            let table = Arc::clone(&table);
            move |name: &str| {
                let table = table.lock().unwrap_or_else(PoisonError::into_inner);
                table.get(name).map(|parameter| parameter.value.clone())
            }
        };
        let values = read.clone();
        self.serve::<GetParameters>("~/get_parameters", move |request, answer| {
            let value = |name: &String| values(name).map_or_else(msg::ParameterValue::default, raw);
            answer.send(GetParametersResponse { values: request.names.iter().map(value).collect() });
        })?;
        self.serve::<GetParameterTypes>("~/get_parameter_types", move |request, answer| {
            let kind = |name: &String| read(name).map_or(0, |value| raw(value).r#type);
            answer.send(GetParameterTypesResponse { types: request.names.iter().map(kind).collect() });
        })?;
        let declared = Arc::clone(&table);
        self.serve::<ListParameters>("~/list_parameters", move |request, answer| {
            let names: Vec<String> =
                declared.lock().unwrap_or_else(PoisonError::into_inner).keys().cloned().collect();
            answer.send(ListParametersResponse { result: listed(names, &request.prefixes, request.depth) });
        })?;
        let declared = Arc::clone(&table);
        self.serve::<DescribeParameters>("~/describe_parameters", move |request, answer| {
            let table = declared.lock().unwrap_or_else(PoisonError::into_inner);
            let describe = |name: &String| described(name, table.get(name));
            answer.send(DescribeParametersResponse {
                descriptors: request.names.iter().map(describe).collect(),
            });
        })?;
        let (node, known, on_change) = (Arc::downgrade(self), Arc::clone(&table), Arc::clone(&changed));
        self.serve::<SetParameters>("~/set_parameters", move |request, answer| {
            let Some(node) = node.upgrade() else { return };
            let set = |parameter: msg::Parameter| result(node.set(&known, &*on_change, vec![parameter]));
            answer.send(SetParametersResponse { results: request.parameters.into_iter().map(set).collect() });
        })?;
        let node = Arc::downgrade(self);
        self.serve::<SetParametersAtomically>("~/set_parameters_atomically", move |request, answer| {
            let Some(node) = node.upgrade() else { return };
            let set = node.set(&table, &*changed, request.parameters);
            answer.send(SetParametersAtomicallyResponse { result: result(set) });
        })
    }

    /// Sets all parameters, or none of them if one of them cannot have its value.
    fn set(
        &self,
        table: &Mutex<Table>,
        changed: &Listener,
        parameters: Vec<msg::Parameter>,
    ) -> Result<(), String> {
        let mut table = table.lock().unwrap_or_else(PoisonError::into_inner);
        let mut values = Vec::new();
        for msg::Parameter { name, value } in parameters {
            let declared = table.get(&name).ok_or_else(|| format!("there is no parameter `{name}`"))?;
            if !declared.is_dynamic {
                return Err(format!("`{name}` cannot be set while the node runs"));
            }
            let value = parameter(value).ok_or_else(|| format!("`{name}` cannot be deleted"))?;
            let value = declared.accept(value).map_err(|text| format!("`{name}` {text}"))?;
            values.push((name, value));
        }
        for (name, value) in values {
            if let Some(declared) = table.get_mut(&name) {
                declared.value = value.clone();
            }
            // This also publishes on `/parameter_events`.
            self.inner().set_parameter(&name, value.clone())?;
            changed(&name, &value);
        }
        Ok(())
    }
}

/// Converts a value to the type of `current`. An integer is accepted for a double, also in lists, and an empty list for
/// a list of any type.
pub(crate) fn fitting(current: &ParameterValue, value: ParameterValue) -> Result<ParameterValue, String> {
    match (current, value) {
        (ParameterValue::Double(_), ParameterValue::Integer(whole)) => {
            Ok(ParameterValue::Double(whole as f64))
        }
        (ParameterValue::DoubleArray(_), ParameterValue::IntegerArray(list)) => {
            Ok(ParameterValue::DoubleArray(list.into_iter().map(|whole| whole as f64).collect()))
        }
        // An empty list is parsed as a list of strings.
        (current, ParameterValue::StringArray(items)) if items.is_empty() => {
            empty_list(current).ok_or_else(|| mismatch(current))
        }
        (current, value) if raw(current.clone()).r#type == raw(value.clone()).r#type => Ok(value),
        (current, _) => Err(mismatch(current)),
    }
}

fn mismatch(current: &ParameterValue) -> String {
    format!("has another type; it is {}", kind(current))
}

fn kind(value: &ParameterValue) -> &'static str {
    match value {
        ParameterValue::NotSet => "not set",
        ParameterValue::Boolean(_) => "a truth value",
        ParameterValue::Integer(_) => "an integer",
        ParameterValue::Double(_) => "a double",
        ParameterValue::String(_) => "a string",
        ParameterValue::ByteArray(_)
        | ParameterValue::BooleanArray(_)
        | ParameterValue::IntegerArray(_)
        | ParameterValue::DoubleArray(_)
        | ParameterValue::StringArray(_) => "a list",
    }
}

/// Returns the empty list of the type of a list, and `None` for other values.
fn empty_list(value: &ParameterValue) -> Option<ParameterValue> {
    Some(match value {
        ParameterValue::ByteArray(_) => ParameterValue::ByteArray(Vec::new()),
        ParameterValue::BooleanArray(_) => ParameterValue::BooleanArray(Vec::new()),
        ParameterValue::IntegerArray(_) => ParameterValue::IntegerArray(Vec::new()),
        ParameterValue::DoubleArray(_) => ParameterValue::DoubleArray(Vec::new()),
        ParameterValue::StringArray(_) => ParameterValue::StringArray(Vec::new()),
        _ => return None,
    })
}

fn result(outcome: Result<(), String>) -> msg::SetParametersResult {
    msg::SetParametersResult { successful: outcome.is_ok(), reason: outcome.err().unwrap_or_default() }
}

/// Returns the names that equal a prefix or are at most `depth` levels below it (0: unlimited). Without prefixes, the
/// levels are those of the whole name. Also returns the parents of these names, such as `a.b` for `a.b.c`.
fn listed(names: Vec<String>, prefixes: &[String], depth: u64) -> msg::ListParametersResult {
    let is_near = |below: &str| depth == 0 || (below.matches('.').count() as u64) < depth;
    let is_wanted = |name: &String| {
        let below = |prefix: &String| match name.strip_prefix(prefix.as_str()) {
            Some("") => true,
            Some(rest) => rest.strip_prefix('.').is_some_and(is_near),
            None => false,
        };
        if prefixes.is_empty() { is_near(name) } else { prefixes.iter().any(below) }
    };
    let names: Vec<String> = names.into_iter().filter(is_wanted).collect();
    let mut names_below: Vec<String> =
        names.iter().filter_map(|name| name.rsplit_once('.')).map(|(prefix, _)| prefix.to_owned()).collect();
    names_below.sort_unstable();
    names_below.dedup();
    msg::ListParametersResult { names, prefixes: names_below }
}

fn described(name: &str, parameter: Option<&Declared>) -> msg::ParameterDescriptor {
    msg::ParameterDescriptor {
        name: name.to_owned(),
        r#type: parameter.map_or(0, |parameter| raw(parameter.value.clone()).r#type),
        description: parameter.map_or_else(String::new, |parameter| parameter.description.to_owned()),
        read_only: parameter.is_some_and(|parameter| !parameter.is_dynamic),
        ..msg::ParameterDescriptor::default()
    }
}

pub(crate) fn raw(value: ParameterValue) -> msg::ParameterValue {
    use msg::{ParameterType as Kind, ParameterValue as Raw};
    let unset = Raw::default();
    match value {
        ParameterValue::NotSet => unset,
        ParameterValue::Boolean(bool_value) => Raw { r#type: Kind::PARAMETER_BOOL, bool_value, ..unset },
        ParameterValue::Integer(integer_value) => {
            Raw { r#type: Kind::PARAMETER_INTEGER, integer_value, ..unset }
        }
        ParameterValue::Double(double_value) => Raw { r#type: Kind::PARAMETER_DOUBLE, double_value, ..unset },
        ParameterValue::String(string_value) => Raw { r#type: Kind::PARAMETER_STRING, string_value, ..unset },
        ParameterValue::ByteArray(byte_array_value) => {
            Raw { r#type: Kind::PARAMETER_BYTE_ARRAY, byte_array_value, ..unset }
        }
        ParameterValue::BooleanArray(bool_array_value) => {
            Raw { r#type: Kind::PARAMETER_BOOL_ARRAY, bool_array_value, ..unset }
        }
        ParameterValue::IntegerArray(integer_array_value) => {
            Raw { r#type: Kind::PARAMETER_INTEGER_ARRAY, integer_array_value, ..unset }
        }
        ParameterValue::DoubleArray(double_array_value) => {
            Raw { r#type: Kind::PARAMETER_DOUBLE_ARRAY, double_array_value, ..unset }
        }
        ParameterValue::StringArray(string_array_value) => {
            Raw { r#type: Kind::PARAMETER_STRING_ARRAY, string_array_value, ..unset }
        }
    }
}

pub(crate) fn parameter(value: msg::ParameterValue) -> Option<ParameterValue> {
    use msg::ParameterType as Kind;
    Some(match value.r#type {
        Kind::PARAMETER_BOOL => ParameterValue::Boolean(value.bool_value),
        Kind::PARAMETER_INTEGER => ParameterValue::Integer(value.integer_value),
        Kind::PARAMETER_DOUBLE => ParameterValue::Double(value.double_value),
        Kind::PARAMETER_STRING => ParameterValue::String(value.string_value),
        Kind::PARAMETER_BYTE_ARRAY => ParameterValue::ByteArray(value.byte_array_value),
        Kind::PARAMETER_BOOL_ARRAY => ParameterValue::BooleanArray(value.bool_array_value),
        Kind::PARAMETER_INTEGER_ARRAY => ParameterValue::IntegerArray(value.integer_array_value),
        Kind::PARAMETER_DOUBLE_ARRAY => ParameterValue::DoubleArray(value.double_array_value),
        Kind::PARAMETER_STRING_ARRAY => ParameterValue::StringArray(value.string_array_value),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use ros2_client::ParameterValue;

    use super::{Declared, duration, fitting, listed};
    use crate::node::arguments::parameter_value;

    #[test]
    fn unusable_durations_are_rejected() {
        let value = ParameterValue::Double(5.0);
        let declared = Declared { name: "t", description: "", value, is_dynamic: true, check: duration };
        for seconds in [-1.0, f64::NAN, f64::INFINITY, 1e30] {
            assert!(declared.accept(ParameterValue::Double(seconds)).is_err(), "{seconds}");
        }
        for value in [ParameterValue::Double(0.0), ParameterValue::Double(0.5), ParameterValue::Integer(3)] {
            assert!(declared.accept(value.clone()).is_ok(), "{value:?}");
        }
    }

    #[test]
    fn lists_are_converted_to_the_present_type() {
        let check = |current: ParameterValue, yaml: &str, expected: Option<ParameterValue>| {
            let value = serde_yaml_ng::from_str(yaml).ok().as_ref().and_then(parameter_value);
            let converted = fitting(&current, value.expect("a value"));
            assert_eq!(converted.as_ref().ok(), expected.as_ref(), "{current:?} {yaml}: {converted:?}");
        };
        let doubles = |list: &[f64]| ParameterValue::DoubleArray(list.to_vec());
        let integers = |list: &[i64]| ParameterValue::IntegerArray(list.to_vec());
        let texts =
            |list: &[&str]| ParameterValue::StringArray(list.iter().map(|text| (*text).to_owned()).collect());
        let truths = |list: &[bool]| ParameterValue::BooleanArray(list.to_vec());
        check(doubles(&[2.5]), "[2, 0, 3]", Some(doubles(&[2.0, 0.0, 3.0])));
        check(doubles(&[]), "[2, 0.5]", Some(doubles(&[2.0, 0.5])));
        check(integers(&[1]), "[2, 0.5]", None);
        check(doubles(&[2.5]), "[]", Some(doubles(&[])));
        check(integers(&[1]), "[]", Some(integers(&[])));
        check(truths(&[true]), "[]", Some(truths(&[])));
        check(texts(&["a"]), "[]", Some(texts(&[])));
        check(ParameterValue::ByteArray(vec![1]), "[]", Some(ParameterValue::ByteArray(Vec::new())));
        check(texts(&["a"]), "[b]", Some(texts(&["b"])));
        check(ParameterValue::String("a".to_owned()), "[]", None);
        check(ParameterValue::Double(1.0), "[2]", None);
        check(texts(&["a"]), "[2]", None);
    }

    #[test]
    fn names_are_listed_below_prefixes() {
        let names = || ["a", "b.c", "b.d.e", "bc"].map(str::to_owned).to_vec();
        let list = |prefixes: &[&str], depth| {
            listed(names(), &prefixes.iter().map(|prefix| (*prefix).to_owned()).collect::<Vec<_>>(), depth)
                .names
        };
        assert_eq!(list(&[], 0), names());
        assert_eq!(list(&[], 1), ["a", "bc"]);
        assert_eq!(list(&["b"], 0), ["b.c", "b.d.e"]);
        assert_eq!(list(&["b"], 1), ["b.c"]);
        assert_eq!(list(&["a"], 1), ["a"]);
        assert_eq!(listed(names(), &[], 0).prefixes, ["b", "b.d"]);
    }
}
