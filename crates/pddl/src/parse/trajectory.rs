//! Parses trajectory constraints: `:constraints`.

use num_rational::BigRational;

use crate::ast::{Constraint, Trajectory, TypedName};
use crate::sexp::Item;

use super::durative::is_conjunction;
use super::{Parser, list_start};

impl Parser<'_> {
    /// Parses `(:constraints CONSTRAINT)`. Several constraints are read as a conjunction.
    pub(super) fn constraints(&mut self, section: Item<'_>, constraints: &mut Vec<Constraint>) {
        for item in section.rest() {
            self.constraint(item, &[], constraints);
        }
    }

    /// Splits a constraint at conjunctions and quantifiers outside of preferences and appends the parts to
    /// `constraints`. `outer` contains the variables of the enclosing quantifiers.
    fn constraint(&mut self, item: Item<'_>, outer: &[TypedName], constraints: &mut Vec<Constraint>) {
        if is_conjunction(item) {
            item.rest().for_each(|part| self.constraint(part, outer, constraints));
        } else if item.is_headed("forall") {
            let Some([variables, body]) = self.operands(item, "(forall (?x - type) (always (p ?x)))") else {
                return;
            };
            let variables: Vec<_> = outer.iter().cloned().chain(self.parameters(variables)).collect();
            self.constraint(body, &variables, constraints);
        } else if item.is_headed("preference") {
            let Some((Some(name), body)) = self.named_preference(item) else { return };
            let Some(trajectory) = self.trajectory(body) else { return };
            let (variables, span) = (outer.to_vec(), item.span());
            constraints.push(Constraint { variables, preference: Some(name), trajectory, span });
        } else if let Some(trajectory) = self.trajectory(item) {
            let (variables, span) = (outer.to_vec(), item.span());
            constraints.push(Constraint { variables, preference: None, trajectory, span });
        }
    }

    fn trajectory(&mut self, item: Item<'_>) -> Option<Trajectory> {
        let head = item.head().unwrap_or_default().to_ascii_lowercase();
        Some(match head.as_str() {
            "and" => Trajectory::And(item.rest().filter_map(|part| self.trajectory(part)).collect()),
            "forall" => {
                let [variables, body] = self.operands(item, "(forall (?x - type) (always (p ?x)))")?;
                Trajectory::ForAll(self.parameters(variables), Box::new(self.trajectory(body)?))
            }
            "at" => {
                let [when, body] = self.operands(item, "(at end (p))")?;
                if !when.symbol().is_some_and(|when| when.eq_ignore_ascii_case("end")) {
                    self.expected(when, "`end`");
                    return None;
                }
                Trajectory::AtEnd(self.condition(body)?)
            }
            "always" => Trajectory::Always(self.single_condition(item, "(always (p))")?),
            "sometime" => Trajectory::Sometime(self.single_condition(item, "(sometime (p))")?),
            "at-most-once" => Trajectory::AtMostOnce(self.single_condition(item, "(at-most-once (p))")?),
            "sometime-after" | "sometime-before" => {
                let [first, second] = self.operands(item, &format!("({head} (p) (q))"))?;
                let (first, second) = (self.condition(first), self.condition(second));
                if head == "sometime-after" {
                    Trajectory::SometimeAfter(first?, second?)
                } else {
                    Trajectory::SometimeBefore(first?, second?)
                }
            }
            "within" | "hold-after" => {
                let [time, body] = self.operands(item, &format!("({head} 10 (p))"))?;
                let (time, body) = (self.time(time), self.condition(body));
                if head == "within" {
                    Trajectory::Within(time?, body?)
                } else {
                    Trajectory::HoldAfter(time?, body?)
                }
            }
            "always-within" => {
                let [time, first, second] = self.operands(item, "(always-within 10 (p) (q))")?;
                let (time, first, second) = (self.time(time), self.condition(first), self.condition(second));
                Trajectory::AlwaysWithin(time?, first?, second?)
            }
            "hold-during" => {
                let [from, until, body] = self.operands(item, "(hold-during 5 10 (p))")?;
                let (from, until, body) = (self.time(from), self.time(until), self.condition(body));
                Trajectory::HoldDuring(from?, until?, body?)
            }
            "preference" => {
                self.sink.error("P106", list_start(item), "a preference cannot stand in another one");
                return None;
            }
            _ => {
                self.expected(item, "a constraint on the trajectory")
                    .help("write `(always (p))`, for example");
                return None;
            }
        })
    }

    fn single_condition(&mut self, item: Item<'_>, form: &str) -> Option<crate::ast::Condition> {
        let [body] = self.operands(item, form)?;
        self.condition(body)
    }

    fn time(&mut self, item: Item<'_>) -> Option<BigRational> {
        self.constant(item)
    }
}
