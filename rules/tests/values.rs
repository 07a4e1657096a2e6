//! Literals as values, and built-ins on them.

use crate::text::literal;
use metaplan_rules::{BuiltIn, Literal};

/// Checks the relation of two literals: `=` identical; `<` and `>` ordered; `~` equal in order but not
/// identical; `#` incomparable.
fn check(left: &str, relation: &str, right: &str) {
    let (a, b) = (literal(left), literal(right));
    let order = a.compare(&b);
    let actual = match order {
        Some(std::cmp::Ordering::Less) => "<",
        Some(std::cmp::Ordering::Greater) => ">",
        Some(std::cmp::Ordering::Equal) if a == b => "=",
        Some(std::cmp::Ordering::Equal) => "~",
        None => "#",
    };
    assert_eq!(actual, relation, "{left} {relation} {right}");
    assert_eq!(b.compare(&a), order.map(std::cmp::Ordering::reverse), "{left} {relation} {right}");
}

#[test]
fn values_compare_as_defined_by_xsd() {
    for (left, relation, right) in [
        ("1.50", "=", "\"1.5\"^^xsd:decimal"),
        ("5", "=", "\"5.0\"^^xsd:decimal"),
        ("\"5\"^^xsd:unsignedByte", "=", "\"+05\"^^xsd:long"),
        ("\"1e-05\"^^xsd:decimal", "=", "0.00001"),
        ("0.1000000000000000000001", "<", "0.1000000000000000000002"),
        ("-7", "<", "0.5"),
        ("99999999999999999999", ">", "1.5"),
        ("\"0.1\"^^xsd:float", ">", "\"0.1\"^^xsd:double"),
        ("0.1", "~", "\"0.1\"^^xsd:float"),
        ("2", "~", "2e0"),
        ("2.5e0", ">", "2"),
        ("\"INF\"^^xsd:double", ">", "1e308"),
        ("\"NaN\"^^xsd:double", "#", "\"NaN\"^^xsd:double"),
        ("\"-0.0\"^^xsd:double", "~", "0e0"),
        ("\"a\"", "=", "\"a\"^^xsd:string"),
        ("\"a\"", "=", "\"a@\"^^rdf:PlainLiteral"),
        ("\"a\"@EN", "=", "\"a@en\"^^rdf:PlainLiteral"),
        ("\"a\"@en", "#", "\"a\""),
        ("\"10\"", "<", "\"9\""),
        ("\"10\"", "#", "9"),
        ("\"0\"^^xsd:boolean", "=", "false"),
        ("false", "#", "\"false\""),
        ("false", "<", "true"),
        ("\"x\"^^<urn:d>", "=", "\"x\"^^<urn:d>"),
        ("\"x\"^^<urn:d>", "#", "\"y\"^^<urn:d>"),
        ("\"inf\"^^xsd:decimal", "#", "\"inf\"^^xsd:decimal"),
        ("\"2026-01-31T12:00:00Z\"^^xsd:dateTime", "~", "\"2026-01-31T14:00:00+02:00\"^^xsd:dateTime"),
        ("\"2026-01-31T12:00:00Z\"^^xsd:dateTime", "=", "\"2026-01-31T12:00:00-00:00\"^^xsd:dateTime"),
        ("\"2026-01-31T12:00:00Z\"^^xsd:dateTime", "#", "\"2026-01-31T12:00:00\"^^xsd:dateTime"),
        ("\"2026-01-31T12:00:00Z\"^^xsd:dateTime", "<", "\"2026-02-02T12:00:00\"^^xsd:dateTime"),
        ("\"2024-02-29\"^^xsd:date", "<", "\"2024-03-01\"^^xsd:date"),
        ("\"-0001-12-31\"^^xsd:date", "<", "\"0001-01-01\"^^xsd:date"),
        ("\"23:59:59.5\"^^xsd:time", ">", "\"23:59:59\"^^xsd:time"),
        ("\"24:00:00\"^^xsd:time", "=", "\"00:00:00\"^^xsd:time"),
        ("\"24:00:00Z\"^^xsd:time", "=", "\"00:00:00Z\"^^xsd:time"),
        ("\"24:00:00\"^^xsd:time", "<", "\"23:59:59\"^^xsd:time"),
        ("\"P1Y\"^^xsd:duration", "=", "\"P12M\"^^xsd:yearMonthDuration"),
        ("\"P1D\"^^xsd:duration", "=", "\"PT24H\"^^xsd:dayTimeDuration"),
        ("\"-P1M\"^^xsd:duration", "<", "\"PT1.5S\"^^xsd:duration"),
        ("\"P27D\"^^xsd:duration", "<", "\"P1M\"^^xsd:duration"),
        ("\"P30D\"^^xsd:duration", "#", "\"P1M\"^^xsd:duration"),
        ("\"P32D\"^^xsd:duration", ">", "\"P1M\"^^xsd:duration"),
        ("\"P400Y\"^^xsd:duration", "#", "\"P146097D\"^^xsd:duration"),
        ("\"a b\"^^xsd:anyURI", "=", "\" a \t b\"^^xsd:anyURI"),
        ("\"-0000\"^^xsd:gYear", "=", "\"0000\"^^xsd:gYear"),
        ("\"-0000-02Z\"^^xsd:gYearMonth", "=", "\"0000-02Z\"^^xsd:gYearMonth"),
        ("\"-00001\"^^xsd:gYear", "#", "\"00001\"^^xsd:gYear"),
    ] {
        check(left, relation, right);
    }
}

