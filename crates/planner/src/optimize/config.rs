//! Configuration of the optimizer.

use encodings::encode::StepSemantics;
use encodings::sat::Backend;
use task::limits::Limits;
use task::words;

/// How the SAT solver is made to find a cheapest plan.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
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

words! { Strategy, "strategy": Auto = "auto", Tighten = "tighten", Cores = "cores" }

/// What finds plans, and proves that there is none better.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Engine {
    /// Search in the space of states first, then the SAT solver.
    #[default]
    Auto,
    /// The SAT solver alone, with the bounds that its formulas rest on.
    Sat,
    /// Search alone.
    Search,
}

words! { Engine, "engine": Auto = "auto", Sat = "sat", Search = "search" }

/// What the user asks of the optimizer. It begins with what is so unless said otherwise, and each `with_` changes one thing.
#[derive(Debug, Clone)]
#[non_exhaustive]
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
    pub semantics: Option<StepSemantics>,
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

impl Config {
    /// Only plans with at most this many steps count; `None` for all.
    #[must_use]
    pub fn with_horizon(self, steps: impl Into<Option<usize>>) -> Self {
        Self { horizon: steps.into(), ..self }
    }

    /// What finds plans, and proves that there is none better.
    #[must_use]
    pub fn with_engine(self, engine: Engine) -> Self {
        Self { engine, ..self }
    }

    /// How many states A\* stores before the other parts have their turn.
    #[must_use]
    pub fn with_head_start(self, head_start: usize) -> Self {
        Self { head_start, ..self }
    }

    /// Whether the SAT solver has to confirm what is proved without it, however long it takes.
    #[must_use]
    pub fn with_confirmation(self, confirm: bool) -> Self {
        Self { confirm, ..self }
    }

    /// How many operators stand at a step of the formulas; `None` for what suits.
    #[must_use]
    pub fn with_semantics(self, semantics: impl Into<Option<StepSemantics>>) -> Self {
        Self { semantics: semantics.into(), ..self }
    }

    /// How the SAT solver is made to find a cheapest plan.
    #[must_use]
    pub fn with_strategy(self, strategy: Strategy) -> Self {
        Self { strategy, ..self }
    }

    /// The SAT solver.
    #[must_use]
    pub fn with_backend(self, backend: Backend) -> Self {
        Self { backend, ..self }
    }

    /// When to stop.
    #[must_use]
    pub fn with_limits(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }
}
