//! Tasks with functions whose values are objects, executed by their definition.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

pub(crate) const REACH: u32 = 7;

/// Number of objects 0, 1 and 2. Function g has only the values 0 and 1.
pub(crate) const OBJECTS: usize = 3;
pub(crate) const WEIGHTS: [u32; OBJECTS] = [1, 2, 0];

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct State {
    /// Values of the functions f and g for each object.
    pub(crate) values: [[Option<usize>; OBJECTS]; 2],
    pub(crate) marked: [bool; OBJECTS],
}

#[derive(Debug, Clone)]
pub(crate) enum Term {
    Object(usize),
    Variable(usize),
    Function(usize, Box<Term>),
}

#[derive(Debug, Clone)]
pub(crate) enum Formula {
    Equal(Term, Term),
    Undefined(Term),
    Marked(Term),
    Heavy(Term),
    Not(Box<Formula>),
    And(Box<Formula>, Box<Formula>),
    Or(Box<Formula>, Box<Formula>),
    /// The quantified variable follows the variables of the binding.
    Exists(Box<Formula>),
    ForAll(Box<Formula>),
}

#[derive(Debug, Clone)]
pub(crate) enum Change {
    Assign(usize, Term, Option<Term>),
    Mark(Term, bool),
    Pay(Term),
}

#[derive(Debug, Clone)]
pub(crate) struct Effect {
    pub(crate) is_universal: bool,
    pub(crate) condition: Option<Formula>,
    pub(crate) change: Change,
}

#[derive(Debug, Clone)]
pub(crate) struct Action {
    pub(crate) parameters: usize,
    pub(crate) condition: Formula,
    pub(crate) start: Option<Vec<Effect>>,
    pub(crate) end: Vec<Effect>,
}

#[derive(Debug)]
pub(crate) struct Task {
    pub(crate) actions: Vec<Action>,
    pub(crate) init: State,
    pub(crate) goal: Formula,
}

pub(crate) type Step = (usize, Vec<usize>);

impl Term {
    pub(crate) fn value(&self, state: &State, binding: &[usize]) -> Option<usize> {
        match self {
            Self::Object(object) => Some(*object),
            Self::Variable(place) => Some(binding[*place]),
            Self::Function(function, inner) => state.values[*function][inner.value(state, binding)?],
        }
    }

    pub(crate) fn text(&self) -> String {
        match self {
            Self::Object(object) => format!("o{object}"),
            Self::Variable(place) => format!("?v{place}"),
            Self::Function(function, inner) => format!("({} {})", ["f", "g"][*function], inner.text()),
        }
    }
}

impl Formula {
    /// Atoms with undefined terms are false, except the test whether a term is undefined.
    pub(crate) fn holds(&self, state: &State, binding: &[usize]) -> bool {
        let with = |object| [binding, &[object]].concat();
        match self {
            Self::Equal(left, right) => match (left.value(state, binding), right.value(state, binding)) {
                (Some(left), Some(right)) => left == right,
                _ => false,
            },
            Self::Undefined(term) => term.value(state, binding).is_none(),
            Self::Marked(term) => term.value(state, binding).is_some_and(|object| state.marked[object]),
            Self::Heavy(term) => term.value(state, binding).is_some_and(|object| WEIGHTS[object] > 0),
            Self::Not(inner) => !inner.holds(state, binding),
            Self::And(left, right) => left.holds(state, binding) && right.holds(state, binding),
            Self::Or(left, right) => left.holds(state, binding) || right.holds(state, binding),
            Self::Exists(body) => (0..OBJECTS).any(|object| body.holds(state, &with(object))),
            Self::ForAll(body) => (0..OBJECTS).all(|object| body.holds(state, &with(object))),
        }
    }

