//! The places of a mission, the ways between them, and the way that a plan takes, coloured by configuration.

use std::collections::BTreeMap;

use maud::{Markup, html};

use crate::data::{Map, Plan};
use crate::layout::layout;
use crate::palette::{Palette, configuration};
use crate::scale::{px, range, width};
use crate::svg::Picture;

/// The greatest width of a map without its margins, and the least height.
const WIDTH: f64 = 780.0;
const LEAST_HEIGHT: f64 = 60.0;
const MARGIN: f64 = 70.0;
/// Two places that are next to each other lie so far apart at least, if the map is not too large for that.
const APART: f64 = 46.0;
const LARGEST: f64 = 4_000.0;
/// The radius of a place.
const RADIUS: f64 = 7.0;
/// The height of a label.
const LINE: f64 = 13.0;

/// A rectangle that is taken: left, top, right, bottom.
type Taken = (f64, f64, f64, f64);

/// From one point to another.
type Line = ((f64, f64), (f64, f64));

/// Draws a map with a plan's way.
pub(crate) fn map(plan: &Plan, map: &Map, palette: &Palette) -> Picture {
    let (points, drawing_width, drawing_height) = pixels(map);
    let legs = legs(plan);
    let mut taken: Vec<Taken> = points
        .iter()
        .map(|(x, y)| (x - RADIUS - 2.0, y - RADIUS - 2.0, x + RADIUS + 2.0, y + RADIUS + 2.0))
        .collect();
    let lines: Vec<Line> = map.ways.iter().map(|(one, other)| (points[*one], points[*other])).collect();
    let limits = (2.0, 2.0, drawing_width - 2.0, drawing_height - 2.0);
    // Places that matter most get their labels first.
    let mut order: Vec<usize> = (0..points.len()).collect();
    let is_used = |place: usize| legs.keys().any(|(from, to)| *from == place || *to == place);
    let used: Vec<bool> = (0..points.len()).map(is_used).collect();
    order.sort_by_key(|place| {
        (!map.places[*place].is_start && !map.places[*place].is_goal, !used[*place], *place)
    });
    let mut labels: Vec<Option<(f64, f64)>> = vec![None; points.len()];
    for place in order {
        let ring = if map.places[place].is_start || map.places[place].is_goal { 4.0 } else { 0.0 };
        let size = (RADIUS + 5.0 + ring, width(&map.places[place].name));
        labels[place] = room(points[place], size, (limits, &lines), &mut taken);
    }
    let moves: usize = legs.values().map(|(steps, _)| steps.len()).sum();
    let title =
        format!("{} places, {} ways, and the {moves} moves of the plan", map.places.len(), map.ways.len());
    let description = "A thick line is taken by the plan, in the colour of the configuration; its number is the step. A ring is \
                       where it begins, a double ring where it is to end. The table of steps says the same."
        .to_owned();
    let body = html! {
        @for (one, other) in &map.ways {
            @let ((x1, y1), (x2, y2)) = (points[*one], points[*other]);
            line class="way" data-way={ (map.places[*one].name) " " (map.places[*other].name) } x1=(px(x1)) y1=(px(y1)) x2=(px(x2)) y2=(px(y2)) {}
        }
        @for ((from, to), (steps, name)) in &legs {
            (leg((points[*from], points[*to]), steps, &palette.class(name), ((limits, &lines), &mut taken), &about(map, *from, *to, name)))
        }
        @for (index, place) in map.places.iter().enumerate() {
            @let (x, y) = points[index];
            g class="place" data-place=(place.name) {
                title { (place.name) }
                circle cx=(px(x)) cy=(px(y)) r=(px(RADIUS - 2.0)) {}
                @if place.is_start || place.is_goal { circle class="ring" cx=(px(x)) cy=(px(y)) r=(px(RADIUS + 1.0)) {} }
                @if place.is_goal { circle class="ring" cx=(px(x)) cy=(px(y)) r=(px(RADIUS + 4.0)) {} }
                @if let Some((x, y)) = labels[index] {
                    text x=(px(x)) y=(px(y)) { (place.name) }
                }
            }
        }
    };
    Picture { width: drawing_width, height: drawing_height, title, description, body }
}

/// For each pair of places the steps, from 1, that lead from the one to the other, and the configuration of the last.
fn legs(plan: &Plan) -> BTreeMap<(usize, usize), (Vec<usize>, String)> {
    let mut legs: BTreeMap<(usize, usize), (Vec<usize>, String)> = BTreeMap::new();
    for (step, number) in plan.steps.iter().zip(1..) {
        if let Some(way) = step.way {
            let leg = legs.entry(way).or_default();
            leg.0.push(number);
            leg.1 = configuration(step);
        }
    }
    legs
}

fn about(map: &Map, from: usize, to: usize, configuration: &str) -> String {
    format!("from {} to {}: {configuration}", map.places[from].name, map.places[to].name)
}

