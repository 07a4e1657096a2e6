//! Compiles a model to an executable program: resolves names and evaluates constants.
//!
//! If guards fix a variable (`l=5 & …`), the commands are indexed by the value of this variable,
//! unless its range is much larger than the number of commands. For each value, the program also
//! stores the actions that may be enabled. The cost of expanding a state therefore does not grow
//! with the number of commands for other values.

use std::cmp::Reverse;

use rustc_hash::FxHashMap;

use crate::error::{Diagnostic, Error};
use crate::mdp::dense;
use crate::number::Number;
use crate::prism::ast::{self, Expr, Model, ModelKind, Type};
use crate::prism::build::{compile_command, declare, reward_item};
use crate::prism::code::Code;
use crate::prism::command::{Command, RewardItem, Variable};
use crate::prism::compile::{Names, Settings};
use crate::prism::starts::starts;
use crate::prism::state::{Layout, Packed, Valuation, above_least};

/// The action number of commands without an action.
pub const UNNAMED: u32 = u32::MAX - 1;

/// The commands of a module that have the same action, or no action.
#[derive(Debug, Clone, Default)]
pub(super) struct Group<N> {
    pub module: usize,
    pub commands: Vec<Command<N>>,
    /// Index of the commands by the value of a variable: the variable, its least value, and the
    /// candidate commands for each value. `None` if all commands are candidates in every state.
    pub index: Option<(u32, i64, Vec<Vec<u32>>)>,
}

/// For each value of a variable from `least` on, the actions that may be enabled with this value, as a bit set.
#[derive(Debug, Clone)]
pub(super) struct Mask {
    pub variable: u32,
    pub least: i64,
    pub table: Vec<Vec<u64>>,
}

#[derive(Debug, Clone)]
pub(super) struct Structure<N> {
    pub states: Vec<RewardItem<N>>,
    pub unnamed: Vec<RewardItem<N>>,
    pub actions: Vec<Vec<RewardItem<N>>>,
}

/// An executable model: compiled commands and rewards of a PRISM model.
#[derive(Debug, Clone)]
pub struct Program<N> {
    /// The kind of process.
    pub kind: ModelKind,
    /// The variables; the global variables come first.
    pub variables: Vec<Variable>,
    /// The names of the actions, indexed by action number.
    pub actions: Vec<String>,
    /// The names of the reward structures, indexed by structure.
    pub reward_names: Vec<String>,
    pub(crate) names: Names,
    pub(super) layout: Layout,
    /// For each action, the command groups of the modules that synchronise on the action.
    pub(super) synchronised: Vec<Vec<Group<N>>>,
    pub(super) free: Vec<Group<N>>,
    pub(super) masks: Vec<Mask>,
    pub(super) rewards: Vec<Structure<N>>,
    /// The indices of the reward structures whose rewards are computed for each choice.
    pub(super) computed_rewards: Vec<usize>,
    pub(super) starts: Vec<Packed>,
    /// Condition under which a state is made absorbing instead of being expanded.
    pub(super) stop: Option<Code>,
}

impl<N: Number> Program<N> {
    /// Resolves the names and evaluates the constants of a model. No rewards are computed until
    /// [`Self::with_rewards`] selects them.
    ///
    /// # Errors
    /// An undefined constant without a value in `settings`, an unknown constant in `settings`, or errors in
    /// names, types and ranges. The errors in variables are returned without those in commands, rewards and
    /// labels, which may follow from them.
    pub fn new(model: &Model, settings: &Settings) -> Result<Self, Error> {
        Self::within(model, settings, usize::MAX)
    }

