//! Snapshot tests for the clauses of a small task: symbolic and sorted, by family.

use std::cell::OnceCell;
use std::fmt::Write as _;

use insta::assert_snapshot;
use search::bounds::Bounds;
use task::context::Context;
use task::ground::{GroundConfig, ground};
use task::limits::Limits;
use task::task::{Argument, Task};

use crate::encode::builder::Builder;
use crate::encode::conditional::FiredEffects;
use crate::encode::formula::{Family, Formula, VariableMeaning};
use crate::encode::{CostEncoding, CostLimit, Encoding, PlanConstraints, StepSemantics, operators, state};
use crate::sat::Lit;
use pddl::{Source, read};

const DOMAIN: &str = "(define (domain d)
  (:types place function design)
  (:predicates (at ?p - place) (way ?a ?b - place) (solves ?d - design ?f - function))
  (:functions (total-cost) (battery) (usage ?d - design) (price ?d - design))
  (:action go :parameters (?a ?b - place ?f - function ?d - design)
    :precondition (and (at ?a) (way ?a ?b) (solves ?d ?f) (>= (battery) (usage ?d)))
    :effect (and (not (at ?a)) (at ?b) (decrease (battery) (usage ?d)) (increase (total-cost) (price ?d)))))";

const PROBLEM: &str = "(define (problem p) (:domain d)
  (:objects a b - place f - function slow fast - design)
  (:init (at a) (way a b) (way b a) (solves slow f) (solves fast f)
    (= (battery) 2) (= (usage slow) 1) (= (usage fast) 2) (= (price slow) 5) (= (price fast) 3) (= (total-cost) 0))
  (:goal (at b)) (:metric minimize (total-cost)))";

fn task() -> Task {
    let (domain, problem, _) =
        read(&Source::new("domain", DOMAIN), &Source::new("problem", PROBLEM)).expect("PDDL");
    let config = GroundConfig { solves: vec![pddl::ast::Name::new("solves")], ..GroundConfig::default() };
    ground(&domain, &problem, &config).expect("a task")
}

fn name(task: &Task, meaning: VariableMeaning) -> String {
    match meaning {
        VariableMeaning::True => "true".into(),
        VariableMeaning::Operator { operator, step } => {
            let operator = &task.operators[operator as usize];
            let mut text = task.schema_names[operator.schema as usize].clone();
            for argument in &operator.arguments {
                if let Argument::Object(object) = argument {
                    let _ = write!(text, " {}", task.object_names[object.index()]);
                }
            }
            format!("({text})@{step}")
        }
        VariableMeaning::Fires { operator, effect, step } => format!("fires{effect} of {operator}@{step}"),
        VariableMeaning::Body { layer, rule, step } => format!("body{rule} of {layer}@{step}"),
        VariableMeaning::Later { variable, rounds, step } => format!("later{rounds} {variable}@{step}"),
        VariableMeaning::Busy { step } => format!("busy@{step}"),
        VariableMeaning::Value { variable, value, step } => {
            let text = &task.variables[variable as usize].values[value as usize];
            format!(
                "{text}{}@{step}",
                if text.starts_with('(') { String::new() } else { format!(" {variable}") }
            )
        }
        VariableMeaning::Design { slot, design, step } => {
            let design = task.slots[slot as usize].designs[design as usize];
            format!("slot{slot}={}@{step}", task.object_names[design.index()])
        }
        VariableMeaning::Group { group, step } => format!("group{group}@{step}"),
        VariableMeaning::CostAtLeast { amount, step, stage } => format!("spent≥{amount}@{step}.{stage}"),
        VariableMeaning::Increment { amount, step, stage } => format!("add≥{amount}@{step}.{stage}"),
        VariableMeaning::Bit { bit } => format!("bit{bit}"),
        VariableMeaning::Others => "others".into(),
        VariableMeaning::Paid => "paid".into(),
        VariableMeaning::Ladder => "ladder".into(),
    }
}

fn clauses(task: &Task, formula: &Formula, family: Family) -> String {
    let literal = |literal: &Lit| {
        let name = name(task, formula.meaning(literal.variable()));
        if literal.is_positive() { name } else { format!("¬{name}") }
    };
    let family_clauses = formula.clauses().filter(|(candidate, _)| *candidate == family);
    let mut lines: Vec<String> = family_clauses
        .map(|(_, clause)| {
            let mut literals: Vec<String> = clause.iter().map(literal).collect();
            literals.sort();
            literals.join(" ∨ ")
        })
        .collect();
    lines.sort();
    lines.join("\n")
}

