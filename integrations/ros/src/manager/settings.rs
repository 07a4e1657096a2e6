//! Settings of a mission on a robot: the file of `--settings`.

use std::collections::BTreeMap;
use std::path::Path;

use metaplan::message::Message;
use serde::Deserialize;

use crate::diagnostic_rules::DiagnosticRule;
use crate::performer::{By, Offered, Poses};

/// Default mode of a function that is not needed.
const UNGROUND: &str = "fd_unground";

/// Contents of the settings file.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Tasks by the names with which they are requested.
    #[serde(default)]
    pub tasks: BTreeMap<String, TaskSettings>,
    /// Names of functions and designs in `system_modes`, if they differ.
    #[serde(default)]
    pub functions: Functions,
    /// Diagnostics of drivers that report a component or measure an attribute.
    #[serde(default)]
    pub diagnostics: Vec<DiagnosticRule>,
    /// The autopilot, if there is one.
    pub autopilot: Option<Autopilot>,
    /// Performers by action names. Other actions end immediately.
    #[serde(default)]
    pub actions: BTreeMap<String, By>,
    /// Poses of objects, for actions that move.
    #[serde(default)]
    pub poses: Poses,
    /// Performers of actions for PlanSys2's executor, by action names.
    #[serde(default)]
    pub offers: BTreeMap<String, Offered>,
}

/// A task.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TaskSettings {
    /// PDDL condition that ends the task.
    pub goal: String,
    /// Facts that hold when the task begins, as for `--set`.
    #[serde(default)]
    pub facts: BTreeMap<String, toml::Value>,
}

/// Autopilot, whose mode tells whether the robot executes commands.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Autopilot {
    /// Topic of type `mavros_msgs/State`.
    pub topic: String,
    /// Mode in which the robot executes commands.
    pub mode: String,
}

/// Names of functions and designs in `system_modes`. The defaults are the names in the knowledge
/// base.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(transparent)]
pub struct Functions(BTreeMap<String, FunctionSettings>);

#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
struct FunctionSettings {
    /// Name of the system, without slash.
    system: Option<String>,
    /// Node of the function; `<system>_node` by default.
    node: Option<String>,
    /// Mode while the function is not needed.
    unground: Option<String>,
    /// Modes of designs.
    #[serde(default)]
    modes: BTreeMap<String, String>,
}

impl Settings {
    /// Reads the settings file; by default a file `ros.toml` in the directory of the mission, if it exists.
    ///
    /// # Errors
    /// The file cannot be read or is invalid.
    pub fn read(file: Option<&Path>, mission: &Path) -> Result<Self, Message> {
        let default_file = mission.with_file_name("ros.toml");
        let file = match file {
            Some(file) => file,
            None if default_file.is_file() => &default_file,
            None => return Ok(Self::default()),
        };
        let name = file.display().to_string();
        let text = std::fs::read_to_string(file)
            .map_err(|error| Message::at("N130", &name, None, format!("the file cannot be read: {error}")))?;
        toml::from_str(&text).map_err(|error| {
            let place = error.span().map(|span| position(&text, span.start));
            Message::at("N130", &name, place, error.message()).with_source(&text)
        })
    }
}

/// Line and column of a byte offset, from 1, in characters.
fn position(text: &str, at: usize) -> (usize, usize) {
    let before = text.get(..at).unwrap_or(text);
    let line = before.rsplit('\n').next().unwrap_or_default();
    (before.matches('\n').count() + 1, line.chars().count() + 1)
}

impl Functions {
    /// Returns the system of a function.
    pub fn system<'s>(&'s self, function: &'s str) -> &'s str {
        self.0.get(function).and_then(|settings| settings.system.as_deref()).unwrap_or(function)
    }

    /// Returns the node of a function.
    pub fn node(&self, function: &str) -> String {
        let node = self.0.get(function).and_then(|node| node.node.clone());
        node.unwrap_or_else(|| format!("{}_node", self.system(function)))
    }

    /// Returns the mode of a design.
    pub fn mode<'s>(&'s self, function: &str, design: &'s str) -> &'s str {
        self.0.get(function).and_then(|settings| settings.modes.get(design)).map_or(design, String::as_str)
    }

    /// Returns the mode of a function that is not needed.
    pub fn unground(&self, function: &str) -> &str {
        self.0.get(function).and_then(|settings| settings.unground.as_deref()).unwrap_or(UNGROUND)
    }

    /// Returns the design of a mode, among the designs of a function.
    pub fn design(&self, function: &str, mode: &str, designs: &[String]) -> Option<String> {
        designs.iter().find(|design| self.mode(function, design) == mode).cloned()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::Settings;

    #[test]
    fn settings_of_the_suave_example_are_read() {
        let mission = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/suave/suave.toml");
        let settings = Settings::read(None, &mission).expect("settings");
        let functions = &settings.functions;
        assert_eq!(functions.mode("generate_recharge_path", "fd_recharge"), "normal");
        let designs = ["fd_recharge".to_owned()];
        assert_eq!(
            functions.design("generate_recharge_path", "normal", &designs).as_deref(),
            Some("fd_recharge")
        );
        assert_eq!(functions.mode("f_maintain_motion", "fd_all_thrusters"), "fd_all_thrusters");
        assert_eq!(functions.node("f_maintain_motion"), "f_maintain_motion_node");
        assert_eq!(settings.tasks.len(), 2);
        assert!(settings.autopilot.is_some());
    }

    #[test]
    fn errors_have_source_locations() {
        let directory = tempfile::tempdir().expect("a directory");
        let file = directory.path().join("ros.toml");
        std::fs::write(&file, "[tasks.a]\ngoal = 1\n").expect("written");
        let message = Settings::read(Some(&file), Path::new("m.toml")).expect_err("wrong");
        assert!(message.text().contains("ros.toml:2:8"), "{}", message.text());
    }
}
