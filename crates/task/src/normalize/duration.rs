//! Duration constraints of durative actions, in particular variable durations.
//!
//! In sequential execution without timed events, a variable duration takes its lower bound, or its upper bound
//! if the metric rewards time. There must be exactly one such bound, which is not strict, and no condition or
//! effect may depend on the duration. Other variable durations are errors. If actions may overlap, the planner
//! chooses a duration when the action starts.

use crate::error::{Error, File, Place};
use crate::lifted::{
    DurationChoice, Expression, Formula, Function, FunctionId, Lifted, Metric, Rational, Term,
};
use crate::normalize::condition::expression;
use crate::normalize::names::{Duration, Names, Scope};
use crate::number::dense;
use pddl::ast::{self, Comparison, Direction, Name, Span};
use pddl::visit::Node;

/// Prefix of the names of auxiliary numeric functions that hold chosen durations. Names in PDDL files contain
/// no parentheses, so neither these names nor their ground names conflict with those of a domain.
pub const CHOSEN: &str = "(chosen duration) of ";

/// Returns `true` if the metrics that depend on `total-time` reward longer plans, and `false` if they reward
/// shorter plans or none depends on it. Returns `None` if this cannot be determined or the metrics disagree.
pub(super) fn rewards_time(metrics: &[Metric]) -> Option<bool> {
    let zero = Rational::from_integer(0);
    let mut rewards = Vec::new();
    for metric in metrics {
        let factor = time_factor(&metric.expression)?;
        let sign = if metric.direction == Direction::Minimize { factor } else { -factor };
        if sign != zero {
            rewards.push(sign < zero);
        }
    }
    let rewarded = rewards.first().copied().unwrap_or(false);
    rewards.iter().all(|other| *other == rewarded).then_some(rewarded)
}

/// Returns the coefficient of `total-time` in an expression, or `None` if the coefficient is not
/// recognised as constant. A quotient whose dividend has the coefficient 0 has the coefficient 0, even
/// if its divisor contains `total-time`.
pub fn time_factor(expression: &Expression) -> Option<Rational> {
    let number = |expression: &Expression| match expression {
        Expression::Number(number) => Some(number.clone()),
        _ => None,
    };
    match expression {
        Expression::TotalTime => Some(Rational::from_integer(1)),
        Expression::Number(_) | Expression::Function(..) => Some(Rational::from_integer(0)),
        Expression::Sum(parts) => parts.iter().map(time_factor).sum(),
        Expression::Negate(inner) => time_factor(inner).map(|factor| -factor),
        Expression::Product(parts, _) => {
            let factors = parts.iter().map(time_factor).collect::<Option<Vec<_>>>()?;
            let timed: Vec<_> =
                (0..parts.len()).filter(|i| factors[*i] != Rational::from_integer(0)).collect();
            match timed[..] {
                [] => Some(Rational::from_integer(0)),
                [only] => (0..parts.len())
                    .filter(|i| *i != only)
                    .map(|i| number(&parts[i]))
                    .try_fold(factors[only].clone(), |product, number| Some(product * number?)),
                _ => None,
            }
        }
        Expression::Quotient(left, right, _) => match (time_factor(left)?, number(right)) {
            (factor, _) if factor == Rational::from_integer(0) => Some(factor),
            (factor, Some(divisor)) if divisor != Rational::from_integer(0) => Some(factor / divisor),
            _ => None,
        },
    }
}

