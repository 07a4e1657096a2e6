//! Charts of two kinds: a numeric fluent over a plan with the bounds of conditions, and the best
//! cost and the lower bound during a search.

use maud::{Markup, html};

use crate::data::{Curve, Plan, Progress};
use crate::frame::{Canvas, Frame, RIGHT, Span};
use crate::scale::{Scale, compact, fit, number, px, range};
use crate::svg::Picture;

const HEIGHT: f64 = 110.0;
const TOP: f64 = 10.0;

pub(crate) fn curve(plan: &Plan, curve: &Curve, span: &Span, canvas: Canvas) -> Picture {
    let frame = Frame::of(plan, span, canvas);
    let top = TOP + canvas.name_height();
    let scale = vertical(top, span.values(&curve.name));
    let mut points: Vec<(f64, f64)> = Vec::new();
    for (at, value) in &curve.points {
        let (x, y) = (frame.scale.at(*at), scale.at(*value));
        if let Some((_, before)) = points.last().copied() {
            points.push((x, before));
        }
        points.push((x, y));
    }
    if let Some((_, last)) = points.last().copied() {
        points.push((frame.scale.at(frame.end), last));
    }
    let corners: Vec<String> = points.iter().map(|(x, y)| format!("{} {}", px(*x), px(*y))).collect();
    let text = format!("M{}", corners.join("L"));
    let (first, last) = (curve.points.first(), curve.points.last());
    let ends = first.zip(last).map(|((_, first), (_, last))| (number(*first), number(*last)));
    let (first, last) = ends.unwrap_or_default();
    let title = format!("{}: from {first} to {last}", curve.name);
    let description =
        format!("{} values, {} bounds that conditions set", curve.points.len(), curve.bounds.len());
    let body = html! {
        (frame.axis(top, top + HEIGHT))
        (values_axis(&scale, (canvas.left, frame.width - RIGHT)))
        @let place = canvas.name_place(top, top + HEIGHT / 2.0 + 4.0);
        // The labels of the axis are placed between the name and the curve.
        @let aside = if canvas.has_names_above { 0.0 } else { 48.0 };
        text class="label" x=(px(place.x - aside)) y=(px(place.y)) text-anchor=(place.anchor) {
            title { (curve.name) }
            (fit(&curve.name, place.room - aside))
        }
        @for bound in &curve.bounds {
            @let (from, to, y) = (frame.scale.at(bound.from), frame.scale.at(bound.to), scale.at(bound.value));
            g class="bound" {
                title { (bound.text) }
                line x1=(px(from)) x2=(px(to.max(from + 3.0))) y1=(px(y)) y2=(px(y)) {}
            }
        }
        path class="curve" data-curve=(curve.name) d=(text) {}
        @for (at, value) in &curve.points {
            circle class="point" cx=(px(frame.scale.at(*at))) cy=(px(scale.at(*value))) r="2.5" {
                title { (curve.name) " = " (number(*value)) " at " (number(*at)) }
            }
        }
    };
    Picture { width: frame.width, height: top + HEIGHT + 24.0, title, description, body }
}

/// Draws the best cost and the lower bound during a search. The messages are equally spaced,
/// because their times differ between runs but their contents do not.
pub(crate) fn search(search: &[Progress], canvas: Canvas) -> Picture {
    let (left, right) = (canvas.left, canvas.width - RIGHT);
    let costs = search.iter().filter_map(|moment| moment.cost);
    let scale = vertical(TOP, range(costs.chain(search.iter().map(|moment| moment.lower_bound))));
    let last = search.len().saturating_sub(1).max(1);
    let along = Scale::new((0.0, last as f64), (left, right));
    let line = |value: &dyn Fn(&Progress) -> Option<f64>| {
        let mut text = String::new();
        let mut before = None;
        for (index, moment) in search.iter().enumerate() {
            let Some(value) = value(moment) else { continue };
            let (x, y) = (px(along.at(index as f64)), px(scale.at(value)));
            text += &before.map_or_else(|| format!("M{x} {y}"), |before| format!("L{x} {before}L{x} {y}"));
            before = Some(y);
        }
        text
    };
    let title = format!("progress of the search, in {} messages", search.len());
    let description =
        "The cost of the best plan falls, the lower bound rises; where they meet, the plan is optimal."
            .to_owned();
    let body = html! {
        (values_axis(&scale, (left, right)))
        path class="cost" d=(line(&|moment| moment.cost)) {}
        path class="least" d=(line(&|moment| Some(moment.lower_bound))) {}
        @for (index, moment) in search.iter().enumerate() {
            @let x = px(along.at(index as f64));
            g data-progress=(index + 1) {
                title { (moment.text) }
                circle class="least" cx=(x) cy=(px(scale.at(moment.lower_bound))) r="3" {}
                @if let Some(cost) = moment.cost {
                    circle class="cost" cx=(x) cy=(px(scale.at(cost))) r="3" {}
                }
            }
        }
        text class="label cost" x=(px(left)) y=(px(TOP + HEIGHT + 19.0)) { "● cost of the best plan" }
        text class="label least" x=(px(left + 168.0)) y=(px(TOP + HEIGHT + 19.0)) { "● lower bound" }
    };
    Picture { width: canvas.width, height: TOP + HEIGHT + 26.0, title, description, body }
}

fn vertical(top: f64, (low, high): (f64, f64)) -> Scale {
    let margin = (high - low) * 0.05;
    Scale::new((low - margin, high + margin), (top + HEIGHT, top))
}

fn values_axis(scale: &Scale, (left, right): (f64, f64)) -> Markup {
    html! {
        g class="axis" {
            @for tick in scale.ticks(4) {
                @let y = scale.at(tick);
                line class="grid" x1=(px(left)) x2=(px(right)) y1=(px(y)) y2=(px(y)) {}
                text x=(px(left - 6.0)) y=(px(y + 4.0)) text-anchor="end" { (compact(tick)) }
            }
        }
    }
}
