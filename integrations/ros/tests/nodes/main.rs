//! Tests with several nodes of this package over loopback.

mod common;
mod controller;
mod graph;
mod nav2;
mod performers;
mod planner;
mod roles;
