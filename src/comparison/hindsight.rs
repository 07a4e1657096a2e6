//! The loss of a component in the middle of a mission: after each move of the nominal run, and with a rate.

use num_traits::ToPrimitive;
use probabilistic::explore::{Bounds, explore};
use probabilistic::solve::solve;
use probabilistic::{Direction, Problem};

use crate::comparison::coadaptation::{Coadaptation, Switch, Traversal};
use crate::comparison::nominal::{after, time_of};
use crate::comparison::planned::{NoResult, PlanTable};
use crate::comparison::process::{Action, Process, Risk, Valuation};
use crate::comparison::referee::Referee;

/// What happens when the component is lost after some move of the nominal run.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
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
#[non_exhaustive]
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
            let lost = Valuation { lost: true, ..at };
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
fn anticipated(referee: &Referee<'_>, policy: &[u32], start: Valuation, moves: usize) -> Option<f64> {
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

/// Moves after which a loss that has not come is left out.
const HORIZON: usize = 2000;

/// What is spent on the way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spent {
    /// Time.
    Time,
    /// Energy.
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

/// Bounds that nobody gets below.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Hindsight {
    /// The least that a mission can take which gets to its goal.
    pub least: Option<f64>,
    /// The expected least of who knows beforehand after which move the component is lost; a mission that cannot get to its
    /// goal then costs the penalty.
    pub expected: Option<f64>,
}

/// What nobody gets below. Collisions, failures and the battery are left out, which can only make it smaller.
pub fn hindsight(mission: &Coadaptation, risk: Risk, penalty: f64, spent: Spent) -> Hindsight {
    let start = mission.start * mission.configurations.len() + mission.initial;
    let never = relaxed(mission, spent, false, None);
    let least = Some(never[start]).filter(|value| value.is_finite());
    let rate = mission.loss.as_ref().filter(|_| risk.loss).and_then(|loss| loss.rate.to_f64());
    let Some(rate) = rate else { return Hindsight { least, expected: least } };
    let mut known = relaxed(mission, spent, true, None);
    // The loss comes with a move at the earliest.
    let (mut expected, mut left) = (0.0, 1.0);
    for _ in 0..HORIZON {
        known = relaxed(mission, spent, false, Some(&known));
        let value = known[start].min(penalty);
        expected += left * rate * value;
        left *= 1.0 - rate;
        if left < 1e-15 || (value - never[start]).abs() < 1e-12 {
            break;
        }
    }
    let expected = expected + left * never[start].min(penalty);
    Hindsight { least, expected: Some(expected).filter(|value| value.is_finite()) }
}

/// The least that it takes to the goal. What comes after one move is `later`, where that is given.
fn relaxed(mission: &Coadaptation, spent: Spent, lost: bool, later: Option<&[f64]>) -> Vec<f64> {
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
                let Some(traversal) = traversal else { continue };
                let rest = match later {
                    _ if arc.to == mission.goal => 0.0,
                    Some(later) => later[at(arc.to, design)],
                    None => best[at(arc.to, design)],
                };
                let whole = spent.traversal(traversal) + rest;
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
