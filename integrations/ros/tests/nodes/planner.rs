//! Replacement of PlanSys2's planner, called in the same way as by PlanSys2's planner client and
//! lifecycle manager.

use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use metaplan::setup::Setup;
use metaplan_ros::interfaces::diagnostic_msgs::msg::{DiagnosticArray, DiagnosticStatus, KeyValue};
use metaplan_ros::interfaces::lifecycle_msgs::msg::{State, Transition};
use metaplan_ros::interfaces::lifecycle_msgs::srv::{
    ChangeState, ChangeStateRequest, GetState, GetStateRequest,
};
use metaplan_ros::interfaces::plansys2_msgs::msg::Plan;
use metaplan_ros::interfaces::plansys2_msgs::srv::{
    GetPlan, GetPlanArray, GetPlanArrayRequest, GetPlanRequest, GetPlanResponse, ValidateDomain,
    ValidateDomainRequest,
};
use metaplan_ros::interfaces::std_msgs;
use metaplan_ros::node::{Caller, Node, depth, latched};
use metaplan_ros::planner;
use smol::block_on;

use crate::common::{domain, node, until};

const LONG: Duration = Duration::from_secs(20);

const DOMAIN: &str = "(define (domain d) (:requirements :typing) (:types place)
  (:predicates (at ?p - place) (way ?a ?b - place)) (:functions (price ?a ?b - place) (spent))
  (:action go :parameters (?a ?b - place) :precondition (and (at ?a) (way ?a ?b))
    :effect (and (not (at ?a)) (at ?b) (increase (spent) (price ?a ?b)))))";

/// The direct way is expensive; two other ways are equally good.
const PROBLEM: &str = "(define (problem p) (:domain d) (:objects a b c d - place)
  (:init (at a) (way a b) (way b d) (way a c) (way c d) (way a d) (= (spent) 0)
    (= (price a b) 1) (= (price b d) 1) (= (price a c) 1) (= (price c d) 1) (= (price a d) 5))
  (:goal (at d)))";

/// A pigeonhole problem, which is unsolvable and too hard to decide in reasonable time.
fn hopeless() -> (String, String) {
    let domain = "(define (domain holes) (:requirements :typing) (:types pigeon hole)
      (:predicates (free ?h - hole) (out ?p - pigeon) (in ?p - pigeon ?h - hole) (home ?p - pigeon)
        (fits ?p - pigeon ?h - hole))
      (:action enter :parameters (?p - pigeon ?h - hole) :precondition (and (out ?p) (free ?h) (fits ?p ?h))
        :effect (and (not (out ?p)) (not (free ?h)) (in ?p ?h) (home ?p)))
      (:action leave :parameters (?p - pigeon ?h - hole) :precondition (in ?p ?h)
        :effect (and (out ?p) (free ?h) (not (in ?p ?h)) (not (home ?p)))))";
    let names =
        |name: &str, count: usize| (0..count).map(|i| format!("{name}{i} ")).collect::<Vec<_>>().concat();
    let facts = |before: &str, count: usize| {
        (0..count).map(|i| format!("({before}{i}) ")).collect::<Vec<_>>().concat()
    };
    // Pigeons and holes are pairwise different, so there is no symmetry.
    let fits = (0..20)
        .flat_map(|pigeon| (0..19).map(move |hole| (pigeon, hole)))
        .filter(|(pigeon, hole)| (pigeon * pigeon * hole + 5 * hole * hole + pigeon) % 23 >= 4)
        .map(|(pigeon, hole)| format!("(fits p{pigeon} h{hole}) "))
        .collect::<Vec<_>>()
        .concat();
    let problem = format!(
        "(define (problem p) (:domain holes) (:objects {}- pigeon {}- hole) (:init {}{}{fits}) (:goal (and {})))",
        names("p", 20),
        names("h", 19),
        facts("out p", 20),
        facts("free h", 19),
        facts("home p", 20)
    );
    (domain.to_owned(), problem)
}

fn planner(setup: Option<Setup>, words: &str) -> (Arc<Node>, Arc<Node>) {
    let domain = domain();
    let (planner, client) = (node(domain, "planner", words), node(domain, "client", ""));
    planner::serve(&planner, setup).expect("services");
    let change = client.caller::<ChangeState>("/planner/change_state");
    for id in [Transition::TRANSITION_CONFIGURE, Transition::TRANSITION_ACTIVATE] {
        let transition = Transition { id, label: String::new() };
        assert!(block_on(change.call(ChangeStateRequest { transition }, LONG)).expect("an answer").success);
    }
    (planner, client)
}

fn ask(caller: &Caller<GetPlan>, domain: &str, problem: &str) -> GetPlanResponse {
    let request = GetPlanRequest { domain: domain.to_owned(), problem: problem.to_owned() };
    block_on(caller.call(request, LONG)).expect("an answer")
}

fn actions(plan: &Plan) -> Vec<&str> {
    plan.items.iter().map(|item| item.action.as_str()).collect()
}

