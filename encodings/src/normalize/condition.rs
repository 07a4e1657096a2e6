//! Conditions, effects and expressions of the syntax tree in ids.

use crate::lifted::{Bound, Change, Effect, Expression, Formula, Term};
use crate::normalize::{Duration, Normalizer, Rational, Scope};
use pddl::ast::{self, TypedName};

impl Normalizer {
    /// A condition, or its negation, in negation normal form.
    #[expect(clippy::arithmetic_side_effects, reason = "as many variables were pushed as are taken off")]
    pub(super) fn condition(
        &mut self,
        condition: &ast::Condition,
        positive: bool,
        scope: &mut Scope,
    ) -> Formula {
        use ast::Condition as C;
        let all = |parts| if positive { Formula::And(parts) } else { Formula::Or(parts) };
        let any = |parts| if positive { Formula::Or(parts) } else { Formula::And(parts) };
        match condition {
            C::And(parts) => all(parts.iter().map(|part| self.condition(part, positive, scope)).collect()),
            C::Or(parts) => any(parts.iter().map(|part| self.condition(part, positive, scope)).collect()),
            C::Not(inner) => self.condition(inner, !positive, scope),
            C::Imply(premise, conclusion) => any(vec![
                self.condition(premise, !positive, scope),
                self.condition(conclusion, positive, scope),
            ]),
            C::ForAll(variables, body) | C::Exists(variables, body) => {
                let universal = matches!(condition, C::ForAll(..)) == positive;
                let bound = self.bind(variables, scope);
                let body = Box::new(self.condition(body, positive, scope));
                scope.variables.truncate(scope.variables.len() - variables.len());
                if universal { Formula::ForAll(bound, body) } else { Formula::Exists(bound, body) }
            }
            C::Atom(atom) => {
                let predicate = self.predicate(atom, scope.file);
                Formula::Literal { positive, predicate, terms: self.terms(atom, scope) }
            }
            C::Equal(left, right, _) => {
                Formula::Equal { positive, left: self.term(left, scope), right: self.term(right, scope) }
            }
            C::Compare(comparison, left, right, span) => {
                let (left, right) = (self.expression(left, scope), self.expression(right, scope));
                let formula = Formula::Compare(*comparison, left, right, scope.place(*span));
                if positive { formula } else { formula.negated() }
            }
        }
    }

    /// Takes variables into sight.
    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    pub(super) fn bind(&mut self, variables: &[TypedName], scope: &mut Scope) -> Vec<Bound> {
        let mut all = Vec::with_capacity(variables.len());
        for variable in variables {
            let candidates = self.candidates(&variable.r#type);
            scope.variables.push((variable.identifier.name.clone(), Term::Parameter(scope.bound)));
            all.push(Bound { variable: scope.bound, candidates });
            scope.bound += 1;
        }
        all
    }

    /// Flattens an effect into changes, each with the variables and the condition that it stands under.
    #[expect(clippy::arithmetic_side_effects, reason = "as many variables were pushed as are taken off")]
    pub(super) fn effect(&mut self, effect: &ast::Effect, scope: &mut Scope, out: &mut Vec<Effect>) {
        let change = match effect {
            ast::Effect::And(parts) => return parts.iter().for_each(|part| self.effect(part, scope, out)),
            ast::Effect::ForAll(variables, inner) => {
                let bound = self.bind(variables, scope);
                let first = out.len();
                self.effect(inner, scope, out);
                scope.variables.truncate(scope.variables.len() - variables.len());
                for effect in &mut out[first..] {
                    effect.bound.splice(0..0, bound.iter().cloned());
                }
                return;
            }
            ast::Effect::When(condition, inner) => {
                let condition = self.condition(condition, true, scope);
                let first = out.len();
                self.effect(inner, scope, out);
                for effect in &mut out[first..] {
                    let own = std::mem::replace(&mut effect.condition, Formula::truth());
                    effect.condition = Formula::And(vec![condition.clone(), own]);
                }
                return;
            }
            ast::Effect::Add(atom) => Change::Add(self.predicate(atom, scope.file), self.terms(atom, scope)),
            ast::Effect::Delete(atom) => {
                Change::Delete(self.predicate(atom, scope.file), self.terms(atom, scope))
            }
            ast::Effect::Assign(assignment, atom, expression, span) => Change::Assign {
                assignment: *assignment,
                function: self.function(atom, scope.file),
                terms: self.terms(atom, scope),
                expression: self.expression(expression, scope),
                place: scope.place(*span),
            },
        };
        out.push(Effect { bound: Vec::new(), condition: Formula::truth(), change });
    }

    pub(super) fn expression(&mut self, expression: &ast::Expression, scope: &mut Scope) -> Expression {
        use ast::Arithmetic as Op;
        match expression {
            ast::Expression::Number(number, _) => Expression::Number(Rational::from_big(number.clone())),
            ast::Expression::Fluent(atom) => {
                let function = self.function(atom, scope.file);
                Expression::Function(function, self.terms(atom, scope), scope.place(atom.span))
            }
            ast::Expression::Duration(span) => match &scope.duration {
                Duration::Fixed(duration) => duration.clone(),
                Duration::Open => {
                    self.unsupported(
                        "`?duration` where the duration is not fixed",
                        "one `(= ?duration …)` in `:duration`",
                        scope.file,
                        *span,
                    );
                    Expression::Number(Rational::from_integer(0))
                }
                Duration::Instantaneous => {
                    let instead = "a number: the action has no duration here";
                    self.unsupported("`?duration`", instead, scope.file, *span);
                    Expression::Number(Rational::from_integer(0))
                }
            },
            ast::Expression::TotalTime(_) => Expression::TotalTime,
            ast::Expression::Operation(op, operands, span) => {
                let place = scope.place(*span);
                let mut operands: Vec<_> =
                    operands.iter().map(|operand| self.expression(operand, scope)).collect();
                match op {
                    Op::Add => Expression::Sum(operands),
                    Op::Multiply => Expression::Product(operands, place),
                    Op::Subtract => {
                        let negated = operands.split_off(usize::from(operands.len() > 1));
                        operands
                            .extend(negated.into_iter().map(|operand| Expression::Negate(Box::new(operand))));
                        Expression::Sum(operands)
                    }
                    Op::Divide => operands
                        .into_iter()
                        .reduce(|left, right| Expression::Quotient(Box::new(left), Box::new(right), place))
                        .unwrap_or(Expression::Sum(Vec::new())),
                }
            }
        }
    }
}
