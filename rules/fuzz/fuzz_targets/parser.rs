//! Fuzz target: any text gives rules or errors. Parsed rules are printed and parsed to the same rules. The
//! engine accepts or rejects them within its step budget.

#![no_main]

use libfuzzer_sys::fuzz_target;
use metaplan_rules::{Engine, Limits, Prefixes, Program, Symbols, parse_rules, print_rules};

/// Heads and bodies of the rules, without variable names and labels, which the syntax cannot always
/// express.
fn content(program: &Program) -> Vec<String> {
    program.rules.iter().map(|rule| format!("{:?} {:?}", rule.head, rule.body)).collect()
}

fuzz_target!(|text: &str| {
    let mut symbols = Symbols::new();
    let Ok(program) = parse_rules(text, "fuzz", &mut symbols, &Prefixes::new()) else { return };
    let printed = print_rules(&program, &symbols, &Prefixes::new());
    let reparsed = parse_rules(&printed, "fuzz", &mut symbols, &Prefixes::new()).expect(&printed);
    assert_eq!(content(&program), content(&reparsed), "{printed}");
    let _ = Engine::with_limits(symbols, program, [], Limits { steps: 1000, ..Limits::default() });
});
