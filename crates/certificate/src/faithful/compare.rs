//! Compares the PDDL files with the ground task: the initial state, the goal, and the rules of
//! derived predicates. Each case (outcome under a condition) of each action instance must be
//! simulated by an operator, or leave the task state unchanged.

use std::collections::BTreeSet;

use num_rational::BigRational;
use num_traits::{One, Zero};
use rustc_hash::FxHashMap;

use crate::faithful::case::Case;
use crate::faithful::effects::{self, Made, Mismatch};
use crate::faithful::formula::{Formula, Known};
use crate::faithful::key::{Key, PHASE};
use crate::faithful::length::Length;
use crate::faithful::linear::Linear;
use crate::faithful::reader::{Reader, TOTAL_TIME};
use crate::faithful::timeline::{self, stands_for};
use crate::faithful::translation::Translation;
use crate::faithful::verdict::{Cause, Difference, Obstacle};
use crate::model::{Argument, Operator};
use pddl::ast::{Action, Direction};

type Result<T> = std::result::Result<T, Obstacle>;

/// Upper limit on the number of partial states that are examined for one condition ([`Comparison::follows`]) or
/// for one case of an action instance ([`Comparison::find`]). A case split replaces a partial state by several.
const SPLIT_LIMIT: usize = 256;

/// Positions of operators by action name and arguments; an argument is `None` if it is a slot.
type Calls = FxHashMap<(String, Vec<Option<u32>>), Vec<usize>>;

pub(super) struct Comparison<'c> {
    pub(super) task: &'c Translation<'c>,
    objects: FxHashMap<String, u32>,
    operators: Calls,
    waits: Vec<usize>,
    /// For each action, the sets of parameters that are slots in an operator (`true` for a slot).
    masks: FxHashMap<String, BTreeSet<Vec<bool>>>,
    /// The metric, to be minimised; `None` if plans are measured by time or by length.
    metric: Option<Linear>,
    timed: bool,
    /// If there are timed events, a common divisor of all their times and of all durations. Otherwise 1, which
    /// is not used.
    unit: BigRational,
}

struct Instance<'i> {
    name: &'i dyn Fn() -> String,
    cost: BigRational,
}

impl<'c> Comparison<'c> {
    /// Indexes the operators of the task. Without a metric, plans are measured by time if `timed`, otherwise
    /// by length. Times of events and durations are multiples of `unit`.
    pub(super) fn new(task: &'c Translation<'c>, timed: bool, unit: BigRational) -> Result<Self> {
        let model = task.model;
        let folded = |name: &String| name.to_ascii_lowercase();
        let mut objects = FxHashMap::default();
        for (number, name) in (0..).zip(&model.objects) {
            if objects.insert(folded(name), number).is_some() {
                return Err(Difference::Form { reason: format!("{name} is two objects") }.into());
            }
        }
        let mut operators: Calls = FxHashMap::default();
        let mut waits = Vec::new();
        let mut masks: FxHashMap<_, BTreeSet<Vec<bool>>> = FxHashMap::default();
        for (position, operator) in model.operators.iter().enumerate() {
            if operator.wait.is_some() {
                waits.push(position);
                continue;
            }
            let Some(schema) = model.schemas.get(operator.schema as usize).map(folded) else {
                return Err(Difference::Form { reason: "an operator of no action".into() }.into());
            };
            let object = |argument: &Argument| match argument {
                Argument::Object(object) => Some(*object),
                Argument::Slot(_) => None,
            };
            let arguments: Vec<Option<u32>> = operator.arguments.iter().map(object).collect();
            let mask = arguments.iter().map(Option::is_none).collect();
            masks.entry(schema.clone()).or_default().insert(mask);
            operators.entry((schema, arguments)).or_default().push(position);
        }
        let metric = match &task.world.problem.metric {
            Some(metric) => {
                let mut reader = Reader::new(task.world, task.invariant, task.axioms);
                reader.is_metric = true;
                let value = reader.expression(&metric.expression)?;
                let value = value.ok_or_else(|| Cause::unsupported("a metric without a value"))?;
                Some(if metric.direction == Direction::Maximize { value.negated() } else { value })
            }
            None => None,
        };
        let direction = task.world.problem.metric.as_ref().map(|metric| metric.direction);
        if model.objective.maximize != (direction == Some(Direction::Maximize)) {
            return Err(Difference::Initial { what: "the metric".into() }.into());
        }
        Ok(Self { task, objects, operators, waits, masks, metric, timed, unit })
    }

    fn initial_value(&self, key: &Key) -> Result<BigRational> {
        let world = self.task.world;
        match world.initial_value(key) {
            Some(value) => Ok(value.clone()),
            None if *key == TOTAL_TIME => Ok(BigRational::zero()),
            None => {
                let reason = format!("{}, which has no value at first", world.show(key));
                Err(Cause::unsupported(reason).into())
            }
        }
    }

