//! Numeric variables, exact, in binary.
//!
//! At every step an effect `x := Σ f·y + q` of the operator there gives the next value, where q is a constant plus
//! tables of designs; what no operator changes stays. A condition `Σ f·y + q ≥ 0` asks for the sign bit of its sum to be 0
//! whenever its operator is there. Where a condition is the very value that an effect of the same operator assigns (a battery that
//! must not fall below 0), the sign bit of the next value serves.

use std::collections::BTreeMap;
use std::sync::Arc;

use task::number::{GROWTH_LIMIT, Int, dense};
use task::task::quantity::{Linear, Quantity};
use task::task::{NumericId, Operator, OperatorId};

use crate::encode::arithmetic::{Arithmetic, Bits, width};
use crate::encode::builder::Builder;
use crate::encode::designs::combinations;
use crate::encode::formula::{Family, Formula, VariableMeaning};
use crate::sat::Lit;

/// Conjunctions, each with the number that it stands for.
type Premises = Vec<(Vec<Lit>, Int)>;

/// Factors of numeric variables.
type Shape = Vec<(NumericId, Int)>;

/// The combinations of a table in the task's numbering, and its values.
type TableKey = (Vec<Vec<(usize, usize)>>, Arc<[Int]>);

/// The values that a number can have.
#[derive(Debug, Clone, Copy)]
struct Range {
    low: Int,
    high: Int,
}

/// Encodes all numeric variables; returns their values before each step and after the last one. None if a limit was
/// reached meanwhile, or if a number can grow beyond what the formula has bits for.
pub(super) fn numeric(builder: &mut Builder<'_>) -> Option<Vec<Vec<Bits>>> {
    let initial = &builder.task.initial.numbers;
    let mut ranges: Vec<Range> = initial.iter().map(|n| Range { low: *n, high: *n }).collect();
    let numbers: Vec<Bits> = initial.iter().map(|n| Arithmetic::constant(*n, width(*n, *n))).collect();
    let mut all = vec![numbers];
    for step in 0..builder.variables.horizon() {
        builder.check().ok()?;
        let numbers = all.last()?;
        let (next, next_ranges) = Transition { builder, step, numbers, ranges: &ranges }.encode()?;
        ranges = next_ranges;
        all.push(next);
    }
    Some(all)
}

/// The change of numbers at a step.
struct Transition<'s, 'a> {
    builder: &'s mut Builder<'a>,
    step: usize,
    /// The numbers before the step.
    numbers: &'s [Bits],
    /// The values that they can have.
    ranges: &'s [Range],
}

impl Transition<'_, '_> {
    /// The numbers after the step, and the values that they can have. None if one can grow too large.
    fn encode(&mut self) -> Option<(Vec<Bits>, Vec<Range>)> {
        let ranges = self.next_ranges()?;
        let mut next = Vec::with_capacity(self.numbers.len());
        for (range, variable) in ranges.iter().zip((0..).map(NumericId)) {
            next.push(self.next_number(variable, *range)?);
        }
        self.comparisons(&next)?;
        Some((next, ranges))
    }

    /// None if a number can grow beyond what the formula has bits for.
    fn next_ranges(&self) -> Option<Vec<Range>> {
        let mut next = self.ranges.to_vec();
        for (id, _) in &self.builder.variables.operators[self.step] {
            for effect in &self.builder.task.operators[id.index()].numeric_effects {
                let range = linear_range(&effect.value, self.ranges)?;
                let slot = &mut next[effect.variable.index()];
                *slot = Range { low: slot.low.min(range.low), high: slot.high.max(range.high) };
            }
        }
        Some(next)
    }

    #[expect(clippy::arithmetic_side_effects, reason = "widths of numbers of 128 bits")]
    fn next_number(&mut self, variable: NumericId, range: Range) -> Option<Bits> {
        let own = |operator: &Operator| -> Vec<Linear<Int>> {
            let effects = operator.numeric_effects.iter().filter(|effect| effect.variable == variable);
            effects.map(|effect| effect.value.clone()).collect()
        };
        let shapes = self.builder.partition(self.step, |operator| {
            own(operator).into_iter().map(|value| value.coefficients).collect()
        });
        let current = self.numbers[variable.index()].clone();
        if shapes.is_empty() {
            return Some(current);
        }
        let members: Vec<OperatorId> = shapes.values().flatten().copied().collect();
        let mut members = members;
        members.sort_unstable();
        let active = self.builder.group(self.step, &members, Family::Numeric);
        let stay: Shape = vec![(variable, 1)];
        let base =
            if shapes.keys().all(|shape| *shape == stay) { current } else { self.base(&shapes, &current)? };
        let width = width(range.low, range.high) + 1;
        let quantity = |operator: &Operator| own(operator).into_iter().map(|value| value.quantity).collect();
        Some(self.plus_quantities(base, &members, &quantity, active, width))
    }

