//! Designs and objects that are equal: of plans that differ by exchanging them, one is enough.
//!
//! - designs: of designs of a slot that no operator tells apart, only the first is chosen: `¬slot=d@t`. Designs are chosen anew
//!   at every step, so each step is symmetric by itself;
//! - objects: objects x₁ < x₂ < … any two of which can be exchanged without changing the task [1] are used first in this order:
//!   `o@t → s_i@t` for each operator o with x_{i+1} among its arguments and `x_i` not, where `s_i@t → s_i@t−1 ∨ u_i@t` says that
//!   `x_i` has been used, and `u_i@t ↔ ⋁ o@t` that it is used now. Renaming the objects of a plan in the order of their first use
//!   makes one that satisfies this, and costs the same.
//!
//! Objects whose numeric variables differ, and tasks with derived variables, are left alone.
//!
//! \[1\] J. Rintanen: Symmetry reduction for SAT representations of transition systems, ICAPS 2003.

use std::collections::BTreeMap;

use rustc_hash::FxHashMap;

use crate::encode::Encoding;
use crate::encode::formula::{Family, Formula, Meaning};
use crate::lifted::ObjectId;
use crate::number::Int;
use crate::quantity::Quantity;
use crate::sat::Lit;
use crate::task::{
    Argument, Condition, ConditionalEffect, Fact, Operator, OperatorId, SlotId, Task, VariableId,
};

/// So many operators are compared at most, over all pairs of objects.
const WORK_LIMIT: usize = 2_000_000;

/// What of a task is equal.
pub(super) struct Symmetry {
    /// Designs of a slot that are equal to an earlier one.
    designs: Vec<(SlotId, u16)>,
    /// For pairs of equal objects: the operators that use the first, and those that use only the second.
    objects: Vec<(Vec<OperatorId>, Vec<OperatorId>)>,
}

impl Symmetry {
    pub(super) fn new(task: &Task) -> Self {
        let slots = (0..task.slots.len() as u32).map(SlotId);
        Self {
            designs: slots
                .flat_map(|slot| equal_designs(task, slot).into_iter().map(move |design| (slot, design)))
                .collect(),
            objects: equal_objects(task),
        }
    }
}

/// Designs of a slot that are equal to an earlier one.
fn equal_designs(task: &Task, slot: SlotId) -> Vec<u16> {
    let users: Vec<(&Operator, usize)> = task
        .operators
        .iter()
        .flat_map(|operator| {
            let positions = operator.slots.iter().enumerate().filter(|(_, usage)| usage.slot == slot);
            positions.map(move |(position, _)| (operator, position))
        })
        .collect();
    let mut different: Vec<u16> = Vec::new();
    let mut equal = Vec::new();
    for design in 0..task.slots[slot.index()].designs.len() as u16 {
        let same =
            |other: &u16| users.iter().all(|(operator, p)| no_difference(operator, *p, *other, design));
        if different.iter().any(same) { equal.push(design) } else { different.push(design) }
    }
    equal
}

/// Whether an operator does not tell two designs of the slot at a position apart.
fn no_difference(operator: &Operator, position: usize, a: u16, b: u16) -> bool {
    let designs = &operator.slots[position].designs;
    let (a, b) = match (designs.binary_search(&a), designs.binary_search(&b)) {
        (Ok(a), Ok(b)) => (a, b),
        (Err(_), Err(_)) => return true,
        _ => return false,
    };
    let sizes = operator.sizes();
    let same = |quantity: &Quantity<Int>| {
        quantity.tables.iter().all(|table| {
            let Some(own) = table.slots.iter().position(|slot| *slot as usize == position) else {
                return true;
            };
            let stride: usize = table.slots[own + 1..].iter().map(|slot| sizes[*slot as usize]).product();
            let with_a = |index: &usize| index / stride % sizes[position] == a;
            (0..table.values.len())
                .filter(with_a)
                .all(|index| table.values[index] == table.values[index - a * stride + b * stride])
        })
    };
    let forbidden = operator.forbidden.iter().all(|rule| {
        let Some(own) = rule.slots.iter().position(|slot| *slot as usize == position) else { return true };
        rule.combinations.iter().all(|combination| {
            let mut swapped = combination.clone();
            if swapped[own] as usize == a {
                swapped[own] = b as u16;
            } else if swapped[own] as usize == b {
                swapped[own] = a as u16;
            }
            rule.combinations.contains(&swapped)
        })
    });
    let effects = operator.numeric_effects.iter().map(|effect| &effect.value.quantity);
    let comparisons = operator.condition.comparisons.iter().map(|comparison| &comparison.quantity);
    forbidden && effects.chain(comparisons).chain([&operator.cost]).all(same)
}

