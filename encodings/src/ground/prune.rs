//! Operators and atoms that cannot matter are removed.
//!
//! Forwards: relaxed reachability once more, now over the operators that are left when everything static is
//! decided. Backwards: effects on atoms that no condition reads, then operators that do nothing at all.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::configuration::conjuncts;
use crate::ground::Generality;
use crate::ground::derived::simplify;
use crate::ground::evaluate::{AtomId, World};
use crate::ground::instantiate::{GroundOperator, GroundTask};
use crate::ground::intervals::{goal_can_hold, prune_by_numbers};
use crate::ground::normal_form::{GroundCondition, GroundLiteral};
use crate::lifted::{Formula, Lifted, ObjectId, PredicateId, Rational};
use crate::limits::{Interrupted, Limits};
use crate::quantity::{NumericId, Quantity};
use pddl::ast::Name;

/// Prunes the task in place; returns a reason if the goal cannot be reached even if nothing is ever deleted.
pub(crate) fn prune(
    lifted: &Lifted,
    task: &mut GroundTask<'_>,
    generality: &Generality,
    limits: &Limits,
) -> Result<Option<String>, Interrupted> {
    let initially: Vec<bool> = task
        .world
        .atoms
        .keys()
        .map(|(predicate, arguments)| task.world.holds_initially(*predicate, arguments))
        .collect();
    let mut reached = forward(task, &initially, limits)?;
    while generality.numbers.is_none() && prune_by_numbers(task, limits)? {
        simplify(task, limits)?;
        reached = forward(task, &initially, limits)?;
    }
    let goal_atoms: Vec<AtomId> = match &task.goal {
        None => return Ok(Some(why_goal_is_false(lifted, task))),
        Some(goal) => goal.literals.iter().filter(|(_, positive)| *positive).map(|(atom, _)| *atom).collect(),
    };
    if let Some(atom) = goal_atoms.into_iter().find(|atom| !reached[atom.index()]) {
        return Ok(Some(never_true(&atom_name(lifted, task, atom))));
    }
    if generality.numbers.is_none() && !goal_can_hold(task, limits)? {
        let reason = "the numbers that the goal asks for are out of reach, even if nothing is ever deleted";
        return Ok(Some(reason.into()));
    }
    drop_unread_numerics(task);
    backward(task, limits)?;
    Ok(None)
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

/// `(function arguments)` as PDDL writes it.
pub(crate) fn numeric_name(lifted: &Lifted, task: &GroundTask<'_>, variable: NumericId) -> String {
    let found = task.world.numerics.get_index(variable.index());
    found.map_or_else(String::new, |((function, arguments), ())| {
        let symbol = lifted.functions.get(function.index());
        symbol.map_or_else(String::new, |symbol| applied(lifted, &symbol.name, arguments))
    })
}

fn name(lifted: &Lifted, predicate: PredicateId, arguments: &[ObjectId]) -> String {
    let Some(symbol) = lifted.predicates.get(predicate.index()) else {
        let number = arguments.first().map_or(0, |number| number.0);
        return format!("condition {number}");
    };
    applied(lifted, &symbol.name, arguments)
}

fn applied(lifted: &Lifted, symbol: &Name, arguments: &[ObjectId]) -> String {
    let mut text = format!("({symbol}");
    for object in arguments {
        text.push(' ');
        text.push_str(lifted.objects[object.index()].as_str());
    }
    text.push(')');
    text
}

/// Removes operators and rules that are not reachable in the delete relaxation; returns the atoms that are.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "what is missing is counted before it is reached, each time once; indices of axioms come after those of operators"
)]
fn forward(task: &mut GroundTask<'_>, initially: &[bool], limits: &Limits) -> Result<Vec<bool>, Interrupted> {
    let axioms = &task.world.definitions.axioms;
    let operators = task.operators.iter().map(|operator| &operator.condition);
    let conditions = operators.chain(axioms.iter().map(|axiom| &axiom.body));
    let mut readers: FxHashMap<AtomId, Vec<usize>> = FxHashMap::default();
    let mut missing = Vec::with_capacity(task.operators.len() + axioms.len());
    let mut reached = initially.to_vec();
    let mut open: Vec<usize> = Vec::new();
    for item in limits.watch(conditions.enumerate()) {
        let (index, condition) = item?;
        let needs = condition.literals.iter().filter(|(atom, positive)| *positive && !reached[atom.index()]);
        let count = needs.map(|(atom, _)| readers.entry(*atom).or_default().push(index)).count();
        missing.push(count);
        if count == 0 {
            open.push(index);
        }
    }
    let mut pulse = limits.pulse();
    while let Some(index) = open.pop() {
        pulse.beat()?;
        let mut reach = |atom: AtomId| {
            if std::mem::replace(&mut reached[atom.index()], true) {
                return;
            }
            for reader in readers.get(&atom).into_iter().flatten() {
                missing[*reader] -= 1;
                if missing[*reader] == 0 {
                    open.push(*reader);
                }
            }
        };
        match task.operators.get(index) {
            Some(operator) => {
                let conditional = operator.conditional.iter().flat_map(|effect| &effect.adds);
                operator.adds.iter().chain(conditional).for_each(|atom| reach(*atom));
            }
            None => reach(axioms[index - task.operators.len()].head),
        }
    }
    let mut keep = missing.iter().map(|count| *count == 0);
    task.operators.retain(|_| keep.next().unwrap_or(true));
    task.world.definitions.axioms.retain(|_| keep.next().unwrap_or(true));
    let possible = |&(atom, positive): &GroundLiteral| !positive || reached[atom.index()];
    task.operators
        .retain(|operator| operator.condition.clauses.iter().all(|clause| clause.iter().any(possible)));
    for operator in &mut task.operators {
        operator.deletes.retain(|atom| reached[atom.index()]);
        operator.conditional.retain(|effect| effect.condition.iter().all(possible));
        for effect in &mut operator.conditional {
            effect.deletes.retain(|atom| reached[atom.index()]);
        }
    }
    Ok(reached)
}

