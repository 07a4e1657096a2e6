//! Preferences in goals and conditions: parts that need not hold. They are taken out of the condition that they stand in.

use crate::ast::{Condition, ConditionTime, Constraint, Identifier, Preference, Trajectory, TypedName};
use crate::sexp::Item;

use super::durative::{is_conjunction, timed};
use super::{Parser, list_start};

/// A preference as it was found, with what it stands below.
struct Found<'t> {
    variables: Vec<TypedName>,
    time: Option<ConditionTime>,
    name: Identifier,
    body: Item<'t>,
    whole: Item<'t>,
}

/// What a preference stands below.
#[derive(Clone, Default)]
struct Above {
    variables: Vec<TypedName>,
    time: Option<ConditionTime>,
}

/// Whether a preference stands in an item.
fn is_soft(item: Item<'_>) -> bool {
    item.is_headed("preference") || item.items().any(is_soft)
}

impl Parser<'_> {
    /// The goal without its preferences, which become constraints on the last state.
    pub(super) fn goal_condition(
        &mut self,
        item: Item<'_>,
        constraints: &mut Vec<Constraint>,
    ) -> Option<Condition> {
        let mut found = Vec::new();
        let goal = self.hard(item, &Above::default(), &mut found)?;
        for Found { variables, name, body, whole, .. } in found {
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

    /// The precondition of an instantaneous action without its preferences.
    pub(super) fn precondition(
        &mut self,
        item: Item<'_>,
        preferences: &mut Vec<Preference>,
    ) -> Option<Condition> {
        let mut found = Vec::new();
        let precondition = self.hard(item, &Above::default(), &mut found)?;
        for Found { variables, name, body, whole, .. } in found {
            let Some(condition) = self.condition(body) else { continue };
            let time = ConditionTime::AtStart;
            preferences.push(Preference { variables, name, time, condition, span: whole.span() });
        }
        Some(precondition)
    }

    /// The condition of a durative action, and its preferences apart.
    pub(super) fn durative_condition(
        &mut self,
        item: Item<'_>,
        conditions: &mut Vec<(ConditionTime, Condition)>,
        preferences: &mut Vec<Preference>,
    ) {
        let mut found = Vec::new();
        self.hard_timed(item, &Above::default(), conditions, &mut found);
        for Found { variables, time, name, body, whole } in found {
            let mut inner = Vec::new();
            match time {
                Some(time) => inner.extend(self.condition(body).map(|condition| (time, condition))),
                None => self.timed_conditions(body, &mut inner),
            }
            let Some((time, _)) = inner.first().cloned() else { continue };
            if time == ConditionTime::OverAll || inner.iter().any(|(other, _)| *other != time) {
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

    /// What has to hold of a condition; an empty conjunction where only preferences stand.
    fn hard<'t>(&mut self, item: Item<'t>, above: &Above, found: &mut Vec<Found<'t>>) -> Option<Condition> {
        if !is_soft(item) {
            return self.condition(item);
        }
        if item.is_headed("preference") {
            found.extend(self.preference(item, above));
            return Some(Condition::And(Vec::new()));
        }
        if item.is_headed("and") {
            let parts = item.rest().filter_map(|part| self.hard(part, above, found).map(|read| (part, read)));
            let is_left = |(part, read): &(Item<'_>, Condition)| !is_soft(*part) || !is_empty(read);
            return Some(Condition::And(parts.filter(is_left).map(|(_, read)| read).collect()));
        }
        if item.is_headed("forall") {
            let [variables, body] = self.operands(item, "(forall (?x - type) (preference name (p ?x)))")?;
            let variables = self.parameters(variables);
            let inner = self.hard(body, &above.below(&variables), found)?;
            return Some(if is_empty(&inner) {
                inner
            } else {
                Condition::ForAll(variables, Box::new(inner))
            });
        }
        self.condition(item)
    }

    /// As [`Parser::hard`] for the condition of a durative action.
    fn hard_timed<'t>(
        &mut self,
        item: Item<'t>,
        above: &Above,
        conditions: &mut Vec<(ConditionTime, Condition)>,
        found: &mut Vec<Found<'t>>,
    ) {
        if !is_soft(item) {
            self.timed_conditions(item, conditions);
        } else if item.is_headed("preference") {
            found.extend(self.preference(item, above));
        } else if is_conjunction(item) {
            for part in item.rest() {
                self.hard_timed(part, above, conditions, found);
            }
        } else if let Some((time, inner)) = timed(item) {
            let above = Above { time: Some(time), ..above.clone() };
            let hard = self.hard(inner, &above, found);
            conditions.extend(hard.filter(|hard| !is_empty(hard)).map(|hard| (time, hard)));
        } else if item.is_headed("forall") {
            let form = "(forall (?x - type) (preference name (at start (p ?x))))";
            let Some([variables, body]) = self.operands(item, form) else { return };
            let variables = self.parameters(variables);
            let mut inner = Vec::new();
            self.hard_timed(body, &above.below(&variables), &mut inner, found);
            let quantify = |(time, part)| (time, Condition::ForAll(variables.clone(), Box::new(part)));
            conditions.extend(inner.into_iter().map(quantify));
        } else {
            self.timed_conditions(item, conditions);
        }
    }

    fn preference<'t>(&mut self, item: Item<'t>, above: &Above) -> Option<Found<'t>> {
        let (name, body) = self.named_preference(item)?;
        let Above { variables, time } = above.clone();
        Some(Found { variables, time, name: name?, body, whole: item })
    }

    /// The name of a preference, if it has one, and what it prefers.
    pub(super) fn named_preference<'t>(&mut self, item: Item<'t>) -> Option<(Option<Identifier>, Item<'t>)> {
        let mut operands = item.rest();
        match (operands.next(), operands.next(), operands.next()) {
            (Some(name), Some(body), None) => Some((Some(self.name_item(name, "a name")?), body)),
            (Some(body), None, None) if body.is_list() => {
                self.sink.warning("P117", list_start(item), "a preference without a name counts for nothing");
                Some((None, body))
            }
            _ => {
                self.expected(item, "a preference").help("write `(preference name (p))`");
                None
            }
        }
    }
}

impl Above {
    fn below(&self, variables: &[TypedName]) -> Self {
        let all = self.variables.iter().chain(variables).cloned().collect();
        Self { variables: all, time: self.time }
    }
}

fn is_empty(condition: &Condition) -> bool {
    matches!(condition, Condition::And(parts) if parts.is_empty())
}
