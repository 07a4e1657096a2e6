//! Random small missions in PDDL, with reference costs of an optimal plan by Dijkstra's algorithm and by
//! dynamic programming.

use std::collections::{BTreeMap, BinaryHeap};
use std::fmt::Write as _;

use super::random::Random;

/// Random mission of a robot that drives on a small map and chooses a design for each function.
#[derive(Debug)]
pub struct Mission {
    waypoints: usize,
    /// Corridors between waypoints: start, end, length, and the required safety of the first
    /// function's design.
    corridors: Vec<(usize, usize, i64, i64)>,
    /// Designs of each function: energy per unit of length, time per unit of length, safety, and
    /// availability.
    functions: Vec<Vec<(i64, i64, i64, bool)>>,
    battery: i64,
    charger: Option<usize>,
    goal: usize,
    /// Weights of time and of energy in the cost of a plan.
    pub weights: (i64, i64),
}

impl Mission {
    /// Returns the random mission of this seed.
    pub fn random(seed: u64) -> Self {
        let mut random = Random(seed);
        let waypoints = 3 + random.below(4) as usize;
        let mut corridors = Vec::new();
        for from in 0..waypoints {
            for to in 0..waypoints {
                if from != to && random.below(10) < 4 {
                    corridors.push((from, to, 1 + random.below(3), random.below(4)));
                }
            }
        }
        let functions = (0..=random.below(2))
            .map(|_| {
                (0..=random.below(3))
                    .map(|_| (1 + random.below(4), 1 + random.below(4), random.below(5), random.below(5) > 0))
                    .collect()
            })
            .collect();
        Self {
            waypoints,
            corridors,
            functions,
            battery: 5 + random.below(25),
            charger: (random.below(2) == 0).then(|| random.below(waypoints as u64) as usize),
            goal: waypoints - 1,
            weights: (random.below(3), random.below(3)),
        }
    }

    fn combinations(&self) -> Vec<Vec<(i64, i64, i64, bool)>> {
        let mut combinations = vec![Vec::new()];
        for designs in &self.functions {
            combinations = combinations
                .iter()
                .flat_map(|prefix: &Vec<_>| {
                    designs.iter().filter(|design| design.3).map(move |design| {
                        let mut longer = prefix.clone();
                        longer.push(*design);
                        longer
                    })
                })
                .collect();
        }
        combinations
    }

    /// Returns the minimum cost of a plan, by Dijkstra's algorithm over pairs of waypoint and
    /// battery level. `None` if there is no plan.
    pub fn oracle(&self) -> Option<i64> {
        let mut best = BTreeMap::from([((0_usize, self.battery), 0_i64)]);
        let mut open = BinaryHeap::from([(std::cmp::Reverse(0), 0, self.battery)]);
        while let Some((std::cmp::Reverse(cost), at, battery)) = open.pop() {
            if at == self.goal {
                return Some(cost);
            }
            for (cost, at, battery) in self.next(cost, at, battery) {
                if best.get(&(at, battery)).is_none_or(|best_cost| cost < *best_cost) {
                    best.insert((at, battery), cost);
                    open.push((std::cmp::Reverse(cost), at, battery));
                }
            }
        }
        None
    }

    /// Returns the successors of the state with waypoint `at` and level `battery`, which is reached at
    /// path cost `cost`: each as path cost, waypoint and battery level.
    fn next(&self, cost: i64, at: usize, battery: i64) -> Vec<(i64, usize, i64)> {
        let mut next = Vec::new();
        for (from, to, length, safety) in self.corridors.iter().filter(|corridor| corridor.0 == at) {
            assert_eq!(*from, at);
            for designs in self.combinations() {
                let energy = length * designs.iter().map(|design| design.0).sum::<i64>();
                let time = length * designs.iter().map(|design| design.1).sum::<i64>();
                // The design of the first function must be safe enough for the corridor.
                if designs[0].2 >= *safety && energy <= battery {
                    let cost = cost + self.weights.0 * time + self.weights.1 * energy;
                    next.push((cost, *to, battery - energy));
                }
            }
        }
        if self.charger == Some(at) {
            next.push((cost + 7 * self.weights.0, at, self.battery));
        }
        next
    }

