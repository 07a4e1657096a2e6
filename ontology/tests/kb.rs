//! The embedded knowledge bases: they load without warnings, contain the data of the missions, and react to
//! reports of the robot.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use ontology::tomasys::{View, change};
use ontology::{
    Axiom, Characteristic, EntityKind, ObjectPropertyExpression, OutputSyntax, ReadOptions, convert_files,
    kb, lower, read_text,
};
use rules::{Engine, Literal, Symbols};

fn engine(text: &str, name: &str) -> Engine {
    let ontology = read_text(text, name, &ReadOptions::default()).expect("well-formed");
    assert_eq!(ontology.warnings, [], "{name}");
    let mut symbols = Symbols::new();
    let lowered = lower(&ontology, &mut symbols);
    assert_eq!(lowered.warnings, [], "{name}");
    let engine = Engine::new(symbols, lowered.program, lowered.facts).expect("safe rules");
    assert_eq!(engine.violations(), [], "{name}");
    engine
}

fn designs(engine: &Engine) -> Vec<String> {
    let line = |design: ontology::tomasys::FunctionDesign| {
        let names = |individuals: &[ontology::tomasys::Individual]| {
            individuals.iter().map(|individual| individual.name.clone()).collect::<Vec<_>>().join("+")
        };
        let estimations: Vec<_> =
            design.estimations.iter().map(|(name, value)| format!("{name}={value}")).collect();
        let (functions, components) = (names(&design.solves), names(&design.components));
        let available = if design.available { "available" } else { "unavailable" };
        format!("{} {functions} {components} {} {available}", design.individual.name, estimations.join(" "))
    };
    View::new(engine).function_designs().into_iter().map(line).collect()
}

fn available(engine: &Engine) -> Vec<String> {
    let designs = View::new(engine).function_designs().into_iter();
    designs.filter(|design| design.available).map(|design| design.individual.name).collect()
}

#[test]
fn tomasys_loads_alone() {
    engine(kb::TOMASYS, "tomasys.ttl");
}

#[test]
fn ugv_has_the_designs_of_the_mission() {
    let engine = engine(kb::UGV, "ugv.ttl");
    assert_eq!(
        designs(&engine),
        [
            "fd_amcl_kinect f_localization c_kinect battery_usage=2 minimum_illuminance=0 safety=1 available",
            "fd_amcl_lidar f_localization c_lidar battery_usage=4 minimum_illuminance=0 safety=2/5 available",
            "fd_aruco f_localization c_camera battery_usage=7 minimum_illuminance=1 safety=7/10 available",
            "fd_aruco_with_light f_localization c_camera+c_flashlight battery_usage=10 minimum_illuminance=0 \
             safety=7/10 available",
            "fd_mrpt_kinect f_localization c_kinect battery_usage=4 minimum_illuminance=0 safety=9/10 available",
            "fd_mrpt_lidar f_localization c_lidar battery_usage=6 minimum_illuminance=0 safety=3/10 available",
        ]
    );
    let view = View::new(&engine);
    let [action] = &view.actions()[..] else { panic!("one action") };
    assert_eq!(
        (action.individual.name.as_str(), action.requires[0].name.as_str()),
        ("a_move", "f_localization")
    );
    assert_eq!(view.components().len(), 4);
    assert_eq!(view.individuals_of_class_named("Function").len(), 1);
}

#[test]
fn uuv_has_the_designs_of_the_mission() {
    let engine = engine(kb::UUV, "uuv.ttl");
    let view = View::new(&engine);
    let solves = |function: &str| {
        let designs = view.function_designs().into_iter().filter(|design| design.solves[0].name == function);
        designs.map(|design| design.individual.name).collect::<Vec<_>>()
    };
    assert_eq!(solves("f_maintain_motion"), ["fd_speed_high", "fd_speed_low", "fd_speed_medium"]);
    assert_eq!(solves("f_generate_search_path"), ["fd_search_high", "fd_search_low", "fd_search_medium"]);
    assert_eq!(solves("f_follow_pipeline"), ["fd_follow"]);
    assert_eq!(solves("f_recharge"), ["fd_recharge"]);
    assert!(view.actions().iter().all(|action| action.requires.len() == 2));
    assert!(view.function_designs().iter().all(|design| design.available && design.estimations.len() == 2));
}

#[test]
fn a_failed_component_makes_its_designs_unavailable_until_it_recovers() {
    let mut engine = engine(kb::UGV, "ugv.ttl");
    let initial = available(&engine);
    for (status, expected) in [
        (change::Status::Failed, vec!["fd_amcl_lidar", "fd_aruco", "fd_aruco_with_light", "fd_mrpt_lidar"]),
        (change::Status::Recovered, initial.iter().map(String::as_str).collect()),
    ] {
        let delta = change::component_status(&mut engine, "c_kinect", status).expect("known");
        engine.apply(delta).expect("applied");
        assert_eq!(available(&engine), expected, "{status:?}");
        assert_eq!(engine.violations(), []);
    }
    let delta = change::clear_component_status(&mut engine, "c_kinect").expect("known");
    engine.apply(delta).expect("applied");
    assert_eq!(available(&engine), initial);
}

