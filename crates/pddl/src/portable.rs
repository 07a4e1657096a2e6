//! A domain and a problem to the same in a form that other planners accept.
//!
//! Requirements name what is used, what is used is declared, nothing is said twice, the problem names its domain. What
//! no other form could say (two actions of one name, names that begin with a digit) stays as it is.

use rustc_hash::{FxHashMap, FxHashSet};

use super::ast::{
    ActionBody, Atom, Comparison, Condition, Constraint, Declaration, Domain, Effect, EffectTime, Expression,
    Identifier, InitialElement, Name, Problem, Span, Term, Trajectory, TypeExpression, TypedName,
};
use super::types::TypeHierarchy;

/// A domain and a problem as other planners want them; both have passed [`check`](super::check()).
pub fn portable(domain: &Domain, problem: &Problem) -> (Domain, Problem) {
    let (mut domain, mut problem) = (domain.clone(), problem.clone());
    declare_types(&mut domain);
    declare_total_cost(&mut domain, &problem);
    move_constants(&mut domain, &mut problem);
    say_once(&domain, &mut problem);
    problem.domain = domain.name.clone();
    problem.requirements.clear();
    require(&mut domain, &problem);
    (domain, problem)
}

fn identifier(name: &str) -> Identifier {
    Identifier { name: Name::new(name), span: Span::default() }
}

