//! Conformance tests for all SAT solvers (back ends).

use std::time::Duration;

use metaplan_encodings::sat::{Answer, Backend, BackendError, Lit, Solver};
use task::limits::Limits;
use test_resources::{Resource, missing};
use testing::random::Random;

const PROGRAMS: [&str; 6] = [
    "minisat -verb=0 /dev/stdin /dev/stdout",
    "glucose -verb=0 /dev/stdin /dev/stdout",
    "cadical -q",
    "kissat -q",
    "picosat",
    "cryptominisat5 --verb 0",
];

/// Returns the built-in solvers and those of [`PROGRAMS`] that are installed.
pub fn backends() -> Vec<Backend> {
    let built_in = Backend::BUILT_IN.iter().map(|name| name.parse().expect("a name"));
    let mut backends: Vec<Backend> = built_in.collect();
    let mut absent = Vec::new();
    for program in PROGRAMS {
        let mut words = program.split(' ').map(str::to_owned);
        let backend =
            Backend::Program { command: words.next().expect("a command"), arguments: words.collect() };
        match backend.check() {
            Ok(()) => backends.push(backend),
            Err(error) => absent.push(error.to_string()),
        }
    }
    if !absent.is_empty() {
        missing(Resource::Solvers, &absent.join("; "));
    }
    backends
}

fn literals(numbers: &[i32]) -> Vec<Lit> {
    numbers.iter().map(|number| Lit::new(number.unsigned_abs() - 1, *number > 0)).collect()
}

fn solver(backend: &Backend, clauses: &[Vec<i32>]) -> Box<dyn Solver> {
    let mut solver = backend.start(&Limits::none(), u64::MAX);
    for clause in clauses {
        solver.add_clause(&literals(clause));
    }
    solver
}

fn check(backends: &[Backend], clauses: &[Vec<i32>], expected: Answer) {
    for backend in backends {
        let mut solver = solver(backend, clauses);
        assert_eq!(solver.solve(&[]), expected, "{backend:?}: {clauses:?}: {:?}", solver.failure());
        if expected == Answer::Satisfiable {
            let holds = |literal: &i32| solver.value(literal.unsigned_abs() - 1) == (*literal > 0);
            assert!(clauses.iter().all(|clause| clause.iter().any(holds)), "{backend:?}: {clauses:?}");
        }
    }
}

