//! The files of a task whose actions may be planned one after another as well.

use std::sync::Arc;

use pddl::ast::{Domain, InitialElement, Problem};

use crate::ground::GroundConfig;

/// Problems with more initial facts and values are not kept.
const INITIAL: usize = 20_000;

/// The files of a task.
#[derive(Debug, Clone)]
pub(super) struct Kept(Arc<(Domain, Problem, GroundConfig)>);

impl Kept {
    /// None if something happens by itself, or if the problem is large.
    pub(super) fn new(domain: &Domain, problem: &Problem, config: &GroundConfig) -> Option<Self> {
        let is_timed = |element: &InitialElement| matches!(element, InitialElement::Timed(..));
        let is_plain = problem.init.len() <= INITIAL && !problem.init.iter().any(is_timed);
        is_plain.then(|| Self(Arc::new((domain.clone(), problem.clone(), config.clone()))))
    }

    pub(super) fn files(&self) -> &(Domain, Problem, GroundConfig) {
        &self.0
    }
}
