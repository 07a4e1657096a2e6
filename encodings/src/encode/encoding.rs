//! The families of clauses in their order: a formula, and what its variables mean.

use std::cell::OnceCell;

use task::context::Context;
use task::limits::Interrupted;
use task::number::{Int, dense};
use task::plan::ground::GroundStep;
use task::task::Task;

use crate::encode::axioms::axioms;
use crate::encode::builder::Builder;
use crate::encode::conditional::FiredEffects;
use crate::encode::cost::{Cost, CostLimit};
use crate::encode::designs::task_slot;
use crate::encode::formula::Formula;
use crate::encode::goal::goal;
use crate::encode::interference::{Interference, StepSemantics};
use crate::encode::numeric::numeric;
use crate::encode::operators::{conditions, effects, sequence};
use crate::encode::selection::selection;
use crate::encode::state::{domain, frame};
use crate::encode::symmetry::Symmetry;
use crate::encode::variables::Variables;
use crate::sat::{Lit, Solver};

/// Which plans a formula is about.
pub struct PlanConstraints<'a> {
    /// For each step, whether each operator can be there; there are no more steps.
    pub allowed: &'a [Vec<bool>],
    /// What they cost at most, if that matters.
    pub cost: Option<CostLimit<'a>>,
    /// How many operators stand at a step.
    pub semantics: StepSemantics,
    /// A formula that comes to more clauses is not finished.
    pub max_clauses: usize,
}

/// A formula and what its variables mean.
pub struct Encoding<'a> {
    pub(super) task: &'a Task,
    pub formula: Formula,
    variables: Variables,
    cost: Option<Cost>,
}

impl<'a> Encoding<'a> {
    /// Encodes plans; of those that differ by exchanging what is equal only some. What is equal is found out once for a task, and
    /// kept in `symmetry`. None if a limit was reached meanwhile, if there are too many clauses, or if numbers are too large for a formula.
    pub fn new(
        context: Context<'a>,
        plans: PlanConstraints<'_>,
        symmetry: &OnceCell<Symmetry>,
    ) -> Option<Self> {
        let (mut builder, cost) = build(context, plans)?;
        if builder.variables.horizon() > 0 {
            if symmetry.get().is_none() {
                let _ = symmetry.set(Symmetry::new(context).ok()?);
            }
            symmetry.get()?.add(&mut builder).ok()?;
        }
        Some(Self::of(builder, cost))
    }

    /// The same with all plans.
    pub fn with_equals(context: Context<'a>, plans: PlanConstraints<'_>) -> Option<Self> {
        let (builder, cost) = build(context, plans)?;
        Some(Self::of(builder, cost))
    }

    fn of(builder: Builder<'a>, cost: Option<Cost>) -> Self {
        let Builder { task, formula, variables, .. } = builder;
        Self { task, formula, variables, cost }
    }

    /// From now on only plans with cost at most `limit`, which must not be above the limit of the encoding.
    pub fn tighten(&mut self, limit: Int) {
        if let Some(cost) = &self.cost {
            cost.at_most(&mut self.formula, limit);
        }
    }

    /// So many steps can be executed.
    pub fn horizon(&self) -> usize {
        self.variables.horizon()
    }

    /// What every plan costs at least, and literals each of which adds its weight if it is true.
    pub fn payments(&self) -> (Int, &[(Lit, Int)]) {
        self.cost.as_ref().map_or((0, &[]), Cost::payments)
    }

    /// The variable of an operator of a plan at its step, or that of the design of one of its slots.
    pub fn choice(&self, plan: &[GroundStep], (at, slot): (usize, Option<u32>)) -> Lit {
        let step = &plan[at];
        match slot {
            None => self.variables.operator(at, step.operator).unwrap_or(!Formula::truth()),
            Some(slot) => {
                let slots = &self.task.operators[step.operator.index()].slots;
                let (slot, design) = task_slot(slots, slot, step.choice[slot as usize]);
                self.variables.designs[at][slot][design]
            }
        }
    }

    /// The clause that excludes exactly one plan.
    pub fn blocking_clause(&self, plan: &[GroundStep]) -> Vec<Lit> {
        let longer = self.variables.busy.get(plan.len()).copied();
        let choices = plan.iter().enumerate().flat_map(|(at, step)| {
            let slots = (0..dense(step.choice.len())).map(Some);
            std::iter::once(None).chain(slots).map(move |slot| !self.choice(plan, (at, slot)))
        });
        choices.chain(longer).collect()
    }

    /// The plan of the assignment that the solver found.
    pub fn decode(&self, solver: &dyn Solver) -> Vec<GroundStep> {
        let holds = |literal: Lit| {
            literal == Formula::truth() || solver.value(literal.variable()) == literal.is_positive()
        };
        let mut steps = Vec::new();
        for (step, candidates) in self.variables.operators.iter().enumerate() {
            // Several stand in the order in which they can be executed.
            for (id, _) in candidates.iter().filter(|(_, literal)| holds(*literal)) {
                let operator = &self.task.operators[id.index()];
                let choice = operator.slots.iter().map(|slot| {
                    let designs = &self.variables.designs[step][slot.slot.index()];
                    let chosen = slot.designs.iter().position(|design| holds(designs[*design as usize]));
                    dense(chosen.unwrap_or(0))
                });
                steps.push(GroundStep { operator: *id, choice: choice.collect() });
            }
        }
        steps
    }
}

/// All families of clauses but that of symmetries. None if a limit was reached meanwhile, or if numbers do not fit.
fn build<'a>(context: Context<'a>, plans: PlanConstraints<'_>) -> Option<(Builder<'a>, Option<Cost>)> {
    let PlanConstraints { allowed, cost, semantics, max_clauses: most } = plans;
    let potential = cost.as_ref().and_then(|cost| cost.bounds.projections.first());
    let interference = Interference::new(context, semantics, potential).ok()?;
    let mut builder = Builder::new(context, allowed, most).ok()?;
    let horizon = builder.variables.horizon();
    for step in 0..horizon {
        at_step(&mut builder, step, interference.as_ref()).ok()?;
    }
    domain(&mut builder, horizon);
    let numbers = numeric(&mut builder)?;
    for item in context.limits.watch(numbers.iter().enumerate()) {
        let (step, numbers) = item.ok()?;
        axioms(&mut builder, step, numbers)?;
    }
    goal(&mut builder, &numbers[horizon])?;
    let cost = match cost {
        Some(cost) => Some(Cost::new(&mut builder, &cost, interference.as_ref())?),
        None => None,
    };
    Some((builder, cost))
}

/// What concerns one step apart from numbers, derived variables and costs.
fn at_step(
    builder: &mut Builder<'_>,
    step: usize,
    interference: Option<&Interference>,
) -> Result<(), Interrupted> {
    domain(builder, step);
    sequence(builder, step, interference.is_none());
    if let Some(interference) = interference {
        interference.add(builder, step)?;
    }
    builder.check()?;
    conditions(builder, step);
    builder.check()?;
    let fires = FiredEffects::new(builder, step);
    builder.check()?;
    effects(builder, step, &fires);
    builder.check()?;
    frame(builder, step, &fires);
    selection(builder, step)
}
