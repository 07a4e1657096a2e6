//! How a mission meets a robot: the file of `--settings`.

use std::collections::BTreeMap;
use std::path::Path;

use metaplan::message::Message;
use serde::Deserialize;

use crate::diagnostic_rules::DiagnosticRule;
use crate::performer::{By, Offered, Poses};

/// The mode of a function that nobody needs.
const UNGROUND: &str = "fd_unground";

/// The file of settings.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Tasks by the names with which they are requested.
    #[serde(default)]
    pub tasks: BTreeMap<String, TaskSettings>,
    /// What `system_modes` calls functions and designs, where that differs.
    #[serde(default)]
    pub functions: Functions,
    /// Diagnostics of drivers that report a component or measure an attribute.
    #[serde(default)]
    pub diagnostics: Vec<DiagnosticRule>,
    /// The autopilot, if there is one.
    pub autopilot: Option<Autopilot>,
    /// Who carries out an action, by its name; the rest are done as soon as they are begun.
    #[serde(default)]
    pub actions: BTreeMap<String, By>,
    /// Where things are, for actions that move.
    #[serde(default)]
    pub poses: Poses,
    /// Who carries out an action for PlanSys2's executor, by its name.
    #[serde(default)]
    pub offers: BTreeMap<String, Offered>,
}

/// A task.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TaskSettings {
    /// What is reached when it is done: a PDDL condition.
    pub goal: String,
    /// Facts that are so when it begins, as for `--set`.
    #[serde(default)]
    pub facts: BTreeMap<String, toml::Value>,
}

/// What says whether the robot obeys.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Autopilot {
    /// A topic of `mavros_msgs/State`.
    pub topic: String,
    /// The mode in which it obeys.
    pub mode: String,
}

/// What functions and designs are called by `system_modes`: as in the knowledge base, unless it is said here.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(transparent)]
pub struct Functions(BTreeMap<String, FunctionSettings>);

#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
struct FunctionSettings {
    /// The system's name, without slash.
    system: Option<String>,
    /// The node that does its work; `<system>_node` unless said otherwise.
    node: Option<String>,
    /// The mode that it has when nobody needs it.
    unground: Option<String>,
    /// The mode of a design.
    #[serde(default)]
    modes: BTreeMap<String, String>,
}

impl Settings {
    /// Reads the file; without one, a file `ros.toml` beside the mission, if there is one.
    ///
    /// # Errors
    /// It cannot be read, or something in it is wrong.
    pub fn read(file: Option<&Path>, mission: &Path) -> Result<Self, Message> {
        let beside = mission.with_file_name("ros.toml");
        let file = match file {
            Some(file) => file,
            None if beside.is_file() => &beside,
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

/// Line and column, from 1, in characters.
fn position(text: &str, at: usize) -> (usize, usize) {
    let before = text.get(..at).unwrap_or(text);
    let line = before.rsplit('\n').next().unwrap_or_default();
    (before.matches('\n').count() + 1, line.chars().count() + 1)
}

impl Functions {
    /// The system of a function.
    pub fn system<'s>(&'s self, function: &'s str) -> &'s str {
        self.0.get(function).and_then(|own| own.system.as_deref()).unwrap_or(function)
    }

    /// The node of a function.
    pub fn node(&self, function: &str) -> String {
        let own = self.0.get(function).and_then(|own| own.node.clone());
        own.unwrap_or_else(|| format!("{}_node", self.system(function)))
    }

    /// The mode of a design.
    pub fn mode<'s>(&'s self, function: &str, design: &'s str) -> &'s str {
        self.0.get(function).and_then(|own| own.modes.get(design)).map_or(design, String::as_str)
    }

    /// The mode of a function that nobody needs.
    pub fn unground(&self, function: &str) -> &str {
        self.0.get(function).and_then(|own| own.unground.as_deref()).unwrap_or(UNGROUND)
    }

    /// The design of a mode, among those that the function has.
    pub fn design(&self, function: &str, mode: &str, designs: &[String]) -> Option<String> {
        designs.iter().find(|design| self.mode(function, design) == mode).cloned()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::Settings;

    #[test]
    fn the_example_is_read() {
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
    fn what_is_wrong_is_said_with_its_place() {
        let directory = tempfile::tempdir().expect("a directory");
        let file = directory.path().join("ros.toml");
        std::fs::write(&file, "[tasks.a]\ngoal = 1\n").expect("written");
        let message = Settings::read(Some(&file), Path::new("m.toml")).expect_err("wrong");
        assert!(message.text().contains("ros.toml:2:8"), "{}", message.text());
    }
}
