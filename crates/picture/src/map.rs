//! Draws the map of the places of a mission, with the moves of a plan coloured by configuration.
//!
//! Moves in opposite directions are drawn side by side. All moves from one place to another share
//! an arrow with the first three of their step numbers. All lengths are in pixels, except those of
//! [`Map`].

use std::collections::BTreeMap;

use maud::{Markup, html};

use crate::data::{Map, Plan};
use crate::frame::Canvas;
use crate::layout::{layout, spread};
use crate::palette::{Palette, configuration};
use crate::scale::{px, range, width};
use crate::svg::Picture;

/// Maximum of the side margins, which contain names of places.
const MARGIN: f64 = 70.0;
const MARGIN_PART: f64 = 0.12;
const UPPER_MARGIN: f64 = 35.0;
/// Height of a map of a single place, without margins.
const LEAST_HEIGHT: f64 = 60.0;
/// Maximum height of a map without margins, unless its places would then be too close to each
/// other.
const HEIGHT: f64 = 420.0;
/// Limits the scale of a map: the 5 % quantile of the lengths of its ways is drawn at most this long. Maps with
/// few places thus stay small.
const FARTHEST: f64 = 130.0;
/// Maximum width and height to which a map is enlarged to separate its places.
const LARGEST: f64 = 4_000.0;
/// Radius of the circle of a place, including the space around it.
const RADIUS: f64 = 7.0;
const LINE: f64 = 13.0;
/// Offset of a move from the line of its way.
const ASIDE: f64 = 2.5;
/// Distance from the centre of an arrow to its tip.
const TIP: f64 = 7.0;
/// Distance from the centre of an arrow to its sides.
const SIDE: f64 = 6.0;
const LOOP: f64 = 10.0;
/// Distance below which two places count as coinciding, and are separated.
const SAME: f64 = 2.0;
const LOOP_MARGIN: f64 = 58.0;
/// Additional distance of a name from its place, if no nearby position is free of lines.
const FARTHER: f64 = 9.0;
const DASH: f64 = 9.0;

type Point = (f64, f64);

/// An occupied rectangle: left, top, right, bottom.
type Taken = (f64, f64, f64, f64);

type Line = (Point, Point);

struct Leg {
    from: usize,
    to: usize,
    /// The numbers of the steps that move from `from` to `to`, from 1.
    steps: Vec<usize>,
    names: Vec<String>,
    shape: Shape,
}

/// The drawing of a leg: a line, or a loop around `centre`, with an arrow.
struct Shape {
    line: Line,
    centre: Option<Point>,
    arrow: Point,
    /// Direction of the arrow, as a unit vector.
    along: Point,
    /// Direction to the preferred side of the step numbers, as a unit vector.
    outwards: Point,
}

