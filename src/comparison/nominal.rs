//! Simulation without failures: the time of a plan, and the state after an action.

use num_rational::BigRational;

use crate::comparison::coadaptation::Coadaptation;
use crate::comparison::process::{Action, Risk, Valuation};

/// Returns the time that a plan takes from the initial configuration if nothing fails. Impossible actions take no time.
pub(super) fn time_of(mission: &Coadaptation, plan: &[Action]) -> f64 {
    use probabilistic::Number;
    let (mut configuration, mut time) = (mission.initial, 0.0);
    for action in plan {
        match action {
            Action::Change(new) => {
                time +=
                    mission.switches[configuration][*new].as_ref().map_or(0.0, |switch| switch.time.to_f64());
                configuration = *new;
            }
            Action::Move(arc) => {
                time += mission.arcs[*arc].by[configuration].as_ref().map_or(0.0, |t| t.time.to_f64());
            }
        }
    }
    time
}

pub(super) fn after(mission: &Coadaptation, at: Valuation, action: Action, risk: Risk) -> Valuation {
    let levels = |energy: &BigRational| if risk.battery { mission.levels(energy) } else { 0 };
    match action {
        Action::Change(new) => {
            let energy = mission.switches[at.configuration][new].as_ref().map_or(0, |s| levels(&s.energy));
            Valuation { configuration: new, battery: at.battery.saturating_sub(energy), ..at }
        }
        Action::Move(arc) => {
            let arc = &mission.arcs[arc];
            let energy = arc.by[at.configuration].as_ref().map_or(0, |t| levels(&t.energy));
            Valuation { place: arc.to, battery: at.battery.saturating_sub(energy), ..at }
        }
    }
}
