//! Tests of `metaplan reason` and `metaplan convert`.

use crate::common::{Outcome, edit, metaplan, metaplan_in, processor_time, root};

/// Checks the exit status, and that standard error or output contains each text. An internal error (panic,
/// M170) always fails the check.
fn check(outcome: &Outcome, status: i32, texts: &[&str]) {
    assert_eq!(outcome.status, status, "{outcome:#?}");
    for text in texts {
        assert!(outcome.stderr.contains(text) || outcome.stdout.contains(text), "no `{text}`: {outcome:#?}");
    }
    assert!(!outcome.stderr.contains("panicked") && !outcome.stderr.contains("M170"), "{outcome:#?}");
}

/// Runs a command on a text, which is the file `model.ttl` and, if the arguments contain `-`, also standard
/// input.
fn run(arguments: &[&str], text: &str) -> Outcome {
    let directory = tempfile::tempdir().expect("a temporary directory");
    std::fs::write(directory.path().join("model.ttl"), text).expect("a file");
    let input = if arguments.contains(&"-") { text } else { "" };
    metaplan_in(directory.path(), arguments, input)
}

const HEAD: &str = "@prefix t: <http://metacontrol.org/tomasys#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix : <http://x#> .
<http://x> a owl:Ontology ; owl:imports <http://metacontrol.org/tomasys> .
:f a t:Function . :fd a t:FunctionDesign ; t:solvesF :f .
";

#[test]
fn inferred_assertions_as_turtle() {
    let arguments = ["reason", "ontology/kb/ugv.ttl", "--fail", "c_kinect", "--format", "turtle"];
    let outcome = metaplan(&arguments);
    check(&outcome, 0, &["@prefix tomasys: <http://metacontrol.org/tomasys#>", "tomasys:fd_realisability"]);
    // The output of the command is a valid document.
    check(&metaplan_in(&root(), &["reason", "-"], &outcome.stdout), 0, &["inferred assertions"]);
    check(&metaplan(&["plan", "missions/ugv.toml", "--format", "turtle"]), 2, &["M107", "reason"]);
}

#[test]
fn unique_names_are_optional() {
    let model = format!("{HEAD}:g a t:Function . :fd t:solvesF :g . :a a t:Action ; t:requiresF :g .");
    let merged = run(&["reason", "-", "--format", "ntriples"], &model);
    check(&merged, 0, &["<http://x#a> <http://metacontrol.org/tomasys#requiresF> <http://x#f> ."]);
    let unique = run(&["reason", "-", "--unique-names", "--format", "ntriples"], &model);
    // Two functions that one design solves are not one function, as the functional property would require.
    check(&unique, 20, &["this is a contradiction, because their names are unique"]);
    assert!(!unique.stdout.contains("requiresF"), "{unique:#?}");
}

#[test]
fn standard_input_can_replace_any_document() {
    let failure = ":c a t:Component ; t:c_status \"FALSE\" . :fd t:requiresC :c .";
    let directory = tempfile::tempdir().expect("a temporary directory");
    std::fs::write(directory.path().join("model.ttl"), HEAD).expect("a file");
    let prefixes = HEAD.lines().take(3).collect::<Vec<_>>().join("\n");
    let failure_document = format!("{prefixes}\n{failure}");
    let rule = "<http://x#likes>(?x, ?y) -> <http://x#likes>(?y, ?x) .\n";
    let stated = format!("{HEAD}{failure}");
    std::fs::write(directory.path().join("failed.ttl"), stated).expect("a file");
    let before = metaplan_in(directory.path(), &["reason", "failed.ttl"], "");
    check(&before, 0, &["fd_realisability"]);
    let status = format!("{prefixes}\n:c t:c_status \"FALSE\" .");
    let after = metaplan_in(directory.path(), &["reason", "failed.ttl", "--retract", "-"], &status);
    check(&after, 0, &["inferred assertions"]);
    assert!(!after.stdout.contains("fd_realisability"), "{after:#?}");
    for (arguments, input, expected) in [
        (&["reason", "model.ttl", "-"][..], &*failure_document, "fd_realisability"),
        (&["reason", "model.ttl", "--assert", "-"], &failure_document, "fd_realisability"),
        (&["reason", "model.ttl", "--rules", "-"], rule, "inferred assertions"),
        (
            &["convert", "-", "--to", "ntriples"],
            &failure_document,
            "<http://metacontrol.org/tomasys#requiresC>",
        ),
        (&["convert", "model.ttl", "-", "--to", "turtle"], &failure_document, "requiresC"),
    ] {
        check(&metaplan_in(directory.path(), arguments, input), 0, &[expected]);
    }
}

