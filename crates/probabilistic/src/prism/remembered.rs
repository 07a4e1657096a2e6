//! A program to the successors of its states, by what its modules were seen to do.
//!
//! This gives what the program itself does, in the same order, and leaves to it what goes wrong.

use std::cell::RefCell;
use std::collections::BTreeSet;

use num_bigint::BigInt;
use num_rational::BigRational;
use smallvec::SmallVec;

use crate::error::Error;
use crate::explore::{Choices, Generator};
use crate::mdp::dense;
use crate::number::Number;
use crate::prism::ast::ModelKind;
use crate::prism::behaviour::{ACTIONS, Chosen, Module};
use crate::prism::command::RewardItem;
use crate::prism::memo::Memo;
use crate::prism::model::{Program, UNNAMED};
use crate::prism::run::{COMBINED, Sums, Values};
use crate::prism::state::Packed;

/// A program that remembers what its modules do.
pub struct Remembered<'a, N> {
    program: &'a Program<N>,
    /// None where a program is better run as it is.
    memory: Option<RefCell<Memory<N>>>,
}

/// What is remembered.
struct Memory<N> {
    team: Team<N>,
    stops: Memo<bool>,
    of_states: Memo<Sums<N>>,
    of_actions: Rewards<N>,
    lead: Lead<N>,
}

/// The modules, with what they do in the state at hand.
struct Team<N> {
    modules: Vec<Module<N>>,
    /// For each action its modules, with the position of the action in each.
    actions: Vec<Vec<(usize, usize)>>,
    /// The behaviour of each module.
    behaviours: Vec<usize>,
    /// The actions that some module prevents, as bits.
    prevented: u128,
}

/// Rewards of choices without action, and of each action.
struct Rewards<N> {
    unnamed: Memo<Sums<N>>,
    named: Vec<Memo<Sums<N>>>,
}

/// States on the way to those that modules lead to together.
struct Lead<N> {
    open: Vec<(Packed, N)>,
    next: Vec<(Packed, N)>,
}

/// A module's commands of which one is taken.
type Part = (usize, std::ops::Range<Chosen>);
/// The modules that move together.
type Parts = SmallVec<[Part; 8]>;

impl<'a, N: Number> Remembered<'a, N> {
    /// Nothing yet of a program.
    pub fn new(program: &'a Program<N>) -> Self {
        // A module that is alone has as many behaviours as there are states.
        let pays = program.free.len() > 1 && program.actions.len() <= ACTIONS;
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
        let stop = |tell: &mut dyn FnMut(u32)| {
            program.stop.iter().for_each(|condition| condition.each_variable(&mut |variable| tell(variable)));
        };
        let of_states = |structure: &usize| &program.rewards[*structure].states;
        Self {
            team: Team::new(program),
            stops: Memo::new(&program.layout, &variables(stop)),
            of_states: sums(program, of_states),
            of_actions: Rewards::new(program),
            lead: Lead { open: Vec::new(), next: Vec::new() },
        }
    }

