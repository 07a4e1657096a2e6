//! Further cheapest plans, and which choices all of them share.
//!
//! The formula "a plan that costs at most the optimum", with as many steps as such a plan can have, is solved again and again, each
//! plan excluded that was found before. What every cheapest plan has in common is its backbone [1]: asked for a plan that
//! differs from the first one in at least one of the choices left, the solver names one, which rules out where the two
//! differ, or proves that there is none. Equal designs and objects are not taken for one another here.
//!
//! [1] J. Marques-Silva, M. Janota, I. Lynce: On computing backbones of propositional theories, ECAI 2010.

#[cfg(test)]
mod tests;

use crate::bounds::Bounds;
use crate::context::Context;
use crate::encode::{CostLimit, Counting, Encoding, Meaning, Plans, Semantics};
use crate::number::dense;
use crate::optimize::Config;
use crate::plan::ground::{GroundPlan, GroundStep, replay};
use crate::plan::solution::{Solution, Status};
use crate::plan::{Plan, decode};
use crate::sat::{Answer, Backend, Lit, Solver};
use crate::task::{Argument, Task};

/// What is known of the other cheapest plans.
#[derive(Debug, Clone)]
pub struct Alternatives {
    /// Plans that cost as much as the first one; not the first one itself.
    pub plans: Vec<Plan>,
    /// Whether it is proved that there are no others.
    pub complete: bool,
    /// For each step of the first plan which of its choices every cheapest plan makes at that step; none if a limit was
    /// reached, or if cheapest plans may be longer than any that was looked for.
    pub forced: Option<Vec<Forced>>,
}

/// Choices at a step that are the same in every cheapest plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Forced {
    /// Whether the action is, with its arguments apart from designs.
    pub action: bool,
    /// The functions whose design is.
    pub functions: Vec<String>,
}

/// Looks for so many more cheapest plans than that of an optimal solution. None if the solution is not optimal, or its formula
/// could not be built within the limits.
pub fn alternatives(task: &Task, solution: &Solution, most: usize, config: &Config) -> Option<Alternatives> {
    let first = solution.ground.as_ref().filter(|_| solution.status == Status::Optimal)?;
    let context = Context::new(task, &config.limits);
    let bounds = Bounds::new(context).ok()?;
    let window = bounds.window(context, Some(first.cost), config.horizon).ok()?;
    let is_complete = window.steps.is_some_and(|steps| steps <= window.allowed.len());
    // Nobody has checked what a program says of a formula without a model.
    let complete = is_complete && !matches!(config.backend, Backend::Program { .. });
    let allowed = if is_complete || config.horizon.is_some() {
        window.allowed
    } else {
        bounds.window(context, Some(first.cost), Some(first.steps.len())).ok()?.allowed
    };
    let cost = CostLimit { limit: first.cost, bounds: &bounds, counting: Counting::Sum };
    let plans =
        Plans { allowed: &allowed, cost: Some(cost), semantics: Semantics::Sequential, most: usize::MAX };
    let encoding = Encoding::with_equals(context, plans)?;
    let mut solver = config.backend.start(&config.limits, u64::MAX);
    for clause in config.limits.watch(encoding.formula.clauses()) {
        solver.add_clause(clause.ok()?.1);
    }
    let mut run = Run { task, encoding, solver };
    let plan =
        |steps: &[GroundStep]| decode(context, &GroundPlan { steps: steps.to_vec(), cost: first.cost });
    let mut found = vec![first.steps.clone()];
    // What differs in waits only is one plan to its reader.
    let mut plans = vec![plan(&first.steps)];
    let mut exhausted = false;
    // Excludes the plans that are known as long as it is assumed.
    let others = run.encoding.formula.fresh(Meaning::Others);
    while plans.len() <= most && !exhausted {
        if let Some(known) = found.last() {
            run.exclude(known, others);
        }
        match run.solve(&[others]) {
            (Answer::Satisfiable, Some(other)) => {
                let shown = plan(&other);
                found.push(other);
                if !plans.contains(&shown) {
                    plans.push(shown);
                }
            }
            (Answer::Unsatisfiable, _) => exhausted = true,
            _ => break,
        }
    }
    // Where there are waits, one action is several operators, at one place or another.
    let has_waits = task.operators.iter().any(|operator| operator.wait.is_some());
    let forced = if complete && !has_waits { run.forced(&first.steps, &found) } else { None };
    plans.remove(0);
    Some(Alternatives { plans, complete: complete && exhausted, forced })
}

