//! Built-ins in rules, by their definitions: composition and splitting of values ([1], section 8.5), URIs
//! (8.6), tokens (8.4), and the libraries `swrlm` and `temporal` ([2], [3]). Unknown built-ins are errors.
//!
//! [1] W3C Member Submission: SWRL, 2004.
//! [2] `SWRLTab` wiki: Mathematical Built-In Library.
//! [3] `SWRLTab` wiki: Temporal Built-In Library, Basic Mode.

use std::collections::BTreeSet;

use metaplan_rules::replay::replay;
use metaplan_rules::{
    Delta, Engine, Fact, Literal, Prefixes, Program, Symbols, Syntax, parse_rules_together,
};

fn parse(texts: &[(&str, &str)], symbols: &mut Symbols) -> Result<Program, Vec<String>> {
    parse_rules_together(texts, symbols, &Prefixes::new(), &Syntax::default())
        .map_err(|errors| errors.iter().map(ToString::to_string).collect())
}

/// Returns the values of `variables` under all matches of a body of built-ins, one text for each match: the
/// lexical forms, separated by `|`.
fn solutions(body: &str, variables: &str) -> Vec<String> {
    let text = format!("-> start(0) . start(?start) ^ {body} -> r({variables}) .");
    let mut symbols = Symbols::new();
    let program = parse(&[("test", &text)], &mut symbols).expect(&text);
    let engine = Engine::new(symbols, program, []).expect(&text);
    let predicate = engine.symbols().find_name("r");
    let text = |arguments: &[metaplan_rules::Symbol]| {
        let values = arguments.iter().map(|symbol| match engine.symbols().value(*symbol).as_literal() {
            Some(Literal::String(text)) => text.to_string(),
            Some(literal) => literal.lexical(),
            None => String::new(),
        });
        values.collect::<Vec<_>>().join("|")
    };
    let facts = engine.facts().filter(|fact| Some(fact.predicate) == predicate);
    facts.map(|fact| text(&fact.arguments)).collect::<BTreeSet<_>>().into_iter().collect()
}

#[test]
fn values_are_split_into_parts() {
    for (body, variables, expected) in [
        ("swrlb:date(\"2026-02-03\"^^xsd:date, ?y, ?m, ?d)", "?y, ?m, ?d", "2026|2|3"),
        ("swrlb:date(\"2026-02-03Z\"^^xsd:date, ?y, ?m, ?d, ?z)", "?y, ?m, ?d, ?z", "2026|2|3|Z"),
        ("swrlb:date(\"2026-02-03-05:30\"^^xsd:date, ?y, 2, ?d, ?z)", "?y, ?d, ?z", "2026|3|-05:30"),
        ("swrlb:date(\"2026-02-03\"^^xsd:date, ?y, ?m, ?d, ?z)", "?y, ?z", "2026|"),
        ("swrlb:date(\"-0044-03-15\"^^xsd:date, ?y, ?m, ?d)", "?y, ?m, ?d", "-44|3|15"),
        // A time zone without a part, a wrong month, and one variable for two parts.
        ("swrlb:date(\"2026-02-03Z\"^^xsd:date, ?y, ?m, ?d)", "?y", ""),
        ("swrlb:date(\"2026-02-03\"^^xsd:date, ?y, 3, ?d)", "?y", ""),
        ("swrlb:date(\"2026-02-03\"^^xsd:date, ?y, ?m, ?m)", "?y", ""),
        ("swrlb:date(\"2026-03-03\"^^xsd:date, ?y, ?m, ?m)", "?y, ?m", "2026|3"),
        ("swrlb:date(\"2026-02-03T00:00:00\"^^xsd:dateTime, ?y, ?m, ?d)", "?y", ""),
        ("swrlb:time(\"23:05:06.5\"^^xsd:time, ?h, ?m, ?s)", "?h, ?m, ?s", "23|5|6.5"),
        (
            "swrlb:dateTime(\"2026-12-31T23:59:58.25+02:00\"^^xsd:dateTime, ?y, ?mo, ?d, ?h, ?mi, ?s, ?z)",
            "?y, ?mo, ?d, ?h, ?mi, ?s, ?z",
            "2026|12|31|23|59|58.25|+02:00",
        ),
        ("swrlb:yearMonthDuration(\"P1Y14M\"^^xsd:duration, ?y, ?m)", "?y, ?m", "2|2"),
        ("swrlb:yearMonthDuration(\"P1Y14M\"^^xsd:duration, 1, ?m)", "?m", ""),
        ("swrlb:yearMonthDuration(\"-P1Y2M\"^^xsd:duration, ?y, ?m)", "?y, ?m", "-1|-2"),
        ("swrlb:yearMonthDuration(\"P1Y2D\"^^xsd:duration, ?y, ?m)", "?y", ""),
        (
            "swrlb:dayTimeDuration(\"P3DT10H30M1.5S\"^^xsd:duration, ?d, ?h, ?m, ?s)",
            "?d, ?h, ?m, ?s",
            "3|10|30|1.5",
        ),
        ("swrlb:dayTimeDuration(\"-PT90M\"^^xsd:duration, ?d, ?h, ?m, ?s)", "?d, ?h, ?m, ?s", "0|-1|-30|0"),
        // Composition, then splitting.
        (
            "swrlb:dayTimeDuration(?p, 0, -1, -30, 0) ^ swrlb:dayTimeDuration(?p, ?d, ?h, ?m, ?s)",
            "?h, ?m",
            "-1|-30",
        ),
        ("swrlb:date(?x, 2026, 2, 30) ^ swrlb:date(?x, ?y, ?m, ?d)", "?y", ""),
    ] {
        assert_eq!(solutions(body, variables).join(" "), expected, "{body}");
    }
}

