//! Search in the space of states: for a first plan, for a best one, and among equal ones.

mod astar;
mod directions;
mod estimate;
mod explore;
mod figures;
mod front;
pub mod generator;
mod open;
mod orbits;
mod pairs;
mod prepared;
mod store;
mod stubborn;
pub mod successors;
pub mod ties;

pub use astar::{Found, Space};
pub use directions::{Asked, directions, is_monotone};
pub use estimate::Estimate;
pub use explore::{Duo, STATE_LIMIT, closed_labels, search, search_from, search_states};
pub use figures::Figures;
pub use pairs::Pairs;
pub use prepared::Prepared;
