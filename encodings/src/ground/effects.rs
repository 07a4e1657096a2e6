//! What an instance changes, by case and by moment.

use crate::error::{Error, Place};
use crate::ground::evaluate::{AtomId, Failure, World};
use crate::ground::events::Passage;
use crate::ground::frame::Operand;
use crate::ground::instantiate::{Build, GroundConditional, GroundOperator};
use crate::ground::join::guards_of_exists;
use crate::ground::residual::{Residual, constant_comparison};
use crate::lifted::{Change, Effect, Rational, Schema};
use crate::pddl::ast::Assignment;
use crate::quantity::{Linear, NumericId, Quantity};

/// An instance becomes at most this many operators.
const CASE_LIMIT: usize = 64;

/// What numeric variables become; a list, because an operator changes few.
#[derive(Debug, Clone, Default)]
pub(crate) struct Numbers {
    /// Ascending by variable.
    changes: Vec<(NumericId, Linear<Rational>)>,
}

impl Numbers {
    pub(crate) fn get(&self, variable: NumericId) -> Option<&Linear<Rational>> {
        let position = self.changes.binary_search_by_key(&variable, |(own, _)| *own);
        position.ok().map(|position| &self.changes[position].1)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &(NumericId, Linear<Rational>)> {
        self.changes.iter()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.changes.is_empty()
    }

    pub(crate) fn retain(&mut self, keep: &dyn Fn(NumericId) -> bool) {
        self.changes.retain(|(variable, _)| keep(*variable));
    }

    /// One variable that changes.
    pub(super) fn one(variable: NumericId, value: Linear<Rational>) -> Self {
        Self { changes: vec![(variable, value)] }
    }

    fn insert(&mut self, variable: NumericId, value: Linear<Rational>) {
        match self.changes.binary_search_by_key(&variable, |(own, _)| *own) {
            Ok(position) => self.changes[position].1 = value,
            Err(position) => self.changes.insert(position, (variable, value)),
        }
    }
}

/// What the start or the end of an instance changes, each change under a condition.
#[derive(Clone)]
pub(super) struct Moment {
    changes: Vec<(Residual, GroundChange)>,
}

#[derive(Clone)]
enum GroundChange {
    Atom(AtomId, bool),
    Number {
        variable: NumericId,
        assignment: Assignment,
        /// None if it is undefined: the operator does not exist where the change would be made.
        operand: Option<Linear<Rational>>,
        place: Place,
    },
}

/// One way in which the conditions of an instance can turn out, all its conditions in terms of the state before it.
pub(super) struct Case {
    parts: Vec<Residual>,
    start: Start,
    end: Vec<(Residual, GroundChange)>,
}

/// What the start of an instance changes for certain.
#[derive(Clone)]
struct Start {
    adds: Vec<AtomId>,
    deletes: Vec<AtomId>,
    numbers: Numbers,
}

impl Build<'_, '_> {
    /// The changes of effects that happen at once.
    pub(super) fn moment(&mut self, effects: &[Effect], operands: &[Operand]) -> Result<Moment, Failure> {
        let mut changes = Vec::with_capacity(effects.len());
        for (effect, operand) in effects.iter().zip(operands) {
            if effect.bound.is_empty() {
                self.effect(effect, operand, &mut changes)?;
                continue;
            }
            let guards = guards_of_exists(&effect.condition);
            let mut bindings = Vec::new();
            self.world.each_binding(&effect.bound, &guards, &mut self.binding, &mut |_, binding| {
                bindings.push(binding.clone());
                true
            });
            let own = std::mem::take(&mut self.binding);
            for binding in bindings {
                self.binding = binding;
                self.effect(effect, operand, &mut changes)?;
            }
            self.binding = own;
        }
        Ok(Moment { changes })
    }

    fn effect(
        &mut self,
        effect: &Effect,
        operand: &Operand,
        changes: &mut Vec<(Residual, GroundChange)>,
    ) -> Result<(), Failure> {
        self.world.in_effect = true;
        let condition = self.world.residual(&effect.condition, &mut self.binding);
        self.world.in_effect = false;
        let condition = condition?;
        if condition != Residual::False {
            let change = self.change(&effect.change, operand)?;
            changes.push((condition, change));
        }
        Ok(())
    }

