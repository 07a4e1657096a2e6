//! Selection of designs for objectives, compared with recorded choices of MROS, and as part of the
//! configuration loop ([`Keeper`]).

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use metaplan::configure::{Configurator, Goal, Keeper, KeeperAnswer, Service, Wishes, Worth};
use metaplan::knowledge::{Knowledge, RobotReport, Sources};
use metaplan::mapek::{Answer, FilterSettings, Observation};
use num_rational::BigRational;
use ontology::ReadOptions;
use ontology::tomasys::change::Status;
use planner::Limits;
use rules::{Delta, Fact};
use serde_json::Value;
use test_resources::{data, data_path};

fn real(files: &[&str]) -> Knowledge {
    let real = data_path("real/owl");
    let folder = |file: &str| match file {
        "tomasys.owl" => "mc_mdl_tomasys",
        "suave.owl" => "suave",
        _ => "mros_ontology",
    };
    let documents = files.iter().map(|file| real.join(folder(file)).join(file)).collect();
    let options = ReadOptions { directories: vec![real], ..ReadOptions::default() };
    Knowledge::read(&Sources { documents, options, ..Sources::default() }).expect("readable")
}

/// Intended deviations from MROS's configuration: name of the run, numbers of the deviating steps, and the
/// reason.
const DIFFERENCES: [(&str, &[usize], &str); 3] = [
    (
        "suave_cancel_ungrounded",
        &[2],
        "MROS stops with an AttributeError and keeps the objective; here it is given up",
    ),
    (
        "suave_no_measurement_crash",
        &[1],
        "MROS stops with a TypeError where nothing was measured; here that rules nothing out",
    ),
    (
        "urjc_mission",
        &[1, 3, 5, 6, 8, 10],
        "MROS's first design misses two requirements of the objective by its estimations, the one taken here misses one; \
         so another design has failed when MROS takes that one, and another is in use when no design is left",
    ),
];

fn number(text: &str) -> Option<BigRational> {
    let literal = rules::Literal::parse(text, Some("http://www.w3.org/2001/XMLSchema#decimal"), None);
    literal.as_rational()
}

fn apply_step(configurator: &mut Configurator, step: &Value) {
    let text = |key: &str| step[key].as_str().unwrap_or_default();
    match (text("op"), text("message")) {
        ("objective", _) => {
            let nfrs = step["nfrs"].as_object().expect("nfrs").iter();
            let bound = |value: &Value| number(value.as_str().expect("text")).expect("a number");
            let goal = Goal {
                name: text("id").to_owned(),
                function: text("type").to_owned(),
                requirements: nfrs.map(|(key, value)| (key.clone(), bound(value))).collect(),
                always_improve: step["always_improve"] == true,
            };
            // MROS keeps an objective of an unknown function but never serves the objective.
            let _ = configurator.pursue(&goal);
        }
        ("cancel", _) => configurator.give_up(text("id")).expect("known"),
        ("triple", _) => {
            let engine = configurator.knowledge_mut().runtime_mut().engine_mut();
            let [s, p, o] = ["s", "p", "o"].map(|key| engine.symbols_mut().name(text(key)));
            let delta = Delta { insert: vec![Fact::new(p, [s, o])], delete: Vec::new() };
            configurator.knowledge_mut().apply(delta).expect("no runaway");
        }
        ("diag", "QA status") => {
            if let Some(value) = number(text("value")) {
                let _ = configurator.knowledge_mut().take(text("key"), RobotReport::measured(&value));
            }
        }
        ("diag", "Component status") => {
            let status = match text("value") {
                "FALSE" => Status::Failed,
                "RECOVERED" => Status::Recovered,
                "TRUE" => Status::Working,
                _ => return,
            };
            let _ = configurator.knowledge_mut().take(text("key"), RobotReport::Component(status));
        }
        _ => {}
    }
}

fn served(configurator: &Configurator) -> BTreeMap<String, String> {
    let objectives = configurator.objectives().into_iter();
    let pair = |objective: ontology::runtime::Objective| {
        Some((objective.individual.name, objective.groundings.into_iter().next()?.design?.name))
    };
    objectives.filter_map(pair).collect()
}

