//! Stiff processes, in which the probability of leaving a set of states is tiny. In doubles, these
//! processes have no inductive certificate, but state elimination has a small relative error.

use std::time::{Duration, Instant};

use metaplan_probabilistic::check::{Answer, Exactness, Options, Outcome, Quantity, check};
use metaplan_probabilistic::{prism, property};
use num_bigint::BigInt;
use num_rational::BigRational;
use test_resources::data;

fn value(model: &str, question: &str, exactness: Exactness) -> Quantity {
    let model = prism::parse(model).unwrap_or_else(|problems| panic!("{problems:?}"));
    let options = Options::default().with_exactness(exactness);
    let start = Instant::now();
    let report = check(&model, &property::parse(question).expect("a property"), &options).expect("an answer");
    // Elimination takes milliseconds, whereas iteration would take up to an hour. The limit is
    // generous for slow machines and unoptimised code.
    assert!(start.elapsed() < Duration::from_secs(300), "{question}: {:?}", start.elapsed());
    match report.outcome {
        Outcome::Value(Answer::Finite(quantity)) => quantity,
        other => panic!("{question}: {other:?}"),
    }
}

fn agree(model: &str, question: &str, expected: &BigRational) {
    for exactness in [Exactness::Always, Exactness::Auto] {
        assert_eq!(value(model, question, exactness).exact.as_ref(), Some(expected), "{question}");
    }
    let rounded = value(model, question, Exactness::Never);
    let end = |end: f64| BigRational::from_float(end).expect("finite");
    assert!(
        end(rounded.lower) <= *expected && *expected <= end(rounded.upper),
        "{rounded:?}, exactly {expected}"
    );
    assert!(rounded.upper - rounded.lower <= 1e-6 * rounded.value, "{rounded:?} is wide");
}

/// Example of Haddad and Monmege, TCS 735, 2018, section 4: value iteration from below stops early,
/// far from the value one half.
#[test]
fn equally_rare_exits_have_probability_one_half() {
    for n in [20, 27, 28, 40, 60, 100] {
        let model = format!(
            "dtmc const int N={n};
             module m x:[-N..N] init 0;
               [] x>0 & x<N -> 0.5:(x'=x+1) + 0.5:(x'=0);
               [] x<0 & x>-N -> 0.5:(x'=x-1) + 0.5:(x'=0);
               [] x=0 -> 0.5:(x'=1) + 0.5:(x'=-1);
               [] x=N | x=-N -> true;
             endmodule"
        );
        agree(&model, "P=? [ F x=N ]", &BigRational::new(BigInt::from(1), BigInt::from(2)));
    }
}

/// From each x the process moves one step up or back to 0, and from 0 to 1. The expected number of
/// steps is 3·2^(N−1) − 3, by a recurrence.
#[test]
fn a_huge_expected_time_is_exact() {
    for n in [26_u32, 28, 40, 60, 100] {
        let model = format!(
            "dtmc module m x:[0..{n}] init 1;
               [] x>0 & x<{n} -> 0.5:(x'=x+1) + 0.5:(x'=0);
               [] x=0 -> (x'=1);
               [] x={n} -> true;
             endmodule
             rewards x<{n} : 1; endrewards"
        );
        let expected = BigInt::from(3) * BigInt::from(2).pow(n - 1) - BigInt::from(3);
        agree(&model, &format!("R=? [ F x={n} ]"), &BigRational::from(expected));
    }
}

#[test]
fn the_better_choice_in_a_stiff_process_is_found() {
    for n in [28, 50] {
        let model = format!(
            "mdp const int N={n};
             module m x:[-N..N] init 0;
               [up] x>0 & x<N -> 0.5:(x'=x+1) + 0.5:(x'=0);
               [down] x<0 & x>-N -> 0.5:(x'=x-1) + 0.5:(x'=0);
               [fair] x=0 -> 0.5:(x'=1) + 0.5:(x'=-1);
               [other] x=0 -> 0.25:(x'=1) + 0.75:(x'=-1);
               [] x=N | x=-N -> true;
             endmodule"
        );
        agree(&model, "Pmax=? [ F x=N ]", &BigRational::new(BigInt::from(1), BigInt::from(2)));
        agree(&model, "Pmin=? [ F x=N ]", &BigRational::new(BigInt::from(1), BigInt::from(4)));
    }
}

/// A gambler starts with 1, wins each round with probability 2/5, and stops at 1,000. The
/// probability of reaching 1,000 is (3/2 − 1) / ((3/2)^1000 − 1), about 4.5·10^−177.
#[test]
fn bounds_of_tiny_values_are_relative() {
    let model = "dtmc module m x:[0..1000] init 1;
          [] x>0 & x<1000 -> 2/5:(x'=x+1) + 3/5:(x'=x-1);
          [] x=0 | x=1000 -> true;
        endmodule";
    let odds = BigRational::new(BigInt::from(3), BigInt::from(2));
    let one = BigRational::from(BigInt::from(1));
    let expected = (&odds - &one) / (odds.pow(1000) - &one);
    let rounded = value(model, "P=? [ F x=1000 ]", Exactness::Never);
    let end = |end: f64| BigRational::from_float(end).expect("finite");
    assert!(end(rounded.lower) <= expected && expected <= end(rounded.upper), "{rounded:?}");
    assert!(rounded.upper - rounded.lower <= 1e-6 * rounded.value, "{rounded:?} is wide");
    let bounded = value(model, "P=? [ F<=300 x=100 ]", Exactness::Never);
    assert!(bounded.value > 0.0 && bounded.upper - bounded.lower <= 1e-6 * bounded.value, "{bounded:?}");
}

/// Wide bounds are available immediately; improving them would take 17 s and must be skipped. The
/// expected value was computed exactly by Metaplan itself. The model is from the Quantitative
/// Verification Benchmark Set.
#[test]
fn wide_bounds_are_improved_only_if_that_is_cheap() {
    let Some(path) = data("real/qvbs/mdp/zeroconf/zeroconf.prism") else { return };
    let model = std::fs::read_to_string(path).expect("a file");
    let open = ["const int N;", "const int K;", "const bool reset;"];
    let set = ["const int N = 1000;", "const int K = 8;", "const bool reset = true;"];
    let model = open.iter().zip(set).fold(model, |model, (open, set)| model.replace(open, set));
    let question = "Pmin=? [ F (l=4 & ip=1) ]";
    let exact = value(&model, question, Exactness::Always).exact.expect("exact");
    assert_eq!(exact.to_string(), "322687697779/64024000322687697779");
    let rounded = value(&model, question, Exactness::Never);
    let end = |end: f64| BigRational::from_float(end).expect("finite");
    assert!(end(rounded.lower) <= exact && exact <= end(rounded.upper), "{rounded:?}");
}
