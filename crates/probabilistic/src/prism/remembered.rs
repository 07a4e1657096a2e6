//! Generates successors from cached behaviours, i.e. from the evaluated commands of the local states of
//! modules.
//!
//! The choices and their order are the same as those of [`Program`]. If an evaluation fails in a state, or the
//! commands of synchronising modules have too many combinations, the state is delegated to the program. The
//! program reports the error, unless another module disables the command whose evaluation failed.

use std::cell::RefCell;
use std::collections::BTreeSet;

use num_bigint::BigInt;
use num_rational::BigRational;
use smallvec::SmallVec;

use crate::error::Error;
use crate::explore::{Choices, Generator};
use crate::mdp::dense;
use crate::number::{Number, RewardSum, sum_of_rewards};
use crate::prism::ast::ModelKind;
use crate::prism::behaviour::{Chosen, MAX_ACTIONS, Module};
use crate::prism::command::RewardItem;
use crate::prism::memo::Memo;
use crate::prism::model::{Program, UNNAMED};
use crate::prism::run::{MAX_COMBINED, Sums, Values};
use crate::prism::state::Packed;

/// A program that caches the evaluated commands of its modules by local state.
pub struct Remembered<'a, N> {
    program: &'a Program<N>,
    /// The caches. `None` if caching would save nothing (a single module), or if there are more
    /// than [`MAX_ACTIONS`] actions; the program then computes all successors.
    memory: Option<RefCell<Memory<N>>>,
}

struct Memory<N> {
    team: Team<N>,
    stops: Memo<bool>,
    state_sums: Memo<Sums<N>>,
    action_sums_cache: Rewards<N>,
    combiner: Combiner<N>,
}

/// The modules, with their behaviours (evaluated commands) in the current state.
struct Team<N> {
    modules: Vec<Module<N>>,
    /// For each action, the modules that synchronise on it: module index, and position of the action in the module's
    /// list.
    actions: Vec<Vec<(usize, usize)>>,
    behaviours: Vec<usize>,
    /// The actions that are disabled by at least one module in the current state, as a bit set.
    prevented: u128,
}

struct Rewards<N> {
    unnamed: Memo<Sums<N>>,
    named: Vec<Memo<Sums<N>>>,
}

/// Buffers for combining the updates of several modules: partial successors with their probabilities.
struct Combiner<N> {
    open: Vec<(Packed, N)>,
    next: Vec<(Packed, N)>,
}

/// The index of a module and the range of its enabled commands, one of which is executed.
type Part = (usize, std::ops::Range<Chosen>);
type Parts = SmallVec<[Part; 8]>;

impl<'a, N: Number> Remembered<'a, N> {
    /// Creates a generator with an empty cache.
    pub fn new(program: &'a Program<N>) -> Self {
        // A model with a single module has about as many local states as states, so caching saves nothing.
        let pays = program.free.len() > 1 && program.actions.len() <= MAX_ACTIONS;
        Self { program, memory: pays.then(|| RefCell::new(Memory::new(program))) }
    }
}

impl<N: Number> Generator<N> for Remembered<'_, N> {
    type State = Packed;

    fn initial(&self) -> Packed {
        self.program.initial()
    }

    fn starts(&self) -> Vec<Packed> {
        self.program.starts()
    }

    fn rewards(&self) -> usize {
        Generator::rewards(self.program)
    }

    fn loop_rewards(&self, state: &Packed) -> Result<Vec<N>, Error> {
        self.program.loop_rewards(state)
    }

    fn codes(&self) -> Option<usize> {
        self.program.codes()
    }

    fn code(&self, state: &Packed) -> usize {
        self.program.code(state)
    }

    fn successors(&self, state: &Packed, choices: &mut Choices<Packed, N>) -> Result<(), Error> {
        if let Some(memory) = &self.memory {
            let mark = choices.mark();
            if memory.borrow_mut().successors(self.program, state, choices).is_some() {
                return Ok(());
            }
            choices.back_to(mark);
        }
        self.program.successors(state, choices)
    }
}

impl<N: Number> Memory<N> {
    fn new(program: &Program<N>) -> Self {
        let stop = |visit: &mut dyn FnMut(u32)| {
            program
                .stop
                .iter()
                .for_each(|condition| condition.each_variable(&mut |variable| visit(variable)));
        };
        let state_sums = |structure: &usize| &program.rewards[*structure].states;
        Self {
            team: Team::new(program),
            stops: Memo::new(&program.layout, &variables(stop)),
            state_sums: sums(program, state_sums),
            action_sums_cache: Rewards::new(program),
            combiner: Combiner { open: Vec::new(), next: Vec::new() },
        }
    }

