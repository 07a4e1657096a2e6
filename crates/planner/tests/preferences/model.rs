//! Small tasks with preferences and trajectory constraints, their evaluation by definition, and their PDDL
//! text.

use std::fmt::Write as _;

const DEPTH: usize = 4;

/// Truth values of p(o0), p(o1), r and s, and value of the number n.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct State {
    pub facts: [bool; 4],
    pub n: i64,
}

/// An object, the parameter ?x, or the quantified variable ?z.
#[derive(Debug, Clone, Copy)]
pub enum Term {
    Object(usize),
    X,
    Z,
}

#[derive(Debug, Clone, Copy, Default)]
pub struct Bound {
    pub x: usize,
    pub z: usize,
}

#[derive(Debug, Clone, Copy)]
pub enum Atom {
    P(Term),
    R,
    S,
}

#[derive(Debug, Clone)]
pub enum Formula {
    Atom(Atom),
    AtLeast(i64),
    Not(Box<Formula>),
    And(Box<Formula>, Box<Formula>),
    Or(Box<Formula>, Box<Formula>),
    All(Box<Formula>),
    Some(Box<Formula>),
}

#[derive(Debug, Clone)]
pub enum Effect {
    Set(Option<Formula>, Atom, bool),
    /// Sets the atom for all objects that satisfy the condition.
    SetAll(Option<Formula>, bool),
    Up,
    Assign(i64),
}

#[derive(Debug, Clone)]
pub struct Action {
    pub has_parameter: bool,
    pub is_durative: bool,
    pub condition: Formula,
    /// Whether the preference refers to the end, and its condition.
    pub preference: Option<(bool, Formula)>,
    pub start: Vec<Effect>,
    pub end: Vec<Effect>,
    pub cost: i64,
}

#[derive(Debug, Clone)]
pub struct Constraint {
    pub kind: &'static str,
    pub first: Formula,
    pub second: Formula,
    pub for_all: bool,
    /// `None` for a hard constraint.
    pub preference: Option<usize>,
}

#[derive(Debug)]
pub struct Task {
    pub actions: Vec<Action>,
    pub init: State,
    pub goal: Formula,
    pub constraints: Vec<Constraint>,
    /// Weights of the preferences 0 to 3. The last weight is that of the action preferences.
    pub weights: [i64; 4],
    pub maximize: bool,
}

impl Term {
    fn place(self, bound: Bound) -> usize {
        match self {
            Self::Object(object) => object,
            Self::X => bound.x,
            Self::Z => bound.z,
        }
    }

    pub fn text(self) -> String {
        match self {
            Self::Object(object) => format!("o{object}"),
            Self::X => "?x".into(),
            Self::Z => "?z".into(),
        }
    }
}

impl Atom {
    fn place(self, bound: Bound) -> usize {
        match self {
            Self::P(term) => term.place(bound),
            Self::R => 2,
            Self::S => 3,
        }
    }

    pub fn text(self) -> String {
        match self {
            Self::P(term) => format!("(p {})", term.text()),
            Self::R => "(r)".into(),
            Self::S => "(s)".into(),
        }
    }
}

impl Formula {
    fn holds(&self, state: &State, bound: Bound) -> bool {
        let each = |inner: &Self| [0, 1].map(|z| inner.holds(state, Bound { z, ..bound }));
        match self {
            Self::Atom(atom) => state.facts[atom.place(bound)],
            Self::AtLeast(number) => state.n >= *number,
            Self::Not(inner) => !inner.holds(state, bound),
            Self::And(left, right) => left.holds(state, bound) && right.holds(state, bound),
            Self::Or(left, right) => left.holds(state, bound) || right.holds(state, bound),
            Self::All(inner) => each(inner).iter().all(|holds| *holds),
            Self::Some(inner) => each(inner).iter().any(|holds| *holds),
        }
    }

    pub fn text(&self) -> String {
        match self {
            Self::Atom(atom) => atom.text(),
            Self::AtLeast(number) => format!("(>= (n) {number})"),
            Self::Not(inner) => format!("(not {})", inner.text()),
            Self::And(left, right) => format!("(and {} {})", left.text(), right.text()),
            Self::Or(left, right) => format!("(or {} {})", left.text(), right.text()),
            Self::All(inner) => format!("(forall (?z - thing) {})", inner.text()),
            Self::Some(inner) => format!("(exists (?z - thing) {})", inner.text()),
        }
    }
}

