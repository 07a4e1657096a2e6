//! Random arithmetic tasks without a robot: a few numbers and flags, all kinds of numeric effects, and
//! metrics of every sign.

use fastrand::Rng;

use super::draw::{Style, number, once_in, one_of, palette};
use super::model::{
    Action, Change, Condition, Effect, Expr, Happening, Lasting, Relation, Task, Term, applied, whole,
};
use super::tune::{Wishes, tune};

struct Builder<'r> {
    task: Task,
    rng: &'r mut Rng,
    styles: Vec<Style>,
    fluents: Vec<usize>,
    constants: Vec<usize>,
    /// Two functions with a thing as their argument: a static one, and one that actions change.
    of_thing: [usize; 2],
    /// Fluent for metrics. Unless the task is `wild`, actions change it only by static amounts, as the
    /// planner requires.
    counted: usize,
    wild: bool,
    flags: Vec<usize>,
    things: Vec<usize>,
    cost: usize,
    open: usize,
}

pub fn arithmetic(rng: &mut Rng) -> Task {
    let mut builder = Builder::new(rng);
    builder.values();
    let timed = once_in(builder.rng, 3);
    for position in 0..builder.rng.usize(1..5) {
        let action = builder.action(format!("a{position}"), timed);
        builder.task.actions.push(action);
    }
    builder.task.metric = builder.metric(timed);
    let Builder { mut task, rng, fluents, flags, .. } = builder;
    let wishes = Wishes {
        atoms: flags.iter().map(|flag| (*flag, Vec::new())).collect(),
        numbers: fluents.iter().map(|fluent| Expr::Function(applied(*fluent, &[]))).collect(),
    };
    tune(&mut task, &wishes, rng);
    task
}

impl<'r> Builder<'r> {
    fn new(rng: &'r mut Rng) -> Self {
        let mut task = Task { types: vec!["thing".to_owned()], ..Task::default() };
        let flags = (0..rng.usize(1..4)).map(|i| task.predicate(&format!("q{i}"), &[])).collect();
        let fluents: Vec<usize> =
            (0..rng.usize(1..4)).map(|i| task.function(&format!("x{i}"), &[])).collect();
        let constants = (0..3).map(|i| task.function(&format!("c{i}"), &[])).collect();
        let of_thing = [task.function("size", &[0]), task.function("level", &[0])];
        let things = (0..rng.usize(1..4)).map(|i| task.object(format!("t{i}"), 0)).collect();
        let cost = task.function("total-cost", &[]);
        let styles = palette(rng);
        let (counted, wild) = (fluents[0], once_in(rng, 10));
        Self { task, rng, styles, fluents, counted, wild, constants, of_thing, flags, things, cost, open: 0 }
    }

    fn draw(&mut self) -> Expr {
        Expr::Number(number(self.rng, &self.styles))
    }

    fn values(&mut self) {
        for function in [self.fluents.clone(), self.constants.clone()].concat() {
            let value = number(self.rng, &self.styles);
            self.task.values.push((function, Vec::new(), value));
        }
        for thing in self.things.clone() {
            for function in self.of_thing {
                let value = number(self.rng, &self.styles);
                self.task.values.push((function, vec![thing], value));
            }
        }
        for flag in self.flags.clone() {
            if once_in(self.rng, 4) {
                self.task.atoms.push((flag, Vec::new()));
            }
        }
    }

    fn constant(&mut self) -> Expr {
        Expr::Function(applied(one_of(self.rng, &self.constants), &[]))
    }

    fn fluent(&mut self) -> Expr {
        Expr::Function(applied(one_of(self.rng, &self.fluents), &[]))
    }

    fn static_expression(&mut self, thing: Option<Term>) -> Expr {
        match (self.rng.u32(0..8), thing) {
            (0 | 1, Some(thing)) => Expr::Function(applied(self.of_thing[0], &[thing])),
            (0 | 1, None) => self.constant(),
            (2, _) => Expr::Product(vec![self.constant(), self.constant()]),
            (3, _) => Expr::Product(vec![self.constant(), self.constant(), self.constant()]),
            (4, _) => {
                let divisor = whole(self.rng.i64(1..8));
                Expr::Quotient(Box::new(self.constant()), Box::new(Expr::Number(divisor)))
            }
            (5, _) => Expr::Minus(Box::new(self.constant()), Box::new(self.draw())),
            _ => self.draw(),
        }
    }

    fn linear(&mut self, thing: Option<Term>) -> Expr {
        match self.rng.u32(0..8) {
            0 | 1 => self.fluent(),
            2 => Expr::Sum(vec![self.fluent(), self.fluent()]),
            3 => Expr::Minus(Box::new(self.fluent()), Box::new(self.fluent())),
            4 => Expr::Product(vec![self.static_expression(thing), self.fluent()]),
            5 => {
                let divisor = whole(self.rng.i64(1..8));
                Expr::Quotient(Box::new(self.fluent()), Box::new(Expr::Number(divisor)))
            }
            6 => Expr::Negative(Box::new(self.fluent())),
            _ => match thing {
                Some(thing) => Expr::Sum(vec![
                    Expr::Function(applied(self.of_thing[1], &[thing])),
                    self.static_expression(Some(thing)),
                ]),
                None => Expr::Sum(vec![
                    Expr::Product(vec![self.draw(), self.fluent()]),
                    Expr::Product(vec![self.draw(), self.fluent()]),
                ]),
            },
        }
    }

