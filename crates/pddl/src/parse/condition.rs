//! Parses conditions: preconditions, goals, bodies of derived predicates.

use crate::ast::{Comparison, Condition};
use crate::number::{Literal, literal};
use crate::sexp::Item;

use super::expression::comparison;
use super::{Parser, at_start, list_start};

impl Parser<'_> {
    pub(super) fn condition(&mut self, item: Item<'_>) -> Option<Condition> {
        if !item.is_list() {
            let help = item.symbol().map(|symbol| format!("a condition is in parentheses: `({symbol})`"));
            self.expected(item, "a condition").help = help;
            return None;
        }
        if item.items().next().is_none() {
            return Some(Condition::And(Vec::new()));
        }
        let Some(head) = item.head() else {
            self.expected(item, "a condition").help("one pair of parentheses too many?");
            return None;
        };
        match head.to_ascii_lowercase().as_str() {
            "and" => Some(Condition::And(self.conditions(item))),
            "or" => Some(Condition::Or(self.conditions(item))),
            "not" => self.negation(item),
            "imply" => self.implication(item),
            "exists" | "forall" => self.quantified(item),
            "preference" => {
                self.sink
                    .error("P106", list_start(item), "a preference cannot stand here")
                    .help("preferences are parts of goals, preconditions and `:constraints`, below `and` and `forall` only");
                None
            }
            symbol => self.with_values(|parser| match comparison(symbol) {
                Some(operator) => parser.comparison_condition(item, operator),
                None => parser.atomic_condition(item),
            }),
        }
    }

    fn conditions(&mut self, item: Item<'_>) -> Vec<Condition> {
        item.rest().filter_map(|item| self.condition(item)).collect()
    }

    fn negation(&mut self, item: Item<'_>) -> Option<Condition> {
        let [inner] = self.operands(item, "(not (predicate ?x))")?;
        Some(Condition::Not(Box::new(self.condition(inner)?)))
    }

    fn implication(&mut self, item: Item<'_>) -> Option<Condition> {
        let [premise, conclusion] = self.operands(item, "(imply (p) (q))")?;
        let (premise, conclusion) = (self.condition(premise), self.condition(conclusion));
        Some(Condition::Imply(Box::new(premise?), Box::new(conclusion?)))
    }

    fn quantified(&mut self, item: Item<'_>) -> Option<Condition> {
        let is_universal = item.is_headed("forall");
        let form = if is_universal { "(forall (?x - type) (p ?x))" } else { "(exists (?x - type) (p ?x))" };
        let [variables, body] = self.operands(item, form)?;
        let variables = self.parameters(variables);
        let body = Box::new(self.condition(body)?);
        Some(if is_universal {
            Condition::ForAll(variables, body)
        } else {
            Condition::Exists(variables, body)
        })
    }

    fn atomic_condition(&mut self, item: Item<'_>) -> Option<Condition> {
        if is_timed(item) {
            self.sink
                .error("P115", list_start(item), "a time specifier cannot stand here")
                .help("`at start`, `over all` and `at end` are the outermost parts of conditions and effects of durative actions");
            return None;
        }
        self.atom(item, "a predicate").map(Condition::Atom)
    }

    fn comparison_condition(&mut self, item: Item<'_>, operator: Comparison) -> Option<Condition> {
        let head = item.head().unwrap_or_default();
        let [left, right] = self.operands(item, &format!("({head} a b)"))?;
        if operator == Comparison::Equal && (self.is_object_fluent(left) || self.is_object_fluent(right)) {
            return self.equal_objects(left, right);
        }
        if operator == Comparison::Equal && is_term_pair(left, right) {
            let (left, right) = (self.term(left), self.term(right));
            return Some(Condition::Equal(left?, right?, item.span()));
        }
        for side in [left, right] {
            // `?duration` is the only numeric variable.
            if side.symbol().is_some_and(is_term_variable) {
                self.sink.error("P106", at_start(side), "expected a number, found a variable");
                return None;
            }
        }
        let (left, right) = (self.expression(left), self.expression(right));
        Some(Condition::Compare(operator, left?, right?, item.span()))
    }
}

fn is_term_variable(symbol: &str) -> bool {
    symbol.starts_with('?') && !symbol.eq_ignore_ascii_case("?duration")
}

/// Returns `true` if `=` compares terms: both sides are symbols, and one is a variable or both are names.
fn is_term_pair(left: Item<'_>, right: Item<'_>) -> bool {
    let (Some(left), Some(right)) = (left.symbol(), right.symbol()) else { return false };
    let is_name =
        |symbol: &str| literal(symbol) == Literal::Name && !symbol.eq_ignore_ascii_case("?duration");
    is_term_variable(left) || is_term_variable(right) || (is_name(left) && is_name(right))
}

/// Returns `true` if a list is `(at start (…))`, `(at end (…))` or `(over all (…))`. An atom such as `(at
/// start)` is not timed.
pub(super) fn is_timed(item: Item<'_>) -> bool {
    let mut operands = item.rest();
    let (Some(when), Some(body), None) = (operands.next(), operands.next(), operands.next()) else {
        return false;
    };
    let Some(when) = when.symbol() else { return false };
    let is = |keyword: &str| when.eq_ignore_ascii_case(keyword);
    body.is_list()
        && ((item.is_headed("at") && (is("start") || is("end"))) || (item.is_headed("over") && is("all")))
}
