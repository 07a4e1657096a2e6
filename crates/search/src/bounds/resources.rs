//! Lower bounds on the consumption of a resource until it is replenished or the goal is reached.
//!
//! A numeric variable is a resource if each operator that changes it either may raise it (replenish it) or
//! requires that the new value is at least 0. The minimum consumption in a projection, on the way to the goal
//! or to a replenishing operator, is a lower bound on the amount that a state must have. This is the
//! resource-to-go of constrained shortest paths \[1\].
//!
//! \[1\] I. Dumitrescu, N. Boland: Improved preprocessing, labeling and scaling algorithms for the
//! weight-constrained shortest path problem, Networks 42(3), 2003.

use task::context::Context;
use task::limits::Interrupted;
use task::number::Int;
use task::task::quantity::NumericId;
use task::task::{Operator, State};

use crate::bounds::pattern_database::Projection;

pub(super) struct Resource {
    pub(super) variable: NumericId,
    /// For projections, given by index: the amount that is required in each abstract state. `None`
    /// means that no amount suffices.
    pub(super) needs: Vec<(usize, Vec<Option<Int>>)>,
}

impl Resource {
    /// Returns `false` if a projection proves that the state has too little of the resource to reach the goal
    /// or to replenish the resource. A value below 0 is harmless if nothing is required.
    pub(super) fn has_enough_resources(&self, state: &State, projections: &[Projection]) -> bool {
        let amount = state.numbers[self.variable.index()];
        self.needs.iter().all(|(projection, needs)| {
            needs[projections[*projection].state(state) as usize]
                .is_some_and(|need| need == 0 || need <= amount)
        })
    }
}

/// Returns the resources of a task, each with its needs in the projections. A projection is omitted
/// from a resource if an operator that may replenish this resource neither requires nor changes the
/// pattern: all needs would be 0.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "numbers of a task are above the least number of their type"
)]
pub(super) fn resources(
    context: Context<'_>,
    projections: &[Projection],
) -> Result<Vec<Resource>, Interrupted> {
    let Context { task, limits } = context;
    let mut result = Vec::new();
    for variable in limits.watch(NumericId::all(task.initial.numbers.len())) {
        let variable = variable?;
        let Some(used) = task.operators.iter().map(|o| used(o, variable)).collect::<Option<Vec<_>>>() else {
            continue;
        };
        let required = task.goal.comparisons.iter().filter(|c| c.coefficients[..] == [(variable, 1)]);
        let required = required.map(|comparison| -comparison.quantity.constant).fold(0, Int::max);
        let mut needs = Vec::new();
        for (projection, position) in projections.iter().zip(0..) {
            // If an operator replenishes in every abstract state, all lower bounds of the projection would be
            // 0.
            let anywhere =
                |operator: usize| used[operator].is_none() && !projection.affects_pattern(operator);
            if !(0..used.len()).any(anywhere) {
                needs.push((position, projection.needs(&used, required, limits)?));
            }
        }
        result.push(Resource { variable, needs });
    }
    Ok(result)
}

/// Returns the minimum consumption of an operator, or `Some(None)` if the operator may replenish the
/// resource. Returns `None` if the operator may lower the variable below 0, so that the variable is not a
/// resource.
#[allow(clippy::option_option)]
#[expect(
    clippy::arithmetic_side_effects,
    reason = "the numbers of a quantity fit together, so that their sum is above the least number of its type"
)]
fn used(operator: &Operator, variable: NumericId) -> Option<Option<Int>> {
    let Some(effect) = operator.numeric_effects.iter().find(|effect| effect.variable == variable) else {
        return Some(Some(0));
    };
    let change = effect.value.quantity.maximum();
    if effect.value.coefficients[..] != [(variable, 1)] || change > 0 {
        return Some(None);
    }
    operator.condition.comparisons.contains(&effect.value).then_some(Some(-change))
}
