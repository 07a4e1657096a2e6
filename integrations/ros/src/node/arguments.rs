//! Parses the arguments after `--ros-args`: remapping rules, parameters, and parameter files.
//!
//! The syntax is that of `rcl` (ROS 2 design, articles "ROS 2 command line arguments" and
//! "Remapping names"): `-r from:=to`, `-r node:from:=to`, `-r __node:=name`, `-r __ns:=/namespace`,
//! `-p name:=value` (the value is YAML), `--params-file FILE`, `--log-level LEVEL`, each any number
//! of times. `--` ends the group.
use std::path::{Path, PathBuf};

use metaplan::message::{Errors, Message};
use ros2_client::ParameterValue;
use serde_yaml_ng::Value;

use crate::node::names::{FullName, is_match};

/// Command-line arguments for ROS.
#[derive(Debug, Clone, Default)]
pub struct RosArguments {
    rules: Vec<Rule>,
    parameters: Vec<Assigned>,
    /// Minimum severity of log messages, from `--log-level`.
    pub log_level: Option<String>,
}

#[derive(Debug, Clone)]
struct Rule {
    node: Option<String>,
    from: String,
    to: String,
}

/// Parameter value for the nodes whose full names match a pattern.
#[derive(Debug, Clone)]
struct Assigned {
    nodes: String,
    name: String,
    value: ParameterValue,
}

impl RosArguments {
    /// Splits a command line into the arguments of the program and those after `--ros-args`.
    ///
    /// # Errors
    /// All errors in the arguments after `--ros-args` and in the parameter files that they name.
    pub fn split(words: impl IntoIterator<Item = String>) -> Result<(Vec<String>, Self), Errors> {
        let (mut program_arguments, mut ros) = (Vec::new(), Vec::new());
        let mut is_ros = false;
        for word in words {
            match word.as_str() {
                "--ros-args" => is_ros = true,
                "--" if is_ros => is_ros = false,
                _ if is_ros => ros.push(word),
                _ => program_arguments.push(word),
            }
        }
        let mut arguments = Self::default();
        let mut messages = Vec::new();
        let mut words = ros.into_iter();
        while let Some(word) = words.next() {
            if let Err(errors) = arguments.take(&word, &mut words) {
                messages.extend(errors);
            }
        }
        if messages.is_empty() { Ok((program_arguments, arguments)) } else { Err(messages.into()) }
    }

    fn take(&mut self, word: &str, words: &mut impl Iterator<Item = String>) -> Result<(), Errors> {
        let mut next = || words.next().ok_or_else(|| vec![invalid(format!("`{word}` requires a value"))]);
        match word {
            "-r" | "--remap" => self.rules.push(rule(&next()?)?),
            "-p" | "--param" => self.parameters.push(parameter(&next()?)?),
            "--params-file" => self.parameters.extend(parameters_file(&PathBuf::from(next()?))?),
            "--log-level" => self.log_level = Some(next()?.to_lowercase()),
            // Security enclave, log configuration and log file are not supported; these options are ignored.
            "-e" | "--enclave" | "--log-config-file" | "--log-file-name" => drop(next()?),
            _ if word.starts_with("--enable-") || word.starts_with("--disable-") => {}
            _ => {
                let text = format!(
                    "`{word}` is not known after `--ros-args`; -r, -p, --params-file and --log-level are"
                );
                return Err(invalid(text).into());
            }
        }
        Ok(())
    }

    /// Returns the full name of a node after remapping by the rules `__node` (or `__name`) and `__ns`.
    pub(crate) fn node(&self, name: &str) -> FullName {
        let rule = |key: &str| {
            let fits =
                |rule: &&Rule| rule.from == key && rule.node.as_deref().is_none_or(|node| node == name);
            self.rules.iter().find(fits).map(|rule| rule.to.clone())
        };
        let namespace = rule("__ns").unwrap_or_else(|| "/".to_owned());
        FullName::new(
            &namespace,
            &rule("__node").or_else(|| rule("__name")).unwrap_or_else(|| name.to_owned()),
        )
    }

    /// Returns the full name of a topic, service or action of a node after remapping by the first matching rule.
    pub(crate) fn remap(&self, name: &str, node: &FullName) -> String {
        let full = node.expand(name);
        let fits = |rule: &&Rule| {
            let is_for = rule.node.as_deref().is_none_or(|for_node| for_node == node.name());
            is_for && !rule.from.starts_with("__") && node.expand(&rule.from) == full
        };
        self.rules.iter().find(fits).map_or(full, |rule| node.expand(&rule.to))
    }

