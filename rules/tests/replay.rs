//! Independent check of derivations: modified derivations are rejected with the right fault. The master
//! test replays random programs after every step.

use crate::text::{engine, facts, prefixes};
use metaplan_rules::replay::{Replayed, replay};
use metaplan_rules::{Delta, Derivation, Engine, Fact, Program, Reason, Symbols, parse_rules};

const RULES: &str = "
    [usable] design(?fd) ^ not broken(?fd) -> usable(?fd) .
    [low] needs(?fd, ?least) ^ measured(?m, ?value) ^ swrlb:lessThan(?value, ?least) -> broken(?fd) .
    [failed] requires(?fd, ?c) ^ failed(?c) -> broken(?fd) .
    [step] next(?x, ?y) -> after(?x, ?y) .
    [steps] next(?x, ?y) ^ after(?y, ?z) -> after(?x, ?z) .
    [many] design(?fd) ^ ?n = count{ requires(?fd, ?c) } -> parts(?fd, ?n) .
";
const STATED: &str = "design(a), design(b), needs(a, 0.5), needs(b, 2), measured(m, 0.75), requires(a, c), requires(a, d), \
     next(a, b), next(b, c), next(c, d)";

fn stated(engine: &Engine) -> Vec<Fact> {
    engine.facts().filter(|fact| engine.is_asserted(fact)).collect()
}

/// Replays the derivation of all facts after `change` has modified it. Compares the number of derived
/// facts, or the fault, with `expected`.
fn check(change: impl Fn(&mut Derivation, &Engine), expected: Result<usize, &str>) {
    let engine = engine(RULES, STATED).expect("rules");
    let mut derivation = engine.everything();
    change(&mut derivation, &engine);
    let mut symbols = engine.symbols().clone();
    let result = replay(engine.program(), &mut symbols, &stated(&engine), &derivation);
    let result = result.map(|Replayed { derived, .. }| derived).map_err(|fault| fault.to_string());
    match (result, expected) {
        (Err(result), Err(expected)) => assert!(result.contains(expected), "{result}"),
        (result, expected) => assert_eq!(result, expected.map_err(str::to_owned)),
    }
}

fn position(derivation: &Derivation, engine: &Engine, fact: &str) -> usize {
    let display = |step: &metaplan_rules::DerivationStep| step.fact.display(engine.symbols()).to_string();
    derivation.steps.iter().position(|step| display(step) == fact).expect("a step")
}

/// Returns a change that removes the step of a fact, which must not support another step.
fn without(fact: &'static str) -> impl Fn(&mut Derivation, &Engine) {
    move |derivation, engine| {
        let removed = position(derivation, engine, fact);
        derivation.steps.remove(removed);
        for step in &mut derivation.steps {
            if let Reason::Rule { supports, .. } = &mut step.reason {
                assert!(!supports.contains(&removed), "{fact}");
                supports.iter_mut().filter(|support| **support > removed).for_each(|support| *support -= 1);
            }
        }
    }
}

#[test]
fn a_complete_derivation_is_accepted() {
    check(|_, _| {}, Ok(10));
}

#[test]
fn missing_steps_are_rejected() {
    check(without("<usable>(<a>)"), Err("<usable>(<a>) follows by rule test#0 (usable), but is missing"));
    check(without("<after>(<a>, <d>)"), Err("<after>(<a>, <d>) follows by rule test#4 (steps)"));
    check(without("<requires>(<a>, <d>)"), Err("rule test#5 (many) does not apply"));
}

#[test]
fn steps_that_do_not_follow_are_rejected() {
    let edit = |fact: &'static str, edit: fn(&mut Reason)| {
        move |derivation: &mut Derivation, engine: &Engine| {
            let position = position(derivation, engine, fact);
            edit(&mut derivation.steps[position].reason);
        }
    };
    check(edit("<usable>(<a>)", |reason| *reason = Reason::Asserted), Err("<usable>(<a>): is not stated"));
    check(
        edit("<usable>(<a>)", |reason| *reason = Reason::Equality { supports: vec![] }),
        Err("does not follow by equality"),
    );
    check(
        edit("<broken>(<b>)", |reason| {
            if let Reason::Rule { bindings, .. } = reason {
                bindings[2].1 = bindings[1].1;
            }
        }),
        Err("<broken>(<b>): rule test#1 (low) does not apply"),
    );
    check(
        edit("<after>(<a>, <d>)", |reason| {
            if let Reason::Rule { supports, .. } = reason {
                supports[1] = usize::MAX;
            }
        }),
        Err("<after>(<a>, <d>): a support that does not come before"),
    );
    // The position of another rule with the same conclusion, but the label of this one.
    check(
        edit("<broken>(<b>)", |reason| {
            if let Reason::Rule { identity, .. } = reason {
                identity.position = 2;
            }
        }),
        Err("there is no rule test#2"),
    );
}

