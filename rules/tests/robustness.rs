//! Robustness: random inputs do not make a parser panic, and parsed values are printed and parsed to the same values.

use metaplan_rules::{Engine, Limits, Literal, Prefixes, Symbols, parse_rules, print_rules};
use proptest::prelude::*;

const DATATYPES: [&str; 16] = [
    "string",
    "token",
    "boolean",
    "decimal",
    "integer",
    "byte",
    "unsignedLong",
    "float",
    "double",
    "dateTime",
    "dateTimeStamp",
    "date",
    "time",
    "duration",
    "dayTimeDuration",
    "anyURI",
];

proptest! {
    #[test]
    fn any_text_is_rules_or_errors(text in "([a-c?:<>()\\[\\]^,.\"@#→∧é0-9e+\n -]|->|not |\\?x|p\\(\\?x\\)|\\^\\^|xsd:byte){0,40}") {
        let mut symbols = Symbols::new();
        if let Ok(program) = parse_rules(&text, "random", &mut symbols, &Prefixes::new()) {
            let printed = print_rules(&program, &symbols, &Prefixes::new());
            let reparsed = parse_rules(&printed, "random", &mut symbols, &Prefixes::new()).expect(&printed);
            let content = |program: &metaplan_rules::Program| -> Vec<_> {
                program.rules.iter().map(|rule| (rule.head.clone(), rule.body.clone())).collect()
            };
            prop_assert_eq!(content(&program), content(&reparsed), "{}", printed);
            let _ = Engine::with_limits(symbols, program, [], Limits { steps: 1000, ..Limits::default() });
        }
    }

    #[test]
    fn any_lexical_form_is_a_literal(text in "[-+0-9.eETZPYMDHS:INFtrué ]{0,24}", datatype in 0..DATATYPES.len()) {
        let iri = format!("http://www.w3.org/2001/XMLSchema#{}", DATATYPES[datatype]);
        let literal = Literal::parse(&text, Some(&iri), None);
        let reparsed = Literal::parse(&literal.lexical(), Some(literal.datatype()), None);
        prop_assert_eq!(&reparsed, &literal);
        prop_assert!(literal.is_ill_typed() || literal.is_in(&iri));
        let _ = literal.compare(&Literal::integer(1));
    }

    #[test]
    fn numbers_order_as_their_exact_values(a in "-?[0-9]{1,25}(\\.[0-9]{1,25})?", b in "-?[0-9]{1,25}(\\.[0-9]{1,25})?") {
        let decimal = |text: &str| Literal::parse(text, Some("http://www.w3.org/2001/XMLSchema#decimal"), None);
        let (a, b) = (decimal(&a), decimal(&b));
        let exact = a.as_rational().expect("finite").cmp(&b.as_rational().expect("finite"));
        prop_assert_eq!(a.compare(&b), Some(exact));
        prop_assert_eq!(exact.is_eq(), a == b);
    }
}
