//! Discovery of a robot: observes its graph, its diagnostics and its sensors for some seconds, and writes
//! settings to start from.
//!
//! All tables of the written file are comments, so the file changes nothing until a person has chosen from
//! them.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use metaplan::message::{Errors, Message};
use metaplan::setup::Setup;

use crate::interfaces::diagnostic_msgs::msg::{DiagnosticArray, DiagnosticStatus};
use crate::interfaces::lifecycle_msgs::srv::{GetState, GetStateRequest};
use crate::manager::components;
use crate::node::{Endpoints, Node, Severity, keep_all};

const SEARCH_PERIOD: Duration = Duration::from_millis(200);

const STATE_TIMEOUT: Duration = Duration::from_secs(2);

/// Placeholder for the user to replace.
const COMPONENT: &str = "COMPONENT";

const ATTRIBUTE: &str = "ATTRIBUTE";

/// Types of sensors whose rate is measured. Images and point clouds are excluded, because they would load the
/// network.
const RATED: [&str; 5] = [
    "sensor_msgs/msg/Imu",
    "sensor_msgs/msg/LaserScan",
    "sensor_msgs/msg/NavSatFix",
    "sensor_msgs/msg/Range",
    "nav_msgs/msg/Odometry",
];

/// Fields that are offered as measurements: message type, field, and factor that converts the value to the
/// usual unit.
const MEASURED: [(&str, &str, f64); 8] = [
    ("sensor_msgs/msg/BatteryState", "percentage", 100.0),
    ("sensor_msgs/msg/Illuminance", "illuminance", 1.0),
    ("sensor_msgs/msg/Range", "range", 1.0),
    ("sensor_msgs/msg/Temperature", "temperature", 1.0),
    ("std_msgs/msg/Float32", "data", 1.0),
    ("std_msgs/msg/Float64", "data", 1.0),
    ("std_msgs/msg/Int32", "data", 1.0),
    ("std_msgs/msg/Int64", "data", 1.0),
];

/// Options of the discovery.
#[derive(Debug, Clone)]
pub struct Options {
    /// Time of the observation.
    pub duration: Duration,
    /// New file for the settings. Without one, they are written to standard output.
    pub output: Option<PathBuf>,
    /// Manifest of a mission whose components and designs are used in the settings. Without one, the settings contain
    /// placeholders.
    pub mission: Option<PathBuf>,
}

#[derive(Debug, Default)]
struct Names {
    components: Vec<String>,
    designs: BTreeMap<String, Vec<String>>,
}

#[derive(Debug, Clone, Default, PartialEq)]
struct Diagnostic {
    hardware_id: String,
    /// Most severe level of all received statuses. `message` belongs to it.
    level: u8,
    message: String,
    /// Last value whose first word is a number, by key.
    numbers: BTreeMap<String, String>,
}

#[derive(Debug, Default)]
struct Robot {
    endpoints: Endpoints,
    diagnostics: BTreeMap<String, Diagnostic>,
    /// Labels of the states of the lifecycle nodes that have replied, by node.
    states: BTreeMap<String, String>,
    /// Messages per second on topics of the types in [`RATED`], by topic.
    rates: BTreeMap<String, f64>,
}

/// Observes the robot, and writes the settings.
///
/// # Errors
/// The mission or a parameter of the command line is wrong, a subscription fails, or the file exists or cannot be written.
pub fn run(node: &Arc<Node>, options: &Options, stop: &AtomicBool) -> Result<(), Errors> {
    if let Some(file) = options.output.as_ref().filter(|file| file.exists()) {
        let text = format!("{} exists and is not overwritten", file.display());
        return Err(vec![Message::error("N100", text).with_help("name another file with --output")].into());
    }
    let names = match &options.mission {
        Some(mission) => names(&Setup::read(mission)?),
        None => Names::default(),
    };
    for warning in node.declare(Vec::new(), |_, _| {})? {
        node.log(Severity::Warn, warning.text().trim_end());
    }
    node.log(Severity::Info, &format!("observes the robot for {:.0} s", options.duration.as_secs_f64()));
    let text = settings(&observe(node, options.duration, stop)?, &names);
    match &options.output {
        None => {
            use std::io::Write as _;
            std::io::stdout().write_all(text.as_bytes()).map_err(|error| unwritten(&error))?;
        }
        Some(file) => {
            std::fs::write(file, text).map_err(|error| unwritten(&error))?;
            node.log(Severity::Info, &format!("{} is written", file.display()));
        }
    }
    Ok(())
}

