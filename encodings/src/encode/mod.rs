//! Ground task to formula: is there a plan of at most `horizon` steps that costs at most `limit`?
//!
//! An encoding over finite-domain variables with explanatory frame axioms [1], sequential or with several operators at a
//! step. Steps that a plan does not need are idle, and stand at its end. The designs of an operator's slots are variables of their own beside the operator's, so that
//! the formula grows with the sum of the designs, not with their product. Each family of clauses has a file.
//!
//! [1] H. Kautz, B. Selman: Pushing the envelope: planning, propositional logic and stochastic search, AAAI 1996.

mod arithmetic;
mod axioms;
mod conditional;
mod cost;
mod equal_designs;
mod formula;
mod groups;
mod interference;
mod numeric;
mod operators;
mod selection;
mod state;
mod symmetry;
#[cfg(test)]
mod tests;

use std::cell::OnceCell;

use rustc_hash::FxHashMap;

use crate::bounds::Bounds;
use crate::ground_plan::GroundStep;
use crate::limits::{Interrupted, Limits};
use crate::number::{Int, dense};
use crate::sat::{Lit, Solver};
use crate::task::{Fact, Literal, OperatorId, Task};
use conditional::Fires;
use cost::Cost;
pub(crate) use formula::{Family, Formula, Meaning};
use interference::Interference;
pub use interference::Semantics;
pub(crate) use symmetry::Symmetry;

/// A formula and what its variables mean.
pub(crate) struct Encoding<'a> {
    task: &'a Task,
    pub(crate) formula: Formula,
    horizon: usize,
    /// What operators must not stand at the same step; none if each stands alone.
    interference: Option<Interference>,
    /// For each step the operators that can be there, ascending, with their variables.
    operators: Vec<Vec<(OperatorId, Lit)>>,
    /// Whether any operator is executed at the step.
    busy: Vec<Lit>,
    /// `values[step][variable][value]`: the variable has the value before the step.
    values: Vec<Vec<Vec<Lit>>>,
    /// `designs[step][slot][design]`.
    designs: Vec<Vec<Vec<Lit>>>,
    groups: FxHashMap<(usize, Vec<OperatorId>), Lit>,
    /// `fires[step]`: the conditional effects of the operators at the step, and whether they take place.
    fires: Vec<Vec<Fires>>,
    cost: Option<Cost>,
}

/// The cost limit of an encoding: only plans with cost at most `limit` count, by the estimates of `bounds`.
pub(crate) struct CostLimit<'a> {
    pub(crate) limit: Int,
    pub(crate) bounds: &'a Bounds,
    pub(crate) counting: Counting,
}

/// What an encoding makes of the costs of steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Counting {
    /// Their sum, which the limit holds down.
    Sum,
    /// Literals with weights, which the solver is to keep false. Only what exceeds the limit by itself is excluded.
    Apart,
}

impl<'a> Encoding<'a> {
    /// Encodes plans of at most `allowed.len()` steps, with the operators allowed at each step; of plans that differ by
    /// exchanging what is equal only some; what is equal is found out once for a task, and kept in `symmetry`. None if a limit was reached meanwhile, or if numbers are too large for a formula.
    pub(crate) fn new(
        task: &'a Task,
        allowed: &[Vec<bool>],
        cost: Option<CostLimit<'_>>,
        semantics: Semantics,
        symmetry: &OnceCell<Symmetry>,
        limits: &Limits,
    ) -> Option<Self> {
        let mut encoding = Self::with_equals(task, allowed, cost, semantics, limits)?;
        if encoding.horizon > 0 {
            if symmetry.get().is_none() {
                let _ = symmetry.set(Symmetry::new(task, limits).ok()?);
            }
            encoding.break_symmetries(symmetry.get()?, limits).ok()?;
        }
        Some(encoding)
    }

    /// The same with all plans.
    pub(crate) fn with_equals(
        task: &'a Task,
        allowed: &[Vec<bool>],
        cost: Option<CostLimit<'_>>,
        semantics: Semantics,
        limits: &Limits,
    ) -> Option<Self> {
        let potential = cost.as_ref().and_then(|cost| cost.bounds.projections.first());
        let horizon = allowed.len();
        let mut encoding = Self {
            task,
            formula: Formula::new(),
            horizon,
            interference: Interference::new(task, semantics, potential, limits).ok()?,
            operators: Vec::new(),
            busy: Vec::new(),
            values: Vec::new(),
            designs: Vec::new(),
            groups: FxHashMap::default(),
            fires: Vec::new(),
            cost: None,
        };
        encoding.declare(allowed, limits).ok()?;
        for step in 0..horizon {
            encoding.step(step, limits).ok()?;
        }
        encoding.domain(horizon);
        let numbers = encoding.numeric(limits)?;
        for item in limits.watch(numbers.iter().enumerate()) {
            let (step, numbers) = item.ok()?;
            encoding.axioms(step, numbers)?;
        }
        encoding.goal(&numbers[horizon])?;
        if let Some(cost) = cost {
            encoding.cost = Some(encoding.accumulate(&cost, limits)?);
        }
        Some(encoding)
    }

