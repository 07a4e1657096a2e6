//! What the user asks of the optimizer.

use crate::encode::Semantics;
use crate::limits::Limits;
use crate::sat::Backend;

/// How the SAT solver is made to find a cheapest plan.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Strategy {
    /// The one that is faster in general.
    #[default]
    Auto,
    /// Cheaper and cheaper plans, until there is none.
    Tighten,
    /// A lower bound that rises with each contradiction among assumptions about what a plan does not pay, until a plan costs as
    /// much. Where the number of steps of a cheapest plan has no bound, it is as `Tighten`.
    Cores,
}

/// What finds plans, and proves that there is none better.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Engine {
    /// Search in the space of states first, then the SAT solver.
    #[default]
    Auto,
    /// The SAT solver alone, with the bounds that its formulas rest on.
    Sat,
    /// Search alone.
    Search,
}

/// What the user asks of the optimizer.
#[derive(Debug, Clone)]
pub struct Config {
    /// Only plans with at most this many steps count.
    pub horizon: Option<usize>,
    /// What finds plans, and proves that there is none better.
    pub engine: Engine,
    /// How many states A\* stores before the other parts of the planner have their turn. What they may do in the first round grows
    /// with it.
    pub head_start: usize,
    /// Whether the SAT solver has to confirm what is proved without it, however long it takes; otherwise it gets about as
    /// long as a small proof took.
    pub confirm: bool,
    /// How many operators stand at a step of the formulas; with a horizon, which counts actions, always one. If not
    /// given, several while a first plan is looked for, and one for the proof that there is no cheaper one.
    pub semantics: Option<Semantics>,
    /// How the SAT solver is made to find a cheapest plan.
    pub strategy: Strategy,
    /// The SAT solver.
    pub backend: Backend,
    /// When to stop.
    pub limits: Limits,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            horizon: None,
            engine: Engine::default(),
            head_start: 20_000,
            confirm: false,
            semantics: None,
            strategy: Strategy::default(),
            backend: Backend::default(),
            limits: Limits::none(),
        }
    }
}
