//! Converts conditions and axioms over atoms to conditions and axioms over finite-domain variables.

use rustc_hash::FxHashMap;

use crate::error::Error;
use crate::ground::finalize::numbers::Numbers;
use crate::ground::finalize::variables::Atoms;
use crate::ground::vocabulary::atom::AtomId;
use crate::ground::vocabulary::axiom::{GroundAxiom, components};
use crate::ground::vocabulary::condition::GroundCondition;
use crate::lifted::Rational;
use crate::limits::Limits;
use crate::number::checked_lcm;
use crate::task::number::TaskNumber;
use crate::task::{Axiom, Condition, Fact, Layer};

#[expect(clippy::arithmetic_side_effects, reason = "above the least number of its type")]
pub(super) fn condition<N: TaskNumber>(
    ground: &GroundCondition,
    atoms: &Atoms,
    numbers: &mut Numbers<N>,
) -> Result<Condition<N>, Error> {
    let mut condition = Condition::default();
    for literal in &ground.literals {
        let literal = atoms.literal(*literal);
        let no_value = atoms.none[literal.fact.variable.index()];
        if literal.positive {
            condition.facts.push(literal.fact);
        } else if no_value == 1 {
            // If a variable has only one other value, a negative literal is a fact instead of a clause.
            condition.facts.push(Fact { variable: literal.fact.variable, value: no_value });
        } else {
            condition.clauses.push(vec![literal]);
        }
    }
    for clause in &ground.clauses {
        condition.clauses.push(clause.iter().map(|literal| atoms.literal(*literal)).collect());
    }
    for (linear, strict) in &ground.comparisons {
        if !N::SCALED {
            let list = if *strict { &mut condition.above } else { &mut condition.comparisons };
            list.push(numbers.linear(linear)?);
            continue;
        }
        let mut linear = numbers.stored(linear, 1).into_owned();
        // A comparison with 0 may be multiplied by a positive factor, which removes fractional coefficients.
        let mut denominators = linear.coefficients.iter().map(|(_, factor)| factor.denominator());
        let common = denominators.try_fold(1, |common, next| checked_lcm(common, next?));
        let common = common.ok_or_else(|| Error::overflow("a factor of a numeric fluent"))?;
        linear.scale(&Rational::from_integer(common));
        let mut integers = numbers.linear(&linear)?;
        // For integers, x > 0 is equivalent to x - 1 ≥ 0.
        if *strict {
            integers.quantity.constant = integers.quantity.constant + -N::one();
        }
        condition.comparisons.push(integers);
    }
    condition.facts.sort_unstable();
    condition.facts.dedup();
    Ok(condition)
}

/// Returns `true` if the condition requires two different values of a variable. Its facts must be sorted and
/// distinct.
pub(super) fn contradictory<N>(condition: &Condition<N>) -> bool {
    condition.facts.windows(2).any(|pair| pair[0].variable == pair[1].variable)
}

/// Sorts the rules of derived variables into layers. Layers on which a layer depends come first. Rules of
/// atoms that nothing reads are dropped.
pub(super) fn axioms<N: TaskNumber>(
    axioms: &[GroundAxiom],
    atoms: &Atoms,
    numbers: &mut Numbers<N>,
    limits: &Limits,
) -> Result<Vec<Layer<N>>, Error> {
    let mut positions: FxHashMap<AtomId, Vec<usize>> = FxHashMap::default();
    for (position, axiom) in axioms.iter().enumerate() {
        positions.entry(axiom.head).or_default().push(position);
    }
    let mut layers = Vec::new();
    for component in limits.watch(components(axioms)) {
        let component = component?;
        let mut layer = Layer { rules: Vec::new(), recursive: component.len() > 1 };
        let mut rules: Vec<usize> =
            component.iter().flat_map(|head| positions[head].iter().copied()).collect();
        rules.sort_unstable();
        for axiom in rules.into_iter().map(|position| &axioms[position]) {
            let Some(head) = atoms.fact(axiom.head) else { continue };
            layer.recursive |= axiom.body.atoms().any(|atom| atom == axiom.head);
            layer.rules.push(Axiom { head, body: condition(&axiom.body, atoms, numbers)? });
        }
        if !layer.rules.is_empty() {
            layers.push(layer);
        }
    }
    Ok(layers)
}
