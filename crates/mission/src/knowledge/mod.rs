//! Knowledge about a robot: documents and rules, inferred facts, and reports.

mod base;
mod catalogue;
mod reads;
mod reports;
mod sources;
mod statement;
mod waiting;

pub use base::{Contradiction, Knowledge};
pub use catalogue::Catalogue;
pub use sources::{COADAPTATION, Sources, Stated, TOMASYS, rule_text};
pub use statement::{Part, Statement, Statements};
pub use waiting::{Fault, RobotReport, Waiting};
