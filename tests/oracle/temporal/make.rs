//! Tiny random tasks that combine all temporal and logical features.
//!
//! Times of events are sums of durations, or slightly earlier or later, so that events coincide
//! with ends of actions. Undefined values occur only where the definition is clear: in comparisons
//! that are conjuncts, and in numeric effects.

use super::model::{
    Action, Atom, Axiom, Body, Comparison, Condition, Effect, Expression, Fluent, Measure, Operation, Part,
    Q, Task, Term, q,
};

/// Numbers of the functions: one that actions change, a static one, one that may be undefined, and the costs.
pub(super) const LEVEL: usize = 0;
pub(super) const LENGTH: usize = 1;
pub(super) const MAYBE: usize = 2;
pub(super) const COST: usize = 3;

/// Frequencies of the features of a task, in percent.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flavour {
    /// For concurrent plans, all durations and times of events are multiples of this unit. `None`
    /// for sequential plans.
    pub(super) unit: Option<Q>,
    pub(super) durative: u8,
    pub(super) conditional: u8,
    pub(super) numeric: u8,
    pub(super) events: u8,
    pub(super) negative: u8,
}

pub struct Maker {
    pub(super) random: fastrand::Rng,
    pub(super) flavour: Flavour,
    pub(super) task: Task,
    /// The predicate between designs and their functions, and the type of designs, in tasks with designs.
    pub(super) designs: Option<(usize, usize)>,
    /// Number of the parameter of the current action that is its design.
    slot: Option<usize>,
}

pub(super) fn constant(value: Q) -> Expression {
    Expression::Number(value)
}

pub(super) fn always_true() -> Condition {
    Condition::All(Vec::new())
}

impl Maker {
    pub fn make(seed: u64, unit: Option<Q>) -> Task {
        Self::build(seed, unit, false)
    }

    pub fn with_designs(seed: u64) -> Task {
        Self::build(seed, None, true)
    }

    /// Tries seeds derived from `seed` until a task is small enough.
    fn build(seed: u64, unit: Option<Q>, designs: bool) -> Task {
        let seeds = (0..u64::MAX).map(|attempt| seed ^ (attempt << 40));
        let mut small_tasks = seeds.filter_map(|seed| Self::small(seed, unit, designs));
        small_tasks.next().expect("a small task")
    }

    fn small(seed: u64, unit: Option<Q>, designs: bool) -> Option<Task> {
        let mut random = fastrand::Rng::with_seed(seed);
        let percent = |random: &mut fastrand::Rng, choices: &[u8]| choices[random.usize(..choices.len())];
        let flavour = Flavour {
            unit,
            durative: percent(&mut random, &[0, 50, 70, 100]),
            conditional: percent(&mut random, if unit.is_some() { &[0, 0, 0, 0, 5] } else { &[0, 15, 40] }),
            numeric: percent(&mut random, &[0, 25, 60]),
            events: percent(&mut random, &[0, 100, 100]),
            negative: percent(&mut random, &[0, 0, 30]),
        };
        let task = Task {
            types: 1 + random.usize(..2),
            objects: Vec::new(),
            predicates: Vec::new(),
            functions: Vec::new(),
            axioms: Vec::new(),
            actions: Vec::new(),
            atoms: Vec::new(),
            values: Vec::new(),
            events: Vec::new(),
            goal: always_true(),
            measure: Measure::Steps,
        };
        let mut maker = Self { random, flavour, task, designs: None, slot: None };
        maker.declare(designs);
        if !maker.task.is_small() {
            return None;
        }
        maker.fill();
        // This part has a separate random sequence, so that all other parts of the task do not depend on this
        // feature.
        maker.random = fastrand::Rng::with_seed(!seed);
        maker.durations_in_effects();
        Some(maker.task)
    }

    pub(super) fn chance(&mut self, percent: u8) -> bool {
        self.random.u8(..100) < percent
    }

    pub(super) fn pick<T: Clone>(&mut self, choices: &[T]) -> T {
        choices[self.random.usize(..choices.len())].clone()
    }

