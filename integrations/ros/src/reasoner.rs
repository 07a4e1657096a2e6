//! Replacement of MROS's reasoner (`mros2_reasoner` \[1\]). Functions are requested as goals of the
//! action `/mros/objective`, and receive the best available design.
//!
//! Designs are selected by [`metaplan::configure`], as in MROS, and requested by `/mros/request_configuration`. If
//! only `/<function>/change_mode` has a server, that service is used. Steps in the settings replace both services.
//! The status of an objective is published when the goal is accepted, when its function has a new design, and every
//! `reasoning_period`. A cancelled goal ends once its function has its unground mode. Without such a mode, or if
//! another goal needs the function, it ends at once.
//!
//! \[1\] Bozhinoski et al., MROS: Runtime Adaptation For Robot Control Architectures, Advanced Robotics 36, 2022.

mod keeping;
mod memory;
mod network;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use metaplan::configure::{Configurator, Keeper, Wishes};
use metaplan::message::{Errors, Message};
use metaplan::setup::Setup;

use crate::diagnosed::Sources;
use crate::manager::{Settings, components};
use crate::node::{Node, Severity};

use keeping::Keeping;
use memory::MemoryFile;
use network::Network;

const SELECTION_TIME_LIMIT: std::time::Duration = std::time::Duration::from_secs(1);

/// Options of the reasoner.
#[derive(Debug, Clone)]
pub struct Options {
    /// Manifest of the mission, of which only the knowledge base is used.
    pub mission: PathBuf,
    /// Settings of the robot, such as the names of its functions and designs; by default a file `ros.toml` in the
    /// directory of the mission.
    pub settings: Option<PathBuf>,
    /// Directory of the state that must survive a restart.
    pub journal: Option<PathBuf>,
    /// `true` if the steps of designs may execute commands.
    pub allow_commands: bool,
}

/// Serves objectives until `stop` is set.
///
/// # Errors
/// The mission or its settings are wrong, a topic or service cannot be created, or the state file cannot be
/// read or written.
pub fn run(node: &Arc<Node>, options: &Options, stop: &AtomicBool) -> Result<(), Errors> {
    let to_errors = |message: Message| Errors::from(message);
    let Setup { mission, .. } = Setup::read(&options.mission)?;
    let settings = Settings::read(options.settings.as_deref(), &options.mission).map_err(to_errors)?;
    let knowledge = mission.knowledge().cloned().ok_or_else(|| {
        to_errors(Message::error(
            "N140",
            "the mission has no knowledge base, from which designs could be chosen",
        ))
    })?;
    for warning in knowledge.warnings() {
        node.log(Severity::Warn, warning.text().trim_end());
    }
    let mut designs: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for design in knowledge.view().function_designs() {
        for function in design.solves {
            designs.entry(function.name).or_default().push(design.individual.name.clone());
        }
    }
    settings.check_steps(&designs, options.allow_commands)?;
    let attribute = |name: &str| {
        let text = || format!("the knowledge base has no quality attribute `{name}`");
        knowledge.has_attribute(name).then_some(()).ok_or_else(text)
    };
    settings.check_targets(&components(Some(&knowledge)), attribute)?;
    let configurator = Configurator::new(knowledge, Wishes::default())?;
    let procedures = settings.functions.procedures();
    let sources = Sources { rules: settings.rules(), signals: settings.signals(), ..Sources::default() };
    let keeping = Keeping::new(Keeper::new(configurator, Some(SELECTION_TIME_LIMIT)), settings.functions);
    let memory = options.journal.as_deref().map(MemoryFile::open).transpose().map_err(to_errors)?;
    Network::connect(node, keeping, procedures, sources, memory)?.run(stop).map_err(to_errors)
}