#[test]
fn forbidden_lexical_forms_are_ill_typed() {
    for text in [
        "\"False\"^^xsd:boolean",
        "\"None\"^^xsd:decimal",
        "\"1.0\"^^xsd:integer",
        "\"256\"^^xsd:unsignedByte",
        "\"-1\"^^xsd:nonNegativeInteger",
        "\"1e999999999\"^^xsd:decimal",
        "\"\"^^xsd:decimal",
        "\"-\"^^xsd:integer",
        "\"inf\"^^xsd:double",
        "\"2023-02-29\"^^xsd:date",
        "\"25:00:00\"^^xsd:time",
        "\"P\"^^xsd:duration",
        "\"2026-01-01T00:00:00é\"^^xsd:dateTime",
        "\"P1M\"^^xsd:dayTimeDuration",
        "\"P0M1D\"^^xsd:dayTimeDuration",
        "\"12345678901-02-29T00:00:00Z\"^^xsd:dateTime",
        "\"012345678901-02-28\"^^xsd:date",
        "\"P99999999999999999999YM\"^^xsd:duration",
        "\"PT1e5S\"^^xsd:duration",
        "\"PT1.S\"^^xsd:duration",
        "\"PT.5S\"^^xsd:duration",
        "\"+15:00\"^^xsd:time",
    ] {
        assert!(literal(text).is_ill_typed(), "{text}");
    }
}

#[test]
fn values_of_unknown_datatypes_have_no_limits() {
    for text in [
        "\"1/3\"^^<http://www.w3.org/2002/07/owl#rational>",
        "\"x\"^^<urn:d>",
        "\"a:b\"^^xsd:QName",
        "\"x\"^^xsd:date",
        "1",
    ] {
        assert!(!literal(text).exceeds_limits(), "{text}");
    }
}

/// Such values are valid, but unknown: neither in nor outside of other datatypes.
#[test]
fn values_beyond_the_limits_are_undecided() {
    for text in [
        "\"12345678901-01-01T00:00:00Z\"^^xsd:dateTime",
        "\"-12345678901-01-01T00:00:00\"^^xsd:dateTime",
        "\"12345678904-02-29\"^^xsd:date",
        "\"P99999999999999999999Y\"^^xsd:duration",
        "\"-P99999999999999999999DT1.5S\"^^xsd:dayTimeDuration",
    ] {
        let value = literal(text);
        assert!(!value.is_ill_typed() && value.exceeds_limits(), "{text}");
        assert_eq!(value.membership(value.datatype()), Some(true), "{text}");
        assert_eq!(value.membership("http://www.w3.org/2001/XMLSchema#integer"), None, "{text}");
    }
}

#[test]
fn canonical_forms_read_back() {
    for text in [
        "1.50",
        "-0.05",
        "12345678901234567890.5",
        "\"1e22\"^^xsd:decimal",
        "1.5e-7",
        "\"INF\"^^xsd:float",
        "true",
        "\"a\\\"\\n\\\\\"",
        "\"x\"@en",
        "\"2026-01-31T23:30:00.25-01:00\"^^xsd:dateTime",
        "\"0004-02-29\"^^xsd:date",
        "\"-P1Y2M\"^^xsd:duration",
        "\"P1DT2H3M4.5S\"^^xsd:duration",
        "\"-PT0.5S\"^^xsd:duration",
        "\"u:x\"^^xsd:anyURI",
    ] {
        assert_eq!(literal(&literal(text).to_string()), literal(text), "{text}");
    }
    assert_eq!(literal("2.50").to_string(), "\"2.5\"^^<http://www.w3.org/2001/XMLSchema#decimal>");
    assert_eq!(literal("2.0").to_string(), "\"2\"^^<http://www.w3.org/2001/XMLSchema#integer>");
    assert_eq!(literal("25e0").to_string(), "\"2.5E1\"^^<http://www.w3.org/2001/XMLSchema#double>");
}

