//! Last grounding stage: converts atoms to finite-domain variables, and rationals to the number type of the
//! task (usually integers).

mod conditions;
mod integers;
mod mutex_groups;
mod numbers;
mod slots;
mod variables;

use std::hash::BuildHasher;

use rustc_hash::{FxBuildHasher, FxHashMap};
use smallvec::SmallVec;

use crate::error::{Error, File, Place};
use crate::ground::config::Generality;
use crate::ground::finalize::conditions::{axioms, condition, contradictory};
use crate::ground::finalize::integers::{Denominator, Integers};
use crate::ground::finalize::numbers::Numbers;
use crate::ground::finalize::slots::Slots;
use crate::ground::finalize::variables::Atoms;
use crate::ground::vocabulary::operator::GroundOperator;
use crate::ground::vocabulary::task::GroundTask;
use crate::lifted::Lifted;
use crate::number::dense;
use crate::task::number::TaskNumber;
use crate::task::quantity::Quantity;
use crate::task::timing::Timing;
use crate::task::{Condition, Objective, Operator, State, Task};

/// Converts the ground task over atoms to the final task over finite-domain variables. `unreachable` is the reason why
/// no plan exists, if known.
pub fn finish<N: TaskNumber>(
    mut task: GroundTask<'_>,
    unreachable: Option<String>,
    generality: &Generality,
) -> Result<Task<N>, Error> {
    let (lifted, limits) = (task.world.lifted, task.world.limits);
    let atoms = Atoms::new(&task)?;
    let mut numbers = Numbers::<N>::new(&task, generality)?;
    let (mut objectives, mut costs) = objectives::<N>(&task, &numbers)?;
    if generality.omits_durations {
        task.operators.iter_mut().for_each(|operator| operator.duration = Quantity::default());
    }
    let mut durations = Denominator::new("durations");
    for operator in limits.watch(&task.operators) {
        let operator = operator?;
        durations.quantity(&operator.duration);
        durations.note(|| schema_name(lifted, operator));
        let bounds = [&operator.timing.start, &operator.timing.end].into_iter().flatten();
        operator.wait.iter().chain(bounds.map(|(time, _)| time)).for_each(|time| durations.number(time));
    }
    let mut durations = durations.integers::<N>()?;
    let mut slots = Slots::new(&task.operators);

    let mut operators = Distinct::with_capacity(task.operators.len());
    for ground in limits.watch(std::mem::take(&mut task.operators)) {
        let ground = ground?;
        let (name, place) = schema_name(lifted, &ground);
        let kinds = (&mut numbers, &mut costs[..], &mut durations);
        let finished =
            operator(ground, &atoms, &mut slots, kinds).map_err(|error| error.within(&name, place))?;
        if let Some(operator) = finished {
            operators.insert(operator);
        }
    }
    let goal = match &task.goal {
        Some(goal) => condition(goal, &atoms, &mut numbers)?,
        None => Condition::default(),
    };
    let exclusive =
        || contradictory(&goal).then(|| "the goal requires atoms that exclude each other".to_owned());
    let unreachable = unreachable.or_else(exclusive);
    let axioms = axioms(&task.axioms, &atoms, &mut numbers, limits)?;
    let mut task = Task {
        object_names: lifted.objects.iter().map(ToString::to_string).collect(),
        schema_names: lifted.schemas.iter().map(|schema| schema.name.to_string()).collect(),
        basic: atoms.basic,
        variables: atoms.variables,
        exclusive: atoms.exclusive,
        number_names: std::mem::take(&mut numbers.names),
        number_scale: numbers.integers.scale,
        number_multiples: numbers.multiples(),
        axioms,
        initial: State { values: atoms.initial, numbers: std::mem::take(&mut numbers.initial) },
        slots: slots.all,
        operators: operators.operators,
        goal,
        objective: objectives.remove(0),
        others: objectives,
        time_scale: durations.scale,
        unreachable,
    };
    // The rules determine the initial values of the derived variables.
    let mut initial = std::mem::replace(&mut task.initial, State { values: Vec::new(), numbers: Vec::new() });
    task.evaluate_axioms(&mut initial);
    task.initial = initial;
    Ok(task)
}

