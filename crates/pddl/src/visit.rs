//! Traversal of the syntax tree: the parts of a node, and a walk over all nodes below it, parents first.
//!
//! A function that treats most kinds of nodes alike matches the special kinds and recurses into `parts` for the others.

use std::slice::{from_mut, from_ref};

use num_rational::BigRational;
use num_traits::Zero as _;

use crate::ast::{
    ActionBody, Atom, Condition, Constraint, Domain, DurationConstraint, Effect, Expression, InitialElement,
    Name, Preference, Problem, Trajectory,
};

/// A node of the syntax tree.
#[derive(Debug, Clone, Copy)]
pub enum Node<'t> {
    /// A condition.
    Condition(&'t Condition),
    /// An effect.
    Effect(&'t Effect),
    /// A numeric expression.
    Expression(&'t Expression),
    /// A constraint on the duration of an action.
    Duration(&'t DurationConstraint),
    /// A constraint on the trajectory.
    Constraint(&'t Constraint),
    /// A preference among the conditions of an action.
    Preference(&'t Preference),
}

/// Callback that receives each node of a walk.
pub type Visit<'v, 't> = &'v mut dyn FnMut(Node<'t>);

impl Domain {
    /// Visits all conditions, effects, expressions, constraints and preferences of the domain. A parent
    /// precedes its children.
    pub fn walk<'t>(&'t self, visit: Visit<'_, 't>) {
        self.constraints.iter().for_each(|constraint| constraint.walk(visit));
        self.derived.iter().for_each(|derived| derived.condition.walk(visit));
        for action in &self.actions {
            for preference in &action.preferences {
                visit(Node::Preference(preference));
                preference.condition.walk(visit);
            }
            action.body.walk(visit);
        }
    }
}

impl Problem {
    /// Visits the goal, the constraints and the metric, with all nodes below them. The initial state is not
    /// visited.
    pub fn walk<'t>(&'t self, visit: Visit<'_, 't>) {
        self.goal.walk(visit);
        self.constraints.iter().for_each(|constraint| constraint.walk(visit));
        if let Some(metric) = &self.metric {
            metric.expression.walk(visit);
        }
    }

    /// Initial values of a function, for all arguments that have one. `total-cost` without a value is 0.
    #[must_use]
    pub fn initial_values(&self, function: &Name) -> Vec<BigRational> {
        let value_of = |element: &InitialElement| match element {
            InitialElement::Value(atom, value, _) => {
                (atom.predicate.name == *function).then(|| value.clone())
            }
            _ => None,
        };
        let values: Vec<_> = self.init.iter().filter_map(value_of).collect();
        if values.is_empty() && *function == Name::new("total-cost") {
            vec![BigRational::zero()]
        } else {
            values
        }
    }
}

impl ActionBody {
    /// Conditions of the action, regardless of their times.
    pub fn conditions(&self) -> impl Iterator<Item = &Condition> {
        let (single, timed) = match self {
            Self::Instantaneous { precondition, .. } => (Some(precondition), &[][..]),
            Self::Durative { conditions, .. } => (None, &conditions[..]),
        };
        single.into_iter().chain(timed.iter().map(|(_, condition)| condition))
    }

    /// Effects of the action, regardless of their times.
    pub fn effects(&self) -> impl Iterator<Item = &Effect> {
        let (single, timed) = match self {
            Self::Instantaneous { effect, .. } => (Some(effect), &[][..]),
            Self::Durative { effects, .. } => (None, &effects[..]),
        };
        single.into_iter().chain(timed.iter().map(|(_, effect)| effect))
    }

    /// Duration constraints; empty for instantaneous actions.
    pub fn durations(&self) -> &[DurationConstraint] {
        match self {
            Self::Instantaneous { .. } => &[],
            Self::Durative { duration, .. } => duration,
        }
    }

    /// Returns `true` if a lower bound of the duration is above 0. `is_positive` decides this for an expression. Returns
    /// `false` for instantaneous actions.
    pub fn has_positive_duration(&self, is_positive: impl Fn(&Expression) -> bool) -> bool {
        let mut durations = self.durations().iter();
        durations
            .any(|constraint| constraint.operator.is_lower_bound() && is_positive(&constraint.expression))
    }

    /// Visits the constraints on the duration, the conditions and the effects, in this order.
    pub fn walk<'t>(&'t self, visit: Visit<'_, 't>) {
        for constraint in self.durations() {
            visit(Node::Duration(constraint));
            constraint.expression.walk(visit);
        }
        self.conditions().for_each(|condition| condition.walk(visit));
        self.effects().for_each(|effect| effect.walk(visit));
    }
}

impl Constraint {
    /// Visits the constraint and all conditions of its trajectory.
    pub fn walk<'t>(&'t self, visit: Visit<'_, 't>) {
        visit(Node::Constraint(self));
        self.trajectory.walk(visit);
    }
}

