//! Quirks of real files are accepted, with a warning where a file deviates from the standard. Only undeclared
//! names are errors.
//!
//! Two domains in this file contain the quirks. A larger matrix of minimal pairs and the generated missions
//! come from scripts outside of the project.

use std::path::{Path, PathBuf};
use std::process::Command;

use metaplan_pddl::validate::{Options, PlanText, validate};
use metaplan_pddl::{Severity, Source, read, render};
use test_resources::{data, python};

/// Runs one of the scripts outside of the project. Returns `None` if the script or Python is absent.
fn script(name: &str, arguments: &[&str]) -> Option<()> {
    let (script, python) = (data(Path::new("tools").join(name))?, python()?);
    let output = Command::new(python).arg(script).args(arguments).output().expect("Python starts");
    assert!(output.status.success(), "{name} {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    Some(())
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).expect("the folder for test files can be made");
    folder
}

fn file(path: &Path) -> Source {
    let bytes = std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Source::from_bytes(path.file_name().unwrap_or_default().to_string_lossy(), &bytes)
}

fn accepted(domain: &Source, problem: &Source) -> Vec<&'static str> {
    match read(domain, problem) {
        Ok((_, _, warnings)) => warnings.iter().map(|warning| warning.code).collect(),
        Err(errors) => panic!("{}", render(&errors, &[domain, problem], false)),
    }
}

#[test]
fn a_domain_with_many_quirks_is_accepted() {
    let domain = Source::new(
        "domain",
        "( DEFINE ( domain Q )\r\n(:requirements :Typing :typing :durative-actions)\r\n(:types room zone - place action)
         (:predicates (At ?x -place) (seen ?x) (action ?a - action) (gh ?x - ghost))
         (:constants r1 - room 0.8_decimal 100._x - object) (:functions )
         (:functions (bat) (use ?x ?y - place) - number (total-cost) - number)
         (:derived (seen ?x) (exists (?y - place) (AT ?y)))
         (:action go :parameters (?x ?y) :precondition () :effect (and))
         (:action go :parameters (?x - place) :effect (increase total-cost (use ?x ?x)))
         (:durative-action mv :parameters () :duration ( = ?duration(+(bat) 100.)) :condition (at start(at r1))
          :effect (and (at end(not(at r1))) (forall (?x - room) (at end (at ?x))))))",
    );
    let problem = Source::new(
        "problem",
        "\u{feff}(define (problem q) (:domain other) (:requirements :typing)
         (:objects r1 - room action - action z1 - zone )
         (:init (not (at z1)) (at r1) (at r1) (= (bat) 10.) (= (use r1 z1) .5) (action action) )
         (:goal (and )) (:metric minimize total-cost))",
    );
    let warnings = accepted(&domain, &problem);
    // In the domain: joined dash, undeclared type, second action. In the problem: other domain name, constant
    // as object, repeated fact.
    assert_eq!(warnings, ["P107", "P136", "P127", "P131", "P127", "P127"]);
}

#[test]
fn types_decide_which_objects_fit() {
    // Type of an object, type of a parameter, and whether the object fits.
    let cases = [
        ("robot", "robot", true),
        ("robot", "object", true),
        ("robot", "machine", true),
        ("machine", "robot", false),
        ("robot", "place", false),
        ("robot", "(either place machine)", true),
        ("robot", "(either place dock)", false),
        ("dock", "(either machine place)", true),
        ("both", "place", true),
        ("both", "machine", true),
        // An object of type `object` is accepted with a warning.
        ("object", "place", true),
        // An undeclared type restricts nothing.
        ("robot", "ghost", true),
        // A supertype need not be declared.
        ("station", "building", true),
    ];
    for (object, parameter, fits) in cases {
        let domain = Source::new(
            "domain",
            format!(
                "(define (domain d) (:types robot - machine machine place - object dock - place both - (either place machine)
                 station - building) (:predicates (p ?x - {parameter})))"
            ),
        );
        let problem =
            format!("(define (problem p) (:domain d) (:objects a - {object}) (:init (p a)) (:goal (p a)))");
        let errors = match read(&domain, &Source::new("problem", problem)) {
            Ok(_) => Vec::new(),
            Err(errors) => errors.iter().map(|error| error.code).collect(),
        };
        let expected: &[&str] = if fits { &[] } else { &["P126", "P126"] };
        assert_eq!(errors, expected, "{object} for {parameter}");
    }
}

/// Checks that `index` has a minimal pair of files for each row of the matrix of quirks. The matrix lists
/// which other planners accept each quirk.
fn check_matrix_rows(index: &str) {
    let Some(path) = data("reference/pddl_quirks.md") else { return };
    let text = std::fs::read_to_string(path).expect("a file");
    let matrix = text.split("| quirk |").nth(1).expect("a matrix");
    let rows = matrix.lines().filter_map(|line| line.strip_prefix("| ")?.split_once(" | "));
    let quirks: Vec<_> = rows.map(|(quirk, _)| quirk.replace('"', "\\\"")).collect();
    assert!(quirks.len() > 40, "{quirks:?}");
    for quirk in quirks {
        assert!(index.contains(&format!("\"name\": \"{quirk}\"")), "{quirk}");
    }
}

