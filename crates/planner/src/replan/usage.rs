//! Usage of the symbols of a domain: read by conditions, changed by effects, or required to be available.
//!
//! The analysis is syntactic: a symbol that is read somewhere counts as read everywhere.

use rustc_hash::FxHashSet;

use pddl::ast::{Atom, Condition, Domain, Effect, Expression, Name, Problem, Term};
use pddl::visit::Node;

/// What symbols are used for.
#[derive(Debug, Default)]
pub(super) struct Usage {
    /// Predicates that conditions of actions and effects, axioms, or quantifiers of the goal read.
    read: FxHashSet<Name>,
    /// Atoms of the goal, as keys.
    goal: FxHashSet<String>,
    /// Predicates and functions that effects or axioms change.
    changed: FxHashSet<Name>,
    /// Functions that conditions, durations and effects read.
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

    /// Whether effects or axioms change a predicate or function.
    pub(super) fn is_changed(&self, name: &Name) -> bool {
        self.changed.contains(name)
    }

    /// Whether anything asks for an atom.
    pub(super) fn is_read(&self, predicate: &Name, key: &str) -> bool {
        self.read.contains(predicate) || self.goal.contains(key)
    }

    /// Whether anything but the metric asks for a function.
    pub(super) fn is_function_read(&self, function: &Name) -> bool {
        self.functions.contains(function)
    }

    /// `is_ground`: of atoms without variables only these very atoms are read.
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

/// An atom as text, however it is spelt: `(robot_at wp1)`.
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

/// The name of a variable or constant.
pub(super) fn identifier(term: &Term) -> &Name {
    match term {
        Term::Variable(identifier) | Term::Constant(identifier) => &identifier.name,
    }
}

/// For each action the parameters that must be available, by position, each with the predicate that says so, by position
/// among `predicates`. None if one of the predicates is used otherwise: then a task in which more is available has
/// not all operators of one in which less is.
#[expect(clippy::arithmetic_side_effects, reason = "occurrences in a text in memory")]
pub(super) fn requirements(domain: &Domain, predicates: &[Name]) -> Option<Vec<Vec<(usize, usize)>>> {
    let mut found = Vec::new();
    let mut mentions = 0;
    for action in &domain.actions {
        let mut own = Vec::new();
        for atom in action.body.conditions().flat_map(conjuncts) {
            let Some(predicate) = predicates.iter().position(|name| *name == atom.predicate.name) else {
                continue;
            };
            let [Term::Variable(variable)] = atom.arguments.as_slice() else { return None };
            let is_own = |parameter: &pddl::ast::TypedName| parameter.identifier.name == variable.name;
            own.push((action.parameters.iter().position(is_own)?, predicate));
            mentions += 1;
        }
        found.push(own);
    }
    let all: usize = predicates.iter().map(|predicate| occurrences(domain, predicate)).sum();
    (all == mentions).then_some(found)
}

/// The atoms of a conjunction.
fn conjuncts(condition: &Condition) -> Vec<&Atom> {
    match condition {
        Condition::And(parts) => parts.iter().flat_map(conjuncts).collect(),
        Condition::Atom(atom) => vec![atom],
        _ => Vec::new(),
    }
}

/// How often conditions and effects of a domain mention a predicate.
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

/// How often a condition mentions a predicate.
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