    /// The part of the next value that depends on the present ones, by the shape of the effect at the step.
    fn base(&mut self, shapes: &BTreeMap<Shape, Vec<OperatorId>>, current: &Bits) -> Option<Bits> {
        let mut options = Vec::new();
        let mut length = current.len();
        let mut changing = Vec::new();
        for (shape, members) in shapes {
            let group = self.builder.group(self.step, members, Family::Numeric);
            let bits = weighted(&mut self.builder.formula, shape, self.numbers, self.ranges)?;
            length = length.max(bits.len());
            changing.push(group);
            options.push((group, bits));
        }
        let base: Bits = (0..length)
            .map(|_| {
                let bit = dense(self.builder.formula.variables());
                self.builder.formula.fresh(VariableMeaning::Bit { bit })
            })
            .collect();
        for (group, bits) in options {
            Arithmetic { formula: &mut self.builder.formula, family: Family::Numeric }
                .equal_if(group, &base, &bits);
        }
        let unchanged = self.builder.formula.fresh(VariableMeaning::Ladder);
        self.builder.formula.add(Family::Numeric, changing.into_iter().chain([unchanged]));
        Arithmetic { formula: &mut self.builder.formula, family: Family::Numeric }
            .equal_if(unchanged, &base, current);
        Some(base)
    }

    /// Adds what the operators' quantities contribute: one number for their constants, one for each table.
    fn plus_quantities(
        &mut self,
        base: Bits,
        members: &[OperatorId],
        quantities: &dyn Fn(&Operator) -> Vec<Quantity<Int>>,
        active: Lit,
        width: usize,
    ) -> Bits {
        let is_member = |id: &OperatorId| members.binary_search(id).is_ok();
        let mut constants: BTreeMap<Int, Vec<OperatorId>> = BTreeMap::new();
        let mut tables: BTreeMap<TableKey, Vec<OperatorId>> = BTreeMap::new();
        for (id, _) in self.builder.variables.operators[self.step].iter().filter(|(id, _)| is_member(id)) {
            let operator = &self.builder.task.operators[id.index()];
            for quantity in quantities(operator) {
                constants.entry(quantity.constant).or_default().push(*id);
                for table in &quantity.tables {
                    let entries = combinations(operator, &table.slots);
                    tables.entry((entries, table.values.clone())).or_default().push(*id);
                }
            }
        }
        let mut own = Premises::new();
        for (constant, members) in constants {
            own.push((vec![self.builder.group(self.step, &members, Family::Numeric)], constant));
        }
        let mut by_slots: BTreeMap<Vec<usize>, (Vec<Lit>, Premises)> = BTreeMap::new();
        for ((entries, values), members) in tables {
            let group = self.builder.group(self.step, &members, Family::Numeric);
            let slots = entries
                .first()
                .map(|entry| entry.iter().map(|(slot, _)| *slot).collect())
                .unwrap_or_default();
            let (groups, premises) = by_slots.entry(slots).or_default();
            groups.push(group);
            for (entry, value) in entries.iter().zip(values.iter()) {
                let designs = entry
                    .iter()
                    .map(|(slot, design)| self.builder.variables.designs[self.step][*slot][*design]);
                premises.push((designs.chain([group]).collect(), *value));
            }
        }
        let mut sum = self.add_source(base, &own, active, width);
        for (groups, premises) in by_slots.into_values() {
            let meaning = VariableMeaning::Ladder;
            let any = self.builder.formula.any(Family::Numeric, meaning, &groups);
            if let [_, _, ..] = groups[..] {
                self.builder.formula.add(Family::Numeric, groups.iter().copied().chain([!any]));
            }
            sum = self.add_source(sum, &premises, any, width);
        }
        sum
    }

    fn add_source(&mut self, base: Bits, premises: &[(Vec<Lit>, Int)], active: Lit, width: usize) -> Bits {
        let mut arithmetic = Arithmetic { formula: &mut self.builder.formula, family: Family::Numeric };
        let more = arithmetic.choose(premises, active);
        if more.iter().all(|bit| *bit == !Formula::truth()) {
            return base;
        }
        arithmetic.add(&base, &more, width)
    }

