//! Writes the optimality proof of a certificate as verification conditions in SMT-LIB 2, for
//! independent checkers.
//!
//! The invariant is a property of a state and its accumulated cost: a label covers the state, or a
//! potential or a need prunes it. Each condition asks for a counterexample, where C is the claimed
//! cost: the initial state violates the invariant, a goal state in the invariant is cheaper than C,
//! or an operator leads out of the invariant. An SMT solver must answer `unsat` to each condition.

use std::fmt::Write as _;

use num_rational::BigRational;

use crate::argument::{Argument, Label, Need, Potential};
use crate::check::{Claimed, Fault, GroundTask};
use crate::integer::Integer;
use crate::model::{Condition, Fact, Linear, Literal, Model, Operator, Quantity};

/// Returns the verification conditions for a claim, as SMT-LIB text. The claim is interpreted as in
/// [`crate::check`]. Returns `None` for tasks with rules of derived variables, because their least fixpoints have
/// no compact encoding.
///
/// # Errors
/// A document is malformed, or the claim is not integral in the units of the task.
pub fn verification_conditions(
    task: &str,
    argument: &str,
    claim: Option<&BigRational>,
) -> Result<Option<String>, Fault> {
    let task = GroundTask::read(task)?;
    let Claimed { model, argument, cost } = Claimed::read(&task, argument, claim)?;
    if !model.axioms.is_empty() {
        return Ok(None);
    }
    let monotone = model.more_never_hurts();
    Ok(Some(Writer { model, argument: &argument, cost, monotone }.document()))
}

struct Writer<'w> {
    model: &'w Model,
    argument: &'w Argument,
    cost: Option<Integer>,
    monotone: bool,
}

fn join(operation: &str, neutral: &str, parts: impl IntoIterator<Item = String>) -> String {
    let parts: Vec<String> = parts.into_iter().collect();
    match &parts[..] {
        [] => neutral.to_owned(),
        [only] => only.clone(),
        _ => format!("({operation} {})", parts.join(" ")),
    }
}

fn all(parts: impl IntoIterator<Item = String>) -> String {
    join("and", "true", parts)
}

fn any(parts: impl IntoIterator<Item = String>) -> String {
    join("or", "false", parts)
}

fn number(number: &Integer) -> String {
    if number.is_negative() { format!("(- {})", -number) } else { number.to_string() }
}

fn fact((variable, value): Fact) -> String {
    format!("(= v{variable} {value})")
}

fn literal((own, positive): &Literal) -> String {
    if *positive { fact(*own) } else { format!("(not {})", fact(*own)) }
}

fn question(text: &mut String, about: &str, declarations: &str, assertions: &[String]) {
    let _ = write!(text, "; {about}\n(push)\n{declarations}");
    for assertion in assertions {
        let _ = writeln!(text, "(assert {assertion})");
    }
    text.push_str("(check-sat)\n(pop)\n");
}

