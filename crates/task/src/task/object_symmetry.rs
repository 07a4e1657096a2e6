//! Object symmetries: transpositions of two objects that map the task to itself.
//!
//! Two objects are interchangeable if exchanging them maps operators to operators and the goal to itself
//! \[1\]. Exchanges that would also have to exchange numeric variables are not found. Tasks with derived
//! variables have no detected symmetries.
//!
//! \[1\] J. Rintanen: Symmetry reduction for SAT representations of transition systems, ICAPS 2003.

use std::collections::BTreeMap;

use rustc_hash::FxHashMap;

use crate::context::Context;
use crate::lifted::ObjectId;
use crate::limits::{Interrupted, Limits};
use crate::task::{
    Argument, Condition, ConditionalEffect, Fact, Literal, Operator, OperatorId, Task, VariableId,
};

/// Limit on the total number of operators that are compared, over all pairs of objects.
const WORK_LIMIT: usize = 2_000_000;

/// Returns exchanges of consecutive objects in each class of interchangeable objects; for the class {a, b, c} these are
/// the exchanges of a and b, and of b and c. Every exchange preserves the operators and the goal; if `initially` is
/// `true`, it also preserves the initial state. Some symmetries may be missing, for example because the number of
/// comparisons is limited. Tasks with derived variables yield an empty list.
///
/// # Errors
/// The deadline has passed or the run is interrupted.
#[expect(clippy::arithmetic_side_effects, reason = "work is looked at each time")]
pub fn symmetry_generators(context: Context<'_>, initially: bool) -> Result<Vec<Exchange>, Interrupted> {
    let Context { task, limits } = context;
    if !task.axioms.is_empty() {
        return Ok(Vec::new());
    }
    let mut uses: BTreeMap<ObjectId, Vec<(u32, usize)>> = BTreeMap::new();
    for operator in limits.watch(&task.operators) {
        let operator = operator?;
        for (argument, position) in operator.arguments.iter().zip(0..) {
            if let Argument::Object(object) = argument {
                uses.entry(*object).or_default().push((operator.schema, position));
            }
        }
    }
    // Interchangeable objects occur at the same argument positions of the same schemas, equally often.
    let mut alike: BTreeMap<Vec<(u32, usize)>, Vec<ObjectId>> = BTreeMap::new();
    for (object, mut places) in uses {
        places.sort_unstable();
        alike.entry(places).or_default().push(object);
    }
    alike.retain(|_, objects| objects.len() > 1);
    if alike.is_empty() || task.operators.len() > WORK_LIMIT {
        return Ok(Vec::new());
    }
    let parts = Parts::new(context)?;
    let mut work = 0;
    let mut exchanges = Vec::new();
    for mut remaining in alike.into_values() {
        while let Some(first) = remaining.first().copied() {
            let (mut last, mut others) = (first, Vec::new());
            for object in remaining.drain(1..) {
                work += task.operators.len();
                let exchange =
                    // Beyond the limit, no further symmetries are found. This is sound.
                    if work <= WORK_LIMIT { Exchange::new(&parts, last, object, limits)? } else { None };
                match exchange {
                    Some(exchange) if exchange.keeps(&parts, initially, limits)? => {
                        exchanges.push(exchange);
                        last = object;
                    }
                    _ => others.push(object),
                }
            }
            remaining = others;
        }
    }
    Ok(exchanges)
}

struct Parts<'t> {
    task: &'t Task,
    /// For each variable and value: the words of the atom as indices in `all_words`, or `None` for a value
    /// without an atom.
    words: Vec<Vec<Option<Vec<usize>>>>,
    facts: FxHashMap<Vec<usize>, Fact>,
    all_words: FxHashMap<&'t str, usize>,
    /// Operator for each schema and argument list, or `None` if several operators have this schema and these
    /// arguments.
    calls: FxHashMap<(u32, Vec<Argument>), Option<OperatorId>>,
    /// All operators in the normal form that [`Exchange::operator`] produces.
    normal: Vec<Operator>,
    goal: Condition,
}

