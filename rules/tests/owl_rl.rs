//! What each axiom of OWL 2 RL makes follow, and what it forbids, under both readings of names.

mod text;

use std::collections::BTreeSet;

use metaplan_rules::owl_rl::{Axiom as A, Names, difference, rules, with_equality};
use metaplan_rules::{Atom, Engine, Fact, Symbol, Symbols, parse_rules};
use text::{facts, prefixes};

/// Axioms over names.
type Axioms<'a> = &'a dyn Fn(Name) -> Vec<A>;
type Name<'a> = &'a mut dyn FnMut(&str) -> Symbol;

/// Facts without `sameAs` and `differentFrom`, as the engine prints them.
const EQUALITY: &str = "http://www.w3.org/2002/07/owl#";

fn engine(axioms: Axioms, names: Names, rule: &str, stated: &str) -> Engine {
    let mut symbols = Symbols::new();
    let axioms = axioms(&mut |name| symbols.name(name));
    let stated: Vec<Fact> = facts(&mut symbols, stated);
    let mut program = parse_rules(rule, "test", &mut symbols, &prefixes()).expect("rules");
    let asks =
        program.rules.iter().flat_map(|rule| &rule.body).any(|atom| matches!(atom, Atom::Different(..)));
    program.rules.extend(rules(&axioms, names).rules);
    if names == Names::Owl {
        if asks {
            program.rules.extend(difference(&axioms, &mut symbols).rules);
        }
        let used = stated.iter().map(|fact| (fact.predicate, fact.arguments.len()));
        program = with_equality(&program, used, &mut symbols);
    }
    Engine::new(symbols, program, stated).expect("safe rules")
}

/// `expected`: what follows besides what is stated, sorted, then how many violations there are.
fn check(axioms: impl Fn(Name) -> Vec<A>, stated: &str, expected: &str, violations: usize) {
    let engine = engine(&axioms, Names::Owl, "", stated);
    let derived = engine.facts().filter(|fact| !engine.is_asserted(fact));
    let derived = derived.map(|fact| fact.display(engine.symbols()).to_string().replace(['<', '>'], ""));
    let derived: BTreeSet<String> = derived.filter(|fact| !fact.starts_with(EQUALITY)).collect();
    let expected: BTreeSet<String> =
        expected.split(" ^ ").filter(|e| !e.is_empty()).map(Into::into).collect();
    assert_eq!(derived, expected, "{stated}");
    assert_eq!(engine.violations().len(), violations, "{stated}: {:?}", engine.violations());
}

#[test]
fn classes() {
    check(|n| vec![A::SubClass(n("c"), n("d"))], "c(x)", "d(x)", 0);
    check(|n| vec![A::EquivalentClasses(n("c"), n("d"))], "c(x) ^ d(y)", "d(x) ^ c(y)", 0);
    check(|n| vec![A::DisjointClasses(n("c"), n("d"))], "c(x) ^ d(x)", "", 1);
    check(|n| vec![A::Complement(n("c"), n("d"))], "c(x) ^ d(y)", "", 0);
    check(|n| vec![A::Nothing(n("c"))], "c(x)", "", 1);
    check(
        |n| vec![A::Intersection(n("c"), vec![n("d"), n("e")])],
        "d(x) ^ e(x) ^ c(y)",
        "c(x) ^ d(y) ^ e(y)",
        0,
    );
    check(|n| vec![A::Union(n("c"), vec![n("d"), n("e")])], "d(x) ^ e(y)", "c(x) ^ c(y)", 0);
    check(|n| vec![A::OneOf(n("c"), vec![n("x"), n("y")])], "d(z)", "c(x) ^ c(y)", 0);
    check(|n| vec![A::SomeValuesFrom(n("c"), n("p"), Some(n("d")))], "p(x, y) ^ d(y) ^ p(z, z)", "c(x)", 0);
    check(|n| vec![A::SomeValuesFrom(n("c"), n("p"), None)], "p(x, y)", "c(x)", 0);
    check(|n| vec![A::AllValuesFrom(n("c"), n("p"), n("d"))], "c(x) ^ p(x, y) ^ p(z, z)", "d(y)", 0);
    check(|n| vec![A::HasValue(n("c"), n("p"), n("v"))], "c(x) ^ p(y, v)", "p(x, v) ^ c(y)", 0);
    check(|n| vec![A::MaxZero(n("c"), n("p"), None)], "c(x) ^ p(x, y)", "", 1);
    check(|n| vec![A::MaxZero(n("c"), n("p"), Some(n("d")))], "c(x) ^ p(x, y) ^ p(x, z) ^ d(z)", "", 1);
    check(|n| vec![A::MaxOne(n("c"), n("p"), None)], "c(x) ^ p(x, y) ^ p(x, z) ^ d(y)", "d(z)", 0);
    check(|n| vec![A::MaxOne(n("c"), n("p"), Some(n("d")))], "c(x) ^ p(x, y) ^ p(x, z) ^ d(y) ^ e(y)", "", 0);
}

