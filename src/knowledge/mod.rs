//! What is known about a robot: documents and rules, what follows from them, and what is reported.

mod base;
mod catalogue;
mod reports;
mod sources;
mod statement;
mod waiting;

pub use base::{Contradiction, Knowledge};
pub(crate) use catalogue::Catalogue;
pub use sources::{COADAPTATION, KnowledgeSection, Sources, TOMASYS};
pub(crate) use sources::{Stated, rule_text};
pub use statement::{Part, Statement, Statements};
pub use waiting::Fault;
pub(crate) use waiting::{RobotReport, Waiting};