    fn change(&mut self, change: &Change, operand: &Operand) -> Result<GroundChange, Failure> {
        Ok(match change {
            Change::Add(predicate, terms) | Change::Delete(predicate, terms) => {
                let atom = self.world.atom(*predicate, &World::arguments(terms, &self.binding));
                GroundChange::Atom(atom, matches!(change, Change::Add(..)))
            }
            Change::Assign { assignment, function, terms, expression, place } => {
                let arguments = World::arguments(terms, &self.binding);
                let variable = self.world.numeric(*function, &arguments, *place)?;
                let operand = match operand {
                    Operand::Undefined => None,
                    Operand::Open(operand) => Some(operand.clone()),
                    Operand::Closed => match self.open(expression) {
                        Ok(operand) => Some(operand),
                        Err(Failure::Undefined) => None,
                        Err(error) => return Err(error),
                    },
                };
                GroundChange::Number { variable, assignment: *assignment, operand, place: *place }
            }
        })
    }
}

impl Moment {
    fn is_certain(&self) -> bool {
        self.changes.iter().all(|(condition, _)| *condition == Residual::True)
    }
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
        Ok(Self { adds, deletes, numbers: numbers(changes(), &Numbers::default())? })
    }
}

/// What must hold between the start effects and the end effects, and what happens by itself in between.
pub(super) struct Middle<'m> {
    pub(super) conditions: &'m [Residual],
    /// Those that hold all the time.
    pub(super) over_all: &'m [Residual],
    pub(super) passage: Option<(Passage<'m>, &'m Quantity<Rational>)>,
}

impl Middle<'_> {
    /// Adds the conditions in terms of the state before the start, and to the start what happens until the end.
    fn pass(&self, start: &mut Start, parts: &mut Vec<Residual>) {
        if let Some((passage, duration)) = &self.passage {
            parts.extend(passage.conditions(duration));
            for event in passage.events() {
                parts.extend(self.over_all.iter().map(|residual| after_start(residual, start)));
                start.change(event);
            }
        }
        parts.extend(self.conditions.iter().map(|residual| after_start(residual, start)));
        if let Some((passage, duration)) = &self.passage {
            start.change(&passage.changes());
            let (clock, value) = passage.clock(duration);
            start.numbers.insert(clock, value);
        }
    }
}

/// The cases of an instance: one, unless its start is conditional or its numbers are.
pub(super) fn cases(
    schema: &Schema,
    before: Vec<Residual>,
    start: &Moment,
    middle: &Middle<'_>,
    end: Moment,
) -> Result<Vec<Case>, Failure> {
    if start.is_certain() && end.is_certain() {
        let mut start = Start::new(|| start.changes.iter().map(|(_, change)| change))?;
        let mut parts = before;
        middle.pass(&mut start, &mut parts);
        return Ok(vec![Case { parts, start, end: end.changes }]);
    }
    let mut all = Vec::new();
    for (decided, chosen) in split(schema, start.changes.iter().map(|(condition, _)| condition))? {
        let holds = |(condition, _): &&(Residual, GroundChange)| {
            *condition == Residual::True || chosen.contains(&condition)
        };
        let changes = || start.changes.iter().filter(holds).map(|(_, change)| change);
        let mut start = Start::new(changes)?;
        let mut parts: Vec<_> = before.iter().cloned().chain(decided).collect();
        middle.pass(&mut start, &mut parts);
        let after = |residual: &Residual| after_start(residual, &start);
        let end: Vec<_> = end
            .changes
            .iter()
            .map(|(condition, change)| (after(condition), change.clone()))
            .filter(|(condition, _)| *condition != Residual::False)
            .collect();
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
            all.push(Case {
                parts: parts.iter().cloned().chain(decided).collect(),
                start: start.clone(),
                end: end.iter().map(settle).filter(|(condition, _)| *condition != Residual::False).collect(),
            });
        }
    }
    Ok(all)
}

