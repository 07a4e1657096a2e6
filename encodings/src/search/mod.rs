//! Search in the space of states: for a first plan, for a best one, and among equal ones.

mod astar;
pub(crate) mod successors;
pub(crate) mod ties;

pub(crate) use astar::{
    Estimate, Found, Prepared, STATE_LIMIT, Space, closed_labels, is_monotone, search, search_from,
    search_states,
};
