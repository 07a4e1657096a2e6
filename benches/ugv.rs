//! The UGV mission from its files to the proved optimum.

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use metaplan::mission::Planning as _;
use metaplan::setup::Setup;
use planner::{Config, Limits, Status, optimize};

fn plan(scenario: Option<&str>) {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/ugv.toml");
    let Setup { mut mission, scenarios, .. } = Setup::read(&manifest).expect("the mission is read");
    if let Some(scenario) = scenario {
        scenarios[scenario].apply(&mut mission).expect("the scenario fits");
    }
    let (problem, _) = mission.filled().expect("the knowledge base fits the domain");
    let task = mission.ground(&problem, &[], &Limits::none()).expect("the mission is ground");
    let solution = optimize(&task, &Config::default(), &mut |_| {});
    assert_eq!(black_box(solution).status, Status::Optimal);
}

fn ugv(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("ugv: load, reason, plan, prove");
    group.bench_function("everything works", |bencher| bencher.iter(|| plan(None)));
    group.bench_function("kinect failed at wp2", |bencher| bencher.iter(|| plan(Some("kinect_failure"))));
    group.finish();
}

criterion_group!(benches, ugv);
criterion_main!(benches);
