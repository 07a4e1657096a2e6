//! Propositional formulas in clausal form, whose variables have descriptions. Formulas are written
//! in DIMACS, and compared with written files.

use std::fmt::Write as _;
use std::io::{BufRead, Read, Write};

use crate::clausal::lines;
use crate::clausal::literal::Literal;

/// A CNF formula. Each variable has a description, which is written to a legend.
pub struct Formula {
    literals: Vec<Literal>,
    /// The end of each clause in `literals`.
    ends: Vec<usize>,
    names: Vec<String>,
    limit: usize,
    widest: usize,
}

impl Formula {
    /// Creates a formula with a single variable, which is always true. The formula stores at most
    /// about `limit` literals; [`Self::within_limit`] reports an excess.
    pub(super) fn new(limit: usize) -> Self {
        let mut formula =
            Self { literals: Vec::new(), ends: Vec::new(), names: Vec::new(), limit, widest: 0 };
        let truth = formula.variable(|| "true".to_owned());
        formula.clause(&[truth]);
        formula
    }

    pub(super) fn has_number(&mut self, bits: usize) {
        self.widest = self.widest.max(bits);
    }

    pub(super) fn literals(&self) -> usize {
        self.literals.len()
    }

    /// Returns an error if the formula exceeds its limit, or will exceed it with `further` literals.
    pub(super) fn within_limit(&self, further: usize) -> Result<(), String> {
        if self.literals.len().saturating_add(further) > self.limit || self.names.len() >= self.limit {
            return Err(format!("the formula has more than {} literals", self.limit));
        }
        Ok(())
    }

    pub(super) fn variable(&mut self, name: impl FnOnce() -> String) -> Literal {
        // Variables beyond the limit need no description, because `within_limit` rejects the
        // formula.
        if self.names.len() < self.limit {
            self.names.push(name());
        }
        Literal::of_variable(self.names.len()).unwrap_or(Literal::FIRST)
    }

    #[allow(clippy::unused_self, reason = "part of the formula")]
    pub(super) fn truth(&self) -> Literal {
        Literal::FIRST
    }

    pub(super) fn clause(&mut self, clause: &[Literal]) {
        // Clauses beyond the limit are not stored, because `within_limit` rejects the formula.
        if self.literals.len() <= self.limit {
            self.literals.extend(clause);
            self.ends.push(self.literals.len());
        }
    }

    /// Encodes that at most one of the variables is true: pairwise for up to 5 variables, otherwise
    /// by the sequential counter encoding [1].
    ///
    /// [1] Sinz, "Towards an optimal CNF encoding of Boolean cardinality constraints", CP 2005.
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

    /// Returns the number of variables.
    pub fn variables(&self) -> usize {
        self.names.len()
    }

    /// Iterates over the clauses.
    pub fn clauses(&self) -> impl Iterator<Item = &[Literal]> {
        let begins = std::iter::once(0).chain(self.ends.iter().copied());
        begins.zip(&self.ends).map(|(begin, end)| &self.literals[begin..*end])
    }

    /// Returns the number of bits of the widest number in the encoding.
    pub fn widest(&self) -> usize {
        self.widest
    }

    pub(super) fn count(&self) -> usize {
        self.ends.len()
    }

    /// Writes the formula in the DIMACS format.
    ///
    /// # Errors
    /// I/O errors of the output.
    pub fn write_dimacs(&self, output: &mut dyn Write) -> std::io::Result<()> {
        self.dimacs(&mut |line| output.write_all(line))?;
        output.flush()
    }

    /// Writes the legend: one line for each variable, with its number and its description.
    ///
    /// # Errors
    /// I/O errors of the output.
    pub fn write_legend(&self, output: &mut dyn Write) -> std::io::Result<()> {
        self.legend(&mut |line| output.write_all(line))?;
        output.flush()
    }

    fn dimacs<E>(&self, visit: &mut dyn FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
        visit(format!("p cnf {} {}\n", self.variables(), self.count()).as_bytes())?;
        let mut line = Vec::new();
        self.clauses().try_for_each(|clause| {
            lines::format(&mut line, clause.iter().map(|literal| literal.number()));
            visit(&line)
        })
    }

    fn legend<E>(&self, visit: &mut dyn FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
        let mut line = String::new();
        (1..).zip(&self.names).try_for_each(|(number, name): (usize, _)| {
            line.clear();
            let _ = writeln!(line, "{number} {name}");
            visit(line.as_bytes())
        })
    }

    pub(super) fn compare(&self, formula: &mut dyn BufRead, legend: &mut dyn BufRead) -> Result<(), String> {
        let mut legend = LineComparer { what: "legend", text: legend, line: Vec::new(), number: 0 };
        self.legend(&mut |line| legend.compare(line))?;
        legend.end()?;
        let mut formula = LineComparer { what: "formula", text: formula, line: Vec::new(), number: 0 };
        self.dimacs(&mut |line| formula.compare(line))?;
        formula.end()
    }
}

struct LineComparer<'w> {
    what: &'static str,
    text: &'w mut dyn BufRead,
    line: Vec<u8>,
    number: usize,
}

impl LineComparer<'_> {
    #[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
    fn compare(&mut self, expected: &[u8]) -> Result<(), String> {
        self.number += 1;
        self.line.clear();
        // At most the expected length is read, which bounds memory; a longer line differs in any
        // case.
        let mut line = Read::take(&mut *self.text, expected.len() as u64);
        line.read_until(b'\n', &mut self.line)
            .map_err(|error| format!("the {} cannot be read: {error}", self.what))?;
        if self.line == expected {
            return Ok(());
        }
        let (number, what) = (self.number, self.what);
        let expected = String::from_utf8_lossy(expected.trim_ascii_end());
        Err(format!("line {number} of the {what} differs, `{expected}` is expected"))
    }

    fn end(&mut self) -> Result<(), String> {
        match self.text.fill_buf() {
            Ok([]) => Ok(()),
            Ok(_) => Err(format!("the {} has more lines", self.what)),
            Err(error) => Err(format!("the {} cannot be read: {error}", self.what)),
        }
    }
}
