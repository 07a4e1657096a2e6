//! Benchmarks of the engine. From scratch: transitive closure, relaxed reachability of a transport task, and the
//! rules of co-adaptation. In knowledge bases of growing size: a component that fails and recovers, a measurement
//! that changes, and copies of the engine.

use std::hint::black_box;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use metaplan_rules::{
    COADAPTATION_RULES, Delta, Engine, Fact, Literal, Prefixes, Program, Symbols, parse_rules,
};

const TOMASYS: &str = "http://metacontrol.org/tomasys#";

struct Random(u64);

impl Random {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % bound
    }
}

fn program(text: &str, symbols: &mut Symbols) -> Program {
    parse_rules(text, "bench", symbols, &Prefixes::new()).expect("rules")
}

fn fact(symbols: &mut Symbols, predicate: &str, arguments: &[&str]) -> Fact {
    let predicate = symbols.name(predicate);
    let arguments: Vec<_> = arguments.iter().map(|name| symbols.name(name)).collect();
    Fact::new(predicate, arguments)
}

type Task = (Symbols, Program, Vec<Fact>);

/// Task with 1,000 nodes and 5,000 random edges; about a million paths.
fn closure() -> Task {
    let mut symbols = Symbols::new();
    let rules = "edge(?x, ?y) -> path(?x, ?y) path(?x, ?y) ^ edge(?y, ?z) -> path(?x, ?z)";
    let program = program(rules, &mut symbols);
    let mut random = Random(1);
    let mut node = || format!("n{}", random.below(1000));
    let edges = (0..5000).map(|_| fact(&mut symbols, "edge", &[&node(), &node()])).collect();
    (symbols, program, edges)
}

/// Delete relaxation of an untyped transport task: trucks drive between locations and carry packages.
fn transport() -> Task {
    let mut symbols = Symbols::new();
    let rules = "
        truck(?t) ^ location(?from) ^ location(?to) ^ at(?t, ?from) ^ road(?from, ?to) -> drive(?t, ?from, ?to) .
        drive(?t, ?from, ?to) -> at(?t, ?to) .
        truck(?t) ^ package(?p) ^ location(?l) ^ at(?t, ?l) ^ at(?p, ?l) ^ capacity(?t, ?n, ?m) -> load(?p, ?t, ?l, ?n, ?m) .
        load(?p, ?t, ?l, ?n, ?m) -> in(?p, ?t) ^ room(?t, ?m) .
        truck(?t) ^ package(?p) ^ location(?l) ^ in(?p, ?t) ^ at(?t, ?l) ^ capacity(?t, ?n, ?m) -> unload(?p, ?t, ?l, ?n, ?m) .
        unload(?p, ?t, ?l, ?n, ?m) -> at(?p, ?l) .
    ";
    let program = program(rules, &mut symbols);
    let mut random = Random(2);
    let mut facts = Vec::new();
    let mut add = |predicate: &str, arguments: &[&str]| facts.push(fact(&mut symbols, predicate, arguments));
    let place = |number: u64| format!("l{number}");
    for number in 0..100 {
        add("location", &[&place(number)]);
        for _ in 0..4 {
            let to = place(random.below(100));
            add("road", &[&place(number), &to]);
            add("road", &[&to, &place(number)]);
        }
    }
    for number in 0..10 {
        let truck = format!("t{number}");
        add("truck", &[&truck]);
        add("at", &[&truck, &place(random.below(100))]);
        add("capacity", &[&truck, "one", "none"]);
        add("capacity", &[&truck, "two", "one"]);
    }
    for number in 0..50 {
        let package = format!("p{number}");
        add("package", &[&package]);
        add("at", &[&package, &place(random.below(100))]);
    }
    (symbols, program, facts)
}

