//! The validator as a judge: plans of up to three steps over all start times that make a difference, on tiny tasks.
//!
//! Every plan is given to the project's validator and to the oracle's executor; they have to agree on whether it is valid, on whether only the
//! goal is missed, and on its value. Then the best plan that the *validator* accepts is held against the planner's claim.
//!
//! One after another, what is possible at a start s depends on where s and the ends lie among the events; so all that matters
//! are the times T - (sums of up to three durations) for events at T, the points between them, and the end of the action before. A plan
//! whose beginning cannot be executed is not extended. Overlapping, starts are multiples of half the separation. `ORACLE_PLANS` bounds the
//! plans of a task; where that cuts off, the order is random.

use std::time::Duration;

use metaplan::mission::Mission;
use num_rational::BigRational;
use pddl::ast::Problem;
use pddl::validate::ViolationKind;

use crate::judge::{Case, Mode, Tally, Truth, judge, plan_lines, project_verdict, read, setting};
use crate::temporal::best::{Schedule, written};
use crate::temporal::happening::{Obstacle, World};
use crate::temporal::model::{Body, Q, big, q};
use crate::temporal::{concurrent_unit, execute, maximizes, overlap, sequential_task};

/// What an execution comes to.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Outcome {
    Valid(Option<BigRational>),
    /// Executable, but the goal does not hold in the end.
    Goal,
    Invalid,
}

struct Enumeration<'e> {
    world: &'e World,
    unit: Option<Q>,
    mission: &'e Mission,
    problem: &'e Problem,
    mode: Mode,
    random: fastrand::Rng,
    times: Vec<Q>,
    left: usize,
    /// Plans on which the two disagree.
    disagreements: Vec<String>,
    best: Option<(BigRational, Schedule)>,
    valid: usize,
}

/// All that makes a difference for starts one after another.
fn times(world: &World, durations: &[Q]) -> Vec<Q> {
    let mut borders = vec![q(0)];
    let mut sums = vec![q(0)];
    for _ in 0..3 {
        sums.extend(sums.clone().iter().flat_map(|sum| durations.iter().map(move |length| sum + length)));
        sums.sort_unstable();
        sums.dedup();
    }
    for (time, _) in &world.events {
        borders.extend(sums.iter().map(|sum| time - sum).filter(|time| *time >= q(0)));
    }
    borders.sort_unstable();
    borders.dedup();
    let between: Vec<Q> = borders.windows(2).map(|pair| (pair[0] + pair[1]) / q(2)).collect();
    let last = *borders.last().expect("0") + q(1);
    borders.extend(between);
    borders.push(last);
    borders.sort_unstable();
    borders
}

/// How long an instance lasts in the initial state.
fn duration(world: &World, instance: usize) -> Option<Q> {
    let (action, objects) = &world.instances[instance];
    match &world.task.actions[*action].body {
        Body::Instantaneous(_) => Some(q(0)),
        Body::Durative { duration, .. } => {
            world.value(duration, &world.initial, objects).ok().filter(|length| *length >= q(0))
        }
    }
}