impl Writer<'_> {
    fn document(&self) -> String {
        let mut text = String::from("; Every answer has to be unsat.\n(set-logic QF_LIA)\n");
        let _ = writeln!(text, "{}", self.invariant());
        for (variable, values) in self.model.variables.iter().enumerate() {
            let _ = writeln!(text, "(declare-const v{variable} Int)");
            let _ = writeln!(text, "(assert (and (<= 0 v{variable}) (< v{variable} {})))", values.len());
        }
        for name in self.names().iter().skip(self.model.variables.len()) {
            let _ = writeln!(text, "(declare-const {name} Int)");
        }
        let values = self.model.values.iter().map(ToString::to_string);
        let numbers = self.model.numbers.iter().map(number);
        let initial: Vec<String> = values.chain(numbers).chain(["0".to_owned()]).collect();
        let initial = [format!("(not (invariant {}))", initial.join(" "))];
        question(&mut text, "the initial state", "", &initial);
        let mut goal = vec![self.holds(), self.condition(&self.model.goal)];
        goal.extend(self.cost.iter().map(|cost| format!("(< paid {})", number(cost))));
        question(&mut text, "goal states", "", &goal);
        for (operator, position) in self.model.operators.iter().zip(0..) {
            self.operator(&mut text, operator, position);
        }
        text
    }

    fn names(&self) -> Vec<String> {
        let values = (0..self.model.variables.len()).map(|variable| format!("v{variable}"));
        let numbers = (0..self.model.numbers.len()).map(|variable| format!("n{variable}"));
        values.chain(numbers).chain(["paid".to_owned()]).collect()
    }

    fn holds(&self) -> String {
        format!("(invariant {})", self.names().join(" "))
    }

    fn invariant(&self) -> String {
        let parameters: Vec<String> = self.names().iter().map(|name| format!("({name} Int)")).collect();
        let potentials = self.argument.potentials.iter().map(|potential| self.cut_off(potential));
        let needs = self.argument.needs.iter().map(|need| self.exhausted(need));
        let labels = self.argument.labels.iter().map(|label| self.covers(label));
        let mut parts = any(potentials.chain(needs).chain(labels));
        // An empty clause in the goal means that grounding found the goal unreachable. The invariant is then
        // simply true.
        if self.model.goal.clauses.iter().any(Vec::is_empty) {
            "true".clone_into(&mut parts);
        }
        format!("(define-fun invariant ({}) Bool {parts})", parameters.join(" "))
    }

    /// Returns the disjunction over the entries of a table for which `entry` returns a formula.
    /// Each formula is conjoined with the variable values of its entry.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "a row and its parts are below the size of a table, see `references`"
    )]
    fn entries(
        &self,
        pattern: &[u32],
        values: &[Option<Integer>],
        entry: impl Fn(Option<&Integer>) -> Option<String>,
    ) -> String {
        any(values.iter().enumerate().filter_map(|(row, value)| {
            let formula = entry(value.as_ref())?;
            let mut remaining_row = row;
            let mut parts = vec![formula];
            for variable in pattern.iter().rev() {
                let size = self.model.variables[*variable as usize].len();
                parts.push(format!("(= v{variable} {})", remaining_row % size));
                remaining_row /= size;
            }
            Some(all(parts))
        }))
    }

    fn cut_off(&self, potential: &Potential) -> String {
        self.entries(&potential.pattern, &potential.values, |value| match (value, &self.cost) {
            (None, _) => Some("true".to_owned()),
            (Some(more), Some(cost)) => Some(format!("(>= paid {})", number(&(cost - more)))),
            (Some(_), None) => None,
        })
    }

    fn exhausted(&self, need: &Need) -> String {
        self.entries(&need.pattern, &need.values, |value| match value {
            None => Some("true".to_owned()),
            Some(value) if value.is_zero() => None,
            Some(value) => Some(format!("(< n{} {})", need.number, number(value))),
        })
    }

    fn covers(&self, Label(values, numbers, cost): &Label) -> String {
        let values = values.iter().enumerate().map(|(variable, value)| format!("(= v{variable} {value})"));
        let relation = if self.monotone { "<=" } else { "=" };
        let numbers = numbers.iter().enumerate();
        let numbers = numbers.map(|(own, value)| format!("({relation} n{own} {})", number(value)));
        all(values.chain(numbers).chain([format!("(>= paid {})", number(cost))]))
    }

    fn condition(&self, condition: &Condition) -> String {
        let comparisons = condition.comparisons.iter();
        condition_with(condition, comparisons.map(|linear| self.linear(linear, &[])))
    }

    fn linear(&self, linear: &Linear, sizes: &[usize]) -> String {
        let factors = linear.factors.iter();
        let factors = factors.map(|(own, factor)| format!("(* {} n{own})", number(factor)));
        join("+", "0", factors.chain([self.quantity(&linear.quantity, sizes)]))
    }

    /// Encodes a quantity as a term. Tables become case distinctions over the designs `c0`, `c1`, …
    /// chosen for the operator's slots.
    fn quantity(&self, quantity: &Quantity, sizes: &[usize]) -> String {
        let tables = quantity.tables.iter().map(|(slots, table)| {
            let rows = &self.model.tables[*table as usize];
            let row = |slots: &[u32]| {
                let key =
                    |row: String, slot: &u32| format!("(+ (* {} {row}) c{slot})", sizes[*slot as usize]);
                slots.iter().fold("0".to_owned(), key)
            };
            let key = row(slots);
            let last = rows.last().map_or_else(|| "0".to_owned(), number);
            let earlier_rows = rows.iter().enumerate().rev().skip(1);
            earlier_rows
                .fold(last, |cases, (row, value)| format!("(ite (= {key} {row}) {} {cases})", number(value)))
        });
        join("+", "0", std::iter::once(number(&quantity.constant)).chain(tables))
    }

    fn operator(&self, text: &mut String, operator: &Operator, position: usize) {
        let sizes = self.model.sizes(operator);
        let comparisons = operator.condition.comparisons.iter().map(|linear| self.linear(linear, &sizes));
        let mut assertions = vec![self.holds(), condition_with(&operator.condition, comparisons)];
        let mut declarations = String::new();
        for (slot, size) in sizes.iter().enumerate() {
            let _ = writeln!(declarations, "(declare-const c{slot} Int)");
            assertions.push(format!("(and (<= 0 c{slot}) (< c{slot} {size}))"));
        }
        for exclusion in &self.model.exclusions[operator.exclusions as usize] {
            for combination in &exclusion.combinations {
                let pairs = exclusion.slots.iter().zip(combination);
                assertions.push(format!(
                    "(not {})",
                    all(pairs.map(|(slot, design)| format!("(= c{slot} {design})")))
                ));
            }
        }
        let values = (0..).zip(&self.model.variables).map(|(variable, _)| value_after(operator, variable));
        let numbers = (0..).zip(&self.model.numbers).map(|(own, _)| {
            let change = operator.changes.iter().find(|(changed, _)| *changed == own);
            change.map_or_else(|| format!("n{own}"), |(_, value)| self.linear(value, &sizes))
        });
        let paid = format!("(+ paid {})", self.quantity(&operator.cost, &sizes));
        let after: Vec<String> = values.chain(numbers).chain([paid]).collect();
        assertions.push(format!("(not (invariant {}))", after.join(" ")));
        question(text, &format!("operator {position}"), &declarations, &assertions);
    }
}

fn condition_with(condition: &Condition, comparisons: impl Iterator<Item = String>) -> String {
    let facts = condition.facts.iter().copied().map(fact);
    let clauses = condition.clauses.iter().map(|clause| any(clause.iter().map(literal)));
    all(facts.chain(clauses).chain(comparisons.map(|sum| format!("(>= {sum} 0)"))))
}

/// Returns a term for the value of a variable after an operator; later effects override earlier
/// ones.
fn value_after(operator: &Operator, variable: u32) -> String {
    let of = |effects: &[Fact]| effects.iter().rev().find(|fact| fact.0 == variable).map(|fact| fact.1);
    let plain = of(&operator.effects).map_or_else(|| format!("v{variable}"), |value| value.to_string());
    operator.conditional.iter().fold(plain, |before, conditional| match of(&conditional.effects) {
        Some(value) => {
            format!("(ite {} {value} {before})", all(conditional.condition.iter().map(literal)))
        }
        None => before,
    })
}
