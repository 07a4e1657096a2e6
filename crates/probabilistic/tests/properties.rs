//! Properties beyond plain reachability. Expected values come from Storm (stormpy 2.0.0, exact),
//! unless a comment states another source.

use metaplan_probabilistic::check::{Answer, Exactness, Options, Outcome, check, check_all};
use metaplan_probabilistic::{Error, prism, property};
use num_rational::BigRational;

const CHAIN: &str = "dtmc
    module m
      s : [0..6] init 0; d : [0..3] init 0;
      [] s=0 -> 1/2:(s'=1) + 1/2:(s'=2);
      [] s=1 -> 1/3:(s'=3) + 2/3:(s'=0);
      [] s=2 -> 1/4:(s'=4) + 1/4:(s'=5) + 1/2:(s'=0);
      [] s=3 -> 1/2:(s'=4) + 1/2:(s'=3);
      [] s=4 -> 3/5:(s'=3) + 2/5:(s'=4);
      [] s=5 -> (s'=6)&(d'=1);
      [] s=6 -> (s'=6);
    endmodule
    rewards \"r\" s<3 : 2; s=3 : 1; endrewards
    rewards \"t\" s<3 : 1; endrewards
    label \"a\" = s=3; label \"b\" = s>=4;";

const PROCESS: &str = "mdp
    module m
      s : [0..5] init 0;
      [go] s=0 -> 0.7:(s'=1) + 0.3:(s'=2);
      [wait] s=0 -> true;
      [go] s=1 -> 0.6:(s'=3) + 0.4:(s'=0);
      [risk] s=1 -> 0.8:(s'=4) + 0.2:(s'=5);
      [go] s=2 -> 0.5:(s'=0) + 0.5:(s'=5);
      [stay] s=2 -> (s'=2);
      [go] s=3 -> 0.9:(s'=4) + 0.1:(s'=1);
      [back] s=4 -> 0.5:(s'=3) + 0.5:(s'=4);
      [end] s=4 -> (s'=4);
      [end] s=5 -> (s'=5);
    endmodule
    rewards \"r\" s<3 : 2; [go] true : 1; [back] true : 3; endrewards
    label \"a\" = s=3; label \"b\" = s>=4;";

fn outcome(model: &str, question: &str, exactness: Exactness) -> Outcome {
    let model = prism::parse(model).unwrap_or_else(|problems| panic!("{problems:?}"));
    let property = property::parse(question).unwrap_or_else(|error| panic!("{question}: {error:?}"));
    let options = Options::default().with_exactness(exactness);
    check(&model, &property, &options).unwrap_or_else(|error| panic!("{question}: {error:?}")).outcome
}

fn error(model: &str, question: &str) -> (&'static str, String) {
    let model = prism::parse(model).unwrap_or_else(|problems| panic!("{problems:?}"));
    let result = property::parse(question).and_then(|property| check(&model, &property, &Options::default()));
    match result {
        Err(Error::Property(problems)) => (problems[0].code, problems[0].message.clone()),
        other => panic!("{question}: {other:?}"),
    }
}

fn agree(model: &str, question: &str, expected: &str) {
    let value = |exactness| match outcome(model, question, exactness) {
        Outcome::Value(answer) => answer,
        other => panic!("{question}: {other:?}"),
    };
    if expected == "inf" {
        assert_eq!([Exactness::Always, Exactness::Never].map(value), [Answer::Infinite, Answer::Infinite]);
        return;
    }
    let expected: BigRational = expected.parse().expect("a fraction");
    let exact = value(Exactness::Always);
    assert_eq!(exact.quantity().and_then(|quantity| quantity.exact.as_ref()), Some(&expected), "{question}");
    let answer = value(Exactness::Never);
    let quantity = answer.quantity().unwrap_or_else(|| panic!("{question}: {answer:?}"));
    let end = |end: f64| BigRational::from_float(end).expect("finite");
    assert!(end(quantity.lower) <= expected && expected <= end(quantity.upper), "{question}: {quantity:?}");
    assert!(quantity.upper - quantity.lower <= 1e-9, "{question}: {quantity:?}");
}

#[test]
fn renamed_modules_expand_formulas_that_are_declared_below() {
    let model = "mdp module a x:[0..1] init 0; [] free -> (x'=1); endmodule module b = a [x=y] endmodule
        formula free = x=0;";
    // If the guard of `b` were `x=0`, a run could end in the state x=1, y=0.
    agree(model, "Pmin=? [ F y=1 ]", "1");
}

#[test]
fn paths_and_rewards_of_a_chain_have_the_expected_values() {
    for (question, expected) in [
        ("P=? [ F<=4 \"b\" ]", "25/48"),
        ("P=? [ F[2,5] \"b\" ]", "85/144"),
        ("P=? [ !\"a\" U[2,6] \"b\" ]", "277/576"),
        ("P=? [ \"deadlock\" | s<3 U<5 \"a\" ]", "19/72"),
        ("P=? [ !(F \"a\") ]", "3/10"),
        ("P=? [ (!\"a\" U \"b\") ]", "3/5"),
        ("P=? [ s=0 ]", "1"),
        ("P=? [ G F \"a\" ]", "7/10"),
        ("P=? [ F G s>=3 ]", "1"),
        ("S=? [ \"a\" ]", "21/55"),
        ("R{\"r\"}=? [ S ]", "21/55"),
        ("R{\"r\"}=? [ C ]", "inf"),
        ("R{\"t\"}=? [ C ]", "24/5"),
        ("R{\"r\"}=? [ I=3 ]", "53/40"),
        ("R{\"r\"}=? [ C<=4 ]", "799/120"),
        ("P=? [ F (P>=0.45 [ X \"a\" ] & s>0) ]", "7/10"),
        // Storm interprets these properties as `F[3,3]`, `X X X F`, and their complements.
        ("P=? [ F=3 \"b\" ]", "31/120"),
        ("P=? [ G=3 !\"b\" ]", "89/120"),
        ("P=? [ !\"a\" U=4 \"b\" ]", "349/1200"),
        ("P=? [ F>2 s=0 ]", "49/144"),
        ("P=? [ F<3 \"b\" ]", "1/4"),
        ("P=? [ G[1,3] s!=0 ]", "5/12"),
        ("P=? [ G>=2 s>=3 ]", "5/12"),
        ("P=? [ s<3 U>=2 \"b\" ]", "3/5"),
        ("P=? [ \"b\" R<=4 s!=3 ]", "53/72"),
        ("P=? [ G<=3 s<3 ]", "7/12"),
        ("P=? [ s<3 W<=4 \"b\" ]", "53/72"),
        ("P=? [ G[2,4] s>=3 ]", "5/12"),
        // Storm cannot express the remaining properties. States 3 and 4 are visited infinitely
        // often once they are reached. `a W b` and `b R !a` are equal to `a U b`, because 3 or 5 is
        // reached with probability 1.
        ("P=? [ F>=3 \"a\" ]", "7/10"),
        ("1 - P=? [ F \"a\" ]", "3/10"),
        ("P=? [ s<3 W \"b\" ]", "3/5"),
        ("P=? [ \"b\" R s!=3 ]", "3/5"),
        ("2 * P=? [ F \"a\" ] / (1 + R{\"t\"}=? [ C ])", "7/29"),
    ] {
        agree(CHAIN, question, expected);
    }
}

#[test]
fn paths_and_rewards_of_a_process_have_the_expected_values() {
    for (question, expected) in [
        ("Pmax=? [ F[2,4] \"b\" ]", "391/400"),
        ("Pmin=? [ F<=3 \"b\" ]", "0"),
        ("Pmin=? [ G s<5 ]", "0"),
        ("Pmax=? [ F=3 \"a\" ]", "21/50"),
        ("Pmin=? [ G=3 s<3 ]", "3/20"),
        ("Pmax=? [ s<3 U=2 \"a\" ]", "21/50"),
        ("Pmax=? [ F>=2 s=0 ]", "1"),
        ("Pmin=? [ G[1,2] s!=2 ]", "7/10"),
        ("Pmax=? [ s<3 W \"a\" ]", "1"),
        ("Pmin=? [ s<3 W \"a\" ]", "0"),
        ("Pmax=? [ \"b\" R s!=5 ]", "1"),
        ("R{\"r\"}min=? [ I=3 ]", "3/10"),
        ("R{\"r\"}max=? [ C<=4 ]", "264/25"),
        ("Pmax=? [ F<=3 (Pmax>=0.85 [ X \"b\" ]) ]", "191/200"),
        ("Pmax=? [ G F \"a\" ]", "0"),
        ("Pmin=? [ G F \"b\" ]", "0"),
        ("Pmax=? [ F G \"b\" ]", "1"),
        ("Pmin=? [ F G s=5 ]", "0"),
        ("R{\"r\"}min=? [ C ]", "106/17"),
        ("R{\"r\"}max=? [ C ]", "inf"),
        ("R{\"r\"}min=? [ C<=5 ]", "307/50"),
        ("R{\"r\"}max=? [ I=2 ]", "2"),
        ("Pmax=? [ F (P>=0.45 [ X \"b\" ]) ]", "1"),
        ("Pmax=? [ F (Pmin>=0.7 [ F s=4 ]) & s!=4 ]", "14/19"),
    ] {
        agree(PROCESS, question, expected);
    }
}

/// The expected aggregates are computed by hand. In states 0 to 6, P [ F d=1 ] has the values 3/10,
/// 1/5, 2/5, 0, 0, 1 and 1.
#[test]
fn filters_aggregate_the_values_of_states() {
    for (question, expected) in [
        ("filter(max, P=? [ X \"a\" ], s<3)", "1/3"),
        ("filter(sum, P=? [ F d=1 ], true)", "29/10"),
        ("filter(avg, P=? [ F d=1 ])", "29/70"),
        ("filter(min, P=? [ F d=1 ], s<3)", "1/5"),
        ("filter(count, P>=0.25 [ F d=1 ])", "4"),
        ("filter(state, P=? [ F d=1 ], s=2)", "2/5"),
        ("filter(first, P=? [ F d=1 ], s>0)", "1/5"),
        ("P=? [ F d=1 {s<3}{max} ]", "2/5"),
        ("filter(max, P=? [ F d=1 ], s<3) - filter(min, P=? [ F d=1 ], s<3)", "1/5"),
    ] {
        agree(CHAIN, question, expected);
    }
    for (question, expected) in [
        ("filter(forall, P>=1 [ F s>=3 ])", true),
        ("filter(exists, P>0.5 [ F d=1 ], s<5)", false),
        ("P>=0.7 [ F \"a\" ] & !(P>0.7 [ F \"a\" ])", true),
        ("P=? [ F \"a\" ] > P=? [ F d=1 ]", true),
        ("s=0 & \"init\"", true),
        ("filter(exists, \"deadlock\")", false),
    ] {
        let result = outcome(CHAIN, question, Exactness::Auto);
        assert!(matches!(result, Outcome::Truth(holds, _) if holds == expected), "{question}: {result:?}");
    }
    // As in PRISM, the old syntax with a bound asks whether it holds in all states, and both words ask for the range.
    for (bound, words, expected) in
        [(">=0.2", "", true), (">=0.3", "", false), (">=0.2", "{min}", true), (">=0.3", "{max}", false)]
    {
        let question = format!("P{bound} [ F d=1 {{s<3}}{words} ]");
        let result = outcome(CHAIN, &question, Exactness::Auto);
        assert!(matches!(result, Outcome::Truth(holds, _) if holds == expected), "{question}: {result:?}");
    }
    for words in ["{min}{max}", "{max}{min}"] {
        let result = outcome(CHAIN, &format!("P=? [ F d=1 {{s<3}}{words} ]"), Exactness::Auto);
        let Outcome::Range(least, greatest) = result else { panic!("{words}: {result:?}") };
        let exact =
            [least, greatest].map(|answer| answer.quantity().and_then(|quantity| quantity.exact.clone()));
        assert_eq!(exact.map(|exact| exact.expect("exact").to_string()), ["1/5", "2/5"], "{words}");
    }
    let Outcome::States(states) = outcome(CHAIN, "filter(print, P=? [ F d=1 ])", Exactness::Auto) else {
        panic!("no states");
    };
    let values: Vec<_> = states.iter().map(|listed| listed.values[0]).collect();
    assert_eq!(values, [0, 1, 2, 5, 6]);
}

/// The values of P [ F d=1 ] in the initial states 0, 1 and 2 are 3/10, 1/5 and 2/5, as in the test
/// of filters.
#[test]
fn several_initial_states_yield_a_range() {
    let model = CHAIN.replace(" init 0;", ";") + " init s<=2 & d=0 endinit";
    let result = outcome(&model, "P=? [ F d=1 ]", Exactness::Auto);
    let Outcome::Range(least, greatest) = result else { panic!("{result:?}") };
    let exact =
        |answer: &Answer| answer.quantity().and_then(|quantity| quantity.exact.clone()).expect("exact");
    assert_eq!([exact(&least), exact(&greatest)].map(|value| value.to_string()), ["1/5", "2/5"]);
    agree(&model, "filter(sum, P=? [ F d=1 ], \"init\")", "9/10");
    let result = outcome(&model, "P>=0.2 [ F d=1 ]", Exactness::Auto);
    assert!(matches!(result, Outcome::Truth(true, _)), "{result:?}");
}

#[test]
fn reward_bounds_agree_with_a_counter() {
    let counted = PROCESS
        .replace("s : [0..5] init 0;", "s : [0..5] init 0; c : [0..40] init 0;")
        .replace("(s'=", "(c'=min(40,c+COST))&(s'=")
        .replace("[wait] s=0 -> true;", "[wait] s=0 -> (c'=min(40,c+2));");
    // The cost of each command.
    let mut priced = String::new();
    for line in counted.lines() {
        let cost = match line.trim() {
            line if line.starts_with("[go] s=3") => "1",
            line if line.starts_with("[go]") => "3",
            line if line.starts_with("[back]") => "3",
            line if line.contains("s=1") || line.contains("s=2") => "2",
            _ => "0",
        };
        priced += &line.replace("COST", cost);
        priced.push('\n');
    }
    for budget in [0, 5, 6, 7, 9, 12, 20] {
        for direction in ["min", "max"] {
            let counter = format!("P{direction}=? [ F s=4 & c<={budget} ]");
            let Outcome::Value(answer) = outcome(&priced, &counter, Exactness::Always) else {
                panic!("{counter}")
            };
            let expected =
                answer.quantity().and_then(|quantity| quantity.exact.clone()).expect("exact").to_string();
            agree(PROCESS, &format!("P{direction}=? [ F^{{rew{{\"r\"}}<={budget}}} s=4 ]"), &expected);
        }
    }
}

#[test]
fn unsupported_properties_are_rejected_by_name() {
    for (question, word) in [
        ("P=? [ F (\"a\" & X \"b\") ]", "LTL"),
        ("P=? [ (F \"a\") & (F \"b\") ]", "LTL"),
        ("E [ F \"a\" ]", "CTL"),
        ("A [ G \"a\" ]", "CTL"),
        ("R{\"r\"}=? [ F (\"a\" & X \"b\") ]", "LTL"),
    ] {
        let (code, message) = error(CHAIN, question);
        assert_eq!(code, "Q403", "{question}: {message}");
        assert!(message.contains(word), "{question}: {message}");
    }
    let (code, message) = error(PROCESS, "S=? [ \"a\" ]");
    assert_eq!(code, "Q403");
    assert!(message.contains('S'), "{message}");
    for (question, code) in [
        ("P=? [ F \"none\" ]", "Q202"),
        ("P=? [ F (P=? [ X \"a\" ]) ]", "Q203"),
        ("filter(max, P=? [ F \"a\" ], false)", "Q509"),
        ("filter(state, P=? [ F \"a\" ], s<2)", "Q509"),
        ("P=? [ F[3,2] \"a\" ]", "Q503"),
        ("F \"a\"", "Q403"),
    ] {
        assert_eq!(error(CHAIN, question).0, code, "{question}");
    }
}

#[test]
fn a_property_file_declares_constants_labels_and_names() {
    let text = "// A constant that stays open, and a label.
        const int k; const int twice = 2*k;
        label \"near\" = s<=k;
        // RESULT: 25/48
        \"first\": P=? [ F<=twice \"b\" ];
        // a remark; with a semicolon
        P=? [ F \"near\" ]
        \"broken\": P=? [ F \"nowhere\" ];";
    let file = property::parse_file(text).unwrap_or_else(|error| panic!("{error:?}"));
    let names: Vec<_> =
        file.properties.iter().map(|listed| (listed.name.as_deref(), &listed.text[..])).collect();
    assert_eq!(
        names,
        [
            (Some("first"), "P=? [ F<=twice \"b\" ]"),
            (None, "P=? [ F \"near\" ]"),
            (Some("broken"), "P=? [ F \"nowhere\" ]")
        ]
    );
    let model = prism::parse(CHAIN).expect("a model");
    let mut options = Options::default().with_declarations(file.declarations);
    let properties: Vec<_> = file.properties.into_iter().map(|listed| listed.property).collect();
    let missing = check_all(&model, &properties, &options).expect_err("open constants").to_string();
    assert_eq!(missing, "constants without value: k");
    options.settings.insert("k".to_owned(), "2".to_owned());
    let reports = check_all(&model, &properties, &options).expect("reports");
    let Ok(first) = &reports[0] else { panic!("{reports:?}") };
    let Outcome::Value(Answer::Finite(quantity)) = &first.outcome else { panic!("{first:?}") };
    assert_eq!(quantity.exact.as_ref().map(ToString::to_string).as_deref(), Some("25/48"));
    assert!(matches!(&reports[2], Err(Error::Property(problems)) if problems[0].code == "Q202"));
    // An error in a declaration is attributed to the property file, not to the model.
    options.declarations.labels[0].expression = prism::ast::Expr::name("nothing");
    assert!(matches!(check_all(&model, &properties, &options), Err(Error::Property(_))));
}

#[test]
fn models_without_a_keyword_and_actions_named_like_functions() {
    let model = "module m round : [0..1] init 0; [round] round=0 -> (round'=max(round,1)); endmodule";
    agree(model, "Pmax=? [ F round=1 ]", "1");
}

/// The letter `R` begins a reward property, and is also a path operator.
#[test]
fn properties_of_rewards_need_no_semicolon_before() {
    let text = "P=? [ F \"a\" ]\nR{\"t\"}=? [ C ]\n// RESULT: 0\nR=? [ I=6 ]\nR<100 [ C<=3 ]\n\"last\": P=? [ \"b\" R s!=3 ]";
    let file = property::parse_file(text).unwrap_or_else(|error| panic!("{error:?}"));
    let texts: Vec<_> = file.properties.iter().map(|listed| &listed.text[..]).collect();
    assert_eq!(
        texts,
        ["P=? [ F \"a\" ]", "R{\"t\"}=? [ C ]", "R=? [ I=6 ]", "R<100 [ C<=3 ]", "P=? [ \"b\" R s!=3 ]"]
    );
}

#[test]
fn unsupported_properties_do_not_affect_the_others() {
    let text = "P=? [ F \"a\" ]
        P=? [ F (\"a\" & X \"b\") ] + P=? [ X (F \"a\") ]
        R{\"t\"}=? [ (s<3 U \"a\") ]
        \"ctl\": filter(forall, A [ G s<3 ], s<2) & (s=0);
        E [ F \"a\" ]
        \"part\": 1 + \"ctl\";
        P=? [ F d=1 ]";
    let file = property::parse_file(text).unwrap_or_else(|error| panic!("{error:?}"));
    let model = prism::parse(CHAIN).expect("a model");
    let options = Options::default().with_declarations(file.declarations);
    let properties = file.properties.iter().map(|listed| &listed.property);
    let reports = check_all(&model, properties, &options).expect("answers");
    let reports = reports.into_iter().map(|report| match report.map(|report| report.outcome) {
        Ok(Outcome::Value(answer)) => {
            answer.quantity().and_then(|quantity| quantity.exact.clone()).expect("exact").to_string()
        }
        Err(Error::Property(problems)) => problems[0].code.to_owned(),
        other => panic!("{other:?}"),
    });
    let expected = ["7/10", "Q403", "Q403", "Q403", "Q403", "Q403", "3/10"];
    assert_eq!(reports.collect::<Vec<_>>(), expected);
    assert_eq!(file.properties[3].text, "filter(forall, A [ G s<3 ], s<2) & (s=0)");
    let broken = property::parse_file("P=? [ F (\"a\" & X \"b\") ]; P=? [ F \"a\" + ]");
    assert!(
        matches!(broken, Err(Error::Property(problems)) if problems.len() == 1 && problems[0].code == "Q102")
    );
}

/// The values follow from those in the tests above. A label of the model takes precedence over a property
/// with the same name.
#[test]
fn named_properties_are_expanded() {
    let text = "
        \"sum\": \"less\" + 2 * \"ever\";
        \"less\": 1 - \"ever\";
        \"ever\": P=? [ F \"a\" ];
        \"likely\": P>=0.45 [ X \"a\" ];
        \"path\": P=? [ F (\"likely\" & s>0) ];
        \"all\": filter(forall, \"likely\" <=> s=3 | s=4);
        \"a\": P=? [ F \"a\" ];
        \"deadlock\": filter(exists, \"deadlock\");
        \"one\": 1 + \"two\"; \"two\": \"one\" / 2;
        \"0\": 1; \"1\": \"0\" + \"0\"; \"2\": \"1\" + \"1\"; \"3\": \"2\" + \"2\"; \"4\": \"3\" + \"3\"; \"5\": \"4\" + \"4\";
        \"6\": \"5\" + \"5\"; \"7\": \"6\" + \"6\"; \"8\": \"7\" + \"7\"; \"9\": \"8\" + \"8\"; \"10\": \"9\" + \"9\";
        \"none\": \"nothing\" + 1;";
    let file = property::parse_file(text).unwrap_or_else(|error| panic!("{error:?}"));
    let model = prism::parse(CHAIN).expect("a model");
    let options = Options::default().with_declarations(file.declarations);
    for (name, expected) in [
        ("sum", "17/10"),
        ("less", "3/10"),
        ("path", "7/10"),
        ("all", "true"),
        ("a", "7/10"),
        ("deadlock", "false"),
        ("one", "Q204"),
        ("8", "256"),
        ("10", "Q104"),
        ("none", "Q202"),
    ] {
        let listed = file.properties.iter().find(|listed| listed.name.as_deref() == Some(name));
        let property = &listed.unwrap_or_else(|| panic!("{name}")).property;
        let result = match check(&model, property, &options).map(|report| report.outcome) {
            Ok(Outcome::Value(answer)) => {
                answer.quantity().and_then(|quantity| quantity.exact.clone()).expect("exact").to_string()
            }
            Ok(Outcome::Truth(holds, _)) => holds.to_string(),
            Err(Error::Property(problems)) => problems[0].code.to_owned(),
            other => panic!("{name}: {other:?}"),
        };
        assert_eq!(result, expected, "{name}");
    }
}

/// Values by hand: the first command waits, `a` leads to the first target, and `b` to the second one or to neither.
#[test]
fn fronts_of_probabilities_do_not_wait_for_ever() {
    let model = "mdp module m s:[0..3] init 0;
        [wait] s=0 -> (s'=0); [a] s=0 -> (s'=1); [b] s=0 -> 0.5:(s'=2) + 0.5:(s'=3); [c] s>0 -> true;
        endmodule";
    for exactness in [Exactness::Always, Exactness::Never] {
        let front = outcome(model, "multi(Pmax=? [ F s=1 ], Pmax=? [ F s=2 ])", exactness);
        let Outcome::Front(points) = front else { panic!("{front:?}") };
        let upper = |answer: &Answer| answer.quantity().expect("finite").upper;
        let points: Vec<Vec<f64>> = points.iter().map(|point| point.iter().map(upper).collect()).collect();
        let expected = [[1.0, 0.0], [0.0, 0.5]];
        let is_close =
            |left: &[f64], right: &[f64]| left.iter().zip(right).all(|(l, r)| (l - r).abs() < 1e-9);
        assert!(
            points.len() == 2
                && expected.iter().all(|point| points.iter().any(|other| is_close(other, point))),
            "{points:?}"
        );
        let bounded = outcome(model, "multi(Pmax=? [ F s=1 ], P>=0.1 [ F s=2 ])", exactness);
        assert!(matches!(bounded, Outcome::Constrained { .. }), "{bounded:?}");
    }
}

/// The choice `fast` takes 2 and hits with probability 1/2, `slow` takes 3 and never hits.
#[test]
fn bounds_of_two_objectives_need_the_right_operator() {
    let model = "mdp
        module m
          s:[0..2] init 0;
          [fast] s=0 -> 1/2:(s'=1) + 1/2:(s'=2);
          [slow] s=0 -> (s'=2);
          [on] s=1 -> (s'=2);
        endmodule
        rewards \"time\" [fast] true:1; [on] true:2; [slow] true:3; endrewards
        label \"goal\" = s=2; label \"hit\" = s=1;";
    let time = "R{\"time\"}min=? [ F \"goal\" ]";
    for bound in ["Pmax<=0.1", "Pmax<0.1", "Pmax>0.1", "Pmin<=0.1", "Pmin>=0.1", "P<=0.1", "P>0.1"] {
        let question = format!("multi({time}, {bound} [ F \"hit\" ])");
        assert_eq!(error(model, &question).0, "Q403", "{question}");
    }
    for bound in ["Rmin>=3", "Rmin>3", "Rmin<3", "Rmax<=3", "R>=3", "R<3"] {
        let bound = bound.replacen('R', "R{\"time\"}", 1);
        let question = format!("multi(Pmax=? [ F \"hit\" ], {bound} [ F \"goal\" ])");
        assert_eq!(error(model, &question).0, "Q403", "{question}");
    }
    for (question, expected) in [
        (format!("multi({time}, Pmax>=0.1 [ F \"hit\" ])"), "2"),
        (format!("multi({time}, P>=0.1 [ F \"hit\" ])"), "2"),
        ("multi(Pmax=? [ F \"hit\" ], R{\"time\"}min<=2.5 [ F \"goal\" ])".to_owned(), "1/2"),
    ] {
        let result = outcome(model, &question, Exactness::Always);
        let Outcome::Constrained { deterministic, .. } = result else { panic!("{question}: {result:?}") };
        let exact = deterministic.quantity().and_then(|quantity| quantity.exact.clone());
        assert_eq!(exact.map(|exact| exact.to_string()).as_deref(), Some(expected), "{question}");
    }
}

/// An improvement of a policy travels one state in a round, so that there are more than a thousand rounds.
#[test]
fn exact_policy_iteration_ends_at_the_optimum() {
    let model = "mdp module m s:[0..1200] init 0;
        [exit] s<1200 -> (s'=1200); [back] s>0 & s<1200 -> (s'=s-1); [fwd] s<1199 -> (s'=s+1);
        endmodule
        rewards \"c\" [exit] s>0 : 1000000; [back] true : 1; [fwd] true : 1; endrewards";
    let answer = outcome(model, "filter(max, R{\"c\"}min=? [ F s=1200 ], true)", Exactness::Always);
    let Outcome::Value(Answer::Finite(quantity)) = answer else { panic!("{answer:?}") };
    assert_eq!(quantity.exact.map(|exact| exact.to_string()).as_deref(), Some("1199"));
}

/// Values by hand: the reward of the first step is within the bound, that of the last one is not.
#[test]
fn rewards_above_a_bound_need_no_memory() {
    let model = "dtmc module m s:[0..6000] init 0; [go] s<6000 -> (s'=s+1); [end] s=6000 -> true; endmodule
        rewards \"t\" [go] s=0 : 1; [go] s=5999 : 99999; endrewards";
    let question = |bound: usize, s: usize| format!("P=? [ F^{{rew{{\"t\"}}<={bound}}} s={s} ]");
    agree(model, &question(1, 5999), "1");
    agree(model, &question(1, 6000), "0");
    assert_eq!(error(model, &question(99999, 6000)).0, "Q503");
}

/// Values by hand: the probability is 1/2 in the initial state and 0 in the state 2.
#[test]
fn a_quotient_needs_a_value_only_in_the_states_of_the_question() {
    let model = "dtmc module m s:[0..2] init 0; [] s=0 -> 0.5:(s'=1) + 0.5:(s'=2); [] s>0 -> true; endmodule";
    agree(model, "1/P=? [ F s=1 ]", "2");
    agree(model, "filter(max, 1/P=? [ F s=1 ], s<2)", "2");
    assert_eq!(error(model, "filter(max, 1/P=? [ F s=1 ], true)").0, "Q303");
}

#[test]
fn a_state_without_a_choice_keeps_its_state_rewards() {
    let model = "dtmc module m x:[0..1] init 1; endmodule
        rewards \"r\" true : 1/7; [] true : 5; endrewards";
    for (question, expected) in [
        ("R{\"r\"}=? [ C<=2 ]", "2/7"),
        ("R{\"r\"}=? [ S ]", "1/7"),
        ("R{\"r\"}=? [ I=2 ]", "1/7"),
        ("P=? [ F<=3 \"deadlock\" ]", "1"),
    ] {
        agree(model, question, expected);
    }
    let two_modules =
        "mdp module m x:[0..1] init 0; [] x=0 -> (x'=1); endmodule module n y:[0..1] init 0; endmodule
        rewards \"r\" x=1 : 1/7; [] true : 5; endrewards";
    agree(two_modules, "R{\"r\"}max=? [ C<=3 ]", "37/7");
    for exactness in [Exactness::Always, Exactness::Never] {
        let total = outcome(model, "R{\"r\"}=? [ C ]", exactness);
        assert!(matches!(total, Outcome::Value(Answer::Infinite)), "{total:?}");
    }
}

/// Precedences of the manual of PRISM, strongest first: `|`, `<=>`, `=>`, `?`.
#[test]
fn equivalences_bind_more_tightly_than_implications() {
    let text = |expression: &str| {
        let model = format!(
            "mdp const bool a; const bool b; const bool c; module m x:bool init {expression}; endmodule"
        );
        let model = prism::parse(&model).expect("a model");
        let text = prism::write(&model);
        assert_eq!(prism::write(&prism::parse(&text).expect("a model")), text, "{expression}");
        text.split_once("init ")
            .and_then(|(_, rest)| rest.split_once(';'))
            .expect("an initial value")
            .0
            .to_owned()
    };
    for (expression, expected) in [
        ("a => b <=> c", "a => b <=> c"),
        ("a => (b <=> c)", "a => b <=> c"),
        ("(a => b) <=> c", "(a => b) <=> c"),
        ("a <=> b => c", "a <=> b => c"),
        ("(a <=> b) => c", "a <=> b => c"),
        ("a <=> (b => c)", "a <=> (b => c)"),
        ("a => b => c", "a => (b => c)"),
        ("a => (b => c)", "a => (b => c)"),
        ("(a => b) => c", "(a => b) => c"),
        ("a <=> b <=> c", "a <=> b <=> c"),
        ("a <=> b | c", "a <=> b | c"),
    ] {
        assert_eq!(text(expression), expected, "{expression}");
    }
    let value = "dtmc module m x:[0..1] init 0; endmodule label \"l\" = false => false <=> false;";
    agree(value, "P=? [ F<=0 \"l\" ]", "1");
    agree(value, "P=? [ F<=0 (false => false <=> false) ]", "1");
}
