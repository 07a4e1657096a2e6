//! The published procedure: the five shortest routes, one configuration for the whole route, and a
//! utility.
//!
//! The procedure is described by Cámara, Schmerl and Garlan (SEAMS 2020); its details are those of the public
//! re-implementation. Simple paths are sorted by length and the first five are kept. For each route, the best
//! configuration is determined by the priority property, and the other properties are evaluated with this
//! configuration. The route with the best utility is chosen. The original uses a model checker for these
//! values; this module computes them directly, by sums over the route. Two peculiarities are preserved. Each
//! move that can collide overwrites the flag `collided`, so only the last of these moves counts. An empty
//! battery does not end a mission.

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};

use crate::comparison::coadaptation::{Arc, Coadaptation, Traversal};
use crate::comparison::process::Action;
use probabilistic::Number;

pub(super) const ROUTES: usize = 5;
/// Weights of the priority property and of each other property in the utility.
const WEIGHTS: [f64; 2] = [0.6, 0.2];
const MAX_PARTIAL_ROUTES: usize = 2_000_000;

/// Property that the published procedure considers first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Priority {
    /// The time until the goal.
    Time,
    /// The energy until the goal.
    Energy,
    /// The probability of no collision.
    Safety,
}

/// Decision of the published procedure, with its predicted values.
#[derive(Debug, Clone, PartialEq)]
pub struct Published {
    /// Numbers of the arcs of the route, in order.
    pub route: Vec<usize>,
    /// Number of the configuration for the whole route.
    pub configuration: usize,
    /// Utility of the decision, from 0 to 1.
    pub utility: f64,
    /// Predicted time, in the mission's time unit.
    pub time: f64,
    /// Predicted energy, in the mission's unit.
    pub energy: f64,
    /// Predicted probability that the last risky move does not collide.
    pub not_collided: f64,
}

impl Published {
    /// Returns the robot's actions: one reconfiguration if necessary, then the route.
    pub fn actions(&self, mission: &Coadaptation) -> Vec<Action> {
        let change = (self.configuration != mission.initial).then_some(Action::Change(self.configuration));
        change.into_iter().chain(self.route.iter().map(|arc| Action::Move(*arc))).collect()
    }
}

/// Returns at most `max_routes` simple routes from start to goal, in ascending length. The length of an arc is its
/// least time over all configurations. Arcs that no configuration can traverse are in no route. The search stops after
/// 2,000,000 partial routes with the routes found until then.
pub fn shortest_routes(mission: &Coadaptation, max_routes: usize) -> Vec<Vec<usize>> {
    // The queue needs totally ordered lengths, so they are rounded to millionths of the time unit. Sums of lengths near
    // the maximum saturate.
    let scaled = |arc: &Arc| {
        let times = arc.by.iter().flatten().map(|traversal| traversal.time.to_f64());
        times.min_by(f64::total_cmp).map(|time| (time * 1e6).round() as u128)
    };
    let lengths: Vec<Option<u128>> = mission.arcs.iter().map(scaled).collect();
    // The exact distance to the goal is the A* heuristic, so routes are completed in ascending
    // length.
    let distances = to_goal(mission, &lengths);
    let begin = distances[mission.start].map(|distance| Reverse((distance, Vec::<usize>::new())));
    let mut queue: BinaryHeap<_> = begin.into_iter().collect();
    let mut leaving = vec![Vec::new(); mission.places.len()];
    for (number, arc) in mission.arcs.iter().enumerate() {
        leaving[arc.from].push(number);
    }
    let (mut routes, mut steps) = (Vec::new(), 0);
    while routes.len() < max_routes
        && let Some(Reverse((_, route))) = queue.pop()
    {
        steps += 1;
        if steps > MAX_PARTIAL_ROUTES {
            break;
        }
        let at = route.last().map_or(mission.start, |arc| mission.arcs[*arc].to);
        if at == mission.goal {
            routes.push(route);
            continue;
        }
        let so_far = route.iter().filter_map(|arc| lengths[*arc]).fold(0, u128::saturating_add);
        let visited: BTreeSet<usize> =
            route.iter().map(|arc| mission.arcs[*arc].from).chain(std::iter::once(at)).collect();
        for number in &leaving[at] {
            let arc = &mission.arcs[*number];
            // Routes are simple paths.
            if !visited.contains(&arc.to)
                && let (Some(length), Some(distance)) = (lengths[*number], distances[arc.to])
            {
                let mut longer = route.clone();
                longer.push(*number);
                let estimate = so_far.saturating_add(length).saturating_add(distance);
                queue.push(Reverse((estimate, longer)));
            }
        }
    }
    routes
}

/// Returns the length of the shortest route from each place to the goal; `None` if no route exists.
fn to_goal(mission: &Coadaptation, lengths: &[Option<u128>]) -> Vec<Option<u128>> {
    let mut entering = vec![Vec::new(); mission.places.len()];
    for (number, arc) in mission.arcs.iter().enumerate() {
        entering[arc.to].push(number);
    }
    let mut best: Vec<Option<u128>> = vec![None; mission.places.len()];
    let mut queue = BinaryHeap::from([Reverse((0_u128, mission.goal))]);
    while let Some(Reverse((so_far, place))) = queue.pop() {
        // Dijkstra's algorithm: the first visit has the least distance.
        if best[place].is_some() {
            continue;
        }
        best[place] = Some(so_far);
        for number in &entering[place] {
            let from = mission.arcs[*number].from;
            if let (None, Some(length)) = (best[from], lengths[*number]) {
                queue.push(Reverse((so_far.saturating_add(length), from)));
            }
        }
    }
    best
}

