//! The axioms of a domain by stratum, and where new facts can be joined with their conditions.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ast::{Atom, Condition, Derived, Domain, Name, TypedName};
use crate::strata::Strata;

/// The axioms of predicates that may depend on each other.
#[derive(Debug, Default)]
pub(super) struct Stratum<'p> {
    /// The predicates.
    pub(super) own: FxHashSet<&'p Name>,
    pub(super) axioms: Vec<Axiom<'p>>,
    /// By predicate of the stratum: where the axioms mention it.
    pub(super) occurrences: FxHashMap<&'p Name, Vec<Occurrence<'p>>>,
}

/// An axiom.
#[derive(Debug)]
pub(super) struct Axiom<'p> {
    pub(super) derived: &'p Derived,
    /// Those parts of its condition, by address, that mention a predicate of the stratum where new facts cannot be joined.
    pub(super) opaque: FxHashSet<*const Condition>,
}

/// An atom in the condition of an axiom, below conjunctions, disjunctions and existential quantifiers only.
#[derive(Debug)]
pub(super) struct Occurrence<'p> {
    /// The position of the axiom.
    pub(super) axiom: usize,
    pub(super) atom: &'p Atom,
    /// The variables of the quantifiers around the atom, outermost first.
    pub(super) variables: Vec<&'p [TypedName]>,
    /// The conjunctions around the atom, with the position of the conjunct that contains the atom.
    pub(super) conjunctions: Vec<(&'p [Condition], usize)>,
}

/// The strata of a domain, lowest first. Axioms through their own negation have no strata; the checker
/// refuses them, and here they all come into one.
#[expect(clippy::arithmetic_side_effects, reason = "levels are at most the number of predicates")]
pub(super) fn strata(domain: &Domain) -> Vec<Stratum<'_>> {
    let levels = Strata::of(domain).ok();
    let mut strata: Vec<Stratum<'_>> = Vec::new();
    for derived in &domain.derived {
        let name = &derived.head.identifier.name;
        let level = levels.as_ref().and_then(|levels| levels.level(name)).unwrap_or(0);
        if strata.len() <= level {
            strata.resize_with(level + 1, Stratum::default);
        }
        strata[level].own.insert(name);
        strata[level].axioms.push(Axiom { derived, opaque: FxHashSet::default() });
    }
    for stratum in &mut strata {
        let Stratum { own, axioms, occurrences } = stratum;
        for (axiom, Axiom { derived, opaque }) in axioms.iter_mut().enumerate() {
            let derived = *derived;
            let mut walk = Walk {
                axiom,
                derived,
                own: &*own,
                variables: Vec::new(),
                conjunctions: Vec::new(),
                occurrences: &mut *occurrences,
                opaque,
            };
            walk.visit(&derived.condition);
        }
    }
    strata
}

/// All predicates and functions in the conditions of axioms.
pub(super) fn read_by_axioms(domain: &Domain) -> FxHashSet<&Name> {
    let mut names = FxHashSet::default();
    for axiom in &domain.derived {
        names_in(&axiom.condition, &mut |name| {
            names.insert(name);
        });
    }
    names
}

/// A walk through the condition of an axiom.
struct Walk<'w, 'p> {
    axiom: usize,
    derived: &'p Derived,
    own: &'w FxHashSet<&'p Name>,
    variables: Vec<&'p [TypedName]>,
    conjunctions: Vec<(&'p [Condition], usize)>,
    occurrences: &'w mut FxHashMap<&'p Name, Vec<Occurrence<'p>>>,
    opaque: &'w mut FxHashSet<*const Condition>,
}

impl<'p> Walk<'_, 'p> {
    /// Notes the occurrences of predicates of the stratum. Returns `true` if there is one with which new facts cannot be joined.
    fn visit(&mut self, condition: &'p Condition) -> bool {
        let mut is_opaque = false;
        match condition {
            Condition::And(parts) => {
                for (position, part) in parts.iter().enumerate() {
                    self.conjunctions.push((parts, position));
                    is_opaque |= self.visit(part);
                    self.conjunctions.pop();
                }
            }
            Condition::Or(parts) => parts.iter().for_each(|part| is_opaque |= self.visit(part)),
            Condition::Exists(variables, body) if !self.hides(variables) => {
                self.variables.push(variables);
                is_opaque = self.visit(body);
                self.variables.pop();
            }
            Condition::Atom(atom) if self.own.contains(&atom.predicate.name) => {
                let occurrence = Occurrence {
                    axiom: self.axiom,
                    atom,
                    variables: self.variables.clone(),
                    conjunctions: self.conjunctions.clone(),
                };
                self.occurrences.entry(&atom.predicate.name).or_default().push(occurrence);
            }
            other => names_in(other, &mut |name| is_opaque |= self.own.contains(name)),
        }
        if is_opaque {
            self.opaque.insert(std::ptr::from_ref(condition));
        }
        is_opaque
    }

    /// Returns `true` if one of some variables has the name of a variable around them.
    fn hides(&self, variables: &[TypedName]) -> bool {
        let around = self.variables.iter().copied().chain([&self.derived.head.parameters[..]]).flatten();
        let around: FxHashSet<&Name> = around.map(|entry| &entry.identifier.name).collect();
        variables.iter().any(|entry| around.contains(&entry.identifier.name))
    }
}

/// Calls `found` with each predicate and each function of a condition.
fn names_in<'p>(condition: &'p Condition, found: &mut dyn FnMut(&'p Name)) {
    condition.walk(&mut |node| {
        if let Some(atom) = node.atom().or_else(|| node.fluent()) {
            found(&atom.predicate.name);
        }
    });
}
