//! Encodes the accumulated cost and the values of the numeric variables after each step, in binary.
//!
//! All numbers are in two's complement. To the cost and to each number, an operator adds a constant and one
//! entry of each of its tables; the designs chosen at the step select the entries. An assignment adds these
//! summands to 0 instead of the previous value. No result overflows (a partial sum may wrap around): the
//! accumulated cost is limited after each step, and each number is wide enough for its range after all steps of
//! the formula.

use std::collections::BTreeMap;

use crate::clausal::binary::{Bits, sign, width};
use crate::clausal::formula::Formula;
use crate::clausal::literal::Literal;
use crate::clausal::timeline::Timeline;
use crate::integer::Integer;
use crate::model::{Linear, Model, Operator, Quantity};
use crate::table::is_alone;

const WIDTH_LIMIT: usize = 4_096;

pub(super) struct Sums {
    spent: Bits,
    /// The claimed cost minus 1.
    limit: Integer,
    numbers: Vec<Bits>,
}

enum Change<'c> {
    Add(&'c Quantity),
    Assign(&'c Quantity),
}

fn change(operator: &Operator, number: u32) -> Result<Option<Change<'_>>, String> {
    let mut changes = operator.changes.iter().filter(|(changed, _)| *changed == number);
    let Some((_, value)) = changes.next() else { return Ok(None) };
    match &value.factors[..] {
        _ if changes.next().is_some() => Err("an operator that changes a number twice is not covered".into()),
        [] => Ok(Some(Change::Assign(&value.quantity))),
        _ if is_alone(value, number) => Ok(Some(Change::Add(&value.quantity))),
        _ => Err("a change by other numbers is not covered".into()),
    }
}

fn comparisons(model: &Model) -> impl Iterator<Item = &Linear> {
    let conditions = model.operators.iter().map(|operator| &operator.condition).chain([&model.goal]);
    conditions.flat_map(|condition| &condition.comparisons)
}

/// Returns a number of bits that suffices for a numeric variable: for its values after up to
/// `steps` steps, and for sums in comparisons.
fn number_width(model: &Model, number: u32, steps: usize) -> Result<usize, String> {
    let initial = &model.numbers[number as usize];
    let (mut least, mut greatest) = (initial.clone(), initial.clone());
    let (mut falls, mut rises) = (Integer::ZERO, Integer::ZERO);
    for operator in &model.operators {
        match change(operator, number)? {
            Some(Change::Assign(value)) => {
                least = least.min(model.least(value));
                greatest = greatest.max(model.most(value));
            }
            Some(Change::Add(value)) => {
                falls = falls.min(model.least(value));
                rises = rises.max(model.most(value));
            }
            None => {}
        }
    }
    let steps = Integer::from(steps as i128);
    least = &least + &(&falls * &steps);
    greatest = &greatest + &(&rises * &steps);
    let compared =
        comparisons(model).filter(|linear| linear.factors.iter().any(|(factor, _)| *factor == number));
    let sizes = compared.map(|linear| {
        let quantity = &linear.quantity;
        &(-&model.least(quantity)).max(model.most(quantity)) + &Integer::from(1)
    });
    let margin = sizes.max().unwrap_or_default();
    Ok(width(&(&least - &margin), &(&greatest + &margin)))
}

impl Sums {
    pub(super) fn new(
        model: &Model,
        formula: &mut Formula,
        cost: &Integer,
        steps: usize,
    ) -> Result<Self, String> {
        let limit = cost - &Integer::from(1);
        let dearest = model.operators.iter().map(|operator| model.most(&operator.cost)).max();
        if model.operators.iter().any(|operator| model.least(&operator.cost).is_negative()) {
            return Err("operators that cost less than nothing are not covered".into());
        }
        let highest = &limit + &dearest.unwrap_or_default();
        let spent = formula.constant(&Integer::ZERO, width(&Integer::ZERO, &highest));
        let mut numbers = Vec::new();
        for (number, initial) in (0..).zip(&model.numbers) {
            numbers.push(formula.constant(initial, number_width(model, number, steps)?));
        }
        let sums = Self { spent, limit, numbers };
        if sums.widest() > WIDTH_LIMIT {
            return Err(format!("numbers of more than {WIDTH_LIMIT} bits are not covered"));
        }
        Ok(sums)
    }

