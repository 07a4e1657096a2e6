//! Monotonicity of the numbers in the metric. If their contribution only grows, its current value
//! is a lower bound on its final value.

use rustc_hash::FxHashSet;
use task::number::{Int, Rational};
use task::task::{NumericId, Operator, Task};

use crate::concurrent::happening::Instance;
use crate::concurrent::time_number::TimeNumber;

/// Returns `true` if it is proved that no operator lowers the contribution of numbers to the minimised
/// metric, for any durations. `instances` provides the numbers that hold durations.
pub(super) fn only_grows<T: TimeNumber>(task: &Task, instances: &[Instance<T>]) -> bool {
    let timers: FxHashSet<NumericId> =
        instances.iter().filter_map(|instance| Some(instance.timer?.0)).collect();
    let grows = |operator: &Operator, variable: NumericId, factor: &Rational| {
        let mut effects = operator.numeric_effects.iter().filter(|effect| effect.variable == variable);
        effects.all(|effect| {
            let value = &effect.value;
            let has_sign = |number: Int| !(Rational::from_integer(number) * factor).is_negative();
            let other_terms = value.coefficients.iter().filter(|(number, _)| *number != variable);
            value.coefficients.contains(&(variable, 1))
                && value.quantity.tables.is_empty()
                && has_sign(value.quantity.constant)
                && other_terms.clone().all(|(number, by)| timers.contains(number) && has_sign(*by))
        })
    };
    task.objective
        .rest
        .iter()
        .all(|(variable, factor)| task.operators.iter().all(|operator| grows(operator, *variable, factor)))
}
