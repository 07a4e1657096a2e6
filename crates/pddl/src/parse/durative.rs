//! Parses durative actions. Conjunctions are split, and time specifiers are moved out of `forall` and `when`,
//! until each condition and each effect has exactly one.

use crate::ast::{Condition, ConditionTime, DurationConstraint, Effect, EffectTime, Expression};
use crate::sexp::Item;

use super::condition::is_timed;
use super::expression::{CONTINUOUS, comparison};
use super::{Parser, list_start};

type TimedConditions = Vec<(ConditionTime, Condition)>;
type TimedEffects = Vec<(EffectTime, Effect)>;

pub(super) fn timed(item: Item<'_>) -> Option<(ConditionTime, Item<'_>)> {
    if !is_timed(item) {
        return None;
    }
    let mut operands = item.rest();
    let time = match operands.next()?.symbol()? {
        word if word.eq_ignore_ascii_case("start") => ConditionTime::AtStart,
        word if word.eq_ignore_ascii_case("end") => ConditionTime::AtEnd,
        _ => ConditionTime::OverAll,
    };
    Some((time, operands.next()?))
}

fn effect_time(time: ConditionTime) -> Option<EffectTime> {
    match time {
        ConditionTime::AtStart => Some(EffectTime::AtStart),
        ConditionTime::AtEnd => Some(EffectTime::AtEnd),
        ConditionTime::OverAll => None,
    }
}

pub(super) fn is_conjunction(item: Item<'_>) -> bool {
    item.is_headed("and") || (item.is_list() && item.items().next().is_none())
}

fn spread_condition(time: ConditionTime, condition: Condition, conditions: &mut TimedConditions) {
    match condition {
        Condition::And(parts) => parts.into_iter().for_each(|part| spread_condition(time, part, conditions)),
        condition => conditions.push((time, condition)),
    }
}

fn spread_effect(time: EffectTime, effect: Effect, effects: &mut TimedEffects) {
    match effect {
        Effect::And(parts) => parts.into_iter().for_each(|part| spread_effect(time, part, effects)),
        effect => effects.push((time, effect)),
    }
}

