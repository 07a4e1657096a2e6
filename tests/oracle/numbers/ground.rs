//! Grounding by instantiation: every action with all combinations of objects, with static subexpressions
//! evaluated.
//!
//! An instance is omitted only if a static conjunct is false or undefined (definition, 2), or if its duration
//! is negative or undefined (1). No other simplification is made, because the facts and numbers that a
//! condition mentions decide about interference even if they do not influence its truth value (6).

use std::collections::{HashMap, HashSet};

use num_traits::{Signed as _, Zero as _};

use super::model::{
    Action, Applied, Change, Condition, Effect, Expr, Happening, Number, Relation, Task, Term,
};

#[derive(Debug, Clone)]
pub enum Value {
    Known(Number),
    Undefined,
    Fluent(usize),
    Sum(Vec<Value>),
    Minus(Box<Value>, Box<Value>),
    Negative(Box<Value>),
    Product(Vec<Value>),
    Quotient(Box<Value>, Box<Value>),
    Time,
}

#[derive(Debug, Clone)]
pub enum Test {
    Known(bool),
    Atom(usize),
    Not(Box<Test>),
    Any(Vec<Test>),
    Compare(Relation, Value, Value),
    /// Always holds. The fields are the number of an open threshold, and the expression whose values are
    /// recorded for it.
    Open(usize, Value),
}

#[derive(Debug, Clone)]
pub enum Act {
    Add(usize),
    Delete(usize),
    Number(Change, usize, Value),
    When(Vec<Test>, Vec<Act>),
}

#[derive(Debug, Clone, Default)]
pub struct Moment {
    pub tests: Vec<Test>,
    pub acts: Vec<Act>,
}

#[derive(Debug, Clone)]
pub struct Instance {
    pub action: usize,
    pub arguments: Vec<usize>,
    pub duration: Number,
    pub start: Moment,
    pub over_all: Vec<Test>,
    pub end: Option<Moment>,
}

/// A ground task. Only atoms and numbers that actions change have indices.
#[derive(Debug, Default)]
pub struct Ground {
    pub instances: Vec<Instance>,
    pub by_name: HashMap<(String, Vec<String>), usize>,
    pub goal: Vec<Test>,
    pub atoms: Vec<bool>,
    /// Initial values; `None` if undefined.
    pub numbers: Vec<Option<Number>>,
    pub metric: Option<Value>,
    pub objectives: Vec<Value>,
}

pub struct Grounder<'t> {
    task: &'t Task,
    changing: (Vec<bool>, Vec<bool>),
    true_atoms: HashSet<(usize, Vec<usize>)>,
    values: HashMap<(usize, Vec<usize>), Number>,
    atoms: HashMap<(usize, Vec<usize>), usize>,
    fluents: HashMap<(usize, Vec<usize>), usize>,
    ground: Ground,
}

pub fn ground(task: &Task, objectives: &[Expr], max_instances: usize) -> Option<Ground> {
    let mut grounder = Grounder {
        task,
        changing: task.changing(),
        true_atoms: task.atoms.iter().cloned().collect(),
        values: task
            .values
            .iter()
            .map(|(f, objects, value)| ((*f, objects.clone()), value.clone()))
            .collect(),
        atoms: HashMap::new(),
        fluents: HashMap::new(),
        ground: Ground::default(),
    };
    for action in 0..task.actions.len() {
        let mut bound = Vec::new();
        grounder.instances(action, &mut bound, max_instances)?;
    }
    grounder.ground.goal = task.goal.iter().map(|condition| grounder.test(condition, &[])).collect();
    grounder.ground.metric = task.metric.as_ref().map(|(_, metric)| grounder.value(metric, &[]));
    grounder.ground.objectives = objectives.iter().map(|objective| grounder.value(objective, &[])).collect();
    Some(grounder.ground)
}

