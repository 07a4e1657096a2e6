//! Reference interpreter of lifted tasks: evaluates them directly, without compilation, indices or caches.

use std::collections::{BTreeMap, BTreeSet};

use num_rational::Ratio;

use crate::ground_semantics::interfere::Touch;
use crate::ground_semantics::model::{
    Action, Atom, DERIVED, Effect, Expression, Formula, Number, PREDICATES, Task, Term, UPPER, Way,
};

#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct State {
    pub facts: BTreeSet<Atom>,
    pub values: BTreeMap<Atom, Number>,
    pub time: Number,
    /// Number of timed literals that have already taken effect.
    timed: usize,
}

/// A step of a plan: the index of the action, its objects, and its duration if the plan must state it.
pub type Step = (usize, Vec<usize>, Option<Number>);

/// `None` if the truth value is undefined because a function has no value.
type Truth = Option<bool>;

fn conjunction(parts: impl Iterator<Item = Truth>) -> Truth {
    let parts: Vec<_> = parts.collect();
    if parts.contains(&Some(false)) {
        return Some(false);
    }
    if parts.contains(&None) { None } else { Some(true) }
}

fn negation(truth: Truth) -> Truth {
    truth.map(|truth| !truth)
}

fn disjunction(parts: impl Iterator<Item = Truth>) -> Truth {
    negation(conjunction(parts.map(negation)))
}

/// Derived atoms of a state, and the value of `?duration` (`None` outside of actions).
struct View<'a> {
    state: &'a State,
    derived: BTreeSet<Atom>,
    duration: Option<Number>,
}

pub fn objects(terms: &[Term], scope: &[usize]) -> Vec<usize> {
    let object = |term: &Term| match term {
        Term::Object(object) => *object,
        Term::Variable(variable) => scope[*variable],
    };
    terms.iter().map(object).collect()
}

pub fn with(scope: &[usize], object: usize) -> Vec<usize> {
    scope.iter().copied().chain([object]).collect()
}

pub fn choices(lists: &[&[usize]]) -> Vec<Vec<usize>> {
    lists.iter().fold(vec![Vec::new()], |all, list| {
        all.iter().flat_map(|known| list.iter().map(|object| with(known, *object))).collect()
    })
}

impl<'a> View<'a> {
    fn new(task: &Task, state: &'a State, duration: Option<Number>) -> Self {
        let mut view = Self { state, derived: BTreeSet::new(), duration };
        for layer in [DERIVED.as_slice(), &[UPPER]] {
            loop {
                let mut found = BTreeSet::new();
                for (head, body) in task.axioms.iter().filter(|(head, _)| layer.contains(head)) {
                    for scope in choices(&vec![&[0, 1, 2][..]; PREDICATES[*head].1]) {
                        if view.truth(body, &scope) == Some(true) {
                            found.insert((*head, scope));
                        }
                    }
                }
                let before = view.derived.len();
                view.derived.extend(found);
                if view.derived.len() == before {
                    break;
                }
            }
        }
        view
    }

    fn holds(&self, formula: &Formula, scope: &[usize]) -> bool {
        self.truth(formula, scope) == Some(true)
    }

    fn truth(&self, formula: &Formula, scope: &[usize]) -> Truth {
        match formula {
            Formula::Fact(predicate, terms) => {
                let atom = (*predicate, objects(terms, scope));
                Some(self.state.facts.contains(&atom) || self.derived.contains(&atom))
            }
            Formula::Equal(left, right) => Some(objects(&[*left], scope) == objects(&[*right], scope)),
            Formula::Compare(sign, left, right) => {
                Some(sign.holds(self.value(left, scope)?, self.value(right, scope)?))
            }
            Formula::Not(inner) => negation(self.truth(inner, scope)),
            Formula::And(parts) => conjunction(parts.iter().map(|part| self.truth(part, scope))),
            Formula::Or(parts) => disjunction(parts.iter().map(|part| self.truth(part, scope))),
            Formula::Imply(left, right) => {
                disjunction([negation(self.truth(left, scope)), self.truth(right, scope)].into_iter())
            }
            Formula::Exists(range, body) => {
                disjunction(range.objects().iter().map(|object| self.truth(body, &with(scope, *object))))
            }
            Formula::ForAll(range, body) => {
                conjunction(range.objects().iter().map(|object| self.truth(body, &with(scope, *object))))
            }
        }
    }

    fn value(&self, expression: &Expression, scope: &[usize]) -> Option<Number> {
        let value = |expression: &Expression| self.value(expression, scope);
        Some(match expression {
            Expression::Number(number) => *number,
            Expression::Function(function, terms) => {
                *self.state.values.get(&(*function, objects(terms, scope)))?
            }
            Expression::Duration => self.duration?,
            Expression::TotalTime => self.state.time,
            Expression::Sum(parts) => parts.iter().map(value).sum::<Option<Number>>()?,
            Expression::Difference(left, right) => value(left)? - value(right)?,
            Expression::Negative(inner) => -value(inner)?,
            Expression::Product(left, right) => value(left)? * value(right)?,
            Expression::Quotient(left, right) => {
                let (left, right) = (value(left)?, value(right)?);
                if right == Ratio::from_integer(0) {
                    return None;
                }
                left / right
            }
        })
    }

