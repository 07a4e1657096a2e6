//! The frame of a picture: its width, the positions of row names, and the horizontal axis.

use std::collections::BTreeMap;

use maud::{Markup, html};

use crate::data::{Axis, Plan};
use crate::scale::{Scale, number, px, range, width};

/// Right margin, in pixels.
pub(crate) const RIGHT: f64 = 16.0;
/// Maximum width to which many steps extend a drawing area, in pixels.
const WIDEST: f64 = 16_000.0;
/// Height of a name above its row, in pixels.
const NAME: f64 = 14.0;

/// The dimensions of a picture, in pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Canvas {
    pub(crate) width: f64,
    /// Left edge of the drawing area; the tick labels of vertical axes are to the left of it.
    pub(crate) left: f64,
    pub(crate) has_names_above: bool,
    /// Minimum average width of a step. For plans with many steps, it widens the drawing area to at most [`WIDEST`].
    pub(crate) step: f64,
    /// Intended minimum distance of neighbouring places of a map.
    pub(crate) apart: f64,
}

pub(crate) const FILE: Canvas =
    Canvas { width: 826.0, left: 170.0, has_names_above: false, step: 60.0, apart: 46.0 };
/// The canvases of the pictures in a page, in descending width. The page shows the first picture
/// that fits its column; `page.css` must contain the same widths.
pub(crate) const PAGE: [Canvas; 3] = [WIDE, COLUMN, TELEPHONE];
pub(crate) const PAIR: [Canvas; 2] = [COLUMN, TELEPHONE];
const WIDE: Canvas = Canvas { width: 1146.0, left: 170.0, has_names_above: false, step: 4.0, apart: 20.0 };
const COLUMN: Canvas = Canvas { width: 560.0, left: 60.0, has_names_above: true, step: 4.0, apart: 20.0 };
const TELEPHONE: Canvas = Canvas { width: 328.0, left: 60.0, has_names_above: true, step: 4.0, apart: 20.0 };

impl Canvas {
    pub(crate) fn inner(&self) -> f64 {
        self.width - self.left - RIGHT
    }

    pub(crate) fn name_height(&self) -> f64 {
        if self.has_names_above { NAME } else { 0.0 }
    }

    /// Returns the position of a row's name: either to the left of the row, right-aligned on the
    /// base line `base`, or above the row at `top`, left-aligned.
    pub(crate) fn name_place(&self, top: f64, base: f64) -> NamePlace {
        if self.has_names_above {
            NamePlace { x: self.left, y: top - 4.0, anchor: "start", room: self.inner() }
        } else {
            NamePlace { x: self.left - 10.0, y: base, anchor: "end", room: self.left - 14.0 }
        }
    }
}

pub(crate) struct NamePlace {
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// End of the text that is at this position, as in SVG's `text-anchor`: `start` or `end`.
    pub(crate) anchor: &'static str,
    pub(crate) room: f64,
}

/// Ranges of the axes. Plans that are shown side by side share one `Span` if their axes are of the same kind.
pub(crate) struct Span {
    steps: usize,
    until: f64,
    /// Minimum and maximum of each numeric fluent, including bounds of conditions.
    values: BTreeMap<String, (f64, f64)>,
}

impl Span {
    pub(crate) fn of(plans: &[&Plan]) -> Self {
        Self {
            steps: plans.iter().map(|plan| plan.steps.len()).max().unwrap_or_default(),
            until: plans.iter().map(|plan| end(plan)).fold(0.0, f64::max),
            values: values(plans),
        }
    }

    pub(crate) fn values(&self, name: &str) -> (f64, f64) {
        self.values.get(name).copied().unwrap_or((0.0, 1.0))
    }
}

fn values(plans: &[&Plan]) -> BTreeMap<String, (f64, f64)> {
    let mut by_name: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for curve in plans.iter().flat_map(|plan| &plan.curves) {
        let values = curve.points.iter().map(|(_, value)| *value);
        let values = values.chain(curve.bounds.iter().map(|bound| bound.value));
        by_name.entry(curve.name.clone()).or_default().extend(values);
    }
    by_name.into_iter().map(|(name, values)| (name, range(values))).collect()
}

fn end(plan: &Plan) -> f64 {
    plan.steps.iter().map(|step| step.end).fold(0.0, f64::max)
}

pub(crate) struct Frame {
    pub(crate) canvas: Canvas,
    pub(crate) scale: Scale,
    pub(crate) end: f64,
    until: f64,
    pub(crate) width: f64,
    label: &'static str,
}

impl Frame {
    pub(crate) fn of(plan: &Plan, span: &Span, canvas: Canvas) -> Self {
        let label = match plan.axis {
            Axis::Time => "time",
            Axis::Steps => "step",
        };
        // With many steps, the picture becomes wider instead of illegible.
        let inner = (span.steps as f64 * canvas.step).min(WIDEST).max(canvas.inner());
        let scale = Scale::new((0.0, span.until), (canvas.left, canvas.left + inner));
        let width = canvas.left + inner + RIGHT;
        Self { canvas, scale, end: end(plan), until: span.until, width, label }
    }

    pub(crate) fn axis(&self, top: f64, bottom: f64) -> Markup {
        let widest = width(&number(self.until)) + 24.0;
        let max_ticks = ((self.width - self.canvas.left - RIGHT) / widest.max(60.0)) as usize;
        html! {
            g class="axis" {
                @for tick in self.scale.ticks(max_ticks.clamp(2, 200)) {
                    @let (x, text) = (self.scale.at(tick), number(tick));
                    line class="grid" x1=(px(x)) x2=(px(x)) y1=(px(top)) y2=(px(bottom)) {}
                    text x=(px(x.min(self.width - width(&text) / 2.0))) y=(px(bottom + 15.0)) text-anchor="middle" { (text) }
                }
                text x=(px(self.canvas.left - 20.0)) y=(px(bottom + 15.0)) text-anchor="end" { (self.label) }
            }
        }
    }
}
