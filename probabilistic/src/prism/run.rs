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
use crate::prism::state::{Packed, Valuation, above_least};

/// The values of the variables, of one state at a time.
type Values = SmallVec<[i64; 16]>;
/// The rewards of a choice.
type Sums<N> = SmallVec<[N; 4]>;

type Outcome<N> = Vec<(Valuation, N)>;

/// Ends of the combined commands of an action in one state, at most.
const COMBINED: usize = 1_000_000;

impl<N: Number> Program<N> {
    /// All combinations of what the enabled commands of some groups do together.
    fn combine(
        &self,
        groups: &[Group<N>],
        values: &Valuation,
        found: &mut Vec<Outcome<N>>,
    ) -> Result<(), Error> {
        let Some((first, others)) = groups.split_first() else { return Ok(()) };
        let mut combined: Vec<Outcome<N>> = Vec::new();
        for command in enabled(first, values) {
            let effects = self.effects(command?, values)?;
            let outcome =
                effects.into_iter().map(|(probability, changes)| (changed(values, &changes), probability));
            combined.push(outcome.collect());
        }
        for group in others {
            if combined.is_empty() {
                return Ok(());
            }
            let mut next = Vec::new();
            let (outcomes, mut ends) = (combined.iter().map(Vec::len).sum::<usize>(), 0_usize);
            for command in enabled(group, values) {
                let command = command?;
                let effects = self.effects(command, values)?;
                ends = ends.saturating_add(outcomes.saturating_mul(effects.len()));
                if ends > COMBINED {
                    let text = format!("more than {COMBINED} ways in which modules move together in a state");
                    return Err(Diagnostic::new("Q306", command.place, text).into());
                }
                next.extend(combined.iter().map(|outcome| join(outcome, &effects)));
            }
            combined = next;
        }
        found.append(&mut combined);
        Ok(())
    }

    /// The updates of a command in a state: probability, and the new values.
    fn effects(&self, command: &Command<N>, values: &[i64]) -> Result<Vec<Effect<N>>, Error> {
        let mut effects = Vec::with_capacity(command.updates.len());
        for (update, probability) in command.updates.iter().zip(&*command.probabilities(values)?) {
            if probability.is_zero() {
                continue;
            }
            let mut changes = Vec::with_capacity(update.assignments.len());
            for (variable, code, place) in &update.assignments {
                let value = self.assigned(*variable, code, *place, values)?;
                changes.push((*variable, value));
            }
            effects.push((probability.clone(), changes));
        }
        Ok(effects)
    }

    /// What an assignment makes of a variable, which must be in its range.
    fn assigned(&self, variable: u32, code: &Code, place: Place, values: &[i64]) -> Result<i64, Error> {
        let value = code.whole(values).map_err(|fault| at(fault, place))?;
        let Variable { name, least, greatest, .. } = &self.variables[variable as usize];
        if (*least..=*greatest).contains(&value) {
            return Ok(value);
        }
        let text = format!("`{name}` becomes {value}, which is not in its range [{least}..{greatest}]");
        Err(Diagnostic::new("Q305", place, text).into())
    }

    fn all_outcomes(&self, values: &Valuation) -> Result<Vec<(u32, Outcome<N>)>, Error> {
        let mut all = Vec::new();
        let mut found = Vec::new();
        for group in &self.free {
            self.combine(std::slice::from_ref(group), values, &mut found)?;
        }
        all.extend(found.drain(..).map(|outcome| (UNNAMED, outcome)));
        for (action, groups) in self.synchronised.iter().enumerate() {
            self.combine(groups, values, &mut found)?;
            all.extend(found.drain(..).map(|outcome| (dense(action), outcome)));
        }
        Ok(all)
    }
}

type Effect<N> = (N, Vec<(u32, i64)>);

fn join<N: Number>(outcome: &Outcome<N>, effects: &[Effect<N>]) -> Outcome<N> {
    let mut joined = Vec::with_capacity(outcome.len().saturating_mul(effects.len()));
    for (values, before) in outcome {
        for (probability, changes) in effects {
            joined.push((changed(values, changes), before.times(probability)));
        }
    }
    joined
}

fn changed(values: &Valuation, changes: &[(u32, i64)]) -> Valuation {
    let mut values = values.clone();
    for (variable, value) in changes {
        values[*variable as usize] = *value;
    }
    values
}

/// The enabled commands of a group.
fn enabled<'a, N: Number>(
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
    /// The reward of a state alone, by the number of its structure.
    pub(crate) fn state_reward(&self, structure: usize, values: &[i64]) -> Result<N, Error> {
        sum(&self.rewards[structure].states, values)
    }

    fn state_rewards(&self, values: &[i64]) -> Result<Sums<N>, Error> {
        self.wanted.iter().map(|structure| sum(&self.rewards[*structure].states, values)).collect()
    }

    fn action_rewards(&self, action: u32, values: &[i64]) -> Result<Sums<N>, Error> {
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
        let mut found = Vec::new();
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
                    self.combine(groups, &values.to_vec(), &mut found)?;
                    for outcome in found.drain(..) {
                        for (values, probability) in outcome {
                            choices.to(self.layout.pack(&values), probability);
                        }
                        choices.end(number, rewards(&self.action_rewards(number, values)?));
                    }
                }
            }
        }
        Ok(())
    }

    /// The one choice of a state of a Markov chain: each of the commands with the same probability.
    fn step(&self, values: &Values, choices: &mut Choices<Packed, N>) -> Result<(), Error> {
        let all = self.all_outcomes(&values.to_vec())?;
        if all.is_empty() {
            return Ok(());
        }
        let count = N::from_rational(&BigRational::from(BigInt::from(all.len())));
        let mut total = self.state_rewards(values)?;
        for (action, outcome) in &all {
            for (sum, more) in total.iter_mut().zip(self.action_rewards(*action, values)?) {
                *sum = sum.plus(&more.over(&count));
            }
            for (values, probability) in outcome {
                choices.to(self.layout.pack(values), probability.over(&count));
            }
        }
        let single = if let [(action, _)] = all[..] { action } else { UNNAMED };
        choices.end(single, total);
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
        let values: Values = self.layout.values(state).collect();
        match self.kind {
            ModelKind::Mdp => self.choices(state, &values, choices),
            ModelKind::Dtmc => self.step(&values, choices),
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
