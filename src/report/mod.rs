//! Pictures of answers: plans (configuration, numbers, route on the map, reasons), Pareto fronts, differences
//! between two situations, comparisons, simulations and journals.
//!
//! This module collects the data of pictures. The crate `picture` draws them.

mod changes;
mod compared;
mod designs;
mod front;
mod log;
mod map;
mod numbers;
mod painter;
mod plan;
mod positions;
mod seen;

pub use changes::{Cost, changes};
pub use compared::{comparison_sheet, simulation_sheet};
pub use designs::designs;
pub use front::front_sheet;
pub use log::log_picture;
pub use painter::Painter;
pub use plan::{plan_picture, timeline_picture};
pub use positions::{Positions, ReportSection};
pub use seen::Seen;