impl Effect {
    pub fn text(&self) -> String {
        let literal = |atom: &Atom, holds: &bool| {
            if *holds { atom.text() } else { format!("(not {})", atom.text()) }
        };
        let under = |condition: &Option<Formula>, effect: String| match condition {
            Some(condition) => format!("(when {} {effect})", condition.text()),
            None => effect,
        };
        match self {
            Self::Set(condition, atom, holds) => under(condition, literal(atom, holds)),
            Self::SetAll(condition, holds) => {
                format!("(forall (?z - thing) {})", under(condition, literal(&Atom::P(Term::Z), holds)))
            }
            Self::Up => "(increase (n) 1)".into(),
            Self::Assign(number) => format!("(assign (n) {number})"),
        }
    }
}

/// Returns the state after simultaneous effects. An atom that is added and deleted is true.
pub fn after(state: &State, effects: &[Effect], bound: Bound) -> State {
    let mut next = state.clone();
    let mut set = Vec::new();
    for effect in effects {
        match effect {
            Effect::Set(condition, atom, holds) => {
                if condition.as_ref().is_none_or(|condition| condition.holds(state, bound)) {
                    set.push((atom.place(bound), *holds));
                }
            }
            Effect::SetAll(condition, holds) => {
                for z in 0..2 {
                    let inner = Bound { z, ..bound };
                    if condition.as_ref().is_none_or(|condition| condition.holds(state, inner)) {
                        set.push((z, *holds));
                    }
                }
            }
            Effect::Up => next.n += 1,
            Effect::Assign(number) => next.n = *number,
        }
    }
    set.sort_by_key(|(_, holds)| *holds);
    for (place, holds) in set {
        next.facts[place] = holds;
    }
    next
}

/// Evaluates the constraint by the definition of PDDL 3.
pub fn follows(constraint: &Constraint, states: &[State], bound: Bound) -> bool {
    let first: Vec<bool> = states.iter().map(|state| constraint.first.holds(state, bound)).collect();
    let second: Vec<bool> = states.iter().map(|state| constraint.second.holds(state, bound)).collect();
    let all = 0..states.len();
    match constraint.kind {
        "at end" => first[states.len() - 1],
        "always" => all.clone().all(|i| first[i]),
        "sometime" => all.clone().any(|i| first[i]),
        // If the condition holds in a state, it holds from there up to some later state, and in no state
        // after that.
        "at-most-once" => all.clone().all(|i| {
            !first[i]
                || (i..states.len())
                    .any(|j| (i..=j).all(|k| first[k]) && (j + 1..states.len()).all(|k| !first[k]))
        }),
        "sometime-after" => all.clone().all(|i| !first[i] || (i..states.len()).any(|j| second[j])),
        "sometime-before" => all.clone().all(|i| !first[i] || (0..i).any(|j| second[j])),
        other => panic!("{other}"),
    }
}

impl Task {
    /// Returns the states of a plan, its cost, and the number of violated action preferences;
    /// `None` if an action is not applicable.
    pub fn execute(&self, plan: &[(usize, usize)]) -> Option<(Vec<State>, i64, i64)> {
        let mut states = vec![self.init.clone()];
        let (mut cost, mut violated) = (0, 0);
        for (action, x) in plan {
            let (action, bound) = (&self.actions[*action], Bound { x: *x, z: 0 });
            let before = states.last()?.clone();
            if !action.condition.holds(&before, bound) {
                return None;
            }
            let middle = after(&before, &action.start, bound);
            if action.is_durative {
                states.push(middle.clone());
            }
            if let Some((at_end, condition)) = &action.preference {
                violated += i64::from(!condition.holds(if *at_end { &middle } else { &before }, bound));
            }
            states.push(after(&middle, &action.end, bound));
            cost += action.cost;
        }
        Some((states, cost, violated))
    }

    pub fn judge(&self, plan: &[(usize, usize)]) -> Option<i64> {
        let (states, mut cost, violated) = self.execute(plan)?;
        if !self.goal.holds(states.last()?, Bound::default()) {
            return None;
        }
        cost += self.weights[3] * violated;
        for constraint in &self.constraints {
            let instances = if constraint.for_all { 0..2 } else { 0..1 };
            let broken = instances.filter(|z| !follows(constraint, &states, Bound { x: 0, z: *z })).count();
            match constraint.preference {
                Some(name) => cost += self.weights[name] * i64::try_from(broken).ok()?,
                None if broken > 0 => return None,
                None => {}
            }
        }
        Some(if self.maximize { 20 - cost } else { cost })
    }

