//! Safety checks of single rules: arities, head atoms and unbound variables. Also determines the variables
//! and atoms that an aggregate shares with the rest of the body.
//!
//! Relation atoms bind their variables. An equality, a built-in function or an aggregate binds another
//! variable once its inputs are bound. Aggregates are ordered such that the group variables of each are bound
//! before its evaluation.

use std::collections::BTreeSet;

use crate::error::Error;
use crate::plan::Bound;
use crate::rule::{Atom, Rule, Term};
use crate::source::Source;

#[derive(Clone, Debug)]
pub(crate) struct Scope {
    pub position: usize,
    /// Variables of the aggregate that atoms outside the aggregate bind, in ascending order.
    pub group: Vec<u16>,
    /// Other variables of the aggregate, in ascending order.
    pub locals: Vec<u16>,
    /// Positions of atoms outside the aggregate. They bind the group variables that the aggregate's own atoms leave
    /// unbound.
    pub context: Vec<usize>,
}

pub(crate) struct Binding {
    pub bound: Bound,
    /// Aggregates in an order in which each comes after the aggregates whose results it needs.
    pub scopes: Vec<Scope>,
}

fn sources(terms: &[Term]) -> Vec<Source> {
    terms.iter().copied().map(Source::from).collect()
}

fn variables(terms: &[Term]) -> Vec<u16> {
    let mut numbers: Vec<u16> = terms.iter().filter_map(|term| Some(term.as_variable()?.0)).collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

/// Returns the variables within an aggregate, except its result. Empty for other atoms.
fn inner_variables(atom: &Atom) -> Vec<u16> {
    match atom {
        Atom::Aggregate { .. } => variables(&atom.terms()[1..]),
        _ => Vec::new(),
    }
}

/// Adds to `bound` all variables that the atoms bind, until no further variable is bound. Aggregates
/// bind their results only if `optimistic`.
fn close(atoms: &[Atom], bound: &mut Bound, optimistic: bool) {
    loop {
        let before = bound.clone();
        for atom in atoms {
            let terms = sources(&atom.terms());
            let binds: &[Source] = match atom {
                Atom::Relation { .. } => &terms,
                Atom::Same(..) if terms.iter().any(|&term| bound.is_bound(term)) => &terms,
                Atom::BuiltIn { built_in, .. } if built_in.binds(&bound.bound_flags(&terms)) => &terms,
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

pub(crate) fn binding(rule: &Rule) -> Binding {
    let initial = Bound(vec![false; rule.variable_count()]);
    let mut bound = initial.clone();
    if !rule.body.iter().any(|atom| matches!(atom, Atom::Aggregate { .. })) {
        close(&rule.body, &mut bound, false);
        return Binding { bound, scopes: Vec::new() };
    }
    // Variables bound outside of aggregates, if every aggregate yields its result.
    let mut outer = initial.clone();
    close(&rule.body, &mut outer, true);
    let mut scopes: Vec<Scope> = Vec::new();
    loop {
        close(&rule.body, &mut bound, false);
        let is_next = |&position: &usize| {
            let Atom::Aggregate { .. } = &rule.body[position] else { return false };
            let group = inner_variables(&rule.body[position]);
            let mut group = group.iter().map(|&number| usize::from(number)).filter(|&n| outer.0[n]);
            group.all(|number| bound.0[number]) && scopes.iter().all(|scope| scope.position != position)
        };
        let Some(position) = (0..rule.body.len()).find(is_next) else { return Binding { bound, scopes } };
        scopes.push(scope(rule, position, &bound, &scopes));
        if let Some(&Source::Variable(result)) = sources(&rule.body[position].terms()).first() {
            bound.bind(result);
        }
    }
}

fn scope(rule: &Rule, position: usize, bound: &Bound, earlier: &[Scope]) -> Scope {
    let inner = inner_variables(&rule.body[position]);
    let (group, locals): (Vec<u16>, Vec<u16>) = inner.iter().partition(|&&n| bound.0[usize::from(n)]);
    let mut inner_bound = Bound(vec![false; rule.variable_count()]);
    close(rule.body[position].parts(), &mut inner_bound, false);
    let open: Vec<u16> =
        group.iter().copied().filter(|&number| !inner_bound.0[usize::from(number)]).collect();
    let context = context(rule, &open, bound, earlier);
    Scope { position, group, locals, context }
}

/// Returns the positions of atoms that bind `variables` for an aggregate. Prefers one relation atom per
/// variable, so that the aggregate depends on few relations. If some variable occurs in no relation
/// atom, returns all atoms that can be evaluated.
fn context(rule: &Rule, variables: &[u16], bound: &Bound, earlier: &[Scope]) -> Vec<usize> {
    let relation_with = |&number: &u16| {
        rule.body.iter().position(|atom| {
            let term = Term::Variable(crate::rule::Variable(number));
            matches!(atom, Atom::Relation { arguments, .. } if arguments.contains(&term))
        })
    };
    let relations: Option<BTreeSet<usize>> = variables.iter().map(relation_with).collect();
    let usable = |&other: &usize| match &rule.body[other] {
        Atom::Aggregate { .. } => earlier.iter().any(|scope| scope.position == other),
        atom => bound.are_bound(&sources(&atom.terms())),
    };
    match relations {
        Some(relations) => relations.into_iter().collect(),
        None => (0..rule.body.len()).filter(usable).collect(),
    }
}

/// Returns a flag for each variable of a rule that has passed [`check`]: `true` if the body binds it. Variables local to
/// aggregates are not bound.
pub(crate) fn bound_variables(rule: &Rule) -> Vec<bool> {
    let may_be_local = |atom: &Atom| matches!(atom, Atom::Aggregate { .. } | Atom::Not { .. });
    if rule.body.iter().any(may_be_local) {
        return binding(rule).bound.0;
    }
    vec![true; rule.variable_count()]
}

/// Returns the errors of one rule: arities of atoms, forbidden head atoms and nested aggregates; if there are
/// none, unbound variables.
pub(crate) fn check(rule: &Rule) -> Vec<Error> {
    let mut errors = Vec::new();
    let identity = || rule.identity.clone();
    for atom in &rule.head {
        let what = match atom {
            atom if atom.is_negated() => "a negated atom",
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
        Atom::BuiltIn { built_in, arguments } | Atom::NotBuiltIn { built_in, arguments }
            if !built_in.accepts(arguments.len()) =>
        {
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
    for (position, atom) in rule.body.iter().enumerate() {
        let Atom::Aggregate { body, .. } = atom else {
            missing.extend(variables(&atom.terms()).into_iter().filter(|n| !is_bound(n)).map(|n| (false, n)));
            continue;
        };
        let result_variables = variables(&atom.terms()[..1]);
        missing.extend(result_variables.into_iter().filter(|n| !is_bound(n)).map(|n| (false, n)));
        // An aggregate without a scope needs the result of another aggregate. That result is unbound and is reported.
        let Some(scope) = scopes.iter().find(|scope| scope.position == position) else { continue };
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
