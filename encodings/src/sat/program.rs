//! External SAT solver programs: DIMACS \[1\] on standard input, the answer on standard output.
//!
//! Two answer formats are accepted: that of the SAT competitions (`s SATISFIABLE`, and the
//! assignment in lines `v …`), and that of `MiniSat`'s result file (`SAT`, and the assignment on
//! the next line). The process is killed when a limit is reached, but not other processes that it has
//! started. Programs have no portable option for a conflict budget, so a time limit replaces the
//! budget. Each call starts a new process that receives the assumptions as clauses. Learnt clauses are
//! therefore lost, and the core always contains all assumptions.
//!
//! \[1\] DIMACS challenge: Satisfiability, suggested format, 1993.

use std::fmt::Write as _;
use std::io::{Read as _, Write as _};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use task::limits::Limits;

use crate::sat::solver::{Answer, Lit, Solver};

/// Time limit of a run of the external program if there is a conflict budget, which it replaces.
const BUDGET_TIME: Duration = Duration::from_secs(2);
/// Time between two checks of the limits while the program runs.
const INTERVAL: Duration = Duration::from_millis(5);

pub(super) struct Program {
    command: Command,
    limits: Limits,
    budget: u64,
    /// DIMACS literals of all clauses; each clause ends with 0.
    clauses: Vec<i32>,
    variables: u32,
    assignment: Vec<bool>,
    core: Vec<Lit>,
    failure: Option<String>,
}

impl Program {
    /// Prepares a solver without clauses. Each run of the program ends at the deadline, at an interruption,
    /// or after [`BUDGET_TIME`] unless `budget` is `u64::MAX`.
    pub(super) fn new(command: &str, arguments: &[String], limits: &Limits, budget: u64) -> Self {
        let mut process = Command::new(command);
        process.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        Self {
            command: process,
            limits: limits.clone(),
            budget,
            clauses: Vec::new(),
            variables: 0,
            assignment: Vec::new(),
            core: Vec::new(),
            failure: None,
        }
    }

    fn dimacs(&self) -> String {
        let count = self.clauses.iter().filter(|literal| **literal == 0).count();
        let mut text = format!("p cnf {} {count}\n", self.variables);
        for literal in &self.clauses {
            let end = if *literal == 0 { '\n' } else { ' ' };
            // Writing to a string cannot fail.
            let _ = write!(text, "{literal}{end}");
        }
        text
    }

    /// Stores the assignment that makes these DIMACS literals true. Returns an error if the
    /// assignment does not satisfy every clause.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "literals are not 0, and each clause has its 0 with it"
    )]
    fn keep(&mut self, literals: &[i32]) -> Result<(), String> {
        self.assignment = vec![false; self.variables as usize];
        for literal in literals.iter().filter(|literal| **literal > 0) {
            if let Some(value) = self.assignment.get_mut(literal.unsigned_abs() as usize - 1) {
                *value = true;
            }
        }
        let holds = |literal: &i32| self.assignment[literal.unsigned_abs() as usize - 1] == (*literal > 0);
        // Each piece of the split includes its terminating 0.
        let mut clauses = self.clauses.split_inclusive(|literal| *literal == 0);
        if clauses.all(|clause| clause[..clause.len() - 1].iter().any(holds)) {
            Ok(())
        } else {
            Err("its assignment does not satisfy the formula".to_owned())
        }
    }

    /// Runs the program once on all clauses, and checks the assignment if it reports one. A fault of the
    /// program is stored in `failure`, and the answer is then `Interrupted`.
    fn decide(&mut self) -> Answer {
        let read = match self.run() {
            Ok(None) => return Answer::Interrupted,
            Ok(Some(output)) => read(&output),
            Err(reason) => Err(reason),
        };
        let checked = read.and_then(|(answer, literals)| {
            if answer == Answer::Satisfiable { self.keep(&literals).map(|()| answer) } else { Ok(answer) }
        });
        match checked {
            Ok(answer) => answer,
            Err(reason) => {
                self.failure = Some(reason);
                Answer::Interrupted
            }
        }
    }

    /// Runs the program and returns its output. Returns `None` if the program was killed, because a limit or
    /// the time that replaces the conflict budget was reached.
    fn run(&mut self) -> Result<Option<String>, String> {
        let started = Instant::now();
        let mut child = Process(self.command.spawn().map_err(|error| format!("cannot be started: {error}"))?);
        let (sender, receiver) = mpsc::channel();
        if let Some(mut output) = child.0.stdout.take() {
            thread::spawn(move || {
                let mut text = Vec::new();
                let read = output.read_to_end(&mut text).map(|_| text);
                // The receiver is gone if the process was killed.
                let _ = sender.send(read);
            });
        }
        if let Some(mut input) = child.0.stdin.take() {
            let text = self.dimacs();
            // A program that has read enough may close its input, so write errors are ignored; the
            // answer is checked in any case.
            thread::spawn(move || input.write_all(text.as_bytes()));
        }
        let is_over_budget = || self.budget < u64::MAX && started.elapsed() > BUDGET_TIME;
        let is_over = || is_over_budget() || self.limits.reached();
        loop {
            match receiver.recv_timeout(INTERVAL) {
                Ok(Ok(text)) => {
                    return Ok(has_ended(&mut child.0, &is_over)?
                        .then(|| String::from_utf8_lossy(&text).into_owned()));
                }
                Ok(Err(error)) => return Err(format!("its output cannot be read: {error}")),
                Err(mpsc::RecvTimeoutError::Disconnected) => return Err("its output is closed".to_owned()),
                Err(mpsc::RecvTimeoutError::Timeout) => {
                    if is_over() {
                        return Ok(None);
                    }
                }
            }
        }
    }
}

