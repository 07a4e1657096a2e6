//! Fuzz target: reads arbitrary bytes as a domain, a problem and a plan. The reader must return errors, or trees
//! that are equal after printing and reading. The byte 0xff, which does not occur in UTF-8, separates the three
//! files.

#![no_main]

use libfuzzer_sys::fuzz_target;
use pddl::{
    Source, check_domain, has_errors, parse_domain, parse_problem, print_domain, print_problem, read, render,
};
use pddl::validate::PlanText;

/// Returns the debug text of a syntax tree without source positions.
fn bare(tree: &impl std::fmt::Debug) -> String {
    let text = format!("{tree:?}");
    let mut parts = text.split("Span { start: ");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |kept, part| kept + part.split_once(" }").map_or(part, |(_, rest)| rest))
}

fuzz_target!(|bytes: &[u8]| {
    let mut texts = bytes.split(|byte| *byte == 0xff);
    let mut next = |name: &str| Source::from_bytes(name, texts.next().unwrap_or_default());
    let (domain, problem, plan) = (next("domain"), next("problem"), next("plan"));
    let (Ok((_, _, found)) | Err(found)) = read(&domain, &problem);
    render(&found, &[&domain, &problem], false);
    let _ = PlanText::parse(&plan);

    let (tree, found) = parse_domain(&domain);
    if let (Some(tree), false) = (tree, has_errors(&found)) {
        render(&check_domain(&tree, &domain), &[&domain], true);
        let printed = Source::new("printed", print_domain(&tree));
        let (again, found) = parse_domain(&printed);
        assert!(!has_errors(&found), "{}", render(&found, &[&printed], false));
        assert_eq!(again.map(|again| bare(&again)), Some(bare(&tree)), "{}", printed.text());
    }
    let (tree, found) = parse_problem(&problem);
    if let (Some(tree), false) = (tree, has_errors(&found)) {
        let printed = Source::new("printed", print_problem(&tree));
        let (again, found) = parse_problem(&printed);
        assert!(!has_errors(&found), "{}", render(&found, &[&printed], false));
        assert_eq!(again.map(|again| bare(&again)), Some(bare(&tree)), "{}", printed.text());
    }
});
