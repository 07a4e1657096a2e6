//! The typed view and the updates on real knowledge bases; comparison of the embedded metamodel with the real
//! one.

use std::collections::BTreeSet;

use ontology::tomasys::{View, change};
use ontology::{Axiom, EntityKind, Ontology, ReadOptions, kb, lower, read_files, read_text};
use rules::{Delta, Engine, Fact, Literal, Symbols};
use test_resources::data;

use crate::common::real_directory;

fn read(file: &str) -> Option<Ontology> {
    let path = data(real_directory().join(file))?;
    let options = ReadOptions { directories: vec![real_directory()], ..ReadOptions::default() };
    Some(read_files(&[path], &options).expect("readable"))
}

fn engine(ontology: &Ontology) -> Engine {
    let mut symbols = Symbols::new();
    let lowered = lower(ontology, &mut symbols);
    Engine::new(symbols, lowered.program, lowered.facts).expect("safe rules")
}

fn unavailable(engine: &Engine) -> Vec<String> {
    let designs = View::new(engine).function_designs().into_iter();
    designs.filter(|design| !design.available).map(|design| design.individual.name).collect()
}

/// A failed component gets the status in the spelling that its knowledge base allows, and the designs that need
/// it become unavailable. Columns: file, component, expected spelling, designs that become unavailable.
#[test]
fn a_failure_is_spelled_as_the_knowledge_base_wants() {
    for (file, component, spelling, expected) in [
        ("suave/suave.owl", "c_thruster_1", "FALSE", &["fd_all_thrusters"][..]),
        ("suave_planta/suave.owl", "c_thruster_1", "ERROR", &["fd_all_thrusters"]),
        (
            "mc_mros_reasoner/MROS_ontology.owl",
            "battery",
            "false",
            &["f_degraded_mode", "f_normal_mode", "f_performance_mode", "f_slow_mode"],
        ),
        ("navigation_planta/navigation.owl", "c_kinect", "ERROR", &["fd_amcl_kinect", "fd_mrpt_kinect"]),
    ] {
        let Some(ontology) = read(file) else { return };
        let mut engine = engine(&ontology);
        let before = unavailable(&engine);
        let failed = change::component_status(&mut engine, component, change::Status::Failed).expect("known");
        engine.apply(failed).expect("applied");
        assert_eq!(engine.violations(), [], "{file}");
        let components = View::new(&engine).components();
        let status =
            components.iter().find(|found| found.individual.name == component).expect("there").status.clone();
        assert_eq!(status.as_deref(), Some(spelling), "{file}");
        let after = unavailable(&engine);
        let lost: Vec<_> = after.iter().filter(|name| !before.contains(name)).map(String::as_str).collect();
        assert_eq!(lost, expected, "{file}");
        let cleared = change::clear_component_status(&mut engine, component).expect("known");
        engine.apply(cleared).expect("applied");
        assert_eq!(unavailable(&engine), before, "{file}");
    }
}

#[test]
fn a_measurement_reaches_what_holds_it() {
    let Some(ontology) = read("suave_planta/suave.owl") else { return };
    let mut engine = engine(&ontology);
    for (value, expected) in [("1.0", 3), ("2.5", 1), ("3.5", 0)] {
        let value = Literal::parse(value, Some(ontology::vocab::xsd::DECIMAL), None);
        let delta = change::measured_value(&mut engine, "water_visibility", value).expect("known");
        engine.apply(delta).expect("applied");
        assert_eq!(engine.violations(), []);
        assert_eq!(unavailable(&engine).len(), expected);
    }
}

/// The grounded design of SUAVE's search requires a visibility of 3.25. Below this value, the grounding and
/// its objective are in error.
#[test]
fn a_measurement_puts_an_objective_in_error_and_out_of_it() {
    let Some(ontology) = read("suave/suave.owl") else { return };
    let mut engine = engine(&ontology);
    let (t, suave) = ("http://metacontrol.org/tomasys#", "http://www.metacontrol.org/suave#");
    let [grounding, objective] = ["fg", "o"].map(|name| engine.symbols_mut().name(&format!("{t}{name}")));
    let design = engine.symbols_mut().name(&format!("{suave}fd_spiral_high"));
    let name = |engine: &mut Engine, local: &str| engine.symbols_mut().name(&format!("{t}{local}"));
    let insert = vec![
        Fact::new(name(&mut engine, "Objective"), [objective]),
        Fact::new(name(&mut engine, "typeFD"), [grounding, design]),
        Fact::new(name(&mut engine, "solvesO"), [grounding, objective]),
    ];
    engine.apply(Delta { insert, delete: Vec::new() }).expect("applied");
    for (value, expected) in [("3.5", None), ("3.0", Some("IN_ERROR_NFR")), ("3.25", None)] {
        let value = Literal::parse(value, Some(ontology::vocab::xsd::DECIMAL), None);
        let delta = change::measured_value(&mut engine, "water_visibility", value).expect("known");
        engine.apply(delta).expect("applied");
        assert_eq!(engine.violations(), []);
        let status = View::new(&engine).values(&format!("{t}o"), &format!("{t}o_status"));
        let status = status.first().and_then(|value| value.as_literal()).map(Literal::lexical);
        assert_eq!(status.as_deref(), expected);
    }
}

#[test]
fn our_metamodel_lacks_only_functional_axioms_of_the_real_one() {
    let Some(real) = read("mc_mdl_tomasys/tomasys.owl") else { return };
    let ours = read_text(kb::TOMASYS, "tomasys.ttl", &ReadOptions::default()).expect("well-formed");
    let axioms = |ontology: &Ontology| -> BTreeSet<Axiom> {
        ontology.axioms.iter().map(|annotated| annotated.axiom.clone()).collect()
    };
    let missing: Vec<String> = axioms(&real).difference(&axioms(&ours)).map(ToString::to_string).collect();
    // In the embedded metamodel, the properties that rules conclude are not functional, so that a
    // second conclusion is not a contradiction.
    let concluded =
        ["b_status", "cc_availability", "fd_realisability", "fg_status", "o_status", "o_updatable"];
    let functional = |name| format!("FunctionalDataProperty(<http://metacontrol.org/tomasys#{name}>)");
    assert_eq!(missing, concluded.map(functional));
    for kind in [EntityKind::Class, EntityKind::ObjectProperty, EntityKind::DataProperty] {
        let ours: BTreeSet<_> = ours.entities(kind).collect();
        let missing: Vec<_> = real.entities(kind).filter(|iri| !ours.contains(iri)).collect();
        assert!(missing.is_empty(), "{missing:?}");
    }
}
