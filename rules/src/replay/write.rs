//! Everything that an engine holds, with why, in an order in which supports come first.

use rustc_hash::FxHashMap;

use crate::derivation::{Derivation, DerivationStep, Reason};
use crate::engine::Engine;
use crate::fact::Fact;

impl Engine {
    /// Derives every fact that holds: a step for each, after what it rests on, as [`crate::replay`] takes it.
    pub fn everything(&self) -> Derivation {
        let mut positions: FxHashMap<Fact, usize> = FxHashMap::default();
        let mut steps = Vec::new();
        // A rule that asks whether two of its own names are one has no support that says so.
        let pairs = self.equality.as_ref().map_or_else(Vec::new, |equality| equality.pairs_in_order());
        for fact in pairs.into_iter().chain(self.facts()) {
            if !positions.contains_key(&fact)
                && let Some(derivation) = self.why(&fact)
            {
                append(&derivation, &mut positions, &mut steps);
            }
        }
        Derivation { steps }
    }
}

/// The positions of what a step rests on.
fn supports(reason: &Reason) -> Vec<usize> {
    match reason {
        Reason::Asserted => Vec::new(),
        Reason::Equality { supports } => supports.clone(),
        Reason::Rule { supports, aggregates, .. } => {
            let matched = aggregates.iter().flat_map(|aggregate| aggregate.matches.iter().flatten());
            supports.iter().chain(matched).copied().collect()
        }
    }
}

/// Appends the steps of a derivation that are not there yet, supports first.
fn append(derivation: &Derivation, positions: &mut FxHashMap<Fact, usize>, steps: &mut Vec<DerivationStep>) {
    let mut stack = vec![(0, 0)];
    while let Some((at, done)) = stack.pop() {
        let step = &derivation.steps[at];
        if positions.contains_key(&step.fact) {
            continue;
        }
        if let Some(support) = supports(&step.reason).get(done) {
            stack.extend([(at, done + 1), (*support, 0)]);
            continue;
        }
        let place = |support: &usize| positions.get(&derivation.steps[*support].fact).copied();
        let places = |supports: &[usize]| supports.iter().filter_map(place).collect();
        let reason = match &step.reason {
            Reason::Asserted => Reason::Asserted,
            Reason::Equality { supports } => Reason::Equality { supports: places(supports) },
            // What is absent and what aggregates ran over follows from the whole.
            Reason::Rule { identity, bindings, supports, .. } => Reason::Rule {
                identity: identity.clone(),
                bindings: bindings.clone(),
                supports: places(supports),
                absent: Vec::new(),
                aggregates: Vec::new(),
            },
        };
        positions.insert(step.fact.clone(), steps.len());
        steps.push(DerivationStep { fact: step.fact.clone(), reason });
    }
}
