//! Pictures of plans: timelines, maps, numbers and searches as SVG, and pages of them that need nothing else.
//!
//! Data goes in ([`Report`], [`Plan`]) and text comes out; the same data gives the same bytes. Nothing is known here of planning, of PDDL
//! or of knowledge bases, and there are no files, no clock and no network. Names may be hostile: `maud` escapes all of them.

mod chart;
mod data;
mod frame;
mod lanes;
mod layout;
mod log;
mod map;
mod page;
mod palette;
mod report;
mod scale;
mod sheet;
mod svg;
mod terminal;
mod timeline;

pub use data::{
    Axis, Bound, Change, Checked, Curve, Design, Group, Happening, Kind, Log, Map, Part, Place, Plan, Points,
    Progress, Reason, Report, Rows, Sheet, Step,
};
pub use page::STYLE;
