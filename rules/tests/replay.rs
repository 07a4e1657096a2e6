//! Derivations are checked without the engine: what is changed in them is found, and named. Random programs are replayed by
//! the master test, after every step.

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

/// Replays what the engine says, changed.
fn check(change: impl Fn(&mut Derivation, &Engine), expected: Result<usize, &str>) {
    let engine = engine(RULES, STATED).expect("rules");
    let mut derivation = engine.everything();
    change(&mut derivation, &engine);
    let mut symbols = engine.symbols().clone();
    let found = replay(engine.program(), &mut symbols, &stated(&engine), &derivation);
    let found = found.map(|Replayed { derived, .. }| derived).map_err(|fault| fault.to_string());
    match (found, expected) {
        (Err(found), Err(expected)) => assert!(found.contains(expected), "{found}"),
        (found, expected) => assert_eq!(found, expected.map_err(str::to_owned)),
    }
}

/// The position of the step that concludes a fact, as it is displayed.
fn position(derivation: &Derivation, engine: &Engine, fact: &str) -> usize {
    let shown = |step: &metaplan_rules::DerivationStep| step.fact.display(engine.symbols()).to_string();
    derivation.steps.iter().position(|step| shown(step) == fact).expect("a step")
}

/// Takes a step out that no other one rests on.
fn without(fact: &'static str) -> impl Fn(&mut Derivation, &Engine) {
    move |derivation, engine| {
        let at = position(derivation, engine, fact);
        derivation.steps.remove(at);
        for step in &mut derivation.steps {
            if let Reason::Rule { supports, .. } = &mut step.reason {
                assert!(!supports.contains(&at), "{fact}");
                supports.iter_mut().filter(|support| **support > at).for_each(|support| *support -= 1);
            }
        }
    }
}

#[test]
fn what_holds_is_accepted() {
    check(|_, _| {}, Ok(10));
}

#[test]
fn what_is_missing_is_found() {
    check(without("<usable>(<a>)"), Err("<usable>(<a>) follows by rule test#0 (usable), and is missing"));
    check(without("<after>(<a>, <d>)"), Err("<after>(<a>, <d>) follows by rule test#4 (steps)"));
    check(without("<requires>(<a>, <d>)"), Err("rule test#5 (many) does not apply"));
}

#[test]
fn what_does_not_follow_is_found() {
    let edit = |fact: &'static str, edit: fn(&mut Reason)| {
        move |derivation: &mut Derivation, engine: &Engine| {
            let at = position(derivation, engine, fact);
            edit(&mut derivation.steps[at].reason);
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
    // The other rule for the same conclusion.
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
fn what_is_negated_must_not_hold() {
    // With `broken(b)` left out, `usable(b)` would be founded; but then something is missing.
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
    check(deny, Err("<broken>(<b>) follows by rule test#1 (low), and is missing"));
}

/// A rule that compares a variable with a name concludes about that name, and about its other names by equality only.
#[test]
fn names_in_rules_stay_as_they_are_written() {
    for (rules, later) in [
        ("sameAs(?x, b) -> p(?x) . q(?y) -> sameAs(b, a) .", "q(c)"),
        ("q(?y) -> sameAs(b, a) . sameAs(b, ?x) -> p(?x) .", "q(c)"),
        ("q(?y) -> sameAs(b, a) . sameAs(a, b) -> p(c) .", "q(c)"),
        ("r(?x) ^ sameAs(?x, b) -> p(?x) . q(?y) -> sameAs(b, a) .", "q(c), r(a)"),
        ("r(?x) ^ sameAs(?x, b) -> p(?x) . p(?y) -> sameAs(b, a) .", "r(b), r(c)"),
        ("sameAs(?x, b) -> p(?x) . p(b) -> sameAs(b, a) . p(a) -> sameAs(c, a) .", "q(c)"),
    ] {
        // Facts about `p` are the first ones, and `a` stands for all of its names.
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
