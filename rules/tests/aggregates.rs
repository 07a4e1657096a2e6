//! Aggregates: values before and after changes, explanations, and rejected rules.

use crate::text::{engine, fact, facts};
use metaplan_rules::{Delta, Engine, Limits, Obstacle, Reason};

const RULES: &str = "
    [spares]  function(?f) ^ ?n = count { solves(?d, ?f) ^ not failed(?d) } -> spares(?f, ?n) .
    [power]   function(?f) ^ ?w = sum { ?p | solves(?d, ?f) ^ power(?d, ?p) } -> power_of(?f, ?w) .
    [least]   function(?f) ^ ?w = min { ?p | solves(?d, ?f) ^ power(?d, ?p) } -> least(?f, ?w) .
    [cheap]   solves(?d, ?f) ^ power(?d, ?p) ^ ?p = min { ?q | solves(?e, ?f) ^ power(?e, ?q) } -> cheapest(?d) .
    [lonely]  function(?f) ^ spares(?f, ?n) ^ swrlb:lessThan(?n, 2) -> lonely(?f) .
    [none]    0 = count { failed(?d) } -> healthy() .
    [bounded] limit(?l) ^ ?n = count { power(?d, ?p) ^ swrlb:greaterThan(?p, ?l) } -> above(?l, ?n) .
    [rank]    power(?d, ?p) ^ ?n = count { power(?e, ?q) ^ swrlb:lessThan(?q, ?p) }
        ^ ?m = count { rival(?e) ^ power(?e, ?q) ^ swrlb:lessThan(?q, ?n) } -> rank(?d, ?n, ?m) .
";
const STATED: &str = "function(f), function(g), solves(a, f), solves(b, f), solves(c, g), power(a, 1.5),
    power(b, 0.1), power(c, 0.2), limit(0.15), rival(b)";

/// Runs a script of lines `+fact`, `-fact`, `?fact` (must hold) and `!fact` (must not hold).
fn check(script: &[&str]) {
    let mut engine = engine(RULES, STATED).expect("rules");
    for line in script {
        let (verb, text) = line.split_at(1);
        let fact = fact(&mut engine, text);
        let delta = match verb {
            "+" => Delta { insert: vec![fact], delete: vec![] },
            "-" => Delta { insert: vec![], delete: vec![fact] },
            _ => {
                assert_eq!(engine.holds(&fact), verb == "?", "{line}");
                continue;
            }
        };
        engine.apply(delta).expect(line);
    }
}

#[test]
fn values_follow_changes() {
    check(&["?spares(f, 2)", "?spares(g, 1)", "?lonely(g)", "!lonely(f)", "?healthy()"]);
    check(&["?power_of(f, 1.6)", "?least(f, 0.1)", "?cheapest(b)", "!cheapest(a)"]);
    check(&[
        "+failed(a)",
        "?spares(f, 1)",
        "!spares(f, 2)",
        "?lonely(f)",
        "!healthy()",
        "-failed(a)",
        "?spares(f, 2)",
    ]);
    check(&[
        "-power(b, 0.1)",
        "?power_of(f, 1.5)",
        "?cheapest(a)",
        "-power(a, 1.5)",
        "?power_of(f, 0)",
        "!least(f, 1.5)",
    ]);
    check(&["+power(b, \"x\")", "!power_of(f, 1.6)", "!least(f, 0.1)", "-power(b, \"x\")", "?least(f, 0.1)"]);
    check(&[
        "-function(f)",
        "!spares(f, 2)",
        "!spares(f, 0)",
        "+function(h)",
        "?spares(h, 0)",
        "?power_of(h, 0)",
    ]);
    check(&[
        "?above(0.15, 2)",
        "+limit(9)",
        "?above(9, 0)",
        "-limit(0.15)",
        "!above(0.15, 2)",
        "!above(0.15, 0)",
    ]);
    check(&["?rank(b, 0, 0)", "?rank(a, 2, 1)", "-rival(b)", "?rank(a, 2, 0)"]);
}

/// The atom `p(?x)` binds the group. If the aggregate also depended on `t`, the rules would not be
/// stratified.
#[test]
fn an_aggregate_depends_on_one_atom_per_group_variable() {
    let rules = "p(?x) ^ t(?x) ^ ?n = count { r(?y) ^ swrlb:lessThan(?y, ?x) } -> s(?x, ?n) .
        s(?x, ?n) ^ swrlb:add(?y, ?x, 1) -> t(?y) .";
    let mut engine = engine(rules, "p(1), p(2), p(3), t(1), r(0), r(1)").expect("stratified");
    for (text, expected) in [("s(1, 1)", true), ("s(2, 2)", true), ("s(3, 2)", true), ("s(4, 2)", false)] {
        let conclusion = fact(&mut engine, text);
        assert_eq!(engine.holds(&conclusion), expected);
    }
}

#[test]
fn a_change_reports_only_its_group() {
    let mut engine = engine(RULES, STATED).expect("rules");
    let insert = facts(engine.symbols_mut(), "failed(c)");
    let change = engine.apply(Delta { insert, delete: vec![] }).expect("no budget needed");
    let displayed = |facts: &[metaplan_rules::Fact]| {
        facts.iter().map(|fact| fact.display(engine.symbols()).to_string()).collect::<Vec<_>>()
    };
    let integer = |number: u8| format!("\"{number}\"^^<http://www.w3.org/2001/XMLSchema#integer>");
    assert_eq!(displayed(&change.insert).len(), 2);
    assert!(displayed(&change.insert).contains(&format!("<spares>(<g>, {})", integer(0))));
    assert!(displayed(&change.delete).contains(&format!("<spares>(<g>, {})", integer(1))));
    assert_eq!(displayed(&change.delete).len(), 2, "the count and `healthy`");
}

