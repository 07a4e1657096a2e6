//! An additional optimality proof for small tasks. It has three parts: a formula "some plan of at most T steps is
//! cheaper", a refutation of the formula, and a proof by potentials that no plan of more than T steps is cheaper.
//!
//! [`encoding`] is deliberately simple: one operator per step, explicit states, sums in binary. It has no time
//! windows, no reduced costs and no symmetry breaking, and shares no code with the planner's encoding. For the
//! certificate, a SAT solver refutes this formula, not the formula that found the plan. [`proof`] checks the
//! refutation clause by clause along its hints (linear RUP, as in LRAT [1]) without search. [`steps`] bounds
//! the number of steps by arithmetic on a potential, i.e. a table of lower bounds on the remaining cost.
//!
//! The checker encodes the task again and compares the result with the written formula.
//!
//! [1] Cruz-Filipe et al., "Efficient certified RAT verification", CADE 2017.

mod binary;
mod encoding;
mod formula;
pub mod lines;
mod literal;
mod proof;
mod steps;
mod sums;
mod timeline;

use std::io::BufRead;

use num_rational::BigRational;

use crate::check::{Claimed, Fault, GroundTask};
use crate::integer::Integer;
pub use formula::Formula;
pub use literal::Literal;
pub use steps::StepBounds;

/// Upper limit on the number of literals of a formula, and on the number of its variables.
pub const LITERAL_LIMIT: usize = 4_000_000;
/// The input streams of a refutation.
pub struct Inputs<'i> {
    /// The formula in the DIMACS format.
    pub formula: &'i mut dyn BufRead,
    /// The legend: one line for each variable, with its number and its description.
    pub legend: &'i mut dyn BufRead,
    /// The refutation in the DRAT format without deletions. Each clause follows by unit
    /// propagation.
    pub proof: &'i mut dyn BufRead,
    /// For each line of the proof, the numbers of the clauses from which it follows. Clauses of the
    /// formula are numbered from 1, followed by the clauses of the proof.
    pub hints: &'i mut dyn BufRead,
}

impl Claimed<'_> {
    /// Computes numbers T such that no plan of more than T steps is cheaper than the claim, if the potentials are lower
    /// bounds, which is not checked. `stop` returns `true` to cancel the computation.
    ///
    /// # Errors
    /// A missing claim, no bound on the number of steps, or a cancelled computation.
    pub fn step_bounds(&self, stop: &dyn Fn() -> bool) -> Result<StepBounds, String> {
        steps::bounds(self.model, &self.argument, self.claimed_cost()?, stop)
    }

    /// Encodes "some plan of at most `steps` steps is cheaper than the claim", with at most `literals` literals. A
    /// formula of more than [`LITERAL_LIMIT`] literals cannot be checked. `stop` returns `true` to cancel the encoding.
    ///
    /// # Errors
    /// A missing claim, an unsupported construct, an exceeded limit, or a cancelled encoding.
    pub fn formula(&self, steps: usize, literals: usize, stop: &dyn Fn() -> bool) -> Result<Formula, String> {
        encoding::encode(self.model, self.claimed_cost()?, steps, literals, stop)
    }

    fn claimed_cost(&self) -> Result<&Integer, String> {
        let reason = || "that there is no plan is not a matter of a number of steps".to_owned();
        self.cost.as_ref().ok_or_else(reason)
    }

    /// Checks the three parts of a refutation: the formula encodes the task, the proof refutes the formula, and no
    /// plan of more than `steps` steps is cheaper. Returns for each part its name with a summary, or with the
    /// reason of failure. `stop` returns `true` to cancel the check.
    pub fn check_refutation(
        &self,
        steps: usize,
        Inputs { formula: written, legend, proof, hints }: Inputs<'_>,
        stop: &dyn Fn() -> bool,
    ) -> [(&'static str, Result<String, String>); 3] {
        let Self { model, argument, cost } = self;
        let Some(cost) = cost else {
            let reason = Fault::Form { document: "the manifest", reason: "a formula without a cost".into() };
            return failed(&reason);
        };
        let steps_checked = steps::check(model, argument, cost, steps, stop).map(|position| {
            format!("no plan of more than {steps} steps is cheaper, by potential {position}")
        });
        let formula = encoding::encode(model, cost, steps, LITERAL_LIMIT, stop);
        let (formula_checked, proof_checked) = match formula {
            Ok(formula) => {
                let comparison = formula.compare(written, legend).map(|()| {
                    format!(
                        "encoding of the task for {steps} steps: {} variables, {} clauses",
                        formula.variables(),
                        formula.count()
                    )
                });
                let refuted = proof::check(formula.clauses(), formula.variables(), proof, hints)
                    .map(|count| format!("it has no model: {count} clauses follow, the last is empty"));
                (comparison, refuted)
            }
            Err(reason) => (Err(reason), Err("there is no formula to refute".to_owned())),
        };
        [("formula", formula_checked), ("proof", proof_checked), ("steps", steps_checked)]
    }
}

/// Names of the parts of a refutation, in the order of [`Claimed::check_refutation`].
pub const REFUTATION_PARTS: [&str; 3] = ["formula", "proof", "steps"];

fn failed(fault: &Fault) -> [(&'static str, Result<String, String>); 3] {
    REFUTATION_PARTS.map(|part| (part, Err(fault.to_string())))
}

/// Checks the three parts of a refutation, see [`Claimed::check_refutation`].
pub fn check_refutation(
    (task, argument): (&str, &str),
    claim: Option<&BigRational>,
    steps: usize,
    inputs: Inputs<'_>,
) -> [(&'static str, Result<String, String>); 3] {
    let task = GroundTask::read(task);
    let claimed = task.as_ref().map_err(Clone::clone).and_then(|task| Claimed::read(task, argument, claim));
    match claimed {
        Ok(claimed) => claimed.check_refutation(steps, inputs, &|| false),
        Err(fault) => failed(&fault),
    }
}
