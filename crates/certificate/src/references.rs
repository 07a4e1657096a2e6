//! Checks that the task and the argument of a certificate are well-formed. After this check, no
//! index in them is out of range, except indices of objects and of action schemas, which are not
//! checked.

use crate::argument::Argument;
use crate::integer::Integer;
use crate::model::{self, Condition, Exclusion, Fact, Linear, Literal, Model, Operator, Quantity};

type Found = Result<(), String>;

const CHOICE_LIMIT: usize = 1 << 20;
const TABLE_LIMIT: usize = 1 << 22;

fn require(holds: bool, message: impl FnOnce() -> String) -> Found {
    if holds { Ok(()) } else { Err(message()) }
}

fn are_distinct(numbers: impl Iterator<Item = u32>) -> bool {
    let mut sorted: Vec<u32> = numbers.collect();
    let count = sorted.len();
    sorted.sort_unstable();
    sorted.dedup();
    sorted.len() == count
}

pub(super) fn task(model: &Model) -> Found {
    let count = model.variables.len();
    require(model.basic <= count, || "more basic variables than variables".into())?;
    require(model.values.len() == count, || "the initial state has not one value for each variable".into())?;
    require(model.variables.iter().all(|values| !values.is_empty()), || "a variable without values".into())?;
    for fact in (0..).zip(model.values.iter().copied()) {
        model.check_fact(fact)?;
    }
    let sizes = model.variables.iter().map(Vec::len).chain([count, model.numbers.len()]);
    require(sizes.max() < Some(u32::MAX as usize), || "too many variables, values or numbers".into())?;
    require(model.fluents.len() == model.numbers.len(), || "not one fluent for each number".into())?;
    let scales = [&model.objective.scale, &model.time_scale, &model.number_scale];
    require(scales.iter().all(|scale| scale.is_positive()), || "a scale that is not positive".into())?;
    for uses in &model.uses {
        // A slot may occur only once in the list: the operator chooses a design for each entry, but the formula
        // has only one choice for each slot.
        require(are_distinct(uses.iter().map(|(slot, _)| *slot)), || "a slot that is used twice".into())?;
        for (slot, designs) in uses {
            let slot = model.slots.get(*slot as usize).ok_or("a slot that is not there")?;
            require(designs.iter().all(|design| (*design as usize) < slot.len()), || {
                "no such design".into()
            })?;
        }
        let combinations = uses.iter().try_fold(1_usize, |product, (_, own)| product.checked_mul(own.len()));
        require(combinations.is_some_and(|count| count <= CHOICE_LIMIT), || "too many combinations".into())?;
    }
    for (operator, position) in model.operators.iter().zip(0..) {
        model.check_operator(operator).map_err(|reason| format!("operator {position}: {reason}"))?;
    }
    for (head, body) in model.axioms.iter().flat_map(|layer| &layer.rules) {
        model.check_fact(*head)?;
        require(head.0 as usize >= model.basic && head.1 == 0, || "a rule of a basic variable".into())?;
        model.check_condition(body, &[])?;
    }
    model.check_condition(&model.goal, &[])
}

pub(super) fn argument(model: &Model, argument: &Argument) -> Found {
    let potentials = argument.potentials.iter().map(|potential| (&potential.pattern, &potential.values));
    let needs = argument.needs.iter().map(|need| (&need.pattern, &need.values));
    for (pattern, values) in potentials.chain(needs) {
        require(are_distinct(pattern.iter().copied()), || "a pattern with a variable twice".into())?;
        require(pattern.iter().all(|variable| (*variable as usize) < model.basic), || {
            "no such variable".into()
        })?;
        let sizes = pattern.iter().map(|variable| model.variables[*variable as usize].len());
        let size =
            sizes.into_iter().try_fold(1_usize, usize::checked_mul).filter(|size| *size <= TABLE_LIMIT);
        require(size == Some(values.len()), || "a table of the wrong size".into())?;
    }
    let numbers = model.numbers.len();
    require(argument.needs.iter().all(|need| (need.number as usize) < numbers), || "no such number".into())?;
    for (label, position) in argument.labels.iter().zip(0..) {
        let sizes = model.variables[..model.basic].iter().map(Vec::len);
        let fits = label.0.len() == model.basic
            && label.1.len() == numbers
            && label.0.iter().zip(sizes).all(|(value, size)| (*value as usize) < size);
        require(fits, || format!("label {position} is not a state"))?;
    }
    Ok(())
}

