//! Tests of parsing, printing and validating PDDL.

mod advance;
mod course;
mod definition;
mod derived;
mod files;
mod language;
mod messages;
mod object_fluents;
mod oracle;
mod properties;
mod quirks;
mod real_plans;
mod validate;
