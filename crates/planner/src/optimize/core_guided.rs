//! Core-guided optimisation: unsatisfiable cores raise the lower bound until a plan with this cost exists
//! (OLL \[1, 2\]).
//!
//! The cost of a plan above the lower bound is a weighted sum of soft literals, all of which are assumed to be
//! false. The solver returns either a plan, which is then a cheapest plan, or a core: a set of soft literals at
//! least one of which is true in every plan. The lower bound then rises by the minimum weight in the core, and this
//! weight is subtracted from all weights in the core. Plans in which several literals of the core are true cost
//! more; the outputs of a totalizer represent this and are added one by one as soft literals of the same weight.
//! Literals with high weight are assumed first (stratification \[3\]), so that plans are found early. A literal
//! whose weight would raise the lower bound above the cost limit is fixed to false (hardening \[3\]).
//!
//! \[1\] B. Andres, B. Kaufmann, O. Matheis, T. Schaub: Unsatisfiability-based optimization in
//! clasp, ICLP 2012.
//! \[2\] A. Morgado, C. Dodaro, J. Marques-Silva: Core-guided `MaxSAT` with soft cardinality
//! constraints, CP 2014.
//! \[3\] C. Ansótegui, M. L. Bonet, J. Gabàs, J. Levy: Improving SAT-based weighted `MaxSAT`
//! solvers, CP 2012.

use std::collections::BTreeMap;

use encodings::encode::{Encoding, Family, Formula, VariableMeaning};
use encodings::sat::{Answer, Lit, Totalizer};
use rustc_hash::FxHashMap;
use task::number::{Int, dense};

use crate::optimize::optimizer_run::{Best, IncrementalSolver, Run, StrategyOutcome};

const CORE_TRIM_ROUNDS: usize = 4;

struct Search {
    lower: Int,
    /// Weight of each soft literal, at least 1. A true literal adds its weight to the cost.
    weights: BTreeMap<Lit, Int>,
    totalizers: Vec<Totalizer>,
    /// Soft literals that are totalizer outputs: the index of the totalizer, and the number n such that the
    /// literal is true if more than n inputs are true.
    outputs: FxHashMap<Lit, (usize, usize)>,
}

impl Search {
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "weights of one source are differences of its amounts, which are at most the gap"
    )]
    fn new(encoding: &Encoding<'_>) -> Self {
        let (lower, literals) = encoding.payments();
        let mut weights = BTreeMap::new();
        for (literal, weight) in literals {
            *weights.entry(*literal).or_default() += weight;
        }
        Self { lower, weights, totalizers: Vec::new(), outputs: FxHashMap::default() }
    }

    fn assumptions(&self, least: Int) -> Vec<Lit> {
        self.weights.iter().filter(|(_, weight)| **weight >= least).map(|(literal, _)| !*literal).collect()
    }

    /// Minimum weight of the next stratum: the greatest weight that is at most `than / 2`, or
    /// otherwise the least weight below `than`. `None` if there is no lower weight.
    fn lighter(&self, than: Int) -> Option<Int> {
        let below = self.weights.values().copied().filter(|weight| *weight < than);
        let lightest = below.clone().min()?;
        Some(below.filter(|weight| *weight <= than / 2).max().unwrap_or(lightest))
    }

    /// Raises the lower bound, reduces the weights of the core, and adds totalizer outputs as soft literals. At least
    /// one literal of the core is true in every plan within the cost limit.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "a core has weights that are at most what the limit leaves, and the least of them is taken off each"
    )]
    fn pay(&mut self, core: &[Lit], formula: &mut Formula) {
        let weight = core.iter().filter_map(|literal| self.weights.get(literal)).copied().min().unwrap_or(0);
        self.lower += weight;
        for literal in core {
            if let Some(literal_weight) = self.weights.get_mut(literal) {
                *literal_weight -= weight;
                if *literal_weight == 0 {
                    self.weights.remove(literal);
                }
            }
            if let Some((totalizer, count)) = self.outputs.get(literal).copied() {
                self.output(totalizer, count + 1, weight, formula);
            }
        }
        formula.add(Family::Bound, core.iter().copied());
        if core.len() > 1 {
            let newest = self.totalizers.len();
            self.totalizers.push(Totalizer::new(core));
            self.output(newest, 1, weight, formula);
        }
    }

    /// Adds a soft literal of the given weight that is true if more than `count` inputs of a totalizer are
    /// true. Has no effect if the totalizer does not have more than `count` inputs.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "weights are at most what the limit on the cost leaves, and each core has its own literals"
    )]
    fn output(&mut self, totalizer: usize, count: usize, weight: Int, formula: &mut Formula) {
        let mut variables = dense(formula.variables());
        let mut clauses = Vec::new();
        let add = |clause: &[Lit]| clauses.push(clause.to_vec());
        let Some(literal) = self.totalizers[totalizer].more_than(count, &mut variables, add) else { return };
        while formula.variables() < variables as usize {
            formula.fresh(VariableMeaning::Paid);
        }
        for clause in clauses {
            formula.add(Family::Bound, clause);
        }
        *self.weights.entry(literal).or_default() += weight;
        self.outputs.insert(literal, (totalizer, count));
    }

    /// Fixes each soft literal to false whose weight, added to the lower bound, exceeds the limit (hardening).
    fn harden(&mut self, limit: Int, formula: &mut Formula) {
        let lower = self.lower;
        let heavy: Vec<Lit> = self
            .weights
            .iter()
            .filter(|(_, weight)| **weight > limit.saturating_sub(lower))
            .map(|(literal, _)| *literal)
            .collect();
        for literal in heavy {
            formula.add(Family::Bound, [!literal]);
            self.weights.remove(&literal);
        }
    }
}

