//! The program `metaplan-ros`.
#![expect(
    clippy::print_stderr,
    reason = "what is wrong with the command line is said before there is a node"
)]

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::{Parser, ValueEnum};
use metaplan::message::Message;
use metaplan_ros::node::{Network, Node, Opening, Rmw, RosArguments, Severity};
use metaplan_ros::performer::PlanVersion;
use metaplan_ros::{controller, manager, planner};

/// Metaplan on a ROS 2 robot, over DDS and without a ROS installation.
///
/// What stands behind `--ros-args` is as for every node: `-r from:=to`, `-p name:=value`, `--params-file FILE`, `--log-level LEVEL`.
/// `ROS_DOMAIN_ID`, `ROS_LOCALHOST_ONLY` and `ROS_AUTOMATIC_DISCOVERY_RANGE` count.
#[derive(Debug, Parser)]
#[command(version)]
struct Arguments {
    /// A mission's manifest; a planner needs none.
    #[arg(long, value_name = "FILE", required_if_eq_any([("role", "manager"), ("role", "controller")]))]
    mission: Option<PathBuf>,
    /// Whose place to take.
    #[arg(long = "as", value_enum, default_value_t = Role::Manager)]
    role: Role,
    /// How the mission meets the robot; `ros.toml` beside the mission, if there is one, unless said otherwise.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Write events and decisions there first, and go on from there after a crash.
    #[arg(long, value_name = "DIR")]
    journal: Option<PathBuf>,
    /// How services are mapped: as the discovered participants say, or as this middleware does.
    #[arg(long, value_enum, default_value_t = Rmw::Auto)]
    rmw: Rmw,
    /// With `--as controller`: whose types PlanSys2's executor has.
    #[arg(long, value_enum, default_value_t)]
    executor: PlanVersion,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Role {
    /// Of the manager of tasks: SUAVE's task bridge, MROS's reasoner and the planner in one.
    Manager,
    /// Of PlanSys2's planner; with a mission, its knowledge base joins in.
    Planner,
    /// Of whoever has PlanSys2's executor carry out what its experts want: with a knowledge base, and again when a design is lost.
    Controller,
}

impl Role {
    /// What the node is called, unless it is said otherwise.
    fn node(self) -> &'static str {
        match self {
            Self::Manager | Self::Controller => "metaplan",
            Self::Planner => "planner",
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
            ExitCode::from(2)
        }
    }
}

fn start() -> Result<(), Vec<Message>> {
    let (words, ros) = RosArguments::split(std::env::args())?;
    let arguments = Arguments::parse_from(words);
    let (network, warnings) =
        Network::from_environment(|name| std::env::var(name).ok()).map_err(|message| vec![message])?;
    let opening =
        Opening { name: arguments.role.node().to_owned(), arguments: ros, network, rmw: arguments.rmw };
    let node = Node::open(opening).map_err(|message| vec![message])?;
    for warning in warnings {
        node.log(Severity::Warn, warning.text().trim_end());
    }
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    // A second signal ends the program at once.
    let handler = move || {
        if asked.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    };
    ctrlc::set_handler(handler)
        .map_err(|error| vec![Message::error("N100", format!("signals cannot be heard: {error}"))])?;
    let Arguments { mission, settings, journal, executor, .. } = arguments;
    match arguments.role {
        Role::Manager => {
            let mission = mission.unwrap_or_default();
            manager::run(&node, &manager::Options { mission, settings, journal }, &stop)
        }
        Role::Controller => {
            let options = controller::Options { mission: mission.unwrap_or_default(), version: executor };
            controller::run(&node, &options, &stop)
        }
        Role::Planner => planner::run(&node, &planner::Options { mission, settings }, &stop),
    }
}
