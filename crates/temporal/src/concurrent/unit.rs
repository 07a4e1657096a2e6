//! Internal unit of time: small enough that all times of a task are integers.

use num_traits::ToPrimitive as _;
use rustc_hash::FxHashMap;
use task::error::Error;
use task::lifted::Rational;
use task::number::{Int, checked_lcm};
use task::task::quantity::NumericId;
use task::task::{OperatorId, Task};

use crate::concurrent::split::Split;

/// Upper limit on times and durations, in internal time units.
pub(super) const LIMIT: Int = 1 << 90;

/// Divisor of each state-dependent duration, by start operator: the duration is a number of the
/// task divided by this constant.
pub(super) type Divisors = FxHashMap<OperatorId, Rational>;

/// Number of internal time units per PDDL time unit. All times are integers in internal units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Unit(pub(super) Int);

impl Unit {
    /// Computes a unit in which all durations, the separation and the times of timed initial
    /// literals are integers.
    pub(super) fn new(
        task: &Task,
        split: &Split,
        separation: &Rational,
        divisors: &Divisors,
    ) -> Result<Self, Error> {
        let mut times = split.events.iter().map(|event| &event.time).chain([separation]);
        // State-dependent durations are numbers of the task, with its scale.
        let multiples =
            task.number_multiples.iter().try_fold(1, |common, multiple| checked_lcm(common, *multiple));
        let scale = multiples
            .and_then(|multiple| multiple.checked_mul(task.number_scale))
            .filter(|multiple| *multiple < LIMIT);
        let scale = scale.ok_or_else(|| Error::overflow("durations"))?;
        let numbers = if split.durations.is_empty() { 1 } else { scale };
        let divided = divisors.values().map(|divisor| divisor.to_big().numer().to_i128());
        let scale = divided.fold(checked_lcm(task.time_scale, numbers), |scale, divisor| {
            checked_lcm(scale?, numbers.checked_mul(divisor?)?).filter(|scale| *scale < LIMIT)
        });
        let scale = scale.ok_or_else(|| Error::overflow("durations"))?;
        let common = times.try_fold(scale, |scale, time| {
            checked_lcm(scale, time.denominator()?).filter(|scale| *scale < LIMIT)
        });
        common.map(Self).ok_or_else(|| Error::overflow("durations and times"))
    }

    pub(super) fn of(self, time: &Rational) -> Result<Int, Error> {
        let units = (time.clone() * &Rational::from_integer(self.0)).to_int();
        units.filter(|units| (-LIMIT..LIMIT).contains(units)).ok_or_else(|| Error::overflow("a time"))
    }

    /// Factor from the value of the number `timer`, divided by `divisor`, to a duration in internal
    /// time units.
    pub(super) fn factor(self, task: &Task, timer: NumericId, divisor: &Rational) -> Result<Int, Error> {
        let multiple = task.number_multiples.get(timer.index()).copied().unwrap_or(1);
        let scale = Rational::from_integer(task.number_scale) * Rational::from_integer(multiple);
        let by = Rational::from_integer(self.0) / scale;
        (by / divisor.clone()).to_int().ok_or_else(|| Error::overflow("a duration"))
    }

    pub(super) fn duration(self, task: &Task, operator: OperatorId) -> Result<Int, Error> {
        let factor = self.0.checked_div(task.time_scale);
        let task_duration = task.operators[operator.index()].duration.constant;
        let duration = factor.and_then(|factor| task_duration.checked_mul(factor));
        let duration = duration.filter(|duration| (-LIMIT..LIMIT).contains(duration));
        duration.ok_or_else(|| Error::overflow("a duration"))
    }
}
