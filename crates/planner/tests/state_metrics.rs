//! Metrics over fluents with state-dependent changes are minimised: comparison with brute force.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::fmt::Write as _;
use std::time::Duration;

use metaplan_planner::{
    Config, Engine, Exact, GroundConfig, Limits, Proof, Solution, Status, Thresholds, ground,
    ground_concurrent, optimize, optimize_concurrent,
};
use num_rational::BigRational;
use testing::random::Random;

use crate::concurrent::parse;
use crate::tally::with_enough_time;

/// A market: the price of a purchase is linear in the amount that was ordered and in the rate.
const DOMAIN: &str = "(define (domain market) (:requirements :typing :numeric-fluents) (:types place)
  (:predicates (at ?p - place) (road ?a ?b - place) (bought ?p - place))
  (:functions (amount) (rate) (spent) (far ?p - place) (price ?p - place) (share ?p - place) (need ?p - place)
    (cap) (lot) (discount) (fee))
  (:action order :parameters () :precondition (< (amount) (cap)) :effect (increase (amount) (lot)))
  (:action haggle :parameters () :precondition (>= (rate) (discount))
    :effect (and (decrease (rate) (discount)) (increase (spent) (fee))))
  (:action drive :parameters (?a ?b - place) :precondition (and (at ?a) (road ?a ?b))
    :effect (and (not (at ?a)) (at ?b) (increase (spent) (far ?b))))
  (:action buy :parameters (?p - place) :precondition (and (at ?p) (>= (amount) (need ?p)))
    :effect (and (bought ?p) (decrease (amount) (need ?p))
      (increase (spent) (+ (* (price ?p) (amount)) (* (share ?p) (rate)))))))";

/// Place, amount, rate and purchases.
type Explicit = (usize, i64, i64, Vec<bool>);

struct Market {
    roads: Vec<(usize, usize)>,
    /// Cost of driving to the place, price, share, and amount that a purchase needs.
    places: Vec<[i64; 4]>,
    goals: Vec<usize>,
    rate: i64,
    cap: i64,
    lot: i64,
    discount: i64,
    fee: i64,
}

impl Market {
    fn sample(random: &mut Random) -> Self {
        let count = 2 + random.below(2) as usize;
        let mut number = |limit| random.below(limit);
        let places = (0..count).map(|_| [number(4), number(5), number(3), number(4)]).collect();
        let (rate, cap, lot, discount, fee) = (number(6), number(8), 1 + number(3), 1 + number(2), number(3));
        let mut roads: Vec<(usize, usize)> = Vec::new();
        for a in 0..count {
            roads.extend((0..count).filter(|b| *b != a && random.below(3) > 0).map(|b| (a, b)));
        }
        let goals = (0..count).filter(|_| random.below(2) > 0).collect();
        Self { roads, places, goals, rate, cap, lot, discount, fee }
    }

