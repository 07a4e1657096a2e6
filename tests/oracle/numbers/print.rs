//! Prints a task as PDDL: the texts of its domain and its problem.

use std::fmt::Write as _;

use super::model::{
    Action, Applied, Change, Condition, Effect, Expr, Happening, Number, Relation, Symbol, Task, Term,
    text_of,
};

pub fn print(task: &Task) -> (String, String) {
    let problem = problem(task);
    (domain(task, &problem), problem)
}

/// Unused predicates and functions are not declared.
fn domain(task: &Task, problem: &str) -> String {
    let mut actions = String::new();
    for action in &task.actions {
        actions += &Printer { task, parameters: &action.parameters }.action(action);
    }
    let is_used = |symbol: &&Symbol| {
        let forms = [format!("({} ", symbol.name), format!("({})", symbol.name)];
        forms.iter().any(|form| actions.contains(form) || problem.contains(form))
    };
    let timed = if task.is_timed() { " :durative-actions" } else { "" };
    let mut text = format!(
        "(define (domain d)\n  (:requirements :typing :fluents :negative-preconditions :disjunctive-preconditions \
         :equality :conditional-effects{timed})\n  (:types {})\n  (:predicates",
        task.types.join(" ")
    );
    for predicate in task.predicates.iter().filter(is_used) {
        text += &declaration(task, predicate);
    }
    text += ")\n";
    if task.functions.iter().any(|function| is_used(&function)) {
        text += "  (:functions";
        for function in task.functions.iter().filter(is_used) {
            text += &declaration(task, function);
        }
        text += ")\n";
    }
    text + &actions + ")\n"
}

fn declaration(task: &Task, symbol: &Symbol) -> String {
    let mut text = format!(" ({}", symbol.name);
    for (position, kind) in symbol.types.iter().enumerate() {
        let _ = write!(text, " ?v{position} - {}", task.types[*kind]);
    }
    text + ")"
}

fn problem(task: &Task) -> String {
    let printer = Printer { task, parameters: &[] };
    let mut text = "(define (problem p) (:domain d)\n  (:objects".to_owned();
    for (name, kind) in &task.objects {
        let _ = write!(text, " {name} - {}", task.types[*kind]);
    }
    text += ")\n  (:init";
    let names = |objects: &[usize]| {
        objects.iter().fold(String::new(), |text, object| text + " " + task.objects[*object].0.as_str())
    };
    for (predicate, objects) in &task.atoms {
        let _ = write!(text, " ({}{})", task.predicates[*predicate].name, names(objects));
    }
    for (function, objects, value) in &task.values {
        let value = text_of(value).expect("an initial value is a decimal");
        let _ = write!(text, "\n    (= ({}{}) {value})", task.functions[*function].name, names(objects));
    }
    let _ = write!(text, ")\n  (:goal {})", printer.all(&task.goal));
    if let Some((maximize, metric)) = &task.metric {
        let direction = if *maximize { "maximize" } else { "minimize" };
        let _ = write!(text, "\n  (:metric {direction} {})", printer.expression(metric));
    }
    text + ")\n"
}

pub fn objective(task: &Task, expression: &Expr) -> String {
    Printer { task, parameters: &[] }.expression(expression)
}

struct Printer<'t> {
    task: &'t Task,
    parameters: &'t [(String, usize)],
}