    /// Returns the parameter values for a node in the order of the command line. If a name occurs several times, the
    /// last value applies.
    pub(crate) fn parameters(&self, node: &FullName) -> Vec<(String, ParameterValue)> {
        let full = node.to_string();
        let matching = self.parameters.iter().filter(|entry| is_match(&entry.nodes, &full, node.name()));
        matching.map(|assigned| (assigned.name.clone(), assigned.value.clone())).collect()
    }
}

fn invalid(text: String) -> Message {
    Message::error("N101", text)
}

/// Parses `from:=to` or `node:from:=to`.
fn rule(text: &str) -> Result<Rule, Message> {
    let malformed =
        || invalid(format!("`{text}` is not a rule; it should be `from:=to`, or `node:from:=to`"));
    let (selector, to) = text.split_once(":=").ok_or_else(malformed)?;
    let (node, from) = match selector.split_once(':') {
        // The prefixes `rostopic://` and `rosservice://` are removed: such a rule applies to all kinds of names.
        Some((node, from)) => match from.strip_prefix("//") {
            Some(from) => (None, from),
            None => (Some(node.to_owned()), from),
        },
        None => (None, selector),
    };
    if from.is_empty() || to.is_empty() {
        return Err(malformed());
    }
    Ok(Rule { node, from: from.to_owned(), to: to.to_owned() })
}

/// Parses `name:=value`, for every node, or `node:name:=value`.
fn parameter(text: &str) -> Result<Assigned, Message> {
    let malformed = || invalid(format!("`{text}` is not a parameter; it should be `name:=value`"));
    let (selector, value) = text.split_once(":=").ok_or_else(malformed)?;
    let (nodes, name) = selector.split_once(':').unwrap_or(("/**", selector));
    let value: Value = serde_yaml_ng::from_str(value)
        .map_err(|error| invalid(format!("the value of the parameter `{name}` is not YAML: {error}")))?;
    let value = parameter_value(&value)
        .ok_or_else(|| invalid(format!("the parameter `{name}` has a value that no parameter can have")))?;
    Ok(Assigned { nodes: nodes.to_owned(), name: name.to_owned(), value })
}

/// Parses a parameter file: node names or patterns with their parameters below `ros__parameters`.
fn parameters_file(path: &Path) -> Result<Vec<Assigned>, Errors> {
    let file = path.display().to_string();
    let fault = |text: String| vec![Message::at("N102", &file, None, text)];
    let text =
        std::fs::read_to_string(path).map_err(|error| fault(format!("the file cannot be read: {error}")))?;
    let root: Value =
        serde_yaml_ng::from_str(&text).map_err(|error| fault(format!("the file is not YAML: {error}")))?;
    let (mut found, mut messages) = (Vec::new(), Vec::new());
    nodes("", &root, &mut found, &mut messages);
    let messages: Vec<Message> =
        messages.into_iter().map(|text| Message::at("N102", &file, None, text)).collect();
    if messages.is_empty() { Ok(found) } else { Err(messages.into()) }
}

/// Collects parameters recursively. The keys above `ros__parameters` are parts of node names.
fn nodes(path: &str, value: &Value, found: &mut Vec<Assigned>, messages: &mut Vec<String>) {
    let Some(fields) = value.as_mapping() else {
        messages.push(format!("`{path}` should hold names of nodes, or `ros__parameters`"));
        return;
    };
    for (key, below) in fields {
        let Some(key) = key.as_str() else {
            messages.push(format!("a key below `{path}` is not a name"));
            continue;
        };
        if key == "ros__parameters" {
            let nodes = if path.starts_with('/') { path.to_owned() } else { format!("/{path}") };
            flatten("", below, &nodes, found, messages);
        } else {
            let path = if path.is_empty() {
                key.to_owned()
            } else {
                format!("{path}/{}", key.trim_start_matches('/'))
            };
            nodes(&path, below, found, messages);
        }
    }
}

/// Flattens nested parameters, whose names are joined with points.
fn flatten(name: &str, value: &Value, nodes: &str, found: &mut Vec<Assigned>, messages: &mut Vec<String>) {
    if let Some(fields) = value.as_mapping() {
        for (key, below) in fields {
            let key = key.as_str().unwrap_or_default();
            let name = if name.is_empty() { key.to_owned() } else { format!("{name}.{key}") };
            flatten(&name, below, nodes, found, messages);
        }
    } else if let Some(value) = parameter_value(value) {
        found.push(Assigned { nodes: nodes.to_owned(), name: name.to_owned(), value });
    } else {
        messages.push(format!("the parameter `{name}` of {nodes} has a value that no parameter can have"));
    }
}

