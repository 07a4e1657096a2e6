//! Plans on a grid of whole times, executed by the definitions of PDDL 2.1 and PDDL 3.

use fastrand::Rng;

use super::{Action, Amount, Constraint, Effect, Formula, Moment, State, Task};

/// The number of what is paid.
pub(super) const PAID: usize = 2;
/// The last start that is tried.
const LAST: i64 = 3;
/// How many plans of three actions are tried.
const LONG_PLANS: usize = 200;

/// An action that starts at a time and takes a time.
type Step = (i64, usize, i64);

impl Formula {
    fn holds(&self, state: &State) -> bool {
        match self {
            Self::Fact(fact, value) => (state.facts >> fact & 1 == 1) == *value,
            Self::AtLeast(number, least) => state.numbers[*number] >= *least,
            Self::AtMost(number, most) => state.numbers[*number] <= *most,
            Self::And(left, right) => left.holds(state) && right.holds(state),
            Self::Or(left, right) => left.holds(state) || right.holds(state),
        }
    }

    /// Facts and numbers that it mentions.
    fn reads(&self) -> (u8, u8) {
        match self {
            Self::Fact(fact, _) => (1 << fact, 0),
            Self::AtLeast(number, _) | Self::AtMost(number, _) => (0, 1 << number),
            Self::And(left, right) | Self::Or(left, right) => {
                let (left, right) = (left.reads(), right.reads());
                (left.0 | right.0, left.1 | right.1)
            }
        }
    }
}

impl Amount {
    fn of(self, duration: i64) -> i64 {
        self.0 + self.1 * duration
    }
}

/// What a happening does and reads.
#[derive(Debug, Default)]
struct Happening {
    reads: (u8, u8),
    adds: u8,
    deletes: u8,
    increases: [i64; 3],
    increased: u8,
    assigned: [Option<i64>; 3],
}

impl Happening {
    /// The start or the end of an action with a duration; none if it contradicts itself.
    fn new(action: &Action, moment: Moment, duration: i64) -> Option<Self> {
        let mut own = Self::default();
        for (_, condition) in action.conditions.iter().filter(|(at, _)| *at == moment) {
            let reads = condition.reads();
            own.reads = (own.reads.0 | reads.0, own.reads.1 | reads.1);
        }
        if action.is_bounded_by_charge && moment == Moment::Start {
            own.reads.1 |= 1 << 1;
        }
        for (_, effect) in action.effects.iter().filter(|(at, _)| *at == moment) {
            match effect {
                Effect::Set(fact, true) => own.adds |= 1 << fact,
                Effect::Set(fact, false) => own.deletes |= 1 << fact,
                Effect::Increase(number, amount) => {
                    own.increases[*number] += amount.of(duration);
                    own.increased |= 1 << number;
                }
                Effect::Assign(number, amount) => {
                    let value = amount.of(duration);
                    if own.assigned[*number].replace(value).is_some_and(|other| other != value) {
                        return None;
                    }
                }
            }
        }
        (own.assigned() & own.increased == 0).then_some(own)
    }

    fn assigned(&self) -> u8 {
        self.assigned.iter().enumerate().filter(|(_, value)| value.is_some()).map(|(at, _)| 1 << at).sum()
    }

    fn interferes(&self, other: &Self) -> bool {
        let disturbs = |one: &Self, other: &Self| {
            (one.adds | one.deletes) & other.reads.0 != 0
                || one.adds & other.deletes != 0
                || (one.increased | one.assigned()) & other.reads.1 != 0
                || one.assigned() & (other.increased | other.assigned()) != 0
        };
        disturbs(self, other) || disturbs(other, self)
    }

    fn apply(&self, state: &mut State) {
        state.facts = state.facts & !self.deletes | self.adds;
        for (number, value) in state.numbers.iter_mut().enumerate() {
            *value = self.assigned[number].unwrap_or(*value) + self.increases[number];
        }
    }
}

impl Task {
    fn holds(&self, action: usize, moment: Moment, state: &State) -> bool {
        let mut conditions = self.actions[action].conditions.iter().filter(|(at, _)| *at == moment);
        conditions.all(|(_, condition)| condition.holds(state))
    }

