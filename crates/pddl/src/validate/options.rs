//! Execution semantics and tolerance.

use num_bigint::BigInt;
use num_rational::BigRational;

/// Execution semantics and tolerance for plans.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Options {
    /// Whether actions may overlap, by the rules of PDDL 2.1. Otherwise each action begins when the preceding
    /// one has ended, or later.
    pub concurrent: bool,
    /// Tolerance, in the domain's time unit; not negative. The default is 0.001.
    ///
    /// In sequential execution, the tolerance accommodates rounded plans: it limits the deviation of a stated
    /// duration from the exact one, and the overlap of a step with the next step. A stated duration of 0 is not
    /// rounded, unless an equality determines the exact one.
    ///
    /// In concurrent execution, the tolerance is the separation (epsilon): the minimum distance of
    /// interfering happenings. A stated duration may then deviate by the same amount, but at most by 0.001.
    ///
    /// The times of timed initial literals are exact in both cases.
    pub tolerance: BigRational,
    /// Whether a step may lack a duration that no equality determines. The step then takes the shortest time
    /// that its constraints allow, or the longest time if the metric rewards time, as the planner chooses without
    /// overlapping actions. The default is `false`: such a step makes the plan invalid.
    pub chosen_durations: bool,
}

impl Options {
    /// Sets whether actions may overlap, by the rules of PDDL 2.1.
    #[must_use]
    pub fn with_concurrent(self, concurrent: bool) -> Self {
        Self { concurrent, ..self }
    }

    /// Sets the tolerance, in the domain's time unit: see [`Options::tolerance`].
    #[must_use]
    pub fn with_tolerance(self, tolerance: BigRational) -> Self {
        Self { tolerance, ..self }
    }

    /// Sets whether durations that are neither stated nor determined are chosen: see [`Options::chosen_durations`].
    #[must_use]
    pub fn with_chosen_durations(self, chosen_durations: bool) -> Self {
        Self { chosen_durations, ..self }
    }

    /// Maximum deviation of a stated duration from the exact one.
    pub(super) fn slack(&self) -> BigRational {
        let tolerance = self.tolerance.clone();
        if self.concurrent { tolerance.min(Self::default().tolerance) } else { tolerance }
    }
}

impl Default for Options {
    fn default() -> Self {
        Self {
            concurrent: false,
            tolerance: BigRational::new(BigInt::from(1), BigInt::from(1000)),
            chosen_durations: false,
        }
    }
}
