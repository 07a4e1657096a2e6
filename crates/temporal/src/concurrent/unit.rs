//! Internal unit of time: small enough that all times of a task, except chosen durations, are integers.

use num_bigint::BigInt;
use num_integer::Integer as _;
use num_rational::BigRational;
use num_traits::{One as _, ToPrimitive as _};
use rustc_hash::FxHashMap;
use task::error::Error;
use task::lifted::Rational;
use task::task::quantity::NumericId;
use task::task::{OperatorId, Task};

use crate::concurrent::split::Split;
use crate::concurrent::time_number::TimeNumber;

#[derive(Default)]
pub(super) struct StaticDurations {
    /// Durations that do not depend on the state, in PDDL time units.
    pub(super) durations: FxHashMap<OperatorId, Rational>,
    /// Divisors of state-dependent durations: the duration is the value of a numeric variable divided by this
    /// constant.
    pub(super) divisors: FxHashMap<OperatorId, Rational>,
}

/// Number of internal time units per PDDL time unit. All times, except chosen durations, are integers in internal units.
#[derive(Debug, Clone)]
pub(super) struct Unit(pub(super) BigInt);

impl Unit {
    /// Computes a unit in which all durations that the planner does not choose, the separation and the times
    /// of timed initial literals are integers.
    ///
    /// # Errors
    /// `Error::Overflow` if the number of units per PDDL time unit has more than `T::TIME_BITS` bits.
    pub(super) fn new<T: TimeNumber>(
        task: &Task,
        split: &Split,
        separation: &Rational,
        fixed: &StaticDurations,
    ) -> Result<Self, Error> {
        let mut common = BigInt::one();
        let mut add = |denominator: &BigInt| {
            if (&common % denominator).bits() > 0 {
                common = common.lcm(denominator);
            }
            if common.bits() > T::TIME_BITS { Err(Error::overflow("durations and times")) } else { Ok(()) }
        };
        for time in split.events.iter().map(|event| &event.time).chain([separation]) {
            add(time.to_big().denom())?;
        }
        for duration in fixed.durations.values().filter(|duration| !duration.is_integer()) {
            add(duration.to_big().denom())?;
        }
        if !split.durations.is_empty() {
            // State-dependent durations are values of numeric variables, which are stored as integers in a
            // scale.
            let multiples = task.number_multiples.iter().copied().map(BigInt::from);
            let scale = multiples.fold(BigInt::one(), |common, multiple| common.lcm(&multiple));
            let scale = scale * task.number_scale;
            add(&scale)?;
            for divisor in fixed.divisors.values() {
                add(&(&scale * divisor.to_big().numer()))?;
            }
        }
        Ok(Self(common))
    }

    /// Returns `true` if the unit and all constant times are representable by `T`.
    pub(super) fn fits<T: TimeNumber>(
        &self,
        split: &Split,
        separation: &Rational,
        fixed: &StaticDurations,
    ) -> bool {
        let times = split.events.iter().map(|event| &event.time).chain([separation]);
        let longest = times.chain(fixed.durations.values()).max();
        self.0.bits() <= T::TIME_BITS && longest.is_none_or(|longest| self.of::<T>(longest).is_ok())
    }

    /// Converts a time in PDDL time units to internal units.
    ///
    /// # Errors
    /// `Error::Overflow` if the time is not an integer number of units, or `T` is too narrow.
    pub(super) fn of<T: TimeNumber>(&self, time: &Rational) -> Result<T, Error> {
        // Big integers are slow, and grounding converts many times.
        if let Some(unit) = self.0.to_i128()
            && let Some(units) = (time.clone() * &Rational::from_integer(unit)).to_int()
            && TimeNumber::bits(units) <= T::TIME_BITS
        {
            return Ok(units.into());
        }
        let units = time.to_big() * BigRational::from_integer(self.0.clone());
        let units = units.is_integer().then(|| units.to_integer());
        let units = units.filter(|units| units.bits() <= T::TIME_BITS);
        units.and_then(|units| T::from_big(&units)).ok_or_else(|| Error::overflow("a time"))
    }

    /// Returns the factor from the stored value of the numeric variable `timer` to a duration in internal
    /// time units. The duration in PDDL time units is the value of the fluent divided by `divisor`.
    ///
    /// # Errors
    /// `Error::Overflow` if the factor is not an integer, or `T` is too narrow.
    pub(super) fn factor<T: TimeNumber>(
        &self,
        task: &Task,
        timer: NumericId,
        divisor: &Rational,
    ) -> Result<T, Error> {
        let multiple = task.number_multiples.get(timer.index()).copied().unwrap_or(1);
        let scale = Rational::from_integer(task.number_scale) * Rational::from_integer(multiple) * divisor;
        let factor = BigRational::from_integer(self.0.clone()) / scale.to_big();
        let factor = factor.is_integer().then(|| factor.to_integer());
        let factor = factor.filter(|factor| factor.bits() <= T::TIME_BITS);
        factor.and_then(|factor| T::from_big(&factor)).ok_or_else(|| Error::overflow("a duration"))
    }
}
