//! Tests of plain domains, whose actions get their designs from the knowledge base. The optimum must equal
//! that of the explicit form, in which designs are parameters of actions.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use metaplan::knowledge::{COADAPTATION, Knowledge, Sources};
use metaplan::message::Errors;
use metaplan::mission::{Bindings, Mission, Planning as _};
use metaplan::setup::Setup;
use ontology::ReadOptions;
use pddl::{Source, Validator, print_domain};
use planner::{Config, Limits, Status, lexicographic};
use rules::Limits as StepLimits;
use testing::random::Random;

/// Status and cost of an optimal plan, and the configuration (function and design) of each step.
type Answer = (Status, Option<String>, Vec<Vec<(String, String)>>);

fn answer(mission: &Mission) -> Answer {
    let (problem, _) = mission.filled().unwrap_or_else(|messages| panic!("{messages:#?}"));
    let task =
        mission.ground(&problem, &[], &Limits::none()).unwrap_or_else(|messages| panic!("{messages:#?}"));
    let solution = lexicographic(&task, &Config::default(), &mut |_| {}).solution;
    let plan = solution.plan.map(|plan| mission.written(plan));
    let configurations =
        plan.iter().flat_map(|plan| plan.steps.iter().map(|step| step.configuration.clone()));
    (solution.status, plan.as_ref().map(|plan| plan.cost.to_string()), configurations.collect())
}

fn shipped(name: &str, situation: &dyn Fn(&mut Mission)) -> Mission {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("missions/{name}.toml"));
    let mut mission = Setup::read(&manifest).unwrap_or_else(|messages| panic!("{messages:#?}")).mission;
    situation(&mut mission);
    mission
}

/// Checks that the explicit and the plain form of a shipped mission have the same optimum, with the same
/// designs at each step. `expected` is the optimal cost; `None` if there is no plan.
fn check(name: &str, situation: &dyn Fn(&mut Mission), expected: Option<&str>) {
    let explicit = answer(&shipped(name, situation));
    let native = answer(&shipped(&format!("{name}_plain"), situation));
    assert_eq!(explicit, native, "{name}");
    assert_eq!(native.1.as_deref(), expected, "{name}");
}

#[test]
fn shipped_missions_have_the_same_optimum_in_both_forms() {
    let set = |name: &'static str, value: &'static str| {
        move |mission: &mut Mission| mission.set(name, value).expect("a setting")
    };
    let fail =
        |component: &'static str| move |mission: &mut Mission| mission.fail(component).expect("a component");
    check("ugv", &|_| {}, Some("408"));
    check("ugv", &fail("c_kinect"), Some("516"));
    check("ugv", &set("ambient_light", "0.9"), Some("516"));
    check("ugv", &set("battery", "7"), None);
    check("uuv", &|_| {}, Some("28"));
    check("uuv", &set("battery", "15"), Some("60"));
    check("uuv", &set("water_visibility", "1.5"), Some("40"));
    check("uuv", &fail("c_sonar"), None);
}

#[test]
fn plans_have_the_arguments_of_the_plain_domain() {
    let mission = shipped("ugv_plain", &|_| {});
    assert!(mission.adaptation().is_some());
    let (problem, _) = mission.filled().expect("a problem");
    let task = mission.ground(&problem, &[], &Limits::none()).expect("a task");
    let plan = lexicographic(&task, &Config::default(), &mut |_| {}).solution.plan.expect("a plan");
    assert_eq!(plan.steps[0].arguments, ["wp1", "wp2", "fd_amcl_kinect"]);
    assert_eq!(mission.written(plan).steps[0].arguments, ["wp1", "wp2"]);
    assert!(shipped("ugv", &|_| {}).adaptation().is_none());
}

struct Generated {
    knowledge: String,
    explicit: String,
    plain: String,
    problem: String,
    bindings: BTreeMap<String, String>,
}

const PREFIX: &str = "@prefix : <urn:m#> .\n@prefix owl: <http://www.w3.org/2002/07/owl#> .\n\
    @prefix t: <http://metacontrol.org/tomasys#> .\n<urn:m> a owl:Ontology ; owl:imports <http://metacontrol.org/tomasys> .\n";

