//! Two's complement arithmetic in clauses. Bits are ordered from the lowest to the highest.

use crate::clausal::formula::Formula;
use crate::clausal::literal::Literal;
use crate::integer::Integer;

/// The bits of a number, from the lowest to the highest; the last bit is the sign.
pub(super) type Bits = Vec<Literal>;

pub(super) fn sign(number: &Bits) -> Literal {
    *number.last().expect("invariant: a number has a sign")
}

pub(super) fn width(least: &Integer, most: &Integer) -> usize {
    least.width().max(most.width())
}

impl Formula {
    pub(super) fn bits(&mut self, width: usize, name: &str) -> Bits {
        (0..width).map(|position| self.variable(|| format!("bit {position} of {name}"))).collect()
    }

    pub(super) fn constant(&self, number: &Integer, width: usize) -> Bits {
        (0..width).map(|position| if number.bit(position) { self.truth() } else { -self.truth() }).collect()
    }

    /// Encodes the sum of two numbers of equal width by a ripple-carry adder, and returns its bits.
    /// A sum that overflows wraps around.
    #[expect(clippy::arithmetic_side_effects, reason = "positions in a number whose bits are held in memory")]
    pub(super) fn add(&mut self, left: &Bits, right: &Bits, name: &str) -> Bits {
        let sum = self.bits(left.len(), name);
        let mut carry = -self.truth();
        for position in 0..left.len() {
            let (a, b, c, s) = (left[position], right[position], carry, sum[position]);
            for signs in 0..8 {
                let sign =
                    |literal: Literal, place: u32| if signs >> place & 1 == 1 { literal } else { -literal };
                let (a, b, c) = (sign(a, 0), sign(b, 1), sign(c, 2));
                // The literals are all false under exactly one assignment of the three inputs, in which `ones`
                // of them are true. Only then does the clause enforce the sum bit: true if `ones` is odd,
                // otherwise false.
                let ones = 3 - u32::count_ones(signs);
                self.clause(&[a, b, c, if ones % 2 == 1 { s } else { -s }]);
            }
            if position + 1 < left.len() {
                let next = self.variable(|| format!("carry {position} of {name}"));
                for (x, y) in [(a, b), (a, c), (b, c)] {
                    self.clause(&[-x, -y, next]);
                    self.clause(&[x, y, -next]);
                }
                carry = next;
            }
        }
        sum
    }

    #[expect(clippy::arithmetic_side_effects, reason = "positions in a number whose bits are held in memory")]
    pub(super) fn at_least(&mut self, condition: &[Literal], number: &Bits, least: &Integer) {
        let ordered = ordered(number, least);
        for position in 0..ordered.len() {
            if ordered[position].1 {
                let higher =
                    ordered[position + 1..].iter().filter(|(_, bit)| !bit).map(|(literal, _)| *literal);
                let clause: Vec<Literal> = condition.iter().map(|literal| -*literal).chain(higher).collect();
                self.clause(&[&clause[..], &[ordered[position].0]].concat());
            }
        }
    }

    #[expect(clippy::arithmetic_side_effects, reason = "positions in a number whose bits are held in memory")]
    pub(super) fn at_most(&mut self, condition: &[Literal], number: &Bits, most: &Integer) {
        let ordered = ordered(number, most);
        for position in 0..ordered.len() {
            if !ordered[position].1 {
                let higher =
                    ordered[position + 1..].iter().filter(|(_, bit)| *bit).map(|(literal, _)| -*literal);
                let clause: Vec<Literal> = condition.iter().map(|literal| -*literal).chain(higher).collect();
                self.clause(&[&clause[..], &[-ordered[position].0]].concat());
            }
        }
    }
}

/// Pairs the literals of a number with the bits of a constant. Both sign bits are negated, so that
/// the lexicographic order of the bits is the numeric order.
#[expect(clippy::arithmetic_side_effects, reason = "positions in a number whose bits are held in memory")]
fn ordered(number: &Bits, constant: &Integer) -> Vec<(Literal, bool)> {
    let last = number.len() - 1;
    let turned = |(position, literal): (usize, &Literal)| {
        let is_sign = position == last;
        (if is_sign { -*literal } else { *literal }, constant.bit(position) != is_sign)
    };
    number.iter().enumerate().map(turned).collect()
}
