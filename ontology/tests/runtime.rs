//! Reports, objectives in error and selection of designs: a small robot in both modes, and the recorded second
//! cycles of MROS.

use std::path::PathBuf;

use crate::common::{real_directory, selected};
use ontology::runtime::{Mode, NewObjective, Objective, Rejection, Runtime};
use ontology::tomasys::change::Status;
use ontology::{INTERNAL, ReadOptions, kb, lower, read_files, read_text, vocab};
use rules::{Delta, Engine, Fact, Literal, Symbols};
use test_resources::data;

const ROBOT: &str = r#"
@prefix t: <http://metacontrol.org/tomasys#> .
@prefix m: <http://ros/mros#> .
@prefix : <http://example.org/robot#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
<http://example.org/robot> a owl:Ontology .
t:Function a owl:Class . t:FunctionDesign a owl:Class . t:FunctionGrounding a owl:Class . t:Objective a owl:Class .
t:Component a owl:Class . t:QualityAttributeType a owl:Class . t:QAvalue a owl:Class .
t:solvesF a owl:ObjectProperty . t:solvesO a owl:ObjectProperty . t:typeF a owl:ObjectProperty .
t:typeFD a owl:ObjectProperty . t:hasNFR a owl:ObjectProperty . t:isQAtype a owl:ObjectProperty .
t:hasQAestimation a owl:ObjectProperty . t:hasQAvalue a owl:ObjectProperty . m:requiredBy a owl:ObjectProperty .
t:fd_error_log a owl:ObjectProperty .
t:hasValue a owl:DatatypeProperty , owl:FunctionalProperty .
t:c_status a owl:DatatypeProperty , owl:FunctionalProperty .
t:o_status a owl:DatatypeProperty , owl:FunctionalProperty .
t:o_updatable a owl:DatatypeProperty . t:o_always_improve a owl:DatatypeProperty .
t:fg_status a owl:DatatypeProperty . t:fd_realisability a owl:DatatypeProperty .
t:qa_comparison_operator a owl:DatatypeProperty .
:f_move a t:Function . :f_other a t:Function .
:fd_slow a t:FunctionDesign ; t:solvesF :f_move ; t:hasQAestimation :e_light , :e_air , :e_slow .
:fd_fast a t:FunctionDesign ; t:solvesF :f_move ; t:hasQAestimation :e_fast .
:c_motor a t:Component ; m:requiredBy :fd_fast .
:light a t:QualityAttributeType ; t:qa_comparison_operator "<" .
:air a t:QualityAttributeType ; t:qa_comparison_operator ">=" .
:performance a t:QualityAttributeType .
:e_light a t:QAvalue ; t:isQAtype :light ; t:hasValue 2.0 .
:e_air a t:QAvalue ; t:isQAtype :air ; t:hasValue 5 .
:e_slow a t:QAvalue ; t:isQAtype :performance ; t:hasValue 0.0 .
:e_fast a t:QAvalue ; t:isQAtype :performance ; t:hasValue 0.0 .
"#;

const RULES: &str = r#"
PREFIX t: <http://metacontrol.org/tomasys#>
PREFIX m: <http://ros/mros#>
t:c_status(?c, "FALSE") ^ m:requiredBy(?c, ?fd) -> t:fd_realisability(?fd, false)
t:c_status(?c, "FALSE") ^ m:requiredBy(?c, ?fd) ^ t:typeFD(?fg, ?fd) -> t:fg_status(?fg, "IN_ERROR_COMPONENT")
t:fg_status(?fg, ?s) ^ t:solvesO(?fg, ?o) -> t:o_status(?o, ?s)
t:c_status(?c, "RECOVERED") ^ t:Objective(?o) -> t:o_updatable(?o, true)
t:hasQAvalue(?fg, ?m) ^ t:isQAtype(?m, ?q) ^ t:hasValue(?m, ?v) ^ t:typeFD(?fg, ?fd) ^ t:hasQAestimation(?fd, ?e) ^ t:isQAtype(?e, ?q) ^ t:hasValue(?e, ?w) ^ swrlb:lessThan(?v, ?w) -> t:fg_status(?fg, "IN_ERROR_NFR")
"#;

fn robot(mode: Mode) -> Runtime {
    robot_with(mode, "")
}

