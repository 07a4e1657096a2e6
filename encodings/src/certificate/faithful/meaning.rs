//! What an instance of an action requires and does, in terms of the state before it. A durative action is one step: its start
//! effects take place before the conditions of its middle and end are looked at, and before its end effects.

use std::collections::{BTreeMap, BTreeSet};

use num_rational::BigRational;
use num_traits::{Signed, Zero};
use rustc_hash::FxHashMap;

use crate::certificate::faithful::linear::Linear;
use crate::certificate::faithful::world::{Key, World};
use crate::pddl::ast::{
    Action, ActionBody, Arithmetic, Assignment, Comparison, Condition, ConditionTime, Effect, EffectTime,
    Expression, Name,
};

/// What is not covered.
type Unknown = String;

#[derive(Debug, Default)]
pub(super) struct Meaning {
    pub(super) positive: BTreeSet<Key>,
    pub(super) negative: BTreeSet<Key>,
    /// Each is greater than 0 (if strict) or at least 0.
    pub(super) comparisons: Vec<(Linear, bool)>,
    /// Atoms that have this value afterwards.
    pub(super) truths: BTreeMap<Key, bool>,
    /// Fluents that have these values afterwards.
    pub(super) changes: BTreeMap<Key, Linear>,
    pub(super) duration: Option<BigRational>,
}

impl Meaning {
    /// The meaning of an instance; none if it can never be executed.
    pub(super) fn of(world: &World<'_>, action: &Action, arguments: &[u32]) -> Result<Option<Self>, Unknown> {
        let names = action.parameters.iter().map(|parameter| &parameter.identifier.name);
        let binding = names.zip(arguments.iter().copied()).collect();
        let mut reader = Reader { binding, ..Reader::new(world) };
        let possible = match &action.body {
            ActionBody::Instantaneous { precondition, effect } => {
                reader.require(precondition)? && reader.cause(&[effect])?
            }
            ActionBody::Durative { duration, conditions, effects } => {
                let [constraint] = &duration[..] else { return Err("durations that are chosen".into()) };
                if constraint.operator != Comparison::Equal {
                    return Err("durations that are chosen".into());
                }
                let Some(length) = reader.expression(&constraint.expression)? else { return Ok(None) };
                let length = length.value().cloned().ok_or("durations that depend on the state")?;
                if length.is_negative() {
                    return Err("negative durations".into());
                }
                reader.meaning.duration = Some(length);
                let at = |wanted: &[ConditionTime]| -> Vec<&Condition> {
                    conditions.iter().filter(|(time, _)| wanted.contains(time)).map(|(_, own)| own).collect()
                };
                let effects = |wanted: EffectTime| -> Vec<&Effect> {
                    effects.iter().filter(|(time, _)| *time == wanted).map(|(_, own)| own).collect()
                };
                reader.all(&at(&[ConditionTime::AtStart]))?
                    && reader.cause(&effects(EffectTime::AtStart))?
                    && reader.all(&at(&[ConditionTime::OverAll, ConditionTime::AtEnd]))?
                    && reader.cause(&effects(EffectTime::AtEnd))?
            }
        };
        Ok((possible && reader.meaning.positive.is_disjoint(&reader.meaning.negative))
            .then_some(reader.meaning))
    }

    /// A goal as what an action without effects requires; none if it never holds.
    pub(super) fn of_goal(world: &World<'_>, goal: &Condition) -> Result<Option<Self>, Unknown> {
        let mut reader = Reader::new(world);
        let possible = reader.require(goal)?;
        Ok((possible && reader.meaning.positive.is_disjoint(&reader.meaning.negative))
            .then_some(reader.meaning))
    }
}

/// Stands for `total-time` in metrics.
pub(super) const TOTAL_TIME: Key = (u32::MAX, Vec::new());

/// A metric over fluents and [`TOTAL_TIME`]; none if it has no value.
pub(super) fn metric(world: &World<'_>, expression: &Expression) -> Result<Option<Linear>, Unknown> {
    Reader { is_metric: true, ..Reader::new(world) }.expression(expression)
}

struct Reader<'r> {
    world: &'r World<'r>,
    binding: FxHashMap<&'r Name, u32>,
    meaning: Meaning,
    is_metric: bool,
}

