//! The timeline of a plan: a lane for the actions, a lane for the designs of each function, and
//! marks where a design changes.

use std::collections::BTreeMap;

use maud::{Markup, html};

use crate::data::{Plan, Step};
use crate::frame::{Canvas, Frame, Span};
use crate::lanes::rows;
use crate::palette::Palette;
use crate::scale::{fit, px, width};
use crate::svg::{Picture, alternative};

const ROW: f64 = 26.0;
const BAR: f64 = 20.0;
const GAP: f64 = 8.0;
const TOP: f64 = 6.0;
const LEAST: f64 = 3.0;
/// Minimum number of characters of a shortened name, including the ellipsis. Instead of a shorter
/// one, the step number is shown (for actions, if it fits) or nothing.
const SHORTEST: usize = 5;
/// Number of pixels by which a step number may be nearer to the ends of a bar than a name, for both
/// ends together.
const SLACK: f64 = 5.0;

struct Bar<'p> {
    step: usize,
    from: f64,
    to: f64,
    text: &'p str,
    is_changed: bool,
}

struct Lane<'p> {
    name: &'p str,
    bars: Vec<Bar<'p>>,
    rows: Vec<usize>,
}

impl<'p> Lane<'p> {
    fn new(name: &'p str, bars: Vec<Bar<'p>>) -> Self {
        let intervals: Vec<(f64, f64)> = bars.iter().map(|bar| (bar.from, bar.to)).collect();
        Self { name, rows: rows(&intervals), bars }
    }

    fn height(&self) -> f64 {
        ROW * (self.rows.iter().max().map_or(0, |last| *last) + 1) as f64
    }
}

pub(crate) fn timeline(plan: &Plan, palette: &Palette, span: &Span, canvas: Canvas) -> Picture {
    let frame = Frame::of(plan, span, canvas);
    let lanes = lanes(plan, &frame);
    let mut tops = Vec::new();
    let mut bottom = TOP;
    for lane in &lanes {
        bottom += canvas.name_height();
        tops.push(bottom);
        bottom += lane.height() + GAP;
    }
    // Where names are placed between lanes, the vertical lines of changes are interrupted.
    let marked: Vec<(f64, f64)> = if canvas.has_names_above {
        lanes.iter().zip(&tops).map(|(lane, top)| (*top, top + lane.height())).collect()
    } else {
        vec![(TOP, bottom)]
    };
    let changes = plan.steps.iter().map(|step| step.reconfigured.len()).sum::<usize>();
    let title = format!("{} steps, {changes} reconfigurations", plan.steps.len());
    let description = lanes.iter().map(|lane| lane.name).collect::<Vec<_>>().join(", ");
    let description =
        format!("One lane for each of: {description}. The table of steps has the same content.");
    let body = html! {
        (frame.axis(TOP + canvas.name_height(), bottom))
        @for ((lane, top), number) in lanes.iter().zip(&tops).zip(0..) {
            (draw_lane(lane, (*top, number == 0), (plan, palette), &frame))
        }
        @for (index, step) in plan.steps.iter().enumerate().filter(|(_, step)| !step.reconfigured.is_empty()) {
            @let x = px(frame.scale.at(step.start));
            @for (top, bottom) in &marked {
                line class="change" x1=(x) x2=(x) y1=(px(*top)) y2=(px(*bottom)) data-step=(index + 1) {}
            }
        }
    };
    Picture { width: frame.width, height: bottom + 24.0, title, description, body }
}

