//! Plans with PDDL names: actions with their arguments and designs.

use std::borrow::Cow;
use std::str::FromStr;

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{ToPrimitive, Zero};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::compile::is_hidden;
use crate::context::Context;
use crate::lifted::ObjectId;
use crate::number::{Int, Rational};
use crate::plan::ground::{GroundPlan, state_dependent_cost};
use crate::plan::reschedule::{earliest, starts};
use crate::task::number::TaskNumber;
use crate::task::{Argument, Objective, Operator, OperatorId, Task};
use pddl::to_decimal;

/// An exact number of arbitrary size, in the units of the PDDL files.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Exact(Rational);

impl Exact {
    /// Converts a number of a ground task to the unit of the PDDL files. `scale` is the number in the task that
    /// represents 1 in the PDDL files.
    pub fn scaled<N: TaskNumber>(value: &N, scale: Int) -> Self {
        Self(value.to_rational() / Rational::from_integer(scale))
    }

    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self(self.0.clone() + &other.0)
    }

    /// Returns the numerator of the reduced fraction.
    pub fn numerator(&self) -> BigInt {
        self.0.to_big().numer().clone()
    }

    /// Returns the denominator of the reduced fraction, which is positive.
    pub fn denominator(&self) -> BigInt {
        self.0.to_big().denom().clone()
    }

    /// Returns `true` if the number is 0.
    pub fn is_zero(&self) -> bool {
        self.0.is_zero()
    }

    /// Converts the number to a rational.
    pub fn to_rational(&self) -> BigRational {
        self.0.to_big()
    }

    /// Returns the nearest 64-bit floating-point number.
    pub fn to_f64(&self) -> f64 {
        self.to_rational().to_f64().unwrap_or(f64::NAN)
    }
}

impl From<BigRational> for Exact {
    fn from(number: BigRational) -> Self {
        Self(Rational::from_big(number))
    }
}

/// Parses an integer, a decimal or a fraction: `3`, `2.5`, `-7/3`.
impl FromStr for Exact {
    type Err = NotANumber;

    fn from_str(text: &str) -> Result<Self, NotANumber> {
        let wrong = || NotANumber(text.to_owned());
        let digits = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
        let unsigned = text.strip_prefix('-').unwrap_or(text);
        let number = match (unsigned.split_once('/'), unsigned.split_once('.')) {
            (Some((numerator, denominator)), _) if digits(numerator) && digits(denominator) => {
                let denominator: BigInt = denominator.parse().map_err(|_| wrong())?;
                if denominator.is_zero() {
                    return Err(wrong());
                }
                BigRational::new(numerator.parse().map_err(|_| wrong())?, denominator)
            }
            (None, Some((whole, decimals))) if digits(whole) && digits(decimals) => {
                let scale = num_traits::pow(BigInt::from(10), decimals.len());
                BigRational::new(format!("{whole}{decimals}").parse().map_err(|_| wrong())?, scale)
            }
            (None, None) if digits(unsigned) => {
                BigRational::from_integer(unsigned.parse().map_err(|_| wrong())?)
            }
            _ => return Err(wrong()),
        };
        Ok(Self::from(if text.starts_with('-') { -number } else { number }))
    }
}

/// Error: the text is not an integer, a decimal, or a fraction with a divisor other than 0.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a number: a decimal such as `2.5` or a fraction such as `7/3` would be one")]
pub struct NotANumber(String);

/// Serialises the number as a string such as `"2.5"` or `"7/3"`, because the numbers of most formats are
/// binary floating-point numbers.
impl Serialize for Exact {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Exact {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = <Cow<'_, str>>::deserialize(deserializer)?;
        text.parse().map_err(serde::de::Error::custom)
    }
}

/// Writes the number as a decimal if it has a finite decimal expansion, otherwise as a fraction.
impl std::fmt::Display for Exact {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let exact = self.to_rational();
        f.write_str(&to_decimal(&exact).unwrap_or_else(|| exact.to_string()))
    }
}

/// An action of a plan as displayed to users.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Step {
    /// Name of the action schema.
    pub action: String,
    /// Arguments in the order of the schema's parameters, including designs.
    pub arguments: Vec<String>,
    /// Functions with their chosen designs, in the order of the design parameters.
    pub configuration: Vec<(String, String)>,
    /// Functions whose design differs from the design in the previous step that uses the function.
    pub reconfigured: Vec<String>,
    /// Start time in the domain's time unit. In a sequential plan, there are gaps between actions only where the
    /// plan waits for timed initial literals.
    pub start: Exact,
    /// Duration in the domain's time unit; 0 for an instantaneous action.
    pub duration: Exact,
    /// Contribution of the action to the metric. In a concurrent plan, total time does not count.
    pub cost: Exact,
}

/// A plan as displayed to users.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Plan {
    /// Actions in order of execution.
    pub steps: Vec<Step>,
    /// Value of the plan under the metric of the problem file, or under the first objective if others replace
    /// the metric.
    pub cost: Exact,
}

/// Converts a plan to PDDL names and computes start times. Waits and auxiliary actions are omitted. Each
/// action starts as early as rescheduling within the limits can achieve.
pub fn decode<N: TaskNumber>(context: Context<'_, N>, plan: &GroundPlan<N>) -> Plan {
    let (task, plan) = (context.task, earliest(context, plan));
    let mut steps = Vec::new();
    let steps_of = plan.steps.iter().map(|step| (step.operator, &step.choice[..]));
    let (measured, rest) = measured(task, steps_of);
    let actions = plan.steps.iter().zip(measured);
    let actions = actions.filter(|(step, _)| task.operators[step.operator.index()].wait.is_none());
    for ((step, measured), start) in actions.zip(starts(task, &plan.steps)) {
        let operator = &task.operators[step.operator.index()];
        // Auxiliary actions of compiled constraints and preferences are not shown to users.
        if is_hidden(&task.schema_names[operator.schema as usize]) {
            continue;
        }
        let sizes = operator.sizes();
        let duration = operator.duration.at(&step.choice, &sizes).to_rational();
        let cost = operator.cost.at(&step.choice, &sizes).to_rational() + measured;
        let cost = task.objective.signed(&cost);
        steps.push(Step::new(task, operator, &step.choice, (start, duration, cost)));
    }
    let mut plan = Plan { steps, cost: metric(task, &(plan.cost.to_rational() + rest)) };
    plan.note_reconfigured();
    plan
}