impl<'t> Parts<'t> {
    fn new(context: Context<'t>) -> Result<Self, Interrupted> {
        let Context { task, limits } = context;
        let mut all_words: FxHashMap<&str, usize> = FxHashMap::default();
        let mut facts = FxHashMap::default();
        let mut words = Vec::with_capacity(task.variables.len());
        for (variable, id) in task.variables.iter().zip(VariableId::all(task.variables.len())) {
            let mut atoms_of_variable = Vec::with_capacity(variable.values.len());
            for (name, value) in limits.watch(&variable.values).zip(0..) {
                let name = name?.as_str();
                atoms_of_variable.push(name.starts_with('(').then(|| {
                    let atom: Vec<usize> = name
                        .trim_matches(['(', ')'])
                        .split(' ')
                        .map(|word| {
                            let next = all_words.len();
                            *all_words.entry(word).or_insert(next)
                        })
                        .collect();
                    facts.insert(atom.clone(), Fact { variable: id, value });
                    atom
                }));
            }
            words.push(atoms_of_variable);
        }
        let identity = Exchange::identity(task);
        let (mut calls, mut normal) = (FxHashMap::default(), Vec::with_capacity(task.operators.len()));
        for (operator, id) in limits.watch(&task.operators).zip(OperatorId::all(task.operators.len())) {
            let operator = operator?;
            let call = (operator.schema, operator.arguments.clone());
            calls.entry(call).and_modify(|entry| *entry = None).or_insert(Some(id));
            normal.push(identity.operator(operator));
        }
        let goal = identity.condition(&task.goal);
        Ok(Self { task, words, facts, all_words, calls, normal, goal })
    }

    fn word(&self, object: ObjectId) -> Option<usize> {
        self.all_words.get(self.task.object_names[object.index()].as_str()).copied()
    }
}

/// An exchange of two objects, with the resulting image of each fact.
pub struct Exchange {
    pub objects: (ObjectId, ObjectId),
    /// Image of each fact, by variable and value.
    pub facts: Vec<Vec<Fact>>,
}

impl Exchange {
    /// Creates the exchange of objects `a` and `b`. Returns `None` unless the atoms of each variable are
    /// mapped to atoms of a single variable with equally many values.
    fn new(
        parts: &Parts<'_>,
        a: ObjectId,
        b: ObjectId,
        limits: &Limits,
    ) -> Result<Option<Self>, Interrupted> {
        let task = parts.task;
        let (a_word, b_word) = (parts.word(a), parts.word(b));
        let exchanged = |atom: &Vec<usize>| {
            let mut image = atom.clone();
            // The first word is the predicate.
            for word in image.iter_mut().skip(1) {
                let exchanged_word = match Some(*word) {
                    word if word == a_word => b_word,
                    word if word == b_word => a_word,
                    word => word,
                };
                *word = exchanged_word?;
            }
            parts.facts.get(&image).copied()
        };
        let mut facts = Vec::with_capacity(task.variables.len());
        for atoms in limits.watch(&parts.words) {
            let atoms = atoms?;
            let images: Option<Vec<Fact>> = atoms.iter().flatten().map(exchanged).collect();
            let Some(images) = images else { return Ok(None) };
            let Some(target) = images.first().map(|image| image.variable) else { return Ok(None) };
            let target_atoms = &parts.words[target.index()];
            if images.iter().any(|image| image.variable != target) || target_atoms.len() != atoms.len() {
                return Ok(None);
            }
            let value_without_atom =
                target_atoms.iter().zip(0..).find(|(atom, _)| atom.is_none()).map(|(_, value)| value);
            let mut images = images.into_iter();
            let image = |atom: &Option<Vec<usize>>| match atom {
                Some(_) => images.next(),
                None => Some(Fact { variable: target, value: value_without_atom? }),
            };
            let Some(atoms) = atoms.iter().map(image).collect() else { return Ok(None) };
            facts.push(atoms);
        }
        Ok(Some(Self { objects: (a, b), facts }))
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
        let literal = |mut literal: Literal| {
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
        Condition { facts: self.facts(&condition.facts), clauses, comparisons, above: Vec::new() }
    }

    fn keeps(&self, parts: &Parts<'_>, initially: bool, limits: &Limits) -> Result<bool, Interrupted> {
        let task = parts.task;
        let initial = |(variable, value): (usize, &u32)| {
            let image = self.facts[variable][*value as usize];
            task.initial.values[image.variable.index()] == image.value
        };
        let is_initial = || task.initial.values.iter().enumerate().all(initial);
        if initially && !is_initial() || self.condition(&task.goal) != parts.goal {
            return Ok(false);
        }
        for operator in limits.watch(&task.operators) {
            let operator = operator?;
            let arguments = operator.arguments.iter().map(|argument| self.argument(*argument)).collect();
            let image = parts.calls.get(&(operator.schema, arguments)).copied().flatten();
            if image.is_none_or(|image| self.operator(operator) != parts.normal[image.index()]) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn identity(task: &Task) -> Self {
        let variables = task.variables.iter().zip(VariableId::all(task.variables.len()));
        let facts = variables.map(|(own, variable)| {
            own.values.iter().zip(0..).map(|(_, value)| Fact { variable, value }).collect()
        });
        Self { objects: (ObjectId(u32::MAX), ObjectId(u32::MAX)), facts: facts.collect() }
    }

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