    pub(super) fn widest(&self) -> usize {
        self.numbers.iter().chain([&self.spent]).map(Vec::len).max().unwrap_or(0)
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "a row and its parts are below the size of a table, see `references`"
    )]
    pub(super) fn advance(
        &mut self,
        model: &Model,
        formula: &mut Formula,
        timeline: &Timeline,
        step: usize,
    ) -> Result<(), String> {
        let mut adder = Adder { model, timeline, step: step + 1 };
        let costs: Vec<_> = model.operators.iter().map(|operator| Some(&operator.cost)).collect();
        self.spent = adder.sum(formula, &self.spent, &costs, "what is spent");
        formula.at_most(&[], &self.spent, &self.limit);
        let before = self.numbers.clone();
        for (number, bits) in (0..).zip(&mut self.numbers) {
            *bits = adder.change(formula, bits, number)?;
        }
        for (operator, literal) in model.operators.iter().zip(&timeline.operators) {
            for linear in &operator.condition.comparisons {
                let [(number, factor)] = &linear.factors[..] else {
                    return Err("a comparison of several numbers, or of none, is not covered".into());
                };
                if operator.changes.iter().any(|(changed, value)| changed == number && value == linear) {
                    // The operator changes the number to the expression that must be at least 0. So the
                    // condition is that the number is not negative after the step, which its sign bit states.
                    let after = &self.numbers[*number as usize];
                    formula.clause(&[-*literal, -sign(after)]);
                } else if linear.quantity.tables.is_empty() {
                    let guarded = (&[*literal][..], &before[*number as usize]);
                    compare(formula, guarded, factor, &linear.quantity.constant);
                } else if !is_alone(linear, *number) {
                    return Err("a comparison of a multiple with designs is not covered".into());
                }
            }
        }
        adder.tests(formula, &before);
        Ok(())
    }

    pub(super) fn goal(&self, model: &Model, formula: &mut Formula) -> Result<(), String> {
        for linear in &model.goal.comparisons {
            match &linear.factors[..] {
                [(number, factor)] if linear.quantity.tables.is_empty() => {
                    let unguarded = (&[][..], &self.numbers[*number as usize]);
                    compare(formula, unguarded, factor, &linear.quantity.constant);
                }
                _ => return Err("a goal about several numbers is not covered".into()),
            }
        }
        Ok(())
    }
}

/// Encodes that `factor` times the number plus `constant` is at least 0 if all literals of
/// `condition` hold.
fn compare(
    formula: &mut Formula,
    (condition, number): (&[Literal], &Bits),
    factor: &Integer,
    constant: &Integer,
) {
    if factor.is_positive() {
        formula.at_least(condition, number, &-&constant.div_floor(factor));
    } else if factor.is_negative() {
        formula.at_most(condition, number, &constant.div_floor(&-factor));
    } else if constant.is_negative() {
        formula.clause(&condition.iter().map(|literal| -*literal).collect::<Vec<_>>());
    }
}

/// Key of a table lookup: index of an operator's list of slots ([`Model::uses`]), slots that select
/// the row, and index of the table.
type Kind<'k> = (u32, &'k [u32], u32);

struct Adder<'a> {
    model: &'a Model,
    timeline: &'a Timeline,
    step: usize,
}

