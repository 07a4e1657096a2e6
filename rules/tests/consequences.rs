//! What follows from small rule texts, before and after changes.

use metaplan_rules as rules;
use metaplan_rules::{
    COADAPTATION_RULES, Delta, Engine, Error, Fact, Literal, Prefixes, Symbols, TOMASYS_RULES, parse_rules,
};

/// A fact as text, `p(a, "x", 1)`, read by the rule parser as the head of a rule without body.
fn fact(engine: &mut Engine, text: &str) -> Fact {
    facts(engine.symbols_mut(), text).remove(0)
}

fn prefixes() -> Prefixes {
    Prefixes::new().with("t", "http://metacontrol.org/tomasys#").with("mros", "http://ros/mros#")
}

fn facts(symbols: &mut Symbols, text: &str) -> Vec<Fact> {
    let text = format!("-> {text} .");
    let program = parse_rules(&text, "facts", symbols, &prefixes()).expect("facts");
    let atoms = program.rules.into_iter().flat_map(|rule| rule.head);
    let ground = |term| match term {
        rules::Term::Constant(symbol) => symbol,
        rules::Term::Variable(_) => panic!("a fact has no variables"),
    };
    let fact = |atom| match atom {
        rules::Atom::Relation { predicate, arguments } => {
            Fact::new(predicate, arguments.into_iter().map(ground))
        }
        other => panic!("{other:?} is no fact"),
    };
    atoms.map(fact).collect()
}

fn engine(rules: &str, stated: &str) -> Result<Engine, Vec<Error>> {
    let mut symbols = Symbols::new();
    let program = parse_rules(rules, "test", &mut symbols, &prefixes())?;
    let facts = if stated.is_empty() { Vec::new() } else { facts(&mut symbols, stated) };
    Engine::new(symbols, program, facts)
}

/// Each script line is `+fact`, `-fact`, `?fact` (must hold) or `!fact` (must not).
fn check(rules: &str, stated: &str, script: &[&str]) {
    let mut engine = engine(rules, stated).expect("rules");
    for line in script {
        let (verb, text) = line.split_at(1);
        let fact = fact(&mut engine, text);
        let delta = match verb {
            "+" => Delta { insert: vec![fact], delete: vec![] },
            "-" => Delta { insert: vec![], delete: vec![fact] },
            _ => {
                assert_eq!(engine.holds(&fact), verb == "?", "{line}");
                continue;
            }
        };
        engine.apply(delta).expect(line);
    }
}

#[test]
fn recursion_and_retraction() {
    let rules = "edge(?x, ?y) -> path(?x, ?y) path(?x, ?y) ^ edge(?y, ?z) -> path(?x, ?z)";
    let stated = "edge(a, b), edge(b, c), edge(c, a), edge(c, d)";
    check(
        rules,
        stated,
        &["?path(a, a)", "?path(a, d)", "-edge(b, c)", "!path(a, d)", "!path(a, a)", "?path(c, b)"],
    );
    check(rules, stated, &["+edge(a, c)", "-edge(b, c)", "?path(a, d)", "?path(a, a)", "!path(b, d)"]);
}

#[test]
fn negation_and_built_ins() {
    let rules = r#"
        design(?fd) ^ not realisable(?fd, false) -> available(?fd, true) .
        requires(?fd, ?c) ^ status(?c, "FALSE") -> realisable(?fd, false) .
        needs(?fd, ?minimum) ^ measured(?value) ^ swrlb:lessThan(?value, ?minimum) -> realisable(?fd, false) .
        measured(?value) ^ swrlb:multiply(?twice, ?value, 2) -> twice(?twice) .
    "#;
    let stated = "design(a), design(b), requires(a, c), needs(b, 1.50), measured(1.5)";
    let script = [
        "?available(a, true)",
        "?available(b, true)",
        "?twice(3)",
        "+status(c, \"FALSE\")",
        "!available(a, true)",
        "-measured(1.5)",
        "+measured(1.49)",
        "!available(b, true)",
        "?twice(2.98)",
        "!twice(3)",
        "-status(c, \"FALSE\")",
        "?available(a, true)",
        "-needs(b, 1.5)",
        "?available(b, true)",
    ];
    check(rules, stated, &script);
}

