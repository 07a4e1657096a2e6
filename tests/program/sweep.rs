//! Tests of `metaplan sweep`: interrupted shards yield the same table as an uninterrupted run, results of
//! different studies are not mixed, and runs have time limits, generated files and pairs of places.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use metaplan::schemas::schema;
use metaplan::sweep::Study;
use serde_json::Value;

use crate::common::{edit, metaplan, metaplan_in, root};

const STUDY: &str = "missions/studies/kinect.toml";

fn sweep(study: &str, results: &Path, options: &[&str]) -> crate::common::Outcome {
    let results = results.to_string_lossy();
    let mut arguments = vec!["sweep", study, "--output", &results, "--format", "json", "--quiet"];
    arguments.extend(options);
    metaplan(&arguments)
}

fn merged(study: &str, results: &Path) -> (String, Value) {
    let csv = results.join("table.csv");
    let outcome = sweep(study, results, &["--merge", "--csv", &csv.to_string_lossy()]);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    (fs::read_to_string(csv).expect("the table"), outcome.json())
}

#[test]
fn killed_shards_give_the_same_table() {
    let folder = tempfile::tempdir().expect("a directory");
    let (uninterrupted, shards) = (folder.path().join("whole"), folder.path().join("parts"));
    let outcome = sweep(STUDY, &uninterrupted, &[]);
    assert_eq!((outcome.status, &outcome.json()["done"]), (0, &12.into()), "{outcome:#?}");
    let (table, answer) = merged(STUDY, &uninterrupted);
    assert_eq!(table.lines().count(), 13, "{table}");
    let groups = answer["groups"].as_array().expect("groups");
    assert!(groups.iter().all(|group| group["common"]["seed"].is_null()), "{groups:?}");
    let validator = jsonschema::validator_for(&schema("sweep").expect("a schema")).expect("it is one");
    assert!(validator.is_valid(&answer), "{answer:#}");
    for shard in ["1/3", "2/3", "3/3"] {
        // Each shard is killed once at an early point; the second shard is killed twice.
        for kill in 0..=u64::from(shard == "2/3") {
            let mut child = Command::new(env!("CARGO_BIN_EXE_metaplan"))
                .args(["sweep", STUDY, "--resume", "--shard", shard, "--output"])
                .arg(&shards)
                .current_dir(root())
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .expect("it runs");
            std::thread::sleep(Duration::from_millis(80 + 150 * kill));
            child.kill().expect("it can be killed");
            child.wait().expect("it ends");
        }
        // A kill can leave an incomplete line at the end of the file.
        let index = &shard[..1];
        let file = shards.join(format!("shard-000{index}-of-0003.jsonl"));
        let mut bytes = fs::read(&file).unwrap_or_default();
        bytes.extend(b"{\"run\": 1, \"va");
        // The line may also end within a character, here after the first byte of `é`.
        bytes.push(0xc3);
        fs::create_dir_all(&shards).expect("it can be made");
        fs::write(&file, bytes).expect("it can be written");
        let outcome = sweep(STUDY, &shards, &["--shard", shard, "--resume"]);
        assert_eq!((outcome.status, &outcome.json()["done"]), (0, &4.into()), "{outcome:#?}");
    }
    // A process that is killed at once can leave a file without a complete header.
    for (name, text) in
        [("empty", ""), ("short", "{\"for"), ("long", "{\"format\":\"metaplan-sweep/1\",\"stu")]
    {
        fs::write(shards.join(name).with_extension("jsonl"), text).expect("it can be written");
    }
    let (shard_table, shard_answer) = merged(STUDY, &shards);
    assert_eq!(shard_table, table);
    assert_eq!(shard_answer, answer);
}

