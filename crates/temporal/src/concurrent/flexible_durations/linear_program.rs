//! Linear programs in exact rationals, solved again after each added constraint.
//!
//! A program is stored as a *dictionary* \[1\]: basic columns and slacks as expressions over the nonbasic columns.
//! The dual simplex algorithm repairs a violated constraint from the last optimum; the primal one minimises
//! another objective. Both use Bland's rule, so that they terminate \[2\].
//!
//! \[1\] V. Chvátal: Linear Programming, 1983. \[2\] R. Bland: New finite pivoting rules for the simplex method,
//! Mathematics of Operations Research 2, 1977.

use num_traits::Zero;
use task::number::Rational;

use crate::concurrent::flexible_durations::affine::{Affine, Column};

/// The first column that stands for what a constraint has left.
const FIRST_SLACK_COLUMN: Column = 1 << 30;

/// A linear program with the optimum of its objective.
#[derive(Debug, Clone)]
pub(super) struct Program {
    /// Ascending by column, each as an expression over columns that are not here.
    rows: Vec<(Column, Affine)>,
    /// What is minimised, over the same columns.
    objective: Affine,
    slacks: Column,
}

impl Program {
    /// Without constraints, but that no column is below 0. The factors of the objective are not negative.
    pub(super) fn new(objective: Affine) -> Self {
        Self { rows: Vec::new(), objective, slacks: FIRST_SLACK_COLUMN }
    }

    /// The least value of the objective.
    pub(super) fn least(&self) -> &Rational {
        &self.objective.constant
    }

    /// About how many bytes it takes.
    pub(super) fn bytes(&self) -> usize {
        self.rows.iter().fold(self.objective.bytes(), |sum, (_, row)| sum.saturating_add(row.bytes()))
    }

    /// The value of an expression at the optimum.
    pub(super) fn value(&self, expression: &Affine) -> Rational {
        self.reduced(expression).constant
    }

