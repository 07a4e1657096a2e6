//! What a module can do, by the values of the variables that this depends on.
//!
//! A model of many states has modules of few: each meets the same values of its variables again and again. So what its commands do
//! there is found once, and written as what becomes of the words of a state.

use std::collections::BTreeSet;

use crate::error::Error;
use crate::mdp::dense;
use crate::number::Number;
use crate::prism::command::Command;
use crate::prism::memo::Numbers;
use crate::prism::model::{Group, Program};
use crate::prism::run::{Values, enabled};
use crate::prism::state::{Edit, Packed};

/// The actions that behaviours are found for, at most.
pub const ACTIONS: usize = 128;
/// Behaviours and changes of each module that are kept; what comes later is found anew each time.
const KEPT: [usize; 2] = [1 << 16, 1 << 20];
/// The number of a behaviour that cannot be told, because something is wrong with it.
const WRONG: u32 = u32::MAX - 1;

/// A module: its commands by action, and its behaviours that are known.
#[derive(Debug)]
pub struct Module<N> {
    /// The actions that it takes part in, and where their commands stand in the program: action, position.
    pub actions: Vec<(usize, usize)>,
    numbers: Option<Numbers>,
    /// For each behaviour the actions that it prevents, as bits.
    prevented: Vec<u128>,
    /// For each behaviour where its commands without action begin, then for each action where its commands do, and the end.
    slots: Vec<u32>,
    /// For each command the end of its updates.
    commands: Vec<u32>,
    /// The probability of each update that is possible, and where its changes end.
    updates: Vec<(N, u32)>,
    edits: Vec<Edit>,
    /// How much of these lists is kept: behaviours, commands, updates, changes.
    kept: [usize; 4],
}

/// A command of a behaviour, by number.
pub type Chosen = u32;

impl<N: Number> Module<N> {
    /// A module of a program, by number.
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
            kept: [0; 4],
        }
    }

    /// The behaviour in a state; none where it cannot be told. It stays until the next one is asked for.
    pub fn behaviour(
        &mut self,
        program: &Program<N>,
        number: usize,
        state: &Packed,
        values: impl FnOnce() -> Values,
    ) -> Option<usize> {
        if let Some(known) = self.numbers.as_ref().and_then(|numbers| numbers.get(state)) {
            return (known != WRONG).then_some(known as usize);
        }
        self.forget();
        let is_full = self.numbers.is_none() || self.kept[0] >= KEPT[0] || self.kept[3] >= KEPT[1];
        let found = self.write(program, number, &values()).ok().map(|()| self.kept[0]);
        if found.is_none() {
            self.forget();
        }
        if !is_full {
            self.kept = self.lengths();
            if let Some(numbers) = &mut self.numbers {
                numbers.note(state, found.map_or(WRONG, dense));
            }
        }
        found
    }

    fn lengths(&self) -> [usize; 4] {
        [self.prevented.len(), self.commands.len(), self.updates.len(), self.edits.len()]
    }

    /// Forgets what is not kept.
    fn forget(&mut self) {
        let [behaviours, commands, updates, edits] = self.kept;
        self.prevented.truncate(behaviours);
        self.slots.truncate(behaviours.saturating_mul(self.width()));
        self.commands.truncate(commands);
        self.updates.truncate(updates);
        self.edits.truncate(edits);
    }

    /// How many numbers a behaviour has in `slots`.
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
                match self.edits[begin..].iter_mut().find(|known| known.joins(&edit)) {
                    Some(known) => known.join(&edit),
                    None => self.edits.push(edit),
                }
            }
            self.updates.push((probability.clone(), dense(self.edits.len())));
        }
        self.commands.push(dense(self.updates.len()));
        Ok(())
    }

    /// The actions that a behaviour prevents, as bits.
    pub fn prevented(&self, behaviour: usize) -> u128 {
        self.prevented[behaviour]
    }

    /// The commands without action of a behaviour.
    pub fn free(&self, behaviour: usize) -> std::ops::Range<Chosen> {
        self.slot(behaviour, 0)
    }

    /// The commands of a behaviour for one of the module's actions, by its position.
    pub fn acting(&self, behaviour: usize, at: usize) -> std::ops::Range<Chosen> {
        self.slot(behaviour, at.saturating_add(1))
    }

    fn slot(&self, behaviour: usize, slot: usize) -> std::ops::Range<Chosen> {
        let at = behaviour.saturating_mul(self.width()).saturating_add(slot);
        self.slots[at]..self.slots[at.saturating_add(1)]
    }

    /// The updates of a command: their probabilities, and what they change.
    pub fn updates(&self, command: Chosen) -> impl ExactSizeIterator<Item = (&N, &[Edit])> {
        let range = self.range(command);
        let mut begin = range.start.checked_sub(1).map_or(0, |before| self.updates[before].1);
        self.updates[range].iter().map(move |(probability, end)| {
            let edits = &self.edits[begin as usize..*end as usize];
            begin = *end;
            (probability, edits)
        })
    }

    /// How many updates commands have that stand side by side.
    pub fn count(&self, commands: std::ops::Range<Chosen>) -> usize {
        commands.map(|command| self.range(command).len()).sum()
    }

    fn range(&self, command: Chosen) -> std::ops::Range<usize> {
        let begin = (command as usize).checked_sub(1).map_or(0, |before| self.commands[before]);
        begin as usize..self.commands[command as usize] as usize
    }
}
