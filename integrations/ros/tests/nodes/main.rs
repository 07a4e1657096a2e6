//! Two of our own nodes over loopback.

mod common;
mod controller;
mod graph;
mod nav2;
mod performers;
mod planner;
mod roles;
