//! Evaluates a property on an explored model. The code is generic in the number type: exact
//! rationals or doubles.

use fixedbitset::FixedBitSet;
use num_rational::BigRational;

use crate::check::answer::{Answer, Outcome};
use crate::check::ask::{Checked, Stop, refusal};
use crate::check::filters::{Filtered, extreme};
use crate::check::paths::Valued;
use crate::check::query::Query;
use crate::check::state::{compare, is_number, undecided};
use crate::check::vector::{Span, Vector};
use crate::error::Error;
use crate::number::Number;
use crate::prism::ast::{BinaryOp, Filter, ModelKind, Property, Question, Type};
use crate::solve::Direction;

/// An outcome, and for each state the choice of a policy that attains the outcome. The policy is `None` if none
/// was computed.
pub type Attained = (Outcome, Option<Vec<u32>>);

impl<N: Number> Query<'_, N> {
    /// Evaluates a property on the explored model. Returns `None` if exact arithmetic exceeds its budget,
    /// or if the caller has cancelled the computation.
    pub fn answer(&self, property: &Property) -> Result<Option<Attained>, Error> {
        match self.outcome(property) {
            Ok(answer) => Ok(Some(answer)),
            Err(Stop::TooMuchWork) => Ok(None),
            Err(Stop::Wrong(error)) => Err(error),
        }
    }

    fn outcome(&self, property: &Property) -> Checked<Attained> {
        match property {
            Property::Multi(_) if self.evaluated.is_some() => {
                Err(refusal("Q403", "a policy is evaluated for one objective at a time"))
            }
            Property::Multi(_) if self.explored.starts > 1 => {
                Err(refusal("Q403", "`multi` is supported for models with one initial state"))
            }
            Property::Multi(parts) => Ok((self.multi(parts)?, None)),
            Property::Refused(problem) => Err(Error::Property(problem.clone().into()).into()),
            Property::Probability(question, _)
            | Property::Reward(question, ..)
            | Property::SteadyState(question, _) => {
                let Valued { vector, policy } = self.valued(property)?;
                Ok((self.judged(&vector, question)?, policy))
            }
            Property::Filter(filter, inner, states) => {
                Ok((shown(self.filtered(*filter, inner, states.as_ref())?), None))
            }
            Property::Expression(inner) if self.kind_of(inner)? == Type::Bool => {
                let holds = self.truth(inner)?;
                let holds = (0..self.explored.starts).all(|start| holds.contains(start));
                Ok((Outcome::Truth(holds, None), None))
            }
            Property::Expression(inner) => {
                let mut starts = FixedBitSet::with_capacity(self.mdp().states());
                starts.insert_range(..self.explored.starts);
                Ok((self.of_starts(&self.numbers(inner, &starts)?), None))
            }
        }
    }

    fn valued(&self, property: &Property) -> Checked<Valued<N>> {
        match property {
            Property::Probability(question, path) => self.path(self.direction(question)?, path),
            Property::Reward(question, name, path) => {
                self.reward(self.direction(question)?, name.as_deref(), path)
            }
            Property::SteadyState(_, states) if self.program.kind == ModelKind::Dtmc => {
                let holds = self.truth(states)?;
                let mdp = self.mdp();
                let paid = (0..mdp.choice_count())
                    .map(|choice| if holds.contains(mdp.owner(choice)) { N::one() } else { N::zero() });
                let mut averages = self.long_run(&paid.collect::<Vec<_>>())?;
                averages.vector.span = Span::Probability;
                Ok(averages)
            }
            Property::SteadyState(..) => {
                Err(refusal("Q403", "`S` is supported for Markov chains only, not for decision processes"))
            }
            _ => Err(refusal("Q403", "`multi` cannot be a part of another property")),
        }
    }

    /// Computes the value of a numeric property in the states `wanted`, as [`Self::numbers`] does.
    pub fn property_numbers(&self, property: &Property, wanted: &FixedBitSet) -> Checked<Vector<N>> {
        match property {
            Property::Expression(inner) => self.numbers(inner, wanted),
            Property::Filter(filter, inner, states) => {
                let Filtered::Number(answer) = self.filtered(*filter, inner, states.as_ref())? else {
                    return Err(refusal("Q403", "a filter that is part of a property must have one value"));
                };
                Ok(self.everywhere(&answer))
            }
            _ => Ok(self.valued(property)?.vector),
        }
    }

    fn everywhere(&self, answer: &Answer) -> Vector<N> {
        let n = self.mdp().states();
        let Answer::Finite(quantity) = answer else {
            let mut vector = Vector::exactly(vec![N::zero(); n], Span::Any);
            vector.infinite.insert_range(..);
            return vector;
        };
        let value = quantity.exact.clone().or_else(|| BigRational::from_float(quantity.value));
        let mut vector = Vector::everywhere(&value.unwrap_or_default(), n);
        let error = (quantity.upper - quantity.value).max(quantity.value - quantity.lower);
        for bound in &mut vector.errors {
            *bound = bound.max(error.next_up());
        }
        vector
    }

    pub fn property_truth(&self, property: &Property) -> Checked<FixedBitSet> {
        let n = self.mdp().states();
        match property {
            Property::Expression(inner) => self.truth(inner),
            Property::Filter(Filter::Print | Filter::PrintAll, ..) => {
                Err(refusal("Q403", "a filter that is part of a property must have one value"))
            }
            Property::Filter(filter, inner, states) => {
                let mut satisfying = FixedBitSet::with_capacity(n);
                let Filtered::Truth(holds) = self.filtered(*filter, inner, states.as_ref())? else {
                    return Err(refusal("Q203", "a truth value is needed here, not a number"));
                };
                satisfying.set_range(.., holds);
                Ok(satisfying)
            }
            _ if is_number(property) => Err(refusal("Q203", "a truth value is needed here, not a number")),
            Property::Probability(question, _)
            | Property::Reward(question, ..)
            | Property::SteadyState(question, _) => {
                let Some((op, bound)) = &question.bound else { return Err(undecided()) };
                let bound = self.constant(bound)?;
                let vector = self.valued(property)?.vector;
                let mut satisfying = FixedBitSet::with_capacity(n);
                for state in 0..n {
                    satisfying.set(state, holds(&vector, state, *op, &bound).ok_or_else(undecided)?);
                }
                Ok(satisfying)
            }
            Property::Refused(problem) => Err(Error::Property(problem.clone().into()).into()),
            Property::Multi(_) => Err(refusal("Q403", "`multi` cannot be a part of another property")),
        }
    }

    /// Returns the requested optimisation direction (`min` or `max`). For a bound without a direction, like
    /// `P>=0.9`, returns the worst case, because the bound must hold for all policies. Fails for a decision
    /// process with neither; for a Markov chain, the direction does not matter.
    fn direction(&self, question: &Question) -> Checked<Direction> {
        match (question.direction, &question.bound) {
            (Some(direction), _) => Ok(direction),
            (None, Some((BinaryOp::Less | BinaryOp::LessEqual, _))) => Ok(Direction::Max),
            (None, Some(_)) => Ok(Direction::Min),
            (None, None) if self.program.kind == ModelKind::Dtmc => Ok(Direction::Max),
            (None, None) => {
                let text = "the value depends on the policy of a decision process: use `min` or `max`";
                Err(refusal("Q502", text))
            }
        }
    }

    fn judged(&self, vector: &Vector<N>, question: &Question) -> Checked<Outcome> {
        let Some((op, bound)) = &question.bound else { return Ok(self.of_starts(vector)) };
        let bound = self.constant(bound)?;
        let starts = 0..self.explored.starts;
        let verdicts: Vec<_> = starts.map(|start| holds(vector, start, *op, &bound)).collect();
        let answer = vector.answer(0);
        if let [verdict] = verdicts[..] {
            return Ok(match verdict {
                Some(verdict) => Outcome::Truth(verdict, Some(answer)),
                None => Outcome::Undecided(answer),
            });
        }
        Ok(match verdicts.iter().position(|verdict| *verdict != Some(true)) {
            None => Outcome::Truth(true, None),
            Some(_) if verdicts.contains(&Some(false)) => Outcome::Truth(false, None),
            Some(at) => Outcome::Undecided(vector.answer(at)),
        })
    }

    /// Returns the value in the initial state, or the least and greatest value if there are several
    /// initial states.
    fn of_starts(&self, vector: &Vector<N>) -> Outcome {
        if self.explored.starts == 1 {
            return Outcome::Value(vector.answer(0));
        }
        let mut starts = FixedBitSet::with_capacity(self.mdp().states());
        starts.insert_range(..self.explored.starts);
        let [least, greatest] = [false, true].map(|greatest| extreme(vector, &starts, greatest));
        Outcome::Range(least, greatest)
    }
}

/// Returns `Some(true)` if the value of `state` satisfies the comparison with `bound`,
/// `Some(false)` if not, and `None` if the bounds on the value do not decide.
fn holds<N: Number>(vector: &Vector<N>, state: usize, op: BinaryOp, bound: &BigRational) -> Option<bool> {
    match vector.ends(state) {
        None => Some(compare(op, std::cmp::Ordering::Greater)),
        Some((low, high)) => {
            let (low, high) = (compare(op, low.cmp(bound)), compare(op, high.cmp(bound)));
            (low == high).then_some(low)
        }
    }
}

fn shown(filtered: Filtered) -> Outcome {
    match filtered {
        Filtered::Number(answer) => Outcome::Value(answer),
        Filtered::Truth(holds) => Outcome::Truth(holds, None),
        Filtered::Range(least, greatest) => Outcome::Range(least, greatest),
        Filtered::States(states) => Outcome::States(states),
    }
}
