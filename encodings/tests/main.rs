//! The planner through its public functions: tasks, plans, proofs, and what it refuses.

mod adl;
mod certificate;
mod concurrent;
mod concurrent_definition;
mod concurrent_durations;
mod concurrent_language;
mod concurrent_runs;
mod concurrent_trajectories;
mod designs;
mod exact;
mod ground_ratpa;
mod ground_semantics;
mod growth;
mod limits;
mod lying;
mod measured;
mod missions;
mod multiples;
mod object_fluents;
mod objectives;
mod optimum;
mod partial;
mod preferences;
mod random;
#[path = "random/adl.rs"]
mod random_adl;
mod refutation;
mod replan;
mod statuses;
mod tally;
mod timed;
mod validate_peer;
mod validate_peer_timed;
mod vanishing;