#[test]
fn axioms_outside_the_profile_are_summarised() {
    let model = format!(
        "{HEAD}@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> . :p a owl:ObjectProperty .
         :B a owl:Class ; rdfs:subClassOf [ a owl:Class ; owl:unionOf ( :A :B ) ] .
         :A a owl:Class ; rdfs:subClassOf [ a owl:Restriction ; owl:onProperty :p ; owl:someValuesFrom :A ] ."
    );
    let outcome = run(&["reason", "-"], &model);
    check(&outcome, 0, &["warning[O301]: SubClassOf(<http://x#B>", "warning[O304]: 2 of "]);
    assert_eq!(outcome.stderr.matches("O301").count(), 2, "{outcome:#?}");
    let outcome = run(&["reason", "-", "--format", "json", "-q"], &model);
    let answer: serde_json::Value = serde_json::from_str(&outcome.stdout).expect("JSON");
    let codes: Vec<_> = answer["warnings"].as_array().expect("an array").iter().map(|w| &w["code"]).collect();
    assert_eq!(codes, ["O301", "O301", "O304"], "{answer:#}");
}

const ZOO: &str =
    "@prefix owl: <http://www.w3.org/2002/07/owl#> . @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix : <http://x#> .
:Cat a owl:Class ; rdfs:subClassOf :Pet . :Pet a owl:Class ; rdfs:subClassOf :Animal . :Animal a owl:Class .
:Stone a owl:Class ; owl:disjointWith :Animal . :StoneCat a owl:Class ; rdfs:subClassOf :Stone , :Cat .
:tom a :Cat .
";

#[test]
fn queries_are_answered_with_derivations() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let query = |arguments: &[&str], input: &str| {
        let command = [&["reason", "zoo.ttl"], arguments].concat();
        metaplan_in(directory.path(), &command, input)
    };
    let prefixes = ZOO.lines().take(2).collect::<Vec<_>>().join(" ");
    std::fs::write(directory.path().join("zoo.ttl"), ZOO).expect("a file");
    let entailed = format!(
        "{prefixes} :Cat a owl:Class ; rdfs:subClassOf :Animal . :Animal a owl:Class . :tom a :Pet ."
    );
    let not_entailed = format!("{entailed} :tom a :Stone . :Stone a owl:Class .");
    let answer = query(&["--entails", "-"], &entailed);
    check(&answer, 0, &["follows: SubClassOf(<http://x#Cat> <http://x#Animal>)", "2 of 2 statements follow"]);
    check(
        &query(&["--entails", "-"], &not_entailed),
        1,
        &["not shown: ClassAssertion(<http://x#Stone> <http://x#tom>)"],
    );
    // The blank node of the question is `e`, not the blank node with this note in the knowledge base.
    let note = format!(
        "{prefixes} :n a owl:AnnotationProperty . :A a owl:Class . _:x a :A ; :n \"t\" . :e a :Pet ."
    );
    std::fs::write(directory.path().join("note.ttl"), note).expect("a file");
    let noted = format!("{prefixes} _:x a :Pet ; :n \"t\" .");
    let answer = metaplan_in(directory.path(), &["reason", "note.ttl", "--entails", "-"], &noted);
    check(&answer, 1, &["follows: ClassAssertion(<http://x#Pet>", "1 of 2 statements follow"]);
    let schema = query(&["--schema"], "");
    check(&schema, 0, &["<http://x#Cat> below <http://x#Pet>\n", "<http://x#StoneCat> is always empty"]);
    let why = query(&["--why", "tom a Animal"], "");
    check(
        &why,
        0,
        &[
            "<http://x#Animal>(<http://x#tom>) by rule",
            "SubClassOf(<http://x#Pet> <http://x#Animal>)",
            "is stated",
        ],
    );
    check(&query(&["--why", ":tom a :Stone"], ""), 1, &["does not hold"]);
    check(
        &query(&["--why-not", "tom a Stone"], ""),
        0,
        &["does not hold", "(SubClassOf(<http://x#StoneCat>"],
    );
    check(&query(&["--why", "tim a Cat"], ""), 2, &["nothing has the name `tim`"]);
    check(&query(&["--why", "tom Cat"], ""), 2, &["SUBJECT a CLASS"]);
    for arguments in [&["--schema"][..], &["--why", "tom a Pet"], &["--entails", "zoo.ttl"]] {
        let json = query(&[arguments, &["--format", "json"]].concat(), "").json();
        assert!(json["format"].as_str().is_some_and(|format| format.ends_with("/1")), "{json:#}");
    }
}

