//! Normalises a domain and a problem to a form that other planners accept.
//!
//! Missing requirement flags are added, `total-cost` and supertypes are declared, objects that the domain
//! uses become constants, duplicates are removed, and the problem names its domain. Features without an
//! equivalent (two actions of one name, names that begin with a digit) stay as they are.

use rustc_hash::{FxHashMap, FxHashSet};

use super::ast::{
    ActionBody, Atom, Comparison, Condition, Constraint, Declaration, Domain, DurationConstraint, Effect,
    EffectTime, Identifier, InitialElement, Name, Problem, Span, Term, Trajectory, TypeExpression, TypedName,
};
use super::types::TypeHierarchy;
use super::visit::{Node, Visit};

/// Converts a domain and a problem that have passed [`check`](super::check()) to a form that other planners
/// accept (see the head of this file).
pub fn portable(domain: &Domain, problem: &Problem) -> (Domain, Problem) {
    let (mut domain, mut problem) = (domain.clone(), problem.clone());
    declare_types(&mut domain);
    declare_total_cost(&mut domain, &problem);
    move_constants(&mut domain, &mut problem);
    remove_duplicates(&domain, &mut problem);
    problem.domain = domain.name.clone();
    // The domain states the requirement flags for the features of both files.
    problem.requirements.clear();
    require(&mut domain, &problem);
    (domain, problem)
}

fn identifier(name: &str) -> Identifier {
    Identifier { name: Name::new(name), span: Span::default() }
}