fn values(arguments: &str) -> Vec<Literal> {
    arguments.split(' ').filter(|text| !text.is_empty()).map(literal).collect()
}

#[test]
fn functions_compute_results() {
    for (name, arguments, expected) in [
        ("add", "1.5 2 0.25", Some("3.75")),
        ("add", "0.1 0.2e0", Some("\"0.30000000000000004\"^^xsd:double")),
        ("subtract", "1 1.5", Some("-0.5")),
        ("multiply", "0.5 0.5", Some("0.25")),
        ("divide", "1 4", Some("0.25")),
        ("divide", "1 3", Some("0.3333333333333333333333333333333333")),
        ("divide", "1 0", None),
        ("divide", "1e0 0", Some("\"INF\"^^xsd:double")),
        ("integerDivide", "-7 2", Some("-3")),
        ("integerDivide", "-7e0 2", Some("-3")),
        ("integerDivide", "7 \"INF\"^^xsd:float", Some("0")),
        ("integerDivide", "7e0 0", None),
        ("mod", "-7 2", Some("-1")),
        ("mod", "1.5 0.4", Some("0.3")),
        ("pow", "2 10", Some("1024")),
        ("pow", "2 -1", Some("0.5")),
        ("pow", "2 1000000000", None),
        ("pow", "4 0.5", Some("2e0")),
        ("unaryMinus", "3", Some("-3")),
        ("abs", "-3.5", Some("3.5")),
        ("ceiling", "-1.5", Some("-1")),
        ("floor", "-1.5", Some("-2")),
        ("round", "2.5", Some("3")),
        ("round", "-2.5", Some("-2")),
        ("round", "0.49999999999999994e0", Some("0e0")),
        ("round", "-2.5e0", Some("-2e0")),
        ("round", "4503599627370497e0", Some("4503599627370497e0")),
        ("round", "-0.5e0", Some("-0e0")),
        ("roundHalfToEven", "2.5", Some("2")),
        ("roundHalfToEven", "-0.5e0", Some("-0e0")),
        ("roundHalfToEven", "1e300 20", Some("1e300")),
        ("roundHalfToEven", "1e10 300", Some("1e10")),
        ("roundHalfToEven", "1.115e0 2", Some("1.11e0")),
        ("roundHalfToEven", "\"1.115\"^^xsd:float 2", Some("\"1.12\"^^xsd:float")),
        ("roundHalfToEven", "3e-320 320", Some("3e-320")),
        ("roundHalfToEven", "1.5e300 -300", Some("2e300")),
        ("roundHalfToEven", "\"-INF\"^^xsd:double 2", Some("\"-INF\"^^xsd:double")),
        ("roundHalfToEven", "\"NaN\"^^xsd:float", Some("\"NaN\"^^xsd:float")),
        ("roundHalfToEven", "1.005 2", Some("1")),
        ("roundHalfToEven", "150 -2", Some("200")),
        ("sin", "0", Some("0e0")),
        ("booleanNot", "true", Some("false")),
        ("booleanNot", "\"true\"", None),
        ("add", "1 \"a\"", None),
        ("stringConcat", "\"a\" \"b\" 1", Some("\"ab1\"")),
        ("substring", "\"motör\" 4", Some("\"ör\"")),
        ("substring", "\"12345\" 0 3", Some("\"12\"")),
        ("substring", "\"12345\" 0.49999999999999994e0 2", Some("\"1\"")),
        ("stringLength", "\"motör\"", Some("5")),
        ("upperCase", "\"aé\"", Some("\"AÉ\"")),
        ("lowerCase", "\"AÉ\"", Some("\"aé\"")),
        ("translate", "\"bar\" \"abc\" \"AB\"", Some("\"BAr\"")),
        ("substringBefore", "\"a=b\" \"=\"", Some("\"a\"")),
        ("substringAfter", "\"a=b\" \"=\"", Some("\"b\"")),
        ("substringAfter", "\"ab\" \"=\"", Some("\"\"")),
        ("replace", "\"abab\" \"(a)b\" \"$1-\"", Some("\"a-a-\"")),
        ("replace", "\"aXb\" \"x\" \"\\\\$\" \"i\"", Some("\"a$b\"")),
        ("replace", "\"ab\" \"x*\" \"y\"", None),
        ("replace", "\"ab\" \"(\" \"y\"", None),
    ] {
        let arguments = values(arguments);
        let built_in = BuiltIn::from_name(name).expect(name);
        let result = built_in.compute(&arguments.iter().collect::<Vec<_>>());
        assert_eq!(result, expected.map(literal), "{name} {arguments:?}");
    }
}

