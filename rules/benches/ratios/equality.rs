//! Individuals with several names: equality by representatives, compared with the rules of table 4 of OWL 2
//! RL.

use std::fmt::Write;
use std::time::Instant;

use metaplan_rules::{Delta, Engine, Fact, Prefixes, Program, Symbols, parse_rules};

use super::median;

const RULES: &str = "linked(?x, ?y) ^ tagged(?y) -> near(?x) . linked(?x, ?y) -> linked(?y, ?x) .";

/// Returns facts about 2,000 names in classes of `names` equal names. Each name is linked to the first name
/// of the next class. Also returns one of the `sameAs` facts, which the benchmark retracts and states again.
fn facts(symbols: &mut Symbols, names: usize) -> (Vec<Fact>, Fact) {
    let classes = 2000 / names;
    let mut facts = Vec::new();
    let [linked, tagged, same_as] =
        ["linked", "tagged", "http://www.w3.org/2002/07/owl#sameAs"].map(|n| symbols.name(n));
    for class in 0..classes {
        let mut name = |class: usize, number: usize| symbols.name(&format!("i{class}_{number}"));
        for number in 0..names {
            facts.push(Fact::new(linked, [name(class, number), name((class + 1) % classes, 0)]));
            if number > 0 {
                facts.push(Fact::new(same_as, [name(class, 0), name(class, number)]));
            }
        }
        facts.push(Fact::new(tagged, [name(class, 0)]));
    }
    let pair = Fact::new(same_as, [symbols.name("i3_0"), symbols.name("i3_1")]);
    (facts, pair)
}

/// The program with equality as rules: a symmetric and transitive relation (without pairs of a name with itself)
/// under which every relation is closed. In rule text, `sameAs` is a special atom, so a relation with another name
/// represents it.
fn by_rules(program: &Program, symbols: &mut Symbols) -> Program {
    let mut text = String::from(
        "same_as(?x, ?y) -> same_as(?y, ?x) .
        same_as(?x, ?y) ^ same_as(?y, ?z) ^ differentFrom(?x, ?z) -> same_as(?x, ?z) .
        linked(?x, ?y) ^ same_as(?x, ?z) -> linked(?z, ?y) .
        linked(?x, ?y) ^ same_as(?y, ?z) -> linked(?x, ?z) .",
    );
    for class in ["tagged", "near"] {
        let _ = write!(text, "{class}(?x) ^ same_as(?x, ?y) -> {class}(?y) .");
    }
    let equality = parse_rules(&text, "equality", symbols, &Prefixes::new()).expect("rules");
    let rules = program.rules.iter().chain(&equality.rules).cloned().collect();
    Program { rules, ..program.clone() }
}

/// Returns the median wall-clock times, in seconds, to build the engine, to retract a `sameAs` fact and to
/// state it again, and the number of facts that hold. Equality is by representatives, or by rules.
fn measure(names: usize, representatives: bool) -> ([f64; 3], usize) {
    let mut symbols = Symbols::new();
    let program = parse_rules(RULES, "bench", &mut symbols, &Prefixes::new()).expect("rules");
    let (mut facts, mut pair) = facts(&mut symbols, names);
    let program = if representatives {
        program.with_equality(&mut symbols)
    } else {
        let (same_as, relation) = (pair.predicate, symbols.name("same_as"));
        facts
            .iter_mut()
            .chain([&mut pair])
            .filter(|f| f.predicate == same_as)
            .for_each(|f| f.predicate = relation);
        by_rules(&program, &mut symbols)
    };
    let build = || Engine::new(symbols.clone(), program.clone(), facts.clone()).expect("safe rules");
    let mut builds: Vec<f64> = (0..2).map(|_| clocked(build).0).collect();
    let (last, mut engine) = clocked(build);
    builds.push(last);
    let count = engine.facts().count();
    let mut apply = |insert: Vec<Fact>, delete: Vec<Fact>| {
        clocked(|| engine.apply(Delta { insert, delete }).expect("no budget needed")).0
    };
    let rounds = if names > 10 { 5 } else { 51 };
    let changes = (0..rounds).map(|_| (apply(vec![], vec![pair.clone()]), apply(vec![pair.clone()], vec![])));
    let (deletes, inserts) = changes.unzip();
    ([median(builds), median(deletes), median(inserts)], count)
}

fn clocked<T>(run: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let result = run();
    (start.elapsed().as_secs_f64(), result)
}

pub(crate) fn compare() {
    println!("2,000 names in classes: representatives beside rules");
    for names in [2, 10, 100] {
        let (ours, count) = measure(names, true);
        let (theirs, theirs_count) = measure(names, false);
        assert_eq!(count, theirs_count);
        print!("  classes of {names:3}, {count:7} facts hold:");
        for ((what, ours), theirs) in ["build", "retract a pair", "state it"].iter().zip(ours).zip(theirs) {
            print!(" {what} {:.3} / {:.3} ms, {:.1} times;", ours * 1e3, theirs * 1e3, theirs / ours);
        }
        println!();
    }
}