    pub(crate) fn text(&self, bound: usize) -> String {
        match self {
            Self::Equal(left, right) => format!("(= {} {})", left.text(), right.text()),
            Self::Undefined(term) => format!("(= {} undefined)", term.text()),
            Self::Marked(term) => format!("(marked {})", term.text()),
            Self::Heavy(term) => format!("(> (weight {}) 0)", term.text()),
            Self::Not(inner) => format!("(not {})", inner.text(bound)),
            Self::And(left, right) => format!("(and {} {})", left.text(bound), right.text(bound)),
            Self::Or(left, right) => format!("(or {} {})", left.text(bound), right.text(bound)),
            Self::Exists(body) => format!("(exists (?v{bound} - thing) {})", body.text(bound + 1)),
            Self::ForAll(body) => format!("(forall (?v{bound} - thing) {})", body.text(bound + 1)),
        }
    }
}

impl Effect {
    pub(crate) fn text(&self, parameters: usize) -> String {
        let change = match &self.change {
            Change::Assign(function, argument, value) => {
                let value = value.as_ref().map_or_else(|| "undefined".into(), Term::text);
                format!("(assign ({} {}) {value})", ["f", "g"][*function], argument.text())
            }
            Change::Mark(term, true) => format!("(marked {})", term.text()),
            Change::Mark(term, false) => format!("(not (marked {}))", term.text()),
            Change::Pay(term) => format!("(increase (total-cost) (weight {}))", term.text()),
        };
        let bound = parameters + usize::from(self.is_universal);
        let change = match &self.condition {
            Some(condition) => format!("(when {} {change})", condition.text(bound)),
            None => change,
        };
        if self.is_universal { format!("(forall (?v{parameters} - thing) {change})") } else { change }
    }
}

/// Returns the next state and the cost of the effects. Returns `None` if an effect reads an
/// undefined term or two effects assign different values to one term.
pub(crate) fn after(state: &State, effects: &[Effect], arguments: &[usize]) -> Option<(State, u32)> {
    let mut assigned: BTreeMap<(usize, usize), Option<usize>> = BTreeMap::new();
    let (mut added, mut deleted, mut cost) = (BTreeSet::new(), BTreeSet::new(), 0);
    for effect in effects {
        let bindings: Vec<Vec<usize>> = if effect.is_universal {
            (0..OBJECTS).map(|object| [arguments, &[object]].concat()).collect()
        } else {
            vec![arguments.to_vec()]
        };
        for binding in bindings {
            if effect.condition.as_ref().is_some_and(|condition| !condition.holds(state, &binding)) {
                continue;
            }
            match &effect.change {
                Change::Assign(function, argument, value) => {
                    let value = match value {
                        Some(value) => Some(value.value(state, &binding)?),
                        None => None,
                    };
                    let key = (*function, argument.value(state, &binding)?);
                    if assigned.insert(key, value).is_some_and(|earlier| earlier != value) {
                        return None;
                    }
                }
                Change::Mark(term, true) => drop(added.insert(term.value(state, &binding)?)),
                Change::Mark(term, false) => drop(deleted.insert(term.value(state, &binding)?)),
                Change::Pay(term) => cost += WEIGHTS[term.value(state, &binding)?],
            }
        }
    }
    let mut next = *state;
    for object in deleted {
        next.marked[object] = false;
    }
    for object in added {
        next.marked[object] = true;
    }
    for ((function, object), value) in assigned {
        next.values[function][object] = value;
    }
    Some((next, cost))
}

impl Task {
    pub(crate) fn execute(&self, state: &State, (action, arguments): &Step) -> Option<(State, u32)> {
        let action = &self.actions[*action];
        if !action.condition.holds(state, arguments) {
            return None;
        }
        let (middle, first) = match &action.start {
            Some(start) => after(state, start, arguments)?,
            None => (*state, 0),
        };
        let (end, second) = after(&middle, &action.end, arguments)?;
        Some((end, first + second + 1))
    }

