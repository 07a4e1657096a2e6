//! Tests of texts: non-ASCII names, byte order marks, empty documents, and plans in files.

use std::fs;
use std::path::Path;

use crate::common::{Outcome, copy_folder, copy_of_mission, edit, headlines, metaplan, metaplan_in, root};

fn texts(folder: &Path) -> Vec<std::path::PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    entries.flat_map(|path| if path.is_dir() { texts(&path) } else { vec![path] }).collect()
}

fn warehouse_with(old: &str, new: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    copy_folder(&root().join("missions/templates/warehouse"), folder.path());
    let mut count = 0;
    for file in texts(folder.path()) {
        let text = fs::read_to_string(&file).expect("a text");
        count += text.matches(old).count();
        fs::write(&file, text.replace(old, new)).expect("written");
    }
    assert!(count > 0, "{old}");
    folder
}

fn run_successfully(folder: &Path, arguments: &[&str]) -> Outcome {
    let outcome = metaplan_in(folder, arguments, "");
    assert_eq!(outcome.status, 0, "{arguments:?}: {outcome:#?}");
    outcome
}

#[test]
fn names_can_have_letters_of_any_script() {
    for (old, new) in [
        ("fd_lidar", "fd_lidär"),
        ("fd_lidar", "激光雷达"),
        // The name contains a base letter with a combining mark.
        ("fd_lidar", "fd_lida\u{308}r"),
        ("f_navigate", "f_überqueren"),
        ("c_lidar", "c_лидар"),
    ] {
        let plain = warehouse_with("name = ", "name = ");
        let folder = warehouse_with(old, new);
        let folder = folder.path();
        let expected = run_successfully(plain.path(), &["plan", "mission.toml"]).stdout.replace(old, new);
        let table = run_successfully(folder, &["plan", "mission.toml"]).stdout;
        let cells = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(cells(&table), cells(&expected), "{new}");
        for arguments in [
            &["plan", "mission.toml", "-o", "plan.txt", "--certificate", "proof"][..],
            &["validate", "mission.toml", "plan.txt"],
            &["verify", "proof", "--mission", "mission.toml"],
            &["plan", "mission.toml", "--format", "json", "-o", "plan.json"],
            &["validate", "mission.toml", "plan.json"],
            &["plan", "mission.toml", "--plan-format", "plansys2"],
            &["plan", "mission.toml", "--plan-format", "btcpp"],
            &["export", "mission.toml", "--to", "pddl", "-o", "exported"],
            &["plan", "exported/domain.pddl", "exported/problem.pddl", "-o", "other.txt"],
            &["validate", "exported/domain.pddl", "exported/problem.pddl", "other.txt"],
            &["validate", "mission.toml", "other.txt"],
            &["lint", "mission.toml"],
            &["report", "mission.toml", "-o", "report.html"],
        ] {
            run_successfully(folder, arguments);
        }
        assert_eq!(
            run_successfully(folder, &["lint", "mission.toml"]),
            run_successfully(plain.path(), &["lint", "mission.toml"]),
            "{new}"
        );
        if new.starts_with('c') {
            run_successfully(folder, &["plan", "mission.toml", "--fail", new]);
        } else if old.starts_with("fd") {
            run_successfully(folder, &["explain", "mission.toml", new]);
        }
    }
}

#[test]
fn designs_without_a_valid_pddl_name_are_omitted() {
    let copy = copy_of_mission("ugv");
    edit(copy.path(), "ontology/kb/ugv.ttl", ":fd_amcl_kinect", ":fd_amcl%28kinect%29");
    let manifest = ["plan", "missions/ugv.toml"];
    let outcome = run_successfully(copy.path(), &manifest);
    assert!(outcome.stdout.contains("cost "), "{outcome:#?}");
    assert!(outcome.stderr.contains("M201") && outcome.stderr.contains("[bindings.names]"), "{outcome:#?}");
    let without_kinect = metaplan(&["plan", "missions/ugv.toml", "--fail", "c_kinect"]);
    assert_eq!(without_kinect.status, 0);
}

