//! Tables of lower bounds over the values of a few variables (abstraction heuristics), and the
//! check that they are lower bounds.
//!
//! A potential is a lower bound on the remaining cost under two conditions. It is at most 0
//! wherever the goal can hold, and no operator decreases it by more than its cost.
//!
//! A need is a lower bound on the required value of a number under three conditions. Wherever the
//! goal can hold, the need is at most the value that the goal requires. An operator that never
//! increases the number may decrease the need, but only by the amount by which it always decreases
//! the number. If it can decrease the number, it must require that the number stays at least 0.
//! Every other change of the number occurs only where the need is 0, or leads from an infinite need
//! to an infinite one.

use crate::integer::Integer;
use crate::model::{Conditional, Fact, Linear, Literal, Model, Operator, Quantity};
use crate::semantics::State;

/// The reason why a table is not accepted.
#[derive(Debug)]
pub(super) enum TableFault {
    /// The table is not a lower bound. Contains the entry or operator that violates it.
    NoBound(String),
    /// The check was cancelled.
    Stopped,
}

/// A lower bound; `None` is infinity.
type Bound<'b> = Option<&'b Integer>;

pub(super) struct Table<'t> {
    pattern: &'t [u32],
    sizes: Vec<usize>,
    values: &'t [Option<Integer>],
}

impl<'t> Table<'t> {
    pub(super) fn new(model: &Model, pattern: &'t [u32], values: &'t [Option<Integer>]) -> Self {
        let sizes = pattern.iter().map(|variable| model.variables[*variable as usize].len()).collect();
        Self { pattern, sizes, values }
    }

    pub(super) fn at(&self, state: &State) -> Bound<'_> {
        self.at_row(self.row_of(state))
    }

    fn value(&self, values: &[u32]) -> Bound<'_> {
        self.at_row(self.row(values))
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "a row is below the size of its table, see `references`"
    )]
    pub(super) fn row(&self, values: &[u32]) -> usize {
        self.sizes.iter().zip(values).fold(0, |row, (size, value)| row * size + *value as usize)
    }

    pub(super) fn row_of(&self, state: &State) -> usize {
        let values: Vec<u32> = self.pattern.iter().map(|variable| state.values[*variable as usize]).collect();
        self.row(&values)
    }

    pub(super) fn rows(&self) -> usize {
        self.values.len()
    }

    pub(super) fn at_row(&self, row: usize) -> Bound<'_> {
        self.values[row].as_ref()
    }

    #[expect(
        clippy::arithmetic_side_effects,
        clippy::cast_possible_truncation,
        reason = "a row is below the size of its table, see `references`"
    )]
    pub(super) fn matching(&self, facts: &[Fact]) -> Vec<Vec<u32>> {
        let mut combinations = vec![Vec::new()];
        for (variable, size) in self.pattern.iter().zip(&self.sizes) {
            let fixed = facts.iter().find(|fact| fact.0 == *variable).map(|fact| fact.1);
            let range = fixed.map_or(0..*size as u32, |value| value..value + 1);
            let longer = |values: Vec<u32>| {
                range.clone().map(move |value| values.iter().copied().chain([value]).collect())
            };
            combinations = combinations.into_iter().flat_map(longer).collect();
        }
        combinations
    }

    fn after(&self, values: &[u32], effects: &[Fact]) -> Vec<u32> {
        let effect = |variable: u32| effects.iter().rev().find(|fact| fact.0 == variable).map(|fact| fact.1);
        self.pattern.iter().zip(values).map(|(variable, value)| effect(*variable).unwrap_or(*value)).collect()
    }

    pub(super) fn touches(&self, operator: &Operator) -> bool {
        let conditional = operator.conditional.iter().flat_map(|conditional| &conditional.effects);
        let mut facts = operator.condition.facts.iter().chain(&operator.effects).chain(conditional);
        facts.any(|fact| self.pattern.contains(&fact.0))
    }

    /// Returns the combinations of values to which an operator may lead from `values`. A
    /// conditional effect may apply or not if its condition contains variables outside of the
    /// pattern.
    pub(super) fn targets(&self, operator: &Operator, values: &[u32]) -> Vec<Vec<u32>> {
        let truth = |((variable, value), positive): &Literal| {
            let position = self.pattern.iter().position(|own| own == variable)?;
            Some((values[position] == *value) == *positive)
        };
        let mut targets = vec![self.after(values, &operator.effects)];
        for Conditional { condition, effects } in &operator.conditional {
            if condition.iter().any(|literal| truth(literal) == Some(false)) {
                continue;
            }
            let fired: Vec<_> = targets.iter().map(|target| self.after(target, effects)).collect();
            if condition.iter().all(|literal| truth(literal) == Some(true)) {
                targets = fired;
            } else {
                targets.extend(fired);
                targets.sort_unstable();
                targets.dedup();
            }
        }
        targets
    }

    /// Calls `check` with the bounds before and after each abstract transition of each operator, and with the result of
    /// `prepare` for the operator. An operator without facts and effects on the pattern's variables is checked only
    /// once. Returns an error if `check` returns `false`.
    fn each_transition<P>(
        &self,
        model: &Model,
        prepare: &dyn Fn(&Operator) -> P,
        check: &dyn Fn(&P, Bound<'_>, Bound<'_>) -> bool,
        stop: &dyn Fn() -> bool,
    ) -> Result<(), TableFault> {
        // An operator that touches no variable leads from each combination to itself, so checking the greatest finite
        // value suffices.
        let greatest = self.values.iter().flatten().max();
        for (operator, position) in model.operators.iter().zip(0..) {
            if !self.touches(operator) {
                if greatest.is_some() && !check(&prepare(operator), greatest, greatest) {
                    let reason = format!("operator {position}, which changes no variable of the table");
                    return Err(TableFault::NoBound(reason));
                }
                continue;
            }
            if stop() {
                return Err(TableFault::Stopped);
            }
            let prepared = prepare(operator);
            for values in self.matching(&operator.condition.facts) {
                for target in self.targets(operator, &values) {
                    if !check(&prepared, self.value(&values), self.value(&target)) {
                        let reason = format!("operator {position} leads from {values:?} to {target:?}");
                        return Err(TableFault::NoBound(reason));
                    }
                }
            }
        }
        Ok(())
    }
}