    /// Adds the choices of a state. Returns `None` if an evaluation fails or there are too many combinations of
    /// commands; some choices may have been added.
    fn successors(
        &mut self,
        program: &Program<N>,
        state: &Packed,
        choices: &mut Choices<Packed, N>,
    ) -> Option<()> {
        let values = || program.layout.values(state).collect::<Values>();
        if let Some(stop) = &program.stop
            && *self.stops.get(state, || Some(stop.holds(&values()).unwrap_or(false)))?
        {
            choices.to(state.clone(), N::one());
            choices.end(UNNAMED, program.computed_rewards.iter().map(|_| N::zero()));
            return Some(());
        }
        self.team.load_state(program, state, values)?;
        match program.kind {
            ModelKind::Mdp => self.choices(program, state, choices),
            ModelKind::Dtmc => self.step(program, state, choices),
        }
    }

    fn choices(
        &mut self,
        program: &Program<N>,
        state: &Packed,
        choices: &mut Choices<Packed, N>,
    ) -> Option<()> {
        let Self { team, state_sums, action_sums_cache, combiner, .. } = self;
        let sums_of_state =
            state_sums.get(state, || program.state_rewards(&program.values_of(state)).ok())?;
        team.each_action(|action, parts| {
            let action_sums = action_sums_cache.get(program, action, state)?;
            team.each_combination(parts, |chosen| {
                combiner
                    .combine(team, state, parts, chosen, |next, probability| choices.to(next, probability));
                choices.end(action, sums_of_state.iter().zip(action_sums).map(|(a, b)| sum_of_rewards(a, b)));
            })
        })
    }

    /// Adds the only choice of a state of a Markov chain: a uniform distribution over the combinations of
    /// enabled commands. A state without enabled commands gets no choice. Returns `None` if an evaluation fails
    /// or there are too many combinations.
    fn step(&mut self, program: &Program<N>, state: &Packed, choices: &mut Choices<Packed, N>) -> Option<()> {
        let Self { team, state_sums, action_sums_cache, combiner, .. } = self;
        let (mut combinations, mut last_action) = (0_usize, UNNAMED);
        team.each_action(|action, parts| {
            let of_action = parts
                .iter()
                .fold(1, |combinations: usize, (_, commands)| combinations.saturating_mul(commands.len()));
            combinations = combinations.saturating_add(of_action);
            last_action = action;
            Some(())
        })?;
        if combinations == 0 {
            return Some(());
        }
        let count =
            (combinations > 1).then(|| N::from_rational(&BigRational::from(BigInt::from(combinations))));
        let share = |number: &N| count.as_ref().map_or_else(|| number.clone(), |count| number.over(count));
        let sums_of_state =
            state_sums.get(state, || program.state_rewards(&program.values_of(state)).ok())?;
        let mut totals: SmallVec<[RewardSum<N>; 4]> =
            sums_of_state.iter().cloned().map(RewardSum::new).collect();
        team.each_action(|action, parts| {
            let reward = action_sums_cache.get(program, action, state)?;
            team.each_combination(parts, |chosen| {
                for (total, reward) in totals.iter_mut().zip(reward) {
                    total.add(&share(reward));
                }
                combiner.combine(team, state, parts, chosen, |next, probability| {
                    choices.to(next, share(&probability));
                });
            })
        })?;
        let action = if combinations == 1 { last_action } else { UNNAMED };
        choices.end(action, totals.into_iter().map(RewardSum::total));
        Some(())
    }
}

impl<N: Number> Team<N> {
    fn new(program: &Program<N>) -> Self {
        let modules: Vec<_> = (0..program.free.len()).map(|number| Module::new(program, number)).collect();
        let mut actions = vec![Vec::new(); program.actions.len()];
        for (number, module) in modules.iter().enumerate() {
            for (position, (action, _)) in module.actions.iter().enumerate() {
                actions[*action].push((number, position));
            }
        }
        Self { behaviours: vec![0; modules.len()], modules, actions, prevented: 0 }
    }

    /// Looks up the behaviour (the evaluated commands) of each module in a state. Returns `None` if
    /// an evaluation fails.
    fn load_state(
        &mut self,
        program: &Program<N>,
        state: &Packed,
        values: impl Fn() -> Values,
    ) -> Option<()> {
        self.prevented = 0;
        for (number, (module, behaviour)) in self.modules.iter_mut().zip(&mut self.behaviours).enumerate() {
            *behaviour = module.behaviour(program, number, state, &values)?;
            self.prevented |= module.prevented(*behaviour);
        }
        Some(())
    }

    /// Calls `visit` for the enabled commands without an action of each module, and for each enabled action
    /// with the participating modules and their commands. Returns `None` as soon as `visit` does.
    fn each_action(&self, mut visit: impl FnMut(u32, &[Part]) -> Option<()>) -> Option<()> {
        for (number, module) in self.modules.iter().enumerate() {
            let commands = module.free(self.behaviours[number]);
            if !commands.is_empty() {
                visit(UNNAMED, &[(number, commands)])?;
            }
        }
        let all_actions =
            u128::MAX.checked_shr(128_u32.saturating_sub(dense(self.actions.len()))).unwrap_or(0);
        let mut possible = all_actions & !self.prevented;
        let mut parts = Parts::new();
        while possible != 0 {
            let action = possible.trailing_zeros();
            possible ^= 1 << action;
            parts.clear();
            parts.extend(self.actions[action as usize].iter().map(|(module, position)| {
                (*module, self.modules[*module].acting(self.behaviours[*module], *position))
            }));
            visit(action, &parts)?;
        }
        Some(())
    }

