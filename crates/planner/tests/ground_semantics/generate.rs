//! Decodes bytes to a lifted task, so that property tests and fuzzers can generate tasks.

use std::collections::{BTreeMap, BTreeSet};

use num_rational::Ratio;

use crate::ground_semantics::interpret::Step;
use crate::ground_semantics::model::{
    Action, CHANGING, CONSTANT, DERIVED, Effect, Expression, FLUENTS, FUNCTIONS, Formula, Number, PREDICATES,
    Range, STATICS, Sign, TOTAL_COST, Task, Term, UPPER, Way,
};

#[expect(clippy::struct_excessive_bools, reason = "switches that have nothing to do with each other")]
#[derive(Debug, Clone, Copy)]
pub struct Features {
    pub conditional: bool,
    pub derived: bool,
    pub timed: bool,
    /// Durations with bounds other than a single equation at the start.
    pub inequalities: bool,
    /// Functions that change and have no initial value, and effects that contradict each other.
    pub undefined: bool,
    /// Derived predicates that depend on themselves through a universal quantifier.
    pub universal: bool,
    /// Negative durations, with which no action can be executed.
    pub negative: bool,
    /// Products of fluents, comparisons in axioms, and durations and divisors that change.
    pub nonlinear: bool,
}

pub const ALL: Features = Features {
    conditional: true,
    derived: true,
    timed: true,
    inequalities: true,
    undefined: true,
    negative: true,
    universal: true,
    nonlinear: true,
};

/// Constructs of tasks whose grounding is compared with the interpreter.
pub const PLANNED: Features = Features {
    conditional: true,
    derived: true,
    timed: false,
    inequalities: true,
    undefined: false,
    negative: true,
    universal: true,
    nonlinear: false,
};

/// Draws choices from bytes. If no bytes remain, it draws the first choice, so that every task is
/// finite.
pub struct Draw<'b> {
    bytes: &'b [u8],
    features: Features,
    partial: bool,
}

#[derive(Debug, Clone, Copy)]
struct Allowed {
    /// Derived predicates that may be read everywhere, negated or not.
    free: &'static [usize],
    /// Derived predicates that may be read only where they are not negated.
    positive: &'static [usize],
    negated: bool,
    numeric: bool,
}

const EVERYWHERE: [usize; 3] = [DERIVED[0], DERIVED[1], UPPER];

impl Allowed {
    fn flipped(self) -> Self {
        Self { negated: !self.negated, ..self }
    }
}

impl<'b> Draw<'b> {
    pub fn new(bytes: &'b [u8], features: Features) -> Self {
        Self { bytes, features, partial: false }
    }

    pub fn below(&mut self, limit: usize) -> usize {
        let Some((first, rest)) = self.bytes.split_first() else { return 0 };
        self.bytes = rest;
        usize::from(*first) % limit.max(1)
    }

    fn chance(&mut self, in_hundred: usize) -> bool {
        self.below(100) + in_hundred >= 100
    }

    fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }

    fn some<T>(&mut self, least: usize, most: usize, mut one: impl FnMut(&mut Self) -> T) -> Vec<T> {
        let count = least + self.below(most - least + 1);
        (0..count).map(|_| one(self)).collect()
    }

    fn number(&mut self) -> Number {
        let numerator = self.below(9) as i128 - 2;
        Ratio::new(numerator, if self.chance(20) { 2 } else { 1 })
    }

    fn range(&mut self) -> Range {
        self.pick(&[Range::Object, Range::Thing, Range::Either, Range::Part])
    }

    fn term(&mut self, depth: usize) -> Term {
        if depth > 0 && self.chance(75) {
            Term::Variable(self.below(depth))
        } else {
            Term::Object(self.below(3))
        }
    }

    fn terms(&mut self, count: usize, depth: usize) -> Vec<Term> {
        (0..count).map(|_| self.term(depth)).collect()
    }

    fn fact(&mut self, depth: usize, allowed: Allowed) -> Formula {
        let mut predicates: Vec<usize> = FLUENTS.iter().chain(&STATICS).chain(&FLUENTS).copied().collect();
        if self.features.derived {
            predicates.extend(allowed.free);
            if !allowed.negated {
                predicates.extend(allowed.positive);
            }
        }
        let predicate = self.pick(&predicates);
        Formula::Fact(predicate, self.terms(PREDICATES[predicate].1, depth))
    }

    fn expression(&mut self, depth: usize, nesting: usize, is_constant: bool, duration: bool) -> Expression {
        let leaf = nesting == 0 || self.chance(50);
        if leaf {
            return match self.below(4) {
                0 | 1 if !is_constant => self.function(&CHANGING, depth),
                1 if duration => Expression::Duration,
                2 => self.function(&CONSTANT, depth),
                _ => Expression::Number(self.number()),
            };
        }
        let inner = |this: &mut Self| this.expression(depth, nesting - 1, is_constant, duration);
        match self.below(6) {
            0 | 1 => Expression::Sum(self.some(1, 3, inner)),
            2 => Expression::Difference(Box::new(inner(self)), Box::new(inner(self))),
            3 => Expression::Negative(Box::new(inner(self))),
            4 => {
                let is_constant = is_constant || !self.features.nonlinear;
                let factor = self.expression(depth, nesting - 1, is_constant, false);
                Expression::Product(Box::new(factor), Box::new(inner(self)))
            }
            _ => {
                let is_constant = is_constant || !self.features.nonlinear;
                // If expressions may be undefined, divisors may be 0 or undefined.
                let divisor = if self.partial || self.features.undefined {
                    self.expression(depth, 0, is_constant, false)
                } else {
                    Expression::Number(Ratio::new(1 + self.below(4) as i128, 2))
                };
                Expression::Quotient(Box::new(inner(self)), Box::new(divisor))
            }
        }
    }

    fn function(&mut self, among: &[usize], depth: usize) -> Expression {
        let function = self.pick(among);
        Expression::Function(function, self.terms(FUNCTIONS[function].1, depth))
    }

    fn sign(&mut self) -> Sign {
        self.pick(&[Sign::GreaterOrEqual, Sign::LessOrEqual, Sign::Greater, Sign::Less, Sign::Equal])
    }

    fn formula(&mut self, depth: usize, nesting: usize, allowed: Allowed, duration: bool) -> Formula {
        let leaf = nesting == 0 || self.chance(45);
        if leaf {
            return match self.below(8) {
                6 => Formula::Equal(self.term(depth), self.term(depth)),
                7 if allowed.numeric => {
                    let sign = self.sign();
                    let left = self.expression(depth, 1, false, duration);
                    Formula::Compare(sign, left, self.expression(depth, 2, false, duration))
                }
                _ => self.fact(depth, allowed),
            };
        }
        let inner = |this: &mut Self| this.formula(depth, nesting - 1, allowed, duration);
        match self.below(8) {
            0 | 1 => Formula::And(self.some(0, 3, inner)),
            2 | 3 => Formula::Or(self.some(0, 3, inner)),
            4 => Formula::Not(Box::new(self.formula(depth, nesting - 1, allowed.flipped(), duration))),
            5 => {
                let premise = self.formula(depth, nesting - 1, allowed.flipped(), duration);
                Formula::Imply(Box::new(premise), Box::new(inner(self)))
            }
            6 => {
                let range = self.range();
                let allowed = self.below_quantifier(allowed, allowed.negated);
                Formula::Exists(range, Box::new(self.formula(depth + 1, nesting - 1, allowed, duration)))
            }
            _ => {
                let range = self.range();
                let allowed = self.below_quantifier(allowed, !allowed.negated);
                Formula::ForAll(range, Box::new(self.formula(depth + 1, nesting - 1, allowed, duration)))
            }
        }
    }

    fn below_quantifier(&self, allowed: Allowed, is_universal: bool) -> Allowed {
        let positive = if is_universal && !self.features.universal { &[] } else { allowed.positive };
        Allowed { positive, ..allowed }
    }

    fn condition(&mut self, depth: usize, most: usize, duration: bool) -> Formula {
        self.condition_over(depth, most, duration, true)
    }

    fn condition_over(&mut self, depth: usize, most: usize, duration: bool, numeric: bool) -> Formula {
        let allowed = Allowed { free: &EVERYWHERE, positive: &[], negated: false, numeric };
        Formula::And(self.some(0, most, |this| {
            if this.chance(50) {
                let fact = this.fact(depth, allowed);
                if this.chance(25) { Formula::Not(Box::new(fact)) } else { fact }
            } else {
                this.formula(depth, 2, allowed, duration)
            }
        }))
    }

    fn change(&mut self, depth: usize, duration: bool) -> Effect {
        if self.chance(30) {
            let value = self.expression(depth, 1, true, duration);
            return Effect::Change(Way::Increase, TOTAL_COST, Vec::new(), value);
        }
        let function = self.pick(&CHANGING);
        let terms = self.terms(FUNCTIONS[function].1, depth);
        let way = self.pick(&[Way::Increase, Way::Decrease, Way::Assign, Way::ScaleUp, Way::ScaleDown]);
        let value = match way {
            Way::ScaleUp | Way::ScaleDown => self.expression(depth, 0, true, false),
            _ => self.expression(depth, 2, false, duration),
        };
        Effect::Change(way, function, terms, value)
    }

    fn effect(&mut self, depth: usize, nesting: usize, duration: bool) -> Effect {
        if nesting == 0 || self.chance(60) {
            let predicate = self.pick(&FLUENTS);
            return match self.below(5) {
                0 | 1 => Effect::Add(predicate, self.terms(PREDICATES[predicate].1, depth)),
                2 | 3 => Effect::Delete(predicate, self.terms(PREDICATES[predicate].1, depth)),
                _ => self.change(depth, duration),
            };
        }
        match self.below(3) {
            0 => Effect::And(self.some(0, 2, |this| this.effect(depth, nesting - 1, duration))),
            1 if self.features.conditional => {
                // An action with an undefined effect is not applicable.
                let numeric = self.features.undefined || !self.partial;
                let condition = self.condition_over(depth, 2, duration, numeric);
                Effect::When(condition, Box::new(self.effect(depth, nesting - 1, duration)))
            }
            _ => {
                let range = self.range();
                Effect::ForAll(range, Box::new(self.effect(depth + 1, nesting - 1, duration)))
            }
        }
    }

    fn effects(&mut self, depth: usize, duration: bool) -> Vec<Effect> {
        let mut effects = self.some(0, 3, |this| this.effect(depth, 2, duration));
        if !self.features.undefined {
            // At most one numeric effect, and not below a quantifier, so that no effect contradicts another.
            let mut seen = false;
            effects.retain(|effect| !changes_number(effect) || !std::mem::replace(&mut seen, true));
            effects.retain(|effect| {
                !matches!(effect, Effect::ForAll(..) | Effect::And(_)) || !changes_number(effect)
            });
        }
        effects
    }

    fn bounds(&mut self, depth: usize) -> Vec<(bool, Sign, Expression)> {
        let is_constant = !self.features.nonlinear;
        if !self.features.negative {
            let root = Box::new(self.expression(depth, 0, true, false));
            return vec![(false, Sign::Equal, Expression::Product(root.clone(), root))];
        }
        if !self.features.inequalities || self.chance(60) {
            return vec![(false, Sign::Equal, self.expression(depth, 1, is_constant, false))];
        }
        self.some(1, 2, |this| {
            let (at_end, sign) = (this.chance(25), this.sign());
            (at_end, sign, this.expression(depth, 1, is_constant, false))
        })
    }

    fn action(&mut self) -> Action {
        let parameters = self.some(0, 2, Self::range);
        let depth = parameters.len();
        let truth = Formula::And(Vec::new());
        if self.chance(40) {
            return Action {
                duration: Some(self.bounds(depth)),
                at_start: self.condition(depth, 1, true),
                over_all: self.condition(depth, 1, true),
                at_end: self.condition(depth, 1, true),
                start_effects: self.effects(depth, true),
                end_effects: self.effects(depth, true),
                parameters,
            };
        }
        Action {
            duration: None,
            at_start: self.condition(depth, 2, false),
            over_all: truth.clone(),
            at_end: truth,
            start_effects: self.effects(depth, false),
            end_effects: Vec::new(),
            parameters,
        }
    }

    fn axioms(&mut self) -> Vec<(usize, Formula)> {
        let numeric = self.features.nonlinear;
        let mut axioms = Vec::new();
        for head in DERIVED {
            let allowed = Allowed { free: &[], positive: &DERIVED, negated: false, numeric };
            let bodies = self.some(0, 2, |this| (head, this.formula(PREDICATES[head].1, 3, allowed, false)));
            axioms.extend(bodies);
        }
        let allowed = Allowed { free: &DERIVED, positive: &[UPPER], negated: false, numeric };
        axioms.extend(self.some(0, 1, |this| (UPPER, this.formula(PREDICATES[UPPER].1, 3, allowed, false))));
        axioms
    }

    fn atom(&mut self, among: &[usize]) -> (usize, Vec<usize>) {
        let predicate = self.pick(among);
        (predicate, (0..PREDICATES[predicate].1).map(|_| self.below(3)).collect())
    }

    fn values(&mut self) -> BTreeMap<(usize, Vec<usize>), Number> {
        let mut values = BTreeMap::new();
        for (function, (_, arity)) in FUNCTIONS.iter().enumerate() {
            let arguments = if *arity == 0 { vec![vec![]] } else { vec![vec![0], vec![1], vec![2]] };
            for arguments in arguments {
                let is_constant = CONSTANT.contains(&function);
                let is_missing = (is_constant && self.partial || self.features.undefined) && self.chance(15);
                let number = if function == TOTAL_COST { Number::from_integer(0) } else { self.number() };
                if !is_missing || function == TOTAL_COST {
                    values.insert((function, arguments), number);
                }
            }
        }
        values
    }

    fn metric(&mut self) -> Option<(bool, Expression)> {
        if self.chance(25) {
            return None;
        }
        let parts = self.some(1, 3, |this| {
            let weight = Expression::Number(this.number());
            let what = match this.below(3) {
                0 => Expression::Function(TOTAL_COST, Vec::new()),
                1 => Expression::TotalTime,
                _ => this.function(&CHANGING, 0),
            };
            Expression::Product(Box::new(weight), Box::new(what))
        });
        Some((self.chance(30), Expression::Sum(parts)))
    }

    pub fn task(&mut self) -> Task {
        self.partial = self.chance(50);
        let axioms = if self.features.derived { self.axioms() } else { Vec::new() };
        let basic: Vec<usize> = FLUENTS.iter().chain(&STATICS).copied().collect();
        let facts: BTreeSet<_> = self.some(0, 7, |this| this.atom(&basic)).into_iter().collect();
        let mut timed = Vec::new();
        if self.features.timed {
            timed = self.some(0, 2, |this| {
                (Number::new(this.below(12) as i128, 2), this.atom(&basic), this.chance(50))
            });
            timed.sort_by_key(|(time, ..)| *time);
            // Each time has at most one literal. (PDDL does not define which of two opposite literals at the same time
            // takes effect; `definition.md` does.)
            timed.dedup_by_key(|(time, ..)| *time);
        }
        Task {
            axioms,
            facts,
            values: self.values(),
            timed,
            actions: self.some(1, 3, Self::action),
            goal: self.condition(0, 2, false),
            metric: self.metric(),
        }
    }

    pub fn plan(&mut self, task: &Task) -> Vec<Step> {
        self.some(0, 5, |this| {
            let index = this.below(task.actions.len());
            let action = &task.actions[index];
            let objects = action.parameters.iter().map(|range| this.pick(range.objects())).collect();
            let needs_duration = action
                .duration
                .as_ref()
                .is_some_and(|bounds| !matches!(bounds[..], [(false, Sign::Equal, _)]));
            (index, objects, needs_duration.then(|| this.number()))
        })
    }
}

fn changes_number(effect: &Effect) -> bool {
    match effect {
        Effect::Change(..) => true,
        Effect::Add(..) | Effect::Delete(..) => false,
        Effect::And(parts) => parts.iter().any(changes_number),
        Effect::When(_, body) | Effect::ForAll(_, body) => changes_number(body),
    }
}
