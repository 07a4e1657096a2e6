//! Checks clausal proofs with hints. Each added clause must follow by reverse unit propagation
//! (RUP) through the clauses that its hints name, in this order. The last clause is empty.
//!
//! A clause follows if its negation leads to a contradiction. Each hint names a clause with at most
//! one literal that is not false. This literal becomes true; without such a literal, the clause is the
//! contradiction. The check does not search and visits each hint at most once. The clauses of the formula are numbered
//! from 1, followed by the clauses of the proof.

use std::io::BufRead;
use std::ops::Range;

use crate::clausal::lines;
use crate::clausal::literal::Literal;

/// Upper limit on the number of literals of all clauses in formula and proof.
const LITERAL_LIMIT: usize = 1 << 26;

/// Checks that a proof refutes `clauses`, which contain the variables `1..=variables`. Returns the
/// number of clauses of the proof.
///
/// # Errors
/// Reports the first line that cannot be read, is malformed, or does not follow. Also fails if the empty
/// clause is missing, or if there are more than [`LITERAL_LIMIT`] literals.
pub(super) fn check<'c>(
    clauses: impl Iterator<Item = &'c [Literal]>,
    variables: usize,
    proof: &mut dyn BufRead,
    hints: &mut dyn BufRead,
) -> Result<usize, String> {
    let mut checker = Checker {
        literals: Vec::new(),
        places: Vec::new(),
        is_true: vec![false; Literal::places(variables)],
        settled: Vec::new(),
    };
    clauses.for_each(|clause| checker.add(clause));
    let (mut line, mut clause, mut named) = (Vec::new(), Vec::new(), Vec::new());
    for number in 1.. {
        let wrong = |reason: &str| format!("line {number} of the proof {reason}");
        let unreadable = |error: std::io::Error| wrong(&format!("cannot be read: {error}"));
        let text = lines::read(proof, &mut line).map_err(unreadable)?;
        let text = text.ok_or("the proof ends before the empty clause")?;
        lines::literals(text, variables, &mut clause)
            .ok_or_else(|| wrong("is not a clause of the formula's variables"))?;
        let text = lines::read(hints, &mut line).map_err(unreadable)?.unwrap_or_default();
        lines::places(text, checker.places.len(), &mut named)
            .ok_or_else(|| wrong("has hints that name no clauses before it"))?;
        if !checker.follows(&clause, &named) {
            return Err(wrong("does not follow by its hints"));
        }
        if clause.is_empty() {
            return Ok(number);
        }
        checker.add(&clause);
        if checker.literals.len() > LITERAL_LIMIT {
            return Err(wrong("is one too many"));
        }
    }
    Err("the proof does not end".to_owned())
}

struct Checker {
    literals: Vec<Literal>,
    places: Vec<Range<usize>>,
    is_true: Vec<bool>,
    /// The true literals, in order to reset `is_true`.
    settled: Vec<Literal>,
}

impl Checker {
    fn add(&mut self, clause: &[Literal]) {
        let begin = self.literals.len();
        self.literals.extend(clause);
        self.places.push(begin..self.literals.len());
    }

    fn settle(&mut self, literal: Literal) {
        self.is_true[literal.index()] = true;
        self.settled.push(literal);
    }

    fn follows(&mut self, clause: &[Literal], hints: &[usize]) -> bool {
        for literal in clause {
            self.settle(-*literal);
        }
        let contradiction = self.contradiction(hints);
        for literal in self.settled.drain(..) {
            self.is_true[literal.index()] = false;
        }
        contradiction
    }

    fn contradiction(&mut self, hints: &[usize]) -> bool {
        for hint in hints {
            let Some(place) = self.places.get(*hint) else { return false };
            let clause = &self.literals[place.clone()];
            let mut open = clause.iter().filter(|literal| !self.is_true[(-**literal).index()]);
            match open.next().copied() {
                None => return true,
                // A clause may contain the same literal twice.
                Some(literal) if open.all(|repeated| *repeated == literal) => self.settle(literal),
                Some(_) => return false,
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::check;
    use crate::clausal::lines;
    use crate::clausal::literal::Literal;

    struct Random(u64);

    impl Random {
        fn below(&mut self, limit: u64) -> u64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 33) % limit
        }

        fn clause(&mut self) -> Vec<Literal> {
            let literal = |random: &mut Self| {
                let variable = Literal::of_variable(random.below(4) as usize + 1).expect("a variable");
                if random.below(2) == 0 { variable } else { -variable }
            };
            (0..=self.below(3)).map(|_| literal(self)).collect()
        }
    }

    fn has_a_model(clauses: &[Vec<Literal>]) -> bool {
        let holds =
            |model: u32, literal: &Literal| (model >> literal.variable() & 1 == 1) == (literal.number() > 0);
        (0..32).any(|model| clauses.iter().all(|clause| clause.iter().any(|literal| holds(model, literal))))
    }

    fn text(lines_of_numbers: &[Vec<i32>]) -> Vec<u8> {
        let mut text = Vec::new();
        let mut line = Vec::new();
        for numbers in lines_of_numbers {
            lines::format(&mut line, numbers.iter().copied());
            text.extend(&line);
        }
        text
    }

    #[test]
    fn a_clause_may_repeat_a_literal() {
        let literal = |number: &i32| Literal::new(*number).expect("a literal");
        let clauses = [&[1, 1][..], &[-1, 2, -1, 2], &[-2, -2]];
        let clauses = clauses.map(|clause| clause.iter().map(literal).collect::<Vec<_>>());
        let (proof, hints) = (text(&[Vec::new()]), text(&[vec![1, 2, 3]]));
        let borrowed = clauses.iter().map(Vec::as_slice);
        assert_eq!(check(borrowed, 2, &mut proof.as_slice(), &mut hints.as_slice()), Ok(1));
    }

    #[test]
    fn satisfiable_clauses_are_never_refuted() {
        let mut refuted = 0;
        for seed in 0..20_000 {
            let mut random = Random(seed);
            let count = 6 + random.below(10);
            let clauses: Vec<Vec<Literal>> = (0..count).map(|_| random.clause()).collect();
            let length = random.below(3);
            let mut proof: Vec<Vec<i32>> = (0..length)
                .map(|_| random.clause().iter().map(|literal| literal.number()).collect())
                .collect();
            proof.push(Vec::new());
            let hints = |line: u64, random: &mut Random| {
                (0..=random.below(8)).map(|_| 1 + random.below(count + line) as i32).collect()
            };
            let hints: Vec<Vec<i32>> = (0..=length).map(|line| hints(line, &mut random)).collect();
            let (proof, hints) = (text(&proof), text(&hints));
            let borrowed = clauses.iter().map(Vec::as_slice);
            let result = check(borrowed, 4, &mut proof.as_slice(), &mut hints.as_slice());
            assert!(
                result.is_err() || !has_a_model(&clauses),
                "seed {seed}: {clauses:?}\n{proof:?}\n{hints:?}"
            );
            refuted += u32::from(result.is_ok());
        }
        assert!(refuted > 100, "{refuted}");
    }
}