    /// Calls `visit` with each combination of one command per module. The command of the first module varies
    /// fastest. Returns `None` if several modules participate and their combinations have more than
    /// [`MAX_COMBINED`] successors.
    fn each_combination(&self, parts: &[Part], mut visit: impl FnMut(&[Chosen])) -> Option<()> {
        if let [(_, commands)] = parts {
            commands.clone().for_each(|command| visit(&[command]));
            return Some(());
        }
        let ends = parts.iter().map(|(module, commands)| self.modules[*module].count(commands.clone()));
        if ends.fold(1, usize::saturating_mul) > MAX_COMBINED {
            return None;
        }
        let mut chosen: SmallVec<[Chosen; 8]> = parts.iter().map(|(_, commands)| commands.start).collect();
        loop {
            visit(&chosen);
            let next = chosen
                .iter()
                .zip(parts)
                .position(|(command, (_, range))| command.saturating_add(1) < range.end);
            let Some(changes) = next else { return Some(()) };
            chosen[changes] = chosen[changes].saturating_add(1);
            for (command, (_, range)) in chosen.iter_mut().zip(parts).take(changes) {
                *command = range.start;
            }
        }
    }
}

impl<N: Number> Combiner<N> {
    /// Calls `to` with each successor (and its probability) of one command per module. The update of the last
    /// module varies fastest.
    fn combine(
        &mut self,
        team: &Team<N>,
        state: &Packed,
        parts: &[Part],
        chosen: &[Chosen],
        mut to: impl FnMut(Packed, N),
    ) {
        let updates = |at: usize| team.modules[parts[at].0].updates(chosen[at]);
        if chosen.len() == 1 {
            for (probability, edits) in updates(0) {
                let mut next = state.clone();
                next.edit(edits);
                to(next, probability.clone());
            }
            return;
        }
        self.open.clear();
        self.open.push((state.clone(), N::one()));
        for at in 0..chosen.len() {
            let mut updates = updates(at);
            // A single update is applied to all partial successors in place.
            if updates.len() == 1
                && let Some((probability, edits)) = updates.next()
            {
                for (next, accumulated) in &mut self.open {
                    next.edit(edits);
                    *accumulated = product(accumulated, probability);
                }
                continue;
            }
            self.next.clear();
            for (before, accumulated) in &self.open {
                for (probability, edits) in team.modules[parts[at].0].updates(chosen[at]) {
                    let mut next = before.clone();
                    next.edit(edits);
                    self.next.push((next, product(accumulated, probability)));
                }
            }
            std::mem::swap(&mut self.open, &mut self.next);
        }
        self.open.drain(..).for_each(|(next, probability)| to(next, probability));
    }
}

/// Multiplies two probabilities. The multiplication is skipped for 1, because most probabilities are 1 and rational
/// multiplication is expensive.
fn product<N: Number>(left: &N, right: &N) -> N {
    match (left.is_unit(), right.is_unit()) {
        (true, _) => right.clone(),
        (_, true) => left.clone(),
        _ => left.times(right),
    }
}

impl<N: Number> Rewards<N> {
    fn new(program: &Program<N>) -> Self {
        let named = (0..program.actions.len())
            .map(|action| sums(program, |structure| &program.rewards[*structure].actions[action]));
        Self {
            unnamed: sums(program, |structure| &program.rewards[*structure].unnamed),
            named: named.collect(),
        }
    }

    fn get(&mut self, program: &Program<N>, action: u32, state: &Packed) -> Option<&Sums<N>> {
        let memo = self.named.get_mut(action as usize).unwrap_or(&mut self.unnamed);
        memo.get(state, || program.action_rewards(action, &program.values_of(state)).ok())
    }
}

fn sums<'a, N: Number>(
    program: &'a Program<N>,
    items: impl Fn(&usize) -> &'a Vec<RewardItem<N>>,
) -> Memo<Sums<N>> {
    let each = |visit: &mut dyn FnMut(u32)| {
        for item in program.computed_rewards.iter().flat_map(&items) {
            item.each_variable(&mut |variable| visit(variable));
        }
    };
    Memo::new(&program.layout, &variables(each))
}

fn variables(each: impl Fn(&mut dyn FnMut(u32))) -> BTreeSet<u32> {
    let mut numbers = BTreeSet::new();
    each(&mut |variable| {
        numbers.insert(variable);
    });
    numbers
}
