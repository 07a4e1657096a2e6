//! Models with known values: exact reference values, and values computed by Storm and PRISM for
//! larger models.

use std::path::Path;
use std::process::Command;

use metaplan_probabilistic::check::{Answer, Exactness, Options, Outcome, Report, check};
use metaplan_probabilistic::number::parse_decimal;
use metaplan_probabilistic::prism::{Settings, parse};
use metaplan_probabilistic::{Number, property};
use num_rational::BigRational;
use serde_json::Value;
use test_resources::{data, python};

/// A temporary file of the authors of the models. The table has values for it, but the test data do not
/// contain it.
const TEMPORARY: &str = "prismtmp.prism";

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).expect("readable")).expect("JSON")
}

fn settings(text: &str) -> Settings {
    let pairs = text.split(',').filter_map(|pair| pair.split_once('='));
    pairs.map(|(name, value)| (name.to_owned(), value.to_owned())).collect()
}

fn run(model: &Path, text: &str, constants: &str, exactness: Exactness) -> Report {
    let source = std::fs::read_to_string(model).expect("readable");
    let model = parse(&source).unwrap_or_else(|problems| panic!("{}: {problems:?}", model.display()));
    let options =
        Options::default().with_settings(settings(constants)).with_exactness(exactness).with_policy(true);
    let property = property::parse(text).unwrap_or_else(|error| panic!("{text}: {error:?}"));
    check(&model, &property, &options).unwrap_or_else(|error| panic!("{text}: {error:?}"))
}

fn rational(text: &str) -> BigRational {
    let (numerator, denominator) = text.split_once('/').unwrap_or((text, "1"));
    parse_decimal(numerator).expect("number") / parse_decimal(denominator).expect("number")
}

/// Checks the value and the bounds of an answer, and its fraction if `is_exact`. `exact` is the expected
/// fraction, or `inf`.
fn expect(description: &str, answer: &Answer, exact: &str, is_exact: bool) {
    match answer {
        Answer::Infinite => assert_eq!(exact, "inf", "{description}"),
        Answer::Undefined => panic!("{description}: undefined"),
        Answer::Finite(quantity) => {
            assert_ne!(exact, "inf", "{description}: {quantity:?}");
            let expected = rational(exact);
            let lower = BigRational::from_float(quantity.lower).expect("finite");
            let upper = BigRational::from_float(quantity.upper)
                .unwrap_or_else(|| panic!("{description}: {quantity:?}"));
            assert!(lower <= expected && expected <= upper, "{description}: {exact} is not in {quantity:?}");
            let scale = quantity.value.abs().max(1.0);
            assert!(
                quantity.upper - quantity.lower <= 1e-6 * scale,
                "{description}: {quantity:?} is too wide"
            );
            assert!(
                (quantity.value - Number::to_f64(&expected)).abs() <= 1e-6 * scale,
                "{description}: {quantity:?}"
            );
            if is_exact {
                assert_eq!(quantity.exact, Some(expected), "{description}");
            }
        }
    }
}

#[test]
fn values_equal_the_exact_reference() {
    let Some(folder) = data("reference/prism_cases") else { return };
    for case in json(&folder.join("expected.json"))["cases"].as_array().expect("cases") {
        let text = |key: &str| case[key].as_str().expect("text");
        for exactness in [Exactness::Auto, Exactness::Never] {
            let model = folder.join(text("file"));
            let report = run(&model, text("property"), text("constants"), exactness);
            let description =
                format!("{} {} {} {exactness:?}", text("file"), text("constants"), text("property"));
            let Outcome::Value(answer) = &report.outcome else {
                panic!("{description}: {:?}", report.outcome)
            };
            expect(&description, answer, text("exact"), exactness == Exactness::Auto);
            let sizes = [report.states, report.choices, report.transitions];
            let expected =
                ["states", "choices", "transitions"].map(|key| case[key].as_u64().expect("number"));
            assert_eq!(sizes.map(|size| size as u64), expected, "{description}");
        }
    }
}

