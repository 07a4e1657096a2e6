//! Facts and engines from text, parsed by the rule parser.
#![allow(dead_code, reason = "each suite uses a part")]

use metaplan_rules::{Atom, Engine, Errors, Fact, Literal, Prefixes, Symbols, Term, Violation, parse_rules};

pub fn prefixes() -> Prefixes {
    Prefixes::new().with("t", "http://metacontrol.org/tomasys#").with("mros", "http://ros/mros#")
}

/// Parses facts such as `p(a, "x"), q(1)`, as the head of a rule without body.
pub fn facts(symbols: &mut Symbols, text: &str) -> Vec<Fact> {
    let program = parse_rules(&format!("-> {text} ."), "facts", symbols, &prefixes()).expect("facts");
    let [same_as, different] = ["sameAs", "differentFrom"]
        .map(|name| symbols.name(&format!("http://www.w3.org/2002/07/owl#{name}")));
    let ground = |term| match term {
        Term::Constant(symbol) => symbol,
        Term::Variable(_) => panic!("a fact has no variables"),
    };
    let fact = |atom| match atom {
        Atom::Relation { predicate, arguments } => Fact::new(predicate, arguments.into_iter().map(ground)),
        Atom::Same(left, right) => Fact::new(same_as, [ground(left), ground(right)]),
        Atom::Different(left, right) => Fact::new(different, [ground(left), ground(right)]),
        other => panic!("{other:?} is not a fact"),
    };
    program.rules.into_iter().flat_map(|rule| rule.head).map(fact).collect()
}

pub fn fact(engine: &mut Engine, text: &str) -> Fact {
    facts(engine.symbols_mut(), text).remove(0)
}

pub fn engine(rules: &str, stated: &str) -> Result<Engine, Errors> {
    let mut symbols = Symbols::new();
    let program = parse_rules(rules, "test", &mut symbols, &prefixes())?;
    let facts = if stated.is_empty() { Vec::new() } else { facts(&mut symbols, stated) };
    Engine::new(symbols, program, facts)
}

/// Parses a literal: `"lexical"^^datatype`, `"text"@en` or a number.
pub fn literal(text: &str) -> Literal {
    let mut symbols = Symbols::new();
    let fact = facts(&mut symbols, &format!("p({text})")).remove(0);
    symbols.value(fact.arguments[0]).as_literal().expect("a literal").clone()
}

pub fn show_violation(engine: &Engine, violation: &Violation) -> String {
    let supports = violation.supports.iter().map(|fact| fact.display(engine.symbols()).to_string());
    supports.collect::<Vec<_>>().join(" and ")
}
