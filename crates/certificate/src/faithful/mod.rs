//! Checks that a ground task is faithful to its PDDL files (translation validation), without
//! grounding the files again.
//!
//! The proof is a simulation [1]. The initial states correspond. Each effect of an action in a
//! state of the files is matched by an operator of the task, with some choice of designs, at no
//! more cost. The goal of the files implies the goal of the task. Then the optimality proof about
//! the task also holds for plans of the files. The task may permit more than the files and omit
//! irrelevant parts.
//!
//! The check visits all action instances whose static conditions hold. `instances` enumerates them by joins over static
//! atoms. `reader` and `action` compute their conditions and effects case by case. `compare` searches for the operator,
//! and `effects` compares its effects. `translation` expresses the task in terms of the files. A variable of the task
//! represents atoms of which at most one holds; this is checked initially and for every instance.
//!
//! An instance needs no operator if it does not change the task state and its cost is not negative. Neither does an
//! instance whose conditions contradict static facts, each other, the variables or the witness. The witness
//! (`invariant`) over-approximates the possible atoms and the ranges of numbers; the check proves that no instance
//! leaves it.
//!
//! Supported: all kinds of conditions; conditional and universal effects; linear numbers; derived
//! predicates, including recursive ones that are variables of the task with equivalent rules;
//! instantaneous and durative actions, executed one after another; timed initial literals
//! (`timeline`); metrics of both directions. Any other construct yields [`Cause::Unsupported`].
//! The check shares only the syntax tree and the type hierarchy with the grounder.
//!
//! [1] R. Milner: An algebraic definition of simulation between programs, IJCAI 1971.

mod action;
mod axioms;
mod bound;
mod candidates;
mod case;
mod compare;
mod derived;
mod effects;
mod exclusive;
mod formula;
mod happening;
mod instances;
mod invariant;
mod key;
mod length;
mod lengths;
mod linear;
mod reader;
mod reads;
mod relation;
mod timeline;
mod translation;
mod verdict;
mod world;

use std::collections::BTreeSet;

use num_rational::BigRational;

use crate::check::GroundTask;
use crate::model::Model;
use axioms::Axioms;
use case::Case;
use compare::Comparison;
use exclusive::{Group, Move};
use invariant::{Invariant, Widening};
use key::Key;
use pddl::ast::{Action, ActionBody, ConditionTime, Domain, Effect, Problem};
use reader::Reader;
use translation::{Names, Translation};
use verdict::Obstacle;
pub use verdict::{Cause, Difference, Faithful};
use world::World;

const ROUND_LIMIT: usize = 10_000;

type Result<T> = std::result::Result<T, Obstacle>;

/// Checks that a ground task is faithful to its PDDL files. `witness` is an over-approximation of
/// the reachable states, which is checked, too. `stop` returns `true` to cancel the check.
pub fn faithful(
    domain: &Domain,
    problem: &Problem,
    task: &str,
    witness: &str,
    stop: &dyn Fn() -> bool,
) -> Faithful {
    match read(task) {
        Ok(task) => faithful_to(domain, problem, &task, witness, stop),
        Err(obstacle) => verdict(obstacle),
    }
}

/// Checks that a ground task is faithful to its PDDL files, see [`faithful()`].
pub fn faithful_to(
    domain: &Domain,
    problem: &Problem,
    task: &GroundTask,
    witness: &str,
    stop: &dyn Fn() -> bool,
) -> Faithful {
    let files = Files::new(domain, problem, &task.model, stop);
    files.and_then(|files| files.compare(witness)).unwrap_or_else(verdict)
}

/// Computes the witness (an over-approximation of the reachable states) for a ground task, as JSON.
///
/// # Errors
/// A verdict as of [`faithful()`]: the task is malformed, a construct is not supported, a limit on sizes is
/// exceeded, or the computation was stopped.
pub fn witness(
    domain: &Domain,
    problem: &Problem,
    task: &str,
    stop: &dyn Fn() -> bool,
) -> std::result::Result<String, Faithful> {
    let witness = read(task).and_then(|task| Files::new(domain, problem, &task.model, stop)?.witness());
    witness.map_err(verdict)
}

/// Computes the witness of a ground task as [`witness()`] does, and checks with it that the task is faithful to its
/// PDDL files. The check reads the witness from its JSON.
///
/// # Errors
/// The verdict of [`witness()`] or of [`faithful()`], if it is not [`Faithful::Yes`].
pub fn witnessed(
    domain: &Domain,
    problem: &Problem,
    task: &GroundTask,
    stop: &dyn Fn() -> bool,
) -> std::result::Result<String, Faithful> {
    let files = Files::new(domain, problem, &task.model, stop).map_err(verdict)?;
    let witness = files.witness().map_err(verdict)?;
    match files.compare(&witness).unwrap_or_else(verdict) {
        Faithful::Yes { .. } => Ok(witness),
        other => Err(other),
    }
}

fn verdict(obstacle: Obstacle) -> Faithful {
    match obstacle {
        Obstacle::Differs(difference) => Faithful::No(difference),
        Obstacle::Open(cause) => Faithful::Undecided(cause),
    }
}