    /// What a plan comes to; none if it is not valid.
    fn value(&self, plan: &[Step]) -> Option<i64> {
        let mut times: Vec<i64> =
            plan.iter().flat_map(|(start, _, duration)| [*start, start + duration]).collect();
        times.sort_unstable();
        times.dedup();
        let mut state = self.initial;
        let mut trajectory = vec![(0, state)];
        for time in times {
            let mut happenings: Vec<Happening> = Vec::new();
            for (start, action, duration) in plan {
                let own = &self.actions[*action];
                for (moment, at) in [(Moment::Start, *start), (Moment::End, start + duration)] {
                    if at != time || (moment == Moment::End && own.durations.is_none()) {
                        continue;
                    }
                    let is_short = !own.is_bounded_by_charge || *duration <= state.numbers[1] + 1;
                    if !self.holds(*action, moment, &state) || (moment == Moment::Start && !is_short) {
                        return None;
                    }
                    happenings.push(Happening::new(own, moment, *duration)?);
                }
            }
            for (position, one) in happenings.iter().enumerate() {
                if happenings[position + 1..].iter().any(|other| one.interferes(other)) {
                    return None;
                }
            }
            happenings.iter().for_each(|happening| happening.apply(&mut state));
            trajectory.push((time, state));
            for (start, action, duration) in plan {
                if *start <= time && time < start + duration && !self.holds(*action, Moment::OverAll, &state)
                {
                    return None;
                }
            }
        }
        if !self.goal.iter().all(|goal| goal.holds(&state)) {
            return None;
        }
        let mut value = plan.iter().map(|(start, _, duration)| start + duration).max().unwrap_or(0);
        if self.is_paid {
            value += state.numbers[PAID];
        }
        if let Some((wish, weight)) = &self.wish {
            value += if wish.holds(&state) { 0 } else { *weight };
        }
        for constraint in self.constraints.iter().filter(|constraint| !constraint.is_kept(&trajectory)) {
            if !constraint.is_soft {
                return None;
            }
            value += self.weight;
        }
        Some(value)
    }

    /// The least value of the plans that are tried.
    pub(super) fn best(&self, rng: &mut Rng) -> Option<i64> {
        let mut steps: Vec<Step> = Vec::new();
        for (number, action) in self.actions.iter().enumerate() {
            let (least, most) = action.durations.unwrap_or((0, 0));
            steps.extend(
                (0..=LAST).flat_map(|start| (least..=most).map(move |duration| (start, number, duration))),
            );
        }
        steps.sort_unstable();
        let mut best = self.value(&[]);
        let mut see = |value: Option<i64>| best = best.into_iter().chain(value).min();
        for (position, one) in steps.iter().enumerate() {
            see(self.value(&[*one]));
            steps[position..].iter().for_each(|other| see(self.value(&[*one, *other])));
        }
        for _ in 0..LONG_PLANS {
            let [a, b, c] = [0; 3].map(|_| steps[rng.usize(0..steps.len())]);
            see(self.value(&[a, b, c]));
        }
        best
    }
}

impl Constraint {
    /// Whether it is kept in a sequence of states with their times [A. Gerevini, P. Haslum, D. Long, A. Saetti, Y. Dimopoulos:
    /// Deterministic planning in the fifth international planning competition, Artificial Intelligence 173, 2009].
    fn is_kept(&self, states: &[(i64, State)]) -> bool {
        let [first, second] = [&self.first, &self.second]
            .map(|own| states.iter().map(|(_, state)| own.holds(state)).collect::<Vec<_>>());
        let count = states.len();
        let soon = |from: usize, to: usize| states[to].0 - states[from].0 <= self.time;
        match self.kind {
            "at end" => first[count - 1],
            "always" => first.iter().all(|holds| *holds),
            "sometime" => first.iter().any(|holds| *holds),
            "within" => (0..count).any(|i| first[i] && states[i].0 <= self.time),
            "at-most-once" => first.chunk_by(|one, other| one == other).filter(|run| run[0]).count() <= 1,
            "sometime-after" => (0..count).all(|i| !first[i] || (i..count).any(|j| second[j])),
            "sometime-before" => (0..count).all(|i| !first[i] || (0..i).any(|j| second[j])),
            "always-within" => (0..count).all(|i| !first[i] || (i..count).any(|j| second[j] && soon(i, j))),
            other => panic!("{other}"),
        }
    }
}
