//! Computes the choices of a state from the commands of a program.
//!
//! Most commands do not synchronise and have constant probabilities; their successors are written directly as packed
//! states. Only synchronised commands and Markov chains need combinations of commands.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::Signed;
use smallvec::SmallVec;

use crate::error::{Diagnostic, Error, Place};
use crate::explore::{Choices, Generator};
use crate::mdp::dense;
use crate::number::{Number, RewardSum, sum_of_rewards};
use crate::prism::ast::ModelKind;
use crate::prism::code::{Code, Fault, rounded};
use crate::prism::command::{Command, RewardItem, Variable};
use crate::prism::model::{Group, Program, UNNAMED};
use crate::prism::state::{Packed, above_least};

pub(super) type Values = SmallVec<[i64; 16]>;
/// The rewards of a state or choice: one for each reward structure whose rewards are computed.
pub(super) type Sums<N> = SmallVec<[N; 4]>;

/// Upper limit on the number of successors of an action in one state, if several modules synchronise on the
/// action.
pub(super) const MAX_COMBINED: usize = 1_000_000;

/// The enabled commands of the modules that synchronise on an action. A joint step executes one command of each
/// module.
struct JointStep<N> {
    action: u32,
    /// For each module, the start of its commands in `commands`.
    modules: SmallVec<[u32; 4]>,
    /// For each command, the end of its updates in `updates`.
    commands: SmallVec<[u32; 8]>,
    /// For each update, its probability (not 0) and the end of its assignments in `changes`.
    updates: SmallVec<[(N, u32); 8]>,
    changes: SmallVec<[(u32, i64); 16]>,
}

impl<N: Number> Program<N> {
    /// Collects the enabled commands of the synchronising modules in `joint`. Returns `false` if a module has
    /// no enabled command. Fails if an expression has no valid value, or if the combinations of the commands
    /// of several modules have more than [`MAX_COMBINED`] successors.
    fn synchronise(
        &self,
        joint: &mut JointStep<N>,
        action: u32,
        groups: &[Group<N>],
        values: &[i64],
    ) -> Result<bool, Error> {
        joint.begin(action);
        let mut commands: SmallVec<[&Command<N>; 8]> = SmallVec::new();
        for group in groups {
            let begin = commands.len();
            joint.modules.push(dense(begin));
            for command in enabled(group, values) {
                commands.push(command?);
            }
            if commands.len() == begin {
                return Ok(false);
            }
        }
        for command in &commands {
            self.effects(joint, command, values)?;
        }
        let mut outcomes = 1_usize;
        for module in 0..groups.len() {
            let mut ends = 0_usize;
            for at in joint.of(module) {
                ends = ends.saturating_add(outcomes.saturating_mul(joint.updates_of(at).len()));
                // With a single module, nothing is combined, so there is no limit.
                if ends > MAX_COMBINED && module > 0 {
                    let text =
                        format!("more than {MAX_COMBINED} combinations of synchronised commands in a state");
                    return Err(Diagnostic::new("Q306", commands[at].place, text).into());
                }
            }
            outcomes = ends;
        }
        Ok(true)
    }

    fn effects(&self, joint: &mut JointStep<N>, command: &Command<N>, values: &[i64]) -> Result<(), Error> {
        for (update, probability) in command.updates.iter().zip(&*command.probabilities(values)?) {
            if probability.is_zero() {
                continue;
            }
            for (variable, code, place) in &update.assignments {
                joint.changes.push((*variable, self.assigned(*variable, code, *place, values)?));
            }
            joint.updates.push((probability.clone(), dense(joint.changes.len())));
        }
        joint.commands.push(dense(joint.updates.len()));
        Ok(())
    }

    /// Evaluates the value of an assignment. A value outside the range of the variable is an error.
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

