//! Bounds enclose the true value although doubles are rounded. Models that would exhaust memory or
//! time are rejected.

use metaplan_probabilistic::check::{Answer, Exactness, Options, Outcome, PolicyTable, Quantity, check};
use metaplan_probabilistic::{Error, jani, prism, property};
use num_rational::BigRational;

fn outcome(model: &str, question: &str, options: &Options<'_>) -> Result<Outcome, Error> {
    let model = prism::parse(model).unwrap_or_else(|problems| panic!("{problems:?}"));
    check(&model, &property::parse(question).expect("a property"), options).map(|report| report.outcome)
}

fn value(model: &str, question: &str, exactness: Exactness) -> Quantity {
    let options = Options::default().with_exactness(exactness);
    match outcome(model, question, &options).expect("an answer") {
        Outcome::Value(Answer::Finite(quantity)) => quantity,
        other => panic!("{question}: {other:?}"),
    }
}

fn encloses(quantity: &Quantity, exact: &BigRational) -> bool {
    let end = |end: f64| BigRational::from_float(end);
    end(quantity.lower).is_some_and(|lower| lower <= *exact)
        && end(quantity.upper).is_some_and(|upper| upper >= *exact)
}

fn enclosed(model: &str, question: &str) -> BigRational {
    let exact = value(model, question, Exactness::Always).exact.expect("a fraction");
    let rounded = value(model, question, Exactness::Never);
    assert!(encloses(&rounded, &exact), "{question}: {rounded:?}, exactly {exact}");
    exact
}

