//! Numeric variables, exact, in binary.
//!
//! At every step an effect `x := Σ f·y + q` of the operator there gives the next value, where q is a constant plus
//! tables of designs; what no operator changes stays. A condition `Σ f·y + q ≥ 0` asks for the sign bit of its sum to be 0
//! whenever its operator is there. Where a condition is the very value that an effect of the same operator assigns (a battery that
//! must not fall below 0), the sign bit of the next value serves.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::encode::Encoding;
use crate::encode::arithmetic::{Arithmetic, Bits, width};
use crate::encode::cost::combinations;
use crate::encode::formula::{Family, Formula};
use crate::limits::Limits;
use crate::number::{GROWTH_LIMIT, Int, dense};
use crate::quantity::{Linear, Quantity};
use crate::sat::Lit;
use crate::task::{NumericId, Operator, OperatorId};

/// Conjunctions, each with the number that it stands for.
type Premises = Vec<(Vec<Lit>, Int)>;

/// Factors of numeric variables.
type Shape = Vec<(NumericId, Int)>;

/// The values that a number can have.
#[derive(Debug, Clone, Copy)]
struct Range {
    low: Int,
    high: Int,
}

impl Encoding<'_> {
    /// Encodes all numeric variables; returns their values before each step and after the last one. None if a limit was
    /// reached meanwhile.
    pub(super) fn numeric(&mut self, limits: &Limits) -> Option<Vec<Vec<Bits>>> {
        let task = self.task;
        let mut ranges: Vec<Range> =
            task.initial.numbers.iter().map(|n| Range { low: *n, high: *n }).collect();
        let mut numbers: Vec<Bits> =
            task.initial.numbers.iter().map(|n| Arithmetic::constant(*n, width(*n, *n))).collect();
        let mut all = vec![numbers.clone()];
        for step in 0..self.horizon {
            if limits.reached() {
                return None;
            }
            let next_ranges = self.next_ranges(step, &ranges)?;
            let mut next = Vec::with_capacity(numbers.len());
            for (range, variable) in next_ranges.iter().zip((0..).map(NumericId)) {
                next.push(self.next_number(step, variable, &numbers, *range, &ranges)?);
            }
            self.comparisons(step, &numbers, &next, &ranges)?;
            (numbers, ranges) = (next, next_ranges);
            all.push(numbers.clone());
        }
        Some(all)
    }

    /// None if a number can grow beyond what the formula has bits for.
    fn next_ranges(&self, step: usize, ranges: &[Range]) -> Option<Vec<Range>> {
        let mut next = ranges.to_vec();
        for (id, _) in &self.operators[step] {
            for effect in &self.task.operators[id.index()].numeric_effects {
                let range = linear_range(&effect.value, ranges)?;
                let slot = &mut next[effect.variable.index()];
                *slot = Range { low: slot.low.min(range.low), high: slot.high.max(range.high) };
            }
        }
        Some(next)
    }

    #[expect(clippy::arithmetic_side_effects, reason = "widths of numbers of 128 bits")]
    fn next_number(
        &mut self,
        step: usize,
        variable: NumericId,
        numbers: &[Bits],
        range: Range,
        ranges: &[Range],
    ) -> Option<Bits> {
        let own = |operator: &Operator| -> Vec<Linear<Int>> {
            let effects = operator.numeric_effects.iter().filter(|effect| effect.variable == variable);
            effects.map(|effect| effect.value.clone()).collect()
        };
        let shapes = self
            .partition(step, |operator| own(operator).into_iter().map(|value| value.coefficients).collect());
        let current = numbers[variable.index()].clone();
        if shapes.is_empty() {
            return Some(current);
        }
        let members: Vec<OperatorId> = shapes.values().flatten().copied().collect();
        let mut members = members;
        members.sort_unstable();
        let active = self.group(step, &members, Family::Numeric);
        let stay: Shape = vec![(variable, 1)];
        let base = if shapes.keys().all(|shape| *shape == stay) {
            current
        } else {
            self.base(step, &shapes, &current, numbers, ranges)?
        };
        let width = width(range.low, range.high) + 1;
        let quantity = |operator: &Operator| own(operator).into_iter().map(|value| value.quantity).collect();
        Some(self.plus_quantities(step, base, &members, &quantity, active, width))
    }

    /// The part of the next value that depends on the present ones, by the shape of the effect at the step.
    fn base(
        &mut self,
        step: usize,
        shapes: &BTreeMap<Shape, Vec<OperatorId>>,
        current: &Bits,
        numbers: &[Bits],
        ranges: &[Range],
    ) -> Option<Bits> {
        let mut options = Vec::new();
        let mut length = current.len();
        let mut changing = Vec::new();
        for (shape, members) in shapes {
            let group = self.group(step, members, Family::Numeric);
            let bits = self.weighted(shape, numbers, ranges)?;
            length = length.max(bits.len());
            changing.push(group);
            options.push((group, bits));
        }
        let base: Bits = (0..length)
            .map(|_| {
                let bit = dense(self.formula.variables());
                self.formula.fresh(crate::encode::formula::Meaning::Bit { bit })
            })
            .collect();
        for (group, bits) in options {
            Arithmetic { formula: &mut self.formula, family: Family::Numeric }.equal_if(group, &base, &bits);
        }
        let unchanged = self.formula.fresh(crate::encode::formula::Meaning::Ladder);
        self.formula.add(Family::Numeric, changing.into_iter().chain([unchanged]));
        Arithmetic { formula: &mut self.formula, family: Family::Numeric }
            .equal_if(unchanged, &base, current);
        Some(base)
    }

    #[expect(clippy::arithmetic_side_effects, reason = "widths of numbers of 128 bits")]
    fn weighted(&mut self, shape: &Shape, numbers: &[Bits], ranges: &[Range]) -> Option<Bits> {
        let linear = Linear { coefficients: shape.clone(), quantity: Quantity::constant(0) };
        let range = linear_range(&linear, ranges)?;
        let width = width(range.low, range.high) + 2;
        let mut sum: Option<Bits> = None;
        let mut arithmetic = Arithmetic { formula: &mut self.formula, family: Family::Numeric };
        for (variable, factor) in shape {
            let multiple = arithmetic.multiple(&numbers[variable.index()], *factor, width);
            sum = Some(match sum {
                None => multiple,
                Some(sum) => arithmetic.add(&sum, &multiple, width),
            });
        }
        Some(sum.unwrap_or_else(|| Arithmetic::constant(0, 1)))
    }

    /// Adds what the operators' quantities contribute: one number for their constants, one for each table.
    fn plus_quantities(
        &mut self,
        step: usize,
        base: Bits,
        members: &[OperatorId],
        quantities: &dyn Fn(&Operator) -> Vec<Quantity<Int>>,
        active: Lit,
        width: usize,
    ) -> Bits {
        let is_member = |id: &OperatorId| members.binary_search(id).is_ok();
        let mut constants: BTreeMap<Int, Vec<OperatorId>> = BTreeMap::new();
        let mut tables: BTreeMap<TableKey, Vec<OperatorId>> = BTreeMap::new();
        for (id, _) in self.operators[step].iter().filter(|(id, _)| is_member(id)) {
            let operator = &self.task.operators[id.index()];
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
            own.push((vec![self.group(step, &members, Family::Numeric)], constant));
        }
        let mut by_slots: BTreeMap<Vec<usize>, (Vec<Lit>, Premises)> = BTreeMap::new();
        for ((entries, values), members) in tables {
            let group = self.group(step, &members, Family::Numeric);
            let slots = entries
                .first()
                .map(|entry| entry.iter().map(|(slot, _)| *slot).collect())
                .unwrap_or_default();
            let (groups, premises) = by_slots.entry(slots).or_default();
            groups.push(group);
            for (entry, value) in entries.iter().zip(values.iter()) {
                let designs = entry.iter().map(|(slot, design)| self.designs[step][*slot][*design]);
                premises.push((designs.chain([group]).collect(), *value));
            }
        }
        let mut sum = self.add_source(base, &own, active, width);
        for (groups, premises) in by_slots.into_values() {
            let meaning = crate::encode::formula::Meaning::Ladder;
            let any = self.formula.any(Family::Numeric, meaning, &groups);
            if let [_, _, ..] = groups[..] {
                self.formula.add(Family::Numeric, groups.iter().copied().chain([!any]));
            }
            sum = self.add_source(sum, &premises, any, width);
        }
        sum
    }

    fn add_source(&mut self, base: Bits, premises: &[(Vec<Lit>, Int)], active: Lit, width: usize) -> Bits {
        let mut arithmetic = Arithmetic { formula: &mut self.formula, family: Family::Numeric };
        let more = arithmetic.choose(premises, active);
        if more.iter().all(|bit| *bit == !Formula::truth()) {
            return base;
        }
        arithmetic.add(&base, &more, width)
    }

    /// The numeric conditions of the operators at a step.
    #[expect(clippy::arithmetic_side_effects, reason = "widths of numbers of 128 bits")]
    fn comparisons(&mut self, step: usize, numbers: &[Bits], next: &[Bits], ranges: &[Range]) -> Option<()> {
        for index in 0..self.operators[step].len() {
            let (id, literal) = self.operators[step][index];
            let operator = &self.task.operators[id.index()];
            for comparison in &operator.condition.comparisons {
                if let Some(effect) =
                    operator.numeric_effects.iter().find(|effect| effect.value == *comparison)
                    && let Some(sign) = next[effect.variable.index()].last()
                {
                    self.formula.add(Family::Numeric, [!literal, !*sign]);
                }
            }
        }
        let remaining = |operator: &Operator| -> Vec<(usize, Linear<Int>)> {
            let assigned =
                |c: &&Linear<Int>| operator.numeric_effects.iter().any(|effect| effect.value == **c);
            operator.condition.comparisons.iter().filter(|c| !assigned(c)).cloned().enumerate().collect()
        };
        let shapes = self.partition(step, |operator| {
            remaining(operator)
                .into_iter()
                .map(|(position, linear)| (linear.coefficients, position))
                .collect()
        });
        for ((shape, position), members) in shapes {
            let group = self.group(step, &members, Family::Numeric);
            let base = self.weighted(&shape, numbers, ranges)?;
            let own = |operator: &Operator| -> Vec<Quantity<Int>> {
                let matching = remaining(operator)
                    .into_iter()
                    .filter(|(p, l)| *p == position && l.coefficients == shape);
                matching.map(|(_, linear)| linear.quantity).collect()
            };
            let values = members.iter().flat_map(|id| remaining(&self.task.operators[id.index()]));
            let mut range = Range { low: 0, high: 0 };
            for (_, linear) in values {
                let own = linear_range(&linear, ranges)?;
                range = Range { low: range.low.min(own.low), high: range.high.max(own.high) };
            }
            let width = width(range.low, range.high).max(base.len()) + 2;
            let sum = self.plus_quantities(step, base, &members, &own, group, width);
            if let Some(sign) = sum.last() {
                self.formula.add(Family::Numeric, [!group, !*sign]);
            }
        }
        Some(())
    }

    /// The numeric part of the goal; none if its numbers do not fit.
    pub(super) fn numeric_goal(&mut self, numbers: &[Bits]) -> Option<()> {
        for comparison in &self.task.goal.comparisons {
            let holds = self.is_at_least_zero(comparison, numbers, Family::Goal)?;
            self.formula.add(Family::Goal, [holds]);
        }
        Some(())
    }

    /// Whether an expression that mentions no designs is at least 0; none if its numbers do not fit.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "widths of numbers of 128 bits; a number has a bit at least"
    )]
    pub(super) fn is_at_least_zero(
        &mut self,
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
        let base = self.weighted(&linear.coefficients, numbers, &ranges)?;
        let range = linear_range(linear, &ranges)?;
        let width = width(range.low, range.high).max(base.len()) + 2;
        let mut arithmetic = Arithmetic { formula: &mut self.formula, family };
        let sum = arithmetic.add(&base, &Arithmetic::constant(linear.quantity.constant, width), width);
        Some(sum.last().map_or(Formula::truth(), |sign| !*sign))
    }
}

/// The combinations of a table in the task's numbering, and its values.
type TableKey = (Vec<Vec<(usize, usize)>>, Arc<[Int]>);

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
