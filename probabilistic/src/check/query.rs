//! A property and an explored model to an outcome, in one kind of number.

use std::cell::RefCell;

use fixedbitset::FixedBitSet;
use num_rational::BigRational;
use num_traits::ToPrimitive;

use crate::check::answer::{Answer, Outcome};
use crate::check::options::Options;
use crate::check::steps;
use crate::error::{Diagnostic, Error, Place};
use crate::explore::{DEADLOCK, Explored};
use crate::mdp::Mdp;
use crate::number::Number;
use crate::pareto::{Bounded, Constrained, Objective, Pareto};
use crate::policy::{choices_of, evaluate, with_secondary};
use crate::prism::ast::{BinaryOp, Expr, ExprKind, ModelKind, Type};
use crate::prism::{Code, Names, Packed, Program};
use crate::property::{Path, Property, Question, RewardPath, Steps};
use crate::solve::{Direction, Problem, Solution, Work, draft, solve_within};

/// Fewer steps than this are counted one by one.
const STEPS: u32 = 1_000_000_000;

/// What a query needs.
pub struct Query<'a, N> {
    pub program: &'a Program<N>,
    pub explored: &'a Explored<Packed, N>,
    /// The numbers of the reward structures that were computed.
    pub wanted: &'a [usize],
    /// The process in doubles, to find a policy to start from.
    pub doubles: Option<Mdp<f64>>,
    /// What exact arithmetic may still cost.
    pub work: RefCell<Work>,
}

/// An answer, and the policy that has it. None where exact arithmetic takes too long.
type Valued = Option<(Answer, Option<Vec<u32>>)>;
/// An outcome, and the policy that has it. None where exact arithmetic takes too long.
type Found = Option<(Outcome, Option<Vec<u32>>)>;

/// The number of a reward structure.
pub fn structure(names: &[String], name: Option<&str>) -> Result<usize, Error> {
    let found = match name {
        None => (!names.is_empty()).then_some(0),
        Some(name) => names.iter().position(|known| known == name),
    };
    found.ok_or_else(|| {
        let text = match name {
            Some(name) => format!("there are no rewards `\"{name}\"`; there are: {}", names.join(", ")),
            None => "the model has no rewards".to_owned(),
        };
        property_error("Q202", Place { line: 1, column: 1 }, &text)
    })
}

fn property_error(code: &'static str, place: Place, text: &str) -> Error {
    Error::Property(vec![Diagnostic::new(code, place, text)])
}

/// Finds what is wrong with a property before anything is explored.
pub fn validate<N: Number>(program: &Program<N>, property: &Property) -> Result<(), Error> {
    let mut names = program.names.clone();
    let mut problems = Vec::new();
    let mut check = |expression: &Expr, kind| {
        if let Err(problem) = typed(&mut names, expression, kind) {
            problems.push(problem);
        }
    };
    let mut parts = vec![property];
    while let Some(part) = parts.pop() {
        let question = match part {
            Property::Multi(more) => {
                parts.extend(more);
                continue;
            }
            Property::Probability(question, path) => {
                match path {
                    Path::Next(goal) | Path::Globally(goal, None) => check(goal, Type::Bool),
                    Path::Globally(goal, Some(steps)) => {
                        check(goal, Type::Bool);
                        check(&steps.limit, Type::Int);
                    }
                    Path::Until(left, right, steps) => {
                        check(left, Type::Bool);
                        check(right, Type::Bool);
                        if let Some(steps) = steps {
                            check(&steps.limit, Type::Int);
                        }
                    }
                }
                question
            }
            Property::Reward(question, _, path) => {
                match path {
                    RewardPath::Reach(goal) => check(goal, Type::Bool),
                    RewardPath::Steps(steps) => check(&steps.limit, Type::Int),
                }
                question
            }
        };
        if let Some((_, bound)) = &question.bound {
            check(bound, Type::Double);
        }
    }
    if problems.is_empty() { Ok(()) } else { Err(Error::Property(problems)) }
}

