//! Graph layout for places without coordinates. Distances in the picture approximate the lengths of
//! shortest paths, in numbers of ways.
//!
//! The method is stress majorization (E. Gansner, Y. Koren, S. North: Graph drawing by stress majorization, GD
//! 2004). The start layout is deterministic: its coordinates follow from the path lengths from two places far
//! apart, and from a third place far from both.

use std::collections::VecDeque;

/// Maximum number of pairs of places in a connected component. Larger components keep the start
/// layout.
const DISTANCES: usize = 4_000_000;
/// Maximum work of majorization for a connected component: rounds times pairs of places.
const WORK: usize = 30_000_000;
/// Maximum number of rounds of majorization; after these the layout hardly changes.
const ROUNDS: usize = 300;

/// Computes coordinates for the places `0..places`. Ways have a length of about 1, except in
/// components that keep the start layout. Ways to unknown places, and from a place to itself, are
/// ignored.
pub(crate) fn layout(places: usize, ways: &[(usize, usize)]) -> Vec<(f64, f64)> {
    let mut neighbours = vec![Vec::new(); places];
    for &(one, other) in ways.iter().filter(|(one, other)| one != other && *one.max(other) < places) {
        neighbours[one].push(other);
        neighbours[other].push(one);
    }
    let mut points = vec![(0.0, 0.0); places];
    // Connected components are placed side by side.
    let mut right = 0.0_f64;
    for component in components(&neighbours) {
        let component_points = placed(&component, &neighbours);
        let (low, high) = component_points
            .iter()
            .fold((f64::MAX, f64::MIN), |(low, high), (x, _)| (low.min(*x), high.max(*x)));
        for (place, (x, y)) in component.iter().zip(&component_points) {
            points[*place] = (right + x - low, *y);
        }
        right += high - low + 1.0;
    }
    points
}

fn components(neighbours: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let mut visited = vec![false; neighbours.len()];
    let mut groups = Vec::new();
    for first in 0..neighbours.len() {
        if !visited[first] {
            let reached = distances(first, neighbours);
            let group: Vec<usize> = (0..neighbours.len()).filter(|place| reached[*place].is_some()).collect();
            for place in &group {
                visited[*place] = true;
            }
            groups.push(group);
        }
    }
    groups
}

fn distances(from: usize, neighbours: &[Vec<usize>]) -> Vec<Option<u32>> {
    let mut distances = vec![None; neighbours.len()];
    let mut queue = VecDeque::from([(from, 0)]);
    distances[from] = Some(0);
    while let Some((place, distance)) = queue.pop_front() {
        for &next in &neighbours[place] {
            if distances[next].is_none() {
                distances[next] = Some(distance + 1);
                queue.push_back((next, distance + 1));
            }
        }
    }
    distances
}

fn placed(group: &[usize], neighbours: &[Vec<usize>]) -> Vec<(f64, f64)> {
    let of = |from: usize| -> Vec<f64> {
        let distances_from = distances(from, neighbours);
        group.iter().map(|place| f64::from(distances_from[*place].unwrap_or(0))).collect()
    };
    let farthest = |distances: &[f64]| {
        let order = (0..distances.len())
            .max_by(|left, right| distances[*left].total_cmp(&distances[*right]).then(right.cmp(left)));
        order.unwrap_or(0)
    };
    // Both ends of a long path, and a place far from both ends: the distances from these places
    // span two dimensions.
    let first = farthest(&of(group[0]));
    let from_first = of(group[first]);
    let from_last = of(group[farthest(&from_first)]);
    let least: Vec<f64> = from_first.iter().zip(&from_last).map(|(one, other)| one.min(*other)).collect();
    let from_side = of(group[farthest(&least)]);
    let start = (0..group.len()).map(|place| {
        // Majorization cannot separate points at equal positions, because no direction is given.
        let little = 0.05 * (place as f64 * 0.754_877_666).fract();
        (
            from_first[place] - from_last[place] + little,
            from_side[place] + 0.05 * (place as f64 * 0.569_840_291).fract(),
        )
    });
    let mut points: Vec<(f64, f64)> = start.collect();
    let count = group.len();
    if count * count <= DISTANCES {
        let pairwise: Vec<Vec<f64>> = group.iter().map(|place| of(*place)).collect();
        for _ in 0..ROUNDS.min(WORK / (count * count).max(1)) {
            points = majorized(&points, &pairwise);
        }
    }
    turned(&points)
}

/// Performs one round of majorization: each place moves to the weighted mean of the positions that
/// its desired distances to the other places suggest. Near places have more weight.
fn majorized(points: &[(f64, f64)], distances: &[Vec<f64>]) -> Vec<(f64, f64)> {
    let place = |moved: usize| {
        let (mut x, mut y, mut weights) = (0.0, 0.0, 0.0);
        for (other, distance) in distances[moved].iter().enumerate().filter(|(other, _)| *other != moved) {
            let (dx, dy) = (points[moved].0 - points[other].0, points[moved].1 - points[other].1);
            let (weight, pull) = (1.0 / (distance * distance), distance / dx.hypot(dy).max(1e-6));
            x += weight * (points[other].0 + dx * pull);
            y += weight * (points[other].1 + dy * pull);
            weights += weight;
        }
        if weights > 0.0 { (x / weights, y / weights) } else { points[moved] }
    };
    (0..points.len()).map(place).collect()
}

