//! A model and the values of its constants to a generator of successors.
//!
//! Commands whose guards fix one variable (`l=5 & …`) are found by its value, so that the cost of a state does not grow
//! with the number of commands for other states.

use rustc_hash::FxHashMap;

use crate::error::{Diagnostic, Error, Place};
use crate::explore::{Choices, Generator};
use crate::number::Number;
use crate::prism::ast::{self, Model, ModelKind, Type};
use crate::prism::build::{compile_command, declare, fixed_values, reward_item};
use crate::prism::code::{Code, Fault};
use crate::prism::compile::{Names, Settings};
use crate::prism::state::{Layout, Packed, Valuation};

/// How far the sum of probabilities may be from one, as in PRISM; what is within is scaled to one.
const SUM_TOLERANCE: f64 = 1e-5;
/// The action number of commands without name.
pub const UNNAMED: u32 = u32::MAX - 1;

/// A variable with its range evaluated.
#[derive(Debug, Clone)]
pub struct Variable {
    /// Its name.
    pub name: String,
    /// Whether it is a truth value.
    pub is_bool: bool,
    pub least: i64,
    pub greatest: i64,
    pub initial: i64,
}

#[derive(Debug, Clone)]
pub struct Update<N> {
    pub probability: Code<N>,
    pub assignments: Vec<(u32, Code<N>, Place)>,
}

#[derive(Debug, Clone)]
pub struct Command<N> {
    pub guard: Code<N>,
    pub updates: Vec<Update<N>>,
    pub place: Place,
}

/// The commands of one module that bear one action.
#[derive(Debug, Clone, Default)]
struct Group<N> {
    commands: Vec<Command<N>>,
    /// The variable by whose value commands are found, its least value, and the commands for each value.
    index: Option<(u32, i64, Vec<Vec<u32>>)>,
}