    fn declare(&mut self, designs: bool) {
        for kind in 0..self.task.types {
            let count = 1 + self.random.usize(..2);
            self.task.objects.extend(std::iter::repeat_n(kind, count));
        }
        for name in 0..3 + self.random.usize(..2) {
            let arity = self.pick(&[0, 0, 0, 0, 0, 1, 1, 1, 2]);
            self.task.predicates.push((format!("p{name}"), arity));
        }
        if designs {
            let kind = self.task.types - 1;
            self.task.objects.extend(std::iter::repeat_n(kind, 2));
            self.designs = Some((self.task.predicates.len(), kind));
            self.task.predicates.push(("fd_solve_f".to_owned(), 2));
        }
        for (name, arity) in [("level", 0), ("length", 1), ("maybe", 0), ("total-cost", 0)] {
            self.task.functions.push((name.to_owned(), arity));
        }
        self.axioms();
    }

    fn fill(&mut self) {
        let actions = 1 + self.random.usize(..4);
        for number in 0..actions {
            let action = self.action(number);
            self.task.actions.push(action);
        }
        self.initial();
        self.events();
        self.goal();
        self.add_costly_action();
        self.measure();
    }

    /// With a probability of 30 %, declares a derived predicate with a random condition. Sometimes
    /// also declares the transitive closure of a binary predicate.
    fn axioms(&mut self) {
        if !self.chance(30) {
            return;
        }
        let base = self.task.predicates.len();
        let binary = (0..base).find(|at| self.task.predicates[*at].1 == 2);
        if let Some(edge) = binary.filter(|_| self.random.bool()) {
            self.task.predicates.push(("reach".into(), 2));
            let atom = |predicate, left, right| {
                Condition::Atom(Atom { predicate, terms: vec![Term::Var(left), Term::Var(right)] })
            };
            let kind = self.random.usize(..self.task.types);
            let step = Condition::All(vec![atom(edge, 0, 2), atom(base, 2, 1)]);
            let condition = Condition::Any(vec![atom(edge, 0, 1), Condition::Exists(kind, Box::new(step))]);
            self.task.axioms.push(Axiom { predicate: base, condition });
        }
        let arity = self.random.usize(..2);
        let condition = self.condition(&vec![0; arity], 1);
        self.task.predicates.push(("derived".into(), arity));
        self.task.axioms.push(Axiom { predicate: self.task.predicates.len() - 1, condition });
    }

    pub(super) fn is_derived(&self, predicate: usize) -> bool {
        self.task.axioms.iter().any(|axiom| axiom.predicate == predicate)
    }

    pub(super) fn is_fixed(&self, predicate: usize) -> bool {
        self.is_derived(predicate) || self.designs.is_some_and(|(solves, _)| solves == predicate)
    }

    /// Generates an atom. `set` excludes predicates that effects and events must not change.
    fn atom(&mut self, variables: usize, set: bool) -> Atom {
        let mut predicate = self.random.usize(..self.task.predicates.len());
        while set && self.is_fixed(predicate) {
            predicate = self.random.usize(..self.task.predicates.len());
        }
        let terms = (0..self.task.predicates[predicate].1).map(|_| self.term(variables)).collect();
        Atom { predicate, terms }
    }

    fn term(&mut self, variables: usize) -> Term {
        if variables > 0 && self.chance(85) {
            let variable = self.random.usize(..variables);
            // If actions change a fact with a design parameter, the planner cannot treat the parameter as a
            // design slot. Such side effects are wanted, but rarely.
            if self.slot == Some(variable) && !self.chance(8) {
                return Term::Object(self.random.usize(..self.task.objects.len()));
            }
            Term::Var(variable)
        } else {
            Term::Object(self.random.usize(..self.task.objects.len()))
        }
    }

    fn fluent(&mut self, function: usize, variables: usize) -> Fluent {
        if let Some(slot) = self.slot.filter(|_| function == LENGTH)
            && self.chance(70)
        {
            return Fluent { function, terms: vec![Term::Var(slot)] };
        }
        let terms = (0..self.task.functions[function].1).map(|_| self.term(variables)).collect();
        Fluent { function, terms }
    }

    pub(super) fn comparison(&mut self, left: usize, variables: usize) -> Condition {
        let left = Expression::Fluent(self.fluent(left, variables));
        let left = match self.random.u8(..6) {
            0 => Expression::Sum(Box::new(left), Box::new(constant(q(1)))),
            1 => Expression::Product(Box::new(constant(q(2))), Box::new(left)),
            _ => left,
        };
        let right = if self.chance(20) {
            Expression::Fluent(self.fluent(LENGTH, variables))
        } else {
            constant(q(self.random.i64(-1..4)))
        };
        let signs = [
            Comparison::Less,
            Comparison::AtMost,
            Comparison::Equal,
            Comparison::AtLeast,
            Comparison::Greater,
        ];
        Condition::Compare(self.pick(&signs), left, right)
    }

