//! Missions: a robot moves between places and does things there, with one to three functions and designs for each.
//!
//! Random in what the designs differ by, what actions do to them, what a battery loses and how it is filled, and what counts.

use fastrand::Rng;

use super::draw::{Style, number, once_in, one, palette};
use super::model::{
    Action, Change, Condition, Effect, Expr, Happening, Lasting, Number, Relation, Task, Term, applied, whole,
};
use super::tune::{Wishes, tune};

/// The types.
const PLACE: usize = 0;
const FUNCTION: usize = 1;
const DESIGN: usize = 2;

/// Which predicates and functions there are.
#[derive(Debug, Clone, Copy)]
pub struct Names {
    pub at: usize,
    way: usize,
    solves: usize,
    available: usize,
    done: usize,
    current: usize,
    marked: usize,
    usage: usize,
    quality: usize,
    trust: usize,
    speed: usize,
    distance: usize,
    range: usize,
    worn: usize,
    battery: usize,
    energy: usize,
    cost: usize,
}

/// A mission under construction.
pub struct Builder<'r> {
    pub task: Task,
    pub names: Names,
    pub rng: &'r mut Rng,
    styles: Vec<Style>,
    places: Vec<usize>,
    functions: Vec<usize>,
    designs: Vec<usize>,
    timed: bool,
    /// Open comparisons so far.
    open: usize,
    /// Whether designs are mentioned by what changes.
    side_effects: bool,
    memory: bool,
    fluent_availability: bool,
}

/// A mission from a seed.
pub fn mission(rng: &mut Rng) -> Task {
    let designs = if once_in(rng, 150) { rng.usize(300..1500) } else { rng.usize(1..7) };
    mission_with(rng, designs)
}

