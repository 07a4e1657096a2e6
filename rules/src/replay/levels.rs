//! Whether rules are stratified: whether relations have levels such that a rule concludes nothing below what it uses, and
//! only above what it negates or aggregates over. Levels are raised until nothing changes, or until there are more
//! levels than relations.

use rustc_hash::FxHashMap;

use crate::replay::fault::Fault;
use crate::rule::{Atom, Program, Rule};
use crate::symbol::Symbol;

type Relation = (Symbol, usize);

/// What a rule concludes, and what it uses: each with 1 where the conclusion has to be above it.
struct Uses {
    heads: Vec<Relation>,
    body: Vec<(Relation, usize)>,
}

pub(super) fn check(program: &Program, same: Symbol, different: Symbol) -> Result<(), Fault> {
    let all: Vec<Uses> =
        program.rules.iter().map(|rule| uses(rule, program.equality, same, different)).collect();
    let mut levels: FxHashMap<Relation, usize> = FxHashMap::default();
    for relation in all.iter().flat_map(|uses| uses.heads.iter().chain(uses.body.iter().map(|(own, _)| own)))
    {
        levels.insert(*relation, 0);
    }
    let most = levels.len();
    loop {
        let mut changed = false;
        for (uses, rule) in all.iter().zip(&program.rules) {
            let least = uses.body.iter().map(|(own, above)| levels[own] + above).max().unwrap_or(0);
            if least > most {
                return Err(Fault::Unstratified(rule.identity.clone()));
            }
            for head in &uses.heads {
                if levels[head] < least {
                    levels.insert(*head, least);
                    changed = true;
                }
            }
        }
        // What holds of one name holds of the others, so that every relation depends on equality.
        let floor = levels.get(&(same, 2)).copied().filter(|_| program.equality).unwrap_or(0);
        for level in levels.values_mut().filter(|level| **level < floor) {
            *level = floor;
            changed = true;
        }
        if !changed {
            return Ok(());
        }
    }
}

fn uses(rule: &Rule, equality: bool, same: Symbol, different: Symbol) -> Uses {
    let relation = |atom: &Atom| match atom {
        Atom::Relation { predicate, arguments } | Atom::Not { predicate, arguments } => {
            Some((*predicate, arguments.len()))
        }
        Atom::Same(..) => Some((same, 2)),
        Atom::Different(..) => Some((different, 2)),
        Atom::BuiltIn { .. } | Atom::Aggregate { .. } => None,
    };
    let mut body = Vec::new();
    for atom in &rule.body {
        match atom {
            Atom::Relation { .. } => body.extend(relation(atom).map(|own| (own, 0))),
            Atom::Not { .. } => body.extend(relation(atom).map(|own| (own, 1))),
            Atom::Aggregate { body: inner, .. } => {
                body.extend(inner.iter().filter_map(relation).map(|own| (own, 1)));
            }
            Atom::Same(..) if equality => body.push(((same, 2), 0)),
            // Under equality, what differs are literals only, which are never made one.
            Atom::Same(..) | Atom::Different(..) | Atom::BuiltIn { .. } => {}
        }
    }
    Uses { heads: rule.head.iter().filter_map(relation).collect(), body }
}
