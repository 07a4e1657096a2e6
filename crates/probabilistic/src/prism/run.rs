//! A state of a program to its choices.
//!
//! Most commands stand alone, with probabilities that are constants: these write their successors straight into the packed
//! state. Only commands of several modules that move together, and those of Markov chains, are combined first.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::Signed;
use smallvec::SmallVec;

use crate::error::{Diagnostic, Error, Place};
use crate::explore::{Choices, Generator};
use crate::mdp::dense;
use crate::number::Number;
use crate::prism::ast::ModelKind;
use crate::prism::code::{Code, Fault, rounded};
use crate::prism::command::{Command, RewardItem, Variable};
use crate::prism::model::{Group, Program, UNNAMED};
use crate::prism::state::{Packed, above_least};

/// The values of the variables, of one state at a time.
pub(super) type Values = SmallVec<[i64; 16]>;
/// The rewards of a choice.
pub(super) type Sums<N> = SmallVec<[N; 4]>;

/// Ends of the combined commands of an action in one state, at most.
pub(super) const COMBINED: usize = 1_000_000;

/// The enabled commands of one action, which move together: one of each module.
struct Meeting<N> {
    action: u32,
    /// Where the commands of each module begin.
    modules: SmallVec<[u32; 4]>,
    /// Where the updates of each command end.
    commands: SmallVec<[u32; 8]>,
    /// The probability of each update that is possible, and where its changes end.
    updates: SmallVec<[(N, u32); 8]>,
    /// Variables with their new values.
    changes: SmallVec<[(u32, i64); 16]>,
}

impl<N: Number> Program<N> {
    /// What modules can do together in a state; false if one of them has no enabled command.
    fn meet(
        &self,
        meeting: &mut Meeting<N>,
        action: u32,
        groups: &[Group<N>],
        values: &[i64],
    ) -> Result<bool, Error> {
        meeting.begin(action);
        let mut commands: SmallVec<[&Command<N>; 8]> = SmallVec::new();
        for group in groups {
            let begin = commands.len();
            meeting.modules.push(dense(begin));
            for command in enabled(group, values) {
                commands.push(command?);
            }
            if commands.len() == begin {
                return Ok(false);
            }
        }
        for command in &commands {
            self.effects(meeting, command, values)?;
        }
        let mut outcomes = 1_usize;
        for module in 0..groups.len() {
            let mut ends = 0_usize;
            for at in meeting.of(module) {
                ends = ends.saturating_add(outcomes.saturating_mul(meeting.updates_of(at).len()));
                if ends > COMBINED && module > 0 {
                    let text = format!("more than {COMBINED} ways in which modules move together in a state");
                    return Err(Diagnostic::new("Q306", commands[at].place, text).into());
                }
            }
            outcomes = ends;
        }
        Ok(true)
    }

    /// Adds the updates of a command in a state.
    fn effects(&self, meeting: &mut Meeting<N>, command: &Command<N>, values: &[i64]) -> Result<(), Error> {
        for (update, probability) in command.updates.iter().zip(&*command.probabilities(values)?) {
            if probability.is_zero() {
                continue;
            }
            for (variable, code, place) in &update.assignments {
                meeting.changes.push((*variable, self.assigned(*variable, code, *place, values)?));
            }
            meeting.updates.push((probability.clone(), dense(meeting.changes.len())));
        }
        meeting.commands.push(dense(meeting.updates.len()));
        Ok(())
    }

    /// What an assignment makes of a variable, which must be in its range.
    pub(super) fn assigned(
        &self,
        variable: u32,
        code: &Code,
        place: Place,
        values: &[i64],
    ) -> Result<i64, Error> {
        let value = code.whole(values).map_err(|fault| at(fault, place))?;
        let Variable { name, least, greatest, .. } = &self.variables[variable as usize];
        if (*least..=*greatest).contains(&value) {
            return Ok(value);
        }
        let text = format!("`{name}` becomes {value}, which is not in its range [{least}..{greatest}]");
        Err(Diagnostic::new("Q305", place, text).into())
    }

