//! Computes the values of path formulas and of reward formulas in all states.

use fixedbitset::FixedBitSet;
use num_traits::ToPrimitive;

use crate::check::ask::{Checked, property_error, refusal, within_budget};
use crate::check::query::Query;
use crate::check::steps::{self, Stepped};
use crate::check::vector::{Span, Vector};
use crate::number::{Number, count, is_whole};
use crate::policy::{attains, with_secondary};
use crate::prism::ast::{ModelKind, Path, RewardPath, StepBound, Steps};
use crate::solve::{Direction, Problem, Solution, draft, solve_within};

const MAX_STEPS: u32 = 1_000_000_000;

#[derive(Debug)]
pub struct Valued<N> {
    pub vector: Vector<N>,
    pub policy: Option<Vec<u32>>,
}

impl<N> From<Vector<N>> for Valued<N> {
    fn from(vector: Vector<N>) -> Self {
        Self { vector, policy: None }
    }
}

/// The bounds on the number of steps, inclusive; `most` is `None` without an upper bound.
#[derive(Debug, Clone, Copy)]
pub struct Range {
    pub least: u32,
    pub most: Option<u32>,
}

pub fn opposite(direction: Direction) -> Direction {
    if direction == Direction::Min { Direction::Max } else { Direction::Min }
}