    /// Calls `to` with each successor (and its probability) of the commands `chosen`, one per module.
    fn expand(&self, state: &Packed, joint: &JointStep<N>, chosen: &[usize], mut to: impl FnMut(Packed, N)) {
        let updates = |module: usize| joint.updates_of(chosen[module]);
        let mut at: SmallVec<[usize; 8]> = (0..chosen.len()).map(|module| updates(module).start).collect();
        if (0..chosen.len()).any(|module| updates(module).is_empty()) {
            return;
        }
        loop {
            let mut next = state.clone();
            let mut accumulated: Option<N> = None;
            for update in &at {
                let (probability, end) = &joint.updates[*update];
                let begin = update.checked_sub(1).map_or(0, |before| joint.updates[before].1);
                for (variable, value) in &joint.changes[begin as usize..*end as usize] {
                    self.layout.set(&mut next, *variable, *value);
                }
                accumulated = Some(match accumulated {
                    Some(before) => before.times(probability),
                    None => probability.clone(),
                });
            }
            if let Some(probability) = accumulated {
                to(next, probability);
            }
            // The update of the last module varies fastest.
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

impl<N> JointStep<N> {
    const fn new() -> Self {
        Self {
            action: UNNAMED,
            modules: SmallVec::new_const(),
            commands: SmallVec::new_const(),
            updates: SmallVec::new_const(),
            changes: SmallVec::new_const(),
        }
    }

    fn begin(&mut self, action: u32) {
        self.action = action;
        self.modules.clear();
        self.commands.clear();
        self.updates.clear();
        self.changes.clear();
    }

    fn of(&self, module: usize) -> std::ops::Range<usize> {
        let end = self.modules.get(module.saturating_add(1)).map_or(self.commands.len(), |end| *end as usize);
        self.modules[module] as usize..end
    }

    fn updates_of(&self, command: usize) -> std::ops::Range<usize> {
        let begin = command.checked_sub(1).map_or(0, |before| self.commands[before]);
        begin as usize..self.commands[command] as usize
    }

    fn combinations(&self) -> usize {
        (0..self.modules.len()).map(|module| self.of(module).len()).product()
    }

    /// Calls `visit` with each combination of one command per module, as positions in `commands`.
    fn each<E>(&self, mut visit: impl FnMut(&[usize]) -> Result<(), E>) -> Result<(), E> {
        let mut at: SmallVec<[usize; 8]> = self.modules.iter().map(|begin| *begin as usize).collect();
        loop {
            visit(&at)?;
            // The command of the first module varies fastest.
            let Some(changes) =
                (0..at.len()).find(|module| at[*module].saturating_add(1) < self.of(*module).end)
            else {
                return Ok(());
            };
            at[changes] = at[changes].saturating_add(1);
            for (command, begin) in at.iter_mut().zip(&self.modules).take(changes) {
                *command = *begin as usize;
            }
        }
    }
}

pub(super) fn enabled<'a, N: Number>(
    group: &'a Group<N>,
    values: &'a [i64],
) -> impl Iterator<Item = Result<&'a Command<N>, Error>> {
    let (indexed, unindexed_count): (&[u32], _) = match &group.index {
        Some((variable, least, table)) => (&table[above_least(values[*variable as usize], *least)], 0),
        None => (&[], group.commands.len()),
    };
    let candidates = indexed.iter().map(|number| *number as usize).chain(0..unindexed_count);
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
    pub(super) fn values_of(&self, state: &Packed) -> Values {
        self.layout.values(state).collect()
    }

    pub(crate) fn state_reward(&self, structure: usize, values: &[i64]) -> Result<N, Error> {
        sum(&self.rewards[structure].states, values)
    }

    pub(crate) fn state_reward_count(&self, structure: usize) -> usize {
        self.rewards[structure].states.len()
    }

    pub(super) fn state_rewards(&self, values: &[i64]) -> Result<Sums<N>, Error> {
        self.computed_rewards.iter().map(|structure| sum(&self.rewards[*structure].states, values)).collect()
    }

    pub(super) fn action_rewards(&self, action: u32, values: &[i64]) -> Result<Sums<N>, Error> {
        let items = |structure: &usize| {
            let structure = &self.rewards[*structure];
            structure.actions.get(action as usize).unwrap_or(&structure.unnamed)
        };
        self.computed_rewards.iter().map(|structure| sum(items(structure), values)).collect()
    }

    /// Returns the actions that may be enabled according to the values of single variables.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "words hold 64 actions, and there are as many words as the actions need; bits is not 0 where its last one is taken"
    )]
    fn possible(&self, values: &[i64]) -> impl Iterator<Item = usize> {
        let words = self.actions.len().div_ceil(64);
        (0..words).flat_map(move |word| {
            let count = self.actions.len() - word * 64;
            let all_actions = if count >= 64 { u64::MAX } else { (1 << count) - 1 };
            let mut bits = self.masks.iter().fold(all_actions, |bits, mask| {
                bits & mask.table[above_least(values[mask.variable as usize], mask.least)][word]
            });
            std::iter::from_fn(move || {
                let first = (bits != 0).then(|| bits.trailing_zeros() as usize)?;
                bits &= bits - 1;
                Some(word * 64 + first)
            })
        })
    }

    fn single_command(
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

    fn choices(
        &self,
        state: &Packed,
        values: &Values,
        choices: &mut Choices<Packed, N>,
    ) -> Result<(), Error> {
        let state_sums = self.state_rewards(values)?;
        let rewards = |action_sums: &Sums<N>| {
            let sums: Sums<N> =
                state_sums.iter().zip(action_sums).map(|(a, b)| sum_of_rewards(a, b)).collect();
            sums
        };
        for group in &self.free {
            for command in enabled(group, values) {
                self.single_command(command?, state, values, choices)?;
                choices.end(UNNAMED, rewards(&self.action_rewards(UNNAMED, values)?));
            }
        }
        let mut joint = JointStep::new();
        for action in self.possible(values) {
            let number = dense(action);
            match &self.synchronised[action][..] {
                [group] => {
                    for command in enabled(group, values) {
                        self.single_command(command?, state, values, choices)?;
                        choices.end(number, rewards(&self.action_rewards(number, values)?));
                    }
                }
                groups => {
                    if !self.synchronise(&mut joint, number, groups, values)? {
                        continue;
                    }
                    let sums = rewards(&self.action_rewards(number, values)?);
                    joint.each(|chosen| {
                        self.expand(state, &joint, chosen, |next, probability| choices.to(next, probability));
                        choices.end(number, sums.iter().cloned());
                        Ok::<(), Error>(())
                    })?;
                }
            }
        }
        Ok(())
    }

    /// Adds the only choice of a state of a Markov chain: a uniform distribution over the combinations of
    /// enabled commands. A state without enabled commands gets no choice.
    fn step(&self, state: &Packed, values: &Values, choices: &mut Choices<Packed, N>) -> Result<(), Error> {
        let mut joint_steps: SmallVec<[JointStep<N>; 1]> = SmallVec::new();
        let mut collect = |action: u32, groups: &[Group<N>]| {
            let mut joint = JointStep::new();
            if self.synchronise(&mut joint, action, groups, values)? {
                joint_steps.push(joint);
            }
            Ok::<(), Error>(())
        };
        for group in &self.free {
            collect(UNNAMED, std::slice::from_ref(group))?;
        }
        for action in self.possible(values) {
            collect(dense(action), &self.synchronised[action])?;
        }
        let combinations = joint_steps.iter().map(JointStep::combinations).fold(0, usize::saturating_add);
        if combinations == 0 {
            return Ok(());
        }
        let count =
            (combinations > 1).then(|| N::from_rational(&BigRational::from(BigInt::from(combinations))));
        let share = |number: &N| count.as_ref().map_or_else(|| number.clone(), |count| number.over(count));
        let mut totals: SmallVec<[RewardSum<N>; 4]> =
            self.state_rewards(values)?.into_iter().map(RewardSum::new).collect();
        for joint in &joint_steps {
            let rewards = self.action_rewards(joint.action, values)?;
            joint.each(|chosen| {
                for (total, reward) in totals.iter_mut().zip(&rewards) {
                    total.add(&share(reward));
                }
                self.expand(state, joint, chosen, |next, probability| choices.to(next, share(&probability)));
                Ok::<(), Error>(())
            })?;
        }
        let action = if combinations == 1 { joint_steps[0].action } else { UNNAMED };
        choices.end(action, totals.into_iter().map(RewardSum::total));
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
        self.computed_rewards.len()
    }

    /// Returns the state rewards: the added loop belongs to no command, and therefore has no transition rewards.
    fn loop_rewards(&self, state: &Packed) -> Result<Vec<N>, Error> {
        Ok(self.state_rewards(&self.values_of(state))?.into_vec())
    }

    fn codes(&self) -> Option<usize> {
        self.layout.codes()
    }

    fn code(&self, state: &Packed) -> usize {
        self.layout.code(state)
    }

    fn successors(&self, state: &Packed, choices: &mut Choices<Packed, N>) -> Result<(), Error> {
        let values = self.values_of(state);
        // If the condition cannot be evaluated in a state, the state is expanded.
        if self.stop.as_ref().is_some_and(|stop| stop.holds(&values).unwrap_or(false)) {
            choices.to(state.clone(), N::one());
            choices.end(UNNAMED, self.computed_rewards.iter().map(|_| N::zero()));
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

fn sum<N: Number>(items: &[RewardItem<N>], values: &[i64]) -> Result<N, Error> {
    let mut sum = RewardSum::new(N::zero());
    for item in items {
        let fault = |fault| at(fault, item.place);
        if item.guard.holds(values).map_err(fault)? {
            if let Some(reward) = &item.certain {
                sum.add(reward);
                continue;
            }
            let reward = item.reward.number(values).map_err(fault)?;
            if reward.is_negative() {
                let text = format!("a negative reward, {}", Number::to_f64(&reward));
                return Err(Diagnostic::new("Q304", item.place, text).into());
            }
            sum.add(&rounded(&reward).map_err(fault)?);
        }
    }
    Ok(sum.total())
}
