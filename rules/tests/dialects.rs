//! Plain SWRL as a dialect of rule text, and custom built-ins.

use metaplan_rules::{
    BuiltIn, Definition, Engine, Fact, Literal, Prefixes, Symbols, Syntax, parse_rules_as, print_rules,
};

fn check(text: &str, syntax: &Syntax, expected: &[&str]) {
    let errors = parse_rules_as(text, "test", &mut Symbols::new(), &Prefixes::new(), syntax);
    let errors: Vec<String> = errors.err().into_iter().flatten().map(|error| error.to_string()).collect();
    assert_eq!(errors, expected, "{text}");
}

#[test]
fn swrl_has_neither_negation_as_failure_nor_aggregates() {
    let swrl = Syntax { swrl_only: true, ..Syntax::default() };
    let text = "p(?x) ^ not q(?x) -> r(?x) . p(?x) -> q(?x) . p(?x) ^ not q(?x) -> s(?x)";
    check(text, &Syntax::default(), &[]);
    let expected = [
        "test:1:13: R105 negation as failure is not SWRL",
        "test:1:59: R105 negation as failure is not SWRL",
    ];
    check(text, &swrl, &expected);
    check("p(?x) ^ not(?x) -> r(?x)", &swrl, &[]);
    let text = "?n = count { p(?x) } -> r(?n)";
    check(text, &Syntax::default(), &[]);
    check(text, &swrl, &["test:1:1: R105 an aggregate is not SWRL"]);
}

/// `multiple` tests that the first argument is a multiple of the second. `double` computes the double of
/// the second.
struct Multiple;
struct Double;

fn number(literal: &Literal) -> Option<i64> {
    literal.lexical().parse().ok()
}

impl Definition for Multiple {
    fn iri(&self) -> &'static str {
        "urn:own#multiple"
    }

    fn accepts(&self, count: usize) -> bool {
        count == 2
    }

    fn holds(&self, arguments: &[&Literal]) -> bool {
        let values: Option<Vec<i64>> = arguments.iter().map(|literal| number(literal)).collect();
        values.is_some_and(|values| values[1] != 0 && values[0] % values[1] == 0)
    }
}

impl Definition for Double {
    fn iri(&self) -> &'static str {
        "urn:own#double"
    }

    fn accepts(&self, count: usize) -> bool {
        count == 2
    }

    fn is_function(&self) -> bool {
        true
    }

    fn compute(&self, arguments: &[&Literal]) -> Option<Literal> {
        Some(Literal::integer(number(arguments[0])?.checked_mul(2)?))
    }
}

#[test]
fn custom_built_ins_test_and_compute() {
    let built_ins = vec![BuiltIn::custom(&Multiple), BuiltIn::custom(&Double)];
    let syntax = Syntax { swrl_only: true, built_ins };
    let prefixes = Prefixes::new().with("own", "urn:own#");
    let text = "[twice] p(?x) ^ own:multiple(?x, 3) ^ own:double(?y, ?x) -> q(?y) .";
    let mut symbols = Symbols::new();
    let program = parse_rules_as(text, "test", &mut symbols, &prefixes, &syntax).expect("rules");
    let printed = print_rules(&program, &symbols, &prefixes);
    assert!(printed.contains("own:multiple(?x, "), "{printed}");
    let (p, q) = (symbols.name("p"), symbols.name("q"));
    let mut fact = |predicate, value| Fact::new(predicate, [symbols.literal(Literal::integer(value))]);
    let (facts, expected) =
        ((1..=6).map(|value| fact(p, value)).collect::<Vec<_>>(), [fact(q, 6), fact(q, 12)]);
    let engine = Engine::new(symbols, program, facts).expect("safe rules");
    let derived: Vec<Fact> = engine.facts().filter(|fact| !engine.is_asserted(fact)).collect();
    assert_eq!(derived, expected);
    check("own:multiple(?x, 3, 4) -> q(?x)", &syntax, &["test:1:1: R102 undeclared prefix `own:`"]);
}