#[test]
fn uris_are_composed_and_split_and_tokens_enumerated() {
    let uri = "\"http://example.org:8080/a/b?q=1#top\"^^xsd:anyURI";
    for (body, variables, expected) in [
        (
            "swrlb:anyURI(?r, \"http\", \"example.org\", 8080, \"/a/b\", \"q=1\", \"top\")",
            "?r",
            "http://example.org:8080/a/b?q=1#top",
        ),
        ("swrlb:anyURI(?r, \"http\", \"example.org\", \"\", \"/\", \"\", \"\")", "?r", "http://example.org/"),
        ("swrlb:anyURI(?r, \"mailto\", \"\", \"\", \"a@b.org\", \"\", \"\")", "?r", "mailto:a@b.org"),
        // An invalid scheme, and a part that would be parsed as two.
        ("swrlb:anyURI(?r, \"1\", \"e.org\", \"\", \"\", \"\", \"\")", "?r", ""),
        ("swrlb:anyURI(?r, \"http\", \"e.org\", \"\", \"/a?b\", \"\", \"\")", "?r", ""),
        (
            &format!("swrlb:anyURI({uri}, ?s, ?h, ?p, ?path, ?q, ?f)"),
            "?s, ?h, ?p, ?path, ?q, ?f",
            "http|example.org|8080|/a/b|q=1|top",
        ),
        (&format!("swrlb:anyURI({uri}, \"http\", ?h, \"8080\", ?path, ?q, \"top\")"), "?h", "example.org"),
        (&format!("swrlb:anyURI({uri}, \"https\", ?h, ?p, ?path, ?q, ?f)"), "?h", ""),
        // RFC 3986, section 5.4.
        ("swrlb:resolveURI(?r, \"../g\", \"http://a/b/c/d;p?q\")", "?r", "http://a/b/g"),
        ("swrlb:resolveURI(?r, \"?y\", \"http://a/b/c/d;p?q\")", "?r", "http://a/b/c/d;p?y"),
        ("swrlb:resolveURI(?r, \"//g\", \"http://a/b/c/d;p?q\")", "?r", "http://g"),
        ("swrlb:resolveURI(?r, \"g\", \"not a base\")", "?r", ""),
        (
            "swrlb:resolveURI(\"http://a/g\"^^xsd:anyURI, \"g\", \"http://a/\") ^ swrlb:add(?r, 1, 1)",
            "?r",
            "2",
        ),
        ("swrlb:tokenize(?r, \"a;b;;a\", \";\")", "?r", " a b"),
        ("swrlb:tokenize(?r, \"one, two\", \",\\\\s*\")", "?r", "one two"),
        ("swrlb:tokenize(?r, \"1X2x3\", \"x\", \"i\")", "?r", "1 2 3"),
        ("swrlb:tokenize(\"b\", \"a;b\", \";\") ^ swrlb:add(?r, 1, 1)", "?r", "2"),
        ("swrlb:tokenize(\"c\", \"a;b\", \";\") ^ swrlb:add(?r, 1, 1)", "?r", ""),
        ("swrlb:tokenize(?r, \"\", \";\")", "?r", ""),
        ("swrlb:tokenize(?r, \"ab\", \";*\")", "?r", ""),
    ] {
        assert_eq!(solutions(body, variables).join(" "), expected, "{body}");
    }
}