    /// Returns a random condition with at most `depth` nested connectives. `variables` contains the types of
    /// the bound variables.
    pub(super) fn condition(&mut self, variables: &[usize], depth: usize) -> Condition {
        let count = variables.len();
        let choice = self.random.u8(..100);
        let nested = |maker: &mut Self| Box::new(maker.condition(variables, depth - 1));
        match choice {
            0..12 if self.chance(self.flavour.numeric) => self.comparison(LEVEL, count),
            12..17 if count > 1 => {
                let same = Condition::Same(Term::Var(0), Term::Var(self.random.usize(1..count)));
                if self.chance(75) { Condition::Not(Box::new(same)) } else { same }
            }
            17..27 if depth > 0 => Condition::Any(vec![*nested(self), *nested(self)]),
            27..30 if depth > 0 => Condition::Imply(nested(self), nested(self)),
            30..33 if depth > 0 => Condition::Not(nested(self)),
            33..42 if depth > 0 => {
                let kind = self.random.usize(..self.task.types);
                let part = Box::new(self.condition(&[variables, &[kind]].concat(), depth - 1));
                if self.random.bool() { Condition::Forall(kind, part) } else { Condition::Exists(kind, part) }
            }
            42..67 => Condition::Not(Box::new(Condition::Atom(self.atom(count, false)))),
            _ => Condition::Atom(self.atom(count, false)),
        }
    }

    pub(super) fn conjunction(&mut self, variables: &[usize], counts: &[usize]) -> Condition {
        let mut parts: Vec<_> = (0..self.pick(counts)).map(|_| self.condition(variables, 1)).collect();
        if self.chance(self.flavour.numeric / 12) {
            parts.push(self.comparison(MAYBE, variables.len()));
        }
        Condition::All(parts)
    }

    fn operand(&mut self, variables: usize, cost: bool) -> Expression {
        match self.random.u8(..10) {
            0 => Expression::Fluent(self.fluent(LENGTH, variables)),
            1 => {
                let length = Expression::Fluent(self.fluent(LENGTH, variables));
                Expression::Quotient(Box::new(length), Box::new(constant(q(2))))
            }
            2 if !cost => Expression::Fluent(self.fluent(LEVEL, 0)),
            3 if !cost && self.random.bool() => Expression::Fluent(self.fluent(MAYBE, 0)),
            _ if cost => {
                let min = if self.chance(self.flavour.negative) { -2 } else { 0 };
                constant(q(self.random.i64(min..5)))
            }
            _ => constant(self.pick(&[q(0), q(1), q(1), q(2), q(3), q(-1), Q::new(1, 2)])),
        }
    }

    fn change(&mut self, function: usize, variables: usize) -> Effect {
        let operations = [
            Operation::Increase,
            Operation::Increase,
            Operation::Decrease,
            Operation::Assign,
            Operation::Assign,
            Operation::ScaleUp,
            Operation::ScaleDown,
        ];
        let (operation, operand) = match self.pick(&operations) {
            _ if function == COST => (Operation::Increase, self.operand(variables, true)),
            scale @ (Operation::ScaleUp | Operation::ScaleDown) => {
                (scale, constant(self.pick(&[q(2), q(1), Q::new(1, 2)])))
            }
            operation => (operation, self.operand(variables, false)),
        };
        Effect::Change(operation, self.fluent(function, variables), operand)
    }

    fn effect(&mut self, variables: &[usize], depth: usize) -> Effect {
        let count = variables.len();
        if self.chance(self.flavour.numeric / 2) {
            let function = self.pick(&[LEVEL, LEVEL, LEVEL, MAYBE, COST, COST]);
            return self.change(function, count);
        }
        if depth > 0 && self.chance(self.flavour.conditional) {
            let condition = self.condition(variables, 1);
            let mut parts = vec![self.effect(variables, 0)];
            if self.chance(20) {
                parts.push(self.effect(variables, 0));
            }
            return Effect::When(condition, parts);
        }
        if depth > 0 && self.chance(10) {
            let kind = self.random.usize(..self.task.types);
            return Effect::Forall(kind, vec![self.effect(&[variables, &[kind]].concat(), depth - 1)]);
        }
        let atom = self.atom(count, true);
        if self.chance(40) { Effect::Delete(atom) } else { Effect::Add(atom) }
    }

