//! Symmetry reduction: one state represents all states that differ only in interchangeable objects.
//!
//! Orbit search \[1\]: every plan from a state has an image, of the same cost, from the image of
//! the state under an exchange of objects that changes neither operators nor goal. A state is made
//! canonical by exchanges of neighbouring objects as long as they lower it in the lexicographic
//! order. Symmetric states usually get the same canonical state; completeness is not needed for
//! soundness.
//!
//! \[1\] C. Domshlak, M. Katz, A. Shleyfman: Enhanced symmetry breaking in cost-optimal planning as forward
//! search, ICAPS 2012.

use task::context::Context;
use task::limits::Interrupted;
use task::number::Int;
use task::task::object_symmetry::symmetry_generators;

/// Moves the value of one variable to another one.
struct Move {
    target: usize,
    source: usize,
    /// Value of the target, by value of the source.
    values: Vec<u32>,
}

/// The symmetries of a task: exchanges of interchangeable objects.
pub struct Orbits {
    /// Moves of each exchange, ascending by target.
    exchanges: Vec<Vec<Move>>,
}

impl Orbits {
    /// Returns `None` if no objects are interchangeable.
    pub(crate) fn new(context: Context<'_, Int>) -> Result<Option<Self>, Interrupted> {
        let mut exchanges = Vec::new();
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
            moves.sort_by_key(|step| step.target);
            exchanges.push(moves);
        }
        exchanges.retain(|moves: &Vec<Move>| !moves.is_empty());
        Ok((!exchanges.is_empty()).then_some(Self { exchanges }))
    }

    /// Replaces values by a canonical representative: applies exchanges as long as they make the
    /// values lexicographically smaller.
    pub(crate) fn canonicalize(&self, values: &mut [u32], image: &mut Vec<u32>) {
        let mut changed = true;
        while std::mem::take(&mut changed) {
            for moves in &self.exchanges {
                image.clear();
                image.extend(moves.iter().map(|step| step.values[values[step.source] as usize]));
                let now = moves.iter().map(|step| &values[step.target]);
                if image.iter().lt(now) {
                    for (step, value) in moves.iter().zip(&*image) {
                        values[step.target] = *value;
                    }
                    changed = true;
                }
            }
        }
    }
}
