//! Semantics of a ground task: states, operators and costs. The implementation is simple rather
//! than fast, because it has to be trusted. All arithmetic is exact.

use std::ops::Range;

use crate::integer::Integer;
use crate::model::{Condition, Fact, Linear, Literal, Model, Operator, Quantity};

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct State {
    pub(super) values: Vec<u32>,
    pub(super) numbers: Vec<Integer>,
}

impl Model {
    #[expect(clippy::cast_possible_truncation, reason = "fewer than 2^32 of each kind, see `references`")]
    pub(super) fn basic_variables(&self) -> Range<u32> {
        0..self.basic as u32
    }

    #[expect(clippy::cast_possible_truncation, reason = "fewer than 2^32 of each kind, see `references`")]
    pub(super) fn derived_variables(&self) -> Range<u32> {
        self.basic as u32..self.variables.len() as u32
    }

    /// Returns the last value of a variable, which means that none of its atoms holds.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::arithmetic_side_effects,
        reason = "a variable has a value, and fewer than 2^32, see `references`"
    )]
    pub(super) fn none(&self, variable: u32) -> u32 {
        self.variables[variable as usize].len() as u32 - 1
    }

    pub(super) fn state(&self, basic: &[u32], numbers: &[Integer]) -> State {
        let mut values = basic.to_vec();
        values.resize(self.variables.len(), 0);
        let mut state = State { values, numbers: numbers.to_vec() };
        self.derive(&mut state);
        state
    }

    pub(super) fn initial(&self) -> State {
        self.state(&self.values[..self.basic], &self.numbers)
    }

    /// Computes the least fixpoint of the rules, layer by layer.
    fn derive(&self, state: &mut State) {
        for variable in self.derived_variables() {
            state.values[variable as usize] = self.none(variable);
        }
        for layer in &self.axioms {
            loop {
                let holds = |(head, body): &&(Fact, Condition)| {
                    state.values[head.0 as usize] != head.1 && self.holds(body, state, &[], &[])
                };
                let new: Vec<Fact> = layer.rules.iter().filter(holds).map(|(head, _)| *head).collect();
                for (variable, value) in &new {
                    state.values[*variable as usize] = *value;
                }
                if new.is_empty() {
                    break;
                }
            }
        }
    }

    pub(super) fn sizes(&self, operator: &Operator) -> Vec<usize> {
        self.uses[operator.uses as usize].iter().map(|(_, designs)| designs.len()).collect()
    }

    /// Returns all combinations of designs that an operator permits, as positions in its lists of
    /// suitable designs.
    #[expect(clippy::cast_possible_truncation, reason = "a slot has fewer designs, see `references`")]
    pub(super) fn choices(&self, operator: &Operator) -> Vec<Vec<u32>> {
        let mut choices: Vec<Vec<u32>> = vec![Vec::new()];
        for size in self.sizes(operator) {
            let longer = |choice: Vec<u32>| {
                (0..size as u32).map(move |design| choice.iter().copied().chain([design]).collect())
            };
            choices = choices.into_iter().flat_map(longer).collect();
        }
        let exclusions = &self.exclusions[operator.exclusions as usize];
        choices.retain(|choice| {
            !exclusions.iter().any(|exclusion| {
                let chosen: Vec<u32> = exclusion.slots.iter().map(|slot| choice[*slot as usize]).collect();
                exclusion.combinations.contains(&chosen)
            })
        });
        choices
    }

    /// Returns the value of a quantity for a combination of designs; `sizes` are those of
    /// [`Model::sizes`].
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "a row is below the size of its table, see `references`"
    )]
    pub(super) fn quantity(&self, quantity: &Quantity, choice: &[u32], sizes: &[usize]) -> Integer {
        let mut sum = quantity.constant.clone();
        for (slots, table) in &quantity.tables {
            // The row is the number whose digits are the chosen designs (mixed radix).
            let mut row = 0;
            for slot in slots {
                row = row * sizes[*slot as usize] + choice[*slot as usize] as usize;
            }
            sum = &sum + &self.tables[*table as usize][row];
        }
        sum
    }

    pub(super) fn least(&self, quantity: &Quantity) -> Integer {
        let tables =
            quantity.tables.iter().filter_map(|(_, table)| self.tables[*table as usize].iter().min());
        tables.chain([&quantity.constant]).sum()
    }

    pub(super) fn most(&self, quantity: &Quantity) -> Integer {
        let tables =
            quantity.tables.iter().filter_map(|(_, table)| self.tables[*table as usize].iter().max());
        tables.chain([&quantity.constant]).sum()
    }

    pub(super) fn linear(&self, linear: &Linear, state: &State, choice: &[u32], sizes: &[usize]) -> Integer {
        let quantity = self.quantity(&linear.quantity, choice, sizes);
        let numbers = linear.factors.iter();
        numbers.fold(quantity, |sum, (number, factor)| &sum + &(&state.numbers[*number as usize] * factor))
    }

    pub(super) fn holds(
        &self,
        condition: &Condition,
        state: &State,
        choice: &[u32],
        sizes: &[usize],
    ) -> bool {
        holds_without_numbers(condition, state)
            && condition
                .comparisons
                .iter()
                .all(|linear| !self.linear(linear, state, choice, sizes).is_negative())
    }

    pub(super) fn successor(
        &self,
        operator: &Operator,
        state: &State,
        choice: &[u32],
        sizes: &[usize],
    ) -> State {
        let mut next = state.clone();
        for (variable, value) in &operator.effects {
            next.values[*variable as usize] = *value;
        }
        // Conditions of conditional effects refer to the state before the operator.
        for conditional in &operator.conditional {
            if conditional.condition.iter().all(|literal| literal_holds(literal, state)) {
                for (variable, value) in &conditional.effects {
                    next.values[*variable as usize] = *value;
                }
            }
        }
        for (number, value) in &operator.changes {
            next.numbers[*number as usize] = self.linear(value, state, choice, sizes);
        }
        self.derive(&mut next);
        next
    }

    /// Returns `true` if larger numbers never hurt: no factor in a condition or change is negative,
    /// and no derived variable depends on numbers.
    pub(super) fn more_never_hurts(&self) -> bool {
        let rules = self.axioms.iter().flat_map(|layer| &layer.rules);
        let conditions = self.operators.iter().map(|operator| &operator.condition).chain([&self.goal]);
        let changes =
            self.operators.iter().flat_map(|operator| operator.changes.iter().map(|(_, value)| value));
        let mut linears = conditions.flat_map(|condition| &condition.comparisons).chain(changes);
        rules.into_iter().all(|(_, body)| body.comparisons.is_empty())
            && linears.all(|linear| linear.factors.iter().all(|(_, factor)| !factor.is_negative()))
    }
}

pub(super) fn holds_without_numbers(condition: &Condition, state: &State) -> bool {
    let fact = |(variable, value): &Fact| state.values[*variable as usize] == *value;
    condition.facts.iter().all(fact)
        && condition.clauses.iter().all(|clause| clause.iter().any(|literal| literal_holds(literal, state)))
}

fn literal_holds(((variable, value), positive): &Literal, state: &State) -> bool {
    (state.values[*variable as usize] == *value) == *positive
}
