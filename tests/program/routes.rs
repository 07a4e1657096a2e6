//! Comparison of joint optimisation with a fixed shortest route, for all pairs of places with measured ways
//! on the map of Cámara et al.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

use metaplan::comparison::{Coadaptation, MapOptions, Process, Risk};
use probabilistic::explore::{Bounds, explore};
use probabilistic::solve::solve;
use probabilistic::{Direction, Number, Problem};
use serde_json::Value;
use test_resources::data;

use crate::probabilistic::{coadaptation, dark, mission, places};

/// Maps each place to its neighbours in numeric order, with the lengths of the ways in metres.
type Graph = BTreeMap<String, Vec<(String, f64)>>;

#[derive(Default)]
struct Side {
    settled: BTreeSet<String>,
    distances: BTreeMap<String, f64>,
    routes: BTreeMap<String, Vec<String>>,
    fringe: BinaryHeap<Reverse<(u64, usize, String)>>,
}

/// Returns the shortest route by bidirectional Dijkstra (I. Pohl: Bi-directional search, 1971), with
/// alternating expansions of both sides. Ties are broken as in the common Python graph library: the first
/// route found wins, and places at equal distance are expanded in the order of insertion.
fn shortest(graph: &Graph, start: &str, goal: &str) -> Vec<String> {
    let mut sides = [start, goal].map(|place| {
        let mut side = Side::default();
        side.distances.insert(place.to_owned(), 0.0);
        side.routes.insert(place.to_owned(), vec![place.to_owned()]);
        side.fringe.push(Reverse((0.0_f64.to_bits(), 0, place.to_owned())));
        side
    });
    let mut best: Option<(f64, Vec<String>)> = None;
    let mut push_count = 1;
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
        for (neighbour, length) in &graph[&place] {
            let distance = sides[turn].distances[&place] + length;
            let is_shorter = sides[turn].distances.get(neighbour).is_none_or(|previous| distance < *previous);
            if sides[turn].settled.contains(neighbour) || !is_shorter {
                continue;
            }
            push_count += 1;
            let mut route = sides[turn].routes[&place].clone();
            route.push(neighbour.clone());
            let side = &mut sides[turn];
            side.distances.insert(neighbour.clone(), distance);
            // The bit patterns of non-negative floats are ordered like the numbers and, unlike floats,
            // implement `Ord`.
            side.fringe.push(Reverse((distance.to_bits(), push_count, neighbour.clone())));
            side.routes.insert(neighbour.clone(), route);
            if let [Some(from_start), Some(from_goal)] =
                sides.each_ref().map(|side| side.distances.get(neighbour))
            {
                let total = from_start + from_goal;
                if best.as_ref().is_none_or(|(best_length, _)| *best_length > total) {
                    let return_route = sides[1].routes[neighbour].iter().rev().skip(1);
                    best = Some((
                        total,
                        sides[0].routes[neighbour].iter().chain(return_route).cloned().collect(),
                    ));
                }
            }
        }
    }
}

/// Parses the map. Returns the graph with lengths rounded to millimetres, and the endpoints of ways with
/// measurements.
fn read(map: &str) -> (Graph, BTreeSet<String>) {
    let map: Value = serde_json::from_str(map).expect("JSON");
    let text = |value: &Value| value.as_str().expect("a name").to_owned();
    let list = |value: &Value| value.as_array().expect("a list").clone();
    let number = |value: &Value| value.as_f64().expect("a number");
    let nodes = list(&map["map"]);
    let coordinates: BTreeMap<String, (f64, f64)> = nodes
        .iter()
        .map(|node| (text(&node["node-id"]), (number(&node["coords"]["x"]), number(&node["coords"]["y"]))))
        .collect();
    let millimetres = |a: &str, b: &str| {
        let ((x, y), (u, v)) = (coordinates[a], coordinates[b]);
        ((x - u).hypot(y - v) * 1000.0).round() / 1000.0
    };
    let mut graph = Graph::new();
    for node in &nodes {
        let place = text(&node["node-id"]);
        let neighbours = list(&node["connected-to"]).into_iter().map(|neighbour| text(&neighbour));
        let mut ways: Vec<_> =
            neighbours.map(|neighbour| (neighbour.clone(), millimetres(&place, &neighbour))).collect();
        ways.sort_by_key(|(neighbour, _)| neighbour[1..].parse::<u32>().expect("a number"));
        graph.insert(place, ways);
    }
    let measured: Vec<[String; 2]> =
        list(&map["time"]).iter().map(|entry| [text(&entry["from"]), text(&entry["to"])]).collect();
    let is_way = |[from, to]: &&[String; 2]| graph[from].iter().any(|(neighbour, _)| neighbour == to);
    let measured_places = measured.iter().filter(is_way).flatten().cloned().collect();
    (graph, measured_places)
}

fn least_energy(mission: &Coadaptation) -> BTreeMap<usize, f64> {
    let process = Process::<f64>::new(mission, Risk::default(), &["energy"]);
    let explored = explore(&process, &Bounds::default()).expect("explored");
    let goal = process.goals(&explored.states);
    let problem = Problem::new(&explored.mdp, Direction::Min, Some(&explored.rewards[0]), &goal);
    let solution = solve(problem, None).expect("small enough");
    let situations = explored.states.iter().map(|state| state.situation());
    let initial_values = situations.zip(&solution.values).filter(|(s, _)| s.configuration == mission.initial);
    initial_values.map(|(situation, value)| (situation.place, *value)).collect()
}

/// For 337 of 3,080 pairs of places, joint optimisation uses less energy than the best configurations on the
/// fixed shortest route. The places of the pairs have measured ways; routes can use all ways of the
/// map, including dark ones.
#[test]
fn joint_optimisation_beats_fixed_shortest_routes() {
    let Some(path) = data("real/map/map-p2cp3.json") else { return };
    let map = std::fs::read_to_string(path).expect("readable");
    let (graph, measured_places) = read(&map);
    let (_directory, mission) = mission(&map, &MapOptions { dark: dark(), ..places("l1", "l18") });
    let mut process = coadaptation(&mission);
    let number = |process: &Coadaptation, place: &str| {
        process.places.iter().position(|name| name.eq_ignore_ascii_case(place)).expect("a place")
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
            let energies = arc.by.iter().flatten().map(|traversal| Number::to_f64(&traversal.energy));
            ((arc.from, arc.to), energies.fold(f64::INFINITY, f64::min))
        })
        .collect();
    let (mut pairs, mut improved) = (0, 0);
    for goal in &measured_places {
        process.goal = places[goal];
        let any_start = measured_places.iter().find(|place| *place != goal).expect("another place");
        process.start = places[any_start];
        let least_energies = least_energy(&process);
        for start in measured_places.iter().filter(|start| *start != goal) {
            let route = shortest(&graph, start, goal);
            let fixed_route_energy: f64 =
                route.windows(2).map(|pair| energy[&(places[&pair[0]], places[&pair[1]])]).sum();
            let joint_energy = least_energies[&places[start]];
            assert!(
                joint_energy <= fixed_route_energy + 1e-6,
                "{start} to {goal}: {joint_energy} and {fixed_route_energy}"
            );
            pairs += 1;
            improved += usize::from(joint_energy < fixed_route_energy - 1e-6);
        }
    }
    assert_eq!((improved, pairs), (337, 3_080));
}
