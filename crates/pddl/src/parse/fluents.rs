//! Parser state for object fluents (functions with objects as values).

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ast::{Atom, Condition, Declaration, Domain, EffectTime, Identifier, Name, Span, Term, TypedName};
use crate::types::TypeHierarchy;

#[derive(Default)]
pub(super) struct Objects {
    /// Predicates that represent object fluents, by name. The last parameter is the value.
    pub(super) functions: FxHashMap<Name, Declaration>,
    pub(super) types: FxHashSet<Name>,
    /// Common prefix of the names of generated variables; `None` before the first is generated.
    pub(super) prefix: Option<String>,
    pub(super) count: usize,
    pub(super) is_open: bool,
    pub(super) values: Vec<Value>,
    /// Time of the effect that is being parsed; `None` in an instantaneous action.
    pub(super) time: Option<EffectTime>,
    /// Conditions that the effects of the current action impose on the state, each with its time.
    pub(super) needs: Vec<(EffectTime, Condition)>,
    pub(super) assigned: Vec<Assigned>,
    /// Values of object fluents in `:init`, by function and arguments, with their positions. `None` for
    /// `undefined`.
    pub(super) initial: FxHashMap<(Name, Vec<Name>), (Option<Name>, Span)>,
}

/// Variable for the value of an object-fluent term, and the atom that binds the variable.
pub(super) struct Value {
    pub(super) variable: TypedName,
    pub(super) atom: Atom,
}

/// Lengths of [`Objects::needs`] and [`Objects::assigned`] at some point of parsing. Later entries belong to
/// effects parsed after this point.
#[derive(Clone, Copy)]
pub(super) struct Mark {
    pub(super) needs: usize,
    pub(super) assigned: usize,
}

impl Objects {
    pub(super) fn of(domain: &Domain) -> Self {
        let names: FxHashSet<&Name> = domain.object_fluents.iter().collect();
        let functions =
            domain.predicates.iter().filter(|declaration| names.contains(&declaration.identifier.name));
        let functions =
            functions.map(|declaration| (declaration.identifier.name.clone(), declaration.clone())).collect();
        let mut objects = Self { functions, ..Self::default() };
        objects.set_types(domain);
        objects
    }

    pub(super) fn set_types(&mut self, domain: &Domain) {
        self.types = TypeHierarchy::of(domain).names().cloned().collect();
    }

    pub(super) fn contains(&self, name: &Name) -> bool {
        self.functions.contains_key(name)
    }

    pub(super) fn time(&self) -> EffectTime {
        self.time.unwrap_or(EffectTime::AtStart)
    }
}

#[derive(Clone)]
pub(super) struct Assigned {
    pub(super) time: EffectTime,
    pub(super) function: Identifier,
    pub(super) arguments: Vec<Term>,
    /// Assigned value; `None` for `undefined`.
    pub(super) value: Option<Term>,
    pub(super) variables: Vec<TypedName>,
    /// Generated variables for the values of object-fluent terms within the assignment.
    pub(super) values: Vec<TypedName>,
    /// Conditions of the enclosing `when` effects, and the atoms that bind `values`.
    pub(super) conditions: Vec<Condition>,
}
