//! Type hierarchy of a domain.

use rustc_hash::{FxHashMap, FxHashSet};

use super::ast::{Domain, Name, TypeExpression};

/// Types of a domain with their supertypes. A type that occurs only as a supertype counts as declared.
/// `object` is the root.
#[derive(Debug)]
pub struct TypeHierarchy {
    index: FxHashMap<Name, usize>,
    parents: Vec<Vec<usize>>,
    children: Vec<Vec<usize>>,
}

impl TypeHierarchy {
    /// Builds the hierarchy of a domain's types.
    pub fn of(domain: &Domain) -> Self {
        let mut hierarchy = Self { index: FxHashMap::default(), parents: Vec::new(), children: Vec::new() };
        hierarchy.insert(&Name::new("object"));
        for entry in &domain.types {
            let child = hierarchy.insert(&entry.identifier.name);
            for parent in &entry.r#type.alternatives {
                let parent = hierarchy.insert(&parent.name);
                hierarchy.parents[child].push(parent);
                hierarchy.children[parent].push(child);
            }
        }
        hierarchy
    }

    #[expect(clippy::arithmetic_side_effects, reason = "a type was pushed before")]
    fn insert(&mut self, name: &Name) -> usize {
        if let Some(index) = self.index.get(name) {
            return *index;
        }
        self.index.insert(name.clone(), self.parents.len());
        self.parents.push(Vec::new());
        self.children.push(Vec::new());
        self.parents.len() - 1
    }

    /// Returns `true` if the type is declared or occurs as a supertype of a declared type.
    pub fn contains(&self, name: &Name) -> bool {
        self.index.contains_key(name)
    }

    pub(crate) fn names(&self) -> impl Iterator<Item = &Name> {
        self.index.keys()
    }

    /// Returns `true` if `lower` is a subtype of `upper` or equal to it. An undeclared `upper` counts as
    /// `object`; an undeclared `lower` is a subtype of `object` only.
    pub(crate) fn is_a(&self, lower: &Name, upper: &Name) -> bool {
        let Some(upper) = self.index.get(upper) else { return true };
        // `object` has index 0.
        if *upper == 0 {
            return true;
        }
        self.index.get(lower).is_some_and(|lower| self.reaches(*lower, *upper))
    }

    fn reaches(&self, lower: usize, upper: usize) -> bool {
        lower == upper || closure(&self.parents, lower).contains(&upper)
    }

    /// Returns `true` if an object of type `subtype` is also of type `supertype`. With `either`, one matching
    /// pair of alternatives suffices.
    pub fn fits(&self, subtype: &TypeExpression, supertype: &TypeExpression) -> bool {
        let is_subtype =
            |lower: &Name| supertype.alternatives.iter().any(|upper| self.is_a(lower, &upper.name));
        // Every object is of type `object`, even one without a type.
        let is_root = |upper: &Name| self.index.get(upper) == Some(&0);
        // An object declared with `either` counts as an object of each alternative.
        supertype.alternatives.is_empty()
            || supertype.alternatives.iter().any(|upper| is_root(&upper.name))
            || subtype.alternatives.iter().any(|lower| is_subtype(&lower.name))
    }

    /// Returns `true` if the check of a problem allows an object of type `object` as an argument of a parameter of type
    /// `parameter`. An object without a type, or with an undeclared one, is allowed.
    pub fn admits(&self, object: &TypeExpression, parameter: &TypeExpression) -> bool {
        let mut types = object.alternatives.iter().map(|alternative| self.index.get(&alternative.name));
        self.fits(object, parameter)
            || types.clone().all(|index| index == Some(&0))
            || types.any(|index| index.is_none())
    }

    /// Returns `true` if some object can be of both types: an alternative of one is a subtype of an
    /// alternative of the other, or two alternatives have a common subtype. An undeclared type
    /// overlaps with every type.
    pub(crate) fn overlap(&self, left: &TypeExpression, right: &TypeExpression) -> bool {
        let common = |left: &Name, right: &Name| {
            self.is_a(left, right) || self.is_a(right, left) || self.have_common_subtype(left, right)
        };
        left.alternatives.is_empty()
            || right.alternatives.is_empty()
            || left
                .alternatives
                .iter()
                .any(|left| right.alternatives.iter().any(|right| common(&left.name, &right.name)))
    }

    fn have_common_subtype(&self, left: &Name, right: &Name) -> bool {
        let (Some(left), Some(right)) = (self.index.get(left), self.index.get(right)) else { return true };
        !closure(&self.children, *left).is_disjoint(&closure(&self.children, *right))
    }

    /// Returns `true` if a type is its own supertype through at least one other type. A supertype of `object`, to which
    /// every object belongs, would be one of its subtypes, too.
    pub(crate) fn is_cyclic(&self, name: &Name) -> bool {
        let Some(index) = self.index.get(name) else { return false };
        let mut supertypes = self.parents[*index].iter().filter(|parent| *parent != index);
        supertypes.any(|parent| *index == 0 || self.reaches(*parent, *index))
    }
}

fn closure(links: &[Vec<usize>], from: usize) -> FxHashSet<usize> {
    let (mut reached, mut open) = (FxHashSet::from_iter([from]), vec![from]);
    while let Some(at) = open.pop() {
        open.extend(links[at].iter().filter(|next| reached.insert(**next)));
    }
    reached
}
