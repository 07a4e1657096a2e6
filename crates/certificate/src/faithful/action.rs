//! Computes the conditions and effects of a ground action (instance) as a list of cases: outcomes,
//! each under a condition on the state before the action.
//!
//! A durative action is one step: its start effects precede the evaluation of its over-all and
//! at-end conditions and its end effects. An instantaneous action is one happening, as are start
//! and end of a durative action with duration 0. With timed
//! events there are separate cases for each interval of time in which the action can be executed.

use std::borrow::Cow;
use std::collections::BTreeMap;

use num_rational::BigRational;
use num_traits::Zero;

use crate::faithful::case::{Case, Moment};
use crate::faithful::formula::{Formula, Known, Structure};
use crate::faithful::happening;
use crate::faithful::key::Key;
use crate::faithful::length::Length;
use crate::faithful::linear::Linear;
use crate::faithful::reader::{Applied, Reader};
use crate::faithful::reads::Reads;
use crate::faithful::timeline::{self, Event, Passage, Timeline};
use crate::faithful::verdict::Cause;
use pddl::ast::{
    Action, ActionBody, Assignment, Condition, ConditionTime, DurationConstraint, Effect, EffectTime,
    Expression,
};

#[expect(clippy::arithmetic_side_effects, reason = "the place of an event that is held in memory")]
pub(super) fn waits(timeline: &Timeline, structure: &Structure) -> Result<Vec<Case>, Cause> {
    let mut cases = Vec::new();
    for (before, event) in timeline.events.iter().enumerate().skip(timeline.begun) {
        let passage = Passage::wait(before + 1, &event.time);
        let mut truths = event.truths.clone();
        truths.extend(passage.truths(timeline));
        truths.extend([(timeline::phase(before), false), (timeline::waited(), true)]);
        for known in Known::default().assume(structure, &Formula::Atom(timeline::phase(before), true))? {
            let (truths, passage) = (truths.clone(), passage.clone());
            cases.push(Case {
                known,
                truths,
                effects: Vec::new(),
                changes: Changes::new(),
                length: None,
                passage,
            });
        }
    }
    Ok(cases)
}

type Changes = BTreeMap<Key, Linear>;

/// Returns the cases of an action instance: conditions on the state before it, each with the
/// effects under this condition. Together they cover all executions in states of the witness (the
/// over-approximation of the reachable states). `reader` contains the witness and the binding of
/// the action's parameters.
pub(super) fn cases<'r>(
    mut reader: Reader<'r>,
    structure: &Structure,
    action: &'r Action,
) -> Result<Vec<Case>, Cause> {
    match &action.body {
        ActionBody::Instantaneous { precondition, effect } => {
            let condition = reader.formula(precondition, true)?;
            let mut cases = Vec::new();
            if condition.is(false) {
                return Ok(cases);
            }
            let moment = reader.moment([effect])?;
            let timeline = &reader.world.timeline;
            for passage in timeline.passages(&BigRational::zero()) {
                let event = passage.at_start(timeline);
                let reads = || reader.reads(vec![precondition], vec![effect], Vec::new());
                if event.is_some_and(|event| reads().event(event)) {
                    continue;
                }
                let condition_at_start =
                    all_of(&condition, [passage.condition(timeline), moment.leaves(event)]);
                let applied = Applied { truths: passage.truths(timeline), ..Applied::default() };
                for known in Known::default().assume(structure, &condition_at_start)? {
                    cases.extend(moment.last(structure, known, &applied, (&passage, None))?);
                }
            }
            Ok(cases)
        }
        ActionBody::Durative { duration, conditions, effects } => {
            let Some(length) = reader.lengths(duration)? else { return Ok(Vec::new()) };
            let at_once = length.least.is_zero();
            reader.length = Some(length);
            let durative = Durative { duration, conditions, effects };
            if at_once { durative.at_once(reader, structure) } else { durative.cases(reader, structure) }
        }
    }
}

/// Returns the conjunction of a condition and two additional ones. Borrows `condition` in the
/// frequent case that both additional conditions are true.
fn all_of(condition: &Formula, additional: [Formula; 2]) -> Cow<'_, Formula> {
    if additional.iter().all(|extra| extra.is(true)) {
        return Cow::Borrowed(condition);
    }
    Cow::Owned(Formula::junction(std::iter::once(condition.clone()).chain(additional), true))
}

struct Durative<'r> {
    duration: &'r [DurationConstraint],
    conditions: &'r [(ConditionTime, Condition)],
    effects: &'r [(EffectTime, Effect)],
}

