//! Symmetry reduction: a canonical state represents states that differ only by exchanges of interchangeable
//! objects.
//!
//! Orbit search \[1\]: if an exchange of objects maps the operators and the goal to themselves, every plan
//! from a state is mapped to a plan of equal cost from the image of the state. A state is made canonical by
//! applying exchanges of neighbouring objects as long as the state becomes lexicographically smaller.
//! Symmetric states usually get equal canonical states; soundness does not depend on this.
//!
//! \[1\] C. Domshlak, M. Katz, A. Shleyfman: Enhanced symmetry breaking in cost-optimal planning as forward
//! search, ICAPS 2012.

use task::context::Context;
use task::limits::Interrupted;
use task::number::Int;
use task::task::object_symmetry::symmetry_generators;

/// Part of an exchange: variable `target` of the image is computed from variable `source`.
struct Move {
    target: usize,
    source: usize,
    /// Value of the target variable for each value of the source variable.
    values: Vec<u32>,
}

/// Symmetries of a task, as a list of exchanges. Each one exchanges two interchangeable objects.
pub struct Orbits {
    exchanges: Vec<Vec<Move>>,
}

impl Orbits {
    /// Finds interchangeable objects. Returns `None` if none are found; the number of comparisons is
    /// limited.
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
            // `canonicalize` compares images lexicographically by target variable.
            moves.sort_by_key(|step| step.target);
            exchanges.push(moves);
        }
        exchanges.retain(|moves: &Vec<Move>| !moves.is_empty());
        Ok((!exchanges.is_empty()).then_some(Self { exchanges }))
    }

    /// Applies exchanges as long as the values become lexicographically smaller. `image` is a
    /// scratch buffer.
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