fn at_most(left: Bound<'_>, right: Bound<'_>, step: &Integer) -> bool {
    right.is_none_or(|right| left.is_some_and(|left| *left <= right + step))
}

pub(super) fn check_potential(
    model: &Model,
    table: &Table<'_>,
    stop: &dyn Fn() -> bool,
) -> Result<(), TableFault> {
    for values in table.matching(&model.goal.facts) {
        if !at_most(table.value(&values), Some(&Integer::ZERO), &Integer::ZERO) {
            return Err(TableFault::NoBound(format!("the goal may hold at {values:?}, where it exceeds 0")));
        }
    }
    let least = |operator: &Operator| model.least(&operator.cost);
    table.each_transition(model, &least, &|least, before, after| at_most(before, after, least), stop)
}

/// The effect of an operator on a number, as far as needs depend on it.
enum Use {
    /// Decreases the number by at least this amount (≥ 0). If the number can decrease, the operator requires
    /// that the result is at least 0.
    Lowers(Integer),
    Other,
}

fn use_of(model: &Model, operator: &Operator, number: u32) -> Use {
    let mut changes = operator.changes.iter().filter(|(own, _)| *own == number);
    let Some((_, value)) = changes.next() else { return Use::Lowers(Integer::ZERO) };
    let greatest = model.most(&value.quantity);
    let guarded = greatest.is_zero() && value.quantity.tables.is_empty()
        || operator.condition.comparisons.iter().any(|guard| implies(model, guard, value));
    if changes.next().is_none() && is_alone(value, number) && !greatest.is_positive() && guarded {
        Use::Lowers(-&greatest)
    } else {
        Use::Other
    }
}

/// Returns `true` if `guard` is at most `wanted` in all states and with all designs. Then `guard >=
/// 0` implies `wanted >= 0`. `false` means undecided.
fn implies(model: &Model, guard: &Linear, wanted: &Linear) -> bool {
    let same_designs = guard.quantity.tables == wanted.quantity.tables
        && guard.quantity.constant <= wanted.quantity.constant;
    guard.factors == wanted.factors
        && (same_designs || model.most(&guard.quantity) <= model.least(&wanted.quantity))
}

pub(super) fn check_need(
    model: &Model,
    number: u32,
    table: &Table<'_>,
    stop: &dyn Fn() -> bool,
) -> Result<(), TableFault> {
    if table.values.iter().flatten().any(Integer::is_negative) {
        return Err(TableFault::NoBound("it is negative".into()));
    }
    let required = model
        .goal
        .comparisons
        .iter()
        .filter_map(|linear| lower_end(linear, number))
        .max()
        .unwrap_or_default()
        .max(Integer::ZERO);
    for values in table.matching(&model.goal.facts) {
        if !at_most(table.value(&values), Some(&required), &Integer::ZERO) {
            return Err(TableFault::NoBound(format!(
                "the goal may hold at {values:?}, where it exceeds {required}"
            )));
        }
    }
    let use_of = |operator: &Operator| use_of(model, operator, number);
    let check = |operator_use: &Use, before: Bound<'_>, after: Bound<'_>| match operator_use {
        Use::Lowers(least) => at_most(before, after, least),
        Use::Other => before.is_some_and(Integer::is_zero) || (before.is_none() && after.is_none()),
    };
    table.each_transition(model, &use_of, &check, stop)
}

/// Returns the lower bound on a number that a comparison implies, if the comparison has the form
/// "number + constant >= 0".
fn lower_end(linear: &Linear, number: u32) -> Option<Integer> {
    let Quantity { constant, tables } = &linear.quantity;
    (is_alone(linear, number) && tables.is_empty()).then(|| -constant)
}

pub(super) fn is_alone(linear: &Linear, number: u32) -> bool {
    linear.factors == [(number, Integer::from(1))]
}
