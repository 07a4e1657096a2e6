//! Constraints on trajectories: `:constraints`.

use num_rational::BigRational;

use crate::ast::{Constraint, Trajectory, TypedName};
use crate::sexp::Item;

use super::durative::is_conjunction;
use super::{Parser, list_start};

impl Parser<'_> {
    /// `(:constraints CONSTRAINT)`; several side by side are read as their conjunction.
    pub(super) fn constraints(&mut self, section: Item<'_>, found: &mut Vec<Constraint>) {
        for item in section.rest() {
            self.constraint(item, &[], found);
        }
    }

    /// Takes a constraint apart: conjunctions and quantifiers outside of preferences only gather.
    fn constraint(&mut self, item: Item<'_>, above: &[TypedName], found: &mut Vec<Constraint>) {
        if is_conjunction(item) {
            item.rest().for_each(|part| self.constraint(part, above, found));
        } else if item.is_headed("forall") {
            let Some([variables, body]) = self.operands(item, "(forall (?x - type) (always (p ?x)))") else {
                return;
            };
            let variables: Vec<_> = above.iter().cloned().chain(self.parameters(variables)).collect();
            self.constraint(body, &variables, found);
        } else if item.is_headed("preference") {
            let Some((Some(name), body)) = self.named_preference(item) else { return };
            let Some(trajectory) = self.trajectory(body) else { return };
            let (variables, span) = (above.to_vec(), item.span());
            found.push(Constraint { variables, preference: Some(name), trajectory, span });
        } else if let Some(trajectory) = self.trajectory(item) {
            let (variables, span) = (above.to_vec(), item.span());
            found.push(Constraint { variables, preference: None, trajectory, span });
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
                let [when, what] = self.operands(item, "(at end (p))")?;
                if !when.symbol().is_some_and(|when| when.eq_ignore_ascii_case("end")) {
                    self.expected(when, "`end`");
                    return None;
                }
                Trajectory::AtEnd(self.condition(what)?)
            }
            "always" => Trajectory::Always(self.only(item, "(always (p))")?),
            "sometime" => Trajectory::Sometime(self.only(item, "(sometime (p))")?),
            "at-most-once" => Trajectory::AtMostOnce(self.only(item, "(at-most-once (p))")?),
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
                let [time, what] = self.operands(item, &format!("({head} 10 (p))"))?;
                let (time, what) = (self.time(time), self.condition(what));
                if head == "within" {
                    Trajectory::Within(time?, what?)
                } else {
                    Trajectory::HoldAfter(time?, what?)
                }
            }
            "always-within" => {
                let [time, first, second] = self.operands(item, "(always-within 10 (p) (q))")?;
                let (time, first, second) = (self.time(time), self.condition(first), self.condition(second));
                Trajectory::AlwaysWithin(time?, first?, second?)
            }
            "hold-during" => {
                let [from, until, what] = self.operands(item, "(hold-during 5 10 (p))")?;
                let (from, until, what) = (self.time(from), self.time(until), self.condition(what));
                Trajectory::HoldDuring(from?, until?, what?)
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

    /// The condition of a constraint with nothing else.
    fn only(&mut self, item: Item<'_>, form: &str) -> Option<crate::ast::Condition> {
        let [what] = self.operands(item, form)?;
        self.condition(what)
    }

    fn time(&mut self, item: Item<'_>) -> Option<BigRational> {
        self.constant(item)
    }
}