#[test]
fn plans_and_reasons_are_answered() {
    let (_planner, client) = planner(None, "");
    let get_plan = client.caller::<GetPlan>("/planner/get_plan");
    let found = ask(&get_plan, DOMAIN, PROBLEM);
    assert!(found.success && found.error_info.is_empty());
    assert_eq!(actions(&found.plan), ["(go a d)"]);
    assert!(found.plan.items[0].duration > 0.0);
    for (domain, problem, expected) in [
        (&DOMAIN[..DOMAIN.len() - 1], PROBLEM, "Invalid PDDL domain: domain, line 1, column 1: "),
        (DOMAIN, &PROBLEM.replace("(at d)", "(at e)"), "Invalid PDDL problem: problem, line 4, column "),
        (
            DOMAIN,
            &PROBLEM.replace("(at a)", "(at b)").replace("(way b d)", ""),
            "Plan not found: no plan exists, proved: ",
        ),
    ] {
        let found = ask(&get_plan, domain, problem);
        assert!(!found.success && found.plan.items.is_empty());
        assert!(found.error_info.starts_with(expected), "{}", found.error_info);
    }
    let validate = client.caller::<ValidateDomain>("/planner/validate_domain");
    for (domain, is_valid) in [(DOMAIN, true), (&DOMAIN[1..], false)] {
        let request = ValidateDomainRequest { domain: domain.to_owned() };
        let answer = block_on(validate.call(request, LONG)).expect("an answer");
        assert_eq!((answer.success, answer.error_info.is_empty()), (is_valid, is_valid));
    }
}

#[test]
fn the_metric_is_a_parameter_and_plans_that_are_as_good_follow() {
    let (_planner, client) = planner(None, "-p metric:=(spent)");
    let get_plan = client.caller::<GetPlan>("/planner/get_plan");
    assert_eq!(ask(&get_plan, DOMAIN, PROBLEM).plan.items.len(), 2);
    let get_plans = client.caller::<GetPlanArray>("/planner/get_plan_array");
    let request = GetPlanArrayRequest { domain: DOMAIN.to_owned(), problem: PROBLEM.to_owned() };
    let answer = block_on(get_plans.call(request, LONG)).expect("an answer");
    assert!(answer.success);
    let mut plans: Vec<_> = answer.plan_array.plan_array.iter().map(actions).collect();
    plans.sort_unstable();
    assert_eq!(plans, [["(go a b)", "(go b d)"], ["(go a c)", "(go c d)"]]);
}

#[test]
fn an_unconfigured_planner_says_so() {
    let domain = domain();
    let (planner, client) = (node(domain, "planner", ""), node(domain, "client", ""));
    planner::serve(&planner, None).expect("services");
    let found = ask(&client.caller::<GetPlan>("/planner/get_plan"), DOMAIN, PROBLEM);
    assert!(!found.success && found.error_info.contains("not configured"), "{}", found.error_info);
}

#[test]
fn others_are_answered_while_a_plan_is_looked_for_and_its_time_is_kept() {
    let (_planner, client) = planner(None, "-p plan_solver_timeout:=3.0");
    let (domain, problem) = hopeless();
    let begun = Instant::now();
    let asking = {
        let client = Arc::clone(&client);
        std::thread::spawn(move || ask(&client.caller::<GetPlan>("/planner/get_plan"), &domain, &problem))
    };
    std::thread::sleep(Duration::from_millis(1500));
    let get_state = client.caller::<GetState>("/planner/get_state");
    let state = block_on(get_state.call(GetStateRequest::default(), LONG)).expect("an answer");
    assert_eq!(state.current_state.id, State::PRIMARY_STATE_ACTIVE);
    assert!(!asking.is_finished(), "the state was told after {:?}", begun.elapsed());
    let found = asking.join().expect("no panic");
    assert!(begun.elapsed() < Duration::from_secs(6), "{:?}", begun.elapsed());
    assert!(!found.success && found.error_info.contains("a limit was reached"), "{}", found.error_info);
}

/// After diagnostics report murky water, the plan uses a design with a lower altitude.
#[test]
fn the_knowledge_base_of_a_mission_joins_in() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let text = |file: &str| std::fs::read_to_string(root.join(file)).expect("a file");
    let (domain, problem) = (text("encodings/uuv/plain.pddl"), text("encodings/uuv/problem.pddl"));
    let setup = Setup::read(&root.join("missions/uuv_plain.toml")).expect("a mission");
    let (_planner, client) = planner(Some(setup), "");
    let told = Arc::new(Mutex::new(String::new()));
    let own = Arc::clone(&told);
    let hear = move |message: std_msgs::msg::String| *own.lock().expect("no panic") = message.data;
    client.subscribe::<std_msgs::msg::String>("/planner/plan", latched(1), hear).expect("a subscription");
    let get_plan = client.caller::<GetPlan>("/planner/get_plan");
    let before = ask(&get_plan, &domain, &problem);
    assert!(before.success, "{}", before.error_info);
    // The JSON contains the designs, for which PlanSys2's plans have no field.
    until("the plan as JSON", || !told.lock().expect("no panic").is_empty());
    let plan: serde_json::Value = serde_json::from_str(&told.lock().expect("no panic")).expect("JSON");
    assert_eq!((&plan["optimal"], &plan["steps"][0]["action"]), (&true.into(), &"search_pipeline".into()));
    assert_eq!(plan["steps"][0]["arguments"], serde_json::json!(["pl1"]));
    assert_eq!(plan["steps"][0]["configuration"]["f_generate_search_path"], "fd_search_high");
    let said = client.publisher::<DiagnosticArray>("/diagnostics", depth(10)).expect("a publisher");
    let values = vec![KeyValue { key: "water_visibility".into(), value: "1.5".into() }];
    let status = vec![DiagnosticStatus { message: "QA status".into(), values, ..Default::default() }];
    let array = DiagnosticArray { status, ..Default::default() };
    // In murky water the search altitude is lower, which takes longer.
    until("another plan", || {
        said.publish(array.clone());
        let after = ask(&get_plan, &domain, &problem);
        assert_eq!(actions(&after.plan), actions(&before.plan));
        after.plan.items[0].duration > before.plan.items[0].duration
    });
}
