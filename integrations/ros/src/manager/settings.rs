//! Settings of a mission on a robot: the file of `--settings`.

use std::collections::BTreeMap;
use std::path::Path;

use metaplan::message::{Errors, Message, did_you_mean};
use metaplan::mission::Mission;
use serde::Deserialize;
use toml::Spanned;

use crate::diagnostic_rules::DiagnosticRule;
use crate::performer::{By, Offered, Poses};
use crate::procedure::Procedure;
use crate::signals::Signal;
use crate::types::{Definition, Library};

/// Default mode of a function that is not needed.
const UNGROUND: &str = "fd_unground";

/// Contents of the settings file.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Definitions of types that this package does not know, by their full names.
    #[serde(default)]
    #[expect(dead_code, reason = "read by `DefinitionsOnly`, before all other tables")]
    types: BTreeMap<String, Definition>,
    /// Tasks by the names with which they are requested.
    #[serde(default)]
    pub tasks: BTreeMap<String, TaskSettings>,
    /// Names of functions and designs in `system_modes`, if they differ, or steps that put designs into effect.
    #[serde(default)]
    pub functions: Functions,
    /// Diagnostics of drivers that report a component or measure an attribute.
    #[serde(default)]
    pub diagnostics: Vec<Spanned<DiagnosticRule>>,
    #[serde(default)]
    pub(crate) signals: Vec<Spanned<Signal>>,
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
    /// Name and text of the settings file, so that errors found after parsing can show their position.
    #[serde(skip)]
    source: Source,
}

#[derive(Debug, Deserialize)]
struct DefinitionsOnly {
    #[serde(default)]
    types: BTreeMap<Spanned<String>, Definition>,
}

/// Names and texts that are checked against the mission, with their positions.
#[derive(Debug, Default, Deserialize)]
struct Located {
    #[serde(default)]
    tasks: BTreeMap<String, LocatedTask>,
    #[serde(default)]
    actions: BTreeMap<Spanned<String>, toml::Value>,
}

#[derive(Debug, Deserialize)]
struct LocatedTask {
    goal: Spanned<String>,
    #[serde(default)]
    facts: BTreeMap<Spanned<String>, toml::Value>,
}

#[derive(Debug, Clone, Default)]
struct Source {
    name: String,
    text: String,
}

impl Source {
    fn error<T>(&self, code: &str, key: &Spanned<T>, text: impl Into<String>) -> Message {
        let place = position(&self.text, key.span().start);
        Message::at(code, &self.name, Some(place), text).with_source(&self.text)
    }
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TaskSettings {
    /// PDDL condition that ends the task.
    pub goal: String,
    /// Facts and values that are set when the task begins, as with `--set`.
    #[serde(default)]
    pub facts: BTreeMap<String, toml::Value>,
}

pub(super) fn fact_value(value: &toml::Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// Autopilot, whose mode shows whether the robot executes commands.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Autopilot {
    /// Topic of type `mavros_msgs/State`.
    pub topic: String,
    /// Mode in which the robot executes commands.
    pub mode: String,
}

/// Functions on the robot, by their names in the knowledge base. The designs of a function are either put into effect
/// by steps, or are modes of `system_modes`, with the same names unless others are given.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(transparent)]
pub struct Functions(BTreeMap<Spanned<String>, FunctionSettings>);

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct FunctionSettings {
    /// Name of the system in `system_modes`, without slash; the name of the function by default.
    system: Option<String>,
    /// Node of the function; `<system>_node` by default.
    node: Option<String>,
    /// Mode while the function is not needed; `fd_unground` by default.
    unground: Option<String>,
    /// Modes of designs, by design. The default is the name of the design.
    #[serde(default)]
    modes: BTreeMap<Spanned<String>, String>,
    /// Steps, by design. If there are any, `system_modes` is not used.
    #[serde(default)]
    designs: BTreeMap<Spanned<String>, Procedure>,
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
        let source = Source { name, text };
        let invalid = |error: toml::de::Error| {
            let place = error.span().map(|span| position(&source.text, span.start));
            Message::at("N130", &source.name, place, error.message()).with_source(&source.text)
        };
        // The types come first, because all other tables are checked against them.
        let definitions: DefinitionsOnly = toml::from_str(&source.text).map_err(invalid)?;
        let directory = file.parent().unwrap_or(Path::new(""));
        let mut library = Library::installed();
        for (kind, definition) in &definitions.types {
            let added = definition.text(directory).and_then(|text| library.add(kind.get_ref(), &text));
            added.map_err(|because| {
                source.error("N136", kind, format!("{}: {because}", kind.get_ref())).with_help(
                    "give the text of the definition, or `{ file = \"…\" }` with the path of its file",
                )
            })?;
        }
        let settings: Result<Self, _> = library.while_current(|| toml::from_str(&source.text));
        Ok(Self { source: source.clone(), ..settings.map_err(invalid)? })
    }

