//! Conditions and effects of a mission's actions, and its metric.

use super::draw::{once_in, one_of};
use super::missions::{Builder, DESIGN, PLACE};
use super::model::{Action, Change, Condition, Effect, Expr, Number, Relation, Term, applied, whole};

impl Builder<'_> {
    /// Adds conditions on designs and on the battery to an action.
    pub fn demand(&mut self, action: &mut Action, slots: &[(Term, Term)], way: Option<[Term; 2]>) {
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
            // Some designs have no value for `range`.
            let range = Expr::Function(applied(self.names.range, &[slots[0].1]));
            let bound = Expr::Number(self.draw());
            let relation = one_of(self.rng, &[Relation::AtLeast, Relation::AtMost]);
            action.start.conditions.push(Condition::Compare(relation, range, bound));
        }
    }

    /// Adds battery consumption and costs to an action.
    pub fn use_up(&mut self, action: &mut Action, slots: &[(Term, Term)], way: Option<[Term; 2]>) {
        let names = self.names;
        let used = self.consumption(slots, way);
        if once_in(self.rng, 3) {
            let battery_condition =
                Condition::Compare(Relation::AtLeast, Self::number(names.battery), used.clone());
            action.start.conditions.push(battery_condition);
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
        if once_in(self.rng, 4) {
            // The undefined operand matters only in states in which the condition of the effect holds.
            let sparse = Expr::Function(applied(names.range, &[slots[0].1]));
            let low = Expr::Number(self.draw());
            let relation = one_of(self.rng, &[Relation::AtLeast, Relation::AtMost]);
            let battery = Condition::Compare(relation, Self::number(names.battery), low);
            let effect = Effect::Number(Change::Increase, applied(names.energy, &[]), sparse);
            effects.push(Effect::When(vec![battery], vec![effect]));
        }
        if once_in(self.rng, 6) {
            let low = self.draw();
            let battery =
                Condition::Compare(Relation::AtMost, Self::number(names.battery), Expr::Number(low));
            let extra_cost = Expr::Number(self.draw());
            let effect = Effect::Number(Change::Increase, applied(names.cost, &[]), extra_cost);
            effects.push(Effect::When(vec![battery], vec![effect]));
        }
        for effect in effects {
            if action.lasting.is_some() && once_in(self.rng, 3) {
                action.start.effects.push(effect);
            } else {
                Self::finally(action).push(effect);
            }
        }
    }

    /// Adds effects that change or read facts and numbers of the first slot's design and function, with matching
    /// conditions.
    pub fn touch(&mut self, action: &mut Action, slots: &[(Term, Term)], way: &[Term]) {
        let names = self.names;
        let (function, design) = slots[0];
        if self.memory {
            self.remember(action, function, design);
        }
        if self.fluent_availability && once_in(self.rng, 2) {
            let unavailable = Effect::Delete(applied(names.available, &[design]));
            Self::finally(action).push(unavailable);
        }
        if !self.side_effects {
            return;
        }
        match self.rng.u32(0..4) {
            0 => {
                let marked = applied(names.marked, &[design]);
                action.start.conditions.push(Condition::Not(Box::new(Condition::Holds(marked.clone()))));
                Self::finally(action).push(Effect::Add(marked));
            }
            1 => {
                let worn = applied(names.worn, &[function]);
                let amount = self.static_expression(slots, None);
                let limit = self.open(Relation::AtMost, Expr::Function(worn.clone()));
                action.start.conditions.push(limit);
                Self::finally(action).push(Effect::Number(Change::Increase, worn, amount));
            }
            2 => {
                let marked = Condition::Holds(applied(names.marked, &[design]));
                let extra_cost = Expr::Number(self.draw_positive());
                let effect = Effect::Number(Change::Increase, applied(names.cost, &[]), extra_cost);
                Self::finally(action).push(Effect::When(vec![marked], vec![effect]));
                action.start.effects.push(Effect::Add(applied(names.marked, &[design])));
            }
            _ => {
                let done = applied(names.done, &way[way.len() - 1..]);
                Self::finally(action).push(Effect::When(
                    vec![Condition::Holds(applied(names.marked, &[design]))],
                    vec![Effect::Add(done)],
                ));
                action.start.effects.push(Effect::Add(applied(names.marked, &[design])));
            }
        }
    }

    /// Adds the effects that record the current design of a function. Replacing a design has a cost.
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

    pub fn work(&mut self) -> Action {
        let mut action = self.empty("work".to_owned());
        let names = self.names;
        action.parameters.push(("where".to_owned(), PLACE));
        let place = [Term::Parameter(0)];
        let slots = self.slots(&mut action, 2);
        action.start.conditions.push(Condition::Holds(applied(names.at, &place)));
        self.demand(&mut action, &slots, None);
        let done = Effect::Add(applied(names.done, &place));
        Self::finally(&mut action).push(done);
        self.use_up(&mut action, &slots, None);
        self.touch(&mut action, &slots, &place);
        action
    }

    pub fn recharge(&mut self) -> Action {
        let mut action = self.empty("recharge".to_owned());
        let names = self.names;
        let place = one_of(self.rng, &self.places);
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
        Self::finally(&mut action).push(Effect::Number(change, battery, Expr::Number(value)));
        let cost = Expr::Number(self.draw_positive());
        Self::finally(&mut action).push(Effect::Number(Change::Increase, applied(names.cost, &[]), cost));
        action
    }

    pub fn repair(&mut self) -> Action {
        let mut action = self.empty("repair".to_owned());
        let names = self.names;
        action.parameters.push(("fd".to_owned(), DESIGN));
        let available = applied(names.available, &[Term::Parameter(0)]);
        action.start.conditions.push(Condition::Not(Box::new(Condition::Holds(available.clone()))));
        Self::finally(&mut action).push(Effect::Add(available));
        let cost = Expr::Number(self.draw_positive());
        Self::finally(&mut action).push(Effect::Number(Change::Increase, applied(names.cost, &[]), cost));
        action
    }

    pub fn metric(&mut self) -> Option<(bool, Expr)> {
        let names = self.names;
        let weighted = |weight: Number, value: Expr| Expr::Product(vec![Expr::Number(weight), value]);
        // The planner refuses metrics that contain a number that an action assigns.
        let recharged = self.task.actions.iter().any(|action| action.name == "recharge");
        let kinds = if recharged && !once_in(self.rng, 10) { 9 } else { 12 };
        let metric = match self.rng.u32(0..kinds) {
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
}