#[derive(Debug, Clone)]
pub struct RewardItem<N> {
    pub action: Option<u32>,
    pub guard: Code<N>,
    pub reward: Code<N>,
    pub place: Place,
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
    pub(crate) names: Names<N>,
    layout: Layout,
    /// For each action the modules that take part, each with its commands.
    synchronised: Vec<Vec<Group<N>>>,
    /// For each module the commands without action.
    free: Vec<Group<N>>,
    rewards: Vec<Vec<RewardItem<N>>>,
    /// Which rewards are computed.
    wanted: Vec<usize>,
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
            rewards: Vec::new(),
            wanted: Vec::new(),
        };
        let modules = model.modules.iter().map(|module| &module.variables);
        for variable in std::iter::once(&model.globals).chain(modules).flatten() {
            match declare(&mut names, variable) {
                Ok(found) => {
                    program.layout.push(found.least, found.greatest);
                    let kind = if found.is_bool { Type::Bool } else { Type::Int };
                    let number = program.variables.len() as u32;
                    names.variable(&found.name, number, kind, variable.place, &mut problems);
                    program.variables.push(found);
                }
                Err(problem) => problems.push(problem),
            }
        }
        if !problems.is_empty() {
            return Err(Error::Model(problems));
        }
        let mut numbers: FxHashMap<&str, u32> = FxHashMap::default();
        for command in model.modules.iter().flat_map(|module| &module.commands) {
            if let Some(action) = &command.action
                && !numbers.contains_key(action.as_str())
            {
                numbers.insert(action, program.actions.len() as u32);
                program.actions.push(action.clone());
            }
        }
        program.synchronised = vec![Vec::new(); program.actions.len()];
        for module in &model.modules {
            program.module(module, model, &mut names, &numbers, &mut problems);
        }
        for rewards in &model.rewards {
            let items = rewards.items.iter().filter_map(|item| {
                reward_item(item, &mut names, &numbers).map_err(|problem| problems.push(problem)).ok()
            });
            program.rewards.push(items.collect());
        }
        for label in &model.labels {
            if let Err(problem) = names.typed(&label.expression, Type::Bool) {
                problems.push(problem);
            }
        }
        program.names = names;
        program.index();
        if problems.is_empty() { Ok(program) } else { Err(Error::Model(problems)) }
    }

    /// Chooses the reward structures that are computed.
    #[must_use]
    pub fn with_rewards(mut self, wanted: &[usize]) -> Self {
        self.wanted = wanted.to_vec();
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
        names: &mut Names<N>,
        numbers: &FxHashMap<&str, u32>,
        problems: &mut Vec<Diagnostic>,
    ) {
        let mut free = Group { commands: Vec::new(), index: None };
        let mut by_action: Vec<(u32, Group<N>)> = Vec::new();
        for command in &module.commands {
            let writable = |name: &str| {
                let own = module.variables.iter().any(|variable| variable.name == name);
                own || command.action.is_none() && model.globals.iter().any(|variable| variable.name == name)
            };
            match compile_command(command, names, writable) {
                Ok(compiled) => match &command.action {
                    None => free.commands.push(compiled),
                    Some(action) => {
                        let number = numbers[action.as_str()];
                        match by_action.iter_mut().find(|(known, _)| *known == number) {
                            Some((_, group)) => group.commands.push(compiled),
                            None => by_action.push((number, Group { commands: vec![compiled], index: None })),
                        }
                    }
                },
                Err(more) => problems.extend(more),
            }
        }
        for (number, group) in by_action {
            self.synchronised[number as usize].push(group);
        }
        self.free.push(free);
    }

    /// Chooses for each group the variable that most of its guards fix.
    fn index(&mut self) {
        let variables = &self.variables;
        for group in self.synchronised.iter_mut().flatten().chain(&mut self.free) {
            let fixed: Vec<Vec<(u32, i64)>> =
                group.commands.iter().map(|command| fixed_values(&command.guard)).collect();
            let count = |variable: u32| {
                fixed.iter().filter(|fixed| fixed.iter().any(|(known, _)| *known == variable)).count()
            };
            let best =
                (0..variables.len() as u32).max_by_key(|variable| (count(*variable), u32::MAX - variable));
            let Some(best) = best.filter(|best| count(*best) > 0) else { continue };
            let Variable { least, greatest, .. } = variables[best as usize];
            if greatest - least > 100_000 {
                continue;
            }
            let mut table: Vec<Vec<u32>> = vec![Vec::new(); (greatest - least + 1) as usize];
            for (number, fixed) in fixed.iter().enumerate() {
                match fixed.iter().find(|(known, _)| *known == best) {
                    Some((_, value)) if (least..=greatest).contains(value) => {
                        table[(value - least) as usize].push(number as u32);
                    }
                    Some(_) => {}
                    None => table.iter_mut().for_each(|list| list.push(number as u32)),
                }
            }
            group.index = Some((best, least, table));
        }
    }

    /// The sum of the rewards of one structure, for a state or for the transitions of an action.
    fn reward(&self, structure: usize, action: Option<u32>, values: &[i64]) -> Result<N, Error> {
        let mut sum = N::zero();
        for item in self.rewards[structure].iter().filter(|item| item.action == action) {
            let fault = |fault| at(fault, item.place);
            if item.guard.holds(values).map_err(fault)? {
                let reward = item.reward.number(values).map_err(fault)?;
                if reward < N::zero() {
                    let text = format!("a negative reward, {}", reward.to_f64());
                    return Err(Diagnostic::new("Q304", item.place, text).into());
                }
                sum = sum.plus(&reward);
            }
        }
        Ok(sum)
    }
}