#[test]
fn mathematical_expressions_are_evaluated() {
    for (body, expected) in [
        ("swrlm:sqrt(?r, 16)", "4.0E0"),
        ("swrlm:sqrt(?r, -1)", ""),
        ("swrlm:log(?r, 1)", "0.0E0"),
        ("swrlb:add(?x, 1, 1) ^ swrlb:add(?y, 2, 2) ^ swrlm:eval(?r, \"(58 * x) / y\", ?x, ?y)", "2.9E1"),
        ("swrlb:add(?x, 1, 1) ^ swrlm:eval(?r, \"2x^2 - 3(x + 1)\", ?x)", "-1.0E0"),
        ("swrlm:eval(?r, \"-2^2 + sqrt(9) + ln(e) + log(100) + abs(-1) + mod(7, 4)\")", "6.0E0"),
        ("swrlm:eval(?r, \"1.5e1 % 4\")", "3.0E0"),
        ("swrlm:eval(?r, \"2 ^ 3 ^ 2\")", "5.12E2"),
        ("swrlm:eval(?r, \"a, b: a - b\", 3, 1)", "2.0E0"),
        ("swrlm:eval(?r, \"1 / 0\")", ""),
        ("swrlm:eval(?r, \"unknown + 1\")", ""),
        ("swrlm:eval(?r, \"1 +\")", ""),
        ("swrlm:eval(?r, \"(1\")", ""),
        ("swrlm:eval(4.0e0, \"2 + 2\") ^ swrlb:add(?r, 0, 1)", "1"),
    ] {
        assert_eq!(solutions(body, "?r").join(" "), expected, "{body}");
    }
    let deep = format!("swrlm:eval(?r, \"{}1{}\")", "(".repeat(100_000), ")".repeat(100_000));
    assert_eq!(solutions(&deep, "?r"), [""; 0]);
}

/// The calculations exceed 64 bits.
#[test]
fn extreme_moments_have_no_result() {
    for body in [
        "temporal:duration(?r, \"290000000-01-01T00:00:00\", \"-290000000-01-01T00:00:00\", \"Milliseconds\")",
        "swrlb:addDayTimeDurationToDate(?r, \"1970-01-01\"^^xsd:date, \
         \"-PT9223372036854775808S\"^^xsd:dayTimeDuration)",
        "swrlb:addDayTimeDurationToDateTime(?m, \"1970-01-01T00:00:00-14:00\"^^xsd:dateTime, \
         \"PT9223372036854775000S\"^^xsd:dayTimeDuration) ^ temporal:duration(?r, ?m, ?m, \"Days\")",
        "swrlb:add(?r, 1, 1) ^ temporal:meets(\"292278994-08-17T07:12:55.807\", \"292278994-08-17T07:12:55.807\")",
    ] {
        assert_eq!(solutions(body, "?r"), [""; 0], "{body}");
    }
}

#[test]
fn temporal_functions_compute_moments_and_durations() {
    for (body, expected) in [
        ("temporal:duration(?r, \"1999-11-01\", \"2000-02-01\", \"Months\")", "3"),
        ("temporal:duration(?r, \"2000-02-01\", \"1999-11-01\", \"months\")", "3"),
        ("temporal:duration(?r, \"1999-12-31\"^^xsd:date, \"2000-01-01\"^^xsd:date, \"Years\")", "1"),
        ("temporal:duration(?r, \"1998-12-02T12\", \"1998-12-02T13:30\", \"Minutes\")", "90"),
        ("temporal:duration(?r, \"1998\", \"1998-12-02\", \"Years\")", "0"),
        ("temporal:duration(?r, \"2026-01-01T00:00:00Z\", \"2026-01-01T00:00:00+01:00\", \"Hours\")", "1"),
        ("temporal:duration(?r, \"2026-01-01T00:00:00Z\", \"2026-01-01T00:00:00\", \"Hours\")", ""),
        ("temporal:duration(?r, \"now\", \"2026-01-01\", \"Days\")", ""),
        ("temporal:duration(?r, \"2026-01-01\", \"2026-01-01\", \"Weeks\")", ""),
        ("temporal:add(?r, \"1999-11-01T10:00:00\"^^xsd:dateTime, 3, \"Months\")", "2000-02-01T10:00:00"),
        ("temporal:add(?r, \"1999-11-01\", -1, \"Days\")", "1999-10-31T00:00:00"),
        ("temporal:add(?r, \"2026-01-31\"^^xsd:date, 1, \"Months\")", "2026-02-28"),
        ("temporal:add(?r, \"2026-01-31\"^^xsd:date, 90, \"Minutes\")", "2026-01-31T01:30:00"),
        ("temporal:add(?r, \"2026-01-31T00:00:00\", 1500, \"Milliseconds\")", "2026-01-31T00:00:01.5"),
        ("temporal:add(?r, \"2026-01-31\", 1.5, \"Days\")", ""),
    ] {
        assert_eq!(solutions(body, "?r").join(" "), expected, "{body}");
    }
}

