//! Pictures of plans: timelines, maps, charts and search progress as SVG, self-contained HTML pages, and plans drawn as
//! text for a terminal.
//!
//! The input is data ([`Report`], [`Plan`]), and the output is text. Equal data yields identical bytes. This crate
//! contains no planning, no PDDL and no knowledge bases, and accesses neither files nor clock nor network. Names may be
//! hostile. In SVG and HTML, `maud` escapes all of them. [`Plan::text`] prints them unchanged.

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
