//! Converts a co-adaptation mission to a Markov decision process whose successors are computed on
//! demand.
//!
//! The process corrects the published procedure: it has every route, reconfigurations at every place, and a permanent
//! collision flag. An action that needs energy must keep the battery at the reserve or above.

use fixedbitset::FixedBitSet;
use num_rational::BigRational;
use probabilistic::explore::{Choices, Generator};
use probabilistic::states::States;
use probabilistic::{Error, Number};

use crate::comparison::coadaptation::Coadaptation;

/// Names of the rewards of the process, in their order.
pub const REWARDS: [&str; 5] = ["time", "energy", "collisions", "reconfigurations", "moves"];

/// The optional parts of a process: sources of uncertainty, and the battery.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[allow(clippy::struct_excessive_bools, reason = "each is a choice of its own")]
pub struct Risk {
    /// `true` if collisions are part of the state.
    pub collisions: bool,
    /// `true` if moves may fail and end the mission.
    pub failures: bool,
    /// `true` if the component may be lost during moves.
    pub loss: bool,
    /// `true` if the battery is part of the state.
    pub battery: bool,
}

impl Risk {
    /// Selects collisions and failures, and the loss of a component and the battery if the mission has data
    /// about them.
    pub fn all(mission: &Coadaptation) -> Self {
        Self {
            collisions: true,
            failures: true,
            loss: mission.loss.is_some(),
            battery: mission.battery.is_some(),
        }
    }
}

/// A state of the process: place, configuration, flags and battery, packed into one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct State(u64);

/// Decoded contents of a state: numbers of the place and of the configuration, flags, and battery level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs, reason = "the names say it")]
pub struct Valuation {
    pub place: usize,
    pub configuration: usize,
    pub hit: bool,
    pub failed: bool,
    pub lost: bool,
    pub battery: u32,
}

impl Valuation {
    /// Returns the initial state of a mission. The battery is 0 unless `risk` includes it.
    pub(super) fn start(mission: &Coadaptation, risk: Risk) -> Self {
        Self {
            place: mission.start,
            configuration: mission.initial,
            hit: false,
            failed: false,
            lost: false,
            battery: mission.battery.filter(|_| risk.battery).map_or(0, |battery| battery.initial),
        }
    }
}

impl State {
    /// Decodes the packed state.
    pub fn situation(self) -> Valuation {
        Valuation {
            place: (self.0 & 0xFFFF) as usize,
            configuration: (self.0 >> 16 & 0xFFF) as usize,
            hit: self.0 >> 28 & 1 == 1,
            failed: self.0 >> 29 & 1 == 1,
            lost: self.0 >> 30 & 1 == 1,
            battery: (self.0 >> 32) as u32,
        }
    }
}

impl From<Valuation> for State {
    fn from(s: Valuation) -> Self {
        let flags = u64::from(s.hit) << 28 | u64::from(s.failed) << 29 | u64::from(s.lost) << 30;
        Self(s.place as u64 | (s.configuration as u64) << 16 | flags | u64::from(s.battery) << 32)
    }
}

#[derive(Debug, Clone)]
struct Move<N> {
    action: u32,
    to: usize,
    levels: u32,
    /// Probabilities of success without a collision, success with a collision, and failure. In the first array, the
    /// component is not lost during the move; in the second array, it is.
    outcomes: [[N; 3]; 2],
    rewards: Vec<N>,
}

#[derive(Debug, Clone)]
struct Reconfiguration<N> {
    action: u32,
    to: usize,
    levels: u32,
    success: N,
    failure: N,
    rewards: Vec<N>,
}

/// The Markov decision process of a mission, with numbers of type `N`.
#[derive(Debug, Clone)]
pub struct Process<N> {
    goal: usize,
    initial: State,
    reserve: u32,
    moves: Vec<Vec<Vec<Move<N>>>>,
    changes: Vec<Vec<Reconfiguration<N>>>,
    lost: Vec<bool>,
    risk: Risk,
    rewards: usize,
    /// Number of battery levels, including the empty one; 1 without a battery.
    levels: usize,
}

impl<N: Number> Process<N> {
    /// Builds the process with the given risks. `rewards` selects some of the [`REWARDS`] by name; other names are
    /// ignored.
    pub fn new(mission: &Coadaptation, risk: Risk, rewards: &[&str]) -> Self {
        let number = |value: &BigRational| N::from_rational(value);
        let indices: Vec<usize> =
            rewards.iter().filter_map(|name| REWARDS.iter().position(|reward| reward == name)).collect();
        let rewards_of = |all: [N; 5]| indices.iter().map(|index| all[*index].clone()).collect::<Vec<N>>();
        let levels = |energy: &BigRational| if risk.battery { mission.levels(energy) } else { 0 };
        // Complements are computed exactly, before numbers are rounded to `N`.
        let (zero, one): (BigRational, BigRational) = (Number::zero(), Number::one());
        let rate = mission.loss.as_ref().filter(|_| risk.loss).map_or(&zero, |loss| &loss.rate);
        let designs = mission.configurations.len();
        let mut moves: Vec<Vec<Vec<Move<N>>>> = vec![vec![Vec::new(); designs]; mission.places.len()];
        for (index, arc) in mission.arcs.iter().enumerate() {
            for (design, traversal) in arc.by.iter().enumerate() {
                let Some(traversal) = traversal.as_ref().filter(|_| mission.configurations[design].available)
                else {
                    continue;
                };
                let hit = if risk.collisions { &traversal.hit } else { &zero };
                let success = if risk.failures { &traversal.success } else { &one };
                let ends = [success * (&one - hit), success * hit, &one - success];
                let share = |rate: &BigRational| ends.each_ref().map(|end| number(&(end * rate)));
                moves[arc.from][design].push(Move {
                    action: Action::Move(index).number(),
                    to: arc.to,
                    levels: levels(&traversal.energy),
                    rewards: rewards_of([
                        number(&traversal.time),
                        number(&traversal.energy),
                        number(&ends[1]),
                        N::zero(),
                        N::one(),
                    ]),
                    outcomes: [share(&(&one - rate)), share(rate)],
                });
            }
        }
        let change = |old: usize, new: usize| {
            let switch =
                mission.switches[old][new].as_ref().filter(|_| mission.configurations[new].available)?;
            Some(Reconfiguration {
                action: Action::Change(new).number(),
                to: new,
                levels: levels(&switch.energy),
                rewards: rewards_of([
                    number(&switch.time),
                    number(&switch.energy),
                    N::zero(),
                    N::one(),
                    N::zero(),
                ]),
                failure: number(&(&one - &switch.success)),
                success: number(&switch.success),
            })
        };
        let changes =
            (0..designs).map(|old| (0..designs).filter_map(|new| change(old, new)).collect()).collect();
        Self {
            goal: mission.goal,
            initial: Valuation::start(mission, risk).into(),
            reserve: mission.battery.filter(|_| risk.battery).map_or(0, |battery| battery.reserve),
            moves,
            changes,
            lost: (0..designs).map(|design| risk.loss && mission.lost(design)).collect(),
            risk,
            rewards: indices.len(),
            levels: mission
                .battery
                .filter(|_| risk.battery)
                .map_or(1, |battery| battery.initial as usize + 1),
        }
    }