    pub fn best(&self) -> Option<i64> {
        let instances: Vec<_> = (0..self.actions.len())
            .flat_map(|action| {
                (0..=usize::from(self.actions[action].has_parameter)).map(move |x| (action, x))
            })
            .collect();
        let (mut best, mut open) = (None, vec![Vec::new()]);
        while let Some(plan) = open.pop() {
            let found = self.judge(&plan);
            best = match (best, found) {
                (Some(left), Some(right)) if self.maximize => Some(std::cmp::max(left, right)),
                (Some(left), Some(right)) => Some(std::cmp::min(left, right)),
                (left, right) => left.or(right),
            };
            if plan.len() < DEPTH && self.execute(&plan).is_some() {
                open.extend(instances.iter().map(|one| [&plan[..], &[*one]].concat()));
            }
        }
        best
    }

    pub fn domain(&self) -> String {
        let mut text = String::from(
            "(define (domain d) (:types thing) (:constants o0 o1 - thing) (:predicates (p ?x - thing) (r) (s)) (:functions (n) (total-cost))\n",
        );
        for (action, number) in self.actions.iter().zip(0..) {
            let parameters = if action.has_parameter { "?x - thing" } else { "" };
            let list = |effects: &[Effect]| effects.iter().map(Effect::text).collect::<Vec<_>>();
            let condition = action.condition.text();
            if action.is_durative {
                let preference = action.preference.as_ref().map(|(at_end, wanted)| {
                    format!(
                        "(preference q3 (at {} {}))",
                        if *at_end { "end" } else { "start" },
                        wanted.text()
                    )
                });
                let timed = |time: &str, effects: &[Effect]| {
                    list(effects)
                        .iter()
                        .map(|effect| format!("(at {time} {effect})"))
                        .collect::<Vec<_>>()
                        .concat()
                };
                let _ = writeln!(
                    text,
                    "(:durative-action a{number} :parameters ({parameters}) :duration (= ?duration 2)
                      :condition (and (at start {condition}) {}) :effect (and {} {} (at end (increase (total-cost) {}))))",
                    preference.unwrap_or_default(),
                    timed("start", &action.start),
                    timed("end", &action.end),
                    action.cost
                );
                continue;
            }
            let preference =
                action.preference.as_ref().map(|(_, wanted)| format!("(preference q3 {})", wanted.text()));
            let _ = writeln!(
                text,
                "(:action a{number} :parameters ({parameters}) :precondition (and {condition} {}) :effect (and {} (increase (total-cost) {})))",
                preference.unwrap_or_default(),
                list(&action.end).concat(),
                action.cost
            );
        }
        text.push(')');
        text
    }

    pub fn problem(&self) -> String {
        let names = ["(p o0)", "(p o1)", "(r)", "(s)"];
        let facts: String =
            names.iter().zip(self.init.facts).filter(|(_, holds)| *holds).map(|(name, _)| *name).collect();
        let (mut goal, mut constraints) = (self.goal.text(), String::new());
        for constraint in &self.constraints {
            let in_goal = constraint.kind == "at end" && constraint.preference.is_some();
            let two = constraint.kind.starts_with("sometime-");
            let second = if two { constraint.second.text() } else { String::new() };
            let mut text = format!("({} {} {second})", constraint.kind, constraint.first.text());
            if in_goal {
                text = constraint.first.text();
            }
            if let Some(name) = constraint.preference {
                text = format!("(preference q{name} {text})");
            }
            if constraint.for_all {
                text = format!("(forall (?z - thing) {text})");
            }
            (if in_goal { &mut goal } else { &mut constraints }).push_str(&text);
        }
        let named = |name: usize| {
            let of_actions = name == 3 && self.actions.iter().any(|action| action.preference.is_some());
            of_actions || self.constraints.iter().any(|constraint| constraint.preference == Some(name))
        };
        let costs: Vec<String> = (0..4)
            .filter(|name| named(*name))
            .map(|name| format!(" (* {} (is-violated q{name}))", self.weights[name]))
            .collect();
        let costs = costs.concat();
        let metric = if self.maximize {
            format!("maximize (- 20 (+ (total-cost){costs}))")
        } else {
            format!("minimize (+ (total-cost){costs})")
        };
        format!(
            "(define (problem p) (:domain d) (:init {facts} (= (n) {}) (= (total-cost) 0))
             (:goal (and {goal})) (:constraints (and {constraints})) (:metric {metric}))",
            self.init.n
        )
    }
}
