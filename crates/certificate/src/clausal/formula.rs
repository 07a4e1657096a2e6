//! Clauses with names for their variables, as they are written and compared.

use std::fmt::Write as _;
use std::io::{BufRead, Read, Write};

use crate::clausal::lines;
use crate::clausal::literal::Literal;

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
    /// The formula that is true, which does not grow much beyond so many literals.
    pub(super) fn new(limit: usize) -> Self {
        let mut formula =
            Self { literals: Vec::new(), ends: Vec::new(), names: Vec::new(), limit, widest: 0 };
        let truth = formula.variable(|| "true".to_owned());
        formula.clause(&[truth]);
        formula
    }

    /// Notes that one of its numbers has so many bits.
    pub(super) fn has_number(&mut self, bits: usize) {
        self.widest = self.widest.max(bits);
    }

    /// An error if it has grown beyond the limit.
    pub(super) fn within_limit(&self) -> Result<(), String> {
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
