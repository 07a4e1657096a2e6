//! Individuals with several names: facts about each name, before and after changes.

use std::collections::BTreeSet;

use crate::text::{fact, facts, prefixes, show_violation};
use metaplan_rules::{Delta, Engine, Fact, Limits, Program, Symbols, parse_rules};

fn engine(rules: &str, stated: &str) -> Engine {
    let mut symbols = Symbols::new();
    let program = parse_rules(rules, "test", &mut symbols, &prefixes()).expect("rules");
    let facts = if stated.is_empty() { Vec::new() } else { facts(&mut symbols, stated) };
    let program = program.with_equality(&mut symbols);
    Engine::new(symbols, program, facts).expect("safe rules")
}

fn displayed(engine: &Engine) -> BTreeSet<String> {
    let short = |text: String| text.replace("http://www.w3.org/2002/07/owl#", "").replace(['<', '>'], "");
    engine.facts().map(|fact| short(fact.display(engine.symbols()).to_string())).collect()
}

/// Runs a script of lines `+fact`, `-fact` and `= facts`. The last form lists all facts except pairs of
/// names.
fn check(rules: &str, stated: &str, script: &[&str]) {
    let mut engine = engine(rules, stated);
    for line in script {
        let (verb, text) = line.split_at(1);
        if verb == "=" {
            let mut facts_shown = displayed(&engine);
            assert!(!facts_shown.contains("sameAs(b, b)"), "{facts_shown:?}");
            facts_shown.retain(|fact| !fact.starts_with("sameAs"));
            let expected: BTreeSet<String> = text.split(" ^ ").map(|fact| fact.trim().to_string()).collect();
            assert_eq!(facts_shown, expected, "{script:?} {line}");
            continue;
        }
        let before = engine.facts().collect::<BTreeSet<_>>();
        let fact = fact(&mut engine, text);
        let change = match verb {
            "+" => Delta { insert: vec![fact], delete: vec![] },
            _ => Delta { insert: vec![], delete: vec![fact] },
        };
        let change = engine.apply(change).expect(line);
        let after = engine.facts().collect::<BTreeSet<_>>();
        assert_eq!(change.insert, after.difference(&before).cloned().collect::<Vec<_>>(), "{line}");
        assert_eq!(change.delete, before.difference(&after).cloned().collect::<Vec<_>>(), "{line}");
        check_views(&engine);
    }
}

/// Compares the stated facts, the facts in brief and the answers to patterns with a filter of all facts.
fn check_views(engine: &Engine) {
    let all: Vec<Fact> = engine.facts().collect();
    let stated: Vec<Fact> = all.iter().filter(|fact| engine.is_asserted(fact)).cloned().collect();
    assert_eq!(engine.stated_facts(), stated);
    let same_as = engine.symbols().find_name("http://www.w3.org/2002/07/owl#sameAs");
    let without_pairs = |facts: Vec<Fact>| -> BTreeSet<Fact> {
        facts.into_iter().filter(|fact| Some(fact.predicate) != same_as).collect()
    };
    assert_eq!(without_pairs(engine.facts_in_brief(1)), without_pairs(all.clone()));
    for fact in &all {
        for bound in 0..1 << fact.arguments.len() {
            let pattern: Vec<_> = fact
                .arguments
                .iter()
                .enumerate()
                .map(|(column, &name)| (bound >> column & 1 == 1).then_some(name))
                .collect();
            let fits = |other: &&Fact| {
                let mut columns = other.arguments.iter().zip(&pattern);
                other.predicate == fact.predicate
                    && other.arguments.len() == pattern.len()
                    && columns.all(|(name, wanted)| wanted.is_none_or(|wanted| wanted == *name))
            };
            let mut expected: Vec<_> = all.iter().filter(fits).map(|fact| fact.arguments.clone()).collect();
            let mut actual: Vec<_> = engine.matching(fact.predicate, &pattern).collect();
            expected.sort();
            actual.sort();
            assert_eq!(actual, expected, "{pattern:?}");
        }
    }
}