impl Generated {
    fn new(seed: u64) -> Self {
        let mut random = Random(seed);
        let functions = 1 + random.below(2) as usize;
        let reconfiguration = random.below(2) == 0;
        let mut knowledge = PREFIX.to_owned();
        for attribute in ["slowness", "energy", "safety", "change"] {
            let _ = writeln!(knowledge, ":{attribute} a t:QualityAttributeType .");
        }
        let required: Vec<_> = (0..functions).map(|f| format!(":f{f}")).collect();
        let bound = 1 + random.below(3);
        let _ = writeln!(
            knowledge,
            ":a_move a t:Action ; t:requiresF {} ; t:requiresQuality :careful .\n\
             :careful a t:Requirement ; t:isQAtype :safety ; t:hasMinimum {bound}.0 ; t:inContext \"narrow\" .\n\
             :f_other a t:Function . :c0 a t:Component ; t:c_status \"FALSE\" .",
            required.join(" , ")
        );
        for function in 0..functions {
            let _ = writeln!(knowledge, ":f{function} a t:Function .");
            for design in 0..2 + random.below(3) {
                let name = format!("d{function}_{design}");
                let needs = if random.below(6) == 0 { "t:requiresC :c0 ; " } else { "" };
                let mut values = vec![("slowness", 1 + random.below(4)), ("energy", 1 + random.below(4))];
                if function == 0 {
                    values.push(("safety", random.below(5)));
                }
                values.push(("change", random.below(4)));
                let estimations: Vec<_> = values.iter().map(|(a, _)| format!(":{name}_{a}")).collect();
                let _ = writeln!(
                    knowledge,
                    ":{name} a t:FunctionDesign ; t:solvesF :f{function} ; {needs}t:hasQAestimation {} .",
                    estimations.join(" , ")
                );
                for (attribute, value) in values {
                    let _ = writeln!(
                        knowledge,
                        ":{name}_{attribute} a t:QAvalue ; t:isQAtype :{attribute} ; t:hasValue {value}.0 ."
                    );
                }
            }
        }
        let mut bindings = BTreeMap::new();
        if reconfiguration {
            bindings.insert("reconfiguration".to_owned(), "reconfigured:change".to_owned());
        }
        Self {
            knowledge,
            explicit: explicit(functions, bound, reconfiguration),
            plain: plain(reconfiguration),
            problem: problem(&mut random),
            bindings,
        }
    }

    fn mission(&self, domain: &str, directory: &Path) -> Mission {
        // The explicit form counts design changes by actions, so it needs no binding.
        let bindings = if domain == self.plain { self.bindings.clone() } else { BTreeMap::new() };
        let mission = read(directory, &self.knowledge, domain, &self.problem, &bindings);
        mission.unwrap_or_else(|messages| panic!("{messages:#?}\n{domain}"))
    }
}

/// Reads a mission of texts. The knowledge base is written to a file in `directory`.
fn read(
    directory: &Path,
    knowledge: &str,
    domain: &str,
    problem: &str,
    bindings: &BTreeMap<String, String>,
) -> Result<Mission, Errors> {
    let file = directory.join("kb.ttl");
    std::fs::write(&file, knowledge).expect("a file");
    let sources = Sources {
        documents: vec![file],
        rules: vec![COADAPTATION.to_owned()],
        options: ReadOptions::default(),
        limits: StepLimits::default(),
    };
    Mission::new(
        "generated",
        Some(Knowledge::read(&sources)),
        Bindings::with(bindings).expect("bindings"),
        Ok(Source::new("domain", domain)),
        Ok(Source::new("problem", problem)),
    )
}

