//! JSON answers of the commands, except `sweep`: a type for each answer, whose fields have the order of the
//! format. `docs/reference/json.md` describes them.
//!
//! The types are built from results of the library. The command line only writes them.

mod check;
mod code;
mod compare;
mod configure;
mod explain;
mod export;
mod init;
mod journal;
mod lint;
mod plan;
mod reason;
mod run;
mod simulate;
mod validate;
mod verify;

pub use ::mission::message::ErrorAnswer;
pub use ::verify::VerificationAnswer;
pub use check::{CheckAnswer, ChecksAnswer};
pub use code::CodeAnswer;
pub use compare::{CompareAnswer, ComparisonAnswer, MEASURES, Pair, Row, begun_rows, rows};
pub use configure::{ConfigureAnswer, KeeperReadyLine};
pub use explain::{ChangesAnswer, DesignAnswer};
pub use export::{ImportAnswer, MissionExport, ModelExport};
pub use init::InitAnswer;
pub use journal::JournalAnswer;
pub use lint::LintAnswer;
pub use plan::{Objective, ParetoAnswer, PlanAnswer, Preparation, milliseconds};
pub use reason::{AssertionAnswer, EntailmentAnswer, ReasonAnswer, ReasonsAnswer, SchemaAnswer, statuses};
pub use run::{HandledLine, LogLine, NumberedAnswer, PlanningLine, ReadyLine};
pub use simulate::{SimulateAnswer, accomplished_cost, beside_joint, runs_of, sample};
pub use validate::VerdictAnswer;
pub use verify::{VerifyAnswer, theorem_line};