/// Knowledge base of designs, each with a required component and a lower bound on a measured attribute; about seven
/// stated facts per design.
fn knowledge_base(designs: usize) -> Task {
    let mut symbols = Symbols::new();
    let program = program(COADAPTATION_RULES, &mut symbols);
    let name = |local: &str| format!("{TOMASYS}{local}");
    let mut facts = Vec::new();
    let truth = symbols.literal(Literal::Boolean(true));
    for number in 0..designs {
        let names = ["fd", "fg", "o", "r"].map(|kind| format!("{kind}{number}"));
        let [design, grounding, objective, requirement] = [0, 1, 2, 3].map(|at| names[at].as_str());
        let (component, kind) = (format!("c{}", number / 10), format!("qa{}", number / 10));
        let mut add =
            |property: &str, arguments: &[&str]| facts.push(fact(&mut symbols, &name(property), arguments));
        add("FunctionDesign", &[design]);
        add("requiresC", &[design, &component]);
        add("hasRequirement", &[design, requirement]);
        add("isQAtype", &[requirement, &kind]);
        add("typeFD", &[grounding, design]);
        add("solvesO", &[grounding, objective]);
        let minimum = symbols.literal(Literal::integer(number as i64 % 10));
        let (predicate, subject) = (symbols.name(&name("hasMinimum")), symbols.name(requirement));
        facts.push(Fact::new(predicate, [subject, minimum]));
        if number % 10 == 0 {
            let measurement = format!("m{kind}");
            facts.push(fact(&mut symbols, &name("isQAtype"), &[&measurement, &kind]));
            let subject = symbols.name(&measurement);
            let value = symbols.literal(Literal::integer(5));
            facts.push(Fact::new(symbols.name(&name("isMeasured")), [subject, truth]));
            facts.push(Fact::new(symbols.name(&name("hasValue")), [subject, value]));
        }
    }
    (symbols, program, facts)
}

fn build((symbols, program, facts): Task) -> Engine {
    Engine::new(symbols, program, facts).expect("safe rules")
}

fn from_scratch(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("from_scratch");
    group.sample_size(10);
    let tasks =
        [("closure", closure()), ("transport", transport()), ("coadaptation", knowledge_base(10_000))];
    for (name, task) in tasks {
        let derived = build(task.clone()).facts().count() - task.2.len();
        group.throughput(Throughput::Elements(derived as u64));
        group.bench_function(name, |bencher| {
            bencher.iter_batched(|| task.clone(), |task| black_box(build(task)), BatchSize::PerIteration);
        });
    }
    group.finish();
}

fn updates(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("update");
    for designs in [100, 10_000, 100_000] {
        let mut engine = build(knowledge_base(designs));
        let size = engine.facts().count();
        let symbols = engine.symbols_mut();
        let failed = symbols.literal(Literal::string("FALSE"));
        let status = Fact::new(symbols.name(&format!("{TOMASYS}c_status")), [symbols.name("c7"), failed]);
        let values = [3, 5].map(|value| symbols.literal(Literal::integer(value)));
        let value = symbols.name(&format!("{TOMASYS}hasValue"));
        let [low, high] = values.map(|number| Fact::new(value, [symbols.name("mqa7"), number]));
        let change = |insert: &[&Fact], delete: &[&Fact]| Delta {
            insert: insert.iter().copied().cloned().collect(),
            delete: delete.iter().copied().cloned().collect(),
        };
        group.bench_function(BenchmarkId::new("component_toggle", size), |bencher| {
            bencher.iter(|| {
                black_box(engine.apply(change(&[&status], &[])).expect("no budget needed"));
                black_box(engine.apply(change(&[], &[&status])).expect("no budget needed"));
            });
        });
        group.bench_function(BenchmarkId::new("clone", size), |bencher| bencher.iter(|| engine.clone()));
        group.bench_function(BenchmarkId::new("clone_and_component_failure", size), |bencher| {
            bencher.iter(|| {
                let mut what_if = engine.clone();
                black_box(what_if.apply(change(&[&status], &[])).expect("no budget needed"));
                what_if
            });
        });
        group.bench_function(BenchmarkId::new("measurement", size), |bencher| {
            bencher.iter(|| {
                black_box(engine.apply(change(&[&low], &[&high])).expect("no budget needed"));
                black_box(engine.apply(change(&[&high], &[&low])).expect("no budget needed"));
            });
        });
    }
    group.finish();
}

criterion_group!(benches, from_scratch, updates);
criterion_main!(benches);
