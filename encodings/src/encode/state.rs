//! Clauses for state variables: their domains at every step, and the frame axioms.
//!
//! `v=d@t` means that variable v has the value d in the state before step t, and `o@t` that operator o is
//! executed at step t.
//!
//! - domain: `⋁_d v=d@t` over the values d of each variable v, and at most one of these values;
//! - frame (explanatory, after Haas \[1\]): `v=d@t+1 → v=d@t ∨ ⋁ {o@t : o sets v to d}` for variables that are
//!   not derived. With the domain constraints before and after the step, this also preserves unchanged values.
//!
//! \[1\] A. Haas: The case for domain-specific frame axioms, The Frame Problem in AI, 1987.

use task::number::dense;
use task::task::{Fact, VariableId};

use crate::encode::builder::Builder;
use crate::encode::conditional::FiredEffects;
use crate::encode::formula::{Family, Formula};
use crate::sat::Lit;

pub(super) fn domain(builder: &mut Builder<'_>, step: usize) {
    for variable in 0..builder.task.variables.len() {
        let falsum = !Formula::truth();
        let literals: Vec<_> =
            builder.variables.values[step][variable].iter().copied().filter(|l| *l != falsum).collect();
        if literals.len() > 1 {
            builder.formula.add(Family::Domain, literals.iter().copied());
            builder.formula.at_most_one(Family::Domain, &literals);
        }
    }
}

#[expect(
    clippy::arithmetic_side_effects,
    reason = "steps are fewer than the horizon, whose formula is in memory"
)]
pub(super) fn frame(builder: &mut Builder<'_>, step: usize, fires: &FiredEffects) {
    let mut producers: Vec<Vec<Vec<Lit>>> =
        builder.task.variables.iter().map(|variable| vec![Vec::new(); variable.values.len()]).collect();
    for (id, literal) in &builder.variables.operators[step] {
        for effect in &builder.task.operators[id.index()].effects {
            producers[effect.variable.index()][effect.value as usize].push(*literal);
        }
    }
    for fired in fires.iter() {
        for effect in fired.effects {
            producers[effect.variable.index()][effect.value as usize].push(fired.literal);
        }
    }
    for (variable, producers) in producers.iter().enumerate().take(builder.task.basic) {
        for (value, producers) in producers.iter().enumerate() {
            let fact = Fact { variable: VariableId::of(variable), value: dense(value) };
            let (before, after) =
                (builder.variables.fact(fact, step), builder.variables.fact(fact, step + 1));
            if after != !Formula::truth() {
                let clause = [!after, before].into_iter().chain(producers.iter().copied());
                builder.formula.add(Family::Frame, clause);
            }
        }
    }
}
