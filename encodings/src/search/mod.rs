//! Search in the space of states: for a first plan, for a best one, and among equal ones.

mod astar;
mod directions;
mod estimate;
mod explore;
mod figures;
mod front;
pub(crate) mod generator;
mod open;
mod orbits;
mod pairs;
mod prepared;
mod store;
mod stubborn;
pub(crate) mod successors;
pub(crate) mod ties;

pub(crate) use astar::{Found, Space};
pub(crate) use directions::{Asked, directions, is_monotone};
pub(crate) use estimate::Estimate;
pub(crate) use explore::{Duo, STATE_LIMIT, closed_labels, search, search_from, search_states};
pub(crate) use figures::Figures;
pub(crate) use pairs::Pairs;
pub(crate) use prepared::Prepared;
