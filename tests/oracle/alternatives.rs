//! Test of [`planner::alternatives`]: compares the reported set of cheapest plans with an enumeration of all
//! cheapest plans up to a length, without idle actions.
//!
//! An action is active if it can change a fact that the goal or an active action reads. All other actions are idle.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use fastrand::Rng;
use metaplan::mission::Planning as _;
use planner::{Config, Engine, Limits, Status, Thresholds};

use crate::judge::{read, setting};

const FACTS: usize = 5;
const LENGTH: usize = 5;

type State = u32;

/// Pair of bit sets of facts: required and forbidden facts of a condition, or added and deleted facts of an
/// effect.
type Literals = (State, State);

#[derive(Debug)]
struct Action {
    condition: Literals,
    effect: Literals,
    cost: u32,
}

impl Action {
    fn is_applicable(&self, state: State) -> bool {
        holds(self.condition, state)
    }

    fn apply(&self, state: State) -> State {
        // A fact that is both deleted and added holds afterwards (PDDL 2.1).
        state & !self.effect.1 | self.effect.0
    }
}

#[derive(Debug)]
struct Task {
    actions: Vec<Action>,
    initial: State,
    goal: Literals,
}

fn holds((positive, negative): Literals, state: State) -> bool {
    state & positive == positive && state & negative == 0
}

fn literals(rng: &mut Rng, count: usize, negative_in: u32) -> Literals {
    let mut chosen = (0, 0);
    for _ in 0..count {
        let fact = 1 << rng.usize(0..FACTS);
        // A fact that was already drawn is skipped, so that a condition cannot contradict itself.
        if (chosen.0 | chosen.1) & fact == 0 {
            *(if rng.u32(0..negative_in) == 0 { &mut chosen.1 } else { &mut chosen.0 }) |= fact;
        }
    }
    chosen
}

fn text(literals: Literals) -> String {
    (0..FACTS).fold(String::new(), |mut text, fact| {
        if literals.0 >> fact & 1 == 1 {
            let _ = write!(text, " (p{fact})");
        }
        if literals.1 >> fact & 1 == 1 {
            let _ = write!(text, " (not (p{fact}))");
        }
        text
    })
}

impl Task {
    fn new(seed: u64) -> Self {
        let mut rng = Rng::with_seed(seed);
        let rng = &mut rng;
        let actions = (0..rng.usize(3..7)).map(|_| {
            let count = rng.usize(0..3);
            let condition = literals(rng, count, 3);
            let count = rng.usize(1..3);
            Action { condition, effect: literals(rng, count, 3), cost: rng.u32(0..3) }
        });
        Self {
            actions: actions.collect(),
            initial: rng.u32(0..1 << FACTS) & rng.u32(0..1 << FACTS),
            goal: literals(rng, 2, 4),
        }
    }

    fn files(&self) -> (String, String) {
        let mut domain = "(define (domain d) (:predicates".to_owned();
        for fact in 0..FACTS {
            let _ = write!(domain, " (p{fact})");
        }
        domain += ") (:functions (total-cost))";
        for (number, Action { condition, effect, cost }) in self.actions.iter().enumerate() {
            let (condition, effect) = (text(*condition), text(*effect));
            let _ = write!(
                domain,
                "\n(:action a{number} :parameters () :precondition (and{condition})
                   :effect (and{effect} (increase (total-cost) {cost})))"
            );
        }
        let (init, goal) = (text((self.initial, 0)), text(self.goal));
        let problem = format!(
            "(define (problem p) (:domain d) (:init{init} (= (total-cost) 0)) (:goal (and{goal}))
               (:metric minimize (total-cost)))"
        );
        (domain + ")", problem)
    }

    fn active(&self) -> BTreeSet<usize> {
        // All reachable states, by exhaustive search.
        let (mut states, mut open) = (BTreeSet::from([self.initial]), vec![self.initial]);
        while let Some(state) = open.pop() {
            let applicable = self.actions.iter().filter(|action| action.is_applicable(state));
            open.extend(applicable.map(|action| action.apply(state)).filter(|next| states.insert(*next)));
        }
        let (mut active, mut read) = (BTreeSet::new(), self.goal.0 | self.goal.1);
        // Least fixpoint: the conditions of an active action are read, which may activate further actions.
        loop {
            let previous_count = active.len();
            for (number, action) in self.actions.iter().enumerate() {
                let changes = |state: &State| {
                    action.is_applicable(*state) && (*state ^ action.apply(*state)) & read != 0
                };
                if states.iter().any(changes) && active.insert(number) {
                    read |= action.condition.0 | action.condition.1;
                }
            }
            if active.len() == previous_count {
                return active;
            }
        }
    }

    /// Returns the cost of a plan; `None` if it is not applicable or does not reach the goal.
    fn cost(&self, plan: &[usize]) -> Option<u32> {
        let (mut state, mut cost) = (self.initial, 0);
        for number in plan {
            let action = &self.actions[*number];
            if !action.is_applicable(state) {
                return None;
            }
            (state, cost) = (action.apply(state), cost + action.cost);
        }
        holds(self.goal, state).then_some(cost)
    }

    /// Returns the plans with at most [`LENGTH`] steps that cost exactly `cost`.
    fn plans(&self, actions: &BTreeSet<usize>, cost: u32) -> Vec<Vec<usize>> {
        let (mut plans, mut open) = (Vec::new(), vec![(self.initial, 0, Vec::new())]);
        while let Some((state, paid, steps)) = open.pop() {
            if holds(self.goal, state) && paid == cost {
                plans.push(steps.clone());
            }
            if steps.len() == LENGTH {
                continue;
            }
            for number in actions {
                let action = &self.actions[*number];
                if action.is_applicable(state) && paid + action.cost <= cost {
                    open.push((action.apply(state), paid + action.cost, [&steps[..], &[*number]].concat()));
                }
            }
        }
        plans
    }
}