/// Converts a YAML value to a parameter. Returns `None` for null, mappings, tagged values, and lists whose items are
/// not all texts, all truth values or all numbers.
pub(crate) fn parameter_value(value: &Value) -> Option<ParameterValue> {
    Some(match value {
        Value::Bool(truth) => ParameterValue::Boolean(*truth),
        Value::Number(number) => match number.as_i64() {
            Some(whole) => ParameterValue::Integer(whole),
            None => ParameterValue::Double(number.as_f64()?),
        },
        Value::String(text) => ParameterValue::String(text.clone()),
        Value::Sequence(list) => {
            let all_items = |of: fn(&Value) -> bool| list.iter().all(of);
            if list.is_empty() || all_items(Value::is_string) {
                ParameterValue::StringArray(
                    list.iter().filter_map(Value::as_str).map(str::to_owned).collect(),
                )
            } else if all_items(Value::is_bool) {
                ParameterValue::BooleanArray(list.iter().filter_map(Value::as_bool).collect())
            // A list of integers and fractions is a list of doubles (next case).
            } else if all_items(Value::is_i64) {
                ParameterValue::IntegerArray(list.iter().filter_map(Value::as_i64).collect())
            } else if all_items(Value::is_number) {
                ParameterValue::DoubleArray(list.iter().filter_map(Value::as_f64).collect())
            } else {
                return None;
            }
        }
        Value::Null | Value::Mapping(_) | Value::Tagged(_) => return None,
    })
}

#[cfg(test)]
mod tests {
    use ros2_client::ParameterValue;

    use super::RosArguments;

    fn read(line: &str) -> (Vec<String>, RosArguments) {
        RosArguments::split(line.split(' ').map(str::to_owned)).expect("right arguments")
    }

    #[test]
    fn arguments_after_ros_args_are_for_ros() {
        let (program, ros) = read(
            "metaplan-ros --ros-args -r __node:=boss -r __ns:=/uuv -r /diagnostics:=/d2 -r ~/plan:=plan -p speed:=2 -- --as manager",
        );
        assert_eq!(program, ["metaplan-ros", "--as", "manager"]);
        let node = ros.node("metaplan");
        assert_eq!(node.to_string(), "/uuv/boss");
        let name = |name: &str| ros.remap(name, &node);
        assert_eq!(name("/diagnostics"), "/d2");
        assert_eq!(name("task/request"), "/uuv/task/request");
        assert_eq!(name("~/plan"), "/uuv/plan");
        assert_eq!(name("/uuv/boss/plan"), "/uuv/plan");
        assert_eq!(ros.parameters(&node), [("speed".to_owned(), ParameterValue::Integer(2))]);
    }

    #[test]
    fn rules_for_another_node_are_ignored() {
        let (_, ros) = read("p --ros-args -r other:a:=b -r metaplan:a:=c -r other:__node:=x");
        let node = ros.node("metaplan");
        assert_eq!(node.to_string(), "/metaplan");
        assert_eq!(ros.remap("a", &node), "/c");
    }

    #[test]
    fn schemes_of_names_are_removed() {
        let (_, ros) = read("p --ros-args -r __ns:=/uuv -r rostopic:///a:=/b -r rosservice://c:=d");
        let node = ros.node("metaplan");
        assert_eq!([ros.remap("/a", &node), ros.remap("c", &node)], ["/b", "/uuv/d"]);
        assert_eq!(ros.remap("a", &node), "/uuv/a");
    }

    #[test]
    fn files_of_parameters_are_read_for_the_nodes_they_name() {
        let directory = tempfile::tempdir().expect("a directory");
        let file = directory.path().join("p.yaml");
        let text = "/**:\n  ros__parameters:\n    a: 1\n    b: {c: [1.5, 2]}\n/uuv/*:\n  ros__parameters: {d: yes it is}\nother:\n  ros__parameters: {a: 2}\n";
        std::fs::write(&file, text).expect("written");
        let (_, ros) = read(&format!("p --ros-args -r __ns:=/uuv --params-file {}", file.display()));
        let values = ros.parameters(&ros.node("metaplan"));
        let names: Vec<&str> = values.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["a", "b.c", "d"]);
        assert_eq!(values[1].1, ParameterValue::DoubleArray(vec![1.5, 2.0]));
        let global_node = ros.node("metaplan");
        assert!(ros.parameters(&global_node).iter().all(|(_, value)| *value != ParameterValue::Integer(2)));
    }

    #[test]
    fn all_errors_are_reported() {
        let line = "p --ros-args -r nothing -p x --fly -p";
        let messages = RosArguments::split(line.split(' ').map(str::to_owned)).expect_err("wrong");
        assert_eq!(messages.len(), 4, "{messages:?}");
        assert!(messages.iter().all(|message| message.code == "N101"), "{messages:?}");
    }
}
