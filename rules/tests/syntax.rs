//! Rule text: parsed rules are printed and parsed to the same rules, and errors have positions.

use crate::text::{engine, prefixes};
use metaplan_rules::{COADAPTATION_RULES, Symbols, TOMASYS_RULES, parse_rules, print_rules};

#[test]
fn printed_rules_read_back_the_same() {
    let unusual = r#"
        prefix ex: <http://example.org/>
        [as Protégé writes it] ex:A(?x) ^ swrlb:greaterThanOrEqual(?x, -0.5) ^ sameAs(?x, ?y) -> ex:B(?y)
        ex:p(?x.1, "a \"b\"\n"@en-GB) ∧ differentFrom(?x, ex:i) ∧ ex:r() → <urn:x y>(?x), sameAs(?x, ex:i) .
        ex:p(?x, 1e3) , not ex:q(?x, true, "5"^^xsd:byte, "FALSE") -> .
        -> ex:A(ex:a.b), not(ex:c) .
        [aggregates] ex:p(?x, ?y) ^ ?n = count { ex:q(?x, ?z) ^ not ex:r(?z) } ^ 0 = sum{?n|ex:s(?n, ?y)}
            ^ "1.5"^^xsd:decimal = min { ?w | ex:v(?x, ?w) } ^ ?n = max { 7 | ex:r(ex:a) } -> ex:A(?n) .
        [range] ex:p(?x, ?y) ^ xsd:decimal(?y) ^ rdf:PlainLiteral(?x) ^ not xsd:string(?x) -> ex:q(?x) .
        [negated] ex:p(?x, ?y) ^ not swrlb:lessThan(?y, 3) ^ not sameAs(?x, ex:i) ^ not differentFrom(?x, ex:i) -> .
        # the end
    "#;
    let unusual = unusual.replace("?x.1", "?x");
    for text in [TOMASYS_RULES, COADAPTATION_RULES, &unusual] {
        let mut symbols = Symbols::new();
        let program = parse_rules(text, "test", &mut symbols, &prefixes()).expect("rules");
        assert!(program.rules.len() > 3);
        let printed = print_rules(&program, &symbols, &prefixes());
        let reparsed = parse_rules(&printed, "test", &mut symbols, &prefixes()).expect(&printed);
        assert_eq!(program, reparsed, "{printed}");
    }
}

#[test]
fn replacement_names_differ_from_existing_names() {
    let mut symbols = Symbols::new();
    let text = "p(?a, ?b) ^ q(?c) -> r(?b, ?c) .";
    let mut program = parse_rules(text, "test", &mut symbols, &prefixes()).expect("rules");
    // The third variable has a name that the syntax cannot express, and its replacement is the name of the
    // second.
    program.rules[0].variables = ["a", "_2", "c:::"].map(Into::into).to_vec();
    let printed = print_rules(&program, &symbols, &prefixes());
    let reparsed = parse_rules(&printed, "test", &mut symbols, &prefixes()).expect(&printed);
    let content = |program: &metaplan_rules::Program| {
        format!("{:?} {:?}", program.rules[0].head, program.rules[0].body)
    };
    assert_eq!(content(&program), content(&reparsed), "{printed}");
}

#[test]
fn names_that_the_syntax_cannot_express_are_replaced() {
    let mut symbols = Symbols::new();
    let text = "[a] p(?x, ?y) ^ q(?z) -> r(?x, ?y, ?z) .";
    let mut program = parse_rules(text, "test", &mut symbols, &prefixes()).expect("rules");
    program.rules[0].variables = ["x", "http://e/#y", "x"].map(Into::into).to_vec();
    program.rules[0].identity.label = Some("two\nlines [1]".into());
    let printed = print_rules(&program, &symbols, &prefixes());
    assert!(
        printed.ends_with("[two lines [1)] <p>(?_0, ?_1) ^ <q>(?_2) -> <r>(?_0, ?_1, ?_2) .\n"),
        "{printed}"
    );
    let reparsed = parse_rules(&printed, "test", &mut symbols, &prefixes()).expect(&printed);
    assert_eq!(
        (&program.rules[0].head, &program.rules[0].body),
        (&reparsed.rules[0].head, &reparsed.rules[0].body)
    );
}

fn check(rules: &str, expected: &[&str]) {
    let errors = engine(rules, "").expect_err(rules);
    let messages: Vec<String> = errors.iter().map(ToString::to_string).collect();
    assert_eq!(messages, expected);
}

