//! Benchmarks: from the files of a knowledge base to all conclusions, and updates of one measured value.
//!
//! The files are those of SUAVE in the test data, or the embedded UUV if they do not exist. Larger knowledge
//! bases are generated in the shape of SUAVE: functions with designs, each with a component and an estimation.

use std::fmt::Write;
use std::hint::black_box;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use ontology::runtime::{Mode, NewObjective, Runtime};
use ontology::{Ontology, ReadOptions, kb, lower, read_files, read_text, vocab};
use rules::{Engine, Literal, Symbols};
use test_resources::data_path;

fn suave() -> Ontology {
    let real = data_path("real/owl");
    let file = real.join("suave/suave.owl");
    let options = ReadOptions { directories: vec![real], ..ReadOptions::default() };
    if file.is_file() {
        read_files(&[file], &options).expect("readable")
    } else {
        read_text(kb::UUV, "uuv.ttl", &options).expect("readable")
    }
}

fn engine(ontology: &Ontology) -> Engine {
    let mut symbols = Symbols::new();
    let lowered = lower(ontology, &mut symbols);
    Engine::new(symbols, lowered.program, lowered.facts).expect("safe rules")
}

fn mission(ontology: &Ontology) -> Runtime {
    let mut runtime = Runtime::new(engine(ontology), Mode::Retract);
    let (name, function) = ("search", "f_generate_search_path");
    let objective = NewObjective { name, function, requirements: Vec::new(), always_improve: false };
    runtime.add_objective(&objective).expect("known");
    let design = &runtime.available_designs(Some(function)).expect("known")[0];
    runtime.ground(name, &design.name).expect("known");
    runtime
}

fn decimal(text: &str) -> Literal {
    Literal::parse(text, Some(vocab::xsd::DECIMAL), None)
}

/// Returns a Turtle document with `count` designs, ten for each function.
fn designs(count: usize) -> String {
    let mut text = String::from(
        "@prefix t: <http://metacontrol.org/tomasys#> .\n@prefix owl: <http://www.w3.org/2002/07/owl#> .\n\
         @prefix : <http://example.org/large#> .\n\
         <http://example.org/large> a owl:Ontology ; owl:imports <http://metacontrol.org/tomasys> .\n\
         :visibility a t:QualityAttributeType .\n\
         :obs_visibility a t:QAvalue ; t:isQAtype :visibility ; t:isMeasured true ; t:hasValue 3.0 .\n",
    );
    for design in 0..count {
        let function = design / 10;
        let status = if design % 10 == 0 { " ; t:c_status \"FALSE\"" } else { "" };
        let _ = writeln!(
            text,
            ":f{function} a t:Function .\n:c{design} a t:Component{status} .\n\
             :r{design} a t:Requirement ; t:isQAtype :visibility ; t:hasMinimum {}.5 .\n\
             :e{design} a t:QAvalue ; t:isQAtype :visibility ; t:hasValue {}.5 .\n\
             :fd{design} a t:FunctionDesign ; t:solvesF :f{function} ; t:requiresC :c{design} ;\n\
             t:hasRequirement :r{design} ; t:hasQAestimation :e{design} .",
            design % 5,
            design % 7
        );
    }
    text
}

fn small(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("suave");
    group.bench_function("read with imports", |bencher| bencher.iter(|| black_box(suave())));
    group.bench_function("read with imports, lower, reason", |bencher| {
        bencher.iter(|| black_box(engine(&suave())));
    });
    let ontology = suave();
    for (name, values) in
        [("a value changes, nothing follows", ["3.5", "3.6"]), ("a value changes a status", ["0.5", "3.5"])]
    {
        let mut runtime = mission(&ontology);
        let mut turn = 0;
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                turn = 1 - turn;
                black_box(runtime.measure("water_visibility", decimal(values[turn])).expect("known"))
            });
        });
        group.bench_function(format!("{name}, objectives in error, selection"), |bencher| {
            bencher.iter(|| {
                turn = 1 - turn;
                runtime.measure("water_visibility", decimal(values[turn])).expect("known");
                for objective in runtime.objectives().iter().filter(|objective| objective.wants_design()) {
                    black_box(runtime.candidates(&objective.individual.iri, None).expect("known"));
                }
            });
        });
    }
    group.finish();
}

fn large(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("designs");
    group.sample_size(10);
    for count in [10, 100, 1_000, 5_000] {
        let text = designs(count);
        let read = || read_text(&text, "large.ttl", &ReadOptions::default()).expect("readable");
        group.bench_function(format!("{count}, {} kB: read", text.len() / 1000), |bencher| {
            bencher.iter(|| black_box(read()));
        });
        let ontology = read();
        group.bench_function(format!("{count}: lower and reason"), |bencher| {
            bencher.iter_batched(|| (), |()| black_box(engine(&ontology)), BatchSize::PerIteration);
        });
    }
    group.finish();
}

criterion_group!(benches, small, large);
criterion_main!(benches);
