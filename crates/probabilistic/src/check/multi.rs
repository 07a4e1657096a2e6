//! Multi-objective properties with two objectives.

use crate::check::answer::{Answer, Outcome};
use crate::check::ask::{Checked, Stop, property_error, refusal};
use crate::check::query::Query;
use crate::error::Place;
use crate::number::Number;
use crate::pareto::{Bounded, Objective, Optimum, Pareto};
use crate::prism::ast::{BinaryOp, ExprKind, Path, Property, Question, RewardPath};
use crate::solve::Direction;

impl<N: Number> Query<'_, N> {
    /// Computes the Pareto front of two objectives. If one of them has a bound, computes the optimum of the
    /// other one instead.
    pub fn multi(&self, parts: &[Property]) -> Checked<Outcome> {
        let place = Place { line: 1, column: 1 };
        let [first, second] = parts else {
            return Err(property_error("Q403", place, "`multi` is supported with two objectives").into());
        };
        // If one objective has a bound, it is placed second.
        let (first, second) = if first.bound().is_some() { (second, first) } else { (first, second) };
        if first.bound().is_some() {
            return Err(property_error("Q403", place, "one objective of `multi` must ask for a value").into());
        }
        let objectives = [self.objective(first)?, self.objective(second)?];
        // The copies share the request to cancel with the query, which otherwise would be answered in doubles.
        let mut work = *self.work.borrow();
        let pareto = Pareto::within(self.mdp(), &objectives, &mut work);
        self.work.borrow_mut().continue_from(&work);
        let Ok(pareto) = pareto else { return Err(Stop::TooMuchWork) };
        let answer_of = |number: usize, loss: &N, error: f64| {
            let value = match objectives[number].rewards {
                Some(_) => loss.clone(),
                None => N::one().minus(loss),
            };
            let answer = Answer::from_number(&value, error);
            if objectives[number].rewards.is_none() { answer.probability() } else { answer }
        };
        if let Some((_, bound)) = second.bound() {
            let bound = N::from_rational(&self.constant(bound)?);
            let limit = if objectives[1].rewards.is_some() { bound } else { N::one().minus(&bound) };
            let optimum = pareto.constrained(&limit);
            self.work.borrow_mut().continue_from(&pareto.work());
            let Ok(optimum) = optimum else { return Err(Stop::TooMuchWork) };
            let constrained_answer = |bounded: Bounded<N>| {
                if N::EXACT {
                    return answer_of(0, &bounded.value, 0.0);
                }
                let answer = Answer::between(bounded.value.to_f64(), [bounded.lower, bounded.upper]);
                if objectives[0].rewards.is_none() { answer.complement() } else { answer }
            };
            return Ok(constrained(optimum, constrained_answer));
        }
        let vertices = pareto.vertices(None);
        self.work.borrow_mut().continue_from(&pareto.work());
        let Ok(vertices) = vertices else { return Err(Stop::TooMuchWork) };
        let pairs = vertices.iter().map(|vertex| {
            [0, 1].map(|number| answer_of(number, &vertex.losses[number], vertex.errors[number]))
        });
        Ok(Outcome::Front(pairs.collect()))
    }

    fn objective(&self, property: &Property) -> Checked<Objective<N>> {
        let refuse = |text: &str| Err(refusal("Q403", text));
        match property {
            Property::Reward(question, name, path) if reaches(path) => {
                let RewardPath::Reach(goal) = path else { return refuse("only `F`") };
                if !asks(question, Direction::Min, BinaryOp::LessEqual) {
                    return refuse("rewards in `multi` are minimised, or bounded with `<=`");
                }
                let rewards = Some(self.rewards(name.as_deref())?.to_vec());
                Ok(Objective { rewards, target: self.truth(goal)? })
            }
            Property::Probability(question, Path::Until(left, goal, None))
                if left.kind == ExprKind::Bool(true) =>
            {
                if !asks(question, Direction::Max, BinaryOp::GreaterEqual) {
                    return refuse("probabilities in `multi` are maximised, or bounded with `>=`");
                }
                Ok(Objective { rewards: None, target: self.truth(goal)? })
            }
            _ => refuse("objectives of `multi` are `R…min=? [ F … ]` and `Pmax=? [ F … ]`"),
        }
    }
}

/// Returns `true` if a question asks for the optimum in `direction`, or has a bound with the operator `bound_op`, with or
/// without this direction.
fn asks(question: &Question, direction: Direction, bound_op: BinaryOp) -> bool {
    match &question.bound {
        None => question.direction == Some(direction),
        Some((op, _)) => *op == bound_op && question.direction.is_none_or(|requested| requested == direction),
    }
}

fn constrained<N: Number>(optimum: Optimum<N>, answer_of: impl Fn(Bounded<N>) -> Answer) -> Outcome {
    match optimum {
        Optimum::Infeasible { proved } => {
            Outcome::Constrained { randomised: Answer::Undefined, deterministic: Answer::Undefined, proved }
        }
        Optimum::Found(optimum) => {
            let proved = optimum.deterministic.as_ref().is_some_and(|(_, proved)| *proved);
            Outcome::Constrained {
                randomised: answer_of(optimum.randomised),
                deterministic: optimum.deterministic.map_or(Answer::Undefined, |(value, _)| answer_of(value)),
                proved,
            }
        }
    }
}

fn reaches(path: &RewardPath) -> bool {
    matches!(path, RewardPath::Reach(_))
}