#[test]
fn omitting_a_negated_fact_is_rejected() {
    // Without `broken(b)`, the step for `usable(b)` would be founded. The missing conclusion must be
    // detected.
    let deny = |derivation: &mut Derivation, engine: &Engine| {
        without("<broken>(<b>)")(derivation, engine);
        let mut usable = derivation.steps[position(derivation, engine, "<usable>(<a>)")].clone();
        let b = derivation.steps[position(derivation, engine, "<design>(<b>)")].fact.arguments[0];
        usable.fact.arguments[0] = b;
        if let Reason::Rule { bindings, supports, .. } = &mut usable.reason {
            bindings[0].1 = b;
            supports[0] = position(derivation, engine, "<design>(<b>)");
        }
        derivation.steps.push(usable);
    };
    check(deny, Err("<broken>(<b>) follows by rule test#1 (low), but is missing"));
}

/// A rule that compares a variable with a name derives facts about that name. Facts about its other names
/// follow by equality.
#[test]
fn derivations_use_names_as_written_in_rules() {
    for (rules, later) in [
        ("sameAs(?x, b) -> p(?x) . q(?y) -> sameAs(b, a) .", "q(c)"),
        ("q(?y) -> sameAs(b, a) . sameAs(b, ?x) -> p(?x) .", "q(c)"),
        ("q(?y) -> sameAs(b, a) . sameAs(a, b) -> p(c) .", "q(c)"),
        ("r(?x) ^ sameAs(?x, b) -> p(?x) . q(?y) -> sameAs(b, a) .", "q(c), r(a)"),
        ("r(?x) ^ sameAs(?x, b) -> p(?x) . p(?y) -> sameAs(b, a) .", "r(b), r(c)"),
        ("sameAs(?x, b) -> p(?x) . p(b) -> sameAs(b, a) . p(a) -> sameAs(c, a) .", "q(c)"),
    ] {
        // The first rule interns `a` before its other names, so that `a` is their representative.
        let (text, mut symbols) = (format!("p(a) ^ never(a) -> p(a) . {rules}"), Symbols::new());
        let program = parse_rules(&text, "test", &mut symbols, &prefixes()).expect("rules");
        let program = Program { equality: true, ..program };
        let mut engine = Engine::new(symbols, program, []).expect("safe");
        for fact in facts(engine.symbols_mut(), later) {
            engine.apply(Delta { insert: vec![fact], delete: Vec::new() }).expect("within the budget");
            let mut symbols = engine.symbols().clone();
            let replayed = replay(engine.program(), &mut symbols, &stated(&engine), &engine.everything());
            assert!(replayed.is_ok(), "{rules}: {replayed:?}");
            for fact in engine.facts() {
                assert!(engine.why(&fact).is_some_and(|derivation| derivation.steps[0].fact == fact));
            }
        }
    }
}

/// A negated built-in or comparison needs no support. It is evaluated, both for the steps and for missing conclusions.
#[test]
fn negated_tests_are_replayed() {
    let rules = "v(?x, ?n) ^ not swrlb:lessThan(?n, 5) -> high(?x) . v(?x, ?n) ^ v(?y, ?n) ^ not sameAs(?x, ?y) -> twin(?x, ?y) .";
    let mut symbols = Symbols::new();
    let program = parse_rules(rules, "test", &mut symbols, &prefixes()).expect("rules");
    let program = program.with_equality(&mut symbols);
    let given = facts(&mut symbols, "v(a, 3), v(b, 9), v(c, 9), v(d, 3), sameAs(a, d)");
    let engine = Engine::new(symbols, program, given).expect("safe");
    let replayed = |derivation: &Derivation| {
        let result = replay(engine.program(), &mut engine.symbols().clone(), &stated(&engine), derivation);
        result.map(|replayed| replayed.derived).map_err(|fault| fault.to_string())
    };
    let derivation = engine.everything();
    // `high` and `twin` of `b` and `c`; `v` and `sameAs` of `a` and `d` hold by equality.
    assert_eq!(replayed(&derivation), Ok(4));
    let mut missing = derivation.clone();
    without("<twin>(<b>, <c>)")(&mut missing, &engine);
    let fault = replayed(&missing).expect_err("a conclusion is missing");
    assert!(fault.contains("<twin>(<b>, <c>) follows by rule test#1"), "{fault}");
    let mut wrong = derivation.clone();
    let [a, high] = ["<v>(<a>, ", "<high>(<b>)"].map(|start| {
        let shown = |step: &metaplan_rules::DerivationStep| step.fact.display(engine.symbols()).to_string();
        wrong.steps.iter().position(|step| shown(step).starts_with(start)).expect("a step")
    });
    let (mut step, premise) = (wrong.steps[high].clone(), wrong.steps[a].fact.clone());
    step.fact.arguments[0] = premise.arguments[0];
    if let Reason::Rule { bindings, supports, .. } = &mut step.reason {
        *supports = vec![a];
        for ((_, value), argument) in bindings.iter_mut().zip(&premise.arguments) {
            *value = *argument;
        }
    }
    wrong.steps.push(step);
    let fault = replayed(&wrong).expect_err("3 is less than 5");
    assert!(fault.contains("rule test#0 does not apply"), "{fault}");
}