/// Parses a value written as `kind:lexical` for a date, time or duration, and otherwise as rule text.
fn temporal(text: &str) -> Literal {
    let (kind, lexical) = text.split_once(':').unwrap_or(("", text));
    let datatype = match kind {
        "dt" => "dateTime",
        "d" => "date",
        "t" => "time",
        "p" => "duration",
        _ => return literal(text),
    };
    literal(&format!("\"{lexical}\"^^xsd:{datatype}"))
}

#[test]
fn functions_of_moments_and_durations_compute_results() {
    for (name, arguments, expected) in [
        ("yearMonthDuration", "1 14", Some("p:P2Y2M")),
        ("dayTimeDuration", "1 2 3 4.5", Some("p:P1DT2H3M4.5S")),
        ("dayTimeDuration", "1 2 -3 4.5", None),
        ("dateTime", "2026 2 3 4 5 6.5", Some("dt:2026-02-03T04:05:06.5")),
        ("dateTime", "2026 2 3 4 5 6 \"+02:00\"", Some("dt:2026-02-03T04:05:06+02:00")),
        ("dateTime", "2026 2 30 4 5 6", None),
        ("date", "2026 2 3 \"Z\"", Some("d:2026-02-03Z")),
        ("time", "4 5 6", Some("t:04:05:06")),
        ("addYearMonthDurations", "p:P1Y p:P2M", Some("p:P1Y2M")),
        ("addYearMonthDurations", "p:P1Y p:P2D", None),
        ("subtractYearMonthDurations", "p:P1Y p:P2M", Some("p:P10M")),
        ("multiplyYearMonthDuration", "p:P1Y 1.5", Some("p:P1Y6M")),
        ("multiplyYearMonthDuration", "p:P1M 0.5", Some("p:P1M")),
        ("divideYearMonthDurations", "p:P1Y 5", Some("p:P2M")),
        ("divideYearMonthDurations", "p:P1Y 0", None),
        ("addDayTimeDurations", "p:PT1H p:P1D", Some("p:P1DT1H")),
        ("subtractDayTimeDurations", "p:PT1H p:P1D", Some("p:-PT23H")),
        ("multiplyDayTimeDurations", "p:PT1H 2.5", Some("p:PT2H30M")),
        ("divideDayTimeDuration", "p:PT1H 4", Some("p:PT15M")),
        ("subtractDates", "d:2026-03-01 d:2026-02-01", Some("p:P28D")),
        ("addDayTimeDurationToDateTime", "dt:2026-03-01T00:00:00 p:PT99999999999999999999S", None),
        ("subtractDates", "d:2026-03-01 d:2026-02-01Z", None),
        ("subtractTimes", "t:01:00:00 t:02:30:00", Some("p:-PT1H30M")),
        ("addYearMonthDurationToDateTime", "dt:2026-01-31T10:00:00 p:P1M", Some("dt:2026-02-28T10:00:00")),
        (
            "subtractYearMonthDurationFromDateTime",
            "dt:2024-02-29T10:00:00Z p:P1Y",
            Some("dt:2023-02-28T10:00:00Z"),
        ),
        ("addDayTimeDurationToDateTime", "dt:2026-12-31T23:59:59.5 p:PT1S", Some("dt:2027-01-01T00:00:00.5")),
        (
            "subtractDayTimeDurationFromDateTime",
            "dt:2026-01-01T00:00:00 p:PT0.5S",
            Some("dt:2025-12-31T23:59:59.5"),
        ),
        ("addYearMonthDurationToDate", "d:2026-11-30 p:P3M", Some("d:2027-02-28")),
        ("subtractYearMonthDurationFromDate", "d:2026-01-30 p:P1Y", Some("d:2025-01-30")),
        ("addDayTimeDurationToDate", "d:2026-02-28 p:P1DT5H", Some("d:2026-03-01")),
        ("subtractDayTimeDurationFromDate", "d:2026-03-01 p:PT1H", Some("d:2026-02-28")),
        ("addDayTimeDurationToTime", "t:23:30:00 p:PT1H", Some("t:00:30:00")),
        ("subtractDayTimeDurationFromTime", "t:00:30:00 p:PT1H", Some("t:23:30:00")),
        ("addDayTimeDurationToTime", "t:23:30:00 p:P1M", None),
        ("addDayTimeDurationToTime", "d:2026-01-01 p:PT1H", None),
        (
            "subtractDateTimesYieldingYearMonthDuration",
            "dt:2026-03-01T00:00:00 dt:2025-02-02T00:00:00",
            Some("p:P1Y"),
        ),
        (
            "subtractDateTimesYieldingYearMonthDuration",
            "dt:2025-02-02T00:00:00 dt:2026-03-02T00:00:00",
            Some("p:-P1Y1M"),
        ),
        (
            "subtractDateTimesYieldingYearMonthDuration",
            "dt:2026-03-01T00:30:00+01:00 dt:2026-02-01T00:00:00Z",
            Some("p:P0M"),
        ),
        (
            "subtractDateTimesYieldingYearMonthDuration",
            "dt:2026-02-28T23:30:00-01:00 dt:2026-02-01T00:00:00Z",
            Some("p:P1M"),
        ),
        (
            "subtractDateTimesYieldingDayTimeDuration",
            "dt:2026-03-01T00:00:00Z dt:2026-02-28T12:00:00Z",
            Some("p:PT12H"),
        ),
    ] {
        let arguments: Vec<Literal> = arguments.split(' ').map(temporal).collect();
        let built_in = BuiltIn::from_name(name).expect(name);
        let result = built_in.compute(&arguments.iter().collect::<Vec<_>>());
        assert_eq!(result, expected.map(temporal), "{name} {arguments:?}");
    }
}

