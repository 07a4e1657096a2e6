//! Generates random tasks with preferences and trajectory constraints.

use testing::random::Random;

use super::model::{Action, Atom, Constraint, Effect, Formula, State, Task, Term};

pub struct Generator(pub Random);

impl Generator {
    pub fn below(&mut self, limit: u64) -> u64 {
        self.0.below(limit).unsigned_abs()
    }

    fn chance(&mut self, one_in: u64) -> bool {
        self.below(one_in) == 0
    }

    fn atom(&mut self, terms: &[Term]) -> Atom {
        let objects = [Term::Object(0), Term::Object(1)];
        match self.below(5) {
            0 | 1 if !terms.is_empty() => Atom::P(terms[self.below(terms.len() as u64) as usize]),
            0..=2 => Atom::P(objects[self.below(2) as usize]),
            3 => Atom::R,
            _ => Atom::S,
        }
    }

    fn formula(&mut self, depth: u64, terms: &[Term]) -> Formula {
        let boxed = |formula| Box::new(formula);
        let inner: Vec<Term> =
            terms.iter().copied().filter(|term| !matches!(term, Term::Z)).chain([Term::Z]).collect();
        match if depth == 0 { 0 } else { self.below(8) } {
            3 => Formula::And(boxed(self.formula(depth - 1, terms)), boxed(self.formula(depth - 1, terms))),
            4 => Formula::Or(boxed(self.formula(depth - 1, terms)), boxed(self.formula(depth - 1, terms))),
            5 => Formula::Not(boxed(self.formula(depth - 1, terms))),
            6 => Formula::All(boxed(self.formula(depth - 1, &inner))),
            7 => Formula::Some(boxed(self.formula(depth - 1, &inner))),
            _ if self.chance(6) => Formula::AtLeast(1 + self.0.below(2)),
            _ if self.chance(3) => Formula::Not(boxed(Formula::Atom(self.atom(terms)))),
            _ => Formula::Atom(self.atom(terms)),
        }
    }

    fn effects(&mut self, terms: &[Term], most: u64) -> Vec<Effect> {
        let mut effects: Vec<Effect> = (0..self.below(most + 1))
            .map(|_| {
                let condition = if self.chance(4) { Some(self.formula(1, terms)) } else { None };
                let holds = !self.chance(3);
                if self.chance(6) {
                    Effect::SetAll(condition, holds)
                } else {
                    Effect::Set(condition, self.atom(terms), holds)
                }
            })
            .collect();
        match self.below(8) {
            0 => effects.push(Effect::Up),
            1 => effects.push(Effect::Assign(self.0.below(3))),
            _ => {}
        }
        effects
    }

    fn action(&mut self) -> Action {
        let (has_parameter, is_durative) = (self.chance(2), self.chance(4));
        let terms = if has_parameter { &[Term::X][..] } else { &[] };
        let limit = Formula::Not(Box::new(Formula::AtLeast(3)));
        let condition = Formula::And(Box::new(limit), Box::new(self.formula(1, terms)));
        let preference = self.chance(3).then(|| (is_durative && self.chance(2), self.formula(1, terms)));
        let start = if is_durative { self.effects(terms, 2) } else { Vec::new() };
        let (end, cost) = (self.effects(terms, 3), 1 + self.0.below(3));
        Action { has_parameter, is_durative, condition, preference, start, end, cost }
    }

    pub fn task(&mut self) -> Task {
        let kinds = ["at end", "always", "sometime", "at-most-once", "sometime-after", "sometime-before"];
        let actions = (0..3).map(|_| self.action()).collect();
        let constraints = (0..=self.below(4)).map(|_| {
            let for_all = self.chance(3);
            let terms = if for_all { &[Term::Z][..] } else { &[] };
            Constraint {
                kind: kinds[self.below(6) as usize],
                first: self.formula(2, terms),
                second: self.formula(1, terms),
                for_all,
                preference: if self.chance(4) { None } else { Some(self.below(3) as usize) },
            }
        });
        Task {
            constraints: constraints.collect(),
            actions,
            init: State { facts: [(); 4].map(|()| self.chance(2)), n: self.0.below(2) },
            goal: self.formula(1, &[]),
            weights: [self.0.below(6) - 1, self.0.below(8), self.0.below(9), self.0.below(5)],
            maximize: self.chance(3),
        }
    }
}