fn robot_with(mode: Mode, additional_rules: &str) -> Runtime {
    let rules_text = format!("{RULES}{additional_rules}");
    let ontology = read_text(ROBOT, "robot.ttl", &ReadOptions::default()).expect("well-formed");
    let mut symbols = Symbols::new();
    let mut lowered = lower(&ontology, &mut symbols);
    let program = rules::parse_rules(&rules_text, "rules", &mut symbols, &rules::Prefixes::default());
    lowered.program.rules.extend(program.expect("rules").rules);
    Runtime::new(Engine::new(symbols, lowered.program, lowered.facts).expect("safe rules"), mode)
}

#[test]
fn candidates_list_missed_requirements() {
    for mode in [Mode::Retract, Mode::Latch] {
        let mut runtime = robot(mode);
        let requirements = vec![("air", decimal("9")), ("performance", decimal("0.5"))];
        let objective = NewObjective { name: "o", function: "f_move", requirements, always_improve: false };
        runtime.add_objective(&objective).expect("known");
        // Without a rule about requirements, no requirement is missed.
        let missed = |runtime: &Runtime| {
            let candidates = runtime.candidates("o", None).expect("known").into_iter();
            let describe =
                |missed: ontology::runtime::Missed| format!("{} {}", missed.attribute, missed.status);
            candidates
                .map(|candidate| candidate.missed.into_iter().map(describe).collect())
                .collect::<Vec<Vec<String>>>()
        };
        assert_eq!(missed(&runtime), [Vec::<String>::new(), vec![]]);
        let mut runtime = robot_with(mode, LESS_IS_AN_ERROR);
        runtime.add_objective(&objective).expect("known");
        // The estimated performance of both designs is too low. Requirements on environmental attributes are
        // not considered.
        assert_eq!(missed(&runtime), [["performance IN_ERROR_FR"], ["performance IN_ERROR_FR"]]);
        runtime.measure("performance", decimal("0.1")).expect("known");
        // Measurements of the previous design are not valid for the next one.
        runtime.ground("o", "fd_fast").expect("known");
        runtime.forget_performance("o").expect("known");
        runtime.conclude().expect("no runaway");
        assert!(!runtime.objectives()[0].is_in_error(), "{mode:?}");
        runtime.measure("performance", decimal("0.1")).expect("known");
        runtime.conclude().expect("no runaway");
        assert!(runtime.objectives()[0].is_in_error(), "{mode:?}");
    }
}

/// A rule for requirements: a measured value below the bound is an error, as in MROS's rules for energy.
const LESS_IS_AN_ERROR: &str = r#"t:hasNFR(?o, ?n) ^ t:isQAtype(?n, ?q) ^ t:hasValue(?n, ?w) ^ t:solvesO(?fg, ?o) ^ t:hasQAvalue(?fg, ?m) ^ t:isQAtype(?m, ?q) ^ t:hasValue(?m, ?v) ^ swrlb:lessThan(?v, ?w) -> t:o_status(?o, "IN_ERROR_FR")
"#;

fn decimal(text: &str) -> Literal {
    Literal::parse(text, Some(vocab::xsd::DECIMAL), None)
}

fn pursue(runtime: &mut Runtime, name: &str, function: &str) {
    let objective = NewObjective { name, function, requirements: Vec::new(), always_improve: false };
    runtime.add_objective(&objective).expect("new");
}

fn status(runtime: &Runtime) -> (Vec<String>, bool) {
    let [objective] = &runtime.objectives()[..] else { panic!("one objective") };
    (objective.statuses.clone(), objective.updatable)
}

fn check_failure(mode: Mode, after_repair: &[&str], updatable: bool) {
    let mut runtime = robot(mode);
    pursue(&mut runtime, "o", "f_move");
    assert_eq!(status(&runtime), (vec!["UNGROUNDED".to_owned()], false));
    runtime.ground("o", "fd_fast").expect("known");
    runtime.conclude().expect("applied");
    assert_eq!(status(&runtime), (Vec::new(), false));
    runtime.report_component("c_motor", Status::Failed).expect("known");
    assert_eq!(runtime.conclude().expect("applied"), []);
    assert_eq!(status(&runtime).0, ["IN_ERROR_COMPONENT"]);
    let objectives = runtime.objectives();
    assert!(objectives.iter().filter(|objective| objective.wants_design()).all(Objective::is_in_error));
    let why = runtime.why("o").expect("known");
    let text = why[0].display(runtime.engine().symbols()).to_string();
    assert!(text.contains("c_status> is stated") || text.contains("c_motor>, \"FALSE\""), "{text}");
    assert_eq!(selected(&runtime, "o").as_deref(), Some("fd_slow"), "{mode:?}");
    runtime.report_component("c_motor", Status::Recovered).expect("known");
    assert_eq!(runtime.conclude().expect("applied"), []);
    assert_eq!(status(&runtime), (after_repair.iter().map(ToString::to_string).collect(), updatable));
    assert_eq!(selected(&runtime, "o").as_deref(), Some("fd_fast"), "of equals the first, {mode:?}");
    runtime.note_recoveries().expect("applied");
    runtime.ground("o", "fd_fast").expect("known");
    runtime.conclude().expect("applied");
    assert_eq!(status(&runtime), (Vec::new(), false));
    assert_eq!(runtime.objectives()[0].groundings.len(), 1);
}