/// Removes effects on numeric variables that no condition depends on; the metric has been made of them already.
fn drop_unread_numerics(task: &mut GroundTask<'_>) {
    let conditions = task.operators.iter().map(|operator| &operator.condition).chain(&task.goal);
    let bodies = task.world.definitions.axioms.iter().map(|axiom| &axiom.body);
    let comparisons = conditions.chain(bodies).flat_map(|condition| &condition.comparisons);
    let mut read: FxHashSet<NumericId> = comparisons
        .flat_map(|(linear, _)| linear.coefficients.iter().map(|(variable, _)| *variable))
        .collect();
    let mut open: Vec<NumericId> = read.iter().copied().collect();
    while let Some(variable) = open.pop() {
        let values = task.operators.iter().filter_map(|operator| operator.numeric_effects.get(variable));
        for (source, _) in values.flat_map(|value| &value.coefficients) {
            if read.insert(*source) {
                open.push(*source);
            }
        }
    }
    for operator in &mut task.operators {
        operator.numeric_effects.retain(&|variable| read.contains(&variable));
    }
}

/// Removes rules of atoms that nothing reads, effects on such atoms, and operators that do nothing and earn nothing.
fn backward(task: &mut GroundTask<'_>, limits: &Limits) -> Result<(), Interrupted> {
    loop {
        limits.check()?;
        let read = read_atoms(task);
        let before = task.operators.len();
        task.world.definitions.axioms.retain(|axiom| read.contains(&axiom.head));
        for operator in &mut task.operators {
            operator.adds.retain(|atom| read.contains(atom));
            operator.deletes.retain(|atom| read.contains(atom));
            for effect in &mut operator.conditional {
                effect.adds.retain(|atom| read.contains(atom));
                effect.deletes.retain(|atom| read.contains(atom));
            }
            operator.conditional.retain(|effect| !effect.adds.is_empty() || !effect.deletes.is_empty());
        }
        task.operators.retain(|operator| !is_idle(operator));
        if task.operators.len() == before {
            return Ok(());
        }
    }
}

/// The atoms that conditions read, directly or through rules.
pub(crate) fn read_atoms(task: &GroundTask<'_>) -> FxHashSet<AtomId> {
    let conditions = task.operators.iter().map(|operator| &operator.condition).chain(&task.goal);
    let conditional = task.operators.iter().flat_map(|operator| &operator.conditional);
    let conditional = conditional.flat_map(|effect| effect.condition.iter().map(|(atom, _)| *atom));
    let mut direct = vec![false; task.world.atoms.len()];
    for atom in conditions.flat_map(GroundCondition::atoms).chain(conditional) {
        direct[atom.index()] = true;
    }
    let direct = direct.into_iter().zip(0..).filter(|(read, _)| *read);
    let mut read: FxHashSet<AtomId> = direct.map(|(_, atom)| AtomId(atom)).collect();
    let mut bodies: FxHashMap<AtomId, Vec<&GroundCondition>> = FxHashMap::default();
    for axiom in &task.world.definitions.axioms {
        bodies.entry(axiom.head).or_default().push(&axiom.body);
    }
    let mut open: Vec<AtomId> = read.iter().copied().collect();
    while let Some(atom) = open.pop() {
        let below = bodies.get(&atom).into_iter().flatten().flat_map(|body| body.atoms());
        open.extend(below.filter(|atom| read.insert(*atom)));
    }
    read
}

/// Whether the operator changes nothing and cannot lower the cost of a plan.
fn is_idle(operator: &GroundOperator) -> bool {
    let known = |atom: AtomId, value: bool| operator.condition.literals.binary_search(&(atom, value)).is_ok();
    let lowest = |cost: &Quantity<Rational>| {
        let tables = cost.tables.iter().filter_map(|table| table.values.iter().min());
        tables.fold(cost.constant.clone(), |sum, value| sum + value)
    };
    operator.adds.iter().all(|atom| known(*atom, true))
        && operator.deletes.iter().all(|atom| known(*atom, false))
        && operator.conditional.is_empty()
        && operator.numeric_effects.iter().all(|(variable, value)| {
            value.quantity.is_zero() && value.coefficients[..] == [(*variable, Rational::from_integer(1))]
        })
        && operator.costs.iter().all(|cost| lowest(cost) >= Rational::from_integer(0))
}
