//! Executes and enumerates plans with integer times by the definitions of PDDL 2.1 and PDDL 3.

use fastrand::Rng;

use super::{Action, Amount, Constraint, Effect, Formula, Moment, State, Task};

/// Index of `total-cost` in [`State::numbers`].
pub(super) const PAID: usize = 2;
const LAST_START: i64 = 3;
/// Number of random plans with three actions. Shorter plans are enumerated exhaustively.
const LONG_PLANS: usize = 200;

/// Step of a plan: start, number of the action, duration.
type Step = (i64, usize, i64);

impl Formula {
    fn holds(&self, state: &State) -> bool {
        match self {
            Self::Fact(fact, value) => (state.facts >> fact & 1 == 1) == *value,
            Self::AtLeast(number, bound) => state.numbers[*number] >= *bound,
            Self::AtMost(number, bound) => state.numbers[*number] <= *bound,
            Self::And(left, right) => left.holds(state) && right.holds(state),
            Self::Or(left, right) => left.holds(state) || right.holds(state),
        }
    }

    /// Returns the facts and the numbers that the formula reads, as bit sets.
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

/// Effects of the start or the end of an action, and the facts and numbers that it reads. Sets are bit sets.
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
    fn new(action: &Action, moment: Moment, duration: i64) -> Option<Self> {
        let mut happening = Self::default();
        for (_, condition) in action.conditions.iter().filter(|(at, _)| *at == moment) {
            let reads = condition.reads();
            happening.reads = (happening.reads.0 | reads.0, happening.reads.1 | reads.1);
        }
        // The duration constraint reads `(charge)` at the start.
        if action.is_bounded_by_charge && moment == Moment::Start {
            happening.reads.1 |= 1 << 1;
        }
        for (_, effect) in action.effects.iter().filter(|(at, _)| *at == moment) {
            match effect {
                Effect::Set(fact, true) => happening.adds |= 1 << fact,
                Effect::Set(fact, false) => happening.deletes |= 1 << fact,
                Effect::Increase(number, amount) => {
                    happening.increases[*number] += amount.of(duration);
                    happening.increased |= 1 << number;
                }
                Effect::Assign(number, amount) => {
                    let value = amount.of(duration);
                    if happening.assigned[*number].replace(value).is_some_and(|other| other != value) {
                        return None;
                    }
                }
            }
        }
        // An assignment conflicts with an increase of the same number at the same time.
        (happening.assigned() & happening.increased == 0).then_some(happening)
    }

    fn assigned(&self) -> u8 {
        self.assigned.iter().enumerate().filter(|(_, value)| value.is_some()).map(|(at, _)| 1 << at).sum()
    }

    fn interferes(&self, other: &Self) -> bool {
        // Two happenings interfere if one writes what the other reads, adds a fact that the other deletes, or
        // assigns a number that the other writes. Two increases commute.
        let disturbs = |writer: &Self, reader: &Self| {
            (writer.adds | writer.deletes) & reader.reads.0 != 0
                || writer.adds & reader.deletes != 0
                || (writer.increased | writer.assigned()) & reader.reads.1 != 0
                || writer.assigned() & (reader.increased | reader.assigned()) != 0
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

    fn value(&self, plan: &[Step]) -> Option<i64> {
        let mut times: Vec<i64> =
            plan.iter().flat_map(|(start, _, duration)| [*start, start + duration]).collect();
        times.sort_unstable();
        times.dedup();
        let mut state = self.initial;
        let mut trajectory = vec![(0, state)];
        for time in times {
            let mut happenings: Vec<Happening> = Vec::new();
            // The conditions of all happenings at a time are evaluated in the state before this time.
            for (start, action, duration) in plan {
                let schema = &self.actions[*action];
                for (moment, at) in [(Moment::Start, *start), (Moment::End, start + duration)] {
                    if at != time || (moment == Moment::End && schema.durations.is_none()) {
                        continue;
                    }
                    let is_within_charge = !schema.is_bounded_by_charge || *duration <= state.numbers[1] + 1;
                    if !self.holds(*action, moment, &state) || (moment == Moment::Start && !is_within_charge)
                    {
                        return None;
                    }
                    happenings.push(Happening::new(schema, moment, *duration)?);
                }
            }
            for (position, happening) in happenings.iter().enumerate() {
                if happenings[position + 1..].iter().any(|later| happening.interferes(later)) {
                    return None;
                }
            }
            happenings.iter().for_each(|happening| happening.apply(&mut state));
            trajectory.push((time, state));
            // Conditions over all must hold in every state from the start until before the end.
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

    pub(super) fn best(&self, rng: &mut Rng) -> Option<i64> {
        let mut steps: Vec<Step> = Vec::new();
        for (number, action) in self.actions.iter().enumerate() {
            let (least, most) = action.durations.unwrap_or((0, 0));
            steps.extend(
                (0..=LAST_START)
                    .flat_map(|start| (least..=most).map(move |duration| (start, number, duration))),
            );
        }
        steps.sort_unstable();
        let mut best = self.value(&[]);
        let mut consider = |value: Option<i64>| best = best.into_iter().chain(value).min();
        for (position, first) in steps.iter().enumerate() {
            consider(self.value(&[*first]));
            steps[position..].iter().for_each(|second| consider(self.value(&[*first, *second])));
        }
        for _ in 0..LONG_PLANS {
            let [a, b, c] = [0; 3].map(|_| steps[rng.usize(0..steps.len())]);
            consider(self.value(&[a, b, c]));
        }
        best
    }
}

impl Constraint {
    /// Returns `true` if a trajectory satisfies the constraint [A. Gerevini, P. Haslum, D. Long, A. Saetti, Y. Dimopoulos:
    /// Deterministic planning in the fifth international planning competition, Artificial Intelligence 173, 2009].
    fn is_kept(&self, states: &[(i64, State)]) -> bool {
        let [first, second] = [&self.first, &self.second]
            .map(|formula| states.iter().map(|(_, state)| formula.holds(state)).collect::<Vec<_>>());
        let count = states.len();
        let in_time = |from: usize, to: usize| states[to].0 - states[from].0 <= self.time;
        match self.kind {
            "at end" => first[count - 1],
            "always" => first.iter().all(|holds| *holds),
            "sometime" => first.iter().any(|holds| *holds),
            "within" => (0..count).any(|i| first[i] && states[i].0 <= self.time),
            "at-most-once" => first.chunk_by(|left, right| left == right).filter(|run| run[0]).count() <= 1,
            "sometime-after" => (0..count).all(|i| !first[i] || (i..count).any(|j| second[j])),
            "sometime-before" => (0..count).all(|i| !first[i] || (0..i).any(|j| second[j])),
            "always-within" => {
                (0..count).all(|i| !first[i] || (i..count).any(|j| second[j] && in_time(i, j)))
            }
            unknown => panic!("{unknown}"),
        }
    }
}