#[test]
fn results_of_different_studies_are_not_mixed() {
    let folder = tempfile::tempdir().expect("a directory");
    let study = folder.path().join("study.toml");
    let domain = root().join("encodings/ugv");
    let text = |limit: u32| {
        format!(
            "command = ['plan', '{0}/domain.pddl', '{0}/problem.pddl', '--kb', '{1}']\ntime_limit = {limit}\n\
             [vary]\nfail = [[], ['c_kinect'], ['c_kinect', 'c_lidar']]\n",
            domain.display(),
            root().join("ontology/kb/ugv.ttl").display()
        )
    };
    fs::write(&study, text(60)).expect("it can be written");
    let (name, results) = (study.to_string_lossy().into_owned(), folder.path().join("results"));
    assert_eq!(sweep(&name, &results, &["--shard", "1/2"]).status, 0);
    let repeated = sweep(&name, &results, &["--shard", "1/2"]);
    assert!(repeated.status == 3 && repeated.stdout.contains("--resume"), "{repeated:#?}");
    // Merging incomplete results reports the missing runs.
    let incomplete = sweep(&name, &results, &["--merge"]);
    assert_eq!(
        (incomplete.status, &incomplete.json()["missing"]),
        (1, &serde_json::json!([1])),
        "{incomplete:#?}"
    );
    fs::write(&study, text(61)).expect("it can be written");
    for options in [["--resume", "--shard", "1/2"].as_slice(), &["--merge"]] {
        let changed_study = sweep(&name, &results, options);
        assert!(
            changed_study.status == 3 && changed_study.stdout.contains("another study"),
            "{changed_study:#?}"
        );
    }
    let file = results.join("shard-0001-of-0002.jsonl");
    let damaged = fs::read_to_string(&file).expect("lines").replacen("\"run\":0", "\"run\":}", 1);
    fs::write(&file, damaged).expect("it can be written");
    fs::write(&study, text(60)).expect("it can be written");
    let damaged_results = sweep(&name, &results, &["--merge"]);
    assert!(
        damaged_results.status == 3 && damaged_results.stdout.contains("line 2 is damaged"),
        "{damaged_results:#?}"
    );
}

#[test]
fn a_study_changes_with_every_file_of_its_mission() {
    let folder = tempfile::tempdir().expect("a directory");
    let here = folder.path();
    assert_eq!(metaplan_in(here, &["init", "m", "--from", "warehouse"], "").status, 0);
    let mission = here.join("m");
    let files = "files = [\"robot.ttl\"]";
    edit(&mission, "mission.toml", files, &format!("{files}\nrules = [\"coadaptation\", \"own.swrl\"]"));
    let import = "owl:imports <http://metacontrol.org/tomasys>";
    edit(&mission, "robot.ttl", import, &format!("{import} , <more.ttl>"));
    let more =
        "@prefix owl: <http://www.w3.org/2002/07/owl#> .\n<http://example.org/more> a owl:Ontology .\n";
    fs::write(mission.join("more.ttl"), more).expect("written");
    let rule = "@prefix t: <http://metacontrol.org/tomasys#> .\n@prefix w: <http://example.org/warehouse#> .\n\
                [own] t:requiresC(?fd, w:c_lidar) -> t:fd_realisability(?fd, false) .\n";
    fs::write(mission.join("own.swrl"), rule).expect("written");
    let study = here.join("study.toml");
    fs::write(&study, "command = ['plan', 'm/mission.toml']\n").expect("written");
    let digest = || Study::read(&study).expect("a study").digest;
    let before = digest();
    for file in
        ["mission.toml", "domain.pddl", "problem.pddl", "robot.ttl", "more.ttl", "own.swrl", "places.csv"]
    {
        let path = mission.join(file);
        let text = fs::read_to_string(&path).expect("text");
        fs::write(&path, text.clone() + "\n").expect("written");
        assert_ne!(digest(), before, "{file}");
        fs::write(&path, text).expect("written");
        assert_eq!(digest(), before, "{file}");
    }
    fs::write(mission.join("notes.txt"), "no part of the mission").expect("written");
    assert_eq!(digest(), before);
}

