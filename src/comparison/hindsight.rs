//! Evaluates the loss of a component during a mission, in two ways. First, the robot executes the plan and nothing
//! else fails: total times of the mission are computed for a loss after 0, 1, 2, … moves. Second, each move loses the
//! component with a given probability: lower bounds are computed by a clairvoyant policy, which knows in advance when
//! the loss happens (hindsight optimisation).

use num_traits::ToPrimitive;
use probabilistic::explore::{Bounds, explore};
use probabilistic::solve::solve;
use probabilistic::{Direction, Problem};

use crate::comparison::coadaptation::{Coadaptation, Switch, Traversal};
use crate::comparison::nominal::{after, time_of};
use crate::comparison::planned::{NoResult, PlanTable};
use crate::comparison::process::{Action, Process, Risk, Valuation};
use crate::comparison::referee::Referee;

/// Total times of a mission for four reactions to the loss of a component. The component is lost after a given number
/// of moves, and no move fails.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct LossAt {
    /// Number of moves before the loss.
    pub moves: usize,
    /// Total time of the plan, continued unchanged after the loss. `None` if the rest of the plan needs the lost
    /// component.
    pub open_loop: Option<f64>,
    /// Total time if a new plan is computed after the loss. `None` if there is no plan.
    pub replanned: Option<f64>,
    /// Expected total time if an optimal policy is computed after the loss. `None` if it is infinite, e.g. because
    /// the goal cannot be reached.
    pub solved_again: Option<f64>,
    /// Total time of the policy that takes a possible loss into account from the start, and may take another
    /// route. `None` if this policy does not reach the goal.
    pub anticipated: Option<f64>,
}

/// Total times of a mission in which a component is lost, for each number of moves before the loss.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct LossReport {
    /// Name of the component.
    pub component: String,
    /// Probability of losing the component at each move.
    pub rate: f64,
    /// One entry for each number of moves before the loss, in ascending order.
    pub steps: Vec<LossAt>,
}

pub(super) fn report(
    referee: &Referee<'_>,
    plan: &[Action],
    anticipating: &[u32],
    memo: &mut PlanTable<'_, '_>,
) -> Result<LossReport, NoResult> {
    let mission = referee.mission;
    let loss = mission.loss.as_ref();
    let mut steps = Vec::new();
    let mut at = Valuation::start(mission, referee.risk);
    let (start, mut moves) = (at, 0);
    for done in 0..=plan.len() {
        let moved = done == 0 || matches!(plan[done - 1], Action::Move(_));
        if moved {
            // A component is lost only by moves, so changes of configuration need no entry.
            let lost = Valuation { lost: true, ..at };
            let spent = time_of(mission, &plan[..done]);
            let remaining = &plan[done..];
            let open_loop = carries_on(mission, at.configuration, remaining).then(|| time_of(mission, plan));
            let planned = if at.place == mission.goal { Some(Vec::new()) } else { memo.plan(&lost)? };
            let replanned = planned.map(|remaining| spent + time_from(mission, at.configuration, &remaining));
            steps.push(LossAt {
                moves,
                open_loop,
                replanned,
                solved_again: solved_again(referee, lost, spent)?,
                anticipated: anticipated(referee, anticipating, start, moves),
            });
        }
        if let Some(action) = plan.get(done) {
            at = after(mission, at, *action, referee.risk);
            moves += usize::from(matches!(action, Action::Move(_)));
        }
    }
    Ok(LossReport {
        component: loss.map(|loss| loss.component.clone()).unwrap_or_default(),
        rate: loss.and_then(|loss| loss.rate.to_f64()).unwrap_or(0.0),
        steps,
    })
}

/// Number of actions after which a run is considered infinite.
const MAX_ACTIONS: usize = 100_000;

/// Total time of a policy if the component is lost after `moves` moves and nothing else fails. `None` if the policy
/// does not reach the goal.
fn anticipated(referee: &Referee<'_>, policy: &[u32], start: Valuation, moves: usize) -> Option<f64> {
    let mission = referee.mission;
    let (mut at, mut left, mut time) = (start, moves, 0.0);
    for _ in 0..MAX_ACTIONS {
        if at.place == mission.goal {
            return Some(time);
        }
        // The loss happens after the given number of moves.
        at.lost |= left == 0;
        let action = referee.decision(policy, at)?;
        time += time_from(mission, at.configuration, &[action]);
        at = after(mission, at, action, referee.risk);
        left = left.saturating_sub(usize::from(matches!(action, Action::Move(_))));
    }
    None
}

/// Returns `true` if the remaining plan never needs the lost component. `configuration` is the current configuration.
fn carries_on(mission: &Coadaptation, configuration: usize, remaining_plan: &[Action]) -> bool {
    let mut configuration = configuration;
    remaining_plan.iter().all(|action| match action {
        Action::Change(new) => {
            configuration = *new;
            !mission.lost(*new)
        }
        Action::Move(_) => !mission.lost(configuration),
    })
}

fn time_from(mission: &Coadaptation, configuration: usize, plan: &[Action]) -> f64 {
    let from = Coadaptation { initial: configuration, ..mission.clone() };
    time_of(&from, plan)
}