impl<'r> Durative<'r> {
    fn condition(&self, reader: &mut Reader<'r>, times: &[ConditionTime]) -> Result<Formula, Cause> {
        let timed = self.conditions.iter().filter(|(time, _)| times.contains(time));
        let conditions: Result<Vec<_>, _> =
            timed.map(|(_, condition)| reader.formula(condition, true)).collect();
        Ok(Formula::junction(conditions?, true))
    }

    fn effects(&self, wanted: EffectTime) -> impl Iterator<Item = &'r Effect> {
        self.effects.iter().filter(move |(time, _)| *time == wanted).map(|(_, effect)| effect)
    }

    fn reads(&self, reader: &Reader<'r>, wanted: EffectTime) -> Reads<'r> {
        let time = match wanted {
            EffectTime::AtStart => ConditionTime::AtStart,
            EffectTime::AtEnd => ConditionTime::AtEnd,
        };
        let conditions = self.conditions.iter().filter(|(own, _)| *own == time);
        let durations = self.duration.iter().filter(|constraint| constraint.time == wanted);
        reader.reads(
            conditions.map(|(_, condition)| condition).collect(),
            self.effects(wanted).collect(),
            durations.map(|constraint| &constraint.expression).collect(),
        )
    }

    /// Start and end of an action with duration 0 are one happening. There are no states to which
    /// over-all conditions apply.
    fn at_once(&self, mut reader: Reader<'r>, structure: &Structure) -> Result<Vec<Case>, Cause> {
        let mut ends = Vec::new();
        for (condition, effect) in
            [(ConditionTime::AtStart, EffectTime::AtStart), (ConditionTime::AtEnd, EffectTime::AtEnd)]
        {
            let condition = self.condition(&mut reader, &[condition])?;
            if condition.is(false) {
                return Ok(Vec::new());
            }
            ends.push((condition, reader.moment(self.effects(effect))?));
        }
        let [(condition, start), (at_end, end)] = &ends[..] else { return Ok(Vec::new()) };
        let reads = [EffectTime::AtStart, EffectTime::AtEnd].map(|half| self.reads(&reader, half));
        let apart = happening::apart((&reads[0], start), (&reads[1], end));
        let happening = Moment {
            atoms: [&start.atoms[..], &end.atoms[..]].concat(),
            numbers: [&start.numbers[..], &end.numbers[..]].concat(),
        };
        let mut cases = Vec::new();
        let timeline = &reader.world.timeline;
        for passage in timeline.passages(&BigRational::zero()) {
            let event = passage.at_start(timeline);
            if event.is_some_and(|event| reads.iter().any(|half| half.event(event))) {
                continue;
            }
            let conditions =
                [condition, at_end, &apart, &passage.condition(timeline), &happening.leaves(event)];
            let applied = Applied { truths: passage.truths(timeline), ..Applied::default() };
            let conditions = Formula::junction(conditions.into_iter().cloned(), true);
            for known in Known::default().assume(structure, &conditions)? {
                cases.extend(happening.last(
                    structure,
                    known,
                    &applied,
                    (&passage, reader.length.as_ref()),
                )?);
            }
        }
        Ok(cases)
    }

    fn cases(&self, mut reader: Reader<'r>, structure: &Structure) -> Result<Vec<Case>, Cause> {
        let condition = self.condition(&mut reader, &[ConditionTime::AtStart])?;
        let mut cases = Vec::new();
        if condition.is(false) {
            return Ok(cases);
        }
        let start = reader.moment(self.effects(EffectTime::AtStart))?;
        let timeline = &reader.world.timeline;
        let least = reader.length.as_ref().map(|length| length.least.clone()).unwrap_or_default();
        for passage in timeline.passages(&least) {
            let event = passage.at_start(timeline);
            if event.is_some_and(|event| self.reads(&reader, EffectTime::AtStart).event(event)) {
                continue;
            }
            let condition_at_start = all_of(&condition, [passage.condition(timeline), start.leaves(event)]);
            for known in Known::default().assume(structure, &condition_at_start)? {
                let guards = start.atoms.iter().map(|(guard, ..)| guard);
                let guards = guards.chain(start.numbers.iter().map(|(guard, ..)| guard));
                for known in known.split(structure, guards)? {
                    let truths = start.truths(structure, &known);
                    for (known, changes) in start.numbers(structure, &known, &Applied::default())? {
                        reader.applied = Applied { truths: truths.clone(), changes };
                        cases.extend(self.after_start(&mut reader, structure, &known, &passage)?);
                    }
                    reader.applied = Applied::default();
                }
            }
        }
        Ok(cases)
    }

    /// Returns the cases of a durative action whose start effects are stored in `reader.applied`.
    /// Considers the events during the action, the over-all conditions, and the end. `known`
    /// contains the assumptions about the state before the action.
    fn after_start(
        &self,
        reader: &mut Reader<'r>,
        structure: &Structure,
        known: &Known,
        passage: &Passage,
    ) -> Result<Vec<Case>, Cause> {
        let timeline = &reader.world.timeline;
        let event = passage.at_end(timeline);
        if event.is_some_and(|event| self.reads(reader, EffectTime::AtEnd).event(event)) {
            return Ok(Vec::new());
        }
        let mut later = vec![self.condition(reader, &[ConditionTime::OverAll])?];
        // Over-all conditions must hold again after each event during the action.
        for event in passage.between(timeline) {
            reader.applied.truths.extend(event.truths.clone());
            later.push(self.condition(reader, &[ConditionTime::OverAll])?);
        }
        later.push(self.condition(reader, &[ConditionTime::AtEnd])?);
        let mut cases = Vec::new();
        if later.iter().any(|condition| condition.is(false)) {
            return Ok(cases);
        }
        let end = reader.moment(self.effects(EffectTime::AtEnd))?;
        later.push(end.leaves(event));
        let mut applied = reader.applied.clone();
        applied.truths.extend(event.into_iter().flat_map(|event| event.truths.clone()));
        applied.truths.extend(passage.truths(timeline));
        for known in known.assume(structure, &Formula::junction(later, true))? {
            cases.extend(end.last(structure, known, &applied, (passage, reader.length.as_ref()))?);
        }
        Ok(cases)
    }
}