fn unwritten(error: &std::io::Error) -> Message {
    Message::error("N100", format!("the settings cannot be written: {error}"))
}

fn names(setup: &Setup) -> Names {
    let mission = &setup.mission;
    let designs = mission.functions().into_iter().map(|function| {
        let designs = mission.designs_of(&function);
        (function, designs)
    });
    Names { components: components(mission.knowledge()), designs: designs.collect() }
}

/// Observes the robot until the time is up or `stop` is set. Then requests the states of its lifecycle nodes.
fn observe(node: &Arc<Node>, duration: Duration, stop: &AtomicBool) -> Result<Robot, Message> {
    let diagnostics: Arc<Mutex<BTreeMap<String, Diagnostic>>> = Arc::default();
    let noted = Arc::clone(&diagnostics);
    node.subscribe::<DiagnosticArray>("/diagnostics", keep_all(), move |array| {
        let mut noted = noted.lock().unwrap_or_else(PoisonError::into_inner);
        for status in array.status {
            note(noted.entry(status.name.clone()).or_default(), status);
        }
    })?;
    // Signals compare rates in the time of the node, which may be simulated.
    let clock = node.clock();
    let (mut counts, start) = (BTreeMap::<String, (Duration, Arc<AtomicU64>)>::new(), Instant::now());
    while start.elapsed() < duration && !stop.load(Ordering::Relaxed) {
        for (topic, kind) in node.endpoints().topics {
            if RATED.contains(&kind.as_str()) && !counts.contains_key(&topic) {
                let count: Arc<AtomicU64> = Arc::default();
                let counter = Arc::clone(&count);
                node.subscribe_any(&topic, move || {
                    counter.fetch_add(1, Ordering::Relaxed);
                })?;
                counts.insert(topic, (clock.elapsed(), count));
            }
        }
        std::thread::sleep(SEARCH_PERIOD.min(duration.saturating_sub(start.elapsed())));
    }
    let endpoints = node.endpoints();
    let now = clock.elapsed();
    let rates = counts.into_iter().filter_map(|(topic, (since, count))| {
        let seconds = now.saturating_sub(since).as_secs_f64();
        // In a paused simulation no time passes, and no rate can be computed.
        (seconds > 0.0).then(|| (topic, count.load(Ordering::Relaxed) as f64 / seconds))
    });
    let rates = rates.collect();
    let state = |name: &String| {
        let (caller, name) = (node.caller::<GetState>(&format!("{name}/get_state")), name.clone());
        async move {
            let answer = caller.call(GetStateRequest::default(), STATE_TIMEOUT).await.ok()?;
            Some((name, answer.current_state.label))
        }
    };
    let states = smol::block_on(futures::future::join_all(endpoints.lifecycle_nodes.iter().map(state)));
    let states = states.into_iter().flatten().collect();
    let diagnostics = std::mem::take(&mut *diagnostics.lock().unwrap_or_else(PoisonError::into_inner));
    Ok(Robot { endpoints, diagnostics, states, rates })
}

fn note(diagnostic: &mut Diagnostic, status: DiagnosticStatus) {
    diagnostic.hardware_id = status.hardware_id;
    if status.level >= diagnostic.level {
        (diagnostic.level, diagnostic.message) = (status.level, status.message);
    }
    for pair in status.values {
        // Numbers may be followed by their unit.
        let word = pair.value.split_whitespace().next().unwrap_or_default();
        if word.parse::<f64>().is_ok_and(f64::is_finite) {
            diagnostic.numbers.insert(pair.key, pair.value);
        }
    }
}

/// Returns the text of the settings. Every table is a comment, and is valid without `# ` if the names of functions and
/// designs are bare keys of TOML.
fn settings(robot: &Robot, names: &Names) -> String {
    let mut text = String::from(
        "# Settings of Metaplan for the robot that was observed. Remove `# ` before the lines that you need, and fill in the\n\
         # names in capitals. The manual describes all keys.\n",
    );
    if !names.components.is_empty() {
        let _ = writeln!(text, "#\n# Components of the mission: {}.", names.components.join(", "));
    }
    section(&mut text, "Diagnostics of drivers", &diagnostics(robot, names));
    section(&mut text, "Lifecycle nodes, as components", &lifecycle(robot, names));
    section(&mut text, "Rates of sensors", &rates(robot, names));
    section(&mut text, "Values of topics", &values(robot));
    section(&mut text, "Functions and designs", &functions(robot, names));
    section(&mut text, "Services that steps can call", &services(robot));
    section(&mut text, "Actions", &actions(robot));
    text
}

