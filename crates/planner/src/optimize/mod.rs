//! Finds a cheapest plan of a ground task, and a proof that no plan is cheaper.
//!
//! By default, heuristic search and a SAT solver take turns; each of them can find plans and prove optimality. Once a
//! plan is known, the solver receives formulas of the form "a plan with at most B steps and a cost of at most L". B is
//! a step bound for L: dynamic programming over projections proves that every plan with a cost of at most L has at most
//! B steps. L starts near the lower bound, where formulas are small. An unsatisfiable formula raises the lower bound. A
//! satisfiable formula is optimised by linear or core-guided search. If there is no step bound, for example because of
//! cycles without cost, formulas prove nothing about optimality. Optimality then follows only from heuristic search, or
//! from a lower bound that equals the cost of a plan.

mod branch_and_bound;
mod cheapest;
mod config;
mod core_guided;
pub(crate) mod hidden_steps;
mod horizon_schedule;
mod linear_search;
mod objectives;
mod optimizer_run;
mod portfolio;
mod prover;
mod sat_budget;
mod sat_confirmation;
mod solve;
mod state_dependent_costs;
#[cfg(test)]
mod tests;
mod unbounded_metric;

pub use cheapest::optimize;
pub use config::{Config, Engine, Strategy};
pub use objectives::{Front, Point, lexicographic, pareto};
pub use unbounded_metric::can_repeat_reward;
