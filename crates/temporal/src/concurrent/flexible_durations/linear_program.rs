//! Linear programs in exact rational arithmetic, reoptimised after each added constraint.
//!
//! A program is stored as a *dictionary* \[1\]: each basic column as an expression over the nonbasic ones. Slacks
//! are columns, too. The dual simplex algorithm restores feasibility after adding a constraint; the
//! primal simplex algorithm minimises another objective. Both use Bland's rule to guarantee
//! termination \[2\].
//!
//! \[1\] V. Chvátal: Linear Programming, 1983. \[2\] R. Bland: New finite pivoting rules for the
//! simplex method, Mathematics of Operations Research 2, 1977.

use num_traits::Zero;
use task::limits::{Interrupted, Limits};
use task::number::Rational;

use crate::concurrent::flexible_durations::affine::{Affine, Column};

const FIRST_SLACK_COLUMN: Column = 1 << 30;

/// A linear program at the optimum of its objective.
#[derive(Debug, Clone)]
pub(super) struct Program {
    /// Dictionary: basic columns in ascending order, each as an expression over nonbasic columns.
    rows: Vec<(Column, Affine)>,
    objective: Affine,
    slacks: Column,
}

impl Program {
    /// Program whose only constraints are that all columns are at least 0. The factors of the
    /// objective must not be negative.
    pub(super) fn new(objective: Affine) -> Self {
        Self { rows: Vec::new(), objective, slacks: FIRST_SLACK_COLUMN }
    }

    pub(super) fn least(&self) -> &Rational {
        &self.objective.constant
    }

    pub(super) fn bytes(&self) -> usize {
        self.rows.iter().fold(self.objective.bytes(), |sum, (_, row)| sum.saturating_add(row.bytes()))
    }

    pub(super) fn value(&self, expression: &Affine) -> Rational {
        self.reduced(expression).constant
    }