/// Executes the reported alternatives and compares them with the enumeration. Returns `true` if the report claims to
/// be complete, and `None` without an optimal plan or a report.
fn check(seed: u64) -> Option<bool> {
    let task = Task::new(seed);
    let (domain, problem) = task.files();
    let about = || format!("seed {seed}\n{domain}\n{problem}");
    let (mission, filled) = read(&domain, &problem).unwrap_or_else(|messages| panic!("{messages:#?}"));
    // With all thresholds at zero, small tasks also reach the prunings that are meant for large tasks.
    let limits = Limits::none();
    let limits = if seed.is_multiple_of(2) { limits.with_thresholds(Thresholds::NONE) } else { limits };
    let ground = mission.ground(&filled, &[], &limits).expect("a ground task");
    let config = Config::default().with_limits(limits);
    // Every third task is solved by the SAT engine alone.
    let config = if seed.is_multiple_of(3) { config.with_engine(Engine::Sat) } else { config };
    let solution = planner::optimize(&ground, &config, &mut |_| {});
    if solution.status != Status::Optimal {
        return None;
    }
    let numbers = |plan: &planner::Plan| -> Vec<usize> {
        plan.steps.iter().map(|step| step.action[1..].parse().expect("a number")).collect()
    };
    // If there are more than 30 alternatives, the report must not claim to be complete.
    let report = planner::alternatives(&ground, &solution, 30, &config)?;
    let plan = solution.plan.as_ref().expect("an optimal plan");
    let (first, cost) = (numbers(plan), plan.cost.to_string().parse().expect("a small number"));
    let reported: BTreeSet<Vec<usize>> = report.plans.iter().map(numbers).chain([first.clone()]).collect();
    let cheapest = task.plans(&task.active(), cost);
    for plan_steps in &reported {
        assert_eq!(task.cost(plan_steps), Some(cost), "{plan_steps:?}\n{}", about());
    }
    // A complete report must contain every enumerated plan, and every enumerated plan must agree with each
    // step that is reported as forced.
    for plan_steps in &cheapest {
        assert!(
            !report.complete || reported.contains(plan_steps),
            "{plan_steps:?} is not in {reported:?}\n{}",
            about()
        );
        for (step, forced) in report.forced.iter().flatten().enumerate() {
            assert!(
                !forced.action || plan_steps.get(step) == first.get(step),
                "step {step} of {plan_steps:?}\n{}",
                about()
            );
        }
    }
    Some(report.complete)
}

#[test]
fn reported_plans_are_cheapest_and_complete_reports_have_all() {
    let (from, tasks) = (setting("ORACLE_FROM", 0), setting("ORACLE_TASKS", 500));
    let complete = (from..from + tasks).filter(|seed| check(*seed) == Some(true)).count();
    assert!(complete as u64 * 5 > tasks, "all cheapest plans of {complete} tasks are known");
}