#[test]
fn changes_of_classes_of_several_names_are_reported() {
    check(
        "",
        "p(a, c), sameAs(a, b), sameAs(c, d), q(e, e)",
        &[
            "+sameAs(b, c)",
            "+sameAs(e, a)",
            "+sameAs(e, e)",
            "-sameAs(a, b)",
            "+sameAs(a, d)",
            "-sameAs(b, c)",
            "-sameAs(e, e)",
            "-sameAs(e, a)",
            "-sameAs(c, d)",
            "= p(a, c) ^ p(d, c) ^ q(e, e)",
        ],
    );
}

#[test]
fn facts_follow_inserted_and_deleted_pairs() {
    let script = [
        "= p(a, b)",
        "+sameAs(b, c)",
        "= p(a, b) ^ p(a, c)",
        "+sameAs(c, d)",
        "= p(a, b) ^ p(a, c) ^ p(a, d)",
    ];
    check(
        "",
        "p(a, b)",
        &[&script[..], &["-sameAs(b, c)", "= p(a, b)", "-sameAs(c, d)", "= p(a, b)"]].concat(),
    );
    check(
        "-> sameAs(a, b)",
        "p(a)",
        &["= p(a) ^ p(b)", "+sameAs(a, b)", "= p(a) ^ p(b)", "-sameAs(a, b)", "= p(a) ^ p(b)"],
    );
    check(
        "sameAs(?x, b) -> sameAs(a, ?x)",
        "p(a), sameAs(a, b)",
        &["= p(a) ^ p(b)", "-sameAs(a, b)", "= p(a) ^ p(b)", "+sameAs(a, b)", "+q(b)", "-sameAs(a, b)"],
    );
    check(
        "q(?x) ^ sameAs(?x, a) -> sameAs(?x, b)",
        "p(a)",
        &["= p(a)", "+q(a)", "= p(a) ^ p(b) ^ q(a) ^ q(b)"],
    );
}

#[test]
fn aggregates_count_individuals_that_are_stated_to_differ() {
    const INTEGER: &str = "http://www.w3.org/2001/XMLSchema#integer";
    let rules = "p(?x) ^ ?n = count { p(?y) ^ differentFrom(?x, ?y) } -> others(?x, ?n)";
    let others =
        |a, b| format!("= p(a) ^ p(b) ^ others(a, \"{a}\"^^{INTEGER}) ^ others(b, \"{b}\"^^{INTEGER})");
    let (none, one) = (others(0, 0), others(1, 1) + " ^ differentFrom(a, b) ^ differentFrom(b, a)");
    check(rules, "p(a), p(b)", &[&none, "+differentFrom(a, b)", &one, "-differentFrom(a, b)", &none]);
}

#[test]
fn pairs_of_names_that_no_other_atom_binds_are_matched() {
    let stated = "p(a), sameAs(a, b)";
    check("sameAs(?x, ?y) ^ differentFrom(?x, c) -> q(?x, ?y)", stated, &["= p(a) ^ p(b)"]);
    check(
        "sameAs(?x, ?y) -> q(?x, ?y)",
        stated,
        &["= p(a) ^ p(b) ^ q(a, a) ^ q(a, b) ^ q(b, a) ^ q(b, b)", "-sameAs(a, b)", "= p(a)"],
    );
}

#[test]
fn equality_does_not_support_itself() {
    let rules = "[fp] p(?x, ?y) ^ p(?x, ?z) ^ differentFrom(?y, ?z) -> sameAs(?y, ?z) .
        [ifp] p(?x, ?z) ^ p(?y, ?z) ^ differentFrom(?x, ?y) -> sameAs(?x, ?y) .";
    let mut symbols = Symbols::new();
    let program = parse_rules(rules, "test", &mut symbols, &prefixes()).expect("rules");
    // Without `with_equality`, `differentFrom` compares names, as in the functional property rules of OWL 2
    // RL.
    let program = Program { equality: true, ..program };
    let stated = facts(&mut symbols, "p(a, b), p(c, d), sameAs(a, c), q(a)");
    let mut engine = Engine::new(symbols, program, stated).expect("safe rules");
    let same_as = fact(&mut engine, "sameAs(b, d)");
    assert!(engine.holds(&same_as));
    let delete = vec![fact(&mut engine, "sameAs(a, c)")];
    engine.apply(Delta { insert: vec![], delete }).expect("no budget needed");
    assert!(!engine.holds(&same_as));
    assert_eq!(engine.facts().count(), 3);
}

