//! A small lifted task as plain data, and its conversion to PDDL.
//!
//! There are three objects and a few predicates and functions with fixed names. Only the actions, axioms,
//! initial state, timed literals, goal and metric vary. A variable is a number: the count of quantified
//! variables and parameters in scope where it is bound, e.g. 0 for the first parameter.

use std::collections::{BTreeMap, BTreeSet};

use num_rational::Ratio;

pub type Number = Ratio<i128>;
/// A predicate or function (as an index) applied to objects.
pub type Atom = (usize, Vec<usize>);

/// The objects: a thing, a thing that is a part, and a tool.
pub const OBJECTS: [(&str, &str); 3] = [("o0", "thing"), ("o1", "part"), ("0.5_tool", "tool")];

/// Name and number of arguments of each predicate.
pub const PREDICATES: [(&str, usize); 8] =
    [("p", 0), ("q", 1), ("Q-r", 2), ("s", 1), ("t", 2), ("d", 1), ("w", 2), ("e", 1)];
/// Indices of the predicates that actions change.
pub const FLUENTS: [usize; 3] = [0, 1, 2];
/// Indices of the predicates that no action changes (timed literals may change them).
pub const STATICS: [usize; 2] = [3, 4];
/// Indices of the derived predicates that depend on each other only positively.
pub const DERIVED: [usize; 2] = [5, 6];
/// Index of the derived predicate that may depend on all others, also negatively.
pub const UPPER: usize = 7;

/// Name and number of arguments of each function.
pub const FUNCTIONS: [(&str, usize); 5] = [("f", 0), ("g", 1), ("total-cost", 0), ("c", 1), ("k", 0)];
/// Indices of the functions that actions change, except `total-cost`.
pub const CHANGING: [usize; 2] = [0, 1];
pub const TOTAL_COST: usize = 2;
/// Indices of the static functions, which only the initial state sets.
pub const CONSTANT: [usize; 2] = [3, 4];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Range {
    Object,
    Thing,
    Part,
    Either,
}

impl Range {
    pub fn objects(self) -> &'static [usize] {
        match self {
            Self::Object => &[0, 1, 2],
            Self::Thing => &[0, 1],
            Self::Part => &[1],
            Self::Either => &[1, 2],
        }
    }

    fn text(self) -> &'static str {
        match self {
            Self::Object => "object",
            Self::Thing => "thing",
            Self::Part => "part",
            Self::Either => "(either part tool)",
        }
    }
}

#[derive(Debug, Clone, Copy)]
pub enum Term {
    Object(usize),
    Variable(usize),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    Less,
    LessOrEqual,
    Equal,
    GreaterOrEqual,
    Greater,
}

impl Sign {
    pub fn holds(self, left: Number, right: Number) -> bool {
        match self {
            Self::Less => left < right,
            Self::LessOrEqual => left <= right,
            Self::Equal => left == right,
            Self::GreaterOrEqual => left >= right,
            Self::Greater => left > right,
        }
    }

    fn text(self) -> &'static str {
        match self {
            Self::Less => "<",
            Self::LessOrEqual => "<=",
            Self::Equal => "=",
            Self::GreaterOrEqual => ">=",
            Self::Greater => ">",
        }
    }
}

#[derive(Debug, Clone)]
pub enum Expression {
    Number(Number),
    Function(usize, Vec<Term>),
    Duration,
    TotalTime,
    Sum(Vec<Expression>),
    Difference(Box<Expression>, Box<Expression>),
    Negative(Box<Expression>),
    Product(Box<Expression>, Box<Expression>),
    Quotient(Box<Expression>, Box<Expression>),
}

#[derive(Debug, Clone)]
pub enum Formula {
    Fact(usize, Vec<Term>),
    Equal(Term, Term),
    Compare(Sign, Expression, Expression),
    Not(Box<Formula>),
    And(Vec<Formula>),
    Or(Vec<Formula>),
    Imply(Box<Formula>, Box<Formula>),
    Exists(Range, Box<Formula>),
    ForAll(Range, Box<Formula>),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    Assign,
    Increase,
    Decrease,
    ScaleUp,
    ScaleDown,
}

#[derive(Debug, Clone)]
pub enum Effect {
    And(Vec<Effect>),
    Add(usize, Vec<Term>),
    Delete(usize, Vec<Term>),
    Change(Way, usize, Vec<Term>, Expression),
    When(Formula, Box<Effect>),
    ForAll(Range, Box<Effect>),
}

