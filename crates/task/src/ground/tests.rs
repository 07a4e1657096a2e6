//! Unit tests of the grounding passes.

use crate::ground::vocabulary::reached::RelaxedReachability;
use crate::ground::vocabulary::task::GroundTask;
use crate::ground::vocabulary::world::World;
use crate::ground::{Generality, derived, finalize, instantiate, metric, prune, relaxed_reachability};
use crate::lifted::configuration::SlotParameter;
use crate::lifted::{Lifted, Rational};
use crate::limits::Limits;
use crate::normalize::normalize;
use crate::task::Task;
use crate::task::quantity::Quantity;
use pddl::{Source, read};

/// A domain in which `go` and `fly` move between places, `go` requires light, and `jump` and `fly` are never
/// applicable: no road is a loop, and the fuel does not suffice.
const DOMAIN: &str = "(define (domain d)
  (:predicates (at ?p) (way ?a ?b) (lit) (ready))
  (:functions (fuel))
  (:derived (ready) (lit))
  (:action go :parameters (?a ?b) :precondition (and (at ?a) (way ?a ?b) (ready))
    :effect (and (not (at ?a)) (at ?b)))
  (:action light :parameters () :precondition (not (lit)) :effect (lit))
  (:action jump :parameters (?a) :precondition (and (at ?a) (way ?a ?a) (ready)) :effect (lit))
  (:action fly :parameters (?a ?b) :precondition (and (at ?a) (>= (fuel) 5))
    :effect (and (not (at ?a)) (at ?b) (decrease (fuel) 1))))";

const PROBLEM: &str = "(define (problem p) (:domain d) (:objects a b)
  (:init (at a) (way a b) (way b a) (= (fuel) 3)) (:goal (at b)))";

fn lifted() -> Lifted {
    let (domain, problem, _) =
        read(&Source::new("domain", DOMAIN), &Source::new("problem", PROBLEM)).expect("PDDL");
    normalize(&domain, &problem, &[]).expect("a lifted task")
}

fn none(lifted: &Lifted) -> Vec<Vec<SlotParameter>> {
    vec![Vec::new(); lifted.schemas.len()]
}

fn reached(lifted: &Lifted) -> RelaxedReachability {
    relaxed_reachability::reach(lifted, &none(lifted), &Limits::none()).expect("no limit")
}

fn counts(lifted: &Lifted, task: &GroundTask<'_>) -> Vec<(String, usize)> {
    let schemas = lifted.schemas.iter().zip(0_u32..);
    let count = |schema| task.operators.iter().filter(|operator| operator.schema == schema).count();
    schemas.map(|(schema, number)| (schema.name.to_string(), count(number))).collect()
}

fn instantiated(check: impl FnOnce(&Lifted, GroundTask<'_>)) {
    let (lifted, limits) = (lifted(), Limits::none());
    let reached = reached(&lifted);
    let world = World::new(&lifted, &reached, &limits);
    let no_slots = none(&lifted);
    check(&lifted, instantiate::instantiate(world, &no_slots, &no_slots).expect("operators"));
}

#[test]
fn reach_finds_instances_and_atoms_as_if_nothing_were_deleted() {
    let lifted = lifted();
    let reached = reached(&lifted);
    let instances: Vec<usize> = reached.instances.iter().map(Vec::len).collect();
    // The relaxation ignores fuel, and no road leads from a place to itself.
    assert_eq!(instances, [2, 1, 0, 4]);
    let name = |predicate: usize| lifted.predicates[predicate].name.to_string();
    let mut atoms: Vec<String> = reached.atoms.iter().map(|(predicate, _)| name(predicate.index())).collect();
    atoms.sort();
    assert_eq!(atoms, ["at", "at", "lit", "ready"]);
}

#[test]
fn instantiate_makes_operators_and_rules() {
    instantiated(|lifted, task| {
        let expected = [("go", 2), ("light", 1), ("jump", 0), ("fly", 4)];
        assert_eq!(counts(lifted, &task), expected.map(|(name, count)| (name.to_owned(), count)));
        assert_eq!(task.axioms.len(), 1);
        assert!(task.world.is_derived(task.axioms[0].head));
        assert!(task.operators.iter().all(|operator| operator.costs.is_empty()));
    });
}

#[test]
fn derived_atoms_with_one_rule_are_replaced_by_its_body() {
    instantiated(|_, mut task| {
        let derived = task.axioms[0].head;
        let asks = |task: &GroundTask<'_>| {
            let conditions = task.operators.iter().flat_map(|operator| operator.condition.atoms());
            conditions.filter(|atom| *atom == derived).count()
        };
        assert_eq!(asks(&task), 2);
        derived::simplify(&mut task).expect("no limit");
        assert_eq!(asks(&task), 0);
    });
}