#[test]
#[cfg(unix)]
fn runs_end_at_their_time_limit_and_files_are_generated() {
    let folder = tempfile::tempdir().expect("a directory");
    let study = folder.path().join("study.toml");
    let model = "mdp\\nmodule m\\n s : [0..9];\\n [] s<{n} -> 0.5:(s'=s+1) + 0.5:(s'=0);\\nendmodule\\n";
    let text = format!(
        "command = ['check', '{{dir}}/m.prism', 'Pmax=? [ F<=20 s={{n}} ]']\n[vary]\nn = [2, 5]\n\
         [generate]\nrun = ['sh', '-c', \"printf \\\"{}\\\" > {{dir}}/m.prism\"]\n",
        model.replace('\\', "\\\\")
    );
    fs::write(&study, text).expect("it can be written");
    let (name, results) = (study.to_string_lossy().into_owned(), folder.path().join("results"));
    let outcome = sweep(&name, &results, &[]);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let (table, _) = merged(&name, &results);
    assert_eq!(table.lines().count(), 3, "{table}");
    let study = folder.path().join("slow.toml");
    let run = root().join("missions/camara_like.toml");
    let text = format!("command = ['compare', '{}']\ntime_limit = 0.05\n", run.display());
    fs::write(&study, text).expect("it can be written");
    let results = folder.path().join("slow");
    let outcome = sweep(&study.to_string_lossy(), &results, &[]);
    assert_eq!((outcome.status, &outcome.json()["timed_out"]), (1, &1.into()), "{outcome:#?}");
}

/// Writes a study, executes it, and returns its answer and the lines of its runs.
fn lines_of(directory: &Path, text: &str) -> (Value, Vec<Value>) {
    let (study, results) = (directory.join("study.toml"), directory.join("results"));
    fs::write(&study, text).expect("it can be written");
    let outcome = sweep(&study.to_string_lossy(), &results, &[]);
    assert_eq!(outcome.status, 1, "{outcome:#?}");
    let lines = fs::read_to_string(results.join("shard-0001-of-0001.jsonl")).expect("lines");
    let lines = lines.lines().skip(1).map(|line| serde_json::from_str(line).expect("JSON"));
    (outcome.json(), lines.collect())
}

#[test]
#[cfg(unix)]
fn a_failed_generator_does_not_affect_other_runs() {
    let folder = tempfile::tempdir().expect("a directory");
    let model = "mdp\\nmodule m\\n s : [0..1];\\n [] s=0 -> (s'=1);\\nendmodule\\n";
    let fail = "if test {n} = 2; then echo no >&2; exit 3; fi";
    let script = format!("{fail}; printf \"{model}\" > {{dir}}/m.prism");
    let text = format!(
        "command = ['check', '{{dir}}/m.prism', 'Pmax=? [ F s=1 ]']\n[vary]\nn = [1, 2, 3]\n\
         [generate]\nrun = ['sh', '-c', \"\"\"{script}\"\"\"]\n"
    );
    let (answer, lines) = lines_of(folder.path(), &text);
    assert_eq!((&answer["done"], &answer["failed"]), (&3.into(), &1.into()), "{answer:#}");
    let failed: Vec<bool> = lines.iter().map(|line| line["answer"].is_null()).collect();
    assert_eq!(failed, [false, true, false], "{lines:#?}");
    let message = lines[1]["message"].as_str().expect("a message");
    assert!(
        message.starts_with("sh -c if test 2 = 2") && message.ends_with("exit status: 3\nno"),
        "{message}"
    );
}

#[test]
#[cfg(unix)]
fn time_limits_bind_generators() {
    let folder = tempfile::tempdir().expect("a directory");
    let study = |generate: &str| {
        format!("command = ['check', 'm.prism', 'P=? [ F s=1 ]']\n[generate]\nrun = {generate}\n")
    };
    // A process in the background keeps the output of the generator open after its end.
    let begun = Instant::now();
    let background = study("['sh', '-c', 'sleep 60 &']");
    let (answer, lines) = lines_of(folder.path(), &format!("time_limit = 1\n{background}"));
    assert_eq!((&answer["done"], &answer["timed_out"]), (&1.into(), &1.into()), "{lines:#?}");
    assert!(begun.elapsed() < Duration::from_secs(50), "{lines:#?}");
    let folder = tempfile::tempdir().expect("a directory");
    let text = study("['sh', '-c', 'sleep 1000']");
    let (answer, lines) = lines_of(folder.path(), &format!("time_limit = 1\n{text}"));
    assert_eq!((&answer["done"], &answer["timed_out"]), (&1.into(), &1.into()), "{answer:#}");
    assert!(lines[0]["message"].as_str().is_some_and(|text| text.contains("time limit")), "{lines:#?}");
    let folder = tempfile::tempdir().expect("a directory");
    let study = folder.path().join("study.toml");
    fs::write(&study, text).expect("it can be written");
    let outcome = sweep(&study.to_string_lossy(), &folder.path().join("results"), &["--time-limit", "1"]);
    assert_eq!((outcome.status, &outcome.json()["done"]), (1, &0.into()), "{outcome:#?}");
}

