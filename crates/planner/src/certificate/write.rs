//! Derives a certificate from a ground task and an exhausted A\* search.

use std::hash::Hash;
use std::sync::Arc;

use ::task::context::Context;
use ::task::limits::{Interrupted, Limits};
use ::task::number::{Int, Rational};
use ::task::plan::solution::{Solution, Status};
use ::task::task::number::TaskNumber;
use ::task::task::quantity::NumericId;
use ::task::task::{self, Task};
use certificate::format::{
    ARGUMENT_FORMAT, Argument, Condition, Conditional, Exclusion, Integer, Label, Layer, Linear, Model, Need,
    Objective, Operator, Parameter, Potential, Quantity, TASK_FORMAT,
};
use num_traits::One;
use rustc_hash::FxHashMap;
use search::bounds::{Bounds, Projection};
use search::search::{Heuristic, closed_labels};

use crate::certificate::integer_scaling::{Scales, scaled, whole};
use crate::certificate::no_certificate::{NoCertificate, action_name};
use crate::exact::{ExactTask, RoundedBounds};

/// Certificate of optimality or of unsolvability, as two JSON documents.
#[derive(Debug, Clone)]
pub struct Certificate {
    /// The ground task.
    pub task: String,
    /// The argument that no plan is cheaper, or that no plan exists.
    pub argument: String,
}

impl Certificate {
    /// Returns the certificate without variables, numbers and operators if grounding has already found the goal
    /// unreachable, and `None` otherwise. Its argument needs only the goal, which is false.
    ///
    /// Grounding prunes such a task only partly: it may have variables and numbers that an action changes although it
    /// has no operator for the action.
    pub fn of_false_goal(&self) -> Option<Self> {
        let model: Model = serde_json::from_str(&self.task).ok()?;
        if !model.goal.clauses.iter().any(Vec::is_empty) {
            return None;
        }
        let reduced = Model {
            goal: Condition { clauses: vec![Vec::new()], ..Condition::default() },
            variables: Vec::new(),
            basic: 0,
            values: Vec::new(),
            numbers: Vec::new(),
            fluents: Vec::new(),
            slots: Vec::new(),
            uses: Vec::new(),
            exclusions: Vec::new(),
            tables: Vec::new(),
            operators: Vec::new(),
            axioms: Vec::new(),
            ..model
        };
        Some(written(&reduced, &Argument { format: ARGUMENT_FORMAT.into(), ..Argument::default() }))
    }
}

/// Creates the certificate of a solution.
///
/// # Errors
/// Returns the first reason in [`NoCertificate`] that applies.
pub fn certify(task: &Task, solution: &Solution, limits: &Limits) -> Result<Certificate, NoCertificate> {
    supported(task, solution)?;
    // The format has a single scale for all numbers.
    if !task.number_multiples.is_empty() {
        return Err(NoCertificate::Fraction { action: "an action".to_owned() });
    }
    let cost = solution.ground.as_ref().map(|plan| plan.cost);
    let context = Context::new(task, limits);
    let bounds = || -> Result<_, NoCertificate> {
        Ok((Bounds::of_projections(context).map_err(at_limit)?, Scales::one()))
    };
    certified(context, cost.as_ref(), &Scales::one(), bounds, |bounds| bounds)
}

/// Creates the certificate of a solution of a task in rationals, see [`certify`].
///
/// # Errors
/// Returns the first reason in [`NoCertificate`] that applies.
pub fn certify_exact(
    task: &ExactTask,
    solution: &Solution,
    limits: &Limits,
) -> Result<Certificate, NoCertificate> {
    let task = &task.0;
    supported(task, solution)?;
    let context = Context::new(task, limits);
    let metric = solution.plan.as_ref().map(|plan| Rational::from_big(plan.cost.to_rational()));
    let cost =
        metric.map(|metric| if task.objective.maximize { -metric } else { metric } - &task.objective.offset);
    let scales = Scales::of(task, &Rational::one())?;
    let bounds = || -> Result<_, NoCertificate> {
        let bounds = RoundedBounds::of_projections(context).map_err(at_limit)?;
        let scales = Scales::of(task, &bounds.unit)?;
        Ok((bounds, scales))
    };
    certified(context, cost.as_ref(), &scales, bounds, |rounded| &rounded.bounds)
}

fn at_limit(Interrupted: Interrupted) -> NoCertificate {
    NoCertificate::Limit
}