fn lanes<'p>(plan: &'p Plan, frame: &Frame) -> Vec<Lane<'p>> {
    let place = |step: &Step| {
        let from = frame.scale.at(step.start);
        // A short step keeps its true end, so that consecutive steps can share a row.
        (from, if step.end > step.start { frame.scale.at(step.end) } else { from + LEAST })
    };
    let mut functions: BTreeMap<&str, Vec<Bar<'p>>> = BTreeMap::new();
    let mut actions = Vec::new();
    for (number, step) in plan.steps.iter().enumerate() {
        let (from, to) = place(step);
        actions.push(Bar { step: number, from, to, text: &step.label, is_changed: false });
        for (function, design) in &step.configuration {
            let is_changed = step.reconfigured.iter().any(|(changed, _)| changed == function);
            let bar = Bar { step: number, from, to, text: design, is_changed };
            functions.entry(function).or_default().push(bar);
        }
    }
    let functions = functions.into_iter().map(|(name, bars)| Lane::new(name, bars));
    std::iter::once(Lane::new("actions", actions)).chain(functions).collect()
}

fn draw_lane(
    lane: &Lane<'_>,
    (top, is_action): (f64, bool),
    (plan, palette): (&Plan, &Palette),
    frame: &Frame,
) -> Markup {
    let left_edge = frame.canvas.left;
    let place = frame.canvas.name_place(top, top + lane.height() / 2.0 + 4.0);
    html! {
        g class="lane" data-lane=(lane.name) {
            rect class="track" x=(px(left_edge)) y=(px(top)) width=(px(frame.scale.at(frame.end) - left_edge)) height=(px(lane.height())) {}
            text class="label" x=(px(place.x)) y=(px(place.y)) text-anchor=(place.anchor) {
                title { (lane.name) }
                (fit(lane.name, place.room))
            }
            @for (bar, row) in lane.bars.iter().zip(&lane.rows) {
                @let step = &plan.steps[bar.step];
                @let class = if is_action { "action".to_owned() } else { palette.class(bar.text) };
                (draw_bar(bar, top + ROW * *row as f64, (&class, is_action), &about(bar, step, lane.name, is_action)))
            }
        }
    }
}

fn draw_bar(bar: &Bar<'_>, top: f64, (class, is_action): (&str, bool), about: &str) -> Markup {
    let y = top + (ROW - BAR) / 2.0;
    let margin = if bar.is_changed { 14.0 } else { 5.0 };
    let room = bar.to - bar.from - margin - 3.0;
    let number = (bar.step + 1).to_string();
    let mut text = fit(bar.text, room);
    // A shorter part of a name is less informative than the step number, which also occurs in map
    // and table, or than the colour of a design.
    if text != bar.text && text.chars().count() < SHORTEST {
        text = if is_action && width(&number) <= room + SLACK { number } else { String::new() };
    }
    let margin = if is_action && text.chars().count() < SHORTEST { margin - SLACK / 2.0 } else { margin };
    html! {
        g class="bar" data-step=(bar.step + 1) {
            title { (about) }
            rect class=(class) x=(px(bar.from + 0.5)) y=(px(y)) width=(px((bar.to - bar.from - 1.0).max(1.0))) height=(px(BAR)) rx="3" {}
            @if !text.is_empty() {
                text x=(px(bar.from + margin)) y=(px(y + 14.0)) { (text) }
            }
            @if bar.is_changed {
                @let (x, y) = (bar.from, y + BAR / 2.0);
                path class="mark" data-mark=(bar.step + 1)
                    d={ "M" (px(x - 6.0)) " " (px(y)) "L" (px(x)) " " (px(y - 6.0)) "L" (px(x + 6.0)) " " (px(y)) "L" (px(x)) " " (px(y + 6.0)) "Z" } {}
            }
        }
    }
}

fn about(bar: &Bar<'_>, step: &Step, lane: &str, is_action: bool) -> String {
    let number = bar.step + 1;
    if is_action {
        return format!(
            "step {number}: {}; from {}, takes {}, costs {}",
            step.label, step.start_text, step.duration_text, step.cost_text
        );
    }
    let changed = step.reconfigured.iter().find(|(function, _)| function == lane);
    let before = changed.map(|(_, before)| alternative(before)).unwrap_or_default();
    format!("step {number}: {lane} = {}{before}", bar.text)
}