#[test]
fn an_error_message_is_no_answer() {
    let folder = tempfile::tempdir().expect("a directory");
    let mission = root().join("missions/ugv.toml");
    let text =
        format!("command = ['plan', '{}']\n[vary]\nfail = ['c_nope', 'c_kinect']\n", mission.display());
    let (answer, lines) = lines_of(folder.path(), &text);
    assert_eq!((&answer["done"], &answer["failed"]), (&2.into(), &1.into()), "{answer:#}");
    assert!(lines[0]["answer"].is_null() && lines[1]["answer"]["format"].is_string(), "{lines:#?}");
    assert!(lines[0]["message"].as_str().is_some_and(|text| text.contains("c_nope")), "{lines:#?}");
}

#[test]
#[cfg(unix)]
fn the_time_limit_of_a_run_ends_its_sat_solver() {
    let folder = tempfile::tempdir().expect("a directory");
    let (study, pid) = (folder.path().join("study.toml"), folder.path().join("pid"));
    let script = folder.path().join("solver.sh");
    fs::write(&script, format!("echo $$ > {}\nexec sleep 1000\n", pid.display())).expect("it can be written");
    let mission = root().join("missions/ugv.toml");
    let text = format!(
        "command = ['plan', '{}', '--engine', 'sat', '--solver', 'sh {}']\ntime_limit = 1\n",
        mission.display(),
        script.display()
    );
    fs::write(&study, text).expect("it can be written");
    let outcome = sweep(&study.to_string_lossy(), &folder.path().join("results"), &[]);
    assert_eq!((outcome.status, &outcome.json()["timed_out"]), (1, &1.into()), "{outcome:#?}");
    let solver = fs::read_to_string(pid).expect("the solver was started");
    // A process that has ended is a zombie until its new parent notices.
    let state = fs::read_to_string(format!("/proc/{}/stat", solver.trim())).unwrap_or_default();
    assert!(state.is_empty() || state.contains(") Z "), "{state}");
}

/// A study can vary pairs of places of the invented map. Its results equal those of the comparison of the
/// map.
#[test]
fn pairs_of_a_map_can_be_varied() {
    let folder = tempfile::tempdir().expect("a directory");
    let study = folder.path().join("study.toml");
    let run = root().join("missions/camara_like.toml");
    let text = format!(
        "command = ['compare', '{0}', '--battery-unit=1000']\nrows = '/comparisons/0/candidates'\n\
         [pairs]\nmission = '{0}'\nmost = 2\n",
        run.display()
    );
    fs::write(&study, text).expect("it can be written");
    let (name, results) = (study.to_string_lossy().into_owned(), folder.path().join("results"));
    assert_eq!(sweep(&name, &results, &[]).status, 0);
    let (table, _) = merged(&name, &results);
    let path = run.to_string_lossy();
    let outcome =
        metaplan(&["compare", &path, "--battery-unit=1000", "--pairs", "2", "--format", "json", "-q"]);
    let answer = outcome.json();
    let expected: Vec<&Value> = answer["comparisons"]
        .as_array()
        .expect("comparisons")
        .iter()
        .flat_map(|comparison| comparison["candidates"].as_array().expect("candidates"))
        .collect();
    let mut reader = csv::Reader::from_reader(table.as_bytes());
    let header = reader.headers().expect("a header").clone();
    let column = |name: &str| header.iter().position(|title| title == name).expect("a column");
    let rows: Vec<csv::StringRecord> = reader.records().map(|row| row.expect("a row")).collect();
    assert_eq!(rows.len(), expected.len());
    for (row, candidate) in rows.iter().zip(expected) {
        assert_eq!(row[column("name")], *candidate["name"].as_str().expect("a name"));
        let time: f64 = row[column("time")].parse().expect("a number");
        assert!((time - candidate["time"].as_f64().expect("a time")).abs() < 1e-9, "{row:?}");
    }
}