/// Returns an error if no certificate is possible for the status of the solution, or for the metric or costs of the
/// task.
fn supported<N: TaskNumber>(task: &Task<N>, solution: &Solution) -> Result<(), NoCertificate> {
    if !matches!(solution.status, Status::Optimal | Status::Unsolvable) {
        return Err(NoCertificate::Unproved);
    }
    if !task.others.is_empty() {
        return Err(NoCertificate::SeveralObjectives);
    }
    // The final values of these fluents are a part of the metric.
    let fluents = task.objective.rest.iter().map(|(fluent, _)| task.number_names[fluent.0 as usize].as_str());
    let fluents: Vec<&str> = fluents.collect();
    if !fluents.is_empty() {
        return Err(NoCertificate::StateDependentMetric { fluents: fluents.join(" and ") });
    }
    match task.operators.iter().find(|operator| operator.cost.minimum() < N::zero()) {
        Some(operator) => Err(NoCertificate::Improvement { action: action_name(task, operator) }),
        None => Ok(()),
    }
}

/// Writes the certificate of a solution with the ground cost `cost` (`None` for an unsolvable task). `bounds` computes
/// a heuristic and the scales of its numbers, and `plain` returns the integer bounds in it. `scales` is used if
/// grounding already proves that the task is unsolvable.
fn certified<N: TaskNumber, E: Heuristic<N>>(
    context: Context<'_, N>,
    cost: Option<&N>,
    scales: &Scales,
    bounds: impl FnOnce() -> Result<(E, Scales), NoCertificate>,
    plain: impl Fn(&E) -> &Bounds,
) -> Result<Certificate, NoCertificate> {
    let task = context.task;
    if task.unreachable.is_some() {
        let argument = Argument { format: ARGUMENT_FORMAT.into(), ..Argument::default() };
        return Ok(written(&model(task, scales), &argument));
    }
    let (bounds, scales) = bounds()?;
    let labels = closed_labels(context, &bounds, cost)?;
    let label = |(values, numbers, cost): (Vec<u32>, Vec<N>, N)| {
        Label(values, integers(&numbers, &scales.numbers), scaled(&cost, &scales.costs))
    };
    let table = |values: &[Option<Int>], scale: &Integer| {
        values.iter().map(|value| value.map(|value| scaled(&value, scale))).collect()
    };
    let pattern = |projection: &Projection| projection.pattern.iter().map(|variable| variable.0).collect();
    let potential = |projection: &Projection| Potential {
        pattern: pattern(projection),
        values: table(projection.costs(), &scales.bounds),
    };
    let need = |(number, projection, values): (NumericId, &Projection, &[Option<Int>])| Need {
        number: number.0,
        pattern: pattern(projection),
        values: table(values, &scales.numbers),
    };
    let argument = Argument {
        format: ARGUMENT_FORMAT.into(),
        potentials: plain(&bounds).projections.iter().map(potential).collect(),
        needs: plain(&bounds).needs().map(need).collect(),
        labels: labels.into_iter().map(label).collect(),
    };
    Ok(written(&model(task, &scales), &argument))
}

fn integers<N: TaskNumber>(numbers: &[N], scale: &Integer) -> Vec<Integer> {
    numbers.iter().map(|number| scaled(number, scale)).collect()
}

fn written(task: &Model, argument: &Argument) -> Certificate {
    let [task, argument] = [serde_json::to_string(task), serde_json::to_string(argument)]
        .map(|text| text.expect("invariant: both documents have string keys only"));
    Certificate { task, argument }
}

struct Pool<K, V> {
    positions: FxHashMap<K, u32>,
    all: Vec<V>,
}

impl<K: Hash + Eq + Clone, V> Pool<K, V> {
    fn new() -> Self {
        Self { positions: FxHashMap::default(), all: Vec::new() }
    }

    #[expect(clippy::cast_possible_truncation, reason = "entries are held in memory")]
    fn position(&mut self, key: &K, value: impl FnOnce(&K) -> V) -> u32 {
        if let Some(position) = self.positions.get(key) {
            return *position;
        }
        let position = self.all.len() as u32;
        self.all.push(value(key));
        self.positions.insert(key.clone(), position);
        position
    }
}

/// Slots of an operator (parameters whose designs are not grounded), with the suitable designs of
/// each slot.
type Uses = Vec<(u32, Vec<u32>)>;

struct Writer<'w, N> {
    scales: &'w Scales,
    tables: Pool<(Arc<[N]>, Integer), Vec<Integer>>,
    uses: Pool<Arc<[task::SlotUse]>, Uses>,
    exclusions: Pool<Arc<[task::ForbiddenCombinations]>, Vec<Exclusion>>,
}