#[test]
fn without_a_metric_each_step_costs_one() {
    instantiated(|_, mut task| {
        metric::attach_costs(&mut task, &Generality::default()).expect("costs");
        let unit = [Quantity::constant(Rational::from_integer(1))];
        assert!(task.operators.iter().all(|operator| operator.costs == unit));
        assert_eq!(task.objectives.len(), 1);
    });
}

#[test]
fn prune_drops_what_numbers_rule_out_and_finish_makes_variables() {
    instantiated(|lifted, mut task| {
        derived::simplify(&mut task).expect("no limit");
        metric::attach_costs(&mut task, &Generality::default()).expect("costs");
        let generality = Generality::default();
        assert_eq!(prune::prune(&mut task, &generality).expect("no limit"), None);
        // No condition reads the head of the rule any more.
        assert!(task.axioms.is_empty());
        let expected = [("go", 2), ("light", 1), ("jump", 0), ("fly", 0)];
        assert_eq!(counts(lifted, &task), expected.map(|(name, count)| (name.to_owned(), count)));
        let task: Task = finalize::finish(task, None, &generality).expect("integers");
        let mut values: Vec<Vec<&str>> = task
            .variables
            .iter()
            .map(|variable| variable.values.iter().map(String::as_str).collect())
            .collect();
        values.sort();
        assert_eq!(values, [vec!["(at a)", "(at b)", "none of these"], vec!["(lit)", "none of these"]]);
        assert!(task.initial.numbers.is_empty());
    });
}

#[test]
fn prune_ignores_initial_numbers_that_may_change() {
    instantiated(|lifted, mut task| {
        derived::simplify(&mut task).expect("no limit");
        metric::attach_costs(&mut task, &Generality::default()).expect("costs");
        let generality = Generality { numbers: Some(1), ..Generality::default() };
        assert_eq!(prune::prune(&mut task, &generality).expect("no limit"), None);
        assert_eq!(counts(lifted, &task)[3], ("fly".to_owned(), 4));
    });
}

#[test]
fn conditions_of_effects_stay_sorted() {
    let domain = "(define (domain d) (:predicates (a) (b) (da) (db) (g) (h))
      (:derived (da) (a)) (:derived (db) (b))
      (:action on :parameters () :effect (and (a) (b)))
      (:action act :parameters ()
        :effect (and (when (and (da) (b)) (g)) (when (and (db) (a)) (h)))))";
    let problem = "(define (problem p) (:domain d) (:init) (:goal (and (g) (h))))";
    let (domain, problem, _) =
        read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("PDDL");
    let lifted = normalize(&domain, &problem, &[]).expect("a lifted task");
    let (reached, limits, slots) = (reached(&lifted), Limits::none(), none(&lifted));
    let world = World::new(&lifted, &reached, &limits);
    let mut task = instantiate::instantiate(world, &slots, &slots).expect("operators");
    derived::simplify(&mut task).expect("no limit");
    let effects = task.operators.iter().flat_map(|operator| &operator.conditional);
    let conditions: Vec<_> = effects.map(|effect| &effect.condition).collect();
    // One of the two has the other order before it is sorted.
    assert_eq!(conditions.len(), 2);
    assert!(conditions.iter().all(|condition| condition.is_sorted()), "{conditions:?}");
}