fn error_codes(model: &str, question: &str, exactness: Exactness) -> Vec<&'static str> {
    match outcome(model, question, &Options::default().with_exactness(exactness)) {
        Err(Error::Model(problems)) => problems.iter().map(|problem| problem.code).collect(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn choices_that_differ_by_less_than_the_tolerance_are_enclosed() {
    let model = "mdp
        module m
          s:[0..4] init 0;
          [] s=0 -> 0.5:(s'=1) + 0.5:(s'=2);
          [] s=1 | s=2 -> (s'=0);
          [] s=1 -> 0.5:(s'=3) + 0.5:(s'=4);
          [] s=2 -> 0.5000000000001:(s'=3) + 0.4999999999999:(s'=4);
        endmodule
        label \"goal\" = s=3;";
    enclosed(model, "Pmax=? [ F \"goal\" ]");
}

#[test]
fn probabilities_with_a_rounded_sum_are_scaled_to_one() {
    let model = "dtmc
        module m
          s:[0..300] init 0;
          [] s<300 -> 0.33333333333333:(s'=s+1) + 0.66666666666666:(s'=max(s-1,0));
        endmodule
        rewards s<300 : 1; endrewards
        label \"goal\" = s=300;";
    enclosed(&model.replace("max(s-1,0)", "s"), "R=? [ F \"goal\" ]");
    enclosed(&model.replace("300", "12"), "R=? [ F \"goal\" ]");
    let nearly = "dtmc
        module m s:[0..2] init 0; [] s=0 -> 0.3333333333333:(s'=1) + 0.6666666666666:(s'=2); endmodule
        label \"goal\" = s=1;";
    enclosed(nearly, "P=? [ F \"goal\" ]");
    let model = "dtmc
        module m s:[0..3] init 0; [] s=0 -> 1/3:(s'=1) + 1/3:(s'=2) + 1/3:(s'=3); endmodule
        label \"goal\" = s=2;";
    assert_eq!(enclosed(model, "P=? [ F \"goal\" ]").to_string(), "1/3");
    let decimals = model.replace("1/3", "0.333333");
    assert_eq!(enclosed(&decimals, "P=? [ F \"goal\" ]").to_string(), "1/3");
}

#[test]
fn constants_are_exact() {
    let model = "const double p = 0.7;
        dtmc
        module m s:[0..1] init 0; [] s=0 -> 1-p-0.3:(s'=1) + p+0.3:(s'=0); endmodule
        label \"goal\" = s=1;";
    assert_eq!(enclosed(model, "P=? [ F \"goal\" ]").to_string(), "0");
    // In doubles, the probability `0.3-0.2-0.1` would be negative.
    enclosed(&model.replace("1-p-0.3", "0.3-0.2-0.1").replace("p+0.3", "1"), "P=? [ F \"goal\" ]");
    let guard = "dtmc
        module m s:[0..3] init 0; [] s*0.1!=0.3 -> (s'=min(s+1,3)); endmodule
        label \"goal\" = s=3 & s*0.1=0.3;";
    assert_eq!(enclosed(guard, "P=? [ F \"goal\" ]").to_string(), "1");
}

#[test]
fn values_below_the_least_double_are_enclosed() {
    let model = "dtmc
        module m s:[0..400] init 0; d:bool init false;
          [] s<400 & !d -> 0.1:(s'=s+1) + 0.9:(d'=true);
        endmodule
        label \"goal\" = s=400;";
    enclosed(model, "P=? [ F \"goal\" ]");
    enclosed(&model.replace("0.9:(d'=true)", "0.5:(d'=true) + 0.4:(s'=max(s-1,0))"), "P=? [ F \"goal\" ]");
    let rare = model.replace("0.1:", "1e-300:").replace("0.9:", "1-1e-300:");
    assert_eq!(error_codes(&rare, "P=? [ F \"goal\" ]", Exactness::Never), ["Q303"]);
}

/// The probability of the second choice, 1e-400, is rounded to 0, like that of the first one.
#[test]
fn a_choice_with_a_value_below_the_least_double_is_enclosed() {
    let model = "mdp
        module m
          s:[0..4] init 0;
          [] s=0 -> (s'=4);
          [] s=0 -> 1e-200:(s'=1) + 1-1e-200:(s'=4);
          [] s=1 -> 1e-200:(s'=2) + 1-1e-200:(s'=4);
        endmodule
        label \"goal\" = s=2;";
    assert_ne!(enclosed(model, "Pmax=? [ F \"goal\" ]"), BigRational::default());
    assert_eq!(enclosed(model, "Pmin=? [ F \"goal\" ]"), BigRational::default());
}

#[test]
fn nearly_integral_rewards_are_enclosed() {
    let model = "dtmc
        module m s:[0..2] init 0; [] s<2 -> (s'=s+1); endmodule
        rewards s=0 : 0.99999999999999999999; s=1 : 3; endrewards
        label \"goal\" = s=2;";
    enclosed(model, "R=? [ F \"goal\" ]");
    let whole = value(&model.replace("0.99999999999999999999", "4"), "R=? [ F \"goal\" ]", Exactness::Never);
    assert_eq!([whole.lower, whole.upper].map(f64::to_bits), [7.0, 7.0].map(f64::to_bits));
}

/// In doubles the rewards are 1/2 and their sums are exact, but the true sums are smaller.
#[test]
fn rewards_with_an_integral_sum_in_doubles_are_enclosed() {
    let half = "0.49999999999999999999";
    let command = "dtmc module m s:[0..1] init 0; [a] s=0 -> (s'=1); endmodule";
    for (question, rewards) in [
        ("R=? [ F s=1 ]", format!("s=0 : 0.5; s=0 : {half};")),
        ("R=? [ F s=1 ]", format!("s=0 : 0.5; [a] true : {half};")),
        ("R=? [ I=0 ]", format!("s=0 : 0.5; s=0 : {half};")),
    ] {
        let module = "module n t:[0..1] init 0; endmodule";
        for model in [
            format!("{command} rewards {rewards} endrewards"),
            format!("{command} {module} rewards {rewards} endrewards"),
        ] {
            enclosed(&model, question);
        }
    }
    let cycle = format!(
        "mdp module m s:[0..2] init 0; [a] s=0 -> (s'=1); [b] s=1 -> (s'=0); [c] s=1 -> (s'=2); endmodule
         rewards [a] true : {half}; endrewards"
    );
    enclosed(&cycle, "Rmin=? [ F s=2 ]");
}

/// The sums of 400 equal probabilities or shares of a reward, and of 100 equal rewards, would be too small if each addition
/// were rounded.
#[test]
fn sums_of_many_summands_are_enclosed() {
    let commands = "[t] true -> true;".repeat(20);
    let synchronised = format!(
        "dtmc module a {commands} endmodule module b {commands} endmodule
         module m s:[0..1] init 0; [t] s=0 -> (s'=1); endmodule
         rewards \"n\" [t] true : 1; endrewards"
    );
    let single = format!(
        "dtmc module m s:[0..1] init 0; {} endmodule rewards \"n\" [t] true : 1; endrewards",
        "[t] s=0 -> (s'=1);".repeat(400)
    );
    for model in [&synchronised, &single] {
        for question in ["P=? [ F<=1 s=1 ]", "P=? [ X s=1 ]", "R{\"n\"}=? [ F s=1 ]", "R{\"n\"}=? [ C<=1 ]"] {
            assert_eq!(enclosed(model, question).to_string(), "1", "{question}");
            let bound = question.replacen("=?", ">=1", 1);
            let options = Options::default().with_exactness(Exactness::Never);
            let refuted = matches!(outcome(model, &bound, &options), Ok(Outcome::Truth(false, _)));
            assert!(!refuted, "{bound}");
        }
    }
    let items = "true : 0.1;".repeat(100);
    let rewards =
        format!("mdp module m s:[0..1] init 0; [] true -> (s'=1-s); endmodule rewards {items} endrewards");
    for question in ["Rmin=? [ C<=1 ]", "Rmax=? [ F s=1 ]", "Rmin=? [ I=1 ]"] {
        assert_eq!(enclosed(&rewards, question).to_string(), "10", "{question}");
    }
}

/// The exact values are 1e-400.
#[test]
fn products_and_quotients_below_the_least_double_are_enclosed() {
    let model = "dtmc
        module m s:[0..2] init 0; [] s=0 -> 1e-200:(s'=1) + 1-1e-200:(s'=2); [] s>0 -> true; endmodule";
    for question in ["(P=? [ F s=1 ]) * (P=? [ F s=1 ])", "(P=? [ F s=1 ]) / 1e200"] {
        assert_ne!(enclosed(model, question), BigRational::default(), "{question}");
        let options = Options::default().with_exactness(Exactness::Never);
        let refuted =
            matches!(outcome(model, &format!("{question} > 0"), &options), Ok(Outcome::Truth(false, _)));
        assert!(!refuted, "{question}");
    }
    // A product with an exact 0 is exactly 0.
    let zero = value(model, "(P=? [ F s=1 ]) * (P=? [ G s=1 ])", Exactness::Never);
    assert_eq!([zero.lower, zero.upper].map(f64::to_bits), [0.0, 0.0].map(f64::to_bits));
}

#[test]
fn step_bounded_values_are_enclosed() {
    let model = "dtmc
        module m s:[0..2] init 0;
          [] s=0 -> 0.5:(s'=1) + 0.5:(s'=2);
          [] s=1 -> 1/7:(s'=0) + 1/3:(s'=2) + 11/21:(s'=1);
        endmodule
        label \"goal\" = s=2;";
    enclosed(model, "P=? [ F<=50 \"goal\" ]");
    // Exact arithmetic exceeds its budget, so the answer is in doubles.
    let rounded = value(model, "P=? [ F<=1000000 \"goal\" ]", Exactness::Auto);
    assert!(rounded.exact.is_none() && rounded.lower <= 1.0 && rounded.upper >= 1.0, "{rounded:?}");
}

#[test]
fn rewards_without_a_step_are_enclosed() {
    let model = "dtmc module m s:[0..1] init 0; [] true -> (s'=1-s); endmodule
        rewards \"r\" s=0 : 2/3; s=0 : 1/7; s=1 : 3; endrewards
        rewards \"whole\" s=0 : 2; s=0 : 3; endrewards";
    for steps in [0, 1, 2] {
        enclosed(model, &format!("R{{\"r\"}}=? [ I={steps} ]"));
    }
    let whole = value(model, "R{\"whole\"}=? [ I=0 ]", Exactness::Never);
    assert_eq!([whole.lower, whole.upper].map(f64::to_bits), [5.0, 5.0].map(f64::to_bits));
    let two_thirds = outcome(
        &model.replace("s=0 : 1/7;", ""),
        "R{\"r\"}<2/3 [ I=0 ]",
        &Options::default().with_exactness(Exactness::Never),
    );
    assert!(matches!(two_thirds, Ok(Outcome::Undecided(_))), "{two_thirds:?}");
}

#[test]
fn policies_start_in_all_initial_states() {
    let model = "mdp
        module m s:[0..5]; [a] s<5 -> 0.5:(s'=5) + 0.5:true; [b] s<5 -> 0.5:(s'=5) + 0.5:(s'=0); endmodule
        init s=1 | s=3 endinit
        label \"goal\" = s=5;";
    let question = "Pmax=? [ F \"goal\" ]";
    let parsed = prism::parse(model).expect("a model");
    let property = property::parse(question).expect("a property");
    let report = check(&parsed, &property, &Options::default().with_policy(true)).expect("an answer");
    let table = report.policy.expect("a policy");
    let mut listed: Vec<_> =
        table.rows.iter().map(|row| row.values[0]).filter(|s| [1, 3].contains(s)).collect();
    listed.sort_unstable();
    assert_eq!(listed, [1, 3]);
    let answer = outcome(model, question, &Options::default().with_evaluation(Some(table)));
    let Ok(Outcome::Range(least, greatest)) = answer else { panic!("{answer:?}") };
    for end in [least, greatest] {
        assert_eq!(
            end.quantity().and_then(|quantity| quantity.exact.clone()),
            Some(BigRational::from_integer(1.into()))
        );
    }
}

#[test]
fn a_policy_without_states_is_evaluated() {
    let model = "mdp module m s:[0..1] init 0; [go] s=0 -> (s'=1); endmodule label \"goal\" = s=1;";
    let policy = "{\"format\": \"metaplan-policy/1\", \"states\": []}";
    for (question, expected) in [("Pmax=? [ F \"goal\" ]", "0"), ("Pmax=? [ F s=0 ]", "1")] {
        let evaluate = Some(PolicyTable::from_json(policy).expect("a policy"));
        let answer =
            outcome(model, question, &Options::default().with_evaluation(evaluate)).expect("an answer");
        let Outcome::Value(Answer::Finite(answer)) = answer else { panic!("{answer:?}") };
        assert_eq!(answer.exact.map(|exact| exact.to_string()).as_deref(), Some(expected), "{question}");
    }
}

#[test]
fn a_policy_is_evaluated_over_bounded_steps() {
    let model = "mdp
        module m s:[0..2] init 0; [slow] s=0 -> 0.1:(s'=1) + 0.9:(s'=0); [fast] s=0 -> 0.5:(s'=1) + 0.5:(s'=2); endmodule
        rewards \"cost\" [slow] true : 1; [fast] true : 5; endrewards
        label \"goal\" = s=1;";
    let policy = "{\"format\": \"metaplan-policy/1\", \"states\": [{\"state\": {\"s\": 0}, \"action\": \"slow\", \"choice\": 0}]}";
    let cases = [
        ("Pmax=? [ X \"goal\" ]", "1/10"),
        ("Pmax=? [ F<=2 \"goal\" ]", "19/100"),
        ("R{\"cost\"}max=? [ C<=2 ]", "19/10"),
        ("Pmin=? [ G<=2 !\"goal\" ]", "81/100"),
    ];
    for (question, expected) in cases {
        let evaluate = Some(PolicyTable::from_json(policy).expect("a policy"));
        let answer =
            outcome(model, question, &Options::default().with_evaluation(evaluate)).expect("an answer");
        let Outcome::Value(Answer::Finite(answer)) = answer else { panic!("{answer:?}") };
        assert_eq!(answer.exact.map(|exact| exact.to_string()).as_deref(), Some(expected), "{question}");
    }
    let evaluate = Some(PolicyTable::from_json(policy).expect("a policy"));
    let two_objectives = "multi(R{\"cost\"}min=? [ F \"goal\" ], Pmax=? [ F \"goal\" ])";
    assert!(outcome(model, two_objectives, &Options::default().with_evaluation(evaluate)).is_err());
}

/// With this policy, the only path visits the states 0 and 1 and ends after one step.
#[test]
fn a_path_that_has_ended_makes_no_further_steps() {
    let model = "mdp
        module m s:[0..1] init 0; [a] s=0 -> (s'=1); [b] s=1 -> (s'=0); endmodule
        rewards \"r\" true : 1; endrewards
        label \"goal\" = s=1;";
    let policy = "{\"format\": \"metaplan-policy/1\", \"states\": [{\"state\": {\"s\": 0}, \"action\": \"a\", \"choice\": 0}]}";
    let without_states = "{\"format\": \"metaplan-policy/1\", \"states\": []}";
    for (policy, question, expected) in [
        (policy, "Pmax=? [ F[2,2] \"goal\" ]", "0"),
        (policy, "Pmax=? [ F>=2 \"goal\" ]", "0"),
        (policy, "Pmax=? [ F[1,2] \"goal\" ]", "1"),
        (policy, "Pmax=? [ F<=2 \"goal\" ]", "1"),
        (policy, "Pmin=? [ s=0 U[1,3] \"goal\" ]", "1"),
        (policy, "Pmax=? [ G[2,2] s=0 ]", "1"),
        (policy, "Pmax=? [ G[1,2] s=0 ]", "0"),
        (policy, "R{\"r\"}max=? [ C<=3 ]", "1"),
        (policy, "R{\"r\"}max=? [ I=1 ]", "1"),
        (policy, "R{\"r\"}max=? [ I=2 ]", "0"),
        (without_states, "Pmax=? [ X s=0 ]", "0"),
        (without_states, "Pmin=? [ X s=0 ]", "0"),
    ] {
        for exactness in [Exactness::Always, Exactness::Never] {
            let evaluate = Some(PolicyTable::from_json(policy).expect("a policy"));
            let options = Options::default().with_exactness(exactness).with_evaluation(evaluate);
            let answer = outcome(model, question, &options).expect("an answer");
            let Outcome::Value(Answer::Finite(answer)) = answer else { panic!("{answer:?}") };
            let expected: BigRational = expected.parse().expect("a fraction");
            assert!(encloses(&answer, &expected), "{question}: {answer:?}, not {expected}");
            assert!(answer.upper - answer.lower <= 1e-9, "{question}: {answer:?}");
        }
    }
}

#[test]
fn a_path_fails_where_an_evaluated_policy_has_no_choice() {
    let model = "mdp
        module m s:[0..2] init 0; [go] s=0 -> (s'=1); [back] s=1 -> (s'=0); [end] s=1 -> (s'=2); endmodule
        rewards \"cost\" true : 1; endrewards
        label \"goal\" = s=2;";
    let policy = "{\"format\": \"metaplan-policy/1\", \"states\": [{\"state\": {\"s\": 0}, \"action\": \"go\", \"choice\": 0}]}";
    for question in ["Pmax=? [ F \"goal\" ]", "Pmin=? [ F \"goal\" ]"] {
        for exactness in [Exactness::Always, Exactness::Never] {
            let evaluate = Some(PolicyTable::from_json(policy).expect("a policy"));
            let options = Options::default().with_exactness(exactness).with_evaluation(evaluate);
            let answer = outcome(model, question, &options).expect("an answer");
            let Outcome::Value(Answer::Finite(answer)) = answer else { panic!("{answer:?}") };
            assert_eq!(answer.upper.to_bits(), 0.0f64.to_bits(), "{question}");
        }
    }
    for question in ["R{\"cost\"}max=? [ F \"goal\" ]", "R{\"cost\"}min=? [ F \"goal\" ]"] {
        let evaluate = Some(PolicyTable::from_json(policy).expect("a policy"));
        let answer =
            outcome(model, question, &Options::default().with_evaluation(evaluate)).expect("an answer");
        assert!(!matches!(answer, Outcome::Value(Answer::Finite(_))), "{question}: {answer:?}");
    }
}

#[test]
fn the_policy_for_tiny_values_is_optimal() {
    let model = "mdp
        module m s:[0..40] init 0; d:bool init false; h:bool init false;
          [slow] s<40 & !d & !h -> (h'=true);
          [on] s<40 & !d & h -> (s'=s+1) & (h'=false);
          [quick] s<40 & !d & !h -> 0.99999:(s'=s+1) + 0.00001:(d'=true);
          [end] s=40 & !d & !h -> 0.00000001:(h'=true) + 0.99999999:(d'=true);
        endmodule
        label \"goal\" = s=40 & h;";
    let model = prism::parse(model).expect("a model");
    let question = property::parse("Pmax=? [ F \"goal\" ]").expect("a property");
    let options = Options::default().with_exactness(Exactness::Never).with_policy(true);
    let report = check(&model, &question, &options).expect("an answer");
    let options = Options::default().with_exactness(Exactness::Always).with_evaluation(report.policy);
    let exact = check(&model, &question, &options).expect("an answer").outcome;
    let Outcome::Value(Answer::Finite(quantity)) = exact else { panic!("{exact:?}") };
    assert_eq!(quantity.exact.map(|exact| exact.to_string()).as_deref(), Some("1/100000000"));
}

/// In each step, the other choice loses less than 1e-9 of the optimal value, but the sum of these losses is large.
#[test]
fn ties_are_not_broken_in_favour_of_a_worse_policy() {
    let cases = [
        (["1e-8", "2e-8"], ["1", "2.05"], "R{\"cost\"}min=? [ F s=1 ]", 1e8),
        (["1e-10", "1.5e-10"], ["1", "1.6"], "R{\"cost\"}min=? [ F s=1 ]", 1e10),
        (["1e-10", "1e-12"], ["1", "1"], "R{\"cost\"}min=? [ F s=1 ]", 1e10),
        (["1e-9*0.5", "0.8e-9"], ["1", "1"], "Pmax=? [ F s=1 ]", 0.5),
    ];
    for ([slow, quick], [slow_cost, quick_cost], question, expected) in cases {
        let failure = if question.starts_with('P') { ["1e-9*0.5", "1.2e-9"] } else { ["0", "0"] };
        let [slow_failure, quick_failure] = failure;
        let model = format!(
            "mdp
            module m s:[0..2] init 0;
              [slow] s=0 -> {slow}:(s'=1) + {slow_failure}:(s'=2) + 1-{slow}-{slow_failure}:true;
              [quick] s=0 -> {quick}:(s'=1) + {quick_failure}:(s'=2) + 1-{quick}-{quick_failure}:true;
            endmodule
            rewards \"cost\" [slow] true : {slow_cost}; [quick] true : {quick_cost}; endrewards
            rewards \"effort\" [slow] true : 1; [quick] true : 1e-6; endrewards"
        );
        let model = prism::parse(&model).expect("a model");
        let property = property::parse(question).expect("a property");
        for secondary in [None, Some("effort".to_owned())] {
            let options = Options::default().with_exactness(Exactness::Never).with_policy(true);
            let report = check(&model, &property, &options.with_secondary(secondary)).expect("an answer");
            let evaluation =
                Options::default().with_exactness(Exactness::Always).with_evaluation(report.policy);
            let exact = check(&model, &property, &evaluation).expect("an answer").outcome;
            let Outcome::Value(Answer::Finite(quantity)) = exact else { panic!("{exact:?}") };
            assert!((quantity.value / expected - 1.0).abs() < 1e-6, "{question} {slow}: {quantity:?}");
        }
    }
}

#[test]
fn two_objectives_in_doubles_have_enclosing_bounds() {
    let model = "mdp
        module m s:[0..2] init 0; r:[0..7] init 0;
          [risk] s=0 & r<7 -> 1/3:(s'=1) + 1/7:(s'=2) + 11/21:(r'=r+1);
          [care] s=0 -> (s'=1);
        endmodule
        rewards \"cost\" [risk] true : 0.1; [care] true : 1+r/7; endrewards
        label \"end\" = s>0; label \"good\" = s=1;";
    let question = "multi(R{\"cost\"}min=? [ F \"end\" ], Pmax=? [ F \"good\" ])";
    let [exact, rounded] = [Exactness::Always, Exactness::Never].map(|exactness| {
        let result = outcome(model, question, &Options::default().with_exactness(exactness));
        let Ok(Outcome::Front(front)) = result else { panic!("{result:?}") };
        front
    });
    assert!(exact.len() > 1 && exact.len() == rounded.len(), "{exact:?} {rounded:?}");
    for (exact, rounded) in exact.iter().flatten().zip(rounded.iter().flatten()) {
        let (exact, rounded) = (exact.quantity().expect("finite"), rounded.quantity().expect("finite"));
        assert!(encloses(rounded, exact.exact.as_ref().expect("a fraction")), "{exact:?} {rounded:?}");
        assert!(rounded.upper - rounded.lower < 1e-12, "{rounded:?}");
    }
    for bounded in [
        "multi(R{\"cost\"}min=? [ F \"end\" ], P>=0.9 [ F \"good\" ])",
        "multi(R{\"cost\"}min=? [ F \"end\" ], P>=0.71 [ F \"good\" ])",
        "multi(Pmax=? [ F \"good\" ], R{\"cost\"}<=0.9 [ F \"end\" ])",
        "multi(Pmax=? [ F \"good\" ], R{\"cost\"}<=2 [ F \"end\" ])",
    ] {
        let [exact, rounded] = [Exactness::Always, Exactness::Never].map(|exactness| {
            match outcome(model, bounded, &Options::default().with_exactness(exactness)) {
                Ok(Outcome::Constrained { randomised, deterministic, proved: true }) => {
                    [randomised, deterministic]
                }
                other => panic!("{bounded}: {other:?}"),
            }
        });
        for (exact, rounded) in exact.iter().zip(&rounded) {
            let (exact, rounded) = (exact.quantity().expect("finite"), rounded.quantity().expect("finite"));
            let fraction = exact.exact.as_ref().expect("a fraction");
            assert!(encloses(rounded, fraction), "{bounded}: {exact:?} {rounded:?}");
            assert!(rounded.upper - rounded.lower < 1e-9, "{bounded}: {rounded:?}");
        }
    }
}

/// Values by hand: `b` satisfies the bound at cost 1 and `d` at cost 5. In doubles, the probabilities of `a` and `b` are so
/// close that the cheaper `a` represents both.
#[test]
fn a_bound_near_the_optimum_is_not_refuted_in_doubles() {
    let near = "[a] s=0 -> 0.5:(s'=1) + 0.5:(s'=2); [b] s=0 -> 0.5000000001:(s'=1) + 0.4999999999:(s'=2);";
    let costly = "[d] s=0 -> 0.9:(s'=1) + 0.1:(s'=2);";
    let question = "multi(R{\"cost\"}min=? [ F \"end\" ], P>=0.50000000005 [ F \"good\" ])";
    for commands in [near.to_owned(), format!("{near} {costly}")] {
        let model = format!(
            "mdp module m s:[0..2] init 0; {commands} endmodule
            rewards \"cost\" [b] true : 1; [d] true : 5; endrewards
            label \"end\" = s>0; label \"good\" = s=1;"
        );
        let answer = |exactness| outcome(&model, question, &Options::default().with_exactness(exactness));
        let Ok(Outcome::Constrained { deterministic: exact, proved: true, .. }) = answer(Exactness::Always)
        else {
            panic!("{commands}")
        };
        assert_eq!(exact.quantity().map(|exact| exact.value.to_bits()), Some(1.0_f64.to_bits()));
        let Ok(Outcome::Constrained { deterministic, proved, .. }) = answer(Exactness::Never) else {
            panic!("{commands}")
        };
        match deterministic.quantity() {
            Some(quantity) => assert!(quantity.lower <= 1.0 && 1.0 <= quantity.upper, "{quantity:?}"),
            None => assert!(!proved, "{commands}"),
        }
    }
}

#[test]
fn extreme_models_are_rejected_or_answered() {
    let wide =
        "mdp module m x:[-5000000000000000000..5000000000000000000] init 0; [] x=0 -> (x'=1); endmodule
        label \"goal\" = x=1;";
    assert_eq!(enclosed(wide, "Pmax=? [ F \"goal\" ]").to_string(), "1");
    let module = |number: usize| {
        let command = format!("[a] x{number}=0 -> 0.5:(x{number}'=1) + 0.5:(x{number}'=0);\n");
        format!("module m{number} x{number}:[0..1] init 0;\n{}endmodule\n", command.repeat(20))
    };
    let modules: Vec<String> = (0..12).map(module).collect();
    let synchronised = format!("mdp\n{}label \"goal\" = x0=1;", modules.concat());
    assert_eq!(error_codes(&synchronised, "Pmax=? [ F \"goal\" ]", Exactness::Auto), ["Q306"]);
    let growing = "const double p = pow(pow(pow(1.5,900),900),900);
        mdp module m x:[0..1] init 0; [] x=0 -> p:(x'=1); endmodule label \"goal\" = x=1;";
    assert_eq!(error_codes(growing, "Pmax=? [ F \"goal\" ]", Exactness::Auto), ["Q303"]);
    let square = |n: usize| format!("const double c{} = c{n}*c{n};\n", n + 1);
    let squares = (0..60).map(square).collect::<Vec<_>>().concat();
    let growing = format!(
        "const double c0 = 0.9;\n{squares} mdp module m x:[0..1] init 0; [] x=0 -> c60:(x'=1) + 1-c60:(x'=0); endmodule
        label \"goal\" = x=1;"
    );
    assert_eq!(error_codes(&growing, "Pmax=? [ F \"goal\" ]", Exactness::Auto), ["Q303"]);
    for update in ["1/x:(x'=1)", "1:(x'=1/0)", "0.5:(x'=1)", "-1:(x'=1) + 2:(x'=0)", "(x'=2)"] {
        let model =
            format!("mdp module m x:[0..1] init 0; [] x=0 -> {update}; endmodule label \"goal\" = x=1;");
        assert_eq!(error_codes(&model, "Pmax=? [ F \"goal\" ]", Exactness::Auto).len(), 1, "{update}");
    }
    let empty = "mdp module m x:[3..2]; endmodule label \"goal\" = x=1;";
    assert_eq!(error_codes(empty, "Pmax=? [ F \"goal\" ]", Exactness::Auto), ["Q207"]);
}

/// The test runs in a thread with a large stack, because unoptimised stack frames are large.
#[test]
fn deep_and_large_expressions_are_rejected() {
    let deep = || {
        let sum = |terms: usize| format!("x=0{}", "+0".repeat(terms));
        let chain = |link: &str, length: usize| {
            let next = |n: usize| format!("formula f{} = {};\n", n + 1, link.replace('f', &format!("f{n}")));
            format!("formula f0 = x=0;\n{}", (0..length).map(next).collect::<Vec<_>>().concat())
        };
        let model = |formulas: &str, guard: &str| {
            format!(
                "mdp {formulas} module m x:[0..1] init 0; [] {guard} -> (x'=1); endmodule label \"goal\" = x=1;"
            )
        };
        assert_eq!(enclosed(&model("", &sum(450)), "Pmax=? [ F \"goal\" ]").to_string(), "1");
        let disjunction = format!("(x=0{})", "|x=0".repeat(9000));
        assert_eq!(enclosed(&model("", &disjunction), "Pmax=? [ F \"goal\" ]").to_string(), "1");
        let long = prism::parse(&model("", &sum(9000))).expect_err("too long");
        assert_eq!(long.diagnostics()[0].code, "Q104");
        for (link, length) in [("f & x>=0", 5000), ("f & f", 60)] {
            let model = model(&chain(link, length), &format!("f{length}"));
            assert_eq!(error_codes(&model, "Pmax=? [ F \"goal\" ]", Exactness::Auto)[0], "Q104", "{link}");
            let renamed = format!("{model} module n = m [x=y] endmodule");
            let renamed = prism::parse(&renamed).expect_err("too large");
            assert_eq!(renamed.diagnostics()[0].code, "Q104", "{link}");
        }
        let model = model(&chain("f & f", 60), "f60");
        let document = jani::write("m", &prism::parse(&model).expect("a model")).expect_err("too large");
        assert_eq!(document.diagnostics()[0].code, "Q104");
    };
    let thread = std::thread::Builder::new().stack_size(16 << 20).spawn(deep);
    thread.expect("a thread").join().expect("no panic");
}
