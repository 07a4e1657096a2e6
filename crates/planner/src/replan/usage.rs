//! Usage of the symbols of a domain and problem: which symbols conditions read, which symbols effects change,
//! and which parameters need available objects.
//!
//! The analysis is syntactic: if a symbol is read anywhere but in the metric, it counts as read for all
//! arguments. Only predicates in the goal are treated more precisely: outside quantifiers, just the atoms
//! that the goal mentions count as read.

use rustc_hash::FxHashSet;

use pddl::ast::{
    Action, ActionBody, Atom, Condition, ConditionTime, Domain, Effect, Expression, Name, Problem, Term,
};
use pddl::visit::Node;

#[derive(Debug, Default)]
pub(super) struct Usage {
    /// Predicates that are read by conditions of actions and effects, by axioms, or by quantified parts of the
    /// goal.
    read: FxHashSet<Name>,
    /// Keys (see [`key`]) of the atoms that the goal contains outside quantifiers.
    goal: FxHashSet<String>,
    changed: FxHashSet<Name>,
    /// Functions that conditions (including the goal), durations or effects read.
    functions: FxHashSet<Name>,
}

impl Usage {
    pub(super) fn of(domain: &Domain, problem: &Problem) -> Self {
        let mut usage = Self::default();
        for action in &domain.actions {
            action.body.walk(&mut |node| usage.node(node));
        }
        for derived in &domain.derived {
            usage.changed.insert(derived.head.identifier.name.clone());
            usage.condition(&derived.condition, false);
        }
        usage.condition(&problem.goal, true);
        usage
    }

    pub(super) fn is_changed(&self, name: &Name) -> bool {
        self.changed.contains(name)
    }

    pub(super) fn is_read(&self, predicate: &Name, key: &str) -> bool {
        self.read.contains(predicate) || self.goal.contains(key)
    }

    pub(super) fn is_function_read(&self, function: &Name) -> bool {
        self.functions.contains(function)
    }

    /// Collects the symbols that a condition reads. If `is_ground`, an atom outside quantifiers is collected
    /// as an atom; otherwise its whole predicate counts as read.
    fn condition(&mut self, condition: &Condition, is_ground: bool) {
        match condition {
            Condition::Exists(_, part) | Condition::ForAll(_, part) => self.condition(part, false),
            Condition::Atom(atom) if is_ground => {
                self.goal.insert(key(atom));
            }
            Condition::Atom(_) | Condition::Compare(..) => condition.walk(&mut |node| self.node(node)),
            other => other.parts().for_each(|part| self.condition(part, is_ground)),
        }
    }

    fn node(&mut self, node: Node<'_>) {
        match node {
            Node::Condition(Condition::Atom(atom)) => {
                self.read.insert(atom.predicate.name.clone());
            }
            Node::Effect(Effect::Add(atom) | Effect::Delete(atom) | Effect::Assign(_, atom, ..)) => {
                self.changed.insert(atom.predicate.name.clone());
            }
            Node::Expression(Expression::Fluent(atom)) => {
                self.functions.insert(atom.predicate.name.clone());
            }
            _ => {}
        }
    }
}

/// Returns the canonical text of an atom in lower case, such as `(robot_at wp1)`.
pub(super) fn key(atom: &Atom) -> String {
    let mut text = String::with_capacity(32);
    text.push('(');
    text.push_str(atom.predicate.name.as_str());
    for term in &atom.arguments {
        text.push(' ');
        text.push_str(identifier(term).as_str());
    }
    text.push(')');
    text.make_ascii_lowercase();
    text
}

pub(super) fn identifier(term: &Term) -> &Name {
    match term {
        Term::Variable(identifier) | Term::Constant(identifier) => &identifier.name,
    }
}

/// Returns, for each action, the parameters (by index) whose objects must be available, each with the index of
/// the predicate that states availability. Returns `None` if one of the predicates is used in another way,
/// because more availability might then exclude operators.
#[expect(clippy::arithmetic_side_effects, reason = "occurrences in a text in memory")]
pub(super) fn requirements(domain: &Domain, predicates: &[Name]) -> Option<Vec<Vec<(usize, usize)>>> {
    let mut requirements = Vec::new();
    let mut mentions = 0;
    for action in &domain.actions {
        let mut parameters = Vec::new();
        for atom in action.body.conditions().flat_map(conjuncts) {
            let Some(predicate) = predicates.iter().position(|name| *name == atom.predicate.name) else {
                continue;
            };
            let [Term::Variable(variable)] = atom.arguments.as_slice() else { return None };
            let is_variable = |parameter: &pddl::ast::TypedName| parameter.identifier.name == variable.name;
            parameters.push((action.parameters.iter().position(is_variable)?, predicate));
            mentions += 1;
        }
        requirements.push(parameters);
    }
    let total: usize = predicates.iter().map(|predicate| occurrences(domain, predicate)).sum();
    (total == mentions).then_some(requirements)
}

/// Returns, for each action, `true` if it requires some available object only in conditions over all. If the duration
/// is 0, these conditions do not apply.
pub(super) fn only_over_all(domain: &Domain, predicates: &[Name]) -> Vec<bool> {
    let of = |action: &Action| {
        let ActionBody::Durative { conditions, .. } = &action.body else { return false };
        let keys = |over_all: bool| -> FxHashSet<String> {
            let timed = conditions.iter().filter(|(time, _)| (*time == ConditionTime::OverAll) == over_all);
            let atoms = timed.flat_map(|(_, condition)| conjuncts(condition));
            atoms.filter(|atom| predicates.contains(&atom.predicate.name)).map(key).collect()
        };
        !keys(true).is_subset(&keys(false))
    };
    domain.actions.iter().map(of).collect()
}

fn conjuncts(condition: &Condition) -> Vec<&Atom> {
    match condition {
        Condition::And(parts) => parts.iter().flat_map(conjuncts).collect(),
        Condition::Atom(atom) => vec![atom],
        _ => Vec::new(),
    }
}

fn occurrences(domain: &Domain, predicate: &Name) -> usize {
    let mut count = Count { predicate, mentions: 0 };
    for action in &domain.actions {
        action.body.walk(&mut |node| count.node(node));
    }
    for derived in &domain.derived {
        count.add(&derived.head.identifier.name);
        derived.condition.walk(&mut |node| count.node(node));
    }
    count.mentions
}

pub(super) fn in_condition(condition: &Condition, predicate: &Name) -> usize {
    let mut count = Count { predicate, mentions: 0 };
    condition.walk(&mut |node| count.node(node));
    count.mentions
}

struct Count<'n> {
    predicate: &'n Name,
    mentions: usize,
}

impl Count<'_> {
    #[expect(clippy::arithmetic_side_effects, reason = "occurrences in a text in memory")]
    fn add(&mut self, name: &Name) {
        self.mentions += usize::from(name == self.predicate);
    }

    fn node(&mut self, node: Node<'_>) {
        if let Node::Condition(Condition::Atom(atom))
        | Node::Effect(Effect::Add(atom) | Effect::Delete(atom)) = node
        {
            self.add(&atom.predicate.name);
        }
    }
}