/// The status of a failed component is written as the knowledge base requires it for this component, and the shipped
/// rules know each way. Columns: statements about the status, expected status.
#[test]
fn shipped_rules_know_each_status_of_a_failed_component() {
    let boolean = "a [ a owl:Restriction ; owl:onProperty t:c_status ; owl:allValuesFrom xsd:boolean ]";
    for (statements, expected) in [
        ("", "\"FALSE\""),
        ("t:c_status rdfs:range xsd:string .", "\"FALSE\""),
        ("t:c_status rdfs:range xsd:boolean .", "\"false\"^^<http://www.w3.org/2001/XMLSchema#boolean>"),
        ("t:c_status rdfs:range [ a rdfs:Datatype ; owl:oneOf ( \"OK\" \"ERROR\" ) ] .", "\"ERROR\""),
        (&format!(":c {boolean} ."), "\"false\"^^<http://www.w3.org/2001/XMLSchema#boolean>"),
        (&format!(":other {boolean} ."), "\"FALSE\""),
    ] {
        let text = format!(
            "@prefix : <http://e/#> . @prefix t: <http://metacontrol.org/tomasys#> . @prefix m: <http://ros/mros#> .
             @prefix owl: <http://www.w3.org/2002/07/owl#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
             @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
             t:Component a owl:Class . t:FunctionDesign a owl:Class . t:c_status a owl:DatatypeProperty .
             t:requiresC a owl:ObjectProperty . m:requiredBy a owl:ObjectProperty .
             :c a t:Component ; m:requiredBy :second . :other a t:Component .
             :first a t:FunctionDesign ; t:requiresC :c . :second a t:FunctionDesign .
             :third a t:FunctionDesign ; t:requiresC :other . {statements}"
        );
        let ontology = read_text(&text, "test", &ReadOptions::default()).expect("well-formed");
        let mut symbols = Symbols::new();
        let mut lowered = lower(&ontology, &mut symbols);
        let shipped = rules::COADAPTATION_RULES;
        let program = rules::parse_rules(shipped, "rules", &mut symbols, &rules::Prefixes::default());
        lowered.program.rules.extend(program.expect("rules").rules);
        let mut engine = Engine::new(symbols, lowered.program, lowered.facts).expect("stratified");
        assert_eq!(available(&engine), ["first", "second", "third"], "{statements}");
        let delta = change::component_status(&mut engine, "c", change::Status::Failed).expect("known");
        let stated: Vec<String> =
            delta.insert.iter().map(|fact| fact.display(engine.symbols()).to_string()).collect();
        engine.apply(delta).expect("applied");
        assert_eq!(stated, [format!("<http://metacontrol.org/tomasys#c_status>(<http://e/#c>, {expected})")]);
        assert_eq!(available(&engine), ["third"], "{statements}");
        assert_eq!(engine.violations(), [], "{statements}");
    }
}

#[test]
fn a_measurement_outside_a_requirement_makes_designs_unavailable() {
    let check = |text: &str, attribute: &str, value: &str, expected: &[&str]| {
        let mut engine = engine(text, attribute);
        let value = Literal::parse(value, Some(ontology::vocab::xsd::DECIMAL), None);
        let delta = change::measured_value(&mut engine, attribute, value).expect("known");
        engine.apply(delta).expect("applied");
        assert_eq!(engine.violations(), []);
        let designs = View::new(&engine).function_designs().into_iter();
        let unavailable: Vec<_> =
            designs.filter(|design| !design.available).map(|design| design.individual.name).collect();
        assert_eq!(unavailable, expected, "{attribute}");
    };
    check(kb::UGV, "ambient_light", "0.8", &[]);
    check(kb::UGV, "ambient_light", "0.81", &["fd_amcl_kinect", "fd_mrpt_kinect"]);
    check(kb::UUV, "water_visibility", "2.5", &["fd_search_high"]);
    check(kb::UUV, "water_visibility", "1.0", &["fd_search_high", "fd_search_low", "fd_search_medium"]);
    // Battery usage has no measurement: the update adds an observation, and no design has a requirement on it.
    check(kb::UUV, "battery_usage", "1.0", &[]);
}

#[test]
fn unknown_names_are_reported_with_those_that_exist() {
    let mut engine = engine(kb::UGV, "ugv.ttl");
    let error =
        change::component_status(&mut engine, "c_radar", change::Status::Failed).expect_err("unknown");
    assert_eq!(
        error.to_string(),
        "error[O106]: the knowledge base has no component `c_radar`; it has c_camera, c_flashlight, c_kinect, c_lidar"
    );
}

