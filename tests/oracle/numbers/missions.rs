//! Random missions: a robot moves between places and works there, with one to three functions and
//! designs for each function.
//!
//! The random parts are the differences between designs, the effects of actions on designs, the
//! consumption and charging of the battery, and the metric.

use fastrand::Rng;

use super::draw::{Style, number, once_in, one_of, palette};
use super::model::{
    Action, Condition, Effect, Expr, Happening, Lasting, Number, Relation, Task, Term, applied, whole,
};
use super::tune::{Wishes, tune};

pub const PLACE: usize = 0;
pub const FUNCTION: usize = 1;
pub const DESIGN: usize = 2;

#[derive(Debug, Clone, Copy)]
pub struct Names {
    pub at: usize,
    pub way: usize,
    pub solves: usize,
    pub available: usize,
    pub done: usize,
    pub current: usize,
    pub marked: usize,
    pub usage: usize,
    pub quality: usize,
    pub trust: usize,
    pub speed: usize,
    pub distance: usize,
    pub range: usize,
    pub worn: usize,
    pub battery: usize,
    pub energy: usize,
    pub cost: usize,
}

#[allow(clippy::struct_excessive_bools)]
pub struct Builder<'r> {
    pub task: Task,
    pub names: Names,
    pub rng: &'r mut Rng,
    pub styles: Vec<Style>,
    pub places: Vec<usize>,
    pub functions: Vec<usize>,
    pub designs: Vec<usize>,
    pub timed: bool,
    /// Number of comparisons with an open threshold.
    pub open: usize,
    pub side_effects: bool,
    pub memory: bool,
    pub fluent_availability: bool,
}

/// Returns a random mission. One in 150 missions has 300 to 1,499 designs of the first function.
pub fn mission(rng: &mut Rng) -> Task {
    let designs = if once_in(rng, 150) { rng.usize(300..1500) } else { rng.usize(1..7) };
    mission_with(rng, designs)
}

/// Generates a mission. `designs` is the number of designs of the first function.
pub fn mission_with(rng: &mut Rng, designs: usize) -> Task {
    let mut builder = Builder::new(rng, designs);
    builder.values();
    let kinds = builder.rng.usize(1..4);
    for kind in 0..kinds.min(if designs > 50 { 1 } else { 3 }) {
        let name = format!("move{kind}");
        let action = builder.travel(name);
        builder.task.actions.push(action);
    }
    if once_in(builder.rng, 2) {
        let action = builder.work();
        builder.task.actions.push(action);
    }
    if designs < 50 && once_in(builder.rng, 2) {
        let action = builder.recharge();
        builder.task.actions.push(action);
    }
    if designs < 50 && builder.fluent_availability {
        let action = builder.repair();
        builder.task.actions.push(action);
    }
    builder.task.metric = builder.metric();
    builder.finish()
}

fn names(task: &mut Task) -> Names {
    Names {
        at: task.predicate("at", &[PLACE]),
        way: task.predicate("way", &[PLACE, PLACE]),
        solves: task.predicate("fd_solve_f", &[DESIGN, FUNCTION]),
        available: task.predicate("fd_available", &[DESIGN]),
        done: task.predicate("done", &[PLACE]),
        current: task.predicate("current", &[FUNCTION, DESIGN]),
        marked: task.predicate("marked", &[DESIGN]),
        usage: task.function("usage", &[DESIGN]),
        quality: task.function("quality", &[DESIGN]),
        trust: task.function("trust", &[DESIGN]),
        speed: task.function("speed", &[DESIGN]),
        distance: task.function("distance", &[PLACE, PLACE]),
        range: task.function("range", &[DESIGN]),
        worn: task.function("worn", &[FUNCTION]),
        battery: task.function("battery", &[]),
        energy: task.function("energy", &[]),
        cost: task.function("total-cost", &[]),
    }
}

impl<'r> Builder<'r> {
    fn new(rng: &'r mut Rng, designs: usize) -> Self {
        let mut task = Task {
            types: ["place", "function", "functiondesign"].map(str::to_owned).to_vec(),
            ..Task::default()
        };
        let names = names(&mut task);
        let places = (0..rng.usize(2..4)).map(|i| task.object(format!("p{i}"), PLACE)).collect();
        let functions = if designs > 50 { 1 } else { rng.usize(1..4) };
        let functions: Vec<usize> = (0..functions).map(|i| task.object(format!("f{i}"), FUNCTION)).collect();
        let mut all_designs = Vec::new();
        for (position, function) in functions.iter().enumerate() {
            let count = if position == 0 { designs } else { rng.usize(1..4) };
            for i in 0..count {
                let design = task.object(format!("fd{position}_{i}"), DESIGN);
                task.atoms.push((names.solves, vec![design, *function]));
                // In rare cases, a design solves two functions.
                if designs < 50 && once_in(rng, 12) {
                    let second_function = one_of(rng, &functions);
                    if second_function != *function {
                        task.atoms.push((names.solves, vec![design, second_function]));
                    }
                }
                all_designs.push(design);
            }
        }
        let small = designs < 50;
        Self {
            task,
            names,
            styles: palette(rng),
            places,
            functions,
            designs: all_designs,
            timed: rng.bool(),
            open: 0,
            side_effects: small && once_in(rng, 4),
            memory: small && once_in(rng, 5),
            fluent_availability: small && once_in(rng, 4),
            rng,
        }
    }