    /// Adds the changes of an effect in the current state to `changes`. Returns `None` if a change is
    /// undefined or contradicts another.
    fn collect(&self, effect: &Effect, scope: &[usize], changes: &mut Changes) -> Option<()> {
        match effect {
            Effect::And(parts) => parts.iter().try_for_each(|part| self.collect(part, scope, changes))?,
            Effect::Add(predicate, terms) => {
                changes.added.insert((*predicate, objects(terms, scope)));
            }
            Effect::Delete(predicate, terms) => {
                changes.deleted.insert((*predicate, objects(terms, scope)));
            }
            Effect::Change(way, function, terms, value) => {
                let value = self.value(value, scope)?;
                let change = match way {
                    Way::Assign => Change::Assign(value),
                    Way::Increase => Change::Add(value),
                    Way::Decrease => Change::Add(-value),
                    Way::ScaleUp => Change::Scale(value),
                    Way::ScaleDown if value == Ratio::from_integer(0) => return None,
                    Way::ScaleDown => Change::Scale(value.recip()),
                };
                changes.record((*function, objects(terms, scope)), change)?;
            }
            Effect::When(condition, body) => {
                if self.truth(condition, scope)? {
                    self.collect(body, scope, changes)?;
                }
            }
            Effect::ForAll(range, body) => {
                for object in range.objects() {
                    self.collect(body, &with(scope, *object), changes)?;
                }
            }
        }
        Some(())
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Change {
    Assign(Number),
    Add(Number),
    Scale(Number),
}

#[derive(Debug, Default)]
pub struct Changes {
    pub added: BTreeSet<Atom>,
    pub deleted: BTreeSet<Atom>,
    pub values: BTreeMap<Atom, Change>,
}

impl Changes {
    fn record(&mut self, target: Atom, change: Change) -> Option<()> {
        let combined = match (self.values.get(&target), change) {
            (None, change) => change,
            (Some(Change::Add(one)), Change::Add(other)) => Change::Add(one + other),
            (Some(Change::Scale(one)), Change::Scale(other)) => Change::Scale(one * other),
            (Some(Change::Assign(one)), Change::Assign(other)) if *one == other => change,
            _ => return None,
        };
        self.values.insert(target, combined);
        Some(())
    }
}

/// The start or the end of an action: condition, effects, and the bounds of the duration that are
/// evaluated then.
type Half<'a> = (&'a Formula, &'a [Effect], Vec<&'a Expression>);

impl State {
    pub fn initial(task: &Task) -> Self {
        let (facts, values, time) = (task.facts.clone(), task.values.clone(), Ratio::from_integer(0));
        let mut state = Self { facts, values, time, timed: 0 };
        state.pass(task, |due| due <= time);
        state
    }

    fn changed(
        &self,
        task: &Task,
        effects: &[Effect],
        scope: &[usize],
        duration: Option<Number>,
    ) -> Option<Self> {
        let view = View::new(task, self, duration);
        let mut changes = Changes::default();
        effects.iter().try_for_each(|effect| view.collect(effect, scope, &mut changes))?;
        let mut after = self.clone();
        for (target, change) in changes.values {
            let before = self.values.get(&target);
            let value = match change {
                Change::Assign(value) => value,
                Change::Add(value) => before? + value,
                Change::Scale(value) => before? * value,
            };
            after.values.insert(target, value);
        }
        after.facts.retain(|fact| !changes.deleted.contains(fact));
        after.facts.extend(changes.added);
        Some(after)
    }

    fn pass(&mut self, task: &Task, is_due: impl Fn(Number) -> bool) {
        while let Some((time, atom, holds)) = task.timed.get(self.timed).filter(|(time, ..)| is_due(*time)) {
            let _ = time;
            if *holds {
                self.facts.insert(atom.clone());
            } else {
                self.facts.remove(atom);
            }
            self.timed += 1;
        }
    }

    /// Returns the duration of an action: 0 for an instantaneous action, otherwise the value of the first
    /// equation, or without an equation the stated duration. Bounds at the end are ignored. Returns `None`
    /// if the bounds do not admit the stated duration, or if the duration is negative or unknown.
    fn duration(
        &self,
        task: &Task,
        action: &Action,
        scope: &[usize],
        stated: Option<Number>,
    ) -> Option<Number> {
        let Some(bounds) = &action.duration else { return Some(Ratio::from_integer(0)) };
        let view = View::new(task, self, None);
        let mut exact = None;
        for (_, sign, value) in bounds.iter().filter(|(at_end, ..)| !at_end) {
            let value = view.value(value, scope)?;
            if *sign == crate::ground_semantics::model::Sign::Equal && exact.is_none() {
                exact = Some(value);
            }
            if stated.is_some_and(|stated| !sign.holds(stated, value)) {
                return None;
            }
        }
        exact.or(stated).filter(|duration| *duration >= Ratio::from_integer(0))
    }

