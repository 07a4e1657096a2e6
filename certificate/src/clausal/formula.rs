//! A task to the formula "there is a plan of at most T steps that costs less than the claim".
//!
//! After each step, every variable has exactly one value; at each step stands exactly one operator, or none for good. An operator
//! requires its conditions, makes its effects true, and fills its slots with designs that suit; a value that was not there
//! before was made by an operator. Sums are in [`super::sums`].

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{BufRead, Read, Write};

use crate::clausal::lines;
use crate::clausal::literal::Literal;
use crate::clausal::sums::Sums;
use crate::integer::Integer;
use crate::model::{self, Argument, Fact, Model, Operator};

/// Clauses, and what their variables mean.
pub struct Formula {
    /// Of all clauses, one after the other.
    literals: Vec<Literal>,
    /// Where each clause ends.
    ends: Vec<usize>,
    names: Vec<String>,
    limit: usize,
    /// How many bits the longest of its numbers has.
    widest: usize,
}

impl Formula {
    /// The formula of a task; an error says what it does not cover.
    pub(super) fn new(model: &Model, cost: &Integer, steps: usize, limit: usize) -> Result<Self, String> {
        if !model.axioms.is_empty() {
            return Err("derived predicates are not covered".into());
        }
        if model.operators.iter().any(|operator| !operator.conditional.is_empty()) {
            return Err("conditional effects are not covered".into());
        }
        if !cost.is_positive() {
            return Err("no plan costs less than nothing".into());
        }
        let mut formula =
            Self { literals: Vec::new(), ends: Vec::new(), names: Vec::new(), limit, widest: 0 };
        let truth = formula.variable(|| "true".to_owned());
        formula.clause(&[truth]);
        let mut timeline = Timeline::new(model, &mut formula);
        let mut sums = Sums::new(model, &mut formula, cost, steps)?;
        formula.widest = sums.widest();
        for step in 0..steps {
            timeline.advance(model, &mut formula, step);
            sums.advance(model, &mut formula, &timeline, step)?;
            formula.within_limit()?;
        }
        timeline.goal(model, &mut formula);
        sums.goal(model, &mut formula)?;
        formula.within_limit()?;
        Ok(formula)
    }

    fn within_limit(&self) -> Result<(), String> {
        if self.literals.len() > self.limit || self.names.len() >= self.limit {
            return Err(format!("the formula has more than {} literals", self.limit));
        }
        Ok(())
    }

    /// A new variable.
    pub(super) fn variable(&mut self, name: impl FnOnce() -> String) -> Literal {
        // What is beyond the limit is refused in any case.
        if self.names.len() < self.limit {
            self.names.push(name());
        }
        Literal::of_variable(self.names.len()).unwrap_or(Literal::FIRST)
    }

    /// The variable that is true.
    #[allow(clippy::unused_self, reason = "part of the formula")]
    pub(super) fn truth(&self) -> Literal {
        Literal::FIRST
    }

    pub(super) fn clause(&mut self, clause: &[Literal]) {
        // What is beyond the limit is refused in any case.
        if self.literals.len() <= self.limit {
            self.literals.extend(clause);
            self.ends.push(self.literals.len());
        }
    }

    /// At most one of some variables: with "one of the first so many" where there are many.
    #[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
    pub(super) fn at_most_one(&mut self, variables: &[Literal], name: &str) {
        if variables.len() <= 5 {
            for (position, first) in variables.iter().enumerate() {
                for second in &variables[position + 1..] {
                    self.clause(&[-*first, -*second]);
                }
            }
            return;
        }
        let mut before: Option<Literal> = None;
        for (position, variable) in variables.iter().enumerate() {
            let some = self.variable(|| format!("one of the first {} of {name}", position + 1));
            self.clause(&[-*variable, some]);
            if let Some(before) = before {
                self.clause(&[-before, some]);
                self.clause(&[-before, -*variable]);
            }
            before = Some(some);
        }
    }

