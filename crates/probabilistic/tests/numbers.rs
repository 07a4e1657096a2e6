//! Numbers at the limits of their types: each number is computed as defined or rejected with its
//! position, and none wraps around.

use metaplan_probabilistic::check::{Exactness, Options, Outcome, PolicyTable, check};
use metaplan_probabilistic::explore::Bounds;
use metaplan_probabilistic::{Diagnostic, Error, prism, property};

fn first(problems: &[Diagnostic]) -> String {
    let problem = &problems[0];
    format!("{} {}:{}", problem.code, problem.place.line, problem.place.column)
}

fn value_or_error(model: &str, question: &str) -> String {
    value_or_error_with(model, question, Exactness::Auto)
}

fn value_or_error_with(model: &str, question: &str, exactness: Exactness) -> String {
    let model = match prism::parse(model) {
        Ok(model) => model,
        Err(error) => return first(error.diagnostics()),
    };
    let property = match property::parse(question) {
        Ok(property) => property,
        Err(Error::Property(problems)) => return first(&problems),
        Err(other) => panic!("{other}"),
    };
    // The only limits are memory and the range of state numbers.
    let bounds = Bounds::default().with_states(usize::MAX);
    match check(&model, &property, &Options::default().with_bounds(bounds).with_exactness(exactness)) {
        Ok(report) => match report.outcome {
            Outcome::Value(answer) => {
                answer.quantity().map_or(f64::NAN, |quantity| quantity.value).to_string()
            }
            other => panic!("{other:?}"),
        },
        Err(Error::Model(problems) | Error::Property(problems)) => first(&problems),
        Err(other) => panic!("{other}"),
    }
}

/// Creates a model with a range and an initial value on the second line, and a command on the third
/// line.
fn counter_model(range: &str, initial: &str, command: &str) -> String {
    let least = "const int least = -9223372036854775807-1; const int greatest = 9223372036854775807;";
    format!("mdp {least}\nmodule m s:[{range}] init {initial};\n{command}\nendmodule")
}

#[test]
fn ranges_may_span_the_integer_type() {
    for (range, initial, command, goal, expected) in [
        ("0..9223372036854775807", "greatest", "[] s>greatest-9 -> (s'=s-1);", "s=greatest-9", "1"),
        ("0..9223372036854775807", "greatest", "[] true -> (s'=s+1);", "s=0", "Q303 3:13"),
        ("least..greatest", "least", "[] s=least -> (s'=greatest);", "s=greatest", "1"),
        ("least..greatest", "0", "[] s=0 -> 0.25:(s'=least)+0.75:(s'=greatest);", "s=least", "0.25"),
        ("least..greatest", "least", "[] true -> (s'=s-1);", "s>0", "Q303 3:13"),
        ("least..greatest", "least", "[] true -> (s'=-s);", "s>0", "Q303 3:13"),
        ("least..greatest", "least", "[] true -> (s'=2*s);", "s>0", "Q303 3:13"),
        ("least..0", "least", "[] true -> (s'=mod(s,-1));", "s>0", "Q303 3:13"),
        ("least..0", "least", "[] true -> (s'=mod(s,0));", "s>0", "Q303 3:13"),
        ("least..greatest", "least", "[] s<0 -> (s'=mod(s,greatest));", "s=greatest-1", "1"),
        ("0..9", "0", "[] true -> (s'=floor(1e30));", "s>0", "Q303 3:13"),
        ("0..9", "0", "[] true -> (s'=ceil(-1e30));", "s>0", "Q303 3:13"),
        ("0..9", "0", "[] true -> (s'=round(1e300*1e100));", "s>0", "Q303 3:13"),
        ("0..pow(10,400)", "0", "[] true -> (s'=1);", "s>0", "Q303 2:16"),
        ("0..9223372036854775808", "0", "[] true -> (s'=1);", "s>0", "Q105 2:16"),
        ("0..greatest+1", "0", "[] true -> (s'=1);", "s>0", "Q303 2:16"),
        ("0..9", "pow(2,9223372036854775807)", "[] true -> (s'=1);", "s>0", "Q303 2:24"),
        // Powers of 0, 1 and -1 are small even for huge exponents.
        ("-1..1", "pow(-1,greatest)", "[] s<0 -> (s'=pow(1,greatest));", "s=1", "1"),
        ("-1..1", "pow(-1,greatest-1)", "[] s>0 -> (s'=pow(0,greatest));", "s=0", "1"),
        ("0..1", "0", "[] s=0 -> (s'=pow(0,0));", "s=1", "1"),
        // Commands are indexed by the value to which their guard fixes a variable; the value may be
        // outside the range.
        ("0..3", "0", "[a] s=greatest -> (s'=1); [a] s=least -> (s'=1); [a] s=0 -> (s'=2);", "s=2", "1"),
        ("-3..3", "-3", "[a] s=-4 -> (s'=1); [a] s=4 -> (s'=1); [a] s=-3 -> (s'=2);", "s=2", "1"),
    ] {
        let model = counter_model(range, initial, command);
        assert_eq!(value_or_error(&model, &format!("Pmax=? [ F {goal} ]")), expected, "{model}");
    }
}

