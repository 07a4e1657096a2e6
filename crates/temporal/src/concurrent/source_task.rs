//! The PDDL task of a temporal task, from which sequential plans are computed.

use std::sync::Arc;

use pddl::ast::{Domain, Problem};

use task::ground::GroundConfig;

/// Maximum number of initial facts and values of a problem that is kept.
const MAX_INITIAL_FACTS: usize = 20_000;

/// The files of a task.
#[derive(Debug, Clone)]
pub(super) struct SourceTask(Arc<(Domain, Problem, GroundConfig)>);

impl SourceTask {
    /// Clones the files. Returns `None` if the problem has too many initial elements.
    pub(super) fn new(domain: &Domain, problem: &Problem, config: &GroundConfig) -> Option<Self> {
        let is_small = problem.init.len() <= MAX_INITIAL_FACTS;
        is_small.then(|| Self(Arc::new((domain.clone(), problem.clone(), config.clone()))))
    }

    pub(super) fn files(&self) -> &(Domain, Problem, GroundConfig) {
        &self.0
    }
}
