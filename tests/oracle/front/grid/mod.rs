//! Samples with concurrent actions at integer times: constraints and preferences of PDDL 3, and chosen
//! durations.
//!
//! The oracle executes plans of a few actions by the definitions of PDDL 2.1 and PDDL 3. It enumerates only
//! plans with integer times, so the optimum can be better than the oracle's best plan, but not worse.

mod execute;

use std::fmt::Write as _;

use fastrand::Rng;
use metaplan::mission::Mission;
use num_rational::BigRational;

use super::{Reference, Sample, whole};
use crate::judge::{Mode, read};
use execute::PAID;

/// Names of facts and of numbers. The third number (`total-cost`) has no entry.
const FACTS: [&str; 3] = ["(p)", "(q)", "(h)"];
const NUMBERS: [&str; 2] = ["(fuel)", "(charge)"];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct State {
    facts: u8,
    numbers: [i64; 3],
}

#[derive(Debug, Clone)]
enum Formula {
    Fact(usize, bool),
    AtLeast(usize, i64),
    AtMost(usize, i64),
    And(Box<Formula>, Box<Formula>),
    Or(Box<Formula>, Box<Formula>),
}

/// A linear function of the duration: constant and factor.
#[derive(Debug, Clone, Copy)]
struct Amount(i64, i64);

#[derive(Debug, Clone)]
enum Effect {
    Set(usize, bool),
    Increase(usize, Amount),
    Assign(usize, Amount),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Moment {
    Start,
    OverAll,
    End,
}

#[derive(Debug, Clone)]
struct Action {
    /// Minimum and maximum duration; `None` for an instantaneous action.
    durations: Option<(i64, i64)>,
    /// Whether the duration is also limited by `(charge)` + 1.
    is_bounded_by_charge: bool,
    conditions: Vec<(Moment, Formula)>,
    effects: Vec<(Moment, Effect)>,
}

#[derive(Debug, Clone)]
struct Constraint {
    kind: &'static str,
    first: Formula,
    second: Formula,
    time: i64,
    is_soft: bool,
}

#[derive(Debug)]
struct Task {
    actions: [Action; 3],
    initial: State,
    goal: Vec<Formula>,
    constraints: Vec<Constraint>,
    wish: Option<(Formula, i64)>,
    /// Weight in the metric of each violated soft constraint.
    weight: i64,
    is_paid: bool,
}

impl Formula {
    fn text(&self) -> String {
        match self {
            Self::Fact(fact, true) => FACTS[*fact].to_owned(),
            Self::Fact(fact, false) => format!("(not {})", FACTS[*fact]),
            Self::AtLeast(number, least) => format!("(>= {} {least})", NUMBERS[*number]),
            Self::AtMost(number, most) => format!("(<= {} {most})", NUMBERS[*number]),
            Self::And(left, right) => format!("(and {} {})", left.text(), right.text()),
            Self::Or(left, right) => format!("(or {} {})", left.text(), right.text()),
        }
    }
}

impl Amount {
    fn text(self) -> String {
        match self {
            Self(constant, 0) => constant.to_string(),
            Self(0, factor) => format!("(* {factor} ?duration)"),
            Self(constant, factor) => format!("(+ {constant} (* {factor} ?duration))"),
        }
    }
}

impl Effect {
    fn text(&self) -> String {
        let number = |number: &usize| if *number == PAID { "(total-cost)" } else { NUMBERS[*number] };
        match self {
            Self::Set(fact, value) => Formula::Fact(*fact, *value).text(),
            // This case covers `decrease`, which is not drawn as an operator of its own.
            Self::Increase(index, Amount(constant, factor)) if *constant <= 0 && *factor <= 0 => {
                format!("(decrease {} {})", number(index), Amount(-constant, -factor).text())
            }
            Self::Increase(index, amount) => format!("(increase {} {})", number(index), amount.text()),
            Self::Assign(index, amount) => format!("(assign {} {})", number(index), amount.text()),
        }
    }
}

impl Task {
    fn domain(&self) -> String {
        let mut text =
            "(define (domain d) (:predicates (p) (q) (h)) (:functions (fuel) (charge) (total-cost))\n"
                .to_owned();
        for (number, action) in self.actions.iter().enumerate() {
            let Some((least, most)) = action.durations else {
                let conditions: String = action.conditions.iter().map(|(_, item)| item.text()).collect();
                let effects: String = action.effects.iter().map(|(_, item)| item.text()).collect();
                let _ = writeln!(
                    text,
                    "(:action a{number} :parameters () :precondition (and {conditions}) :effect (and {effects}))"
                );
                continue;
            };
            let at = |moment: &Moment| match moment {
                Moment::Start => "at start",
                Moment::OverAll => "over all",
                Moment::End => "at end",
            };
            let conditions =
                action.conditions.iter().map(|(moment, item)| format!("({} {})", at(moment), item.text()));
            let effects =
                action.effects.iter().map(|(moment, item)| format!("({} {})", at(moment), item.text()));
            let by_charge = if action.is_bounded_by_charge { "(<= ?duration (+ (charge) 1))" } else { "" };
            let duration = if least == most && !action.is_bounded_by_charge {
                format!("(= ?duration {least})")
            } else {
                format!("(and (>= ?duration {least}) (<= ?duration {most}) {by_charge})")
            };
            let _ = writeln!(
                text,
                "(:durative-action a{number} :parameters () :duration {duration}
                   :condition (and {}) :effect (and {}))",
                conditions.collect::<String>(),
                effects.collect::<String>()
            );
        }
        text + ")"
    }