    /// Returns the process with `state` as initial state.
    #[must_use]
    pub fn starting(mut self, state: State) -> Self {
        self.initial = state;
        self
    }

    /// Returns the set of the numbers of all goal states (see [`Process::is_goal`]).
    pub fn goals(&self, states: &States<State>) -> FixedBitSet {
        let mut goals = FixedBitSet::with_capacity(states.len());
        for (number, state) in states.iter().enumerate() {
            goals.set(number, self.is_goal(*state));
        }
        goals
    }

    /// Returns `true` if the state is at the goal and the mission has not failed.
    pub fn is_goal(&self, state: State) -> bool {
        let situation = state.situation();
        situation.place == self.goal && !situation.failed
    }

    fn enough(&self, battery: u32, levels: u32) -> Option<u32> {
        if !self.risk.battery {
            return Some(0);
        }
        // Actions that need no energy stay possible below the reserve.
        battery.checked_sub(levels).filter(|remaining| *remaining >= self.reserve || levels == 0)
    }
}

/// An action of the process: a move along an arc, or a change of the configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// A move along the arc with this number.
    Move(usize),
    /// A change to the configuration with this number.
    Change(usize),
}

impl Action {
    /// Decodes the number that a process assigns to an action.
    pub fn from_number(number: u32) -> Self {
        // The lowest bit distinguishes changes from moves.
        if number & 1 == 0 { Self::Move(number as usize >> 1) } else { Self::Change(number as usize >> 1) }
    }

    /// Returns the number of the action in a process.
    pub fn number(self) -> u32 {
        match self {
            Self::Move(arc) => (arc as u32) << 1,
            Self::Change(configuration) => (configuration as u32) << 1 | 1,
        }
    }
}

impl<N: Number> Generator<N> for Process<N> {
    type State = State;

    fn initial(&self) -> State {
        self.initial
    }

    fn rewards(&self) -> usize {
        self.rewards
    }

    fn codes(&self) -> Option<usize> {
        self.levels.checked_mul(self.moves.len())?.checked_mul(8)?.checked_mul(self.lost.len())
    }

    fn code(&self, state: &State) -> usize {
        let s = state.situation();
        // Mixed radix: the most significant digit is the battery, the least significant one the
        // configuration.
        let flags = usize::from(s.hit) | usize::from(s.failed) << 1 | usize::from(s.lost) << 2;
        ((s.battery as usize * self.moves.len() + s.place) * 8 + flags) * self.lost.len() + s.configuration
    }

    fn successors(&self, state: &State, choices: &mut Choices<State, N>) -> Result<(), Error> {
        let s = state.situation();
        // Goal and failure states are absorbing.
        if s.place == self.goal || s.failed {
            return Ok(());
        }
        for change in &self.changes[s.configuration] {
            let Some(battery) = self.enough(s.battery, change.levels) else { continue };
            if s.lost && self.lost[change.to] {
                continue;
            }
            choices.to(Valuation { configuration: change.to, battery, ..s }.into(), change.success.clone());
            choices.to(Valuation { battery, ..s }.into(), change.failure.clone());
            choices.end(change.action, change.rewards.iter().cloned());
        }
        if s.lost && self.lost[s.configuration] {
            return Ok(());
        }
        for step in &self.moves[s.place][s.configuration] {
            let Some(battery) = self.enough(s.battery, step.levels) else { continue };
            let arrived = Valuation { place: step.to, battery, ..s };
            // A failed mission is over, so neither the next place nor a collision is recorded.
            let failed = Valuation { failed: true, battery, ..s };
            // The loss happens during the move, so each outcome exists with and without a loss.
            for (lost, ends) in [s.lost, true].into_iter().zip(&step.outcomes) {
                let ways = [
                    Valuation { lost, ..arrived },
                    Valuation { lost, hit: true, ..arrived },
                    Valuation { lost, ..failed },
                ];
                for (situation, probability) in ways.into_iter().zip(ends) {
                    choices.to(situation.into(), probability.clone());
                }
            }
            choices.end(step.action, step.rewards.iter().cloned());
        }
        Ok(())
    }
}
