//! Consequences of small rule texts, before and after changes.

use crate::text;

use crate::text::{engine, fact, facts, show_violation};
use metaplan_rules::{
    COADAPTATION_RULES, Delta, Engine, Interrupt, Limits, Prefixes, Symbols, TOMASYS_RULES, parse_rules,
};

/// Runs a script of lines `+fact`, `-fact`, `?fact` (must hold) and `!fact` (must not hold).
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
fn deleting_an_edge_removes_paths_without_another_derivation() {
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
fn negated_atoms_and_comparisons_follow_changes() {
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
fn a_failed_component_makes_designs_unavailable() {
    let stated = "t:FunctionDesign(kinect), t:FunctionDesign(lidar), t:requiresC(kinect, camera),
        mros:requiredBy(laser, lidar), t:typeFD(fg, kinect), t:solvesO(fg, o), t:typeFD(fg2, lidar),
        t:solvesO(fg2, p)";
    for status in ["\"FALSE\"", "false", "\"ERROR\""] {
        let script = [
            "?t:fd_available(kinect, true)",
            &format!("+t:c_status(camera, {status})"),
            "!t:fd_available(kinect, true)",
            "?t:fd_realisability(kinect, false)",
            "?t:o_status(o, \"IN_ERROR_COMPONENT\")",
            "?t:fd_available(lidar, true)",
            "!t:o_status(p, \"IN_ERROR_COMPONENT\")",
            &format!("+t:c_status(laser, {status})"),
            "!t:fd_available(lidar, true)",
            "?t:o_status(p, \"IN_ERROR_COMPONENT\")",
            &format!("-t:c_status(camera, {status})"),
            "?t:fd_available(kinect, true)",
            "!t:o_status(o, \"IN_ERROR_COMPONENT\")",
        ];
        check(COADAPTATION_RULES, stated, &script);
    }
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

/// A design is excluded, as in MROS, if a measurement is on the wrong side of the design's estimation,
/// according to the operator of the attribute. Other estimations and requirements of objectives are no
/// measurements.
#[test]
fn a_missed_estimation_makes_designs_unavailable() {
    for (operator, missed, met) in [
        ("<", ["1.24", "-1"], ["1.25", "9"]),
        ("<=", ["1.24", "1.25"], ["1.26", "9"]),
        (">", ["1.26", "9"], ["1.250", "-1"]),
        (">=", ["1.26", "1.25"], ["1.24", "-1"]),
    ] {
        let stated = format!(
            "t:FunctionDesign(low), t:FunctionDesign(high), t:hasQAestimation(low, e1), t:hasQAestimation(high, e2),
             t:isQAtype(e1, view), t:isQAtype(e2, view), t:hasValue(e1, 1.25), t:hasValue(e2, 1.25), t:isQAtype(obs, view),
             t:qa_comparison_operator(view, \"{operator}\"), t:hasNFR(o, nfr), t:isQAtype(nfr, view), t:hasValue(nfr, -50),
             t:hasQAestimation(other, e3), t:isQAtype(e3, heat), t:hasValue(e3, 0), t:FunctionDesign(other)"
        );
        let mut script = vec!["?t:fd_available(low, true)".to_owned()];
        for (values, verb) in [(missed, '!'), (met, '?'), (missed, '!')] {
            for value in values {
                script.push(format!("+t:hasValue(obs, {value})"));
                script.push(format!("{verb}t:fd_available(low, true)"));
                script.push(format!("{verb}t:fd_available(high, true)"));
                script.push("?t:fd_available(other, true)".to_owned());
                script.push(format!("-t:hasValue(obs, {value})"));
            }
        }
        script.push("?t:fd_available(high, true)".to_owned());
        let script: Vec<&str> = script.iter().map(String::as_str).collect();
        check(COADAPTATION_RULES, &stated, &script);
    }
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

#[test]
fn constraints_and_ill_typed_literals_are_violations() {
    let rules = "[disjoint] p(?x) ^ q(?x) -> . ready(?x) -> p(?x)";
    let mut engine = engine(rules, "q(a), p(b), q(c), p(c)").expect("rules");
    let violations = |engine: &Engine| {
        engine.violations().iter().map(|violation| show_violation(engine, violation)).collect::<Vec<_>>()
    };
    assert_eq!(violations(&engine), ["<p>(<c>) and <q>(<c>)"]);
    let change = facts(engine.symbols_mut(), "ready(a), v(a, \"False\"^^xsd:boolean)");
    let delete = vec![fact(&mut engine, "q(c)")];
    engine.apply(Delta { insert: change, delete }).expect("no budget needed");
    let ill_typed = "<v>(<a>, \"False\"^^<http://www.w3.org/2001/XMLSchema#boolean>)";
    assert_eq!(violations(&engine), ["<p>(<a>) and <q>(<a>)", ill_typed]);
}

/// A rule that doubles a number also increases the size of the values. The default budget stops the rule before the values
/// are very long.
#[test]
fn growing_values_exhaust_the_default_budget() {
    let rules = "[double] v(?x, ?n) ^ swrlb:multiply(?m, ?n, 2) -> v(?x, ?m) .";
    let mut symbols = Symbols::new();
    let program = parse_rules(rules, "test", &mut symbols, &Prefixes::new()).expect("rules");
    let mut engine = Engine::new(symbols, program, []).expect("nothing to double");
    let start = facts(engine.symbols_mut(), "v(a, 1), v(b, 3), v(c, 5)");
    let error = engine.apply(Delta { insert: start, delete: vec![] }).expect_err("it never ends");
    let text = error.to_string();
    assert!(text.contains("(double)"), "{text}");
    let (before, _) = text.rsplit_once(" characters)").expect("an abbreviated value");
    let length: usize = before.rsplit('(').next().expect("a part").parse().expect("a length");
    // If the length of the values cost nothing, they would have 40,000 digits.
    assert!(length < 5_000, "{text}");
    assert!(text.len() < 300, "{text}");
    assert_eq!(engine.facts().count(), 0);
}

/// The seconds of a duration have no limit: this rule adds 300 digits in each round.
#[test]
fn growing_durations_exhaust_the_budget() {
    let rules = "v(?x, ?d) ^ swrlb:multiplyDayTimeDurations(?e, ?d, 1e300) -> v(?x, ?e) .";
    let mut symbols = Symbols::new();
    let program = parse_rules(rules, "test", &mut symbols, &Prefixes::new()).expect("rules");
    let stated = facts(&mut symbols, "v(a, \"PT1S\"^^xsd:dayTimeDuration)");
    let limits = Limits { steps: 10_000_000, ..Limits::default() };
    let error = Engine::with_limits(symbols, program, stated, limits).expect_err("it never ends").to_string();
    let (before, _) = error.rsplit_once(" characters)").expect("an abbreviated value");
    let length: usize = before.rsplit('(').next().expect("a part").parse().expect("a length");
    // If the length of the durations cost nothing, the last one would have 120,000 digits.
    assert!(length < 10_000, "{error}");
}

/// Each replacement of a character by the whole text would make a value of 100 MB.
#[test]
fn long_replacements_exhaust_the_budget() {
    let rule = "t(?x) ^ swrlb:replace(?y, ?x, \".\", ?x) -> u(?y) .";
    let mut symbols = Symbols::new();
    let program = parse_rules(rule, "test", &mut symbols, &Prefixes::new()).expect("rules");
    let stated = facts(&mut symbols, &format!("t(\"{}\")", "x".repeat(10_000)));
    let errors = Engine::new(symbols, program, stated).expect_err("100 MB");
    assert_eq!(errors[0].code(), "R301");
}

#[test]
fn invalid_constant_patterns_are_errors() {
    for (pattern, reason) in [("(", "unclosed group"), ("(a)\\\\1", "back reference"), ("[a-", "unclosed")] {
        let rules = format!("p(?x) ^ swrlb:matches(?x, \"{pattern}\") -> q(?x) .");
        let mut symbols = Symbols::new();
        let program = parse_rules(&rules, "test", &mut symbols, &Prefixes::new()).expect("rules");
        let errors = Engine::new(symbols, program, []).expect_err("no pattern").to_string();
        assert!(errors.contains("R210") && errors.contains(reason), "{errors}");
    }
}

/// Each of the two built-ins is evaluated once, but the second result is long.
#[test]
fn long_values_cost_steps_without_recursion() {
    let concatenation =
        |result: &str, part: &str| format!("swrlb:stringConcat({result}, {})", vec![part; 31].join(", "));
    let body = format!("t(?x) ^ {} ^ {}", concatenation("?y", "?x"), concatenation("?z", "?y"));
    let mut symbols = Symbols::new();
    let rule = format!("{body} -> u(?z) .");
    let program = parse_rules(&rule, "test", &mut symbols, &Prefixes::new()).expect("rules");
    let stated = facts(&mut symbols, &format!("t(\"{}\")", "x".repeat(100)));
    let limits = Limits { steps: 1_000, ..Limits::default() };
    let errors = Engine::with_limits(symbols, program, stated, limits).expect_err("96,100 bytes");
    assert_eq!(errors[0].code(), "R301");
}

#[test]
fn rules_are_checked_without_evaluation() {
    for (rules, code) in [
        // The evaluation of these rules would not end.
        ("-> n(1) . n(?x) ^ swrlb:add(?y, ?x, 1) -> n(?y) .", None),
        ("p(?x) -> q(?y) .", Some("R202")),
        ("p(?x) ^ not q(?x) -> q(?x) .", Some("R206")),
    ] {
        let mut symbols = Symbols::new();
        let program = parse_rules(rules, "test", &mut symbols, &Prefixes::new()).expect("rules");
        let errors = Engine::check(&program, &symbols).err();
        assert_eq!(errors.map(|errors| errors[0].code()), code, "{rules}");
    }
}

#[test]
fn runaway_rules_end_in_an_error_that_names_them() {
    let rules = "[count] n(?x) ^ swrlb:add(?y, ?x, 1) -> n(?y) . go(?x) -> n(?x) . n(?x) -> seen(?x)";
    let mut symbols = Symbols::new();
    let program = parse_rules(rules, "test", &mut symbols, &Prefixes::new()).expect("rules");
    let mut engine =
        Engine::with_limits(symbols, program.clone(), [], Limits { steps: 10_000, ..Limits::default() })
            .expect("nothing to count");
    let start = facts(engine.symbols_mut(), "go(1), calm(1)");
    engine.apply(Delta { insert: vec![start[1].clone()], delete: vec![] }).expect("nothing to count");
    let change = Delta { insert: vec![start[0].clone()], delete: vec![start[1].clone()] };
    let error = engine.apply(change).expect_err("it never ends");
    assert_eq!(
        error.to_string(),
        "R301 step budget of 10000 exhausted, last in rule test#0 (count), which computes new values from its \
         own conclusions; the last one is 2"
    );
    assert_eq!(engine.facts().collect::<Vec<_>>(), [start[1].clone()]);
    assert!(
        Engine::with_limits(
            engine.symbols().clone(),
            program,
            [start[0].clone()],
            Limits { steps: 10_000, ..Limits::default() }
        )
        .is_err()
    );
}

#[test]
fn only_recursive_rules_are_charged_for_new_values() {
    let counted = |rules: &str, steps: u64| {
        let mut symbols = Symbols::new();
        let program = parse_rules(rules, "test", &mut symbols, &Prefixes::new()).expect("rules");
        let stated: Vec<_> = (0..50).flat_map(|n| facts(&mut symbols, &format!("v({n})"))).collect();
        Engine::with_limits(symbols, program, stated, Limits { steps, ..Limits::default() }).is_ok()
    };
    assert!(counted("v(?x) ^ swrlb:multiply(?y, ?x, 1000) -> w(?y)", 1_000));
    let recursive = "v(?x) ^ swrlb:lessThan(?x, 100) ^ swrlb:add(?y, ?x, 1) -> v(?y)";
    assert!(!counted(recursive, 1_000_000) && counted(recursive, 2_000_000));
}

/// The engine is interrupted at each call of the interrupt function in turn. After an interrupt, the
/// engine is in its state before the update, and a repeated update has the result of an update without
/// interrupt.
#[test]
fn evaluation_can_be_interrupted() {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};
    let rules =
        "e(?x, ?y) -> p(?x, ?y) . p(?x, ?y) ^ e(?y, ?z) -> p(?x, ?z) . same(?x, ?y) -> sameAs(?x, ?y)";
    let stated: Vec<String> = (0..300).map(|n| format!("e(n{n}, n{}), ", n + 1)).collect();
    let stated = stated.concat();
    for equality in [false, true] {
        let mut symbols = Symbols::new();
        let mut program = parse_rules(rules, "test", &mut symbols, &Prefixes::new()).expect("rules");
        program.equality = equality;
        let facts = facts(&mut symbols, stated.trim_end_matches(", "));
        let questions = Arc::new(AtomicUsize::new(usize::MAX));
        let counter = Arc::clone(&questions);
        let limits = Limits {
            interrupt: Some(Interrupt::new(move || counter.fetch_sub(1, Ordering::Relaxed) == 0)),
            ..Limits::default()
        };
        questions.store(2, Ordering::Relaxed);
        let stopped = Engine::with_limits(symbols.clone(), program.clone(), facts.clone(), limits.clone());
        let error = stopped.expect_err("interrupted")[0].to_string();
        assert_eq!(error, "R304 interrupted, last in rule test#1");
        questions.store(usize::MAX, Ordering::Relaxed);
        let mut engine = Engine::with_limits(symbols, program, [], limits).expect("nothing to do");
        let delta = Delta { insert: facts, delete: Vec::new() };
        for question in 0.. {
            questions.store(question, Ordering::Relaxed);
            match engine.apply(delta.clone()) {
                Ok(change) => {
                    assert_eq!(change.insert.len(), 300 + 300 * 301 / 2);
                    assert!(question > 2, "never asked");
                    break;
                }
                Err(error) => assert!(error.to_string().starts_with("R304"), "{error}"),
            }
            assert_eq!(engine.facts().count(), 0);
        }
    }
}

/// A relation with a closure rule equals the result of an ordinary rule after every change: a chain with a
/// detour and an alias.
#[test]
fn a_transitive_relation_is_its_closure_after_every_change() {
    let rules = "[closure] p(?x, ?y) ^ p(?y, ?z) -> p(?x, ?z) . [alias] q(?x, ?y) -> p(?x, ?y) . \
                 [back] p(?x, ?y) ^ both(?x) -> p(?y, ?x)";
    let mut engine = engine(rules, "").expect("rules");
    let steps = [
        "+p(a, b)", "+p(b, c)", "+q(c, d)", "+q(a, c)", "+p(a, d)", "-p(b, c)", "+q(b, c)", "-q(c, d)",
        "+p(d, a)", "+q(c, d)", "-p(a, b)", "+both(c)", "-q(a, c)", "-p(a, d)", "-both(c)", "+p(c, c)",
        "-q(b, c)", "-p(c, c)",
    ];
    let mut stated = std::collections::BTreeSet::new();
    for step in steps {
        let (sign, text) = step.split_at(1);
        let delta = facts(engine.symbols_mut(), text);
        let change = if sign == "+" {
            stated.insert(text);
            Delta { insert: delta, delete: Vec::new() }
        } else {
            stated.remove(text);
            Delta { insert: Vec::new(), delete: delta }
        };
        engine.apply(change).expect("no budget needed");
        let displayed = |engine: &Engine| -> Vec<String> {
            engine.facts().map(|fact| fact.display(engine.symbols()).to_string()).collect()
        };
        // A third atom prevents the recognition as a closure.
        let plain = rules.replace("-> p(?x, ?z)", "^ swrlb:equal(1, 1) -> p(?x, ?z)");
        let lines: Vec<&str> = stated.iter().copied().collect();
        let fresh = text::engine(&plain, &lines.join(", ")).expect("rules");
        let (mut actual, mut expected) = (displayed(&engine), displayed(&fresh));
        actual.sort();
        expected.sort();
        assert_eq!(actual, expected, "{step}");
    }
}

#[test]
fn a_clone_answers_what_if() {
    let mut engine = engine("p(?x) -> q(?x)", "p(a)").expect("rules");
    let mut copy = engine.clone();
    let insert = vec![fact(&mut copy, "p(b)")];
    let change = copy.apply(Delta { insert, delete: vec![] }).expect("no budget needed");
    assert_eq!(change.insert.len(), 2);
    let derived = fact(&mut engine, "q(b)");
    assert!(copy.holds(&derived) && !engine.holds(&derived));
}

#[test]
fn joins_are_complete_as_facts_grow() {
    let rules = "e(?x, ?y) ^ e(?y, ?z) ^ mark(?z) -> near(?x) . near(?x) ^ not off(?x) -> on(?x)";
    let mut engine = engine(rules, "").expect("rules");
    for number in 0..300 {
        let text = format!("e(n{number}, n{}), mark(n{number})", number + 1);
        let insert = facts(engine.symbols_mut(), &text);
        engine.apply(Delta { insert, delete: vec![] }).expect("no budget needed");
    }
    assert_eq!(engine.facts().count(), 600 + 2 * 298);
    let delete = facts(engine.symbols_mut(), "e(n7, n8)");
    assert_eq!(engine.apply(Delta { insert: vec![], delete }).expect("no budget needed").delete.len(), 5);
}

#[test]
fn large_cartesian_products_are_complete() {
    let side = 45_usize;
    let stated: Vec<String> = (0..side).map(|number| format!("p({number})")).collect();
    let rules = "p(?x) ^ p(?y) ^ p(?z) -> cube(?x, ?y, ?z)";
    let mut engine = engine(rules, &stated.join(", ")).expect("rules");
    assert_eq!(engine.facts().count(), side + side.pow(3));
    let delete = facts(engine.symbols_mut(), "p(7)");
    let change = engine.apply(Delta { insert: vec![], delete }).expect("no budget needed");
    assert_eq!(change.delete.len(), 1 + side.pow(3) - (side - 1).pow(3));
}

#[test]
fn changes_of_a_clone_and_its_original_are_independent() {
    let rules = "p(?x) ^ swrlb:add(?y, ?x, 1) -> q(?y) . q(?x) ^ not r(?x) -> s(?x) .";
    let mut original = engine(rules, "p(1), p(2)").expect("rules");
    let before: Vec<_> = original.facts().collect();
    let mut what_if = original.clone();
    let insert = facts(what_if.symbols_mut(), "p(7), r(2)");
    let delete = facts(what_if.symbols_mut(), "p(2)");
    let change = what_if.apply(Delta { insert, delete }).expect("no budget needed");
    assert_eq!((change.insert.len(), change.delete.len()), (4, 4));
    assert_eq!(original.facts().collect::<Vec<_>>(), before);
    let delete = facts(original.symbols_mut(), "p(1)");
    original.apply(Delta { insert: vec![], delete }).expect("no budget needed");
    let eight = fact(&mut what_if, "s(8)");
    assert!(what_if.holds(&eight) && what_if.why(&eight).is_some());
}

#[test]
fn negated_built_ins_hold_exactly_if_the_built_ins_do_not() {
    let rules = "
        v(?n) ^ not swrlb:lessThan(?n, 5) -> atLeast5(?n) .
        v(?n) ^ ?k = count { w(?m) ^ not swrlb:lessThan(?m, ?n) } -> countFrom(?n, ?k) .
        v(?n) ^ not swrlb:add(?n, 1, 2) -> not3(?n) .
        v(?n) ^ not swrlb:lessThan(?n, 5) ^ not atLeast5(?n) -> never(?n) .
    ";
    let script = [
        "!atLeast5(3)",
        "?atLeast5(9)",
        "!never(9)",
        // A string and an individual are not less than a number.
        "?atLeast5(\"x\")",
        "?atLeast5(a)",
        "!not3(3)",
        "?not3(9)",
        "?countFrom(3, 2)",
        "?countFrom(9, 0)",
        "+w(9)",
        "?countFrom(9, 1)",
        "-v(9)",
        "!atLeast5(9)",
    ];
    check(rules, "v(3), v(9), v(\"x\"), v(a), w(1), w(3), w(4)", &script);
}

#[test]
fn negated_comparisons_of_names_are_complements() {
    let rules = "
        p(?x) ^ p(?y) ^ sameAs(?x, ?y) -> same(?x, ?y) . p(?x) ^ p(?y) ^ not sameAs(?x, ?y) -> notSame(?x, ?y) .
        p(?x) ^ p(?y) ^ differentFrom(?x, ?y) -> different(?x, ?y) .
        p(?x) ^ p(?y) ^ not <http://www.w3.org/2002/07/owl#differentFrom>(?x, ?y) -> notDifferent(?x, ?y) .";
    let script = [
        "?same(a, a)",
        "!notSame(a, a)",
        "!same(a, b)",
        "?notSame(a, b)",
        "!different(a, a)",
        "?notDifferent(a, a)",
        "?different(a, b)",
        "!notDifferent(a, b)",
    ];
    check(rules, "p(a), p(b)", &script);
}