struct Run<'a> {
    task: &'a Task,
    encoding: Encoding<'a>,
    solver: Box<dyn Solver>,
}

/// A choice of the first plan: an operator at a step, or the design of one of its slots (by position).
type Choice = (usize, Option<u32>);

impl Run<'_> {
    /// Excludes a plan if the literal holds.
    fn exclude(&mut self, plan: &[GroundStep], literal: Lit) {
        let mut clause = self.encoding.other_than(plan);
        clause.push(!literal);
        self.solver.add_clause(&clause);
    }

    /// A plan of the formula under assumptions.
    fn solve(&mut self, assumptions: &[Lit]) -> (Answer, Option<Vec<GroundStep>>) {
        let answer = self.solver.solve(assumptions);
        if answer != Answer::Satisfiable {
            return (answer, None);
        }
        let steps = self.encoding.decode(self.solver.as_ref());
        let is_plan = replay(self.task, &steps).is_some();
        debug_assert!(is_plan, "the encoding admits a sequence that is not a plan");
        (answer, is_plan.then_some(steps))
    }

    /// Which choices of the first plan all cheapest plans make; some of them are known.
    fn forced(&mut self, first: &[GroundStep], known: &[Vec<GroundStep>]) -> Option<Vec<Forced>> {
        let mut choices: Vec<Choice> = Vec::new();
        for (at, step) in first.iter().enumerate() {
            choices.push((at, None));
            choices.extend((0..dense(step.choice.len())).map(|slot| (at, Some(slot))));
        }
        for plan in known {
            choices.retain(|choice| self.shares(first, plan, *choice));
        }
        while !choices.is_empty() {
            let other = self.encoding.formula.fresh(Meaning::Others);
            let differs = choices.iter().map(|choice| !self.encoding.choice(first, *choice));
            let clause: Vec<_> = differs.chain([!other]).collect();
            self.solver.add_clause(&clause);
            match self.solve(&[other]) {
                (Answer::Satisfiable, Some(plan)) => {
                    choices.retain(|choice| self.shares(first, &plan, *choice));
                }
                (Answer::Unsatisfiable, _) => break,
                _ => return None,
            }
        }
        Some(first.iter().enumerate().map(|(at, step)| self.names(at, step, &choices)).collect())
    }

    fn shares(&self, first: &[GroundStep], plan: &[GroundStep], (at, slot): Choice) -> bool {
        let Some(other) = plan.get(at) else { return false };
        match slot {
            None => other.operator == first[at].operator,
            Some(slot) => {
                let own = self.design(&first[at], slot as usize);
                (0..other.choice.len()).any(|position| self.design(other, position) == own)
            }
        }
    }

    /// Slot and design in the task's numbering.
    fn design(&self, step: &GroundStep, position: usize) -> (usize, u32) {
        let usage = &self.task.operators[step.operator.index()].slots[position];
        (usage.slot.index(), usage.designs[step.choice[position] as usize])
    }

    fn names(&self, at: usize, step: &GroundStep, forced: &[Choice]) -> Forced {
        let action = forced.contains(&(at, None));
        let operator = &self.task.operators[step.operator.index()];
        let is_forced = |argument: &Argument| match argument {
            Argument::Object(_) => action,
            Argument::Slot(slot) => forced.contains(&(at, Some(*slot))),
        };
        let functions = operator.configuration.iter().filter(|(_, argument)| is_forced(argument));
        let name = |function: crate::lifted::ObjectId| self.task.object_names[function.index()].clone();
        Forced { action, functions: functions.map(|(function, _)| name(*function)).collect() }
    }
}
