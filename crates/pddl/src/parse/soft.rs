//! Separates preferences (soft conditions) from the goals and conditions that contain them.

use crate::ast::{Condition, ConditionTime, Constraint, Identifier, Preference, Trajectory, TypedName};
use crate::sexp::Item;

use super::durative::{is_conjunction, timed};
use super::{Parser, list_start};

struct RawPreference<'t> {
    variables: Vec<TypedName>,
    time: Option<ConditionTime>,
    name: Identifier,
    body: Item<'t>,
    whole: Item<'t>,
}

#[derive(Clone, Default)]
struct Context {
    variables: Vec<TypedName>,
    time: Option<ConditionTime>,
}

fn is_soft(item: Item<'_>) -> bool {
    item.is_headed("preference") || item.items().any(is_soft)
}

impl Parser<'_> {
    /// Parses the goal. Its preferences become constraints on the last state.
    pub(super) fn goal_condition(
        &mut self,
        item: Item<'_>,
        constraints: &mut Vec<Constraint>,
    ) -> Option<Condition> {
        let mut raw_preferences = Vec::new();
        let goal = self.hard(item, &Context::default(), &mut raw_preferences)?;
        for RawPreference { variables, name, body, whole, .. } in raw_preferences {
            let Some(condition) = self.condition(body) else { continue };
            let trajectory = Trajectory::AtEnd(condition);
            constraints.push(Constraint {
                variables,
                preference: Some(name),
                trajectory,
                span: whole.span(),
            });
        }
        Some(goal)
    }

    pub(super) fn precondition(
        &mut self,
        item: Item<'_>,
        preferences: &mut Vec<Preference>,
    ) -> Option<Condition> {
        let mut raw_preferences = Vec::new();
        let precondition = self.hard(item, &Context::default(), &mut raw_preferences)?;
        for RawPreference { variables, name, body, whole, .. } in raw_preferences {
            let Some(condition) = self.condition(body) else { continue };
            let time = ConditionTime::AtStart;
            preferences.push(Preference { variables, name, time, condition, span: whole.span() });
        }
        Some(precondition)
    }

    pub(super) fn durative_condition(
        &mut self,
        item: Item<'_>,
        conditions: &mut Vec<(ConditionTime, Condition)>,
        preferences: &mut Vec<Preference>,
    ) {
        let mut raw_preferences = Vec::new();
        self.hard_timed(item, &Context::default(), conditions, &mut raw_preferences);
        for RawPreference { variables, time, name, body, whole } in raw_preferences {
            let (mut inner, message_count) = (Vec::new(), self.sink.len());
            match time {
                Some(time) => inner.extend(self.condition(body).map(|condition| (time, condition))),
                None => self.timed_conditions(body, &mut inner),
            }
            if inner.is_empty() && self.sink.len() > message_count {
                continue;
            }
            // An empty conjunction has no parts. Its preference is kept, because a metric may name it.
            let stated = inner.first().map(|(time, _)| *time);
            let time = stated.or_else(|| timed(body).map(|(time, _)| time)).unwrap_or(ConditionTime::AtStart);
            if time == ConditionTime::OverAll || inner.iter().any(|(other_time, _)| *other_time != time) {
                self.refuse(whole, "preferences for conditions over all, or at several times,")
                    .help("give each condition at start or at end a preference of its own");
                continue;
            }
            let condition = match inner.len() {
                1 => inner.swap_remove(0).1,
                _ => Condition::And(inner.into_iter().map(|(_, part)| part).collect()),
            };
            preferences.push(Preference { variables, name, time, condition, span: whole.span() });
        }
    }

    /// Parses the hard (mandatory) part of a condition and collects its preferences in `soft`. The result is
    /// an empty conjunction if the condition consists of preferences only.
    fn hard<'t>(
        &mut self,
        item: Item<'t>,
        outer: &Context,
        soft: &mut Vec<RawPreference<'t>>,
    ) -> Option<Condition> {
        if !is_soft(item) {
            return self.condition(item);
        }
        if item.is_headed("preference") {
            soft.extend(self.preference(item, outer));
            return Some(Condition::And(Vec::new()));
        }
        if item.is_headed("and") {
            let parts = item.rest().filter_map(|part| self.hard(part, outer, soft).map(|hard| (part, hard)));
            let is_hard = |(part, hard): &(Item<'_>, Condition)| !is_soft(*part) || !is_empty(hard);
            return Some(Condition::And(parts.filter(is_hard).map(|(_, hard)| hard).collect()));
        }
        if item.is_headed("forall") {
            let [variables, body] = self.operands(item, "(forall (?x - type) (preference name (p ?x)))")?;
            let variables = self.parameters(variables);
            let inner = self.hard(body, &outer.below(&variables), soft)?;
            return Some(if is_empty(&inner) {
                inner
            } else {
                Condition::ForAll(variables, Box::new(inner))
            });
        }
        self.condition(item)
    }

    fn hard_timed<'t>(
        &mut self,
        item: Item<'t>,
        outer: &Context,
        conditions: &mut Vec<(ConditionTime, Condition)>,
        soft: &mut Vec<RawPreference<'t>>,
    ) {
        if !is_soft(item) {
            self.timed_conditions(item, conditions);
        } else if item.is_headed("preference") {
            soft.extend(self.preference(item, outer));
        } else if is_conjunction(item) {
            for part in item.rest() {
                self.hard_timed(part, outer, conditions, soft);
            }
        } else if let Some((time, inner)) = timed(item) {
            let outer = Context { time: Some(time), ..outer.clone() };
            let hard = self.hard(inner, &outer, soft);
            conditions.extend(hard.filter(|hard| !is_empty(hard)).map(|hard| (time, hard)));
        } else if item.is_headed("forall") {
            let form = "(forall (?x - type) (preference name (at start (p ?x))))";
            let Some([variables, body]) = self.operands(item, form) else { return };
            let variables = self.parameters(variables);
            let mut inner = Vec::new();
            self.hard_timed(body, &outer.below(&variables), &mut inner, soft);
            let quantify = |(time, part)| (time, Condition::ForAll(variables.clone(), Box::new(part)));
            conditions.extend(inner.into_iter().map(quantify));
        } else {
            self.timed_conditions(item, conditions);
        }
    }

    fn preference<'t>(&mut self, item: Item<'t>, outer: &Context) -> Option<RawPreference<'t>> {
        let (name, body) = self.named_preference(item)?;
        let Context { variables, time } = outer.clone();
        Some(RawPreference { variables, time, name: name?, body, whole: item })
    }

    pub(super) fn named_preference<'t>(&mut self, item: Item<'t>) -> Option<(Option<Identifier>, Item<'t>)> {
        let mut operands = item.rest();
        match (operands.next(), operands.next(), operands.next()) {
            (Some(name), Some(body), None) => Some((Some(self.name_item(name, "a name")?), body)),
            (Some(body), None, None) if body.is_list() => {
                self.sink.warning("P117", list_start(item), "a preference without a name has no effect");
                Some((None, body))
            }
            _ => {
                self.expected(item, "a preference").help("write `(preference name (p))`");
                None
            }
        }
    }
}

impl Context {
    fn below(&self, variables: &[TypedName]) -> Self {
        let all_variables = self.variables.iter().chain(variables).cloned().collect();
        Self { variables: all_variables, time: self.time }
    }
}

fn is_empty(condition: &Condition) -> bool {
    matches!(condition, Condition::And(parts) if parts.is_empty())
}