    pub(crate) fn rules(&self) -> Vec<DiagnosticRule> {
        self.diagnostics.iter().map(|rule| rule.get_ref().clone()).collect()
    }

    pub(crate) fn signals(&self) -> Vec<Signal> {
        self.signals.iter().map(|signal| signal.get_ref().clone()).collect()
    }

    /// Checks that the mission has the components and attributes of diagnostics and signals. `attribute`
    /// returns the reason why a name cannot be measured.
    ///
    /// # Errors
    /// Reports all components that the mission does not have, and all attributes that cannot be measured.
    pub(crate) fn check_targets(
        &self,
        components: &[String],
        attribute: impl Fn(&str) -> Result<(), String>,
    ) -> Result<(), Errors> {
        let fault = |(component, measured): (Option<&str>, Option<&str>)| match (component, measured) {
            (Some(name), _) if !components.iter().any(|component| component == name) => {
                let suggestion = did_you_mean(name, components.iter().map(String::as_str));
                Some(format!(
                    "the knowledge base has no component `{name}`; it has {}{suggestion}",
                    components.join(", ")
                ))
            }
            (_, Some(name)) => attribute(name).err(),
            _ => None,
        };
        let help = "use a component, or an attribute that is measured, of the knowledge base";
        let of_rules = self.diagnostics.iter().filter_map(|rule| {
            fault(rule.get_ref().target()).map(|text| self.source.error("N135", rule, text).with_help(help))
        });
        let of_signals = self.signals.iter().filter_map(|signal| {
            fault(signal.get_ref().target())
                .map(|text| self.source.error("N135", signal, text).with_help(help))
        });
        let errors: Vec<Message> = of_rules.chain(of_signals).collect();
        if errors.is_empty() { Ok(()) } else { Err(errors.into()) }
    }

    /// Checks the goals and facts of tasks and the names of actions against the mission. A task with a wrong goal would
    /// never end, and an action of the plan whose table has another name would succeed at once.
    ///
    /// # Errors
    /// Reports all tasks and actions that do not fit the mission.
    pub(crate) fn check_mission(&self, mission: &Mission) -> Result<(), Errors> {
        // This cannot fail, because `read` has parsed the text.
        let Located { tasks, actions } = toml::from_str(&self.source.text).unwrap_or_default();
        let mut errors = Vec::new();
        for (task, LocatedTask { goal, facts }) in &tasks {
            if let Err(messages) = mission.goal(goal.get_ref()) {
                let reasons: Vec<&str> = messages.iter().map(|message| message.message.as_str()).collect();
                let text = format!("the goal of the task {task} is wrong: {}", reasons.join("; "));
                errors.push(self.source.error("N130", goal, text));
            }
            for (fact, value) in facts {
                let mut copy = mission.clone();
                let set = copy.set_in_problem(fact.get_ref(), &fact_value(value)).map_err(Errors::from);
                if let Err(messages) = set.and_then(|_| copy.filled()) {
                    let reasons: Vec<&str> =
                        messages.iter().map(|message| message.message.as_str()).collect();
                    let text = format!("a fact of the task {task} is wrong: {}", reasons.join("; "));
                    errors.push(self.source.error("N130", fact, text));
                }
            }
        }
        let names: Vec<String> =
            mission.domain().actions.iter().map(|action| action.identifier.name.to_string()).collect();
        for action in actions.keys() {
            let name = action.get_ref();
            if !names.iter().any(|known| known.eq_ignore_ascii_case(name)) {
                let suggestion = did_you_mean(name, names.iter().map(String::as_str));
                let text = format!("the domain has no action `{name}`{suggestion}");
                errors.push(
                    self.source
                        .error("N130", action, text)
                        .with_help("use the name of an action of the domain"),
                );
            }
        }
        if errors.is_empty() { Ok(()) } else { Err(errors.into()) }
    }

