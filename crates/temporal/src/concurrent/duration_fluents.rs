//! Durations that depend on the state or that the planner chooses: one fluent per schema, set by the start and cleared by the end.
//!
//! `?duration` has the value of the expression in the state in which the action starts \[1\]. The start assigns it
//! to the fluent, which the end, its effects and the temporal network read. A duration that the planner chooses
//! is set by an operator that never happens; the reachability analysis lets it be any value from 0.
//!
//! \[1\] M. Fox, D. Long: PDDL2.1, JAIR 20, 2003, section 5.2.

use pddl::ast::{Assignment, Comparison, Name};
use task::lifted::{
    Change, Effect, Expression, Formula, Function, FunctionId, Lifted, Rational, Schema, Term,
};
use task::normalize::duration::CHOSEN;
use task::number::dense;

/// What the names of these numbers begin with: no name in a file has a blank.
pub(super) const DURATION_PREFIX: &str = "(duration of ";
/// The same for those that the planner chooses, as ground numbers are written.
pub(super) const FLEXIBLE_DURATION_PREFIX: &str = "(chosen duration of ";

/// Whether some action changes what an expression mentions.
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

/// The number that is the duration of a schema, if the planner chooses that.
pub(super) fn chosen(lifted: &Lifted, duration: &Expression) -> Option<FunctionId> {
    let Expression::Function(function, ..) = duration else { return None };
    lifted.functions[function.index()].name.as_str().starts_with(CHOSEN).then_some(*function)
}

/// A number for the durations of a schema.
pub(super) struct Timer {
    pub(super) function: FunctionId,
    terms: Vec<Term>,
    /// What the start assigns; none where the planner chooses.
    numerator: Option<Expression>,
    /// The duration is the number divided by this, which no action changes.
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
        let name = Name::new(&format!("duration of {}", schema.name));
        lifted.functions.push(Function { name, fluent: true, partial: true });
        Self { function, terms, numerator: Some(numerator), divisor }
    }

    /// Whether the planner chooses it.
    pub(super) fn is_chosen(&self) -> bool {
        self.numerator.is_none()
    }

    fn number(&self, schema: &Schema) -> Expression {
        Expression::Function(self.function, self.terms.clone(), schema.place)
    }

    /// The duration.
    fn expression(&self, schema: &Schema) -> Expression {
        let number = self.number(schema);
        match &self.divisor {
            Some(divisor) => Expression::Quotient(Box::new(number), Box::new(divisor.clone()), schema.place),
            None => number,
        }
    }

    /// What the start does, if the planner does not choose.
    pub(super) fn set(&self, schema: &Schema) -> Option<Effect> {
        Some(self.assign(schema, Assignment::Assign, self.numerator.clone()?))
    }

    /// What makes it any number, as far as can be told from what is in reach.
    pub(super) fn relaxed_increase(&self, schema: &Schema) -> Option<Effect> {
        let one = Expression::Number(Rational::from_integer(1));
        self.numerator.is_none().then(|| self.assign(schema, Assignment::Increase, one))
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

    /// That the start has set it.
    pub(super) fn is_set(&self, schema: &Schema) -> Option<Formula> {
        let zero = Expression::Number(Rational::from_integer(0));
        let compare = || Formula::Compare(Comparison::Greater, self.number(schema), zero, schema.place);
        self.numerator.is_some().then(compare)
    }

    /// The schema whose end takes its duration from the timer.
    pub(super) fn with_end(&self, schema: &Schema) -> Schema {
        let Some(duration) = &schema.duration else { return schema.clone() };
        let replace = |expression: &Expression| replaced(expression, duration, &self.expression(schema));
        let mut own = schema.clone();
        for effect in &mut own.end_effects {
            if let Change::Assign { expression, .. } = &mut effect.change {
                *expression = replace(expression);
            }
        }
        own
    }
}

/// An expression with another one put for each part that is equal to `part`.
fn replaced(expression: &Expression, part: &Expression, other: &Expression) -> Expression {
    let each = |parts: &[Expression]| parts.iter().map(|own| replaced(own, part, other)).collect();
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