impl Grounder<'_> {
    /// Adds the instances of an action by binding its parameters one after another. A false static conjunct
    /// ends a branch as soon as its parameters are bound.
    fn instances(&mut self, action: usize, bound: &mut Vec<usize>, max_instances: usize) -> Option<()> {
        let task = self.task;
        let schema: &Action = &task.actions[action];
        if let Some(&(_, kind)) = schema.parameters.get(bound.len()).as_ref() {
            for object in task.of_type(*kind) {
                bound.push(object);
                if self.may_hold(schema, bound) {
                    self.instances(action, bound, max_instances)?;
                }
                bound.pop();
            }
            return Some(());
        }
        if let Some(instance) = self.instance(action, schema, bound) {
            let names = bound.iter().map(|object| task.objects[*object].0.clone()).collect();
            self.ground.by_name.insert((schema.name.clone(), names), self.ground.instances.len());
            self.ground.instances.push(instance);
        }
        (self.ground.instances.len() <= max_instances).then_some(())
    }

    /// Returns `false` if a static conjunct fails whose last parameter has just been bound. Conditions over
    /// all matter only if the duration is positive, so they are evaluated only for complete instances.
    fn may_hold(&mut self, schema: &Action, bound: &[usize]) -> bool {
        let end = schema.lasting.as_ref().map_or(&[][..], |lasting| &lasting.end.conditions);
        schema
            .start
            .conditions
            .iter()
            .chain(end)
            .all(|condition| greatest(condition) != Some(bound.len() - 1) || !self.fails(condition, bound))
    }

    /// Returns `true` if a condition is static, and false or undefined.
    fn fails(&mut self, condition: &Condition, bound: &[usize]) -> bool {
        if !self.is_static(condition) {
            return false;
        }
        let test = self.test(condition, bound);
        super::step::holds(&test, &super::step::State::default()) != Some(true)
    }

    fn instance(&mut self, action: usize, schema: &Action, bound: &[usize]) -> Option<Instance> {
        let duration = match schema.lasting.as_ref().map(|lasting| self.value(&lasting.duration, bound)) {
            None => Number::zero(),
            Some(Value::Known(duration)) if !duration.is_negative() => duration,
            Some(Value::Known(_) | Value::Undefined) => return None,
            Some(_) => unreachable!("durations are static"),
        };
        let is_durative = !duration.is_zero();
        let over_all: &[Condition] =
            schema.lasting.as_ref().filter(|_| is_durative).map_or(&[], |l| &l.over_all);
        let end = schema.lasting.as_ref().map(|lasting| &lasting.end);
        let conjuncts = schema.start.conditions.iter().chain(over_all);
        let conjuncts = conjuncts.chain(end.iter().flat_map(|end| &end.conditions));
        for condition in conjuncts {
            if self.fails(condition, bound) {
                return None;
            }
        }
        Some(Instance {
            action,
            arguments: bound.to_vec(),
            duration,
            start: self.moment(&schema.start, bound),
            over_all: self.tests(over_all, bound),
            end: end.map(|end| self.moment(end, bound)),
        })
    }

    fn moment(&mut self, happening: &Happening, bound: &[usize]) -> Moment {
        Moment {
            tests: self.tests(&happening.conditions, bound),
            acts: happening.effects.iter().map(|effect| self.act(effect, bound)).collect(),
        }
    }

    /// Returns the non-static conjuncts. The static conjuncts hold, otherwise the instance would have been
    /// omitted.
    fn tests(&mut self, conditions: &[Condition], bound: &[usize]) -> Vec<Test> {
        let mut tests = Vec::new();
        for condition in conditions {
            if !self.is_static(condition) {
                tests.push(self.test(condition, bound));
            }
        }
        tests
    }

    fn act(&mut self, effect: &Effect, bound: &[usize]) -> Act {
        match effect {
            Effect::Add(atom) => Act::Add(self.changing_atom(key(atom, bound))),
            Effect::Delete(atom) => Act::Delete(self.changing_atom(key(atom, bound))),
            Effect::Number(change, function, value) => {
                let fluent = self.fluent(key(function, bound));
                Act::Number(*change, fluent, self.value(value, bound))
            }
            Effect::When(conditions, effects) => Act::When(
                conditions.iter().map(|condition| self.test(condition, bound)).collect(),
                effects.iter().map(|effect| self.act(effect, bound)).collect(),
            ),
        }
    }

    fn test(&mut self, condition: &Condition, bound: &[usize]) -> Test {
        match condition {
            Condition::Holds(atom) => {
                let key = key(atom, bound);
                if self.changing.0[key.0] {
                    Test::Atom(self.changing_atom(key))
                } else {
                    Test::Known(self.true_atoms.contains(&key))
                }
            }
            Condition::Not(inner) => Test::Not(Box::new(self.test(inner, bound))),
            Condition::Any(parts) => Test::Any(parts.iter().map(|part| self.test(part, bound)).collect()),
            Condition::Same(left, right) => Test::Known(object(*left, bound) == object(*right, bound)),
            Condition::Compare(relation, left, right) => {
                Test::Compare(*relation, self.value(left, bound), self.value(right, bound))
            }
            Condition::Open(_, expression, number) => Test::Open(*number, self.value(expression, bound)),
        }
    }

    fn value(&mut self, expression: &Expr, bound: &[usize]) -> Value {
        let folded = match expression {
            Expr::Number(value) => Value::Known(value.clone()),
            Expr::Function(function) => {
                let key = key(function, bound);
                if self.changing.1[key.0] {
                    Value::Fluent(self.fluent(key))
                } else {
                    self.values.get(&key).map_or(Value::Undefined, |value| Value::Known(value.clone()))
                }
            }
            Expr::Sum(parts) => Value::Sum(parts.iter().map(|part| self.value(part, bound)).collect()),
            Expr::Product(parts) => {
                Value::Product(parts.iter().map(|part| self.value(part, bound)).collect())
            }
            Expr::Minus(left, right) => {
                Value::Minus(Box::new(self.value(left, bound)), Box::new(self.value(right, bound)))
            }
            Expr::Quotient(left, right) => {
                Value::Quotient(Box::new(self.value(left, bound)), Box::new(self.value(right, bound)))
            }
            Expr::Negative(inner) => Value::Negative(Box::new(self.value(inner, bound))),
            Expr::TotalTime => Value::Time,
        };
        // Without fluents, the value is the same in every state and can be computed once.
        if mentions_state(&folded) {
            return folded;
        }
        super::step::number(&folded, &super::step::State::default()).map_or(Value::Undefined, Value::Known)
    }

    fn changing_atom(&mut self, key: (usize, Vec<usize>)) -> usize {
        let holds = self.true_atoms.contains(&key);
        let atoms = &mut self.ground.atoms;
        *self.atoms.entry(key).or_insert_with(|| {
            atoms.push(holds);
            atoms.len() - 1
        })
    }

    fn fluent(&mut self, key: (usize, Vec<usize>)) -> usize {
        let initial_value = self.values.get(&key).cloned();
        // `total-cost` starts at 0 if the problem does not initialise it.
        let initial =
            initial_value.or_else(|| (self.task.functions[key.0].name == "total-cost").then(Number::zero));
        let numbers = &mut self.ground.numbers;
        *self.fluents.entry(key).or_insert_with(|| {
            numbers.push(initial);
            numbers.len() - 1
        })
    }

    fn is_static(&self, condition: &Condition) -> bool {
        match condition {
            Condition::Holds(atom) => !self.changing.0[atom.symbol],
            Condition::Not(inner) => self.is_static(inner),
            Condition::Any(parts) => parts.iter().all(|part| self.is_static(part)),
            Condition::Same(..) => true,
            Condition::Compare(_, left, right) => self.never_changes(left) && self.never_changes(right),
            Condition::Open(..) => false,
        }
    }

    fn never_changes(&self, expression: &Expr) -> bool {
        match expression {
            Expr::Number(_) => true,
            Expr::TotalTime => false,
            Expr::Function(function) => !self.changing.1[function.symbol],
            Expr::Sum(parts) | Expr::Product(parts) => parts.iter().all(|part| self.never_changes(part)),
            Expr::Minus(left, right) | Expr::Quotient(left, right) => {
                self.never_changes(left) && self.never_changes(right)
            }
            Expr::Negative(inner) => self.never_changes(inner),
        }
    }
}

