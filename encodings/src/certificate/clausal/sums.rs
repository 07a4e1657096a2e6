//! What is spent and what is left after each step, in binary.
//!
//! An operator adds a constant and entries of tables over its slots, all in two's complement; the bits of a summand are what
//! the chosen operator and designs make them. Nothing overflows: what is spent never exceeds the limit, and numbers
//! are as wide as they can get in so many steps.

use std::collections::BTreeMap;

use crate::certificate::clausal::binary::{Bits, bit, width};
use crate::certificate::clausal::formula::{Formula, Timeline, Var};
use crate::certificate::model::{Linear, Model, Operator, Quantity};
use crate::number::Int;

/// The sums after the latest step.
pub(super) struct Sums {
    spent: Bits,
    /// What may be spent at most.
    limit: i128,
    numbers: Vec<Bits>,
}

/// What an operator does to a number.
enum Change<'c> {
    Add(&'c Quantity),
    Assign(&'c Quantity),
}

fn change(operator: &Operator, number: u32) -> Result<Option<Change<'_>>, String> {
    let mut changes = operator.changes.iter().filter(|(own, _)| *own == number);
    let Some((_, value)) = changes.next() else { return Ok(None) };
    match &value.factors[..] {
        _ if changes.next().is_some() => Err("an operator that changes a number twice is not covered".into()),
        [] => Ok(Some(Change::Assign(&value.quantity))),
        [(own, 1)] if *own == number => Ok(Some(Change::Add(&value.quantity))),
        _ => Err("a change by other numbers is not covered".into()),
    }
}

/// All comparisons of a task.
fn comparisons(model: &Model) -> impl Iterator<Item = &Linear> {
    let conditions = model.operators.iter().map(|operator| &operator.condition).chain([&model.goal]);
    conditions.flat_map(|condition| &condition.comparisons)
}

/// How many bits a number needs for so many steps, and to be compared.
fn number_width(model: &Model, number: u32, steps: usize) -> Result<usize, String> {
    let initial = model.numbers[number as usize];
    let (mut least, mut most) = (initial, initial);
    let (mut falls, mut rises) = (0, 0);
    for operator in &model.operators {
        match change(operator, number)? {
            Some(Change::Assign(value)) => {
                least = least.min(model.least(value));
                most = most.max(model.most(value));
            }
            Some(Change::Add(value)) => {
                falls = falls.min(model.least(value));
                rises = rises.max(model.most(value));
            }
            None => {}
        }
    }
    let large = || "numbers that may become too large are not covered".to_owned();
    let after = |end: i128, each: i128| end.checked_add(each.checked_mul(steps as i128)?);
    least = after(least, falls).ok_or_else(large)?;
    most = after(most, rises).ok_or_else(large)?;
    let own = comparisons(model).filter(|linear| linear.factors.iter().any(|(own, _)| *own == number));
    let sizes = own.map(|linear| {
        let quantity = &linear.quantity;
        model.least(quantity).abs().max(model.most(quantity).abs()) + 1
    });
    let beside = sizes.max().unwrap_or(0);
    let ends = least.checked_sub(beside).zip(most.checked_add(beside));
    ends.map(|(least, most)| width(least, most)).ok_or_else(large)
}