/// An expression of a property; `"init"` and `"deadlock"` are known without declaration.
fn typed(names: &mut Names, expression: &Expr, kind: Type) -> Result<Code, Diagnostic> {
    let built_in = |label: &str| ["init", "deadlock"].contains(&label);
    match &expression.kind {
        ExprKind::Label(label) if built_in(label) && !names.labels().contains(&label.as_str()) => {
            Ok(Code::Whole(0))
        }
        _ => names.typed(expression, kind),
    }
}

impl<N: Number> Query<'_, N> {
    fn mdp(&self) -> &Mdp<N> {
        &self.explored.mdp
    }

    /// Answers a property.
    pub fn answer(&self, property: &Property, options: &Options<'_>) -> Result<Found, Error> {
        match property {
            Property::Multi(_) if options.evaluate.is_some() => {
                let text = "a policy is evaluated for one objective at a time";
                Err(property_error("Q403", Place { line: 1, column: 1 }, text))
            }
            Property::Multi(parts) => self.multi(parts),
            Property::Probability(question, path) => {
                let direction = self.direction(question)?;
                let found = self.probability(direction, path, options)?;
                self.judge(found, question)
            }
            Property::Reward(question, name, path) => {
                let direction = self.direction(question)?;
                let rewards = self.rewards(name.as_deref())?;
                let found = match path {
                    RewardPath::Reach(goal) => {
                        let terminal = self.states(goal)?;
                        let problem = self.problem(direction, Some(rewards), &terminal);
                        self.solved(problem, options, false)?
                    }
                    RewardPath::Steps(limit) => {
                        let none = FixedBitSet::with_capacity(self.mdp().states());
                        let problem = self.problem(direction, Some(rewards), &none);
                        self.stepped(problem, vec![N::zero(); self.mdp().states()], limit, options)?
                    }
                };
                self.judge(found, question)
            }
        }
    }

    /// Least or greatest: as it is asked, or as the bound needs it for all policies.
    fn direction(&self, question: &Question) -> Result<Direction, Error> {
        match (question.direction, &question.bound) {
            (Some(direction), _) => Ok(direction),
            (None, Some((BinaryOp::Less | BinaryOp::LessEqual, _))) => Ok(Direction::Max),
            (None, Some(_)) => Ok(Direction::Min),
            (None, None) if self.program.kind == ModelKind::Dtmc => Ok(Direction::Max),
            (None, None) => {
                let text = "a decision process has many policies: ask for `min` or `max`";
                Err(property_error("Q502", Place { line: 1, column: 1 }, text))
            }
        }
    }

    fn judge(&self, found: Valued, question: &Question) -> Result<Found, Error> {
        let Some((answer, policy)) = found else { return Ok(None) };
        let Some((op, bound)) = &question.bound else {
            return Ok(Some((Outcome::Value(answer), policy)));
        };
        let bound = self.constant(bound)?;
        let holds = |value: Option<BigRational>| {
            compare(*op, value.map_or(std::cmp::Ordering::Greater, |value| value.cmp(&bound)))
        };
        let outcome = match &answer {
            Answer::Finite(quantity) => {
                let end = |end: f64| quantity.exact.clone().or_else(|| BigRational::from_float(end));
                let (low, high) = (holds(end(quantity.lower)), holds(end(quantity.upper)));
                if low == high { Outcome::Truth(low, Some(answer)) } else { Outcome::Undecided(answer) }
            }
            _ => Outcome::Truth(holds(None), Some(answer)),
        };
        Ok(Some((outcome, policy)))
    }

    fn probability(&self, direction: Direction, path: &Path, options: &Options<'_>) -> Result<Valued, Error> {
        let opposite = if direction == Direction::Min { Direction::Max } else { Direction::Min };
        match path {
            Path::Next(goal) => {
                let values = indicator(&self.states(goal)?, self.mdp().states());
                let none = FixedBitSet::with_capacity(self.mdp().states());
                let once = Steps { limit: Expr::int(1), strict: false };
                self.stepped(self.problem(direction, None, &none), values, &once, options)
            }
            Path::Globally(goal, limit) => {
                let not = Expr { kind: ExprKind::Not(Box::new(goal.clone())), place: goal.place };
                let until = Path::Until(Expr::bool(true), not, limit.clone());
                let found = self.probability(opposite, &until, options)?;
                Ok(found.map(|(answer, policy)| (answer.complement(), policy)))
            }
            Path::Until(left, right, None) => {
                let (terminal, blocked) = self.until(left, right)?;
                let problem = Problem { blocked: Some(&blocked), ..self.problem(direction, None, &terminal) };
                self.solved(problem, options, true)
            }
            Path::Until(left, right, Some(limit)) => {
                let (terminal, blocked) = self.until(left, right)?;
                let values = indicator(&terminal, self.mdp().states());
                let problem = Problem { blocked: Some(&blocked), ..self.problem(direction, None, &terminal) };
                self.stepped(problem, values, limit, options)
            }
        }
    }

    /// Values after so many steps, of the best policy or of the one that was given.
    fn stepped(
        &self,
        problem: Problem<'_, N>,
        values: Vec<N>,
        limit: &Steps,
        options: &Options<'_>,
    ) -> Result<Valued, Error> {
        let given = options.evaluate.as_ref().map(|table| table.choices(self.program, self.explored));
        let allowed = given.transpose()?.map(|policy| choices_of(self.mdp(), &policy));
        let problem = Problem { allowed: allowed.as_ref(), ..problem };
        let found = steps::apply(problem, values, self.limit(limit)?, &mut self.work.borrow_mut());
        Ok(found.map(|found| {
            let answer = Answer::from_number(&found.values[0], found.error(0));
            (if problem.rewards.is_none() { answer.probability() } else { answer }, None)
        }))
    }

    /// The states at which an until-path ends well, and those at which it ends badly.
    fn until(&self, left: &Expr, right: &Expr) -> Result<(FixedBitSet, FixedBitSet), Error> {
        let terminal = self.states(right)?;
        let mut blocked = self.states(left)?;
        blocked.toggle_range(..);
        blocked.difference_with(&terminal);
        Ok((terminal, blocked))
    }

    fn problem<'p>(
        &'p self,
        direction: Direction,
        rewards: Option<&'p [N]>,
        terminal: &'p FixedBitSet,
    ) -> Problem<'p, N> {
        Problem::new(self.mdp(), direction, rewards, terminal)
    }

    /// Solves a problem, or evaluates the policy that was given; breaks the ties of the policy.
    fn solved(
        &self,
        problem: Problem<'_, N>,
        options: &Options<'_>,
        is_probability: bool,
    ) -> Result<Valued, Error> {
        let clip = |answer: Answer| if is_probability { answer.probability() } else { answer };
        if let Some(table) = &options.evaluate {
            let policy = table.choices(self.program, self.explored)?;
            let solution = evaluate(problem, &policy);
            return Ok(solution.map(|solution| (clip(Answer::of(&solution, 0)), Some(policy))));
        }
        let Some(solution) = self.solve_hinted(problem) else { return Ok(None) };
        let mut policy = solution.policy.clone();
        if options.policy {
            let secondary = match &options.secondary {
                Some(name) => self.rewards(Some(name))?.to_vec(),
                None => vec![N::one(); self.mdp().choice_count()],
            };
            if let Some(second) = with_secondary(&problem, &solution, &secondary) {
                for (choice, better) in policy.iter_mut().zip(&second.policy) {
                    *choice = *better;
                }
            }
        }
        Ok(Some((clip(Answer::of(&solution, 0)), Some(policy))))
    }

    /// Solves a problem, from a policy that is good in doubles where arithmetic is exact.
    fn solve_hinted(&self, problem: Problem<'_, N>) -> Option<Solution<N>> {
        let hint = self.doubles.as_ref().and_then(|mdp| {
            let rewards: Option<Vec<f64>> =
                problem.rewards.map(|rewards| rewards.iter().map(Number::to_f64).collect());
            let Problem { direction, terminal, blocked, .. } = problem;
            draft(Problem { blocked, ..Problem::new(mdp, direction, rewards.as_deref(), terminal) })
        });
        solve_within(problem, hint.as_deref(), &mut self.work.borrow_mut())
    }

    fn rewards(&self, name: Option<&str>) -> Result<&[N], Error> {
        let number = structure(&self.program.reward_names, name)?;
        let at = self.wanted.iter().position(|wanted| *wanted == number);
        let at = at.ok_or_else(|| Error::Policy("these rewards were not computed".to_owned()))?;
        Ok(&self.explored.rewards[at])
    }

    fn constant(&self, expression: &Expr) -> Result<BigRational, Error> {
        let mut names = self.program.names.clone();
        let code = names.constant(expression, Type::Double);
        let value = code.and_then(|code| {
            code.number(&[]).map_err(|fault| Diagnostic::new("Q303", expression.place, fault.0))
        });
        value.map_err(|problem| Error::Property(vec![problem]))
    }

    fn limit(&self, steps: &Steps) -> Result<u32, Error> {
        // It is whole, which `validate` has seen to.
        let limit = self.constant(&steps.limit)?.to_integer() - u8::from(steps.strict);
        limit.to_u32().filter(|most| *most < STEPS).ok_or_else(|| {
            let text = "the number of steps must be at least 0 and below 10^9";
            property_error("Q503", steps.limit.place, text)
        })
    }

    /// The states in which an expression holds.
    fn states(&self, expression: &Expr) -> Result<FixedBitSet, Error> {
        let n = self.mdp().states();
        let mut found = FixedBitSet::with_capacity(n);
        let mut names = self.program.names.clone();
        if let ExprKind::Label(label) = &expression.kind
            && !names.labels().contains(&label.as_str())
        {
            let is_deadlock =
                |state: usize| self.mdp().choices(state).any(|choice| self.mdp().action(choice) == DEADLOCK);
            for state in 0..n {
                found.set(state, if label == "init" { state == 0 } else { is_deadlock(state) });
            }
            return Ok(found);
        }
        let code = names.typed(expression, Type::Bool).map_err(|problem| Error::Property(vec![problem]))?;
        let mut values = Vec::new();
        for (number, state) in self.explored.states.iter().enumerate() {
            self.program.unpack(state, &mut values);
            let holds =
                code.holds(&values).map_err(|fault| property_error("Q303", expression.place, fault.0))?;
            found.set(number, holds);
        }
        Ok(found)
    }

    fn multi(&self, parts: &[Property]) -> Result<Found, Error> {
        let place = Place { line: 1, column: 1 };
        let [first, second] = parts else {
            return Err(property_error("Q403", place, "`multi` is handled with two objectives"));
        };
        let (first, second, swapped) =
            if bound_of(first).is_some() { (second, first, true) } else { (first, second, false) };
        if bound_of(first).is_some() {
            return Err(property_error("Q403", place, "one objective of `multi` must ask for a value"));
        }
        let objectives = [self.objective(first)?, self.objective(second)?];
        let Ok(pareto) = Pareto::new(self.mdp(), &objectives) else { return Ok(None) };
        let shown = |number: usize, loss: &N, error: f64| {
            let value = match objectives[number].rewards {
                Some(_) => loss.clone(),
                None => N::one().minus(loss),
            };
            let answer = Answer::from_number(&value, error);
            if objectives[number].rewards.is_none() { answer.probability() } else { answer }
        };
        if let Some((_, bound)) = bound_of(second) {
            let bound = N::from_rational(&self.constant(bound)?);
            let limit = if objectives[1].rewards.is_some() { bound } else { N::one().minus(&bound) };
            let Ok(found) = pareto.constrained(&limit) else { return Ok(None) };
            let shown = |found: Bounded<N>| {
                if N::EXACT {
                    return shown(0, &found.value, 0.0);
                }
                let answer = Answer::between(found.value.to_f64(), [found.lower, found.upper]);
                if objectives[0].rewards.is_none() { answer.complement() } else { answer }
            };
            return Ok(Some((constrained(found, shown), None)));
        }
        let Ok(vertices) = pareto.vertices(None) else { return Ok(None) };
        let pairs = vertices.iter().map(|vertex| {
            let pair = [0, 1].map(|number| shown(number, &vertex.losses[number], vertex.errors[number]));
            if swapped {
                let [a, b] = pair;
                [b, a]
            } else {
                pair
            }
        });
        Ok(Some((Outcome::Front(pairs.collect()), None)))
    }

    fn objective(&self, property: &Property) -> Result<Objective<N>, Error> {
        let refuse = |text: &str| Err(property_error("Q403", Place { line: 1, column: 1 }, text));
        match property {
            Property::Reward(question, name, path) if reaches(path) => {
                let RewardPath::Reach(goal) = path else { return refuse("only `F`") };
                let least = question.direction == Some(Direction::Min)
                    || matches!(question.bound, Some((BinaryOp::LessEqual, _)));
                if !least {
                    return refuse("rewards in `multi` are minimised, or bounded with `<=`");
                }
                let rewards = Some(self.rewards(name.as_deref())?.to_vec());
                Ok(Objective { rewards, target: self.states(goal)? })
            }
            Property::Probability(question, Path::Until(left, goal, None))
                if left.kind == ExprKind::Bool(true) =>
            {
                let greatest = question.direction == Some(Direction::Max)
                    || matches!(question.bound, Some((BinaryOp::GreaterEqual, _)));
                if !greatest {
                    return refuse("probabilities in `multi` are maximised, or bounded with `>=`");
                }
                Ok(Objective { rewards: None, target: self.states(goal)? })
            }
            _ => refuse("objectives of `multi` are `R…min=? [ F … ]` and `Pmax=? [ F … ]`"),
        }
    }
}