    /// Same as [`Self::new`], but lists only one initial state more than the limit if there are more than this limit. The
    /// exploration then reports that the limit is exceeded.
    pub(crate) fn within(model: &Model, settings: &Settings, max_starts: usize) -> Result<Self, Error> {
        let mut names = Names::new(model, settings)?;
        let mut problems = Vec::new();
        let mut program = Self {
            kind: model.kind,
            variables: Vec::new(),
            actions: Vec::new(),
            reward_names: model.rewards.iter().map(|rewards| rewards.name.clone()).collect(),
            names: names.clone(),
            layout: Layout::default(),
            synchronised: Vec::new(),
            free: Vec::new(),
            masks: Vec::new(),
            rewards: Vec::new(),
            computed_rewards: Vec::new(),
            starts: Vec::new(),
            stop: None,
        };
        let modules = model.modules.iter().map(|module| &module.variables);
        for variable in std::iter::once(&model.globals).chain(modules).flatten() {
            match declare(&mut names, variable) {
                Ok(declared) => {
                    program.layout.push(declared.least, declared.greatest);
                    let kind = if declared.is_bool { Type::Bool } else { Type::Int };
                    let number = dense(program.variables.len());
                    names.variable(&declared.name, number, kind, variable.place, &mut problems);
                    program.variables.push(declared);
                }
                Err(problem) => problems.push(problem),
            }
        }
        // Without the variables whose declarations are invalid, further errors would be misleading.
        if !problems.is_empty() {
            return Err(Error::Model(problems.into()));
        }
        let mut numbers: FxHashMap<&str, u32> = FxHashMap::default();
        for command in model.modules.iter().flat_map(|module| &module.commands) {
            if let Some(action) = &command.action
                && !numbers.contains_key(action.as_str())
            {
                numbers.insert(action, dense(program.actions.len()));
                program.actions.push(action.clone());
            }
        }
        program.synchronised = vec![Vec::new(); program.actions.len()];
        for module in &model.modules {
            program.module(module, model, &mut names, &numbers, &mut problems);
        }
        for rewards in &model.rewards {
            let mut structure = Structure {
                states: Vec::new(),
                unnamed: Vec::new(),
                actions: vec![Vec::new(); program.actions.len()],
            };
            for item in &rewards.items {
                match reward_item(item, &mut names) {
                    Ok(compiled) => match &item.action {
                        None => structure.states.push(compiled),
                        Some(None) => structure.unnamed.push(compiled),
                        // A reward for an action that no command has never applies.
                        Some(Some(name)) => {
                            if let Some(number) = numbers.get(name.as_str()) {
                                structure.actions[*number as usize].push(compiled);
                            }
                        }
                    },
                    Err(problem) => problems.push(problem),
                }
            }
            program.rewards.push(structure);
        }
        for label in &model.labels {
            if let Err(problem) = names.typed(&label.expression, Type::Bool) {
                problems.push(problem);
            }
        }
        match program.find_starts(model, &mut names, max_starts) {
            Ok(starts) => program.starts = starts,
            Err(problem) => problems.push(problem),
        }
        program.names = names;
        program.index();
        if problems.is_empty() { Ok(program) } else { Err(Error::Model(problems.into())) }
    }

    fn find_starts(&self, model: &Model, names: &mut Names, limit: usize) -> Result<Vec<Packed>, Diagnostic> {
        let Some(condition) = &model.initial else {
            let values: Valuation = self.variables.iter().map(|variable| variable.initial).collect();
            return Ok(vec![self.layout.pack(&values)]);
        };
        let place = condition.place;
        let initial_states =
            starts(names.typed(condition, Type::Bool)?, place, &self.variables, &self.layout, limit)?;
        if initial_states.is_empty() {
            return Err(Diagnostic::new("Q307", place, "there is no state in which `init` holds"));
        }
        Ok(initial_states)
    }

    /// Selects the reward structures, by index, whose rewards are computed for each choice.
    #[must_use]
    pub fn with_rewards(mut self, computed_rewards: &[usize]) -> Self {
        self.computed_rewards = computed_rewards.to_vec();
        self
    }

    /// Makes the states that satisfy a condition absorbing. The caller guarantees that the checked property does not
    /// depend on their successors. A condition that does not compile is ignored.
    #[must_use]
    pub(crate) fn stopping(mut self, condition: Option<&Expr>) -> Self {
        self.stop = condition.and_then(|condition| self.names.clone().typed(condition, Type::Bool).ok());
        self
    }

    /// Returns the name of an action; the empty string for a command without an action.
    pub fn action_name(&self, action: u32) -> &str {
        self.actions.get(action as usize).map_or("", String::as_str)
    }

    /// Writes the values of the variables in a packed state to `values`.
    pub fn unpack(&self, state: &Packed, values: &mut Valuation) {
        self.layout.unpack(state, values);
    }