/// Returns `spent` plus the least expected time from the state `from` to the goal, if no move fails. Returns `None`
/// if the expected time is infinite.
fn solved_again(referee: &Referee<'_>, from: Valuation, spent: f64) -> Result<Option<f64>, NoResult> {
    let risk = Risk { collisions: false, failures: false, ..referee.risk };
    let process =
        Process::<f64>::new(referee.mission, Risk { loss: true, ..risk }, &["time"]).starting(from.into());
    let explored = explore(&process, &Bounds::default())?;
    let goal = process.goals(&explored.states);
    let problem = Problem::new(&explored.mdp, Direction::Min, Some(&explored.rewards[0]), &goal);
    let solution = solve(problem, None);
    Ok(solution.filter(|s| !s.infinite.contains(0)).map(|s| spent + s.values[0]))
}

/// Number of moves after which a loss is treated as if it never happened.
const HORIZON: usize = 2000;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spent {
    Time,
    Energy,
}

impl Spent {
    fn traversal(self, traversal: &Traversal) -> f64 {
        let spent = if self == Self::Time { &traversal.time } else { &traversal.energy };
        spent.to_f64().unwrap_or(f64::INFINITY)
    }

    fn switch(self, switch: &Switch) -> f64 {
        let spent = if self == Self::Time { &switch.time } else { &switch.energy };
        spent.to_f64().unwrap_or(f64::INFINITY)
    }
}

/// Lower bounds on the time or the energy that any policy needs to reach the goal.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Hindsight {
    /// Least time or energy of a mission that reaches its goal without a loss. `None` if the goal
    /// cannot be reached.
    pub least: Option<f64>,
    /// Least expected time or energy for a clairvoyant controller, which knows in advance the move at which the
    /// component is lost. Each case counts at most the penalty, for example if the loss makes the goal unreachable.
    /// `None` if the expected value is infinite. Equal to `least` if no loss is considered.
    pub expected: Option<f64>,
}

/// Computes the lower bounds for time or energy. Collisions, failures and the battery are neglected: without them,
/// the goal can only be reached sooner or with less energy.
pub fn hindsight(mission: &Coadaptation, risk: Risk, penalty: f64, spent: Spent) -> Hindsight {
    let start = mission.start * mission.configurations.len() + mission.initial;
    let never = relaxed(mission, spent, false, None);
    let least = Some(never[start]).filter(|value| value.is_finite());
    let rate = mission.loss.as_ref().filter(|_| risk.loss).and_then(|loss| loss.rate.to_f64());
    let Some(rate) = rate else { return Hindsight { least, expected: least } };
    let mut bounds = relaxed(mission, spent, true, None);
    // The component is lost at the first move at the earliest.
    let (mut expected, mut left) = (0.0, 1.0);
    for _ in 0..HORIZON {
        bounds = relaxed(mission, spent, false, Some(&bounds));
        let value = bounds[start].min(penalty);
        expected += left * rate * value;
        left *= 1.0 - rate;
        // The remaining terms are negligible, or all have the value without a loss. They are added after the
        // loop.
        if left < 1e-15 || (value - never[start]).abs() < 1e-12 {
            break;
        }
    }
    // `left` is the probability that the loss has not happened yet. For these cases, the value without
    // a loss is added.
    let expected = expected + left * never[start].min(penalty);
    Hindsight { least, expected: Some(expected).filter(|value| value.is_finite()) }
}

/// Returns the least time or energy to the goal for each pair of place and configuration. With `lost`, configurations
/// that need the lost component cannot be used. If `later` is given, it has a value for each pair, which is used as
/// the time or energy after the next move.
fn relaxed(mission: &Coadaptation, spent: Spent, lost: bool, later: Option<&[f64]>) -> Vec<f64> {
    let designs = mission.configurations.len();
    let at = |place: usize, design: usize| place * designs + design;
    let usable = |design: usize| mission.configurations[design].available && !(lost && mission.lost(design));
    let mut best = vec![f64::INFINITY; mission.places.len() * designs];
    for design in 0..designs {
        best[at(mission.goal, design)] = 0.0;
    }
    // Bellman-Ford: relaxation of arcs and switches until nothing changes.
    loop {
        let mut changed = false;
        for arc in &mission.arcs {
            for (design, traversal) in arc.by.iter().enumerate().filter(|(design, _)| usable(*design)) {
                let Some(traversal) = traversal else { continue };
                let remaining = match later {
                    _ if arc.to == mission.goal => 0.0,
                    Some(later) => later[at(arc.to, design)],
                    None => best[at(arc.to, design)],
                };
                let whole = spent.traversal(traversal) + remaining;
                let here = &mut best[at(arc.from, design)];
                if arc.from != mission.goal && whole < *here {
                    *here = whole;
                    changed = true;
                }
            }
        }
        for place in (0..mission.places.len()).filter(|place| *place != mission.goal) {
            for old in 0..designs {
                for new in (0..designs).filter(|new| usable(*new)) {
                    let Some(switch) = &mission.switches[old][new] else { continue };
                    let whole = spent.switch(switch) + best[at(place, new)];
                    if whole < best[at(place, old)] {
                        best[at(place, old)] = whole;
                        changed = true;
                    }
                }
            }
        }
        if !changed {
            return best;
        }
    }
}
