//! What policy iteration found in doubles to values with bounds: by the first method that makes them tight.

use num_rational::BigRational;

use crate::number::{Number, count};
use crate::solve::certify::{certify, rounding};
use crate::solve::chain::Rows;
use crate::solve::interval::{self, Enclosed};
use crate::solve::iterate::{Iterated, iterate};
use crate::solve::problem::Direction;
use crate::solve::quotient::Quotient;
use crate::solve::work::{TIGHT, Work};

/// What a component may cost in rationals, where doubles cannot tell enough of it; and the blocks that it may have.
const RATIONAL: (u64, usize) = (1_000_000_000, 3000);
/// What it may cost where they tell enough for most purposes.
const TIGHTER: u64 = 100_000_000;

/// Bounds on the values of all blocks; none where no method finds any.
///
/// A chain's elimination has a small relative error by itself. Where there are choices, a certificate tells the error; a
/// process that is left very rarely has none in doubles, and is solved in rationals. What elimination cannot solve at all is
/// iterated from both sides.
pub fn enclosed<N: Number>(
    quotient: &Quotient<N>,
    found: Option<Iterated<N>>,
    direction: Direction,
    work: &mut Work,
) -> Option<Enclosed<N>> {
    let tight = work.tight;
    let Some(mut found) = found else { return interval::enclose(quotient, direction, tight) };
    let is_chain = (0..quotient.blocks()).all(|block| quotient.range(block).len() <= 1);
    if !is_chain {
        // What they are off by is told of this policy only.
        found.relative = Vec::new();
    }
    if quotient.blocks() > RATIONAL.1 && !is_level(quotient, &found.values, tight) {
        let around = interval::around(quotient, &found.values, direction, tight);
        if around.is_some() {
            return around;
        }
    }
    let mut errors: Vec<f64> = if is_chain {
        found.values.iter().zip(&found.relative).map(|(value, relative)| value.to_f64() * relative).collect()
    } else {
        certify(quotient, &found.policy, &found.values, direction)
    };
    if is_chain && !is_tight(&found.values, &errors, tight) {
        let certified = certify(quotient, &found.policy, &found.values, direction);
        for (error, certified) in errors.iter_mut().zip(certified) {
            *error = error.min(certified);
        }
    }
    let is_good = is_tight(&found.values, &errors, tight);
    let rounded = Enclosed { policy: found.policy, values: found.values, errors };
    if is_good {
        return Some(rounded);
    }
    // Bounds that are there, but wide, are made better while that is cheap, or because it was asked for.
    let is_usual = tight >= TIGHT && rounded.errors.iter().all(|error| error.is_finite());
    let most = if is_usual { TIGHTER } else { RATIONAL.0 };
    let exact = (quotient.blocks() <= RATIONAL.1)
        .then(|| work.spared(most, |work| in_rationals(quotient, &rounded.policy, direction, work)));
    let found = exact.flatten();
    if is_usual {
        return found.or(Some(rounded));
    }
    found
        .or_else(|| interval::around(quotient, &rounded.values, direction, tight))
        .or_else(|| interval::enclose(quotient, direction, tight))
        .or(Some(rounded))
}

/// Whether one error for all blocks, which is what a certificate tells, can be tight for the least value, too.
fn is_level<N: Number>(quotient: &Quotient<N>, values: &[N], tight: f64) -> bool {
    let values = values.iter().map(Number::to_f64).filter(|value| *value > 0.0);
    let (least, most) =
        values.fold((f64::INFINITY, 0.0_f64), |(least, most), value| (least.min(value), most.max(value)));
    rounding(quotient.widest) * most <= tight * 0.5 * least
}

fn is_tight<N: Number>(values: &[N], errors: &[f64], tight: f64) -> bool {
    values.iter().zip(errors).all(|(value, error)| value.is_zero() || *error <= tight * 0.5 * value.to_f64())
}

/// The best values of the rounded rows, exactly. Each entry of a row is off by a few roundings, and so a value by as many for
/// each block, above and below (see `chain`), for whichever policy, and so for the best one.
fn in_rationals<N: Number>(
    quotient: &Quotient<N>,
    policy: &[u32],
    direction: Direction,
    work: &mut Work,
) -> Option<Enclosed<N>> {
    let exact = |numbers: &[N]| {
        numbers.iter().map(|number| BigRational::from_float(number.to_f64())).collect::<Option<Vec<_>>>()
    };
    let rows = &quotient.rows;
    let rational = Quotient {
        first: quotient.first.clone(),
        rows: Rows {
            first: rows.first.clone(),
            columns: rows.columns.clone(),
            probabilities: exact(&rows.probabilities)?,
            constants: exact(&rows.constants)?,
            leaving: exact(&rows.leaving)?,
        },
        choices: quotient.choices.clone(),
        widest: quotient.widest,
    };
    let found = iterate(&rational, policy.to_vec(), direction, work)?;
    let relative = (count(quotient.blocks()) + 4.0) * 2.0 * (count(quotient.widest) + 8.0) * f64::EPSILON;
    let values: Vec<N> = found.values.iter().map(N::from_rational).collect();
    let errors = values.iter().map(|value| value.to_f64() * relative).collect();
    Some(Enclosed { policy: found.policy, values, errors })
}
