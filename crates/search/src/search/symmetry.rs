//! Symmetry reduction: one state represents all states that differ only in interchangeable objects.
//!
//! Orbit search \[1\]: whatever can be done from a state can be done, at the same cost, from its image under an
//! exchange of objects that changes neither operators nor goal. A state is made canonical by exchanges of
//! neighbouring objects as long as they lower it in the lexicographic order. Symmetric states usually get the
//! same canonical state; completeness is not needed for soundness.
//!
//! \[1\] C. Domshlak, M. Katz, A. Shleyfman: Enhanced symmetry breaking in cost-optimal planning as forward
//! search, ICAPS 2012.

use task::context::Context;
use task::limits::Interrupted;
use task::number::Int;
use task::task::object_symmetry::symmetry_generators;

/// A variable takes the place of another one.
struct Move {
    target: usize,
    source: usize,
    /// By value of the source.
    values: Vec<u32>,
}

/// The exchanges of interchangeable objects.
pub struct Orbits {
    /// For each exchange what it moves, ascending by target.
    exchanges: Vec<Vec<Move>>,
}

impl Orbits {
    /// None if no objects are interchangeable.
    pub(crate) fn new(context: Context<'_, Int>) -> Result<Option<Self>, Interrupted> {
        let mut all = Vec::new();
        for exchange in symmetry_generators(context, false)? {
            let mut moves = Vec::new();
            for (source, facts) in exchange.facts.iter().enumerate() {
                let is_moved = |(value, fact): (u32, &task::task::Fact)| {
                    fact.variable.index() != source || fact.value != value
                };
                let Some(first) = facts.first().filter(|_| (0..).zip(facts).any(is_moved)) else { continue };
                let values = facts.iter().map(|fact| fact.value).collect();
                moves.push(Move { target: first.variable.index(), source, values });
            }
            moves.sort_by_key(|own| own.target);
            all.push(moves);
        }
        all.retain(|moves: &Vec<Move>| !moves.is_empty());
        Ok((!all.is_empty()).then_some(Self { exchanges: all }))
    }

    /// Exchanges objects as long as that brings the values of a state forward in their order.
    pub(crate) fn canonicalize(&self, values: &mut [u32], image: &mut Vec<u32>) {
        let mut changed = true;
        while std::mem::take(&mut changed) {
            for moves in &self.exchanges {
                image.clear();
                image.extend(moves.iter().map(|own| own.values[values[own.source] as usize]));
                let now = moves.iter().map(|own| &values[own.target]);
                if image.iter().lt(now) {
                    for (own, value) in moves.iter().zip(&*image) {
                        values[own.target] = *value;
                    }
                    changed = true;
                }
            }
        }
    }
}