/// Pigeonhole formula: `holes + 1` pigeons do not fit into the holes. It is unsatisfiable and hard
/// for resolution.
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
fn every_back_end_decides_special_formulas() {
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

struct Formulas(Random);

impl Formulas {
    fn literal(&mut self, variables: u64) -> i32 {
        let variable = 1 + self.0.below(variables) as i32;
        if self.0.below(2) == 0 { variable } else { -variable }
    }

    fn clauses(&mut self, variables: u64, count: u64) -> Vec<Vec<i32>> {
        (0..count).map(|_| (0..3).map(|_| self.literal(variables)).collect()).collect()
    }
}

fn by_enumeration(variables: u64, clauses: &[Vec<i32>], assumptions: &[i32]) -> bool {
    (0..1_u32 << variables).any(|bits| {
        let literal = |l: &i32| (bits >> (l.unsigned_abs() - 1) & 1 == 1) == (*l > 0);
        assumptions.iter().all(literal) && clauses.iter().all(|clause| clause.iter().any(literal))
    })
}

#[test]
fn answers_for_random_formulas_agree_with_enumeration() {
    let backends = backends();
    let mut formulas = Formulas(Random(1));
    let mut satisfiable = 0;
    for _ in 0..60 {
        let variables = 3 + formulas.0.below(6) as u64;
        let count = variables * 4 + formulas.0.below(variables) as u64;
        let clauses = formulas.clauses(variables, count);
        let any = by_enumeration(variables, &clauses, &[]);
        satisfiable += usize::from(any);
        check(&backends, &clauses, if any { Answer::Satisfiable } else { Answer::Unsatisfiable });
    }
    assert!((10..50).contains(&satisfiable), "the formulas are of one kind: {satisfiable} of 60");
}

/// Adds clauses in portions, and solves under several sets of assumptions after each portion.
/// Checks all answers. Returns the number of satisfiable calls, of unsatisfiable calls, and of
/// cores that omit an assumption.
fn check_growing(backend: &Backend, seed: u64) -> (usize, usize, usize) {
    let mut formulas = Formulas(Random(seed));
    let variables = 4 + formulas.0.below(7) as u64;
    let mut all_clauses: Vec<Vec<i32>> = Vec::new();
    let mut solver = solver(backend, &[]);
    let (mut satisfiable, mut unsatisfiable, mut smaller) = (0, 0, 0);
    for _ in 0..5 {
        let clauses = formulas.clauses(variables, variables);
        for clause in &clauses {
            solver.add_clause(&literals(clause));
        }
        all_clauses.extend(clauses);
        for _ in 0..4 {
            let count = formulas.0.below(6);
            // Assumptions may contradict each other or repeat, and one is about a variable that no
            // clause contains.
            let mut assumptions: Vec<i32> = (0..count).map(|_| formulas.literal(variables)).collect();
            assumptions.push(variables as i32 + 1);
            let context = || format!("{backend:?}, seed {seed}: {all_clauses:?} under {assumptions:?}");
            let answer = solver.solve(&literals(&assumptions));
            if answer == Answer::Satisfiable {
                let holds = |l: &i32| solver.value(l.unsigned_abs() - 1) == (*l > 0);
                assert!(all_clauses.iter().all(|clause| clause.iter().any(holds)), "{}", context());
                assert!(assumptions.iter().all(holds), "{}", context());
                satisfiable += 1;
            } else {
                assert_eq!(answer, Answer::Unsatisfiable, "{}: {:?}", context(), solver.failure());
                let core: Vec<i32> = solver.core().iter().map(|literal| literal.dimacs()).collect();
                assert!(core.iter().all(|literal| assumptions.contains(literal)), "{}: {core:?}", context());
                assert!(!by_enumeration(variables + 1, &all_clauses, &core), "{}: {core:?}", context());
                unsatisfiable += 1;
                smaller += usize::from(core.len() < assumptions.len());
            }
        }
    }
    (satisfiable, unsatisfiable, smaller)
}

/// Regression test: after several calls, a solver once returned a core (failed assumptions) that
/// was satisfiable.
#[test]
fn cores_of_later_calls_are_contradictory() {
    for backend in backends() {
        check_growing(&backend, 666);
    }
}

fn check_many_growing(seeds: std::ops::Range<u64>) {
    for backend in backends() {
        let (mut satisfiable, mut unsatisfiable, mut smaller) = (0, 0, 0);
        for seed in seeds.clone() {
            let counts = check_growing(&backend, seed);
            satisfiable += counts.0;
            unsatisfiable += counts.1;
            smaller += counts.2;
        }
        assert!(satisfiable > 100 && unsatisfiable > 100, "{backend:?}: {satisfiable}, {unsatisfiable}");
        assert!(matches!(backend, Backend::Program { .. }) || smaller > 100, "{backend:?}: {smaller}");
    }
}

#[test]
fn incremental_answers_are_right_and_cores_are_contradictory() {
    check_many_growing(0..30);
}

#[test]
#[ignore = "takes minutes"]
fn many_incremental_answers_are_right_and_cores_are_contradictory() {
    check_many_growing(30..3_000);
}

/// Pigeonhole formula with an assumption that lets one pigeon stay outside. Learnt clauses must not
/// depend on the assumptions of an earlier call.
#[test]
fn answers_do_not_depend_on_earlier_calls() {
    let holes = 6;
    for backend in backends() {
        let mut clauses = pigeons(holes);
        clauses[0].push(100);
        let mut solver = solver(&backend, &clauses);
        for _ in 0..2 {
            assert_eq!(solver.solve(&literals(&[-100])), Answer::Unsatisfiable, "{backend:?}");
            assert_eq!(solver.core(), literals(&[-100]), "{backend:?}");
            assert_eq!(solver.solve(&literals(&[100])), Answer::Satisfiable, "{backend:?}");
            assert_eq!(solver.solve(&[]), Answer::Satisfiable, "{backend:?}");
        }
        solver.add_clause(&literals(&[-100]));
        assert_eq!(solver.solve(&[]), Answer::Unsatisfiable, "{backend:?}");
        assert!(solver.core().is_empty(), "{backend:?}");
    }
}

/// The deadline has already passed and conflicts are counted, so the speed of the machine does not matter.
#[test]
fn limits_interrupt_every_back_end() {
    let clauses: Vec<Vec<Lit>> = pigeons(13).iter().map(|clause| literals(clause)).collect();
    let stopped = |limits: &Limits, budget: u64, backend: &Backend| {
        let mut solver = backend.start(limits, budget);
        for clause in &clauses {
            solver.add_clause(clause);
        }
        assert_eq!(solver.solve(&[]), Answer::Interrupted, "{backend:?}, budget {budget}");
        assert!(solver.failure().is_none(), "{backend:?}: {:?}", solver.failure());
        // The limit stays exceeded, so further calls are interrupted as well.
        solver.add_clause(&literals(&[1, 1_000]));
        assert_ne!(solver.solve(&literals(&[-1])), Answer::Satisfiable, "{backend:?}, budget {budget}");
        solver
    };
    for backend in backends() {
        let mut late = stopped(&Limits::none().with_time(Duration::ZERO), u64::MAX, &backend);
        assert_eq!(late.solve(&[]), Answer::Interrupted, "{backend:?}, asked again");
    }
    for backend in Backend::built_in() {
        stopped(&Limits::none(), 200, &backend);
    }
    // Programs get a time instead of a number of conflicts. This one never answers.
    let silent = Backend::Program { command: "sleep".to_owned(), arguments: vec!["1000".to_owned()] };
    stopped(&Limits::none(), 200, &silent);
}

#[test]
fn unusable_solver_names_and_programs_are_reported() {
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

/// The program needs more time for its first answer than the time that replaces a conflict budget.
#[test]
#[cfg(unix)]
fn a_solver_that_starts_slowly_is_usable() {
    let script = "if grep -q '^-'; then echo s UNSATISFIABLE; exit; fi
      sleep 3; echo s SATISFIABLE; echo v 1 0";
    let arguments = vec!["-c".to_owned(), script.to_owned()];
    assert_eq!(Backend::Program { command: "sh".to_owned(), arguments }.check(), Ok(()));
}