fn section(text: &mut String, title: &str, tables: &[String]) {
    if tables.is_empty() {
        return;
    }
    let _ = writeln!(text, "\n## {title}");
    for table in tables {
        text.push('\n');
        for line in table.lines() {
            let _ = writeln!(text, "# {line}");
        }
    }
}

/// Returns the component with the longest name that is a part of `name`, or a placeholder. Case, the prefix
/// `c_`, and the difference between `_` and a space are ignored.
fn component<'n>(names: &'n Names, name: &str) -> &'n str {
    let name = name.to_lowercase();
    let is_similar = |component: &&String| {
        let bare = component.strip_prefix("c_").unwrap_or(component).to_lowercase();
        !bare.is_empty() && (name.contains(&bare) || name.contains(&bare.replace('_', " ")))
    };
    names
        .components
        .iter()
        .filter(is_similar)
        .max_by_key(|component| component.len())
        .map_or(COMPONENT, String::as_str)
}

fn diagnostics(robot: &Robot, names: &Names) -> Vec<String> {
    let mut tables = Vec::new();
    for (name, diagnostic) in &robot.diagnostics {
        // The messages of MROS's monitors are read without a table.
        if ["qa status", "component status"].contains(&diagnostic.message.to_lowercase().as_str()) {
            continue;
        }
        let level = match diagnostic.level {
            DiagnosticStatus::OK => "OK",
            DiagnosticStatus::WARN => "WARN",
            DiagnosticStatus::ERROR => "ERROR",
            _ => "STALE",
        };
        let comment = comment(&format!("most severe level: {level} ({})", diagnostic.message));
        let component = component(names, name);
        let name = quoted(name);
        tables.push(format!("[[diagnostics]]  {comment}\nname = {name}\ncomponent = {}", quoted(component)));
        for (key, value) in &diagnostic.numbers {
            let (key, comment) = (quoted(key), self::comment(value));
            tables.push(format!(
                "[[diagnostics]]\nname = {name}\nattribute = {ATTRIBUTE:?}\nkey = {key}  {comment}"
            ));
        }
    }
    tables
}

fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

fn comment(text: &str) -> String {
    format!("# {}", text.replace(char::is_control, " "))
}

fn lifecycle(robot: &Robot, names: &Names) -> Vec<String> {
    let nodes = robot.endpoints.lifecycle_nodes.iter();
    nodes
        .map(|node| {
            let state = robot.states.get(node).map_or("unknown", String::as_str);
            let component = component(names, node);
            format!(
                "[[signals]]\nnode = {node:?}\nstate = \"active\"  # now {state}\ncomponent = {component:?}"
            )
        })
        .collect()
}

fn rates(robot: &Robot, names: &Names) -> Vec<String> {
    let table = |(topic, rate): (&String, &f64)| {
        let component = component(names, topic);
        // Half of the present rate tolerates the usual variation.
        let least = (rate / 2.0 * 10.0).round() / 10.0;
        format!(
            "[[signals]]\ntopic = {topic:?}  # {rate:.1} messages per second\ncomponent = {component:?}\nat_least = {least:?}\nperiod = {:.1}",
            (10.0 / rate.max(1.0)).max(1.0)
        )
    };
    robot.rates.iter().filter(|(_, rate)| **rate > 0.0).map(table).collect()
}

fn values(robot: &Robot) -> Vec<String> {
    let mut tables = Vec::new();
    for (topic, kind) in &robot.endpoints.topics {
        for (_, field, scale) in MEASURED.iter().filter(|(measured, ..)| measured == kind) {
            let scale = if (*scale - 1.0).abs() > f64::EPSILON {
                format!("\nscale = {scale:?}")
            } else {
                String::new()
            };
            tables.push(format!(
                "[[signals]]\ntopic = {topic:?}\ntype = {kind:?}\nfield = {field:?}\nattribute = {ATTRIBUTE:?}{scale}"
            ));
        }
    }
    tables
}

fn functions(robot: &Robot, names: &Names) -> Vec<String> {
    let systems = &robot.endpoints.systems;
    let first_node = robot.endpoints.lifecycle_nodes.first().map_or("/NODE", String::as_str);
    let mut tables = Vec::new();
    for (function, designs) in &names.designs {
        if systems.contains(function) {
            tables.push(format!("[functions.{function}]\nsystem = {function:?}  # served by system_modes"));
            continue;
        }
        for design in designs {
            tables.push(format!(
                "[functions.{function}.designs.{design}]\nsteps = [\n    {{ node = {first_node:?}, state = \"active\" }},\n]"
            ));
        }
    }
    let unknown: Vec<&String> =
        systems.iter().filter(|system| !names.designs.contains_key(*system)).collect();
    tables.extend(
        unknown
            .iter()
            .map(|system| format!("[functions.FUNCTION_{}]\nsystem = {system:?}", system.replace('/', "_"))),
    );
    tables
}