fn read(task: &str) -> Result<GroundTask> {
    Ok(GroundTask::read(task).map_err(|fault| Difference::from(&fault))?)
}

struct Instance {
    action: usize,
    arguments: Vec<u32>,
    requires: Vec<Key>,
}

struct Files<'f> {
    domain: &'f Domain,
    world: World<'f>,
    model: &'f Model,
    names: Names,
    instances: Vec<Instance>,
    stop: &'f dyn Fn() -> bool,
}

impl<'f> Files<'f> {
    fn new(
        domain: &'f Domain,
        problem: &'f Problem,
        model: &'f Model,
        stop: &'f dyn Fn() -> bool,
    ) -> Result<Self> {
        let world = World::new(domain, problem)?;
        let names = Names::new(&world, model)?;
        let mut instances = Vec::new();
        let mut size = 0_usize;
        for (action, schema) in domain.actions.iter().enumerate() {
            for arguments in instances::of(&world, schema, stop)? {
                size = size.saturating_add(arguments.len());
                let requires = requires(&world, schema, &arguments)?;
                instances.push(Instance { action, arguments, requires });
            }
            if instances.len() > instances::INSTANCE_LIMIT || size > instances::ARGUMENT_LIMIT {
                return Err(instances::too_many("actions").into());
            }
        }
        Ok(Self { domain, world, model, names, instances, stop })
    }

    fn stopped(&self) -> std::result::Result<(), Cause> {
        if (self.stop)() { Err(Cause::Stopped) } else { Ok(()) }
    }

    /// Returns cases that cover all executions of the instance in states that satisfy the invariant. An empty list
    /// proves that the instance is executable in no such state.
    fn cases(&self, instance: &Instance, invariant: &Invariant, axioms: &Axioms) -> Result<Vec<Case>> {
        self.stopped()?;
        if instance.requires.iter().any(|key| !invariant.may_hold(key)) {
            return Ok(Vec::new());
        }
        let schema = &self.domain.actions[instance.action];
        let mut reader = Reader::new(&self.world, invariant, axioms);
        let names = schema.parameters.iter().map(|parameter| &parameter.identifier.name);
        reader.binding = names.zip(instance.arguments.iter().copied()).collect();
        let cases = action::cases(reader, &self.names.structure, schema);
        Ok(cases.map_err(|cause| cause.within(&self.world.call(schema, &instance.arguments)))?)
    }

    fn witness(&self) -> Result<String> {
        let mut widening = Widening::new(&self.world);
        let untimed = self.world.timeline.is_empty();
        let plain: Vec<bool> = self.domain.actions.iter().map(|action| untimed && is_plain(action)).collect();
        let waits = action::waits(&self.world.timeline, &self.names.structure)?;
        // The effects of a plain action are constant, so its instances are visited only until they are
        // reachable.
        let mut open: Vec<&Instance> = self.instances.iter().collect();
        for _ in 0..ROUND_LIMIT {
            let axioms = derived::axioms(&self.world, &widening.invariant, &self.names.linked, self.stop)?;
            // The facts about derived atoms refer to the invariant at the start of the round, so this invariant
            // is used during the round.
            let frozen = (self.world.derived().next().is_some()).then(|| widening.invariant.clone());
            let (mut news, mut next) = (false, Vec::new());
            for case in &waits {
                news |= widening.include(&self.names.structure, case);
            }
            for instance in open {
                let invariant = frozen.as_ref().unwrap_or(&widening.invariant);
                let cases = self.cases(instance, invariant, &axioms)?;
                for case in &cases {
                    news |= widening.include(&self.names.structure, case);
                }
                if cases.is_empty() || !plain[instance.action] {
                    next.push(instance);
                }
            }
            open = next;
            if !news {
                let mut invariant = widening.invariant;
                invariant.exclusive = self.exclusive(&invariant, &axioms)?;
                return Ok(invariant.write(&self.world));
            }
        }
        Err(invariant::too_many_rounds(ROUND_LIMIT).into())
    }

    /// Searches for mutex groups for the variables whose own atoms are not preserved as a mutex group. Some of
    /// these variables may get no group, because the search is limited.
    fn exclusive(&self, invariant: &Invariant, axioms: &Axioms) -> Result<Vec<Group>> {
        let atoms = |variable| self.names.atoms(variable).map(|(_, key)| key.clone()).collect();
        let variables: Vec<Group> = self.model.basic_variables().map(atoms).collect();
        let may_hold = |key: &Key| invariant.may_hold(key);
        let mut broken: BTreeSet<u32> = BTreeSet::new();
        self.each_move(invariant, axioms, &mut |own| {
            let touched = own.adds.iter().filter_map(|key| Some(self.names.fact(key)?.0));
            broken
                .extend(touched.filter(|own_variable| {
                    own.keeps(&variables[*own_variable as usize], &may_hold).is_err()
                }));
        })?;
        if broken.is_empty() {
            return Ok(Vec::new());
        }
        let mut moves = Vec::new();
        self.each_move(invariant, axioms, &mut |own| moves.push(own))?;
        let broken = broken.into_iter().map(|variable| variables[variable as usize].clone());
        Ok(exclusive::search(&self.world, &may_hold, broken, &moves, self.stop))
    }