    /// Writes the choices of a state; none where something cannot be told.
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
            choices.end(UNNAMED, program.wanted.iter().map(|_| N::zero()));
            return Some(());
        }
        self.team.meet(program, state, values)?;
        match program.kind {
            ModelKind::Mdp => self.choices(program, state, choices),
            ModelKind::Dtmc => self.step(program, state, choices),
        }
    }

    /// All choices of a state of a decision process.
    fn choices(
        &mut self,
        program: &Program<N>,
        state: &Packed,
        choices: &mut Choices<Packed, N>,
    ) -> Option<()> {
        let Self { team, of_states, of_actions, lead, .. } = self;
        let of_state = of_states.get(state, || program.state_rewards(&program.values_of(state)).ok())?;
        team.each_meeting(|action, parts| {
            let more = of_actions.get(program, action, state)?;
            team.each_way(parts, |chosen| {
                lead.go(team, state, parts, chosen, |next, probability| choices.to(next, probability));
                choices.end(action, of_state.iter().zip(more).map(|(a, b)| a.plus(b)));
            })
        })
    }

    /// The one choice of a state of a Markov chain: each of the ways to go on with the same probability.
    fn step(&mut self, program: &Program<N>, state: &Packed, choices: &mut Choices<Packed, N>) -> Option<()> {
        let Self { team, of_states, of_actions, lead, .. } = self;
        let (mut ways, mut taken) = (0_usize, UNNAMED);
        team.each_meeting(|action, parts| {
            let own = parts.iter().fold(1, |ways: usize, (_, commands)| ways.saturating_mul(commands.len()));
            ways = ways.saturating_add(own);
            taken = action;
            Some(())
        })?;
        if ways == 0 {
            return Some(());
        }
        let count = (ways > 1).then(|| N::from_rational(&BigRational::from(BigInt::from(ways))));
        let share = |number: &N| count.as_ref().map_or_else(|| number.clone(), |count| number.over(count));
        let of_state = of_states.get(state, || program.state_rewards(&program.values_of(state)).ok())?;
        let mut total = of_state.clone();
        team.each_meeting(|action, parts| {
            let more = of_actions.get(program, action, state)?;
            team.each_way(parts, |chosen| {
                for (sum, more) in total.iter_mut().zip(more) {
                    *sum = sum.plus(&share(more));
                }
                lead.go(team, state, parts, chosen, |next, probability| {
                    choices.to(next, share(&probability));
                });
            })
        })?;
        choices.end(if ways == 1 { taken } else { UNNAMED }, total);
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

    /// Finds what each module does in a state; none where that cannot be told.
    fn meet(&mut self, program: &Program<N>, state: &Packed, values: impl Fn() -> Values) -> Option<()> {
        self.prevented = 0;
        for (number, (module, own)) in self.modules.iter_mut().zip(&mut self.behaviours).enumerate() {
            *own = module.behaviour(program, number, state, &values)?;
            self.prevented |= module.prevented(*own);
        }
        Some(())
    }

    /// Tells what can happen, by action and the modules that take part; none where that says so.
    fn each_meeting(&self, mut tell: impl FnMut(u32, &[Part]) -> Option<()>) -> Option<()> {
        for (number, module) in self.modules.iter().enumerate() {
            let commands = module.free(self.behaviours[number]);
            if !commands.is_empty() {
                tell(UNNAMED, &[(number, commands)])?;
            }
        }
        let all = u128::MAX.checked_shr(128_u32.saturating_sub(dense(self.actions.len()))).unwrap_or(0);
        let mut possible = all & !self.prevented;
        let mut parts = Parts::new();
        while possible != 0 {
            let action = possible.trailing_zeros();
            possible ^= 1 << action;
            parts.clear();
            parts.extend(self.actions[action as usize].iter().map(|(module, position)| {
                (*module, self.modules[*module].acting(self.behaviours[*module], *position))
            }));
            tell(action, &parts)?;
        }
        Some(())
    }

    /// Tells each way to choose one command of each part, the first one's changes first; none where there are too many ends.
    fn each_way(&self, parts: &[Part], mut way: impl FnMut(&[Chosen])) -> Option<()> {
        if let [(_, commands)] = parts {
            commands.clone().for_each(|command| way(&[command]));
            return Some(());
        }
        let ends = parts.iter().map(|(module, commands)| self.modules[*module].count(commands.clone()));
        if ends.fold(1, usize::saturating_mul) > COMBINED {
            return None;
        }
        let mut chosen: SmallVec<[Chosen; 8]> = parts.iter().map(|(_, commands)| commands.start).collect();
        loop {
            way(&chosen);
            let next = chosen.iter().zip(parts).position(|(own, (_, all))| own.saturating_add(1) < all.end);
            let Some(changes) = next else { return Some(()) };
            chosen[changes] = chosen[changes].saturating_add(1);
            for (own, (_, all)) in chosen.iter_mut().zip(parts).take(changes) {
                *own = all.start;
            }
        }
    }
}

impl<N: Number> Lead<N> {
    /// The states that a command of each part leads to; the updates of the last one change first.
    fn go(
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
            if updates.len() == 1
                && let Some((probability, edits)) = updates.next()
            {
                for (next, together) in &mut self.open {
                    next.edit(edits);
                    *together = product(together, probability);
                }
                continue;
            }
            self.next.clear();
            for (before, together) in &self.open {
                for (probability, edits) in team.modules[parts[at].0].updates(chosen[at]) {
                    let mut next = before.clone();
                    next.edit(edits);
                    self.next.push((next, product(together, probability)));
                }
            }
            std::mem::swap(&mut self.open, &mut self.next);
        }
        self.open.drain(..).for_each(|(next, probability)| to(next, probability));
    }
}

/// Most moves of modules are certain, and rationals are long to multiply.
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

    /// The rewards of an action in a state; none where they cannot be told.
    fn get(&mut self, program: &Program<N>, action: u32, state: &Packed) -> Option<&Sums<N>> {
        let memo = self.named.get_mut(action as usize).unwrap_or(&mut self.unnamed);
        memo.get(state, || program.action_rewards(action, &program.values_of(state)).ok())
    }
}

/// Sums of some rewards of each structure that is wanted.
fn sums<'a, N: Number>(
    program: &'a Program<N>,
    items: impl Fn(&usize) -> &'a Vec<RewardItem<N>>,
) -> Memo<Sums<N>> {
    let each = |tell: &mut dyn FnMut(u32)| {
        for item in program.wanted.iter().flat_map(&items) {
            item.each_variable(&mut |variable| tell(variable));
        }
    };
    Memo::new(&program.layout, &variables(each))
}

fn variables(each: impl Fn(&mut dyn FnMut(u32))) -> BTreeSet<u32> {
    let mut found = BTreeSet::new();
    each(&mut |variable| {
        found.insert(variable);
    });
    found
}