    /// Returns the minimum cost of a plan with at most n steps, for each n from 0 to `max_steps`. The
    /// entry for n is `None` if there is no such plan.
    pub fn oracle_by_steps(&self, max_steps: usize) -> Vec<Option<i64>> {
        let mut costs = Vec::new();
        let mut reached = BTreeMap::from([((0_usize, self.battery), 0_i64)]);
        for _ in 0..=max_steps {
            let goals = reached.iter().filter(|((at, _), _)| *at == self.goal);
            costs.push(goals.map(|(_, cost)| *cost).min());
            // A copy, so that each round adds exactly one step.
            for ((at, battery), cost) in reached.clone() {
                for (cost, at, battery) in self.next(cost, at, battery) {
                    let best_cost = reached.entry((at, battery)).or_insert(cost);
                    *best_cost = cost.min(*best_cost);
                }
            }
        }
        costs
    }

    /// Returns the domain in PDDL.
    pub fn domain(&self) -> String {
        let k = self.functions.len();
        let each = |f: &dyn Fn(usize) -> String| (0..k).map(f).collect::<Vec<_>>().join(" ");
        let energy = format!("(* (length ?from ?to) (+ 0 {}))", each(&|i| format!("(energy ?fd{i})")));
        let time = format!("(* (length ?from ?to) (+ 0 {}))", each(&|i| format!("(slowness ?fd{i})")));
        format!(
            "(define (domain robot)
              (:types waypoint function design)
              (:predicates (at ?w - waypoint) (corridor ?a ?b - waypoint) (charger ?w - waypoint)
                (requires {}) (fd_solve_f ?fd - design ?f - function) (fd_available ?fd - design))
              (:functions (battery) (capacity) (time_used) (energy_used) (length ?a ?b - waypoint)
                (energy ?fd - design) (slowness ?fd - design) (safety ?fd - design) (danger ?a ?b - waypoint))
              (:action move
                :parameters ({} {} ?from ?to - waypoint)
                :precondition (and (at ?from) (corridor ?from ?to) (requires {}) {}
                  (>= (safety ?fd0) (danger ?from ?to)) (>= (battery) {energy}))
                :effect (and (not (at ?from)) (at ?to) (decrease (battery) {energy})
                  (increase (energy_used) {energy}) (increase (time_used) {time})))
              (:action recharge
                :parameters (?w - waypoint)
                :precondition (and (at ?w) (charger ?w))
                :effect (and (assign (battery) (capacity)) (increase (time_used) 7))))",
            each(&|i| format!("?f{i} - function")),
            each(&|i| format!("?f{i} - function")),
            each(&|i| format!("?fd{i} - design")),
            each(&|i| format!("?f{i}")),
            each(&|i| format!("(fd_solve_f ?fd{i} ?f{i}) (fd_available ?fd{i})")),
        )
    }

    /// Returns the problem in PDDL.
    pub fn problem(&self) -> String {
        let mut objects = String::new();
        let mut init = format!(
            "(at w0) (= (battery) {0}) (= (capacity) {0}) (= (time_used) 0) (= (energy_used) 0)",
            self.battery
        );
        for waypoint in 0..self.waypoints {
            let _ = write!(objects, " w{waypoint}");
        }
        objects.push_str(" - waypoint");
        let mut requires = String::from("(requires");
        for (function, designs) in self.functions.iter().enumerate() {
            let _ = write!(objects, " f{function} - function");
            let _ = write!(requires, " f{function}");
            for (design, (energy, slowness, safety, available)) in designs.iter().enumerate() {
                let name = format!("d{function}_{design}");
                let _ = write!(objects, " {name} - design");
                let _ = write!(init, " (fd_solve_f {name} f{function}) (= (energy {name}) {energy})");
                let _ = write!(init, " (= (slowness {name}) {slowness}) (= (safety {name}) {safety})");
                if *available {
                    let _ = write!(init, " (fd_available {name})");
                }
            }
        }
        for (from, to, length, danger) in &self.corridors {
            let _ = write!(init, " (corridor w{from} w{to}) (= (length w{from} w{to}) {length})");
            let _ = write!(init, " (= (danger w{from} w{to}) {danger})");
        }
        if let Some(charger) = self.charger {
            let _ = write!(init, " (charger w{charger})");
        }
        format!(
            "(define (problem p) (:domain robot) (:objects{objects}) (:init {init} {requires})) (:goal (at w{}))
              (:metric minimize (+ (* {} (time_used)) (* {} (energy_used)))))",
            self.goal, self.weights.0, self.weights.1
        )
    }
}