    pub(crate) fn cost(&self, plan: &[Step]) -> Option<u32> {
        let start = (self.init, 0);
        let (end, cost) = plan.iter().try_fold(start, |(state, cost), step| {
            let (next, more) = self.execute(&state, step)?;
            Some((next, cost + more))
        })?;
        self.goal.holds(&end, &[]).then_some(cost)
    }

    pub(crate) fn steps(&self) -> Vec<Step> {
        let of = |(number, action): (usize, &Action)| -> Vec<Step> {
            let mut bindings = vec![Vec::new()];
            for _ in 0..action.parameters {
                let longer = |binding: &Vec<usize>| {
                    (0..OBJECTS).map(|object| [&binding[..], &[object]].concat()).collect::<Vec<_>>()
                };
                bindings = bindings.iter().flat_map(longer).collect();
            }
            bindings.into_iter().map(|binding| (number, binding)).collect()
        };
        self.actions.iter().enumerate().flat_map(of).collect()
    }

    /// Minimum cost of a plan, if it is at most [`REACH`].
    pub(crate) fn best(&self) -> Option<u32> {
        let steps = self.steps();
        let mut open = BTreeSet::from([(0, self.init)]);
        let mut closed = BTreeSet::new();
        while let Some((cost, state)) = open.pop_first() {
            if self.goal.holds(&state, &[]) {
                return Some(cost);
            }
            if !closed.insert(state) {
                continue;
            }
            let next = steps.iter().filter_map(|step| self.execute(&state, step));
            open.extend(next.map(|(next, more)| (cost + more, next)).filter(|(cost, _)| *cost <= REACH));
        }
        None
    }

    pub(crate) fn domain(&self) -> String {
        let mut text = String::from(
            "(define (domain d) (:requirements :adl :object-fluents) (:types thing - object small - thing)
             (:constants o0 o1 - small o2 - thing)
             (:predicates (marked ?x - thing)) (:functions (f ?x - thing) - thing (g ?x - thing) - small
               (weight ?x - thing) (total-cost))\n",
        );
        for (number, action) in self.actions.iter().enumerate() {
            let count = action.parameters;
            let parameters: String =
                (0..count).map(|place| format!("?v{place} ")).collect::<Vec<_>>().concat();
            let parameters = if count == 0 { parameters } else { parameters + "- thing" };
            let list = |effects: &[Effect], open: &str, close: &str| {
                let texts = effects.iter().map(|effect| format!("{open}{}{close} ", effect.text(count)));
                texts.collect::<Vec<_>>().concat()
            };
            let condition = action.condition.text(count);
            let written = match &action.start {
                Some(start) => format!(
                    "(:durative-action a{number} :parameters ({parameters}) :duration (= ?duration 2)
                       :condition (at start {condition})
                       :effect (and {}{}(at end (increase (total-cost) 1))))\n",
                    list(start, "(at start ", ")"),
                    list(&action.end, "(at end ", ")")
                ),
                None => format!(
                    "(:action a{number} :parameters ({parameters}) :precondition {condition}
                       :effect (and {}(increase (total-cost) 1)))\n",
                    list(&action.end, "", "")
                ),
            };
            text.push_str(&written);
        }
        text + ")"
    }

    pub(crate) fn problem(&self) -> String {
        let mut init = String::new();
        for (object, weight) in WEIGHTS.iter().enumerate() {
            let _ = write!(init, "(= (weight o{object}) {weight}) ");
            if self.init.marked[object] {
                let _ = write!(init, "(marked o{object}) ");
            }
            for function in 0..2 {
                if let Some(value) = self.init.values[function][object] {
                    let _ = write!(init, "(= ({} o{object}) o{value}) ", ["f", "g"][function]);
                }
            }
        }
        format!(
            "(define (problem p) (:domain d)
              (:init {init}(= (total-cost) 0))
              (:goal {}) (:metric minimize (total-cost)))",
            self.goal.text(0)
        )
    }
}
