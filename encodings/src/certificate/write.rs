//! A ground task and a search that has ended to a certificate.

use std::hash::Hash;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::bounds::Bounds;
use crate::certificate::argument::{Argument, Label, Need, Potential};
use crate::certificate::integer::Integer;
use crate::certificate::model::{
    Argument as Parameter, Condition, Conditional, Exclusion, Layer, Linear, Model, Objective, Operator,
    Quantity,
};
use crate::limits::Limits;
use crate::number::Int;
use crate::search::closed_labels;
use crate::solution::{Solution, Status};
use crate::task::{self, Task};

pub(super) const TASK_FORMAT: &str = "metaplan-task/1";
pub(super) const ARGUMENT_FORMAT: &str = "metaplan-argument/1";

/// A certificate of an optimal plan, or of there being none: two JSON documents.
#[derive(Debug, Clone)]
pub struct Certificate {
    /// The ground task.
    pub task: String,
    /// Why no plan is cheaper.
    pub argument: String,
}

/// Makes the certificate of a solution. Nothing if the solution is not proved for plans of any length, if the task has several
/// objectives or one that plans improve without bound, or if the search does not end within the limits.
pub fn certify(task: &Task, solution: &Solution, limits: &Limits) -> Option<Certificate> {
    if !matches!(solution.status, Status::Optimal | Status::Unsolvable)
        || !task.others.is_empty()
        || task.operators.iter().any(|operator| operator.cost.minimum() < 0)
    {
        return None;
    }
    if task.unreachable.is_some() {
        let argument = Argument { format: ARGUMENT_FORMAT.into(), ..Argument::default() };
        return written(&model(task), &argument);
    }
    let bounds = Bounds::of_projections(task, limits).ok()?;
    let cost = solution.ground.as_ref().map(|plan| plan.cost);
    let labels = closed_labels(task, &bounds, limits, cost)?;
    let label =
        |(values, numbers, cost): (Vec<u32>, Vec<Int>, Int)| Label(values, integers(&numbers), cost.into());
    let potential = |projection: &crate::bounds::Projection| Potential {
        pattern: projection.pattern.iter().map(|variable| variable.0).collect(),
        values: bounds_of(projection.costs()),
    };
    let argument = Argument {
        format: ARGUMENT_FORMAT.into(),
        potentials: bounds.projections.iter().map(potential).collect(),
        needs: bounds
            .needs()
            .map(|(number, projection, values)| Need {
                number: number.0,
                pattern: projection.pattern.iter().map(|variable| variable.0).collect(),
                values: bounds_of(values),
            })
            .collect(),
        labels: labels.into_iter().map(label).collect(),
    };
    written(&model(task), &argument)
}

fn integers(numbers: &[Int]) -> Vec<Integer> {
    numbers.iter().copied().map(Integer::from).collect()
}

fn bounds_of(values: &[Option<Int>]) -> Vec<Option<Integer>> {
    values.iter().map(|value| value.map(Integer::from)).collect()
}

fn written(task: &Model, argument: &Argument) -> Option<Certificate> {
    let task = serde_json::to_string(task).ok()?;
    Some(Certificate { task, argument: serde_json::to_string(argument).ok()? })
}

/// Lists things once.
struct Pool<K, V> {
    positions: FxHashMap<K, u32>,
    all: Vec<V>,
}

impl<K: Hash + Eq + Clone, V> Pool<K, V> {
    fn new() -> Self {
        Self { positions: FxHashMap::default(), all: Vec::new() }
    }

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

/// Slots, each with the designs that suit.
type Uses = Vec<(u32, Vec<u32>)>;

struct Writer {
    tables: Pool<Arc<[Int]>, Vec<Integer>>,
    uses: Pool<Arc<[task::SlotUse]>, Uses>,
    exclusions: Pool<Arc<[task::Forbidden]>, Vec<Exclusion>>,
}

fn model(task: &Task) -> Model {
    let mut writer = Writer { tables: Pool::new(), uses: Pool::new(), exclusions: Pool::new() };
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
        numbers: integers(&task.initial.numbers),
        fluents: task.number_names.clone(),
        number_scale: task.number_scale.into(),
        slots: task.slots.iter().map(|slot| slot.designs.iter().map(|design| design.0).collect()).collect(),
        uses: writer.uses.all,
        exclusions: writer.exclusions.all,
        tables: writer.tables.all,
        operators,
        axioms,
        goal,
        objective: Objective {
            scale: task.objective.scale.into(),
            offset: task.objective.offset.into(),
            maximize: task.objective.maximize,
        },
        time_scale: task.time_scale.into(),
    }
}

fn fact(fact: task::Fact) -> (u32, u32) {
    (fact.variable.0, fact.value)
}

fn literal(literal: &task::Literal) -> ((u32, u32), bool) {
    (fact(literal.fact), literal.positive)
}

impl Writer {
    fn operator(&mut self, operator: &task::Operator) -> Operator {
        let exclusion = |rule: &task::Forbidden| Exclusion {
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
                uses.iter().map(|own| (own.slot.0, own.designs.clone())).collect()
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
                .map(|effect| (effect.variable.0, self.linear(&effect.value)))
                .collect(),
            cost: self.quantity(&operator.cost),
            duration: self.quantity(&operator.duration),
            wait: operator.wait.map(Integer::from),
        }
    }

    fn condition(&mut self, condition: &task::Condition) -> Condition {
        Condition {
            facts: condition.facts.iter().copied().map(fact).collect(),
            clauses: condition.clauses.iter().map(|clause| clause.iter().map(literal).collect()).collect(),
            comparisons: condition.comparisons.iter().map(|linear| self.linear(linear)).collect(),
        }
    }

    fn linear(&mut self, linear: &crate::quantity::Linear<Int>) -> Linear {
        Linear {
            factors: linear
                .coefficients
                .iter()
                .map(|(number, factor)| (number.0, Integer::from(*factor)))
                .collect(),
            quantity: self.quantity(&linear.quantity),
        }
    }

    fn quantity(&mut self, quantity: &crate::quantity::Quantity<Int>) -> Quantity {
        let tables = quantity.tables.iter();
        Quantity {
            constant: quantity.constant.into(),
            tables: tables
                .map(|table| {
                    (table.slots.to_vec(), self.tables.position(&table.values, |values| integers(values)))
                })
                .collect(),
        }
    }
}