#[test]
fn rule_texts_can_be_added() {
    for (text, name, unavailable) in [(kb::UGV, "ugv.ttl", 2), (kb::UUV, "uuv.ttl", 3)] {
        let ontology = read_text(text, name, &ReadOptions::default()).expect("well-formed");
        let mut symbols = Symbols::new();
        let mut lowered = lower(&ontology, &mut symbols);
        for rules in [rules::TOMASYS_RULES, rules::COADAPTATION_RULES] {
            let program = rules::parse_rules(rules, "rules", &mut symbols, &rules::Prefixes::default());
            lowered.program.rules.extend(program.expect("rules").rules);
        }
        let mut engine = Engine::new(symbols, lowered.program, lowered.facts).expect("stratified");
        let before = available(&engine).len();
        let delta = change::component_status(&mut engine, "c_camera", change::Status::Failed).expect("known");
        engine.apply(delta).expect("applied");
        assert_eq!(before - available(&engine).len(), unavailable, "{name}");
        assert_eq!(engine.violations(), [], "{name}");
    }
}

/// The restrictions of OWL 2 DL that concern these knowledge bases. Everything is declared: horned-owl reads
/// them without a warning. No IRI is a property of two kinds or both class and datatype. Composite properties
/// (transitive, or defined by a chain) are not functional, irreflexive, asymmetric or disjoint.
#[test]
fn our_knowledge_bases_are_owl_2_dl() {
    for (text, name) in [(kb::TOMASYS, "tomasys.ttl"), (kb::UGV, "ugv.ttl"), (kb::UUV, "uuv.ttl")] {
        let ontology = read_text(text, name, &ReadOptions::default()).expect("well-formed");
        assert_eq!(ontology.warnings, [], "{name}");
        let entities_of = |kind| ontology.entities(kind).collect::<BTreeSet<_>>();
        let properties =
            [EntityKind::ObjectProperty, EntityKind::DataProperty, EntityKind::AnnotationProperty]
                .map(entities_of);
        let [objects, data, annotations] = &properties;
        assert!(objects.is_disjoint(data) && objects.is_disjoint(annotations), "{name}");
        assert!(data.is_disjoint(annotations), "{name}");
        assert!(entities_of(EntityKind::Class).is_disjoint(&entities_of(EntityKind::Datatype)), "{name}");
        let (mut composite, mut simple) = (BTreeSet::new(), BTreeSet::new());
        for annotated in &ontology.axioms {
            match &annotated.axiom {
                Axiom::ObjectPropertyCharacteristic(Characteristic::Transitive, property)
                | Axiom::SubPropertyChainOf(_, property) => drop(composite.insert(property)),
                Axiom::ObjectPropertyCharacteristic(
                    Characteristic::Functional
                    | Characteristic::InverseFunctional
                    | Characteristic::Irreflexive
                    | Characteristic::Asymmetric,
                    property,
                ) => drop(simple.insert(property)),
                Axiom::DisjointObjectProperties(properties) => simple.extend(properties),
                _ => {}
            }
        }
        let iri = |property: &&ObjectPropertyExpression| match property {
            ObjectPropertyExpression::Property(iri) | ObjectPropertyExpression::Inverse(iri) => iri.clone(),
        };
        let (composite, simple): (BTreeSet<_>, BTreeSet<_>) =
            (composite.iter().map(iri).collect(), simple.iter().map(iri).collect());
        assert!(composite.is_disjoint(&simple), "{name}");
    }
}

/// Setup: `python3 -m venv pellet && pellet/bin/pip install owlready2==0.47`, and Java 17. Command:
/// `METAPLAN_PYTHON=$PWD/pellet/bin/python cargo test -p metaplan-ontology --test all kb:: --
/// --ignored`.
#[test]
#[ignore = "needs owlready2 and Java"]
fn our_knowledge_bases_load_in_owlready2_and_are_consistent_in_pellet() {
    let python = std::env::var("METAPLAN_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let directory = tempfile::tempdir().expect("temporary directory");
    for (name, individuals) in [("tomasys", 0), ("ugv", 10), ("uuv", 10)] {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("kb/{name}.ttl"));
        let options = ReadOptions::default();
        let (text, _) = convert_files(&[source], &options, OutputSyntax::RdfXml).expect("writable");
        let file = directory.path().join(format!("{name}.owl"));
        std::fs::write(&file, text).expect("written");
        let script = "import sys, owlready2 as o
w = o.World(); k = w.get_ontology('file://' + sys.argv[1]).load()
o.sync_reasoner_pellet(w, infer_property_values=True, infer_data_property_values=True, debug=0)
print(len(list(w.individuals())), len(list(w.rules())))";
        let output = Command::new(&python).args(["-c", script]).arg(&file).output().expect("Python runs");
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8_lossy(&output.stdout);
        let counts: Vec<usize> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        assert!(counts[0] >= individuals && counts[1] > 0, "{name}: {text}");
    }
}