    /// Checks the functions in the settings and their steps against the mission. `designs` are the mission's designs,
    /// by function.
    ///
    /// # Errors
    /// A function or a design does not exist, a design has no steps although other designs of its function have, a
    /// function has both steps and names for `system_modes`, or a command is not allowed.
    pub(crate) fn check_steps(
        &self,
        designs: &BTreeMap<String, Vec<String>>,
        are_commands_allowed: bool,
    ) -> Result<(), Errors> {
        let mut errors = Vec::new();
        for (function, settings) in &self.functions.0 {
            let mut error = |code, key, text: String, help: &str| {
                errors.push(self.source.error(code, key, text).with_help(help));
            };
            let name = function.get_ref();
            let has_names =
                settings.system.is_some() || settings.node.is_some() || !settings.modes.is_empty();
            if settings.has_steps() && has_names {
                error(
                    "N133",
                    function,
                    format!("the function {name} has steps for its designs, and names for `system_modes`"),
                    "remove `system`, `node` and `modes`, or remove `designs`",
                );
            }
            let Some(known) = designs.get(name) else {
                let suggestion = did_you_mean(name, designs.keys().map(String::as_str));
                let text = format!("the mission has no function `{name}`{suggestion}");
                error("N133", function, text, "use the name of a function of the knowledge base");
                continue;
            };
            for design in settings.modes.keys().filter(|design| !known.contains(design.get_ref())) {
                let suggestion = did_you_mean(design.get_ref(), known.iter().map(String::as_str));
                let text = format!("the function {name} has no design `{}`{suggestion}", design.get_ref());
                error("N133", design, text, &format!("its designs are {}", known.join(", ")));
            }
            if !settings.has_steps() {
                continue;
            }
            let unground = settings.unground.as_deref().unwrap_or(UNGROUND);
            for (design, procedure) in &settings.designs {
                let written = design.get_ref();
                if written != unground && !known.contains(written) {
                    let suggestion = did_you_mean(written, known.iter().map(String::as_str));
                    error(
                        "N133",
                        design,
                        format!("the function {name} has no design `{written}`{suggestion}"),
                        &format!(
                            "its designs are {}; `{unground}` is used while it is not needed",
                            known.join(", ")
                        ),
                    );
                }
                if procedure.has_command() && !are_commands_allowed {
                    error(
                        "N134",
                        design,
                        format!("the steps of {written} execute a command, which is not allowed"),
                        "start the program with --allow-commands if you trust this file, or remove the command",
                    );
                }
            }
            let missing: Vec<&str> = known
                .iter()
                .map(String::as_str)
                .filter(|design| !settings.designs.contains_key(*design))
                .collect();
            if !missing.is_empty() {
                error(
                    "N133",
                    function,
                    format!("the function {name} has no steps for {}", missing.join(", ")),
                    &format!("add a table `[functions.{name}.designs.{}]` with `steps`", missing[0]),
                );
            }
        }
        if errors.is_empty() { Ok(()) } else { Err(errors.into()) }
    }
}

impl FunctionSettings {
    fn has_steps(&self) -> bool {
        !self.designs.is_empty()
    }
}

/// Returns the line and the column (in characters) of a byte offset, both from 1.
fn position(text: &str, at: usize) -> (usize, usize) {
    let before = text.get(..at).unwrap_or(text);
    let line = before.rsplit('\n').next().unwrap_or_default();
    (before.matches('\n').count() + 1, line.chars().count() + 1)
}

impl Functions {
    /// Returns the name of a function's system, by default the name of the function.
    pub fn system<'s>(&'s self, function: &'s str) -> &'s str {
        self.0.get(function).and_then(|settings| settings.system.as_deref()).unwrap_or(function)
    }

    /// Returns the node of a function, by default `<system>_node`.
    pub fn node(&self, function: &str) -> String {
        let node = self.0.get(function).and_then(|node| node.node.clone());
        node.unwrap_or_else(|| format!("{}_node", self.system(function)))
    }

    /// Returns the mode of a design, by default the name of the design.
    pub fn mode<'s>(&'s self, function: &str, design: &'s str) -> &'s str {
        self.0.get(function).and_then(|settings| settings.modes.get(design)).map_or(design, String::as_str)
    }

    /// Returns the mode of a function that is not needed. `None` if the function then keeps its design, because it has
    /// steps for its designs and none for this mode.
    pub fn unground(&self, function: &str) -> Option<&str> {
        let Some(settings) = self.0.get(function) else { return Some(UNGROUND) };
        let mode = settings.unground.as_deref().unwrap_or(UNGROUND);
        (!settings.has_steps() || settings.designs.contains_key(mode)).then_some(mode)
    }

    pub(crate) fn has_steps(&self, function: &str) -> bool {
        self.0.get(function).is_some_and(FunctionSettings::has_steps)
    }

    pub(crate) fn procedures(&self) -> BTreeMap<String, BTreeMap<String, Procedure>> {
        let of_function = |settings: &FunctionSettings| {
            settings
                .designs
                .iter()
                .map(|(mode, procedure)| (mode.get_ref().clone(), procedure.clone()))
                .collect()
        };
        let with_steps = self.0.iter().filter(|(_, settings)| settings.has_steps());
        with_steps.map(|(function, settings)| (function.get_ref().clone(), of_function(settings))).collect()
    }

