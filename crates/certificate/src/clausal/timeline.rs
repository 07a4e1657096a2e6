//! Encodes states and steps. After each step, every variable has exactly one value. Each step has
//! exactly one operator or is idle, and all steps after an idle step are idle.
//!
//! An operator implies its conditions, its effects, and a suitable design in each of its slots.
//! Frame axioms: a value that did not hold before the step must be an effect of the step's
//! operator.

use std::collections::BTreeMap;

use crate::clausal::formula::Formula;
use crate::clausal::literal::Literal;
use crate::model::{self, Argument, Fact, Model, Operator};

pub(super) struct Timeline {
    /// For each variable and value, the literal that the variable has this value after the latest
    /// step.
    values: Vec<Vec<Literal>>,
    pub(super) operators: Vec<Literal>,
    pub(super) idle: Option<Literal>,
    /// For each slot and each of its designs, the literal that the design is chosen at the latest
    /// step.
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
        let variables = model.variables.iter().enumerate().map(|(variable, values)| {
            let name = |value: &String| format!("{value} (variable {variable}) after step {time}");
            let literals: Vec<Literal> =
                values.iter().map(|value| formula.variable(|| name(value))).collect();
            formula.clause(&literals);
            formula.at_most_one(&literals, &format!("the values of variable {variable} after step {time}"));
            literals
        });
        variables.collect()
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
        let choices = [&operators[..], &[idle]].concat();
        formula.clause(&choices);
        formula.at_most_one(&choices, &format!("the operators at step {number}"));
        self.operators = operators;
        self.choose(model, formula, number);
        let next = Self::state(model, formula, number);
        let mut makers: BTreeMap<Fact, Vec<Literal>> = BTreeMap::new();
        for (operator, literal) in model.operators.iter().zip(&self.operators) {
            for fact in &operator.condition.facts {
                formula.clause(&[-*literal, Self::fact(&self.values, *fact)]);
            }
            for clause in &operator.condition.clauses {
                let literals = clause.iter().map(|literal| Self::literal(&self.values, literal));
                formula.clause(&std::iter::once(-*literal).chain(literals).collect::<Vec<_>>());
            }
            // If an operator assigns a variable several times, the last effect counts.
            let last: BTreeMap<u32, u32> = operator.effects.iter().copied().collect();
            for fact in last {
                formula.clause(&[-*literal, Self::fact(&next, fact)]);
                makers.entry(fact).or_default().push(*literal);
            }
        }
        // Frame axioms: a value after the step held before, or an operator of the step makes it
        // true.
        for (variable, values) in (0..).zip(&next) {
            for (value, after) in (0..).zip(values) {
                let before = Self::fact(&self.values, (variable, value));
                let achievers = makers.get(&(variable, value)).into_iter().flatten().copied();
                formula.clause(&[-*after, before].into_iter().chain(achievers).collect::<Vec<_>>());
            }
        }
        self.values = next;
    }

    fn literal(values: &[Vec<Literal>], (fact, positive): &model::Literal) -> Literal {
        let literal = Self::fact(values, *fact);
        if *positive { literal } else { -literal }
    }

    /// Encodes that the operator of the step has a suitable design in each of its slots, and that
    /// the combination of designs is not excluded.
    fn choose(&mut self, model: &Model, formula: &mut Formula, number: usize) {
        self.chosen = Vec::new();
        for (slot, designs) in model.slots.iter().enumerate() {
            let name = |design: &u32| format!("{} in slot {slot} at step {number}", object(model, *design));
            let literals: Vec<Literal> =
                designs.iter().map(|design| formula.variable(|| name(design))).collect();
            formula.at_most_one(&literals, &format!("the designs of slot {slot} at step {number}"));
            self.chosen.push(literals);
        }
        // Operators with the same suitable designs in the same slots and the same excluded combinations
        // imply one common auxiliary variable. The clauses are stated for this variable only, which
        // reduces their number.
        let mut kinds: BTreeMap<(u32, u32), Vec<Literal>> = BTreeMap::new();
        for (operator, literal) in model.operators.iter().zip(&self.operators) {
            kinds.entry((operator.uses, operator.exclusions)).or_default().push(*literal);
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

    /// Returns the literal of a design, given by its position among the suitable designs of an
    /// operator's slot.
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

fn show(model: &Model, operator: &Operator) -> String {
    let argument = |argument: &Argument| match argument {
        Argument::Object(number) => format!(" {}", object(model, *number)),
        Argument::Slot(slot) => format!(" ?{slot}"),
    };
    let arguments: String = operator.arguments.iter().map(argument).collect();
    let schema = model.schemas.get(operator.schema as usize).map_or("wait", String::as_str);
    format!("({schema}{arguments})")
}

fn object(model: &Model, number: u32) -> &str {
    model.objects.get(number as usize).map_or("?", String::as_str)
}
