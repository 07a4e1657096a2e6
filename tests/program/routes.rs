//! Joint optimality beside a fixed shortest route, for all pairs of places on the user's copy of the map of Cámara et al.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

use metaplan::comparison::{Coadaptation, MapOptions, Process, Risk};
use probabilistic::explore::{Bounds, explore};
use probabilistic::solve::solve;
use probabilistic::{Direction, Number, Problem};
use serde_json::Value;

use crate::probabilistic::{coadaptation, dark, mission, places, shared};

/// Neighbours, in the order of their numbers, with the lengths of the ways to them in metres.
type Graph = BTreeMap<String, Vec<(String, f64)>>;

/// What one side of the search knows.
#[derive(Default)]
struct Side {
    settled: BTreeSet<String>,
    seen: BTreeMap<String, f64>,
    routes: BTreeMap<String, Vec<String>>,
    fringe: BinaryHeap<Reverse<(u64, usize, String)>>,
}

/// A shortest route by Dijkstra's algorithm from both sides in turn, which ends when they meet (I. Pohl: Bi-directional search, 1971).
/// Of equally long ones it is the first one that is found, as with the usual library for graphs in Python: places at
/// one distance come first in, first out.
fn shortest(graph: &Graph, start: &str, goal: &str) -> Vec<String> {
    let mut sides = [start, goal].map(|place| {
        let mut side = Side::default();
        side.seen.insert(place.to_owned(), 0.0);
        side.routes.insert(place.to_owned(), vec![place.to_owned()]);
        side.fringe.push(Reverse((0.0_f64.to_bits(), 0, place.to_owned())));
        side
    });
    let mut best: Option<(f64, Vec<String>)> = None;
    let mut pushed = 1;
    let mut turn = 1;
    loop {
        turn = 1 - turn;
        let Some(Reverse((_, _, place))) = sides[turn].fringe.pop() else { panic!("no way") };
        if !sides[turn].settled.insert(place.clone()) {
            continue;
        }
        if sides[1 - turn].settled.contains(&place) {
            return best.map(|(_, route)| route).expect("they have met");
        }
        for (next, length) in &graph[&place] {
            let distance = sides[turn].seen[&place] + length;
            let is_shorter = sides[turn].seen.get(next).is_none_or(|known| distance < *known);
            if sides[turn].settled.contains(next) || !is_shorter {
                continue;
            }
            pushed += 1;
            let mut route = sides[turn].routes[&place].clone();
            route.push(next.clone());
            let side = &mut sides[turn];
            side.seen.insert(next.clone(), distance);
            // Of numbers that are not negative the bits have the same order.
            side.fringe.push(Reverse((distance.to_bits(), pushed, next.clone())));
            side.routes.insert(next.clone(), route);
            if let [Some(there), Some(back)] = sides.each_ref().map(|side| side.seen.get(next)) {
                let whole = there + back;
                if best.as_ref().is_none_or(|(least, _)| *least > whole) {
                    let back = sides[1].routes[next].iter().rev().skip(1);
                    best = Some((whole, sides[0].routes[next].iter().chain(back).cloned().collect()));
                }
            }
        }
    }
}

/// Ways with their lengths to the millimetre, and the places that some measured way leads to.
fn read(map: &str) -> (Graph, BTreeSet<String>) {
    let map: Value = serde_json::from_str(map).expect("JSON");
    let text = |value: &Value| value.as_str().expect("a name").to_owned();
    let list = |value: &Value| value.as_array().expect("a list").clone();
    let number = |value: &Value| value.as_f64().expect("a number");
    let nodes = list(&map["map"]);
    let at: BTreeMap<String, (f64, f64)> = nodes
        .iter()
        .map(|node| (text(&node["node-id"]), (number(&node["coords"]["x"]), number(&node["coords"]["y"]))))
        .collect();
    let millimetres = |a: &str, b: &str| {
        let ((x, y), (u, v)) = (at[a], at[b]);
        ((x - u).hypot(y - v) * 1000.0).round() / 1000.0
    };
    let mut graph = Graph::new();
    for node in &nodes {
        let place = text(&node["node-id"]);
        let neighbours = list(&node["connected-to"]).into_iter().map(|other| text(&other));
        let mut ways: Vec<_> = neighbours.map(|other| (other.clone(), millimetres(&place, &other))).collect();
        ways.sort_by_key(|(other, _)| other[1..].parse::<u32>().expect("a number"));
        graph.insert(place, ways);
    }
    let measured: Vec<[String; 2]> =
        list(&map["time"]).iter().map(|entry| [text(&entry["from"]), text(&entry["to"])]).collect();
    let is_way = |[from, to]: &&[String; 2]| graph[from].iter().any(|(other, _)| other == to);
    let reached = measured.iter().filter(is_way).flatten().cloned().collect();
    (graph, reached)
}

/// The least energy from each place to the goal, by the process.
fn least_energy(mission: &Coadaptation) -> BTreeMap<usize, f64> {
    let process = Process::<f64>::new(mission, Risk::default(), &["energy"]);
    let explored = explore(&process, &Bounds::default()).expect("explored");
    let goal = process.goals(&explored.states);
    let problem = Problem::new(&explored.mdp, Direction::Min, Some(&explored.rewards[0]), &goal);
    let solution = solve(problem, None).expect("small enough");
    let situations = explored.states.iter().map(|state| state.situation());
    let started = situations.zip(&solution.values).filter(|(s, _)| s.configuration == mission.initial);
    started.map(|(situation, value)| (situation.place, *value)).collect()
}

/// Route and configuration chosen together use less energy than the best configurations on the fixed shortest route in 337 of
/// 3,080 pairs: the places are those that measured ways lead to, the ways are all of the map, with the dark ones.
#[test]
fn a_fixed_shortest_route_is_beaten_on_the_map_of_camara() {
    let Some(path) = shared("real/map/map-p2cp3.json") else { return };
    let map = std::fs::read_to_string(path).expect("readable");
    let (graph, reached) = read(&map);
    let (_directory, mission) = mission(&map, &MapOptions { dark: dark(), ..places("l1", "l18") });
    let mut process = coadaptation(&mission);
    let number = |process: &Coadaptation, place: &str| {
        process.places.iter().position(|known| known.eq_ignore_ascii_case(place)).expect("a place")
    };
    let places: BTreeMap<&String, usize> = graph
        .iter()
        .filter(|(_, ways)| !ways.is_empty())
        .map(|(place, _)| (place, number(&process, place)))
        .collect();
    let energy: BTreeMap<(usize, usize), f64> = process
        .arcs
        .iter()
        .map(|arc| {
            let by = arc.by.iter().flatten().map(|traversal| Number::to_f64(&traversal.energy));
            ((arc.from, arc.to), by.fold(f64::INFINITY, f64::min))
        })
        .collect();
    let (mut pairs, mut beaten) = (0, 0);
    for goal in &reached {
        process.goal = places[goal];
        let away = reached.iter().find(|place| *place != goal).expect("another place");
        process.start = places[away];
        let least = least_energy(&process);
        for start in reached.iter().filter(|start| *start != goal) {
            let route = shortest(&graph, start, goal);
            let fixed: f64 = route.windows(2).map(|pair| energy[&(places[&pair[0]], places[&pair[1]])]).sum();
            let together = least[&places[start]];
            assert!(together <= fixed + 1e-6, "{start} to {goal}: {together} and {fixed}");
            pairs += 1;
            beaten += usize::from(together < fixed - 1e-6);
        }
    }
    assert_eq!((beaten, pairs), (337, 3_080));
}
