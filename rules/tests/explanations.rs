//! Why not: the nearest that rules come to concluding a fact, as text.

mod text;

use metaplan_rules::{Engine, Obstacle, Symbol};
use text::{engine, fact};

fn name(engine: &Engine, symbol: Option<Symbol>) -> String {
    symbol.map_or_else(|| "?".to_string(), |symbol| engine.symbols().value(symbol).to_string())
}

fn names(engine: &Engine, symbols: &[Option<Symbol>]) -> String {
    symbols.iter().map(|&symbol| name(engine, symbol)).collect::<Vec<_>>().join(", ")
}

fn describe(engine: &Engine, obstacle: &Obstacle) -> String {
    match obstacle {
        Obstacle::Missing { predicate, arguments } => {
            format!("no {}({})", name(engine, Some(*predicate)), names(engine, arguments))
        }
        Obstacle::Present(fact) => format!("but {}", fact.display(engine.symbols())),
        Obstacle::False { built_in, gap, .. } => {
            format!("{} missed by {}", built_in.name(), gap.as_ref().map_or("?".into(), ToString::to_string))
        }
        Obstacle::Equality { left, right, wanted } => {
            format!("{} = {} is not {wanted}", name(engine, Some(*left)), name(engine, Some(*right)))
        }
        other => format!("{other:?}"),
    }
}

/// The obstacles of each rule that could conclude the fact.
fn check(rules: &str, stated: &str, wanted: &str, expected: &[&[&str]]) {
    let mut engine = engine(rules, stated).expect("rules");
    let fact = fact(&mut engine, wanted);
    let misses = engine.why_not(&fact);
    let found: Vec<Vec<String>> =
        misses.iter().map(|miss| miss.obstacles.iter().map(|o| describe(&engine, o)).collect()).collect();
    assert_eq!(found, expected);
}

#[test]
fn the_nearest_match_is_reported() {
    let rules = "
        design(?fd) ^ not broken(?fd) -> usable(?fd) .
        needs(?fd, ?least) ^ measured(?m, ?value) ^ swrlb:lessThan(?value, ?least) -> broken(?fd) .
        requires(?fd, ?c) ^ failed(?c) -> broken(?fd) .
        twin(?fd, ?other) ^ differentFrom(?fd, ?other) -> broken(?fd) .
    ";
    let stated =
        "design(a), design(b), needs(a, 0.5), needs(b, 2), measured(m, 0.75), measured(n, 1.5), twin(a, a)";
    check(rules, stated, "usable(b)", &[&["but <broken>(<b>)"]]);
    check(rules, stated, "usable(c)", &[&["no <design>(<c>)"]]);
    check(rules, stated, "usable(a)", &[]);
    let broken: &[&[&str]] = &[
        &["lessThan missed by 1/4"],
        &["no <requires>(<a>, ?)", "no <failed>(?)"],
        &["<a> = <a> is not false"],
    ];
    check(rules, stated, "broken(a)", broken);
    check(rules, stated, "unheard(a)", &[]);
}
