//! Lifted temporal tasks as data, and their PDDL texts.
//!
//! Predicates and functions accept objects of all types. Parameters and quantified variables are typed. A variable is identified by its
//! nesting depth: first the parameters, then quantified variables from the outermost to the innermost.

use std::fmt::Write as _;

use num_rational::Ratio;

use crate::judge::decimal;

/// Rational number for values and times. The oracles keep numerator and denominator below 2^30, so
/// that no operation overflows.
pub type Q = Ratio<i64>;

pub fn q(number: i64) -> Q {
    Q::from_integer(number)
}

pub fn big(number: Q) -> num_rational::BigRational {
    num_rational::BigRational::new((*number.numer()).into(), (*number.denom()).into())
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Term {
    Var(usize),
    Object(usize),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Atom {
    pub predicate: usize,
    pub terms: Vec<Term>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Fluent {
    pub function: usize,
    pub terms: Vec<Term>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comparison {
    Less,
    AtMost,
    Equal,
    AtLeast,
    Greater,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Expression {
    Number(Q),
    Fluent(Fluent),
    Sum(Box<Expression>, Box<Expression>),
    /// `?duration` of the action. The field is the expression that determines the duration.
    Duration(Box<Expression>),
    Product(Box<Expression>, Box<Expression>),
    Quotient(Box<Expression>, Box<Expression>),
}

#[derive(Debug, Clone, PartialEq)]
pub enum Condition {
    Atom(Atom),
    Same(Term, Term),
    Compare(Comparison, Expression, Expression),
    Not(Box<Condition>),
    All(Vec<Condition>),
    Any(Vec<Condition>),
    Imply(Box<Condition>, Box<Condition>),
    Forall(usize, Box<Condition>),
    Exists(usize, Box<Condition>),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Operation {
    Increase,
    Decrease,
    ScaleUp,
    ScaleDown,
    Assign,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Effect {
    Add(Atom),
    Delete(Atom),
    Change(Operation, Fluent, Expression),
    When(Condition, Vec<Effect>),
    Forall(usize, Vec<Effect>),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    pub condition: Condition,
    pub effects: Vec<Effect>,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Body {
    Instantaneous(Part),
    Durative { duration: Expression, start: Part, over_all: Condition, end: Part },
}

#[derive(Debug, Clone, PartialEq)]
pub struct Action {
    pub name: String,
    pub parameters: Vec<usize>,
    pub body: Body,
}

/// Rule of a derived predicate. The first variables of `condition` are the arguments of the predicate.
#[derive(Debug, Clone, PartialEq)]
pub struct Axiom {
    pub predicate: usize,
    pub condition: Condition,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Measure {
    /// Number of actions (no metric, sequential).
    Steps,
    /// Total time (no metric).
    Time,
    /// A weighted sum of `total-time` and of functions without arguments.
    Metric { maximize: bool, time: Q, functions: Vec<(Q, usize)> },
}

#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    pub types: usize,
    pub objects: Vec<usize>,
    /// Names and arities, including derived predicates.
    pub predicates: Vec<(String, usize)>,
    pub functions: Vec<(String, usize)>,
    /// Axioms in the order of their strata.
    pub axioms: Vec<Axiom>,
    pub actions: Vec<Action>,
    pub atoms: Vec<Atom>,
    pub values: Vec<(Fluent, Q)>,
    /// Timed initial literals in order of time, with one entry per time. The flag is `true` for atoms that
    /// become true.
    pub events: Vec<(Q, Vec<(bool, Atom)>)>,
    pub goal: Condition,
    pub measure: Measure,
}

pub fn number(value: Q) -> String {
    if value < q(0) { format!("(- {})", decimal(&big(-value))) } else { decimal(&big(value)) }
}

impl Task {
    /// Returns `true` if states fit into their bit sets: at most 128 atoms and 64 numbers.
    pub fn is_small(&self) -> bool {
        let instances = |(_, arity): &(String, usize)| self.objects.len().pow(*arity as u32);
        let count = |list: &[(String, usize)]| list.iter().map(instances).sum::<usize>();
        count(&self.predicates) <= 128 && count(&self.functions) <= 64
    }

    fn term(term: Term) -> String {
        match term {
            Term::Var(depth) => format!("?v{depth}"),
            Term::Object(object) => format!("o{object}"),
        }
    }

    fn call(name: &str, terms: &[Term]) -> String {
        let terms: String = terms.iter().map(|term| format!(" {}", Self::term(*term))).collect();
        format!("({name}{terms})")
    }

    fn atom(&self, atom: &Atom) -> String {
        Self::call(&self.predicates[atom.predicate].0, &atom.terms)
    }

    fn fluent(&self, fluent: &Fluent) -> String {
        Self::call(&self.functions[fluent.function].0, &fluent.terms)
    }

    fn expression(&self, expression: &Expression) -> String {
        let pair = |sign: &str, left: &Expression, right: &Expression| {
            format!("({sign} {} {})", self.expression(left), self.expression(right))
        };
        match expression {
            Expression::Number(value) => number(*value),
            Expression::Fluent(fluent) => self.fluent(fluent),
            Expression::Sum(left, right) => pair("+", left, right),
            Expression::Duration(_) => "?duration".to_owned(),
            Expression::Product(left, right) => pair("*", left, right),
            Expression::Quotient(left, right) => pair("/", left, right),
        }
    }

    /// Formats a condition as PDDL. `depth` is the number of bound variables.
    fn condition(&self, condition: &Condition, depth: usize) -> String {
        let list = |word: &str, parts: &[Condition]| {
            let parts: String =
                parts.iter().map(|part| format!(" {}", self.condition(part, depth))).collect();
            format!("({word}{parts})")
        };
        let quantified = |word: &str, kind: &usize, part: &Condition| {
            format!("({word} (?v{depth} - t{kind}) {})", self.condition(part, depth + 1))
        };
        match condition {
            Condition::Atom(atom) => self.atom(atom),
            Condition::Same(left, right) => format!("(= {} {})", Self::term(*left), Self::term(*right)),
            Condition::Compare(comparison, left, right) => {
                let sign = match comparison {
                    Comparison::Less => "<",
                    Comparison::AtMost => "<=",
                    Comparison::Equal => "=",
                    Comparison::AtLeast => ">=",
                    Comparison::Greater => ">",
                };
                format!("({sign} {} {})", self.expression(left), self.expression(right))
            }
            Condition::Not(part) => format!("(not {})", self.condition(part, depth)),
            Condition::All(parts) => list("and", parts),
            Condition::Any(parts) => list("or", parts),
            Condition::Imply(left, right) => {
                format!("(imply {} {})", self.condition(left, depth), self.condition(right, depth))
            }
            Condition::Forall(kind, part) => quantified("forall", kind, part),
            Condition::Exists(kind, part) => quantified("exists", kind, part),
        }
    }

    /// Formats an effect as PDDL. The time specifier is empty for instantaneous actions.
    fn effect(&self, effect: &Effect, time: &str, depth: usize) -> String {
        let at = |text: String| if time.is_empty() { text } else { format!("({time} {text})") };
        let list = |parts: &[Effect], depth: usize| {
            let parts: Vec<_> = parts.iter().map(|part| self.effect(part, time, depth)).collect();
            if let [part] = &parts[..] { part.clone() } else { format!("(and {})", parts.join(" ")) }
        };
        match effect {
            Effect::Add(atom) => at(self.atom(atom)),
            Effect::Delete(atom) => at(format!("(not {})", self.atom(atom))),
            Effect::Change(operation, fluent, expression) => {
                let word = match operation {
                    Operation::Increase => "increase",
                    Operation::Decrease => "decrease",
                    Operation::ScaleUp => "scale-up",
                    Operation::ScaleDown => "scale-down",
                    Operation::Assign => "assign",
                };
                at(format!("({word} {} {})", self.fluent(fluent), self.expression(expression)))
            }
            Effect::When(condition, parts) => {
                format!("(when {} {})", at(self.condition(condition, depth)), list(parts, depth))
            }
            Effect::Forall(kind, parts) => {
                format!("(forall (?v{depth} - t{kind}) {})", list(parts, depth + 1))
            }
        }
    }

    fn effects(&self, parts: &[(&str, &[Effect])], depth: usize) -> String {
        let effects = |(time, effects): &(&str, &[Effect])| {
            effects
                .iter()
                .map(|effect| format!("\n    {}", self.effect(effect, time, depth)))
                .collect::<String>()
        };
        format!("(and{})", parts.iter().map(effects).collect::<String>())
    }

    fn action(&self, action: &Action) -> String {
        let depth = action.parameters.len();
        let name = &action.name;
        let parameters: Vec<_> = action
            .parameters
            .iter()
            .enumerate()
            .map(|(depth, kind)| format!("?v{depth} - t{kind}"))
            .collect();
        let parameters = parameters.join(" ");
        match &action.body {
            Body::Instantaneous(part) => format!(
                " (:action {name} :parameters ({parameters})\n  :precondition {}\n  :effect {})\n",
                self.condition(&part.condition, depth),
                self.effects(&[("", &part.effects)], depth)
            ),
            Body::Durative { duration, start, over_all, end } => {
                let condition = |time: &str, condition: &Condition| match condition {
                    Condition::All(parts) if parts.is_empty() => String::new(),
                    condition => format!(" ({time} {})", self.condition(condition, depth)),
                };
                format!(
                    " (:durative-action {name} :parameters ({parameters})\n  :duration (= ?duration {})\n  \
                     :condition (and{}{}{})\n  :effect {})\n",
                    self.expression(duration),
                    condition("at start", &start.condition),
                    condition("over all", over_all),
                    condition("at end", &end.condition),
                    self.effects(&[("at start", &start.effects), ("at end", &end.effects)], depth)
                )
            }
        }
    }

    /// Returns `true` if a goal, an action or another axiom mentions the given predicate, which must be the
    /// last one.
    pub fn domain_uses(&self, predicate: usize) -> bool {
        let name = &self.predicates[predicate].0;
        let mut task_without = self.clone();
        task_without.axioms.retain(|axiom| axiom.predicate != predicate);
        task_without.predicates.truncate(predicate);
        let actions: String = self.actions.iter().map(|action| self.action(action)).collect();
        let axioms: String =
            task_without.axioms.iter().map(|axiom| self.condition(&axiom.condition, 2)).collect();
        (actions + &axioms + &self.condition(&self.goal, 0)).contains(&format!("({name}"))
    }

    pub fn domain(&self) -> String {
        let mut text = "(define (domain d) (:requirements :adl :fluents :durative-actions \
                        :timed-initial-literals :derived-predicates)\n (:types"
            .to_owned();
        (0..self.types).for_each(|kind| text += &format!(" t{kind}"));
        let declared = |list: &[(String, usize)]| {
            list.iter()
                .map(|(name, arity)| {
                    let arguments: String = (0..*arity).map(|at| format!(" ?x{at} - object")).collect();
                    format!(" ({name}{arguments})")
                })
                .collect::<String>()
        };
        let _ = write!(text, ")\n (:predicates{})\n", declared(&self.predicates));
        let _ = writeln!(text, " (:functions{})", declared(&self.functions));
        for axiom in &self.axioms {
            let (name, arity) = &self.predicates[axiom.predicate];
            let arguments: String = (0..*arity).map(|at| format!(" ?v{at} - object")).collect();
            let _ = writeln!(
                text,
                " (:derived ({name}{arguments}) {})",
                self.condition(&axiom.condition, *arity)
            );
        }
        self.actions.iter().for_each(|action| text += &self.action(action));
        text + ")\n"
    }

    pub fn problem(&self) -> String {
        let mut text = "(define (problem p) (:domain d)\n (:objects".to_owned();
        for (object, kind) in self.objects.iter().enumerate() {
            let _ = write!(text, " o{object} - t{kind}");
        }
        text += ")\n (:init";
        self.atoms.iter().for_each(|atom| text += &format!(" {}", self.atom(atom)));
        for (fluent, value) in &self.values {
            // Initial values must be plain numbers, so a negative value is not written as an expression.
            let value = if *value < q(0) { format!("-{}", decimal(&big(-value))) } else { number(*value) };
            let _ = write!(text, " (= {} {value})", self.fluent(fluent));
        }
        for (time, literals) in &self.events {
            for (positive, atom) in literals {
                let atom = self.atom(atom);
                let literal = if *positive { atom } else { format!("(not {atom})") };
                let _ = write!(text, " (at {} {literal})", number(*time));
            }
        }
        let _ = write!(text, ")\n (:goal {})", self.condition(&self.goal, 0));
        if let Measure::Metric { maximize, time, functions } = &self.measure {
            let mut terms: Vec<String> = Vec::new();
            let mut term = |weight: Q, call: &str| {
                terms.push(if weight == q(1) {
                    call.to_owned()
                } else {
                    format!("(* {} {call})", number(weight))
                });
            };
            if *time != q(0) {
                term(*time, "(total-time)");
            }
            functions.iter().for_each(|(weight, at)| term(*weight, &format!("({})", self.functions[*at].0)));
            let word = if *maximize { "maximize" } else { "minimize" };
            let sum = terms.into_iter().reduce(|left, right| format!("(+ {left} {right})"));
            let _ = write!(text, "\n (:metric {word} {})", sum.expect("a metric has a term"));
        }
        text + ")\n"
    }
}
