//! Subclasses between restrictions, from subclasses and subproperties of their parts (scm-svf1, scm-svf2, scm-avf1,
//! scm-avf2). An instance of a restriction that is stated need not have the values that would make it an instance of a
//! wider one, so these do not follow from the rules of the axioms themselves.

use rustc_hash::{FxHashMap, FxHashSet};

use super::axiom::Axiom;
use crate::symbol::Symbol;

/// What is below what, reflexive and transitive.
#[derive(Default)]
struct Order(FxHashMap<Symbol, Vec<Symbol>>);

impl Order {
    fn add(&mut self, below: Symbol, above: Symbol) {
        self.0.entry(below).or_default().push(above);
    }

    fn is_below(&self, below: Symbol, above: Symbol) -> bool {
        let (mut seen, mut stack) = (FxHashSet::from_iter([below]), vec![below]);
        while let Some(at) = stack.pop() {
            if at == above {
                return true;
            }
            stack.extend(self.0.get(&at).into_iter().flatten().copied().filter(|&next| seen.insert(next)));
        }
        false
    }
}

/// A restriction: its class, property and filler; no filler is `owl:Thing`.
type Restriction = (Symbol, Symbol, Option<Symbol>);

/// The subclass axioms between restrictions that follow and are not among the axioms themselves.
pub(super) fn subclasses(axioms: &[Axiom]) -> Vec<Axiom> {
    let (mut some, mut all): (Vec<Restriction>, Vec<Restriction>) = (Vec::new(), Vec::new());
    let (mut classes, mut properties) = (Order::default(), Order::default());
    for axiom in axioms {
        match axiom {
            Axiom::SubClass(c, d) => classes.add(*c, *d),
            Axiom::EquivalentClasses(c, d) => {
                classes.add(*c, *d);
                classes.add(*d, *c);
            }
            Axiom::Intersection(c, parts) => parts.iter().for_each(|&part| classes.add(*c, part)),
            Axiom::Union(c, parts) => parts.iter().for_each(|&part| classes.add(part, *c)),
            Axiom::SubProperty(p, q) => properties.add(*p, *q),
            Axiom::EquivalentProperties(p, q) => {
                properties.add(*p, *q);
                properties.add(*q, *p);
            }
            Axiom::SomeValuesFrom(c, p, filler) => some.push((*c, *p, *filler)),
            Axiom::AllValuesFrom(c, p, filler) => all.push((*c, *p, Some(*filler))),
            _ => {}
        }
    }
    let mut found = Vec::new();
    loop {
        let before = found.len();
        for (restrictions, is_universal) in [(&some, false), (&all, true)] {
            for (lower, upper) in restrictions.iter().flat_map(|l| restrictions.iter().map(move |u| (l, u))) {
                let (below, above) = if is_universal { (upper.1, lower.1) } else { (lower.1, upper.1) };
                let fits = match (lower.2, upper.2) {
                    (_, None) => true,
                    (Some(lower), Some(upper)) => classes.is_below(lower, upper),
                    (None, Some(_)) => false,
                };
                if fits && properties.is_below(below, above) && !classes.is_below(lower.0, upper.0) {
                    classes.add(lower.0, upper.0);
                    found.push(Axiom::SubClass(lower.0, upper.0));
                }
            }
        }
        if found.len() == before {
            return found;
        }
    }
}