impl Sums {
    pub(super) fn new(
        model: &Model,
        formula: &mut Formula,
        cost: i128,
        steps: usize,
    ) -> Result<Self, String> {
        let limit = cost.checked_sub(1).ok_or("a cost that is too small is not covered")?;
        let dearest = model.operators.iter().map(|operator| model.most(&operator.cost)).max().unwrap_or(0);
        if model.operators.iter().any(|operator| model.least(&operator.cost) < 0) {
            return Err("operators that cost less than nothing are not covered".into());
        }
        let spent = formula.constant(
            0,
            width(0, limit.checked_add(dearest).ok_or("costs that are too large are not covered")?),
        );
        let mut numbers = Vec::new();
        for (number, initial) in (0..).zip(&model.numbers) {
            let width = number_width(model, number, steps)?;
            numbers.push(formula.constant(*initial, width));
        }
        Ok(Self { spent, limit, numbers })
    }

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
        formula.at_most(&[], &self.spent, self.limit);
        let before = self.numbers.clone();
        for (number, bits) in (0..).zip(&mut self.numbers) {
            *bits = adder.change(formula, bits, number)?;
        }
        for (operator, own) in model.operators.iter().zip(&timeline.operators) {
            for linear in &operator.condition.comparisons {
                let [(number, factor)] = linear.factors[..] else {
                    return Err("a comparison of several numbers, or of none, is not covered".into());
                };
                if operator.changes.contains(&(number, linear.clone())) {
                    let after = &self.numbers[number as usize];
                    formula.clause(&[-own, -after[after.len() - 1]]);
                } else if linear.quantity.tables.is_empty() {
                    compare(formula, &[*own], &before[number as usize], factor, linear.quantity.constant);
                } else if factor != 1 {
                    return Err("a comparison of a multiple with designs is not covered".into());
                }
            }
        }
        adder.tests(formula, &before);
        Ok(())
    }

    pub(super) fn goal(&self, model: &Model, formula: &mut Formula) -> Result<(), String> {
        for linear in &model.goal.comparisons {
            match linear.factors[..] {
                [(number, factor)] if linear.quantity.tables.is_empty() => {
                    compare(formula, &[], &self.numbers[number as usize], factor, linear.quantity.constant);
                }
                _ => return Err("a goal about several numbers is not covered".into()),
            }
        }
        Ok(())
    }
}

/// Where a condition holds, a multiple of a number plus a constant is at least 0.
fn compare(formula: &mut Formula, condition: &[Var], number: &Bits, factor: Int, constant: Int) {
    let (factor, constant) = (factor, constant);
    match factor {
        0 if constant >= 0 => {}
        0 => formula.clause(&condition.iter().map(|literal| -literal).collect::<Vec<_>>()),
        1.. => formula.at_least(condition, number, -constant.div_euclid(factor)),
        _ => formula.at_most(condition, number, constant.div_euclid(-factor)),
    }
}

/// What an operator fills, the slots that a table is over, and the table.
type Kind<'k> = (u32, &'k [u32], u32);

struct Adder<'a> {
    model: &'a Model,
    timeline: &'a Timeline,
    step: usize,
}