#[test]
fn step_limit_and_missing_imports_are_options() {
    let counting_rule = "<http://x#n>(?x, ?n) ^ swrlb:add(?m, ?n, 1) -> <http://x#n>(?x, ?m) .\n";
    let directory = tempfile::tempdir().expect("a temporary directory");
    std::fs::write(directory.path().join("count.swrl"), counting_rule).expect("a file");
    std::fs::write(directory.path().join("model.ttl"), "<http://x#i> <http://x#n> 1 .").expect("a file");
    let arguments = ["reason", "model.ttl", "--rules", "count.swrl", "-q", "--step-limit", "1000000"];
    check(
        &metaplan_in(directory.path(), &arguments, ""),
        3,
        &["error[R301]: step budget of 1000000", "count.swrl#0"],
    );
    let unknown = "<http://x#n>(?x, ?n) ^ <http://my#add>(?m, ?n, 1) -> <http://x#n>(?x, ?m) .\n";
    std::fs::write(directory.path().join("unknown.swrl"), unknown).expect("a file");
    let arguments = ["reason", "model.ttl", "--rules", "unknown.swrl", "-q"];
    check(
        &metaplan_in(directory.path(), &arguments, ""),
        3,
        &["unknown.swrl:1:24", "R104", "<http://my#add> with 3 arguments"],
    );
    let imports = "<http://x> a <http://www.w3.org/2002/07/owl#Ontology> ;
        <http://www.w3.org/2002/07/owl#imports> <http://nowhere.example/y> .";
    check(&run(&["reason", "-"], imports), 3, &["O103", "--ignore-missing-imports"]);
    check(&run(&["reason", "-", "--ignore-missing-imports"], imports), 0, &["warning[O206]"]);
}

#[test]
fn repeated_warnings_are_summarised() {
    let models: Vec<String> = (0..15).map(|n| format!("<http://x#i{n}> a <http://x#C{n}> .\n")).collect();
    let model = models.concat();
    let outcome = run(&["reason", "-"], &model);
    check(&outcome, 0, &["and 5 more O201"]);
    assert_eq!(outcome.stderr.matches("warning[O201]").count(), 10, "{outcome:#?}");
}

#[test]
fn modelling_mistakes_are_reported() {
    let mistakes = ":g a t:Function . :e a t:FunctionDesign . :r a t:Requirement .";
    let outcome = run(&["reason", "model.ttl"], &format!("{HEAD}{mistakes}"));
    check(&outcome, 0, &["warning[O401]", "<http://x#e>", "warning[O402]", "<http://x#g>", "warning[O403]"]);
    let quiet = run(&["reason", "model.ttl", "-q"], &format!("{HEAD}{mistakes}"));
    assert_eq!(quiet.stderr, "");
    let contradiction =
        run(&["reason", "model.ttl"], &format!("{HEAD}:c a t:Component ; t:c_status false ."));
    check(&contradiction, 20, &["warning[O406]", "a string is expected", "inconsistent"]);
    let shipped = metaplan(&["reason", "ontology/kb/ugv.ttl"]);
    assert_eq!(shipped.stderr, "");
}

#[test]
fn all_syntaxes_round_trip() {
    let expected = metaplan(&["reason", "ontology/kb/uuv.ttl", "--format", "ntriples"]);
    check(&expected, 0, &[]);
    let mut starts = Vec::new();
    for syntax in ["rdfxml", "turtle", "ntriples", "owlxml", "functional"] {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let file = directory.path().join("copy.owl");
        let file = file.to_str().expect("UTF-8");
        check(&metaplan(&["convert", "ontology/kb/uuv.ttl", "--to", syntax, "-o", file]), 0, &[]);
        let answer = metaplan(&["convert", "ontology/kb/uuv.ttl", "--to", syntax]);
        let written = std::fs::read_to_string(file).expect("the file is read");
        assert_eq!(answer.stdout, written, "{syntax}");
        starts.push(written.chars().take(5).collect::<String>());
        let reread = metaplan(&["reason", file, "--format", "ntriples"]);
        check(&reread, 0, &[]);
        assert_eq!(reread.stdout, expected.stdout, "{syntax}");
    }
    assert_eq!(starts, ["<?xml", "@pref", "<http", "<?xml", "Prefi"]);
}

