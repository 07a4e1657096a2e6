//! Computes the fastest sequence of configurations for a fixed route, by dynamic programming over its arcs.

use num_rational::BigRational;

use crate::comparison::coadaptation::{Coadaptation, Switch, Traversal};
use crate::comparison::process::Action;

/// Returns the fastest actions that follow a route of arcs; the configuration can be changed once before each arc.
/// Returns `None` if the route cannot be traversed with the available configurations. The battery is ignored.
pub fn best_on_route(mission: &Coadaptation, route: &[usize]) -> Option<Vec<Action>> {
    best_by(mission, route, |traversal| traversal.time.clone(), |switch| switch.time.clone())
        .map(|(_, plan)| plan)
}

fn best_by(
    mission: &Coadaptation,
    route: &[usize],
    traversal_cost: impl Fn(&Traversal) -> BigRational,
    switch_cost: impl Fn(&Switch) -> BigRational,
) -> Option<(BigRational, Vec<Action>)> {
    let designs = mission.configurations.len();
    let mut best: Vec<Option<(BigRational, Vec<Action>)>> = vec![None; designs];
    best[mission.initial] = Some((BigRational::from_integer(0.into()), Vec::new()));
    for arc in route {
        let mut next = vec![None; designs];
        for design in (0..designs).filter(|design| mission.configurations[*design].available) {
            let Some(traversal) = &mission.arcs[*arc].by[design] else { continue };
            for (old, incumbent) in best.iter().enumerate() {
                let Some((so_far, plan)) = incumbent else { continue };
                let mut cost = so_far + traversal_cost(traversal);
                let mut plan = plan.clone();
                if old != design {
                    let Some(switch) = &mission.switches[old][design] else { continue };
                    cost += switch_cost(switch);
                    plan.push(Action::Change(design));
                }
                plan.push(Action::Move(*arc));
                if next[design].as_ref().is_none_or(|(incumbent, _)| cost < *incumbent) {
                    next[design] = Some((cost, plan));
                }
            }
        }
        best = next;
    }
    best.into_iter().flatten().min_by(|(a, _), (b, _)| a.cmp(b))
}
