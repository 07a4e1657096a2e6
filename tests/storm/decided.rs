//! Tests of the model checker that do not need Storm: early termination for decided properties, and bounded
//! rewards.

use probabilistic::check::{Exactness, Options, check};
use probabilistic::explore::{Bounds, explore};
use probabilistic::prism::ast::{Model, ModelKind};
use probabilistic::prism::{self, Program, Settings};
use probabilistic::property;

use super::ours;
use super::random::{Random, questions, random_model};

/// Exploration stops at states in which the property is decided, unless a policy is requested. The answers
/// are equal to those without early termination.
#[test]
fn decided_states_are_not_explored_further() {
    let mut random = Random(7);
    let mut fewer = 0;
    for _ in 0..300 {
        let model = random_model(&mut random);
        let bounded_questions =
            ["P=? [ G \"good\" ]", "P=? [ G<=3 !\"goal\" ]", "P>=0.5 [ \"good\" U<=4 \"goal\" ]"];
        let bounded_questions = bounded_questions.map(|question| match model.kind {
            ModelKind::Mdp => question.replace("P=?", "Pmin=?"),
            ModelKind::Dtmc => question.to_owned(),
        });
        for question in
            questions(model.kind).iter().copied().chain(bounded_questions.iter().map(String::as_str))
        {
            let property = property::parse(question).expect("a property");
            let [full_report, early_report] = [true, false].map(|policy| {
                let options = Options::default().with_exactness(Exactness::Always).with_policy(policy);
                check(&model, &property, &options).expect("an answer")
            });
            assert_eq!(early_report.outcome, full_report.outcome, "{question}\n{}", prism::write(&model));
            assert!(early_report.states <= full_report.states);
            fewer += usize::from(early_report.states < full_report.states);
        }
    }
    // Guards against models in which no property is decided early.
    assert!(fewer > 100, "{fewer} have fewer states");
}

/// Returns the probability of reaching `s=m-1` within a reward budget, by value iteration over pairs of state
/// and remaining budget.
fn unfolded(model: &Model, budget: usize, greatest: bool) -> f64 {
    let program = Program::<f64>::new(model, &Settings::default()).expect("a program").with_rewards(&[0]);
    let explored = explore(&program, &Bounds::default()).expect("explored");
    let (mdp, rewards) = (&explored.mdp, &explored.rewards[0]);
    let mut values = Vec::new();
    let mut is_goal = Vec::new();
    for state in &explored.states {
        program.unpack(state, &mut values);
        is_goal.push(values[0] == program.variables[0].greatest);
    }
    let mut probabilities = vec![vec![0.0_f64; mdp.states()]; budget + 1];
    for _ in 0..20_000 {
        let mut change = 0.0_f64;
        for remaining in 0..=budget {
            for state in 0..mdp.states() {
                let choice_value = |choice: usize| {
                    let Some(remaining) = remaining.checked_sub(rewards[choice] as usize) else { return 0.0 };
                    mdp.transitions(choice)
                        .map(|(target, p)| p * probabilities[remaining][target])
                        .sum::<f64>()
                };
                let choice_values = mdp.choices(state).map(choice_value);
                let best = match (is_goal[state], greatest) {
                    (true, _) => 1.0,
                    (false, true) => choice_values.fold(0.0, f64::max),
                    (false, false) => choice_values.fold(1.0, f64::min),
                };
                change = change.max((best - probabilities[remaining][state]).abs());
                probabilities[remaining][state] = best;
            }
        }
        if change < 1e-13 {
            break;
        }
    }
    probabilities[budget][0]
}

/// The oracle is value iteration on the process that is unfolded over the remaining budget. The models have
/// cycles of choices with and without reward.
#[test]
fn reward_bounded_probabilities_are_those_of_the_unfolded_process() {
    let mut random = Random(11);
    let mut between = 0;
    for _ in 0..200 {
        let model = random_model(&mut random);
        // In a chain, the rewards of a state's commands are averaged, so they are not integers.
        if model.kind == ModelKind::Dtmc {
            continue;
        }
        for budget in [0, 1, 3, 8] {
            for direction in ["min", "max"] {
                let question = format!("P{direction}=? [ F^{{rew{{\"cost\"}}<={budget}}} \"goal\" ]");
                let expected = unfolded(&model, budget, direction == "max");
                between += usize::from(expected > 0.0 && expected < 1.0);
                for exactness in [Exactness::Always, Exactness::Never] {
                    let (value, lower, upper) = ours(&model, &question, exactness).expect("a probability");
                    let text = prism::write(&model);
                    assert!((value - expected).abs() < 1e-9, "{question}: {value}, {expected}\n{text}");
                    assert!(lower - 1e-9 <= expected && expected <= upper + 1e-9, "{question}\n{text}");
                }
            }
        }
    }
    assert!(between > 100, "{between} values between 0 and 1");
}