#[test]
fn unreadable_documents_are_input_errors() {
    for (text, message) in [
        ("@prefix : <http://x#> . :a x:b :c .", "model.ttl:1:"),
        ("<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\"><a>", "model.ttl:1:"),
        (
            "<http://x> <http://www.w3.org/2002/07/owl#imports> <http://nowhere> .\n<http://x> a \
          <http://www.w3.org/2002/07/owl#Ontology> .",
            "O103",
        ),
    ] {
        for command in [&["reason", "model.ttl"][..], &["convert", "model.ttl", "--to", "turtle"]] {
            check(&run(command, text), 3, &[message]);
        }
    }
    check(&run(&["convert", "model.ttl", "--to", "klingon"], ""), 2, &["functional"]);
    check(&run(&["convert", "absent.ttl", "--to", "turtle"], ""), 3, &["O101"]);
}

#[test]
fn hostile_rule_files_are_escaped() {
    let directory = tempfile::tempdir().expect("a directory");
    let hostile = "a(?x) \u{1b}[2J\u{202e}\u{200b}\u{e0041} \"x\nerror[M999]: forged\" -> b(?x)\n\
                   [label \u{1b}]0;t\u{7}] a(?x) -> b(?y)\n";
    std::fs::write(directory.path().join("r.swrl"), hostile).expect("a file");
    std::fs::write(directory.path().join("label.swrl"), "[a\u{9b}\u{2028}b] a(?x) -> b(?y)\n")
        .expect("a file");
    let knowledge = "<http://example.org/m> a <http://www.w3.org/2002/07/owl#Ontology> .\n";
    std::fs::write(directory.path().join("kb.ttl"), knowledge).expect("a file");
    for rules in ["r.swrl", "label.swrl"] {
        for format in ["text", "json"] {
            let outcome = metaplan_in(
                directory.path(),
                &["reason", "kb.ttl", "--rules", rules, "--format", format],
                "",
            );
            assert_eq!(outcome.status, 3, "{outcome:#?}");
            let output = outcome.stdout + &outcome.stderr;
            let is_unsafe =
                |c: char| (c.is_control() && c != '\n') || "\u{202e}\u{200b}\u{2028}\u{e0041}".contains(c);
            assert!(!output.contains(is_unsafe), "{output:?}");
            assert!(!output.lines().any(|line| line.starts_with("error[M999]")), "{output:?}");
            assert!(output.contains(if rules == "r.swrl" { "R101" } else { "R202" }), "{output:?}");
        }
    }
}

const EMPTY: &str = "@prefix : <urn:x#> . @prefix owl: <http://www.w3.org/2002/07/owl#> . \
    @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .\n";

