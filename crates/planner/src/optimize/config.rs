//! Configuration of the optimizer.

use encodings::encode::StepSemantics;
use encodings::sat::Backend;
use task::limits::Limits;
use task::words;

/// Strategy by which the SAT solver optimises the cost of a plan.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Strategy {
    /// The strategy that is usually faster, at present `Tighten`.
    #[default]
    Auto,
    /// Linear search: finds cheaper and cheaper plans until the formula is unsatisfiable.
    Tighten,
    /// Core-guided search: unsatisfiable cores raise the lower bound until a plan with this cost exists. Without an
    /// upper bound on the number of steps of a cheapest plan, this strategy equals `Tighten`. It also equals
    /// `Tighten` while the SAT solver has a budget, i.e. takes turns with other components of the planner.
    Cores,
}

words! { Strategy, "strategy": Auto = "auto", Tighten = "tighten", Cores = "cores" }

/// Selection of the algorithms that find plans and prove optimality.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Engine {
    /// A portfolio of heuristic search and the SAT solver.
    #[default]
    Auto,
    /// The SAT solver only, together with the bounds that its formulas need.
    Sat,
    /// Heuristic search only. The SAT solver is used as well if actions can improve the metric, or if the search does
    /// not find a cheapest plan within the horizon.
    Search,
}

words! { Engine, "engine": Auto = "auto", Sat = "sat", Search = "search" }

/// Options of the optimizer. `default` returns the default options; each `with_` method changes one option.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Config {
    /// Maximum number of steps of a plan; `None` for no limit.
    pub horizon: Option<usize>,
    /// Algorithms that find plans and prove optimality.
    pub engine: Engine,
    /// Number of states that A\* stores before satisficing search and SAT solver start. Also scales the work of
    /// each component in the later rounds.
    pub head_start: usize,
    /// If `true`, the SAT solver confirms plans that heuristic search proves optimal, where a formula exists,
    /// without a limit on its work. If `false`, it tries this for small tasks only, with a small budget. A proof
    /// that is not confirmed remains valid. With [`Engine::Search`], nothing is confirmed.
    pub confirm: bool,
    /// Step semantics of the SAT formulas. With a horizon, which counts actions, the semantics is always
    /// sequential. The default (`None`) is parallel for a first plan and sequential for the optimality proof.
    pub semantics: Option<StepSemantics>,
    /// Strategy by which the SAT solver optimises the cost of a plan.
    pub strategy: Strategy,
    /// The SAT solver.
    pub backend: Backend,
    /// Time and memory limits.
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
    /// Limits the number of steps of a plan; `None` for no limit.
    #[must_use]
    pub fn with_horizon(self, steps: impl Into<Option<usize>>) -> Self {
        Self { horizon: steps.into(), ..self }
    }

    /// Sets the algorithms that find plans and prove optimality.
    #[must_use]
    pub fn with_engine(self, engine: Engine) -> Self {
        Self { engine, ..self }
    }

    /// Sets the number of states that A\* stores before satisficing search and SAT solver start.
    #[must_use]
    pub fn with_head_start(self, head_start: usize) -> Self {
        Self { head_start, ..self }
    }

    /// Sets whether the SAT solver confirms plans that heuristic search proves optimal, without a limit on its
    /// work; see [`Config::confirm`].
    #[must_use]
    pub fn with_confirmation(self, confirm: bool) -> Self {
        Self { confirm, ..self }
    }

    /// Sets the step semantics of formulas; `None` for the default.
    #[must_use]
    pub fn with_semantics(self, semantics: impl Into<Option<StepSemantics>>) -> Self {
        Self { semantics: semantics.into(), ..self }
    }

    /// Sets the strategy by which the SAT solver optimises the cost of a plan.
    #[must_use]
    pub fn with_strategy(self, strategy: Strategy) -> Self {
        Self { strategy, ..self }
    }

    /// Sets the SAT solver.
    #[must_use]
    pub fn with_backend(self, backend: Backend) -> Self {
        Self { backend, ..self }
    }

    /// Sets the time and memory limits.
    #[must_use]
    pub fn with_limits(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }
}