#[test]
fn tests_hold_or_fail() {
    for (name, arguments, expected) in [
        ("equal", "2 2e0", true),
        ("equal", "2 \"2\"", false),
        ("notEqual", "2 3", true),
        ("notEqual", "2 \"2\"", true),
        ("lessThan", "0.5 0.5", false),
        ("lessThanOrEqual", "0.5 0.50", true),
        ("greaterThan", "\"b\" \"a\"", true),
        ("greaterThanOrEqual", "\"NaN\"^^xsd:double 0", false),
        ("startsWith", "\"ab\" \"a\"", true),
        ("endsWith", "\"ab\" \"a\"", false),
        ("containsIgnoreCase", "\"aBc\" \"Bc\"", true),
        ("containsIgnoreCase", "\"ΟΔΟΣΑ\" \"ΟΔΟΣ\"", true),
        ("stringEqualIgnoreCase", "\"ΟΔΟΣ\" \"οδος\"", true),
        ("contains", "\"aBc\" \"bc\"", false),
        ("stringEqualIgnoreCase", "\"FALSE\" \"false\"", true),
        ("matches", "\"c_thruster_1\" \"^c_[a-z]+_[0-9]$\"", true),
        ("matches", "\"ABC\" \"b\"", false),
        ("matches", "\"ABC\" \"b\" \"i\"", true),
        ("matches", "\"ABC\" \"(\"", false),
        ("matches", "\"a#c\" \"a#q\" \"x\"", false),
        ("matches", "\"a#c\" \"^[#a]#c$\" \"x\"", true),
        ("matches", "1 \"1\"", false),
        ("add", "3 1 2", true),
        ("add", "3 1 1", false),
        ("lessThan", "1", false),
    ] {
        let arguments = values(arguments);
        let built_in = BuiltIn::from_name(name).expect(name);
        assert_eq!(built_in.holds(&arguments.iter().collect::<Vec<_>>()), expected, "{name} {arguments:?}");
    }
}