#[test]
fn updates_are_equivalent_to_the_resulting_document() {
    let negative = "[] a owl:NegativePropertyAssertion ; owl:sourceIndividual :a ; owl:assertionProperty :p ; \
        owl:targetIndividual :b .";
    let has_value =
        ":p a owl:ObjectProperty . :a a [ a owl:Restriction ; owl:onProperty :p ; owl:hasValue :b ] .";
    let names = ":a a owl:NamedIndividual . :b a owl:NamedIndividual . :A a owl:Class . :B a owl:Class .";
    let swapped = ":d a owl:NamedIndividual ; owl:sameAs :c .";
    for (base, plus, minus, resulting, status) in [
        (
            format!("{names} :a owl:differentFrom :b ."),
            ":a owl:sameAs :b .",
            "",
            ":a owl:differentFrom :b ; owl:sameAs :b .",
            20,
        ),
        (":p a owl:ObjectProperty . :a :p :b .".into(), negative, "", "", 20),
        (format!("{names} :a a :A ."), ":a a [ a owl:Class ; owl:complementOf :A ] .", "", "", 20),
        (format!("{names} :a a :A , :B ."), ":A owl:disjointWith :B .", "", "", 20),
        (format!("{names} :a a :A ."), ":A rdfs:subClassOf :B .", "", ":a a :A . :A rdfs:subClassOf :B .", 0),
        (":p a owl:ObjectProperty .".into(), has_value, "", has_value, 0),
        (format!("{names} {has_value}"), "", has_value, "", 0),
        (format!("{names} :a a :A . :A rdfs:subClassOf :B ."), "", ":A rdfs:subClassOf :B .", ":a a :A .", 0),
        (
            ":n a owl:DatatypeProperty . :c owl:sameAs :e . :d :n 2 .".into(),
            swapped,
            ":c owl:sameAs :e .",
            ":n a owl:DatatypeProperty . :d :n 2 ; owl:sameAs :c .",
            0,
        ),
    ] {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let write = |name: &str, text: &str| {
            let text = format!("{EMPTY}{text}");
            std::fs::write(directory.path().join(name), text).expect("a file");
        };
        write("base.ttl", &base);
        write("plus.ttl", plus);
        write("minus.ttl", minus);
        let update =
            ["reason", "base.ttl", "--assert", "plus.ttl", "--retract", "minus.ttl", "--format", "ntriples"];
        let updated = metaplan_in(directory.path(), &update, "");
        check(&updated, status, &[]);
        if status == 0 {
            write("rest.ttl", &format!("{names} {resulting}"));
            let expected = metaplan_in(directory.path(), &["reason", "rest.ttl", "--format", "ntriples"], "");
            check(&expected, 0, &[]);
            assert_eq!(updated.stdout, expected.stdout, "{base} {plus} {minus}: {}", updated.stderr);
        }
    }
}

#[test]
fn ineffective_updates_are_reported() {
    let change = |option: &str, text: &str| {
        let directory = tempfile::tempdir().expect("a temporary directory");
        std::fs::write(directory.path().join("base.ttl"), format!("{EMPTY}:a a :A .")).expect("a file");
        metaplan_in(directory.path(), &["reason", "base.ttl", option, "-"], &format!("{EMPTY}{text}"))
    };
    check(&change("--retract", ":b a :A ."), 0, &["O207", "urn:x#b"]);
    check(&change("--retract", "_:b a :A ."), 3, &["O114", "_:"]);
    check(
        &change("--assert", "<urn:u> a owl:Ontology ; owl:imports <urn:other> ."),
        0,
        &["O208", "urn:other"],
    );
    check(&change("--assert", ":A rdfs:subClassOf [ a owl:Class ; owl:unionOf ( :B :C ) ] ."), 0, &["O301"]);
}

/// A rule that derives ever larger values ends each command within 2 s of processor time, with
/// default limits. The message contains the rule and the value.
#[test]
fn diverging_rules_end_every_command() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let here = directory.path();
    assert_eq!(metaplan_in(here, &["init", "m", "--from", "warehouse"], "").status, 0);
    let rule = "[doubling] <urn:v>(?x, ?n) ^ swrlb:multiply(?m, ?n, 2) -> <urn:v>(?x, ?m) .\n";
    std::fs::write(here.join("m/doubling.swrl"), rule).expect("a file");
    edit(
        &here.join("m"),
        "mission.toml",
        "files = [\"robot.ttl\"]",
        "files = [\"robot.ttl\"]\nrules = [\"doubling.swrl\"]",
    );
    let facts = ":f_grasp a t:Function .\n<urn:v> a owl:DatatypeProperty . :c_lidar <urn:v> 3 . :c_lamp <urn:v> 5 , 7 .\n";
    edit(&here.join("m"), "robot.ttl", ":f_grasp a t:Function .\n", facts);
    for arguments in [
        &["reason", "m/robot.ttl", "--rules", "m/doubling.swrl"][..],
        &["lint", "m/mission.toml"],
        &["plan", "m/mission.toml"],
        &["run", "m/mission.toml"],
    ] {
        let outcome = metaplan_in(here, arguments, "");
        assert!([1, 3].contains(&outcome.status), "{outcome:#?}");
        check(
            &outcome,
            outcome.status,
            &["R301", "doubling.swrl#0 (doubling)", "the last one is", "characters)"],
        );
        if test_resources::python().is_some() {
            let seconds = processor_time(here, arguments);
            assert!(seconds < 2.0, "{arguments:?} takes {seconds} s");
        }
    }
}
