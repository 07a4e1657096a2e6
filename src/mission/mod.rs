//! Planning for missions: grounding, validation and export of plans.
//!
//! The crate `metaplan-mission` joins the knowledge base and the PDDL files. This module adds the planner.

mod blocking;
mod btcpp;
pub mod conditions;
mod confirm;
mod lean;
pub mod numbers;
mod planning;
mod plansys2;
mod sections;
mod steps;

pub use ::mission::{Bindings, CoAdaptation, Mission, Names, ParsedObjective, unused_measurement};
pub use blocking::{Blocking, blocking};
pub use btcpp::{btcpp_text, first_wait};
pub(crate) use confirm::plan_text;
pub use confirm::{Reading, Unconfirmed, confirm};
pub use lean::lean;
pub use planning::Planning;
pub(crate) use planning::{ground_with, replanner};
pub use plansys2::{PlanLine, instant, plan_lines, popf_text, spaced};
pub use sections::{
    BindingsSection, KnowledgeSection, Mistake, PlanningSection, Scenario, TimeUnit, setting,
};
pub use steps::read_plan;
