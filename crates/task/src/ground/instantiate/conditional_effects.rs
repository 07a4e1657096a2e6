//! Case distinction: splits an action instance into operators, one for each combination of truth values of
//! the conditions of its start effects and numeric effects.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::error::Error;
use crate::ground::evaluate::normal_form::Definitions;
use crate::ground::instantiate::change::{GroundChange, atoms, numbers, substitute};
use crate::ground::instantiate::design_constraints::{admit_some, distinct, forbid};
use crate::ground::instantiate::simultaneous_effects::SimultaneousEffects;
use crate::ground::instantiate::timeline_windows::{Interference, TimelineWindow};
use crate::ground::vocabulary::atom::AtomId;
use crate::ground::vocabulary::eval_error::{Failure, possible};
use crate::ground::vocabulary::numbers::Numbers;
use crate::ground::vocabulary::operator::{GroundConditional, GroundOperator};
use crate::ground::vocabulary::partial_eval::{Residual, constant_comparison};
use crate::ground::vocabulary::world::World;
use crate::lifted::Schema;
use crate::limits::Limits;
use crate::task::ForbiddenCombinations;

/// Limit on the number of combinations of truth values, separately for the conditions of start effects and of
/// numeric end effects of an action instance.
const CASE_LIMIT: usize = 64;

/// A case of an action instance: one combination of truth values of the effect conditions. All conditions are
/// expressed over the state before the instance.
pub(super) struct Case {
    parts: Vec<Residual>,
    start: Start,
    end: Vec<(Residual, GroundChange)>,
}

#[derive(Clone)]
struct Start {
    adds: Vec<AtomId>,
    deletes: Vec<AtomId>,
    numbers: Numbers,
    undefined: Vec<ForbiddenCombinations>,
}

impl Start {
    fn change(&mut self, changes: &[(AtomId, bool)]) {
        for (atom, holds) in changes {
            self.adds.retain(|known| known != atom);
            self.deletes.retain(|known| known != atom);
            if *holds { &mut self.adds } else { &mut self.deletes }.push(*atom);
        }
    }

    fn new<'c, I: Iterator<Item = &'c GroundChange>>(changes: impl Fn() -> I) -> Result<Self, Failure> {
        let (adds, deletes) = atoms(changes());
        let undefined = changes().flat_map(GroundChange::undefined).cloned().collect();
        Ok(Self { adds, deletes, numbers: numbers(changes(), &Numbers::default())?, undefined })
    }
}

pub(super) struct Middle<'m> {
    pub(super) over_all: &'m [Residual],
    pub(super) at_end: &'m [Residual],
    /// If the task has timed events: the timeline window of the action (its position relative to the events), and the
    /// conditions under which events interfere with it.
    pub(super) passage: Option<&'m (TimelineWindow<'m>, Interference)>,
}

impl Middle<'_> {
    /// Adds all conditions to `parts`, rewritten over the state before the start. Adds the changes of the timed
    /// events up to the end, and the changes of phase and clock, to `start`.
    fn pass(&self, start: &mut Start, parts: &mut Vec<Residual>) {
        let Some((passage, interference)) = self.passage else {
            let conditions = self.over_all.iter().chain(self.at_end);
            parts.extend(conditions.map(|residual| after_start(residual, start)));
            return;
        };
        parts.extend(passage.conditions());
        parts.extend(interference.start.iter().map(Residual::negated));
        parts.extend(self.over_all.iter().map(|residual| after_start(residual, start)));
        for event in passage.events() {
            start.change(event);
            parts.extend(self.over_all.iter().map(|residual| after_start(residual, start)));
        }
        parts.extend(self.at_end.iter().map(|residual| after_start(residual, start)));
        parts.extend(interference.end.iter().map(|residual| after_start(residual, start).negated()));
        start.change(passage.event_at_end().unwrap_or_default());
        start.change(&passage.changes());
        if let Some((clock, value)) = passage.clock() {
            start.numbers.insert(clock, value);
        }
    }
}

