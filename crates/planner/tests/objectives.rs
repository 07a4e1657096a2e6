//! Multiple objectives and tie-breaking, compared with an enumeration of the plans of small missions that visit no
//! waypoint twice.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use metaplan_planner::{Config, GroundConfig, Plan, Status, Task, ground, lexicographic, optimize, pareto};
use pddl::ast::{Direction, Metric};
use pddl::{Source, read, read_objective};
use testing::random::Random;

/// A mission with two functions. Every move costs time and energy that depend on the designs.
#[derive(Debug)]
struct Mission {
    waypoints: usize,
    /// Corridors as (from, to, length), in the order of the problem file.
    corridors: Vec<(usize, usize, i64)>,
    /// For each function: time and energy per unit of length of each design.
    designs: [Vec<(i64, i64)>; 2],
}

#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Way {
    stations: Vec<usize>,
    designs: Vec<[usize; 2]>,
    time: i64,
    energy: i64,
}

impl Mission {
    fn random(seed: u64) -> Self {
        let mut random = Random(seed);
        let waypoints = 3 + random.below(2) as usize;
        let mut corridors = Vec::new();
        for from in 0..waypoints {
            for to in 0..waypoints {
                if from != to && random.below(10) < 6 {
                    corridors.push((from, to, 1 + random.below(2)));
                }
            }
        }
        let mut designs =
            || (0..=random.below(3)).map(|_| (1 + random.below(2), 1 + random.below(3))).collect();
        Self { waypoints, corridors, designs: [designs(), designs()] }
    }

    /// Enumerates the ways that visit no waypoint twice.
    fn ways(&self) -> Vec<Way> {
        let start = Way { stations: vec![0], designs: Vec::new(), time: 0, energy: 0 };
        let (mut open, mut found) = (vec![start], Vec::new());
        while let Some(way) = open.pop() {
            let here = way.stations[way.stations.len() - 1];
            if here == self.waypoints - 1 {
                found.push(way);
                continue;
            }
            for (_, to, length) in
                self.corridors.iter().filter(|c| c.0 == here && !way.stations.contains(&c.1))
            {
                for (i, first) in self.designs[0].iter().enumerate() {
                    for (j, second) in self.designs[1].iter().enumerate() {
                        let mut next = way.clone();
                        next.stations.push(*to);
                        next.designs.push([i, j]);
                        next.time += length * (first.0 + second.0);
                        next.energy += length * (first.1 + second.1);
                        open.push(next);
                    }
                }
            }
        }
        found
    }

    /// Returns domain and problem as PDDL text. If `reversed`, the names of waypoints and designs sort
    /// in reverse order.
    fn text(&self, reversed: bool) -> (String, String) {
        let domain = "(define (domain d) (:types place function design)
          (:predicates (at ?p - place) (way ?a ?b - place) (fd_solve_f ?d - design ?f - function))
          (:functions (length ?a ?b - place) (pace ?d - design) (draw ?d - design) (time) (energy))
          (:action move :parameters (?a ?b - place ?f ?g - function ?c ?d - design)
            :precondition (and (at ?a) (way ?a ?b) (= ?f f0) (= ?g f1) (fd_solve_f ?c ?f) (fd_solve_f ?d ?g))
            :effect (and (not (at ?a)) (at ?b)
              (increase (time) (* (length ?a ?b) (+ (pace ?c) (pace ?d))))
              (increase (energy) (* (length ?a ?b) (+ (draw ?c) (draw ?d)))))))";
        let domain = domain.replace("(:predicates", "(:constants f0 f1 - function)\n(:predicates");
        let place = |p: usize| Self::name('p', p, reversed);
        let mut objects: Vec<String> = (0..self.waypoints).map(|p| format!("{} - place", place(p))).collect();
        let mut init = format!("(at {}) (= (time) 0) (= (energy) 0)", place(0));
        for (from, to, length) in &self.corridors {
            let (from, to) = (place(*from), place(*to));
            let _ = write!(init, " (way {from} {to}) (= (length {from} {to}) {length})");
        }
        for (function, designs) in self.designs.iter().enumerate() {
            for (design, (pace, draw)) in designs.iter().enumerate() {
                let name = Self::name(['c', 'd'][function], design, reversed);
                objects.push(format!("{name} - design"));
                let _ = write!(
                    init,
                    " (fd_solve_f {name} f{function}) (= (pace {name}) {pace}) (= (draw {name}) {draw})"
                );
            }
        }
        let goal = place(self.waypoints - 1);
        let objects = objects.join(" ");
        let problem = format!(
            "(define (problem p) (:domain d) (:objects {objects}) (:init {init}) (:goal (at {goal})))"
        );
        (domain, problem)
    }

    fn name(kind: char, number: usize, reversed: bool) -> String {
        format!("{kind}{}", if reversed { 9 - number } else { number })
    }

    fn task(&self, objectives: &[&str], reversed: bool) -> Task {
        let (domain, problem) = self.text(reversed);
        task(&domain, &problem, objectives)
    }

    fn way(plan: &Plan, reversed: bool) -> (Vec<usize>, Vec<[usize; 2]>) {
        let number = |name: &str| {
            let digit: usize = name[1..].parse().expect("a digit");
            if reversed { 9 - digit } else { digit }
        };
        let mut stations = vec![0];
        let mut designs = Vec::new();
        for step in &plan.steps {
            stations.push(number(&step.arguments[1]));
            designs.push([number(&step.arguments[4]), number(&step.arguments[5])]);
        }
        (stations, designs)
    }
}

