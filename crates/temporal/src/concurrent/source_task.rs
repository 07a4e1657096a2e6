//! PDDL domain and problem of a temporal task, kept for the computation of sequential plans.

use std::sync::Arc;

use pddl::ast::{Domain, Problem};

use task::ground::GroundConfig;

const MAX_INITIAL_FACTS: usize = 20_000;

#[derive(Debug, Clone)]
pub(super) struct SourceTask(Arc<(Domain, Problem, GroundConfig)>);

impl SourceTask {
    /// Clones the domain, problem and options. Returns `None` if the problem exceeds
    /// [`MAX_INITIAL_FACTS`].
    pub(super) fn new(domain: &Domain, problem: &Problem, config: &GroundConfig) -> Option<Self> {
        let is_small = problem.init.len() <= MAX_INITIAL_FACTS;
        is_small.then(|| Self(Arc::new((domain.clone(), problem.clone(), config.clone()))))
    }

    pub(super) fn files(&self) -> &(Domain, Problem, GroundConfig) {
        &self.0
    }
}