/// Returns the cases of an instance, i.e. the combinations of truth values of its effect conditions. There is at most
/// one case unless the start effects or numeric effects have conditions. Contradictory cases, and cases with
/// undefined start effects, are dropped. Fails if there are more than `CASE_LIMIT` combinations for the start, or for
/// the numeric effects of the end.
pub(super) fn cases(
    schema: &Schema,
    before: &[Residual],
    start: &SimultaneousEffects,
    middle: &Middle<'_>,
    end: &SimultaneousEffects,
) -> Result<Vec<Case>, Failure> {
    let mut cases = Vec::new();
    for (decided, chosen) in split(schema, start.changes.iter().map(|(condition, _)| condition))? {
        let holds = |(condition, _): &&(Residual, GroundChange)| {
            *condition == Residual::True || chosen.contains(&condition)
        };
        let changes = || start.changes.iter().filter(holds).map(|(_, change)| change);
        let mut parts: Vec<_> = before.iter().cloned().chain(decided).collect();
        if contradictory(&parts) {
            continue;
        }
        let Some(mut start) = possible(Start::new(changes))? else { continue };
        middle.pass(&mut start, &mut parts);
        let after = |residual: &Residual| after_start(residual, &start);
        let end: Vec<_> = end
            .changes
            .iter()
            .map(|(condition, change)| (after(condition), change.clone()))
            .filter(|(condition, _)| *condition != Residual::False)
            .collect();
        // Operators have no conditional numeric effects, so each truth value of such a condition becomes a separate
        // case.
        let numeric = end.iter().filter(|(_, change)| matches!(change, GroundChange::Number { .. }));
        let numeric: Vec<_> = numeric.map(|(condition, _)| condition.clone()).collect();
        for (decided, chosen) in split(schema, numeric.iter())? {
            let settle = |(condition, change): &(Residual, GroundChange)| {
                let settled = if chosen.contains(&condition) {
                    Residual::True
                } else if numeric.contains(condition) && *condition != Residual::True {
                    Residual::False
                } else {
                    condition.clone()
                };
                (settled, change.clone())
            };
            let parts: Vec<_> = parts.iter().cloned().chain(decided).collect();
            if !contradictory(&parts) {
                let end = end.iter().map(settle).filter(|(condition, _)| *condition != Residual::False);
                cases.push(Case { parts, start: start.clone(), end: end.collect() });
            }
        }
    }
    Ok(cases)
}

fn contradictory(parts: &[Residual]) -> bool {
    fn note(parts: &[Residual], known: &mut FxHashMap<AtomId, bool>) -> bool {
        parts.iter().any(|part| match part {
            Residual::False => true,
            Residual::And(parts) => note(parts, known),
            Residual::Literal { atom, positive } => known.insert(*atom, *positive) == Some(!positive),
            _ => false,
        })
    }
    note(parts, &mut FxHashMap::default())
}

/// Returns all combinations of truth values of the conditions. Each entry holds the conditions or their
/// negations, and the list of conditions that are true. Fails if there are more than `CASE_LIMIT`
/// combinations.
#[allow(clippy::type_complexity)]
#[expect(clippy::arithmetic_side_effects, reason = "cases are at most twice their limit")]
fn split<'r>(
    schema: &Schema,
    conditions: impl Iterator<Item = &'r Residual>,
) -> Result<Vec<(Vec<Residual>, Vec<&'r Residual>)>, Failure> {
    let mut distinct: Vec<&Residual> = Vec::new();
    for condition in conditions.filter(|condition| **condition != Residual::True) {
        if !distinct.contains(&condition) {
            distinct.push(condition);
        }
    }
    let mut combinations: Vec<(Vec<Residual>, Vec<&Residual>)> = vec![(Vec::new(), Vec::new())];
    for condition in distinct {
        if combinations.len() * 2 > CASE_LIMIT {
            return Err(Failure::Error(Error::Unsupported {
                construct: format!("an instance of `{}` with more than {CASE_LIMIT} cases", schema.name),
                instead: "fewer conditions on which its numbers or its start effects depend".into(),
                place: schema.place,
            }));
        }
        let mut longer = Vec::with_capacity(2 * combinations.len());
        for (decided, chosen) in combinations {
            let with = |part: Residual| decided.iter().cloned().chain([part]).collect::<Vec<_>>();
            longer.push((with(condition.clone()), chosen.iter().copied().chain([condition]).collect()));
            longer.push((with(condition.negated()), chosen));
        }
        combinations = longer;
    }
    Ok(combinations)
}