    /// The states that a choice of one command of each module leads to.
    fn lead(&self, state: &Packed, meeting: &Meeting<N>, chosen: &[usize], mut to: impl FnMut(Packed, N)) {
        let updates = |module: usize| meeting.updates_of(chosen[module]);
        let mut at: SmallVec<[usize; 8]> = (0..chosen.len()).map(|module| updates(module).start).collect();
        if (0..chosen.len()).any(|module| updates(module).is_empty()) {
            return;
        }
        loop {
            let mut next = state.clone();
            let mut together: Option<N> = None;
            for update in &at {
                let (probability, end) = &meeting.updates[*update];
                let begin = update.checked_sub(1).map_or(0, |before| meeting.updates[before].1);
                for (variable, value) in &meeting.changes[begin as usize..*end as usize] {
                    self.layout.set(&mut next, *variable, *value);
                }
                together = Some(match together {
                    Some(before) => before.times(probability),
                    None => probability.clone(),
                });
            }
            if let Some(probability) = together {
                to(next, probability);
            }
            // The updates of the last module change first.
            let Some(changes) =
                (0..at.len()).rev().find(|module| at[*module].saturating_add(1) < updates(*module).end)
            else {
                return;
            };
            at[changes] = at[changes].saturating_add(1);
            for (module, at) in at.iter_mut().enumerate().skip(changes.saturating_add(1)) {
                *at = updates(module).start;
            }
        }
    }
}

impl<N> Meeting<N> {
    const fn new() -> Self {
        Self {
            action: UNNAMED,
            modules: SmallVec::new_const(),
            commands: SmallVec::new_const(),
            updates: SmallVec::new_const(),
            changes: SmallVec::new_const(),
        }
    }

    /// Forgets what was, for another action.
    fn begin(&mut self, action: u32) {
        self.action = action;
        self.modules.clear();
        self.commands.clear();
        self.updates.clear();
        self.changes.clear();
    }

    /// The commands of a module, by position.
    fn of(&self, module: usize) -> std::ops::Range<usize> {
        let end = self.modules.get(module.saturating_add(1)).map_or(self.commands.len(), |end| *end as usize);
        self.modules[module] as usize..end
    }

    /// The updates of a command, by position.
    fn updates_of(&self, command: usize) -> std::ops::Range<usize> {
        let begin = command.checked_sub(1).map_or(0, |before| self.commands[before]);
        begin as usize..self.commands[command] as usize
    }

    /// In how many ways one command of each module can be chosen.
    fn ways(&self) -> usize {
        (0..self.modules.len()).map(|module| self.of(module).len()).product()
    }

    /// Each way to choose one command of each module.
    fn each<E>(&self, mut way: impl FnMut(&[usize]) -> Result<(), E>) -> Result<(), E> {
        let mut at: SmallVec<[usize; 8]> = self.modules.iter().map(|begin| *begin as usize).collect();
        loop {
            way(&at)?;
            // The command of the first module changes first.
            let Some(changes) = (0..at.len()).find(|own| at[*own].saturating_add(1) < self.of(*own).end)
            else {
                return Ok(());
            };
            at[changes] = at[changes].saturating_add(1);
            for (own, begin) in at.iter_mut().zip(&self.modules).take(changes) {
                *own = *begin as usize;
            }
        }
    }
}

/// The enabled commands of a group.
pub(super) fn enabled<'a, N: Number>(
    group: &'a Group<N>,
    values: &'a [i64],
) -> impl Iterator<Item = Result<&'a Command<N>, Error>> {
    let (listed, all): (&[u32], _) = match &group.index {
        Some((variable, least, table)) => (&table[above_least(values[*variable as usize], *least)], 0),
        None => (&[], group.commands.len()),
    };
    let candidates = listed.iter().map(|number| *number as usize).chain(0..all);
    candidates.filter_map(move |number| {
        let command = &group.commands[number];
        match command.guard.holds(values) {
            Ok(true) => Some(Ok(command)),
            Ok(false) => None,
            Err(fault) => Some(Err(at(fault, command.place))),
        }
    })
}

