//! Compares Metaplan's plans with the approach of Cámara, Schmerl and Garlan (Software Architecture
//! and Task Plan Co-Adaptation for Mobile Service Robots, SEAMS 2020).
//!
//! A mission with routes and configurations is converted to a Markov decision process
//! ([`Coadaptation`]). The plan of Metaplan's planner and the policies of probabilistic model
//! checking are evaluated in this process ([`compare`]).

mod coadaptation;
mod compare;
mod compared;
mod hindsight;
mod import;
mod map;
mod nominal;
mod planned;
mod play;
mod process;
mod program;
mod published;
mod referee;
mod route;
mod single_way;
mod task;

pub use coadaptation::{Arc, Battery, Coadaptation, Configuration, Loss, Roles, Switch, Traversal};
pub use compare::{Candidate, Comparison, Config, Listener, compare};
pub use compared::Compared;
pub use hindsight::{Hindsight, LossAt, LossReport};
pub use import::{Files, MapOptions, import_map};
pub use planned::{Costs, NoResult, PlanFinder, Planned, Stages};
pub use play::Measures;
pub use process::{Action, Process, REWARDS, Risk, State, Valuation};
pub use program::program;
pub use published::{Priority, Published, published, shortest_routes};
pub use single_way::published_program;
pub use task::Tasked;