#[test]
fn violations_list_stated_facts() {
    let mut engine = engine(
        "p(?x) ^ q(?x) -> .",
        "p(a), q(b), sameAs(a, b), differentFrom(c, d), sameAs(c, d), sameAs(a, 1)",
    );
    let violations: Vec<String> = engine.violations().iter().map(|v| show_violation(&engine, v)).collect();
    assert_eq!(violations.len(), 3, "{violations:?}");
    let lines: Vec<String> =
        engine.violations().iter().map(|v| v.display(engine.symbols()).to_string()).collect();
    assert!(lines.iter().any(|line| line.starts_with("test#0: <p>(<a>), <q>(<")), "{lines:?}");
    let literal = "a literal is not the same as another literal or as an individual: ";
    assert!(lines.iter().any(|line| line.starts_with(literal)), "{lines:?}");
    let delete = facts(engine.symbols_mut(), "sameAs(a, b), sameAs(c, d), sameAs(a, 1)");
    engine.apply(Delta { insert: vec![], delete }).expect("no budget needed");
    assert_eq!(engine.violations(), []);
}

#[test]
fn constraints_about_equal_names_remain_separate() {
    let (rules, all) = ("p(b) -> . p(a) -> .", "sameAs(b, a), p(b)");
    for order in [["sameAs(b, a)", "p(b)"], ["p(a)", "sameAs(b, a)"], ["sameAs(a, b)", "p(a)"]] {
        let mut engine = engine(rules, "q(c)");
        for text in order {
            let insert = facts(engine.symbols_mut(), text);
            engine.apply(Delta { insert, delete: vec![] }).expect("no budget needed");
        }
        assert_eq!(engine.violations().len(), 2, "{order:?}");
        let delete =
            facts(engine.symbols_mut(), order.iter().find(|text| text.starts_with('s')).expect("one"));
        engine.apply(Delta { insert: vec![], delete }).expect("no budget needed");
        assert_eq!(engine.violations().len(), 1, "{order:?}");
    }
    assert_eq!(engine(rules, all).violations().len(), 2);
}

#[test]
fn a_stopped_update_leaves_the_engine_unchanged() {
    let rules = "go(?x) -> n(0) . n(?x) ^ swrlb:add(?y, ?x, 1) -> n(?y) . go(?x) -> sameAs(?x, b) .";
    let mut symbols = Symbols::new();
    let program = parse_rules(rules, "test", &mut symbols, &prefixes()).expect("rules");
    let stated = facts(&mut symbols, "sameAs(a, b), p(a), p(c)");
    let program = program.with_equality(&mut symbols);
    let mut engine =
        Engine::with_limits(symbols, program, stated, Limits { steps: 1000, ..Limits::default() })
            .expect("nothing to count");
    let before = engine.facts().collect::<Vec<_>>();
    let (insert, delete) = (vec![fact(&mut engine, "go(c)")], vec![fact(&mut engine, "sameAs(a, b)")]);
    engine.apply(Delta { insert, delete }).expect_err("it never ends");
    assert_eq!(engine.facts().collect::<Vec<_>>(), before);
    let delete = vec![fact(&mut engine, "sameAs(a, b)")];
    engine.apply(Delta { insert: vec![], delete }).expect("within the budget");
    assert_eq!(engine.facts().count(), 2);
}