    /// Adds the constraints that each expression is at least 0, and reoptimises. Returns `false` if
    /// the constraints are infeasible; the program must not be used then, nor after an interruption.
    pub(super) fn constrain<'e>(
        &mut self,
        expressions: impl IntoIterator<Item = &'e Affine>,
        limits: &Limits,
    ) -> Result<bool, Interrupted> {
        for expression in expressions {
            let row = self.reduced(expression);
            match row.known() {
                Some(value) if value.is_negative() => return Ok(false),
                Some(_) => {}
                None => {
                    self.rows.push((self.slacks, row));
                    self.slacks = self.slacks.saturating_add(1);
                }
            }
        }
        self.mend(limits)
    }

    /// Minimises another objective by the primal simplex algorithm. Returns `false` if the
    /// objective is unbounded below.
    pub(super) fn minimise(&mut self, objective: &Affine, limits: &Limits) -> Result<bool, Interrupted> {
        self.objective = self.reduced(objective);
        let mut pulse = limits.pulse();
        loop {
            pulse.beat()?;
            // Bland's rule takes the first eligible column, which prevents cycling.
            let entering = self.objective.terms.iter().find(|(_, factor)| factor.is_negative());
            let Some((entering, _)) = entering.cloned() else { return Ok(true) };
            let mut leaving: Option<(Rational, Column)> = None;
            for (column, row) in &self.rows {
                if let Some(factor) = row.coefficient(entering).filter(|factor| factor.is_negative()) {
                    let step = row.constant.clone() / -factor.clone();
                    if leaving.as_ref().is_none_or(|(least, _)| step < *least) {
                        leaving = Some((step, *column));
                    }
                }
            }
            let Some((_, leaving)) = leaving else { return Ok(false) };
            self.pivot(leaving, entering);
        }
    }

    /// Rewrites an expression over the nonbasic columns. Its constant is then the value at the
    /// current optimum, where nonbasic columns are 0.
    fn reduced(&self, expression: &Affine) -> Affine {
        let mut reduced = Affine::constant(expression.constant.clone());
        for (column, factor) in &expression.terms {
            reduced = match self.rows.binary_search_by_key(column, |(basic, _)| *basic) {
                Ok(position) => reduced.plus(&self.rows[position].1, factor),
                Err(_) => reduced.plus(&Affine::column(*column), factor),
            };
        }
        reduced
    }

    /// Restores feasibility by the dual simplex algorithm. Returns `false` if no feasible solution
    /// exists.
    fn mend(&mut self, limits: &Limits) -> Result<bool, Interrupted> {
        let mut pulse = limits.pulse();
        loop {
            pulse.beat()?;
            let broken = self.rows.iter().find(|(_, row)| row.constant.is_negative());
            let Some((leaving, row)) = broken else { return Ok(true) };
            let leaving = *leaving;
            let mut entering: Option<(Rational, Column)> = None;
            for (column, factor) in row.terms.iter().filter(|(_, factor)| factor.is_positive()) {
                let price = self.objective.coefficient(*column).cloned().unwrap_or_else(Rational::zero);
                let ratio = price / factor.clone();
                if entering.as_ref().is_none_or(|(least, _)| ratio < *least) {
                    entering = Some((ratio, *column));
                }
            }
            let Some((_, entering)) = entering else { return Ok(false) };
            self.pivot(leaving, entering);
        }
    }

    fn pivot(&mut self, leaving: Column, entering: Column) {
        let position = self.rows.binary_search_by_key(&leaving, |(candidate, _)| *candidate);
        let (_, mut row) = self.rows.remove(position.expect("invariant: a row of the dictionary"));
        let position = row.terms.binary_search_by_key(&entering, |(candidate, _)| *candidate);
        let (_, factor) = row.terms.remove(position.expect("invariant: a column of the row"));
        // Solves `leaving = row + factor · entering` for `entering`.
        let by = factor.recip();
        let solved = Affine::column(leaving).minus(&row).times(&by);
        for (_, row) in &mut self.rows {
            row.substitute(entering, &solved);
        }
        self.objective.substitute(entering, &solved);
        let position = self.rows.partition_point(|(basic, _)| *basic < entering);
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

    /// Brute-force minimum of an objective over two columns, attained at an intersection of two
    /// constraints.
    fn least(constraints: &[Affine], objective: &Affine) -> Option<Rational> {
        let mut half_planes = constraints.to_vec();
        half_planes.extend([affine(0, [1, 0]), affine(0, [0, 1])]);
        let zero = Rational::zero;
        let at = |expression: &Affine, point: &[Rational; 2]| {
            expression.terms.iter().fold(expression.constant.clone(), |sum, (column, factor)| {
                sum + factor.clone() * &point[*column as usize]
            })
        };
        let mut best: Option<Rational> = None;
        for (index, first_line) in half_planes.iter().enumerate() {
            for second_line in &half_planes[..index] {
                let factor = |of: &Affine, column| of.coefficient(column).cloned().unwrap_or_else(zero);
                let [a, b, c, d] = [
                    factor(first_line, 0),
                    factor(first_line, 1),
                    factor(second_line, 0),
                    factor(second_line, 1),
                ];
                let determinant = a.clone() * &d - &(b.clone() * &c);
                if determinant.is_zero() {
                    continue;
                }
                let first = b * &second_line.constant - &(d * &first_line.constant);
                let second = c * &first_line.constant - &(a * &second_line.constant);
                let point = [first, second].map(|numerator| numerator / determinant.clone());
                if half_planes.iter().all(|expression| !at(expression, &point).is_negative()) {
                    let value = at(objective, &point);
                    best = Some(best.map_or(value.clone(), |least| least.min(value)));
                }
            }
        }
        best
    }

    #[test]
    fn a_limit_interrupts_the_simplex_algorithms() {
        let limits = Limits::none();
        let mut program = Program::new(affine(0, [1, 1]));
        assert_eq!(program.constrain(&[affine(-3, [1, 2])], &limits), Ok(true));
        limits.interrupt().store(true, std::sync::atomic::Ordering::Relaxed);
        assert!(program.clone().constrain(&[affine(-3, [2, 1])], &limits).is_err());
        assert!(program.minimise(&affine(0, [2, 1]), &limits).is_err());
    }

    proptest! {
        #[test]
        fn the_simplex_optimum_equals_the_best_corner(
            rows in prop::collection::vec((-9_i128..9, [-4_i128..5, -4_i128..5]), 0..7),
            costs in [0_i128..4, 0_i128..4],
            others in [-3_i128..4, -3_i128..4],
        ) {
            let mut constraints: Vec<_> = rows.iter().map(|(constant, row)| affine(*constant, *row)).collect();
            let objective = affine(1, costs);
            let mut program = Program::new(objective.clone());
            // Constraints are added one by one, so that each step starts from the last optimum.
            let limits = Limits::none();
            let holds = constraints.iter().all(|constraint| program.constrain([constraint], &limits).expect("no limit"));
            let optimum = holds.then(|| program.least().clone());
            prop_assert_eq!(optimum, least(&constraints, &objective));
            if holds {
                let second_objective = affine(0, others);
                let bounded = program.minimise(&second_objective, &limits).expect("no limit");
                if bounded {
                    prop_assert_eq!(Some(program.least().clone()), least(&constraints, &second_objective));
                    prop_assert_eq!(program.value(&second_objective), program.least().clone());
                } else {
                    // Within a large box, the objective has a minimum, on the border of the box.
                    constraints.extend([affine(1_000_000, [-1, 0]), affine(1_000_000, [0, -1])]);
                    prop_assert!(least(&constraints, &second_objective).is_some_and(|value| value < Rational::from_integer(-1000)));
                }
            }
        }
    }
}