/// Draws a move, with an arrow and the number of its first step beside it, if there is room.
fn leg(
    ((x1, y1), (x2, y2)): ((f64, f64), (f64, f64)),
    steps: &[usize],
    class: &str,
    (free, taken): ((Taken, &[Line]), &mut Vec<Taken>),
    about: &str,
) -> Markup {
    let length = (x2 - x1).hypot(y2 - y1).max(1e-6);
    let (dx, dy) = ((x2 - x1) / length, (y2 - y1) / length);
    // Ways there and back lie beside each other.
    let (sx, sy) = (-dy * 2.5, dx * 2.5);
    let (x, y) = (x1 + (x2 - x1) * 0.62 + sx, y1 + (y2 - y1) * 0.62 + sy);
    let numbers: Vec<String> = steps.iter().take(3).map(ToString::to_string).collect();
    let text = numbers.join(",") + if steps.len() > 3 { "…" } else { "" };
    let middle = (x1 + (x2 - x1) * 0.38 + sx, y1 + (y2 - y1) * 0.38 + sy);
    let label = room(middle, (RADIUS + 5.0, width(&text)), free, taken);
    let arrow = format!(
        "M{} {}L{} {}L{} {}Z",
        px(x + dx * 7.0),
        px(y + dy * 7.0),
        px(x - dx * 4.0 - dy * 6.0),
        px(y - dy * 4.0 + dx * 6.0),
        px(x - dx * 4.0 + dy * 6.0),
        px(y - dy * 4.0 - dx * 6.0),
    );
    let all: Vec<String> = steps.iter().map(ToString::to_string).collect();
    html! {
        g class={ "leg " (class) } data-step=(all.join(" ")) {
            title { "step " (all.join(", ")) ", " (about) }
            line x1=(px(x1 + sx)) y1=(px(y1 + sy)) x2=(px(x2 + sx)) y2=(px(y2 + sy)) {}
            path d=(arrow) {}
            @if let Some((x, y)) = label { text x=(px(x)) y=(px(y)) { (text) } }
        }
    }
}

/// Where a text of this width can stand beside a point without touching what is there, and if possible no line: the left end of its base
/// line. `reach` is how far the point itself goes. The room is taken then.
fn room(
    (x, y): (f64, f64),
    (reach, width): (f64, f64),
    (limits, lines): (Taken, &[Line]),
    taken: &mut Vec<Taken>,
) -> Option<(f64, f64)> {
    let beside = [(x + reach, y), (x - reach - width, y)];
    let across = [y - reach - LINE / 2.0, y + reach + LINE / 2.0];
    let above = across.into_iter().flat_map(|y| [(x - width / 2.0, y), (x + 3.0, y), (x - width - 3.0, y)]);
    let places = beside.into_iter().chain(above).map(|(left, middle)| {
        (left - 1.0, middle - LINE / 2.0 - 1.0, left + width + 1.0, middle + LINE / 2.0 + 1.0)
    });
    let is_free = |wanted: &Taken| {
        let inside =
            wanted.0 >= limits.0 && wanted.1 >= limits.1 && wanted.2 <= limits.2 && wanted.3 <= limits.3;
        let apart = |other: &Taken| {
            wanted.2 <= other.0 || other.2 <= wanted.0 || wanted.3 <= other.1 || other.3 <= wanted.1
        };
        inside && taken.iter().all(apart)
    };
    let free: Vec<Taken> = places.filter(is_free).collect();
    let clear = free.iter().find(|wanted| !lines.iter().any(|line| crosses(*line, **wanted)));
    let chosen = *clear.or(free.first())?;
    taken.push(chosen);
    Some((chosen.0 + 1.0, f64::midpoint(chosen.1, chosen.3) + 4.0))
}

/// Whether a line comes into a rectangle, by what is left of it between the sides (Liang and Barsky, 1984).
fn crosses(((x1, y1), (x2, y2)): Line, (left, top, right, bottom): Taken) -> bool {
    let (dx, dy) = (x2 - x1, y2 - y1);
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for (slope, distance) in [(-dx, x1 - left), (dx, right - x1), (-dy, y1 - top), (dy, bottom - y1)] {
        if slope == 0.0 {
            if distance < 0.0 {
                return false;
            }
        } else if slope < 0.0 {
            from = from.max(distance / slope);
        } else {
            to = to.min(distance / slope);
        }
    }
    from <= to
}

/// Where the places are drawn, and how wide and high the picture is.
fn pixels(map: &Map) -> (Vec<(f64, f64)>, f64, f64) {
    let known: Option<Vec<(f64, f64)>> = map.places.iter().map(|place| place.position).collect();
    let points = known.unwrap_or_else(|| layout(map.places.len(), &map.ways));
    let ((left, right), (low, high)) = (range(points.iter().map(|p| p.0)), range(points.iter().map(|p| p.1)));
    let (across, upwards) = ((right - left).max(1e-9), (high - low).max(1e-9));
    let lengths = map
        .ways
        .iter()
        .map(|(one, other)| (points[*one].0 - points[*other].0).hypot(points[*one].1 - points[*other].1));
    let mut lengths: Vec<f64> = lengths.filter(|length| *length > 0.0).collect();
    lengths.sort_by(f64::total_cmp);
    // The shortest ways but for a few decide.
    let shortest = lengths.get(lengths.len() / 20).copied().unwrap_or(across);
    let widest = WIDTH / across;
    let least = (APART / shortest).min(LARGEST / across.max(upwards));
    let scale = widest.min(420.0 / upwards).max(least).min(130.0 / shortest).max(1e-9);
    let height = (upwards * scale).max(if map.places.len() > 1 { 0.0 } else { LEAST_HEIGHT });
    let place = |(x, y): &(f64, f64)| (MARGIN + (x - left) * scale, MARGIN / 2.0 + (high - y) * scale);
    let drawn: Vec<(f64, f64)> = points.iter().map(place).collect();
    (drawn, across * scale + 2.0 * MARGIN, height + MARGIN)
}
