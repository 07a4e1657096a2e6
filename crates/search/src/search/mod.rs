//! Optimal search in the state space: A\*, its open list, state registry, heuristic interface and pruning
//! methods. Also selects a canonical plan among plans of equal cost and length (`plan_tiebreak`), and
//! computes the h² mutexes ([`MutexPairs`]) with which the satisficing search prunes.

mod astar;
pub mod design_combinations;
mod h2_mutexes;
mod heuristic;
mod monotonicity;
mod open_list;
mod pareto_front;
pub mod plan_tiebreak;
mod search_driver;
mod search_task;
mod state_registry;
mod statistics;
mod stubborn_sets;
pub mod successor_generator;
mod symmetry;

pub use astar::{SearchOutcome, SearchProblem};
pub use h2_mutexes::MutexPairs;
pub use heuristic::Heuristic;
pub use monotonicity::{Polarity, directions, is_monotone};
pub use search_driver::{
    InterleavedSearch, NoLabels, STATE_LIMIT, closed_labels, search, search_from, search_states,
};
pub use search_task::SearchTask;
pub use statistics::SearchStatistics;