impl Printer<'_> {
    fn action(&self, action: &Action) -> String {
        let parameters: Vec<String> = self
            .parameters
            .iter()
            .map(|(name, kind)| format!("?{name} - {}", self.task.types[*kind]))
            .collect();
        let (name, parameters) = (&action.name, parameters.join(" "));
        let Some(lasting) = &action.lasting else {
            return format!(
                "  (:action {name} :parameters ({parameters})\n    :precondition {}\n    :effect {})\n",
                self.all(&action.start.conditions),
                self.effects(&action.start.effects)
            );
        };
        let timed = |moment: &str, conditions: &[Condition]| -> String {
            conditions
                .iter()
                .fold(String::new(), |text, c| text + &format!(" ({moment} {})", self.condition(c)))
        };
        let effects = |moment: &str, happening: &Happening| -> String {
            let items = happening.effects.iter();
            items.fold(String::new(), |text, e| text + &format!(" ({moment} {})", self.effect(e)))
        };
        format!(
            "  (:durative-action {name} :parameters ({parameters})\n    :duration (= ?duration {})\n    \
             :condition (and{}{}{})\n    :effect (and{}{}))\n",
            self.expression(&lasting.duration),
            timed("at start", &action.start.conditions),
            timed("over all", &lasting.over_all),
            timed("at end", &lasting.end.conditions),
            effects("at start", &action.start),
            effects("at end", &lasting.end),
        )
    }

    fn term(&self, term: Term) -> String {
        match term {
            Term::Parameter(position) => format!("?{}", self.parameters[position].0),
            Term::Object(object) => self.task.objects[object].0.clone(),
        }
    }

    fn applied(&self, name: &str, symbol: &Applied) -> String {
        symbol.arguments.iter().fold(format!("({name}"), |text, term| text + " " + &self.term(*term)) + ")"
    }

    fn atom(&self, applied: &Applied) -> String {
        self.applied(&self.task.predicates[applied.symbol].name, applied)
    }

    fn function(&self, applied: &Applied) -> String {
        self.applied(&self.task.functions[applied.symbol].name, applied)
    }

    fn all(&self, conditions: &[Condition]) -> String {
        conditions.iter().fold("(and".to_owned(), |text, c| text + " " + &self.condition(c)) + ")"
    }

    fn condition(&self, condition: &Condition) -> String {
        match condition {
            Condition::Holds(atom) => self.atom(atom),
            Condition::Not(inner) => format!("(not {})", self.condition(inner)),
            Condition::Any(parts) => {
                parts.iter().fold("(or".to_owned(), |text, c| text + " " + &self.condition(c)) + ")"
            }
            Condition::Same(left, right) => format!("(= {} {})", self.term(*left), self.term(*right)),
            Condition::Compare(relation, left, right) => {
                let relation = match relation {
                    Relation::Less => "<",
                    Relation::AtMost => "<=",
                    Relation::Equal => "=",
                    Relation::AtLeast => ">=",
                    Relation::Greater => ">",
                };
                format!("({relation} {} {})", self.expression(left), self.expression(right))
            }
            Condition::Open(..) => unreachable!("thresholds are chosen before a task is printed"),
        }
    }

    fn effects(&self, effects: &[Effect]) -> String {
        effects.iter().fold("(and".to_owned(), |text, effect| text + " " + &self.effect(effect)) + ")"
    }

    fn effect(&self, effect: &Effect) -> String {
        match effect {
            Effect::Add(atom) => self.atom(atom),
            Effect::Delete(atom) => format!("(not {})", self.atom(atom)),
            Effect::Number(change, function, value) => {
                let change = match change {
                    Change::Assign => "assign",
                    Change::Increase => "increase",
                    Change::Decrease => "decrease",
                    Change::ScaleUp => "scale-up",
                    Change::ScaleDown => "scale-down",
                };
                format!("({change} {} {})", self.function(function), self.expression(value))
            }
            Effect::When(conditions, effects) => {
                format!("(when {} {})", self.all(conditions), self.effects(effects))
            }
        }
    }

    fn expression(&self, expression: &Expr) -> String {
        let list = |operator: &str, parts: &[Expr]| {
            parts.iter().fold(format!("({operator}"), |text, e| text + " " + &self.expression(e)) + ")"
        };
        match expression {
            Expr::Number(value) => number(value),
            Expr::Function(applied) => self.function(applied),
            Expr::Sum(parts) => list("+", parts),
            Expr::Product(parts) => list("*", parts),
            Expr::Minus(left, right) => list("-", &[(**left).clone(), (**right).clone()]),
            Expr::Quotient(left, right) => list("/", &[(**left).clone(), (**right).clone()]),
            Expr::Negative(inner) => format!("(- {})", self.expression(inner)),
            Expr::TotalTime => "(total-time)".to_owned(),
        }
    }
}

/// Formats a number as a decimal if [`text_of`] can, otherwise as a quotient of integers.
fn number(value: &Number) -> String {
    text_of(value).unwrap_or_else(|| format!("(/ {} {})", value.numer(), value.denom()))
}