/// Declares supertypes that are only mentioned; types that nothing declares restrict nothing.
fn declare_types(domain: &mut Domain) {
    let hierarchy = TypeHierarchy::of(domain);
    for declaration in domain.predicates.iter_mut().chain(&mut domain.functions) {
        for parameter in &mut declaration.parameters {
            parameter.r#type.alternatives.retain(|r#type| hierarchy.contains(&r#type.name));
        }
    }
    let mut known: FxHashSet<Name> = FxHashSet::default();
    known.insert(Name::new("object"));
    known.extend(domain.types.iter().map(|entry| entry.identifier.name.clone()));
    let parents: Vec<_> = domain.types.iter().flat_map(|entry| entry.r#type.alternatives.clone()).collect();
    for identifier in parents {
        if known.insert(identifier.name.clone()) {
            domain.types.push(TypedName { identifier, r#type: TypeExpression::default() });
        }
    }
}

/// Declares `total-cost` where it is only used.
fn declare_total_cost(domain: &mut Domain, problem: &Problem) {
    let name = Name::new("total-cost");
    let is_declared = domain.functions.iter().any(|function| function.identifier.name == name);
    let mut is_used = false;
    walk(domain, problem, &mut |part| {
        is_used |= matches!(part, Part::Function(atom) if atom.predicate.name == name);
    });
    if is_used && !is_declared {
        domain.functions.push(Declaration { identifier: identifier("total-cost"), parameters: Vec::new() });
    }
}

/// Makes constants of the problem's objects that the domain uses.
fn move_constants(domain: &mut Domain, problem: &mut Problem) {
    let mut used: FxHashSet<Name> = FxHashSet::default();
    walk_domain(domain, &mut |part| {
        let (Part::Condition(Condition::Atom(atom))
        | Part::Effect(Effect::Add(atom) | Effect::Delete(atom))
        | Part::Function(atom)) = part
        else {
            if let Part::Condition(Condition::Equal(left, right, _)) = part {
                used.extend([left, right].into_iter().filter_map(constant));
            }
            return;
        };
        used.extend(atom.arguments.iter().filter_map(constant));
    });
    let (moved, kept) = std::mem::take(&mut problem.objects)
        .into_iter()
        .partition(|object| used.contains(&object.identifier.name));
    problem.objects = kept;
    let declared: FxHashSet<Name> =
        domain.constants.iter().map(|constant| constant.identifier.name.clone()).collect();
    let is_new = |object: &TypedName| !declared.contains(&object.identifier.name);
    domain.constants.extend(Vec::into_iter(moved).filter(is_new));
    merge_types(&mut domain.constants);
}

fn constant(term: &Term) -> Option<Name> {
    match term {
        Term::Constant(identifier) => Some(identifier.name.clone()),
        Term::Variable(_) => None,
    }
}

/// Drops objects that are constants already, repeated facts and values, and what the closed world says anyway.
fn say_once(domain: &Domain, problem: &mut Problem) {
    let constants: FxHashSet<Name> =
        domain.constants.iter().map(|constant| constant.identifier.name.clone()).collect();
    problem.objects.retain(|object| !constants.contains(&object.identifier.name));
    merge_types(&mut problem.objects);
    let mut said: FxHashSet<(bool, Name, Vec<Name>)> = FxHashSet::default();
    problem.init.retain(|element| match element {
        InitialElement::Fact(atom) => said.insert((false, atom.predicate.name.clone(), names(atom))),
        InitialElement::Value(atom, ..) => said.insert((true, atom.predicate.name.clone(), names(atom))),
        InitialElement::NegatedFact(_) => false,
        InitialElement::Timed(..) => true,
    });
}

/// Objects that are declared twice are of both types.
fn merge_types(objects: &mut Vec<TypedName>) {
    let mut merged: Vec<TypedName> = Vec::with_capacity(objects.len());
    let mut places: FxHashMap<Name, usize> = FxHashMap::default();
    for object in objects.drain(..) {
        let Some(place) = places.get(&object.identifier.name) else {
            places.insert(object.identifier.name.clone(), merged.len());
            merged.push(object);
            continue;
        };
        let known = &mut merged[*place].r#type.alternatives;
        let is_new = |one: &Identifier| known.iter().all(|other| other.name != one.name);
        let more: Vec<_> = object.r#type.alternatives.into_iter().filter(is_new).collect();
        known.extend(more);
    }
    *objects = merged;
}

fn names(atom: &Atom) -> Vec<Name> {
    let name = |term: &Term| match term {
        Term::Variable(identifier) | Term::Constant(identifier) => identifier.name.clone(),
    };
    atom.arguments.iter().map(name).collect()
}

/// Requirements that stand for others.
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

/// Adds the requirements that are used and not stated.
fn require(domain: &mut Domain, problem: &Problem) {
    let mut needed: FxHashSet<&'static str> = FxHashSet::default();
    needed.insert("strips");
    walk(domain, problem, &mut |part| needed.extend(part.needs()));
    let mut insert = |flag, is_used: bool| is_used && needed.insert(flag);
    let soft = domain.constraints.iter().chain(&problem.constraints).any(|own| own.preference.is_some());
    insert("preferences", soft);
    insert("typing", !domain.types.is_empty());
    insert("derived-predicates", !domain.derived.is_empty());
    let is_timed = |element: &InitialElement| matches!(element, InitialElement::Timed(..));
    insert("timed-initial-literals", problem.init.iter().any(is_timed));
    let is_durative = domain.actions.iter().any(|action| matches!(action.body, ActionBody::Durative { .. }));
    insert("durative-actions", is_durative);
    // The older name is the one that planners for durative actions know.
    if is_durative && needed.remove("numeric-fluents") {
        needed.insert("fluents");
    }
    if needed.contains("numeric-fluents") || needed.contains("fluents") {
        needed.remove("action-costs");
    }
    let mut stated = FxHashSet::default();
    domain.requirements.retain(|flag| stated.insert(flag.name.clone()));
    let is_stated = |flag: &&str| {
        let by = IMPLIED.iter().filter(|(implied, _)| implied == flag).map(|(_, by)| *by);
        by.chain([*flag]).any(|flag| stated.contains(&Name::new(flag)))
    };
    let mut missing: Vec<_> = needed.into_iter().filter(|flag| !is_stated(flag)).collect();
    missing.sort_unstable();
    domain.requirements.extend(missing.into_iter().map(identifier));
}

/// A part of a domain or a problem that may need a requirement.
#[derive(Clone, Copy)]
enum Part<'t> {
    Condition(&'t Condition),
    Effect(&'t Effect),
    /// A function in an expression or as the target of an effect.
    Function(&'t Atom),
    Duration(Comparison, EffectTime),
    Constraint(&'t Constraint),
    /// A preference of an action.
    Preference,
}

impl Part<'_> {
    fn needs(self) -> Option<&'static str> {
        match self {
            Self::Preference => Some("preferences"),
            Self::Constraint(Constraint { preference, trajectory, .. }) => match trajectory {
                Trajectory::AtEnd(_) if preference.is_some() => Some("preferences"),
                _ => Some("constraints"),
            },
            Self::Condition(condition) => match condition {
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
            Self::Effect(effect) => match effect {
                Effect::When(..) | Effect::ForAll(..) => Some("conditional-effects"),
                Effect::Assign(_, target, ..) if is_total_cost(target) => Some("action-costs"),
                Effect::Assign(..) => Some("numeric-fluents"),
                Effect::And(_) | Effect::Add(_) | Effect::Delete(_) => None,
            },
            Self::Function(_) | Self::Duration(Comparison::Equal, EffectTime::AtStart) => None,
            Self::Duration(..) => Some("duration-inequalities"),
        }
    }
}

fn is_total_cost(atom: &Atom) -> bool {
    atom.predicate.name == Name::new("total-cost")
}

type Found<'f> = &'f mut dyn FnMut(Part<'_>);

fn walk(domain: &Domain, problem: &Problem, found: Found<'_>) {
    walk_domain(domain, found);
    walk_condition(&problem.goal, found);
    walk_constraints(&problem.constraints, found);
    if let Some(metric) = &problem.metric {
        walk_expression(&metric.expression, found);
    }
}

fn walk_domain(domain: &Domain, found: Found<'_>) {
    walk_constraints(&domain.constraints, found);
    for axiom in &domain.derived {
        walk_condition(&axiom.condition, found);
    }
    for action in &domain.actions {
        for preference in &action.preferences {
            found(Part::Preference);
            walk_condition(&preference.condition, found);
        }
        match &action.body {
            ActionBody::Instantaneous { precondition, effect } => {
                walk_condition(precondition, found);
                walk_effect(effect, found);
            }
            ActionBody::Durative { duration, conditions, effects } => {
                for constraint in duration {
                    found(Part::Duration(constraint.operator, constraint.time));
                    walk_expression(&constraint.expression, found);
                }
                for (_, condition) in conditions {
                    walk_condition(condition, found);
                }
                for (_, effect) in effects {
                    walk_effect(effect, found);
                }
            }
        }
    }
}

fn walk_constraints(constraints: &[Constraint], found: Found<'_>) {
    for constraint in constraints {
        found(Part::Constraint(constraint));
        walk_trajectory(&constraint.trajectory, found);
    }
}

fn walk_trajectory(trajectory: &Trajectory, found: Found<'_>) {
    match trajectory {
        Trajectory::And(parts) => {
            for part in parts {
                walk_trajectory(part, found);
            }
        }
        Trajectory::ForAll(_, body) => walk_trajectory(body, found),
        Trajectory::AtEnd(what)
        | Trajectory::Always(what)
        | Trajectory::Sometime(what)
        | Trajectory::AtMostOnce(what)
        | Trajectory::Within(_, what)
        | Trajectory::HoldDuring(_, _, what)
        | Trajectory::HoldAfter(_, what) => walk_condition(what, found),
        Trajectory::SometimeAfter(first, second)
        | Trajectory::SometimeBefore(first, second)
        | Trajectory::AlwaysWithin(_, first, second) => {
            walk_condition(first, found);
            walk_condition(second, found);
        }
    }
}

fn walk_condition(condition: &Condition, found: Found<'_>) {
    found(Part::Condition(condition));
    match condition {
        Condition::And(parts) | Condition::Or(parts) => {
            for part in parts {
                walk_condition(part, found);
            }
        }
        Condition::Not(inner) | Condition::Exists(_, inner) | Condition::ForAll(_, inner) => {
            walk_condition(inner, found);
        }
        Condition::Imply(premise, conclusion) => {
            walk_condition(premise, found);
            walk_condition(conclusion, found);
        }
        Condition::Atom(_) | Condition::Equal(..) => {}
        Condition::Compare(_, left, right, _) => {
            walk_expression(left, found);
            walk_expression(right, found);
        }
    }
}

fn walk_effect(effect: &Effect, found: Found<'_>) {
    found(Part::Effect(effect));
    match effect {
        Effect::And(parts) => {
            for part in parts {
                walk_effect(part, found);
            }
        }
        Effect::Add(_) | Effect::Delete(_) => {}
        Effect::ForAll(_, body) => walk_effect(body, found),
        Effect::When(condition, body) => {
            walk_condition(condition, found);
            walk_effect(body, found);
        }
        Effect::Assign(_, target, value, _) => {
            found(Part::Function(target));
            walk_expression(value, found);
        }
    }
}

fn walk_expression(expression: &Expression, found: Found<'_>) {
    match expression {
        Expression::Fluent(atom) => found(Part::Function(atom)),
        Expression::Operation(_, operands, _) => {
            for operand in operands {
                walk_expression(operand, found);
            }
        }
        Expression::Number(..) | Expression::Duration(_) | Expression::TotalTime(_) => {}
    }
}