/// A mission with so many designs of the first function.
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
        let mut all = Vec::new();
        for (position, function) in functions.iter().enumerate() {
            let count = if position == 0 { designs } else { rng.usize(1..4) };
            for i in 0..count {
                let design = task.object(format!("fd{position}_{i}"), DESIGN);
                task.atoms.push((names.solves, vec![design, *function]));
                // Some designs solve two functions.
                if designs < 50 && once_in(rng, 12) {
                    let other = one(rng, &functions);
                    if other != *function {
                        task.atoms.push((names.solves, vec![design, other]));
                    }
                }
                all.push(design);
            }
        }
        let small = designs < 50;
        Self {
            task,
            names,
            styles: palette(rng),
            places,
            functions,
            designs: all,
            timed: rng.bool(),
            open: 0,
            side_effects: small && once_in(rng, 4),
            memory: small && once_in(rng, 5),
            fluent_availability: small && once_in(rng, 4),
            rng,
        }
    }

    fn draw(&mut self) -> Number {
        number(self.rng, &self.styles)
    }

    fn draw_positive(&mut self) -> Number {
        let drawn = self.draw();
        if drawn > whole(0) { drawn } else { whole(1) - drawn }
    }

    /// The initial state.
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
        // Designs that are equal in all numbers.
        let equal = once_in(self.rng, 4);
        let mut previous: Option<[Number; 5]> = None;
        for design in self.designs.clone() {
            if !once_in(self.rng, 6) {
                self.task.atoms.push((names.available, vec![design]));
            }
            let fresh = [self.draw(), self.draw(), self.draw(), self.draw_positive(), self.draw()];
            let again = equal && self.rng.bool();
            let values = previous.filter(|_| again).unwrap_or(fresh);
            let functions = [names.usage, names.quality, names.trust, names.speed, names.range];
            for (function, value) in functions.into_iter().zip(values.clone()) {
                if function != names.range || !sparse || self.rng.bool() {
                    self.task.values.push((function, vec![design], value));
                }
            }
            previous = Some(values);
        }
        for function in self.functions.clone() {
            let design = one(self.rng, &self.designs);
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

    fn slots(&mut self, action: &mut Action, most: usize) -> Vec<(Term, Term)> {
        let count = self.rng.usize(1..=most.min(self.functions.len()));
        // The same function twice is rare.
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

    fn empty(&mut self, name: String) -> Action {
        let lasting = self.timed.then(|| Lasting {
            duration: Expr::Number(whole(1)),
            over_all: Vec::new(),
            end: Happening::default(),
        });
        Action { name, parameters: Vec::new(), start: Happening::default(), lasting }
    }

    /// An expression over the designs and the way: static.
    fn static_expression(&mut self, slots: &[(Term, Term)], way: Option<[Term; 2]>) -> Expr {
        let names = self.names;
        let of = |function: usize, rng: &mut Rng| Expr::Function(applied(function, &[one(rng, slots).1]));
        let numbers = [names.usage, names.quality, names.trust];
        let first = of(one(self.rng, &numbers), self.rng);
        let second = of(one(self.rng, &numbers), self.rng);
        let quotient = of(names.speed, self.rng);
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

    /// A sum over all slots, so that each design counts: what an action uses.
    fn consumption(&mut self, slots: &[(Term, Term)], way: Option<[Term; 2]>) -> Expr {
        let usage = |slot: &(Term, Term)| Expr::Function(applied(self.names.usage, &[slot.1]));
        let mut each: Vec<Expr> = slots.iter().map(usage).collect();
        let all = if each.len() == 1 { each.remove(0) } else { Expr::Sum(each) };
        match (self.rng.u32(0..4), way) {
            (0, _) | (_, None) => all,
            (1, _) => self.static_expression(slots, way),
            (_, Some(way)) => Expr::Product(vec![Expr::Function(applied(self.names.distance, &way)), all]),
        }
    }

    fn open(&mut self, relation: Relation, expression: Expr) -> Condition {
        self.open += 1;
        Condition::Open(relation, expression, self.open - 1)
    }

    fn number(function: usize) -> Expr {
        Expr::Function(applied(function, &[]))
    }

    /// From a place to another.
    fn travel(&mut self, name: String) -> Action {
        let mut action = self.empty(name);
        let names = self.names;
        let first = self.rng.bool();
        let place = |action: &mut Action| {
            action.parameters.push(("from".to_owned(), PLACE));
            action.parameters.push(("to".to_owned(), PLACE));
        };
        if first {
            place(&mut action);
        }
        let slots = self.slots(&mut action, 3);
        if !first {
            place(&mut action);
        }
        let to = if first { 1 } else { action.parameters.len() - 1 };
        let way = [Term::Parameter(to - 1), Term::Parameter(to)];
        action.start.conditions.push(Condition::Holds(applied(names.at, &way[..1])));
        action.start.conditions.push(Condition::Holds(applied(names.way, &way)));
        if let Some(lasting) = &mut action.lasting {
            lasting.duration = self.duration(&slots, way);
        }
        self.demand(&mut action, &slots, Some(way));
        action.start.effects.push(Effect::Delete(applied(names.at, &way[..1])));
        let arrive = Effect::Add(applied(names.at, &way[1..]));
        self.finally(&mut action).push(arrive);
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

    /// Effects at the end, if the action lasts.
    fn finally<'a>(&mut self, action: &'a mut Action) -> &'a mut Vec<Effect> {
        match &mut action.lasting {
            Some(lasting) => &mut lasting.end.effects,
            None => &mut action.start.effects,
        }
    }

    /// What the action needs of designs and battery.
    fn demand(&mut self, action: &mut Action, slots: &[(Term, Term)], way: Option<[Term; 2]>) {
        for _ in 0..self.rng.usize(0..3) {
            let expression = self.static_expression(slots, way);
            let condition = self.open(Relation::AtLeast, expression);
            action.start.conditions.push(condition);
        }
        if once_in(self.rng, 3) {
            let condition = self.open(Relation::AtLeast, Self::number(self.names.battery));
            action.start.conditions.push(condition);
        }
        if once_in(self.rng, 6) {
            // A value that some designs do not have.
            let range = Expr::Function(applied(self.names.range, &[slots[0].1]));
            let bound = Expr::Number(self.draw());
            let relation = one(self.rng, &[Relation::AtLeast, Relation::AtMost]);
            action.start.conditions.push(Condition::Compare(relation, range, bound));
        }
    }

    /// What the action uses, and what that costs.
    fn use_up(&mut self, action: &mut Action, slots: &[(Term, Term)], way: Option<[Term; 2]>) {
        let names = self.names;
        let used = self.consumption(slots, way);
        if once_in(self.rng, 3) {
            let enough = Condition::Compare(Relation::AtLeast, Self::number(names.battery), used.clone());
            action.start.conditions.push(enough);
        }
        let costs = self.consumption(slots, way);
        let mut effects = vec![Effect::Number(Change::Increase, applied(names.cost, &[]), costs)];
        if !once_in(self.rng, 4) {
            effects.push(Effect::Number(Change::Decrease, applied(names.battery, &[]), used.clone()));
        }
        if self.rng.bool() {
            effects.push(Effect::Number(Change::Increase, applied(names.energy, &[]), used));
        }
        if once_in(self.rng, 8) {
            let sparse = Expr::Function(applied(names.range, &[slots[0].1]));
            effects.push(Effect::Number(Change::Increase, applied(names.energy, &[]), sparse));
        }
        if once_in(self.rng, 6) {
            let low = self.draw();
            let battery =
                Condition::Compare(Relation::AtMost, Self::number(names.battery), Expr::Number(low));
            let more = Expr::Number(self.draw());
            let effect = Effect::Number(Change::Increase, applied(names.cost, &[]), more);
            effects.push(Effect::When(vec![battery], vec![effect]));
        }
        for effect in effects {
            if action.lasting.is_some() && once_in(self.rng, 3) {
                action.start.effects.push(effect);
            } else {
                self.finally(action).push(effect);
            }
        }
    }

    /// Effects that mention a design or a function.
    fn touch(&mut self, action: &mut Action, slots: &[(Term, Term)], way: &[Term]) {
        let names = self.names;
        let (function, design) = slots[0];
        if self.memory {
            self.remember(action, function, design);
        }
        if self.fluent_availability && once_in(self.rng, 2) {
            let lost = Effect::Delete(applied(names.available, &[design]));
            self.finally(action).push(lost);
        }
        if !self.side_effects {
            return;
        }
        match self.rng.u32(0..4) {
            0 => {
                let marked = applied(names.marked, &[design]);
                action.start.conditions.push(Condition::Not(Box::new(Condition::Holds(marked.clone()))));
                self.finally(action).push(Effect::Add(marked));
            }
            1 => {
                let worn = applied(names.worn, &[function]);
                let amount = self.static_expression(slots, None);
                let limit = self.open(Relation::AtMost, Expr::Function(worn.clone()));
                action.start.conditions.push(limit);
                self.finally(action).push(Effect::Number(Change::Increase, worn, amount));
            }
            2 => {
                let marked = Condition::Holds(applied(names.marked, &[design]));
                let dear = Expr::Number(self.draw_positive());
                let effect = Effect::Number(Change::Increase, applied(names.cost, &[]), dear);
                self.finally(action).push(Effect::When(vec![marked], vec![effect]));
                action.start.effects.push(Effect::Add(applied(names.marked, &[design])));
            }
            _ => {
                let done = applied(names.done, &way[way.len() - 1..]);
                self.finally(action).push(Effect::When(
                    vec![Condition::Holds(applied(names.marked, &[design]))],
                    vec![Effect::Add(done)],
                ));
                action.start.effects.push(Effect::Add(applied(names.marked, &[design])));
            }
        }
    }

    /// The current design of a function is remembered, and another one costs.
    fn remember(&mut self, action: &mut Action, function: Term, design: Term) {
        let names = self.names;
        action.parameters.push(("old".to_owned(), DESIGN));
        let old = Term::Parameter(action.parameters.len() - 1);
        let current = applied(names.current, &[function, old]);
        action.start.conditions.push(Condition::Holds(current.clone()));
        let cost = self.draw_positive();
        let effect = Effect::Number(Change::Increase, applied(names.cost, &[]), Expr::Number(cost));
        let differs = Condition::Not(Box::new(Condition::Same(old, design)));
        action.start.effects.push(Effect::Delete(current));
        action.start.effects.push(Effect::Add(applied(names.current, &[function, design])));
        action.start.effects.push(Effect::When(vec![differs], vec![effect]));
    }

    /// Something to do at a place.
    fn work(&mut self) -> Action {
        let mut action = self.empty("work".to_owned());
        let names = self.names;
        action.parameters.push(("where".to_owned(), PLACE));
        let place = [Term::Parameter(0)];
        let slots = self.slots(&mut action, 2);
        action.start.conditions.push(Condition::Holds(applied(names.at, &place)));
        self.demand(&mut action, &slots, None);
        let done = Effect::Add(applied(names.done, &place));
        self.finally(&mut action).push(done);
        self.use_up(&mut action, &slots, None);
        self.touch(&mut action, &slots, &place);
        action
    }

    /// Fills the battery: a value is assigned, or added where it is low.
    fn recharge(&mut self) -> Action {
        let mut action = self.empty("recharge".to_owned());
        let names = self.names;
        let place = one(self.rng, &self.places);
        action.start.conditions.push(Condition::Holds(applied(names.at, &[Term::Object(place)])));
        let battery = applied(names.battery, &[]);
        let full = self.task.values.iter().find(|(function, ..)| *function == names.battery);
        let full = full.map_or_else(|| whole(10), |(.., value)| value.clone());
        let (change, value) = match self.rng.u32(0..5) {
            0..=2 => (Change::Assign, full),
            3 => (Change::Increase, self.draw_positive()),
            _ => (Change::Assign, self.draw()),
        };
        if change == Change::Increase {
            let low = self.open(Relation::AtMost, Self::number(names.battery));
            action.start.conditions.push(low);
        }
        self.finally(&mut action).push(Effect::Number(change, battery, Expr::Number(value)));
        let cost = Expr::Number(self.draw_positive());
        self.finally(&mut action).push(Effect::Number(Change::Increase, applied(names.cost, &[]), cost));
        action
    }

    /// Makes a design available.
    fn repair(&mut self) -> Action {
        let mut action = self.empty("repair".to_owned());
        let names = self.names;
        action.parameters.push(("fd".to_owned(), DESIGN));
        let available = applied(names.available, &[Term::Parameter(0)]);
        action.start.conditions.push(Condition::Not(Box::new(Condition::Holds(available.clone()))));
        self.finally(&mut action).push(Effect::Add(available));
        let cost = Expr::Number(self.draw_positive());
        self.finally(&mut action).push(Effect::Number(Change::Increase, applied(names.cost, &[]), cost));
        action
    }

    fn metric(&mut self) -> Option<(bool, Expr)> {
        let names = self.names;
        let weighted = |weight: Number, of: Expr| Expr::Product(vec![Expr::Number(weight), of]);
        let metric = match self.rng.u32(0..12) {
            0 => return None,
            1..=4 => Self::number(names.cost),
            5 => Self::number(names.energy),
            6 if self.timed => Expr::TotalTime,
            7 if self.timed => {
                let weights = [self.draw_positive(), self.draw_positive()];
                let [first, second] = weights;
                Expr::Sum(vec![weighted(first, Expr::TotalTime), weighted(second, Self::number(names.cost))])
            }
            8 => {
                let (first, second) = (self.draw_positive(), self.draw_positive());
                Expr::Sum(vec![
                    weighted(first, Self::number(names.cost)),
                    weighted(second, Self::number(names.energy)),
                ])
            }
            9 => {
                let (first, second) = (self.draw(), self.draw());
                let battery = weighted(first, Self::number(names.battery));
                Expr::Minus(Box::new(weighted(second, Self::number(names.cost))), Box::new(battery))
            }
            10 => return Some((true, Self::number(names.battery))),
            _ => Expr::Sum(vec![Self::number(names.cost), Expr::Number(self.draw())]),
        };
        Some((false, metric))
    }

    fn finish(self) -> Task {
        let Self { mut task, names, rng, places, .. } = self;
        let mut atoms = vec![(names.at, vec![places[places.len() - 1]])];
        atoms.push((names.at, vec![one(rng, &places)]));
        atoms.extend(places.iter().map(|place| (names.done, vec![*place])));
        let wishes = Wishes { atoms, numbers: vec![Self::number(names.battery), Self::number(names.energy)] };
        tune(&mut task, &wishes, rng);
        task
    }
}