fn served_by_mros(step: &Value) -> BTreeMap<String, String> {
    let groundings = step["state"]["groundings"].as_object().expect("groundings").values();
    let text = |value: &Value| value.as_str().expect("text").to_owned();
    groundings.map(|grounding| (text(&grounding["solvesO"]), text(&grounding["typeFD"]))).collect()
}

#[test]
fn choices_equal_those_of_mros_except_for_listed_differences() {
    let (Some(folder), Some(_)) = (data("golden/trace"), data("real/owl")) else { return };
    let folder = std::fs::read_dir(folder).expect("a folder");
    let mut files: Vec<PathBuf> = folder.map(|entry| entry.expect("an entry").path()).collect();
    files.sort();
    let (mut cycles, mut differences) = (0, BTreeMap::<String, Vec<usize>>::new());
    for file in files {
        let trace: Value =
            serde_json::from_str(&std::fs::read_to_string(&file).expect("a file")).expect("JSON");
        let scenario = trace["scenario"].as_str().expect("scenario").to_owned();
        let list = |key: &str| trace[key].as_array().expect("a list").clone();
        let documents = list("kb_files");
        let documents: Vec<&str> =
            documents.iter().map(|document| document.as_str().expect("text")).collect();
        let mut configurator = Configurator::new(real(&documents), Wishes::default()).expect("no wishes");
        for (at, step) in list("steps").iter().enumerate() {
            if step["op"] != "cycle" {
                apply_step(&mut configurator, step);
                continue;
            }
            cycles += 1;
            let consistent = configurator.knowledge().contradictions().is_empty();
            let configuration = configurator.choose(&Limits::none()).expect("no runaway");
            assert!(configuration.optimal);
            if consistent && step["reconfiguration_success"] != false {
                for choice in &configuration.choices {
                    configurator.adopt(choice).expect("known");
                }
            }
            if served(&configurator) != served_by_mros(step) {
                differences.entry(scenario.clone()).or_default().push(at);
            }
        }
    }
    let listed = DIFFERENCES.map(|(scenario, steps, _)| (scenario.to_owned(), steps.to_vec()));
    assert_eq!(differences, BTreeMap::from(listed));
    assert_eq!(cycles, 80);
}

/// Knowledge base with two functions. Their best designs both use the arm, and together need 9
/// units of energy.
pub const ROBOT: &str = r"
@prefix t: <http://metacontrol.org/tomasys#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix : <http://example.org/robot#> .
<http://example.org/robot> a owl:Ontology ; owl:imports <http://metacontrol.org/tomasys> .
:f_look a t:Function . :f_grasp a t:Function .
:c_arm a t:Component . :c_camera a t:Component .
:performance a t:QualityAttributeType . :energy a t:QualityAttributeType .
:fd_look_close a t:FunctionDesign ; t:solvesF :f_look ; t:requiresC :c_arm , :c_camera ; t:hasQAestimation :p9 , :e5 .
:fd_look_far a t:FunctionDesign ; t:solvesF :f_look ; t:requiresC :c_camera ; t:hasQAestimation :p2 , :e1 .
:fd_grasp_firm a t:FunctionDesign ; t:solvesF :f_grasp ; t:requiresC :c_arm ; t:hasQAestimation :p8 , :e4 .
:fd_push a t:FunctionDesign ; t:solvesF :f_grasp ; t:hasQAestimation :p5 , :e1 .
:p9 a t:QAvalue ; t:isQAtype :performance ; t:hasValue 0.9 . :p2 a t:QAvalue ; t:isQAtype :performance ; t:hasValue 0.2 .
:p8 a t:QAvalue ; t:isQAtype :performance ; t:hasValue 0.8 . :p5 a t:QAvalue ; t:isQAtype :performance ; t:hasValue 0.5 .
:e5 a t:QAvalue ; t:isQAtype :energy ; t:hasValue 5 . :e1 a t:QAvalue ; t:isQAtype :energy ; t:hasValue 1 .
:e4 a t:QAvalue ; t:isQAtype :energy ; t:hasValue 4 .
";

pub fn robot() -> Knowledge {
    robot_with("")
}