/// Declares supertypes that are only mentioned. A parameter of a predicate or function with an undeclared type
/// accepts all objects, so it gets no type.
fn declare_types(domain: &mut Domain) {
    let hierarchy = TypeHierarchy::of(domain);
    for declaration in domain.predicates.iter_mut().chain(&mut domain.functions) {
        for parameter in &mut declaration.parameters {
            let alternatives = &mut parameter.r#type.alternatives;
            if alternatives.iter().any(|r#type| !hierarchy.contains(&r#type.name)) {
                alternatives.clear();
            }
        }
    }
    let mut declared: FxHashSet<Name> = FxHashSet::default();
    declared.insert(Name::new("object"));
    declared.extend(domain.types.iter().map(|entry| entry.identifier.name.clone()));
    let parents: Vec<_> = domain.types.iter().flat_map(|entry| entry.r#type.alternatives.clone()).collect();
    for identifier in parents {
        if declared.insert(identifier.name.clone()) {
            domain.types.push(TypedName { identifier, r#type: TypeExpression::default() });
        }
    }
}

fn declare_total_cost(domain: &mut Domain, problem: &Problem) {
    let name = Name::new("total-cost");
    let is_declared = domain.functions.iter().any(|function| function.identifier.name == name);
    let mut is_used = false;
    walk(domain, problem, &mut |node| {
        is_used |= function(node).is_some_and(|atom| atom.predicate.name == name);
    });
    if is_used && !is_declared {
        domain.functions.push(Declaration { identifier: identifier("total-cost"), parameters: Vec::new() });
    }
}

fn move_constants(domain: &mut Domain, problem: &mut Problem) {
    let mut used: FxHashSet<Name> = FxHashSet::default();
    domain.walk(&mut |node| match node {
        Node::Condition(Condition::Equal(left, right, _)) => {
            used.extend([left, right].into_iter().filter_map(constant));
        }
        Node::Condition(Condition::Atom(atom)) | Node::Effect(Effect::Add(atom) | Effect::Delete(atom)) => {
            used.extend(atom.arguments.iter().filter_map(constant));
        }
        node => used.extend(function(node).iter().flat_map(|atom| &atom.arguments).filter_map(constant)),
    });
    // A constant that the problem declares again has the types of both declarations.
    used.extend(domain.constants.iter().map(|constant| constant.identifier.name.clone()));
    let (moved, kept): (Vec<_>, Vec<_>) = std::mem::take(&mut problem.objects)
        .into_iter()
        .partition(|object| used.contains(&object.identifier.name));
    problem.objects = kept;
    domain.constants.extend(moved);
    merge_types(&TypeHierarchy::of(domain), &mut domain.constants);
}

fn constant(term: &Term) -> Option<Name> {
    match term {
        Term::Constant(identifier) => Some(identifier.name.clone()),
        Term::Variable(_) => None,
    }
}

/// Removes repeated facts and values, and negated facts, which the closed-world assumption implies. Merges
/// repeated declarations of an object.
fn remove_duplicates(domain: &Domain, problem: &mut Problem) {
    merge_types(&TypeHierarchy::of(domain), &mut problem.objects);
    let mut stated: FxHashSet<(bool, Name, Vec<Name>)> = FxHashSet::default();
    problem.init.retain(|element| match element {
        InitialElement::Fact(atom) => stated.insert((false, atom.predicate.name.clone(), names(atom))),
        InitialElement::Value(atom, ..) => stated.insert((true, atom.predicate.name.clone(), names(atom))),
        InitialElement::NegatedFact(_) => false,
        InitialElement::Timed(..) => true,
    });
}

/// Merges repeated declarations of an object, which then has all their types. A supertype of another type of
/// the object is not stated.
fn merge_types(hierarchy: &TypeHierarchy, objects: &mut Vec<TypedName>) {
    let mut merged: Vec<TypedName> = Vec::with_capacity(objects.len());
    let mut places: FxHashMap<Name, usize> = FxHashMap::default();
    for object in objects.drain(..) {
        let Some(place) = places.get(&object.identifier.name) else {
            places.insert(object.identifier.name.clone(), merged.len());
            merged.push(object);
            continue;
        };
        let alternatives = &mut merged[*place].r#type.alternatives;
        let is_new =
            |alternative: &Identifier| alternatives.iter().all(|present| present.name != alternative.name);
        let new_alternatives: Vec<_> = object.r#type.alternatives.into_iter().filter(is_new).collect();
        alternatives.extend(new_alternatives);
        let candidates = alternatives.clone();
        let is_below = |lower: &Identifier, upper: &Identifier| {
            hierarchy.is_a(&lower.name, &upper.name) && !hierarchy.is_a(&upper.name, &lower.name)
        };
        alternatives.retain(|upper| !candidates.iter().any(|lower| is_below(lower, upper)));
    }
    *objects = merged;
}

fn names(atom: &Atom) -> Vec<Name> {
    atom.arguments.iter().map(Term::name).cloned().collect()
}

/// Pairs of requirement flags: a file that states the second flag need not state the first.
const IMPLIED: [(&str, &str); 12] = [
    ("typing", "adl"),
    ("negative-preconditions", "adl"),
    ("disjunctive-preconditions", "adl"),
    ("equality", "adl"),
    ("existential-preconditions", "adl"),
    ("universal-preconditions", "adl"),
    ("existential-preconditions", "quantified-preconditions"),
    ("universal-preconditions", "quantified-preconditions"),
    ("conditional-effects", "adl"),
    ("numeric-fluents", "fluents"),
    ("fluents", "numeric-fluents"),
    ("action-costs", "numeric-fluents"),
];

fn require(domain: &mut Domain, problem: &Problem) {
    let mut required: FxHashSet<&'static str> = FxHashSet::default();
    required.insert("strips");
    walk(domain, problem, &mut |node| required.extend(needs(node)));
    let mut insert = |flag, is_used: bool| is_used && required.insert(flag);
    let soft = domain
        .constraints
        .iter()
        .chain(&problem.constraints)
        .any(|constraint| constraint.preference.is_some());
    insert("preferences", soft);
    insert("typing", !domain.types.is_empty());
    insert("derived-predicates", !domain.derived.is_empty());
    let is_timed = |element: &InitialElement| matches!(element, InitialElement::Timed(..));
    insert("timed-initial-literals", problem.init.iter().any(is_timed));
    let is_durative = domain.actions.iter().any(|action| matches!(action.body, ActionBody::Durative { .. }));
    insert("durative-actions", is_durative);
    // Planners for durative actions accept the older name `fluents`.
    if is_durative && required.remove("numeric-fluents") {
        required.insert("fluents");
    }
    // Numeric fluents include action costs.
    if required.contains("numeric-fluents") || required.contains("fluents") {
        required.remove("action-costs");
    }
    let mut stated = FxHashSet::default();
    domain.requirements.retain(|flag| stated.insert(flag.name.clone()));
    let is_stated = |flag: &&str| {
        let implying = IMPLIED.iter().filter(|(implied, _)| implied == flag).map(|(_, implying)| *implying);
        implying.chain([*flag]).any(|flag| stated.contains(&Name::new(flag)))
    };
    let mut missing: Vec<_> = required.into_iter().filter(|flag| !is_stated(flag)).collect();
    missing.sort_unstable();
    domain.requirements.extend(missing.into_iter().map(identifier));
}

fn walk<'t>(domain: &'t Domain, problem: &'t Problem, visit: Visit<'_, 't>) {
    domain.walk(visit);
    problem.walk(visit);
}

fn function(node: Node<'_>) -> Option<&Atom> {
    match node {
        Node::Effect(Effect::Assign(_, target, ..)) => Some(target),
        node => node.fluent(),
    }
}

/// Returns the requirement flag of a node, apart from the flags of its children. `None` if it needs no flag.
fn needs(node: Node<'_>) -> Option<&'static str> {
    match node {
        Node::Preference(_) => Some("preferences"),
        Node::Constraint(Constraint { preference, trajectory, .. }) => match trajectory {
            Trajectory::AtEnd(_) if preference.is_some() => Some("preferences"),
            _ => Some("constraints"),
        },
        Node::Condition(condition) => match condition {
            Condition::And(_) | Condition::Atom(_) => None,
            Condition::Or(_) | Condition::Imply(..) => Some("disjunctive-preconditions"),
            Condition::Not(inner) => match **inner {
                Condition::Atom(_) | Condition::Equal(..) => Some("negative-preconditions"),
                _ => Some("disjunctive-preconditions"),
            },
            Condition::Exists(..) => Some("existential-preconditions"),
            Condition::ForAll(..) => Some("universal-preconditions"),
            Condition::Equal(..) => Some("equality"),
            Condition::Compare(..) => Some("numeric-fluents"),
        },
        Node::Effect(effect) => match effect {
            Effect::When(..) | Effect::ForAll(..) => Some("conditional-effects"),
            Effect::Assign(_, target, ..) if is_total_cost(target) => Some("action-costs"),
            Effect::Assign(..) => Some("numeric-fluents"),
            Effect::And(_) | Effect::Add(_) | Effect::Delete(_) => None,
        },
        Node::Expression(_)
        | Node::Duration(DurationConstraint {
            operator: Comparison::Equal, time: EffectTime::AtStart, ..
        }) => None,
        Node::Duration(_) => Some("duration-inequalities"),
    }
}

fn is_total_cost(atom: &Atom) -> bool {
    atom.predicate.name == Name::new("total-cost")
}
