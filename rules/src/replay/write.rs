//! Exports the derivation of all facts of an engine, with supports before the facts that they support.

use rustc_hash::FxHashMap;

use crate::derivation::{Derivation, DerivationStep, Reason};
use crate::engine::Engine;
use crate::fact::Fact;

impl Engine {
    /// Returns one derivation of all facts that hold, as input of [`crate::replay`]. The derivation has a
    /// step for each fact, after the steps of the supports of the fact. Absent facts and the matches of
    /// aggregates are omitted, because the checker computes them.
    pub fn everything(&self) -> Derivation {
        let mut positions: FxHashMap<Fact, usize> = FxHashMap::default();
        let mut steps = Vec::new();
        // If a rule compares two names in its text (`sameAs(a, b)`), the equality is not among its supports,
        // which are relation atoms only. So all equalities come first.
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

/// Appends the steps of a derivation to `steps`, supports first. Facts that already have a step are skipped.
fn append(derivation: &Derivation, positions: &mut FxHashMap<Fact, usize>, steps: &mut Vec<DerivationStep>) {
    let mut stack = vec![(0, 0)];
    while let Some((position, visited_count)) = stack.pop() {
        let step = &derivation.steps[position];
        if positions.contains_key(&step.fact) {
            continue;
        }
        if let Some(support) = supports(&step.reason).get(visited_count) {
            stack.extend([(position, visited_count + 1), (*support, 0)]);
            continue;
        }
        let place = |support: &usize| positions.get(&derivation.steps[*support].fact).copied();
        let places = |supports: &[usize]| supports.iter().filter_map(place).collect();
        let reason = match &step.reason {
            Reason::Asserted => Reason::Asserted,
            Reason::Equality { supports } => Reason::Equality { supports: places(supports) },
            // Absent facts and aggregate matches follow from the complete set of facts.
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