/// Converts a ground operator. Returns `None` if its condition requires two values of one variable. The tuple
/// holds the conversions of numeric fluents, of the costs of each objective, and of durations.
fn operator<N: TaskNumber>(
    ground: GroundOperator,
    atoms: &Atoms,
    slots: &mut Slots,
    (numbers, costs, durations): (&mut Numbers<N>, &mut [Integers<N>], &mut Integers<N>),
) -> Result<Option<Operator<N>>, Error> {
    let condition = condition(&ground.condition, atoms, numbers)?;
    if contradictory(&condition) {
        return Ok(None);
    }
    let by_objective = ground.costs.iter().zip(costs);
    let mut by_objective = by_objective.map(|(cost, integers)| integers.quantity(cost));
    Ok(Some(Operator {
        schema: ground.schema,
        slots: slots.uses(&ground.slots),
        condition,
        effects: atoms.effects(&ground),
        conditional: atoms.conditional(&ground),
        numeric_effects: numbers.effects(&ground)?,
        cost: by_objective.next().unwrap_or_else(|| Ok(Quantity::constant(N::one())))?,
        others: by_objective.collect::<Result<_, _>>()?,
        duration: durations.quantity(&ground.duration)?,
        arguments: ground.arguments,
        configuration: ground.configuration,
        forbidden: ground.forbidden,
        wait: ground.wait.map(|time| durations.number(&time)).transpose()?,
        timing: Timing {
            start: ground.timing.start.map(|(time, _)| durations.number(&time)).transpose()?,
            end: ground.timing.end.map(|(time, _)| durations.number(&time)).transpose()?,
        },
    }))
}

fn schema_name(lifted: &Lifted, operator: &GroundOperator) -> (String, Option<Place>) {
    let schema = lifted.schemas.get(operator.schema as usize);
    let named = schema.map(|schema| (format!("`{}`", schema.name), Some(schema.place)));
    named.unwrap_or_else(|| ("a wait".to_owned(), None))
}

struct Distinct<N> {
    operators: Vec<Operator<N>>,
    positions: FxHashMap<u64, SmallVec<[u32; 2]>>,
}

impl<N: TaskNumber> Distinct<N> {
    fn with_capacity(capacity: usize) -> Self {
        let mut positions = FxHashMap::default();
        positions.reserve(capacity);
        Self { operators: Vec::with_capacity(capacity), positions }
    }

    fn insert(&mut self, operator: Operator<N>) {
        let positions = self.positions.entry(FxBuildHasher.hash_one(&operator)).or_default();
        if positions.iter().all(|position| self.operators[*position as usize] != operator) {
            positions.push(dense(self.operators.len()));
            self.operators.push(operator);
        }
    }
}

#[expect(clippy::type_complexity, reason = "a list for each of two things")]
fn objectives<N: TaskNumber>(
    task: &GroundTask<'_>,
    numbers: &Numbers<N>,
) -> Result<(Vec<Objective<N>>, Vec<Integers<N>>), Error> {
    let (mut objectives, mut conversions) = (Vec::new(), Vec::new());
    for (objective, position) in task.objectives.iter().zip(0..) {
        let place = task.world.lifted.metrics.get(position).map(|metric| metric.place);
        let mut denominator = match place {
            Some(place @ Place { file: File::Objective(_), .. }) => Denominator::of_objective(place),
            _ => Denominator::new("the metric"),
        };
        let at_start = || ("its value at the start".to_owned(), place);
        denominator.number(&objective.offset);
        denominator.note(at_start);
        for operator in &task.operators {
            denominator.quantity(&operator.costs[position]);
            denominator.note(|| schema_name(task.world.lifted, operator));
        }
        let integers = denominator.integers()?;
        let offset = integers.number(&objective.offset).map_err(|error| {
            let (name, place) = at_start();
            error.within(&name, place)
        })?;
        let remaining = numbers.rest(&objective.rest);
        objectives.push(Objective {
            scale: integers.scale,
            offset,
            maximize: objective.maximize,
            rest: remaining,
        });
        conversions.push(integers);
    }
    Ok((objectives, conversions))
}