    /// Returns the one of the given designs of a function that has this mode, if there is one.
    pub fn design(&self, function: &str, mode: &str, designs: &[String]) -> Option<String> {
        designs.iter().find(|design| self.mode(function, design) == mode).cloned()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use metaplan::message::Message;
    use metaplan::setup::Setup;

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

    /// Reads settings and returns the error of the file, or all errors of the check against two functions.
    fn wrong(text: &str, are_commands_allowed: bool) -> String {
        let directory = tempfile::tempdir().expect("a directory");
        let file = directory.path().join("ros.toml");
        std::fs::write(&file, text).expect("written");
        let designs = [("f_go", vec!["fd_fast", "fd_slow"]), ("f_see", vec!["fd_camera"])];
        let designs = designs.map(|(function, designs)| {
            (function.to_owned(), designs.into_iter().map(str::to_owned).collect())
        });
        let settings = match Settings::read(Some(&file), Path::new("m.toml")) {
            Ok(settings) => settings,
            Err(message) => return message.text().to_owned(),
        };
        match settings.check_steps(&designs.into(), are_commands_allowed) {
            Ok(()) => String::new(),
            Err(errors) => errors.iter().map(Message::text).collect(),
        }
    }

    #[test]
    fn steps_that_do_not_fit_have_source_locations_and_remedies() {
        let table =
            |design: &str, step: &str| format!("[functions.f_go.designs.{design}]\nsteps = [{step}]\n");
        let active = r#"{ node = "/a", state = "active" }"#;
        let (fast, slow) = (table("fd_fast", active), table("fd_slow", active));
        assert_eq!(wrong(&format!("{fast}{slow}"), false), "");
        assert_eq!(wrong(&format!("{fast}{slow}{}", table("fd_unground", active)), false), "");
        for (text, parts) in [
            (fast.clone(), ["ros.toml:1:12", "no steps for fd_slow", "[functions.f_go.designs.fd_slow]"]),
            (
                format!("{fast}{slow}{}", table("fd_slw", active)),
                ["ros.toml:5:25", "no design `fd_slw`; did you mean `fd_slow`?", "its designs are"],
            ),
            (
                format!("{fast}{slow}").replace("f_go", "f_gu"),
                ["ros.toml:1:12", "no function `f_gu`; did you mean `f_go`?", "knowledge base"],
            ),
            (
                format!("[functions.f_go]\nsystem = \"go\"\n{fast}{slow}"),
                ["ros.toml:1:12", "names for `system_modes`", "remove `system`"],
            ),
            (
                "[functions.f_gu]\nsystem = \"go\"\n".to_owned(),
                ["ros.toml:1:12", "no function `f_gu`; did you mean `f_go`?", "knowledge base"],
            ),
            (
                "[functions.f_go.modes]\nfd_slw = \"slow\"\n".to_owned(),
                ["ros.toml:2:1", "no design `fd_slw`; did you mean `fd_slow`?", "its designs are"],
            ),
            (
                format!("{fast}{}", table("fd_slow", r#"{ command = ["x"] }"#)),
                ["N134", "ros.toml:3:25", "--allow-commands"],
            ),
            (
                format!("{fast}{}", table("fd_slow", r#"{ node = "/a" }"#)),
                ["N130", "ros.toml:4:10", "either a `state` or `parameters`"],
            ),
            (
                format!("{fast}{}", table("fd_slow", r#"{ node = "/a", state = "on" }"#)),
                ["N130", "ros.toml:4:33", "expected one of"],
            ),
        ] {
            let message = wrong(&text, false);
            for part in parts {
                assert!(message.contains(part), "{part} is not in: {message}");
            }
        }
        assert_eq!(wrong(&format!("{fast}{}", table("fd_slow", r#"{ command = ["x"] }"#)), true), "");
    }

    #[test]
    fn tasks_and_actions_that_do_not_fit_have_source_locations() {
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/suave/suave.toml");
        let mission = Setup::read(&manifest).expect("the mission is read").mission;
        let example = Settings::read(None, &manifest).expect("settings");
        assert!(example.check_mission(&mission).is_ok());
        let directory = tempfile::tempdir().expect("a directory");
        let file = directory.path().join("ros.toml");
        for (text, parts) in [
            (
                "[tasks.a]\ngoal = \"(pipline_found pl1)\"\n",
                ["ros.toml:2:8", "the goal of the task a is wrong"],
            ),
            (
                "[tasks.a]\ngoal = \"(and)\"\nfacts = { \"pipline_found pl1\" = true }\n",
                ["ros.toml:3:11", "a fact of the task a is wrong"],
            ),
            (
                "[actions.rechrge]\nby = \"actions_hub\"\n",
                ["ros.toml:1:10", "no action `rechrge`; did you mean `recharge`?"],
            ),
        ] {
            std::fs::write(&file, text).expect("written");
            let settings = Settings::read(Some(&file), &manifest).expect("settings");
            let errors = settings.check_mission(&mission).expect_err("it does not fit");
            let message: String = errors.iter().map(Message::text).collect();
            for part in ["N130"].iter().chain(&parts) {
                assert!(message.contains(part), "{part} is not in: {message}");
            }
        }
    }
}