#[test]
fn errors_have_codes_and_positions() {
    check(
        "?n = mean { ?x | p(?x) } -> q(?n)",
        &["test:1:6: R101 expected `count`, `sum`, `min` or `max`, found `mean`"],
    );
    check("?n = sum { p(?x) } -> q(?n)", &["test:1:13: R101 expected `|`, found `(`"]);
    check("?n(?x) -> q(?n)", &["test:1:3: R101 expected an atom, or `=` and an aggregate, found `(`"]);
    check("p(?x) ^ -> q(?x) .", &["test:1:9: R101 expected a name, found `->`"]);
    check(
        "p(?x -> q(?x) .\n\n  q(?x) -> r(?x) . s(é, $) -> t(?x) .",
        &[
            "test:3:25: R101 unexpected character `$`",
            "test:1:6: R101 expected `,` or `)`, found `->`",
            "test:3:26: R101 expected a variable, name or literal, found `)`",
        ],
    );
    check(
        "a:p(?x) -> q(?x) . b:p(?x) -> q(?x)",
        &["test:1:1: R102 undeclared prefix `a:`", "test:1:20: R102 undeclared prefix `b:`"],
    );
    check(
        "p(?x) ^ swrlb:listConcat(?x, ?x) -> q(?x)",
        &["test:1:9: R104 built-in `listConcat` works on lists, which the engine does not support"],
    );
    check(
        "p(?x) ^ swrlb:lesThan(?x, 3) -> q(?x) . p(?x) ^ swrlb:greaterthan(?x, 3) -> q(?x) . p(?x) ^ swrlb:frobnicate(?x) -> q(?x)",
        &[
            "test:1:9: R104 there is no built-in `lesThan`; did you mean `lessThan`?",
            "test:1:49: R104 there is no built-in `greaterthan`; did you mean `greaterThan`?",
            "test:1:93: R104 there is no built-in `frobnicate`",
        ],
    );
    check(
        "p(?x) ^ not swrlb:lessThen(?x, 3) -> q(?x) . p(?x) ^ not swrlb:member(?x, ?x) -> q(?x)",
        &[
            "test:1:13: R104 there is no built-in `lessThen`; did you mean `lessThan`?",
            "test:1:58: R104 built-in `member` works on lists, which the engine does not support",
        ],
    );
    check(
        "@prefix t: <http://swrl.stanford.edu/ontologies/built-ins/3.3/abox.owl#> .\nt:add(?x, ?y, 1, \"Days\") -> q(?x)",
        &[
            "test:2:1: R104 built-in <http://swrl.stanford.edu/ontologies/built-ins/3.3/abox.owl#add> belongs to a \
           library that the engine does not have",
        ],
    );
    check(
        "p(?x) -> q(\"a\\u00A0b) . c\") . p(?x) -> r(\"\\d\") .",
        &["test:1:12: R101 unknown escape in a string", "test:1:42: R101 unknown escape in a string"],
    );
    check(
        "p(?x) -> q(\"open",
        &[
            "test:1:12: R101 the closing `\"` of a string is missing",
            "test:1:17: R101 expected a variable, name or literal, found the end of the text",
        ],
    );
}

#[test]
fn unsafe_rules_are_refused_all_at_once() {
    check(
        "[a] p(?x) -> q(?y) . [b] p(?x) ^ not q(?z, ?x) -> r(?x) . [c] swrlb:lessThan(?x, 3) -> r(?x)",
        &[
            "R202 rule test#0 (a): variable ?y in the head is not bound by the body",
            "R203 rule test#1 (b): variable ?z is only tested, never bound",
            "R203 rule test#2 (c): variable ?x is only tested, never bound",
        ],
    );
    check(
        "p(?x) ^ swrlb:add(?y, ?x) -> q(?y)",
        &["R204 rule test#0: built-in add does not take 2 arguments"],
    );
    check(
        "p(?x) ^ not swrlb:lessThan(?x) -> q(?x) . p(?x) ^ not swrlb:lessThan(?x, ?y) ^ not sameAs(?x, ?z) -> q(?x)",
        &[
            "R204 rule test#0: built-in lessThan does not take 1 arguments",
            "R203 rule test#1: variable ?y is only tested, never bound",
            "R203 rule test#1: variable ?z is only tested, never bound",
        ],
    );
    check("p(?x) -> not swrlb:lessThan(?x, 3)", &["R205 rule test#0: a head may not contain a negated atom"]);
    check("p(?x) -> swrlb:lessThan(?x, 3)", &["R205 rule test#0: a head may not contain a built-in"]);
    check(
        "p(?x) ^ not q(?x) -> r(?x) . r(?x) -> q(?x)",
        &["R206 rule test#0: `not <q>` depends on its own conclusion, so the rules have no stratification"],
    );
}
