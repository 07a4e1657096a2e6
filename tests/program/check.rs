//! Tests of `metaplan check`: rejected inputs, and policies in files.

use std::path::Path;

use test_resources::data;

use crate::common::{headlines, metaplan, metaplan_in, root};

const MODEL: &str =
    "mdp\nmodule m\n  s:[0..2] init 0;\n  [a] s=0 -> PROBABILITIES;\nendmodule\nlabel \"goal\" = s=1;\n";

#[test]
fn invalid_models_and_properties_are_refused_with_their_position() {
    let good = "0.5:(s'=1) + 0.5:(s'=2)";
    // Updates, property, exit status, and a part of the output.
    let cases = [
        (good, "Pmax=? [ F \"goal\" ]", 0, "0.5"),
        ("0.5:(s'=1) + 0.4:(s'=2)", "Pmax=? [ F \"goal\" ]", 3, "<stdin>:4:3: error[Q301]"),
        ("(s'=3)", "Pmax=? [ F \"goal\" ]", 3, "<stdin>:4:15: error[Q305]"),
        ("(t'=1)", "Pmax=? [ F \"goal\" ]", 3, "<stdin>:4:15: error[Q201]"),
        ("(s'=1", "Pmax=? [ F \"goal\" ]", 3, "<stdin>:4:19: error[Q102]"),
        (good, "Pmax=? [ F \"nowhere\" ]", 3, "property:1:12: error[Q202]"),
        (good, "S=? [ \"goal\" ]", 3, "property:1:1: error[Q403]"),
        (good, "R{\"time\"}min=? [ F \"goal\" ]", 3, "error[Q202]"),
    ];
    for (updates, property, status, expected) in cases {
        let model = MODEL.replace("PROBABILITIES", updates);
        let outcome = metaplan_in(&root(), &["check", "-", property], &model);
        let output = format!("{}{}", outcome.stdout, headlines(&outcome.stderr));
        // Standard input is reported under the name of the argument, `-`.
        let output = output.replace("-:", "<stdin>:");
        assert_eq!(outcome.status, status, "{updates} {property}: {outcome:#?}");
        assert!(output.contains(expected), "{expected} in {output}");
    }
    let limited = metaplan_in(
        &root(),
        &["check", "-", "Pmax=? [ F \"goal\" ]", "--state-limit", "2"],
        &MODEL.replace("PROBABILITIES", good),
    );
    assert_eq!(limited.status, 12, "{limited:#?}");
    let continuous =
        metaplan_in(&root(), &["check", "-", "Pmax=? [ F \"goal\" ]"], "ctmc\nmodule m endmodule\n");
    assert_eq!(continuous.status, 3, "{continuous:#?}");
    assert!(headlines(&continuous.stderr).contains(":1:1: error[Q401]"), "{continuous:#?}");
}

#[test]
fn one_answer_is_a_table_of_one_row() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("one.csv");
    let arguments = ["check", "-", "Pmax=? [ F s=1 ]", "--csv", file.to_str().expect("UTF-8")];
    let model = MODEL.replace("PROBABILITIES", "0.5:(s'=1) + 0.5:(s'=2)");
    let outcome = metaplan_in(&root(), &arguments, &model);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    assert_eq!(std::fs::read_to_string(&file).expect("a table"), "Pmax=? [ F s=1 ]\n0.5\n");
}

#[test]
fn constants_are_given_once() {
    let arguments = ["check", "-", "Pmax=? [ F s=1 ]", "--const", "n=1:2", "--const", "n=3:4"];
    let model = MODEL.replace("mdp\n", "mdp\nconst int n;\n").replace("PROBABILITIES", "(s'=1)");
    let outcome = metaplan_in(&root(), &arguments, &model);
    assert_eq!(outcome.status, 2, "{outcome:#?}");
    assert!(outcome.stderr.contains("M107") && outcome.stderr.contains("two values"), "{outcome:#?}");
}

#[test]
fn series_can_have_fractions() {
    let model =
        MODEL.replace("mdp\n", "mdp\nconst double p;\n").replace("PROBABILITIES", "p:(s'=1) + 1-p:(s'=2)");
    let check = |series: &str| {
        metaplan_in(
            &root(),
            &["check", "-", "Pmax=? [ F s=1 ]", "--const", series, "--format", "json"],
            &model,
        )
    };
    let outcome = check("p=1/3:1/3:1");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let answer = outcome.json();
    let answers = answer["answers"].as_array().expect("answers");
    let values: Vec<&str> =
        answers.iter().map(|answer| answer["constants"]["p"].as_str().expect("a value")).collect();
    assert_eq!(values, ["1/3", "2/3", "1"], "{answer:#}");
    let refused = check("p=0:1/0:1");
    assert!(refused.status == 2 && refused.stdout.contains("`1/0` of the series"), "{refused:#?}");
}

#[test]
fn properties_without_a_policy_are_refused() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("policy.json");
    let arguments = ["check", "-", "Pmax=? [ F<=6 s=1 ]", "--policy", file.to_str().expect("UTF-8")];
    let outcome = metaplan_in(&root(), &arguments, &MODEL.replace("PROBABILITIES", "(s'=1)"));
    assert_eq!(outcome.status, 2, "{outcome:#?}");
    assert!(outcome.stderr.contains("without a bound"), "{outcome:#?}");
    assert!(!file.exists());
}

#[test]
fn an_error_in_a_series_names_the_values_of_its_constants() {
    let arguments = ["check", "-", "Pmax=? [ F s=1 ]", "--const", "n=1:3", "--const", "m=7"];
    let model =
        MODEL.replace("mdp\n", "mdp\nconst int n;\nconst int m;\n").replace("PROBABILITIES", "(s'=n)");
    let outcome = metaplan_in(&root(), &arguments, &model);
    assert_eq!(outcome.status, 3, "{outcome:#?}");
    assert!(outcome.stderr.contains("Q305"), "{outcome:#?}");
    assert!(
        outcome.stderr.contains("this is the model with n=3") && !outcome.stderr.contains("m=7"),
        "{outcome:#?}"
    );
}

#[test]
fn policies_are_written_and_evaluated() {
    let Some(folder) = data("reference/prism_cases") else { return };
    let model = folder.join("c12_det_plan_vs_policy.prism");
    let directory = tempfile::tempdir().expect("a directory");
    let policy = directory.path().join("policy.json");
    let (model, policy): (&Path, &Path) = (&model, &policy);
    let (model, policy) = (model.to_str().expect("UTF-8"), policy.to_str().expect("UTF-8"));
    let question = "R{\"time\"}min=? [ F \"goal\" ]";
    let computed = metaplan(&["check", model, question, "--const", "FIXED=false", "--policy", policy]);
    assert_eq!((computed.status, computed.stdout.as_str()), (0, "3\n"), "{computed:#?}");
    let evaluated = metaplan(&["check", model, question, "--const", "FIXED=false", "--evaluate", policy]);
    assert_eq!((evaluated.status, evaluated.stdout.as_str()), (0, "3\n"), "{evaluated:#?}");
    let fixed = metaplan(&["check", model, question, "--const", "FIXED=true", "--evaluate", policy]);
    assert_eq!(fixed.status, 3, "the policy is about another model: {fixed:#?}");
}
