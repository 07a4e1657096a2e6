//! Parses problems.

use crate::ast::{Condition, Constraint, Identifier, Metric, Problem, Span};
use crate::sexp::Item;

use super::Parser;
use super::list_start;
use super::typed::Entries;

#[derive(Default)]
struct UniqueSections {
    domain: Option<Identifier>,
    domain_span: Option<Span>,
    goal: Option<Condition>,
    goal_span: Option<Span>,
    metric: Option<Metric>,
    metric_span: Option<Span>,
}

impl Parser<'_> {
    pub(super) fn problem(&mut self, define: Item<'_>) -> Option<Problem> {
        let (name, sections) = self.header(define, "problem")?;
        let unnamed = self.identifier("unnamed", name.span);
        let mut problem = Problem {
            name,
            domain: unnamed,
            requirements: Vec::new(),
            objects: Vec::new(),
            init: Vec::new(),
            goal: Condition::And(Vec::new()),
            constraints: Vec::new(),
            metric: None,
        };
        let mut unique = UniqueSections::default();
        for section in sections {
            self.problem_section(section, &mut problem, &mut unique);
        }
        self.missing_sections(&problem, &unique);
        if let Some(domain) = unique.domain {
            problem.domain = domain;
        }
        if let Some(goal) = unique.goal {
            problem.goal = goal;
        }
        problem.metric = unique.metric;
        Some(problem)
    }

    fn problem_section(&mut self, section: Item<'_>, problem: &mut Problem, unique: &mut UniqueSections) {
        let message_count = self.sink.len();
        let keyword = section.head().unwrap_or_default().to_ascii_lowercase();
        match keyword.as_str() {
            ":requirements" => self.requirements(section, &mut problem.requirements),
            ":objects" => {
                problem.objects.extend(self.typed_list(section.rest(), Entries::Names));
                if self.sink.len() > message_count && self.sink.has_errors() {
                    self.declarations_intact = false;
                }
            }
            ":init" => section.rest().for_each(|item| self.initial(item, &mut problem.init)),
            ":domain" => {
                if self.first(section, &mut unique.domain_span) {
                    unique.domain = self.domain_name(section);
                }
            }
            ":goal" => {
                if self.first(section, &mut unique.goal_span) {
                    unique.goal = self.goal(section, &mut problem.constraints);
                }
            }
            ":constraints" => self.constraints(section, &mut problem.constraints),
            ":metric" => {
                if self.first(section, &mut unique.metric_span) {
                    unique.metric = self.metric(section);
                }
            }
            _ => self.other_section(section, "problem"),
        }
    }

    fn first(&mut self, section: Item<'_>, place: &mut Option<Span>) -> bool {
        let span = list_start(section);
        if let Some(earlier) = place.replace(span) {
            let source = self.sink.source();
            let keyword = section.head().unwrap_or_default();
            self.sink.error("P111", span, format!("`{keyword}` is repeated")).related(
                source,
                earlier,
                "the first one is here",
            );
            return false;
        }
        true
    }

    fn domain_name(&mut self, section: Item<'_>) -> Option<Identifier> {
        let Some(item) = section.rest().next() else {
            self.sink
                .error("P106", section.span(), "the name of the domain is missing")
                .help("write `(:domain name)`");
            return None;
        };
        self.name_item(item, "a name of a domain")
    }

    /// Parses the goal and appends its preferences to `constraints`. An empty goal is true. More than one
    /// condition is an error.
    fn goal(&mut self, section: Item<'_>, constraints: &mut Vec<Constraint>) -> Option<Condition> {
        let mut items = section.rest();
        match (items.next(), items.next()) {
            (None, _) => Some(Condition::And(Vec::new())),
            (Some(item), None) => self.goal_condition(item, constraints),
            (Some(_), Some(second)) => {
                self.sink
                    .error("P108", super::at_start(second), "a goal is one condition")
                    .help("write `(:goal (and (p) (q)))`");
                None
            }
        }
    }

    fn missing_sections(&mut self, problem: &Problem, unique: &UniqueSections) {
        if self.has_unknown_section {
            return;
        }
        let place = problem.name.span;
        if unique.domain_span.is_none() {
            self.sink.error("P110", place, "the problem has no `:domain`").help("write `(:domain name)`");
        }
        if unique.goal_span.is_none() {
            self.sink.error("P110", place, "the problem has no `:goal`").help("write `(:goal (and …))`");
        }
    }
}
