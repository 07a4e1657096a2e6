//! What each axiom of OWL 2 RL makes follow, and what it forbids, under both readings of names.

use std::collections::BTreeSet;

use crate::text::{facts, prefixes};
use metaplan_rules::owl_rl::{Axiom as A, Names, difference, rules, with_equality};
use metaplan_rules::{Atom, Engine, Fact, Literal, Symbol, Symbols, parse_rules};

/// Axioms over names.
type Axioms<'a> = &'a dyn Fn(Name) -> Vec<A>;
type Name<'a> = &'a mut dyn FnMut(&str) -> Symbol;

/// Facts without `sameAs` and `differentFrom`, as the engine prints them.
const EQUALITY: &str = "http://www.w3.org/2002/07/owl#";

fn engine(axioms: Axioms, names: Names, rule: &str, stated: &str) -> Engine {
    let mut symbols = Symbols::new();
    let axioms = axioms(&mut |name| match name.strip_prefix("xsd:") {
        Some(datatype) => {
            symbols.literal(Literal::Uri(format!("http://www.w3.org/2001/XMLSchema#{datatype}").into()))
        }
        None if name == "= 1" => symbols.literal(Literal::integer(1)),
        None => symbols.name(name),
    });
    let stated: Vec<Fact> = facts(&mut symbols, stated);
    let mut program = parse_rules(rule, "test", &mut symbols, &prefixes()).expect("rules");
    let asks =
        program.rules.iter().flat_map(|rule| &rule.body).any(|atom| matches!(atom, Atom::Different(..)));
    program.rules.extend(rules(&axioms, names).rules);
    if names == Names::Owl {
        if asks {
            program.rules.extend(difference(&axioms, &mut symbols).rules);
        }
        program = with_equality(&program, &mut symbols);
    }
    Engine::new(symbols, program, stated).expect("safe rules")
}

