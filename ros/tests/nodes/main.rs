//! Two of our own nodes over loopback.

mod common;
mod graph;
mod performers;
mod planner;
