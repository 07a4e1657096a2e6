//! Small random tasks with possibly undefined numbers, their execution by definition, and their PDDL text.

use testing::random::Random;

pub(crate) const DEPTH: usize = 5;

/// Truth values of the facts r and s, and values of the numbers a and b.
#[derive(Debug, Clone, Copy)]
struct State {
    facts: [bool; 2],
    values: [Option<i64>; 2],
}

#[derive(Debug, Clone, Copy)]
enum Number {
    Constant(i64),
    Function(usize),
}

#[derive(Debug, Clone)]
enum Formula {
    Fact(usize),
    Less(Number, Number),
    Not(Box<Formula>),
    And(Box<Formula>, Box<Formula>),
    Or(Box<Formula>, Box<Formula>),
}

#[derive(Debug, Clone)]
enum Change {
    Set(usize, bool),
    Assign(usize, Number),
    /// Increase by 1, up to at most 3.
    Increase(usize),
}

#[derive(Debug, Clone)]
struct Effect {
    condition: Option<Formula>,
    change: Change,
}

#[derive(Debug, Clone)]
struct Action {
    is_durative: bool,
    condition: Formula,
    start: Vec<Effect>,
    end: Vec<Effect>,
}

#[derive(Debug)]
pub(crate) struct Task {
    actions: Vec<Action>,
    init: State,
    goal: Formula,
}

impl Number {
    fn value(self, state: &State) -> Option<i64> {
        match self {
            Self::Constant(value) => Some(value),
            Self::Function(function) => state.values[function],
        }
    }

    fn text(self) -> String {
        match self {
            Self::Constant(value) => value.to_string(),
            Self::Function(function) => ["(a)", "(b)"][function].into(),
        }
    }
}

impl Formula {
    /// Kleene's three-valued logic; `None` is undefined.
    fn truth(&self, state: &State) -> Option<bool> {
        match self {
            Self::Fact(fact) => Some(state.facts[*fact]),
            Self::Less(left, right) => Some(left.value(state)? < right.value(state)?),
            Self::Not(inner) => Some(!inner.truth(state)?),
            Self::And(left, right) => match (left.truth(state), right.truth(state)) {
                (Some(false), _) | (_, Some(false)) => Some(false),
                (Some(true), Some(true)) => Some(true),
                _ => None,
            },
            Self::Or(left, right) => match (left.truth(state), right.truth(state)) {
                (Some(true), _) | (_, Some(true)) => Some(true),
                (Some(false), Some(false)) => Some(false),
                _ => None,
            },
        }
    }

    fn text(&self) -> String {
        match self {
            Self::Fact(fact) => ["(r)", "(s)"][*fact].into(),
            Self::Less(left, right) => format!("(< {} (+ 0 {}))", left.text(), right.text()),
            Self::Not(inner) => format!("(not {})", inner.text()),
            Self::And(left, right) => format!("(and {} {})", left.text(), right.text()),
            Self::Or(left, right) => format!("(or {} {})", left.text(), right.text()),
        }
    }
}

impl Effect {
    fn text(&self) -> String {
        let change = match &self.change {
            Change::Set(fact, true) => Formula::Fact(*fact).text(),
            Change::Set(fact, false) => format!("(not {})", Formula::Fact(*fact).text()),
            Change::Assign(function, number) => {
                format!("(assign {} {})", Number::Function(*function).text(), number.text())
            }
            Change::Increase(function) => {
                let function = Number::Function(*function).text();
                return format!("(when (< {function} 3) (increase {function} 1))");
            }
        };
        match &self.condition {
            Some(condition) => format!("(when {} {change})", condition.text()),
            None => change,
        }
    }
}

/// Returns the state after simultaneous effects, or `None` if an effect reads an undefined value.
fn after(state: State, effects: &[Effect]) -> Option<State> {
    let mut next = state;
    let mut added = Vec::new();
    for effect in effects {
        if let Some(condition) = &effect.condition
            && !condition.truth(&state)?
        {
            continue;
        }
        match &effect.change {
            Change::Set(fact, true) => added.push(*fact),
            Change::Set(fact, false) => next.facts[*fact] = false,
            Change::Assign(function, number) => next.values[*function] = Some(number.value(&state)?),
            Change::Increase(function) => {
                next.values[*function] = Some((state.values[*function]? + 1).min(3));
            }
        }
    }
    for fact in added {
        next.facts[fact] = true;
    }
    Some(next)
}

impl Task {
    fn execute(&self, plan: &[usize]) -> Option<State> {
        plan.iter().try_fold(self.init, |state, action| {
            let action = &self.actions[*action];
            if action.condition.truth(&state) != Some(true) {
                return None;
            }
            after(after(state, &action.start)?, &action.end)
        })
    }