pub fn robot_with(statements: &str) -> Knowledge {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("robot.ttl");
    std::fs::write(&file, format!("{ROBOT}{statements}")).expect("written");
    let (documents, rules) = (vec![file], vec!["coadaptation".to_owned()]);
    Knowledge::read(&Sources { documents, rules, ..Sources::default() }).expect("readable")
}

fn chosen(wishes: Wishes) -> (Vec<Option<String>>, BigRational) {
    let mut configurator = Configurator::new(robot(), wishes).expect("known names");
    for function in configurator.functions() {
        configurator.pursue(&Goal::of(&function)).expect("known");
    }
    let configuration = configurator.choose(&Limits::none()).expect("no runaway");
    assert!(configuration.optimal);
    (configuration.choices.into_iter().map(|choice| choice.design).collect(), configuration.utility)
}

#[test]
fn competing_functions_are_configured_jointly() {
    let name = |name: &str| Some(name.to_owned());
    let sum = |text: &str| number(text).expect("a number");
    // Functions in alphabetical order: first grasp, then look.
    assert_eq!(chosen(Wishes::default()), (vec![name("fd_grasp_firm"), name("fd_look_close")], sum("1.7")));
    let exclusive = BTreeSet::from(["c_arm".to_owned()]);
    let wishes = Wishes { exclusive, ..Wishes::default() };
    assert_eq!(chosen(wishes.clone()), (vec![name("fd_push"), name("fd_look_close")], sum("1.4")));
    // A budget of 5 excludes the best pair: firm and far have utility 1.0; push and close need 6.
    let budget = |limit: &str| Wishes { budgets: vec![("energy".to_owned(), sum(limit))], ..wishes.clone() };
    assert_eq!(chosen(budget("5")), (vec![name("fd_grasp_firm"), name("fd_look_far")], sum("1.0")));
    assert_eq!(chosen(budget("1")).0, [name("fd_push"), None]);
    let cheap = Wishes { worth: Worth::Least("energy".to_owned()), ..Wishes::default() };
    assert_eq!(chosen(cheap), (vec![name("fd_push"), name("fd_look_far")], sum("-2")));
}

fn deliver(keeper: &mut Keeper, line: &str) -> Vec<KeeperAnswer> {
    keeper.handle(&Observation::parse(line))
}

/// Returns the requested reconfigurations: objective, previous design, new design.
fn reconfigurations(answers: &[KeeperAnswer]) -> Vec<(&str, Option<&str>, Option<&str>)> {
    let reconfigurations = answers.iter().filter_map(|answer| match answer {
        KeeperAnswer::Service(Service::Reconfigure { objective, from, to, .. }) => {
            Some((objective.as_str(), from.as_deref(), to.as_deref()))
        }
        _ => None,
    });
    reconfigurations.collect()
}