    pub(super) fn initial(&self) -> Result<()> {
        let (model, names) = (self.task.model, self.task.names);
        for variable in model.basic_variables() {
            let atoms = &model.variables[variable as usize];
            let holding: Vec<u32> = names
                .atoms(variable)
                .filter(|(_, key)| self.task.world.holds_initially(key))
                .map(|(value, _)| value)
                .collect();
            let expected = match holding[..] {
                [] => model.none(variable),
                [value] => value,
                _ => u32::MAX,
            };
            if model.values[variable as usize] != expected {
                return Err(Difference::Initial { what: atoms.join(" or ") }.into());
            }
        }
        for (key, number) in names.fluents.iter().zip(&model.numbers) {
            if number.to_rational() != self.initial_value(key)? * model.number_scale.to_rational() {
                return Err(Difference::Initial { what: self.task.world.show(key) }.into());
            }
        }
        let mut offset = BigRational::zero();
        if let Some(metric) = &self.metric {
            offset += &metric.constant;
            for (key, factor) in &metric.factors {
                offset += factor * self.initial_value(key)?;
            }
        }
        if model.objective.offset.to_rational() != offset * model.objective.scale.to_rational() {
            return Err(Difference::Initial { what: "the metric".into() }.into());
        }
        Ok(())
    }

    /// Checks that the goal of the PDDL files implies the goal of the task.
    pub(super) fn goal(&self) -> Result<()> {
        let mut reader = Reader::new(self.task.world, self.task.invariant, self.task.axioms);
        let goal = reader.formula(&self.task.world.problem.goal, true);
        let goal = goal.map_err(|cause| cause.within("the goal"))?;
        let task_goal = self.task.condition(&self.task.model.goal, &[], &[]);
        // Plans need not end with a wait, so the goal is required only in states that do not follow
        // a wait.
        let not_waited = Formula::Atom(timeline::waited(), false);
        for known in Known::default()
            .assume(&self.task.names.structure, &Formula::junction([goal, not_waited], true))?
        {
            if !self.follows(known, &task_goal, &|_| true) {
                return Err(Difference::Goal.into());
            }
        }
        Ok(())
    }

    /// Checks for each derived atom of `Axioms::linked` that the rules of the task and of the PDDL
    /// files are equivalent. Other derived atoms are replaced by their rules.
    pub(super) fn rules(&self) -> Result<()> {
        let task = self.task;
        let mut linked: Vec<&Key> = task.axioms.linked.iter().collect();
        linked.sort_unstable();
        for key in linked {
            let Some((variable, _)) = task.names.fact(key) else { continue };
            let files = Reader::new(task.world, task.invariant, task.axioms).unfold(key)?;
            let rules = task.rules(variable);
            // A derivation must not depend on atoms that are derived later, so no case splits on
            // the truth value of derived atoms are made.
            let admits = |leaf: &Formula| match leaf {
                Formula::Atom(key, _) => task.world.rules(key.0).is_none(),
                _ => true,
            };
            for (left, right) in [(&files, &rules), (&rules, &files)] {
                for known in Known::default().assume(&task.names.structure, left)? {
                    if !self.follows(known, right, &admits) {
                        return Err(Difference::WrongRules { atom: task.world.show(key) }.into());
                    }
                }
            }
        }
        Ok(())
    }

    /// Returns `true` if `known` implies the condition `wanted`, by case splits on the leaves that `admits`
    /// accepts. `false` means refuted or not proved.
    fn follows(&self, known: Known, wanted: &Formula, admits: &dyn Fn(&Formula) -> bool) -> bool {
        let structure = &self.task.names.structure;
        let mut open = vec![known];
        for _ in 0..SPLIT_LIMIT {
            let Some(known) = open.pop() else { return true };
            match known.decide(structure, wanted) {
                Some(true) => {}
                Some(false) => return false,
                None => {
                    let Some(leaf) = known.open(structure, wanted, admits) else { return false };
                    let Ok(cases) = known.split(structure, std::iter::once(leaf)) else { return false };
                    open.extend(cases);
                }
            }
        }
        open.is_empty()
    }

    /// Checks that operators simulate a case. Returns `false` if no operator is needed, because the
    /// case does not change the task state and its cost is not negative.
    pub(super) fn case(&self, action: &Action, arguments: &[u32], case: &Case) -> Result<bool> {
        let name = || self.task.world.call(action, arguments);
        let instance = Instance { cost: self.cost(case)?, name: &name };
        if instance.cost >= BigRational::zero()
            && effects::compare(self.task, case, &case.known, None).is_ok()
        {
            return Ok(false);
        }
        self.find(&self.candidates(action, arguments), case, &instance).map(|()| true)
    }