    pub(crate) fn is_plan(&self, plan: &[usize]) -> bool {
        self.execute(plan).is_some_and(|state| self.goal.truth(&state) == Some(true))
    }

    /// Returns the number of actions of a shortest plan, or `None` if there is no plan with at most
    /// [`DEPTH`] actions.
    pub(crate) fn shortest(&self) -> Option<usize> {
        let mut layer: Vec<Vec<usize>> = vec![Vec::new()];
        for length in 0..=DEPTH {
            if layer.iter().any(|plan| self.is_plan(plan)) {
                return Some(length);
            }
            let longer =
                layer.iter().flat_map(|plan| (0..self.actions.len()).map(|one| [&plan[..], &[one]].concat()));
            layer = longer.filter(|plan| self.execute(plan).is_some()).collect();
        }
        None
    }

    pub(crate) fn domain(&self) -> String {
        let mut text =
            String::from("(define (domain d) (:predicates (r) (s)) (:functions (a) (b) (total-cost))\n");
        for (action, number) in self.actions.iter().zip(0..) {
            let list = |effects: &[Effect], open: &str, close: &str| {
                effects
                    .iter()
                    .map(|effect| format!("{open}{}{close}", effect.text()))
                    .collect::<Vec<_>>()
                    .concat()
            };
            let condition = action.condition.text();
            let written = if action.is_durative {
                format!(
                    "(:durative-action a{number} :parameters () :duration (= ?duration 2) :condition (at start {condition})
                      :effect (and {}{}(at end (increase (total-cost) 1))))\n",
                    list(&action.start, "(at start ", ")"),
                    list(&action.end, "(at end ", ")")
                )
            } else {
                format!(
                    "(:action a{number} :parameters () :precondition {condition} :effect (and {}(increase (total-cost) 1)))\n",
                    list(&action.end, "", "")
                )
            };
            text.push_str(&written);
        }
        text + ")"
    }

    pub(crate) fn problem(&self) -> String {
        let facts =
            ["(r)", "(s)"].iter().zip(self.init.facts).filter(|(_, holds)| *holds).map(|(fact, _)| *fact);
        let values = ["a", "b"].iter().zip(self.init.values);
        let values = values.filter_map(|(name, value)| value.map(|value| format!("(= ({name}) {value})")));
        format!(
            "(define (problem p) (:domain d) (:init {} {} (= (total-cost) 0)) (:goal {}) (:metric minimize (total-cost)))",
            facts.collect::<String>(),
            values.collect::<String>(),
            self.goal.text()
        )
    }
}

pub(crate) struct Generator(pub(crate) Random);

impl Generator {
    pub(crate) fn below(&mut self, limit: u64) -> usize {
        self.0.below(limit).unsigned_abs() as usize
    }

    fn number(&mut self) -> Number {
        if self.below(2) == 0 { Number::Function(self.below(2)) } else { Number::Constant(self.0.below(4)) }
    }

    fn formula(&mut self, depth: u64) -> Formula {
        let inner = |own: &mut Self| Box::new(own.formula(depth - 1));
        match if depth == 0 { self.below(2) } else { self.below(6) } {
            0 => Formula::Fact(self.below(2)),
            1 | 2 => Formula::Less(Number::Function(self.below(2)), self.number()),
            3 => Formula::Not(inner(self)),
            4 => Formula::And(inner(self), inner(self)),
            _ => Formula::Or(inner(self), inner(self)),
        }
    }

    /// Generates effects, at most one on each number.
    fn effects(&mut self) -> Vec<Effect> {
        let mut changes = Vec::new();
        if self.below(2) == 0 {
            changes.push(Change::Set(self.below(2), self.below(3) > 0));
        }
        for function in 0..2 {
            match self.below(6) {
                0 => changes.push(Change::Increase(function)),
                1 => changes.push(Change::Assign(function, self.number())),
                _ => {}
            }
        }
        let guard = |own: &mut Self, change: &Change| {
            (own.below(4) == 0 && !matches!(change, Change::Increase(_))).then(|| own.formula(1))
        };
        changes.into_iter().map(|change| Effect { condition: guard(self, &change), change }).collect()
    }

    pub(crate) fn task(&mut self) -> Task {
        let actions = (0..3).map(|_| {
            let is_durative = self.below(4) == 0;
            let start = if is_durative { self.effects() } else { Vec::new() };
            Action { is_durative, condition: self.formula(1), start, end: self.effects() }
        });
        let actions = actions.collect();
        let values = [(); 2].map(|()| if self.below(3) == 0 { Some(self.0.below(3)) } else { None });
        let facts = [(); 2].map(|()| self.below(2) == 0);
        Task { actions, init: State { facts, values }, goal: self.formula(2) }
    }
}