/// An action. An instantaneous action uses only its condition and effects at the start.
#[derive(Debug, Clone)]
pub struct Action {
    pub parameters: Vec<Range>,
    /// Bounds of `?duration`; a bound with the flag `true` is evaluated at the end.
    pub duration: Option<Vec<(bool, Sign, Expression)>>,
    pub at_start: Formula,
    pub over_all: Formula,
    pub at_end: Formula,
    pub start_effects: Vec<Effect>,
    pub end_effects: Vec<Effect>,
}

#[derive(Debug, Clone)]
pub struct Task {
    pub axioms: Vec<(usize, Formula)>,
    pub actions: Vec<Action>,
    pub facts: BTreeSet<Atom>,
    pub values: BTreeMap<Atom, Number>,
    /// Timed literals: time, atom, and whether the atom becomes true.
    pub timed: Vec<(Number, Atom, bool)>,
    pub goal: Formula,
    /// Metric: `true` for maximisation, and the expression.
    pub metric: Option<(bool, Expression)>,
}

fn join<T>(parts: &[T], text: impl Fn(&T) -> String) -> String {
    parts.iter().map(text).collect::<Vec<_>>().join(" ")
}

fn term(term: Term) -> String {
    match term {
        Term::Object(object) => OBJECTS[object].0.to_owned(),
        Term::Variable(variable) => format!("?v{variable}"),
    }
}

fn applied(name: &str, terms: &[Term]) -> String {
    let words: Vec<_> = std::iter::once(name.to_owned()).chain(terms.iter().map(|one| term(*one))).collect();
    format!("({})", words.join(" "))
}

pub fn number(value: Number) -> String {
    match (*value.numer(), *value.denom()) {
        (numerator, 1) => numerator.to_string(),
        (numerator, 2) => format!("{}{}.5", if numerator < 0 { "-" } else { "" }, numerator.abs() / 2),
        (numerator, denominator) => format!("(/ {numerator} {denominator})"),
    }
}

impl Expression {
    fn text(&self) -> String {
        match self {
            Self::Number(value) => number(*value),
            Self::Function(function, terms) => applied(FUNCTIONS[*function].0, terms),
            Self::Duration => "?duration".to_owned(),
            Self::TotalTime => "(total-time)".to_owned(),
            Self::Sum(parts) => format!("(+ {})", join(parts, Self::text)),
            Self::Difference(left, right) => format!("(- {} {})", left.text(), right.text()),
            Self::Negative(inner) => format!("(- {})", inner.text()),
            Self::Product(left, right) => format!("(* {} {})", left.text(), right.text()),
            Self::Quotient(left, right) => format!("(/ {} {})", left.text(), right.text()),
        }
    }
}

fn bound(range: Range, depth: usize) -> String {
    format!("(?v{depth} - {})", range.text())
}

impl Formula {
    /// Formats a formula as PDDL. `depth` is the number of variables bound around the formula.
    pub fn text(&self, depth: usize) -> String {
        match self {
            Self::Fact(predicate, terms) => applied(PREDICATES[*predicate].0, terms),
            Self::Equal(left, right) => format!("(= {} {})", term(*left), term(*right)),
            Self::Compare(sign, left, right) => format!("({} {} {})", sign.text(), left.text(), right.text()),
            Self::Not(inner) => format!("(not {})", inner.text(depth)),
            Self::And(parts) => format!("(and {})", join(parts, |part| part.text(depth))),
            Self::Or(parts) => format!("(or {})", join(parts, |part| part.text(depth))),
            Self::Imply(left, right) => format!("(imply {} {})", left.text(depth), right.text(depth)),
            Self::Exists(range, body) => {
                format!("(exists {} {})", bound(*range, depth), body.text(depth + 1))
            }
            Self::ForAll(range, body) => {
                format!("(forall {} {})", bound(*range, depth), body.text(depth + 1))
            }
        }
    }
}

impl Effect {
    fn text(&self, depth: usize) -> String {
        match self {
            Self::And(parts) => format!("(and {})", join(parts, |part| part.text(depth))),
            Self::Add(predicate, terms) => applied(PREDICATES[*predicate].0, terms),
            Self::Delete(predicate, terms) => format!("(not {})", applied(PREDICATES[*predicate].0, terms)),
            Self::Change(way, function, terms, value) => {
                let head = match way {
                    Way::Assign => "assign",
                    Way::Increase => "increase",
                    Way::Decrease => "decrease",
                    Way::ScaleUp => "scale-up",
                    Way::ScaleDown => "scale-down",
                };
                format!("({head} {} {})", applied(FUNCTIONS[*function].0, terms), value.text())
            }
            Self::When(condition, body) => format!("(when {} {})", condition.text(depth), body.text(depth)),
            Self::ForAll(range, body) => {
                format!("(forall {} {})", bound(*range, depth), body.text(depth + 1))
            }
        }
    }
}