fn check(family: Family) -> String {
    let task = task();
    let bounds = Bounds::new(Context::new(&task, &Limits::none())).expect("no limit");
    let allowed = vec![vec![true; task.operators.len()]; 2];
    let cost = CostLimit { limit: 6, bounds: &bounds, counting: CostEncoding::Sum };
    let limits = Limits::none();
    let encoding = Encoding::new(
        Context::new(&task, &limits),
        PlanConstraints {
            allowed: &allowed,
            cost: Some(cost),
            semantics: StepSemantics::Sequential,
            max_clauses: usize::MAX,
        },
        &OnceCell::new(),
    )
    .expect("no limit");
    clauses(&task, &encoding.formula, family)
}

/// Task with two interchangeable lamps that need power, and a switch that cuts the power. The
/// action of the switch is declared between two actions that need power.
const LAMPS: (&str, &str) = (
    "(define (domain d)
      (:predicates (on ?x) (red ?x) (power))
      (:action light :parameters (?x) :precondition (power) :effect (on ?x))
      (:action cut :parameters () :precondition (power) :effect (not (power)))
      (:action colour :parameters (?x) :precondition (power) :effect (red ?x)))",
    "(define (problem p) (:domain d) (:objects a b) (:init (power))
      (:goal (and (on a) (on b) (red a) (red b) (not (power)))))",
);

fn lamps(semantics: StepSemantics, family: Family) -> String {
    let (domain, problem, _) =
        read(&Source::new("domain", LAMPS.0), &Source::new("problem", LAMPS.1)).expect("PDDL");
    let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
    let allowed = vec![vec![true; task.operators.len()]; 2];
    let limits = Limits::none();
    let encoding = Encoding::new(
        Context::new(&task, &limits),
        PlanConstraints { allowed: &allowed, cost: None, semantics, max_clauses: usize::MAX },
        &OnceCell::new(),
    )
    .expect("no limit");
    clauses(&task, &encoding.formula, family)
}

#[test]
fn interference_in_any_order() {
    assert_snapshot!(lamps(StepSemantics::ForAllStep, Family::Interference));
}

#[test]
fn interference_in_some_order() {
    assert_eq!(lamps(StepSemantics::Sequential, Family::Interference), "");
    assert_snapshot!(lamps(StepSemantics::ExistsStep, Family::Interference));
}

#[test]
fn symmetry_of_objects() {
    assert_snapshot!(lamps(StepSemantics::Sequential, Family::Symmetry));
}

#[test]
fn domain() {
    assert_snapshot!(check(Family::Domain));
}

#[test]
fn sequence() {
    assert_snapshot!(check(Family::Sequence));
}

#[test]
fn condition() {
    assert_snapshot!(check(Family::Condition));
}

#[test]
fn effect() {
    assert_snapshot!(check(Family::Effect));
}

#[test]
fn frame() {
    assert_snapshot!(check(Family::Frame));
}

#[test]
fn selection() {
    assert_snapshot!(check(Family::Selection));
}

#[test]
fn cost() {
    assert_snapshot!(check(Family::Cost));
}

#[test]
fn goal() {
    assert_snapshot!(check(Family::Goal));
}

fn alone(family: Family, write: impl Fn(&mut Builder<'_>, usize)) -> String {
    let (task, limits) = (task(), Limits::none());
    let allowed = vec![vec![true; task.operators.len()]; 2];
    let mut builder = Builder::new(Context::new(&task, &limits), &allowed, usize::MAX).expect("no limit");
    for step in 0..2 {
        write(&mut builder, step);
    }
    let families: Vec<Family> =
        builder.formula.clauses_from(1).map(|(clause_family, _)| clause_family).collect();
    assert!(families.iter().all(|clause_family| *clause_family == family), "{families:?}");
    clauses(&task, &builder.formula, family)
}

#[test]
fn a_family_alone_writes_the_same_clauses_as_in_a_whole_encoding() {
    assert_eq!(alone(Family::Condition, operators::conditions), check(Family::Condition));
    let sequence = |builder: &mut Builder<'_>, step| operators::sequence(builder, step, true);
    assert_eq!(alone(Family::Sequence, sequence), check(Family::Sequence));
    let effects = |builder: &mut Builder<'_>, step| {
        let fires = FiredEffects::new(builder, step);
        operators::effects(builder, step, &fires);
    };
    assert_eq!(alone(Family::Effect, effects), check(Family::Effect));
    let frame = |builder: &mut Builder<'_>, step| {
        let fires = FiredEffects::new(builder, step);
        state::frame(builder, step, &fires);
    };
    assert_eq!(alone(Family::Frame, frame), check(Family::Frame));
}