#[test]
fn a_failed_design_is_replaced_and_requested_again_once_realisable() {
    let mut keeper = Keeper::new(Configurator::new(robot(), Wishes::default()).expect("no wishes"), None);
    assert_eq!(keeper.start(), []);
    let answers =
        deliver(&mut keeper, r#"{"event":"objective_added","objective":"o1","function":"f_look","seq":1}"#);
    assert_eq!(reconfigurations(&answers), [("o1", None, Some("fd_look_close"))]);
    // After the refusal, the second-best design is requested.
    let answers = deliver(&mut keeper, r#"{"event":"reconfiguration_failed","effect":1,"seq":2}"#);
    assert_eq!(reconfigurations(&answers), [("o1", None, Some("fd_look_far"))]);
    assert_eq!(reconfigurations(&deliver(&mut keeper, r#"{"event":"acknowledged","effect":2}"#)), []);
    deliver(&mut keeper, r#"{"event":"design_status","design":"fd_look_close","realisable":true}"#);
    // A failure after the acknowledgement counts, too. Its duplicate changes nothing.
    let failed = r#"{"event":"reconfiguration_failed","effect":2}"#;
    assert_eq!(reconfigurations(&deliver(&mut keeper, failed)), [("o1", None, Some("fd_look_close"))]);
    assert_eq!(deliver(&mut keeper, failed), []);
    deliver(&mut keeper, r#"{"event":"design_status","design":"fd_look_far","realisable":true}"#);
    let answers =
        deliver(&mut keeper, r#"{"event":"component_status","component":"c_arm","status":"FALSE"}"#);
    assert_eq!(reconfigurations(&answers), [("o1", Some("fd_look_close"), Some("fd_look_far"))]);
    // Without the camera no design is available, and the current design stays. Once the camera works, the
    // objective is served again.
    let answers =
        deliver(&mut keeper, r#"{"event":"component_status","component":"c_camera","status":"FALSE"}"#);
    assert!(
        answers.iter().any(|answer| matches!(answer, KeeperAnswer::Service(Service::Unserved { .. }))),
        "{answers:?}"
    );
    assert_eq!(reconfigurations(&answers), []);
    assert_eq!(reconfigurations(&deliver(&mut keeper, r#"{"event":"tick"}"#)), []);
    deliver(&mut keeper, r#"{"event":"component_status","component":"c_arm","status":"RECOVERED"}"#);
    let answers =
        deliver(&mut keeper, r#"{"event":"component_status","component":"c_camera","status":"RECOVERED"}"#);
    assert_eq!(reconfigurations(&answers), [("o1", Some("fd_look_far"), Some("fd_look_close"))]);
    let duplicate = r#"{"event":"objective_added","objective":"o1","function":"f_look","seq":1}"#;
    assert_eq!(deliver(&mut keeper, duplicate), [KeeperAnswer::Loop(Answer::Duplicate { sequence: 1 })]);
    for (line, code) in [
        (r#"{"event":"objective_added","objective":"o2","function":"f_lok"}"#, "M306"),
        (r#"{"event":"objective_added","objective":"o1","function":"f_look"}"#, "M306"),
        (r#"{"event":"acknowledged","effect":77}"#, "M305"),
        (r#"{"event":"action_started","action":1}"#, "M306"),
        (r#"{"event":"objective_removed","objective":"o9"}"#, "M306"),
        (
            r#"{"event":"objective_added","objective":"o2","function":"f_look","requirements":{"energy":"much"}}"#,
            "M302",
        ),
    ] {
        let answers = deliver(&mut keeper, line);
        let is_refused = |answer: &KeeperAnswer| matches!(answer, KeeperAnswer::Loop(Answer::Error { code: error_code, .. }) if error_code == code);
        assert!(matches!(&answers[..], [only] if is_refused(only)), "{line}: {answers:?}");
    }
    let answers = deliver(&mut keeper, r#"{"event":"objective_removed","objective":"o1"}"#);
    assert_eq!(reconfigurations(&answers), [("o1", Some("fd_look_close"), None)]);
    assert_eq!(deliver(&mut keeper, r#"{"event":"acknowledged","effect":6}"#), []);
}

/// An objective without a choice gives up its design if another objective needs the component.
#[test]
fn a_design_that_cannot_be_kept_is_withdrawn() {
    let wishes = Wishes { exclusive: BTreeSet::from(["c_arm".to_owned()]), ..Wishes::default() };
    let mut keeper = Keeper::new(Configurator::new(robot(), wishes).expect("known names"), None);
    keeper.start();
    let design = |name: &str, realisable: bool| {
        format!(r#"{{"event":"design_status","design":"{name}","realisable":{realisable}}}"#)
    };
    deliver(&mut keeper, r#"{"event":"objective_added","objective":"o1","function":"f_look"}"#);
    deliver(&mut keeper, r#"{"event":"objective_added","objective":"o2","function":"f_grasp"}"#);
    for unavailable in ["fd_look_far", "fd_look_close"] {
        assert_eq!(reconfigurations(&deliver(&mut keeper, &design(unavailable, false))), []);
    }
    let answers = deliver(&mut keeper, &design("fd_push", false));
    let (close, firm) = (Some("fd_look_close"), Some("fd_grasp_firm"));
    assert_eq!(
        reconfigurations(&answers),
        [("o1", close, None), ("o2", Some("fd_push"), firm)],
        "{answers:?}"
    );
    let reason = "fd_look_close: fd_grasp_firm uses c_arm, which only one design can use";
    assert!(format!("{answers:?}").contains(reason), "{answers:?}");
    // The arm is in use, so the design does not come back; another design of the other objective releases the arm.
    assert_eq!(reconfigurations(&deliver(&mut keeper, &design("fd_look_close", true))), []);
    deliver(&mut keeper, &design("fd_push", true));
    let answers = deliver(&mut keeper, &design("fd_grasp_firm", false));
    assert_eq!(
        reconfigurations(&answers),
        [("o1", None, close), ("o2", firm, Some("fd_push"))],
        "{answers:?}"
    );
}

#[test]
fn a_refused_measurement_does_not_change_its_filter() {
    let knowledge = Knowledge::read(&Sources {
        documents: vec![PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("ontology/kb/ugv.ttl")],
        rules: vec!["coadaptation".to_owned()],
        ..Sources::default()
    });
    let configurator = Configurator::new(knowledge.expect("readable"), Wishes::default()).expect("no wishes");
    let mut keeper = Keeper::new(configurator, None).with_filters(&FilterSettings::default());
    keeper.start();
    let measured = |attribute: &str, value: &str| {
        format!(r#"{{"event":"measured","attribute":"{attribute}","value":{value}}}"#)
    };
    let available = |answers: &[KeeperAnswer]| format!("{answers:?}").contains("fd_amcl_kinect");
    assert!(available(&deliver(&mut keeper, &measured("ambient_light", "0.9"))));
    let refused = deliver(&mut keeper, &measured("http://example.org/wrong#ambient_light", "0.3"));
    assert!(format!("{refused:?}").contains("M306"), "{refused:?}");
    // Within the band of the bound 0.8.
    let answers = deliver(&mut keeper, &measured("ambient_light", "0.79"));
    assert!(!available(&answers), "{answers:?}");
}

/// A rule of the user and an event can make a design unavailable without an error of its objective.
#[test]
fn an_unavailable_design_in_use_is_replaced_without_an_error_of_the_objective() {
    let directory = tempfile::tempdir().expect("a directory");
    let (file, dark) = (directory.path().join("robot.ttl"), directory.path().join("dark.swrl"));
    std::fs::write(&file, format!("{ROBOT}:c_lamp a t:Component .")).expect("written");
    let rule = "@prefix t: <http://metacontrol.org/tomasys#> .
        @prefix r: <http://example.org/robot#> .
        [dark] t:requiresC(?fd, r:c_arm) ^ t:c_status(r:c_lamp, \"FALSE\") -> t:fd_realisability(?fd, false) .";
    std::fs::write(&dark, rule).expect("written");
    let rules = vec!["coadaptation".to_owned(), dark.display().to_string()];
    let sources = Sources { documents: vec![file], rules, ..Sources::default() };
    let knowledge = Knowledge::read(&sources).expect("readable");
    let mut keeper = Keeper::new(Configurator::new(knowledge, Wishes::default()).expect("no wishes"), None);
    keeper.start();
    deliver(&mut keeper, r#"{"event":"objective_added","objective":"o1","function":"f_look"}"#);
    let (close, far) = (Some("fd_look_close"), Some("fd_look_far"));
    let answers =
        deliver(&mut keeper, r#"{"event":"component_status","component":"c_lamp","status":"FALSE"}"#);
    assert_eq!(reconfigurations(&answers), [("o1", close, far)]);
    let reasons = answers.iter().find_map(|answer| match answer {
        KeeperAnswer::Service(Service::Reconfigure { because, .. }) => Some(because.as_slice()),
        _ => None,
    });
    let expected = [
        "o1 is served by fd_look_close, which is not available",
        "fd_look_close: rule: dark",
        "fd_look_close: requiresC(fd_look_close, c_arm)",
        "fd_look_close: c_status(c_lamp, \"FALSE\")",
    ];
    assert_eq!(reasons.expect("a change"), expected);
    // No design is available, and the current one stays. The report is not repeated.
    let far_fails = r#"{"event":"design_status","design":"fd_look_far","realisable":false}"#;
    let answers = deliver(&mut keeper, far_fails);
    assert_eq!(reconfigurations(&answers), []);
    assert!(
        answers.iter().any(|answer| matches!(answer, KeeperAnswer::Service(Service::Unserved { .. }))),
        "{answers:?}"
    );
    assert_eq!(deliver(&mut keeper, r#"{"event":"tick"}"#), []);
    let answers =
        deliver(&mut keeper, r#"{"event":"component_status","component":"c_lamp","status":"RECOVERED"}"#);
    assert_eq!(reconfigurations(&answers), [("o1", far, close)]);
    // An available design is kept if another one becomes available.
    deliver(&mut keeper, &far_fails.replace("false", "true"));
    let close_fails = far_fails.replace("fd_look_far", "fd_look_close");
    assert_eq!(reconfigurations(&deliver(&mut keeper, &close_fails)), [("o1", close, far)]);
    let answers = deliver(&mut keeper, &close_fails.replace("false", "true"));
    assert_eq!(reconfigurations(&answers), []);
}

#[test]
fn a_time_too_far_ahead_is_refused() {
    let mut keeper = Keeper::new(Configurator::new(robot(), Wishes::default()).expect("no wishes"), None);
    keeper.start();
    let added = r#"{"event":"objective_added","objective":"o1","function":"f_look","time":1e9}"#;
    let answers = deliver(&mut keeper, added);
    let is_refused = |answer: &KeeperAnswer| matches!(answer, KeeperAnswer::Loop(Answer::Error { code, .. }) if code == "M308");
    assert!(matches!(&answers[..], [only] if is_refused(only)), "{answers:?}");
    assert_eq!(keeper.now(), std::time::Duration::ZERO);
    let answers = deliver(&mut keeper, &added.replace("1e9", "5"));
    assert_eq!(reconfigurations(&answers), [("o1", None, Some("fd_look_close"))]);
}

#[test]
fn changes_of_an_objective_removed_by_its_iri_are_forgotten() {
    let mut keeper = Keeper::new(Configurator::new(robot(), Wishes::default()).expect("no wishes"), None);
    keeper.start();
    deliver(&mut keeper, r#"{"event":"objective_added","objective":"o1","function":"f_look"}"#);
    let iri = keeper.configurator().objectives()[0].individual.iri.clone();
    let removed = serde_json::json!({ "event": "objective_removed", "objective": iri });
    assert_eq!(
        reconfigurations(&deliver(&mut keeper, &removed.to_string())),
        [("o1", Some("fd_look_close"), None)]
    );
    // A late failure of the change neither is an error nor rules the design out.
    assert_eq!(deliver(&mut keeper, r#"{"event":"reconfiguration_failed","effect":1}"#), []);
    let answers = deliver(&mut keeper, r#"{"event":"objective_added","objective":"o2","function":"f_look"}"#);
    assert_eq!(reconfigurations(&answers), [("o2", None, Some("fd_look_close"))]);
}

#[test]
fn a_contradiction_elsewhere_does_not_stop_adaptation() {
    let contradiction = "
:Good a owl:Class ; owl:disjointWith :Bad . :Bad a owl:Class . :c_lamp a t:Component , :Good .
[ a owl:Restriction ; owl:onProperty t:c_status ; owl:hasValue \"FALSE\" ]
  <http://www.w3.org/2000/01/rdf-schema#subClassOf> :Bad .";
    let mut keeper = Keeper::new(
        Configurator::new(robot_with(contradiction), Wishes::default()).expect("no wishes"),
        None,
    );
    keeper.start();
    deliver(&mut keeper, r#"{"event":"objective_added","objective":"o1","function":"f_look"}"#);
    let answers =
        deliver(&mut keeper, r#"{"event":"component_status","component":"c_lamp","status":"FALSE"}"#);
    let is_contradicted =
        |answer: &KeeperAnswer| matches!(answer, KeeperAnswer::Loop(Answer::Contradicted { .. }));
    assert!(answers.iter().any(is_contradicted), "{answers:?}");
    let answers =
        deliver(&mut keeper, r#"{"event":"component_status","component":"c_arm","status":"FALSE"}"#);
    assert_eq!(reconfigurations(&answers), [("o1", Some("fd_look_close"), Some("fd_look_far"))]);
}