/// Returns the duration of an action, and conditions that ensure its bounds. If durations may be chosen freely,
/// a variable duration becomes an auxiliary numeric function. Otherwise it is replaced by its longest value if
/// `longest` is `Some(true)` (the metric rewards time) and by its shortest if `Some(false)`. If `longest` is
/// `None` or no single bound determines the value, an error is recorded in `names`.
pub(super) fn duration(
    names: &mut Names,
    (constraints, span): (&[ast::DurationConstraint], Span),
    action: (&Name, usize),
    longest: Option<bool>,
    scope: &mut Scope,
) -> (Expression, Vec<Formula>, DurationChoice) {
    let mut bounds = [Vec::new(), Vec::new()];
    let mut fixed = Vec::new();
    for constraint in constraints {
        let value = expression(names, &constraint.expression, scope);
        match constraint.operator {
            Comparison::Equal => fixed.push((value, constraint.span)),
            Comparison::Greater | Comparison::GreaterOrEqual => bounds[0].push((value, constraint)),
            Comparison::Less | Comparison::LessOrEqual => bounds[1].push((value, constraint)),
        }
    }
    if let [(duration, _)] = &fixed[..]
        && bounds.iter().all(Vec::is_empty)
    {
        scope.duration = Duration::Fixed(duration.clone());
        return (duration.clone(), Vec::new(), DurationChoice::None);
    }
    let [lower, upper] = bounds;
    let span = constraints.first().map_or(span, |constraint| constraint.span);
    if names.is_free {
        let number = chosen(names, action, scope.place(span));
        let fixed = fixed.into_iter().map(|(bound, span)| (Comparison::Equal, bound, span));
        let open = lower.into_iter().chain(upper);
        let constraints_on_duration =
            open.map(|(bound, constraint)| (constraint.operator, bound, constraint.span)).chain(fixed);
        let compare =
            |(operator, bound, span)| Formula::Compare(operator, number.clone(), bound, scope.place(span));
        let conditions = constraints_on_duration.map(compare).collect();
        scope.duration = Duration::Fixed(number.clone());
        return (number, conditions, DurationChoice::None);
    }
    scope.duration = Duration::Open;
    let selected = match longest {
        Some(longest) if fixed.is_empty() => match if longest { &upper[..] } else { &lower[..] } {
            [(expression, constraint)]
                if matches!(constraint.operator, Comparison::GreaterOrEqual | Comparison::LessOrEqual) =>
            {
                Some(expression.clone())
            }
            _ => None,
        },
        _ => None,
    };
    let Some(chosen) = selected else {
        names.unsupported(
            "a duration without one bound that the metric makes it take",
            "one `(= ?duration …)`, one `(>= ?duration …)` without timed initial literals and with a metric that does \
             not reward time, or `--concurrent`",
            File::Domain,
            span,
        );
        return (Expression::Number(Rational::from_integer(0)), Vec::new(), DurationChoice::None);
    };
    let choice = if longest == Some(true) {
        DurationChoice::Longest(
            lower.iter().map(|(bound, constraint)| (constraint.operator, bound.clone())).collect(),
        )
    } else {
        DurationChoice::Shortest
    };
    let conditions = lower.into_iter().chain(upper).map(|(bound, constraint)| {
        let place = scope.place(constraint.span);
        Formula::Compare(constraint.operator, chosen.clone(), bound, place)
    });
    let conditions = conditions.collect();
    (chosen, conditions, choice)
}

/// Returns an error for each duration constraint `at end` over a function that actions change, because the planner
/// evaluates all duration constraints at the start.
pub(super) fn changing_at_end(domain: &ast::Domain, lifted: &Lifted) -> Vec<Error> {
    let is_fluent =
        |name: &Name| lifted.functions.iter().any(|function| function.fluent && function.name == *name);
    let mut errors = Vec::new();
    for action in &domain.actions {
        let ast::ActionBody::Durative { duration, .. } = &action.body else { continue };
        for constraint in duration.iter().filter(|constraint| constraint.time == ast::EffectTime::AtEnd) {
            let mut may_change = false;
            constraint.expression.walk_fluents(&mut |atom| may_change |= is_fluent(&atom.predicate.name));
            if may_change {
                errors.push(Error::Unsupported {
                    construct: "a duration `at end` over a function that actions change".into(),
                    instead: "the duration `at start`".into(),
                    place: Place { file: File::Domain, span: constraint.span },
                });
            }
        }
    }
    errors
}

/// Returns an error for each action that reads `?duration` after its start has changed a function of the duration. The
/// duration is a number that is fixed at the start, but `?duration` is replaced by its expression.
pub fn changed_by_start(domain: &ast::Domain) -> Vec<Error> {
    let mut errors = Vec::new();
    for action in &domain.actions {
        let ast::ActionBody::Durative { duration, conditions, effects } = &action.body else { continue };
        let mut changed = Vec::new();
        for (_, effect) in effects.iter().filter(|(time, _)| *time == ast::EffectTime::AtStart) {
            effect.walk(&mut |node| {
                if let Node::Effect(ast::Effect::Assign(_, target, ..)) = node {
                    changed.push(&target.predicate.name);
                }
            });
        }
        let mut is_changed = false;
        for constraint in duration {
            constraint
                .expression
                .walk_fluents(&mut |atom| is_changed |= changed.contains(&&atom.predicate.name));
        }
        let mut read = None;
        let mut visit = |node: Node<'_>| {
            if let Node::Expression(ast::Expression::Duration(span)) = node {
                read = Some(*span);
            }
        };
        let later = conditions.iter().filter(|(time, _)| *time != ast::ConditionTime::AtStart);
        later.for_each(|(_, condition)| condition.walk(&mut visit));
        let later = effects.iter().filter(|(time, _)| *time == ast::EffectTime::AtEnd);
        later.for_each(|(_, effect)| effect.walk(&mut visit));
        if let Some(span) = read.filter(|_| is_changed) {
            errors.push(Error::Unsupported {
                construct: "`?duration` after the start has changed a function of the duration".into(),
                instead: "a function that the start does not change, or plan with `--concurrent`".into(),
                place: Place { file: File::Domain, span },
            });
        }
    }
    errors
}

fn chosen(names: &mut Names, (action, parameters): (&Name, usize), place: Place) -> Expression {
    let id = FunctionId(dense(names.functions.len()));
    let name = Name::new(&format!("{CHOSEN}{action}"));
    names.functions.push(Function { name, fluent: true, partial: true });
    Expression::Function(id, (0..dense(parameters)).map(Term::Parameter).collect(), place)
}
