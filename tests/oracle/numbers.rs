//! Generator B: tasks with numbers, function designs, and optimisation.
//!
//! Missions with designs, and arithmetic tasks, are derived from seeds. Their numbers are hard to compute
//! with, and thresholds are hit exactly or missed by a tiny amount. The oracle is explicit search with
//! rational numbers.

mod arithmetic;
mod deeds;
mod draw;
mod explore;
mod fronts;
mod ground;
mod missions;
mod model;
mod print;
mod shrink;
mod special;
mod step;
mod truth;
mod tune;
mod variants;

use std::rc::Rc;
use std::time::Duration;

use fastrand::Rng;

use crate::judge::{Case, Executor, Mode, SHORT, Step, Tally, Truth, is_over, judge, setting};

use explore::{Budget, Measures};
use ground::Ground;
use model::{Expr, Number, Task};
use truth::{Explored, Outcome};

const BUDGET: Budget = Budget { states: 300, attempts: 25_000 };

struct Puzzle {
    name: String,
    task: Task,
    ground: Rc<Ground>,
    explored: Explored,
}

impl Puzzle {
    fn new(name: String, task: Task, objectives: &[Expr]) -> Option<Self> {
        Self::within(name, task, objectives, BUDGET)
    }

    fn within(name: String, task: Task, objectives: &[Expr], budget: Budget) -> Option<Self> {
        let ground = Rc::new(ground::ground(&task, objectives, budget.attempts)?);
        let maximize = task.metric.as_ref().is_some_and(|(maximize, _)| *maximize);
        let explored = truth::truth(&ground, maximize, budget)?;
        Some(Self { name, task, ground, explored })
    }

    fn maximize(&self) -> bool {
        self.task.metric.as_ref().is_some_and(|(maximize, _)| *maximize)
    }

    /// Returns the steps of a plan, without gaps between them.
    fn steps(&self, plan: &[usize]) -> Vec<Step> {
        let mut clock = model::whole(0);
        let step = |number: &usize| {
            let instance = &self.ground.instances[*number];
            let name = |object: &usize| self.task.objects[*object].0.clone();
            let start = clock.clone();
            clock += &instance.duration;
            Step {
                action: self.task.actions[instance.action].name.clone(),
                arguments: instance.arguments.iter().map(name).collect(),
                start,
                duration: instance.duration.clone(),
            }
        };
        plan.iter().map(step).collect()
    }

    fn case(&self, certify: bool) -> Case {
        let (domain, problem) = print::print(&self.task);
        let solution = |solution: &(Number, Vec<usize>)| (solution.0.clone(), self.steps(&solution.1));
        let truth = match &self.explored.outcome {
            Outcome::Best(best) => {
                let (cost, plan) = solution(best);
                Truth::Best(cost, plan)
            }
            Outcome::NoPlan => Truth::NoPlan,
            Outcome::NoBest(best) => {
                let (cost, plan) = solution(best);
                Truth::NoBest(cost, plan)
            }
            Outcome::Open(best) => Truth::Open(best.as_ref().map(solution)),
        };
        Case {
            name: self.name.clone(),
            domain,
            problem,
            mode: Mode::Sequential,
            maximize: self.maximize(),
            truth,
            execute: executor(Rc::clone(&self.ground)),
            certify,
            limit: Duration::from_millis(500),
            second_limit: SHORT,
        }
    }
}

fn executor(ground: Rc<Ground>) -> Executor {
    Box::new(move |steps: &[Step]| {
        let measures = Measures::new(&ground);
        let mut state = measures.initial();
        let mut clock = model::whole(0);
        for step in steps {
            let position = ground.by_name.get(&(step.action.clone(), step.arguments.clone()));
            let instance = &ground.instances[*position.ok_or(format!("no action {step:?}"))?];
            if step.duration != instance.duration {
                return Err(format!("{step:?} takes {}", instance.duration));
            }
            if step.start < clock {
                return Err(format!("{step:?} overlaps"));
            }
            clock = &step.start + &step.duration;
            state = step::execute(instance, &state).ok_or(format!("{step:?} cannot be executed"))?;
        }
        if !step::all_hold(&ground.goal, &state) {
            return Err("the goal does not hold".to_owned());
        }
        let steps = i64::try_from(steps.len()).expect("a short plan");
        measures.of(&state, steps).map(|mut values| values.swap_remove(0)).ok_or("no value".to_owned())
    })
}

