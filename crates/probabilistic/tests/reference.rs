//! Models with known values: exact ones, and those of Storm and PRISM on larger models.

#![allow(clippy::print_stdout)]

use std::path::{Path, PathBuf};
use std::process::Command;

use metaplan_probabilistic::check::{Answer, Exactness, Options, Outcome, Report, check};
use metaplan_probabilistic::number::parse_decimal;
use metaplan_probabilistic::prism::{Settings, parse};
use metaplan_probabilistic::{Number, property};
use num_rational::BigRational;
use serde_json::Value;

fn shared(path: &str) -> Option<PathBuf> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared")).join(path);
    if !path.exists() {
        println!("skipped: {} is not there", path.display());
    }
    path.exists().then_some(path)
}

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

/// The value, its bounds and its exact form, against what is expected; `exact` is a fraction or `inf`.
fn expect(what: &str, answer: &Answer, exact: &str, is_exact: bool) {
    match answer {
        Answer::Infinite => assert_eq!(exact, "inf", "{what}"),
        Answer::Undefined => panic!("{what}: undefined"),
        Answer::Finite(quantity) => {
            assert_ne!(exact, "inf", "{what}: {quantity:?}");
            let expected = rational(exact);
            let lower = BigRational::from_float(quantity.lower).expect("finite");
            let upper =
                BigRational::from_float(quantity.upper).unwrap_or_else(|| panic!("{what}: {quantity:?}"));
            assert!(lower <= expected && expected <= upper, "{what}: {exact} is not in {quantity:?}");
            let scale = quantity.value.abs().max(1.0);
            assert!(quantity.upper - quantity.lower <= 1e-6 * scale, "{what}: {quantity:?} is too wide");
            assert!(
                (quantity.value - Number::to_f64(&expected)).abs() <= 1e-6 * scale,
                "{what}: {quantity:?}"
            );
            if is_exact {
                assert_eq!(quantity.exact, Some(expected), "{what}");
            }
        }
    }
}

#[test]
fn exact_cases() {
    let Some(folder) = shared("reference/prism_cases") else { return };
    for case in json(&folder.join("expected.json"))["cases"].as_array().expect("cases") {
        let text = |key: &str| case[key].as_str().expect("text");
        for exactness in [Exactness::Auto, Exactness::Never] {
            let model = folder.join(text("file"));
            let report = run(&model, text("property"), text("constants"), exactness);
            let what = format!("{} {} {} {exactness:?}", text("file"), text("constants"), text("property"));
            let Outcome::Value(answer) = &report.outcome else { panic!("{what}: {:?}", report.outcome) };
            expect(&what, answer, text("exact"), exactness == Exactness::Auto);
            let sizes = [report.states, report.choices, report.transitions];
            let expected =
                ["states", "choices", "transitions"].map(|key| case[key].as_u64().expect("number"));
            assert_eq!(sizes.map(|size| size as u64), expected, "{what}");
        }
    }
}

#[test]
fn two_objectives() {
    let Some(folder) = shared("reference/prism_cases") else { return };
    for case in json(&folder.join("expected.json"))["multi_objective"].as_array().expect("cases") {
        let text = |key: &str| case[key].as_str().expect("text");
        for exactness in [Exactness::Auto, Exactness::Never] {
            let report = run(&folder.join(text("file")), text("property"), "", exactness);
            let what = format!("{} {} {exactness:?}", text("file"), text("property"));
            match &report.outcome {
                Outcome::Front(found) => {
                    let expected = case["pareto_vertices"].as_array().expect("vertices");
                    assert_eq!(found.len(), expected.len(), "{what}: {found:?}");
                    for (pair, expected) in found.iter().zip(expected) {
                        for (answer, exact) in pair.iter().zip(expected.as_array().expect("pair")) {
                            expect(
                                &what,
                                answer,
                                exact.as_str().expect("text"),
                                exactness == Exactness::Auto,
                            );
                        }
                    }
                }
                Outcome::Constrained { randomised, deterministic, proved } => {
                    let is_exact = exactness == Exactness::Auto;
                    expect(&what, randomised, text("exact_randomised"), is_exact);
                    expect(&what, deterministic, text("exact_deterministic"), is_exact);
                    assert!(proved, "{what}");
                }
                other => panic!("{what}: {other:?}"),
            }
        }
    }
}

