//! In the place of MROS's reasoner (`mros2_reasoner` \[1\]): functions are asked for as goals of the action `/mros/objective`, and get the
//! best design that can be had now.
//!
//! Designs are chosen by [`metaplan::configure`], as MROS chooses them, and asked for by `/mros/request_configuration`, or by
//! `/<function>/change_mode` where nobody serves that. What is told of an objective is told as soon as it changes, and each
//! `reasoning_period` besides. A goal is cancelled once its function has given up its design.
//!
//! \[1\] Bozhinoski et al., MROS: Runtime Adaptation For Robot Control Architectures, Advanced Robotics 36, 2022.

mod keeping;
mod memory;
mod network;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use metaplan::configure::{Configurator, Keeper, Wishes};
use metaplan::message::{Errors, Message};
use metaplan::setup::Setup;

use crate::manager::Settings;
use crate::node::{Node, Severity};

use keeping::Keeping;
use memory::MemoryFile;
use network::Network;

/// So long a choice may take.
const LIMIT: std::time::Duration = std::time::Duration::from_secs(1);

/// What the reasoner is started with.
#[derive(Debug, Clone)]
pub struct Options {
    /// A mission's manifest, of which the knowledge base counts.
    pub mission: PathBuf,
    /// What functions and designs are called on the robot; a file `ros.toml` beside the mission unless said otherwise.
    pub settings: Option<PathBuf>,
    /// Where is kept what has to be known after a restart.
    pub journal: Option<PathBuf>,
}

/// Serves objectives until told to stop.
///
/// # Errors
/// The mission or its settings are wrong, or a topic or service cannot be made.
pub fn run(node: &Arc<Node>, options: &Options, stop: &AtomicBool) -> Result<(), Errors> {
    let one = |message: Message| Errors::from(message);
    let Setup { mission, .. } = Setup::read(&options.mission)?;
    let settings = Settings::read(options.settings.as_deref(), &options.mission).map_err(one)?;
    let knowledge = mission.knowledge().cloned().ok_or_else(|| {
        one(Message::error("N140", "the mission has no knowledge base, from which designs could be chosen"))
    })?;
    for warning in knowledge.warnings() {
        node.log(Severity::Warn, warning.text().trim_end());
    }
    let configurator = Configurator::new(knowledge, Wishes::default())?;
    let keeping = Keeping::new(Keeper::new(configurator, Some(LIMIT)), settings.functions);
    let memory = options.journal.as_deref().map(MemoryFile::open).transpose().map_err(one)?;
    Network::connect(node, keeping, &settings.diagnostics, memory)?.run(stop).map_err(one)
}