    /// Packs the values of the variables into a state. Returns `None` if a value is outside the range of its
    /// variable, or if there are more or fewer values than variables.
    pub fn pack(&self, values: &[i64]) -> Option<Packed> {
        let fits = values.len() == self.variables.len()
            && self.variables.iter().zip(values).all(|(v, value)| (v.least..=v.greatest).contains(value));
        fits.then(|| self.layout.pack(values))
    }

    fn module(
        &mut self,
        module: &ast::Module,
        model: &Model,
        names: &mut Names,
        numbers: &FxHashMap<&str, u32>,
        problems: &mut Vec<Diagnostic>,
    ) {
        let number = self.free.len();
        let mut free = Group { module: number, commands: Vec::new(), index: None };
        let mut by_action: FxHashMap<u32, Group<N>> = FxHashMap::default();
        for command in &module.commands {
            let writable = |name: &str| {
                let is_local = module.variables.iter().any(|variable| variable.name == name);
                // Commands with an action cannot write global variables: synchronised modules could write different
                // values.
                is_local
                    || command.action.is_none() && model.globals.iter().any(|variable| variable.name == name)
            };
            match compile_command(command, names, writable) {
                Ok(compiled) => match &command.action {
                    None => free.commands.push(compiled),
                    Some(action) => {
                        let group = by_action.entry(numbers[action.as_str()]).or_insert_with(|| Group {
                            module: number,
                            commands: Vec::new(),
                            index: None,
                        });
                        group.commands.push(compiled);
                    }
                },
                Err(errors) => problems.extend(errors),
            }
        }
        for (action, group) in by_action {
            self.synchronised[action as usize].push(group);
        }
        self.free.push(free);
    }

    /// Indexes each group of commands by the variable that most of its guards fix. A group has no
    /// index if no guard fixes a variable, or if the range of this variable is much larger than the
    /// number of commands.
    fn index(&mut self) {
        let variables = &self.variables;
        for group in self.synchronised.iter_mut().flatten().chain(&mut self.free) {
            let fixed: Vec<&[(u32, i64)]> =
                group.commands.iter().map(|command| command.guard.fixed()).collect();
            let count = |variable: u32| {
                fixed
                    .iter()
                    .filter(|fixed| fixed.iter().any(|(fixed_variable, _)| *fixed_variable == variable))
                    .count()
            };
            // If several variables are fixed equally often, the first one is chosen, for reproducible results.
            let best =
                (0..dense(variables.len())).max_by_key(|variable| (count(*variable), Reverse(*variable)));
            let Some(best) = best.filter(|best| count(*best) > 0) else { continue };
            let Variable { least, greatest, .. } = variables[best as usize];
            // The size of the table is limited in proportion to the number of commands.
            let limit = group.commands.len().saturating_mul(10).saturating_add(1000);
            let Ok(above) = usize::try_from(greatest.abs_diff(least)) else { continue };
            if above > limit {
                continue;
            }
            let mut table: Vec<Vec<u32>> = vec![Vec::new(); above.saturating_add(1)];
            for (number, fixed) in fixed.iter().enumerate() {
                match fixed.iter().find(|(fixed_variable, _)| *fixed_variable == best) {
                    Some((_, value)) => {
                        if let Some(list) = table.get_mut(above_least(*value, least)) {
                            list.push(dense(number));
                        }
                    }
                    // A command that does not fix the variable is a candidate for every value.
                    None => table.iter_mut().for_each(|list| list.push(dense(number))),
                }
            }
            group.index = Some((best, least, table));
        }
        self.mask();
    }

    fn mask(&mut self) {
        let words = self.actions.len().div_ceil(64);
        let mut masks: Vec<Mask> = Vec::new();
        for (action, groups) in self.synchronised.iter().enumerate() {
            for (variable, least, commands) in groups.iter().filter_map(|group| group.index.as_ref()) {
                let position = masks.iter().position(|mask| mask.variable == *variable);
                let at = position.unwrap_or_else(|| {
                    let table = vec![vec![u64::MAX; words]; commands.len()];
                    masks.push(Mask { variable: *variable, least: *least, table });
                    masks.len().saturating_sub(1)
                });
                for (row, list) in masks[at].table.iter_mut().zip(commands) {
                    if list.is_empty() {
                        row[action / 64] &= !(1 << (action % 64));
                    }
                }
            }
        }
        self.masks = masks;
    }
}
