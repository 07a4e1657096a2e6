//! Replaces references to named properties, as in `1 - "hit"`, by their definitions.

use std::borrow::Cow;

use crate::check::state::BUILT_IN;
use crate::error::{Diagnostic, Error, Place};
use crate::prism::ast::{Expr, ExprKind, Model, Path, Property, RewardPath};
use crate::property::Declarations;

const MAX_REFERENCES: usize = 1000;

/// Returns the property with each reference to a named property replaced by its definition.
///
/// # Errors
/// A circular reference, a reference to an unsupported property, or more than [`MAX_REFERENCES`] references.
pub fn expand_references<'p>(
    property: &'p Property,
    model: &Model,
    declarations: &Declarations,
) -> Result<Cow<'p, Property>, Error> {
    if declarations.properties.is_empty() {
        return Ok(Cow::Borrowed(property));
    }
    let mut expansion =
        Expansion { model, declarations, within: Vec::new(), expanded_count: 0, problem: None };
    let expanded = expansion.property(property);
    expansion.problem.map_or(Ok(Cow::Owned(expanded)), |problem| Err(Error::Property(problem.into())))
}

struct Expansion<'a> {
    model: &'a Model,
    declarations: &'a Declarations,
    /// The names of the properties whose definitions are being expanded, outermost first.
    within: Vec<String>,
    expanded_count: usize,
    problem: Option<Diagnostic>,
}

impl Expansion<'_> {
    fn property(&mut self, property: &Property) -> Property {
        match property {
            Property::Probability(question, path) => Property::Probability(question.clone(), self.path(path)),
            Property::Reward(question, name, RewardPath::Reach(goal)) => {
                let goal = self.expression(goal);
                Property::Reward(question.clone(), name.clone(), RewardPath::Reach(goal))
            }
            Property::Reward(..) | Property::Refused(_) => property.clone(),
            Property::SteadyState(question, states) => {
                Property::SteadyState(question.clone(), self.expression(states))
            }
            Property::Multi(parts) => Property::Multi(parts.iter().map(|part| self.property(part)).collect()),
            Property::Filter(filter, inner, states) => {
                let inner = self.expression(inner);
                Property::Filter(*filter, inner, states.as_ref().map(|states| self.expression(states)))
            }
            Property::Expression(inner) => match self.expression(inner) {
                Expr { kind: ExprKind::Property(property), .. } => *property,
                inner => Property::Expression(inner),
            },
        }
    }

    fn path(&mut self, path: &Path) -> Path {
        match path {
            Path::State(goal) => Path::State(self.expression(goal)),
            Path::Not(inner) => Path::Not(Box::new(self.path(inner))),
            Path::Next(goal) => Path::Next(self.expression(goal)),
            Path::Until(left, right, steps) => {
                Path::Until(self.expression(left), self.expression(right), steps.clone())
            }
            Path::Globally(goal, steps) => Path::Globally(self.expression(goal), steps.clone()),
            Path::WeakUntil(left, right, steps) => {
                Path::WeakUntil(self.expression(left), self.expression(right), steps.clone())
            }
            Path::Release(left, right, steps) => {
                Path::Release(self.expression(left), self.expression(right), steps.clone())
            }
            Path::Repeatedly(goal) => Path::Repeatedly(self.expression(goal)),
            Path::Persistently(goal) => Path::Persistently(self.expression(goal)),
        }
    }

    fn expression(&mut self, expression: &Expr) -> Expr {
        expression.rewrite(&mut |part| {
            let kind = match &part.kind {
                ExprKind::Property(inner) => ExprKind::Property(Box::new(self.property(inner))),
                ExprKind::Label(name) => self.named(name, part.place)?,
                _ => return None,
            };
            Some(Expr { kind, place: part.place })
        })
    }

    /// Returns the expanded definition of a named property. Returns `None` if the name is a label
    /// or unknown, or if an error was recorded.
    fn named(&mut self, name: &str, place: Place) -> Option<ExprKind> {
        let is_label = BUILT_IN.contains(&name) || self.model.labels.iter().any(|label| label.name == name);
        if is_label || self.problem.is_some() {
            return None;
        }
        let declarations = self.declarations;
        let (_, property) = declarations.properties.iter().find(|(candidate, _)| candidate == name)?;
        if let Property::Refused(problem) = property {
            self.problem = Some(problem.clone());
            return None;
        }
        if self.within.iter().any(|open| open == name) {
            let text = format!("the property `\"{name}\"` contains itself");
            self.problem = Some(Diagnostic::new("Q204", place, text));
            return None;
        }
        self.expanded_count = self.expanded_count.saturating_add(1);
        if self.expanded_count > MAX_REFERENCES {
            let text = format!("more than {MAX_REFERENCES} parts that are properties with names");
            self.problem = Some(Diagnostic::new("Q104", place, text));
            return None;
        }
        self.within.push(name.to_owned());
        let property = self.property(property);
        self.within.pop();
        Some(match property {
            Property::Expression(inner) => inner.kind,
            property => ExprKind::Property(Box::new(property)),
        })
    }
}
