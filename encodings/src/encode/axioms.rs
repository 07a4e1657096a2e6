//! Clauses for derived variables: the least fixpoint of their rules, by completion and level constraints.
//!
//! - body: `b@t ↔ ⋀ l@t` for the body b of each rule, with the literals l, in the state before step t;
//! - completion: `h@t ↔ ⋁ b@t` over the bodies b of the rules with head h \[1\];
//! - levels: variables that depend on each other are derived in rounds. A true `h@t` needs a supporting rule, whose
//!   body variables from the same layer are derived in earlier rounds. With a variable `s@t` for each rule that may
//!   support h (`b@t` itself if the body has no such variables): `h@t → ⋁ s@t`, `s@t → b@t`, and
//!   `s@t ∧ r(h) ≤ k → r(a) ≤ k−1` for each such body variable a and each number k. Here r is the round in which a
//!   variable is derived, in order encoding \[2\].
//!
//! \[1\] K. Clark: Negation as failure, Logic and Data Bases, 1978.
//! \[2\] T. Janhunen: Representing normal programs with clauses, ECAI 2004.

use std::collections::BTreeMap;

use rustc_hash::FxHashSet;
use task::number::dense;
use task::task::{Layer, VariableId};

use crate::encode::arithmetic::Bits;
use crate::encode::builder::Builder;
use crate::encode::formula::{Family, Formula, VariableMeaning};
use crate::encode::numeric::is_at_least_zero;
use crate::sat::Lit;

/// Upper limit on the number of level constraints of one layer, in all steps. Their number per step is quadratic in
/// the number of variables of the layer, and cubic for the transitive closure of a relation.
const MAX_LEVEL_CLAUSES: usize = 30_000_000;

/// Adds the clauses for derived variables before a step. `numbers` has the bits of the numeric variables
/// before the step. Returns `None` if numbers can exceed the available bits, if there are too many clauses, or if a
/// limit is reached.
pub(super) fn axioms(builder: &mut Builder<'_>, step: usize, numbers: &[Bits]) -> Option<()> {
    let task = builder.task;
    for (layer, index) in task.axioms.iter().zip(0..) {
        let mut bodies: BTreeMap<VariableId, Vec<(Lit, Vec<VariableId>)>> = BTreeMap::new();
        let heads: FxHashSet<VariableId> = layer.rules.iter().map(|rule| rule.head.variable).collect();
        for (rule, position) in layer.rules.iter().zip(0..) {
            let mut premises: Vec<_> =
                rule.body.facts.iter().map(|fact| builder.variables.fact(*fact, step)).collect();
            for clause in &rule.body.clauses {
                premises.extend(clause.iter().map(|literal| builder.variables.literal(*literal, step)));
            }
            for comparison in &rule.body.comparisons {
                premises.push(is_at_least_zero(&mut builder.formula, comparison, numbers, Family::Axiom)?);
            }
            let meaning = VariableMeaning::Body { layer: index, rule: position, step: dense(step) };
            let body = builder.formula.equivalent(meaning, &premises, Family::Axiom);
            let recursive_variables =
                rule.body.facts.iter().filter(|fact| fact.value == 0).map(|fact| fact.variable);
            let recursive_variables =
                recursive_variables.filter(|variable| heads.contains(variable)).collect();
            bodies.entry(rule.head.variable).or_default().push((body, recursive_variables));
        }
        for (variable, bodies) in &bodies {
            let head = builder.variables.values[step][variable.index()][0];
            for (body, _) in bodies {
                builder.formula.add(Family::Axiom, [!*body, head]);
            }
            builder.formula.add(Family::Axiom, bodies.iter().map(|(body, _)| *body).chain([!head]));
        }
        if layer.recursive {
            levels(builder, step, layer, &bodies)?;
        }
    }
    Some(())
}

/// Adds level constraints for a recursive layer, so that variables that support only each other are false. Returns
/// `None` if there are too many clauses, or if a limit is reached.
#[expect(clippy::arithmetic_side_effects, reason = "rounds count from 1, and rules are held in memory")]
fn levels(
    builder: &mut Builder<'_>,
    step: usize,
    layer: &Layer,
    bodies: &BTreeMap<VariableId, Vec<(Lit, Vec<VariableId>)>>,
) -> Option<()> {
    let orders = bodies.len() + bodies.values().flatten().map(|(_, below)| below.len()).sum::<usize>();
    let clauses = orders.saturating_mul(bodies.len());
    if clauses.saturating_mul(builder.variables.horizon() + 1) > MAX_LEVEL_CLAUSES {
        return None;
    }
    let rounds = dense(bodies.len());
    // `later[v][k]` is true if variable v is derived in round k + 2 or later. Every true variable
    // is derived in at most `rounds` rounds.
    let mut later: BTreeMap<VariableId, Vec<Lit>> = BTreeMap::new();
    for variable in bodies.keys() {
        let literals: Vec<_> = (1..rounds)
            .map(|rounds| {
                builder.formula.fresh(VariableMeaning::Later {
                    variable: variable.0,
                    rounds,
                    step: dense(step),
                })
            })
            .collect();
        for pair in literals.windows(2) {
            builder.formula.add(Family::Axiom, [!pair[1], pair[0]]);
        }
        later.insert(*variable, literals);
        builder.check().ok()?;
    }
    debug_assert!(layer.recursive);
    for (variable, bodies) in bodies {
        let head = builder.variables.values[step][variable.index()][0];
        let mut supports = vec![!head];
        for (body, recursive_variables) in bodies {
            if recursive_variables.is_empty() {
                supports.push(*body);
                continue;
            }
            let support = builder.formula.fresh(VariableMeaning::Ladder);
            builder.formula.add(Family::Axiom, [!support, *body]);
            for below in recursive_variables {
                // In the first round no variable of the layer has been derived before, so the rule supports nothing.
                let first = later[variable].first().copied().unwrap_or(!Formula::truth());
                builder.formula.add(Family::Axiom, [!support, first]);
                for k in 1..=later[variable].len() {
                    let above = later[variable].get(k).copied().unwrap_or(!Formula::truth());
                    builder.formula.add(Family::Axiom, [!support, above, !later[below][k - 1]]);
                }
            }
            supports.push(support);
        }
        builder.formula.add(Family::Axiom, supports);
        builder.check().ok()?;
    }
    Some(())
}