#[test]
fn temporal_relations_compare_granules() {
    let holds = |body: &str| !solutions(body, "?start").is_empty();
    let [early, late, later] = ["\"2026-01-01T10:00\"", "\"2026-01-01T12:00\"", "\"2026-01-02\""];
    for (relation, arguments, expected) in [
        ("before", format!("{early}, {late}"), true),
        ("before", format!("{early}, {late}, \"Days\""), false),
        ("notBefore", format!("{early}, {late}, \"Days\""), true),
        ("equals", format!("{early}, {late}, \"Days\""), true),
        ("equals", format!("{early}, {late}"), false),
        ("after", format!("{late}, {early}, \"Hours\""), true),
        ("meets", format!("{early}, {later}, \"Days\""), true),
        ("metBy", format!("{later}, {early}, \"Days\""), true),
        ("meets", format!("{early}, {later}"), false),
        ("during", format!("{late}, {early}, {later}"), true),
        ("during", format!("{early}, {late}, {later}"), false),
        ("contains", format!("{early}, {late}, {later}"), false),
        ("starts", format!("{early}, {early}, {later}"), true),
        ("finishes", format!("{later}, {early}, {later}"), true),
        ("intersects", format!("{late}, {early}, {later}"), true),
        ("notIntersects", format!("{early}, {late}, {later}"), true),
        // A period that ends before it begins is invalid. For invalid arguments, neither a relation nor its
        // negation holds.
        ("during", format!("{late}, {later}, {early}"), false),
        ("notDuring", format!("{late}, {later}, {early}"), false),
        ("notBefore", format!("{late}, \"soon\""), false),
        ("durationLessThan", format!("1, {early}, {late}, \"Hours\""), true),
        ("durationLessThan", format!("2, {early}, {late}, \"Hours\""), false),
        ("durationEqualTo", format!("2, {early}, {late}, \"Hours\""), true),
        ("durationGreaterThan", format!("3, {early}, {late}, \"Hours\""), true),
        ("durationGreaterThanOrEqualTo", format!("2, {early}, {late}, \"Hours\""), true),
        ("notDurationLessThanOrEqualTo", format!("3, {early}, {late}, \"Hours\""), true),
    ] {
        let body = format!("temporal:{relation}({arguments})");
        assert_eq!(holds(&body), expected, "{body}");
    }
}

