//! Trims the proof of a SAT solver, in DRAT format, to a short proof with hints.
//!
//! Each clause of the solver's proof must follow from earlier clauses by unit propagation \[1\]; other RAT
//! clauses are rejected. The clauses used in this propagation become the hints of the derived clause. Literals
//! that are permanently implied become unit clauses, which keeps hints short. Only clauses on which the empty
//! clause depends are written.
//!
//! The result is checked again by the crate `certificate`. The checker has its own propagation, which follows the
//! hints. Both use the same reader and writer of clauses (`certificate::lines`).
//!
//! \[1\] L. Cruz-Filipe, M. Heule, W. Hunt, M. Kaufmann, P. Schneider-Kamp: Efficient certified RAT
//! verification, CADE 2017.

use std::io::{BufRead, Write};

use certificate::{Literal, lines};
use rustc_hash::FxHashMap;

use task::limits::Limits;

const LITERAL_LIMIT: usize = 1 << 26;
const NONE: u32 = u32::MAX;

/// Reads the solver's proof `draft` for the given clauses, and writes the trimmed proof and its hints, line
/// by line.
///
/// # Errors
/// The draft cannot be read or is not a valid proof, a limit is reached, or a file cannot be written.
#[expect(clippy::arithmetic_side_effects, reason = "places of clauses that are held in memory")]
pub(super) fn trim<'c>(
    clauses: impl Iterator<Item = &'c [Literal]>,
    variables: usize,
    draft: &mut dyn BufRead,
    (proof, hints): (&mut dyn Write, &mut dyn Write),
    limits: &Limits,
) -> Result<(), String> {
    let mut trimmer = Trimmer::new(variables);
    for clause in clauses {
        let position = trimmer.push(clause.to_vec());
        trimmer.given += 1;
        trimmer.watch(position);
    }
    trimmer.settle_all();
    let (mut line, mut clause) = (Vec::new(), Vec::new());
    while !trimmer.is_done {
        let failed = |error: std::io::Error| format!("the solver's proof cannot be read: {error}");
        let text = lines::read(draft, &mut line).map_err(failed)?;
        let text = text.ok_or("the solver's proof ends before the empty clause")?;
        let (deletes, text) =
            text.strip_prefix(b"d ").map_or((false, text), |clause_text| (true, clause_text));
        lines::literals(text, variables, &mut clause).ok_or("the solver's proof has no clause in a line")?;
        clause.sort_unstable();
        clause.dedup();
        if deletes {
            trimmer.forget(&clause);
        } else {
            trimmer.conclude(&clause)?;
        }
        if limits.reached() {
            return Err("the solver's proof was not trimmed within the limits".to_owned());
        }
        if trimmer.size > LITERAL_LIMIT {
            return Err("the solver's proof is too long".to_owned());
        }
    }
    trimmer.write(proof, hints).map_err(|error| format!("the proof cannot be written: {error}"))
}

struct Trimmer {
    /// Clauses of the formula, followed by derived clauses. The first two literals of a clause are
    /// watched.
    clauses: Vec<Vec<Literal>>,
    given: usize,
    hints: Vec<Vec<u32>>,
    is_gone: Vec<bool>,
    watches: Vec<Vec<u32>>,
    positions: FxHashMap<Vec<Literal>, Vec<u32>>,
    is_true: Vec<bool>,
    trail: Vec<Literal>,
    /// Number of literals of the trail that have been propagated.
    done: usize,
    reasons: Vec<u32>,
    /// The unit clause that permanently fixes the value of each variable.
    units: Vec<u32>,
    is_seen: Vec<bool>,
    conflict: Option<u32>,
    is_done: bool,
    size: usize,
}

impl Trimmer {
    #[expect(clippy::arithmetic_side_effects, reason = "places of clauses that are held in memory")]
    fn new(variables: usize) -> Self {
        let size = variables + 1;
        Self {
            clauses: Vec::new(),
            given: 0,
            hints: Vec::new(),
            is_gone: Vec::new(),
            watches: vec![Vec::new(); Literal::places(variables)],
            positions: FxHashMap::default(),
            is_true: vec![false; Literal::places(variables)],
            trail: Vec::new(),
            done: 0,
            reasons: vec![NONE; size],
            units: vec![NONE; size],
            is_seen: vec![false; size],
            conflict: None,
            is_done: false,
            size: 0,
        }
    }

    fn is_false(&self, literal: Literal) -> bool {
        self.is_true[(-literal).index()]
    }