impl Case {
    fn forbidden(
        &self,
        template: &GroundOperator,
        limits: &Limits,
    ) -> Result<Arc<[ForbiddenCombinations]>, Failure> {
        let end = self.end.iter().filter(|(condition, _)| *condition == Residual::True);
        let rules = end.flat_map(|(_, change)| change.undefined()).chain(&self.start.undefined);
        let mut rules = rules.peekable();
        if rules.peek().is_none() {
            return Ok(template.forbidden.clone());
        }
        let mut forbidden = template.forbidden.to_vec();
        for rule in rules {
            for combination in &rule.combinations {
                forbid(&mut forbidden, &rule.slots, combination.clone());
            }
        }
        let forbidden = distinct(forbidden);
        let sizes: Vec<_> = template.slots.iter().map(|(_, designs)| designs.len()).collect();
        if admit_some(&forbidden, &sizes, limits)? { Ok(forbidden) } else { Err(Failure::Undefined) }
    }

    #[expect(clippy::arithmetic_side_effects, reason = "something was pushed before")]
    pub(super) fn operator(
        self,
        world: &mut World<'_>,
        definitions: &mut Definitions,
        template: GroundOperator,
    ) -> Result<GroundOperator, Failure> {
        let forbidden = self.forbidden(&template, world.limits)?;
        let start = self.start;
        let certain = || self.end.iter().filter(|(condition, _)| *condition == Residual::True);
        let (end_adds, end_deletes) = atoms(certain().map(|(_, change)| change));
        let mut numeric_effects = numbers(certain().map(|(_, change)| change), &start.numbers)?;
        numeric_effects.complete(start.numbers);
        let mut conditional: Vec<GroundConditional> = Vec::new();
        for (condition, change) in self.end.iter().filter(|(condition, _)| *condition != Residual::True) {
            let GroundChange::Atom(atom, positive) = change else { continue };
            let is_deleted = start.deletes.contains(atom) && !start.adds.contains(atom);
            // The deletion has no effect: the start already deletes the atom, or the end adds the atom.
            if !positive && (is_deleted || end_adds.contains(atom)) {
                continue;
            }
            let condition = literals(world, definitions, condition);
            // A condition that contains an atom and its negation never holds.
            if condition.windows(2).any(|pair| pair[0].0 == pair[1].0) {
                continue;
            }
            let position = conditional.iter().position(|entry| entry.condition == condition);
            let position = position.unwrap_or_else(|| {
                conditional.push(GroundConditional { condition, adds: Vec::new(), deletes: Vec::new() });
                conditional.len() - 1
            });
            let entry = &mut conditional[position];
            if *positive { &mut entry.adds } else { &mut entry.deletes }.push(*atom);
        }
        for entry in &mut conditional {
            // Adding takes precedence over deleting.
            entry.deletes.retain(|atom| !entry.adds.contains(atom));
        }
        let mut adds = end_adds;
        adds.extend(start.adds.iter().filter(|atom| !end_deletes.contains(atom)));
        adds.sort_unstable();
        adds.dedup();
        let mut deletes: Vec<_> = end_deletes.into_iter().chain(start.deletes).collect();
        deletes.sort_unstable();
        deletes.dedup();
        deletes.retain(|atom| !adds.contains(atom));
        let condition = definitions.condition(world, &self.parts)?;
        Ok(GroundOperator { forbidden, condition, adds, deletes, conditional, numeric_effects, ..template })
    }
}

fn literals(
    world: &mut World<'_>,
    definitions: &mut Definitions,
    condition: &Residual,
) -> Vec<(AtomId, bool)> {
    let parts =
        if let Residual::And(parts) = condition { &parts[..] } else { std::slice::from_ref(condition) };
    let mut literals: Vec<_> = parts.iter().map(|part| definitions.literal(world, part)).collect();
    literals.sort_unstable();
    literals.dedup();
    literals
}

/// Rewrites a condition on a state after the start of a durative action as a condition on the state before
/// the start.
fn after_start(residual: &Residual, Start { adds, deletes, numbers, .. }: &Start) -> Residual {
    if adds.is_empty() && deletes.is_empty() && numbers.is_empty() {
        return residual.clone();
    }
    residual.clone().mapped(&|leaf| match leaf {
        Residual::Literal { atom, positive } if adds.contains(&atom) || deletes.contains(&atom) => {
            if adds.contains(&atom) == positive { Residual::True } else { Residual::False }
        }
        Residual::Compare { mut linear, strict } => {
            substitute(&mut linear, numbers);
            constant_comparison(&linear, strict).unwrap_or(Residual::Compare { linear, strict })
        }
        other => other,
    })
}