#[test]
fn a_status_is_retracted_with_its_cause() {
    check_failure(Mode::Retract, &[], true);
}

#[test]
fn a_latched_status_remains_until_grounding() {
    check_failure(Mode::Latch, &["IN_ERROR_COMPONENT"], true);
}

#[test]
fn designs_without_measurements_and_utility_are_selected() {
    let mut runtime = robot(Mode::Retract);
    pursue(&mut runtime, "o", "f_move");
    assert_eq!(selected(&runtime, "o").as_deref(), Some("fd_fast"));
    pursue(&mut runtime, "p", "f_other");
    assert_eq!(selected(&runtime, "p"), None);
}

#[test]
fn a_design_that_violates_two_attributes_is_rejected_with_both_reasons() {
    let mut runtime = robot(Mode::Retract);
    pursue(&mut runtime, "o", "f_move");
    for (attribute, value) in [("light", "1.99"), ("air", "5.0")] {
        runtime.measure(attribute, decimal(value)).expect("known");
    }
    runtime.report_component("c_motor", Status::Failed).expect("known");
    assert_eq!(selected(&runtime, "o"), None);
    let rejections = |runtime: &Runtime| -> Vec<Vec<Rejection>> {
        let candidates = runtime.candidates("o", None).expect("known");
        candidates.into_iter().map(|candidate| candidate.rejections).collect()
    };
    let [fast, slow] = &rejections(&runtime)[..] else { panic!("two designs") };
    assert_eq!((&fast[..], slow.len()), (&[Rejection::Unavailable][..], 2));
    runtime.measure("light", decimal("2.00")).expect("known");
    assert_eq!(rejections(&runtime)[1].len(), 1);
    runtime.measure("air", decimal("4.9")).expect("known");
    assert_eq!(selected(&runtime, "o").as_deref(), Some("fd_slow"));
    assert_eq!(runtime.engine().violations(), []);
}

#[test]
fn a_grounding_uses_earlier_measurements_only_in_retract_mode() {
    for (mode, expected) in [(Mode::Retract, &["IN_ERROR_NFR"][..]), (Mode::Latch, &[])] {
        let mut runtime = robot(mode);
        runtime.measure("light", decimal("1.0")).expect("known");
        pursue(&mut runtime, "o", "f_move");
        runtime.ground("o", "fd_slow").expect("known");
        runtime.conclude().expect("applied");
        assert_eq!(status(&runtime).0, expected, "{mode:?}");
        runtime.measure("light", decimal("1.0")).expect("known");
        runtime.conclude().expect("applied");
        assert_eq!(status(&runtime).0, ["IN_ERROR_NFR"], "{mode:?}");
    }
}

#[test]
fn removing_an_objective_restores_the_facts() {
    let mut runtime = robot(Mode::Retract);
    let before: Vec<Fact> = runtime.engine().facts().collect();
    let requirements = vec![("light", decimal("0.5")), ("air", decimal("1"))];
    let objective = NewObjective { name: "o", function: "f_move", requirements, always_improve: true };
    runtime.add_objective(&objective).expect("new");
    assert!(runtime.objectives()[0].wants_design());
    runtime.ground("o", "fd_slow").expect("known");
    assert!(runtime.objectives()[0].wants_design(), "it always improves");
    runtime.unground("o").expect("known");
    assert_eq!(status(&runtime).0, ["UNGROUNDED"]);
    runtime.ground("o", "fd_fast").expect("known");
    runtime.remove_objective("o").expect("known");
    assert_eq!(runtime.engine().facts().collect::<Vec<_>>(), before);
}

