//! Parses numeric expressions, atoms and terms.

use num_rational::BigRational;
use num_traits::Zero;

use crate::ast::{Arithmetic, Atom, Comparison, Expression, Term};
use crate::number::{Literal, literal};
use crate::sexp::Item;

use super::{Parser, at_start, list_start};

pub(super) fn comparison(symbol: &str) -> Option<Comparison> {
    Some(match symbol {
        "<" => Comparison::Less,
        "<=" => Comparison::LessOrEqual,
        "=" => Comparison::Equal,
        ">=" => Comparison::GreaterOrEqual,
        ">" => Comparison::Greater,
        _ => return None,
    })
}

fn arithmetic(symbol: &str) -> Option<Arithmetic> {
    Some(match symbol {
        "+" => Arithmetic::Add,
        "-" => Arithmetic::Subtract,
        "*" => Arithmetic::Multiply,
        "/" => Arithmetic::Divide,
        _ => return None,
    })
}

pub(super) const CONTINUOUS: &str = "numbers change at the start and the end of actions only: `(at end (increase (f) (* 2 ?duration)))` for a rate of 2";

impl Parser<'_> {
    pub(super) fn term(&mut self, item: Item<'_>) -> Option<Term> {
        let Some(symbol) = item.symbol() else { return self.value_of(item) };
        match symbol.strip_prefix('?') {
            Some("") => {
                self.sink.error("P106", item.span(), "a variable has a name after its question mark");
                None
            }
            Some(name) => Some(Term::Variable(self.identifier(name, item.span()))),
            None => self.name_item(item, "a term").map(Term::Constant),
        }
    }

    pub(super) fn atom(&mut self, item: Item<'_>, description: &str) -> Option<Atom> {
        let Some(first) = item.items().next() else {
            self.expected(item, description);
            return None;
        };
        let predicate = self.name_item(first, description)?;
        if self.objects.contains(&predicate.name) {
            return self.misplaced_object_fluent(item, &predicate.name);
        }
        let message_count = self.sink.len();
        let arguments = item.rest().filter_map(|item| self.term(item)).collect();
        // An unreadable term is already reported. It must not cause a second error about the number of
        // arguments.
        (self.sink.len() == message_count).then_some(Atom { predicate, arguments, span: item.span() })
    }

    pub(super) fn fluent(&mut self, item: Item<'_>) -> Option<Atom> {
        if item.is_list() {
            return self.atom(item, "a function");
        }
        let is_operator = |symbol: &str| {
            comparison(symbol).is_some()
                || arithmetic(symbol).is_some()
                || symbol.eq_ignore_ascii_case("is-violated")
        };
        if item.symbol().is_some_and(is_operator) {
            self.expected(item, "a function");
            return None;
        }
        let predicate = self.name_item(item, "a function")?;
        if self.objects.contains(&predicate.name) {
            return self.misplaced_object_fluent(item, &predicate.name);
        }
        Some(Atom { predicate, arguments: Vec::new(), span: item.span() })
    }

    pub(super) fn expression(&mut self, item: Item<'_>) -> Option<Expression> {
        let Some(symbol) = item.symbol() else { return self.compound_expression(item) };
        if symbol.eq_ignore_ascii_case("?duration") {
            return Some(Expression::Duration(item.span()));
        }
        if symbol.eq_ignore_ascii_case("#t") {
            self.refuse(item, "continuous effects (`#t`)").help(CONTINUOUS);
            return None;
        }
        if symbol.eq_ignore_ascii_case("total-time") {
            return Some(Expression::TotalTime(item.span()));
        }
        if literal(symbol) == Literal::Name {
            return self.fluent(item).map(Expression::Fluent);
        }
        self.number(item).map(|value| Expression::Number(value, item.span()))
    }

    fn compound_expression(&mut self, item: Item<'_>) -> Option<Expression> {
        let head = item.head().unwrap_or_default();
        if let Some(operation) = arithmetic(head) {
            return self.operation(item, operation);
        }
        if head.eq_ignore_ascii_case("total-time") && item.rest().next().is_none() {
            return Some(Expression::TotalTime(item.span()));
        }
        if comparison(head).is_some() {
            self.expected(item, "a number");
            return None;
        }
        self.fluent(item).map(Expression::Fluent)
    }

    fn operation(&mut self, item: Item<'_>, operation: Arithmetic) -> Option<Expression> {
        let count = item.rest().count();
        let (allowed, form) = match operation {
            Arithmetic::Add => (count >= 1, "(+ a b)"),
            Arithmetic::Multiply => (count >= 1, "(* a b)"),
            Arithmetic::Subtract => (count == 1 || count == 2, "(- a b)"),
            Arithmetic::Divide => (count == 2, "(/ a b)"),
        };
        if !allowed {
            let message = format!("`{}` cannot have {count} operands", item.head().unwrap_or_default());
            self.sink.error("P108", list_start(item), message).help(format!("write `{form}`"));
            return None;
        }
        let operands: Vec<_> = item.rest().filter_map(|item| self.expression(item)).collect();
        (operands.len() == count).then_some(Expression::Operation(operation, operands, item.span()))
    }

    /// Parses a constant expression, as required in `:init` and for times of trajectory constraints, and
    /// returns its value. Reports an error if there is no value, for example because the expression reads a
    /// function.
    pub(super) fn constant(&mut self, item: Item<'_>) -> Option<BigRational> {
        let expression = self.expression(item)?;
        let value = evaluate(&expression);
        if value.is_none() {
            self.sink.error("P106", at_start(item), "the value is not a number, or the number is too long");
        }
        value
    }
}

/// Evaluates an expression. `None` if it contains a function, `?duration` or `total-time`, divides by zero, or has
/// an intermediate result that exceeds [`MAX_BITS`].
fn evaluate(expression: &Expression) -> Option<BigRational> {
    match expression {
        Expression::Number(value, _) => Some(value.clone()),
        Expression::Fluent(_) | Expression::Duration(_) | Expression::TotalTime(_) => None,
        Expression::Operation(operation, operands, _) => {
            let mut values = operands.iter().map(evaluate);
            let first = values.next()??;
            if *operation == Arithmetic::Subtract && operands.len() == 1 {
                return Some(-first);
            }
            values.try_fold(first, |left, right| apply(*operation, &left, &right?))
        }
    }
}

/// Maximum number of bits of the numerator and of the denominator of a number that is computed during
/// parsing, about 90 decimal digits.
const MAX_BITS: u64 = 300;

fn apply(operation: Arithmetic, left: &BigRational, right: &BigRational) -> Option<BigRational> {
    let value = match operation {
        Arithmetic::Add => left + right,
        Arithmetic::Subtract => left - right,
        Arithmetic::Multiply => left * right,
        Arithmetic::Divide if right.is_zero() => return None,
        Arithmetic::Divide => left / right,
    };
    (value.numer().bits().max(value.denom().bits()) <= MAX_BITS).then_some(value)
}