#[test]
fn derivations_list_the_matches() {
    let mut engine = engine(RULES, STATED).expect("rules");
    let power = fact(&mut engine, "power_of(f, 1.6)");
    let derivation = engine.why(&power).expect("it holds");
    let Reason::Rule { aggregates, bindings, .. } = &derivation.steps[0].reason else { panic!("derived") };
    assert_eq!(bindings.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["f", "w"]);
    assert_eq!(aggregates[0].matches.len(), 2);
    let displayed = derivation.display(engine.symbols()).to_string();
    let decimal = |number: &str| format!("\"{number}\"^^<http://www.w3.org/2001/XMLSchema#decimal>");
    let expected = format!(
        "<power_of>(<f>, {w}) by rule test#1 (power)
  {w} from 2 matches
  <function>(<f>) is stated
    <solves>(<a>, <f>) is stated
    <power>(<a>, {a}) is stated
    <solves>(<b>, <f>) is stated
    <power>(<b>, {b}) is stated
",
        w = decimal("1.6"),
        a = decimal("1.5"),
        b = decimal("0.1"),
    );
    assert_eq!(displayed, expected);
}

fn miss(engine: &mut Engine, text: &str) -> Vec<String> {
    let conclusion = fact(engine, text);
    let misses = engine.why_not(&conclusion);
    let show = |obstacle: &Obstacle| obstacle.display(engine.symbols()).to_string();
    misses.iter().flat_map(|miss| miss.obstacles.iter().map(show)).collect()
}

#[test]
fn near_misses_report_the_gap() {
    let mut engine = engine(RULES, STATED).expect("rules");
    let number =
        |kind: &str, number: &str| format!("\"{number}\"^^<http://www.w3.org/2001/XMLSchema#{kind}>");
    let (decimal, integer) = (|n| number("decimal", n), |n| number("integer", n));
    let expected = format!("sum is {}, not {}, by 0.4", decimal("1.6"), integer("2"));
    assert_eq!(miss(&mut engine, "power_of(f, 2)"), [expected]);
    let apply = |engine: &mut Engine, insert: &str| {
        let insert = facts(engine.symbols_mut(), insert);
        engine.apply(Delta { insert, delete: vec![] }).expect("no budget needed");
    };
    apply(&mut engine, "function(h), failed(a)");
    assert_eq!(miss(&mut engine, "least(h, 1)"), [format!("there is no min, not {}", integer("1"))]);
    assert_eq!(
        miss(&mut engine, "healthy()"),
        [format!("count is {}, not {}, by 1", integer("1"), integer("0"))]
    );
}

#[test]
fn rows_of_aggregates_cost_steps() {
    let stated: Vec<String> = (0..5_000).map(|number| format!("h({number})")).collect();
    let mut engine = engine("?n = count { h(?y) } -> v(?n) .", &stated.join(", ")).expect("rules");
    engine.set_limits(Limits { steps: 1_000, ..Limits::default() });
    let insert = facts(engine.symbols_mut(), "h(a)");
    let error = engine.apply(Delta { insert, delete: vec![] }).expect_err("too many rows");
    assert_eq!(error.code(), "R301");
}

#[test]
fn deeply_nested_aggregates_are_refused() {
    let errors = engine(&"?n = count { ".repeat(100_000), "").expect_err("too deep");
    assert_eq!(errors[0].code(), "R101");
}

fn refuse(rules: &str, expected: &[&str]) {
    let errors = engine(rules, "").expect_err(rules);
    assert_eq!(errors.iter().map(ToString::to_string).collect::<Vec<_>>(), expected);
}

#[test]
fn unsafe_and_unstratified_aggregates_are_refused() {
    let unbound = |variable: &str, place: &str| format!("rule test#0: variable ?{variable} {place}");
    let in_head =
        |variable: &str| format!("R202 {}", unbound(variable, "in the head is not bound by the body"));
    let in_body = |variable: &str| format!("R203 {}", unbound(variable, "is only tested, never bound"));
    refuse("?n = count { p(?x, ?y) } -> q(?x, ?n)", &[&in_head("x")]);
    refuse("p(?x) ^ ?n = count { swrlb:lessThan(?y, ?x) } -> q(?x, ?n)", &[&in_body("y")]);
    refuse("p(?x) ^ ?n = sum { ?z | r(?x) } -> q(?x, ?n)", &[&in_body("z")]);
    refuse("p(?x) ^ ?n = sum { ?n | r(?x) } -> q(?x, ?n)", &[&in_body("n")]);
    refuse("?n = count { p(?x, ?m) } ^ ?m = count { p(?n, ?x) } -> q(?m)", &[&in_body("n"), &in_body("m")]);
    let depends = "depends on its own conclusion, so the rules have no stratification";
    refuse("p(?x) ^ ?n = count { q(?y) } -> q(?n)", &[&format!("R208 rule test#0: its count {depends}")]);
    refuse(
        "p(?x) ^ ?n = sum { ?y | r(?y) } -> q(?n) . q(?x) -> r(?x)",
        &[&format!("R208 rule test#0: its sum {depends}")],
    );
    let nested = "?n = count { p(?x) ^ ?x = max { ?y | q(?y) } } -> r(?n)";
    refuse(
        nested,
        &["R209 rule test#0: an aggregate within an aggregate; compute the inner one in a separate rule"],
    );
}
