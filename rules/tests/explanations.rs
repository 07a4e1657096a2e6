//! Tests of `why` and `why_not`, as text.

use crate::text::{engine, fact};
use metaplan_rules::Obstacle;

const RULES: &str = "
    [usable] design(?fd) ^ not broken(?fd) -> usable(?fd) .
    [too low] needs(?fd, ?least) ^ measured(?m, ?value) ^ swrlb:lessThan(?value, ?least) -> broken(?fd) .
    [failed] requires(?fd, ?c) ^ failed(?c) -> broken(?fd) .
    [twin] twin(?fd, ?other) ^ differentFrom(?fd, ?other) -> broken(?fd) .
    [high] measured(?fd, ?value) ^ not swrlb:lessThan(?value, 1) -> high(?fd) .
    [both] usable(?fd) ^ design(?fd) -> ready(?fd) .
";
const STATED: &str =
    "design(a), design(b), needs(a, 0.5), needs(b, 2), measured(m, 0.75), measured(n, 1.5), twin(a, a)";

fn check(text: &str, expected: &[&[&str]]) {
    let mut engine = engine(RULES, STATED).expect("rules");
    let fact = fact(&mut engine, text);
    let show = |obstacle: &Obstacle| obstacle.display(engine.symbols()).to_string();
    let misses = engine.why_not(&fact);
    let obstacles: Vec<Vec<String>> =
        misses.iter().map(|miss| miss.obstacles.iter().map(show).collect()).collect();
    assert_eq!(obstacles, expected);
}

#[test]
fn the_nearest_match_is_reported() {
    check("usable(b)", &[&["but <broken>(<b>)"]]);
    check("usable(c)", &[&["missing <design>(<c>)"]]);
    check("usable(a)", &[]);
    check("unheard(a)", &[]);
    let decimal = |number: &str| format!("\"{number}\"^^<http://www.w3.org/2001/XMLSchema#decimal>");
    let integer = |number: &str| decimal(number).replace("decimal", "integer");
    let low = format!("lessThan({}, {}) is false, by 0.25", decimal("0.75"), decimal("0.5"));
    let failed = ["missing <requires>(<a>, ?)", "missing <failed>(?)"];
    check("high(m)", &[&[&format!("lessThan({}, {}) is true", decimal("0.75"), integer("1"))]]);
    check("broken(a)", &[&[&low], &failed, &["<a> is the same as <a>"]]);
}

#[test]
fn derivations_print_as_trees() {
    let mut engine = engine(RULES, STATED).expect("rules");
    let fact = fact(&mut engine, "ready(a)");
    let displayed = engine.why(&fact).expect("it holds").display(engine.symbols()).to_string();
    let expected = "<ready>(<a>) by rule test#5 (both)
  <usable>(<a>) by rule test#0 (usable)
    not <broken>(<a>)
    <design>(<a>) is stated
  <design>(<a>) is stated
";
    assert_eq!(displayed, expected);
}

/// The search visits each atom of the body below the previous one, so recursion would exhaust the stack.
#[test]
fn the_search_for_a_nearest_match_does_not_recurse() {
    let atoms: Vec<String> = (0..300).map(|number| format!("p(?x, ?y{number})")).collect();
    let rules = format!("[long] {} ^ missing(?x) -> q(?x) .", atoms.join(" ^ "));
    let mut engine = engine(&rules, "p(a, b)").expect("rules");
    let fact = fact(&mut engine, "q(a)");
    let thread = std::thread::Builder::new().stack_size(128 << 10).spawn(move || engine.why_not(&fact));
    let misses = thread.expect("a thread").join().expect("misses");
    let [miss] = &misses[..] else { panic!("{} misses", misses.len()) };
    assert_eq!((miss.supports.len(), miss.obstacles.len()), (300, 1));
}