#[test]
fn a_clone_is_independent_of_its_original() {
    let mut original = engine("p(?x) ^ q(?x) -> r(?x) .", "p(a), q(b)");
    let mut what_if = original.clone();
    let insert = vec![fact(&mut what_if, "sameAs(a, b)")];
    let change = what_if.apply(Delta { insert, delete: vec![] }).expect("no budget needed");
    assert_eq!((change.insert.len(), what_if.facts().count()), (6, 8));
    assert_eq!(original.facts().count(), 2);
    let insert = vec![fact(&mut original, "q(a)")];
    assert_eq!(original.apply(Delta { insert, delete: vec![] }).expect("no budget needed").insert.len(), 2);
}

/// The number of pairs is quadratic in the size of a class, so the brief listing omits derivable pairs.
#[test]
fn large_classes_are_listed_in_brief() {
    let stated: Vec<String> = (1..40).map(|n| format!("is(n{n}, n0)")).collect();
    let engine = engine("is(?x, ?y) -> sameAs(?x, ?y) .", &stated.join(", "));
    let is_same_as = |fact: &Fact| {
        engine.symbols().value(fact.predicate).as_name() == Some("http://www.w3.org/2002/07/owl#sameAs")
    };
    assert_eq!(engine.facts().filter(is_same_as).count(), 40 * 39);
    assert_eq!(engine.inferred_in_brief(40).into_iter().filter(is_same_as).count(), 40 * 39);
    let mut brief = engine.inferred_in_brief(39);
    assert!(brief.iter().all(|fact| engine.holds(fact) && !engine.is_asserted(fact)));
    brief.retain(is_same_as);
    assert_eq!(brief.len(), 39);
    assert!(brief.iter().all(|fact| fact.arguments[0] == brief[0].arguments[0]));
}