impl Parser<'_> {
    pub(super) fn timed_conditions(&mut self, item: Item<'_>, conditions: &mut TimedConditions) {
        if is_conjunction(item) {
            for item in item.rest() {
                self.timed_conditions(item, conditions);
            }
        } else if let Some((time, inner)) = timed(item) {
            if let Some(condition) = self.condition(inner) {
                spread_condition(time, condition, conditions);
            }
        } else if item.is_headed("forall") {
            let Some([variables, body]) = self.operands(item, "(forall (?x - type) (at start (p ?x)))")
            else {
                return;
            };
            let variables = self.parameters(variables);
            let mut inner = Vec::new();
            self.timed_conditions(body, &mut inner);
            let quantify = |(time, part)| (time, Condition::ForAll(variables.clone(), Box::new(part)));
            conditions.extend(inner.into_iter().map(quantify));
        } else if item.is_headed("preference") {
            // A preference at this position is an error, which `condition` reports.
            self.condition(item);
        } else {
            self.without_time(item, "condition", "`(at start (…))`, `(over all (…))` or `(at end (…))`");
        }
    }

    fn without_time(&mut self, item: Item<'_>, noun: &str, forms: &str) {
        if !item.is_list() {
            self.expected(item, &format!("a {noun} with a time specifier"));
            return;
        }
        self.sink
            .error(
                "P115",
                list_start(item),
                format!("this {noun} of a durative action has no time specifier"),
            )
            .help(format!("write {forms}"));
    }

    pub(super) fn timed_effects(&mut self, item: Item<'_>, effects: &mut TimedEffects) {
        if is_conjunction(item) {
            for item in item.rest() {
                self.timed_effects(item, effects);
            }
        } else if let Some((time, inner)) = timed(item) {
            self.effect_at(item, time, inner, effects);
        } else if item.is_headed("forall") {
            let Some([variables, body]) = self.operands(item, "(forall (?x - type) (at end (p ?x)))") else {
                return;
            };
            let variables = self.parameters(variables);
            let mut inner = Vec::new();
            let mark = self.mark_effects();
            self.timed_effects(body, &mut inner);
            self.effects_below(mark, &variables);
            let quantify = |(time, part)| (time, Effect::ForAll(variables.clone(), Box::new(part)));
            effects.extend(inner.into_iter().map(quantify));
        } else if item.is_headed("when") {
            self.timed_when(item, effects);
        } else if item.items().any(mentions_continuous_time) {
            self.refuse(item, "continuous effects (`#t`)").help(CONTINUOUS);
        } else {
            self.without_time(item, "effect", "`(at start (…))` or `(at end (…))`");
        }
    }

    fn effect_at(
        &mut self,
        item: Item<'_>,
        time: ConditionTime,
        inner: Item<'_>,
        effects: &mut TimedEffects,
    ) {
        let Some(time) = effect_time(time) else {
            self.sink
                .error("P115", list_start(item), "effects cannot take place over all")
                .help("write `(at start (…))` or `(at end (…))`");
            return;
        };
        self.objects.time = Some(time);
        if let Some(effect) = self.effect(inner) {
            spread_effect(time, effect, effects);
        }
    }

    /// Parses `(when (at T (p)) (at T (q)))` and appends conditional effects to `timed_effects`. All times
    /// must be equal.
    fn timed_when(&mut self, item: Item<'_>, timed_effects: &mut TimedEffects) {
        let Some([condition, effect]) = self.operands(item, "(when (at end (p)) (at end (q)))") else {
            return;
        };
        let (mut conditions, mut effects) = (Vec::new(), Vec::new());
        self.timed_conditions(condition, &mut conditions);
        let mark = self.mark_effects();
        self.timed_effects(effect, &mut effects);
        let conjunction = Condition::And(conditions.iter().map(|(_, part)| part.clone()).collect());
        self.effects_when(mark, &conjunction);
        for (time, effect) in effects {
            // The truth of the condition would have to be remembered until the time of the effect.
            if conditions.iter().any(|(condition_time, _)| effect_time(*condition_time) != Some(time)) {
                self.refuse(item, "conditional effects that take place at another time than their condition")
                    .help("remember the condition in an atom: `(when (at start (p)) (at start (q)))` and `(when (at end (q)) …)`");
                return;
            }
            timed_effects.push((time, Effect::When(conjunction.clone(), Box::new(effect))));
        }
    }

    pub(super) fn duration(&mut self, item: Item<'_>, constraints: &mut Vec<DurationConstraint>) {
        if is_conjunction(item) {
            for item in item.rest() {
                self.duration(item, constraints);
            }
            return;
        }
        let (time, constraint) = match timed(item) {
            Some((time, inner)) => (effect_time(time), inner),
            None => (Some(EffectTime::AtStart), item),
        };
        let operator = constraint.head().and_then(comparison);
        let (Some(time), Some(operator)) = (time, operator) else {
            self.expected(item, "a duration constraint").help("write `(= ?duration 5)`");
            return;
        };
        let Some([left, right]) = self.operands(constraint, "(= ?duration 5)") else { return };
        let (left, right) = (self.expression(left), self.expression(right));
        let (operator, expression) = match (left, right) {
            (Some(Expression::Duration(_)), Some(bound)) => (operator, bound),
            (Some(bound), Some(Expression::Duration(_))) => (operator.mirrored(), bound),
            (Some(_), Some(_)) => {
                self.sink.error("P106", list_start(constraint), "this does not constrain `?duration`");
                return;
            }
            _ => return,
        };
        constraints.push(DurationConstraint { time, operator, expression, span: constraint.span() });
    }
}

fn mentions_continuous_time(item: Item<'_>) -> bool {
    item.symbol().is_some_and(|symbol| symbol.eq_ignore_ascii_case("#t"))
        || item.items().any(mentions_continuous_time)
}