    pub fn draw(&mut self) -> Number {
        number(self.rng, &self.styles)
    }

    pub fn draw_positive(&mut self) -> Number {
        let value = self.draw();
        if value > whole(0) { value } else { whole(1) - value }
    }

    fn values(&mut self) {
        let names = self.names;
        for from in self.places.clone() {
            for to in self.places.clone() {
                if from != to && !once_in(self.rng, 5) {
                    self.task.atoms.push((names.way, vec![from, to]));
                    let value = self.draw_positive();
                    self.task.values.push((names.distance, vec![from, to], value));
                }
            }
        }
        self.task.atoms.push((names.at, vec![self.places[0]]));
        let sparse = once_in(self.rng, 4);
        // Some designs get the numbers of the previous design, so that they are interchangeable.
        let equal = once_in(self.rng, 4);
        let mut previous: Option<[Number; 5]> = None;
        for design in self.designs.clone() {
            if !once_in(self.rng, 6) {
                self.task.atoms.push((names.available, vec![design]));
            }
            let fresh = [self.draw(), self.draw(), self.draw(), self.draw_positive(), self.draw()];
            let is_repeated = equal && self.rng.bool();
            let values = previous.filter(|_| is_repeated).unwrap_or(fresh);
            let functions = [names.usage, names.quality, names.trust, names.speed, names.range];
            for (function, value) in functions.into_iter().zip(values.clone()) {
                if function != names.range || !sparse || self.rng.bool() {
                    self.task.values.push((function, vec![design], value));
                }
            }
            previous = Some(values);
        }
        for function in self.functions.clone() {
            let design = one_of(self.rng, &self.designs);
            self.task.atoms.push((names.current, vec![function, design]));
            self.task.values.push((names.worn, vec![function], whole(0)));
        }
        let battery = self.draw_positive() * whole(self.rng.i64(1..5)) + self.draw();
        self.task.values.push((names.battery, Vec::new(), battery));
        let energy = if self.rng.bool() { whole(0) } else { self.draw() };
        self.task.values.push((names.energy, Vec::new(), energy));
        if self.rng.bool() {
            self.task.values.push((names.cost, Vec::new(), whole(0)));
        }
    }

    /// Adds one to `max_slots` design slots. Returns the function and the design of each slot.
    pub fn slots(&mut self, action: &mut Action, max_slots: usize) -> Vec<(Term, Term)> {
        let count = self.rng.usize(1..=max_slots.min(self.functions.len()));
        // In rare cases, all slots with a constant function have the same function.
        let twice = once_in(self.rng, 10);
        let mut slots = Vec::new();
        for position in 0..count {
            let constant = self.rng.bool();
            let function = if constant {
                Term::Object(self.functions[if twice { 0 } else { position }])
            } else {
                action.parameters.push((format!("f{position}"), FUNCTION));
                Term::Parameter(action.parameters.len() - 1)
            };
            action.parameters.push((format!("fd{position}"), DESIGN));
            let design = Term::Parameter(action.parameters.len() - 1);
            let solves = Condition::Holds(applied(self.names.solves, &[design, function]));
            let available = Condition::Holds(applied(self.names.available, &[design]));
            action.start.conditions.push(solves);
            match &mut action.lasting {
                Some(lasting) if self.rng.bool() => lasting.over_all.push(available),
                _ => action.start.conditions.push(available),
            }
            slots.push((function, design));
        }
        if slots.len() > 1 && once_in(self.rng, 3) {
            let same = Condition::Same(slots[0].1, slots[1].1);
            action.start.conditions.push(Condition::Not(Box::new(same)));
        }
        slots
    }

    pub fn empty(&mut self, name: String) -> Action {
        let lasting = self.timed.then(|| Lasting {
            duration: Expr::Number(whole(1)),
            over_all: Vec::new(),
            end: Happening::default(),
        });
        Action { name, parameters: Vec::new(), start: Happening::default(), lasting }
    }