/// Swaps pairs of names in random scripts: each change deletes one pair, if there is one, and inserts another,
/// with other facts. After each change, the facts, which of them are stated and which have explanations equal
/// those of a new engine. With `exchanges_rules`, every change also selects the rules at random.
fn swap_pairs(scripts: u64, exchanges_rules: bool) {
    for seed in 0..scripts {
        let random = std::cell::Cell::new(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        let pick = |bound: usize| {
            let mut next = random.get();
            next ^= next << 13;
            next ^= next >> 7;
            next ^= next << 17;
            random.set(next);
            (next >> 16) as usize % bound
        };
        let names = ["a", "b", "c", "d", "e", "f"];
        let rules = [
            "p(?x, ?y) ^ q(?y) -> q(?x) .",
            "p(?x, ?y) ^ p(?x, ?z) -> sameAs(?y, ?z) .",
            "q(?x) -> sameAs(?x, c) .",
            "p(?x, a) -> r(?x) .",
        ];
        let subset = || rules.iter().filter(|_| pick(2) == 0).copied().collect::<Vec<_>>().join("\n");
        let mut text = subset();
        let fact = |kind: usize| match kind {
            0 => format!("sameAs({}, {})", names[pick(6)], names[pick(6)]),
            1 => format!("p({}, {})", names[pick(6)], names[pick(6)]),
            _ => format!("q({})", names[pick(6)]),
        };
        let mut stated: BTreeSet<String> = [0, 0, 1, 1, 1, 2].map(fact).into_iter().collect();
        let mut incremental = engine(&text, &stated.iter().cloned().collect::<Vec<_>>().join(", "));
        for step in 0..5 {
            let mut deleted: Vec<String> =
                stated.iter().filter(|fact| fact.starts_with("sameAs")).take(1).cloned().collect();
            deleted.extend(stated.iter().nth(step % stated.len().max(1)).filter(|_| step % 2 == 1).cloned());
            let inserted = [fact(0), fact(step % 3)];
            deleted.retain(|fact| !inserted.contains(fact));
            let [insert, delete] = [&inserted[..], &deleted].map(|facts| {
                facts.iter().map(|text| crate::text::fact(&mut incremental, text)).collect::<Vec<_>>()
            });
            for fact in &deleted {
                stated.remove(fact);
            }
            stated.extend(inserted);
            let before = displayed(&incremental);
            let delta = Delta { insert, delete };
            let change = if exchanges_rules {
                text = subset();
                let program =
                    parse_rules(&text, "test", incremental.symbols_mut(), &prefixes()).expect("rules");
                let program = program.with_equality(incremental.symbols_mut());
                incremental.change(delta, program).expect("within the budget")
            } else {
                incremental.apply(delta).expect("within the budget")
            };
            let scratch = engine(&text, &stated.iter().cloned().collect::<Vec<_>>().join(", "));
            let state = |engine: &Engine| -> BTreeSet<(String, bool, bool)> {
                let facts = engine.facts().map(|fact| {
                    (
                        fact.display(engine.symbols()).to_string(),
                        engine.is_asserted(&fact),
                        engine.why(&fact).is_some(),
                    )
                });
                facts.collect()
            };
            assert_eq!(state(&incremental), state(&scratch), "seed {seed}, step {step}: {stated:?}\n{text}");
            let after = displayed(&incremental);
            assert_eq!(change.insert.len(), after.difference(&before).count(), "seed {seed}, step {step}");
            assert_eq!(change.delete.len(), before.difference(&after).count(), "seed {seed}, step {step}");
        }
    }
}

#[test]
fn swapped_pairs_match_evaluation_from_scratch() {
    swap_pairs(100, false);
    swap_pairs(100, true);
}

#[test]
#[ignore = "takes a minute without optimisation"]
fn many_swapped_pairs_match_evaluation_from_scratch() {
    swap_pairs(2_500, false);
    swap_pairs(2_500, true);
}

#[test]
fn removing_an_equality_rule_splits_its_classes() {
    let mut engine = engine("p(?x, ?y) ^ p(?x, ?z) -> sameAs(?y, ?z) .", "p(a, b), p(a, c), q(c)");
    let before = displayed(&engine);
    assert!(before.contains("q(b)"), "{before:?}");
    let rule = engine
        .program()
        .rules
        .iter()
        .find(|rule| &*rule.identity.source == "test")
        .expect("the rule")
        .clone();
    let change = engine.remove_rule(&rule.identity).expect("safe rules");
    assert!(!displayed(&engine).contains("q(b)") && change.insert.is_empty(), "{change:?}");
    engine.add_rules([rule]).expect("safe rules");
    assert_eq!(displayed(&engine), before);
}

#[test]
fn equality_is_switched_on_by_a_change() {
    let mut symbols = Symbols::new();
    let stated = facts(&mut symbols, "p(a, b), q(c)");
    let program = parse_rules("q(?x) -> r(?x) .", "test", &mut symbols, &prefixes()).expect("rules");
    let complete = program.with_equality(&mut symbols);
    let mut engine = Engine::new(symbols, program, stated).expect("safe rules");
    let pair = fact(&mut engine, "sameAs(b, c)");
    let change =
        engine.change(Delta { insert: vec![pair.clone()], delete: vec![] }, complete).expect("safe rules");
    let now = displayed(&engine);
    for expected in ["p(a, c)", "q(b)", "r(b)", "sameAs(b, c)", "sameAs(c, b)"] {
        assert!(now.contains(expected), "{expected}: {now:?}");
    }
    assert!(change.delete.is_empty() && !change.insert.is_empty(), "{change:?}");
    engine.apply(Delta { insert: vec![], delete: vec![pair] }).expect("within the budget");
    assert!(!displayed(&engine).contains("r(b)"));
}

#[test]
fn pairs_that_were_derived_without_equality_join_when_it_is_switched_on() {
    let mut symbols = Symbols::new();
    let stated = facts(&mut symbols, "p(b, c), q(c)");
    let program =
        parse_rules("p(?x, ?y) -> sameAs(?x, ?y) .", "test", &mut symbols, &prefixes()).expect("rules");
    let complete = program.with_equality(&mut symbols);
    let mut engine = Engine::new(symbols, program, stated).expect("safe rules");
    assert!(!displayed(&engine).contains("q(b)"));
    let q = fact(&mut engine, "q(d)");
    engine.change(Delta { insert: vec![q], delete: vec![] }, complete).expect("safe rules");
    let now = displayed(&engine);
    assert!(now.contains("q(b)") && now.contains("q(d)"), "{now:?}");
    let p = fact(&mut engine, "p(b, c)");
    engine.apply(Delta { insert: vec![], delete: vec![p] }).expect("within the budget");
    assert!(!displayed(&engine).contains("q(b)"));
}

/// A derived pair that mentions a name is deleted when the name becomes equal to another name. Pairs
/// that follow without that name must be derived again.
#[test]
fn pairs_are_derived_again_when_constants_of_rules_become_equal() {
    let rules = "p(?x, ?y) ^ sameAs(?x, c) -> q(?y, ?x) .
        p(?x, ?w) ^ q(?y, ?x) ^ q(?z, ?x) -> sameAs(?y, ?z) .
        p(?x, ?y) -> n(?x) ^ n(?y) .
        n(?x) -> p(?x, ?x) ^ p(?x, d) .
        r(?x) -> p(?x, e) .";
    let mut engine = engine(rules, "r(c), p(e, a), p(e, c)");
    let pair = fact(&mut engine, "sameAs(a, c)");
    assert!(engine.holds(&pair), "{:?}", displayed(&engine));
}

#[test]
fn negated_comparisons_follow_changes_of_equality() {
    let all = "= p(a) ^ p(b) ^ q(a, b) ^ q(b, a)";
    check(
        "p(?x) ^ p(?y) ^ not sameAs(?x, ?y) -> q(?x, ?y)",
        "p(a), p(b)",
        &[all, "+sameAs(a, b)", "= p(a) ^ p(b)", "-sameAs(a, b)", all],
    );
    check(
        "not sameAs(a, b) ^ p(?x) -> q(?x, ?x) . r(?x) -> sameAs(a, b)",
        "p(a)",
        &["= p(a) ^ q(a, a)", "+r(c)", "= p(a) ^ p(b) ^ r(c)", "-r(c)", "= p(a) ^ q(a, a)"],
    );
    let one =
        |number: u8| format!("= p(a) ^ p(b) ^ n(\"{number}\"^^http://www.w3.org/2001/XMLSchema#integer)");
    check(
        "?n = count { p(?x) ^ not sameAs(?x, b) } -> n(?n)",
        "p(a), p(b)",
        &[&one(1), "+sameAs(a, b)", &one(0), "-sameAs(a, b)", &one(1)],
    );
    let differ = "differentFrom(a, b) ^ differentFrom(b, a)";
    check(
        "p(?x) ^ p(?y) ^ not differentFrom(?x, ?y) -> q(?x, ?y)",
        "p(a), p(b)",
        &[
            "= p(a) ^ p(b) ^ q(a, a) ^ q(a, b) ^ q(b, a) ^ q(b, b)",
            "+differentFrom(a, b)",
            &format!("= p(a) ^ p(b) ^ q(a, a) ^ q(b, b) ^ {differ}"),
        ],
    );
}

#[test]
fn negation_through_equality_is_an_error() {
    for rules in [
        "p(?x) ^ p(?y) ^ not sameAs(?x, ?y) -> sameAs(?x, ?y)",
        "p(?x) ^ not sameAs(?x, b) -> q(?x) . q(?x) -> sameAs(?x, b)",
        "r(?n) ^ ?n = count { p(?x) ^ not sameAs(?x, b) } -> sameAs(a, b)",
    ] {
        let mut symbols = Symbols::new();
        let program = parse_rules(rules, "test", &mut symbols, &prefixes()).expect("rules");
        let program = program.with_equality(&mut symbols);
        let errors = Engine::new(symbols, program, []).expect_err(rules);
        assert!(errors.iter().any(|error| error.code() == "R206"), "{rules}: {errors}");
    }
}