impl Trajectory {
    /// Visits all conditions of a trajectory formula.
    pub fn walk<'t>(&'t self, visit: Visit<'_, 't>) {
        match self {
            Self::And(parts) => parts.iter().for_each(|part| part.walk(visit)),
            Self::ForAll(_, body) => body.walk(visit),
            Self::AtEnd(condition)
            | Self::Always(condition)
            | Self::Sometime(condition)
            | Self::AtMostOnce(condition)
            | Self::Within(_, condition)
            | Self::HoldDuring(_, _, condition)
            | Self::HoldAfter(_, condition) => condition.walk(visit),
            Self::SometimeAfter(first, second)
            | Self::SometimeBefore(first, second)
            | Self::AlwaysWithin(_, first, second) => {
                first.walk(visit);
                second.walk(visit);
            }
        }
    }
}

impl Condition {
    /// Returns `true` if the condition has an atom with a predicate for which `is_wanted` returns `true`.
    pub fn has_atom(&self, is_wanted: impl Fn(&Name) -> bool) -> bool {
        let mut has_atom = false;
        self.walk(&mut |node| {
            has_atom |= node.atom().is_some_and(|atom| is_wanted(&atom.predicate.name));
        });
        has_atom
    }

    /// Direct subconditions, from left to right.
    pub fn parts(&self) -> impl Iterator<Item = &Self> {
        let (first, second): (&[Self], &[Self]) = match self {
            Self::And(parts) | Self::Or(parts) => (parts, &[]),
            Self::Not(body) | Self::Exists(_, body) | Self::ForAll(_, body) => (from_ref(body), &[]),
            Self::Imply(premise, conclusion) => (from_ref(premise), from_ref(conclusion)),
            Self::Atom(_) | Self::Equal(..) | Self::Compare(..) => (&[], &[]),
        };
        first.iter().chain(second)
    }

    /// Mutable variant of [`Condition::parts`].
    pub fn parts_mut(&mut self) -> impl Iterator<Item = &mut Self> {
        let (first, second): (&mut [Self], &mut [Self]) = match self {
            Self::And(parts) | Self::Or(parts) => (parts, &mut []),
            Self::Not(body) | Self::Exists(_, body) | Self::ForAll(_, body) => (from_mut(body), &mut []),
            Self::Imply(premise, conclusion) => (from_mut(premise), from_mut(conclusion)),
            Self::Atom(_) | Self::Equal(..) | Self::Compare(..) => (&mut [], &mut []),
        };
        first.iter_mut().chain(second)
    }