    #[expect(
        clippy::arithmetic_side_effects,
        clippy::cast_possible_truncation,
        reason = "clauses, none of them empty but the last, have little more than 2^26 literals in all"
    )]
    fn push(&mut self, clause: Vec<Literal>) -> u32 {
        self.size += clause.len();
        self.clauses.push(clause);
        self.is_gone.push(false);
        self.clauses.len() as u32 - 1
    }

    fn push_concluded(&mut self, clause: Vec<Literal>, hints: Vec<u32>) -> u32 {
        self.is_done |= clause.is_empty();
        self.hints.push(hints);
        self.push(clause)
    }

    fn settle(&mut self, literal: Literal, reason: u32) {
        if !self.is_true[literal.index()] {
            self.is_true[literal.index()] = true;
            self.reasons[literal.variable()] = reason;
            self.trail.push(literal);
        }
    }

    /// Starts watching a new clause, unless it is a tautology. If it is a unit clause under the current
    /// assignment, assigns its literal; if all its literals are false, records the conflict.
    fn watch(&mut self, position: u32) {
        let mut clause = std::mem::take(&mut self.clauses[position as usize]);
        clause.sort_unstable();
        clause.dedup();
        self.positions.entry(clause.clone()).or_default().push(position);
        let tautology = clause.iter().any(|literal| clause.binary_search(&-*literal).is_ok());
        clause.sort_by_key(|literal| self.is_false(*literal));
        if !tautology {
            if clause.len() >= 2 {
                for literal in &clause[..2] {
                    self.watches[literal.index()].push(position);
                }
            }
            match clause.iter().filter(|literal| !self.is_false(**literal)).count() {
                0 => self.conflict = self.conflict.or(Some(position)),
                1 => self.settle(clause[0], position),
                _ => {}
            }
        }
        self.clauses[position as usize] = clause;
    }

    /// Propagates all assigned literals permanently. Each implied literal becomes a unit clause, and a
    /// conflict becomes the empty clause.
    fn settle_all(&mut self) {
        let conflict = self.conflict.or_else(|| self.propagate());
        for at in 0..self.trail.len() {
            let variable = self.trail[at].variable();
            if self.units[variable] == NONE {
                let reason = self.reasons[variable];
                self.units[variable] = if self.clauses[reason as usize].len() == 1 {
                    reason
                } else {
                    let hints = self.by_units(reason, variable);
                    self.push_concluded(vec![self.trail[at]], hints)
                };
            }
        }
        if let Some(conflict) = conflict {
            let hints = self.by_units(conflict, 0);
            self.push_concluded(Vec::new(), hints);
        }
    }

    /// Returns hints: the unit clauses that falsify all literals of a clause except those of the variable
    /// `except` (0 for no exception), followed by the clause itself.
    fn by_units(&self, position: u32, except: usize) -> Vec<u32> {
        let variables = self.clauses[position as usize].iter().map(|literal| literal.variable());
        let units = variables.filter(|variable| *variable != except).map(|variable| self.units[variable]);
        units.chain([position]).collect()
    }

    /// Adds a clause of the solver's proof with its hints. Ignores a tautology. Fails if the clause does not
    /// follow by unit propagation.
    fn conclude(&mut self, clause: &[Literal]) -> Result<(), String> {
        if clause.iter().any(|literal| clause.binary_search(&-*literal).is_ok()) {
            return Ok(());
        }
        let hints = self.follows(clause).ok_or("a clause of the solver's proof does not follow")?;
        let position = self.push_concluded(clause.to_vec(), hints);
        if !self.is_done {
            self.watch(position);
            self.settle_all();
        }
        Ok(())
    }

    /// Deletes one copy of a clause. Literals that are permanently assigned because of this clause stay
    /// assigned.
    fn forget(&mut self, clause: &[Literal]) {
        let Some(positions) = self.positions.get_mut(clause) else { return };
        if let Some(position) = positions.pop() {
            self.is_gone[position as usize] = true;
        }
        if positions.is_empty() {
            self.positions.remove(clause);
        }
    }

    /// Returns the clauses from which a clause follows by unit propagation, in the order of
    /// propagation; `None` if it does not follow.
    fn follows(&mut self, clause: &[Literal]) -> Option<Vec<u32>> {
        if let Some(literal) = clause.iter().find(|literal| self.is_true[literal.index()]) {
            return Some(vec![self.units[literal.variable()]]);
        }
        let (settled, done) = (self.trail.len(), self.done);
        for literal in clause {
            self.settle(-*literal, NONE);
        }
        let conflict = self.propagate();
        let hints = conflict.map(|conflict| self.antecedents(conflict, settled));
        for literal in self.trail.drain(settled..) {
            self.is_true[literal.index()] = false;
        }
        self.done = done;
        hints
    }

    /// Returns the clauses on which a conflict depends, in the order of propagation; the falsified clause is
    /// last. `settled` is the number of permanently assigned literals.
    fn antecedents(&mut self, conflict: u32, settled: usize) -> Vec<u32> {
        let mut hints = vec![conflict];
        let mut units = Vec::new();
        let mut visited = Vec::new();
        let mut look = |position: u32, is_seen: &mut Vec<bool>| {
            for literal in &self.clauses[position as usize] {
                let variable = literal.variable();
                if !std::mem::replace(&mut is_seen[variable], true) {
                    visited.push(variable);
                    units.extend((self.units[variable] != NONE).then_some(self.units[variable]));
                }
            }
        };
        look(conflict, &mut self.is_seen);
        for literal in self.trail[settled..].iter().rev() {
            let reason = self.reasons[literal.variable()];
            if self.is_seen[literal.variable()] && reason != NONE {
                hints.push(reason);
                look(reason, &mut self.is_seen);
            }
        }
        for variable in visited {
            self.is_seen[variable] = false;
        }
        hints.extend(units);
        hints.reverse();
        hints
    }

    /// Propagates the new literals of the trail. Returns a clause whose literals are all false, if there is one.
    #[expect(clippy::arithmetic_side_effects, reason = "places of clauses that are held in memory")]
    fn propagate(&mut self) -> Option<u32> {
        while let Some(literal) = self.trail.get(self.done).copied() {
            self.done += 1;
            let falsified = -literal;
            let mut watching = std::mem::take(&mut self.watches[falsified.index()]);
            let mut conflict = None;
            watching.retain(|position| conflict.is_some() || self.visit(*position, falsified, &mut conflict));
            self.watches[falsified.index()] = watching;
            if conflict.is_some() {
                return conflict;
            }
        }
        None
    }

    /// Updates a clause after one of its watched literals has become false. Returns `true` if this literal
    /// stays watched.
    fn visit(&mut self, position: u32, falsified: Literal, conflict: &mut Option<u32>) -> bool {
        if self.is_gone[position as usize] {
            return false;
        }
        let clause = &mut self.clauses[position as usize];
        if clause[0] == falsified {
            clause.swap(0, 1);
        }
        if self.is_true[clause[0].index()] {
            return true;
        }
        if let Some(at) = (2..clause.len()).find(|at| !self.is_true[(-clause[*at]).index()]) {
            clause.swap(1, at);
            self.watches[clause[1].index()].push(position);
            return false;
        }
        if self.is_true[(-clause[0]).index()] {
            *conflict = Some(position);
        } else {
            let first = clause[0];
            self.settle(first, position);
        }
        true
    }

    #[expect(clippy::arithmetic_side_effects, reason = "places of clauses that are held in memory")]
    fn write(&self, proof: &mut dyn Write, hints: &mut dyn Write) -> std::io::Result<()> {
        let mut is_needed = vec![false; self.clauses.len()];
        is_needed[self.clauses.len() - 1] = true;
        for at in (self.given..self.clauses.len()).rev() {
            if is_needed[at] {
                for hint in &self.hints[at - self.given] {
                    is_needed[*hint as usize] = true;
                }
            }
        }
        // The clauses of the formula keep their numbers, from 1. The derived clauses that are needed get the next
        // numbers.
        let mut numbers = 1..;
        let mut places: Vec<i32> = numbers.by_ref().take(self.given).collect();
        let mut line = Vec::new();
        let concluded = self.clauses.iter().zip(is_needed).skip(self.given);
        for ((clause, is_needed), hints_of) in concluded.zip(&self.hints) {
            let number = if is_needed { numbers.next() } else { None };
            places.push(number.unwrap_or(0));
            if is_needed {
                lines::format(&mut line, clause.iter().map(|literal| literal.number()));
                proof.write_all(&line)?;
                lines::format(&mut line, hints_of.iter().map(|hint| places[*hint as usize]));
                hints.write_all(&line)?;
            }
        }
        proof.flush()?;
        hints.flush()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::Ordering;

    use super::*;

    #[test]
    fn a_limit_is_not_reported_as_a_long_proof() {
        let clause = |text: &str| {
            let mut clause = Vec::new();
            lines::literals(text.as_bytes(), 2, &mut clause).expect("literals");
            clause
        };
        let clauses = ["1 2 0", "1 -2 0", "-1 2 0", "-1 -2 0"].map(clause);
        let trimmed = |limits: &Limits| {
            let mut draft = &b"1 0\n0\n"[..];
            let (mut proof, mut hints) = (Vec::new(), Vec::new());
            trim(clauses.iter().map(Vec::as_slice), 2, &mut draft, (&mut proof, &mut hints), limits)
        };
        let limits = Limits::none();
        assert_eq!(trimmed(&limits), Ok(()));
        limits.interrupt().store(true, Ordering::Relaxed);
        let reason = "the solver's proof was not trimmed within the limits";
        assert_eq!(trimmed(&limits), Err(reason.to_owned()));
    }
}