impl Adder<'_> {
    fn change(&mut self, formula: &mut Formula, before: &Bits, number: u32) -> Result<Bits, String> {
        let changes: Vec<Option<Change<'_>>> =
            self.model.operators.iter().map(|operator| change(operator, number)).collect::<Result<_, _>>()?;
        let name = format!("number {number}");
        let mut base = before.clone();
        if changes.iter().flatten().any(|change| matches!(change, Change::Assign(_))) {
            let assigned = formula.variable(|| format!("{name} is assigned at step {}", self.step));
            for (operator, change) in self.timeline.operators.iter().zip(&changes) {
                let assigns = matches!(change, Some(Change::Assign(_)));
                formula.clause(&[-*operator, if assigns { assigned } else { -assigned }]);
            }
            if let Some(idle) = self.timeline.idle {
                formula.clause(&[-idle, -assigned]);
            }
            base = formula.bits(before.len(), &format!("what is kept of {name} at step {}", self.step));
            // An assignment adds its value to 0, every other change to the previous value.
            for (kept, bit) in base.iter().zip(before) {
                formula.clause(&[-assigned, -*kept]);
                formula.clause(&[assigned, -*kept, *bit]);
                formula.clause(&[assigned, *kept, -*bit]);
            }
        }
        let parts: Vec<Option<&Quantity>> = changes
            .iter()
            .map(|change| match change {
                Some(Change::Add(value) | Change::Assign(value)) => Some(*value),
                None => None,
            })
            .collect();
        Ok(self.sum(formula, &base, &parts, &name))
    }

    /// Encodes the operators' comparisons that contain tables, as sums that must not be negative. A comparison
    /// is omitted if its expression is the new value of the number, because the sign bit of this value is
    /// tested instead (see [`Sums::advance`]).
    fn tests(&mut self, formula: &mut Formula, before: &[Bits]) {
        let table_comparisons = |operator: &Operator, number: u32| -> Vec<Linear> {
            let linear_conditions = operator.condition.comparisons.iter().filter(|linear| {
                is_alone(linear, number)
                    && !linear.quantity.tables.is_empty()
                    && !operator.changes.iter().any(|(changed, value)| *changed == number && value == *linear)
            });
            linear_conditions.cloned().collect()
        };
        for (number, bits) in (0..).zip(before) {
            let comparisons: Vec<Vec<Linear>> =
                self.model.operators.iter().map(|operator| table_comparisons(operator, number)).collect();
            let count = comparisons.iter().map(Vec::len).max().unwrap_or(0);
            for place in 0..count {
                let parts: Vec<Option<&Quantity>> =
                    comparisons.iter().map(|list| list.get(place).map(|linear| &linear.quantity)).collect();
                let sum = self.sum(formula, bits, &parts, &format!("comparison {place} of number {number}"));
                for (operator, _) in
                    self.timeline.operators.iter().zip(&parts).filter(|(_, part)| part.is_some())
                {
                    formula.clause(&[-*operator, -sign(&sum)]);
                }
            }
        }
    }

    /// Encodes `base` plus the quantity that the operator of this step adds, and returns the bits
    /// of the sum. `parts` contains the quantity of each operator; `None` adds nothing.
    fn sum(&mut self, formula: &mut Formula, base: &Bits, parts: &[Option<&Quantity>], name: &str) -> Bits {
        let step = self.step;
        let constants = parts.iter().map(|part| part.map_or(&Integer::ZERO, |quantity| &quantity.constant));
        let mut kinds: BTreeMap<&Integer, Vec<Literal>> = BTreeMap::new();
        for (literal, constant) in self.timeline.operators.iter().zip(constants) {
            kinds.entry(constant).or_default().push(*literal);
        }
        let mut sum = base.clone();
        // If all constants are zero, no adder is needed.
        if kinds.keys().any(|constant| !constant.is_zero()) {
            kinds.entry(&Integer::ZERO).or_default().extend(self.timeline.idle);
            let added = formula.bits(base.len(), &format!("the constant added to {name} at step {step}"));
            for (constant, operators) in kinds {
                let kind = formula.variable(|| format!("{constant} is added to {name} at step {step}"));
                for operator in operators {
                    formula.clause(&[-operator, kind]);
                }
                for (position, bit) in added.iter().enumerate() {
                    formula.clause(&[-kind, if constant.bit(position) { *bit } else { -*bit }]);
                }
            }
            sum = formula.add(&sum, &added, &format!("{name} with the constant of step {step}"));
        }
        let tables = parts.iter().flatten().map(|quantity| quantity.tables.len()).max().unwrap_or(0);
        for place in 0..tables {
            let added = self.table(formula, parts, place, (base.len(), name));
            sum = formula.add(&sum, &added, &format!("{name} with table {place} of step {step}"));
        }
        sum
    }

    #[expect(
        clippy::arithmetic_side_effects,
        clippy::cast_possible_truncation,
        reason = "a row and its parts are below the size of a table, see `references`"
    )]
    fn table(
        &mut self,
        formula: &mut Formula,
        parts: &[Option<&Quantity>],
        place: usize,
        (width, name): (usize, &str),
    ) -> Bits {
        let step = self.step;
        let added = formula.bits(width, &format!("table {place} added to {name} at step {step}"));
        let mut kinds: BTreeMap<Option<Kind<'_>>, Vec<Literal>> = BTreeMap::new();
        for ((operator, literal), part) in
            self.model.operators.iter().zip(&self.timeline.operators).zip(parts)
        {
            let table = part.and_then(|quantity| quantity.tables.get(place));
            let kind = table.map(|(slots, table)| (operator.uses, slots.as_slice(), *table));
            kinds.entry(kind).or_default().push(*literal);
        }
        kinds.entry(None).or_default().extend(self.timeline.idle);
        for (kind, operators) in kinds {
            let Some((uses, slots, table)) = kind else {
                for operator in operators {
                    for bit in &added {
                        formula.clause(&[-operator, -*bit]);
                    }
                }
                continue;
            };
            let chosen = formula.variable(|| format!("table {table} is added to {name} at step {step}"));
            for operator in operators {
                formula.clause(&[-operator, chosen]);
            }
            let uses = &self.model.uses[uses as usize];
            for (row, value) in self.model.tables[table as usize].iter().enumerate() {
                // The row number has one digit per slot (mixed radix): the design of the slot. The last slot is
                // the lowest digit.
                let mut remaining_row = row;
                let mut condition = vec![-chosen];
                for slot in slots.iter().rev() {
                    let size = uses[*slot as usize].1.len();
                    condition.push(-self.timeline.design(uses, *slot, (remaining_row % size) as u32));
                    remaining_row /= size;
                }
                for (position, bit) in added.iter().enumerate() {
                    let literal = if value.bit(position) { *bit } else { -*bit };
                    formula.clause(&[&condition[..], &[literal]].concat());
                }
            }
        }
        added
    }
}