impl<N: Number> Program<N> {
    /// The values of the variables in a state.
    pub(super) fn values_of(&self, state: &Packed) -> Values {
        self.layout.values(state).collect()
    }

    /// The reward of a state alone, by the number of its structure.
    pub(crate) fn state_reward(&self, structure: usize, values: &[i64]) -> Result<N, Error> {
        sum(&self.rewards[structure].states, values)
    }

    pub(super) fn state_rewards(&self, values: &[i64]) -> Result<Sums<N>, Error> {
        self.wanted.iter().map(|structure| sum(&self.rewards[*structure].states, values)).collect()
    }

    pub(super) fn action_rewards(&self, action: u32, values: &[i64]) -> Result<Sums<N>, Error> {
        let items = |structure: &usize| {
            let structure = &self.rewards[*structure];
            structure.actions.get(action as usize).unwrap_or(&structure.unnamed)
        };
        self.wanted.iter().map(|structure| sum(items(structure), values)).collect()
    }

    /// The actions that the values of single variables leave possible.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "words hold 64 actions, and there are as many words as the actions need; bits is not 0 where its last one is taken"
    )]
    fn possible(&self, values: &[i64]) -> impl Iterator<Item = usize> {
        let words = self.actions.len().div_ceil(64);
        (0..words).flat_map(move |word| {
            let count = self.actions.len() - word * 64;
            let all = if count >= 64 { u64::MAX } else { (1 << count) - 1 };
            let mut bits = self.masks.iter().fold(all, |bits, mask| {
                bits & mask.table[above_least(values[mask.variable as usize], mask.least)][word]
            });
            std::iter::from_fn(move || {
                let first = (bits != 0).then(|| bits.trailing_zeros() as usize)?;
                bits &= bits - 1;
                Some(word * 64 + first)
            })
        })
    }

    /// Writes the successors of a command that stands alone.
    fn alone(
        &self,
        command: &Command<N>,
        state: &Packed,
        values: &[i64],
        choices: &mut Choices<Packed, N>,
    ) -> Result<(), Error> {
        for (update, probability) in command.updates.iter().zip(&*command.probabilities(values)?) {
            if probability.is_zero() {
                continue;
            }
            let mut next = state.clone();
            for (variable, code, place) in &update.assignments {
                self.layout.set(&mut next, *variable, self.assigned(*variable, code, *place, values)?);
            }
            choices.to(next, probability.clone());
        }
        Ok(())
    }

    /// All choices of a state of a decision process.
    fn choices(
        &self,
        state: &Packed,
        values: &Values,
        choices: &mut Choices<Packed, N>,
    ) -> Result<(), Error> {
        let of_state = self.state_rewards(values)?;
        let rewards = |more: &Sums<N>| {
            let sums: Sums<N> = of_state.iter().zip(more).map(|(a, b)| a.plus(b)).collect();
            sums
        };
        for group in &self.free {
            for command in enabled(group, values) {
                self.alone(command?, state, values, choices)?;
                choices.end(UNNAMED, rewards(&self.action_rewards(UNNAMED, values)?));
            }
        }
        let mut meeting = Meeting::new();
        for action in self.possible(values) {
            let number = dense(action);
            match &self.synchronised[action][..] {
                [group] => {
                    for command in enabled(group, values) {
                        self.alone(command?, state, values, choices)?;
                        choices.end(number, rewards(&self.action_rewards(number, values)?));
                    }
                }
                groups => {
                    if !self.meet(&mut meeting, number, groups, values)? {
                        continue;
                    }
                    let sums = rewards(&self.action_rewards(number, values)?);
                    meeting.each(|chosen| {
                        self.lead(state, &meeting, chosen, |next, probability| choices.to(next, probability));
                        choices.end(number, sums.iter().cloned());
                        Ok::<(), Error>(())
                    })?;
                }
            }
        }
        Ok(())
    }

    /// The one choice of a state of a Markov chain: each of the commands with the same probability.
    fn step(&self, state: &Packed, values: &Values, choices: &mut Choices<Packed, N>) -> Result<(), Error> {
        let mut meetings: SmallVec<[Meeting<N>; 1]> = SmallVec::new();
        let mut meet = |action: u32, groups: &[Group<N>]| {
            let mut meeting = Meeting::new();
            if self.meet(&mut meeting, action, groups, values)? {
                meetings.push(meeting);
            }
            Ok::<(), Error>(())
        };
        for group in &self.free {
            meet(UNNAMED, std::slice::from_ref(group))?;
        }
        for action in self.possible(values) {
            meet(dense(action), &self.synchronised[action])?;
        }
        let ways = meetings.iter().map(Meeting::ways).fold(0, usize::saturating_add);
        if ways == 0 {
            return Ok(());
        }
        let count = (ways > 1).then(|| N::from_rational(&BigRational::from(BigInt::from(ways))));
        let share = |number: &N| count.as_ref().map_or_else(|| number.clone(), |count| number.over(count));
        let mut total = self.state_rewards(values)?;
        for meeting in &meetings {
            let rewards = self.action_rewards(meeting.action, values)?;
            meeting.each(|chosen| {
                for (sum, more) in total.iter_mut().zip(&rewards) {
                    *sum = sum.plus(&share(more));
                }
                self.lead(state, meeting, chosen, |next, probability| choices.to(next, share(&probability)));
                Ok::<(), Error>(())
            })?;
        }
        choices.end(if ways == 1 { meetings[0].action } else { UNNAMED }, total);
        Ok(())
    }
}