fn task(domain: &str, problem: &str, objectives: &[&str]) -> Task {
    let (domain, problem, _) =
        read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("PDDL");
    let objective = |text: &&str| -> Metric {
        let source = Source::new("objective", *text);
        read_objective(Direction::Minimize, &source, &domain, &problem).expect("an objective")
    };
    let objectives = objectives.iter().map(objective).collect();
    ground(&domain, &problem, &GroundConfig::default().with_objectives(objectives)).expect("a task")
}

fn changes(designs: &[[usize; 2]]) -> usize {
    designs.windows(2).map(|pair| (0..2).filter(|f| pair[0][*f] != pair[1][*f]).count()).sum()
}

#[test]
fn pareto_fronts_are_exact() {
    for seed in 0..150 {
        let mission = Mission::random(seed);
        let ways = mission.ways();
        let values: BTreeSet<(i64, i64)> = ways.iter().map(|way| (way.time, way.energy)).collect();
        let dominated = |v: &(i64, i64)| values.iter().any(|o| o != v && o.0 <= v.0 && o.1 <= v.1);
        let expected: Vec<_> =
            values.iter().filter(|v| !dominated(v)).map(|v| vec![v.0.to_string(), v.1.to_string()]).collect();
        let front = pareto(&mission.task(&["(time)", "(energy)"], false), &Config::default(), &mut |_| {});
        let found: Vec<Vec<String>> = front
            .points
            .iter()
            .filter(|point| point.solution.plan.is_some())
            .map(|point| point.values.iter().map(ToString::to_string).collect())
            .collect();
        assert_eq!(found, expected, "seed {seed}: {mission:?}");
        let status = if ways.is_empty() { Status::Unsolvable } else { Status::Optimal };
        assert_eq!(front.status, status, "seed {seed}");
    }
}

#[test]
fn lists_of_objectives_are_in_order() {
    for seed in 0..150 {
        let mission = Mission::random(seed);
        let objectives = ["(energy)", "(+ (time) (* 0.5 (energy)))", "(time)"];
        let point = lexicographic(&mission.task(&objectives, false), &Config::default(), &mut |_| {});
        let best = mission.ways().into_iter().min_by_key(|way| (way.energy, way.time));
        let found: Option<(f64, f64)> =
            point.solution.plan.is_some().then(|| (point.values[0].to_f64(), point.values[2].to_f64()));
        let expected = best.map(|way| (way.energy as f64, way.time as f64));
        assert_eq!(found, expected, "seed {seed}: {mission:?}");
    }
}

#[test]
fn the_displayed_plan_has_the_values_of_all_objectives() {
    // An earlier start keeps the first value, but not the second.
    let domain = "(define (domain d) (:requirements :timed-initial-literals :fluents :conditional-effects)
      (:predicates (night) (done)) (:functions (effort) (bill))
      (:action use :parameters () :precondition (and)
        :effect (and (done) (increase (effort) 1) (when (night) (increase (bill) 1))
          (when (not (night)) (increase (bill) 10)))))";
    let problem =
        "(define (problem p) (:domain d) (:init (at 10 (night)) (= (effort) 0) (= (bill) 0)) (:goal (done)))";
    let point =
        lexicographic(&task(domain, problem, &["(effort)", "(bill)"]), &Config::default(), &mut |_| {});
    let values: Vec<String> = point.values.iter().map(ToString::to_string).collect();
    assert_eq!((point.solution.status, values), (Status::Optimal, vec!["1".to_owned(), "1".to_owned()]));
    let starts: Vec<String> =
        point.solution.plan.iter().flat_map(|plan| &plan.steps).map(|step| step.start.to_string()).collect();
    assert_eq!(starts, ["10.001"]);
}

#[test]
fn ties_are_broken_in_order_and_names_play_no_part() {
    let mut ties = 0;
    for seed in 0..300 {
        let mission = Mission::random(seed);
        let ways = mission.ways();
        let key = |way: &Way| (way.time, way.stations.len(), changes(&way.designs));
        // Steps are compared one by one: first their operators, i.e. their waypoints, and then their designs.
        let order = |way: &Way| {
            let steps = way.stations.windows(2).zip(&way.designs);
            steps.map(|(stations, designs)| (stations.to_vec(), *designs)).collect::<Vec<_>>()
        };
        let expected = ways.iter().min_by_key(|way| (key(way), order(way)));
        ties +=
            usize::from(expected.is_some_and(|best| ways.iter().filter(|w| w.time == best.time).count() > 1));
        for reversed in [false, true] {
            let solution = optimize(&mission.task(&["(time)"], reversed), &Config::default(), &mut |_| {});
            let found = solution.plan.as_ref().map(|plan| Mission::way(plan, reversed));
            let expected = expected.map(|way| (way.stations.clone(), way.designs.clone()));
            assert_eq!(found, expected, "seed {seed}, reversed names {reversed}: {mission:?}");
        }
    }
    assert!(ties > 50, "only {ties} missions have ties");
}
