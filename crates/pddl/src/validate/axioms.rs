//! Groups the axioms of a domain by stratum and finds the body atoms that semi-naive evaluation joins with
//! new facts.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ast::{Atom, Condition, Derived, Domain, Name, TypedName};
use crate::strata::Strata;

/// Axioms of one stratum. Their predicates may depend on each other, but not through a negation.
#[derive(Debug, Default)]
pub(super) struct Stratum<'p> {
    pub(super) predicates: FxHashSet<&'p Name>,
    pub(super) axioms: Vec<Axiom<'p>>,
    /// For each predicate of the stratum: the atoms in bodies of axioms with which its new facts can be joined.
    pub(super) occurrences: FxHashMap<&'p Name, Vec<Occurrence<'p>>>,
}

#[derive(Debug)]
pub(super) struct Axiom<'p> {
    pub(super) derived: &'p Derived,
    /// Addresses of the opaque parts of the condition. An opaque part mentions a predicate of the stratum
    /// where new facts cannot be joined, for example below a negation.
    pub(super) opaque: FxHashSet<*const Condition>,
}

/// Atom in the body of an axiom with which new facts can be joined, because only conjunctions, disjunctions and
/// existential quantifiers enclose the atom.
#[derive(Debug)]
pub(super) struct Occurrence<'p> {
    pub(super) axiom: usize,
    pub(super) atom: &'p Atom,
    pub(super) variables: Vec<&'p [TypedName]>,
    /// Enclosing conjunctions, each with the index of the conjunct that contains the atom.
    pub(super) conjunctions: Vec<(&'p [Condition], usize)>,
}

/// Returns the strata of a domain, lowest first. If an axiom depends on its own negation, which the
/// checker rejects, all axioms form one stratum.
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
        strata[level].predicates.insert(name);
        strata[level].axioms.push(Axiom { derived, opaque: FxHashSet::default() });
    }
    for stratum in &mut strata {
        let Stratum { predicates, axioms, occurrences } = stratum;
        for (axiom, Axiom { derived, opaque }) in axioms.iter_mut().enumerate() {
            let derived = *derived;
            let mut walk = Walk {
                axiom,
                derived,
                predicates: &*predicates,
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

pub(super) fn read_by_axioms(domain: &Domain) -> FxHashSet<&Name> {
    let mut names = FxHashSet::default();
    for axiom in &domain.derived {
        names_in(&axiom.condition, &mut |name| {
            names.insert(name);
        });
    }
    names
}

struct Walk<'w, 'p> {
    axiom: usize,
    derived: &'p Derived,
    predicates: &'w FxHashSet<&'p Name>,
    variables: Vec<&'p [TypedName]>,
    conjunctions: Vec<(&'p [Condition], usize)>,
    occurrences: &'w mut FxHashMap<&'p Name, Vec<Occurrence<'p>>>,
    opaque: &'w mut FxHashSet<*const Condition>,
}

impl<'p> Walk<'_, 'p> {
    /// Records the occurrences of the stratum's predicates in `condition`. Returns `true` if the
    /// condition is opaque: it mentions such a predicate in a part into which new facts cannot be
    /// joined.
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
            // A new fact satisfies one disjunct; the other disjuncts need not be joined.
            Condition::Or(parts) => parts.iter().for_each(|part| is_opaque |= self.visit(part)),
            Condition::Exists(variables, body) if !self.hides(variables) => {
                self.variables.push(variables);
                is_opaque = self.visit(body);
                self.variables.pop();
            }
            Condition::Atom(atom) if self.predicates.contains(&atom.predicate.name) => {
                let occurrence = Occurrence {
                    axiom: self.axiom,
                    atom,
                    variables: self.variables.clone(),
                    conjunctions: self.conjunctions.clone(),
                };
                self.occurrences.entry(&atom.predicate.name).or_default().push(occurrence);
            }
            // Below a negation, an implication or a universal quantifier, a new fact cannot be joined.
            other => names_in(other, &mut |name| is_opaque |= self.predicates.contains(name)),
        }
        if is_opaque {
            self.opaque.insert(std::ptr::from_ref(condition));
        }
        is_opaque
    }

    fn hides(&self, variables: &[TypedName]) -> bool {
        let enclosing = self.variables.iter().copied().chain([&self.derived.head.parameters[..]]).flatten();
        let enclosing: FxHashSet<&Name> = enclosing.map(|entry| &entry.identifier.name).collect();
        variables.iter().any(|entry| enclosing.contains(&entry.identifier.name))
    }
}

fn names_in<'p>(condition: &'p Condition, visit: &mut dyn FnMut(&'p Name)) {
    condition.walk(&mut |node| {
        if let Some(atom) = node.atom().or_else(|| node.fluent()) {
            visit(&atom.predicate.name);
        }
    });
}