    pub(super) fn wait(&self, case: &Case) -> Result<()> {
        let name = || {
            let phases = case.truths.iter().filter(|(key, holds)| key.0 == PHASE && **holds);
            let phases: Vec<String> = phases.map(|(key, _)| self.task.world.show(key)).collect();
            format!("the wait until {}", phases.join(", "))
        };
        let instance = Instance { cost: BigRational::zero(), name: &name };
        if effects::compare(self.task, case, &case.known, None).is_ok() {
            return Ok(());
        }
        let operators = self.waits.iter().map(|position| &self.task.model.operators[*position]);
        let waits: Vec<(&Operator, Vec<u32>)> = operators
            .filter(|operator| self.task.model.uses[operator.uses as usize].is_empty())
            .map(|operator| (operator, Vec::new()))
            .collect();
        self.find(&waits, case, &instance)
    }

    /// Checks that in every state in which the case can be executed, one of the candidate operators
    /// simulates it. Fails if this is not proved after [`SPLIT_LIMIT`] partial states.
    fn find(&self, candidates: &[(&Operator, Vec<u32>)], case: &Case, instance: &Instance<'_>) -> Result<()> {
        let structure = &self.task.names.structure;
        let conditions: Vec<Formula> = candidates
            .iter()
            .map(|(operator, choice)| {
                self.task.condition(&operator.condition, choice, &self.task.model.sizes(operator))
            })
            .collect();
        let mut open = vec![case.known.clone()];
        for _ in 0..SPLIT_LIMIT {
            let Some(known) = open.pop() else { return Ok(()) };
            let mut reason = Obstacle::from(Difference::NoOperatorFor { instance: String::new() });
            let mut done = false;
            for ((operator, choice), condition) in candidates.iter().zip(&conditions) {
                let result = match known.decide(structure, condition) {
                    Some(true) => self.simulates((operator, choice), case, &known, instance),
                    _ => Err(Difference::WrongCondition { instance: String::new() }.into()),
                };
                match result {
                    Ok(()) => {
                        done = true;
                        break;
                    }
                    // The error about the operator that matches best is reported.
                    Err(next) if rank(&next) >= rank(&reason) => reason = next,
                    Err(_) => {}
                }
            }
            if done {
                continue;
            }
            let leaf = conditions.iter().find_map(|condition| known.open(structure, condition, &|_| true));
            let Some(leaf) = leaf else { return Err(named(reason, &(instance.name)())) };
            open.extend(known.split(structure, std::iter::once(leaf))?);
        }
        if open.is_empty() {
            return Ok(());
        }
        Err(Cause::TooMany { what: format!("cases of {}", (instance.name)()), limit: SPLIT_LIMIT }.into())
    }

    fn simulates(
        &self,
        (operator, choice): (&Operator, &[u32]),
        case: &Case,
        known: &Known,
        instance: &Instance<'_>,
    ) -> Result<()> {
        let resolved = Made { operator, choice };
        let wrong_effect = |what| Difference::WrongEffect { instance: (instance.name)(), what };
        effects::compare(self.task, case, known, Some(resolved)).map_err(|mismatch| match mismatch {
            Mismatch::Differs(what) => Obstacle::from(wrong_effect(what)),
            Mismatch::Unknown(atoms) => Cause::Exclusion { instance: (instance.name)(), atoms }.into(),
        })?;
        if !self.keeps_time((operator, choice), case) {
            return Err(wrong_effect(self.task.world.show(&timeline::clock())).into());
        }
        let model = self.task.model;
        let cost = model.quantity(&operator.cost, choice, &model.sizes(operator));
        if cost.to_rational() > &instance.cost * model.objective.scale.to_rational() {
            let cost = instance.cost.to_string();
            return Err(Difference::WrongCost { instance: (instance.name)(), cost }.into());
        }
        Ok(())
    }

    /// Returns `true` if the clock of the task represents the time after the case. This holds if
    /// the task has no clock, or if the operator leaves it unchanged or advances it by the duration
    /// of the case. It also holds if the operator sets it to a value that represents every possible
    /// end time (see `timeline`).
    fn keeps_time(&self, (operator, choice): (&Operator, &[u32]), case: &Case) -> bool {
        let Some(number) = self.task.names.numbers.get(&timeline::clock()) else { return true };
        // An unchanged clock value represents the later time, too.
        let Some((_, value)) = operator.changes.iter().find(|(changed, _)| changed == number) else {
            return true;
        };
        let value = self.task.value(value, choice, &self.task.model.sizes(operator));
        let passed = value.clone().minus(&Linear::fluent(timeline::clock()));
        match (passed.value(), value.value()) {
            (Some(passed), _) => {
                let length = case.length.as_ref().and_then(Length::fixed);
                *passed == length.cloned().unwrap_or_default()
            }
            (None, Some(set)) => stands_for(set, &case.passage.end, &self.unit),
            (None, None) => false,
        }
    }