    fn effects(&mut self, variables: &[usize], counts: &[usize]) -> Vec<Effect> {
        let mut effects: Vec<_> = (0..self.pick(counts)).map(|_| self.effect(variables, 2)).collect();
        // Two changes of one number, at least one of which is conditional, can conflict in some states only.
        if self.chance(self.flavour.conditional / 3) {
            let first = self.change(LEVEL, variables.len());
            let condition = self.condition(variables, 1);
            let second = Effect::When(condition, vec![self.change(LEVEL, variables.len())]);
            effects.push(if self.chance(30) {
                Effect::When(self.condition(variables, 0), vec![first])
            } else {
                first
            });
            effects.push(second);
        }
        effects
    }

    fn duration(&mut self, variables: usize) -> Expression {
        let length = Expression::Fluent(self.fluent(LENGTH, variables));
        let unit = self.flavour.unit.unwrap_or(q(1));
        match self.random.u8(..20) {
            0..4 => length,
            4 => Expression::Sum(Box::new(constant(unit)), Box::new(length)),
            5 => Expression::Product(Box::new(constant(q(2))), Box::new(length)),
            6 | 7 => constant(q(0)),
            8 if self.flavour.unit.is_none() => constant(self.pick(&[Q::new(1, 1000), q(1000)])),
            9 | 10 if self.flavour.unit.is_none() => constant(Q::new(self.random.i64(1..6), 2)),
            11 if self.flavour.unit.is_none() && self.chance(20) => Expression::Fluent(self.fluent(LEVEL, 0)),
            _ => constant(unit * q(self.random.i64(1..4))),
        }
    }

    fn action(&mut self, number: usize) -> Action {
        let mut parameters: Vec<usize> =
            (0..self.pick(&[0, 0, 1, 1, 2])).map(|_| self.random.usize(..self.task.types)).collect();
        if let Some((_, kind)) = self.designs
            && self.chance(70)
        {
            self.slot = Some(parameters.len());
            parameters.push(kind);
        }
        let variables = &parameters[..];
        let mut body = if self.chance(self.flavour.durative) {
            let start = Part {
                condition: self.conjunction(variables, &[0, 1, 1, 2]),
                effects: self.effects(variables, &[0, 1, 1, 2]),
            };
            let over_all = self.conjunction(variables, &[0, 0, 1]);
            let end = Part {
                condition: self.conjunction(variables, &[0, 0, 1]),
                effects: self.effects(variables, &[0, 1, 1, 2]),
            };
            Body::Durative { duration: self.duration(variables.len()), start, over_all, end }
        } else {
            let condition = self.conjunction(variables, &[0, 1, 1, 2]);
            Body::Instantaneous(Part { condition, effects: self.effects(variables, &[1, 1, 2, 3]) })
        };
        if let (Some((predicate, _)), Some(slot)) = (self.designs, self.slot.take()) {
            let (Body::Instantaneous(start) | Body::Durative { start, .. }) = &mut body;
            // The function of every design slot is the first object.
            let solves = Atom { predicate, terms: vec![Term::Var(slot), Term::Object(0)] };
            if let Condition::All(parts) = &mut start.condition {
                parts.push(Condition::Atom(solves));
            }
        }
        Action { name: format!("a{number}"), parameters, body }
    }

    fn durations_in_effects(&mut self) {
        for at in 0..self.task.actions.len() {
            let mut action = self.task.actions[at].clone();
            let Body::Durative { duration, start, end, .. } = &mut action.body else { continue };
            // A duration that actions can change is not repeated in effects.
            let is_dynamic = matches!(duration, Expression::Fluent(Fluent { function: LEVEL, .. }));
            if is_dynamic || !self.chance(self.flavour.numeric / 4) {
                continue;
            }
            let mut operand = Expression::Duration(Box::new(duration.clone()));
            if self.random.bool() {
                operand = Expression::Product(Box::new(constant(Q::new(1, 2))), Box::new(operand));
            }
            let function = self.pick(&[LEVEL, COST]);
            let effect = Effect::Change(Operation::Increase, Fluent { function, terms: Vec::new() }, operand);
            if self.random.bool() {
                start.effects.push(effect);
            } else {
                end.effects.push(effect);
            }
            self.task.actions[at] = action;
        }
    }
}
