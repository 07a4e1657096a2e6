//! Reduces a problem to the facts and values that given actions can read.
//!
//! Executing an action interns and indexes the whole initial state. If no condition or effect is quantified
//! over objects, an action reads only atoms about its own arguments and the constants of the domain. On a map
//! with 100 arcs and 18 designs, for example, an action reads one value in a thousand.

use std::collections::BTreeSet;

use rustc_hash::FxHashSet;

use crate::ast::{Action, Atom, Condition, Domain, Effect, InitialElement, Name, Problem, Term};
use crate::mentioned::Mentioned;
use crate::visit::Node;

use super::plan::PlanStep;

/// Returns the problem without facts and values that neither the steps nor the metric nor `goal` can read. Some
/// unread ones may remain. Returns `None` if the readable facts cannot be determined, for example with axioms,
/// constraints or quantifiers.
pub(super) fn relevant(
    domain: &Domain,
    problem: &Problem,
    steps: &[PlanStep],
    goal: Option<&Condition>,
) -> Option<Problem> {
    let names: FxHashSet<&Name> = steps.iter().map(|step| &step.action).collect();
    let schemas = || domain.actions.iter().filter(|action| names.contains(&action.identifier.name));
    if reads_all_facts(domain, problem) || schemas().any(reads_all_objects) {
        return None;
    }
    let mut metric = Vec::new();
    if let Some(objective) = &problem.metric {
        objective.expression.walk_fluents(&mut |atom| metric.push(atom));
    }
    let metric_functions: FxHashSet<&Name> = metric.iter().map(|atom| &atom.predicate.name).collect();
    if metric_functions.iter().any(|name| name.as_str() == "is-violated") {
        return None;
    }
    let mut read = Vec::new();
    schemas().for_each(|action| fluents_of(action, &mut read));
    let mut is_quantified = false;
    if let Some(goal) = goal {
        goal.walk(&mut |node| {
            is_quantified |= matches!(node, Node::Condition(Condition::Exists(..) | Condition::ForAll(..)));
            read.extend(node.fluent().or_else(|| node.atom()));
        });
    }
    if is_quantified {
        return None;
    }
    let mentioned = Mentioned::by_domain(domain).objects;
    let arguments = steps.iter().flat_map(|step| &step.arguments).chain(&mentioned);
    let terms = read.iter().flat_map(|atom| &atom.arguments);
    let constants = terms.map(Term::name);
    let objects: FxHashSet<&Name> = arguments.chain(constants).collect();
    let is_named = |atom: &Atom| atom.arguments.iter().all(|term| objects.contains(term.name()));
    let is_relevant = |element: &&InitialElement| match element {
        InitialElement::Timed(..) => true,
        InitialElement::Value(atom, ..) => is_named(atom) || metric_functions.contains(&atom.predicate.name),
        // An assignment to an object fluent reads its previous value.
        InitialElement::Fact(atom) | InitialElement::NegatedFact(atom) => {
            is_named(atom) || domain.object_fluents.contains(&atom.predicate.name)
        }
    };
    Some(Problem {
        name: problem.name.clone(),
        domain: problem.domain.clone(),
        requirements: problem.requirements.clone(),
        objects: problem.objects.clone(),
        init: problem.init.iter().filter(is_relevant).cloned().collect(),
        goal: problem.goal.clone(),
        constraints: Vec::new(),
        metric: problem.metric.clone(),
    })
}

/// Returns `true` if executing a step may read facts about one of `objects`. Never returns `false` if it reads one, but
/// may return `true` if it reads none.
pub fn may_read(domain: &Domain, problem: &Problem, step: &PlanStep, objects: &BTreeSet<Name>) -> bool {
    let mentions = |action: &Action| {
        let mut is_mentioned = false;
        action.body.walk(&mut |node| {
            let mut terms = node.atom().into_iter().flat_map(|atom| &atom.arguments);
            is_mentioned |= terms.any(|term| objects.contains(term.name()));
        });
        is_mentioned
    };
    let mut schemas = domain.actions.iter().filter(|action| action.identifier.name == step.action);
    reads_all_facts(domain, problem)
        || step.arguments.iter().any(|argument| objects.contains(argument))
        || schemas.any(|action| reads_all_objects(action) || mentions(action))
}

/// Returns `true` if there are axioms or constraints, which can read every fact.
fn reads_all_facts(domain: &Domain, problem: &Problem) -> bool {
    !domain.derived.is_empty() || !domain.constraints.is_empty() || !problem.constraints.is_empty()
}

/// Returns `true` if the action contains a quantifier or a preference, and so may read facts about any
/// object.
fn reads_all_objects(action: &Action) -> bool {
    let mut is_quantified = false;
    action.body.walk(&mut |node| {
        is_quantified |= matches!(
            node,
            Node::Condition(Condition::Exists(..) | Condition::ForAll(..)) | Node::Effect(Effect::ForAll(..))
        );
    });
    is_quantified || !action.preferences.is_empty()
}

fn fluents_of<'a>(action: &'a Action, fluents: &mut Vec<&'a Atom>) {
    action.body.walk(&mut |node| match node {
        Node::Effect(Effect::Assign(_, target, ..)) => fluents.push(target),
        node => fluents.extend(node.fluent()),
    });
}