    /// Returns the minimal increase of the metric by a case. Without a metric, returns the minimal
    /// duration if plans are measured by time, otherwise 1. Fails if the increase depends on the
    /// state or has no minimum.
    fn cost(&self, case: &Case) -> Result<BigRational> {
        let one = BigRational::one();
        let time = |factor: &BigRational| match &case.length {
            Some(length) => length.least_times(factor),
            None => Ok(BigRational::zero()),
        };
        let Some(metric) = &self.metric else {
            return Ok(if self.timed { time(&one)? } else { one });
        };
        let mut sum = Linear::constant(BigRational::zero());
        for (key, factor) in &metric.factors {
            if *key == TOTAL_TIME {
                sum.constant += time(factor)?;
            } else if let Some(after) = case.changes.get(key) {
                let growth = after.clone().minus(&Linear::fluent(key.clone()));
                sum = sum.plus(&growth, factor);
            }
        }
        match self.task.invariant.settled(&sum).value() {
            Some(cost) => Ok(cost.clone()),
            None => Err(Cause::unsupported("costs that depend on the state").into()),
        }
    }

    fn candidates(&self, action: &Action, arguments: &[u32]) -> Vec<(&'c Operator, Vec<u32>)> {
        let name = action.identifier.name.as_str().to_ascii_lowercase();
        let world = self.task.world;
        let object = |object: &u32| self.objects.get(&world.name(*object).to_ascii_lowercase()).copied();
        let Some(objects) = arguments.iter().map(object).collect::<Option<Vec<u32>>>() else {
            return Vec::new();
        };
        let mut candidates = Vec::new();
        for mask in self.masks.get(&name).into_iter().flatten().filter(|mask| mask.len() == objects.len()) {
            let pattern = objects.iter().zip(mask).map(|(object, open)| (!open).then_some(*object)).collect();
            for position in self.operators.get(&(name.clone(), pattern)).into_iter().flatten() {
                let operator = &self.task.model.operators[*position];
                candidates.extend(self.choice(operator, &objects).map(|choice| (operator, choice)));
            }
        }
        candidates
    }

    /// Finds the designs with which the arguments of an operator are `objects`. A design is given by its
    /// position in the list of suitable designs of its slot. Returns `None` if there are no such designs, if a
    /// slot occurs in no argument, or if the combination is excluded.
    fn choice(&self, operator: &Operator, objects: &[u32]) -> Option<Vec<u32>> {
        let model = self.task.model;
        let uses = &model.uses[operator.uses as usize];
        let mut choice: Vec<Option<u32>> = vec![None; uses.len()];
        for (argument, object) in operator.arguments.iter().zip(objects) {
            let Argument::Slot(place) = argument else { continue };
            let (slot, designs) = uses.get(*place as usize)?;
            let objects_of_slot = &model.slots[*slot as usize];
            let position = designs.iter().position(|design| objects_of_slot[*design as usize] == *object)?;
            let position = u32::try_from(position).ok()?;
            let entry = &mut choice[*place as usize];
            if entry.is_some_and(|earlier| earlier != position) {
                return None;
            }
            *entry = Some(position);
        }
        let choice: Vec<u32> = choice.into_iter().collect::<Option<_>>()?;
        let excluded = model.exclusions[operator.exclusions as usize].iter().any(|exclusion| {
            let chosen: Vec<u32> = exclusion.slots.iter().map(|slot| choice[*slot as usize]).collect();
            exclusion.combinations.contains(&chosen)
        });
        (!excluded).then_some(choice)
    }
}

/// Ranks a reason for rejecting an operator: the more of the operator matches, the higher.
fn rank(reason: &Obstacle) -> u8 {
    match reason {
        Obstacle::Differs(Difference::NoOperatorFor { .. }) => 0,
        Obstacle::Differs(Difference::WrongCondition { .. }) => 1,
        Obstacle::Differs(_) => 2,
        Obstacle::Open(_) => 3,
    }
}

fn named(reason: Obstacle, instance: &str) -> Obstacle {
    let instance = instance.to_owned();
    match reason {
        Obstacle::Differs(Difference::NoOperatorFor { .. }) => Difference::NoOperatorFor { instance }.into(),
        Obstacle::Differs(Difference::WrongCondition { .. }) => {
            Difference::WrongCondition { instance }.into()
        }
        reason => reason,
    }
}