/// Raises the lower bound on the cost of the formula's plans until it exceeds `limit`, it equals the cost of a
/// plan, or a resource limit is reached. Stores cheaper plans and the raised bound in `best`.
pub(super) fn raise(
    run: &mut Run<'_>,
    mut encoding: Encoding<'_>,
    limit: Int,
    best: &mut Best,
) -> StrategyOutcome {
    let mut search = Search::new(&encoding);
    let mut live = run.live(u64::MAX);
    let mut least = search.lighter(Int::MAX).unwrap_or(Int::MAX);
    loop {
        let limit = limit.min(best.plan.below());
        if search.lower > limit {
            return StrategyOutcome::Exhausted;
        }
        search.harden(limit, &mut encoding.formula);
        match run.call(&mut live, &encoding, &search.assumptions(least)) {
            (Answer::Unsatisfiable, _) => {
                let core = match trimmed(run, &mut live, &encoding) {
                    Some(core) if core.is_empty() => return StrategyOutcome::Exhausted,
                    Some(core) => core,
                    None => return StrategyOutcome::Interrupted,
                };
                search.pay(&core, &mut encoding.formula);
                if search.lower > best.lower {
                    best.lower = search.lower.min(limit.saturating_add(1));
                    run.announce(best, encoding.horizon());
                }
            }
            (_, None) => return StrategyOutcome::Interrupted,
            (_, Some(plan)) => {
                if plan.cost < best.plan.cost {
                    best.plan = plan;
                    run.announce(best, encoding.horizon());
                }
                match search.lighter(least) {
                    Some(lighter) => least = lighter,
                    None => return StrategyOutcome::Exhausted,
                }
            }
        }
    }
}

/// Returns the core of the last solver call, reduced by further calls. Returns `None` if such a call does not
/// report unsatisfiability, for example at a limit.
fn trimmed(run: &mut Run<'_>, live: &mut IncrementalSolver, encoding: &Encoding<'_>) -> Option<Vec<Lit>> {
    let mut core = live.solver.core().to_vec();
    for _ in 0..CORE_TRIM_ROUNDS {
        if core.len() < 2 {
            break;
        }
        // A call that assumes only the literals of the core often returns a smaller core.
        match run.call(live, encoding, &core) {
            (Answer::Unsatisfiable, _) if live.solver.core().len() < core.len() => {
                core = live.solver.core().to_vec();
            }
            (Answer::Unsatisfiable, _) => break,
            _ => return None,
        }
    }
    core.sort_unstable();
    Some(core.into_iter().map(|literal| !literal).collect())
}