/// Rotates the points such that their longest extent is horizontal. Mirrors them such that the
/// first place is to the left of and above the centre.
fn turned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let count = points.len() as f64;
    let sum = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0, y + point.1));
    let (x, y) = (sum.0 / count, sum.1 / count);
    let moments = points.iter().fold((0.0, 0.0, 0.0), |(xx, xy, yy), point| {
        let (dx, dy) = (point.0 - x, point.1 - y);
        (xx + dx * dx, xy + dx * dy, yy + dy * dy)
    });
    // For a symmetric extent such as a square, all directions are equally good.
    let angle = 0.5 * (2.0 * moments.1).atan2(moments.0 - moments.2);
    let (sin, cos) = angle.sin_cos();
    let mut turned: Vec<(f64, f64)> = points
        .iter()
        .map(|point| {
            let (dx, dy) = (point.0 - x, point.1 - y);
            (dx * cos + dy * sin, dy * cos - dx * sin)
        })
        .collect();
    // The tolerances prevent that rounding mirrors a symmetric layout.
    let (flip_x, flip_y) = (turned[0].0 > 1e-9, turned[0].1 < -1e-9);
    for point in &mut turned {
        *point = (if flip_x { -point.0 } else { point.0 }, if flip_y { -point.1 } else { point.1 });
    }
    turned
}

/// Separates points that nearly coincide. Each point belongs to the first group whose first point
/// is closer than `same`. The points of a group are moved to a ring around its first point, with a
/// distance of `apart` between neighbours. Groups of one point are unchanged.
pub(crate) fn spread(points: &mut [(f64, f64)], same: f64, apart: f64) {
    let mut groups: Vec<((f64, f64), Vec<usize>)> = Vec::new();
    for (index, (x, y)) in points.iter().enumerate() {
        match groups.iter_mut().find(|((gx, gy), _)| (gx - x).hypot(gy - y) < same) {
            Some((_, group)) => group.push(index),
            None => groups.push(((*x, *y), vec![index])),
        }
    }
    for ((x, y), group) in groups.iter().filter(|(_, group)| group.len() > 1) {
        // Neighbours on a ring of this radius have the distance `apart` (chord length).
        let part = std::f64::consts::PI / group.len() as f64;
        let radius = apart / 2.0 / part.sin();
        for (index, number) in group.iter().zip(0..) {
            let (sin, cos) = (2.0 * part * f64::from(number) + std::f64::consts::PI).sin_cos();
            points[*index] = (x + radius * cos, y + radius * sin);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{layout, spread};

    #[test]
    fn points_at_one_position_are_spread_and_others_stay() {
        let mut points = vec![(0.0, 0.0), (100.0, 0.0), (0.0, 0.0), (3.0, 0.0), (0.0, 0.0), (0.0, 0.0)];
        spread(&mut points, 4.0, 18.0);
        assert_eq!(points[1], (100.0, 0.0));
        for one in 0..points.len() {
            for other in 0..one {
                let (a, b) = (points[one], points[other]);
                assert!((a.0 - b.0).hypot(a.1 - b.1) > 17.9, "{one} {other}: {points:?}");
            }
            assert!(points[one].0.hypot(points[one].1) < 60.0 || one == 1, "{points:?}");
        }
    }

    fn grid(side: usize) -> Vec<(usize, usize)> {
        let at = |row: usize, column: usize| row * side + column;
        let rows =
            (0..side).flat_map(|row| (1..side).map(move |column| (at(row, column - 1), at(row, column))));
        let columns =
            (1..side).flat_map(|row| (0..side).map(move |column| (at(row - 1, column), at(row, column))));
        rows.chain(columns).collect()
    }

    #[test]
    fn neighbours_lie_near_and_no_places_coincide() {
        for side in [2, 3, 5] {
            let points = layout(side * side, &grid(side));
            let between = |one: usize, other: usize| {
                let (one, other): ((f64, f64), (f64, f64)) = (points[one], points[other]);
                (one.0 - other.0).hypot(one.1 - other.1)
            };
            for (one, other) in grid(side) {
                assert!((0.5..1.6).contains(&between(one, other)), "{side}: {one} {other} {points:?}");
            }
            for one in 0..side * side {
                for other in 0..one {
                    assert!(between(one, other) > 0.5, "{side}: {one} {other} {points:?}");
                }
            }
        }
    }

    #[test]
    fn places_without_ways_are_placed_too() {
        let points = layout(3, &[]);
        assert_eq!(points.len(), 3);
        assert!(points[0].0 < points[1].0 && points[1].0 < points[2].0);
        assert!(layout(0, &[]).is_empty());
    }
}
