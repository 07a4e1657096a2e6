//! After each step, every variable has exactly one value; at each step stands exactly one operator, or none for good.
//!
//! An operator requires its conditions, makes its effects true, and fills its slots with designs that suit; a value that was not
//! there before was made by an operator.

use std::collections::BTreeMap;

use crate::clausal::formula::Formula;
use crate::clausal::literal::Literal;
use crate::model::{self, Argument, Fact, Model, Operator};

/// States and what leads from one to the next.
pub(super) struct Timeline {
    /// For each variable and value, after the latest step.
    values: Vec<Vec<Literal>>,
    /// At the latest step.
    pub(super) operators: Vec<Literal>,
    pub(super) idle: Option<Literal>,
    /// For each slot and design.
    pub(super) chosen: Vec<Vec<Literal>>,
}

impl Timeline {
    pub(super) fn new(model: &Model, formula: &mut Formula) -> Self {
        let values = Self::state(model, formula, 0);
        for (variable, value) in model.values.iter().enumerate() {
            formula.clause(&[values[variable][*value as usize]]);
        }
        Self { values, operators: Vec::new(), idle: None, chosen: Vec::new() }
    }

    fn state(model: &Model, formula: &mut Formula, time: usize) -> Vec<Vec<Literal>> {
        let all = model.variables.iter().enumerate().map(|(variable, values)| {
            let name = |value: &String| format!("{value} (variable {variable}) after step {time}");
            let own: Vec<Literal> = values.iter().map(|value| formula.variable(|| name(value))).collect();
            formula.clause(&own);
            formula.at_most_one(&own, &format!("the values of variable {variable} after step {time}"));
            own
        });
        all.collect()
    }

    fn fact(values: &[Vec<Literal>], (variable, value): Fact) -> Literal {
        values[variable as usize][value as usize]
    }

    #[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
    pub(super) fn advance(&mut self, model: &Model, formula: &mut Formula, step: usize) {
        let number = step + 1;
        let name = |operator: &Operator| format!("{} at step {number}", show(model, operator));
        let operators: Vec<Literal> =
            model.operators.iter().map(|operator| formula.variable(|| name(operator))).collect();
        let idle = formula.variable(|| format!("nothing from step {number} on"));
        if let Some(before) = self.idle.replace(idle) {
            formula.clause(&[-before, idle]);
        }
        let one = [&operators[..], &[idle]].concat();
        formula.clause(&one);
        formula.at_most_one(&one, &format!("the operators at step {number}"));
        self.operators = operators;
        self.choose(model, formula, number);
        let next = Self::state(model, formula, number);
        let mut makers: BTreeMap<Fact, Vec<Literal>> = BTreeMap::new();
        for (operator, own) in model.operators.iter().zip(&self.operators) {
            for fact in &operator.condition.facts {
                formula.clause(&[-*own, Self::fact(&self.values, *fact)]);
            }
            for clause in &operator.condition.clauses {
                let literals = clause.iter().map(|literal| Self::literal(&self.values, literal));
                formula.clause(&std::iter::once(-*own).chain(literals).collect::<Vec<_>>());
            }
            // Later effects prevail.
            let last: BTreeMap<u32, u32> = operator.effects.iter().copied().collect();
            for fact in last {
                formula.clause(&[-*own, Self::fact(&next, fact)]);
                makers.entry(fact).or_default().push(*own);
            }
        }
        for (variable, values) in (0..).zip(&next) {
            for (value, after) in (0..).zip(values) {
                let before = Self::fact(&self.values, (variable, value));
                let made = makers.get(&(variable, value)).into_iter().flatten().copied();
                formula.clause(&[-*after, before].into_iter().chain(made).collect::<Vec<_>>());
            }
        }
        self.values = next;
    }

    fn literal(values: &[Vec<Literal>], (fact, positive): &model::Literal) -> Literal {
        let own = Self::fact(values, *fact);
        if *positive { own } else { -own }
    }

    /// Every operator fills its slots with designs that suit, and with no combination that is excluded.
    fn choose(&mut self, model: &Model, formula: &mut Formula, number: usize) {
        self.chosen = Vec::new();
        for (slot, designs) in model.slots.iter().enumerate() {
            let name = |design: &u32| format!("{} in slot {slot} at step {number}", object(model, *design));
            let own: Vec<Literal> = designs.iter().map(|design| formula.variable(|| name(design))).collect();
            formula.at_most_one(&own, &format!("the designs of slot {slot} at step {number}"));
            self.chosen.push(own);
        }
        let mut kinds: BTreeMap<(u32, u32), Vec<Literal>> = BTreeMap::new();
        for (operator, own) in model.operators.iter().zip(&self.operators) {
            kinds.entry((operator.uses, operator.exclusions)).or_default().push(*own);
        }
        for ((uses, exclusions), operators) in kinds {
            let kind =
                formula.variable(|| format!("slots {uses} without {exclusions} are filled at step {number}"));
            for operator in operators {
                formula.clause(&[-operator, kind]);
            }
            let uses = &model.uses[uses as usize];
            for (slot, designs) in uses {
                let suited = designs.iter().map(|design| self.chosen[*slot as usize][*design as usize]);
                formula.clause(&std::iter::once(-kind).chain(suited).collect::<Vec<_>>());
            }
            for exclusion in &model.exclusions[exclusions as usize] {
                for combination in &exclusion.combinations {
                    let pairs = exclusion.slots.iter().zip(combination);
                    let chosen = pairs.map(|(slot, design)| -self.design(uses, *slot, *design));
                    formula.clause(&std::iter::once(-kind).chain(chosen).collect::<Vec<_>>());
                }
            }
        }
    }

    /// A design by its position among those that suit a slot of an operator.
    pub(super) fn design(&self, uses: &[(u32, Vec<u32>)], slot: u32, design: u32) -> Literal {
        let (slot, suited) = &uses[slot as usize];
        self.chosen[*slot as usize][suited[design as usize] as usize]
    }

    pub(super) fn goal(&self, model: &Model, formula: &mut Formula) {
        for fact in &model.goal.facts {
            formula.clause(&[Self::fact(&self.values, *fact)]);
        }
        for clause in &model.goal.clauses {
            let literals: Vec<Literal> =
                clause.iter().map(|literal| Self::literal(&self.values, literal)).collect();
            formula.clause(&literals);
        }
    }
}

/// An operator as it is called in PDDL; slots are `?` and a number.
fn show(model: &Model, operator: &Operator) -> String {
    let argument = |argument: &Argument| match argument {
        Argument::Object(own) => format!(" {}", object(model, *own)),
        Argument::Slot(slot) => format!(" ?{slot}"),
    };
    let arguments: String = operator.arguments.iter().map(argument).collect();
    let schema = model.schemas.get(operator.schema as usize).map_or("wait", String::as_str);
    format!("({schema}{arguments})")
}

fn object(model: &Model, number: u32) -> &str {
    model.objects.get(number as usize).map_or("?", String::as_str)
}
