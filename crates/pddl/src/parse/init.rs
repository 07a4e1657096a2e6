//! Parses the initial state and the metric.

use crate::ast::{Direction, InitialElement, Metric};
use crate::number::{Literal, literal};
use crate::sexp::Item;

use super::{Parser, at_start, list_start};

impl Parser<'_> {
    pub(super) fn initial(&mut self, item: Item<'_>, elements: &mut Vec<InitialElement>) {
        if !item.is_list() {
            self.expected(item, "a fact").help("a fact is in parentheses: `(predicate object)`");
            return;
        }
        let Some(head) = item.head() else {
            self.expected(item, "a fact");
            return;
        };
        match head {
            "=" => elements.extend(self.initial_value(item)),
            _ if head.eq_ignore_ascii_case("not") => {
                let Some([inner]) = self.operands(item, "(not (predicate object))") else { return };
                elements.extend(self.fact(inner).map(InitialElement::NegatedFact));
            }
            _ if head.eq_ignore_ascii_case("and") => {
                for item in item.rest() {
                    self.initial(item, elements);
                }
            }
            _ if head.eq_ignore_ascii_case("at") && is_timed_literal(item) => {
                elements.extend(self.timed_literal(item));
            }
            _ => elements.extend(self.fact(item).map(InitialElement::Fact)),
        }
    }

    fn fact(&mut self, item: Item<'_>) -> Option<crate::ast::Atom> {
        let head = item.head().unwrap_or_default();
        if ["or", "not", "forall", "exists", "imply", "when", "oneof", "unknown", "<", ">", "<=", ">=", "="]
            .contains(&head)
        {
            self.sink
                .error("P106", list_start(item), format!("`{head}` cannot stand in the initial state"))
                .help("the initial state is known: it lists what holds, and what it does not list is false");
            return None;
        }
        self.atom(item, "a predicate")
    }

    fn initial_value(&mut self, item: Item<'_>) -> Option<InitialElement> {
        let [left, right] = self.operands(item, "(= (function object) 1)")?;
        if self.is_object_fluent(left) || self.is_object_fluent(right) {
            return self.initial_object(left, right);
        }
        let is_number = |item: Item<'_>| item.symbol().is_some_and(|symbol| literal(symbol) != Literal::Name);
        let (function, value) = if is_number(left) { (right, left) } else { (left, right) };
        if value.symbol().is_some_and(|symbol| literal(symbol) == Literal::Name) {
            self.expected(value, "a number")
                .help("a function with objects as values is declared with their type in `:functions`: `(place-of ?x - tool) - place`");
            return None;
        }
        let (function, value) = (self.fluent(function), self.constant(value));
        Some(InitialElement::Value(function?, value?, item.span()))
    }

    fn timed_literal(&mut self, item: Item<'_>) -> Option<InitialElement> {
        let [time, literal] = self.operands(item, "(at 5 (predicate object))")?;
        let time = self.number(time)?;
        if literal.is_headed("=") {
            self.refuse(literal, "timed initial values")
                .help("only facts change at a time; let one mean the value: `(at 5 (full))`");
            return None;
        }
        let (atom, holds) = if literal.is_headed("not") {
            let [inner] = self.operands(literal, "(not (predicate object))")?;
            (inner, false)
        } else {
            (literal, true)
        };
        let atom = self.fact(atom)?;
        Some(InitialElement::Timed(time, atom, holds, item.span()))
    }

    pub(super) fn metric(&mut self, section: Item<'_>) -> Option<Metric> {
        let [direction, expression] = self.operands(section, "(:metric minimize (total-cost))")?;
        let word = direction.symbol().unwrap_or_default();
        let direction = if word.eq_ignore_ascii_case("minimize") {
            Direction::Minimize
        } else if word.eq_ignore_ascii_case("maximize") {
            Direction::Maximize
        } else {
            self.sink.error("P106", at_start(direction), "expected `minimize` or `maximize`");
            return None;
        };
        let expression = self.expression(expression)?;
        Some(Metric { direction, expression, span: section.span() })
    }
}

/// Returns `true` if `(at a b)` is a timed initial literal rather than a fact of a predicate named `at`.
fn is_timed_literal(item: Item<'_>) -> bool {
    let mut operands = item.rest();
    let time = operands.next().and_then(Item::symbol);
    time.is_some_and(|symbol| literal(symbol) != Literal::Name) && operands.next().is_some_and(Item::is_list)
}