    fn problem(&self) -> String {
        let mut init = format!(
            "(at p0) (= (amount) 0) (= (spent) 0) (= (rate) {}) (= (cap) {}) (= (lot) {}) (= (discount) {}) (= (fee) {})",
            self.rate, self.cap, self.lot, self.discount, self.fee
        );
        for (a, b) in &self.roads {
            let _ = write!(init, " (road p{a} p{b})");
        }
        let mut objects = String::new();
        for (place, numbers) in self.places.iter().enumerate() {
            let _ = write!(objects, " p{place}");
            for (name, number) in ["far", "price", "share", "need"].iter().zip(numbers) {
                let _ = write!(init, " (= ({name} p{place}) {number})");
            }
        }
        let goals: String =
            self.goals.iter().map(|place| ["(bought p", &place.to_string(), ")"].concat()).collect();
        format!(
            "(define (problem p) (:domain market) (:objects{objects} - place) (:init {init})
              (:goal (and (at p0) {goals})) (:metric minimize (spent)))"
        )
    }

    fn start(&self) -> Explicit {
        (0, 0, self.rate, vec![false; self.places.len()])
    }

    fn is_goal(&self, (at, _, _, bought): &Explicit) -> bool {
        *at == 0 && self.goals.iter().all(|goal| bought[*goal])
    }

    fn successors(&self, (at, amount, rate, bought): &Explicit) -> Vec<(i64, Explicit)> {
        let (at, amount, rate) = (*at, *amount, *rate);
        let mut next = Vec::new();
        if amount < self.cap {
            next.push((0, (at, amount + self.lot, rate, bought.clone())));
        }
        if rate >= self.discount {
            next.push((self.fee, (at, amount, rate - self.discount, bought.clone())));
        }
        for (_, to) in self.roads.iter().filter(|(from, _)| *from == at) {
            next.push((self.places[*to][0], (*to, amount, rate, bought.clone())));
        }
        let [_, price, share, need] = self.places[at];
        if amount >= need {
            let mut bought = bought.clone();
            bought[at] = true;
            next.push((price * amount + share * rate, (at, amount - need, rate, bought)));
        }
        next
    }

    fn cheapest_within(&self, horizon: usize) -> Option<i64> {
        let mut layer = BTreeMap::from([(self.start(), 0)]);
        let mut best = None;
        for step in 0..=horizon {
            let goals = layer.iter().filter(|(state, _)| self.is_goal(state)).map(|(_, cost)| *cost);
            best = best.into_iter().chain(goals).min();
            if step < horizon {
                let mut next: BTreeMap<Explicit, i64> = BTreeMap::new();
                for (state, cost) in &layer {
                    for (more, state) in self.successors(state) {
                        let least = next.entry(state).or_insert(i64::MAX);
                        *least = (*least).min(cost + more);
                    }
                }
                layer = next;
            }
        }
        best
    }

    fn cheapest(&self) -> Option<i64> {
        let start = self.start();
        let mut costs: BTreeMap<Explicit, i64> = BTreeMap::new();
        let mut open = BinaryHeap::from([Reverse((0, start))]);
        while let Some(Reverse((cost, state))) = open.pop() {
            if costs.contains_key(&state) {
                continue;
            }
            if self.is_goal(&state) {
                return Some(cost);
            }
            let next = self.successors(&state).into_iter();
            open.extend(next.map(|(more, state)| Reverse((cost + more, state))));
            costs.insert(state, cost);
        }
        None
    }
}

fn solve(domain: &str, problem: &str, limits: Limits) -> Solution {
    let (domain, problem) = parse(domain, problem);
    let task =
        ground(&domain, &problem, &GroundConfig::default()).unwrap_or_else(|errors| panic!("{errors:?}"));
    optimize(&task, &Config::default().with_limits(limits), &mut |_| {})
}

#[test]
fn state_dependent_costs_are_as_low_as_by_brute_force() {
    let seeds = std::env::var("METAPLAN_SEEDS").map_or(300, |text| text.parse().expect("a number"));
    let mut solved = 0;
    for seed in 0..seeds {
        let market = Market::sample(&mut Random(seed));
        let (problem, expected) = (market.problem(), market.cheapest());
        for thresholds in [Thresholds::default(), Thresholds::NONE] {
            let solution = solve(DOMAIN, &problem, Limits::none().with_thresholds(thresholds));
            let cost = solution.plan.as_ref().map(|plan| plan.cost.to_string());
            assert_eq!(cost, expected.map(|cost| cost.to_string()), "seed {seed}\n{problem}");
            let status = if expected.is_some() { Status::Optimal } else { Status::Unsolvable };
            assert_eq!(solution.status, status, "seed {seed}\n{problem}");
        }
        solved += usize::from(expected.is_some());
    }
    assert!(solved * 3 > seeds as usize, "{solved} of {seeds} are solvable");
}

#[test]
fn state_dependent_costs_within_a_horizon_are_as_low_as_by_brute_force() {
    let (mut proved, mut longer_is_cheaper) = (0, 0);
    for seed in 0..60 {
        let market = Market::sample(&mut Random(seed));
        let (domain, problem) = parse(DOMAIN, &market.problem());
        let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
        for horizon in [0, 2, 4, 7] {
            let expected = market.cheapest_within(horizon);
            let config = Config::default().with_horizon(horizon);
            let solution = optimize(&task, &config, &mut |_| {});
            let context = || format!("seed {seed}, {horizon} steps: {solution:?}\n{}", market.problem());
            let cost = solution.plan.as_ref().map(|plan| plan.cost.to_string());
            let Some(expected) = expected else {
                assert!(cost.is_none(), "{}", context());
                let is_solvable = market.cheapest().is_some();
                assert!(solution.status != Status::Unsolvable || !is_solvable, "{}", context());
                continue;
            };
            assert_eq!(cost, Some(expected.to_string()), "{}", context());
            // A longer plan may be cheaper than the best one within the horizon.
            let cheapest = market.cheapest().expect("there is a plan");
            let is_proved = solution.status == Status::Optimal;
            assert!(!is_proved || cheapest == expected, "{}", context());
            let bound = solution.lower_bound.as_ref().map(Exact::to_rational);
            let cost = BigRational::from_integer(cheapest.into());
            assert!(bound.is_none_or(|bound| bound <= cost), "{}", context());
            assert!(solution.plan.as_ref().is_some_and(|plan| plan.steps.len() <= horizon));
            proved += usize::from(is_proved);
            longer_is_cheaper += usize::from(cheapest < expected);
        }
    }
    assert!(
        proved > 30 && longer_is_cheaper > 5,
        "{proved} proved, {longer_is_cheaper} with cheaper longer plans"
    );
}

