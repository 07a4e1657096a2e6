//! A checker of DRAT proofs: each clause that a proof adds has to follow from the clauses so far by unit propagation (RUP), and
//! the last one is empty.
//!
//! Every clause that was added follows from the formula. So forgetting one is always admissible, and a clause that was
//! a reason for something that is settled may be taken away without unsettling it. Clauses that follow in the weaker sense
//! of resolution asymmetric tautologies are refused: the solvers that write for us add none.

use std::io::BufRead;

use rustc_hash::FxHashMap;

/// A line of a proof is not longer than this, in bytes.
const LINE_LIMIT: u64 = 1 << 22;
/// So many literals may be in use at a time.
const LITERAL_LIMIT: usize = 1 << 26;

/// Checks that a proof refutes clauses over variables numbered from 1; returns how many clauses it adds.
///
/// # Errors
/// The first line that does not follow, or that the proof ends too early.
pub(super) fn check<'c>(
    clauses: impl Iterator<Item = &'c [i32]>,
    variables: usize,
    proof: &mut dyn BufRead,
) -> Result<usize, String> {
    let mut checker = Checker::new(variables);
    for clause in clauses {
        checker.add(clause.to_vec());
    }
    if checker.contradiction {
        return Ok(0);
    }
    let mut count = 0;
    let mut line = String::new();
    for number in 1.. {
        let wrong = |reason: &str| format!("line {number} of the proof {reason}");
        line.clear();
        let read = std::io::Read::take(&mut *proof, LINE_LIMIT).read_line(&mut line);
        if read.map_err(|error| wrong(&format!("cannot be read: {error}")))? == 0 {
            return Err("the proof ends before the empty clause".to_owned());
        }
        let text = line.trim();
        let (deletes, text) = text.strip_prefix("d ").map_or((false, text), |rest| (true, rest));
        let clause =
            literals(text, variables).ok_or_else(|| wrong("is no clause of the formula's variables"))?;
        if deletes {
            checker.forget(&clause);
            continue;
        }
        count += 1;
        if !checker.follows(&clause) {
            return Err(wrong("does not follow by unit propagation"));
        }
        if clause.is_empty() || checker.add(clause) {
            return Ok(count);
        }
        if checker.literals > LITERAL_LIMIT {
            return Err(wrong("has too many literals in use"));
        }
    }
    Err("the proof does not end".to_owned())
}

/// The literals of a line, sorted, each once; the line ends with 0.
fn literals(text: &str, variables: usize) -> Option<Vec<i32>> {
    let mut words: Vec<&str> = text.split_ascii_whitespace().collect();
    if words.pop() != Some("0") {
        return None;
    }
    let literal = |word: &str| {
        let literal: i32 = word.parse().ok()?;
        (literal != 0 && literal.unsigned_abs() as usize <= variables).then_some(literal)
    };
    let mut clause = words.into_iter().map(literal).collect::<Option<Vec<i32>>>()?;
    clause.sort_unstable();
    clause.dedup();
    Some(clause)
}

/// The place of a literal in lists.
fn index(literal: i32) -> usize {
    2 * literal.unsigned_abs() as usize + usize::from(literal < 0)
}

struct Checker {
    /// The first two literals of each clause are watched; forgotten ones are empty.
    clauses: Vec<Vec<i32>>,
    watches: Vec<Vec<u32>>,
    /// By sorted literals.
    positions: FxHashMap<Vec<i32>, Vec<u32>>,
    /// Whether a literal is true.
    is_true: Vec<bool>,
    /// Literals that are true, in the order in which they became so.
    trail: Vec<i32>,
    /// How many of them have been propagated.
    done: usize,
    literals: usize,
    contradiction: bool,
}

impl Checker {
    fn new(variables: usize) -> Self {
        let size = 2 * variables + 2;
        Self {
            clauses: Vec::new(),
            watches: vec![Vec::new(); size],
            positions: FxHashMap::default(),
            is_true: vec![false; size],
            trail: Vec::new(),
            done: 0,
            literals: 0,
            contradiction: false,
        }
    }

    fn is_false(&self, literal: i32) -> bool {
        self.is_true[index(-literal)]
    }

