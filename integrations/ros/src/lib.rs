//! Metaplan on a ROS 2 robot, over DDS and without a ROS installation.

pub mod controller;
mod diagnosed;
mod diagnostic_rules;
pub mod discover;
pub mod interfaces;
pub mod manager;
pub mod node;
pub mod perform;
pub mod performer;
pub mod planner;
pub mod popf;
mod procedure;
pub mod reasoner;
mod signals;
mod types;
mod validated;