/// Returns the explicit form of the domain: actions with parameters for functions and designs. A change of
/// designs is a separate action.
fn explicit(functions: usize, bound: i64, reconfiguration: bool) -> String {
    let each = |text: &dyn Fn(usize) -> String| (0..functions).map(text).collect::<Vec<_>>().join(" ");
    let sum = |attribute: &str| format!("(+ 0 {})", each(&|f| format!("({attribute} ?d{f})")));
    let (current_designs, change) = if reconfiguration {
        (
            each(&|f| format!("(at_work ?d{f} f{f})")),
            "(:action set :parameters (?f - function ?d - functiondesign)
                :precondition (and (unset ?f) (fd_solve_f ?d ?f) (fd_available ?d))
                :effect (at_work ?d ?f))
              (:action reconfigure :parameters (?f - function ?old ?new - functiondesign)
                :precondition (and (at_work ?old ?f) (fd_solve_f ?new ?f) (fd_available ?new) (not (= ?old ?new)))
                :effect (and (not (at_work ?old ?f)) (at_work ?new ?f) (increase (total-cost) (change ?new))))",
        )
    } else {
        (String::new(), "")
    };
    let move_over = |name: &str, condition: &str| {
        format!(
            "(:action {name} :parameters (?a ?b - place {})
               :precondition (and (at ?a) {condition} {} {current_designs}
                 (>= (battery) (* (length ?a ?b) {energy})))
               :effect (and (not (at ?a)) (at ?b) (decrease (battery) (* (length ?a ?b) {energy}))
                 (increase (total-cost) (+ (length ?a ?b) (* (length ?a ?b) {})))))",
            each(&|f| format!("?d{f} - functiondesign")),
            each(&|f| format!("(fd_solve_f ?d{f} f{f}) (fd_available ?d{f})")),
            sum("slowness"),
            energy = sum("energy"),
        )
    };
    format!(
        "(define (domain m) (:types place function functiondesign) (:constants {} - function)
          (:predicates (at ?p - place) (wide ?a ?b - place) (narrow ?a ?b - place) (charger ?p - place)
            (fd_solve_f ?d - functiondesign ?f - function) (fd_available ?d - functiondesign)
            (at_work ?d - functiondesign ?f - function) (unset ?f - function))
          (:functions (total-cost) (battery) (length ?a ?b - place) (slowness ?d - functiondesign)
            (energy ?d - functiondesign) (safety ?d - functiondesign) (change ?d - functiondesign))
          (:derived (unset ?f - function) (not (exists (?d - functiondesign) (at_work ?d ?f))))
          {} {} (:action charge :parameters (?p - place) :precondition (and (at ?p) (charger ?p))
            :effect (and (assign (battery) 12) (increase (total-cost) 5))) {change})",
        each(&|f| format!("f{f}")),
        move_over("move", "(wide ?a ?b)"),
        move_over("squeeze", &format!("(narrow ?a ?b) (>= (safety ?d0) {bound})")),
    )
}

fn plain(reconfiguration: bool) -> String {
    let (function, effect) = if reconfiguration {
        ("(reconfiguration)", "(increase (total-cost) (reconfiguration))")
    } else {
        ("", "")
    };
    format!(
        "(define (domain m) (:types place)
          (:predicates (at ?p - place) (wide ?a ?b - place) (narrow ?a ?b - place) (charger ?p - place))
          (:functions (total-cost) (battery) (length ?a ?b - place) (slowness) (energy) {function})
          (:action move :parameters (?a ?b - place)
            :precondition (and (at ?a) (or (wide ?a ?b) (narrow ?a ?b)) (>= (battery) (* (length ?a ?b) (energy))))
            :effect (and (not (at ?a)) (at ?b) (decrease (battery) (* (length ?a ?b) (energy)))
              (increase (total-cost) (+ (length ?a ?b) (* (length ?a ?b) (slowness)))) {effect}))
          (:action charge :parameters (?p - place) :precondition (and (at ?p) (charger ?p))
            :effect (and (assign (battery) 12) (increase (total-cost) 5))))"
    )
}

fn problem(random: &mut Random) -> String {
    let mut init = format!("(at p0) (charger p{}) (= (battery) 12) (= (total-cost) 0)", random.below(4));
    for a in 0..4 {
        for b in 0..4 {
            if a != b && random.below(2) == 0 {
                let kind = if random.below(3) == 0 { "narrow" } else { "wide" };
                let _ = write!(init, " ({kind} p{a} p{b}) (= (length p{a} p{b}) {})", 1 + random.below(3));
            }
        }
    }
    format!(
        "(define (problem p) (:domain m) (:objects p0 p1 p2 p3 - place) (:init {init}) (:goal (at p3))
          (:metric minimize (total-cost)))"
    )
}

#[test]
fn generated_missions_have_the_same_optimum_in_both_forms() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let mut solved = [0, 0];
    for seed in 0..100 {
        let generated = Generated::new(seed);
        let explicit = answer(&generated.mission(&generated.explicit, directory.path()));
        let native = answer(&generated.mission(&generated.plain, directory.path()));
        assert_eq!((explicit.0, &explicit.1), (native.0, &native.1), "seed {seed}\n{}", generated.knowledge);
        assert!([Status::Optimal, Status::Unsolvable].contains(&native.0), "seed {seed}");
        solved[usize::from(!generated.bindings.is_empty())] += usize::from(native.1.is_some());
    }
    // Guards against generated missions that are mostly unsolvable.
    assert!(solved[0] > 20 && solved[1] > 20, "{solved:?} missions have a plan");
}