#[test]
fn minimal_pairs_are_accepted_unless_a_name_is_undeclared() {
    let folder = folder("quirks");
    let Some(()) = script("pddl_quirks.py", &[&folder.to_string_lossy()]) else { return };
    let index = std::fs::read_to_string(folder.join("index.json")).expect("the script writes an index");
    // One JSON object per pair: {"n": 0, "name": "…", "expect": "accept"}.
    let pairs: Vec<bool> = index
        .match_indices("\"expect\": \"")
        .map(|(at, key)| index[at + key.len()..].starts_with("accept"))
        .collect();
    assert!(pairs.len() > 40, "{index}");
    check_matrix_rows(&index);
    for (number, is_accepted) in pairs.into_iter().enumerate() {
        let path = |kind: &str| folder.join(format!("{number:02}.{kind}.pddl"));
        let (domain, problem) = (file(&path("domain")), file(&path("problem")));
        if is_accepted {
            accepted(&domain, &problem);
            continue;
        }
        let Err(diagnostics) = read(&domain, &problem) else { panic!("pair {number} is an error") };
        let errors: Vec<_> =
            diagnostics.iter().filter(|diagnostic| diagnostic.severity == Severity::Error).collect();
        assert_eq!(errors.len(), 1, "pair {number}");
        assert!(matches!(errors[0].code, "P120" | "P121"), "pair {number}: {}", errors[0].code);
    }
}

#[test]
fn generated_missions_have_no_warnings() {
    let folder = folder("missions");
    let out = folder.to_string_lossy().into_owned();
    for (family, seed) in [("ugv", "1"), ("ugv", "2"), ("uuv", "1")] {
        let name = format!("{family}-{seed}");
        let arguments =
            ["--family", family, "--seed", seed, "--n", "6", "--m", "3", "--k", "2", "--reconf", "1"];
        let output = ["--enc", "c,b,n,f,o", "--out", &out, "--name", &name];
        let Some(()) = script("gen_ratpa.py", &[arguments.as_slice(), &output].concat()) else { return };
        for encoding in ["c", "b", "n", "f", "o"] {
            let path = |kind: &str| folder.join(format!("{name}.{encoding}.{kind}.pddl"));
            let warnings = accepted(&file(&path("domain")), &file(&path("problem")));
            assert!(warnings.is_empty(), "{name}.{encoding}: {warnings:?}");
        }
    }
}

#[test]
fn lenient_syntax_is_read_as_by_other_planners() {
    let domain = Source::new(
        "domain",
        "(in-package \"PDDL\") (define (domain d) (:types oven kiln - object - board)
         (:predicates (hot ?x) (next ?x ?y) (used? ?x))
         (:action heat :parameters (?x - oven) :vars (?y - kiln) :precondition (and (next?x ?y) (not (used? ?x)))
          :effect (hot?x)))",
    );
    let problem = Source::new(
        "problem",
        "(define (problem p) (:domain d) (:objects k - oven k - kiln - board) (:init (next k k)) (:goal (hot k)))",
    );
    let warnings = accepted(&domain, &problem);
    assert_eq!(warnings, ["P104", "P107", "P109", "P116", "P116", "P127", "P107"]);
    let (domain, problem, _) = read(&domain, &problem).expect("it was accepted");
    let parameters = &domain.actions[0].parameters;
    assert_eq!(parameters.iter().map(|entry| entry.identifier.name.as_str()).collect::<Vec<_>>(), ["x", "y"]);
    let plan = PlanText::parse(&Source::new("plan", "(heat k k)")).expect("it is a plan");
    let verdict = validate(&domain, &problem, &plan, &Options::default());
    assert!(verdict.valid, "{verdict:?}");
    let (_, problem) = metaplan_pddl::portable(&domain, &problem);
    assert!(metaplan_pddl::print_problem(&problem).contains("k - (either oven kiln)"));
}

/// Without the narrower type, `(go c)` would not be an action of the portable files.
#[test]
fn a_constant_that_is_declared_again_keeps_both_types() {
    let domain = Source::new(
        "domain",
        "(define (domain d) (:requirements :typing) (:types truck - vehicle) (:constants c - vehicle)
          (:predicates (done)) (:action go :parameters (?t - truck) :effect (done)))",
    );
    let problem = Source::new(
        "problem",
        "(define (problem p) (:domain d) (:objects c - truck) (:init) (:goal (done)))",
    );
    let (domain, problem, _) = read(&domain, &problem).expect("it is accepted");
    let (domain, problem) = metaplan_pddl::portable(&domain, &problem);
    let texts = [metaplan_pddl::print_domain(&domain), metaplan_pddl::print_problem(&problem)];
    let (domain, problem, _) =
        read(&Source::new("domain", &texts[0]), &Source::new("problem", &texts[1])).expect("portable files");
    let plan = PlanText::parse(&Source::new("plan", "(go c)")).expect("it is a plan");
    assert!(validate(&domain, &problem, &plan, &Options::default()).valid, "{texts:?}");
}