/// The rule's name in the tables, axioms, what is stated, what follows besides (sorted by names), how many violations.
type Case = (&'static str, fn(Name) -> Vec<A>, &'static str, &'static str, usize);

fn check(&(name, axioms, stated, expected, violations): &Case) {
    let engine = engine(&axioms, Names::Owl, "", stated);
    let derived = engine.facts().filter(|fact| !engine.is_asserted(fact));
    let derived = derived.map(|fact| fact.display(engine.symbols()).to_string().replace(['<', '>'], ""));
    let derived: BTreeSet<String> =
        derived.filter(|fact| name.starts_with("eq-") || !fact.starts_with(EQUALITY)).collect();
    let expected: BTreeSet<String> =
        expected.split(" ^ ").filter(|e| !e.is_empty()).map(|e| e.replace("owl:", EQUALITY)).collect();
    assert_eq!(derived, expected, "{name}: {stated}");
    assert_eq!(engine.violations().len(), violations, "{name}: {stated}: {:?}", engine.violations());
}

/// Tables 4 to 9 of the profile, in their order.
const CASES: &[Case] = &[
    ("eq-sym", |_| vec![], "owl:sameAs(x, y)", "owl:sameAs(y, x)", 0),
    (
        "eq-trans",
        |_| vec![],
        "owl:sameAs(x, y) ^ owl:sameAs(y, z) ^ owl:sameAs(y, x) ^ owl:sameAs(z, y)",
        "owl:sameAs(x, z) ^ owl:sameAs(z, x)",
        0,
    ),
    ("eq-rep-s", |_| vec![], "owl:sameAs(x, y) ^ owl:sameAs(y, x) ^ p(x, z)", "p(y, z)", 0),
    ("eq-rep-o", |_| vec![], "owl:sameAs(x, y) ^ owl:sameAs(y, x) ^ p(z, x)", "p(z, y)", 0),
    (
        "eq-diff1",
        |_| vec![],
        "owl:sameAs(x, y) ^ owl:sameAs(y, x) ^ owl:differentFrom(x, y)",
        "owl:differentFrom(x, x) ^ owl:differentFrom(y, y) ^ owl:differentFrom(y, x)",
        1,
    ),
    ("prp-dom", |n| vec![A::Domain(n("p"), n("c"))], "p(x, y)", "c(x)", 0),
    ("prp-rng", |n| vec![A::Range(n("p"), n("d"))], "p(x, y)", "d(y)", 0),
    ("prp-fp", |n| vec![A::FunctionalObject(n("p"))], "p(x, y) ^ p(x, z) ^ c(y)", "c(z)", 0),
    ("prp-fp", |n| vec![A::FunctionalData(n("p"))], "p(x, 1.5) ^ p(x, 1.50) ^ p(y, 1.5)", "", 0),
    ("prp-fp", |n| vec![A::FunctionalData(n("p"))], "p(x, 1) ^ p(x, 2)", "", 2),
    ("prp-ifp", |n| vec![A::InverseFunctional(n("p"))], "p(x, z) ^ p(y, z) ^ c(x)", "c(y)", 0),
    ("prp-irp", |n| vec![A::Irreflexive(n("p"))], "p(x, x) ^ p(x, y)", "", 1),
    ("prp-symp", |n| vec![A::Symmetric(n("p"))], "p(x, y)", "p(y, x)", 0),
    ("prp-asyp", |n| vec![A::Asymmetric(n("p"))], "p(x, y) ^ p(y, x)", "", 2),
    ("prp-trp", |n| vec![A::Transitive(n("p"))], "p(x, y) ^ p(y, z)", "p(x, z)", 0),
    ("prp-spo1", |n| vec![A::SubProperty(n("p"), n("q"))], "p(x, y)", "q(x, y)", 0),
    ("prp-spo2", |n| vec![A::Chain(vec![n("p"), n("q")], n("r"))], "p(x, y) ^ q(y, z)", "r(x, z)", 0),
    ("prp-eqp1", |n| vec![A::EquivalentProperties(n("p"), n("q"))], "p(x, y)", "q(x, y)", 0),
    ("prp-eqp2", |n| vec![A::EquivalentProperties(n("p"), n("q"))], "q(z, z)", "p(z, z)", 0),
    ("prp-pdw", |n| vec![A::DisjointProperties(n("p"), n("q"))], "p(x, y) ^ q(x, y)", "", 1),
    (
        "prp-adp",
        |n| {
            vec![
                A::DisjointProperties(n("p"), n("q")),
                A::DisjointProperties(n("p"), n("r")),
                A::DisjointProperties(n("q"), n("r")),
            ]
        },
        "p(x, y) ^ r(x, y)",
        "",
        1,
    ),
    ("prp-inv1", |n| vec![A::Inverse(n("p"), n("q"))], "p(x, y)", "q(y, x)", 0),
    ("prp-inv2", |n| vec![A::Inverse(n("p"), n("q"))], "q(v, w)", "p(w, v)", 0),
    (
        "prp-key",
        |n| vec![A::Key(n("c"), vec![n("p"), n("q")])],
        "c(x) ^ c(y) ^ p(x, 1) ^ p(y, 1) ^ q(x, z) ^ q(y, z) ^ d(x)",
        "d(y)",
        0,
    ),
    ("prp-npa1", |n| vec![A::Negative(n("p"), n("x"), n("y"))], "p(x, y) ^ p(y, x)", "", 1),
    ("prp-npa2", |n| vec![A::Negative(n("p"), n("x"), n("= 1"))], "p(x, 1.0) ^ p(x, 2)", "", 1),
    ("cls-nothing2", |n| vec![A::Nothing(n("c"))], "c(x)", "", 1),
    ("cls-int1", |n| vec![A::Intersection(n("c"), vec![n("d"), n("e")])], "d(x) ^ e(x) ^ d(y)", "c(x)", 0),
    ("cls-int2", |n| vec![A::Intersection(n("c"), vec![n("d"), n("e")])], "c(y)", "d(y) ^ e(y)", 0),
    ("cls-uni", |n| vec![A::Union(n("c"), vec![n("d"), n("e")])], "d(x) ^ e(y)", "c(x) ^ c(y)", 0),
    ("cls-com", |n| vec![A::Complement(n("c"), n("d"))], "c(x) ^ d(y)", "", 0),
    ("cls-com", |n| vec![A::Complement(n("c"), n("d"))], "c(x) ^ d(x)", "", 1),
    (
        "cls-svf1",
        |n| vec![A::SomeValuesFrom(n("c"), n("p"), Some(n("d")))],
        "p(x, y) ^ d(y) ^ p(z, z)",
        "c(x)",
        0,
    ),
    ("cls-svf2", |n| vec![A::SomeValuesFrom(n("c"), n("p"), None)], "p(x, y)", "c(x)", 0),
    ("cls-avf", |n| vec![A::AllValuesFrom(n("c"), n("p"), n("d"))], "c(x) ^ p(x, y) ^ p(z, z)", "d(y)", 0),
    ("cls-hv1", |n| vec![A::HasValue(n("c"), n("p"), n("v"))], "c(x)", "p(x, v)", 0),
    ("cls-hv2", |n| vec![A::HasValue(n("c"), n("p"), n("v"))], "p(y, v)", "c(y)", 0),
    ("cls-maxc1", |n| vec![A::MaxZero(n("c"), n("p"), None)], "c(x) ^ p(x, y)", "", 1),
    ("cls-maxc2", |n| vec![A::MaxOne(n("c"), n("p"), None)], "c(x) ^ p(x, y) ^ p(x, z) ^ d(y)", "d(z)", 0),
    (
        "cls-maxqc1",
        |n| vec![A::MaxZero(n("c"), n("p"), Some(n("d")))],
        "c(x) ^ p(x, y) ^ p(x, z) ^ d(z)",
        "",
        1,
    ),
    ("cls-maxqc2", |n| vec![A::MaxZero(n("c"), n("p"), None)], "c(x) ^ p(y, x)", "", 0),
    (
        "cls-maxqc3",
        |n| vec![A::MaxOne(n("c"), n("p"), Some(n("d")))],
        "c(x) ^ p(x, y) ^ p(x, z) ^ d(y) ^ e(y)",
        "",
        0,
    ),
    (
        "cls-maxqc3",
        |n| vec![A::MaxOne(n("c"), n("p"), Some(n("d")))],
        "c(x) ^ p(x, y) ^ p(x, z) ^ d(y) ^ d(z) ^ e(y)",
        "e(z)",
        0,
    ),
    ("cls-maxqc4", |n| vec![A::MaxOne(n("c"), n("p"), None)], "p(x, y) ^ p(x, z) ^ d(y)", "", 0),
    ("cls-oo", |n| vec![A::OneOf(n("c"), vec![n("x"), n("y")])], "d(z)", "c(x) ^ c(y)", 0),
    ("cax-sco", |n| vec![A::SubClass(n("c"), n("d"))], "c(x)", "d(x)", 0),
    ("cax-eqc1", |n| vec![A::EquivalentClasses(n("c"), n("d"))], "c(x)", "d(x)", 0),
    ("cax-eqc2", |n| vec![A::EquivalentClasses(n("c"), n("d"))], "d(y)", "c(y)", 0),
    ("cax-dw", |n| vec![A::DisjointClasses(n("c"), n("d"))], "c(x) ^ d(x)", "", 1),
    (
        "cax-adc",
        |n| {
            vec![
                A::DisjointClasses(n("c"), n("d")),
                A::DisjointClasses(n("c"), n("e")),
                A::DisjointClasses(n("d"), n("e")),
            ]
        },
        "d(x) ^ e(x)",
        "",
        1,
    ),
    ("dt-type2", |n| vec![A::DataRange(n("p"), n("xsd:integer"))], "p(x, 1) ^ p(x, 1.0)", "", 0),
    ("dt-eq", |n| vec![A::FunctionalData(n("p"))], "p(x, 1) ^ p(x, \"1.00\"^^xsd:decimal)", "", 0),
    ("dt-diff", |n| vec![A::FunctionalData(n("p"))], "p(x, 1) ^ p(x, \"1\"^^xsd:double)", "", 2),
    (
        "dt-not-type",
        |n| vec![A::DataRange(n("p"), n("xsd:integer"))],
        "p(x, 1.5) ^ p(x, true) ^ p(x, 2)",
        "",
        2,
    ),
    ("dt-not-type", |_| vec![], "p(x, \"yes\"^^xsd:boolean)", "", 1),
    ("scm-sco", |n| vec![A::SubClass(n("c"), n("d")), A::SubClass(n("d"), n("e"))], "c(x)", "d(x) ^ e(x)", 0),
    (
        "scm-eqc1",
        |n| vec![A::EquivalentClasses(n("c"), n("d")), A::SubClass(n("d"), n("e"))],
        "c(x)",
        "d(x) ^ e(x)",
        0,
    ),
    (
        "scm-eqc2",
        |n| vec![A::SubClass(n("c"), n("d")), A::SubClass(n("d"), n("c"))],
        "c(x) ^ d(y)",
        "d(x) ^ c(y)",
        0,
    ),
    (
        "scm-spo",
        |n| vec![A::SubProperty(n("p"), n("q")), A::SubProperty(n("q"), n("r"))],
        "p(x, y)",
        "q(x, y) ^ r(x, y)",
        0,
    ),
    (
        "scm-eqp1",
        |n| vec![A::EquivalentProperties(n("p"), n("q")), A::SubProperty(n("q"), n("r"))],
        "p(x, y)",
        "q(x, y) ^ r(x, y)",
        0,
    ),
    (
        "scm-eqp2",
        |n| vec![A::SubProperty(n("p"), n("q")), A::SubProperty(n("q"), n("p"))],
        "p(x, y) ^ q(y, y)",
        "q(x, y) ^ p(y, y)",
        0,
    ),
    (
        "scm-dom1",
        |n| vec![A::Domain(n("p"), n("c")), A::SubClass(n("c"), n("d"))],
        "p(x, y)",
        "c(x) ^ d(x)",
        0,
    ),
    (
        "scm-dom2",
        |n| vec![A::Domain(n("p"), n("c")), A::SubProperty(n("q"), n("p"))],
        "q(x, y)",
        "c(x) ^ p(x, y)",
        0,
    ),
    (
        "scm-rng1",
        |n| vec![A::Range(n("p"), n("c")), A::SubClass(n("c"), n("d"))],
        "p(x, y)",
        "c(y) ^ d(y)",
        0,
    ),
    (
        "scm-rng2",
        |n| vec![A::Range(n("p"), n("c")), A::SubProperty(n("q"), n("p"))],
        "q(x, y)",
        "c(y) ^ p(x, y)",
        0,
    ),
    (
        "scm-hv",
        |n| {
            vec![
                A::HasValue(n("c"), n("p"), n("v")),
                A::HasValue(n("d"), n("q"), n("v")),
                A::SubProperty(n("p"), n("q")),
            ]
        },
        "c(x)",
        "p(x, v) ^ q(x, v) ^ d(x)",
        0,
    ),
    (
        "scm-svf1",
        |n| {
            vec![
                A::SomeValuesFrom(n("c"), n("p"), Some(n("e"))),
                A::SomeValuesFrom(n("d"), n("p"), Some(n("f"))),
                A::SubClass(n("e"), n("f")),
            ]
        },
        "c(x) ^ d(y)",
        "d(x)",
        0,
    ),
    (
        "scm-svf1",
        |n| vec![A::SomeValuesFrom(n("c"), n("p"), Some(n("e"))), A::SomeValuesFrom(n("d"), n("p"), None)],
        "c(x) ^ d(y)",
        "d(x)",
        0,
    ),
    (
        "scm-svf2",
        |n| {
            vec![
                A::SomeValuesFrom(n("c"), n("p"), Some(n("e"))),
                A::SomeValuesFrom(n("d"), n("q"), Some(n("e"))),
                A::SubProperty(n("p"), n("q")),
            ]
        },
        "c(x) ^ d(y)",
        "d(x)",
        0,
    ),
    (
        "scm-avf1",
        |n| {
            vec![
                A::AllValuesFrom(n("c"), n("p"), n("e")),
                A::AllValuesFrom(n("d"), n("p"), n("f")),
                A::SubClass(n("e"), n("f")),
            ]
        },
        "c(x) ^ d(y)",
        "d(x)",
        0,
    ),
    (
        "scm-avf2",
        |n| {
            vec![
                A::AllValuesFrom(n("c"), n("p"), n("e")),
                A::AllValuesFrom(n("d"), n("q"), n("e")),
                A::SubProperty(n("q"), n("p")),
            ]
        },
        "c(x) ^ d(y)",
        "d(x)",
        0,
    ),
    (
        "scm-int",
        |n| vec![A::Intersection(n("c"), vec![n("d"), n("e")]), A::SubClass(n("d"), n("f"))],
        "c(x)",
        "d(x) ^ e(x) ^ f(x)",
        0,
    ),
    (
        "scm-uni",
        |n| vec![A::Union(n("c"), vec![n("d"), n("e")]), A::SubClass(n("c"), n("f"))],
        "d(x)",
        "c(x) ^ f(x)",
        0,
    ),
];

/// The other rules of the tables, and why they have no case.
const WITHOUT_CASE: &[(&str, &str)] = &[
    ("eq-ref", "pairs of a name with itself are not derived"),
    ("eq-rep-p", "relations are not individuals"),
    ("eq-diff2", "each pair of owl:AllDifferent is a fact of owl:differentFrom"),
    ("eq-diff3", "each pair of owl:AllDifferent is a fact of owl:differentFrom"),
    ("prp-ap", "says nothing about individuals"),
    ("cls-thing", "says nothing about individuals"),
    ("cls-nothing1", "says nothing about individuals"),
    ("dt-type1", "says nothing about individuals"),
    ("scm-cls", "a class as its own subclass adds no assertion"),
    ("scm-op", "a property as its own subproperty adds no assertion"),
    ("scm-dp", "a property as its own subproperty adds no assertion"),
];

/// The tables' rules: eq 9, prp 20, cls 19, cax 5, dt 5, scm 20.
const RULES: usize = 78;

#[test]
fn every_rule_of_the_tables_has_a_case_or_a_reason() {
    CASES.iter().for_each(check);
    let names: BTreeSet<&str> =
        CASES.iter().map(|case| case.0).chain(WITHOUT_CASE.iter().map(|rule| rule.0)).collect();
    assert_eq!(names.len(), RULES);
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