/// Two actions: `first` requires a design without light, and `second` a design with light.
const CHANGE: &str = ":f a t:Function . :start a t:QualityAttributeType . :light a t:QualityAttributeType .
    :a_first a t:Action ; t:requiresF :f ; t:requiresQuality [ a t:Requirement ; t:isQAtype :light ; t:hasMaximum 0 ] .
    :a_second a t:Action ; t:requiresF :f ; t:requiresQuality [ a t:Requirement ; t:isQAtype :light ; t:hasMinimum 1 ] .
    :fd_lidar a t:FunctionDesign ; t:solvesF :f ; t:hasQAestimation [ a t:QAvalue ; t:isQAtype :start ; t:hasValue 4 ] ,
      [ a t:QAvalue ; t:isQAtype :light ; t:hasValue 0 ] .
    :fd_camera a t:FunctionDesign ; t:solvesF :f ; t:hasQAestimation [ a t:QAvalue ; t:isQAtype :light ; t:hasValue 1 ] .";

/// A quality bound for the action `enter`, in a context that the predicate `(open ?a)` states.
const CONTEXT: &str = ":f a t:Function . :effort a t:QualityAttributeType . :light a t:QualityAttributeType .
    :a_enter a t:Action ; t:requiresF :f ; t:requiresQuality :r .
    :r a t:Requirement ; t:isQAtype :light ; t:hasMinimum 1 ; t:inContext \"open\" .
    :fd_a a t:FunctionDesign ; t:solvesF :f ; t:hasQAestimation [ a t:QAvalue ; t:isQAtype :effort ; t:hasValue 1 ] ,
      [ a t:QAvalue ; t:isQAtype :light ; t:hasValue 0 ] .
    :fd_b a t:FunctionDesign ; t:solvesF :f ; t:hasQAestimation [ a t:QAvalue ; t:isQAtype :effort ; t:hasValue 2 ] ,
      [ a t:QAvalue ; t:isQAtype :light ; t:hasValue 1 ] .";

fn check_small(knowledge: &str, domain: &str, bindings: &[(&str, &str)], cost: &str, designs: &[&str]) {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let problem = "(define (problem p) (:domain d) (:init (= (total-cost) 0) (open)) (:goal (done))
        (:metric minimize (total-cost)))";
    let bindings = bindings.iter().map(|(symbol, query)| ((*symbol).to_owned(), (*query).to_owned()));
    let mission = read(directory.path(), knowledge, domain, problem, &bindings.collect());
    let (status, actual, steps) =
        answer(&mission.unwrap_or_else(|messages| panic!("{messages:#?}\n{domain}")));
    assert_eq!((status, actual.as_deref()), (Status::Optimal, Some(cost)), "{domain}");
    let actual: Vec<&str> = steps.iter().flatten().map(|(_, design)| design.as_str()).collect();
    assert_eq!(actual, designs, "{domain}");
}

#[test]
fn a_change_to_a_design_without_an_estimation_is_free() {
    let domain = |functions: &str, cost: &str| {
        format!(
            "(define (domain d) (:predicates (open) (one) (done)) (:functions (total-cost) {functions})
              (:action first :parameters () :precondition (open)
                :effect (and (one) (increase (total-cost) (+ 1 {cost})) (increase (total-cost) (change))))
              (:action second :parameters () :precondition (one)
                :effect (and (done) (increase (total-cost) 1) (increase (total-cost) (change)))))"
        )
    };
    let knowledge = format!("{PREFIX}{CHANGE}");
    let bindings = [("change", "reconfigured:start"), ("used", "chosen:start")];
    check_small(&knowledge, &domain("(change)", "0"), &bindings[..1], "2", &["fd_lidar", "fd_camera"]);
    // The chosen design of `first` costs 4. A sum over chosen designs is undefined without an estimation, so it has
    // another function than the sum over newly chosen designs.
    check_small(&knowledge, &domain("(change) (used)", "(used)"), &bindings, "6", &["fd_lidar", "fd_camera"]);
}