/// Every way in which conditions can turn out: what must hold then, and which of them hold.
#[allow(clippy::type_complexity)]
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
    let mut all: Vec<(Vec<Residual>, Vec<&Residual>)> = vec![(Vec::new(), Vec::new())];
    for condition in distinct {
        if all.len() * 2 > CASE_LIMIT {
            return Err(Failure::Error(Error::Unsupported {
                construct: format!("an instance of `{}` with more than {CASE_LIMIT} cases", schema.name),
                instead: "fewer conditions on which its numbers or its start effects depend".into(),
                place: schema.place,
            }));
        }
        let mut longer = Vec::with_capacity(2 * all.len());
        for (decided, chosen) in all {
            let with = |part: Residual| decided.iter().cloned().chain([part]).collect::<Vec<_>>();
            longer.push((with(condition.clone()), chosen.iter().copied().chain([condition]).collect()));
            longer.push((with(condition.negated()), chosen));
        }
        all = longer;
    }
    Ok(all)
}

impl Case {
    /// The operator of this case; everything but conditions and effects is that of the template.
    pub(super) fn operator(
        self,
        world: &mut World<'_>,
        template: GroundOperator,
    ) -> Result<GroundOperator, Failure> {
        let start = self.start;
        let certain = || self.end.iter().filter(|(condition, _)| *condition == Residual::True);
        let (end_adds, end_deletes) = atoms(certain().map(|(_, change)| change));
        let mut numeric_effects = numbers(certain().map(|(_, change)| change), &start.numbers)?;
        for (variable, value) in start.numbers.changes {
            if numeric_effects.get(variable).is_none() {
                numeric_effects.insert(variable, value);
            }
        }
        let mut conditional: Vec<GroundConditional> = Vec::new();
        for (condition, change) in self.end.iter().filter(|(condition, _)| *condition != Residual::True) {
            let GroundChange::Atom(atom, positive) = change else { continue };
            let gone = start.deletes.contains(atom) && !start.adds.contains(atom);
            if !positive && (gone || end_adds.contains(atom)) {
                continue;
            }
            let condition = literals(world, condition);
            if condition.windows(2).any(|pair| pair[0].0 == pair[1].0) {
                continue;
            }
            let position = conditional.iter().position(|known| known.condition == condition);
            let position = position.unwrap_or_else(|| {
                conditional.push(GroundConditional { condition, adds: Vec::new(), deletes: Vec::new() });
                conditional.len() - 1
            });
            let entry = &mut conditional[position];
            if *positive { &mut entry.adds } else { &mut entry.deletes }.push(*atom);
        }
        for entry in &mut conditional {
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
        let condition = world.condition(&self.parts)?;
        Ok(GroundOperator { condition, adds, deletes, conditional, numeric_effects, ..template })
    }
}

/// The literals of a conjunction; parts that are none get a name.
fn literals(world: &mut World<'_>, condition: &Residual) -> Vec<(AtomId, bool)> {
    let parts =
        if let Residual::And(parts) = condition { &parts[..] } else { std::slice::from_ref(condition) };
    let mut literals: Vec<_> = parts.iter().map(|part| world.literal(part)).collect();
    literals.sort_unstable();
    literals.dedup();
    literals
}

/// The atoms that changes make true, and those that they make false; what is both becomes true.
fn atoms<'c>(changes: impl Iterator<Item = &'c GroundChange>) -> (Vec<AtomId>, Vec<AtomId>) {
    let (mut adds, mut deletes) = (Vec::new(), Vec::new());
    for change in changes {
        if let GroundChange::Atom(atom, positive) = change {
            if *positive { &mut adds } else { &mut deletes }.push(*atom);
        }
    }
    deletes.retain(|atom| !adds.contains(atom));
    (adds, deletes)
}

