//! Missions in PLANTA's form, planned from the files that its users have: held against the files that its converter has made of them,
//! by plain enumeration of all that can be reached.

mod brute;
mod examples;
mod files;
mod random;
mod situations;
