//! Test of the validator on plans of up to three steps for tiny tasks.
//!
//! Each plan is executed by the project's validator and by the oracle's executor. Both must agree on
//! validity, on whether only the goal fails, and on the value. The best plan that the *validator* accepts is
//! then compared with the planner's claim.
//!
//! Sequential plans: the applicability of an action depends only on the positions of its start and of its end
//! relative to the events. So the only relevant start times are T − (sums of up to three durations) for
//! events at T, the points between these times, and the end of the previous action. A plan with an
//! inexecutable prefix is not extended. Concurrent plans: starts are multiples of half the separation.
//! `ORACLE_PLANS` limits the number of plans per task; the order is random, so the limit selects a random
//! sample.

use std::time::Duration;

use metaplan::mission::Mission;
use num_rational::BigRational;
use pddl::ast::Problem;
use pddl::validate::ViolationKind;

use crate::judge::{
    Case, Mode, SHORT, Tally, Truth, is_over, judge, plan_lines, project_verdict, read, setting,
};
use crate::temporal::best::{Schedule, written};
use crate::temporal::happening::{Obstacle, World};
use crate::temporal::model::{Body, Q, big, q};
use crate::temporal::{concurrent_unit, execute, maximizes, overlap, sequential_task};

#[derive(Debug, Clone, PartialEq, Eq)]
enum Outcome {
    Valid(Option<BigRational>),
    /// Executable, but the goal does not hold in the final state.
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
    remaining_plans: usize,
    disagreements: Vec<String>,
    best: Option<(BigRational, Schedule)>,
    valid: usize,
}

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
    // Applicability is constant between two neighbouring times, so one point per interval is sufficient.
    let between: Vec<Q> = borders.windows(2).map(|pair| (pair[0] + pair[1]) / q(2)).collect();
    let last = *borders.last().expect("0") + q(1);
    borders.extend(between);
    borders.push(last);
    borders.sort_unstable();
    borders
}

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
    /// Executes a plan with the validator and with the executor, and records a disagreement. Returns the
    /// executor's result; `None` on overflow.
    fn outcome(&mut self, plan: &Schedule) -> Option<Outcome> {
        self.remaining_plans = self.remaining_plans.saturating_sub(1);
        let executed = match self.unit {
            None => execute::execute(self.world, plan),
            Some(unit) => overlap::execute(self.world, plan, unit),
        };
        let executed = match executed {
            Ok(value) => Outcome::Valid(Some(big(value))),
            Err(Obstacle::Blocked("the goal does not hold")) => Outcome::Goal,
            Err(Obstacle::Blocked(_)) => Outcome::Invalid,
            Err(Obstacle::TooLarge) => return None,
        };
        let steps = written(self.world, plan);
        let verdict = project_verdict(self.mission, self.problem, &steps, &self.mode);
        let validated = match &verdict.violation {
            None if self.problem.metric.is_some() => Outcome::Valid(verdict.metric),
            // Without a metric, the oracle may count the steps of sequential plans. The validator does not,
            // so its value cannot be compared.
            None if self.unit.is_some() => Outcome::Valid(Some(verdict.total_time)),
            None => match &executed {
                Outcome::Valid(value) => Outcome::Valid(value.clone()),
                _ => Outcome::Valid(None),
            },
            Some(violation) if violation.kind == ViolationKind::Goal => Outcome::Goal,
            Some(_) => Outcome::Invalid,
        };
        if let Outcome::Valid(Some(value)) = &validated {
            self.valid += 1;
            let maximize = maximizes(&self.world.task);
            let better = |(best, _): &(BigRational, _)| if maximize { value > best } else { value < best };
            if self.best.as_ref().is_none_or(better) {
                self.best = Some((value.clone(), plan.clone()));
            }
        }
        if executed != validated {
            let reason = verdict.violation.map_or_else(String::new, |violation| violation.message.clone());
            let text = plan_lines(&steps);
            self.disagreements
                .push(format!("oracle {executed:?}, validator {validated:?} {reason} on\n{text}"));
        }
        Some(executed)
    }

    /// Ends when the limit on the number of plans is reached or a disagreement was found.
    fn extend(&mut self, plan: &Schedule, steps: usize) {
        let clock = plan.last().map_or(q(0), |(_, start, length)| start + length);
        let mut candidates: Vec<(usize, Q, Q)> = Vec::new();
        for instance in 0..self.world.instances.len() {
            let Some(length) = duration(self.world, instance) else { continue };
            let later = self.times.iter().filter(|time| self.unit.is_some() || **time > clock);
            candidates.extend(later.map(|time| (instance, *time, length)));
            if self.unit.is_none() {
                candidates.push((instance, clock, length));
            }
        }
        self.random.shuffle(&mut candidates);
        for step in candidates {
            if self.remaining_plans == 0 || !self.disagreements.is_empty() {
                return;
            }
            let extended_plan = [&plan[..], &[step]].concat();
            let outcome = self.outcome(&extended_plan);
            // In concurrent mode a further action can make an inexecutable plan executable, for example by adding a fact in time.
            let is_extensible =
                self.unit.is_some() || matches!(outcome, Some(Outcome::Valid(_) | Outcome::Goal));
            if steps > 1 && is_extensible {
                self.extend(&extended_plan, steps - 1);
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
        remaining_plans: setting("ORACLE_PLANS", 300) as usize,
        disagreements: Vec::new(),
        best: None,
        valid: 0,
    };
    let empty = Schedule::new();
    enumeration.outcome(&empty);
    enumeration.extend(&empty, 3);
    tally.count(if enumeration.remaining_plans > 0 { "enumerated: all" } else { "enumerated: some" });
    *tally.counts.entry("plans that are valid".into()).or_default() += enumeration.valid;
    let best = enumeration.best.map(|(value, plan)| (value, written(&world, &plan)));
    let disagreements = enumeration.disagreements;
    let maximize = maximizes(&world.task);
    // The oracle's executor cannot check the claimed truth here: the validator found the truth, and both were
    // compared above.
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
        second_limit: SHORT,
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
    for seed in from..from + tasks {
        check(name, seed, unit(seed), &mut tally);
        if is_over(&tally) {
            break;
        }
    }
    tally.finish();
}

#[test]
fn validator_agrees_on_sequential_plans() {
    enumerate("enumerated", 200, |_| None);
}

#[test]
fn validator_agrees_on_concurrent_plans() {
    enumerate("enumerated-overlap", 200, |seed| Some(concurrent_unit(seed)));
}