fn mentions_state(value: &Value) -> bool {
    match value {
        Value::Known(_) | Value::Undefined => false,
        Value::Fluent(_) | Value::Time => true,
        Value::Sum(parts) | Value::Product(parts) => parts.iter().any(mentions_state),
        Value::Minus(left, right) | Value::Quotient(left, right) => {
            mentions_state(left) || mentions_state(right)
        }
        Value::Negative(inner) => mentions_state(inner),
    }
}

fn object(term: Term, bound: &[usize]) -> usize {
    match term {
        Term::Parameter(position) => bound[position],
        Term::Object(object) => object,
    }
}

fn key(applied: &Applied, bound: &[usize]) -> (usize, Vec<usize>) {
    (applied.symbol, applied.arguments.iter().map(|term| object(*term, bound)).collect())
}

/// Returns the position of the last parameter that a condition mentions.
fn greatest(condition: &Condition) -> Option<usize> {
    let last_parameter =
        |applied: &Applied| applied.arguments.iter().filter_map(|term| parameter(*term)).max();
    match condition {
        Condition::Holds(atom) => last_parameter(atom),
        Condition::Not(inner) => greatest(inner),
        Condition::Any(parts) => parts.iter().filter_map(greatest).max(),
        Condition::Same(left, right) => parameter(*left).max(parameter(*right)),
        Condition::Compare(_, left, right) => greatest_in(left).max(greatest_in(right)),
        Condition::Open(_, expression, _) => greatest_in(expression),
    }
}

fn greatest_in(expression: &Expr) -> Option<usize> {
    match expression {
        Expr::Number(_) | Expr::TotalTime => None,
        Expr::Function(applied) => applied.arguments.iter().filter_map(|term| parameter(*term)).max(),
        Expr::Sum(parts) | Expr::Product(parts) => parts.iter().filter_map(greatest_in).max(),
        Expr::Minus(left, right) | Expr::Quotient(left, right) => greatest_in(left).max(greatest_in(right)),
        Expr::Negative(inner) => greatest_in(inner),
    }
}

fn parameter(term: Term) -> Option<usize> {
    match term {
        Term::Parameter(position) => Some(position),
        Term::Object(_) => None,
    }
}
