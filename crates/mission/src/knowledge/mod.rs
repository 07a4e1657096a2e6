//! Knowledge about a robot: documents and rules, inferred facts, and reports.

mod base;
mod catalogue;
mod mention;
mod reports;
mod sources;
mod statement;
mod value_reads;
mod waiting;

pub use base::{Contradiction, Knowledge};
pub use catalogue::Catalogue;
pub use mention::doubt_about;
pub use sources::{COADAPTATION, Sources, Stated, TOMASYS, rule_text};
pub use statement::{Part, Statement, Statements};
pub use value_reads::{VALUE_PROPERTIES, ValueRead};
pub use waiting::{Fault, RobotReport, Waiting};