impl Enumeration<'_> {
    /// Executes a plan twice.
    fn outcome(&mut self, plan: &Schedule) -> Option<Outcome> {
        self.left = self.left.saturating_sub(1);
        let own = match self.unit {
            None => execute::execute(self.world, plan),
            Some(unit) => overlap::execute(self.world, plan, unit),
        };
        let own = match own {
            Ok(value) => Outcome::Valid(Some(big(value))),
            Err(Obstacle::Blocked("the goal does not hold")) => Outcome::Goal,
            Err(Obstacle::Blocked(_)) => Outcome::Invalid,
            Err(Obstacle::TooLarge) => return None,
        };
        let steps = written(self.world, plan);
        let verdict = project_verdict(self.mission, self.problem, &steps, &self.mode);
        let other = match &verdict.violation {
            None if self.problem.metric.is_some() => Outcome::Valid(verdict.metric),
            // Without a metric the validator has the time; steps are counted.
            None if self.unit.is_some() => Outcome::Valid(Some(verdict.total_time)),
            None => match &own {
                Outcome::Valid(value) => Outcome::Valid(value.clone()),
                _ => Outcome::Valid(None),
            },
            Some(violation) if violation.kind == ViolationKind::Goal => Outcome::Goal,
            Some(_) => Outcome::Invalid,
        };
        if let Outcome::Valid(Some(value)) = &other {
            self.valid += 1;
            let maximize = maximizes(&self.world.task);
            let better = |(best, _): &(BigRational, _)| if maximize { value > best } else { value < best };
            if self.best.as_ref().is_none_or(better) {
                self.best = Some((value.clone(), plan.clone()));
            }
        }
        if own != other {
            let reason = verdict.violation.map_or_else(String::new, |violation| violation.message.clone());
            let text = plan_lines(&steps);
            self.disagreements.push(format!("oracle {own:?}, validator {other:?} {reason} on\n{text}"));
        }
        Some(own)
    }

    /// All plans that go on from one, in a random order.
    fn extend(&mut self, plan: &Schedule, steps: usize) {
        let clock = plan.last().map_or(q(0), |(_, start, length)| start + length);
        let mut further: Vec<(usize, Q, Q)> = Vec::new();
        for instance in 0..self.world.instances.len() {
            let Some(length) = duration(self.world, instance) else { continue };
            let later = self.times.iter().filter(|time| self.unit.is_some() || **time > clock);
            further.extend(later.map(|time| (instance, *time, length)));
            if self.unit.is_none() {
                further.push((instance, clock, length));
            }
        }
        self.random.shuffle(&mut further);
        for step in further {
            if self.left == 0 || !self.disagreements.is_empty() {
                return;
            }
            let longer = [&plan[..], &[step]].concat();
            let outcome = self.outcome(&longer);
            // What cannot be executed can be, overlapping, with a further action.
            let extended = self.unit.is_some() || matches!(outcome, Some(Outcome::Valid(_) | Outcome::Goal));
            if steps > 1 && extended {
                self.extend(&longer, steps - 1);
            }
        }
    }
}

fn check(name: &str, seed: u64, unit: Option<Q>, tally: &mut Tally) {
    let task = sequential_task(seed, unit);
    let world = World::new(task);
    let (domain, problem_text) = (world.task.domain(), world.task.problem());
    let (mission, problem) = read(&domain, &problem_text).expect("the generator's tasks are read");
    let mut durations: Vec<Q> = (0..world.instances.len()).filter_map(|at| duration(&world, at)).collect();
    durations.retain(|length| *length > q(0));
    durations.sort_unstable();
    durations.dedup();
    let mode = unit.map_or(Mode::Sequential, |unit| Mode::Concurrent(big(unit)));
    let times = match unit {
        None => times(&world, &durations),
        Some(unit) => (0..14).map(|half| unit * q(half) / q(2)).collect(),
    };
    let mut enumeration = Enumeration {
        world: &world,
        unit,
        mission: &mission,
        problem: &problem,
        mode: mode.clone(),
        random: fastrand::Rng::with_seed(seed),
        times,
        left: setting("ORACLE_PLANS", 300) as usize,
        disagreements: Vec::new(),
        best: None,
        valid: 0,
    };
    let empty = Schedule::new();
    enumeration.outcome(&empty);
    enumeration.extend(&empty, 3);
    tally.count(if enumeration.left > 0 { "enumerated: all" } else { "enumerated: some" });
    *tally.counts.entry("plans that are valid".into()).or_default() += enumeration.valid;
    let best = enumeration.best.map(|(value, plan)| (value, written(&world, &plan)));
    let disagreements = enumeration.disagreements;
    let maximize = maximizes(&world.task);
    // The executor for plans of the planner is the validator here, which has judged them already.
    let case = Case {
        name: format!("{name}-{seed}"),
        domain,
        problem: problem_text,
        mode,
        maximize,
        truth: Truth::Open(best),
        execute: crate::temporal::executor(world, unit),
        certify: false,
        limit: Duration::from_secs(2),
    };
    for disagreement in &disagreements {
        tally.fail(&case, "executor and validator disagree", disagreement);
    }
    if disagreements.is_empty() {
        judge(&case, tally);
    } else {
        tally.tasks += 1;
    }
}

fn enumerate(name: &str, default: u64, unit: impl Fn(u64) -> Option<Q>) {
    let (from, tasks) = (setting("ORACLE_FROM", 0), setting("ORACLE_TASKS", default));
    let mut tally = Tally::default();
    (from..from + tasks).for_each(|seed| check(name, seed, unit(seed), &mut tally));
    tally.finish();
}

#[test]
fn plans_one_after_another() {
    enumerate("enumerated", 200, |_| None);
}

#[test]
fn plans_that_overlap() {
    enumerate("enumerated-overlap", 200, |seed| Some(concurrent_unit(seed)));
}