    pub fn value(&self, task: &Task, expression: &Expression, scope: &[usize]) -> Option<Number> {
        View::new(task, self, None).value(expression, scope)
    }

    /// Returns the state after a happening, all effects of which read this state. Returns `None` if a
    /// condition does not hold, an effect is undefined, or parts of the happening interfere with each
    /// other or with a simultaneous event.
    fn happen(
        &self,
        task: &Task,
        halves: &[Half<'_>],
        scope: &[usize],
        duration: Number,
        time: Number,
    ) -> Option<Self> {
        let view = View::new(task, self, Some(duration));
        if !halves.iter().all(|(condition, ..)| view.holds(condition, scope)) {
            return None;
        }
        let mut touched = Vec::new();
        for (condition, effects, bounds) in halves {
            let mut touch = Touch::default();
            touch.reads_of_formula(task, condition, scope);
            for value in bounds {
                touch.reads_of_expression(value, scope);
            }
            for effect in *effects {
                touch.reads_of_effect(task, effect, scope);
            }
            let mut changes = Changes::default();
            effects.iter().try_for_each(|effect| view.collect(effect, scope, &mut changes))?;
            touch.writes(&changes);
            touched.push(touch);
        }
        for (_, atom, holds) in task.timed.iter().filter(|(due, ..)| *due == time) {
            let mut event = Touch::default();
            if *holds { &mut event.added } else { &mut event.deleted }.insert(atom.clone());
            touched.push(event);
        }
        let disturbs =
            |one: &Touch| touched.iter().any(|other| one.disturbs(other) && !std::ptr::eq(one, other));
        if touched.iter().any(disturbs) {
            return None;
        }
        let effects: Vec<_> = halves.iter().flat_map(|(_, effects, _)| effects.iter().cloned()).collect();
        let mut after = self.changed(task, &effects, scope, Some(duration))?;
        after.pass(task, |due| due <= time);
        Some(after)
    }

    /// Returns the state after a step that starts as soon as the previous step has ended. Returns `None`
    /// if it cannot be executed.
    pub fn after(&self, task: &Task, (action, scope, stated): &Step) -> Option<Self> {
        let action = &task.actions[*action];
        let start = self.time;
        let zero = Ratio::from_integer(0);
        let mut state = self.clone();
        state.pass(task, |time| time < start);
        let duration = state.duration(task, action, scope, *stated)?;
        let end = start + duration;
        let bounds = |end: bool| {
            let bounds = action.duration.iter().flatten().filter(move |(at_end, ..)| *at_end == end);
            bounds.map(|(.., value)| value).collect()
        };
        let first = (&action.at_start, action.start_effects.as_slice(), bounds(false));
        let last = (&action.at_end, action.end_effects.as_slice(), bounds(true));
        let is_as_long_as_wanted = |state: &Self| {
            let view = View::new(task, state, Some(duration));
            let mut bounds = action.duration.iter().flatten().filter(|(at_end, ..)| *at_end);
            bounds.all(|(_, sign, value)| {
                view.value(value, scope).is_some_and(|value| sign.holds(duration, value))
            })
        };
        if action.duration.is_none() {
            state = state.happen(task, &[first], scope, duration, start)?;
        } else if duration == zero {
            if !is_as_long_as_wanted(&state) {
                return None;
            }
            state = state.happen(task, &[first, last], scope, duration, start)?;
        } else {
            let holds = |state: &Self, formula| View::new(task, state, Some(duration)).holds(formula, scope);
            state = state.happen(task, &[first], scope, duration, start)?;
            if !holds(&state, &action.over_all) {
                return None;
            }
            while let Some((time, ..)) = task.timed.get(state.timed).filter(|(time, ..)| *time < end) {
                state.pass(task, |due| due <= *time);
                if !holds(&state, &action.over_all) {
                    return None;
                }
            }
            if !is_as_long_as_wanted(&state) {
                return None;
            }
            state = state.happen(task, &[last], scope, duration, end)?;
        }
        state.time = end;
        Some(state)
    }

    /// Returns all atoms that hold, including derived atoms.
    pub fn all_facts(&self, task: &Task) -> BTreeSet<Atom> {
        let derived = View::new(task, self, None).derived;
        self.facts.iter().cloned().chain(derived).collect()
    }

    pub fn is_goal(&self, task: &Task) -> bool {
        View::new(task, self, None).holds(&task.goal, &[])
    }

    pub fn metric(&self, task: &Task) -> Option<Number> {
        let (_, value) = task.metric.as_ref()?;
        View::new(task, self, None).value(value, &[])
    }
}