impl Adder<'_> {
    /// A number after the step.
    fn change(&mut self, formula: &mut Formula, before: &Bits, number: u32) -> Result<Bits, String> {
        let changes: Vec<Option<Change<'_>>> =
            self.model.operators.iter().map(|operator| change(operator, number)).collect::<Result<_, _>>()?;
        let name = format!("number {number}");
        let mut base = before.clone();
        if changes.iter().flatten().any(|change| matches!(change, Change::Assign(_))) {
            let assigned = formula.variable(|| format!("{name} is assigned at step {}", self.step));
            for (own, change) in self.timeline.operators.iter().zip(&changes) {
                let assigns = matches!(change, Some(Change::Assign(_)));
                formula.clause(&[-own, if assigns { assigned } else { -assigned }]);
            }
            formula.clause(&[-self.timeline.idle, -assigned]);
            base = formula.bits(before.len(), &format!("what is kept of {name} at step {}", self.step));
            for (kept, bit) in base.iter().zip(before) {
                formula.clause(&[-assigned, -kept]);
                formula.clause(&[assigned, -kept, *bit]);
                formula.clause(&[assigned, *kept, -bit]);
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

    /// Comparisons with tables: sums of their own, which may not be negative.
    fn tests(&mut self, formula: &mut Formula, before: &[Bits]) {
        let asked = |operator: &Operator, number: u32| -> Vec<Linear> {
            let own = operator.condition.comparisons.iter().filter(|linear| {
                linear.factors == [(number, 1)]
                    && !linear.quantity.tables.is_empty()
                    && !operator.changes.contains(&(number, (*linear).clone()))
            });
            own.cloned().collect()
        };
        for (number, bits) in (0..).zip(before) {
            let all: Vec<Vec<Linear>> =
                self.model.operators.iter().map(|operator| asked(operator, number)).collect();
            let most = all.iter().map(Vec::len).max().unwrap_or(0);
            for place in 0..most {
                let parts: Vec<Option<&Quantity>> =
                    all.iter().map(|own| own.get(place).map(|linear| &linear.quantity)).collect();
                let sum = self.sum(formula, bits, &parts, &format!("comparison {place} of number {number}"));
                for (own, _) in self.timeline.operators.iter().zip(&parts).filter(|(_, part)| part.is_some())
                {
                    formula.clause(&[-own, -sum[sum.len() - 1]]);
                }
            }
        }
    }

    /// A number plus what each operator adds to it.
    fn sum(&mut self, formula: &mut Formula, base: &Bits, parts: &[Option<&Quantity>], name: &str) -> Bits {
        let step = self.step;
        let constants = parts.iter().map(|part| part.map_or(0, |quantity| quantity.constant));
        let mut kinds: BTreeMap<i128, Vec<Var>> = BTreeMap::new();
        for (own, constant) in self.timeline.operators.iter().zip(constants) {
            kinds.entry(constant).or_default().push(*own);
        }
        let mut sum = base.clone();
        if kinds.keys().any(|constant| *constant != 0) {
            kinds.entry(0).or_default().push(self.timeline.idle);
            let added = formula.bits(base.len(), &format!("the constant added to {name} at step {step}"));
            for (constant, operators) in kinds {
                let kind = formula.variable(|| format!("{constant} is added to {name} at step {step}"));
                for own in operators {
                    formula.clause(&[-own, kind]);
                }
                for (position, own) in added.iter().enumerate() {
                    formula.clause(&[-kind, if bit(constant, position) { *own } else { -own }]);
                }
            }
            sum = formula.add(&sum, &added, &format!("{name} with the constant of step {step}"));
        }
        let most = parts.iter().flatten().map(|quantity| quantity.tables.len()).max().unwrap_or(0);
        for place in 0..most {
            let added = self.table(formula, parts, place, (base.len(), name));
            sum = formula.add(&sum, &added, &format!("{name} with table {place} of step {step}"));
        }
        sum
    }

    /// The entry of one of the operator's tables.
    fn table(
        &mut self,
        formula: &mut Formula,
        parts: &[Option<&Quantity>],
        place: usize,
        (width, name): (usize, &str),
    ) -> Bits {
        let step = self.step;
        let added = formula.bits(width, &format!("table {place} added to {name} at step {step}"));
        let mut kinds: BTreeMap<Option<Kind<'_>>, Vec<Var>> = BTreeMap::new();
        for ((operator, own), part) in self.model.operators.iter().zip(&self.timeline.operators).zip(parts) {
            let table = part.and_then(|quantity| quantity.tables.get(place));
            let kind = table.map(|(slots, table)| (operator.uses, slots.as_slice(), *table));
            kinds.entry(kind).or_default().push(*own);
        }
        kinds.entry(None).or_default().push(self.timeline.idle);
        for (kind, operators) in kinds {
            let Some((uses, slots, table)) = kind else {
                for own in operators {
                    for bit in &added {
                        formula.clause(&[-own, -bit]);
                    }
                }
                continue;
            };
            let chosen = formula.variable(|| format!("table {table} is added to {name} at step {step}"));
            for own in operators {
                formula.clause(&[-own, chosen]);
            }
            let uses = &self.model.uses[uses as usize];
            for (row, value) in self.model.tables[table as usize].iter().enumerate() {
                let mut rest = row;
                let mut condition = vec![-chosen];
                for slot in slots.iter().rev() {
                    let size = uses[*slot as usize].1.len();
                    condition.push(-self.timeline.design(uses, *slot, (rest % size) as u32));
                    rest /= size;
                }
                for (position, own) in added.iter().enumerate() {
                    let literal = if bit(*value, position) { *own } else { -own };
                    formula.clause(&[&condition[..], &[literal]].concat());
                }
            }
        }
        added
    }
}