#[test]
fn unknown_built_ins_are_errors() {
    let check = |text: &str, expected: &[&str]| {
        let texts = [("other", "p(?x) -> <urn:known>(?x, 1, 2)"), ("test", text)];
        let errors = parse(&texts, &mut Symbols::new()).err().unwrap_or_default();
        assert_eq!(errors, expected, "{text}");
    };
    let unknown = |at: &str, name: &str, count: usize| {
        format!(
            "test:{at}: R104 <{name}> with {count} arguments is not a class, a property or anything that a rule concludes, \
             and a built-in of this name is not known"
        )
    };
    check("p(?x) ^ <urn:my#add>(?y, ?x, 1) -> q(?y)", &[&unknown("1:9", "urn:my#add", 3)]);
    check("p(?x) ^ <urn:my#even>(4) -> q(?x)", &[&unknown("1:9", "urn:my#even", 1)]);
    check("p(?x) ^ not <urn:my#odd>(?x, ?x, ?x) -> q(?x)", &[&unknown("1:13", "urn:my#odd", 3)]);
    check("0 = count { <urn:my#odd>(?x, ?x, ?x) } -> q(?x)", &[&unknown("1:13", "urn:my#odd", 3)]);
    check("p(?x) ^ flag() -> q(?x)", &[&unknown("1:9", "flag", 0)]);
    // A rule derives the relation, in this text or in another one.
    check("p(?x) -> t(?x, 1, 2) . t(?x, ?y, ?z) -> q(?x)", &[]);
    check("<urn:known>(?x, ?y, ?z) -> q(?x)", &[]);
    check("p(?x) ^ r(?x, 1) -> q(?x)", &[]);
    let foreign = "http://sqwrl.stanford.edu/ontologies/built-ins/3.4/sqwrl.owl#select";
    let message =
        format!("test:1:9: R104 built-in <{foreign}> belongs to a library that the engine does not have");
    check(&format!("p(?x) ^ <{foreign}>(?x) -> q(?x)"), &[&message]);
    let library = "http://swrl.stanford.edu/ontologies/built-ins/3.4/temporal.owl#";
    check(&format!("p(?x) ^ <{library}before>(?x, ?x) -> q(?x)"), &[]);
    let message =
        format!("test:1:9: R104 built-in <{library}soon> belongs to a library that the engine does not have");
    check(&format!("p(?x) ^ <{library}soon>(?x) -> q(?x)"), &[&message]);
    let suggestion = "http://swrl.stanford.edu/ontologies/built-ins/3.3/temporal.owl#before";
    let message = format!(
        "test:1:9: R104 built-in <{library}befor> belongs to a library that the engine does not have; did you mean `{suggestion}`?"
    );
    check(&format!("p(?x) ^ <{library}befor>(?x, ?x) -> q(?x)"), &[&message]);
}

#[test]
fn parts_and_tokens_follow_changes() {
    let rules = "said(?x, ?text) ^ swrlb:tokenize(?word, ?text, \" \") -> word(?x, ?word) .
        born(?x, ?date) ^ swrlb:date(?date, ?year, ?month, ?day) ^ swrlb:lessThan(?month, 7) -> early(?x, ?year) .";
    let mut symbols = Symbols::new();
    let program = parse(&[("test", rules)], &mut symbols).expect("rules");
    let date = |text: &str| Literal::parse(text, Some("http://www.w3.org/2001/XMLSchema#date"), None);
    let mut fact = |predicate: &str, literal: Literal| {
        Fact::new(symbols.name(predicate), [symbols.name("i"), symbols.literal(literal)])
    };
    let (short, long) = (fact("said", Literal::string("a b")), fact("said", Literal::string("b c d")));
    let (spring, autumn) = (fact("born", date("2001-03-04")), fact("born", date("2002-10-04")));
    let [a, b, c] = ["a", "b", "c"].map(|word| fact("word", Literal::string(word)));
    let [in_2001, in_2002] = [2001, 2002].map(|year| fact("early", Literal::integer(year)));
    let mut engine = Engine::new(symbols, program, [short.clone(), autumn.clone()]).expect("safe");
    let check = |engine: &Engine, holds: &[&Fact], fails: &[&Fact]| {
        assert!(holds.iter().all(|fact| engine.holds(fact) && engine.why(fact).is_some()));
        for fact in fails {
            assert!(!engine.holds(fact) && !engine.why_not(fact).is_empty());
        }
        let stated: Vec<Fact> = engine.facts().filter(|fact| engine.is_asserted(fact)).collect();
        let derived = engine.facts().count() - stated.len();
        let mut symbols = engine.symbols().clone();
        let replayed = replay(engine.program(), &mut symbols, &stated, &engine.everything());
        assert_eq!(replayed.expect("what holds").derived, derived);
    };
    check(&engine, &[&a, &b], &[&c, &in_2001, &in_2002]);
    engine.apply(Delta { insert: vec![long.clone(), spring.clone()], delete: Vec::new() }).expect("it ends");
    check(&engine, &[&a, &b, &c, &in_2001], &[&in_2002]);
    engine.apply(Delta { insert: Vec::new(), delete: vec![short, spring] }).expect("it ends");
    check(&engine, &[&b, &c], &[&a, &in_2001]);
    engine.apply(Delta { insert: Vec::new(), delete: vec![long, autumn] }).expect("it ends");
    check(&engine, &[], &[&a, &b, &c]);
}
