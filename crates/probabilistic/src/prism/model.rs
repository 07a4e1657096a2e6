//! A model and the values of its constants to a program that can be run.
//!
//! Commands whose guards fix one variable (`l=5 & …`) are found by its value, and so are the actions that have such
//! commands, so that the cost of a state does not grow with the number of commands for other states.

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

/// The action number of commands without name.
pub const UNNAMED: u32 = u32::MAX - 1;

/// The commands of one module that bear one action.
#[derive(Debug, Clone, Default)]
pub(super) struct Group<N> {
    /// The number of the module.
    pub module: usize,
    pub commands: Vec<Command<N>>,
    /// The variable by whose value commands are found, its least value, and the commands for each value.
    pub index: Option<(u32, i64, Vec<Vec<u32>>)>,
}

/// For each value of a variable the actions that may be possible, as bits.
#[derive(Debug, Clone)]
pub(super) struct Mask {
    pub variable: u32,
    pub least: i64,
    pub table: Vec<Vec<u64>>,
}

/// A reward structure.
#[derive(Debug, Clone)]
pub(super) struct Structure<N> {
    /// Of states.
    pub states: Vec<RewardItem<N>>,
    /// Of choices without action.
    pub unnamed: Vec<RewardItem<N>>,
    /// For each action.
    pub actions: Vec<Vec<RewardItem<N>>>,
}

/// A model that can be explored.
#[derive(Debug, Clone)]
pub struct Program<N> {
    /// What kind of process it is.
    pub kind: ModelKind,
    /// Its variables.
    pub variables: Vec<Variable>,
    /// The names of its actions.
    pub actions: Vec<String>,
    /// The names of its reward structures.
    pub reward_names: Vec<String>,
    pub(crate) names: Names,
    pub(super) layout: Layout,
    /// For each action the modules that take part, each with its commands.
    pub(super) synchronised: Vec<Vec<Group<N>>>,
    /// For each module the commands without action.
    pub(super) free: Vec<Group<N>>,
    pub(super) masks: Vec<Mask>,
    pub(super) rewards: Vec<Structure<N>>,
    /// Which rewards are computed.
    pub(super) wanted: Vec<usize>,
    /// Where it can start.
    pub(super) starts: Vec<Packed>,
    /// Where nothing that happens later is asked for.
    pub(super) stop: Option<Code>,
}

impl<N: Number> Program<N> {
    /// Resolves names and evaluates constants. Rewards are computed for the structures in `wanted` only, by number.
    ///
    /// # Errors
    /// All that is wrong with names and types; constants that are missing or unknown.
    pub fn new(model: &Model, settings: &Settings) -> Result<Self, Error> {
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
            wanted: Vec::new(),
            starts: Vec::new(),
            stop: None,
        };
        let modules = model.modules.iter().map(|module| &module.variables);
        for variable in std::iter::once(&model.globals).chain(modules).flatten() {
            match declare(&mut names, variable) {
                Ok(found) => {
                    program.layout.push(found.least, found.greatest);
                    let kind = if found.is_bool { Type::Bool } else { Type::Int };
                    let number = dense(program.variables.len());
                    names.variable(&found.name, number, kind, variable.place, &mut problems);
                    program.variables.push(found);
                }
                Err(problem) => problems.push(problem),
            }
        }
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
                    Ok(found) => match &item.action {
                        None => structure.states.push(found),
                        Some(None) => structure.unnamed.push(found),
                        // An action that no command has never happens.
                        Some(Some(name)) => {
                            if let Some(number) = numbers.get(name.as_str()) {
                                structure.actions[*number as usize].push(found);
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
        match program.find_starts(model, &mut names) {
            Ok(starts) => program.starts = starts,
            Err(problem) => problems.push(problem),
        }
        program.names = names;
        program.index();
        if problems.is_empty() { Ok(program) } else { Err(Error::Model(problems.into())) }
    }

    fn find_starts(&self, model: &Model, names: &mut Names) -> Result<Vec<Packed>, Diagnostic> {
        let Some(condition) = &model.initial else {
            let values: Valuation = self.variables.iter().map(|variable| variable.initial).collect();
            return Ok(vec![self.layout.pack(&values)]);
        };
        let place = condition.place;
        let found = starts(names.typed(condition, Type::Bool)?, place, &self.variables, &self.layout)?;
        if found.is_empty() {
            return Err(Diagnostic::new("Q307", place, "there is no state in which `init` holds"));
        }
        Ok(found)
    }

    /// Chooses the reward structures that are computed.
    #[must_use]
    pub fn with_rewards(mut self, wanted: &[usize]) -> Self {
        self.wanted = wanted.to_vec();
        self
    }

    /// Lets states in which a condition holds keep where they are: what happens later is not asked for. A condition that does not fit the
    /// model is left out.
    #[must_use]
    pub(crate) fn stopping(mut self, condition: Option<&Expr>) -> Self {
        self.stop = condition.and_then(|condition| self.names.clone().typed(condition, Type::Bool).ok());
        self
    }

    /// The name of an action.
    pub fn action_name(&self, action: u32) -> &str {
        self.actions.get(action as usize).map_or("", String::as_str)
    }

    /// The values of the variables in a state.
    pub fn unpack(&self, state: &Packed, values: &mut Valuation) {
        self.layout.unpack(state, values);
    }

    /// The state with these values, if all are in range.
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
                let own = module.variables.iter().any(|variable| variable.name == name);
                own || command.action.is_none() && model.globals.iter().any(|variable| variable.name == name)
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
                Err(more) => problems.extend(more),
            }
        }
        for (action, group) in by_action {
            self.synchronised[action as usize].push(group);
        }
        self.free.push(free);
    }

    /// Chooses for each group the variable that most of its guards fix.
    fn index(&mut self) {
        let variables = &self.variables;
        for group in self.synchronised.iter_mut().flatten().chain(&mut self.free) {
            let fixed: Vec<&[(u32, i64)]> =
                group.commands.iter().map(|command| command.guard.fixed()).collect();
            let count = |variable: u32| {
                fixed.iter().filter(|fixed| fixed.iter().any(|(known, _)| *known == variable)).count()
            };
            let best =
                (0..dense(variables.len())).max_by_key(|variable| (count(*variable), Reverse(*variable)));
            let Some(best) = best.filter(|best| count(*best) > 0) else { continue };
            let Variable { least, greatest, .. } = variables[best as usize];
            // The table must not outgrow the commands by much.
            let most = group.commands.len().saturating_mul(10).saturating_add(1000);
            let Ok(above) = usize::try_from(greatest.abs_diff(least)) else { continue };
            if above > most {
                continue;
            }
            let mut table: Vec<Vec<u32>> = vec![Vec::new(); above.saturating_add(1)];
            for (number, fixed) in fixed.iter().enumerate() {
                match fixed.iter().find(|(known, _)| *known == best) {
                    Some((_, value)) => {
                        if let Some(list) = table.get_mut(above_least(*value, least)) {
                            list.push(dense(number));
                        }
                    }
                    None => table.iter_mut().for_each(|list| list.push(dense(number))),
                }
            }
            group.index = Some((best, least, table));
        }
        self.mask();
    }

    /// Notes for each value of a variable which actions it leaves possible.
    fn mask(&mut self) {
        let words = self.actions.len().div_ceil(64);
        let mut masks: Vec<Mask> = Vec::new();
        for (action, groups) in self.synchronised.iter().enumerate() {
            for (variable, least, commands) in groups.iter().filter_map(|group| group.index.as_ref()) {
                let known = masks.iter().position(|mask| mask.variable == *variable);
                let at = known.unwrap_or_else(|| {
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