#[test]
fn a_context_that_ends_at_the_start_of_an_action_counts() {
    let domain = "(define (domain d) (:requirements :durative-actions) (:predicates (open) (done))
        (:functions (total-cost) (effort))
        (:durative-action enter :parameters () :duration (= ?duration 1) :condition (at start (open))
          :effect (and (at start (not (open))) (at end (done)) (at end (increase (total-cost) (effort))))))";
    check_small(&format!("{PREFIX}{CONTEXT}"), domain, &[], "2", &["fd_b"]);
}

/// The parameter for the design of an action must differ from the variables of quantifiers.
#[test]
fn quantifiers_do_not_bind_the_parameters_of_designs() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let domain =
        "(define (domain d) (:requirements :typing :conditional-effects :numeric-fluents) (:types place)
        (:predicates (done) (seen ?p - place)) (:functions (total-cost) (effort))
        (:action go :parameters () :precondition () :effect (and (done)
          (forall (?fd1 - place) (when (seen ?fd1) (increase (total-cost) (effort)))))))";
    let problem = "(define (problem p) (:domain d) (:objects a b c - place)
        (:init (= (total-cost) 0) (seen a) (seen b)) (:goal (done)) (:metric minimize (total-cost)))";
    let knowledge = format!("{PREFIX}{ONE_DESIGN}");
    let mission = read(directory.path(), &knowledge, domain, problem, &BTreeMap::new());
    let (_, cost, steps) = answer(&mission.unwrap_or_else(|messages| panic!("{messages:#?}")));
    // The design `fd_a` has an effort of 1.
    assert_eq!((cost.as_deref(), steps), (Some("2"), vec![vec![("f".to_owned(), "fd_a".to_owned())]]));
}

/// A mission with one action, which takes `duration` and has the designs and the bound of `knowledge`.
fn timed(knowledge: &str, duration: &str, span: &str) -> Mission {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let knowledge = format!("{PREFIX}{knowledge}\n:fd_b t:requiresC :c . :c a t:Component .");
    let domain = format!(
        "(define (domain d) (:requirements :durative-actions :numeric-fluents) (:predicates (open) (done))
           (:functions (total-cost) (span) (effort))
           (:durative-action enter :parameters () :duration (= ?duration {duration}) :condition (at start (open))
             :effect (and (at end (done)) (at end (increase (total-cost) (effort))))))"
    );
    let problem = format!(
        "(define (problem p) (:domain d) (:init (= (total-cost) 0) (= (span) {span}) (open)) (:goal (done))
           (:metric minimize (total-cost)))"
    );
    let mission = read(directory.path(), &knowledge, &domain, &problem, &BTreeMap::new());
    mission.unwrap_or_else(|messages| panic!("{messages:#?}\n{domain}"))
}

/// Returns the designs of an optimal plan, or `None` if there is no plan.
fn designs(mission: &Mission) -> Option<Vec<String>> {
    let (status, cost, steps) = answer(mission);
    assert!([Status::Optimal, Status::Unsolvable].contains(&status), "{status:?}");
    cost.map(|_| steps.into_iter().flatten().map(|(_, design)| design).collect())
}

/// Conditions over all do not apply to the duration 0. Only the design `fd_b` meets the bound. Each case has the
/// duration with `fd_a` and with `fd_b`.
#[test]
fn designs_are_required_at_the_start_of_an_action_that_may_take_no_time() {
    let everywhere = CONTEXT.replace(" ; t:inContext \"open\"", "");
    for knowledge in [CONTEXT, &everywhere] {
        for (duration, span, durations) in [
            ("0", "0", [0, 0]),
            ("(span)", "0", [0, 0]),
            ("(* 2 (span))", "0", [0, 0]),
            ("(- (effort) 1)", "3", [0, 1]),
            ("2", "0", [2, 2]),
            ("(span)", "3", [3, 3]),
            ("(+ 1 (span))", "0", [1, 1]),
            ("(* (span) (effort))", "3", [3, 6]),
        ] {
            let mut mission = timed(knowledge, duration, span);
            assert_eq!(designs(&mission), Some(vec!["fd_b".to_owned()]), "{duration}");
            let is_valid = |mission: &Mission, design: &str, duration: i32| {
                let (problem, _) = mission.filled().unwrap_or_else(|messages| panic!("{messages:#?}"));
                let plan = Source::new("plan", format!("0: (enter {design}) [{duration}]"));
                Validator::new(mission.domain(), &problem).validate(&plan).expect("a plan").valid
            };
            let validity =
                [is_valid(&mission, "fd_a", durations[0]), is_valid(&mission, "fd_b", durations[1])];
            assert_eq!(validity, [false, true], "{duration}");
            // The form of missions without the duration 0 has no superfluous conditions.
            let text = print_domain(mission.domain());
            let starts =
                ["(at start (fd_available ", "(at start (fd_solve_f "].map(|part| text.matches(part).count());
            assert_eq!(starts, [usize::from(durations[0] == 0), 1], "{text}");
            mission.fail("c").expect("a component");
            assert_eq!(designs(&mission), None, "{duration}");
            assert!(!is_valid(&mission, "fd_b", durations[1]), "{duration}");
        }
    }
}