impl<N: Number> Query<'_, N> {
    pub fn path(&self, direction: Direction, path: &Path) -> Checked<Valued<N>> {
        let n = self.mdp().states();
        match path {
            Path::State(states) => Ok(Vector::indicator(&self.truth(states)?, n).into()),
            Path::Not(inner) => Ok(complement(self.path(opposite(direction), inner)?)),
            Path::Next(goal) => {
                let values = Vector::<N>::indicator(&self.truth(goal)?, n).values;
                let no_states = FixedBitSet::with_capacity(n);
                let stepped = self.stepped(self.problem(direction, None, &no_states), values, 1)?;
                Ok(Vector::stepped(stepped, Span::Probability).into())
            }
            Path::Until(left, right, steps) => {
                self.until(direction, &self.truth(left)?, &self.truth(right)?, steps.as_deref())
            }
            Path::Globally(goal, steps) => {
                let every_state = self.every();
                // The complement of "always `goal`": a state outside `goal` is reached.
                let bad = inverse(self.truth(goal)?);
                Ok(complement(self.until(opposite(direction), &every_state, &bad, steps.as_deref())?))
            }
            Path::WeakUntil(left, right, steps) => {
                // The complement: a state in which neither formula holds is reached through states
                // with `left` but without `right`.
                let (left, right) = (self.truth(left)?, inverse(self.truth(right)?));
                let (mut keep, mut bad) = (left.clone(), inverse(left));
                keep.intersect_with(&right);
                bad.intersect_with(&right);
                Ok(complement(self.until(opposite(direction), &keep, &bad, steps.as_deref())?))
            }
            Path::Release(left, right, steps) => {
                // The complement: `right` fails before or when `left` holds for the first time.
                let (keep, bad) = (inverse(self.truth(left)?), inverse(self.truth(right)?));
                Ok(complement(self.until(opposite(direction), &keep, &bad, steps.as_deref())?))
            }
            Path::Repeatedly(goal) => self.repeatedly(direction, &self.truth(goal)?),
            Path::Persistently(goal) => {
                // The complement: states outside `goal` are visited infinitely often.
                let bad = inverse(self.truth(goal)?);
                Ok(complement(self.repeatedly(opposite(direction), &bad)?))
            }
        }
    }

    fn until(
        &self,
        direction: Direction,
        left: &FixedBitSet,
        right: &FixedBitSet,
        steps: Option<&Steps>,
    ) -> Checked<Valued<N>> {
        let mut blocked = left.clone();
        blocked.union_with(right);
        blocked.toggle_range(..);
        let problem = Problem { blocked: Some(&blocked), ..self.problem(direction, None, right) };
        let Some(steps) = steps else { return self.solved(problem) };
        if let Some(name) = &steps.reward {
            return self.until_within_reward(problem, name.as_deref(), steps);
        }
        let Range { least, most } = self.span(steps)?;
        let then = match most {
            None => self.solved(problem)?.vector,
            Some(most) => {
                let values = Vector::<N>::indicator(right, self.mdp().states()).values;
                let stepped = self.stepped(problem, values, most.saturating_sub(least))?;
                Vector::stepped(stepped, Span::Probability)
            }
        };
        if least == 0 {
            return Ok(then.into());
        }
        // Before the lower bound on the number of steps is reached, `left` must hold, regardless of `right`.
        let (no_states, outside) = (FixedBitSet::with_capacity(left.len()), inverse(left.clone()));
        let before = Problem { blocked: Some(&outside), ..self.problem(direction, None, &no_states) };
        let errors = then.errors;
        let Stepped { mut values, relative, lost } = self.stepped(before, then.values, 1)?;
        for state in outside.ones() {
            values[state] = N::zero();
        }
        let mut stepped = self.stepped(before, values, least.saturating_sub(1))?;
        // The step that was computed separately rounds, too. Its error is not yet counted.
        stepped.relative += relative;
        stepped.lost |= lost;
        let mut vector = Vector::stepped(stepped, Span::Probability);
        let first = errors.iter().fold(0.0_f64, |most, error| most.max(*error));
        for error in &mut vector.errors {
            *error += first;
        }
        Ok(vector.into())
    }

    fn span(&self, steps: &Steps) -> Checked<Range> {
        let least = match &steps.least {
            None => 0,
            Some(bound) => self.limit(bound, i8::from(bound.strict))?,
        };
        let Some(bound) = &steps.most else { return Ok(Range { least, most: None }) };
        let most = self.at_most(bound)?;
        if most < least {
            let text = "no number of steps is within these bounds";
            return Err(property_error("Q503", bound.limit.place, text).into());
        }
        Ok(Range { least, most: Some(most) })
    }

    fn at_most(&self, bound: &StepBound) -> Checked<u32> {
        self.limit(bound, 0_i8.saturating_sub(i8::from(bound.strict)))
    }

    /// Evaluates a step bound and adds `offset`: 1 or -1 for a strict bound, otherwise 0. Fails unless the
    /// result is at least 0 and below [`MAX_STEPS`].
    fn limit(&self, bound: &StepBound, offset: i8) -> Checked<u32> {
        // `validate` has checked that the bound is an integer.
        let limit = self.constant(&bound.limit)?.to_integer() + offset;
        Ok(limit.to_u32().filter(|most| *most < MAX_STEPS).ok_or_else(|| {
            let text = if offset < 0 {
                "the number of steps must be at least 1 and at most 10^9 for `<`"
            } else {
                "the number of steps must be at least 0 and below 10^9"
            };
            property_error("Q503", bound.limit.place, text)
        })?)
    }

    pub fn reward(&self, direction: Direction, name: Option<&str>, path: &RewardPath) -> Checked<Valued<N>> {
        let n = self.mdp().states();
        let no_states = FixedBitSet::with_capacity(n);
        match path {
            RewardPath::Reach(goal) => {
                let terminal = self.truth(goal)?;
                self.solved(self.problem(direction, Some(self.rewards(name)?), &terminal))
            }
            RewardPath::Steps(bound) => {
                let limit = self.at_most(bound)?;
                let problem = self.problem(direction, Some(self.rewards(name)?), &no_states);
                let stepped = self.stepped(problem, vec![N::zero(); n], limit)?;
                Ok(Vector::stepped(stepped, Span::Positive).into())
            }
            RewardPath::Instant(limit) => {
                let limit = self.at_most(&StepBound { limit: limit.clone(), strict: false })?;
                let values = self.state_rewards(name)?;
                // A sum of rewards is exact if it is an integer. Otherwise, each reward and each addition is rounded.
                let is_exact = N::EXACT || values.iter().all(|value| is_whole(value.to_f64()));
                let mut stepped = self.stepped(self.problem(direction, None, &no_states), values, limit)?;
                if !is_exact {
                    stepped.relative += (count(self.state_reward_count(name)?) + 1.0) * f64::EPSILON;
                }
                Ok(Vector::stepped(stepped, Span::Positive).into())
            }
            RewardPath::Total => self.total(direction, self.rewards(name)?),
            RewardPath::LongRun if self.program.kind == ModelKind::Dtmc => self.long_run(self.rewards(name)?),
            RewardPath::LongRun => {
                Err(refusal("Q403", "`S` is supported for Markov chains only, not for decision processes"))
            }
        }
    }

    /// Applies the Bellman operator `steps` times to `values`, the values after the last step. If a policy is
    /// given, only its choices are considered.
    fn stepped(&self, problem: Problem<'_, N>, values: Vec<N>, steps: u32) -> Checked<Stepped<N>> {
        let problem = Problem { allowed: self.evaluated.as_ref(), ..problem };
        within_budget(steps::apply(problem, values, steps, &mut self.work.borrow_mut()))
    }

    pub fn problem<'p>(
        &'p self,
        direction: Direction,
        rewards: Option<&'p [N]>,
        terminal: &'p FixedBitSet,
    ) -> Problem<'p, N> {
        Problem::new(self.mdp(), direction, rewards, terminal)
    }

    /// Computes the optimal values, or the values of the given policy if there is one. If an optimal policy is
    /// reported, ties between optimal choices are broken by the secondary reward (by default, the number of
    /// steps), where [`with_secondary`] permits this and the resulting policy is still optimal.
    pub fn solved(&self, problem: Problem<'_, N>) -> Checked<Valued<N>> {
        let span = if problem.rewards.is_none() { Span::Probability } else { Span::Positive };
        let problem = Problem { allowed: self.evaluated.as_ref(), ..problem };
        let solution = within_budget(self.solve_hinted(problem))?;
        let mut policy = solution.policy.clone();
        if self.options.policy && self.evaluated.is_none() {
            let secondary = match &self.options.secondary {
                Some(name) => self.rewards(Some(name))?.to_vec(),
                None => vec![N::one(); self.mdp().choice_count()],
            };
            // In exact arithmetic, each policy of optimal choices that ends is optimal.
            if let Some(second) = with_secondary(&problem, &solution, &secondary)
                && (N::EXACT || attains(problem, &second.policy, &solution) == Some(true))
            {
                policy = second.policy;
            }
        }
        Ok(Valued { vector: Vector::solved(solution, span), policy: Some(policy) })
    }

    /// Solves a problem; returns `None` if exact arithmetic exceeds its budget. If no policy is given, exact
    /// policy iteration starts from a policy computed in doubles, where possible.
    fn solve_hinted(&self, problem: Problem<'_, N>) -> Option<Solution<N>> {
        let doubles = self.doubles.as_ref().filter(|_| problem.allowed.is_none());
        let hint = doubles.and_then(|mdp| {
            let rewards: Option<Vec<f64>> =
                problem.rewards.map(|rewards| rewards.iter().map(Number::to_f64).collect());
            let Problem { direction, terminal, blocked, .. } = problem;
            draft(Problem { blocked, ..Problem::new(mdp, direction, rewards.as_deref(), terminal) })
        });
        solve_within(problem, hint.as_deref(), &mut self.work.borrow_mut())
    }
}

/// Converts probabilities to the complementary ones. The policy stays: minimising an event
/// maximises its complement.
fn complement<N: Number>(values: Valued<N>) -> Valued<N> {
    Valued { vector: values.vector.complement(), policy: values.policy }
}

pub fn inverse(mut set: FixedBitSet) -> FixedBitSet {
    set.toggle_range(..);
    set
}
