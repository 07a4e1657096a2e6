//! Any text is rules or errors; what is read prints and reads back as the same rules; the engine takes or refuses it
//! within its step budget.

#![no_main]

use libfuzzer_sys::fuzz_target;
use metaplan_rules::{Engine, Limits, Prefixes, Program, Symbols, parse_rules, print_rules};

/// Rules without names of variables and labels, which the syntax cannot always spell.
fn bare(program: &Program) -> Vec<String> {
    program.rules.iter().map(|rule| format!("{:?} {:?}", rule.head, rule.body)).collect()
}

fuzz_target!(|text: &str| {
    let mut symbols = Symbols::new();
    let Ok(program) = parse_rules(text, "fuzz", &mut symbols, &Prefixes::new()) else { return };
    let printed = print_rules(&program, &symbols, &Prefixes::new());
    let again = parse_rules(&printed, "fuzz", &mut symbols, &Prefixes::new()).expect(&printed);
    assert_eq!(bare(&program), bare(&again), "{printed}");
    let _ = Engine::with_limits(symbols, program, [], Limits { steps: 1000, ..Limits::default() });
});
