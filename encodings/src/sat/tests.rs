//! What every back end has to do: one suite over all of them.

use std::time::{Duration, Instant};

use crate::limits::Limits;
use crate::sat::{Answer, Backend, BackendError, Lit, Solver};

/// Programs that distributions ship, as a user would name them.
const PROGRAMS: [&str; 6] = [
    "minisat -verb=0 /dev/stdin /dev/stdout",
    "glucose -verb=0 /dev/stdin /dev/stdout",
    "cadical -q",
    "kissat -q",
    "picosat",
    "cryptominisat5 --verb 0",
];

/// The built-in ones, and the programs that are there.
#[allow(clippy::print_stdout)]
pub(crate) fn backends() -> Vec<Backend> {
    let built_in = Backend::BUILT_IN.iter().map(|name| name.parse().expect("a name"));
    let mut found: Vec<Backend> = built_in.collect();
    for program in PROGRAMS {
        let mut words = program.split(' ').map(str::to_owned);
        let backend =
            Backend::Program { command: words.next().expect("a command"), arguments: words.collect() };
        match backend.check() {
            Ok(()) => found.push(backend),
            Err(error) => println!("skipped: {error}"),
        }
    }
    found
}

fn solver(backend: &Backend, clauses: &[Vec<i32>]) -> Box<dyn Solver> {
    let mut solver = backend.start(&Limits::none(), u64::MAX);
    for clause in clauses {
        let literal = |number: &i32| {
            let positive = Lit::positive(number.unsigned_abs() - 1);
            if *number > 0 { positive } else { !positive }
        };
        solver.add_clause(&clause.iter().map(literal).collect::<Vec<_>>());
    }
    solver
}

/// All back ends answer as expected, and their assignments satisfy the clauses.
fn check(backends: &[Backend], clauses: &[Vec<i32>], expected: Answer) {
    for backend in backends {
        let mut solver = solver(backend, clauses);
        assert_eq!(solver.solve(), expected, "{backend:?}: {clauses:?}: {:?}", solver.failure());
        if expected == Answer::Satisfiable {
            let holds = |literal: &i32| solver.value(literal.unsigned_abs() - 1) == (*literal > 0);
            assert!(clauses.iter().all(|clause| clause.iter().any(holds)), "{backend:?}: {clauses:?}");
        }
    }
}

/// No `holes + 1` pigeons fit: hard for all that only resolve.
fn pigeons(holes: i32) -> Vec<Vec<i32>> {
    let inside = |pigeon: i32, hole: i32| pigeon * holes + hole + 1;
    let mut clauses: Vec<Vec<i32>> =
        (0..=holes).map(|pigeon| (0..holes).map(|hole| inside(pigeon, hole)).collect()).collect();
    for hole in 0..holes {
        for a in 0..=holes {
            clauses.extend((0..a).map(|b| vec![-inside(a, hole), -inside(b, hole)]));
        }
    }
    clauses
}

#[test]
fn special_formulas() {
    use Answer::{Satisfiable, Unsatisfiable};
    let backends = backends();
    check(&backends, &[], Satisfiable);
    check(&backends, &[vec![]], Unsatisfiable);
    check(&backends, &[vec![3]], Satisfiable);
    check(&backends, &[vec![1, 2], vec![]], Unsatisfiable);
    check(&backends, &[vec![1], vec![-1]], Unsatisfiable);
    check(&backends, &[vec![1, 1], vec![-2, -2]], Satisfiable);
    check(&backends, &[vec![1, -1]], Satisfiable);
    check(&backends, &pigeons(4), Unsatisfiable);
}

#[test]
fn random_formulas_as_enumeration() {
    let backends = backends();
    let mut state = 1_u64;
    let mut below = move |limit: u64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) % limit) as i32
    };
    let mut satisfiable = 0;
    for _ in 0..60 {
        let variables = 3 + below(6) as u64;
        let count = variables * 4 + below(variables) as u64;
        let clauses: Vec<Vec<i32>> = (0..count)
            .map(|_| {
                let literal = |_| {
                    let variable = 1 + below(variables);
                    if below(2) == 0 { variable } else { -variable }
                };
                (0..3).map(literal).collect()
            })
            .collect();
        let holds = |bits: u32| {
            let literal = |l: &i32| (bits >> (l.unsigned_abs() - 1) & 1 == 1) == (*l > 0);
            clauses.iter().all(|clause| clause.iter().any(literal))
        };
        let any = (0..1_u32 << variables).any(holds);
        satisfiable += usize::from(any);
        check(&backends, &clauses, if any { Answer::Satisfiable } else { Answer::Unsatisfiable });
    }
    assert!((10..50).contains(&satisfiable), "the formulas are of one kind: {satisfiable} of 60");
}

#[test]
fn limits_interrupt() {
    let clauses = pigeons(13);
    for backend in backends() {
        let mut limited = backend.start(&Limits::none().with_time(Duration::from_millis(50)), u64::MAX);
        let mut counted = backend.start(&Limits::none(), 200);
        for clause in &clauses {
            let literal = |number: &i32| {
                let positive = Lit::positive(number.unsigned_abs() - 1);
                if *number > 0 { positive } else { !positive }
            };
            let clause: Vec<_> = clause.iter().map(literal).collect();
            limited.add_clause(&clause);
            counted.add_clause(&clause);
        }
        let started = Instant::now();
        assert_eq!(limited.solve(), Answer::Interrupted, "{backend:?}, by time");
        assert_eq!(counted.solve(), Answer::Interrupted, "{backend:?}, by conflicts");
        assert!(started.elapsed() < Duration::from_secs(20), "{backend:?}");
        assert!(counted.failure().is_none());
    }
}

#[test]
fn names_and_programs_that_do_not_serve() {
    assert_eq!("batsat".parse(), Ok(Backend::Batsat));
    assert_eq!(" ".parse::<Backend>(), Err(BackendError::Empty));
    let message = |name: &str| match name.parse::<Backend>().and_then(|backend| backend.check()) {
        Ok(()) => "serves".to_owned(),
        Err(error) => error.to_string(),
    };
    assert_eq!(message("varisat"), "serves");
    for (name, part) in [("no-such-solver", "cannot be started"), ("true", "neither SATISFIABLE")] {
        assert!(message(name).contains(part), "{}", message(name));
    }
    assert!(message("echo s UNSATISFIABLE").contains("answers wrongly"));
    assert!(message("echo s SATISFIABLE").contains("does not satisfy"));
}