    /// What concerns one step apart from numbers, derived variables and costs.
    fn step(&mut self, step: usize, limits: &Limits) -> Result<(), Interrupted> {
        self.domain(step);
        self.sequence(step);
        self.interfere(step, limits)?;
        for family in [Self::conditions, Self::conditional, Self::effects, Self::frame] {
            limits.check()?;
            family(self, step);
        }
        self.selection(step, limits)
    }

    /// The variable of a fact before a step.
    fn fact(&self, fact: Fact, step: usize) -> Lit {
        self.values[step][fact.variable.index()][fact.value as usize]
    }

    /// The variable of a fact before a step, or its negation.
    fn literal(&self, literal: Literal, step: usize) -> Lit {
        let fact = self.fact(literal.fact, step);
        if literal.positive { fact } else { !fact }
    }

    /// The last state satisfies the goal; idle steps at the end keep it satisfied.
    fn goal(&mut self, numbers: &[arithmetic::Bits]) -> Option<()> {
        let task = self.task;
        for fact in &task.goal.facts {
            let literal = self.fact(*fact, self.horizon);
            self.formula.add(Family::Goal, [literal]);
        }
        for clause in &task.goal.clauses {
            let literals: Vec<_> =
                clause.iter().map(|literal| self.literal(*literal, self.horizon)).collect();
            self.formula.add(Family::Goal, literals);
        }
        self.numeric_goal(numbers)
    }

    /// From now on only plans with cost at most `limit`, which must not be above the limit of the encoding.
    pub(crate) fn tighten(&mut self, limit: Int) {
        if let Some(cost) = self.cost.take() {
            cost.at_most(&mut self.formula, limit);
            self.cost = Some(cost);
        }
    }

    /// So many steps can be executed.
    pub(crate) fn horizon(&self) -> usize {
        self.horizon
    }

    /// What every plan costs at least, and literals each of which adds its weight if it is true.
    pub(crate) fn payments(&self) -> (Int, &[(Lit, Int)]) {
        self.cost.as_ref().map_or((0, &[]), Cost::payments)
    }

    /// The variable of an operator of a plan at its step, or that of the design of one of its slots.
    pub(crate) fn choice(&self, plan: &[GroundStep], (at, slot): (usize, Option<u32>)) -> Lit {
        let step = &plan[at];
        match slot {
            None => self.operator(at, step.operator).unwrap_or(!Formula::truth()),
            Some(slot) => {
                let slots = &self.task.operators[step.operator.index()].slots;
                let (slot, design) = selection::global(slots, slot, step.choice[slot as usize]);
                self.designs[at][slot][design]
            }
        }
    }

    /// The clause that excludes exactly one plan.
    pub(crate) fn other_than(&self, plan: &[GroundStep]) -> Vec<Lit> {
        let longer = self.busy.get(plan.len()).copied();
        let choices = plan.iter().enumerate().flat_map(|(at, step)| {
            let slots = (0..dense(step.choice.len())).map(Some);
            std::iter::once(None).chain(slots).map(move |slot| !self.choice(plan, (at, slot)))
        });
        choices.chain(longer).collect()
    }

    /// The plan of the assignment that the solver found.
    pub(crate) fn decode(&self, solver: &dyn Solver) -> Vec<GroundStep> {
        let holds = |literal: Lit| {
            literal == Formula::truth() || solver.value(literal.variable()) == literal.is_positive()
        };
        let mut steps = Vec::new();
        for (step, candidates) in self.operators.iter().enumerate() {
            // Several stand in the order in which they can be executed.
            for (id, _) in candidates.iter().filter(|(_, literal)| holds(*literal)) {
                let operator = &self.task.operators[id.index()];
                let choice = operator.slots.iter().map(|slot| {
                    let designs = &self.designs[step][slot.slot.index()];
                    let chosen = slot.designs.iter().position(|design| holds(designs[*design as usize]));
                    dense(chosen.unwrap_or(0))
                });
                steps.push(GroundStep { operator: *id, choice: choice.collect() });
            }
        }
        steps
    }
}