#[test]
fn byte_order_marks_are_ignored() {
    const MARK: &[u8] = b"\xef\xbb\xbf";
    let folder = tempfile::tempdir().expect("a folder");
    let within = |name: &str| folder.path().join(name);
    for part in ["missions", "encodings/ugv", "ontology/kb", "rules/swrl"] {
        copy_folder(&root().join(part), &within(part));
    }
    fs::write(within("model.prism"), "dtmc\nmodule m\ns : [0..1] init 0;\n[] s=0 -> (s'=1);\nendmodule\n")
        .expect("a model");
    fs::write(within("props"), "P=? [ F s=1 ];\n").expect("properties");
    fs::write(
        within("events.jsonl"),
        "{\"event\": \"component_status\", \"component\": \"c_kinect\", \"status\": \"FALSE\"}\n",
    )
    .expect("events");
    let ugv = "missions/ugv.toml";
    for arguments in [
        &["plan", ugv, "-o", "plan.txt"][..],
        &["plan", ugv, "--format", "json", "-o", "plan.json"],
        &["convert", "ontology/kb/ugv.ttl", "--to", "ntriples", "-o", "kb.nt"],
        &["convert", "ontology/kb/ugv.ttl", "--to", "functional", "-o", "kb.ofn"],
        &["convert", "ontology/kb/ugv.ttl", "--to", "owlxml", "-o", "kb.owx"],
        &["convert", "ontology/kb/ugv.ttl", "--to", "rdfxml", "-o", "kb.owl"],
    ] {
        run_successfully(folder.path(), arguments);
    }
    let answers = || -> Vec<Outcome> {
        let commands = [
            &["plan", ugv][..],
            &[
                "plan",
                "encodings/ugv/domain.pddl",
                "encodings/ugv/problem.pddl",
                "--kb",
                "ontology/kb/ugv.ttl",
            ],
            &["report", "missions/templates/warehouse/mission.toml"],
            &["validate", ugv, "plan.txt"],
            &["validate", ugv, "plan.json"],
            &["reason", "kb.nt", "--rules", "rules/swrl/coadaptation.swrl"],
            &["reason", "kb.ofn", "--rules", "rules/swrl/coadaptation.swrl"],
            &["reason", "kb.owx", "--rules", "rules/swrl/tomasys.swrl"],
            &["reason", "kb.owl", "--assert", "kb.nt"],
            &["check", "model.prism", "--props", "props"],
            &["run", ugv, "--events", "events.jsonl"],
        ];
        commands.iter().map(|command| run_successfully(folder.path(), command)).collect()
    };
    let without_times = |outcomes: Vec<Outcome>| -> Vec<String> {
        let is_measured = |line: &&str| !line.contains("microseconds");
        outcomes
            .into_iter()
            .map(|outcome| {
                (outcome.stdout + &outcome.stderr).lines().filter(is_measured).collect::<Vec<_>>().join("\n")
            })
            .collect()
    };
    let expected = without_times(answers());
    assert!(expected.iter().all(|text| !text.contains("\"answer\":\"error\"")), "{expected:#?}");
    let mut count = 0;
    for file in texts(folder.path()) {
        let text = fs::read(&file).expect("a text");
        if !text.starts_with(MARK) && std::str::from_utf8(&text).is_ok() {
            fs::write(&file, [MARK, &text].concat()).expect("written");
            count += 1;
        }
    }
    assert!(count > 20, "{count} files");
    assert_eq!(without_times(answers()), expected);
    // The file is UTF-16 with CRLF, as written by `>` in Windows PowerShell.
    let plan = fs::read_to_string(within("plan.txt")).expect("a plan").replace('\n', "\r\n");
    let bytes: Vec<u8> = plan.encode_utf16().flat_map(u16::to_le_bytes).collect();
    fs::write(within("plan.txt"), bytes).expect("written");
    run_successfully(folder.path(), &["validate", ugv, "plan.txt"]);
}

#[test]
fn empty_documents_change_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let kb = root().join("ontology/kb/ugv.ttl").display().to_string();
    let reason = ["reason", &kb, "--rules", "coadaptation"];
    let expected = run_successfully(folder.path(), &reason).stdout;
    for text in ["", "\n \r\n\t\n", "# nothing\n\n# at all", "\u{feff}"] {
        fs::write(folder.path().join("nothing.nt"), text).expect("written");
        for option in ["--assert", "--retract"] {
            let outcome = run_successfully(folder.path(), &[&reason[..], &[option, "nothing.nt"]].concat());
            assert_eq!(outcome.stdout, expected, "{text:?} {option}");
            let piped = metaplan_in(folder.path(), &[&reason[..], &[option, "-"]].concat(), text);
            assert_eq!((piped.status, piped.stdout), (0, expected.clone()), "{text:?} {option}");
        }
    }
    // A knowledge base must not be empty, and a document in an unknown syntax is an error.
    fs::write(folder.path().join("other.nt"), "{\"@context\": {}}").expect("written");
    for arguments in [&["reason", "nothing.nt"][..], &[&reason[..], &["--assert", "other.nt"]].concat()] {
        let outcome = metaplan_in(folder.path(), arguments, "");
        assert_eq!(outcome.status, 3, "{outcome:#?}");
        assert!(headlines(&outcome.stderr).contains("O113"), "{outcome:#?}");
    }
}

#[test]
fn plans_in_files_can_be_validated() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("plan.txt").display().to_string();
    for mission in ["missions/ugv.toml", "missions/uuv.toml", "missions/templates/warehouse/mission.toml"] {
        let written = metaplan(&["plan", mission, "-o", &file]);
        assert_eq!((written.status, written.stdout.as_str()), (0, ""), "{mission}");
        assert!(written.stderr.contains("proved"), "{written:#?}");
        let text = fs::read_to_string(&file).expect("a plan");
        assert_eq!(text, metaplan(&["plan", mission, "--plan-format", "ipc"]).stdout, "{mission}");
        let valid = metaplan(&["validate", mission, &file]);
        assert!(valid.status == 0 && valid.stdout.starts_with("valid"), "{mission}: {valid:#?}");
        // A table of a plan is rejected with a single message, which names the remedy.
        for table in [&["--plan-format", "table"][..], &["--plan-format", "table", "--verbose"]] {
            assert_eq!(metaplan(&[&["plan", mission, "-o", &file], table].concat()).status, 0);
            let refused = metaplan(&["validate", mission, &file]);
            assert_eq!(refused.status, 3, "{refused:#?}");
            assert_eq!(headlines(&refused.stderr).matches("error[").count(), 1, "{refused:#?}");
            assert!(refused.stderr.contains("M111") && refused.stderr.contains("--plan-format ipc"));
        }
    }
    // Answers that are not a plan cannot be written in a plan format. They are printed to standard error, or
    // written to the file in the format of standard output.
    let unsolvable = metaplan(&["plan", "missions/uuv.toml", "--set", "water_visibility=1", "-o", &file]);
    assert_eq!(unsolvable.status, 10);
    let printed = metaplan(&["plan", "missions/uuv.toml", "--set", "water_visibility=1"]);
    assert_eq!(unsolvable.stderr, printed.stdout);
    let with_alternatives = ["plan", "missions/ugv.toml", "--alternatives", "1"];
    assert_eq!(metaplan(&[&with_alternatives[..], &["-o", &file]].concat()).status, 0);
    assert_eq!(fs::read_to_string(&file).expect("an answer"), metaplan(&with_alternatives).stdout);
}
