//! Bounds the values that policy iteration has computed in doubles. If the first bounds are not tight,
//! further methods are tried. Finite bounds are improved only if that is cheap, so they may stay wide.

use num_rational::BigRational;

use crate::number::{Number, count};
use crate::solve::certify::{certify, rounding};
use crate::solve::chain::Rows;
use crate::solve::interval::{self, Enclosed};
use crate::solve::iterate::{Iterated, iterate};
use crate::solve::problem::Direction;
use crate::solve::quotient::Quotient;
use crate::solve::work::{TIGHT, Work};

/// Limits for solving in rationals if the bounds in doubles are insufficient: work units, and
/// number of blocks (merged end components).
const RATIONAL_LIMITS: (u64, usize) = (1_000_000_000, 3000);
/// Work limit for solving in rationals if the bounds in doubles are finite but too wide, and the requested
/// width is [`TIGHT`] or more. In all other cases, the work limit is the first of [`RATIONAL_LIMITS`].
const IMPROVEMENT_LIMIT: u64 = 100_000_000;

/// Computes bounds on the values of all blocks (merged end components). Returns `None` if policy iteration
/// found no values and interval iteration finds no bounds. Otherwise, the bounds may still be wide or infinite
/// if no method improves them.
///
/// For a Markov chain, elimination has a small relative error. With choices, a certificate bounds the error. If
/// the probability of leaving a component is tiny, there may be no certificate in doubles. Small components are then
/// solved in rationals. If elimination is too expensive, interval iteration computes bounds from both sides.
pub fn enclosed<N: Number>(
    quotient: &Quotient<N>,
    iterated: Option<Iterated<N>>,
    direction: Direction,
    work: &mut Work<'_>,
) -> Option<Enclosed<N>> {
    let tight = work.tight;
    let Some(mut iterated) = iterated else { return interval::enclose(quotient, direction, work) };
    let is_chain = (0..quotient.blocks()).all(|block| quotient.range(block).len() <= 1);
    if !is_chain {
        // These errors refer to the values of the computed policy, which may not be optimal if there are
        // choices.
        iterated.relative = Vec::new();
    }
    if quotient.blocks() > RATIONAL_LIMITS.1 && !is_level(quotient, &iterated.values, tight) {
        let around = interval::around(quotient, &iterated.values, direction, tight);
        if around.is_some() {
            return around;
        }
    }
    let mut errors: Vec<f64> = if is_chain {
        iterated
            .values
            .iter()
            .zip(&iterated.relative)
            .map(|(value, relative)| value.to_f64() * relative)
            .collect()
    } else {
        certify(quotient, &iterated.policy, &iterated.values, direction)
    };
    if is_chain && !is_tight(&iterated.values, &errors, tight) {
        let certified = certify(quotient, &iterated.policy, &iterated.values, direction);
        for (error, certified) in errors.iter_mut().zip(certified) {
            *error = error.min(certified);
        }
    }
    let is_good = is_tight(&iterated.values, &errors, tight);
    let rounded = Enclosed { policy: iterated.policy, values: iterated.values, errors };
    if is_good {
        return Some(rounded);
    }
    // Finite but wide bounds are improved only if that is cheap. More work is done if an error is
    // infinite, or if narrower bounds than usual were requested.
    let is_usual = tight >= TIGHT && rounded.errors.iter().all(|error| error.is_finite());
    let limit = if is_usual { IMPROVEMENT_LIMIT } else { RATIONAL_LIMITS.0 };
    let exact = (quotient.blocks() <= RATIONAL_LIMITS.1)
        .then(|| work.spared(limit, |work| in_rationals(quotient, &rounded.policy, direction, work)));
    let improved = exact.flatten();
    if is_usual {
        return improved.or(Some(rounded));
    }
    improved
        .or_else(|| interval::around(quotient, &rounded.values, direction, tight))
        .or_else(|| interval::enclose(quotient, direction, work))
        .or(Some(rounded))
}

