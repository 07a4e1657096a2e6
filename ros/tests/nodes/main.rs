//! Two of our own nodes over loopback.

mod common;
mod graph;
mod nav2;
mod performers;
mod planner;
mod roles;
