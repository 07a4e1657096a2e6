//! Caches the evaluated commands of a module for each of its local states. A local state consists of the values
//! of the variables that the commands of the module read.
//!
//! A module usually has few local states, and each occurs in many states of the model. The commands of a local state
//! are evaluated once. Their effects are stored as edits of the words of a packed state. The evaluated commands of a
//! local state are called its behaviour.

use std::collections::BTreeSet;

use crate::error::Error;
use crate::mdp::dense;
use crate::number::Number;
use crate::prism::command::Command;
use crate::prism::memo::Numbers;
use crate::prism::model::{Group, Program};
use crate::prism::run::{Values, enabled};
use crate::prism::state::{Edit, Packed};

/// Upper limit on the number of actions of a cached model, because a behaviour (the evaluated
/// commands of a local state) stores its disabled actions in a `u128`.
pub const MAX_ACTIONS: usize = 128;
/// Limits for the cache of each module: number of behaviours (evaluated commands of local states),
/// and number of edits (changes of one word of a packed state, by which the effects are stored). If
/// one of them is reached, further behaviours are computed on every request.
const CACHE_LIMITS: [usize; 2] = [1 << 16, 1 << 20];
/// Cache entry of a local state in which the evaluation of a command fails.
const FAILED: u32 = u32::MAX - 1;

#[derive(Debug)]
pub struct Module<N> {
    /// The actions of the module: number of the action, and position of the module's command group
    /// in `Program::synchronised` for this action.
    pub actions: Vec<(usize, usize)>,
    numbers: Option<Numbers>,
    /// For each behaviour, the actions of the module that are disabled, as a bit set.
    prevented: Vec<u128>,
    /// For each behaviour: the start of its commands without action, the start of its commands for each action, and
    /// the end of its commands.
    slots: Vec<u32>,
    /// For each command, the end of its updates in `updates`.
    commands: Vec<u32>,
    /// For each update, its probability (not 0) and the end of its edits in `edits`.
    updates: Vec<(N, u32)>,
    edits: Vec<Edit>,
    /// Lengths of the cached parts of the lists: behaviours, commands, updates, edits.
    cached_lengths: [usize; 4],
}

/// Index into `Module::commands`: a command with its updates evaluated in a local state.
pub type Chosen = u32;

impl<N: Number> Module<N> {
    pub fn new(program: &Program<N>, number: usize) -> Self {
        let mut actions = Vec::new();
        for (action, groups) in program.synchronised.iter().enumerate() {
            actions.extend(groups.iter().position(|group| group.module == number).map(|at| (action, at)));
        }
        let mut variables = BTreeSet::new();
        let groups = actions.iter().map(|(action, at)| &program.synchronised[*action][*at]);
        for command in groups.chain([&program.free[number]]).flat_map(|group| &group.commands) {
            command.each_variable(&mut |variable| {
                variables.insert(variable);
            });
        }
        Self {
            actions,
            numbers: Numbers::new(&program.layout, &variables),
            prevented: Vec::new(),
            slots: Vec::new(),
            commands: Vec::new(),
            updates: Vec::new(),
            edits: Vec::new(),
            cached_lengths: [0; 4],
        }
    }

    /// Returns the index of the behaviour (the evaluated commands of the local state) in a state,
    /// or `None` if the evaluation of a command fails. The index is valid until the next call.
    pub fn behaviour(
        &mut self,
        program: &Program<N>,
        number: usize,
        state: &Packed,
        values: impl FnOnce() -> Values,
    ) -> Option<usize> {
        if let Some(cached) = self.numbers.as_ref().and_then(|numbers| numbers.get(state)) {
            return (cached != FAILED).then_some(cached as usize);
        }
        // An uncached behaviour of the previous call lies behind the cached ones.
        self.discard_uncached();
        // With a full cache, the behaviour is stored behind the cached ones but not registered, so a later call
        // discards it.
        let is_full = self.numbers.is_none()
            || self.cached_lengths[0] >= CACHE_LIMITS[0]
            || self.cached_lengths[3] >= CACHE_LIMITS[1];
        let behaviour = self.write(program, number, &values()).ok().map(|()| self.cached_lengths[0]);
        if behaviour.is_none() {
            self.discard_uncached();
        }
        if !is_full {
            self.cached_lengths = self.lengths();
            if let Some(numbers) = &mut self.numbers {
                numbers.note(state, behaviour.map_or(FAILED, dense));
            }
        }
        behaviour
    }

