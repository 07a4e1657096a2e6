//! Search in the space of states: for a first plan, for a best one, and among equal ones.

mod astar;
mod directions;
mod front;
pub(crate) mod generator;
mod open;
mod store;
pub(crate) mod successors;
pub(crate) mod ties;

pub(crate) use astar::{
    Estimate, Found, Prepared, STATE_LIMIT, Search, Space, closed_labels, search, search_from, search_states,
};
pub(crate) use directions::is_monotone;