#[test]
fn conditions_on_designs_follow_the_durations_of_the_situation() {
    let text = |mission: &Mission| print_domain(mission.domain());
    let mut mission = timed(CONTEXT, "(span)", "3");
    let positive = text(&mission);
    mission.set("span", "0").expect("a value");
    assert_ne!(text(&mission), positive);
    assert_eq!(text(&mission), text(&timed(CONTEXT, "(span)", "0")));
    mission.fail("c").expect("a component");
    assert_eq!(designs(&mission), None);
    mission.set("span", "3").expect("a value");
    assert_eq!(text(&mission), positive);
}

/// No design of `f1` has an estimation of the bounded attribute, so the bound does not apply to `f1`. The design `fd_a`
/// also serves `f2`, to which the bound applies.
#[test]
fn a_bound_applies_to_the_functions_with_estimations() {
    // TOMASys itself admits only one function per design.
    let prefix = PREFIX.replace(" ; owl:imports <http://metacontrol.org/tomasys>", "");
    let knowledge = ":f1 a t:Function . :f2 a t:Function . :safety a t:QualityAttributeType .
        :careful a t:Requirement ; t:isQAtype :safety ; t:hasMinimum 0.5 .
        :a_first a t:Action ; t:requiresF :f1 ; t:requiresQuality :careful .
        :a_second a t:Action ; t:requiresF :f2 ; t:requiresQuality :careful .
        :a_both a t:Action ; t:requiresF :f1 , :f2 ; t:requiresQuality :careful .
        :fd_a a t:FunctionDesign ; t:solvesF :f1 , :f2 .
        :fd_b a t:FunctionDesign ; t:solvesF :f2 ; t:hasQAestimation [ a t:QAvalue ; t:isQAtype :safety ; t:hasValue 0.9 ] .";
    let domain = |actions: &str| {
        format!("(define (domain d) (:predicates (open) (one) (done)) (:functions (total-cost)) {actions})")
    };
    let first =
        "(:action first :parameters () :precondition (open) :effect (and (one) (increase (total-cost) 1)))";
    let second =
        "(:action second :parameters () :precondition (one) :effect (and (done) (increase (total-cost) 1)))";
    let both =
        "(:action both :parameters () :precondition (open) :effect (and (done) (increase (total-cost) 1)))";
    let knowledge = format!("{prefix}{knowledge}");
    check_small(&knowledge, &domain(&format!("{first} {second}")), &[], "2", &["fd_a", "fd_b"]);
    check_small(&knowledge, &domain(both), &[], "1", &["fd_a", "fd_b"]);
}

/// One function with one design. The statements of a test are added to these.
const ONE_DESIGN: &str = "@prefix o: <urn:o#> . :f a t:Function . :effort a t:QualityAttributeType .
    :a_go a t:Action ; t:requiresF :f .
    :fd_a a t:FunctionDesign ; t:solvesF :f ; t:hasQAestimation [ a t:QAvalue ; t:isQAtype :effort ; t:hasValue 1 ] .\n";

fn with_statements(statements: &str) -> Result<Mission, Errors> {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let domain = "(define (domain d) (:predicates (done)) (:functions (total-cost) (effort))
        (:action go :parameters () :precondition () :effect (and (done) (increase (total-cost) (effort)))))";
    let problem = "(define (problem p) (:domain d) (:init (= (total-cost) 0)) (:goal (done))
        (:metric minimize (total-cost)))";
    let knowledge = format!("{PREFIX}{ONE_DESIGN}{statements}");
    read(directory.path(), &knowledge, domain, problem, &BTreeMap::new())
}