/// Waits for the end of a program that has closed its output. Returns `false` if a limit, or the time that
/// replaces the conflict budget, is reached first. A SAT solver exits with status 10, 20 or 0; after any
/// other status the output may be incomplete, so the result is an error.
fn has_ended(child: &mut Child, is_over: &dyn Fn() -> bool) -> Result<bool, String> {
    while !is_over() {
        match child.try_wait().map_err(|error| format!("its exit status is unknown: {error}"))? {
            Some(status) if matches!(status.code(), Some(0 | 10 | 20)) => return Ok(true),
            Some(status) => return Err(format!("it failed: {status}")),
            None => thread::sleep(INTERVAL),
        }
    }
    Ok(false)
}

struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        // The process may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn read(output: &str) -> Result<(Answer, Vec<i32>), String> {
    let mut answer = None;
    let mut literals = Vec::new();
    for line in output.lines() {
        let line = line.trim();
        match line.strip_prefix("s ").unwrap_or(line).trim() {
            "SATISFIABLE" | "SAT" => answer = Some(Answer::Satisfiable),
            "UNSATISFIABLE" | "UNSAT" => answer = Some(Answer::Unsatisfiable),
            "UNKNOWN" | "INDETERMINATE" | "INDET" => answer = Some(Answer::Interrupted),
            _ => {
                let values =
                    line.strip_prefix("v ").unwrap_or(line).split_whitespace().map(str::parse::<i32>);
                if let Ok(values) = values.collect::<Result<Vec<_>, _>>() {
                    literals.extend(values.into_iter().filter(|literal| *literal != 0));
                }
            }
        }
    }
    match answer {
        Some(answer) => Ok((answer, literals)),
        None => Err("its output says neither SATISFIABLE nor UNSATISFIABLE".to_owned()),
    }
}

impl Solver for Program {
    #[expect(clippy::arithmetic_side_effects, reason = "fewer than 2^31 variables")]
    fn add_clause(&mut self, clause: &[Lit]) {
        for literal in clause {
            self.variables = self.variables.max(literal.variable() + 1);
            self.clauses.push(literal.dimacs());
        }
        self.clauses.push(0);
    }

    fn solve(&mut self, assumptions: &[Lit]) -> Answer {
        let clause_end = self.clauses.len();
        for literal in assumptions {
            self.add_clause(&[*literal]);
        }
        let answer = self.decide();
        self.clauses.truncate(clause_end);
        self.core.clear();
        if answer == Answer::Unsatisfiable {
            self.core.extend_from_slice(assumptions);
        }
        answer
    }

    fn core(&self) -> &[Lit] {
        &self.core
    }

    fn value(&self, variable: u32) -> bool {
        self.assignment.get(variable as usize).copied().unwrap_or(false)
    }

    fn conflicts(&self) -> u64 {
        0
    }

    fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }
}