pub(crate) fn map(plan: &Plan, map: &Map, palette: &Palette, canvas: Canvas) -> Picture {
    let has_loops = plan.steps.iter().any(|step| step.way.is_some_and(|(from, to)| from == to));
    let (points, drawn_width, drawn_height) = pixels(map, canvas, has_loops);
    let legs = legs(plan, map, &points);
    let limits = (2.0, 2.0, drawn_width - 2.0, drawn_height - 2.0);
    let ways = map.ways.iter().map(|(one, other)| (points[*one], points[*other]));
    let lines: Vec<Line> = ways.chain(legs.iter().map(|leg| leg.shape.line)).collect();
    let square = |(x, y): Point, half: f64| (x - half, y - half, x + half, y + half);
    let dots = points.iter().map(|point| square(*point, RADIUS + 2.0));
    let loops = legs.iter().filter_map(|leg| leg.shape.centre).map(|centre| square(centre, LOOP));
    let arrows = legs.iter().map(|leg| square(leg.shape.arrow, SIDE));
    let mut occupied: Vec<Taken> = dots.chain(loops).chain(arrows).collect();
    // Each step number must be nearer to its own arrow than to the others, so step numbers are placed before names.
    let numbers: Vec<_> =
        legs.iter().map(|leg| number(leg, &legs, (limits, &lines), &mut occupied)).collect();
    let labels = names(map, &points, &legs, (limits, &lines), &mut occupied);
    let moves: usize = legs.iter().map(|leg| leg.steps.len()).sum();
    let title =
        format!("{} places, {} ways, and the {moves} moves of the plan", map.places.len(), map.ways.len());
    let description = "Thick lines are the moves of the plan, in the colour of the configuration; the number at an \
                       arrow is the step. A ring marks the start, a double ring the goal. The table of steps has the \
                       same content."
        .to_owned();
    let body = html! {
        @for (one, other) in &map.ways {
            @let ((x1, y1), (x2, y2)) = (points[*one], points[*other]);
            line class="way" data-way={ (map.places[*one].name) " " (map.places[*other].name) } x1=(px(x1)) y1=(px(y1)) x2=(px(x2)) y2=(px(y2)) {}
        }
        @for (leg, number) in legs.iter().zip(&numbers) { (draw_leg(leg, map, palette, *number)) }
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
    Picture { width: drawn_width, height: drawn_height, title, description, body }
}

/// Collects the moves of a plan: a leg for each pair of origin and destination, in the order of
/// these pairs.
fn legs(plan: &Plan, map: &Map, points: &[Point]) -> Vec<Leg> {
    let mut moves: BTreeMap<(usize, usize), (Vec<usize>, Vec<String>)> = BTreeMap::new();
    for (step, number) in plan.steps.iter().zip(1..) {
        if let Some(way) = step.way {
            let (steps, names) = moves.entry(way).or_default();
            steps.push(number);
            names.push(configuration(step));
        }
    }
    let legs = moves.into_iter().map(|((from, to), (steps, names))| {
        let shape = if from == to {
            let neighbours =
                map.ways.iter().filter_map(|(one, other)| match (*one == from, *other == from) {
                    (true, false) => Some(points[*other]),
                    (false, true) => Some(points[*one]),
                    _ => None,
                });
            looped(points[from], &neighbours.collect::<Vec<_>>())
        } else {
            straight(points[from], points[to])
        };
        Leg { from, to, steps, names, shape }
    });
    legs.collect()
}

/// Draws a move between two different points as a line on the right-hand side of the way.
fn straight((x1, y1): Point, (x2, y2): Point) -> Shape {
    let length = (x2 - x1).hypot(y2 - y1).max(1e-6);
    let along = ((x2 - x1) / length, (y2 - y1) / length);
    let outwards = (-along.1, along.0);
    let (sx, sy) = (outwards.0 * ASIDE, outwards.1 * ASIDE);
    // The arrow is beyond the middle of the line, so the arrows of opposite moves do not overlap,
    // even on short ways.
    let part = (0.5 + TIP / length).clamp(0.62, 0.75);
    let arrow = (x1 + (x2 - x1) * part + sx, y1 + (y2 - y1) * part + sy);
    Shape { line: ((x1 + sx, y1 + sy), (x2 + sx, y2 + sy)), centre: None, arrow, along, outwards }
}

/// Draws a move that ends at its origin as a loop, on the side of the place that is farthest from
/// its ways. The sides above and below are preferred, because step numbers need least space there.
fn looped((x, y): Point, neighbours: &[Point]) -> Shape {
    let diagonal = std::f64::consts::FRAC_1_SQRT_2;
    let upright = [(0.0, -1.0), (0.0, 1.0)];
    let slanted = [-diagonal, diagonal].map(|dy| [-diagonal, diagonal].map(|dx| (dx, dy))).concat();
    let directions = upright.into_iter().chain(slanted).chain([(-1.0, 0.0), (1.0, 0.0)]);
    let nearness = |(dx, dy): Point| {
        let parts = neighbours
            .iter()
            .map(|(nx, ny)| ((nx - x) * dx + (ny - y) * dy) / (nx - x).hypot(ny - y).max(1e-6));
        // All angles of at least 90 degrees to the ways are equally good.
        parts.fold(0.0, f64::max)
    };
    let best = directions.min_by(|one, other| nearness(*one).total_cmp(&nearness(*other)));
    let (dx, dy) = best.unwrap_or((0.0, -1.0));
    let centre = (x + dx * (RADIUS + LOOP), y + dy * (RADIUS + LOOP));
    let arrow = (centre.0 + dx * LOOP, centre.1 + dy * LOOP);
    Shape { line: (centre, arrow), centre: Some(centre), arrow, along: (-dy, dx), outwards: (dx, dy) }
}

fn numbers(leg: &Leg) -> String {
    let numbers: Vec<String> = leg.steps.iter().take(3).map(ToString::to_string).collect();
    numbers.join(",") + if leg.steps.len() > 3 { "…" } else { "" }
}

/// Finds a free rectangle for the step numbers of a leg and marks it as occupied. It is nearer to
/// the leg's arrow than to all other arrows, and no other line crosses it if possible. Returns the
/// left end of the base line, or `None` if no position is free.
fn number(
    leg: &Leg,
    legs: &[Leg],
    (limits, lines): (Taken, &[Line]),
    taken: &mut Vec<Taken>,
) -> Option<Point> {
    let Shape { arrow, along, outwards, .. } = leg.shape;
    let (half_width, half_height) = (width(&numbers(leg)) / 2.0 + 1.0, LINE / 2.0 + 1.0);
    // The step numbers of a move in the opposite direction are placed on the other side.
    let is_one_way = !legs.iter().any(|other| (other.from, other.to) == (leg.to, leg.from));
    let sides: &[f64] = if is_one_way && leg.from != leg.to { &[1.0, -1.0] } else { &[1.0] };
    let reach = outwards.0.abs() * half_width + outwards.1.abs() * half_height + SIDE + 1.0;
    let offsets = sides.iter().flat_map(|side| {
        [0.0, 6.0, 12.0, 20.0].into_iter().flat_map(move |more| {
            [0.0, 6.0, 12.0, -6.0, 20.0, -12.0, 28.0, -18.0].map(|shift| (side * (reach + more), shift))
        })
    });
    let centres = offsets.map(|(across, shift)| {
        (arrow.0 + outwards.0 * across + along.0 * shift, arrow.1 + outwards.1 * across + along.1 * shift)
    });
    let is_own = |(x, y): &Point| {
        let distance = |shape: &Shape| (shape.arrow.0 - x).hypot(shape.arrow.1 - y);
        let own_distance = distance(&leg.shape);
        legs.iter().all(|other| std::ptr::eq(other, leg) || own_distance + 1.0 < distance(&other.shape))
    };
    let places = centres
        .filter(is_own)
        .map(|(x, y)| (x - half_width, y - half_height, x + half_width, y + half_height));
    let own_line = leg.shape.line;
    let other_lines: Vec<Line> = lines.iter().copied().filter(|line| *line != own_line).collect();
    choose(places, (limits, &other_lines), taken)
}

/// Finds positions for the names of places, in the order of start and goal places, places of the
/// plan's moves, and other places. Returns for each name the left end of its base line, or `None`
/// if no position is free.
fn names(
    map: &Map,
    points: &[Point],
    legs: &[Leg],
    free: (Taken, &[Line]),
    taken: &mut Vec<Taken>,
) -> Vec<Option<Point>> {
    let is_end = |place: usize| map.places[place].is_start || map.places[place].is_goal;
    let mut used = vec![false; points.len()];
    for leg in legs {
        (used[leg.from], used[leg.to]) = (true, true);
    }
    let mut order: Vec<usize> = (0..points.len()).collect();
    // Ties are broken by index, for a reproducible picture.
    order.sort_by_key(|place| (!is_end(*place), !used[*place], *place));
    let mut labels = vec![None; points.len()];
    for place in order {
        let ring = if is_end(place) { 4.0 } else { 0.0 };
        let size = (RADIUS + 5.0 + ring, width(&map.places[place].name));
        labels[place] = room(points[place], size, free, taken);
    }
    labels
}

fn draw_leg(leg: &Leg, map: &Map, palette: &Palette, number: Option<Point>) -> Markup {
    let mut names: Vec<&String> = Vec::new();
    for name in leg.names.iter().filter(|name| !name.is_empty()) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let (from, to) = (&map.places[leg.from].name, &map.places[leg.to].name);
    let about = leg.steps.iter().zip(&leg.names);
    let about: Vec<String> =
        about.map(|(step, name)| format!("step {step}, from {from} to {to}: {name}")).collect();
    let steps: Vec<String> = leg.steps.iter().map(ToString::to_string).collect();
    // Each configuration draws one dash per period, so the colours alternate along the line.
    let dash = format!("{} {}", px(DASH), px(DASH * names.len().saturating_sub(1) as f64));
    let last = names.last().map_or_else(String::new, |name| (*name).clone());
    let Shape { line: ((x1, y1), (x2, y2)), centre, arrow: (x, y), along: (dx, dy), .. } = leg.shape;
    let arrow = format!(
        "M{} {}L{} {}L{} {}Z",
        px(x + dx * TIP),
        px(y + dy * TIP),
        px(x - dx * 4.0 - dy * SIDE),
        px(y - dy * 4.0 + dx * SIDE),
        px(x - dx * 4.0 + dy * SIDE),
        px(y - dy * 4.0 - dx * SIDE),
    );
    html! {
        g class={ "leg " (palette.class(&last)) } data-step=(steps.join(" ")) data-from=(from) data-to=(to) {
            title { (about.join("\n")) }
            @if let Some((x, y)) = centre {
                circle class="loop" cx=(px(x)) cy=(px(y)) r=(px(LOOP)) {}
            } @else if names.len() < 2 {
                line x1=(px(x1)) y1=(px(y1)) x2=(px(x2)) y2=(px(y2)) {}
            } @else {
                @for (index, name) in names.iter().enumerate() {
                    line class=(palette.class(name)) stroke-dasharray=(dash) stroke-dashoffset=(px(-DASH * index as f64)) x1=(px(x1)) y1=(px(y1)) x2=(px(x2)) y2=(px(y2)) {}
                }
            }
            path d=(arrow) {}
            @if let Some((x, y)) = number { text x=(px(x)) y=(px(y)) { (numbers(leg)) } }
        }
    }
}

/// Finds a free rectangle for a text near a point, at the distance `reach` or slightly farther, and
/// marks it as occupied. No line crosses it if possible. Returns the left end of the base line, or
/// `None` if no position is free.
fn room(
    (x, y): Point,
    (reach, width): (f64, f64),
    (limits, lines): (Taken, &[Line]),
    taken: &mut Vec<Taken>,
) -> Option<Point> {
    // The greater distance is used only if each nearby position is occupied or crossed by a line.
    let places = [reach, reach + FARTHER].into_iter().flat_map(|reach| {
        let beside = [(x + reach, y), (x - reach - width, y)];
        let across = [y - reach - LINE / 2.0, y + reach + LINE / 2.0].into_iter();
        let across = across.flat_map(move |y| [x - width / 2.0, x + 7.0, x - width - 7.0].map(|x| (x, y)));
        beside.into_iter().chain(across)
    });
    let places = places.map(|(left, middle)| {
        (left - 1.0, middle - LINE / 2.0 - 1.0, left + width + 1.0, middle + LINE / 2.0 + 1.0)
    });
    choose(places, (limits, lines), taken)
}

/// Selects the first free rectangle, preferably one that no line crosses, and marks it as occupied.
/// Returns the left end of the base line for a text in the rectangle, or `None` if none is free.
fn choose(
    places: impl Iterator<Item = Taken>,
    (limits, lines): (Taken, &[Line]),
    taken: &mut Vec<Taken>,
) -> Option<Point> {
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

/// Returns `true` if a line intersects a rectangle (line clipping by Liang and Barsky, 1984).
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

fn pixels(map: &Map, canvas: Canvas, has_loops: bool) -> (Vec<Point>, f64, f64) {
    let positions: Option<Vec<Point>> = map.places.iter().map(|place| place.position).collect();
    let points = positions.unwrap_or_else(|| layout(map.places.len(), &map.ways));
    let ((left, right), (low, high)) = (range(points.iter().map(|p| p.0)), range(points.iter().map(|p| p.1)));
    let (across, upwards) = ((right - left).max(1e-9), (high - low).max(1e-9));
    let lengths = map
        .ways
        .iter()
        .map(|(one, other)| (points[*one].0 - points[*other].0).hypot(points[*one].1 - points[*other].1));
    // Ways between places at nearly equal positions are ignored; such places are separated later.
    let shortest = across.max(upwards) * SAME / LARGEST;
    let mut lengths: Vec<f64> = lengths.filter(|length| *length > shortest).collect();
    lengths.sort_by(f64::total_cmp);
    // The 5 % quantile is used, so that a few very short ways do not enlarge the whole map.
    let shortest = lengths.get(lengths.len() / 20).copied().unwrap_or(across);
    let least_margin = if has_loops { LOOP_MARGIN } else { 0.0 };
    let margin = (canvas.width * MARGIN_PART).min(MARGIN).max(least_margin);
    let upper = UPPER_MARGIN.max(least_margin);
    let widest = (canvas.width - 2.0 * margin) / across;
    let least = (canvas.apart / shortest).min(LARGEST / across.max(upwards));
    let scale = widest.min(HEIGHT / upwards).max(least).min(FARTHEST / shortest).max(1e-9);
    let height = (upwards * scale).max(if map.places.len() > 1 { 0.0 } else { LEAST_HEIGHT });
    let place = |(x, y): &Point| (margin + (x - left) * scale, upper + (high - y) * scale);
    let mut drawn: Vec<Point> = points.iter().map(place).collect();
    spread(&mut drawn, SAME, 2.0 * RADIUS + 4.0);
    (drawn, across * scale + 2.0 * margin, height + 2.0 * upper)
}
