//! Parser state for object fluents (functions with objects as values).

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ast::{Atom, Condition, Declaration, Domain, EffectTime, Identifier, Name, Span, Term, TypedName};
use crate::types::TypeHierarchy;

/// Declared object fluents, and those that occur in the part that is being read.
#[derive(Default)]
pub(super) struct Objects {
    /// Predicates that represent object fluents.
    pub(super) functions: FxHashMap<Name, Declaration>,
    /// Declared types.
    pub(super) types: FxHashSet<Name>,
    /// Common prefix of new variables, once there is one.
    pub(super) prefix: Option<String>,
    /// Number of new variables.
    pub(super) count: usize,
    /// Whether the current context allows terms with object fluents.
    pub(super) is_open: bool,
    /// Terms of the condition or effect that is being read.
    pub(super) values: Vec<Value>,
    /// Time of the effect that is being read; `None` in an instantaneous action.
    pub(super) time: Option<EffectTime>,
    /// Requirements of the current action's effects on the state.
    pub(super) needs: Vec<(EffectTime, Condition)>,
    /// Assignments to object fluents by the current action.
    pub(super) assigned: Vec<Assigned>,
    /// Values in `:init`; `None` for `undefined`.
    pub(super) initial: FxHashMap<(Name, Vec<Name>), (Option<Name>, Span)>,
}

/// Variable for the value of a term, and the atom that binds it.
pub(super) struct Value {
    pub(super) variable: TypedName,
    pub(super) atom: Atom,
}

/// Position in `needs` and `assigned`: later entries belong to the effects read since.
#[derive(Clone, Copy)]
pub(super) struct Mark {
    pub(super) needs: usize,
    pub(super) assigned: usize,
}

impl Objects {
    /// Collects the object fluents of a domain.
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

/// Assignment to an object fluent.
#[derive(Clone)]
pub(super) struct Assigned {
    pub(super) time: EffectTime,
    pub(super) function: Identifier,
    pub(super) arguments: Vec<Term>,
    /// `None` for `undefined`.
    pub(super) value: Option<Term>,
    /// Variables of the enclosing quantifiers.
    pub(super) variables: Vec<TypedName>,
    /// Variables for the values of terms.
    pub(super) values: Vec<TypedName>,
    /// Conditions of the enclosing `when` effects.
    pub(super) conditions: Vec<Condition>,
}