/// Returns `true` if the rounding error of the greatest value is within the error that the least positive value
/// permits. Otherwise a certificate, which bounds the errors of all blocks together, is hardly tight for small
/// values.
fn is_level<N: Number>(quotient: &Quotient<N>, values: &[N], tight: f64) -> bool {
    let values = values.iter().map(Number::to_f64).filter(|value| *value > 0.0);
    let (least, greatest) = values
        .fold((f64::INFINITY, 0.0_f64), |(least, greatest), value| (least.min(value), greatest.max(value)));
    rounding(quotient.widest) * greatest <= tight * 0.5 * least
}

fn is_tight<N: Number>(values: &[N], errors: &[f64], tight: f64) -> bool {
    values.iter().zip(errors).all(|(value, error)| value.is_zero() || *error <= tight * 0.5 * value.to_f64())
}

/// Solves the equations in rationals, although their entries are rounded. Returns `None` if the budget is
/// exceeded or an entry is not finite.
///
/// Each row is first divided by the sum of its probabilities (see [`stochastic`]). Otherwise, the pivots of
/// elimination, which are sums of probabilities of leaving, would contradict the diagonal of the equations by
/// the rounding error of this sum. Values of about 10^16 steps multiply this error, so that policy
/// iteration would stop at a wrong policy or alternate between policies.
///
/// With u = ε/2, the error bound is as follows, up to factors near 1:
///
/// - Let w be the greatest number of transitions of a choice. An entry of a rounded row has a relative error of
///   at most (w + 3)ε: the probability itself is rounded (ε), merging adds up to w of them (wu), and the
///   division by the probability of not looping adds as much again. The division by the sum doubles this
///   error for probabilities. Constants are not divided.
/// - The value of a policy is N/D, where N and D are sums of products of n probabilities at most (see `chain`);
///   each term of N has a constant in place of one of them. Hence the relative error is at most 4n(w + 3)ε.
/// - The rows have the same transitions before and after rounding, so the same policies leave the component. As
///   the bound holds for the value of each of them, it holds for the optimum, too.
fn in_rationals<N: Number>(
    quotient: &Quotient<N>,
    policy: &[u32],
    direction: Direction,
    work: &mut Work<'_>,
) -> Option<Enclosed<N>> {
    let rational = Quotient {
        first: quotient.first.clone(),
        rows: stochastic(&quotient.rows)?,
        choices: quotient.choices.clone(),
        widest: quotient.widest,
    };
    let optimum = iterate(&rational, policy.to_vec(), direction, work)?;
    let relative = 4.0 * (count(quotient.blocks()) + 4.0) * (count(quotient.widest) + 8.0) * f64::EPSILON;
    let values: Vec<N> = optimum.values.iter().map(N::from_rational).collect();
    let errors = values.iter().map(|value| value.to_f64() * relative).collect();
    Some(Enclosed { policy: optimum.policy, values, errors })
}

/// Converts rows to rationals and divides the probabilities of each row by their sum, so that this sum is
/// exactly 1. Returns `None` if an entry is not finite.
fn stochastic<N: Number>(rows: &Rows<N>) -> Option<Rows<BigRational>> {
    let exact = |number: &N| BigRational::from_float(number.to_f64());
    let exact_numbers = |numbers: &[N]| numbers.iter().map(exact).collect::<Option<Vec<_>>>();
    let mut result = Rows {
        first: rows.first.clone(),
        columns: rows.columns.clone(),
        probabilities: exact_numbers(&rows.probabilities)?,
        constants: exact_numbers(&rows.constants)?,
        leaving: exact_numbers(&rows.leaving)?,
    };
    for row in 0..result.len() {
        let range = result.range(row);
        let sum = result.probabilities[range.clone()]
            .iter()
            .fold(result.leaving[row].clone(), |sum, p| sum.plus(p));
        if !sum.is_unit() {
            let probabilities = result.probabilities[range].iter_mut();
            for probability in probabilities.chain([&mut result.leaving[row]]) {
                *probability = probability.over(&sum);
            }
        }
    }
    Some(result)
}