/// Whether changes of one number at one time go together: additions, scalings, and assignments of the same value do.
/// `Failure::Undefined` if they do not, which leaves the action inapplicable (PDDL 2.1, section 8).
fn reconcile(earlier: &GroundChange, later: &GroundChange) -> Result<(), Failure> {
    let (
        GroundChange::Number { assignment: kind, operand: known, .. },
        GroundChange::Number { assignment, operand, place, .. },
    ) = (earlier, later)
    else {
        return Ok(());
    };
    let way = |assignment: &Assignment| match assignment {
        Assignment::Assign => 0,
        Assignment::Increase | Assignment::Decrease => 1,
        Assignment::ScaleUp | Assignment::ScaleDown => 2,
    };
    match (known, operand) {
        _ if way(kind) != way(assignment) => Err(Failure::Undefined),
        (Some(known), Some(value)) if way(kind) == 0 && known != value => {
            let is_constant =
                |value: &Linear<Rational>| value.coefficients.is_empty() && value.quantity.tables.is_empty();
            if is_constant(known) && is_constant(value) {
                return Err(Failure::Undefined);
            }
            Err(Failure::Error(Error::Unsupported {
                construct: "two different values assigned to one number at one time".into(),
                instead: "one `assign` of each number".into(),
                place: *place,
            }))
        }
        _ => Ok(()),
    }
}

/// What numeric variables become, in terms of the state before the action; `before` are the changes that
/// the action has made already.
fn numbers<'c>(
    changes: impl Iterator<Item = &'c GroundChange>,
    before: &Numbers,
) -> Result<Numbers, Failure> {
    let mut changed = Numbers::default();
    let mut last: Vec<(NumericId, &GroundChange)> = Vec::new();
    for change in changes {
        let GroundChange::Number { variable, assignment, operand, place } = change else { continue };
        match last.iter_mut().find(|(known, _)| known == variable) {
            Some((_, earlier)) => {
                reconcile(earlier, change)?;
                *earlier = change;
            }
            None => last.push((*variable, change)),
        }
        let mut operand = operand.clone().ok_or(Failure::Undefined)?;
        substitute(&mut operand, before);
        let current = || {
            let old = changed.get(*variable).or_else(|| before.get(*variable));
            old.cloned().unwrap_or_else(|| Linear::variable(*variable))
        };
        let value = match assignment {
            Assignment::Assign => operand,
            Assignment::Increase => sum(current(), &operand),
            Assignment::Decrease => sum(current(), &operand.negated()),
            Assignment::ScaleUp | Assignment::ScaleDown => {
                scaled(current(), &operand, *assignment == Assignment::ScaleDown, *place)?
            }
        };
        changed.insert(*variable, value);
    }
    Ok(changed)
}

fn sum(mut left: Linear<Rational>, right: &Linear<Rational>) -> Linear<Rational> {
    left.add(right);
    left
}

fn scaled(
    mut value: Linear<Rational>,
    factor: &Linear<Rational>,
    inverse: bool,
    place: Place,
) -> Result<Linear<Rational>, Failure> {
    if !factor.coefficients.is_empty() || !factor.quantity.tables.is_empty() {
        return Err(Failure::Error(Error::NonLinear { place }));
    }
    let factor = factor.quantity.constant.clone();
    if inverse && factor == Rational::from_integer(0) {
        return Err(Failure::Undefined);
    }
    value.scale(&if inverse { factor.recip() } else { factor });
    Ok(value)
}

fn substitute(linear: &mut Linear<Rational>, before: &Numbers) {
    if !linear.coefficients.iter().any(|(variable, _)| before.get(*variable).is_some()) {
        return;
    }
    let mut result = Linear { coefficients: Vec::new(), quantity: linear.quantity.clone() };
    for (variable, factor) in &linear.coefficients {
        let mut value = before.get(*variable).cloned().unwrap_or_else(|| Linear::variable(*variable));
        value.scale(factor);
        result.add(&value);
    }
    *linear = result;
}

/// A condition of the middle or end of a durative action in terms of the state before its start.
fn after_start(residual: &Residual, Start { adds, deletes, numbers }: &Start) -> Residual {
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
