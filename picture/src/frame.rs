//! What the pictures over a plan share: their width, the axis from left to right, and its labels.

use maud::{Markup, html};

use crate::data::{Axis, Plan};
use crate::scale::{Scale, number, px, width};

/// Where what is drawn begins, in pixels: before it stand labels.
pub(crate) const LEFT: f64 = 170.0;
/// What stays free at the right.
pub(crate) const RIGHT: f64 = 16.0;
/// The greatest width of what is drawn.
const WIDEST: f64 = 16_000.0;
/// How wide what is drawn is at least: in a file, in a page, and beside another one in a page.
pub(crate) const FILE: f64 = 640.0;
pub(crate) const PAGE: f64 = 960.0;
pub(crate) const HALF: f64 = 380.0;
/// So many pixels for a step, if there is room.
const STEP: f64 = 60.0;

/// What plans that stand beside each other share: how wide they are drawn, and what their axes run to.
pub(crate) struct Room {
    inner: f64,
    until: f64,
}

impl Room {
    /// Room for some plans, at least so wide.
    pub(crate) fn of(plans: &[&Plan], least: f64) -> Self {
        let steps = plans.iter().map(|plan| plan.steps.len()).max().unwrap_or_default();
        let inner = (steps as f64 * STEP).max(least).min(WIDEST.max(least));
        Self { inner, until: plans.iter().map(|plan| end(plan)).fold(0.0, f64::max) }
    }
}

/// Where a plan ends on its axis.
fn end(plan: &Plan) -> f64 {
    plan.steps.iter().map(|step| step.end).fold(0.0, f64::max)
}

/// The axis of a plan.
pub(crate) struct Frame {
    pub(crate) scale: Scale,
    /// Where the plan ends.
    pub(crate) end: f64,
    /// Where the axis does.
    until: f64,
    /// Of the whole picture.
    pub(crate) width: f64,
    label: &'static str,
}

impl Frame {
    pub(crate) fn of(plan: &Plan, room: &Room) -> Self {
        let label = match plan.axis {
            Axis::Time => "time",
            Axis::Steps => "step",
        };
        let scale = Scale::new((0.0, room.until), (LEFT, LEFT + room.inner));
        Self { scale, end: end(plan), until: room.until, width: LEFT + room.inner + RIGHT, label }
    }

    /// The axis below everything, with lines up to `top`.
    pub(crate) fn axis(&self, top: f64, bottom: f64) -> Markup {
        let widest = width(&number(self.until)) + 24.0;
        let most = ((self.width - LEFT - RIGHT) / widest.max(60.0)) as usize;
        html! {
            g class="axis" {
                @for tick in self.scale.ticks(most.clamp(2, 200)) {
                    @let x = px(self.scale.at(tick));
                    line class="grid" x1=(x) x2=(x) y1=(px(top)) y2=(px(bottom)) {}
                    text x=(x) y=(px(bottom + 15.0)) text-anchor="middle" { (number(tick)) }
                }
                text x=(px(LEFT - 20.0)) y=(px(bottom + 15.0)) text-anchor="end" { (self.label) }
            }
        }
    }
}
