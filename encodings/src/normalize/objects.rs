//! Objects and types: which objects a parameter or a quantified variable of some type ranges over.

use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::lifted::ObjectId;
use crate::normalize::Normalizer;
use crate::number::dense;
use pddl::ast::{self, Identifier, Name, Span, TypeExpression};

impl Normalizer {
    #[expect(clippy::arithmetic_side_effects, reason = "an object was pushed before")]
    pub(super) fn declare_objects(&mut self, domain: &ast::Domain, problem: &ast::Problem) {
        let mut parents: FxHashMap<Name, Vec<Name>> = FxHashMap::default();
        for entry in &domain.types {
            let above = entry.r#type.alternatives.iter().map(|parent| parent.name.clone());
            parents.entry(entry.identifier.name.clone()).or_default().extend(above);
        }
        for entry in domain.constants.iter().chain(&problem.objects) {
            let name = &entry.identifier.name;
            let id = *self.object_ids.entry(name.clone()).or_insert_with(|| {
                self.objects.push(name.clone());
                ObjectId(dense(self.objects.len()) - 1)
            });
            let mut open: Vec<Name> = entry.r#type.alternatives.iter().map(|t| t.name.clone()).collect();
            open.push(Name::new("object"));
            let mut seen = FxHashSet::default();
            while let Some(name) = open.pop() {
                if seen.insert(name.clone()) {
                    open.extend(parents.get(&name).into_iter().flatten().cloned());
                    self.members.entry(name).or_default().push(id);
                }
            }
        }
        for members in self.members.values_mut() {
            members.sort_unstable();
            members.dedup();
        }
    }

    pub(super) fn candidates(&self, expression: &TypeExpression) -> Arc<[ObjectId]> {
        let object = Identifier { name: Name::new("object"), span: Span::default() };
        let alternatives = if expression.alternatives.is_empty() {
            std::slice::from_ref(&object)
        } else {
            &expression.alternatives
        };
        let mut all: Vec<_> =
            alternatives.iter().filter_map(|t| self.members.get(&t.name)).flatten().copied().collect();
        all.sort_unstable();
        all.dedup();
        all.into()
    }
}