impl<'r> Reader<'r> {
    fn reads(
        &self,
        conditions: Vec<&'r Condition>,
        effects: Vec<&'r Effect>,
        durations: Vec<&'r Expression>,
    ) -> Reads<'r> {
        let (world, axioms, binding) = (self.world, self.axioms, self.binding.clone());
        Reads { world, axioms, binding, conditions, effects, durations }
    }

    fn moment(&mut self, effects: impl IntoIterator<Item = &'r Effect>) -> Result<Moment, Cause> {
        let mut moment = Moment::default();
        for effect in effects {
            self.collect(effect, &Formula::truth(true), &mut moment)?;
        }
        Ok(moment)
    }

    fn collect(&mut self, effect: &'r Effect, guard: &Formula, moment: &mut Moment) -> Result<(), Cause> {
        match effect {
            Effect::And(parts) => parts.iter().try_for_each(|part| self.collect(part, guard, moment)),
            Effect::Add(atom) | Effect::Delete(atom) => {
                let key = self.world.key(atom, &self.binding)?;
                moment.atoms.push((guard.clone(), key, matches!(effect, Effect::Add(_))));
                Ok(())
            }
            Effect::ForAll(bound, inner) => self
                .each(bound, None, &mut |own| own.collect(inner, guard, moment).map(|()| true))
                .map(|_| ()),
            Effect::When(condition, inner) => {
                self.in_when = true;
                let condition = self.formula(condition, true);
                self.in_when = false;
                let guard = Formula::junction([guard.clone(), condition?], true);
                if guard.is(false) { Ok(()) } else { self.collect(inner, &guard, moment) }
            }
            Effect::Assign(kind, atom, expression, _) => {
                let key = self.world.key(atom, &self.binding)?;
                let value = self.expression(expression)?;
                moment.numbers.push((guard.clone(), *kind, key, value));
                Ok(())
            }
        }
    }
}

impl Moment {
    /// Returns the condition that no active effect on an atom contradicts `event`, which happens
    /// simultaneously. True if there is no event.
    fn leaves(&self, event: Option<&Event>) -> Formula {
        let Some(event) = event else { return Formula::truth(true) };
        let opposite = self.atoms.iter().filter(|(_, key, holds)| event.truths.get(key) == Some(&!holds));
        Formula::junction(opposite.map(|(guard, ..)| guard.negated()), true)
    }