/// Pairs of neighbours in classes of equal objects.
fn equal_objects(task: &Task) -> Vec<(Vec<OperatorId>, Vec<OperatorId>)> {
    if !task.axioms.is_empty() {
        return Vec::new();
    }
    let mut uses: BTreeMap<ObjectId, Vec<(u32, usize)>> = BTreeMap::new();
    for operator in &task.operators {
        for (argument, position) in operator.arguments.iter().zip(0..) {
            if let Argument::Object(object) = argument {
                uses.entry(*object).or_default().push((operator.schema, position));
            }
        }
    }
    let mut alike: BTreeMap<Vec<(u32, usize)>, Vec<ObjectId>> = BTreeMap::new();
    for (object, mut places) in uses {
        places.sort_unstable();
        alike.entry(places).or_default().push(object);
    }
    let operators = Calls::new(task);
    let mut work = 0;
    let mut pairs = Vec::new();
    for mut rest in alike.into_values() {
        while let Some(first) = rest.first().copied() {
            let (mut last, mut others) = (first, Vec::new());
            for object in rest.drain(1..) {
                work += task.operators.len();
                let equal = work <= WORK_LIMIT
                    && Exchange::new(task, last, object).is_some_and(|e| e.keeps(task, &operators));
                if equal {
                    let only = uses_of(task, object).filter(|id| !uses_of(task, last).any(|own| own == *id));
                    pairs.push((uses_of(task, last).collect(), only.collect()));
                    last = object;
                } else {
                    others.push(object);
                }
            }
            rest = others;
        }
    }
    pairs
}

fn uses_of(task: &Task, object: ObjectId) -> impl Iterator<Item = OperatorId> + '_ {
    let all = task.operators.iter().zip((0..).map(OperatorId));
    all.filter(move |(operator, _)| operator.arguments.contains(&Argument::Object(object))).map(|(_, id)| id)
}

/// Operators by schema and arguments; none where there are several.
struct Calls(FxHashMap<(u32, Vec<Argument>), Option<OperatorId>>);

impl Calls {
    fn new(task: &Task) -> Self {
        let mut calls = FxHashMap::default();
        for (operator, id) in task.operators.iter().zip((0..).map(OperatorId)) {
            let call = (operator.schema, operator.arguments.clone());
            calls.entry(call).and_modify(|known| *known = None).or_insert(Some(id));
        }
        Self(calls)
    }
}

/// Two objects that change places, and where that takes each fact.
struct Exchange {
    objects: (ObjectId, ObjectId),
    facts: Vec<Vec<Fact>>,
}

impl Exchange {
    /// None if the variables do not match.
    fn new(task: &Task, a: ObjectId, b: ObjectId) -> Option<Self> {
        let mut by_name: FxHashMap<&str, Fact> = FxHashMap::default();
        let is_atom = |name: &str| name.starts_with('(');
        for (variable, id) in task.variables.iter().zip((0..).map(VariableId)) {
            for (name, value) in variable.values.iter().zip(0..) {
                if is_atom(name) {
                    by_name.insert(name, Fact { variable: id, value });
                }
            }
        }
        let (a_name, b_name) = (&task.object_names[a.index()], &task.object_names[b.index()]);
        let exchanged = |name: &str| {
            let words =
                name.trim_matches(['(', ')']).split(' ').enumerate().map(|(position, word)| match word {
                    word if position > 0 && word == a_name => b_name,
                    word if position > 0 && word == b_name => a_name,
                    word => word,
                });
            format!("({})", words.collect::<Vec<_>>().join(" "))
        };
        let mut facts = Vec::with_capacity(task.variables.len());
        for variable in &task.variables {
            let mut target = None;
            for name in variable.values.iter().filter(|name| is_atom(name)) {
                let image = by_name.get(exchanged(name).as_str())?;
                if *target.get_or_insert(image.variable) != image.variable {
                    return None;
                }
            }
            let target = target?;
            let image = &task.variables[target.index()];
            if image.values.len() != variable.values.len() {
                return None;
            }
            let other = image.values.iter().position(|name| !is_atom(name));
            let value = |name: &String| {
                if is_atom(name) {
                    by_name.get(exchanged(name).as_str()).copied()
                } else {
                    Some(Fact { variable: target, value: other? as u32 })
                }
            };
            facts.push(variable.values.iter().map(value).collect::<Option<Vec<_>>>()?);
        }
        Some(Self { objects: (a, b), facts })
    }