    /// The numeric conditions of the operators at a step.
    #[expect(clippy::arithmetic_side_effects, reason = "widths of numbers of 128 bits")]
    fn comparisons(&mut self, next: &[Bits]) -> Option<()> {
        for index in 0..self.builder.variables.operators[self.step].len() {
            let (id, literal) = self.builder.variables.operators[self.step][index];
            let operator = &self.builder.task.operators[id.index()];
            for comparison in &operator.condition.comparisons {
                if let Some(effect) =
                    operator.numeric_effects.iter().find(|effect| effect.value == *comparison)
                    && let Some(sign) = next[effect.variable.index()].last()
                {
                    self.builder.formula.add(Family::Numeric, [!literal, !*sign]);
                }
            }
        }
        let remaining = |operator: &Operator| -> Vec<(usize, Linear<Int>)> {
            let assigned =
                |c: &&Linear<Int>| operator.numeric_effects.iter().any(|effect| effect.value == **c);
            operator.condition.comparisons.iter().filter(|c| !assigned(c)).cloned().enumerate().collect()
        };
        let shapes = self.builder.partition(self.step, |operator| {
            remaining(operator)
                .into_iter()
                .map(|(position, linear)| (linear.coefficients, position))
                .collect()
        });
        for ((shape, position), members) in shapes {
            let group = self.builder.group(self.step, &members, Family::Numeric);
            let base = weighted(&mut self.builder.formula, &shape, self.numbers, self.ranges)?;
            let own = |operator: &Operator| -> Vec<Quantity<Int>> {
                let matching = remaining(operator)
                    .into_iter()
                    .filter(|(p, l)| *p == position && l.coefficients == shape);
                matching.map(|(_, linear)| linear.quantity).collect()
            };
            let values = members.iter().flat_map(|id| remaining(&self.builder.task.operators[id.index()]));
            let mut range = Range { low: 0, high: 0 };
            for (_, linear) in values {
                let own = linear_range(&linear, self.ranges)?;
                range = Range { low: range.low.min(own.low), high: range.high.max(own.high) };
            }
            let width = width(range.low, range.high).max(base.len()) + 2;
            let sum = self.plus_quantities(base, &members, &own, group, width);
            if let Some(sign) = sum.last() {
                self.builder.formula.add(Family::Numeric, [!group, !*sign]);
            }
        }
        Some(())
    }
}

/// A sum of multiples of numbers.
#[expect(clippy::arithmetic_side_effects, reason = "widths of numbers of 128 bits")]
fn weighted(formula: &mut Formula, shape: &Shape, numbers: &[Bits], ranges: &[Range]) -> Option<Bits> {
    let linear = Linear { coefficients: shape.clone(), quantity: Quantity::constant(0) };
    let range = linear_range(&linear, ranges)?;
    let width = width(range.low, range.high) + 2;
    let mut sum: Option<Bits> = None;
    let mut arithmetic = Arithmetic { formula, family: Family::Numeric };
    for (variable, factor) in shape {
        let multiple = arithmetic.multiple(&numbers[variable.index()], *factor, width);
        sum = Some(match sum {
            None => multiple,
            Some(sum) => arithmetic.add(&sum, &multiple, width),
        });
    }
    Some(sum.unwrap_or_else(|| Arithmetic::constant(0, 1)))
}

/// Whether an expression that mentions no designs is at least 0; none if its numbers do not fit.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "widths of numbers of 128 bits; a number has a bit at least"
)]
pub(super) fn is_at_least_zero(
    formula: &mut Formula,
    linear: &Linear<Int>,
    numbers: &[Bits],
    family: Family,
) -> Option<Lit> {
    let ranges: Vec<Range> = numbers
        .iter()
        .map(|bits| {
            // A number of so many bits is not larger, and `next_ranges` admits none of more.
            let limit: Int = 1 << bits.len().saturating_sub(1).min(126);
            Range { low: -limit, high: limit }
        })
        .collect();
    let base = weighted(formula, &linear.coefficients, numbers, &ranges)?;
    let range = linear_range(linear, &ranges)?;
    let width = width(range.low, range.high).max(base.len()) + 2;
    let mut arithmetic = Arithmetic { formula, family };
    let sum = arithmetic.add(&base, &Arithmetic::constant(linear.quantity.constant, width), width);
    Some(sum.last().map_or(Formula::truth(), |sign| !*sign))
}

/// None if it exceeds what the formula has bits for.
fn linear_range(linear: &Linear<Int>, ranges: &[Range]) -> Option<Range> {
    let (mut low, mut high) = (linear.quantity.minimum(), linear.quantity.maximum());
    for (variable, factor) in &linear.coefficients {
        let range = ranges[variable.index()];
        let (a, b) = (factor.checked_mul(range.low)?, factor.checked_mul(range.high)?);
        low = low.checked_add(a.min(b))?;
        high = high.checked_add(a.max(b))?;
    }
    (low >= -GROWTH_LIMIT && high <= GROWTH_LIMIT).then_some(Range { low, high })
}