fn model<N: TaskNumber>(task: &Task<N>, scales: &Scales) -> Model {
    let mut writer = Writer { scales, tables: Pool::new(), uses: Pool::new(), exclusions: Pool::new() };
    let operators = task.operators.iter().map(|operator| writer.operator(operator)).collect();
    let axioms = task
        .axioms
        .iter()
        .map(|layer| Layer {
            rules: layer.rules.iter().map(|rule| (fact(rule.head), writer.condition(&rule.body))).collect(),
            recursive: layer.recursive,
        })
        .collect();
    let mut goal = writer.condition(&task.goal);
    if task.unreachable.is_some() {
        goal.clauses.push(Vec::new());
    }
    Model {
        format: TASK_FORMAT.into(),
        objects: task.object_names.clone(),
        schemas: task.schema_names.clone(),
        variables: task.variables.iter().map(|variable| variable.values.clone()).collect(),
        basic: task.basic,
        values: task.initial.values.clone(),
        numbers: integers(&task.initial.numbers, &scales.numbers),
        fluents: task.number_names.clone(),
        number_scale: &Integer::from(task.number_scale) * &scales.numbers,
        slots: task.slots.iter().map(|slot| slot.designs.iter().map(|design| design.0).collect()).collect(),
        uses: writer.uses.all,
        exclusions: writer.exclusions.all,
        tables: writer.tables.all,
        operators,
        axioms,
        goal,
        objective: Objective {
            scale: &Integer::from(task.objective.scale) * &scales.costs,
            offset: scaled(&task.objective.offset, &scales.costs),
            maximize: task.objective.maximize,
        },
        time_scale: &Integer::from(task.time_scale) * &scales.times,
    }
}

fn fact(fact: task::Fact) -> (u32, u32) {
    (fact.variable.0, fact.value)
}

fn literal(literal: &task::Literal) -> ((u32, u32), bool) {
    (fact(literal.fact), literal.positive)
}

impl<N: TaskNumber> Writer<'_, N> {
    fn operator(&mut self, operator: &task::Operator<N>) -> Operator {
        let scales = self.scales;
        let exclusion = |rule: &task::ForbiddenCombinations| Exclusion {
            slots: rule.slots.to_vec(),
            combinations: rule.combinations.iter().map(|combination| combination.to_vec()).collect(),
        };
        let parameter = |argument: &task::Argument| match argument {
            task::Argument::Object(object) => Parameter::Object(object.0),
            task::Argument::Slot(slot) => Parameter::Slot(*slot),
        };
        let conditional = |effect: &task::ConditionalEffect| Conditional {
            condition: effect.condition.iter().map(literal).collect(),
            effects: effect.effects.iter().copied().map(fact).collect(),
        };
        Operator {
            schema: operator.schema,
            arguments: operator.arguments.iter().map(parameter).collect(),
            uses: self.uses.position(&operator.slots, |uses| {
                uses.iter().map(|usage| (usage.slot.0, usage.designs.clone())).collect()
            }),
            exclusions: self
                .exclusions
                .position(&operator.forbidden, |rules| rules.iter().map(exclusion).collect()),
            condition: self.condition(&operator.condition),
            effects: operator.effects.iter().copied().map(fact).collect(),
            conditional: operator.conditional.iter().map(conditional).collect(),
            changes: operator
                .numeric_effects
                .iter()
                .map(|effect| (effect.variable.0, self.linear(&effect.value, &Integer::from(1))))
                .collect(),
            cost: self.quantity(&operator.cost, &scales.costs),
            duration: self.quantity(&operator.duration, &scales.times),
            wait: operator.wait.as_ref().map(|time| scaled(time, &scales.times)),
        }
    }

    fn condition(&mut self, condition: &task::Condition<N>) -> Condition {
        let mut comparisons: Vec<Linear> =
            condition.comparisons.iter().map(|linear| self.linear(linear, &whole(linear))).collect();
        for linear in &condition.above {
            let mut strict = self.linear(linear, &whole(linear));
            // For integers, x > 0 is equivalent to x ≥ 1.
            strict.quantity.constant = &strict.quantity.constant - &Integer::from(1);
            comparisons.push(strict);
        }
        Condition {
            facts: condition.facts.iter().copied().map(fact).collect(),
            clauses: condition.clauses.iter().map(|clause| clause.iter().map(literal).collect()).collect(),
            comparisons,
        }
    }

    fn linear(&mut self, linear: &task::quantity::Linear<N>, factor: &Integer) -> Linear {
        let factors = linear.coefficients.iter();
        let scale = &self.scales.numbers * factor;
        Linear {
            factors: factors.map(|(number, coefficient)| (number.0, scaled(coefficient, factor))).collect(),
            quantity: self.quantity(&linear.quantity, &scale),
        }
    }

    fn quantity(&mut self, quantity: &task::quantity::Quantity<N>, scale: &Integer) -> Quantity {
        let tables = quantity.tables.iter().map(|table| {
            let key = (table.values.clone(), scale.clone());
            (table.slots.to_vec(), self.tables.position(&key, |(values, scale)| integers(values, scale)))
        });
        Quantity { tables: tables.collect(), constant: scaled(&quantity.constant, scale) }
    }
}
