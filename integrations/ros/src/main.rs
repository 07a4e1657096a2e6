//! The program `metaplan-ros`.
#![expect(
    clippy::print_stderr,
    reason = "what is wrong with the command line is said before there is a node"
)]

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::{Parser, ValueEnum};
use metaplan::message::{Errors, Message};
use metaplan_ros::node::{Network, Node, Opening, Rmw, RosArguments, Severity};
use metaplan_ros::performer::PlanVersion;
use metaplan_ros::{controller, discover, manager, planner, reasoner};

/// Metaplan on a ROS 2 robot, over DDS and without a ROS installation.
///
/// Arguments after `--ros-args` have the form that all ROS 2 nodes use: `-r from:=to`, `-p name:=value`, `--params-file FILE`,
/// `--log-level LEVEL`. The environment variables `ROS_DOMAIN_ID`, `ROS_LOCALHOST_ONLY` and `ROS_AUTOMATIC_DISCOVERY_RANGE`
/// take effect.
#[derive(Debug, Parser)]
#[command(version)]
struct Arguments {
    /// Read the manifest of the mission. Optional for the planner, which otherwise plans with the received domain
    /// alone, and for the discovery, which otherwise writes placeholders.
    #[arg(long, value_name = "FILE", required_if_eq_any = [("role", "manager"), ("role", "reasoner"), ("role", "controller")])]
    mission: Option<PathBuf>,
    /// Set the role of this node.
    #[arg(long = "as", value_enum, default_value_t = Role::Manager)]
    role: Role,
    /// Read the mapping between mission and robot from this file. [default: `ros.toml` in the directory of the manifest, if it exists]
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Write events and decisions to a journal in this directory before acting on them, and resume from it after a
    /// crash. For the manager and the reasoner only. A reasoner stores only its objectives and the latest reports.
    #[arg(long, value_name = "DIR")]
    journal: Option<PathBuf>,
    /// Set how long `--as discover` observes the robot, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 30.0, value_parser = seconds)]
    seconds: f64,
    /// Write the settings of `--as discover` to a new file instead of standard output.
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Set the ROS middleware whose encoding of service requests is used. By default, it is detected from the other participants.
    #[arg(long, value_enum, default_value_t = Rmw::Auto)]
    rmw: Rmw,
    /// Allow steps of designs in the settings to execute commands on this machine.
    #[arg(long)]
    allow_commands: bool,
    /// Set the version of PlanSys2 whose message types the executor has, for `--as controller`.
    #[arg(long, value_enum, default_value_t)]
    executor: PlanVersion,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Role {
    /// Task manager: replaces SUAVE's task bridge, MROS's reasoner and the planner.
    Manager,
    /// MROS reasoner: serves the action `/mros/objective`.
    Reasoner,
    /// PlanSys2 planner: uses the knowledge base of the mission, if a mission is given.
    Planner,
    /// PlanSys2 controller: plans for the goal of the problem expert, has the executor carry out the plan, and replans when a design is lost.
    Controller,
    /// Observer of a robot: writes commented settings to start from.
    Discover,
}

fn seconds(text: &str) -> Result<f64, String> {
    let time = text.parse().ok().filter(|seconds| (f64::MIN_POSITIVE..=86_400.0).contains(seconds));
    time.ok_or_else(|| "a number of seconds greater than 0, and at most 86400, is expected".to_owned())
}

impl Role {
    /// Default name of the node. PlanSys2 finds its planner by the name `planner`.
    fn node(self) -> &'static str {
        match self {
            Self::Manager | Self::Reasoner | Self::Controller => "metaplan",
            Self::Planner => "planner",
            Self::Discover => "metaplan_discover",
        }
    }
}

fn main() -> ExitCode {
    match start() {
        Ok(()) => ExitCode::SUCCESS,
        Err(messages) => {
            for message in &messages {
                eprint!("{}", message.text());
            }
            ExitCode::from(status(&messages))
        }
    }
}

/// Exit status for errors: 75 (`EX_TEMPFAIL` of `sysexits.h`) if the network is not up yet, so that a
/// supervisor tries again; otherwise 2.
fn status(messages: &[Message]) -> u8 {
    let is_temporary = messages.iter().all(|message| message.code == "N120");
    if is_temporary { 75 } else { 2 }
}

fn start() -> Result<(), Errors> {
    let (words, ros) = RosArguments::split(std::env::args())?;
    let arguments = Arguments::parse_from(words);
    let (network, warnings) = Network::from_environment(|name| std::env::var(name).ok())?;
    let opening =
        Opening { name: arguments.role.node().to_owned(), arguments: ros, network, rmw: arguments.rmw };
    let node = Node::open(opening)?;
    for warning in warnings {
        node.log(Severity::Warn, warning.text().trim_end());
    }
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    // A second signal ends the program immediately.
    let handler = move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    };
    ctrlc::set_handler(handler).map_err(|error| {
        vec![Message::error("N100", format!("the signal handler cannot be installed: {error}"))]
    })?;
    let Arguments { role, mission, settings, journal, executor, allow_commands, seconds, output, .. } =
        arguments;
    if journal.is_some() && matches!(role, Role::Planner | Role::Controller | Role::Discover) {
        let text = "`--journal` is for a manager and a reasoner: the other roles have no persistent state";
        return Err(vec![Message::error("N100", text)].into());
    }
    if output.is_some() && role != Role::Discover {
        let text = "`--output` is for the discovery: no other role writes settings";
        return Err(vec![Message::error("N100", text)].into());
    }
    let ended = match (role, mission) {
        (Role::Discover, mission) => {
            let duration = Duration::from_secs_f64(seconds);
            discover::run(&node, &discover::Options { duration, output, mission }, &stop)
        }
        (Role::Planner, mission) => planner::run(&node, &planner::Options { mission, settings }, &stop),
        (Role::Controller, Some(mission)) => {
            controller::run(&node, &controller::Options { mission, version: executor }, &stop)
        }
        (Role::Manager, Some(mission)) => {
            manager::run(&node, &manager::Options { mission, settings, journal, allow_commands }, &stop)
        }
        (Role::Reasoner, Some(mission)) => {
            reasoner::run(&node, &reasoner::Options { mission, settings, journal, allow_commands }, &stop)
        }
        (_, None) => Err(vec![Message::error("N100", "`--mission` is missing")].into()),
    };
    node.close();
    ended
}