    /// Asks that none of some expressions is below 0. False if that cannot be: the program is of no use then.
    pub(super) fn constrain<'e>(&mut self, all: impl IntoIterator<Item = &'e Affine>) -> bool {
        for expression in all {
            let row = self.reduced(expression);
            match row.known() {
                Some(value) if value.is_negative() => return false,
                Some(_) => {}
                None => {
                    self.rows.push((self.slacks, row));
                    self.slacks = self.slacks.saturating_add(1);
                }
            }
        }
        self.mend()
    }

    /// Minimises another objective. False if it has no least value.
    pub(super) fn minimise(&mut self, objective: &Affine) -> bool {
        self.objective = self.reduced(objective);
        loop {
            let entering = self.objective.terms.iter().find(|(_, factor)| factor.is_negative());
            let Some((entering, _)) = entering.cloned() else { return true };
            let mut leaving: Option<(Rational, Column)> = None;
            for (column, row) in &self.rows {
                if let Some(factor) = row.coefficient(entering).filter(|factor| factor.is_negative()) {
                    let step = row.constant.clone() / -factor.clone();
                    if leaving.as_ref().is_none_or(|(least, _)| step < *least) {
                        leaving = Some((step, *column));
                    }
                }
            }
            let Some((_, leaving)) = leaving else { return false };
            self.pivot(leaving, entering);
        }
    }

    /// An expression over the columns that are 0.
    fn reduced(&self, expression: &Affine) -> Affine {
        let mut reduced = Affine::constant(expression.constant.clone());
        for (column, factor) in &expression.terms {
            reduced = match self.rows.binary_search_by_key(column, |(own, _)| *own) {
                Ok(position) => reduced.plus(&self.rows[position].1, factor),
                Err(_) => reduced.plus(&Affine::column(*column), factor),
            };
        }
        reduced
    }

    /// The dual simplex algorithm.
    fn mend(&mut self) -> bool {
        loop {
            let broken = self.rows.iter().find(|(_, row)| row.constant.is_negative());
            let Some((leaving, row)) = broken else { return true };
            let leaving = *leaving;
            let mut entering: Option<(Rational, Column)> = None;
            for (column, factor) in row.terms.iter().filter(|(_, factor)| factor.is_positive()) {
                let price = self.objective.coefficient(*column).cloned().unwrap_or_else(Rational::zero);
                let ratio = price / factor.clone();
                if entering.as_ref().is_none_or(|(least, _)| ratio < *least) {
                    entering = Some((ratio, *column));
                }
            }
            let Some((_, entering)) = entering else { return false };
            self.pivot(leaving, entering);
        }
    }

    /// What was 0 takes the place of what becomes 0.
    fn pivot(&mut self, leaving: Column, entering: Column) {
        let position = self.rows.binary_search_by_key(&leaving, |(own, _)| *own);
        let (_, mut row) = self.rows.remove(position.expect("invariant: a row of the dictionary"));
        let position = row.terms.binary_search_by_key(&entering, |(own, _)| *own);
        let (_, factor) = row.terms.remove(position.expect("invariant: a column of the row"));
        // leaving = row + factor · entering
        let by = factor.recip();
        let solved = Affine::column(leaving).minus(&row).times(&by);
        for (_, other) in &mut self.rows {
            other.substitute(entering, &solved);
        }
        self.objective.substitute(entering, &solved);
        let position = self.rows.partition_point(|(own, _)| *own < entering);
        self.rows.insert(position, (entering, solved));
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn affine(constant: i128, factors: [i128; 2]) -> Affine {
        let terms = [(0, factors[0]), (1, factors[1])].into_iter().filter(|(_, factor)| *factor != 0);
        Affine {
            constant: Rational::from_integer(constant),
            terms: terms.map(|(column, factor)| (column, Rational::from_integer(factor))).collect(),
        }
    }

    /// The least value over two columns: at one of the points where two constraints meet.
    fn least(constraints: &[Affine], objective: &Affine) -> Option<Rational> {
        let mut all = constraints.to_vec();
        all.extend([affine(0, [1, 0]), affine(0, [0, 1])]);
        let zero = Rational::zero;
        let at = |expression: &Affine, point: &[Rational; 2]| {
            expression.terms.iter().fold(expression.constant.clone(), |sum, (column, factor)| {
                sum + factor.clone() * &point[*column as usize]
            })
        };
        let mut best: Option<Rational> = None;
        for (index, one) in all.iter().enumerate() {
            for other in &all[..index] {
                let factor = |of: &Affine, column| of.coefficient(column).cloned().unwrap_or_else(zero);
                let [a, b, c, d] = [factor(one, 0), factor(one, 1), factor(other, 0), factor(other, 1)];
                let determinant = a.clone() * &d - &(b.clone() * &c);
                if determinant.is_zero() {
                    continue;
                }
                let first = b * &other.constant - &(d * &one.constant);
                let second = c * &one.constant - &(a * &other.constant);
                let point = [first, second].map(|own| own / determinant.clone());
                if all.iter().all(|own| !at(own, &point).is_negative()) {
                    let value = at(objective, &point);
                    best = Some(best.map_or(value.clone(), |known| known.min(value)));
                }
            }
        }
        best
    }

    proptest! {
        #[test]
        fn agrees_with_all_corners(
            rows in prop::collection::vec((-9_i128..9, [-4_i128..5, -4_i128..5]), 0..7),
            costs in [0_i128..4, 0_i128..4],
            others in [-3_i128..4, -3_i128..4],
        ) {
            let mut constraints: Vec<_> = rows.iter().map(|(constant, row)| affine(*constant, *row)).collect();
            let objective = affine(1, costs);
            let mut program = Program::new(objective.clone());
            // One after another, so that each begins where the last one has ended.
            let holds = constraints.iter().all(|own| program.constrain([own]));
            let found = holds.then(|| program.least().clone());
            prop_assert_eq!(found, least(&constraints, &objective));
            if holds {
                let other = affine(0, others);
                let bounded = program.minimise(&other);
                if bounded {
                    prop_assert_eq!(Some(program.least().clone()), least(&constraints, &other));
                    prop_assert_eq!(program.value(&other), program.least().clone());
                } else {
                    // In a large box it has a least value, which is at the border of the box.
                    constraints.extend([affine(1_000_000, [-1, 0]), affine(1_000_000, [0, -1])]);
                    prop_assert!(least(&constraints, &other).is_some_and(|own| own < Rational::from_integer(-1000)));
                }
            }
        }
    }
}
