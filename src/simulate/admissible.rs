//! Designs with which an action can be executed now, for strategies that choose the design of each
//! function separately.
//!
//! A design is *admissible* for a function of an action if it is available and the action can be executed with it now,
//! i.e. all conditions of the action hold. These conditions include the quality bounds of the action in the current
//! context (`t:requiresQuality`) and a sufficient battery level. A condition that mentions the design of another
//! function is omitted until that design is chosen.

use std::borrow::Cow;

use pddl::ast::{Action, ActionBody, Atom, Condition, Domain, Name, Problem, Term};
use pddl::validate::advance;
use pddl::visit::Node;

use crate::mapek::{PlannedStep, Remainder, resume};

/// The conditions of an action that can be checked although some of its designs are not chosen yet.
pub(super) struct Admission<'p> {
    domain: Domain,
    problem: Cow<'p, Problem>,
}

impl<'p> Admission<'p> {
    /// Collects the conditions of a step. `remainder` describes the action under way, if the step is
    /// running. The functions in `undecided` have no chosen design yet, so conditions that mention
    /// their designs are omitted.
    pub(super) fn new(
        domain: &Domain,
        problem: &'p Problem,
        step: &PlannedStep,
        remainder: Option<Remainder<'_>>,
        undecided: &[&str],
    ) -> Self {
        let problem = Cow::Borrowed(problem);
        let (mut domain, problem) = match remainder {
            Some(remainder) => resume(domain, problem, &Remainder { step, ..remainder }),
            None => (domain.clone(), problem),
        };
        let is_undecided =
            |word: &String| undecided.iter().any(|function| step.design(function) == Some(word.as_str()));
        let name = Name::new(&step.action);
        for action in domain.actions.iter_mut().filter(|action| action.identifier.name == name) {
            if action.parameters.len() == step.arguments.len() {
                let open = action.parameters.iter().zip(&step.arguments);
                let open: Vec<Name> = open
                    .filter(|(_, argument)| is_undecided(argument))
                    .map(|(parameter, _)| parameter.identifier.name.clone())
                    .collect();
                leave_open(action, &open);
            }
        }
        Self { domain, problem }
    }

    pub(super) fn admits(&self, step: &PlannedStep) -> bool {
        advance(&self.domain, &self.problem, &step.to_plan_step(), false).is_ok()
    }
}

fn leave_open(action: &mut Action, open: &[Name]) {
    match &mut action.body {
        ActionBody::Instantaneous { precondition, .. } => drop_open(precondition, open),
        ActionBody::Durative { conditions, .. } => {
            for (_, condition) in conditions {
                drop_open(condition, open);
            }
        }
    }
}

fn drop_open(condition: &mut Condition, open: &[Name]) {
    match condition {
        Condition::And(parts) => parts.iter_mut().for_each(|part| drop_open(part, open)),
        other if mentions(other, open) => *other = Condition::And(Vec::new()),
        _ => {}
    }
}

fn mentions(condition: &Condition, names: &[Name]) -> bool {
    let mut is_mentioned = false;
    condition.walk(&mut |node| {
        is_mentioned |= match node {
            Node::Condition(Condition::Equal(left, right, _)) => {
                [left, right].into_iter().any(|term| is_one_of(term, names))
            }
            node => node.atom().or_else(|| node.fluent()).is_some_and(|atom| is_about(atom, names)),
        };
    });
    is_mentioned
}

fn is_about(atom: &Atom, names: &[Name]) -> bool {
    atom.arguments.iter().any(|term| is_one_of(term, names))
}

fn is_one_of(term: &Term, names: &[Name]) -> bool {
    matches!(term, Term::Variable(variable) if names.contains(&variable.name))
}
