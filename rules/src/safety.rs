//! What is wrong with a rule by itself: arities, head atoms, variables that nothing binds; and which variables and
//! atoms an aggregate takes from outside.
//!
//! Relation atoms bind their variables; an equality, a built-in function or an aggregate binds one more once the others
//! are bound. Aggregates are put into an order in which each has its group before it.

use std::collections::BTreeSet;

use crate::error::Error;
use crate::plan::Bound;
use crate::rule::{Atom, Rule, Term};
use crate::source::Source;

/// What an aggregate takes from outside and what is its own.
#[derive(Clone, Debug)]
pub(crate) struct Scope {
    /// Its position in the body.
    pub at: usize,
    /// Variables that atoms outside bind, ascending.
    pub group: Vec<u16>,
    /// Its other variables, ascending.
    pub locals: Vec<u16>,
    /// Positions of the atoms outside that have to bind the group because the aggregate's own do not; empty otherwise.
    pub context: Vec<usize>,
}

/// How the variables of a body come to their values.
pub(crate) struct Binding {
    bound: Bound,
    /// The aggregates, each after those whose results it takes.
    pub scopes: Vec<Scope>,
}

fn sources(terms: &[Term]) -> Vec<Source> {
    terms.iter().copied().map(Source::from).collect()
}

/// The variables in terms, ascending.
fn variables(terms: &[Term]) -> Vec<u16> {
    let mut numbers: Vec<u16> = terms.iter().filter_map(|term| Some(term.as_variable()?.0)).collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

/// The variables within an aggregate, its result left out.
fn inner_variables(atom: &Atom) -> Vec<u16> {
    match atom {
        Atom::Aggregate { .. } => variables(&atom.terms()[1..]),
        _ => Vec::new(),
    }
}

/// Binds what atoms other than aggregates bind, until nothing changes; `optimistic` has aggregates bind their results.
fn close(atoms: &[Atom], bound: &mut Bound, optimistic: bool) {
    loop {
        let before = bound.clone();
        for atom in atoms {
            let terms = sources(&atom.terms());
            let binds: &[Source] = match atom {
                Atom::Relation { .. } => &terms,
                Atom::Same(..) if terms.iter().any(|&term| bound.knows(term)) => &terms,
                Atom::BuiltIn { built_in, .. } if built_in.binds(&bound.known(&terms)) => &terms,
                Atom::Aggregate { .. } if optimistic => &terms[..1],
                _ => &[],
            };
            for source in binds {
                if let Source::Variable(number) = *source {
                    bound.bind(number);
                }
            }
        }
        if before == *bound {
            return;
        }
    }
}

/// How the variables of a rule's body come to their values.
pub(crate) fn binding(rule: &Rule) -> Binding {
    let none = Bound(vec![false; rule.variable_count()]);
    let mut bound = none.clone();
    if !rule.body.iter().any(|atom| matches!(atom, Atom::Aggregate { .. })) {
        close(&rule.body, &mut bound, false);
        return Binding { bound, scopes: Vec::new() };
    }
    let mut outside = none.clone();
    close(&rule.body, &mut outside, true);
    let mut scopes: Vec<Scope> = Vec::new();
    loop {
        close(&rule.body, &mut bound, false);
        let is_next = |&at: &usize| {
            let Atom::Aggregate { .. } = &rule.body[at] else { return false };
            let group = inner_variables(&rule.body[at]);
            let mut group = group.iter().map(|&number| usize::from(number)).filter(|&n| outside.0[n]);
            group.all(|number| bound.0[number]) && scopes.iter().all(|scope| scope.at != at)
        };
        let Some(at) = (0..rule.body.len()).find(is_next) else { return Binding { bound, scopes } };
        scopes.push(scope(rule, at, &bound, &scopes));
        if let Some(&Source::Variable(result)) = sources(&rule.body[at].terms()).first() {
            bound.bind(result);
        }
    }
}

fn scope(rule: &Rule, at: usize, bound: &Bound, earlier: &[Scope]) -> Scope {
    let inner = inner_variables(&rule.body[at]);
    let (group, locals): (Vec<u16>, Vec<u16>) = inner.iter().partition(|&&n| bound.0[usize::from(n)]);
    let mut alone = Bound(vec![false; rule.variable_count()]);
    close(rule.body[at].parts(), &mut alone, false);
    let open: Vec<u16> = group.iter().copied().filter(|&number| !alone.0[usize::from(number)]).collect();
    let context = context(rule, &open, bound, earlier);
    Scope { at, group, locals, context }
}

/// Positions of atoms that bind variables for an aggregate: one relation for each where that is enough, so that the
/// aggregate depends on as little as possible, else all that can be evaluated.
fn context(rule: &Rule, variables: &[u16], bound: &Bound, earlier: &[Scope]) -> Vec<usize> {
    let relation_with = |&number: &u16| {
        rule.body.iter().position(|atom| {
            let term = Term::Variable(crate::rule::Variable(number));
            matches!(atom, Atom::Relation { arguments, .. } if arguments.contains(&term))
        })
    };
    let relations: Option<BTreeSet<usize>> = variables.iter().map(relation_with).collect();
    let usable = |&other: &usize| match &rule.body[other] {
        Atom::Aggregate { .. } => earlier.iter().any(|scope| scope.at == other),
        atom => bound.knows_all(&sources(&atom.terms())),
    };
    match relations {
        Some(relations) => relations.into_iter().collect(),
        None => (0..rule.body.len()).filter(usable).collect(),
    }
}

/// Which variables the atoms of the body bind, those of aggregates' own left out.
pub(crate) fn bound_variables(rule: &Rule) -> Vec<bool> {
    binding(rule).bound.0
}

/// The errors of one rule: built-in arities, forbidden head atoms, variables that nothing binds.
pub(crate) fn check(rule: &Rule) -> Vec<Error> {
    let mut errors = Vec::new();
    let identity = || rule.identity.clone();
    for atom in &rule.head {
        let what = match atom {
            Atom::Not { .. } => "a negated atom",
            Atom::BuiltIn { .. } => "a built-in",
            Atom::Aggregate { .. } => "an aggregate",
            _ => continue,
        };
        errors.push(Error::HeadAtom { rule: identity(), what });
    }
    for atom in rule.head.iter().chain(&rule.body) {
        errors.extend(arity(rule, atom));
        errors.extend(atom.parts().iter().filter_map(|inner| arity(rule, inner)));
        if atom.parts().iter().any(|inner| matches!(inner, Atom::Aggregate { .. })) {
            errors.push(Error::NestedAggregate { rule: identity() });
        }
    }
    if errors.is_empty() { unbound(rule) } else { errors }
}

fn arity(rule: &Rule, atom: &Atom) -> Option<Error> {
    let identity = || rule.identity.clone();
    match atom {
        Atom::BuiltIn { built_in, arguments } if !built_in.accepts(arguments.len()) => {
            let (built_in, count) = (built_in.name(), arguments.len());
            Some(Error::BuiltInArity { rule: identity(), built_in, count })
        }
        Atom::Relation { arguments, .. } | Atom::Not { arguments, .. } if arguments.len() > 32 => {
            Some(Error::Arity { rule: identity(), count: arguments.len() })
        }
        Atom::Aggregate { .. } if inner_variables(atom).len() > 32 => {
            Some(Error::Arity { rule: identity(), count: inner_variables(atom).len() })
        }
        _ => None,
    }
}

fn unbound(rule: &Rule) -> Vec<Error> {
    let Binding { bound, scopes } = binding(rule);
    let mut missing: Vec<(bool, u16)> = Vec::new();
    let is_bound = |number: &u16| bound.0[usize::from(*number)];
    for (at, atom) in rule.body.iter().enumerate() {
        let Atom::Aggregate { body, .. } = atom else {
            missing.extend(variables(&atom.terms()).into_iter().filter(|n| !is_bound(n)).map(|n| (false, n)));
            continue;
        };
        let own = variables(&atom.terms()[..1]);
        missing.extend(own.into_iter().filter(|n| !is_bound(n)).map(|n| (false, n)));
        // One that has no place in the order waits for a result that is reported by itself.
        let Some(scope) = scopes.iter().find(|scope| scope.at == at) else { continue };
        let mut inner = Bound(vec![false; bound.0.len()]);
        scope.group.iter().for_each(|&number| inner.bind(number));
        close(body, &mut inner, false);
        let open = scope.locals.iter().filter(|&&number| !inner.0[usize::from(number)]);
        missing.extend(open.map(|&number| (false, number)));
    }
    let head: Vec<Term> = rule.head.iter().flat_map(Atom::terms).collect();
    missing.extend(variables(&head).into_iter().filter(|n| !is_bound(n)).map(|n| (true, n)));
    let mut errors = Vec::new();
    let mut reported = vec![false; bound.0.len()];
    for (in_head, number) in missing {
        if std::mem::replace(&mut reported[usize::from(number)], true) {
            continue;
        }
        let (rule, variable) = (rule.identity.clone(), rule.variable_name(crate::rule::Variable(number)));
        errors.push(if in_head {
            Error::UnsafeHead { rule, variable }
        } else {
            Error::UnsafeBody { rule, variable }
        });
    }
    errors
}