#[test]
fn properties() {
    check(|n| vec![A::Domain(n("p"), n("c")), A::Range(n("p"), n("d"))], "p(x, y)", "c(x) ^ d(y)", 0);
    check(|n| vec![A::FunctionalObject(n("p"))], "p(x, y) ^ p(x, z) ^ c(y)", "c(z)", 0);
    check(|n| vec![A::FunctionalData(n("p"))], "p(x, 1.5) ^ p(x, 1.50) ^ p(y, 1.5)", "", 0);
    check(|n| vec![A::FunctionalData(n("p"))], "p(x, 1) ^ p(x, 2)", "", 2);
    check(|n| vec![A::InverseFunctional(n("p"))], "p(x, z) ^ p(y, z) ^ c(x)", "c(y)", 0);
    check(|n| vec![A::Irreflexive(n("p"))], "p(x, x) ^ p(x, y)", "", 1);
    check(|n| vec![A::Symmetric(n("p"))], "p(x, y)", "p(y, x)", 0);
    check(|n| vec![A::Asymmetric(n("p"))], "p(x, y) ^ p(y, x)", "", 2);
    check(|n| vec![A::Transitive(n("p"))], "p(x, y) ^ p(y, z)", "p(x, z)", 0);
    check(|n| vec![A::SubProperty(n("p"), n("q"))], "p(x, y)", "q(x, y)", 0);
    check(|n| vec![A::Chain(vec![n("p"), n("q")], n("r"))], "p(x, y) ^ q(y, z)", "r(x, z)", 0);
    check(|n| vec![A::EquivalentProperties(n("p"), n("q"))], "p(x, y) ^ q(z, z)", "q(x, y) ^ p(z, z)", 0);
    check(|n| vec![A::DisjointProperties(n("p"), n("q"))], "p(x, y) ^ q(x, y)", "", 1);
    check(|n| vec![A::Inverse(n("p"), n("q"))], "p(x, y) ^ q(v, w)", "q(y, x) ^ p(w, v)", 0);
    check(
        |n| vec![A::Key(n("c"), vec![n("p"), n("q")])],
        "c(x) ^ c(y) ^ p(x, 1) ^ p(y, 1) ^ q(x, z) ^ q(y, z) ^ d(x)",
        "d(y)",
        0,
    );
    check(|n| vec![A::Negative(n("p"), n("x"), n("y"))], "p(x, y) ^ p(y, x)", "", 1);
}

/// Whether `yes()` follows by a rule that asks for equality or difference.
fn ask(rule: &str, axioms: Axioms, names: Names, stated: &str, expected: bool) {
    let engine = engine(axioms, names, rule, stated);
    let yes = engine.symbols().find_name("yes").expect("in the rule");
    assert_eq!(engine.holds(&Fact::new(yes, [])), expected, "{rule} {names:?}: {stated}");
}

#[test]
fn equality_is_asked_for() {
    let functional = |n: &mut dyn FnMut(&str) -> Symbol| vec![A::FunctionalObject(n("p"))];
    let disjoint = |n: &mut dyn FnMut(&str) -> Symbol| vec![A::DisjointClasses(n("c"), n("d"))];
    let merge = "p(x, y) ^ p(x, z) ^ c(y) ^ d(z)";
    for (names, merged) in [(Names::Owl, true), (Names::Unique, false)] {
        ask("c(?a) ^ d(?a) -> yes()", &functional, names, merge, merged);
        ask("c(?a) ^ d(?b) ^ sameAs(?a, ?b) -> yes()", &functional, names, merge, merged);
        ask("c(?a) ^ sameAs(?a, z) -> yes()", &functional, names, merge, merged);
        ask("sameAs(y, z) -> yes()", &functional, names, merge, merged);
        ask("sameAs(y, y) -> yes()", &functional, names, merge, true);
        ask("c(?a) ^ d(?b) ^ differentFrom(?a, ?b) -> yes()", &functional, names, "c(y) ^ d(z)", !merged);
        ask("c(?a) ^ d(?b) ^ differentFrom(?a, ?b) -> yes()", &disjoint, names, "c(y) ^ d(z)", true);
    }
    ask("sameAs(?a, ?b) ^ c(?c) -> yes()", &functional, Names::Owl, merge, true);
    let data =
        |n: &mut dyn FnMut(&str) -> Symbol| vec![A::FunctionalData(n("q")), A::FunctionalObject(n("p"))];
    let apart = "p(x, v) ^ q(v, 1) ^ p(y, w) ^ q(w, 2)";
    ask("differentFrom(x, y) -> yes()", &data, Names::Owl, apart, true);
    ask("differentFrom(x, v) -> yes()", &data, Names::Owl, apart, false);
}