/// Tested in two ways: with the SAT solver alone, and with overlapping actions. If costs depend on the state, no plan
/// is called optimal; otherwise only plans with the least cost are.
#[test]
fn state_dependent_costs_that_are_not_minimised_are_not_called_optimal() {
    with_enough_time(Duration::from_millis(300), |time| {
        let planned = check_not_minimised(time);
        if planned > 20 { Ok(()) } else { Err(format!("{planned} plans")) }
    });
}

fn check_not_minimised(time: Duration) -> usize {
    let mut planned = 0;
    for seed in 0..30 {
        let market = Market::sample(&mut Random(seed));
        let (domain, problem) = parse(DOMAIN, &market.problem());
        let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
        let is_dependent = !task.objective.rest.is_empty();
        let limits = Limits::none().with_time(time);
        let config = Config::default().with_limits(limits.clone()).with_engine(Engine::Sat);
        let by_formulas = optimize(&task, &config, &mut |_| {});
        let separation = BigRational::new(1.into(), 1000.into());
        let overlapping = ground_concurrent(&domain, &problem, &GroundConfig::default(), &separation);
        let overlapping = overlapping.expect("a task");
        assert_eq!(
            overlapping.not_minimised().is_empty(),
            !is_dependent,
            "seed {seed}: {}",
            market.problem()
        );
        let limits = Limits::none().with_time(time);
        let overlapping = optimize_concurrent(&overlapping, &limits, &mut |_| {});
        let best = market.cheapest().map(|best| BigRational::from_integer(best.into()));
        for solution in [by_formulas, overlapping] {
            let Some(plan) = &solution.plan else { continue };
            planned += 1;
            let is_best = Some(plan.cost.to_rational()) == best;
            assert!(solution.status != Status::Optimal || is_best, "seed {seed}: {solution:?}");
            let bound = solution.lower_bound.as_ref().map(Exact::to_rational);
            assert!(bound.is_none() || bound <= best, "seed {seed}: {solution:?}");
            assert!(solution.status != Status::Optimal || !is_dependent, "seed {seed}: {solution:?}");
        }
    }
    planned
}

/// The purchaser problem of IPC 2006: a purchase costs a price times the amount that is on sale or
/// needed.
#[test]
fn conditions_on_sums_bound_the_costs_of_purchases() {
    let domain = "(define (domain tpp) (:requirements :typing :numeric-fluents) (:types place goods)
      (:predicates (at ?p - place))
      (:functions (sale ?g - goods ?p - place) (way ?a ?b - place) (price ?g - goods ?p - place) (bought ?g - goods)
        (request ?g - goods) (total-cost))
      (:action drive :parameters (?a ?b - place) :precondition (at ?a)
        :effect (and (not (at ?a)) (at ?b) (increase (total-cost) (way ?a ?b))))
      (:action some :parameters (?g - goods ?p - place)
        :precondition (and (at ?p) (> (sale ?g ?p) 0) (> (sale ?g ?p) (- (request ?g) (bought ?g))))
        :effect (and (decrease (sale ?g ?p) (- (request ?g) (bought ?g)))
          (increase (total-cost) (* (- (request ?g) (bought ?g)) (price ?g ?p))) (assign (bought ?g) (request ?g))))
      (:action all :parameters (?g - goods ?p - place)
        :precondition (and (at ?p) (> (sale ?g ?p) 0) (<= (sale ?g ?p) (- (request ?g) (bought ?g))))
        :effect (and (assign (sale ?g ?p) 0) (increase (total-cost) (* (sale ?g ?p) (price ?g ?p)))
          (increase (bought ?g) (sale ?g ?p)))))";
    // With a price of 5: two at m and one at n, ways of 4: 4 + 6 + 4 + 5 + 4. At n alone: 4 + 15 + 4.
    let problem = |price: u32| {
        format!(
            "(define (problem p) (:domain tpp) (:objects h m n - place g - goods)
              (:init (at h) (= (sale g h) 0) (= (sale g m) 2) (= (sale g n) 9) (= (price g h) 0) (= (price g m) 3)
                (= (price g n) {price}) (= (way h m) 4) (= (way m h) 4) (= (way h n) 4) (= (way n h) 4) (= (way m n) 4)
                (= (way n m) 4) (= (way h h) 0) (= (way m m) 0) (= (way n n) 0) (= (bought g) 0) (= (request g) 3)
                (= (total-cost) 0))
              (:goal (and (at h) (>= (bought g) (request g)))) (:metric minimize (total-cost)))"
        )
    };
    for (price, expected) in [(5, "23"), (6, "24"), (3, "17")] {
        let solution = solve(domain, &problem(price), Limits::none());
        let cost = solution.plan.map(|plan| plan.cost.to_string());
        // With a price of 6: 4 + 6 + 4 + 6 + 4.
        assert_eq!((solution.status, cost.as_deref()), (Status::Optimal, Some(expected)), "{price}");
    }
}

