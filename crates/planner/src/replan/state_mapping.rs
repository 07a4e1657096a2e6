//! Maps problems of a domain to states of a task that was grounded for another problem of the domain.
//!
//! The mapping requires that both problems have the same operators. The problems may differ in availability,
//! in numbers that actions change, and in facts that actions change and for which the task has variables.
//! These facts must be reachable in the relaxation of the task and must respect its mutex groups. Then every
//! fact that is reachable in the new problem is also reachable in the grounded problem. Facts and values that
//! actions change but nothing reads may differ arbitrarily. Everything else must be equal: other facts and
//! values (even if nothing reads them), objects, goal, constraints and metric. The last three are compared as
//! syntax trees with their positions in the text. Timed initial literals are not supported.

use num_rational::BigRational;
use num_traits::ToPrimitive;
use rustc_hash::{FxHashMap, FxHashSet};
use task::lifted::ObjectId;
use task::number::{Int, dense};
use task::task::{Fact, State, Task};

use crate::replan::usage::{Usage, key};
use pddl::ast::{Atom, InitialElement, Name, Problem};
use pddl::validate::Advance;

#[derive(Debug)]
pub(super) struct Layout {
    usage: Usage,
    /// Predicates with one parameter that state availability.
    assumed: Vec<Name>,
    /// Facts about availability with which the task was grounded.
    grounded: FxHashSet<String>,
    objects: FxHashMap<String, ObjectId>,
    /// Objects, goal, constraints and metric of all supported problems, as text.
    frame: String,
    /// Variable and value of each fact, and whether it is reachable in the relaxation.
    facts: FxHashMap<String, (Fact, bool)>,
    numbers: FxHashMap<String, usize>,
    scale: BigRational,
    /// Facts without a variable in the task that must be true in every problem, numbered from 0.
    fixed: FxHashMap<String, usize>,
    /// Numeric values without a variable in the task that must be equal in every problem, numbered from 0.
    values: FxHashMap<String, (usize, BigRational)>,
    /// Values of the variables if no fact is true.
    nothing: Vec<u32>,
}

#[derive(Debug, Clone)]
pub(super) struct ReplanState {
    pub(super) state: State,
    pub(super) available: Vec<Vec<ObjectId>>,
}

impl Layout {
    /// Creates the mapping to a task. `problem` is the problem for which the task was grounded.
    #[expect(clippy::arithmetic_side_effects, reason = "every variable has a value")]
    pub(super) fn new(usage: Usage, assumed: &[Name], problem: &Problem, task: &Task) -> Self {
        let names = task.object_names.iter().map(|name| name.to_ascii_lowercase());
        let numbers = task.number_names.iter().map(|name| name.to_ascii_lowercase());
        let mut layout = Self {
            usage,
            assumed: assumed.to_vec(),
            grounded: FxHashSet::default(),
            objects: names.zip((0..).map(ObjectId)).collect(),
            frame: frame(problem),
            facts: facts(task),
            numbers: numbers.zip(0..).collect(),
            scale: BigRational::from_integer(task.number_scale.into()),
            fixed: FxHashMap::default(),
            values: FxHashMap::default(),
            nothing: task.variables.iter().map(|variable| dense(variable.values.len()) - 1).collect(),
        };
        for element in &problem.init {
            match element {
                InitialElement::Fact(atom) => {
                    let key = key(atom);
                    if assumed.contains(&atom.predicate.name) {
                        layout.grounded.insert(key);
                    } else if !layout.facts.contains_key(&key) && layout.matters(atom, &key) {
                        let position = layout.fixed.len();
                        layout.fixed.entry(key).or_insert(position);
                    }
                }
                InitialElement::Value(function, value, _) => {
                    let key = key(function);
                    if !layout.numbers.contains_key(&key) && layout.value_matters(function) {
                        let position = layout.values.len();
                        layout.values.entry(key).or_insert((position, value.clone()));
                    }
                }
                InitialElement::NegatedFact(_) | InitialElement::Timed(..) => {}
            }
        }
        layout
    }

    /// Returns `true` if a fact that has no variable in the task must be stated by every problem or by none.
    fn matters(&self, atom: &Atom, key: &str) -> bool {
        let predicate = &atom.predicate.name;
        !self.assumed.contains(predicate)
            && (!self.usage.is_changed(predicate) || self.usage.is_read(predicate, key))
    }

    /// Returns `true` if a problem is supported only if it states the same value of this function as the
    /// grounded problem. The function has no variable in the task.
    fn value_matters(&self, function: &Atom) -> bool {
        let name = &function.predicate.name;
        !self.usage.is_changed(name) || self.usage.is_function_read(name)
    }

    /// Converts the initial state of a problem to a state of the task. Returns `None` if the task does not
    /// support the problem.
    pub(super) fn situation(&self, task: &Task, problem: &Problem) -> Option<ReplanState> {
        if frame(problem) != self.frame {
            return None;
        }
        let numbers = vec![None; self.numbers.len()];
        let mut reading = Reading {
            values: self.nothing.clone(),
            numbers,
            available: vec![Vec::new(); self.assumed.len()],
            fixed: vec![false; self.fixed.len()],
            fixed_values: vec![false; self.values.len()],
        };
        for element in &problem.init {
            self.read(element, &mut reading)?;
        }
        let is_complete = reading.fixed.iter().chain(&reading.fixed_values).all(|is_present| *is_present);
        let numbers = reading.numbers.into_iter().collect::<Option<Vec<Int>>>()?;
        let mut state = State { values: reading.values, numbers };
        if !respects_exclusion(task, &state) {
            return None;
        }
        task.evaluate_axioms(&mut state);
        for objects in &mut reading.available {
            objects.sort_unstable();
            objects.dedup();
        }
        is_complete.then_some(ReplanState { state, available: reading.available })
    }