type Outcome<N> = Vec<(Valuation, N)>;

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
            for command in enabled(group, values) {
                let effects = self.effects(command?, values)?;
                next.extend(combined.iter().map(|outcome| join(outcome, &effects)));
            }
            combined = next;
        }
        found.append(&mut combined);
        Ok(())
    }

    /// The updates of a command in a state: probability, and the new values.
    fn effects(&self, command: &Command<N>, values: &[i64]) -> Result<Vec<Effect<N>>, Error> {
        let fault = |fault| at(fault, command.place);
        let mut effects = Vec::with_capacity(command.updates.len());
        let mut sum = N::zero();
        for update in &command.updates {
            let probability = update.probability.number(values).map_err(fault)?;
            if probability < N::zero() {
                let text = format!("a negative probability, {}", probability.to_f64());
                return Err(Diagnostic::new("Q302", command.place, text).into());
            }
            sum = sum.plus(&probability);
            if probability.is_zero() {
                continue;
            }
            let mut changes = Vec::with_capacity(update.assignments.len());
            for (variable, code, place) in &update.assignments {
                let value = code.whole(values).map_err(|fault| at(fault, *place))?;
                let Variable { name, least, greatest, .. } = &self.variables[*variable as usize];
                if !(*least..=*greatest).contains(&value) {
                    let text =
                        format!("`{name}` becomes {value}, which is not in its range [{least}..{greatest}]");
                    return Err(Diagnostic::new("Q305", *place, text).into());
                }
                changes.push((*variable, value));
            }
            effects.push((probability, changes));
        }
        if sum == N::one() {
            return Ok(effects);
        }
        let off = (sum.to_f64() - 1.0).abs();
        if off.is_nan() || off > SUM_TOLERANCE {
            let text = format!("the probabilities sum to {}, not to 1", sum.to_f64());
            return Err(Diagnostic::new("Q301", command.place, text).into());
        }
        if N::EXACT || off > 1e-13 {
            for (probability, _) in &mut effects {
                *probability = probability.over(&sum);
            }
        }
        Ok(effects)
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
            all.extend(found.drain(..).map(|outcome| (action as u32, outcome)));
        }
        Ok(all)
    }
}

type Effect<N> = (N, Vec<(u32, i64)>);

fn join<N: Number>(outcome: &Outcome<N>, effects: &[Effect<N>]) -> Outcome<N> {
    let mut joined = Vec::with_capacity(outcome.len() * effects.len());
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
        Some((variable, least, table)) => (&table[(values[*variable as usize] - least) as usize], 0),
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

impl<N: Number> Generator<N> for Program<N> {
    type State = Packed;

    fn initial(&self) -> Packed {
        let values: Valuation = self.variables.iter().map(|variable| variable.initial).collect();
        self.layout.pack(&values)
    }

    fn rewards(&self) -> usize {
        self.wanted.len()
    }

    fn successors(&self, state: &Packed, choices: &mut Choices<Packed, N>) -> Result<(), Error> {
        let mut values = Valuation::new();
        self.layout.unpack(state, &mut values);
        let all = self.all_outcomes(&values)?;
        let mut of_state = Vec::with_capacity(self.wanted.len());
        for structure in &self.wanted {
            of_state.push(self.reward(*structure, None, &values)?);
        }
        let count = crate::prism::code::from_whole::<N>(all.len() as i64);
        let mut total = of_state.clone();
        let is_chain = self.kind == ModelKind::Dtmc && all.len() > 1;
        for (action, outcome) in &all {
            let mut rewards = Vec::with_capacity(self.wanted.len());
            for (at, structure) in self.wanted.iter().enumerate() {
                let more = self.reward(*structure, Some(*action), &values)?;
                if is_chain {
                    total[at] = total[at].plus(&more.over(&count));
                }
                rewards.push(of_state[at].plus(&more));
            }
            for (values, probability) in outcome {
                let probability = if is_chain { probability.over(&count) } else { probability.clone() };
                choices.to(self.layout.pack(values), probability);
            }
            if !is_chain {
                choices.end(*action, rewards);
            }
        }
        if is_chain {
            choices.end(UNNAMED, total);
        }
        Ok(())
    }
}

fn at(Fault(text): Fault, place: Place) -> Error {
    Diagnostic::new("Q303", place, text).into()
}