    fn lengths(&self) -> [usize; 4] {
        [self.prevented.len(), self.commands.len(), self.updates.len(), self.edits.len()]
    }

    fn discard_uncached(&mut self) {
        let [behaviours, commands, updates, edits] = self.cached_lengths;
        self.prevented.truncate(behaviours);
        self.slots.truncate(behaviours.saturating_mul(self.width()));
        self.commands.truncate(commands);
        self.updates.truncate(updates);
        self.edits.truncate(edits);
    }

    fn width(&self) -> usize {
        self.actions.len().saturating_add(2)
    }

    fn write(&mut self, program: &Program<N>, number: usize, values: &[i64]) -> Result<(), Error> {
        self.slots.push(dense(self.commands.len()));
        self.write_group(program, &program.free[number], values)?;
        let mut prevented = 0;
        for at in 0..self.actions.len() {
            let (action, position) = self.actions[at];
            let before = self.commands.len();
            self.write_group(program, &program.synchronised[action][position], values)?;
            if self.commands.len() == before {
                prevented |= 1 << action;
            }
        }
        self.prevented.push(prevented);
        Ok(())
    }

    fn write_group(&mut self, program: &Program<N>, group: &Group<N>, values: &[i64]) -> Result<(), Error> {
        for command in enabled(group, values) {
            self.write_command(program, command?, values)?;
        }
        self.slots.push(dense(self.commands.len()));
        Ok(())
    }

    fn write_command(
        &mut self,
        program: &Program<N>,
        command: &Command<N>,
        values: &[i64],
    ) -> Result<(), Error> {
        for (update, probability) in command.updates.iter().zip(&*command.probabilities(values)?) {
            if probability.is_zero() {
                continue;
            }
            let begin = self.edits.len();
            for (variable, code, place) in &update.assignments {
                let value = program.assigned(*variable, code, *place, values)?;
                let edit = program.layout.edit(*variable, value);
                // Assignments to variables that are packed into the same word are merged into one edit.
                match self.edits[begin..].iter_mut().find(|earlier| earlier.joins(&edit)) {
                    Some(earlier) => earlier.join(&edit),
                    None => self.edits.push(edit),
                }
            }
            self.updates.push((probability.clone(), dense(self.edits.len())));
        }
        self.commands.push(dense(self.updates.len()));
        Ok(())
    }

    pub fn prevented(&self, behaviour: usize) -> u128 {
        self.prevented[behaviour]
    }

    pub fn free(&self, behaviour: usize) -> std::ops::Range<Chosen> {
        self.slot(behaviour, 0)
    }

    /// Returns the enabled commands for one action in the local state to which the behaviour
    /// belongs. `at` is the position of the action in [`Self::actions`].
    pub fn acting(&self, behaviour: usize, at: usize) -> std::ops::Range<Chosen> {
        self.slot(behaviour, at.saturating_add(1))
    }

    fn slot(&self, behaviour: usize, slot: usize) -> std::ops::Range<Chosen> {
        let at = behaviour.saturating_mul(self.width()).saturating_add(slot);
        self.slots[at]..self.slots[at.saturating_add(1)]
    }

    pub fn updates(&self, command: Chosen) -> impl ExactSizeIterator<Item = (&N, &[Edit])> {
        let range = self.range(command);
        // Only ends are stored: the edits of an update begin at the end of the previous update's edits.
        let mut begin = range.start.checked_sub(1).map_or(0, |before| self.updates[before].1);
        self.updates[range].iter().map(move |(probability, end)| {
            let edits = &self.edits[begin as usize..*end as usize];
            begin = *end;
            (probability, edits)
        })
    }

    /// Returns the total number of updates of consecutive commands. Updates of probability 0 do not count.
    pub fn count(&self, commands: std::ops::Range<Chosen>) -> usize {
        commands.map(|command| self.range(command).len()).sum()
    }

    fn range(&self, command: Chosen) -> std::ops::Range<usize> {
        let begin = (command as usize).checked_sub(1).map_or(0, |before| self.commands[before]);
        begin as usize..self.commands[command as usize] as usize
    }
}