    fn flag(&mut self) -> Condition {
        let flag = Condition::Holds(applied(one_of(self.rng, &self.flags), &[]));
        if once_in(self.rng, 3) { Condition::Not(Box::new(flag)) } else { flag }
    }

    fn change(&mut self, thing: Option<Term>) -> Effect {
        let target = match thing {
            Some(thing) if once_in(self.rng, 3) => applied(self.of_thing[1], &[thing]),
            _ => applied(one_of(self.rng, &self.fluents), &[]),
        };
        let kinds = if target.symbol == self.counted && !self.wild { 6 } else { 10 };
        match self.rng.u32(0..kinds) {
            0..=2 => Effect::Number(Change::Increase, target, self.static_expression(thing)),
            3..=5 => Effect::Number(Change::Decrease, target, self.static_expression(thing)),
            6 => Effect::Number(Change::Assign, target, self.static_expression(thing)),
            7 => Effect::Number(Change::Assign, target, self.linear(thing)),
            8 => {
                let change = one_of(self.rng, &[Change::Increase, Change::Decrease]);
                Effect::Number(change, target, self.linear(thing))
            }
            _ => {
                let factor = match self.rng.u32(0..4) {
                    0 => whole(2),
                    1 => whole(1) / whole(2),
                    2 => whole(-1),
                    _ => number(self.rng, &self.styles),
                };
                let change = one_of(self.rng, &[Change::ScaleUp, Change::ScaleDown]);
                Effect::Number(change, target, Expr::Number(factor))
            }
        }
    }

    fn happening(&mut self, thing: Option<Term>, open: bool) -> Happening {
        let mut happening = Happening::default();
        if self.rng.bool() {
            let flag = self.flag();
            happening.conditions.push(flag);
        }
        if once_in(self.rng, 6) {
            let disjuncts = vec![self.flag(), self.flag()];
            happening.conditions.push(Condition::Any(disjuncts));
        }
        if open && !once_in(self.rng, 3) {
            let expression =
                if once_in(self.rng, 4) { self.static_expression(thing) } else { self.linear(thing) };
            happening.conditions.push(Condition::Open(Relation::AtLeast, expression, self.open));
            self.open += 1;
        }
        for _ in 0..self.rng.usize(0..3) {
            let effect = self.change(thing);
            let target = |effect: &Effect| match effect {
                Effect::Number(_, target, _) => Some(target.clone()),
                _ => None,
            };
            // Two effects on the same number may contradict each other. Such contradictions are wanted, but
            // rarely.
            if happening.effects.iter().all(|earlier| target(earlier) != target(&effect))
                || once_in(self.rng, 6)
            {
                happening.effects.push(effect);
            }
        }
        let flag = applied(one_of(self.rng, &self.flags), &[]);
        match self.rng.u32(0..4) {
            0 | 1 => happening.effects.push(Effect::Add(flag)),
            2 => happening.effects.push(Effect::Delete(flag)),
            _ => {}
        }
        if once_in(self.rng, 3) {
            let condition = if self.rng.bool() {
                self.flag()
            } else {
                let expression = self.linear(thing);
                let relation = super::draw::relation(self.rng);
                let bound = self.draw();
                Condition::Compare(relation, expression, bound)
            };
            let effect = self.change(thing);
            happening.effects.push(Effect::When(vec![condition], vec![effect]));
        }
        happening
    }

    fn action(&mut self, name: String, timed: bool) -> Action {
        let thing = once_in(self.rng, 3);
        let parameters = if thing { vec![("t".to_owned(), 0)] } else { Vec::new() };
        let thing = thing.then_some(Term::Parameter(0));
        let mut start = self.happening(thing, true);
        let mut lasting = timed.then(|| {
            let duration = match self.rng.u32(0..6) {
                0 => Expr::Number(whole(0)),
                1 => self.static_expression(thing),
                _ => Expr::Number(whole(self.rng.i64(1..4))),
            };
            let over_all = if once_in(self.rng, 4) { vec![self.flag()] } else { Vec::new() };
            Lasting { duration, over_all, end: self.happening(thing, false) }
        });
        let cost = Effect::Number(Change::Increase, applied(self.cost, &[]), self.static_expression(thing));
        match &mut lasting {
            Some(lasting) => lasting.end.effects.push(cost),
            None => start.effects.push(cost),
        }
        if self.wild && self.rng.bool() {
            // Tasks with `wild` may have costs that depend on the state.
            let cost = Effect::Number(Change::Increase, applied(self.cost, &[]), self.linear(thing));
            start.effects.push(cost);
        }
        Action { name, parameters, start, lasting }
    }

    fn metric(&mut self, timed: bool) -> Option<(bool, Expr)> {
        let cost = Expr::Function(applied(self.cost, &[]));
        let counted = Expr::Function(applied(self.counted, &[]));
        let maximize = once_in(self.rng, 6);
        let metric = match self.rng.u32(0..8) {
            // The default metric depends on whether any duration is positive, so timed tasks always have a metric.
            0 if !timed => return None,
            0..=3 => cost,
            4 => self.fluent(),
            5 => Expr::Sum(vec![
                Expr::Product(vec![self.draw(), cost]),
                Expr::Product(vec![self.draw(), self.fluent()]),
            ]),
            6 if timed => Expr::Sum(vec![Expr::Product(vec![self.draw(), Expr::TotalTime]), cost]),
            _ => Expr::Minus(Box::new(cost), Box::new(counted)),
        };
        Some((maximize, metric))
    }
}
