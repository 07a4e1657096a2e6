//! Random numbers of the kinds that challenge arithmetic, and random choices.

use fastrand::Rng;
use num_bigint::BigInt;

use super::model::{Number, Relation, decimal, power_of_ten, whole};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// 0 to 9.
    Small,
    /// 1 to 5.
    Positive,
    /// At most two digits after the point.
    Short,
    /// -5 to 5.
    Signed,
    /// 16 digits after the point, below 1, like the output of a sensor.
    Sensor,
    /// 16 significant digits, with the point at any position.
    Digits,
    /// Integers divided by 1, 2, 4, 8 or 16: exact doubles.
    Binary,
    /// Digit times 10^-12 or 10^18.
    Wide,
    /// At most 1 away from 2^31, 2^46, 2^53, 2^62, 2^63 or 2^64.
    Powers,
    /// 10^30 to 10^30 + 2.
    Huge,
    Zero,
}

pub fn palette(rng: &mut Rng) -> Vec<Style> {
    use Style::{Binary, Digits, Huge, Positive, Powers, Sensor, Short, Signed, Small, Wide, Zero};
    let kind: &[Style] = match rng.u32(0..20) {
        0..=3 => &[Positive, Small],
        4 | 5 => &[Positive, Short],
        6 => &[Small, Signed],
        7 | 8 => &[Sensor],
        9 | 10 => &[Sensor, Positive],
        11 => &[Sensor, Digits],
        12 => &[Digits],
        13 => &[Binary, Positive, Signed],
        14 => &[Wide],
        15 => &[Wide, Positive, Zero],
        16 => &[Powers],
        17 => &[Powers, Positive],
        18 => &[Huge, Positive],
        _ => &[Sensor, Positive, Signed, Short, Zero, Powers],
    };
    kind.to_vec()
}

pub fn number(rng: &mut Rng, styles: &[Style]) -> Number {
    match styles[rng.usize(0..styles.len())] {
        Style::Small => whole(rng.i64(0..10)),
        Style::Positive => whole(rng.i64(1..6)),
        Style::Short => {
            let denominator = if rng.bool() { 10 } else { 100 };
            whole(rng.i64(1..500)) / whole(denominator)
        }
        Style::Signed => whole(rng.i64(-5..6)),
        Style::Sensor => {
            let lower_limit = if rng.bool() { 9_000_000_000_000_000 } else { 1 };
            decimal(&format!("0.{:016}", rng.i64(lower_limit..10_000_000_000_000_000)))
        }
        Style::Digits => {
            let digits = whole(rng.i64(1_000_000_000_000_000..10_000_000_000_000_000));
            digits / Number::from_integer(power_of_ten(rng.usize(0..19)))
        }
        Style::Binary => whole(rng.i64(1..40)) / whole(1 << rng.u32(0..5)),
        Style::Wide => {
            let factor = whole(rng.i64(1..10));
            let (small, large) = (decimal("0.000000000001"), decimal("1000000000000000000"));
            factor * if rng.bool() { small } else { large }
        }
        Style::Powers => {
            let exponent = [31_u32, 46, 53, 62, 63, 64][rng.usize(0..6)];
            Number::from_integer(BigInt::from(2).pow(exponent)) + whole(rng.i64(-1..2))
        }
        Style::Huge => Number::from_integer(power_of_ten(30)) + whole(rng.i64(0..3)),
        Style::Zero => whole(0),
    }
}

pub fn once_in(rng: &mut Rng, times: u32) -> bool {
    rng.u32(0..times) == 0
}

pub fn one_of<T: Clone>(rng: &mut Rng, choices: &[T]) -> T {
    choices[rng.usize(0..choices.len())].clone()
}

pub fn relation(rng: &mut Rng) -> Relation {
    if once_in(rng, 8) { Relation::Equal } else { one_of(rng, &Relation::ALL) }
}

/// Returns a number that is equal to `value`, or differs from it by at most 1 or its 10^-16th part.
pub fn near(rng: &mut Rng, value: &Number) -> Number {
    let step = match rng.u32(0..8) {
        0..=3 => return value.clone(),
        4 => decimal("0.0000000000000001"),
        5 => Number::new(BigInt::from(1), power_of_ten(32)),
        6 => value * decimal("0.0000000000000001"),
        _ => whole(1),
    };
    if rng.bool() { value + step } else { value - step }
}
