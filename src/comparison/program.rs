//! Converts a co-adaptation mission to a model in the PRISM language.
//! [`Process`](crate::comparison::Process) is the same decision process with successors computed
//! directly.

use std::collections::BTreeSet;

use num_rational::BigRational;
use num_traits::{One, Zero};
use probabilistic::Place;
use probabilistic::prism::ast::{
    BinaryOp, Command, Constant, Expr, ExprKind, Model, ModelKind, Module, Named, RewardItem, Rewards,
    Update, Variable,
};
use probabilistic::prism::identifier;

use crate::comparison::coadaptation::{Battery, Coadaptation, Traversal};
use crate::comparison::process::{REWARDS, Risk};

/// Returns the PRISM model of a mission. Its variables are the place `l`, the configuration `c` and, as far as `risk`
/// includes them, the battery `b` and the flags `hit`, `failed` and `lost`.
pub fn program(mission: &Coadaptation, risk: Risk) -> Model {
    let writer =
        ProcessWriter { mission, risk, sets: names_of_changes(mission), moves: names_of_moves(mission) };
    model(
        writer.remark(),
        Vec::new(),
        (writer.variables(), writer.commands()),
        writer.rewards(),
        writer.labels(),
    )
}

pub(super) fn model(
    remark: String,
    constants: Vec<Constant>,
    (variables, commands): (Vec<Variable>, Vec<Command>),
    rewards: Vec<Rewards>,
    labels: Vec<Named>,
) -> Model {
    let robot = Module { name: "robot".to_owned(), variables, commands, place: Place::default() };
    Model {
        kind: ModelKind::Mdp,
        remark,
        constants,
        formulas: Vec::new(),
        globals: Vec::new(),
        modules: vec![robot],
        rewards,
        labels,
        initial: None,
    }
}

pub(super) fn range(name: &str, greatest: usize, initial: usize) -> Variable {
    Variable {
        name: name.to_owned(),
        range: Some((Expr::int(0), Expr::int(greatest as i64))),
        initial: Some(Expr::int(initial as i64)),
        place: Place::default(),
    }
}

pub(super) fn flag(name: &str) -> Variable {
    Variable { range: None, initial: Some(Expr::bool(false)), ..range(name, 0, 0) }
}

struct ProcessWriter<'a> {
    mission: &'a Coadaptation,
    risk: Risk,
    sets: Vec<String>,
    moves: Vec<String>,
}

pub(super) fn names_of_changes(mission: &Coadaptation) -> Vec<String> {
    distinct(mission.configurations.iter().map(|configuration| format!("set_{}", configuration.name)))
}

pub(super) fn names_of_moves(mission: &Coadaptation) -> Vec<String> {
    let place = |place: usize| &mission.places[place];
    distinct(mission.arcs.iter().map(|arc| format!("go_{}_{}", place(arc.from), place(arc.to))))
}

/// Converts names to identifiers. Identifiers that would be equal get a number, because rewards belong to the
/// name of an action.
fn distinct(names: impl Iterator<Item = String>) -> Vec<String> {
    let mut used = BTreeSet::new();
    let mut identifiers = Vec::new();
    for name in names {
        let plain = identifier(&name);
        let (mut distinct, mut number) = (plain.clone(), 1);
        while !used.insert(distinct.clone()) {
            number += 1;
            distinct = format!("{plain}_{number}");
        }
        identifiers.push(distinct);
    }
    identifiers
}

pub(super) fn equals(variable: &str, value: usize) -> Expr {
    Expr::name(variable).op(BinaryOp::Equal, Expr::int(value as i64))
}

pub(super) fn not(expression: Expr) -> Expr {
    Expr::new(ExprKind::Not(Box::new(expression)))
}

pub(super) fn all(parts: impl IntoIterator<Item = Expr>) -> Expr {
    parts.into_iter().reduce(|all, part| all.op(BinaryOp::And, part)).unwrap_or(Expr::bool(true))
}

pub(super) fn number(value: &BigRational) -> Expr {
    Expr::new(ExprKind::Number(value.clone()))
}

pub(super) type Assignments = Vec<(String, Expr, Place)>;

pub(super) fn assign(name: &str, value: Expr) -> (String, Expr, Place) {
    (name.to_owned(), value, Place::default())
}

