//! Assembles all families of clauses into a formula, and decodes satisfying assignments into plans.

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

/// Constraints on the plans that a formula admits.
pub struct PlanConstraints<'a> {
    /// `allowed[step][operator]` is `true` if the operator may occur at the step. The number of
    /// steps is the horizon.
    pub allowed: &'a [Vec<bool>],
    /// Limit on the cost of the plans; `None` for plans of any cost.
    pub cost: Option<CostLimit<'a>>,
    /// Number and order of the operators within a step.
    pub semantics: StepSemantics,
    /// Maximum number of clauses; beyond it, no encoding is created. It is checked between parts of the encoding,
    /// but not after all of them, so an encoding may have more clauses.
    pub max_clauses: usize,
}

/// The formula for plans of a task, with the meaning of its variables.
pub struct Encoding<'a> {
    pub(super) task: &'a Task,
    pub formula: Formula,
    variables: Variables,
    cost: Option<Cost>,
}

impl<'a> Encoding<'a> {
    /// Encodes plans with symmetry breaking: of plans that differ only by exchanging interchangeable designs or
    /// objects, at least one is admitted, but usually not all. `symmetry` caches the symmetries of the task.
    /// Returns `None` if the deadline passes or the run is interrupted, there are too many clauses, or numbers
    /// are too large.
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

    /// Encodes plans as [`Encoding::new`] does, but without symmetry breaking.
    pub fn with_equals(context: Context<'a>, plans: PlanConstraints<'_>) -> Option<Self> {
        let (builder, cost) = build(context, plans)?;
        Some(Self::of(builder, cost))
    }

    fn of(builder: Builder<'a>, cost: Option<Cost>) -> Self {
        let Builder { task, formula, variables, .. } = builder;
        Self { task, formula, variables, cost }
    }

    /// Adds clauses for a lower cost limit, if costs are encoded (see [`CostLimit`]). A limit above that of
    /// the encoding has no effect. With `CostEncoding::Apart`, only a limit below the lower bound has an effect.
    pub fn tighten(&mut self, limit: Int) {
        if let Some(cost) = &self.cost {
            cost.at_most(&mut self.formula, limit);
        }
    }

    /// Returns the maximum number of steps.
    pub fn horizon(&self) -> usize {
        self.variables.horizon()
    }

    /// Returns the cost as a sum for core-guided search: a lower bound on the cost of every plan, and literals whose
    /// weights are added to it if the literals are true. The slice is empty unless the encoding uses
    /// `CostEncoding::Apart`. Without a cost limit, the lower bound is 0.
    pub fn payments(&self) -> (Int, &[(Lit, Int)]) {
        self.cost.as_ref().map_or((0, &[]), Cost::payments)
    }

    /// Returns the literal for a choice that a plan makes at the step `at`: its operator if `slot` is `None`, otherwise
    /// its design for this slot. The encoding must have sequential semantics, so that the step `at` has action number
    /// `at` of the plan. For an operator that is impossible at the step, returns the constant false.
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

    /// Returns a clause that excludes exactly this plan. The encoding must have sequential semantics, so that
    /// each action of the plan has its own step.
    pub fn blocking_clause(&self, plan: &[GroundStep]) -> Vec<Lit> {
        // A longer plan that begins with this plan is a different plan, so it stays admitted.
        let longer = self.variables.busy.get(plan.len()).copied();
        let choices = plan.iter().enumerate().flat_map(|(at, step)| {
            let slots = (0..dense(step.choice.len())).map(Some);
            std::iter::once(None).chain(slots).map(move |slot| !self.choice(plan, (at, slot)))
        });
        choices.chain(longer).collect()
    }

    /// Decodes the last satisfying assignment of a solver into a plan.
    pub fn decode(&self, solver: &dyn Solver) -> Vec<GroundStep> {
        let holds = |literal: Lit| {
            literal == Formula::truth() || solver.value(literal.variable()) == literal.is_positive()
        };
        let mut steps = Vec::new();
        for (step, candidates) in self.variables.operators.iter().enumerate() {
            // Operators of one step are listed in an executable order.
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

/// Adds all families of clauses except symmetry breaking. Returns `None` if a limit is reached, there are too many
/// clauses, or numbers are too large.
fn build<'a>(context: Context<'a>, plans: PlanConstraints<'_>) -> Option<(Builder<'a>, Option<Cost>)> {
    let PlanConstraints { allowed, cost, semantics, max_clauses: max_clause_count } = plans;
    let potential = cost.as_ref().and_then(|cost| cost.bounds.projections.first());
    let interference = Interference::new(context, semantics, potential).ok()?;
    let mut builder = Builder::new(context, allowed, max_clause_count).ok()?;
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

/// Adds the clauses of one step, except those for numbers, derived variables and costs.
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
