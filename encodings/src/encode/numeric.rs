//! Clauses for exact numeric variables in binary arithmetic.
//!
//! At every step, an effect `x := Σ f·y + q` of the operator at the step determines the next value.
//! Here x and y are numeric variables, f are constant factors, and q is a constant plus entries of
//! tables, which are selected by designs. Numbers that no operator changes keep their values. A
//! condition `Σ f·y + q ≥ 0` requires the sign bit of the sum to be 0 if its operator is executed. If a
//! condition has the same expression as an effect of the same operator (a battery that must not fall
//! below 0), the sign bit of the next value is used instead.

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

/// Conjunctions of literals, each with the number that is selected if the conjunction is true.
type Premises = Vec<(Vec<Lit>, Int)>;

type Shape = Vec<(NumericId, Int)>;

/// Identity of a table: combinations of (slot, design) in the numbering of the task, and the value
/// of each.
type TableKey = (Vec<Vec<(usize, usize)>>, Arc<[Int]>);

#[derive(Debug, Clone, Copy)]
struct Range {
    low: Int,
    high: Int,
}

/// Encodes all numeric variables. Returns their bits before each step and after the last step. Returns `None` if a
/// limit is reached, there are too many clauses, or a number can exceed the available bits.
pub(super) fn numeric(builder: &mut Builder<'_>) -> Option<Vec<Vec<Bits>>> {
    let initial = &builder.task.initial.numbers;
    let mut ranges: Vec<Range> = initial.iter().map(|n| Range { low: *n, high: *n }).collect();
    let numbers: Vec<Bits> = initial.iter().map(|n| Arithmetic::constant(*n, width(*n, *n))).collect();
    let mut numbers_by_step = vec![numbers];
    for step in 0..builder.variables.horizon() {
        builder.check().ok()?;
        let numbers = numbers_by_step.last()?;
        let (next, next_ranges) = Transition { builder, step, numbers, ranges: &ranges }.encode()?;
        ranges = next_ranges;
        numbers_by_step.push(next);
    }
    Some(numbers_by_step)
}

struct Transition<'s, 'a> {
    builder: &'s mut Builder<'a>,
    step: usize,
    numbers: &'s [Bits],
    ranges: &'s [Range],
}

impl Transition<'_, '_> {
    fn encode(&mut self) -> Option<(Vec<Bits>, Vec<Range>)> {
        let ranges = self.next_ranges()?;
        let mut next = Vec::with_capacity(self.numbers.len());
        for (range, variable) in ranges.iter().zip((0..).map(NumericId)) {
            next.push(self.next_number(variable, *range)?);
        }
        self.comparisons(&next)?;
        Some((next, ranges))
    }

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
        let values_of = |operator: &Operator| -> Vec<Linear<Int>> {
            let effects = operator.numeric_effects.iter().filter(|effect| effect.variable == variable);
            effects.map(|effect| effect.value.clone()).collect()
        };
        let shapes = self.builder.partition(self.step, |operator| {
            values_of(operator).into_iter().map(|value| value.coefficients).collect()
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
        let quantity =
            |operator: &Operator| values_of(operator).into_iter().map(|value| value.quantity).collect();
        Some(self.plus_quantities(base, &members, &quantity, active, width))
    }

    /// Returns the part of the next value that depends on present values: the linear combination of the
    /// effect at the step, or `current` if no operator changes the number. `shapes` groups the operators by
    /// their linear combinations. Returns `None` if the part can exceed the available bits.
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
        // Without an operator that changes the number, the number keeps its value.
        let unchanged = self.builder.formula.fresh(VariableMeaning::Ladder);
        self.builder.formula.add(Family::Numeric, changing.into_iter().chain([unchanged]));
        Arithmetic { formula: &mut self.builder.formula, family: Family::Numeric }
            .equal_if(unchanged, &base, current);
        Some(base)
    }

    /// Adds the constants and table entries of the operators `members` to `base`: one summand for the
    /// constants, and one summand for the tables of each set of slots. `active` is true if a member is
    /// executed. The sum has `width` bits, or is `base` if nothing is added.
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
        let mut constant_premises = Premises::new();
        for (constant, members) in constants {
            constant_premises
                .push((vec![self.builder.group(self.step, &members, Family::Numeric)], constant));
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
        let mut sum = self.add_source(base, &constant_premises, active, width);
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
        let summand = arithmetic.choose(premises, active);
        if summand.iter().all(|bit| *bit == !Formula::truth()) {
            return base;
        }
        arithmetic.add(&base, &summand, width)
    }

    /// Adds clauses for the numeric conditions of the operators at the step. `next` has the bits of the
    /// numbers after the step. Returns `None` if a number can exceed the available bits.
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
            let quantities = |operator: &Operator| -> Vec<Quantity<Int>> {
                let matching = remaining(operator)
                    .into_iter()
                    .filter(|(p, l)| *p == position && l.coefficients == shape);
                matching.map(|(_, linear)| linear.quantity).collect()
            };
            let values = members.iter().flat_map(|id| remaining(&self.builder.task.operators[id.index()]));
            let mut range = Range { low: 0, high: 0 };
            for (_, linear) in values {
                let comparison_range = linear_range(&linear, self.ranges)?;
                range = Range {
                    low: range.low.min(comparison_range.low),
                    high: range.high.max(comparison_range.high),
                };
            }
            let width = width(range.low, range.high).max(base.len()) + 2;
            let sum = self.plus_quantities(base, &members, &quantities, group, width);
            if let Some(sign) = sum.last() {
                self.builder.formula.add(Family::Numeric, [!group, !*sign]);
            }
        }
        Some(())
    }
}

/// Returns the bits of a linear combination of numbers, or `None` if it can exceed the available
/// bits.
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

/// Returns a literal that is true exactly if a linear expression without tables is at least 0. Returns `None`
/// if numbers can exceed the available bits.
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
            // A two's complement number of n bits has an absolute value of at most 2^(n−1). The exponent can
            // be capped at 126, because `next_ranges` admits at most 2^124 (`GROWTH_LIMIT`).
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