impl ProcessWriter<'_> {
    fn remark(&self) -> String {
        let list = |names: Vec<&str>| {
            let numbered: Vec<_> =
                names.iter().enumerate().map(|(n, name)| format!("{n} = {name}")).collect();
            numbered.join(", ")
        };
        let places = list(self.mission.places.iter().map(String::as_str).collect());
        let designs = list(self.mission.configurations.iter().map(|c| c.name.as_str()).collect());
        format!("A co-adaptation mission.\nl, the place: {places}\nc, the configuration: {designs}")
    }

    fn battery(&self) -> Option<Battery> {
        self.mission.battery.filter(|_| self.risk.battery)
    }

    fn variables(&self) -> Vec<Variable> {
        let mission = self.mission;
        let mut variables = vec![
            range("l", mission.places.len() - 1, mission.start),
            range("c", mission.configurations.len().max(2) - 1, mission.initial),
        ];
        let flags = [("hit", self.risk.collisions), ("failed", self.risk.failures), ("lost", self.risk.loss)];
        variables.extend(flags.into_iter().filter(|(_, wanted)| *wanted).map(|(name, _)| flag(name)));
        if let Some(battery) = self.battery() {
            variables.push(range("b", battery.initial as usize, battery.initial as usize));
        }
        variables
    }

    fn running(&self) -> Expr {
        let away = Expr::name("l").op(BinaryOp::NotEqual, Expr::int(self.mission.goal as i64));
        all(std::iter::once(away).chain(self.risk.failures.then(|| not(Expr::name("failed")))))
    }

    /// Returns the guard that the battery suffices for an energy without going below the reserve, and the assignment
    /// that subtracts the energy. Both are missing without a battery, or for an energy of 0 levels.
    fn spend(&self, energy: &BigRational) -> (Option<Expr>, Assignments) {
        let Some(battery) = self.battery() else { return (None, Vec::new()) };
        let levels = i64::from(self.mission.levels(energy));
        if levels == 0 {
            return (None, Vec::new());
        }
        let enough =
            Expr::name("b").op(BinaryOp::GreaterEqual, Expr::int(levels + i64::from(battery.reserve)));
        // The guard keeps the reserve, so the battery never becomes negative.
        (Some(enough), vec![assign("b", Expr::name("b").op(BinaryOp::Minus, Expr::int(levels)))])
    }

    fn not_lost(&self, configuration: usize) -> Option<Expr> {
        (self.risk.loss && self.mission.lost(configuration)).then(|| not(Expr::name("lost")))
    }

    fn set(&self, configuration: usize) -> String {
        self.sets[configuration].clone()
    }

    fn go(&self, arc: usize) -> String {
        self.moves[arc].clone()
    }

    fn commands(&self) -> Vec<Command> {
        let mut commands = Vec::new();
        let available = |design: &usize| self.mission.configurations[*design].available;
        for new in (0..self.mission.configurations.len()).filter(available) {
            for old in 0..self.mission.configurations.len() {
                let Some(switch) = &self.mission.switches[old][new] else { continue };
                let (enough, spent) = self.spend(&switch.energy);
                let guard = all([self.running(), equals("c", old)]
                    .into_iter()
                    .chain(self.not_lost(new))
                    .chain(enough));
                let mut changed = spent.clone();
                changed.push(assign("c", Expr::int(new as i64)));
                // A failed change takes energy and keeps the configuration.
                let failure = BigRational::one() - &switch.success;
                let updates = updates([(switch.success.clone(), changed), (failure, spent)]);
                commands.push(command(self.set(new), guard, updates));
            }
        }
        for (index, arc) in self.mission.arcs.iter().enumerate() {
            for (design, traversal) in arc.by.iter().enumerate().filter(|(design, _)| available(design)) {
                let Some(traversal) = traversal else { continue };
                let (enough, spent) = self.spend(&traversal.energy);
                let place = [self.running(), equals("l", arc.from), equals("c", design)];
                let guard = all(place.into_iter().chain(self.not_lost(design)).chain(enough));
                let updates = updates(self.ends(traversal, arc.to, &spent));
                commands.push(command(self.go(index), guard, updates));
            }
        }
        commands
    }

    fn ends(&self, traversal: &Traversal, to: usize, spent: &Assignments) -> Vec<(BigRational, Assignments)> {
        let certain = BigRational::one();
        let hit = if self.risk.collisions { traversal.hit.clone() } else { BigRational::zero() };
        let success = if self.risk.failures { traversal.success.clone() } else { certain.clone() };
        let with = |assignments: Vec<(&str, Expr)>| {
            let assignments = assignments.into_iter().map(|(name, value)| assign(name, value));
            assignments.chain(spent.iter().cloned()).collect::<Assignments>()
        };
        let there = ("l", Expr::int(to as i64));
        let ends = [
            (&success * (&certain - &hit), with(vec![there.clone()])),
            (&success * &hit, with(vec![there, ("hit", Expr::bool(true))])),
            (&certain - &success, with(vec![("failed", Expr::bool(true))])),
        ];
        let Some(loss) = self.mission.loss.as_ref().filter(|_| self.risk.loss) else { return ends.to_vec() };
        let mut outcomes = Vec::new();
        for (probability, assignments) in ends {
            let mut lost = assignments.clone();
            lost.push(assign("lost", Expr::bool(true)));
            outcomes.push((&probability * (&certain - &loss.rate), assignments));
            outcomes.push((probability * &loss.rate, lost));
        }
        outcomes
    }

    fn rewards(&self) -> Vec<Rewards> {
        let mut time = Vec::new();
        let mut energy = Vec::new();
        let mut collisions = Vec::new();
        let mut add_reward = |action: &str, guard: Expr, values: [&BigRational; 3]| {
            for (list, value) in [&mut time, &mut energy, &mut collisions].into_iter().zip(values) {
                if !value.is_zero() {
                    list.push(item(action, guard.clone(), number(value)));
                }
            }
        };
        let zero = BigRational::zero();
        for new in 0..self.mission.configurations.len() {
            for (old, switches) in self.mission.switches.iter().enumerate() {
                if let Some(switch) = &switches[new] {
                    add_reward(&self.set(new), equals("c", old), [&switch.time, &switch.energy, &zero]);
                }
            }
        }
        for (index, arc) in self.mission.arcs.iter().enumerate() {
            for (design, traversal) in arc.by.iter().enumerate() {
                if let Some(traversal) = traversal {
                    let success =
                        if self.risk.failures { traversal.success.clone() } else { BigRational::one() };
                    // The expected number of collisions of a move is its collision probability.
                    let hits = if self.risk.collisions { success * &traversal.hit } else { zero.clone() };
                    add_reward(
                        &self.go(index),
                        equals("c", design),
                        [&traversal.time, &traversal.energy, &hits],
                    );
                }
            }
        }
        let once = |actions: BTreeSet<String>| {
            actions.iter().map(|action| item(action, Expr::bool(true), Expr::int(1))).collect::<Vec<_>>()
        };
        let sets = once((0..self.mission.configurations.len()).map(|design| self.set(design)).collect());
        let moves = once((0..self.mission.arcs.len()).map(|arc| self.go(arc)).collect());
        let rewards = [time, energy, collisions, sets, moves];
        let named = REWARDS.iter().zip(rewards);
        named
            .map(|(name, items)| Rewards { name: (*name).to_owned(), items, place: Place::default() })
            .collect()
    }

    fn labels(&self) -> Vec<Named> {
        let goal = equals("l", self.mission.goal);
        let label = |name: &str, expression: Expr| Named {
            name: name.to_owned(),
            expression,
            place: Place::default(),
        };
        let arrived = all(std::iter::once(goal).chain(self.risk.failures.then(|| not(Expr::name("failed")))));
        let safe =
            all(std::iter::once(arrived.clone()).chain(self.risk.collisions.then(|| not(Expr::name("hit")))));
        vec![label("goal", arrived), label("safe_goal", safe), label("stop", not(self.running()))]
    }
}

pub(super) fn item(action: &str, guard: Expr, reward: Expr) -> RewardItem {
    RewardItem { action: Some(Some(action.to_owned())), guard, reward, place: Place::default() }
}

pub(super) fn command(action: String, guard: Expr, updates: Vec<Update>) -> Command {
    Command { action: Some(action), guard, updates, place: Place::default() }
}

/// Converts outcomes to updates of a PRISM command. Outcomes of probability 0 are omitted, and a single outcome gets
/// no explicit probability.
pub(super) fn updates(ends: impl IntoIterator<Item = (BigRational, Assignments)>) -> Vec<Update> {
    let possible: Vec<_> = ends.into_iter().filter(|(probability, _)| !probability.is_zero()).collect();
    let certain = possible.len() == 1;
    let update = |(probability, assignments): (BigRational, Assignments)| Update {
        probability: (!certain).then(|| number(&probability)),
        assignments,
    };
    possible.into_iter().map(update).collect()
}