/// Returns the time, the energy and the probability of no collision that the published model predicts. The initial
/// change to the configuration is included. Returns `None` if the route cannot be traversed with the configuration.
fn believed(mission: &Coadaptation, route: &[usize], configuration: usize) -> Option<[f64; 3]> {
    let way: Option<Vec<&Traversal>> =
        route.iter().map(|arc| mission.arcs[*arc].by[configuration].as_ref()).collect();
    let way = way?;
    let switch = mission.switches[mission.initial][configuration].as_ref();
    let begin = switch.map_or([0.0; 2], |switch| [switch.time.to_f64(), switch.energy.to_f64()]);
    let time = way.iter().fold(begin[0], |sum, traversal| sum + traversal.time.to_f64());
    let energy = way.iter().fold(begin[1], |sum, traversal| sum + traversal.energy.to_f64());
    // The published model overwrites its collision flag, so only the last risky move counts.
    let last_risky = way.iter().rev().map(|traversal| traversal.hit.to_f64()).find(|hit| *hit > 0.0);
    Some([time, energy, 1.0 - last_risky.unwrap_or(0.0)])
}

/// Runs the published procedure. Returns `None` if no route can be traversed.
pub fn published(mission: &Coadaptation, priority: Priority) -> Option<Published> {
    let available = |configuration: &usize| mission.configurations[*configuration].available;
    let mut candidates = Vec::new();
    for route in shortest_routes(mission, ROUTES) {
        let drivable = (0..mission.configurations.len()).filter(available);
        let believed = drivable.filter_map(|c| believed(mission, &route, c).map(|values| (c, values)));
        // Time and energy are minimised; the probability is maximised.
        let key = |[time, energy, safety]: &[f64; 3]| match priority {
            Priority::Time => *time,
            Priority::Energy => *energy,
            Priority::Safety => -safety,
        };
        let best = believed.min_by(|(_, a), (_, b)| key(a).total_cmp(&key(b)));
        candidates.extend(best.map(|(configuration, values)| (route, configuration, values)));
    }
    let greatest =
        |of: usize| candidates.iter().map(|(.., values)| values[of]).fold(f64::MIN_POSITIVE, f64::max);
    let scale =
        [greatest(0), mission.battery.map_or(greatest(1), |b| f64::from(b.initial) * f64::from(b.unit))];
    let utility = |values: &[f64; 3]| {
        let single = [1.0 - values[0] / scale[0], 1.0 - (values[1] / scale[1]).min(1.0), values[2]];
        let weighted =
            single.iter().enumerate().map(|(of, u)| u * WEIGHTS[usize::from(of != priority as usize)]);
        weighted.sum::<f64>()
    };
    let best = candidates.iter().max_by(|(.., a), (.., b)| utility(a).total_cmp(&utility(b)))?;
    let (route, configuration, values) = best;
    Some(Published {
        route: route.clone(),
        configuration: *configuration,
        utility: utility(values),
        time: values[0],
        energy: values[1],
        not_collided: values[2],
    })
}

#[cfg(test)]
mod tests {
    use num_bigint::BigInt;
    use num_rational::BigRational;

    use super::*;
    use crate::comparison::coadaptation::Configuration;

    #[test]
    fn routes_have_traversable_arcs_and_may_be_long() {
        let arc = |from, to, exponent: Option<u32>| {
            let traversal = exponent.map(|exponent| Traversal {
                time: BigRational::from_integer(BigInt::from(10).pow(exponent)),
                energy: BigRational::default(),
                success: BigRational::from_integer(1.into()),
                hit: BigRational::default(),
            });
            Arc { from, to, by: vec![traversal] }
        };
        let check = |arcs: Vec<Arc>, expected: &[&[usize]]| {
            let configuration =
                Configuration { name: "c".to_owned(), components: Vec::new(), available: true };
            let mission = Coadaptation {
                places: ["a", "b", "c"].map(str::to_owned).to_vec(),
                start: 0,
                goal: 2,
                configurations: vec![configuration],
                initial: 0,
                arcs,
                switches: vec![vec![None]],
                battery: None,
                loss: None,
            };
            assert_eq!(shortest_routes(&mission, ROUTES), expected);
        };
        let long = |direct| vec![arc(0, 1, Some(14)), arc(0, 2, direct), arc(1, 2, Some(14))];
        check(long(Some(15)), &[&[0, 2], &[1]]);
        check(long(Some(13)), &[&[1], &[0, 2]]);
        check(long(None), &[&[0, 2]]);
        check(vec![arc(0, 1, Some(300)), arc(1, 2, Some(300))], &[&[0, 1]]);
        check(vec![arc(0, 1, Some(0)), arc(1, 2, None)], &[]);
    }
}
