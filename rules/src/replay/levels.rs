//! Stratification check: relations have levels. The heads of a rule are not below its positive atoms, and are
//! above its negated and aggregated atoms. Levels are raised to a fixpoint. If a level exceeds the number of
//! relations, the rules are not stratified.

use rustc_hash::FxHashMap;

use crate::replay::fault::Fault;
use crate::rule::{Atom, Program, Rule};
use crate::symbol::Symbol;

type Relation = (Symbol, usize);

/// Head relations and body relations of a rule. The number of a body relation is the minimum difference between
/// the level of the heads and the level of the relation: 1 if the atom is negated or aggregated, otherwise 0.
struct Uses {
    heads: Vec<Relation>,
    body: Vec<(Relation, usize)>,
}

pub(super) fn check(program: &Program, same_as: Symbol, different: Symbol) -> Result<(), Fault> {
    let rule_uses: Vec<Uses> =
        program.rules.iter().map(|rule| uses(rule, program.equality, same_as, different)).collect();
    let mut levels: FxHashMap<Relation, usize> = FxHashMap::default();
    for relation in rule_uses
        .iter()
        .flat_map(|uses| uses.heads.iter().chain(uses.body.iter().map(|(relation, _)| relation)))
    {
        levels.insert(*relation, 0);
    }
    let max_level = levels.len();
    loop {
        let mut changed = false;
        for (uses, rule) in rule_uses.iter().zip(&program.rules) {
            let required =
                uses.body.iter().map(|(relation, above)| levels[relation] + above).max().unwrap_or(0);
            if required > max_level {
                return Err(Fault::Unstratified(rule.identity.clone()));
            }
            for head in &uses.heads {
                if levels[head] < required {
                    levels.insert(*head, required);
                    changed = true;
                }
            }
        }
        // A fact about one name holds about all equal names, so every relation depends on equality.
        let floor = levels.get(&(same_as, 2)).copied().filter(|_| program.equality).unwrap_or(0);
        for level in levels.values_mut().filter(|level| **level < floor) {
            *level = floor;
            changed = true;
        }
        if !changed {
            return Ok(());
        }
    }
}

fn uses(rule: &Rule, equality: bool, same_as: Symbol, different: Symbol) -> Uses {
    let relation = |atom: &Atom| match atom {
        Atom::Relation { predicate, arguments } | Atom::Not { predicate, arguments } => {
            Some((*predicate, arguments.len()))
        }
        Atom::Same(..) => Some((same_as, 2)),
        Atom::Different(..) => Some((different, 2)),
        _ => None,
    };
    let mut body = Vec::new();
    for atom in &rule.body {
        match atom {
            Atom::Relation { .. } => body.extend(relation(atom).map(|used| (used, 0))),
            Atom::Not { .. } => body.extend(relation(atom).map(|used| (used, 1))),
            Atom::NotSame(..) if equality => body.push(((same_as, 2), 1)),
            Atom::Aggregate { body: inner, .. } => {
                body.extend(inner.iter().filter_map(relation).map(|used| (used, 1)));
                let is_inequality = |atom: &Atom| matches!(atom, Atom::NotSame(..));
                body.extend((equality && inner.iter().any(is_inequality)).then_some(((same_as, 2), 1)));
            }
            Atom::Same(..) if equality => body.push(((same_as, 2), 0)),
            // These atoms depend on no relation. Under equality, `differentFrom` is decided only if one term is a
            // literal, which never equals anything else.
            _ => {}
        }
    }
    Uses { heads: rule.head.iter().filter_map(relation).collect(), body }
}
