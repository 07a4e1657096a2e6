//! What follows from small rule texts, before and after changes.

use metaplan_rules as rules;
use metaplan_rules::{Delta, Engine, Error, Fact, Literal, Prefixes, Symbols, parse_rules};

/// A fact as text, `p(a, "x", 1)`, read by the rule parser as the head of a rule without body.
fn fact(engine: &mut Engine, text: &str) -> Fact {
    facts(engine.symbols_mut(), text).remove(0)
}

fn facts(symbols: &mut Symbols, text: &str) -> Vec<Fact> {
    let text = format!("-> {text} .");
    let program = parse_rules(&text, "facts", symbols, &Prefixes::new()).expect("facts");
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
    let program = parse_rules(rules, "test", &mut symbols, &Prefixes::new())?;
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