    fn problem(&self) -> String {
        let facts: String =
            (0..3).filter(|fact| self.initial.facts >> fact & 1 == 1).map(|fact| FACTS[fact]).collect();
        let [fuel, charge, paid] = self.initial.numbers;
        let mut goal: String = self.goal.iter().map(Formula::text).collect();
        let mut metric = "(total-time)".to_owned();
        if self.is_paid {
            metric += " (total-cost)";
        }
        if let Some((wish, weight)) = &self.wish {
            let _ = write!(goal, "(preference v {})", wish.text());
            let _ = write!(metric, " (* {weight} (is-violated v))");
        }
        if self.constraints.iter().any(|constraint| constraint.is_soft) {
            let _ = write!(metric, " (* {} (is-violated w))", self.weight);
        }
        let constraints: String = self.constraints.iter().map(Constraint::text).collect();
        let constraints =
            if constraints.is_empty() { constraints } else { format!("(:constraints (and {constraints}))") };
        format!(
            "(define (problem n) (:domain d)
               (:init {facts} (= (fuel) {fuel}) (= (charge) {charge}) (= (total-cost) {paid}))
               (:goal (and {goal})) {constraints} (:metric minimize (+ 0 {metric})))"
        )
    }

    fn sample(&self, rng: &mut Rng) -> Sample {
        let (domain, problem) = (self.domain(), self.problem());
        let (mission, _): (Mission, _) =
            read(&domain, &problem).unwrap_or_else(|messages| panic!("{messages:#?}\n{domain}\n{problem}"));
        // The separation is the unit of the grid, so interfering happenings of a plan with integer times are
        // far enough apart.
        let separation = BigRational::from_integer(1.into());
        Sample {
            mission,
            mode: Mode::Concurrent(separation),
            maximize: false,
            reference: Reference::Some(self.best(rng).map(whole)),
        }
    }
}

impl Constraint {
    fn text(&self) -> String {
        let (first, second) = (self.first.text(), self.second.text());
        let text = match self.kind {
            "within" => format!("(within {} {first})", self.time),
            "always-within" => format!("(always-within {} {first} {second})", self.time),
            kind if kind.starts_with("sometime-") => format!("({kind} {first} {second})"),
            kind => format!("({kind} {first})"),
        };
        if self.is_soft { format!("(preference w {text})") } else { text }
    }
}

fn literal(rng: &mut Rng) -> Formula {
    Formula::Fact(rng.usize(0..3), rng.u32(0..3) > 0)
}

fn formula(rng: &mut Rng) -> Formula {
    match rng.u32(0..4) {
        0 => Formula::And(Box::new(literal(rng)), Box::new(literal(rng))),
        1 => Formula::Or(Box::new(literal(rng)), Box::new(literal(rng))),
        _ => literal(rng),
    }
}

fn set(rng: &mut Rng) -> Effect {
    Effect::Set(rng.usize(0..3), rng.u32(0..3) > 0)
}