#[test]
fn individuals_with_one_name_in_pddl_are_refused() {
    let bound = "a t:Requirement ; t:isQAtype :effort ; t:hasMaximum";
    for (statements, first, second) in [
        ("o:fd_a a t:FunctionDesign ; t:solvesF :f .", "<urn:m#fd_a>", "<urn:o#fd_a>"),
        (":FD_A a t:FunctionDesign ; t:solvesF :f .", "<urn:m#FD_A>", "<urn:m#fd_a>"),
        ("o:f a t:Function . :fd_b a t:FunctionDesign ; t:solvesF o:f .", "<urn:m#f>", "<urn:o#f>"),
        (
            "o:fd_a a t:Function . :fd_b a t:FunctionDesign ; t:solvesF o:fd_a .",
            "<urn:m#fd_a>",
            "<urn:o#fd_a>",
        ),
        (
            format!(":a_go t:requiresQuality :q , o:q . :q {bound} 1 . o:q {bound} 2 .").as_str(),
            "<urn:m#q>",
            "<urn:o#q>",
        ),
        (
            "o:effort a t:QualityAttributeType . [] a t:QAvalue ; t:isQAtype o:effort ; t:hasValue 2 .",
            "<urn:m#effort>",
            "<urn:o#effort>",
        ),
        (":go a t:Action ; t:requiresF :f , :g . :g a t:Function .", "<urn:m#a_go>", "<urn:m#go>"),
    ] {
        let messages = with_statements(statements).map(|_| ()).expect_err(statements);
        let messages: Vec<_> = messages.iter().collect();
        let [message] = messages[..] else { panic!("{statements}: {messages:#?}") };
        assert_eq!(message.code, "M225", "{statements}: {messages:#?}");
        for iri in [first, second] {
            assert!(message.message.contains(iri), "{statements}: no {iri}: {messages:#?}");
        }
    }
}

#[test]
fn equal_names_outside_of_the_problem_are_accepted() {
    for statements in [
        "o:fd_a a t:Component .",
        "o:fd_a a t:QualityAttributeType .",
        "o:effort a t:QualityAttributeType .",
        "o:a_go a t:Action .",
        ":Effort a t:Component .",
        // Both actions have the same requirements.
        ":go a t:Action ; t:requiresF :f .",
    ] {
        let mission = with_statements(statements).unwrap_or_else(|messages| panic!("{messages:#?}"));
        assert_eq!(answer(&mission).1.as_deref(), Some("1"), "{statements}");
    }
}

#[test]
fn different_values_of_one_attribute_are_refused() {
    let estimation = |kind: &str, value: &str| {
        format!(
            ":fd_a t:hasQAestimation :v{value} . :v{value} a t:QAvalue ; t:isQAtype {kind} ; t:hasValue {value} ."
        )
    };
    let measured = |value: &str| {
        format!(":w{value} a t:QAvalue ; t:isQAtype :effort ; t:isMeasured true ; t:hasValue {value} .")
    };
    let twice = |part: &dyn Fn(&str) -> String| format!("{}\n{}", part("2"), part("7"));
    for (statements, words) in [
        (estimation(":effort", "7"), ["<urn:m#fd_a> has two estimations of `effort`", "7 (<urn:m#v7>)"]),
        (twice(&measured), ["2 (<urn:m#w2>)", "7 (<urn:m#w7>)"]),
    ] {
        let messages = with_statements(&statements).map(|_| ()).expect_err(&statements);
        let messages: Vec<_> = messages.iter().collect();
        let [message] = messages[..] else { panic!("{statements}: {messages:#?}") };
        assert_eq!(message.code, "M234", "{statements}: {messages:#?}");
        for word in words {
            assert!(message.message.contains(word), "{statements}: no `{word}`: {messages:#?}");
        }
    }
    // Equal values, and values that the problem does not use.
    for statements in [estimation(":effort", "1"), twice(&|value| estimation(":beauty", value))] {
        let mission = with_statements(&statements).unwrap_or_else(|messages| panic!("{messages:#?}"));
        assert_eq!(answer(&mission).1.as_deref(), Some("1"), "{statements}");
    }
}