impl Effect {
    fn is_conditional(&self) -> bool {
        match self {
            Self::And(parts) => parts.iter().any(Self::is_conditional),
            Self::When(..) => true,
            Self::ForAll(_, body) => body.is_conditional(),
            Self::Add(..) | Self::Delete(..) | Self::Change(..) => false,
        }
    }
}

impl Action {
    pub fn is_conditional(&self) -> bool {
        self.start_effects.iter().chain(&self.end_effects).any(Effect::is_conditional)
    }

    fn text(&self, index: usize) -> String {
        let depth = self.parameters.len();
        let parameters =
            self.parameters.iter().enumerate().map(|(at, range)| format!("?v{at} - {}", range.text()));
        let head = format!("a{index} :parameters ({})", parameters.collect::<Vec<_>>().join(" "));
        let Some(duration) = &self.duration else {
            let effects = join(&self.start_effects, |effect| effect.text(depth));
            return format!(
                "(:action {head}\n :precondition {}\n :effect (and {effects}))",
                self.at_start.text(depth)
            );
        };
        let bounds = join(duration, |(at_end, sign, value)| {
            let bound = format!("({} ?duration {})", sign.text(), value.text());
            if *at_end { format!("(at end {bound})") } else { bound }
        });
        let at = |when: &str, effects: &[Effect]| {
            join(effects, |effect| format!("(at {when} {})", effect.text(depth)))
        };
        format!(
            "(:durative-action {head} :duration (and {bounds})
 :condition (and (at start {}) (over all {}) (at end {}))
 :effect (and {} {}))",
            self.at_start.text(depth),
            self.over_all.text(depth),
            self.at_end.text(depth),
            at("start", &self.start_effects),
            at("end", &self.end_effects),
        )
    }
}

fn ground_text(name: &str, arguments: &[usize]) -> String {
    applied(name, &arguments.iter().map(|object| Term::Object(*object)).collect::<Vec<_>>())
}

/// Formats an atom as in messages and ground tasks, e.g. `(q o0)`.
pub fn fact_text((predicate, arguments): &Atom) -> String {
    ground_text(PREDICATES[*predicate].0, arguments)
}

pub fn function_text((function, arguments): &Atom) -> String {
    ground_text(FUNCTIONS[*function].0, arguments)
}

fn objects_of(arity: usize) -> String {
    join(&(0..arity).collect::<Vec<_>>(), |at| format!("?v{at} - object"))
}

impl Task {
    pub fn domain(&self) -> String {
        let declared =
            |names: &[(&str, usize)]| join(names, |(name, arity)| format!("({name} {})", objects_of(*arity)));
        let axioms = join(&self.axioms, |(head, body)| {
            let arity = PREDICATES[*head].1;
            format!("(:derived ({} {}) {})\n", PREDICATES[*head].0, objects_of(arity), body.text(arity))
        });
        let actions: Vec<_> =
            self.actions.iter().enumerate().map(|(index, action)| action.text(index)).collect();
        format!(
            "(define (domain d)\n(:types part - thing thing tool - object)\n(:predicates {})\n(:functions {})\n{axioms}\n{})",
            declared(&PREDICATES),
            declared(&FUNCTIONS),
            actions.join("\n"),
        )
    }

    pub fn problem(&self) -> String {
        let objects = join(&OBJECTS, |(name, r#type)| format!("{name} - {type}"));
        let facts = self.facts.iter().map(fact_text);
        let values =
            self.values.iter().map(|(atom, value)| format!("(= {} {})", function_text(atom), number(*value)));
        let timed = self.timed.iter().map(|(time, atom, holds)| {
            let fact = fact_text(atom);
            format!("(at {} {})", number(*time), if *holds { fact } else { format!("(not {fact})") })
        });
        let init = facts.chain(values).chain(timed).collect::<Vec<_>>().join(" ");
        let metric = self.metric.as_ref().map_or(String::new(), |(maximize, value)| {
            format!("\n(:metric {} {})", if *maximize { "maximize" } else { "minimize" }, value.text())
        });
        let goal = self.goal.text(0);
        format!(
            "(define (problem p) (:domain d)\n(:objects {objects})\n(:init {init})\n(:goal {goal}){metric})"
        )
    }
}