#[test]
fn literals_are_equal_by_value() {
    let decimal = |text| Literal::parse(text, Some("http://www.w3.org/2001/XMLSchema#decimal"), None);
    assert_eq!(decimal("1.50"), decimal("1.5"));
    assert_eq!(decimal("5.0"), Literal::integer(5));
    assert_eq!(decimal("1e-05"), decimal("0.00001"));
    assert!(decimal("inf").is_ill_typed());
}

#[test]
fn a_failed_component_makes_designs_unavailable() {
    let stated = "t:FunctionDesign(kinect), t:FunctionDesign(lidar), t:requiresC(kinect, camera),
        mros:requiredBy(laser, lidar), t:typeFD(fg, kinect), t:solvesO(fg, o)";
    let script = [
        "?t:fd_available(kinect, true)",
        "+t:c_status(camera, \"FALSE\")",
        "!t:fd_available(kinect, true)",
        "?t:fd_realisability(kinect, false)",
        "?t:o_status(o, \"IN_ERROR_COMPONENT\")",
        "?t:fd_available(lidar, true)",
        "+t:c_status(laser, \"FALSE\")",
        "!t:fd_available(lidar, true)",
        "-t:c_status(camera, \"FALSE\")",
        "?t:fd_available(kinect, true)",
        "!t:o_status(o, \"IN_ERROR_COMPONENT\")",
    ];
    check(COADAPTATION_RULES, stated, &script);
}

#[test]
fn a_violated_requirement_makes_designs_unavailable() {
    let stated = "t:FunctionDesign(aruco), t:hasRequirement(aruco, light), t:isQAtype(light, brightness),
        t:hasMinimum(light, 0.9), t:hasRequirement(aruco, cool), t:isQAtype(cool, temperature),
        t:hasMaximum(cool, 60), t:isQAtype(m1, brightness), t:isMeasured(m1, true), t:hasValue(m1, 0.90),
        t:isQAtype(m2, temperature), t:isMeasured(m2, true), t:hasValue(m2, 60.5), t:typeFD(fg, aruco)";
    let script = [
        "!t:fd_available(aruco, true)",
        "?t:fg_status(fg, \"IN_ERROR_NFR\")",
        "-t:hasValue(m2, 60.50)",
        "?t:fd_available(aruco, true)",
        "+t:hasValue(m2, \"6e1\"^^xsd:decimal)",
        "?t:fd_available(aruco, true)",
        "-t:hasValue(m1, 0.9)",
        "+t:hasValue(m1, 0.89)",
        "!t:fd_available(aruco, true)",
    ];
    check(COADAPTATION_RULES, stated, &script);
}

#[test]
fn statuses_follow_their_causes() {
    let stated = "t:typeC(c, class), t:cc_unique(class, true), t:typeC(spec, class), t:roleDef(role, spec),
        t:roles(fd, role), t:binding_component(b, c), t:binding_role(b, role), t:hasBindings(fg, b),
        t:solvesO(fg, o), t:typeFD(fg, fd), t:requiresO(above, o), t:solvesO(above, top), t:Objective(o),
        t:Component(c), t:hasQAvalue(fg, m), t:isQAtype(m, qa), t:hasValue(m, 1.2), t:hasQAestimation(fd, e),
        t:isQAtype(e, qa), t:hasValue(e, 1.25), t:qa_comparison_operator(qa, \"<\")";
    let script = [
        "?t:o_status(top, \"IN_ERROR_NFR\")",
        "+t:c_status(c, \"FALSE\")",
        "?t:fd_realisability(fd, false)",
        "?t:cspec_availability(spec, false)",
        "?t:fg_status(above, \"IN_ERROR_COMPONENT\")",
        "?t:o_status(top, \"IN_ERROR_COMPONENT\")",
        "-t:c_status(c, \"FALSE\")",
        "+t:c_status(c, \"RECOVERED\")",
        "!t:fd_realisability(fd, false)",
        "!t:o_status(top, \"IN_ERROR_COMPONENT\")",
        "?t:o_updatable(o, true)",
        "-t:hasValue(m, 1.2)",
        "!t:o_status(top, \"IN_ERROR_NFR\")",
        "!t:o_status(o, \"IN_ERROR_NFR\")",
    ];
    check(TOMASYS_RULES, stated, &script);
}