#[test]
fn values_with_the_prefix_of_measurements_can_be_estimations() {
    let value = "a t:QAvalue ; t:isQAtype :effort ; t:hasValue 5";
    let design = ":fd_b a t:FunctionDesign ; t:solvesF :f ; t:hasQAestimation :obs_b .";
    for (statements, cost) in [
        (format!("{design} :obs_b {value} ; t:isMeasured false ."), "1"),
        (format!("{design} :obs_b {value} ."), "1"),
        (format!(":obs_b {value} ; t:isMeasured false ."), "1"),
        // A measured value replaces the estimations of all designs.
        (format!(":obs_b {value} ."), "5"),
        (format!(":qa_b {value} ; t:isMeasured true ."), "5"),
        (format!(":qa_b {value} ; t:isMeasured true . :cost owl:sameAs :effort ."), "5"),
        (format!(":qa_b {value} ; t:isMeasured true . :zeal owl:sameAs :effort ."), "5"),
    ] {
        let mission = with_statements(&statements).unwrap_or_else(|messages| panic!("{messages:#?}"));
        assert_eq!(answer(&mission).1.as_deref(), Some(cost), "{statements}");
    }
}

#[test]
fn settings_do_not_contradict_the_knowledge_base() {
    let bounded = ":a_go t:requiresQuality :q . :q a t:Requirement ; t:isQAtype :effort ; t:hasMaximum 2 .";
    let bounded = || with_statements(bounded).expect("a mission");
    let explicit = || shipped("ugv", &|_| {});
    for (mut mission, name, value, is_accepted) in [
        (bounded(), "fd_meets_q fd_a", "false", false),
        (bounded(), "fd_meets_q fd_a", "true", false),
        (bounded(), "done", "true", true),
        (explicit(), "fd_solve_f fd_amcl_kinect f_localization", "false", false),
        (explicit(), "fd_solve_f fd_amcl_kinect", "f_navigation", false),
        (explicit(), "fd_solve_f fd_amcl_kinect f_localization", "true", true),
        (explicit(), "robot_at", "wp2", true),
    ] {
        let outcome = mission.set(name, value);
        assert_eq!(outcome.is_ok(), is_accepted, "{name}={value}: {outcome:?}");
        assert!(outcome.err().is_none_or(|message| message.code == "M106"), "{name}={value}");
    }
}

#[test]
fn problems_do_not_state_which_designs_meet_a_bound() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let knowledge = format!(
        "{PREFIX}{ONE_DESIGN}:a_go t:requiresQuality :q . :q a t:Requirement ; t:isQAtype :effort ; t:hasMaximum 0 ."
    );
    let domain = "(define (domain d) (:predicates (done))
        (:action go :parameters () :precondition () :effect (done)))";
    let problem = "(define (problem p) (:domain d) (:init (fd_meets_q fd_a)) (:goal (done)))";
    let messages = read(directory.path(), &knowledge, domain, problem, &BTreeMap::new());
    let messages = messages.map(|_| ()).expect_err("a fact of the knowledge base");
    assert!(messages.iter().any(|message| message.code == "M116"), "{messages:#?}");
}

#[test]
fn same_individuals_count_once() {
    for statements in [
        ":h owl:sameAs :f .",
        ":e owl:sameAs :f . :a_go t:requiresF :e .",
        ":cost owl:sameAs :effort .",
        ":a_walk owl:sameAs :a_go .",
    ] {
        let mission = with_statements(statements).unwrap_or_else(|messages| panic!("{messages:#?}"));
        let (status, cost, steps) = answer(&mission);
        assert_eq!((status, cost.as_deref()), (Status::Optimal, Some("1")), "{statements}");
        let designs: Vec<&str> = steps.iter().flatten().map(|(_, design)| design.as_str()).collect();
        assert_eq!(designs, ["fd_a"], "{statements}");
        let doubts = mission.doubts();
        assert!(doubts.iter().all(|doubt| doubt.code != "M205"), "{statements}: {doubts:#?}");
    }
}

#[test]
fn a_measurement_does_not_change_an_estimation() {
    let statements = ":fd_a t:hasRequirement [ a t:Requirement ; t:isQAtype :effort ; t:hasMaximum 9 ] .
        :fd_b a t:FunctionDesign ; t:solvesF :f ; t:hasQAestimation :obs_effort .
        :obs_effort a t:QAvalue ; t:isQAtype :effort ; t:hasValue 0 .";
    let mut mission = with_statements(statements).unwrap_or_else(|messages| panic!("{messages:#?}"));
    mission.set("effort", "3").expect("an attribute with a bound");
    assert_eq!(answer(&mission).1.as_deref(), Some("0"));
}