impl<N: Number> Generator<N> for Program<N> {
    type State = Packed;

    fn initial(&self) -> Packed {
        self.starts.first().cloned().unwrap_or_default()
    }

    fn starts(&self) -> Vec<Packed> {
        self.starts.clone()
    }

    fn rewards(&self) -> usize {
        self.wanted.len()
    }

    fn codes(&self) -> Option<usize> {
        self.layout.codes()
    }

    fn code(&self, state: &Packed) -> usize {
        self.layout.code(state)
    }

    fn successors(&self, state: &Packed, choices: &mut Choices<Packed, N>) -> Result<(), Error> {
        let values = self.values_of(state);
        if self.stop.as_ref().is_some_and(|stop| stop.holds(&values).unwrap_or(false)) {
            choices.to(state.clone(), N::one());
            choices.end(UNNAMED, self.wanted.iter().map(|_| N::zero()));
            return Ok(());
        }
        match self.kind {
            ModelKind::Mdp => self.choices(state, &values, choices),
            ModelKind::Dtmc => self.step(state, &values, choices),
        }
    }
}

fn at(Fault(text): Fault, place: Place) -> Error {
    Diagnostic::new("Q303", place, text).into()
}

/// The sum of some rewards of a state.
fn sum<N: Number>(items: &[RewardItem<N>], values: &[i64]) -> Result<N, Error> {
    let mut sum = N::zero();
    for item in items {
        let fault = |fault| at(fault, item.place);
        if item.guard.holds(values).map_err(fault)? {
            if let Some(reward) = &item.certain {
                sum = sum.plus(reward);
                continue;
            }
            let reward = item.reward.number(values).map_err(fault)?;
            if reward.is_negative() {
                let text = format!("a negative reward, {}", Number::to_f64(&reward));
                return Err(Diagnostic::new("Q304", item.place, text).into());
            }
            sum = sum.plus(&rounded(&reward).map_err(fault)?);
        }
    }
    Ok(sum)
}
