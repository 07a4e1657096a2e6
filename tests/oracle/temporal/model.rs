//! A lifted temporal task as a structure of its own, and its PDDL text.
//!
//! Predicates and functions take objects of any type; parameters and quantified variables are typed. A variable is its depth: the
//! parameters come first, then quantified variables from the outside to the inside.

use std::fmt::Write as _;

use num_rational::Ratio;

use crate::judge::decimal;

/// Numbers of tasks and times. All operations are followed by a check that numerator and denominator stay below 2^30, so none
/// overflows.
pub type Q = Ratio<i64>;

/// A number from an integer.
pub fn q(number: i64) -> Q {
    Q::from_integer(number)
}

/// The same number in any size.
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
    /// `?duration` of the action, which takes this long.
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
    /// For each object of a type.
    Forall(usize, Box<Condition>),
    /// For some object of a type.
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
    /// For each object of a type.
    Forall(usize, Vec<Effect>),
}

/// Conditions and effects of one end of an action.
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
    /// The types of the parameters.
    pub parameters: Vec<usize>,
    pub body: Body,
}

/// A derived predicate, true where its condition is; the arguments are the first variables.
#[derive(Debug, Clone, PartialEq)]
pub struct Axiom {
    pub predicate: usize,
    pub condition: Condition,
}

/// What plans are measured by.
#[derive(Debug, Clone, PartialEq)]
pub enum Measure {
    /// The number of actions, without a metric.
    Steps,
    /// The time, without a metric.
    Time,
    /// Weights of `total-time` and of functions without arguments.
    Metric { maximize: bool, time: Q, functions: Vec<(Q, usize)> },
}

#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    pub types: usize,
    /// The type of each object.
    pub objects: Vec<usize>,
    /// Name and number of arguments. Derived ones are named by an axiom.
    pub predicates: Vec<(String, usize)>,
    pub functions: Vec<(String, usize)>,
    /// In the order of their strata.
    pub axioms: Vec<Axiom>,
    pub actions: Vec<Action>,
    pub atoms: Vec<Atom>,
    pub values: Vec<(Fluent, Q)>,
    /// In order of time, each time once: what becomes true, or false.
    pub events: Vec<(Q, Vec<(bool, Atom)>)>,
    pub goal: Condition,
    pub measure: Measure,
}

/// A number as PDDL writes it.
pub fn number(value: Q) -> String {
    if value < q(0) { format!("(- {})", decimal(&big(-value))) } else { decimal(&big(value)) }
}

impl Task {
    /// Whether states fit what they are kept in: 128 atoms, 64 values.
    pub fn is_small(&self) -> bool {
        let instances = |(_, arity): &(String, usize)| self.objects.len().pow(*arity as u32);
        let all = |list: &[(String, usize)]| list.iter().map(instances).sum::<usize>();
        all(&self.predicates) <= 128 && all(&self.functions) <= 64
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

    /// `depth` is how many variables are bound.
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

    /// An effect at a time, which is empty for instantaneous actions.
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

    /// Whether anything but its own axiom mentions the last predicate.
    pub fn domain_uses(&self, predicate: usize) -> bool {
        let name = &self.predicates[predicate].0;
        let mut others = self.clone();
        others.axioms.retain(|axiom| axiom.predicate != predicate);
        others.predicates.truncate(predicate);
        let actions: String = self.actions.iter().map(|action| self.action(action)).collect();
        let axioms: String = others.axioms.iter().map(|axiom| self.condition(&axiom.condition, 2)).collect();
        (actions + &axioms + &self.condition(&self.goal, 0)).contains(&format!("({name}"))
    }

    /// The PDDL domain.
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

    /// The PDDL problem.
    pub fn problem(&self) -> String {
        let mut text = "(define (problem p) (:domain d)\n (:objects".to_owned();
        for (object, kind) in self.objects.iter().enumerate() {
            let _ = write!(text, " o{object} - t{kind}");
        }
        text += ")\n (:init";
        self.atoms.iter().for_each(|atom| text += &format!(" {}", self.atom(atom)));
        for (fluent, value) in &self.values {
            // Initial values are literals.
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
