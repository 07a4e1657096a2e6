//! Failure and recovery of a component. Each update changes 31 facts: one status, and three derived facts for
//! each of ten designs.

use std::time::{Duration, Instant};

use differential_dataflow::input::Input;
use metaplan_rules::{Delta, Engine, Fact, Literal, Prefixes, Symbols, parse_rules};

use crate::median;

const ROUNDS: usize = 2000;
const RULES: &str = r#"
    requiresC(?fd, ?c) ^ c_status(?c, "FALSE") -> fd_realisability(?fd, false) .
    typeFD(?fg, ?fd) ^ fd_realisability(?fd, false) -> fg_status(?fg, "IN_ERROR_COMPONENT") .
    solvesO(?fg, ?o) ^ fg_status(?fg, "IN_ERROR_COMPONENT") -> o_status(?o, "IN_ERROR_COMPONENT") .
"#;

pub fn build(designs: u32) -> Engine {
    let mut symbols = Symbols::new();
    let program = parse_rules(RULES, "status", &mut symbols, &Prefixes::new()).expect("rules");
    let mut facts = Vec::new();
    for number in 0..designs {
        let mut fact = |predicate: &str, first: String, second: String| {
            let arguments = [symbols.name(&first), symbols.name(&second)];
            facts.push(Fact::new(symbols.name(predicate), arguments));
        };
        fact("requiresC", format!("fd{number}"), format!("c{}", number / 10));
        fact("typeFD", format!("fg{number}"), format!("fd{number}"));
        fact("solvesO", format!("fg{number}"), format!("o{number}"));
    }
    Engine::new(symbols, program, facts).expect("safe rules")
}

pub fn engine(designs: u32) -> Duration {
    let mut engine = build(designs);
    let symbols = engine.symbols_mut();
    let failed = symbols.literal(Literal::string("FALSE"));
    let status = Fact::new(symbols.name("c_status"), [symbols.name("c7"), failed]);
    let times = (0..ROUNDS).map(|round| {
        let (mut insert, mut delete) = (Vec::new(), Vec::new());
        if round % 2 == 0 { &mut insert } else { &mut delete }.push(status.clone());
        let start = Instant::now();
        let change = engine.apply(Delta { insert, delete }).expect("no budget needed");
        let time = start.elapsed();
        assert_eq!(change.insert.len() + change.delete.len(), 31);
        time
    });
    median(times.collect())
}

/// Returns the median wall-clock time of one update by differential dataflow, until the probe has reached the
/// time of the update.
pub fn differential(designs: u32) -> Duration {
    timely::execute_directly(move |worker| {
        let (mut requires, mut types, mut solves, mut failed, probe) =
            worker.dataflow::<u32, _, _>(|scope| {
                let (requires_input, requires) = scope.new_collection::<(u32, u32), isize>();
                let (types_input, types) = scope.new_collection::<(u32, u32), isize>();
                let (solves_input, solves) = scope.new_collection::<(u32, u32), isize>();
                let (failed_input, failed) = scope.new_collection::<(u32, ()), isize>();
                let designs = requires.join_map(failed, |_, &design, ()| (design, ())).distinct();
                let groundings = types.join_map(designs, |_, &grounding, ()| (grounding, ())).distinct();
                let objectives = solves.join_map(groundings, |_, &objective, ()| objective).distinct();
                let (probe, _) = objectives.probe();
                (requires_input, types_input, solves_input, failed_input, probe)
            });
        for number in 0..designs {
            requires.insert((number / 10, number));
            types.insert((number, number));
            solves.insert((number, number));
        }
        let mut times = Vec::with_capacity(ROUNDS);
        for round in 0..=ROUNDS {
            let start = Instant::now();
            match round {
                0 => {}
                _ if round % 2 == 1 => failed.insert((7, ())),
                _ => failed.remove((7, ())),
            }
            let next = round as u32 + 1;
            requires.advance_to(next);
            types.advance_to(next);
            solves.advance_to(next);
            failed.advance_to(next);
            requires.flush();
            types.flush();
            solves.flush();
            failed.flush();
            worker.step_while(|| probe.less_than(&next));
            if round > 0 {
                times.push(start.elapsed());
            }
        }
        median(times)
    })
}