fn services(robot: &Robot) -> Vec<String> {
    let step = |(service, kind): (&String, &String)| {
        let data = if kind.ends_with("SetBool") { ", data = true" } else { "" };
        format!("#     {{ service = {service:?}, type = {kind:?}{data} }},")
    };
    let is_usable = |(_, kind): &(&String, &String)| kind.starts_with("std_srvs/");
    let steps: Vec<String> = robot.endpoints.services.iter().filter(is_usable).map(step).collect();
    if steps.is_empty() { Vec::new() } else { vec![steps.join("\n")] }
}

fn actions(robot: &Robot) -> Vec<String> {
    let moves =
        robot.endpoints.actions.iter().filter(|(_, kind)| kind.as_str() == "nav2_msgs/action/NavigateToPose");
    moves
        .map(|(action, _)| format!("[actions.ACTION]\nby = \"navigate_to_pose\"\nserver = {action:?}"))
        .collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::path::Path;

    use super::{Diagnostic, Names, Robot, settings};
    use crate::manager::Settings;
    use crate::node::Endpoints;

    fn owned<const N: usize>(pairs: [(&str, &str); N]) -> BTreeMap<String, String> {
        pairs.map(|(name, value)| (name.to_owned(), value.to_owned())).into()
    }

    fn robot() -> Robot {
        let diagnostic = Diagnostic {
            hardware_id: "usb".to_owned(),
            level: 2,
            message: "no\nscan".to_owned(),
            numbers: owned([("Frequency", "9.8 Hz")]),
        };
        Robot {
            endpoints: Endpoints {
                topics: owned([
                    ("/battery", "sensor_msgs/msg/BatteryState"),
                    ("/scan", "sensor_msgs/msg/LaserScan"),
                ]),
                services: owned([("/lamp", "std_srvs/srv/SetBool"), ("/reset", "std_srvs/srv/Trigger")]),
                actions: owned([("/navigate_to_pose", "nav2_msgs/action/NavigateToPose")]),
                lifecycle_nodes: vec!["/amcl".to_owned()],
                systems: vec!["f_drive".to_owned(), "arm".to_owned()],
            },
            diagnostics: [("lidar: \"front\"".to_owned(), diagnostic)].into(),
            states: owned([("/amcl", "inactive")]),
            rates: [("/scan".to_owned(), 10.02)].into(),
        }
    }

    fn names() -> Names {
        let designs = [("f_drive", ["fd_fast"]), ("f_see", ["fd_camera"])];
        Names {
            components: vec!["c_lidar".to_owned(), "c_arm".to_owned()],
            designs: designs
                .map(|(function, names)| (function.to_owned(), names.map(str::to_owned).to_vec()))
                .into(),
        }
    }

    fn read(text: &str) -> Result<Settings, String> {
        let directory = tempfile::tempdir().expect("a directory");
        let file = directory.path().join("ros.toml");
        std::fs::write(&file, text).expect("written");
        Settings::read(Some(&file), Path::new("m.toml")).map_err(|message| message.text().to_owned())
    }

    #[test]
    fn the_written_settings_are_valid_with_and_without_their_comment_signs() {
        for names in [Names::default(), names()] {
            let text = settings(&robot(), &names);
            assert!(read(&text).is_ok_and(|settings| settings.signals().is_empty()), "{text}");
            let mut lines = Vec::new();
            for line in text.lines() {
                lines.push(line.strip_prefix("# ").unwrap_or(line));
            }
            // The introduction is prose.
            let start = lines.iter().position(|line| line.starts_with("## ")).expect("a section");
            let settings = read(&lines[start..].join("\n")).expect("valid settings");
            assert_eq!(settings.signals().len(), 3, "{text}");
            assert_eq!(settings.rules().len(), 2, "{text}");
        }
    }

    #[test]
    fn components_of_the_mission_are_suggested_by_name() {
        let text = settings(&robot(), &names());
        assert!(text.contains("name = 'lidar: \"front\"'\n# component = \"c_lidar\""), "{text}");
        assert!(text.contains("[functions.f_see.designs.fd_camera]"), "{text}");
        assert!(text.contains("at_least = 5.0"), "{text}");
    }
}