    fn fact(&self, fact: Fact) -> Fact {
        self.facts[fact.variable.index()][fact.value as usize]
    }

    fn facts(&self, facts: &[Fact]) -> Vec<Fact> {
        let mut facts: Vec<_> = facts.iter().map(|fact| self.fact(*fact)).collect();
        facts.sort_unstable();
        facts
    }

    fn object(&self, object: ObjectId) -> ObjectId {
        match object {
            object if object == self.objects.0 => self.objects.1,
            object if object == self.objects.1 => self.objects.0,
            object => object,
        }
    }

    fn argument(&self, argument: Argument) -> Argument {
        match argument {
            Argument::Object(object) => Argument::Object(self.object(object)),
            slot @ Argument::Slot(_) => slot,
        }
    }

    fn condition(&self, condition: &Condition) -> Condition {
        let literal = |mut literal: crate::task::Literal| {
            literal.fact = self.fact(literal.fact);
            literal
        };
        let mut clauses: Vec<Vec<_>> =
            condition.clauses.iter().map(|clause| clause.iter().map(|l| literal(*l)).collect()).collect();
        for clause in &mut clauses {
            clause.sort_unstable();
        }
        clauses.sort();
        let comparisons = condition.comparisons.clone();
        Condition { facts: self.facts(&condition.facts), clauses, comparisons }
    }

    /// Whether the task with the objects exchanged is the same task.
    fn keeps(&self, task: &Task, operators: &Calls) -> bool {
        let initial = |(variable, value): (usize, &u32)| {
            let image = self.facts[variable][*value as usize];
            task.initial.values[image.variable.index()] == image.value
        };
        let identity = Self::identity(task);
        task.initial.values.iter().enumerate().all(initial)
            && self.condition(&task.goal) == identity.condition(&task.goal)
            && task.operators.iter().all(|operator| {
                let arguments = operator.arguments.iter().map(|argument| self.argument(*argument)).collect();
                let image = operators.0.get(&(operator.schema, arguments)).copied().flatten();
                image.is_some_and(|image| {
                    self.operator(operator) == identity.operator(&task.operators[image.index()])
                })
            })
    }

    fn identity(task: &Task) -> Self {
        let facts = task.variables.iter().zip((0..).map(VariableId)).map(|(own, variable)| {
            (0..own.values.len() as u32).map(|value| Fact { variable, value }).collect()
        });
        Self { objects: (ObjectId(u32::MAX), ObjectId(u32::MAX)), facts: facts.collect() }
    }

    /// The operator with the objects exchanged, in a normal form.
    fn operator(&self, operator: &Operator) -> Operator {
        let mut image = operator.clone();
        for argument in &mut image.arguments {
            *argument = self.argument(*argument);
        }
        for (function, design) in &mut image.configuration {
            (*function, *design) = (self.object(*function), self.argument(*design));
        }
        image.condition = self.condition(&operator.condition);
        image.effects = self.facts(&operator.effects);
        image.conditional = operator
            .conditional
            .iter()
            .map(|effect| {
                let condition = Condition { clauses: vec![effect.condition.clone()], ..Condition::default() };
                let clauses = self.condition(&condition).clauses;
                ConditionalEffect {
                    condition: clauses.into_iter().flatten().collect(),
                    effects: self.facts(&effect.effects),
                }
            })
            .collect();
        image
    }
}

impl Encoding<'_> {
    /// Equal designs and objects are used in their order.
    pub(super) fn break_symmetries(&mut self) {
        let symmetry = Symmetry::new(self.task);
        for step in 0..self.horizon {
            for (slot, design) in &symmetry.designs {
                let literal = self.designs[step][slot.index()][*design as usize];
                self.formula.add(Family::Symmetry, [!literal]);
            }
        }
        for (first, only_second) in &symmetry.objects {
            let mut seen: Lit = !Formula::truth();
            for step in 0..self.horizon {
                let used = self.group(step, first, Family::Symmetry);
                let longer = self.formula.fresh(Meaning::Ladder);
                self.formula.add(Family::Symmetry, [!longer, seen, used]);
                seen = longer;
                for id in only_second {
                    if let Some(literal) = self.operator(step, *id) {
                        self.formula.add(Family::Symmetry, [!literal, seen]);
                    }
                }
            }
        }
    }
}