#[test]
fn probabilities_and_rewards_beyond_doubles_are_rejected() {
    for (command, reward, expected) in [
        ("[] s=0 -> (s'=1);", "pow(10.5,400)", "Q303 5:21"),
        ("[] s=0 -> (s'=1);", "1e2147483648", "Q105 5:25"),
        ("[] s=0 -> (s'=1);", "1e401", "Q105 5:25"),
        ("[] s=0 -> (s'=1);", "pow(0.0,-1.0)", "Q303 5:21"),
        ("[] s=0 -> 1e-300:(s'=1)+1-1e-300:(s'=0);", "1", "Q303 3:1"),
    ] {
        let model = counter_model("0..1", "0", command);
        let model = format!("{model}\nrewards \"r\" true:0; s=0:{reward}; endrewards");
        assert_eq!(
            value_or_error_with(&model, "R{\"r\"}min=? [ F s=1 ]", Exactness::Never),
            expected,
            "{model}"
        );
    }
}

#[test]
fn step_bounds_are_integers_and_are_not_rounded() {
    // The state is 3 after 3 steps and not earlier.
    let model = counter_model("0..3", "0", "[] s<3 -> (s'=s+1);");
    for (bound, expected) in [
        ("<=3", "1"),
        ("<=2", "0"),
        ("<3", "0"),
        ("<4", "1"),
        ("<=(2.5)", "Q203 1:15"),
        // The nearest double of this number is 3.
        ("<=(2.99999999999999999999)", "Q203 1:15"),
        ("<=999999999", "1"),
        ("<=1000000000", "Q503 1:14"),
        ("<1000000000", "1"),
        ("<=9223372036854775807", "Q503 1:14"),
        ("<=9223372036854775808", "Q102 1:14"),
        ("<=greatest", "Q503 1:14"),
        ("<=(pow(10,300))", "Q303 1:15"),
        ("<=least", "Q503 1:14"),
        ("<0", "Q503 1:13"),
        ("<=(-1)", "Q503 1:15"),
    ] {
        assert_eq!(value_or_error(&model, &format!("Pmax=? [ F {bound} s=3 ]")), expected, "{bound}");
    }
}

#[test]
fn the_message_about_a_strict_step_bound_excludes_zero() {
    let model = prism::parse(&counter_model("0..3", "0", "[] s<3 -> (s'=s+1);")).expect("a model");
    for (bound, expected) in
        [("<0", "at least 1 and at most 10^9 for `<`"), ("<=(-1)", "at least 0 and below 10^9")]
    {
        let property = property::parse(&format!("Pmax=? [ F {bound} s=3 ]")).expect("a property");
        match check(&model, &property, &Options::default()) {
            Err(Error::Property(problems)) => assert!(problems[0].message.contains(expected), "{problems:?}"),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn rational_logarithms_and_roots_are_exact() {
    for (condition, expected) in [
        ("log(1000,10)=3", "1"),
        ("log(1/8,2)=-3", "1"),
        ("log(1,7)=0", "1"),
        ("log(1.21,1.1)=2", "1"),
        ("log(1000,10)<3", "0"),
        ("pow(8.0,1/3)=2", "1"),
        ("pow(4/9,1.5)=8/27", "1"),
        ("pow(4/9,-0.5)=3/2", "1"),
        ("pow(2.0,0.5)>1.41421356 & pow(2.0,0.5)<1.41421357", "1"),
        ("log(10,2)>3.3219280948 & log(10,2)<3.3219280949", "1"),
        ("pow(0.0,0.5)=0", "1"),
    ] {
        let model = format!("dtmc module m s:[0..1] init 0; endmodule label \"l\" = {condition};");
        assert_eq!(value_or_error(&model, "P=? [ F \"l\" ]"), expected, "{condition}");
    }
}

#[test]
fn a_policy_with_an_invalid_choice_is_rejected() {
    let model = prism::parse(&counter_model("0..3", "0", "[] s<3 -> (s'=s+1);")).expect("a model");
    let property = property::parse("Pmax=? [ F s=3 ]").expect("a property");
    for (choice, expected) in [
        ("0", None),
        ("1", Some("state 2: the model has no such choice there")),
        ("18446744073709551615", Some("state 2: the model has no such choice there")),
        ("18446744073709551616", Some("state 2: `choice` must be a number")),
        ("-1", Some("state 2: `choice` must be a number")),
        ("0.5", Some("state 2: `choice` must be a number")),
    ] {
        // The choices of the second state have global numbers that do not start with 0.
        let row = |s: u8, choice: &str| {
            format!("{{\"state\": {{\"s\": {s}}}, \"action\": \"\", \"choice\": {choice}}}")
        };
        let rows = [row(0, "0"), row(1, choice), row(2, "0")].join(", ");
        let json = format!("{{\"format\": \"metaplan-policy/1\", \"states\": [{rows}]}}");
        let result = PolicyTable::from_json(&json)
            .and_then(|table| check(&model, &property, &Options::default().with_evaluation(table)));
        assert_eq!(result.err().map(|error| error.to_string()).as_deref(), expected, "{choice}");
    }
}
