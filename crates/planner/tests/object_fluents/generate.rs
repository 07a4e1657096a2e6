//! Generates random tasks with functions whose values are objects (object fluents).

use testing::random::Random;

use super::model::{Action, Change, Effect, Formula, OBJECTS, State, Task, Term};

pub(crate) struct Generator(pub(crate) Random);

impl Generator {
    pub(crate) fn below(&mut self, limit: u64) -> usize {
        self.0.below(limit).unsigned_abs() as usize
    }

    fn term(&mut self, bound: usize, depth: u64) -> Term {
        match self.below(if depth == 0 { 3 } else { 6 }) {
            0 => Term::Object(self.below(OBJECTS as u64)),
            1 | 2 if bound > 0 => Term::Variable(self.below(bound as u64)),
            1 | 2 => Term::Object(self.below(2)),
            _ => Term::Function(self.below(2), Box::new(self.term(bound, depth - 1))),
        }
    }

    fn formula(&mut self, bound: usize, depth: u64) -> Formula {
        let inner = |own: &mut Self, bound| Box::new(own.formula(bound, depth - 1));
        match if depth == 0 { self.below(5) } else { self.below(11) } {
            0 | 1 => match (self.term(bound, 2), self.term(bound, 1)) {
                // Such an equation can never hold and is an error, so it is replaced.
                (Term::Function(1, inner), Term::Object(2)) => Formula::Marked(Term::Function(1, inner)),
                (Term::Object(2), Term::Function(1, inner)) => Formula::Heavy(Term::Function(1, inner)),
                (left, right) => Formula::Equal(left, right),
            },
            2 => Formula::Undefined(Term::Function(self.below(2), Box::new(self.term(bound, 1)))),
            3 => Formula::Marked(self.term(bound, 1)),
            4 => Formula::Heavy(self.term(bound, 1)),
            5 => Formula::Not(inner(self, bound)),
            6 | 7 => Formula::And(inner(self, bound), inner(self, bound)),
            8 => Formula::Or(inner(self, bound), inner(self, bound)),
            9 => Formula::Exists(inner(self, bound + 1)),
            _ => Formula::ForAll(inner(self, bound + 1)),
        }
    }

    fn effect(&mut self, parameters: usize) -> Effect {
        let is_universal = self.below(4) == 0;
        let bound = parameters + usize::from(is_universal);
        let condition = (self.below(3) == 0).then(|| self.formula(bound, 1));
        let change = match self.below(8) {
            0 => Change::Mark(self.term(bound, 1), true),
            1 => Change::Mark(self.term(bound, 1), false),
            2 if !is_universal && condition.is_none() => Change::Pay(self.term(bound, 1)),
            number => {
                let function = number % 2;
                let value = match (self.below(6), function) {
                    (0, _) => None,
                    (_, 0) => Some(self.term(bound, 1)),
                    (1 | 2, _) => Some(Term::Function(1, Box::new(self.term(bound, 1)))),
                    _ => Some(Term::Object(self.below(2))),
                };
                Change::Assign(function, self.term(bound, 1), value)
            }
        };
        Effect { is_universal, condition, change }
    }

    fn effects(&mut self, parameters: usize) -> Vec<Effect> {
        (0..=self.below(3)).map(|_| self.effect(parameters)).collect()
    }

    pub(crate) fn task(&mut self) -> Task {
        let actions = (0..2 + self.below(2)).map(|_| {
            let parameters = self.below(3);
            let start = (self.below(5) == 0).then(|| self.effects(parameters));
            Action {
                parameters,
                condition: self.formula(parameters, 1),
                start,
                end: self.effects(parameters),
            }
        });
        let actions = actions.collect();
        let mut init = State { values: [[None; OBJECTS]; 2], marked: [false; OBJECTS] };
        for object in 0..OBJECTS {
            init.marked[object] = self.below(2) == 0;
            init.values[0][object] = (self.below(3) > 0).then(|| self.below(OBJECTS as u64));
            init.values[1][object] = (self.below(3) > 0).then(|| self.below(2));
        }
        let mut task = Task { actions, init, goal: Formula::Equal(Term::Object(0), Term::Object(0)) };
        task.goal = self.goal(&task);
        task
    }

    /// The formula holds after some random steps but not initially, if one is found soon.
    fn goal(&mut self, task: &Task) -> Formula {
        let (steps, mut end) = (task.steps(), task.init);
        for _ in 0..20 {
            let step = &steps[self.below(steps.len() as u64)];
            end = task.execute(&end, step).map_or(end, |(next, _)| next);
        }
        let goals: Vec<_> = (0..20).map(|_| self.formula(0, 2)).collect();
        let is_good = |goal: &&Formula| goal.holds(&end, &[]) && !goal.holds(&task.init, &[]);
        goals.iter().find(is_good).unwrap_or(&goals[0]).clone()
    }
}