#[test]
fn storm_on_models_of_the_map() {
    let (Some(reference), Some(summary), Some(generator)) = (
        shared("reference/storm_reference.json"),
        shared("reference/p2cp3_summary.json"),
        shared("tools/storm/gen_p2cp3_prism.py"),
    ) else {
        return;
    };
    let folder = std::env::temp_dir().join(format!("metaplan-map-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let reference = json(&reference);
    for case in reference["own_models"].as_array().expect("cases") {
        let text = |key: &str| case[key].as_str().expect("text");
        let model = folder.join(Path::new(text("model")).file_name().expect("a name"));
        let made = Command::new("python3")
            .args([&generator, &summary, &model])
            .args(text("options").split_whitespace())
            .output();
        if !made.is_ok_and(|output| output.status.success()) {
            println!("skipped: no python3 to generate the models");
            return;
        }
        // Large models are not solved exactly, and once is enough.
        let large = case["storm"]["states"].as_u64().is_some_and(|states| states > 5_000);
        let ways = if large { &[Exactness::Never][..] } else { &[Exactness::Auto, Exactness::Never] };
        for exactness in ways.iter().copied() {
            let report = run(&model, text("property"), "", exactness);
            let what = format!("{} {} {exactness:?}", text("options"), text("property"));
            let Outcome::Value(answer) = &report.outcome else { panic!("{what}: {:?}", report.outcome) };
            if let Some(exact) = case["exact"].as_str() {
                expect(&what, answer, exact, exactness == Exactness::Auto);
            } else {
                let value = answer.quantity().expect("finite").value;
                assert!((value - case["value"].as_f64().expect("number")).abs() < 1e-6, "{what}: {value}");
            }
        }
    }
    let front = &reference["own_models_pareto"][0];
    let model = folder.join("pareto.prism");
    let options = "--start 25 --goal 7 --risk hit --dark none --unavailable kinect";
    let status =
        Command::new("python3").args([&generator, &summary, &model]).args(options.split(' ')).output();
    assert!(status.is_ok_and(|output| output.status.success()));
    let report = run(&model, front["property"].as_str().expect("text"), "", Exactness::Auto);
    let Outcome::Front(found) = &report.outcome else { panic!("{:?}", report.outcome) };
    let expected = front["vertices"].as_array().expect("vertices");
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (pair, expected) in found.iter().zip(expected) {
        for (answer, exact) in pair.iter().zip(expected.as_array().expect("pair")) {
            expect("front", answer, exact.as_str().expect("text"), true);
        }
    }
    std::fs::remove_dir_all(&folder).expect("removed");
}

#[test]
fn files_of_the_repository() {
    let (Some(reference), Some(folder)) = (shared("reference/storm_reference.json"), shared("real/prism"))
    else {
        return;
    };
    let mut checked = 0;
    for case in json(&reference)["repository_files"].as_array().expect("cases") {
        let text = |key: &str| case[key].as_str().expect("text");
        let model = folder.join(text("case"));
        if !model.exists() {
            println!("skipped: {} is not there", model.display());
            continue;
        }
        checked += 1;
        for exactness in [Exactness::Auto, Exactness::Never] {
            let report = run(&model, text("property"), text("constants"), exactness);
            let what = format!("{} {} {exactness:?}", text("case"), text("property"));
            let Outcome::Value(answer) = &report.outcome else { panic!("{what}: {:?}", report.outcome) };
            let value = answer.quantity().unwrap_or_else(|| panic!("{what}: {answer:?}")).value;
            assert!((value - case["value"].as_f64().expect("number")).abs() < 1e-6, "{what}: {value}");
            assert_eq!(report.states as u64, case["storm"]["states"].as_u64().expect("number"), "{what}");
        }
    }
    assert!(checked > 0, "no file of the reference is there");
}