    fn settle(&mut self, literal: i32) {
        if !self.is_true[index(literal)] {
            self.is_true[index(literal)] = true;
            self.trail.push(literal);
        }
    }

    /// Adds a clause that holds; whether a contradiction is settled now.
    fn add(&mut self, mut clause: Vec<i32>) -> bool {
        clause.sort_unstable();
        clause.dedup();
        let tautology = clause.iter().any(|literal| clause.binary_search(&-literal).is_ok());
        if self.contradiction || tautology {
            return self.contradiction;
        }
        self.literals += clause.len();
        let position = self.clauses.len() as u32;
        self.positions.entry(clause.clone()).or_default().push(position);
        // Literals that are not false first.
        clause.sort_by_key(|literal| self.is_false(*literal));
        let open = clause.iter().filter(|literal| !self.is_false(**literal)).count();
        if clause.len() >= 2 {
            for literal in &clause[..2] {
                self.watches[index(*literal)].push(position);
            }
        }
        match open {
            0 => self.contradiction = true,
            1 => {
                self.settle(clause[0]);
                self.clauses.push(clause);
                self.contradiction = self.propagate();
                return self.contradiction;
            }
            _ => {}
        }
        self.clauses.push(clause);
        self.contradiction
    }

    /// Takes a clause away, if it is there.
    fn forget(&mut self, clause: &[i32]) {
        let Some(positions) = self.positions.get_mut(clause) else { return };
        if let Some(position) = positions.pop() {
            self.literals -= clause.len();
            self.clauses[position as usize] = Vec::new();
        }
        if positions.is_empty() {
            self.positions.remove(clause);
        }
    }

    /// Whether a clause follows: whether its negation leads to a contradiction.
    fn follows(&mut self, clause: &[i32]) -> bool {
        if self.contradiction || clause.iter().any(|literal| self.is_true[index(*literal)]) {
            return true;
        }
        let (settled, done) = (self.trail.len(), self.done);
        for literal in clause {
            self.settle(-literal);
        }
        let tautology = clause.iter().any(|literal| self.is_true[index(*literal)]);
        let follows = tautology || self.propagate();
        for literal in self.trail.drain(settled..) {
            self.is_true[index(literal)] = false;
        }
        self.done = done;
        follows
    }

    /// Whether a contradiction is met.
    fn propagate(&mut self) -> bool {
        while let Some(literal) = self.trail.get(self.done).copied() {
            self.done += 1;
            let falsified = -literal;
            let mut watching = std::mem::take(&mut self.watches[index(falsified)]);
            let mut kept = 0;
            let mut contradiction = false;
            for at in 0..watching.len() {
                let position = watching[at];
                let next = if contradiction { Next::Keep } else { self.visit(position, falsified) };
                match next {
                    Next::Forget => continue,
                    Next::Watch(other) => {
                        self.watches[index(other)].push(position);
                        continue;
                    }
                    Next::Settle(unit) => self.settle(unit),
                    Next::Contradiction => contradiction = true,
                    Next::Keep => {}
                }
                watching[kept] = position;
                kept += 1;
            }
            watching.truncate(kept);
            self.watches[index(falsified)] = watching;
            if contradiction {
                return true;
            }
        }
        false
    }

    /// Looks at a clause one of whose watched literals has become false.
    fn visit(&mut self, position: u32, falsified: i32) -> Next {
        let is_true = &self.is_true;
        let clause = &mut self.clauses[position as usize];
        if clause.is_empty() {
            return Next::Forget;
        }
        if clause[0] == falsified {
            clause.swap(0, 1);
        }
        if is_true[index(clause[0])] {
            return Next::Keep;
        }
        match (2..clause.len()).find(|at| !is_true[index(-clause[*at])]) {
            Some(at) => {
                clause.swap(1, at);
                Next::Watch(clause[1])
            }
            None if is_true[index(-clause[0])] => Next::Contradiction,
            None => Next::Settle(clause[0]),
        }
    }
}

/// What becomes of a clause whose watched literal is false.
enum Next {
    /// It has been taken away.
    Forget,
    /// It is true, or nothing is left to watch.
    Keep,
    /// Another literal is watched.
    Watch(i32),
    /// Only one literal is left.
    Settle(i32),
    /// None is left.
    Contradiction,
}
