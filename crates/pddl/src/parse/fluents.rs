//! What the parser keeps of functions with objects as values while it reads.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ast::{Atom, Condition, Declaration, Domain, EffectTime, Identifier, Name, Span, Term, TypedName};
use crate::types::TypeHierarchy;

/// What the parser knows of functions with objects as values, and what it has met of them in the part that it reads.
#[derive(Default)]
pub(super) struct Objects {
    /// The predicates that stand for them.
    pub(super) functions: FxHashMap<Name, Declaration>,
    /// The declared types.
    pub(super) types: FxHashSet<Name>,
    /// What new variables begin with, once there is one, and how many there are.
    pub(super) prefix: Option<String>,
    pub(super) count: usize,
    /// Whether terms can stand where the parser is.
    pub(super) is_open: bool,
    /// The terms of the condition or effect that is being read.
    pub(super) values: Vec<Value>,
    /// The time of the effect that is being read; none in an instantaneous action.
    pub(super) time: Option<EffectTime>,
    /// What the effects of the action that is being read ask of the state.
    pub(super) needs: Vec<(EffectTime, Condition)>,
    pub(super) assigned: Vec<Assigned>,
    /// The values in `:init`: none for `undefined`.
    pub(super) initial: FxHashMap<(Name, Vec<Name>), (Option<Name>, Span)>,
}

/// A variable for the value of a term, and the atom that says so.
pub(super) struct Value {
    pub(super) variable: TypedName,
    pub(super) atom: Atom,
}

/// A place among what effects ask of the state.
#[derive(Clone, Copy)]
pub(super) struct Mark {
    pub(super) needs: usize,
    pub(super) assigned: usize,
}

impl Objects {
    /// Those of a domain that was read.
    pub(super) fn of(domain: &Domain) -> Self {
        let known: FxHashSet<&Name> = domain.object_fluents.iter().collect();
        let functions = domain.predicates.iter().filter(|own| known.contains(&own.identifier.name));
        let functions = functions.map(|own| (own.identifier.name.clone(), own.clone())).collect();
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

/// An assignment to a function with objects as values.
#[derive(Clone)]
pub(super) struct Assigned {
    pub(super) time: EffectTime,
    pub(super) function: Identifier,
    pub(super) arguments: Vec<Term>,
    /// None for `undefined`.
    pub(super) value: Option<Term>,
    /// The variables of the quantifiers that it stands below.
    pub(super) variables: Vec<TypedName>,
    /// The variables that stand for values of terms.
    pub(super) values: Vec<TypedName>,
    /// When it takes place.
    pub(super) conditions: Vec<Condition>,
}