    /// How many variables it has.
    pub fn variables(&self) -> usize {
        self.names.len()
    }

    /// Its clauses.
    pub fn clauses(&self) -> impl Iterator<Item = &[Literal]> {
        let begins = std::iter::once(0).chain(self.ends.iter().copied());
        begins.zip(&self.ends).map(|(begin, end)| &self.literals[begin..*end])
    }

    /// How many bits the longest of its numbers has.
    pub fn widest(&self) -> usize {
        self.widest
    }

    pub(super) fn count(&self) -> usize {
        self.ends.len()
    }

    /// Writes it in DIMACS.
    ///
    /// # Errors
    /// The output fails.
    pub fn write_dimacs(&self, output: &mut dyn Write) -> std::io::Result<()> {
        self.dimacs(&mut |line| output.write_all(line))?;
        output.flush()
    }

    /// Writes a line for each variable: its number and what it stands for.
    ///
    /// # Errors
    /// The output fails.
    pub fn write_legend(&self, output: &mut dyn Write) -> std::io::Result<()> {
        self.legend(&mut |line| output.write_all(line))?;
        output.flush()
    }

    /// Calls `visit` with each line of the formula.
    fn dimacs<E>(&self, visit: &mut dyn FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
        visit(format!("p cnf {} {}\n", self.variables(), self.count()).as_bytes())?;
        let mut line = Vec::new();
        self.clauses().try_for_each(|clause| {
            lines::format(&mut line, clause.iter().map(|literal| literal.number()));
            visit(&line)
        })
    }

    /// Calls `visit` with each line of the legend.
    fn legend<E>(&self, visit: &mut dyn FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
        let mut line = String::new();
        (1..).zip(&self.names).try_for_each(|(number, name): (usize, _)| {
            line.clear();
            let _ = writeln!(line, "{number} {name}");
            visit(line.as_bytes())
        })
    }

    /// Whether a written formula and its legend are these: every clause, by the names of its variables.
    pub(super) fn compare(&self, formula: &mut dyn BufRead, legend: &mut dyn BufRead) -> Result<(), String> {
        let mut legend = Written { what: "legend", text: legend, line: Vec::new(), number: 0 };
        self.legend(&mut |line| legend.compare(line))?;
        legend.end()?;
        let mut formula = Written { what: "formula", text: formula, line: Vec::new(), number: 0 };
        self.dimacs(&mut |line| formula.compare(line))?;
        formula.end()
    }
}

/// A text that is compared line by line with what is expected.
struct Written<'w> {
    what: &'static str,
    text: &'w mut dyn BufRead,
    line: Vec<u8>,
    /// Lines so far.
    number: usize,
}

impl Written<'_> {
    #[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
    fn compare(&mut self, expected: &[u8]) -> Result<(), String> {
        self.number += 1;
        self.line.clear();
        // A line that is longer than expected is wrong, however long it is.
        let mut line = Read::take(&mut *self.text, expected.len() as u64);
        line.read_until(b'\n', &mut self.line)
            .map_err(|error| format!("the {} cannot be read: {error}", self.what))?;
        if self.line == expected {
            return Ok(());
        }
        let (number, what) = (self.number, self.what);
        let expected = String::from_utf8_lossy(expected.trim_ascii_end());
        Err(format!("line {number} of the {what} is another one, `{expected}` is expected"))
    }

    fn end(&mut self) -> Result<(), String> {
        match self.text.fill_buf() {
            Ok([]) => Ok(()),
            Ok(_) => Err(format!("the {} has more lines", self.what)),
            Err(error) => Err(format!("the {} cannot be read: {error}", self.what)),
        }
    }
}

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
    fn new(model: &Model, formula: &mut Formula) -> Self {
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
    fn advance(&mut self, model: &Model, formula: &mut Formula, step: usize) {
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

    fn goal(&self, model: &Model, formula: &mut Formula) {
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
