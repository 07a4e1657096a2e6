//! Symbol table of a domain and a problem, with one namespace per kind of name.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ast::{Declaration, Domain, Name, Problem, TypeExpression, TypedName};
use crate::types::TypeHierarchy;

#[derive(Debug, Default)]
pub(super) struct Object<'a> {
    pub(super) types: Vec<&'a TypeExpression>,
    pub(super) is_constant: bool,
}

/// Declared names. The first of several declarations of a predicate or a function counts.
#[derive(Debug)]
pub(super) struct Symbols<'a> {
    pub(super) types: TypeHierarchy,
    pub(super) predicates: FxHashMap<&'a Name, &'a Declaration>,
    pub(super) functions: FxHashMap<&'a Name, &'a Declaration>,
    pub(super) object_fluents: FxHashSet<&'a Name>,
    pub(super) derived: FxHashSet<&'a Name>,
    pub(super) objects: FxHashMap<&'a Name, Object<'a>>,
    pub(super) preferences: FxHashSet<&'a Name>,
}

impl<'a> Symbols<'a> {
    pub(super) fn of(domain: &'a Domain, problem: Option<&'a Problem>) -> Self {
        let mut objects = FxHashMap::default();
        insert_objects(&mut objects, &domain.constants, true);
        if let Some(problem) = problem {
            insert_objects(&mut objects, &problem.objects, false);
        }
        let action_preferences =
            domain.actions.iter().flat_map(|action| &action.preferences).map(|preference| &preference.name);
        let constraints =
            domain.constraints.iter().chain(problem.into_iter().flat_map(|problem| &problem.constraints));
        let names =
            action_preferences.chain(constraints.filter_map(|constraint| constraint.preference.as_ref()));
        Self {
            preferences: names.map(|identifier| &identifier.name).collect(),
            types: TypeHierarchy::of(domain),
            predicates: by_name(&domain.predicates),
            functions: by_name(&domain.functions),
            object_fluents: domain.object_fluents.iter().collect(),
            derived: domain.derived.iter().map(|axiom| &axiom.head.identifier.name).collect(),
            objects,
        }
    }
}

fn insert_objects<'a>(
    objects: &mut FxHashMap<&'a Name, Object<'a>>,
    entries: &'a [TypedName],
    is_constant: bool,
) {
    for entry in entries {
        let object = objects.entry(&entry.identifier.name).or_default();
        object.types.push(&entry.r#type);
        object.is_constant |= is_constant;
    }
}

fn by_name(declarations: &[Declaration]) -> FxHashMap<&Name, &Declaration> {
    let mut map = FxHashMap::default();
    for declaration in declarations {
        map.entry(&declaration.identifier.name).or_insert(declaration);
    }
    map
}
