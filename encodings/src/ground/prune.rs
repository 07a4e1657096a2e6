//! Operators and atoms that cannot matter are removed.
//!
//! Forwards: relaxed reachability once more, now over the operators that are left when everything static is
//! decided. Backwards: effects on atoms that no condition reads, then operators that do nothing at all.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::configuration::conjuncts;
use crate::ground::evaluate::{AtomId, World};
use crate::ground::instantiate::{GroundOperator, GroundTask};
use crate::ground::normal_form::GroundCondition;
use crate::lifted::{Arguments, Formula, Lifted, PredicateId, Rational};
use crate::quantity::NumericId;

/// Prunes the task in place; returns a reason if the goal cannot be reached even if nothing is ever deleted.
pub(crate) fn prune(lifted: &Lifted, task: &mut GroundTask<'_>) -> Option<String> {
    let initially: Vec<bool> = task
        .world
        .atoms
        .keys()
        .map(|(predicate, arguments)| task.world.holds_initially(*predicate, arguments))
        .collect();
    let reached = forward(task, &initially);
    let goal_atoms: Vec<AtomId> = match &task.goal {
        None => return Some(why_goal_is_false(lifted, task)),
        Some(goal) => goal.literals.iter().filter(|(_, positive)| *positive).map(|(atom, _)| *atom).collect(),
    };
    if let Some(atom) = goal_atoms.into_iter().find(|atom| !reached[atom.index()]) {
        return Some(never_true(&atom_name(lifted, task, atom)));
    }
    drop_unread_numerics(task);
    backward(task);
    None
}

fn never_true(atom: &str) -> String {
    format!("no action can make {atom} true, even if nothing is ever deleted")
}

/// A sentence about a goal that is false whatever happens: the first atom in it that can never hold.
fn why_goal_is_false(lifted: &Lifted, task: &GroundTask<'_>) -> String {
    for conjunct in conjuncts(&lifted.goal) {
        if let Formula::Literal { positive: true, predicate, terms } = conjunct {
            let arguments = World::arguments(terms, &Vec::new());
            if !task.world.can_hold(*predicate, &arguments) {
                return never_true(&name(lifted, *predicate, &arguments));
            }
        }
    }
    "the goal contradicts what never changes".into()
}

/// `(predicate arguments)` as PDDL writes it.
pub(crate) fn atom_name(lifted: &Lifted, task: &GroundTask<'_>, atom: AtomId) -> String {
    let found = task.world.atoms.get_index(atom.index());
    found.map_or_else(String::new, |((predicate, arguments), ())| name(lifted, *predicate, arguments))
}

fn name(lifted: &Lifted, predicate: PredicateId, arguments: &Arguments) -> String {
    let mut text = format!("({}", lifted.predicates[predicate.index()].name);
    for object in arguments {
        text.push(' ');
        text.push_str(lifted.objects[object.index()].as_str());
    }
    text.push(')');
    text
}

/// Removes operators that are not reachable in the delete relaxation; returns the atoms that are.
fn forward(task: &mut GroundTask<'_>, initially: &[bool]) -> Vec<bool> {
    let mut readers: FxHashMap<AtomId, Vec<usize>> = FxHashMap::default();
    let mut missing = Vec::with_capacity(task.operators.len());
    let mut reached = initially.to_vec();
    let mut open: Vec<usize> = Vec::new();
    for (index, operator) in task.operators.iter().enumerate() {
        let needs =
            operator.condition.literals.iter().filter(|(atom, positive)| *positive && !reached[atom.index()]);
        let count = needs.map(|(atom, _)| readers.entry(*atom).or_default().push(index)).count();
        missing.push(count);
        if count == 0 {
            open.push(index);
        }
    }
    while let Some(index) = open.pop() {
        for atom in &task.operators[index].adds {
            if std::mem::replace(&mut reached[atom.index()], true) {
                continue;
            }
            for reader in readers.get(atom).into_iter().flatten() {
                missing[*reader] -= 1;
                if missing[*reader] == 0 {
                    open.push(*reader);
                }
            }
        }
    }
    let mut keep = missing.iter().map(|count| *count == 0);
    task.operators.retain(|_| keep.next().unwrap_or(true));
    let possible = |&(atom, positive): &(AtomId, bool)| !positive || reached[atom.index()];
    task.operators
        .retain(|operator| operator.condition.clauses.iter().all(|clause| clause.iter().any(possible)));
    for operator in &mut task.operators {
        operator.deletes.retain(|atom| reached[atom.index()]);
    }
    reached
}

/// Removes effects on numeric variables that no condition depends on; the metric has been made of them already.
fn drop_unread_numerics(task: &mut GroundTask<'_>) {
    let conditions = task.operators.iter().map(|operator| &operator.condition).chain(&task.goal);
    let comparisons = conditions.flat_map(|condition| &condition.comparisons);
    let mut open: Vec<NumericId> = comparisons
        .flat_map(|(linear, _)| linear.coefficients.iter().map(|(variable, _)| *variable))
        .collect();
    let mut read: FxHashSet<NumericId> = open.iter().copied().collect();
    while let Some(variable) = open.pop() {
        let values = task.operators.iter().filter_map(|operator| operator.numeric_effects.get(&variable));
        for (source, _) in values.flat_map(|value| &value.coefficients) {
            if read.insert(*source) {
                open.push(*source);
            }
        }
    }
    for operator in &mut task.operators {
        operator.numeric_effects.retain(|variable, _| read.contains(variable));
    }
}

/// Removes effects on atoms that nothing reads, and operators that do nothing and earn nothing.
fn backward(task: &mut GroundTask<'_>) {
    loop {
        let mut read: FxHashSet<AtomId> = FxHashSet::default();
        let conditions = task.operators.iter().map(|operator| &operator.condition).chain(&task.goal);
        conditions.for_each(|condition| read.extend(atoms(condition)));
        let before = task.operators.len();
        for operator in &mut task.operators {
            operator.adds.retain(|atom| read.contains(atom));
            operator.deletes.retain(|atom| read.contains(atom));
        }
        task.operators.retain(|operator| !is_idle(operator));
        if task.operators.len() == before {
            return;
        }
    }
}

fn atoms(condition: &GroundCondition) -> impl Iterator<Item = AtomId> + '_ {
    condition.literals.iter().chain(condition.clauses.iter().flatten()).map(|(atom, _)| *atom)
}

/// Whether the operator changes nothing and cannot lower the cost of a plan.
fn is_idle(operator: &GroundOperator) -> bool {
    let known: FxHashSet<_> = operator.condition.literals.iter().copied().collect();
    let lowest = operator.cost.tables.iter().filter_map(|table| table.values.iter().min());
    let lowest = lowest.fold(operator.cost.constant, |sum, value| sum + value);
    operator.adds.iter().all(|atom| known.contains(&(*atom, true)))
        && operator.deletes.iter().all(|atom| known.contains(&(*atom, false)))
        && operator.numeric_effects.iter().all(|(variable, value)| {
            value.quantity.is_zero() && value.coefficients[..] == [(*variable, Rational::from_integer(1))]
        })
        && lowest >= Rational::from_integer(0)
}