    /// Calls `visit` with the effects on mutex groups of each wait, and of those cases of each
    /// action instance that may add an atom.
    fn each_move(&self, invariant: &Invariant, axioms: &Axioms, visit: &mut dyn FnMut(Move)) -> Result<()> {
        let structure = &self.names.structure;
        let waits = action::waits(&self.world.timeline, structure)?;
        let effect =
            |case: &Case| Move::new(structure, case, Invariant::added(structure, case).cloned().collect());
        waits.iter().map(effect).for_each(&mut *visit);
        for instance in &self.instances {
            let cases = self.cases(instance, invariant, axioms)?;
            cases.iter().map(effect).filter(Move::adds_any).for_each(&mut *visit);
        }
        Ok(())
    }

    #[expect(clippy::arithmetic_side_effects, reason = "instances are held in memory")]
    fn compare(mut self, witness: &str) -> Result<Faithful> {
        let invariant = Invariant::read(&self.world, witness)?;
        for (number, group) in exclusive::numbered(self.model.variables.len(), &invariant.exclusive) {
            for key in group {
                self.names.structure.groups.entry(key.clone()).or_default().push(number);
            }
        }
        let axioms = derived::axioms(&self.world, &invariant, &self.names.linked, self.stop)?;
        let task = Translation::new(&self.world, self.model, &self.names, &invariant, &axioms)?;
        // Decided by the domain alone: the witness may contain atoms that no plan reaches.
        let timed = self.world.problem.metric.is_none() && self.domain.actions.iter().any(is_durative);
        let unit = self.unit(&invariant, &axioms)?;
        let comparison = Comparison::new(&task, timed, unit)?;
        comparison.initial()?;
        comparison.goal()?;
        comparison.rules()?;
        for case in action::waits(&self.world.timeline, &self.names.structure)? {
            invariant.admits(&self.world, &self.names.structure, &case)?;
            comparison.wait(&case)?;
        }
        let (mut instances, mut idle) = (0, 0);
        for instance in &self.instances {
            let cases = self.cases(instance, &invariant, &axioms)?;
            instances += usize::from(!cases.is_empty());
            let mut changes = false;
            for case in &cases {
                invariant.admits(&self.world, &self.names.structure, case)?;
                let schema = &self.domain.actions[instance.action];
                changes |= comparison.case(schema, &instance.arguments, case)?;
            }
            idle += usize::from(!cases.is_empty() && !changes);
        }
        Ok(Faithful::Yes { instances, idle, timed })
    }

    /// Returns a common divisor of the times of events and of all durations. Without timed events, returns 1, which is
    /// not used.
    fn unit(&self, invariant: &Invariant, axioms: &Axioms) -> Result<BigRational> {
        let mut durations = BTreeSet::new();
        if !self.world.timeline.is_empty() {
            for instance in &self.instances {
                let cases = self.cases(instance, invariant, axioms)?;
                let lengths = cases.into_iter().filter_map(|case| case.length);
                durations.extend(lengths.map(|length| length.least));
            }
        }
        Ok(self.world.timeline.unit(durations.iter()))
    }
}

fn is_durative(action: &Action) -> bool {
    matches!(action.body, ActionBody::Durative { .. })
}

/// Returns `true` if the effects of an action are unconditional and do not change numbers.
fn is_plain(action: &Action) -> bool {
    fn plain(effect: &Effect) -> bool {
        match effect {
            Effect::And(parts) => parts.iter().all(plain),
            Effect::ForAll(_, inner) => plain(inner),
            Effect::Add(_) | Effect::Delete(_) => true,
            Effect::When(..) | Effect::Assign(..) => false,
        }
    }
    match &action.body {
        ActionBody::Instantaneous { effect, .. } => plain(effect),
        ActionBody::Durative { effects, .. } => effects.iter().all(|(_, effect)| plain(effect)),
    }
}

/// Returns the conjuncts of an instance's condition (for a durative action, of its start condition)
/// that are atoms of changing predicates.
fn requires(world: &World<'_>, action: &Action, arguments: &[u32]) -> std::result::Result<Vec<Key>, Cause> {
    let mut atoms = Vec::new();
    match &action.body {
        ActionBody::Instantaneous { precondition, .. } => instances::conjuncts(precondition, &mut atoms),
        ActionBody::Durative { conditions, .. } => {
            for (_, condition) in conditions.iter().filter(|(time, _)| *time == ConditionTime::AtStart) {
                instances::conjuncts(condition, &mut atoms);
            }
        }
    }
    let names = action.parameters.iter().map(|parameter| &parameter.identifier.name);
    let binding = names.zip(arguments.iter().copied()).collect();
    let mut keys = Vec::new();
    for atom in atoms {
        let key = world.key(atom, &binding)?;
        if world.changes(key.0) {
            keys.push(key);
        }
    }
    Ok(keys)
}