impl<'r> Reader<'r> {
    fn new(world: &'r World<'r>) -> Self {
        Self { world, binding: FxHashMap::default(), meaning: Meaning::default(), is_metric: false }
    }

    fn all(&mut self, conditions: &[&Condition]) -> Result<bool, Unknown> {
        for condition in conditions {
            if !self.require(condition)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Adds a condition on the state after the effects so far; `false` if it cannot hold.
    fn require(&mut self, condition: &Condition) -> Result<bool, Unknown> {
        match condition {
            Condition::And(parts) => self.all(&parts.iter().collect::<Vec<_>>()),
            Condition::Atom(atom) => {
                let key = self.world.key(atom, &self.binding)?;
                Ok(self.literal(key, true))
            }
            Condition::Equal(left, right, _) => self.equal(left, right),
            Condition::Not(inner) => match &**inner {
                Condition::Atom(atom) => {
                    let key = self.world.key(atom, &self.binding)?;
                    Ok(self.literal(key, false))
                }
                Condition::Equal(left, right, _) => Ok(!self.equal(left, right)?),
                _ => Err("negations of more than atoms".into()),
            },
            Condition::Compare(operator, left, right, _) => self.compare(*operator, left, right),
            Condition::Or(parts) => self.disjunction(parts),
            Condition::Imply(..) => Err("implications".into()),
            Condition::Exists(..) | Condition::ForAll(..) => Err("quantifiers".into()),
        }
    }

    /// Adds the only part of a disjunction that can hold; nothing if one holds whatever the state.
    fn disjunction(&mut self, parts: &[Condition]) -> Result<bool, Unknown> {
        let mut possible = Vec::new();
        for part in parts {
            let meaning = Meaning {
                truths: self.meaning.truths.clone(),
                changes: self.meaning.changes.clone(),
                duration: self.meaning.duration.clone(),
                ..Meaning::default()
            };
            let mut own = Self { binding: self.binding.clone(), meaning, ..*self };
            if own.require(part)? {
                let Meaning { positive, negative, comparisons, .. } = own.meaning;
                if positive.is_empty() && negative.is_empty() && comparisons.is_empty() {
                    return Ok(true);
                }
                possible.push(part);
            }
        }
        match possible[..] {
            [] => Ok(false),
            [part] => self.require(part),
            _ => Err("disjunctions".into()),
        }
    }

    fn equal(&self, left: &crate::pddl::ast::Term, right: &crate::pddl::ast::Term) -> Result<bool, Unknown> {
        Ok(self.world.object(left, &self.binding)? == self.world.object(right, &self.binding)?)
    }

    fn literal(&mut self, key: Key, holds: bool) -> bool {
        if let Some(known) = self.meaning.truths.get(&key) {
            return *known == holds;
        }
        if !self.world.changes(key.0) {
            return self.world.holds_initially(&key) == holds;
        }
        if holds {
            self.meaning.positive.insert(key)
        } else {
            self.meaning.negative.insert(key)
        };
        true
    }

    fn compare(
        &mut self,
        operator: Comparison,
        left: &Expression,
        right: &Expression,
    ) -> Result<bool, Unknown> {
        let (Some(left), Some(right)) = (self.expression(left)?, self.expression(right)?) else {
            return Ok(false);
        };
        let minus = BigRational::from_integer((-1).into());
        let difference = left.plus(&right, &minus);
        let opposite = difference.times(&minus);
        let all = match operator {
            Comparison::GreaterOrEqual => vec![(difference, false)],
            Comparison::Greater => vec![(difference, true)],
            Comparison::LessOrEqual => vec![(opposite, false)],
            Comparison::Less => vec![(opposite, true)],
            Comparison::Equal => vec![(difference, false), (opposite, false)],
        };
        for (linear, strict) in all {
            match linear.value() {
                Some(value) if value.is_negative() || strict && value.is_zero() => return Ok(false),
                Some(_) => {}
                None => self.meaning.comparisons.push((linear, strict)),
            }
        }
        Ok(true)
    }

    /// The value of an expression after the effects so far; none if it has none.
    fn expression(&self, expression: &Expression) -> Result<Option<Linear>, Unknown> {
        let one = BigRational::from_integer(1.into());
        Ok(match expression {
            Expression::Number(number, _) => Some(Linear::constant(number.clone())),
            Expression::Fluent(atom) => {
                let key = self.world.key(atom, &self.binding)?;
                match self.meaning.changes.get(&key) {
                    Some(known) => Some(known.clone()),
                    None if self.world.changes(key.0) => {
                        if self.world.initial_value(&key).is_none() && self.world.name(key.0) != "total-cost"
                        {
                            return Err("numeric fluents without an initial value".into());
                        }
                        Some(Linear::fluent(key))
                    }
                    None => self.world.initial_value(&key).cloned().map(Linear::constant),
                }
            }
            Expression::Duration(_) => self.meaning.duration.clone().map(Linear::constant),
            Expression::TotalTime(_) if self.is_metric => Some(Linear::fluent(TOTAL_TIME)),
            Expression::TotalTime(_) => return Err("total-time outside of the metric".into()),
            Expression::Operation(operation, parts, _) => {
                let parts =
                    parts.iter().map(|part| self.expression(part)).collect::<Result<Option<Vec<_>>, _>>()?;
                let Some(parts) = parts else { return Ok(None) };
                let mut parts = parts.into_iter();
                let Some(first) = parts.next() else { return Err("an operation without operands".into()) };
                let rest: Vec<Linear> = parts.collect();
                if *operation == Arithmetic::Subtract && rest.is_empty() {
                    return Ok(Some(first.times(&-one)));
                }
                let mut result = first;
                for next in rest {
                    result = match operation {
                        Arithmetic::Add => result.plus(&next, &one),
                        Arithmetic::Subtract => result.plus(&next, &-one.clone()),
                        Arithmetic::Multiply => match (result.value().cloned(), next.value()) {
                            (_, Some(factor)) => result.times(factor),
                            (Some(factor), None) => next.times(&factor),
                            (None, None) => return Err("products of numeric fluents".into()),
                        },
                        Arithmetic::Divide => match next.value() {
                            Some(divisor) if divisor.is_zero() => return Ok(None),
                            Some(divisor) => result.times(&divisor.recip()),
                            None => return Err("quotients of numeric fluents".into()),
                        },
                    };
                }
                Some(result)
            }
        })
    }

    /// Adds effects that take place at one time; `false` if they cannot.
    fn cause(&mut self, effects: &[&Effect]) -> Result<bool, Unknown> {
        let (mut adds, mut deletes, mut changes) = (BTreeSet::new(), BTreeSet::new(), BTreeMap::new());
        let mut open: Vec<&Effect> = effects.to_vec();
        while let Some(effect) = open.pop() {
            match effect {
                Effect::And(parts) => open.extend(parts),
                Effect::Add(atom) => {
                    adds.insert(self.world.key(atom, &self.binding)?);
                }
                Effect::Delete(atom) => {
                    deletes.insert(self.world.key(atom, &self.binding)?);
                }
                Effect::ForAll(..) | Effect::When(..) => return Err("conditional effects".into()),
                Effect::Assign(kind, atom, expression, _) => {
                    let key = self.world.key(atom, &self.binding)?;
                    let Some(value) = self.expression(expression)? else { return Ok(false) };
                    let before = || self.meaning.changes.get(&key).cloned();
                    let before = changes.get(&key).cloned().or_else(before);
                    let before = before.unwrap_or_else(|| Linear::fluent(key.clone()));
                    let one = BigRational::from_integer(1.into());
                    let after = match kind {
                        Assignment::Increase => before.plus(&value, &one),
                        Assignment::Decrease => before.plus(&value, &-one),
                        Assignment::Assign if !changes.contains_key(&key) => value,
                        _ => return Err("numbers that are scaled, or assigned twice".into()),
                    };
                    changes.insert(key, after);
                }
            }
        }
        // What is both added and deleted holds.
        self.meaning.truths.extend(deletes.into_iter().map(|key| (key, false)));
        self.meaning.truths.extend(adds.into_iter().map(|key| (key, true)));
        self.meaning.changes.extend(changes);
        Ok(true)
    }
}