    /// Returns the new truth values of the atoms that the active effects add or delete. `known`
    /// must decide all guards (conditions of effects).
    fn truths(&self, structure: &Structure, known: &Known) -> BTreeMap<Key, bool> {
        let active = |guard: &Formula| known.decide(structure, guard) == Some(true);
        let mut truths = BTreeMap::new();
        for (guard, key, holds) in &self.atoms {
            if active(guard) {
                let value = truths.entry(key.clone()).or_insert(*holds);
                // An atom that is both added and deleted holds.
                *value |= *holds;
            }
        }
        truths
    }

    /// Returns the cases of an action instance. `self` contains the effects of its last happening,
    /// and `applied` the changes by its start and by events.
    fn last(
        &self,
        structure: &Structure,
        known: Known,
        applied: &Applied,
        (passage, length): (&Passage, Option<&Length>),
    ) -> Result<Vec<Case>, Cause> {
        let mut cases = Vec::new();
        for known in known.split(structure, self.numbers.iter().map(|(guard, ..)| guard))? {
            for (known, number_changes) in self.numbers(structure, &known, applied)? {
                let mut changes = applied.changes.clone();
                changes.extend(number_changes);
                let (truths, effects) = (applied.truths.clone(), self.atoms.clone());
                let (passage, length) = (passage.clone(), length.cloned());
                cases.push(Case { known, truths, effects, changes, length, passage });
            }
        }
        Ok(cases)
    }

    /// Returns the changes of the numeric fluents as cases. `known` must decide all guards (conditions of
    /// effects). If several values are assigned to one fluent, they must be equal; each case extends `known` by this
    /// assumption. There is no case if active effects contradict each other or are undefined.
    fn numbers(
        &self,
        structure: &Structure,
        known: &Known,
        applied: &Applied,
    ) -> Result<Vec<(Known, Changes)>, Cause> {
        let mut by_fluent: BTreeMap<&Key, Vec<(Assignment, &Linear)>> = BTreeMap::new();
        for (guard, kind, key, value) in &self.numbers {
            if known.decide(structure, guard) == Some(true) {
                let Some(value) = value else { return Ok(Vec::new()) };
                by_fluent.entry(key).or_default().push((*kind, value));
            }
        }
        let mut changes = BTreeMap::new();
        let mut equations = Vec::new();
        for (key, effects) in by_fluent {
            let before = applied.changes.get(key).cloned().unwrap_or_else(|| Linear::fluent(key.clone()));
            match together(before, &effects, &mut equations)? {
                Some(after) => changes.insert(key.clone(), after),
                None => return Ok(Vec::new()),
            };
        }
        let equations = known.assume(structure, &Formula::junction(equations, true))?;
        Ok(equations.into_iter().map(|known| (known, changes.clone())).collect())
    }
}

/// Returns the value of a number after simultaneous effects, given the value `before`. Returns `None` if the
/// effects contradict each other or divide by zero. If several values are assigned, their equality is appended
/// to `equations`. Fails if a number is scaled by an expression that is not constant.
fn together(
    before: Linear,
    effects: &[(Assignment, &Linear)],
    equations: &mut Vec<Formula>,
) -> Result<Option<Linear>, Cause> {
    let way = |kind: Assignment| match kind {
        Assignment::Assign => 0,
        Assignment::Increase | Assignment::Decrease => 1,
        Assignment::ScaleUp | Assignment::ScaleDown => 2,
    };
    if effects.windows(2).any(|pair| way(pair[0].0) != way(pair[1].0)) {
        return Ok(None);
    }
    let mut after = before;
    for (position, (kind, value)) in effects.iter().enumerate() {
        after = match kind {
            Assignment::Increase => after.plus(value, &BigRational::from_integer(1.into())),
            Assignment::Decrease => after.minus(value),
            Assignment::Assign if position == 0 => (*value).clone(),
            Assignment::Assign => {
                let difference = after.clone().minus(value);
                match difference.value() {
                    Some(number) if number.is_zero() => {}
                    Some(_) => return Ok(None),
                    None => {
                        equations.push(Formula::Compare(difference.clone(), false));
                        equations.push(Formula::Compare(difference.negated(), false));
                    }
                }
                after
            }
            Assignment::ScaleUp | Assignment::ScaleDown => {
                let Some(factor) = value.value() else {
                    return Err(Cause::unsupported("numbers that are scaled by numbers that change"));
                };
                match (kind, factor.is_zero()) {
                    (Assignment::ScaleDown, true) => return Ok(None),
                    (Assignment::ScaleDown, false) => after.times(&factor.recip()),
                    _ => after.times(factor),
                }
            }
        };
    }
    Ok(Some(after))
}
