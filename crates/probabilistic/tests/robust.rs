//! Random texts do not make the parser or the checker panic. A model that is written as text and parsed
//! again is unchanged.

use metaplan_probabilistic::check::{Answer, Exactness, Options, Outcome, check};
use metaplan_probabilistic::explore::Bounds;
use metaplan_probabilistic::{Error, jani, prism, property};
use proptest::prelude::*;

const MODEL: &str = "mdp
const int N = 3;
formula done = s=N | (d & !(s=0));
global g : [0..2];
module first
  s : [0..N] init 0; d : bool init false;
  [a] s<N -> 1/3:(s'=s+1) + 2/3:(s'=min(s,1))&(d'=!d);
  [b] s<N & g=0 -> (s'=N);
  [] g<2 & mod(s,2)=0 -> (g'=g+1);
endmodule
module second = first [s=t, d=e, a=c] endmodule
rewards \"cost\"
  [a] d : 2; [c] true : s+0.5; done : 1;
endrewards
rewards \"toll\" [b] true : 2; s=1 : 1; endrewards
label \"goal\" = done & t>=1;
";

/// The exploration reports the excess before all initial states are listed.
#[test]
fn initial_states_count_for_the_limit_on_states() {
    let model = "mdp module m x:[0..9999]; [] true -> true; endmodule init x>=10 endinit";
    let model = prism::parse(model).expect("a model");
    let question = property::parse("Pmax=? [ F x=1 ]").expect("a property");
    for exactness in [Exactness::Always, Exactness::Never] {
        let limited = |states: usize| {
            let bounds = Bounds::default().with_states(states);
            check(&model, &question, &Options::default().with_exactness(exactness).with_bounds(bounds))
        };
        let report = limited(9990).expect("all states are within the limit");
        assert_eq!(report.states, 9990);
        for limit in [0, 1000, 9989] {
            let error = limited(limit).expect_err("the limit is exceeded");
            let Error::StateLimit { states, limit: reported } = error else { panic!("{error}") };
            assert_eq!((states, reported), (limit + 1, limit));
        }
    }
}

const WORDS: [&str; 24] = [
    "module",
    "endmodule",
    "[",
    "]",
    "(",
    ")",
    "->",
    "true",
    "s",
    "'",
    "=",
    "+",
    ":",
    ";",
    "..",
    "?",
    "label",
    "\"goal\"",
    "-",
    "9999999999999999999",
    "0.5",
    "rewards",
    "endrewards",
    "init",
];

const PROPERTIES: [&str; 12] = [
    "Pmax=? [ (!d U[1,4] \"goal\") ]",
    "1 - Pmin=? [ d=false W<=3 s=N ] / 2",
    "Pmax>=1/2 [ F=3 s=1 ] & !(Pmin<0.1 [ \"goal\" R g<2 ])",
    "filter(max, R{\"cost\"}min=? [ C<=4 ], s>0 | \"deadlock\")",
    "filter(forall, Pmax>0 [ X (Pmin<=0 [ G F d ]) ], \"init\")",
    "filter(print, Pmin=? [ F G g=2 ])",
    "R{\"cost\"}max=? [ F done ] + filter(count, s=N)",
    "R{\"cost\"}min=? [ I=2 ] * (2 - Pmax=? [ F>=2 done ])",
    "R{\"cost\"}min=? [ C ]",
    "Pmax=? [ F^{rew{\"toll\"}<=5} \"goal\" {g=0}{min} ]",
    "multi(R{\"cost\"}min=? [ F \"goal\" ], Pmax>=0.5 [ F s=N ])",
    "filter(argmax, Pmax=? [ G<=2 s<N ], mod(s,2)=0)",
];

const PROPERTY_WORDS: [&str; 32] = [
    "P",
    "Pmax",
    "Pmin=?",
    "R{\"cost\"}",
    "=?",
    ">=",
    "<0.5",
    "[",
    "]",
    "(",
    ")",
    "{",
    "}",
    "F",
    "G",
    "X",
    "U",
    "W",
    "R",
    "C",
    "I=2",
    "S",
    "<=3",
    "[1,2]",
    "!",
    "&",
    "filter(",
    "sum,",
    ",",
    "\"goal\"",
    "multi(",
    "s",
];

fn survive(text: &str) {
    if let Ok(model) = prism::parse(text) {
        let property = property::parse("Pmax=? [ F \"goal\" ]").expect("a property");
        let options = Options::default().with_bounds(Bounds::default().with_states(2000));
        let _ = check(&model, &property, &options);
        let _ = jani::write("model", &model);
    }
}

fn survive_property(question: &str) {
    thread_local! {
        static READ: prism::ast::Model = prism::parse(MODEL).expect("a model");
    }
    if let Ok(property) = property::parse(question) {
        let options = Options::default().with_bounds(Bounds::default().with_states(2000));
        READ.with(|model| {
            let _ = check(model, &property, &options);
        });
    }
}

#[test]
fn intact_properties_have_answers() {
    let model = prism::parse(MODEL).expect("a model");
    for question in PROPERTIES {
        let property = property::parse(question).unwrap_or_else(|error| panic!("{question}: {error:?}"));
        check(&model, &property, &Options::default()).unwrap_or_else(|error| panic!("{question}: {error:?}"));
    }
}

#[test]
fn recursive_formulas_are_rejected() {
    let model = "mdp formula a = b; formula b = a; module m s:[0..1] init 0; [] a -> (s'=1); endmodule";
    survive(&format!("{model} label \"goal\" = a;"));
    let problems = jani::write("m", &prism::parse(model).expect("a model")).expect_err("refused");
    assert_eq!(
        problems.diagnostics().iter().map(|problem| problem.code).collect::<Vec<_>>(),
        ["Q204", "Q204"]
    );
}

/// The search for recursive formulas follows each reference once.
#[test]
fn a_long_chain_of_formulas_is_refused_at_once() {
    let links = (1..20_000).map(|link| format!("formula f{link} = f{} + s;", link - 1));
    let links = links.collect::<Vec<_>>().concat();
    let text =
        format!("mdp formula f0 = s; {links} module m s:[0..1] init 0; [] f19999 = 0 -> (s'=1); endmodule");
    let problems = jani::write("m", &prism::parse(&text).expect("a model")).expect_err("refused");
    assert!(problems.to_string().contains("nested too deeply"), "{problems}");
}

#[test]
fn a_written_model_parses_to_the_same_model() {
    let model = prism::parse(MODEL).expect("a model");
    let text = prism::write(&model);
    let parsed = prism::parse(&text).unwrap_or_else(|problems| panic!("{problems:?}\n{text}"));
    assert_eq!(prism::write(&parsed), text);
    for question in [
        "Pmax=? [ F \"goal\" ]",
        "R{\"cost\"}min=? [ F done ]",
        "Pmin=? [ d=false U s=N ]",
        "Pmin=? [ G<=5 s<N ]",
    ] {
        let property = property::parse(question).expect("a property");
        let outcome = |model| check(model, &property, &Options::default()).expect("an answer").outcome;
        assert_eq!(outcome(&model), outcome(&parsed), "{question}");
    }
}

#[test]
fn exact_and_rounded_answers_agree() {
    use metaplan_probabilistic::check::{Exactness, Outcome};
    let model = prism::parse(MODEL).expect("a model");
    for question in [
        "Pmax=? [ F \"goal\" ]",
        "Pmin=? [ F \"goal\" ]",
        "R{\"cost\"}min=? [ F done ]",
        "R{\"cost\"}max=? [ F done ]",
        "Pmax=? [ X d ]",
        "Pmax=? [ F<=4 \"goal\" ]",
        "R{\"cost\"}max=? [ C<=7 ]",
    ] {
        let property = property::parse(question).expect("a property");
        let [exact, rounded] = [Exactness::Always, Exactness::Never].map(|exactness| {
            let options = Options::default().with_exactness(exactness);
            check(&model, &property, &options).expect("an answer").outcome
        });
        let (Outcome::Value(exact), Outcome::Value(rounded)) = (exact, rounded) else { panic!("{question}") };
        match (exact.quantity(), rounded.quantity()) {
            (Some(exact), Some(rounded)) => assert!(
                rounded.lower <= exact.upper
                    && exact.lower <= rounded.upper
                    && (exact.value - rounded.value).abs() < 1e-9,
                "{question}: {exact:?} {rounded:?}"
            ),
            (None, None) => {}
            other => panic!("{question}: {other:?}"),
        }
    }
}

fn cases() -> u32 {
    std::env::var("PROPTEST_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(200)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn broken_models_do_not_panic(at in 0..MODEL.len(), length in 0_usize..40, word in 0..WORDS.len()) {
        let end = (at + length).min(MODEL.len());
        survive(&format!("{}{}{}", &MODEL[..at], WORDS[word], &MODEL[end..]));
    }

    #[test]
    fn words_in_any_order_do_not_panic(words in prop::collection::vec(0..WORDS.len(), 0..40)) {
        let text: Vec<&str> = words.into_iter().map(|word| WORDS[word]).collect();
        survive(&format!("mdp {}", text.join(" ")));
        let _ = property::parse(&text.join(" "));
    }

    #[test]
    fn broken_properties_do_not_panic(
        which in 0..PROPERTIES.len(),
        at in 0.0..1.0_f64,
        length in 0_usize..12,
        words in prop::collection::vec(0..PROPERTY_WORDS.len(), 0..3),
    ) {
        let text: Vec<char> = PROPERTIES[which].chars().collect();
        let at = (at * text.len() as f64) as usize;
        let end = (at + length).min(text.len());
        let words: Vec<&str> = words.into_iter().map(|word| PROPERTY_WORDS[word]).collect();
        let part = |range: &[char]| range.iter().collect::<String>();
        survive_property(&format!("{} {} {}", part(&text[..at]), words.join(" "), part(&text[end..])));
    }

    #[test]
    fn property_words_in_any_order_do_not_panic(
        words in prop::collection::vec(0..PROPERTY_WORDS.len(), 0..16),
    ) {
        let words: Vec<&str> = words.into_iter().map(|word| PROPERTY_WORDS[word]).collect();
        survive_property(&words.join(" "));
    }
}

/// A random walk on a torus. Elimination would have much fill-in in two dimensions, so interval
/// iteration is used.
#[test]
#[ignore = "20 s in release, minutes in debug: a component of 90,000 states"]
fn a_large_component_gets_bounds() {
    let model = prism::parse(
        "mdp
         module walk
           x:[0..299] init 0;
           y:[0..299] init 0;
           home:bool init false;
           [east] !home -> 0.9:(x'=mod(x+1,300)) + 0.08:(y'=mod(y+1,300)) + 0.02:(home'=true);
           [north] !home -> 0.5:(y'=mod(y+7,300)) + 0.48:(x'=mod(x+299,300)) + 0.02:(home'=true);
         endmodule
         rewards \"cost\" [east] true : 1 + mod(x*y,5); [north] true : 2 + mod(x+y,3); endrewards
         label \"home\" = home;",
    )
    .expect("a model");
    for question in ["R{\"cost\"}min=? [ F \"home\" ]", "R{\"cost\"}max=? [ F \"home\" ]"] {
        let property = property::parse(question).expect("a property");
        let options = Options::default().with_exactness(Exactness::Never);
        let report = check(&model, &property, &options).expect("an answer");
        let Outcome::Value(Answer::Finite(cost)) = report.outcome else { panic!("{:?}", report.outcome) };
        assert!(cost.lower <= cost.value && cost.value <= cost.upper);
        assert!(cost.upper - cost.lower <= 1e-6 * cost.value, "{cost:?}");
    }
}

#[test]
fn jani_has_the_initial_states_of_the_model() {
    let model = "dtmc
        module m s:[0..2]; d:bool; [] s<2 -> (s'=s+1); endmodule
        init s>0 & !d endinit";
    let jani = jani::write("m", &prism::parse(model).expect("a model")).expect("JANI");
    let variables = jani["variables"].as_array().expect("variables");
    assert!(variables.iter().all(|variable| variable.get("initial-value").is_none()), "{jani}");
    assert_eq!(jani["restrict-initial"]["exp"]["op"], "\u{2227}", "{jani}");
    let without = model.replace("init s>0 & !d endinit", "");
    let jani = jani::write("m", &prism::parse(&without).expect("a model")).expect("JANI");
    assert!(jani.get("restrict-initial").is_none(), "{jani}");
    assert_eq!(jani["variables"][0]["initial-value"], 0);
}

#[test]
fn labels_in_jani_are_expanded_and_truth_values_are_compared() {
    let model = "dtmc
        module m x:[0..2] init 0; y:[0..1] init 0; [] x<2 -> (x'=x+1); endmodule
        label \"x\" = x=2; label \"both\" = \"x\" & y=1; label \"equal\" = x=1 <=> y=1;";
    let jani = jani::write("m", &prism::parse(model).expect("a model")).expect("JANI");
    let values = jani["automata"][0]["locations"][0]["transient-values"].as_array().expect("values");
    let value = |name: &str| {
        let assignment = values.iter().find(|assignment| assignment["ref"] == name);
        assignment.unwrap_or_else(|| panic!("no {name}: {jani}"))["value"].clone()
    };
    let equal = |name: &str, number: i64| serde_json::json!({ "op": "=", "left": name, "right": number });
    let binary = |op: &str, left: &str, number: i64| serde_json::json!({ "op": op, "left": equal(left, number), "right": equal("y", 1) });
    assert_eq!(value("both"), binary("\u{2227}", "x", 2));
    assert_eq!(value("equal"), binary("=", "x", 1));
    let cyclic = model.replace("\"x\" = x=2", "\"x\" = \"both\"");
    assert!(jani::write("m", &prism::parse(&cyclic).expect("a model")).is_err());
}

/// Exploration of these models ends at once, so only the computation of the values can be cancelled.
#[test]
fn computations_of_values_are_cancelled() {
    let model = "mdp module m s:[0..2] init 0; [a] s=0 -> 0.5:(s'=1) + 0.5:(s'=0); [b] s=1 -> 0.5:(s'=0) + 0.5:(s'=2);
        [c] s=1 -> (s'=0); endmodule rewards \"cost\" [a] true : 1; endrewards label \"goal\" = s=2;";
    let front = "mdp module m s:[0..600] init 0; [a] s<600 -> (s'=s+1); [b] s<600 -> (s'=s+1); endmodule
        rewards \"a\" [a] true : s+1; endrewards rewards \"b\" [b] true : 600-s; endrewards label \"goal\" = s=600;";
    for (model, number, question, exactness) in [
        (model, 3, "R{\"cost\"}max=? [ C<=999999999 ]", Exactness::Never),
        (model, 3, "Pmax=? [ F^{rew{\"cost\"}<=99999} s=7 ]", Exactness::Always),
        (front, 601, "multi(R{\"a\"}min=? [ F \"goal\" ], R{\"b\"}min=? [ F \"goal\" ])", Exactness::Always),
        (front, 601, "multi(R{\"a\"}min=? [ F \"goal\" ], R{\"b\"}<=9000 [ F \"goal\" ])", Exactness::Always),
    ] {
        let model = prism::parse(model).expect("a model");
        let question = property::parse(question).expect("a property");
        let calls = std::cell::Cell::new(0);
        // The second call cancels. A later one would belong to a computation that starts again in doubles.
        let progress = |_: usize| calls.replace(calls.get() + 1) != 1;
        let options = Options::default().with_exactness(exactness);
        let options = options.with_bounds(Bounds::default().with_progress(&progress));
        let cancelled = check(&model, &question, &options).map(|report| report.outcome);
        assert!(
            matches!(cancelled, Err(Error::Interrupted { states }) if states == number),
            "{question:?}: {cancelled:?}"
        );
    }
}