/// The purchase costs 5,000 at once, and 7 after a drive.
#[test]
fn a_price_that_depends_on_the_state_is_minimised() {
    let domain = "(define (domain market) (:requirements :strips :typing :numeric-fluents) (:types place)
      (:predicates (at ?p - place) (bought)) (:functions (far ?p - place) (price ?p - place) (amount) (total-cost))
      (:action order :parameters () :precondition (< (amount) 5) :effect (increase (amount) 5))
      (:action drive :parameters (?a ?b - place) :precondition (at ?a)
        :effect (and (not (at ?a)) (at ?b) (increase (total-cost) (far ?b))))
      (:action buy :parameters (?p - place) :precondition (and (at ?p) (>= (amount) 5))
        :effect (and (bought) (increase (total-cost) (* (amount) (price ?p))))))";
    let problem = "(define (problem two) (:domain market) (:objects home near distant - place)
      (:init (at home) (= (amount) 0) (= (total-cost) 0) (= (far home) 1) (= (far near) 1) (= (far distant) 2)
        (= (price home) 1000) (= (price near) 100) (= (price distant) 1))
      (:goal (bought)) (:metric minimize (total-cost)))";
    let solution = solve(domain, problem, Limits::none());
    let cost = solution.plan.map(|plan| plan.cost.to_string());
    assert_eq!((solution.status, cost.as_deref()), (Status::Optimal, Some("7")));
    assert_eq!(solution.proof, Some(Proof::Search));
    assert_eq!(solution.lower_bound.map(|bound| bound.to_string()).as_deref(), Some("7"));
}

/// The amount grows without bound and at no cost, but less of it is never worse.
#[test]
fn useless_growth_of_a_number_ends_the_search() {
    let domain = "(define (domain market) (:requirements :strips :numeric-fluents)
      (:predicates (ready) (bought)) (:functions (amount) (price) (total-cost))
      (:action order :parameters () :effect (and (ready) (increase (amount) 5)))
      (:action buy :parameters () :precondition (ready)
        :effect (and (bought) (increase (total-cost) (* (amount) (price))))))";
    let problem =
        "(define (problem p) (:domain market) (:init (= (amount) 0) (= (price) 1000) (= (total-cost) 0))
      (:goal (bought)) (:metric minimize (total-cost)))";
    let solution = solve(domain, problem, Limits::none());
    let cost = solution.plan.map(|plan| plan.cost.to_string());
    assert_eq!((solution.status, cost.as_deref()), (Status::Optimal, Some("5000")));
}

/// The balance may become negative, and a purchase would then reduce the cost.
#[test]
fn a_metric_that_an_action_may_improve_is_not_called_optimal() {
    let domain = "(define (domain market) (:requirements :strips :numeric-fluents)
      (:predicates (bought)) (:functions (balance) (total-cost))
      (:action lend :parameters () :precondition (> (balance) -3) :effect (decrease (balance) 2))
      (:action buy :parameters () :effect (and (bought) (increase (total-cost) (balance)))))";
    let problem = "(define (problem p) (:domain market) (:init (= (balance) 1) (= (total-cost) 0))
      (:goal (bought)) (:metric minimize (total-cost)))";
    let solution = solve(domain, problem, Limits::none());
    assert_eq!((solution.status, solution.proof, solution.lower_bound), (Status::Feasible, None, None));
}
