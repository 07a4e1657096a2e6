//! Tests of the problem in the Metaplan paper with SUAVE's knowledge base. The names of problem and knowledge
//! base differ and are mapped.

use serde_json::{Value, json};

use crate::common::{Outcome, metaplan, metaplan_in};
use crate::real::real;

fn paper() -> Option<([String; 2], Vec<String>)> {
    let real = real()?.display().to_string();
    let file = |name: &str| format!("{real}/pddl/suave_metaplan/suave_extended_metaplan_{name}.pddl");
    let options =
        [("kb", "suave/suave.owl"), ("directory", "mros_ontology"), ("directory", "mc_mdl_tomasys")];
    let options =
        options.iter().flat_map(|(option, path)| [format!("--{option}"), format!("{real}/owl/{path}")]);
    Some(([file("domain"), file("problem")], options.collect()))
}

const MAP: [(&str, &str); 4] = [
    ("fd_spiral_*", "fd_search_*"),
    ("fd_all_thrusters", "fd_maintain_motion"),
    ("fd_recover_thrusters", "fd_recover_motion"),
    ("fd_follow_pipeline", "fd_follow"),
];

fn plan(files: &[String], options: &[&str]) -> Outcome {
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    metaplan(&[&["plan"], &files[..], options, &["--format", "json"]].concat())
}

/// Returns the plan for the paper's problem without a knowledge base. The problem states the availability of
/// all designs except the given ones.
fn by_hand(files: &[String; 2], unavailable: &[&str]) -> Value {
    let mut text = std::fs::read_to_string(&files[1]).expect("the problem");
    for design in unavailable {
        let fact = format!("(fd_available {design})");
        assert!(text.contains(&fact), "{fact}");
        text = text.replace(&fact, "");
    }
    let directory = tempfile::tempdir().expect("a directory");
    let problem = directory.path().join("problem.pddl");
    std::fs::write(&problem, text).expect("written");
    plan(&[files[0].clone(), problem.display().to_string()], &[]).json()
}

/// Returns the greatest sum of design values over the three actions of the shortest plan, by brute force over
/// the available designs in the paper's table.
fn greatest_value(unavailable: &[&str]) -> f64 {
    let designs = [
        ("search", "fd_search_low", 0.5),
        ("search", "fd_search_medium", 0.7),
        ("search", "fd_search_high", 1.0),
        ("motion", "fd_maintain_motion", 1.0),
        ("motion", "fd_recover_motion", 0.5),
        ("follow", "fd_follow", 1.0),
        ("recharge", "fd_recharge", 1.0),
    ];
    let values_of = |function: &str| {
        let available = designs.iter().filter(|(design_function, design, _)| {
            *design_function == function && !unavailable.contains(design)
        });
        available.map(|(.., worth)| *worth).collect::<Vec<f64>>()
    };
    let mut best = f64::NEG_INFINITY;
    let motion = values_of("motion");
    for (search, follow, recharge) in values_of("search").iter().flat_map(|s| {
        let (follow, recharge) = (values_of("follow"), values_of("recharge"));
        follow.into_iter().flat_map(move |f| recharge.clone().into_iter().map(move |r| (*s, f, r)))
    }) {
        for first in &motion {
            for second in &motion {
                for third in &motion {
                    best = best.max(search + follow + recharge + first + second + third);
                }
            }
        }
    }
    best
}

#[test]
fn problem_of_the_paper_works_with_the_knowledge_base_of_suave() {
    let Some((files, options)) = paper() else { return };
    let options: Vec<&str> = options.iter().map(String::as_str).collect();
    let entries: Vec<String> =
        MAP.iter().map(|(individual, object)| format!("{individual}={object}")).collect();
    let names: Vec<&str> = entries.iter().flat_map(|entry| ["--name", entry]).collect();
    let mut plans = Vec::new();
    for (situation, unavailable) in [
        (&[][..], &[][..]),
        (&["--fail", "c_thruster_1"], &["fd_maintain_motion"]),
        (&["--set", "water_visibility=1.5"], &["fd_search_medium", "fd_search_high"]),
        (&["--set", "water_visibility=2.25"], &["fd_search_high"]),
        (
            &["--fail", "c_thruster_6", "--set", "water_visibility=2"],
            &["fd_maintain_motion", "fd_search_medium", "fd_search_high"],
        ),
    ] {
        let outcome = plan(&files, &[&options, &names, situation].concat());
        assert_eq!(outcome.status, 1, "{situation:?}: {outcome:#?}");
        let (answer, expected) = (outcome.json(), by_hand(&files, unavailable));
        for field in ["steps", "cost", "status", "unbounded", "proof"] {
            assert_eq!(answer[field], expected[field], "{situation:?}: {field}");
        }
        assert_eq!(answer["cost"].as_f64(), Some(greatest_value(unavailable)), "{situation:?}");
        assert!(!outcome.stderr.contains("P127"), "nothing is stated twice: {outcome:#?}");
        plans.push(answer["steps"].clone());
    }
    assert!(plans[1..].iter().all(|steps| *steps != plans[0]), "{plans:#?}");
    // The knowledge base does not have the recharging design, so its availability can be set. The
    // availability of designs in the knowledge base cannot.
    let outcome =
        plan(&files, &[&options, &names, &["--set", "fd_available fd_recharge=false"][..]].concat());
    assert_eq!(outcome.status, 10, "{outcome:#?}");
    let outcome =
        plan(&files, &[&options, &names, &["--set", "fd_available fd_search_low=false"][..]].concat());
    assert!(outcome.status == 2 && outcome.stdout.contains("the knowledge base determines"), "{outcome:#?}");
    // The water is too murky for all search designs. The mission is unsolvable because of the knowledge base,
    // not because of unmatched names.
    let outcome = plan(&files, &[&options, &names, &["--set", "water_visibility=1"][..]].concat());
    assert_eq!(outcome.status, 10, "{outcome:#?}");
    assert_eq!(
        outcome.json()["blocking"],
        json!(["fd_search_high", "fd_search_low", "fd_search_medium"]),
        "{outcome:#?}"
    );
}