#[test]
fn removing_an_objective_keeps_requirements_of_other_objectives() {
    for (rule, is_kept) in [("-> t:hasNFR(t:p, t:o_nfr_light)", true), ("", false)] {
        let mut runtime = robot_with(Mode::Retract, rule);
        let requirements = vec![("light", decimal("0.5"))];
        let objective = NewObjective { name: "o", function: "f_move", requirements, always_improve: false };
        runtime.add_objective(&objective).expect("new");
        runtime.remove_objective("o").expect("known");
        let symbols = runtime.engine().symbols();
        let [class, requirement] = ["QAvalue", "o_nfr_light"]
            .map(|local| symbols.find_name(&format!("http://metacontrol.org/tomasys#{local}")).expect(local));
        assert_eq!(runtime.engine().holds(&Fact::new(class, [requirement])), is_kept, "{rule}");
    }
}

#[test]
fn two_objectives_may_use_one_design() {
    let mut runtime = robot(Mode::Retract);
    let mut names = Vec::new();
    for objective in ["o", "p"] {
        pursue(&mut runtime, objective, "f_move");
        names.push(runtime.ground(objective, "fd_fast").expect("known").name);
    }
    assert_eq!(names, ["fg_fast", "fg_fast_p"]);
}

#[test]
fn unknown_and_invalid_names_are_rejected() {
    let mut runtime = robot(Mode::Latch);
    let before: Vec<Fact> = runtime.engine().facts().collect();
    let objective =
        |name, function| NewObjective { name, function, requirements: Vec::new(), always_improve: false };
    let mut codes = vec![
        runtime.add_objective(&objective("o", "f_fly")).expect_err("no function").code(),
        runtime.add_objective(&objective("o o", "f_move")).expect_err("no IRI").code(),
        runtime.measure("smell", decimal("1")).expect_err("no attribute").code(),
        runtime.measure("light", decimal("bright")).expect_err("no number").code(),
        runtime.report_component("c_radar", Status::Failed).expect_err("no component").code(),
        runtime.ground("o", "fd_fast").expect_err("no objective").code(),
        runtime.candidates("o", None).expect_err("no objective").code(),
    ];
    assert_eq!(runtime.engine().facts().collect::<Vec<_>>(), before);
    pursue(&mut runtime, "o", "f_move");
    codes.push(runtime.add_objective(&objective("o", "f_move")).expect_err("twice").code());
    assert_eq!(codes, ["O106", "O107", "O106", "O110", "O106", "O106", "O106", "O108"]);
}

#[test]
fn our_own_robots_are_grounded_and_adapted() {
    let ontology = read_text(kb::UUV, "uuv.ttl", &ReadOptions::default()).expect("well-formed");
    let mut symbols = Symbols::new();
    let lowered = lower(&ontology, &mut symbols);
    let engine = Engine::new(symbols, lowered.program, lowered.facts).expect("safe rules");
    let mut runtime = Runtime::new(engine, Mode::Retract);
    pursue(&mut runtime, "search", "f_generate_search_path");
    runtime.measure("water_visibility", decimal("2.5")).expect("known");
    let available = runtime.available_designs(Some("f_generate_search_path")).expect("known");
    let names: Vec<_> = available.iter().map(|design| design.name.as_str()).collect();
    assert_eq!(names, ["fd_search_low", "fd_search_medium"]);
    let design = selected(&runtime, "search").expect("one is left");
    assert!(names.contains(&design.as_str()), "{design}");
    runtime.ground("search", &design).expect("known");
    assert_eq!(runtime.engine().violations(), []);
}

