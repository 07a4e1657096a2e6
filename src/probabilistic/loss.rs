//! The loss of a component in the middle of a mission: after each move of the nominal run, and with a rate.

use num_traits::ToPrimitive;
use probabilistic::explore::{Bounds, explore};
use probabilistic::solve::solve;
use probabilistic::{Direction, Problem};

use crate::probabilistic::coadaptation::Coadaptation;
use crate::probabilistic::compare::{Failure, Memo, after, time_of};
use crate::probabilistic::process::{Action, Process, Risk, Situation};
use crate::probabilistic::referee::Referee;

/// What happens when the component is lost after some move of the nominal run.
#[derive(Debug, Clone, PartialEq)]
pub struct LossAt {
    /// After how many moves.
    pub moves: usize,
    /// The time of the plan if it can be carried on as it is.
    pub open_loop: Option<f64>,
    /// The time with a new plan from there.
    pub replanned: Option<f64>,
    /// The time when the process is solved again from there.
    pub solved_again: Option<f64>,
    /// The time of the policy that reckons with the loss, which may have gone another way from the start.
    pub anticipated: Option<f64>,
}

/// The loss of a component on the nominal run.
#[derive(Debug, Clone, PartialEq)]
pub struct LossReport {
    /// The component.
    pub component: String,
    /// The probability of losing it, for each move.
    pub rate: f64,
    /// For each number of moves.
    pub steps: Vec<LossAt>,
}

pub(super) fn report(
    referee: &Referee<'_>,
    plan: &[Action],
    anticipating: &[u32],
    memo: &mut Memo<'_, '_>,
) -> Result<LossReport, Failure> {
    let mission = referee.mission;
    let loss = mission.loss.as_ref();
    let mut steps = Vec::new();
    let mut at = Situation {
        place: mission.start,
        configuration: mission.initial,
        hit: false,
        failed: false,
        lost: false,
        battery: mission.battery.filter(|_| referee.risk.battery).map_or(0, |battery| battery.initial),
    };
    let (start, mut moves) = (at, 0);
    for done in 0..=plan.len() {
        let moved = done == 0 || matches!(plan[done - 1], Action::Move(_));
        if moved {
            let lost = Situation { lost: true, ..at };
            let spent = time_of(mission, &plan[..done]);
            let rest = &plan[done..];
            let open_loop = carries_on(mission, at.configuration, rest).then(|| time_of(mission, plan));
            let planned = if at.place == mission.goal { Some(Vec::new()) } else { memo.plan(&lost)? };
            let replanned = planned.map(|rest| spent + time_from(mission, at.configuration, &rest));
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

/// Actions after which a run counts as endless.
const LONGEST: usize = 100_000;

/// The time of a policy when the component is lost after so many moves and nothing else goes wrong.
fn anticipated(referee: &Referee<'_>, policy: &[u32], start: Situation, moves: usize) -> Option<f64> {
    let mission = referee.mission;
    let (mut at, mut left, mut time) = (start, moves, 0.0);
    for _ in 0..LONGEST {
        if at.place == mission.goal {
            return Some(time);
        }
        at.lost |= left == 0;
        let action = referee.decision(policy, at)?;
        time += time_from(mission, at.configuration, &[action]);
        at = after(mission, at, action, referee.risk);
        left = left.saturating_sub(usize::from(matches!(action, Action::Move(_))));
    }
    None
}

/// Whether the rest of a plan does without the component.
fn carries_on(mission: &Coadaptation, configuration: usize, rest: &[Action]) -> bool {
    let mut configuration = configuration;
    rest.iter().all(|action| match action {
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

/// The least time to the goal from a situation, when nothing else goes wrong.
fn solved_again(referee: &Referee<'_>, from: Situation, spent: f64) -> Result<Option<f64>, Failure> {
    let risk = Risk { collisions: false, failures: false, ..referee.risk };
    let process =
        Process::<f64>::new(referee.mission, Risk { loss: true, ..risk }, &["time"]).starting(from.into());
    let explored = explore(&process, &Bounds::default())?;
    let mut goal = fixedbitset::FixedBitSet::with_capacity(explored.mdp.states());
    for (number, state) in explored.states.iter().enumerate() {
        goal.set(number, process.is_goal(*state));
    }
    let problem = Problem {
        mdp: &explored.mdp,
        direction: Direction::Min,
        rewards: Some(&explored.rewards[0]),
        terminal: &goal,
        terminal_values: None,
        blocked: None,
        allowed: None,
    };
    let solution = solve(problem, None);
    Ok(solution.filter(|s| !s.infinite.contains(0)).map(|s| spent + s.values[0]))
}

/// Moves after which a loss that has not come is left out.
const HORIZON: usize = 2000;

/// A time that nobody gets below: the expected time of who knows beforehand after which move the component is lost.
/// Collisions, failures and the battery are left out, which can only make it smaller.
pub fn hindsight(mission: &Coadaptation, risk: Risk, penalty: f64) -> Option<f64> {
    let size = mission.places.len() * mission.configurations.len();
    let at = |place: usize, design: usize| place * mission.configurations.len() + design;
    let start = at(mission.start, mission.initial);
    let never = relaxed(mission, false, &vec![f64::INFINITY; size], true);
    let Some(loss) = mission.loss.as_ref().filter(|_| risk.loss) else {
        return Some(never[start]).filter(|time| time.is_finite());
    };
    let rate = loss.rate.to_f64()?;
    let mut known = relaxed(mission, true, &vec![f64::INFINITY; size], true);
    // The loss comes with a move at the earliest.
    let (mut expected, mut left) = (0.0, 1.0);
    for _ in 0..HORIZON {
        known = relaxed(mission, false, &known, false);
        let time = known[start].min(penalty);
        expected += left * rate * time;
        left *= 1.0 - rate;
        if left < 1e-15 || (time - never[start]).abs() < 1e-12 {
            break;
        }
    }
    Some(expected + left * never[start].min(penalty))
}

/// Least times to the goal. With `to_the_end`, moves go on as they are; otherwise what comes after one move is `later`.
fn relaxed(mission: &Coadaptation, lost: bool, later: &[f64], to_the_end: bool) -> Vec<f64> {
    let designs = mission.configurations.len();
    let at = |place: usize, design: usize| place * designs + design;
    let usable = |design: usize| mission.configurations[design].available && !(lost && mission.lost(design));
    let mut best = vec![f64::INFINITY; mission.places.len() * designs];
    for design in 0..designs {
        best[at(mission.goal, design)] = 0.0;
    }
    loop {
        let mut changed = false;
        for arc in &mission.arcs {
            for (design, traversal) in arc.by.iter().enumerate().filter(|(design, _)| usable(*design)) {
                let Some(time) = traversal.as_ref().and_then(|traversal| traversal.time.to_f64()) else {
                    continue;
                };
                let rest = if arc.to == mission.goal {
                    0.0
                } else if to_the_end {
                    best[at(arc.to, design)]
                } else {
                    later[at(arc.to, design)]
                };
                let here = &mut best[at(arc.from, design)];
                if arc.from != mission.goal && time + rest < *here {
                    *here = time + rest;
                    changed = true;
                }
            }
        }
        for place in (0..mission.places.len()).filter(|place| *place != mission.goal) {
            for old in 0..designs {
                for new in (0..designs).filter(|new| usable(*new)) {
                    let Some(switch) = &mission.switches[old][new] else { continue };
                    let time = switch.time.to_f64().unwrap_or(f64::INFINITY) + best[at(place, new)];
                    if time < best[at(place, old)] {
                        best[at(place, old)] = time;
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