/// Executes the steps from the initial state. Returns by how much each step changes the state-dependent part of the
/// metric, and the final value of this part. All numbers are in the task's cost unit and negated if the metric is
/// maximised. They are 0 if the metric has no such part.
pub fn measured<'s, N: TaskNumber>(
    task: &Task<N>,
    steps: impl Iterator<Item = (OperatorId, &'s [u32])>,
) -> (Vec<Rational>, Rational) {
    if task.objective.rest.is_empty() {
        return (steps.map(|_| Rational::zero()).collect(), Rational::zero());
    }
    let (mut state, mut added) = (task.initial.clone(), Vec::new());
    let mut before = state_dependent_cost(task, &state);
    for (operator, choice) in steps {
        // On overflow, the state does not change. A step may also be inapplicable if it is examined outside its
        // plan; its effects are then applied nevertheless.
        if let Some(next) = task.successor(&task.operators[operator.index()], &state, choice) {
            state = next;
        }
        let after = state_dependent_cost(task, &state);
        added.push(after.clone() - &before);
        before = after;
    }
    (added, before)
}

impl Plan {
    /// Returns the latest end time of an action, in the domain's time unit; 0 for an empty plan.
    pub fn makespan(&self) -> Exact {
        let ends = self.steps.iter().map(|step| step.start.0.clone() + &step.duration.0);
        Exact(ends.max().unwrap_or_default())
    }

    /// Recomputes the field `reconfigured` of each step.
    pub fn note_reconfigured(&mut self) {
        let mut current = Vec::new();
        for step in &mut self.steps {
            step.reconfigured.clear();
            step.note_reconfigured(&mut current);
        }
    }
}

impl Step {
    /// Converts an operator with chosen designs to a step with PDDL names. Start and duration are given in
    /// the task's time unit, the cost in the task's cost unit.
    pub fn new<N: TaskNumber>(
        task: &Task<N>,
        operator: &Operator<N>,
        choice: &[u32],
        (start, duration, cost): (Rational, Rational, Rational),
    ) -> Self {
        Self {
            action: task.schema_names[operator.schema as usize].clone(),
            arguments: arguments(task, operator, choice),
            configuration: configuration(task, operator, choice),
            reconfigured: Vec::new(),
            start: Exact::scaled(&start, task.time_scale),
            duration: Exact::scaled(&duration, task.time_scale),
            cost: Exact::scaled(&cost, task.objective.scale),
        }
    }

    /// Appends the functions whose design changes in this step to `reconfigured`. `current` holds the last design
    /// of each function before this step, and is updated.
    fn note_reconfigured(&mut self, current: &mut Vec<(String, String)>) {
        for (function, design) in &self.configuration {
            match current.iter_mut().find(|(name, _)| name == function) {
                Some((_, known)) if known == design => {}
                Some((_, known)) => {
                    known.clone_from(design);
                    self.reconfigured.push(function.clone());
                }
                None => current.push((function.clone(), design.clone())),
            }
        }
    }
}

/// Converts a sum of operator costs to the value of the problem's metric.
pub fn metric<N: TaskNumber>(task: &Task<N>, cost: &impl TaskNumber) -> Exact {
    task.objective.metric(cost)
}

impl<N: TaskNumber> Objective<N> {
    /// Converts a sum of operator costs to the value of the metric in the PDDL file.
    pub fn metric(&self, cost: &impl TaskNumber) -> Exact {
        Exact::scaled(&self.signed(&(cost.to_rational() + self.offset.to_rational())), self.scale)
    }

    fn signed(&self, cost: &impl TaskNumber) -> Rational {
        let cost = cost.to_rational();
        if self.maximize { -cost } else { cost }
    }
}

/// Returns the object of an operator's argument. If the argument is a slot, the object is the design that
/// `choice` selects.
pub fn resolve<N>(task: &Task<N>, operator: &Operator<N>, choice: &[u32], argument: Argument) -> ObjectId {
    match argument {
        Argument::Object(object) => object,
        Argument::Slot(position) => {
            let slot = &operator.slots[position as usize];
            let design = slot.designs[choice[position as usize] as usize];
            task.slots[slot.slot.index()].designs[design as usize]
        }
    }
}

fn argument<N>(task: &Task<N>, operator: &Operator<N>, choice: &[u32], argument: Argument) -> String {
    task.object_names[resolve(task, operator, choice, argument).index()].clone()
}

/// Returns the names of an operator's arguments, including the chosen designs.
pub fn arguments<N>(task: &Task<N>, operator: &Operator<N>, choice: &[u32]) -> Vec<String> {
    operator.arguments.iter().map(|a| argument(task, operator, choice, *a)).collect()
}

fn configuration<N>(task: &Task<N>, operator: &Operator<N>, choice: &[u32]) -> Vec<(String, String)> {
    let name = |function: ObjectId| task.object_names[function.index()].clone();
    let pairs = operator.configuration.iter();
    pairs.map(|(function, design)| (name(*function), argument(task, operator, choice, *design))).collect()
}