    pub fn static_expression(&mut self, slots: &[(Term, Term)], way: Option<[Term; 2]>) -> Expr {
        let names = self.names;
        let estimation =
            |function: usize, rng: &mut Rng| Expr::Function(applied(function, &[one_of(rng, slots).1]));
        let numbers = [names.usage, names.quality, names.trust];
        let first = estimation(one_of(self.rng, &numbers), self.rng);
        let second = estimation(one_of(self.rng, &numbers), self.rng);
        let quotient = estimation(names.speed, self.rng);
        let constant = Expr::Number(number(self.rng, &self.styles));
        let distance = way.map_or(constant.clone(), |way| Expr::Function(applied(names.distance, &way)));
        match self.rng.u32(0..10) {
            0 | 1 => first,
            2 => Expr::Product(vec![distance, first]),
            3 => Expr::Product(vec![first, second]),
            4 => Expr::Product(vec![first, second, distance]),
            5 => Expr::Quotient(Box::new(distance), Box::new(quotient)),
            6 => Expr::Sum(vec![first, second, constant]),
            7 => Expr::Minus(Box::new(first), Box::new(second)),
            8 => Expr::Quotient(Box::new(first), Box::new(Expr::Number(whole(self.rng.i64(2..8))))),
            _ => Expr::Sum(vec![Expr::Product(vec![first, distance]), constant]),
        }
    }

    /// Returns a random amount: usually a sum over all slots, so that each design matters.
    pub fn consumption(&mut self, slots: &[(Term, Term)], way: Option<[Term; 2]>) -> Expr {
        let usage = |slot: &(Term, Term)| Expr::Function(applied(self.names.usage, &[slot.1]));
        let mut usages: Vec<Expr> = slots.iter().map(usage).collect();
        let total = if usages.len() == 1 { usages.remove(0) } else { Expr::Sum(usages) };
        match (self.rng.u32(0..4), way) {
            (0, _) | (_, None) => total,
            (1, _) => self.static_expression(slots, way),
            (_, Some(way)) => Expr::Product(vec![Expr::Function(applied(self.names.distance, &way)), total]),
        }
    }

    pub fn open(&mut self, relation: Relation, expression: Expr) -> Condition {
        self.open += 1;
        Condition::Open(relation, expression, self.open - 1)
    }

    pub fn number(function: usize) -> Expr {
        Expr::Function(applied(function, &[]))
    }

    fn travel(&mut self, name: String) -> Action {
        let mut action = self.empty(name);
        let names = self.names;
        let places_first = self.rng.bool();
        let place = |action: &mut Action| {
            action.parameters.push(("from".to_owned(), PLACE));
            action.parameters.push(("to".to_owned(), PLACE));
        };
        // The order of places and designs among the parameters varies.
        if places_first {
            place(&mut action);
        }
        let slots = self.slots(&mut action, 3);
        if !places_first {
            place(&mut action);
        }
        let to = if places_first { 1 } else { action.parameters.len() - 1 };
        let way = [Term::Parameter(to - 1), Term::Parameter(to)];
        action.start.conditions.push(Condition::Holds(applied(names.at, &way[..1])));
        action.start.conditions.push(Condition::Holds(applied(names.way, &way)));
        if let Some(lasting) = &mut action.lasting {
            lasting.duration = self.duration(&slots, way);
        }
        self.demand(&mut action, &slots, Some(way));
        action.start.effects.push(Effect::Delete(applied(names.at, &way[..1])));
        let arrive = Effect::Add(applied(names.at, &way[1..]));
        Self::finally(&mut action).push(arrive);
        self.use_up(&mut action, &slots, Some(way));
        self.touch(&mut action, &slots, &way);
        action
    }

    fn duration(&mut self, slots: &[(Term, Term)], way: [Term; 2]) -> Expr {
        let distance = Expr::Function(applied(self.names.distance, &way));
        let speed = Expr::Function(applied(self.names.speed, &[slots[0].1]));
        match self.rng.u32(0..4) {
            0 => Expr::Number(whole(self.rng.i64(1..4))),
            1 => distance,
            2 => Expr::Quotient(Box::new(distance), Box::new(speed)),
            _ => Expr::Product(vec![distance, speed]),
        }
    }

    pub fn finally(action: &mut Action) -> &mut Vec<Effect> {
        match &mut action.lasting {
            Some(lasting) => &mut lasting.end.effects,
            None => &mut action.start.effects,
        }
    }

    fn finish(self) -> Task {
        let Self { mut task, names, rng, places, .. } = self;
        let mut atoms = vec![(names.at, vec![places[places.len() - 1]])];
        atoms.push((names.at, vec![one_of(rng, &places)]));
        atoms.extend(places.iter().map(|place| (names.done, vec![*place])));
        let wishes = Wishes { atoms, numbers: vec![Self::number(names.battery), Self::number(names.energy)] };
        tune(&mut task, &wishes, rng);
        task
    }
}