impl Model {
    fn check_fact(&self, (variable, value): Fact) -> Found {
        let size = self.variables.get(variable as usize).map_or(0, Vec::len);
        require((value as usize) < size, || format!("variable {variable} has no value {value}"))
    }

    fn check_literals(&self, literals: &[Literal]) -> Found {
        literals.iter().try_for_each(|(fact, _)| self.check_fact(*fact))
    }

    fn check_operator(&self, operator: &Operator) -> Found {
        let uses = self.uses.get(operator.uses as usize).ok_or("no such list of slots")?;
        let sizes: Vec<usize> = uses.iter().map(|(_, designs)| designs.len()).collect();
        let exclusions = self.exclusions.get(operator.exclusions as usize).ok_or("no such exclusions")?;
        let exists = |slot: &u32| (*slot as usize) < sizes.len();
        require(exclusions.iter().all(|exclusion| exclusion.slots.iter().all(exists)), || {
            "no such slot".into()
        })?;
        for Exclusion { slots, combinations } in exclusions {
            let suits = |(slot, design): (&u32, &u32)| (*design as usize) < sizes[*slot as usize];
            let fits = |combination: &Vec<u32>| {
                combination.len() == slots.len() && slots.iter().zip(combination).all(suits)
            };
            require(combinations.iter().all(fits), || "no such combination of designs".into())?;
        }
        let slots = operator.arguments.iter().filter_map(|argument| match argument {
            model::Argument::Slot(slot) => Some(slot),
            model::Argument::Object(_) => None,
        });
        require(slots.into_iter().all(exists), || "no such slot".into())?;
        self.check_condition(&operator.condition, &sizes)?;
        let conditional = operator.conditional.iter();
        conditional.clone().try_for_each(|effect| self.check_literals(&effect.condition))?;
        let effects = operator.effects.iter().chain(conditional.flat_map(|effect| &effect.effects));
        for fact in effects {
            self.check_fact(*fact)?;
            require((fact.0 as usize) < self.basic, || "an effect on a derived variable".into())?;
        }
        for (number, value) in &operator.changes {
            require((*number as usize) < self.numbers.len(), || "no such number".into())?;
            self.check_linear(value, &sizes)?;
        }
        let changed = operator.changes.iter().map(|(number, _)| *number);
        require(are_distinct(changed), || "a number that changes twice".into())?;
        self.check_quantity(&operator.cost, &sizes)?;
        self.check_quantity(&operator.duration, &sizes)
    }

    fn check_condition(&self, condition: &Condition, sizes: &[usize]) -> Found {
        condition.facts.iter().try_for_each(|fact| self.check_fact(*fact))?;
        condition.clauses.iter().try_for_each(|clause| self.check_literals(clause))?;
        condition.comparisons.iter().try_for_each(|linear| self.check_linear(linear, sizes))
    }

    fn check_linear(&self, linear: &Linear, sizes: &[usize]) -> Found {
        let exists = |(number, _): &(u32, Integer)| (*number as usize) < self.numbers.len();
        require(linear.factors.iter().all(exists), || "no such number".into())?;
        require(are_distinct(linear.factors.iter().map(|(number, _)| *number)), || {
            "a number with two factors".into()
        })?;
        self.check_quantity(&linear.quantity, sizes)
    }

    fn check_quantity(&self, quantity: &Quantity, sizes: &[usize]) -> Found {
        for (slots, table) in &quantity.tables {
            let table = self.tables.get(*table as usize).ok_or("no such table")?;
            let slot_sizes = slots.iter().map(|slot| sizes.get(*slot as usize).copied());
            let size = slot_sizes.into_iter().try_fold(1_usize, |product, size| product.checked_mul(size?));
            require(size == Some(table.len()), || "a table of the wrong size".into())?;
        }
        Ok(())
    }
}