#[test]
fn two_objectives_equal_the_exact_reference() {
    let Some(folder) = data("reference/prism_cases") else { return };
    for case in json(&folder.join("expected.json"))["multi_objective"].as_array().expect("cases") {
        let text = |key: &str| case[key].as_str().expect("text");
        for exactness in [Exactness::Auto, Exactness::Never] {
            let report = run(&folder.join(text("file")), text("property"), "", exactness);
            let description = format!("{} {} {exactness:?}", text("file"), text("property"));
            match &report.outcome {
                Outcome::Front(front) => {
                    let expected = case["pareto_vertices"].as_array().expect("vertices");
                    assert_eq!(front.len(), expected.len(), "{description}: {front:?}");
                    for (pair, expected) in front.iter().zip(expected) {
                        for (answer, exact) in pair.iter().zip(expected.as_array().expect("pair")) {
                            expect(
                                &description,
                                answer,
                                exact.as_str().expect("text"),
                                exactness == Exactness::Auto,
                            );
                        }
                    }
                }
                Outcome::Constrained { randomised, deterministic, proved } => {
                    let is_exact = exactness == Exactness::Auto;
                    expect(&description, randomised, text("exact_randomised"), is_exact);
                    expect(&description, deterministic, text("exact_deterministic"), is_exact);
                    assert!(proved, "{description}");
                }
                other => panic!("{description}: {other:?}"),
            }
        }
    }
}

#[test]
fn map_models_agree_with_storm() {
    let (Some(reference), Some(summary), Some(generator), Some(python)) = (
        data("reference/storm_reference.json"),
        data("reference/p2cp3_summary.json"),
        data("tools/storm/gen_p2cp3_prism.py"),
        python(),
    ) else {
        return;
    };
    let folder = std::env::temp_dir().join(format!("metaplan-map-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let reference = json(&reference);
    for case in reference["own_models"].as_array().expect("cases") {
        let text = |key: &str| case[key].as_str().expect("text");
        let model = folder.join(Path::new(text("model")).file_name().expect("a name"));
        let generated = Command::new(&python)
            .args([&generator, &summary, &model])
            .args(text("options").split_whitespace())
            .output();
        assert!(
            generated.is_ok_and(|output| output.status.success()),
            "the script generates {}",
            text("model")
        );
        // Large models are checked once only, in doubles.
        let large = case["storm"]["states"].as_u64().is_some_and(|states| states > 5_000);
        let modes = if large { &[Exactness::Never][..] } else { &[Exactness::Auto, Exactness::Never] };
        for exactness in modes.iter().copied() {
            let report = run(&model, text("property"), "", exactness);
            let description = format!("{} {} {exactness:?}", text("options"), text("property"));
            let Outcome::Value(answer) = &report.outcome else {
                panic!("{description}: {:?}", report.outcome)
            };
            if let Some(exact) = case["exact"].as_str() {
                expect(&description, answer, exact, exactness == Exactness::Auto);
            } else {
                let value = answer.quantity().expect("finite").value;
                assert!(
                    (value - case["value"].as_f64().expect("number")).abs() < 1e-6,
                    "{description}: {value}"
                );
            }
        }
    }
    let front = &reference["own_models_pareto"][0];
    let model = folder.join("pareto.prism");
    let options = "--start 25 --goal 7 --risk hit --dark none --unavailable kinect";
    let status = Command::new(&python).args([&generator, &summary, &model]).args(options.split(' ')).output();
    assert!(status.is_ok_and(|output| output.status.success()));
    let report = run(&model, front["property"].as_str().expect("text"), "", Exactness::Auto);
    let Outcome::Front(vertices) = &report.outcome else { panic!("{:?}", report.outcome) };
    let expected = front["vertices"].as_array().expect("vertices");
    assert_eq!(vertices.len(), expected.len(), "{vertices:?}");
    for (pair, expected) in vertices.iter().zip(expected) {
        for (answer, exact) in pair.iter().zip(expected.as_array().expect("pair")) {
            expect("front", answer, exact.as_str().expect("text"), true);
        }
    }
    std::fs::remove_dir_all(&folder).expect("removed");
}

#[test]
fn repository_models_agree_with_storm() {
    let (Some(reference), Some(folder)) = (data("reference/storm_reference.json"), data("real/prism")) else {
        return;
    };
    let mut checked = 0;
    for case in json(&reference)["repository_files"].as_array().expect("cases") {
        let text = |key: &str| case[key].as_str().expect("text");
        if text("case") == TEMPORARY {
            continue;
        }
        let Some(model) = data(folder.join(text("case"))) else { continue };
        checked += 1;
        for exactness in [Exactness::Auto, Exactness::Never] {
            let report = run(&model, text("property"), text("constants"), exactness);
            let description = format!("{} {} {exactness:?}", text("case"), text("property"));
            let Outcome::Value(answer) = &report.outcome else {
                panic!("{description}: {:?}", report.outcome)
            };
            let value = answer.quantity().unwrap_or_else(|| panic!("{description}: {answer:?}")).value;
            assert!((value - case["value"].as_f64().expect("number")).abs() < 1e-6, "{description}: {value}");
            assert_eq!(
                report.states as u64,
                case["storm"]["states"].as_u64().expect("number"),
                "{description}"
            );
        }
    }
    assert!(checked > 0, "no file of the reference is there");
}