#[test]
fn problem_of_the_paper_needs_a_name_map() {
    let Some((files, options)) = paper() else { return };
    let options: Vec<&str> = options.iter().map(String::as_str).collect();
    let outcome = plan(&files, &options);
    assert_eq!(outcome.status, 3, "{outcome:#?}");
    let answer = outcome.json();
    let messages = answer["messages"].as_array().expect("messages");
    let errors: Vec<&Value> = messages.iter().filter(|message| message["severity"] == "error").collect();
    let places: Vec<_> = errors
        .iter()
        .map(|error| (error["code"].as_str(), error["line"].as_u64(), error["column"].as_u64()))
        .collect();
    let code = Some("M222");
    assert_eq!(places, [(code, Some(18), Some(3)), (code, Some(22), Some(3)), (code, Some(25), Some(3))]);
    let expected_names = [
        (
            "`fd_search_low`, `fd_search_medium`, `fd_search_high`",
            "`fd_spiral_high`, `fd_spiral_low`, `fd_spiral_medium`",
        ),
        ("`fd_maintain_motion`, `fd_recover_motion`", "`fd_all_thrusters`, `fd_recover_thrusters`"),
        ("`fd_follow`", "`fd_follow_pipeline`"),
    ];
    for (error, (in_problem, in_knowledge)) in errors.iter().zip(expected_names) {
        let lists = format!("in the problem only: {in_problem}; in the knowledge base only: {in_knowledge}");
        assert!(error["message"].as_str().is_some_and(|text| text.ends_with(&lists)), "{error:#}");
    }
    // The help texts propose the correct entries.
    let helps: String = errors.iter().filter_map(|error| error["help"].as_str()).collect();
    for (individual, object) in MAP {
        let entry = if individual.contains('*') {
            format!("\"{individual}\" = \"{object}\"")
        } else {
            format!("{individual} = \"{object}\"")
        };
        assert!(helps.contains(&entry), "no `{entry}`: {helps}");
    }
}

#[test]
fn functions_unknown_to_the_knowledge_base_are_kept() {
    let Some((files, options)) = paper() else { return };
    let directory = tempfile::tempdir().expect("a directory");
    let entries: Vec<String> =
        MAP.iter().map(|(individual, object)| format!("\"{individual}\" = \"{object}\"")).collect();
    let paths = |option: &str| {
        let pairs = options.chunks(2).filter(|pair| pair[0] == option);
        pairs.map(|pair| format!("{:?}", pair[1])).collect::<Vec<_>>().join(", ")
    };
    let manifest = format!(
        "name = \"paper\"\n[knowledge]\nfiles = [{}]\ndirectories = [{}]\n[planning]\ndomain = {:?}\nproblem = {:?}\n\
         [bindings.names]\n{}\n",
        paths("--kb"),
        paths("--directory"),
        files[0],
        files[1],
        entries.join("\n")
    );
    let run = |lines: &str, options: &[&str]| {
        std::fs::write(directory.path().join("m.toml"), &manifest).expect("written");
        metaplan_in(directory.path(), &[&["run", "m.toml", "--quiet"], options].concat(), lines)
    };
    let events = [
        r#"{"event":"action_succeeded","action":1}"#,
        r#"{"event":"component_status","component":"c_thruster_1","status":"FALSE"}"#,
        r#"{"event":"action_succeeded","action":2}"#,
    ]
    .join("\n");
    let outcome = run(&events, &[]);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let answers: Vec<Value> =
        outcome.stdout.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let answers_of_kind = |kind: &str, line: u64| -> Vec<&Value> {
        answers.iter().filter(|answer| answer["answer"] == kind && answer["line"] == line).collect()
    };
    assert!(answers_of_kind("error", 0).is_empty() && answers_of_kind("error", 1).is_empty(), "{answers:#?}");
    let requested = |line: u64| {
        answers_of_kind("request_action", line)
            .iter()
            .map(|answer| answer["name"].clone())
            .collect::<Vec<_>>()
    };
    assert_eq!(requested(0), ["recharge"], "{answers:#?}");
    assert_eq!(requested(1), ["search_pipeline"], "{answers:#?}");
    let inferences = answers_of_kind("inferred", 2);
    assert!(inferences[0]["designs"].to_string().contains("fd_maintain_motion"), "{answers:#?}");
    let text =
        answers.iter().filter(|answer| answer["line"] == 2).map(ToString::to_string).collect::<String>();
    assert!(text.contains("fd_recover_motion"), "{answers:#?}");
}