pub fn trajectories(seed: u64) -> Sample {
    let mut rng = Rng::with_seed(seed);
    let rng = &mut rng;
    let actions = [0; 3].map(|_| {
        if rng.u32(0..3) == 0 {
            return Action {
                durations: None,
                is_bounded_by_charge: false,
                conditions: vec![(Moment::Start, literal(rng))],
                effects: vec![(Moment::Start, set(rng))],
            };
        }
        let duration = rng.i64(1..3);
        let moment = |rng: &mut Rng| if rng.bool() { Moment::Start } else { Moment::End };
        let condition_moment = if rng.bool() { Moment::Start } else { Moment::OverAll };
        Action {
            durations: Some((duration, duration)),
            is_bounded_by_charge: false,
            conditions: vec![(condition_moment, literal(rng))],
            effects: vec![(moment(rng), set(rng)), (moment(rng), set(rng))],
        }
    });
    let kinds = [
        "at end",
        "always",
        "sometime",
        "at-most-once",
        "sometime-after",
        "sometime-before",
        "within",
        "always-within",
    ];
    let constraints = (0..rng.usize(1..4)).map(|_| Constraint {
        kind: kinds[rng.usize(0..kinds.len())],
        first: formula(rng),
        second: formula(rng),
        time: rng.i64(0..5),
        is_soft: rng.u32(0..3) > 0,
    });
    let constraints = constraints.collect();
    let task = Task {
        actions,
        initial: State { facts: rng.u8(0..8), numbers: [0; 3] },
        goal: vec![literal(rng)],
        constraints,
        wish: rng.bool().then(|| (formula(rng), rng.i64(1..4))),
        weight: rng.i64(1..5),
        is_paid: false,
    };
    task.sample(rng)
}

pub fn durations(seed: u64) -> Sample {
    let mut rng = Rng::with_seed(seed);
    let rng = &mut rng;
    let condition = |rng: &mut Rng| match rng.u32(0..6) {
        0 => Formula::AtMost(0, rng.i64(1..4)),
        1 | 2 => Formula::AtLeast(0, rng.i64(1..5)),
        _ => literal(rng),
    };
    let effect = |rng: &mut Rng, is_durative: bool| match rng.u32(0..9) {
        0 | 1 if is_durative => Effect::Increase(0, Amount(0, rng.i64(1..4))),
        2 if is_durative => Effect::Increase(0, Amount(0, -1)),
        3 if is_durative => Effect::Assign(1, Amount(4, -1)),
        4 => Effect::Increase(0, Amount(-rng.i64(1..3), 0)),
        5 => Effect::Increase(1, Amount(rng.i64(1..3), 0)),
        _ => set(rng),
    };
    let mut number = 0;
    let actions = [0; 3].map(|_| {
        number += 1;
        if number == 3 && rng.bool() {
            return Action {
                durations: None,
                is_bounded_by_charge: false,
                conditions: vec![(Moment::Start, condition(rng))],
                effects: vec![
                    (Moment::Start, effect(rng, false)),
                    (Moment::Start, set(rng)),
                    (Moment::Start, Effect::Increase(PAID, Amount(2, 0))),
                ],
            };
        }
        let min_duration = rng.i64(1..3);
        let conditions = (0..rng.usize(1..3))
            .map(|_| ([Moment::Start, Moment::OverAll, Moment::End][rng.usize(0..3)], condition(rng)));
        let conditions = conditions.collect();
        let mut effects: Vec<(Moment, Effect)> = Vec::new();
        for kind in 0..2 {
            for _ in 0..rng.usize(1..3) {
                let moment = if rng.bool() { Moment::Start } else { Moment::End };
                effects.push((moment, if kind == 0 { effect(rng, true) } else { set(rng) }));
            }
        }
        let price = [Amount(2, 0), Amount(0, 1), Amount(0, 2)][rng.usize(0..3)];
        effects.push((Moment::End, Effect::Increase(PAID, price)));
        Action {
            durations: Some((min_duration, min_duration + rng.i64(0..3))),
            is_bounded_by_charge: rng.u32(0..4) == 0,
            conditions,
            effects,
        }
    });
    let task = Task {
        actions,
        initial: State { facts: rng.u8(0..8), numbers: [rng.i64(0..3), 0, 0] },
        goal: vec![literal(rng), condition(rng), condition(rng)],
        constraints: Vec::new(),
        wish: None,
        weight: 0,
        is_paid: rng.bool(),
    };
    task.sample(rng)
}