fn task(seed: u64) -> Task {
    let mut rng = Rng::with_seed(seed);
    // The first numbers of neighbouring seeds are correlated, so they are discarded.
    (0..8).for_each(|_| {
        rng.u64(..);
    });
    if rng.u32(0..5) < 3 { missions::mission(&mut rng) } else { arithmetic::arithmetic(&mut rng) }
}

fn judge_seed(seed: u64, tally: &mut Tally) {
    judge_task(seed, &task(seed), tally);
}

fn judge_task(seed: u64, task: &Task, tally: &mut Tally) {
    let puzzle_with = |objectives: &[Expr]| Puzzle::new(format!("numbers-{seed}"), task.clone(), objectives);
    let Some(puzzle) = puzzle_with(&[]) else { return tally.count("oracle: too large") };
    let case = puzzle.case(seed.is_multiple_of(2));
    judge(&case, tally);
    let mut rng = Rng::with_seed(seed ^ 0x5eed);
    variants::check_validator(&puzzle, &case, &mut rng, tally);
    // Each expensive check runs for a quarter of the seeds.
    if seed % 4 == 1 {
        variants::check_variants(&puzzle, &case, &mut rng, tally);
    }
    if seed % 4 == 3 {
        let objectives = variants::objectives(&puzzle, &mut rng);
        if let Some(puzzle) = puzzle_with(&objectives) {
            variants::check_objectives(&puzzle, &objectives, &case, tally);
        }
    }
}

/// Runs the seeds of one parity (`first` is 0 or 1), so that two test threads share the work.
fn judge_seeds(first: u64) {
    let (from, tasks) = (setting("ORACLE_FROM", 0), setting("ORACLE_TASKS", 160));
    let mut tally = Tally::default();
    for seed in (from + first..from + tasks).step_by(2) {
        judge_seed(seed, &mut tally);
        if is_over(&tally) {
            break;
        }
    }
    tally.finish();
}

#[test]
fn random_tasks_with_numbers() {
    judge_seeds(0);
}

#[test]
fn random_tasks_with_numbers_odd_seeds() {
    judge_seeds(1);
}

#[test]
#[ignore = "writes the tasks of `ORACLE_FROM` and what follows to `ORACLE_SAVE`"]
fn show() {
    let directory = std::path::PathBuf::from(std::env::var_os("ORACLE_SAVE").expect("ORACLE_SAVE is set"));
    let (from, tasks) = (setting("ORACLE_FROM", 0), setting("ORACLE_TASKS", 1));
    for seed in from..from + tasks {
        let (domain, problem) = print::print(&task(seed));
        let directory = directory.join(format!("numbers-{seed}"));
        std::fs::create_dir_all(&directory).expect("a directory");
        std::fs::write(directory.join("domain.pddl"), domain).expect("a file");
        std::fs::write(directory.join("problem.pddl"), problem).expect("a file");
    }
}

#[test]
#[ignore = "makes the tasks of `ORACLE_FROM` and what follows smaller, where they fail, and prints them"]
#[allow(clippy::print_stdout)]
fn smaller() {
    let (from, tasks) = (setting("ORACLE_FROM", 0), setting("ORACLE_TASKS", 1));
    for seed in from..from + tasks {
        let kinds = |task: &Task| {
            let mut tally = Tally::default();
            judge_task(seed, task, &mut tally);
            tally.failures.iter().map(|failure| failure.kind).collect::<Vec<_>>()
        };
        for kind in kinds(&task(seed)) {
            // Delta debugging: the kind of failure must remain the same while the task shrinks.
            let small = shrink::shrink(task(seed), &|task| kinds(task).contains(&kind));
            let mut tally = Tally::default();
            judge_task(seed, &small, &mut tally);
            let texts = tally.failures.iter().filter(|failure| failure.kind == kind);
            texts.for_each(|failure| println!("{}", failure.text));
        }
    }
}
