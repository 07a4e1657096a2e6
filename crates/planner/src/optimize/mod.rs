//! From a ground task to a cheapest plan, and to the proof that no plan is cheaper.
//!
//! Search yields a first plan. Then formulas "a plan of at most B steps that costs at most L" are
//! solved, where B is the step bound for L: dynamic programming over projections shows that no plan
//! of this cost has more steps. L starts near the lower bound, where the formula is small. An
//! unsatisfiable formula raises the lower bound; a satisfiable one is optimised by one of two
//! strategies. Only then is the answer optimal. If no step bound exists (cycles without cost),
//! exhaustive search can prove optimality; otherwise the plan is not proved.

mod cheapest;
mod config;
mod core_guided;
mod horizon_schedule;
mod linear_search;
mod objectives;
mod optimizer_run;
mod portfolio;
mod prover;
mod sat_budget;
mod sat_confirmation;
mod solve;
#[cfg(test)]
mod tests;
mod unbounded_metric;

pub use cheapest::optimize;
pub use config::{Config, Engine, Strategy};
pub use objectives::{Front, Point, lexicographic, pareto};
pub use unbounded_metric::can_repeat_reward;
