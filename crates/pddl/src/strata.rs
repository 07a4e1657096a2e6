//! Stratification of derived predicates: each predicate is in a higher stratum than all derived predicates
//! that its axioms negate.

use std::cmp::Reverse;

use rustc_hash::FxHashMap;

use super::ast::{Condition, Domain, Name};

#[derive(Debug)]
pub(crate) struct Strata<'d> {
    level: FxHashMap<&'d Name, usize>,
}

/// Error: the derived predicate depends on its own negation.
#[derive(Debug)]
pub(crate) struct NegativeCycle<'d>(pub(crate) &'d Name);

impl<'d> Strata<'d> {
    #[expect(clippy::arithmetic_side_effects, reason = "levels are at most the number of predicates")]
    pub(crate) fn of(domain: &'d Domain) -> Result<Self, NegativeCycle<'d>> {
        let mut numbers: FxHashMap<&Name, usize> = FxHashMap::default();
        for axiom in &domain.derived {
            let next = numbers.len();
            numbers.entry(&axiom.head.identifier.name).or_insert(next);
        }
        // Dependencies: head, derived predicate of the body, and 1 if the dependency is negated, else 0.
        let mut edges = Vec::new();
        for axiom in &domain.derived {
            let head = &axiom.head.identifier.name;
            uses(&axiom.condition, false, &mut |name, negated| {
                let body = numbers.get(name);
                edges.extend(body.map(|body| (head, numbers[head], *body, usize::from(negated))));
            });
        }
        let components = components(numbers.len(), &edges);
        let on_cycle = |(_, head, body, step): &&(_, usize, usize, usize)| {
            *step == 1 && components[*head] == components[*body]
        };
        if let Some((head, ..)) = edges.iter().find(on_cycle) {
            return Err(NegativeCycle(head));
        }
        // The bodies of a component are in the same component or in later ones, which are complete.
        edges.sort_by_key(|(_, head, ..)| Reverse(components[*head]));
        let mut levels = vec![0; numbers.len()];
        for (_, head, body, step) in edges {
            let required = levels[components[body]] + step;
            let level: &mut usize = &mut levels[components[head]];
            *level = required.max(*level);
        }
        let level = numbers.into_iter().map(|(name, number)| (name, levels[components[number]]));
        Ok(Self { level: level.collect() })
    }

    pub(crate) fn level(&self, name: &Name) -> Option<usize> {
        self.level.get(name).copied()
    }
}

/// Returns the strongly connected component of each predicate. A component has a smaller number than the other
/// components that its axioms use. Follows S. R. Kosaraju (A. V. Aho, J. E. Hopcroft, J. D. Ullman: Data Structures
/// and Algorithms, 1983, section 6.7).
fn components(count: usize, edges: &[(&Name, usize, usize, usize)]) -> Vec<usize> {
    let (mut bodies, mut heads) = (vec![Vec::new(); count], vec![Vec::new(); count]);
    for (_, head, body, _) in edges {
        bodies[*head].push(*body);
        heads[*body].push(*head);
    }
    let mut finished = Vec::new();
    let mut visited = vec![false; count];
    for start in 0..count {
        search(&bodies, start, &mut visited, &mut finished);
    }
    let mut components = vec![0; count];
    visited.fill(false);
    for (start, component) in finished.into_iter().rev().zip(0..) {
        let mut members = Vec::new();
        search(&heads, start, &mut visited, &mut members);
        for member in members {
            components[member] = component;
        }
    }
    components
}

/// Visits the predicates that `start` reaches and that are not `visited` yet, depth first. Appends them to
/// `finished`, each after those that it reaches.
#[expect(clippy::arithmetic_side_effects, reason = "positions in a list that is held in memory")]
fn search(links: &[Vec<usize>], start: usize, visited: &mut [bool], finished: &mut Vec<usize>) {
    let mut path: Vec<(usize, usize)> = Vec::new();
    if !std::mem::replace(&mut visited[start], true) {
        path.push((start, 0));
    }
    while let Some((vertex, position)) = path.last_mut() {
        let next = links[*vertex].get(*position);
        *position += 1;
        match next {
            Some(next) if std::mem::replace(&mut visited[*next], true) => {}
            Some(next) => path.push((*next, 0)),
            None => {
                finished.push(*vertex);
                path.pop();
            }
        }
    }
}

/// Calls `visit(predicate, negated)` for each atom of a condition. `negated` is `true` below an odd number of
/// negations; the premise of an implication counts as negated.
fn uses<'d>(condition: &'d Condition, negated: bool, visit: &mut impl FnMut(&'d Name, bool)) {
    match condition {
        Condition::Not(inner) => uses(inner, !negated, visit),
        Condition::Imply(premise, conclusion) => {
            uses(premise, !negated, visit);
            uses(conclusion, negated, visit);
        }
        Condition::Atom(atom) => visit(&atom.predicate.name, negated),
        other => other.parts().for_each(|part| uses(part, negated, visit)),
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use super::{NegativeCycle, Strata};
    use crate::ast::{Domain, Name};
    use crate::{Source, parse_domain};

    /// Domain in which each predicate `p` has the axioms `(:derived (p) body)` of the list.
    fn domain(axioms: &[(String, String)]) -> Domain {
        let mut text = "(define (domain d) (:predicates".to_owned();
        for (head, _) in axioms {
            write!(text, " ({head})").expect("a text");
        }
        text.push(')');
        for (head, body) in axioms {
            write!(text, "(:derived ({head}) {body})").expect("a text");
        }
        text.push(')');
        parse_domain(&Source::new("domain", text)).0.expect("a domain")
    }

    fn check(axioms: &[(&str, &str)], expected: Result<&[usize], &str>) {
        let domain =
            domain(&axioms.iter().map(|(head, body)| ((*head).into(), (*body).into())).collect::<Vec<_>>());
        match (Strata::of(&domain), expected) {
            (Ok(strata), Ok(levels)) => {
                let computed =
                    axioms.iter().map(|(head, _)| strata.level(&Name::new(head)).expect("derived"));
                assert_eq!(computed.collect::<Vec<_>>(), levels, "{axioms:?}");
            }
            (Err(NegativeCycle(name)), Err(expected)) => assert_eq!(name.as_str(), expected, "{axioms:?}"),
            (strata, expected) => panic!("{axioms:?}: {strata:?}, expected {expected:?}"),
        }
    }

    #[test]
    fn a_stratum_is_above_all_that_it_negates() {
        check(&[("a", "(not (b))"), ("b", "(c)"), ("c", "(not (d))"), ("d", "()")], Ok(&[2, 1, 1, 0]));
        check(&[("a", "(and (b) (not (c)))"), ("b", "(a)"), ("c", "(c)")], Ok(&[1, 1, 0]));
        check(&[("a", "(imply (b) (c))"), ("b", "()"), ("c", "(not (b))")], Ok(&[1, 0, 1]));
        check(&[("a", "(not (not (a)))")], Ok(&[0]));
        check(&[("a", "(b)"), ("b", "(not (c))"), ("c", "(b)")], Err("b"));
        check(&[("a", "(not (a))")], Err("a"));
    }

    /// The time is nearly linear in the number of axioms, also if a cycle comes last.
    #[test]
    fn a_cycle_behind_a_long_chain_is_found_soon() {
        let mut axioms: Vec<(String, String)> =
            (1..20_000).map(|number| (format!("p{number}"), format!("(not (p{}))", number - 1))).collect();
        axioms.insert(0, ("p0".into(), "()".into()));
        axioms.reverse();
        let chain = domain(&axioms);
        let strata = Strata::of(&chain).expect("no cycle");
        assert_eq!(strata.level(&Name::new("p19999")), Some(19_999));
        axioms.push(("q".into(), "(not (q))".into()));
        assert_eq!(Strata::of(&domain(&axioms)).expect_err("a cycle").0.as_str(), "q");
    }
}