/// The recorded second cycles of MROS: there are no new conclusions, and the statuses remain.
#[test]
fn recorded_second_cycles_of_mros_are_reproduced() {
    for (case, property, expected) in [
        ("suave_26_second_cycle_latched", None, "IN_ERROR_COMPONENT"),
        (
            "suave_27_second_cycle_status_removed_latched",
            Some(vocab::tomasys::C_STATUS),
            "IN_ERROR_COMPONENT",
        ),
        ("suave_28_second_cycle_visibility_back_latched", Some(vocab::tomasys::HAS_VALUE), "IN_ERROR_NFR"),
    ] {
        let Some(path) = data(format!("golden/kb/{case}.json")) else { return };
        let text = std::fs::read_to_string(path).expect("readable");
        let case: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let mut runtime = second_cycle(&case);
        assert_eq!(runtime.conclude().expect("applied"), []);
        assert_eq!(status(&runtime).0, [expected]);
        match property {
            Some(vocab::tomasys::HAS_VALUE) => {
                runtime.measure("water_visibility", decimal("3.5")).expect("known");
            }
            Some(_) => {
                runtime.clear_component("c_thruster_1").expect("known");
            }
            None => {}
        }
        let engine = runtime.engine();
        let new_facts = |fact: &Fact| {
            let name = engine.symbols().value(fact.predicate).as_name().expect("name");
            !engine.is_asserted(fact) && !name.starts_with(INTERNAL)
        };
        let new_facts: Vec<_> =
            engine.facts().filter(new_facts).map(|f| f.display(engine.symbols()).to_string()).collect();
        assert_eq!(
            new_facts.len(),
            case["reference"]["inferred"].as_array().expect("list").len(),
            "{new_facts:?}"
        );
        assert_eq!(runtime.conclude().expect("applied"), []);
        assert_eq!(status(&runtime).0, [expected]);
    }
}

fn second_cycle(case: &serde_json::Value) -> Runtime {
    let real = real_directory();
    let files = case["kb"].as_array().expect("kb").iter();
    let files: Vec<PathBuf> = files.map(|file| real.join(file.as_str().expect("file"))).collect();
    let options = ReadOptions { directories: vec![real], ..ReadOptions::default() };
    let ontology = read_files(&files, &options).expect("readable");
    let mut symbols = Symbols::new();
    let lowered = lower(&ontology, &mut symbols);
    let engine = Engine::new(symbols, lowered.program, lowered.facts).expect("safe rules");
    let mut runtime = Runtime::new(engine, Mode::Latch);
    let mut insert = Vec::new();
    for triple in case["added"].as_array().expect("added") {
        let [subject, predicate, object] = [0, 1, 2].map(|index| triple[index].as_str().expect("term"));
        let symbols = runtime.engine_mut().symbols_mut();
        let subject = symbols.name(subject);
        match object.strip_prefix('"') {
            _ if object == vocab::owl::NAMED_INDIVIDUAL => {}
            _ if predicate == vocab::rdf::TYPE => insert.push(Fact::new(symbols.name(object), [subject])),
            Some(quoted) => {
                let (lexical, suffix) = quoted.rsplit_once('"').expect("quote");
                let datatype = suffix.trim_start_matches("^^<").trim_end_matches('>');
                let value = symbols.literal(Literal::parse(lexical, Some(datatype), None));
                insert.push(Fact::new(symbols.name(predicate), [subject, value]));
            }
            None => {
                let object = symbols.name(object);
                insert.push(Fact::new(symbols.name(predicate), [subject, object]));
            }
        }
    }
    runtime.apply(Delta { insert, delete: Vec::new() }).expect("applied");
    runtime
}

/// All pairs of the names would take gigabytes.
#[test]
fn many_names_of_an_individual_take_little_memory() {
    let pairs: Vec<String> = (0..10_000)
        .map(|number| format!("<http://e/a> <{}> <http://e/b{number}> .", vocab::owl::SAME_AS))
        .collect();
    let text = format!("{}\n<http://e/b7> a <http://e/Robot> .", pairs.join("\n"));
    let ontology = read_text(&text, "names.ttl", &ReadOptions::default()).expect("readable");
    let mut symbols = Symbols::new();
    let lowered = lower(&ontology, &mut symbols);
    let engine = Engine::new(symbols, lowered.program, lowered.facts).expect("safe");
    for mode in [Mode::Retract, Mode::Latch] {
        let mut runtime = Runtime::new(engine.clone(), mode);
        let [same_as, first, new] = [vocab::owl::SAME_AS, "http://e/a", "http://e/new"]
            .map(|name| runtime.engine_mut().symbols_mut().name(name));
        let pair = Fact::new(same_as, [first, new]);
        let delta = Delta { insert: vec![pair.clone()], delete: Vec::new() };
        let change = runtime.apply(delta).expect("it ends");
        // All pairs with the new name in both directions, and its class.
        assert_eq!(change.insert.len(), 2 * 10_001 + 1);
        assert_eq!(runtime.engine().stated_facts().len(), 10_002);
        assert_eq!(runtime.engine().matching(same_as, &[Some(new), None]).count(), 10_001);
        let change = runtime.apply(Delta { insert: Vec::new(), delete: vec![pair] }).expect("it ends");
        assert_eq!(change.delete.len(), 2 * 10_001 + 1);
    }
}