#[test]
fn value_spaces_contain_their_values() {
    let xsd = |local: &str| format!("http://www.w3.org/2001/XMLSchema#{local}");
    for (text, datatypes, others) in [
        ("5", "decimal integer byte unsignedByte", "negativeInteger float double string boolean"),
        ("1.5", "decimal", "integer double"),
        ("-1", "integer negativeInteger", "unsignedByte"),
        ("1.5e0", "double", "decimal float"),
        ("\"5\"", "string token", "integer anyURI"),
        ("\" a\"", "string normalizedString", "token"),
        ("\"a\tb\"", "string", "normalizedString token"),
        ("\"a  b\"", "normalizedString", "token language"),
        ("\"en-GB\"", "language NMTOKEN NCName", "integer"),
        ("\"9a\"", "NMTOKEN token", "Name NCName language"),
        ("\"a:b\"", "Name NMTOKEN", "NCName language"),
        ("\"a\"@en", "", "string token"),
        ("true", "boolean", "string"),
        ("\"2026-01-01T00:00:00Z\"^^xsd:dateTime", "dateTime dateTimeStamp", "date"),
        ("\"P1D\"^^xsd:duration", "duration dayTimeDuration", "yearMonthDuration"),
        ("\"P1M\"^^xsd:duration", "duration yearMonthDuration", "dayTimeDuration string"),
        ("\"P0M\"^^xsd:yearMonthDuration", "duration yearMonthDuration dayTimeDuration", "string"),
        ("\"nan\"^^xsd:decimal", "", "decimal string"),
    ] {
        let value = literal(text);
        let in_space = |local: &&str| value.is_in(&xsd(local));
        assert!(datatypes.split_whitespace().all(|local| in_space(&local)), "{text} {datatypes}");
        assert!(!others.split_whitespace().any(|local| in_space(&local)), "{text} {others}");
    }
    let plain = "http://www.w3.org/1999/02/22-rdf-syntax-ns#PlainLiteral";
    assert!(literal("\"a\"@en").is_in(plain) && literal("\"a\"").is_in(plain) && !literal("1").is_in(plain));
    assert!(literal("1").is_in("http://www.w3.org/2002/07/owl#real"));
    assert!(literal("\"x\"^^<urn:d>").is_in("urn:d") && !literal("\"x\"^^<urn:d>").is_in("urn:e"));
}

#[test]
fn patterns_have_the_syntax_of_xpath() {
    let matches = |text: &str, pattern: &str| {
        BuiltIn::Matches.holds(&[&Literal::string(text), &Literal::string(pattern)])
    };
    for (text, pattern, expected) in [
        ("b", "^[a-z-[aeiou]]$", true),
        ("a", "^[a-z-[aeiou]]$", false),
        ("-", "^[a-z-[aeiou]]$", false),
        ("b", "^[a-z-[^b]]$", true),
        ("c", "^[a-z-[^b]]$", false),
        ("d", "^[a-z-[a-f-[d]]]$", true),
        ("e", "^[a-z-[a-f-[d]]]$", false),
        ("-", "^[-a]$", true),
        ("-", "^[a-]$", true),
        ("&", "^[&&]$", true),
        ("a", "^[a&&b]$", true),
        ("_x:1-2", "^\\i\\c*$", true),
        ("1x", "^\\i\\c*$", false),
        ("é", "^\\i$", true),
        (" ", "^\\C$", true),
        ("x", "^\\I$", false),
        ("1", "^[\\c-[\\i]]$", true),
        ("x", "^[\\c-[\\i]]$", false),
        ("[", "^\\[$", true),
        // `$` and combining marks are word characters, connectors such as `_` are punctuation.
        ("$\u{301}a1", "^\\w+$", true),
        ("_", "^\\w$", false),
        ("_", "^[\\W]$", true),
        ("\u{A0}", "^\\s$", false),
        ("\u{A0}", "^\\S$", true),
        ("\n", "^[^\\S]$", true),
        ("b", "^[\\w-[a]]$", true),
        ("a", "^[\\w-[a]]$", false),
        ("α", "\\p{IsGreek}", false),
        ("α", "^\\p{L}$", true),
    ] {
        assert_eq!(matches(text, pattern), expected, "{text} {pattern}");
    }
    // With the flag `x`, white space remains in classes only.
    let spaced = ["a b", "^ a [ ] b \\ $", "x"].map(Literal::string);
    assert!(!BuiltIn::Matches.holds(&spaced.each_ref()), "`\\ $` is the character `$`");
    let spaced = ["a b", "^ a [ ] b $", "x"].map(Literal::string);
    assert!(BuiltIn::Matches.holds(&spaced.each_ref()));
}
