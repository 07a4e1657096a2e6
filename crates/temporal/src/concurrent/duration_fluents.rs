//! Durations that depend on the state or that the planner chooses. One numeric function per schema
//! holds the duration, or its dividend, from the start to the end of an action.
//!
//! `?duration` has the value of the duration expression in the state in which the action starts
//! \[1\]. The start assigns this value to the fluent. If the expression is a quotient with a static
//! divisor, the start assigns only the dividend, and the readers of the fluent (the end, its effects
//! and the temporal network) divide by the divisor. If the planner chooses the duration, the start
//! assigns nothing. An auxiliary operator, which is never executed, increases
//! the fluent, so that every value from 0 is reachable in the relaxed task.
//!
//! \[1\] M. Fox, D. Long: PDDL2.1, JAIR 20, 2003, section 5.2.

use pddl::ast::{Assignment, Comparison, Name};
use task::lifted::{
    Change, Effect, Expression, Formula, Function, FunctionId, Lifted, Rational, Schema, Term,
};
use task::normalize::duration::CHOSEN;
use task::number::dense;

/// Prefix of the ground names of duration fluents. No fluent of a domain has such a name: `(duration
/// of b)` would be a function `duration` with the objects `of` and `b`.
pub(super) const DURATION_PREFIX: &str = "((duration) of ";
pub(super) const FLEXIBLE_DURATION_PREFIX: &str = "((chosen duration) of ";

pub(super) fn depends_on_state(lifted: &Lifted, expression: &Expression) -> bool {
    let any = |parts: &[Expression]| parts.iter().any(|part| depends_on_state(lifted, part));
    match expression {
        Expression::Number(_) | Expression::TotalTime => false,
        Expression::Function(function, ..) => lifted.functions[function.index()].fluent,
        Expression::Sum(parts) | Expression::Product(parts, _) => any(parts),
        Expression::Negate(inner) => depends_on_state(lifted, inner),
        Expression::Quotient(left, right, _) => {
            depends_on_state(lifted, left) || depends_on_state(lifted, right)
        }
    }
}

pub(super) fn chosen(lifted: &Lifted, duration: &Expression) -> Option<FunctionId> {
    let Expression::Function(function, ..) = duration else { return None };
    lifted.functions[function.index()].name.as_str().starts_with(CHOSEN).then_some(*function)
}

/// Duration fluent of a schema: the function that holds the durations of its running instances.
pub(super) struct Timer {
    pub(super) function: FunctionId,
    terms: Vec<Term>,
    /// Expression that the start assigns. `None` if the planner chooses the duration.
    numerator: Option<Expression>,
    /// Static divisor: the duration is the value of the function divided by this expression. `None`
    /// for no division.
    pub(super) divisor: Option<Expression>,
}

impl Timer {
    pub(super) fn new(lifted: &mut Lifted, schema: &Schema, duration: &Expression) -> Self {
        let terms = (0..dense(schema.parameters.len())).map(Term::Parameter).collect();
        if let Some(function) = chosen(lifted, duration) {
            return Self { function, terms, numerator: None, divisor: None };
        }
        let (numerator, divisor) = match duration {
            Expression::Quotient(left, right, _) if !depends_on_state(lifted, right) => {
                ((**left).clone(), Some((**right).clone()))
            }
            whole => (whole.clone(), None),
        };
        let function = FunctionId(dense(lifted.functions.len()));
        let name = Name::new(&format!("(duration) of {}", schema.name));
        lifted.functions.push(Function { name, fluent: true, partial: true });
        Self { function, terms, numerator: Some(numerator), divisor }
    }

    pub(super) fn is_chosen(&self) -> bool {
        self.numerator.is_none()
    }

    fn number(&self, schema: &Schema) -> Expression {
        Expression::Function(self.function, self.terms.clone(), schema.place)
    }

    fn expression(&self, schema: &Schema) -> Expression {
        let number = self.number(schema);
        match &self.divisor {
            Some(divisor) => Expression::Quotient(Box::new(number), Box::new(divisor.clone()), schema.place),
            None => number,
        }
    }

    pub(super) fn set(&self, schema: &Schema) -> Option<Effect> {
        Some(self.assign(schema, Assignment::Assign, self.numerator.clone()?))
    }

    /// Effect that lets relaxed reachability assume any value for a chosen duration. Returns `None`
    /// if the planner does not choose the duration.
    pub(super) fn relaxed_increase(&self, schema: &Schema) -> Option<Effect> {
        let unit_increase = Expression::Number(Rational::from_integer(1));
        self.numerator.is_none().then(|| self.assign(schema, Assignment::Increase, unit_increase))
    }

    fn assign(&self, schema: &Schema, assignment: Assignment, expression: Expression) -> Effect {
        let change = Change::Assign {
            assignment,
            function: self.function,
            terms: self.terms.clone(),
            expression,
            place: schema.place,
        };
        Effect { bound: Vec::new(), condition: Formula::truth(), change }
    }

    pub(super) fn clear(&self, schema: &Schema) -> Effect {
        self.assign(schema, Assignment::Assign, Expression::Number(Rational::from_integer(0)))
    }

    /// Condition of the end that the start has set the fluent. Returns `None` if the planner
    /// chooses the duration.
    pub(super) fn is_set(&self, schema: &Schema) -> Option<Formula> {
        let zero = Expression::Number(Rational::from_integer(0));
        let compare = || Formula::Compare(Comparison::Greater, self.number(schema), zero, schema.place);
        self.numerator.is_some().then(compare)
    }

    /// Copy of a schema whose end effects read the duration from the fluent instead of computing it
    /// from the state.
    pub(super) fn with_end(&self, schema: &Schema) -> Schema {
        let Some(duration) = &schema.duration else { return schema.clone() };
        let replace = |expression: &Expression| replaced(expression, duration, &self.expression(schema));
        let mut copy = schema.clone();
        for effect in &mut copy.end_effects {
            if let Change::Assign { expression, .. } = &mut effect.change {
                *expression = replace(expression);
            }
        }
        copy
    }
}

fn replaced(expression: &Expression, part: &Expression, other: &Expression) -> Expression {
    let each = |parts: &[Expression]| parts.iter().map(|inner| replaced(inner, part, other)).collect();
    if expression == part {
        return other.clone();
    }
    match expression {
        Expression::Sum(parts) => Expression::Sum(each(parts)),
        Expression::Product(parts, place) => Expression::Product(each(parts), *place),
        Expression::Negate(inner) => Expression::Negate(Box::new(replaced(inner, part, other))),
        Expression::Quotient(left, right, place) => Expression::Quotient(
            Box::new(replaced(left, part, other)),
            Box::new(replaced(right, part, other)),
            *place,
        ),
        Expression::Number(_) | Expression::Function(..) | Expression::TotalTime => expression.clone(),
    }
}
