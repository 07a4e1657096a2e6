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

    /// Copy of a schema whose end and over-all condition read the duration from the fluent, because
    /// the duration expression may have another value in later states.
    ///
    /// Normalisation has replaced `?duration` by a copy of the duration expression. The functions in
    /// this copy have the places of the `:duration` field, so the same expression written in a
    /// condition or an effect differs from it and still reads the current state.
    pub(super) fn with_end(&self, schema: &Schema) -> Schema {
        let Some(duration) = &schema.duration else { return schema.clone() };
        let fluent = self.expression(schema);
        let replace = |expression: &Expression| (expression == duration).then(|| fluent.clone());
        let mut copy = schema.clone();
        copy.over_all = replace_in_formula(&copy.over_all, &replace);
        copy.at_end = replace_in_formula(&copy.at_end, &replace);
        replace_in_effects(&mut copy.end_effects, &replace);
        copy
    }
}

/// Copy of a schema with a chosen duration, in which the duration is 0.
pub(super) fn with_zero_duration(schema: &Schema, chosen: FunctionId) -> Schema {
    let zero = Expression::Number(Rational::from_integer(0));
    let replace = |expression: &Expression| {
        let is_chosen = matches!(expression, Expression::Function(function, ..) if *function == chosen);
        is_chosen.then(|| zero.clone())
    };
    let mut copy = schema.clone();
    copy.start_condition = replace_in_formula(&copy.start_condition, &replace);
    copy.at_end = replace_in_formula(&copy.at_end, &replace);
    replace_in_effects(&mut copy.start_effects, &replace);
    replace_in_effects(&mut copy.end_effects, &replace);
    copy
}

/// Returns the substitute of an expression, or `None` to keep the expression.
type Replace<'r> = dyn Fn(&Expression) -> Option<Expression> + 'r;

fn replace_in_effects(effects: &mut [Effect], replace: &Replace<'_>) {
    for effect in effects {
        effect.condition = replace_in_formula(&effect.condition, replace);
        if let Change::Assign { expression, .. } = &mut effect.change {
            *expression = replace_in_expression(expression, replace);
        }
    }
}

fn replace_in_formula(formula: &Formula, replace: &Replace<'_>) -> Formula {
    let each = |parts: &[Formula]| parts.iter().map(|part| replace_in_formula(part, replace)).collect();
    match formula {
        Formula::And(parts) => Formula::And(each(parts)),
        Formula::Or(parts) => Formula::Or(each(parts)),
        Formula::Exists(bound, body) => {
            Formula::Exists(bound.clone(), Box::new(replace_in_formula(body, replace)))
        }
        Formula::ForAll(bound, body) => {
            Formula::ForAll(bound.clone(), Box::new(replace_in_formula(body, replace)))
        }
        Formula::Compare(comparison, left, right, place) => {
            let [left, right] = [left, right].map(|side| replace_in_expression(side, replace));
            Formula::Compare(*comparison, left, right, *place)
        }
        Formula::Literal { .. } | Formula::Equal { .. } => formula.clone(),
    }
}

fn replace_in_expression(expression: &Expression, replace: &Replace<'_>) -> Expression {
    if let Some(substitute) = replace(expression) {
        return substitute;
    }
    let inner = |part: &Expression| replace_in_expression(part, replace);
    let each = |parts: &[Expression]| parts.iter().map(inner).collect();
    match expression {
        Expression::Sum(parts) => Expression::Sum(each(parts)),
        Expression::Product(parts, place) => Expression::Product(each(parts), *place),
        Expression::Negate(operand) => Expression::Negate(Box::new(inner(operand))),
        Expression::Quotient(left, right, place) => {
            Expression::Quotient(Box::new(inner(left)), Box::new(inner(right)), *place)
        }
        Expression::Number(_) | Expression::Function(..) | Expression::TotalTime => expression.clone(),
    }
}