    fn read(&self, element: &InitialElement, reading: &mut Reading) -> Option<()> {
        match element {
            InitialElement::Fact(atom) => {
                let key = key(atom);
                if let Some(predicate) = self.assumed.iter().position(|name| *name == atom.predicate.name) {
                    if !self.grounded.contains(&key) {
                        return None;
                    }
                    let object = key.trim_end_matches(')').split_once(' ')?.1;
                    reading.available[predicate].push(*self.objects.get(object)?);
                } else if let Some((fact, is_reached)) = self.facts.get(&key) {
                    return self.set(&mut reading.values, *fact, *is_reached);
                } else if let Some(position) = self.fixed.get(&key) {
                    reading.fixed[*position] = true;
                } else if self.matters(atom, &key) {
                    return None;
                }
            }
            InitialElement::Value(function, value, _) => {
                let key = key(function);
                if let Some(position) = self.numbers.get(&key) {
                    reading.numbers[*position] = Some(self.integer(value)?);
                } else if let Some((position, expected)) = self.values.get(&key) {
                    reading.fixed_values[*position] = true;
                    return (expected == value).then_some(());
                } else if self.value_matters(function) {
                    return None;
                }
            }
            InitialElement::NegatedFact(_) => {}
            InitialElement::Timed(..) => return None,
        }
        Some(())
    }

    /// Sets a fact in the values of a state. Returns `None` if the variable already has another fact, or the
    /// fact is unreachable.
    fn set(&self, values: &mut [u32], fact: Fact, is_reached: bool) -> Option<()> {
        let value = &mut values[fact.variable.index()];
        let is_free = *value == self.nothing[fact.variable.index()] || *value == fact.value;
        *value = fact.value;
        (is_free && is_reached).then_some(())
    }

    fn integer(&self, value: &BigRational) -> Option<Int> {
        let scaled = value * &self.scale;
        scaled.is_integer().then(|| scaled.to_integer().to_i128()).flatten()
    }

    /// Returns the state after a step. Returns `None` if the step changes facts or values that must not
    /// change, or if the task cannot represent the new state.
    pub(super) fn advance(&self, task: &Task, state: &State, step: &Advance) -> Option<State> {
        let mut next = state.clone();
        for atom in &step.deleted {
            let key = key(atom);
            let is_settled = || self.fixed.contains_key(&key) || self.assumed.contains(&atom.predicate.name);
            match self.facts.get(&key) {
                Some((fact, _)) if fact.holds(&next.values) => {
                    next.values[fact.variable.index()] = self.nothing[fact.variable.index()];
                }
                None if is_settled() => return None,
                _ => {}
            }
        }
        for atom in &step.added {
            let key = key(atom);
            match self.facts.get(&key) {
                Some((fact, is_reached)) => self.set(&mut next.values, *fact, *is_reached)?,
                None if self.matters(atom, &key) || self.assumed.contains(&atom.predicate.name) => {
                    return None;
                }
                None => {}
            }
        }
        for change in &step.values {
            match self.numbers.get(&key(&change.function)) {
                Some(position) => next.numbers[*position] = self.integer(&change.after)?,
                None if self.value_matters(&change.function) => return None,
                None => {}
            }
        }
        if !respects_exclusion(task, &next) {
            return None;
        }
        task.evaluate_axioms(&mut next);
        Some(next)
    }

    pub(super) fn object(&self, name: &str) -> Option<ObjectId> {
        self.objects.get(&name.to_ascii_lowercase()).copied()
    }
}

fn respects_exclusion(task: &Task, state: &State) -> bool {
    task.exclusive.iter().all(|group| group.iter().filter(|fact| fact.holds(&state.values)).count() <= 1)
}

struct Reading {
    values: Vec<u32>,
    numbers: Vec<Option<Int>>,
    available: Vec<Vec<ObjectId>>,
    fixed: Vec<bool>,
    fixed_values: Vec<bool>,
}

fn frame(problem: &Problem) -> String {
    use std::fmt::Write as _;
    let mut text = String::new();
    for object in &problem.objects {
        text.push_str(object.identifier.name.as_str());
        for kind in &object.r#type.alternatives {
            text.push(':');
            text.push_str(kind.name.as_str());
        }
        text.push(' ');
    }
    // The text includes source positions. A problem with other positions is therefore not supported, which
    // costs time but is correct.
    let _ = write!(text, "{:?} {:?} {:?}", problem.goal, problem.constraints, problem.metric);
    text
}

/// Facts of basic (not derived) variables by name, and whether each is true initially or an effect
/// of an operator.
fn facts(task: &Task) -> FxHashMap<String, (Fact, bool)> {
    let mut reached: FxHashSet<Fact> = FxHashSet::default();
    for operator in &task.operators {
        reached.extend(operator.effects.iter().copied());
        reached.extend(operator.conditional.iter().flat_map(|effect| effect.effects.iter().copied()));
    }
    let mut facts = FxHashMap::default();
    for (variable, id) in task.variables[..task.basic].iter().zip((0..).map(task::task::VariableId)) {
        for (text, value) in variable.values.iter().zip(0..) {
            let fact = Fact { variable: id, value };
            let is_reached = reached.contains(&fact) || task.initial.values[id.index()] == value;
            if text.starts_with('(') {
                facts.insert(text.to_ascii_lowercase(), (fact, is_reached));
            }
        }
    }
    facts
}