fn compare(op: BinaryOp, order: std::cmp::Ordering) -> bool {
    match op {
        BinaryOp::Less => order.is_lt(),
        BinaryOp::LessEqual => order.is_le(),
        BinaryOp::Greater => order.is_gt(),
        _ => order.is_ge(),
    }
}

fn bound_of(property: &Property) -> Option<&(BinaryOp, Expr)> {
    match property {
        Property::Probability(question, _) | Property::Reward(question, ..) => question.bound.as_ref(),
        Property::Multi(_) => None,
    }
}

fn constrained<N: Number>(found: Option<Constrained<N>>, shown: impl Fn(Bounded<N>) -> Answer) -> Outcome {
    match found {
        None => Outcome::Constrained {
            randomised: Answer::Undefined,
            deterministic: Answer::Undefined,
            proved: true,
        },
        Some(found) => {
            let proved = found.deterministic.as_ref().is_some_and(|(_, proved)| *proved);
            Outcome::Constrained {
                randomised: shown(found.randomised),
                deterministic: found.deterministic.map_or(Answer::Undefined, |(value, _)| shown(value)),
                proved,
            }
        }
    }
}

fn indicator<N: Number>(set: &FixedBitSet, states: usize) -> Vec<N> {
    (0..states).map(|state| if set.contains(state) { N::one() } else { N::zero() }).collect()
}

/// Whether a property sums rewards until something is reached.
fn reaches(path: &RewardPath) -> bool {
    matches!(path, RewardPath::Reach(_))
}
