//! Parses effects without time specifiers.

use crate::ast::{Assignment, Effect};
use crate::sexp::Item;

use super::condition::is_timed;
use super::expression::comparison;
use super::{Parser, list_start};

fn assignment(symbol: &str) -> Option<Assignment> {
    Some(match symbol {
        "assign" => Assignment::Assign,
        "increase" => Assignment::Increase,
        "decrease" => Assignment::Decrease,
        "scale-up" => Assignment::ScaleUp,
        "scale-down" => Assignment::ScaleDown,
        _ => return None,
    })
}

impl Parser<'_> {
    pub(super) fn effect(&mut self, item: Item<'_>) -> Option<Effect> {
        if !item.is_list() {
            self.expected(item, "an effect");
            return None;
        }
        if item.items().next().is_none() {
            return Some(Effect::And(Vec::new()));
        }
        let Some(head) = item.head() else {
            self.expected(item, "an effect").help("one pair of parentheses too many?");
            return None;
        };
        match head.to_ascii_lowercase().as_str() {
            "and" => Some(Effect::And(item.rest().filter_map(|item| self.effect(item)).collect())),
            "not" => self.for_values(|parser| parser.delete(item)),
            "forall" => self.universal_effect(item),
            "when" => self.conditional_effect(item),
            "probabilistic" | "oneof" => {
                self.refuse(item, "effects that depend on chance")
                    .help("a plan here is one sequence, and an action has one outcome in each state");
                None
            }
            symbol => self.for_values(|parser| match assignment(symbol) {
                Some(kind) => parser.assignment(item, kind),
                None => parser.add(item),
            }),
        }
    }

    fn add(&mut self, item: Item<'_>) -> Option<Effect> {
        let head = item.head().unwrap_or_default();
        if is_timed(item) {
            self.sink
                .error("P115", list_start(item), "a time specifier cannot stand here")
                .help("`at start` and `at end` are the outermost parts of effects of durative actions");
            return None;
        }
        if comparison(head).is_some() {
            self.sink
                .error("P106", list_start(item), format!("`{head}` is a comparison, expected an effect"))
                .help("numbers are changed by `assign`, `increase`, `decrease`, `scale-up` and `scale-down`");
            return None;
        }
        if ["or", "exists", "imply"].iter().any(|keyword| head.eq_ignore_ascii_case(keyword)) {
            self.sink.error("P106", list_start(item), format!("`{head}` cannot be an effect"));
            return None;
        }
        self.atom(item, "a predicate").map(Effect::Add)
    }

    fn delete(&mut self, item: Item<'_>) -> Option<Effect> {
        let [inner] = self.operands(item, "(not (predicate ?x))")?;
        let head = inner.head().unwrap_or_default();
        if ["and", "or", "not", "forall", "when"].iter().any(|keyword| head.eq_ignore_ascii_case(keyword)) {
            self.expected(inner, "a predicate")
                .help("an effect negates one atom: `(and (not (p)) (not (q)))`");
            return None;
        }
        self.atom(inner, "a predicate").map(Effect::Delete)
    }

    fn universal_effect(&mut self, item: Item<'_>) -> Option<Effect> {
        let [variables, body] = self.operands(item, "(forall (?x - type) (p ?x))")?;
        let variables = self.parameters(variables);
        let mark = self.mark_effects();
        let body = self.effect(body);
        self.effects_below(mark, &variables);
        Some(Effect::ForAll(variables, Box::new(body?)))
    }

    fn conditional_effect(&mut self, item: Item<'_>) -> Option<Effect> {
        let [condition, effect] = self.operands(item, "(when (p) (q))")?;
        let condition = self.condition(condition);
        let mark = self.mark_effects();
        let effect = self.effect(effect);
        let condition = condition?;
        self.effects_when(mark, &condition);
        Some(Effect::When(condition, Box::new(effect?)))
    }

    fn assignment(&mut self, item: Item<'_>, kind: Assignment) -> Option<Effect> {
        let head = item.head().unwrap_or_default();
        let [target, value] = self.operands(item, &format!("({head} (function ?x) 1)"))?;
        if kind == Assignment::Assign && self.is_object_fluent(target) {
            return self.object_assignment(target, value);
        }
        let (target, value) = (self.fluent(target), self.expression(value));
        Some(Effect::Assign(kind, target?, value?, item.span()))
    }
}
