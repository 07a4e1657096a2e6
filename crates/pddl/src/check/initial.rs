//! Checks the initial state, the goal and the metric.

use num_rational::BigRational;
use num_traits::Signed;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

use crate::ast::{Atom, Condition, Expression, InitialElement, Metric, Name, Span, Term};

use super::condition::Kind;
use super::soft::is_violation;
use super::{Checker, Scope};

type Key<'a> = (&'a Name, SmallVec<[&'a Name; 4]>);

fn key(atom: &Atom) -> Key<'_> {
    (&atom.predicate.name, atom.arguments.iter().map(Term::name).collect())
}

impl<'a> Checker<'a> {
    #[expect(clippy::arithmetic_side_effects, reason = "those that are counted are among them")]
    pub(super) fn initial_state(&mut self, init: &'a [InitialElement]) {
        let scope = Scope::new();
        let mut facts: FxHashMap<Key<'a>, (Span, bool)> = FxHashMap::default();
        let mut values: FxHashMap<Key<'a>, (Span, &BigRational)> = FxHashMap::default();
        let is_value = |element: &&InitialElement| matches!(element, InitialElement::Value(..));
        // Reserved at once, because `:init` can have millions of elements.
        let count = init.iter().filter(is_value).count();
        values.reserve(count);
        facts.reserve(init.len() - count);
        for element in init {
            match element {
                InitialElement::Fact(atom) | InitialElement::NegatedFact(atom) => {
                    self.atom(atom, Kind::Predicate, &scope);
                    self.check_basic(atom);
                    let holds = matches!(element, InitialElement::Fact(_));
                    if let Some(earlier) = facts.insert(key(atom), (atom.span, holds)) {
                        self.repeated_fact(atom.span, holds, earlier);
                    }
                }
                InitialElement::Value(atom, value, span) => {
                    self.atom(atom, Kind::Function, &scope);
                    if let Some(earlier) = values.insert(key(atom), (*span, value)) {
                        self.repeated_value(*span, value, earlier);
                    }
                }
                InitialElement::Timed(time, atom, _, span) => {
                    self.atom(atom, Kind::Predicate, &scope);
                    self.check_basic(atom);
                    if time.is_negative() {
                        self.sink.error("P139", *span, "this time is before the initial state");
                    }
                }
            }
        }
    }

    fn repeated_fact(&mut self, span: Span, holds: bool, (place, held_before): (Span, bool)) {
        let source = self.sink.source();
        if holds == held_before {
            self.sink.warning("P127", span, "this fact is repeated").related(
                source,
                place,
                "it stands here already",
            );
        } else {
            self.sink.warning("P139", span, "this fact is stated and denied; it holds").related(
                source,
                place,
                if held_before { "the fact is here" } else { "the negation is here" },
            );
        }
    }

    fn repeated_value(&mut self, span: Span, value: &BigRational, (place, earlier): (Span, &BigRational)) {
        let source = self.sink.source();
        if value == earlier {
            self.sink.warning("P127", span, "this value is repeated").related(
                source,
                place,
                "it stands here already",
            );
        } else {
            self.sink.error("P127", span, "this function has another value already").related(
                source,
                place,
                "it stands here",
            );
        }
    }

    pub(super) fn goal(&mut self, goal: &'a Condition) {
        self.condition(goal, &mut Scope::new());
    }

    pub(super) fn metric(&mut self, metric: &'a Metric) {
        self.metric_expression(&metric.expression);
    }

    fn metric_expression(&mut self, expression: &'a Expression) {
        match expression {
            Expression::TotalTime(_) => {}
            Expression::Fluent(atom) if is_violation(atom) => self.violation(atom),
            Expression::Operation(_, operands, _) => {
                for operand in operands {
                    self.metric_expression(operand);
                }
            }
            _ => self.expression(expression, &Scope::new()),
        }
    }
}
