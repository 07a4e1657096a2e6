//! From a ground task to a cheapest plan, and to the reason why there is no cheaper one.
//!
//! A quick search yields a first plan. Then come formulas "a plan of at most B steps that costs at most L", where B is the step
//! bound for L: by dynamic programming over projections, no plan that costs so little has more steps. L begins near the lower bound,
//! because the formula is small there, and what is unsatisfiable raises that bound; a formula that has a plan yields a cheapest
//! one, by one of two strategies. Only then is the answer called optimal. Where no step bound exists (free cycles), the search's own
//! exhaustion may serve; otherwise the answer is a plan that is not proved optimal.

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