    /// Visits the condition, all subconditions, and the numeric expressions in comparisons.
    pub fn walk<'t>(&'t self, visit: Visit<'_, 't>) {
        visit(Node::Condition(self));
        self.parts().for_each(|part| part.walk(visit));
        if let Self::Compare(_, left, right, _) = self {
            left.walk(visit);
            right.walk(visit);
        }
    }

    /// Visits the numeric functions in the comparisons of the condition.
    pub fn walk_fluents<'t>(&'t self, visit: &mut dyn FnMut(&'t Atom)) {
        self.walk(&mut |node| node.fluent().into_iter().for_each(&mut *visit));
    }

    /// Applies a change to every numeric leaf expression of the condition, that is, to each number, fluent,
    /// `?duration` and `total-time`.
    pub fn change_leaves(&mut self, change: &mut dyn FnMut(&mut Expression)) {
        self.parts_mut().for_each(|part| part.change_leaves(change));
        if let Self::Compare(_, left, right, _) = self {
            left.change_leaves(change);
            right.change_leaves(change);
        }
    }
}

impl Effect {
    /// Direct subeffects, from left to right.
    pub fn parts(&self) -> &[Self] {
        match self {
            Self::And(parts) => parts,
            Self::ForAll(_, body) | Self::When(_, body) => from_ref(body),
            Self::Add(_) | Self::Delete(_) | Self::Assign(..) => &[],
        }
    }

    /// Mutable variant of [`Effect::parts`].
    pub fn parts_mut(&mut self) -> &mut [Self] {
        match self {
            Self::And(parts) => parts,
            Self::ForAll(_, body) | Self::When(_, body) => from_mut(body),
            Self::Add(_) | Self::Delete(_) | Self::Assign(..) => &mut [],
        }
    }

    /// Visits the effect, all subeffects, and their conditions and numeric expressions. The target of an
    /// assignment is part of the effect node and is not visited separately.
    pub fn walk<'t>(&'t self, visit: Visit<'_, 't>) {
        visit(Node::Effect(self));
        match self {
            Self::When(condition, _) => condition.walk(visit),
            Self::Assign(_, _, value, _) => value.walk(visit),
            _ => {}
        }
        self.parts().iter().for_each(|part| part.walk(visit));
    }

    /// Applies a change to every numeric leaf expression of the effect, that is, to each number, fluent,
    /// `?duration` and `total-time`. Targets of assignments are not changed.
    pub fn change_leaves(&mut self, change: &mut dyn FnMut(&mut Expression)) {
        match self {
            Self::When(condition, _) => condition.change_leaves(change),
            Self::Assign(_, _, value, _) => value.change_leaves(change),
            _ => {}
        }
        self.parts_mut().iter_mut().for_each(|part| part.change_leaves(change));
    }
}

impl Expression {
    /// Operands of an operation from left to right; empty for all other expressions.
    pub fn operands(&self) -> &[Self] {
        match self {
            Self::Operation(_, operands, _) => operands,
            _ => &[],
        }
    }

    /// Visits the expression and all its subexpressions.
    pub fn walk<'t>(&'t self, visit: Visit<'_, 't>) {
        visit(Node::Expression(self));
        self.operands().iter().for_each(|operand| operand.walk(visit));
    }

    /// Visits the numeric functions in the expression.
    pub fn walk_fluents<'t>(&'t self, visit: &mut dyn FnMut(&'t Atom)) {
        self.walk(&mut |node| node.fluent().into_iter().for_each(&mut *visit));
    }

    /// Applies a change to every leaf of the expression, that is, to each number, fluent, `?duration` and
    /// `total-time`.
    pub fn change_leaves(&mut self, change: &mut dyn FnMut(&mut Self)) {
        match self {
            Self::Operation(_, operands, _) => {
                for operand in operands {
                    operand.change_leaves(change);
                }
            }
            leaf => change(leaf),
        }
    }
}

impl<'t> Node<'t> {
    /// Returns the function with its arguments if the node is a numeric fluent.
    pub fn fluent(self) -> Option<&'t Atom> {
        match self {
            Self::Expression(Expression::Fluent(atom)) => Some(atom),
            _ => None,
        }
    }

    /// Returns the atom if the node is an atomic condition.
    pub fn atom(self) -> Option<&'t Atom> {
        match self {
            Self::Condition(Condition::Atom(atom)) => Some(atom),
            _ => None,
        }
    }
}
