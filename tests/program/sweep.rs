//! `metaplan sweep`: shards, kills and all, come to the same table as the whole.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use metaplan::schemas::schema;
use serde_json::Value;

use crate::common::{metaplan, root};

const STUDY: &str = "missions/studies/kinect.toml";

fn sweep(study: &str, results: &Path, more: &[&str]) -> crate::common::Outcome {
    let results = results.to_string_lossy();
    let mut arguments = vec!["sweep", study, "--output", &results, "--format", "json", "--quiet"];
    arguments.extend(more);
    metaplan(&arguments)
}

/// The merged table, and the answer.
fn merged(study: &str, results: &Path) -> (String, Value) {
    let csv = results.join("table.csv");
    let outcome = sweep(study, results, &["--merge", "--csv", &csv.to_string_lossy()]);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    (fs::read_to_string(csv).expect("the table"), outcome.json())
}

#[test]
fn shards_that_are_killed_come_to_the_same_table_as_the_whole() {
    let folder = tempfile::tempdir().expect("a directory");
    let (whole, parts) = (folder.path().join("whole"), folder.path().join("parts"));
    let outcome = sweep(STUDY, &whole, &[]);
    assert_eq!((outcome.status, &outcome.json()["done"]), (0, &12.into()), "{outcome:#?}");
    let (table, answer) = merged(STUDY, &whole);
    assert_eq!(table.lines().count(), 13, "{table}");
    let groups = answer["groups"].as_array().expect("groups");
    assert!(groups.iter().all(|group| group["common"]["seed"].is_null()), "{groups:?}");
    let fits = jsonschema::validator_for(&schema("sweep").expect("a schema")).expect("it is one");
    assert!(fits.is_valid(&answer), "{answer:#}");
    for shard in ["1/3", "2/3", "3/3"] {
        // Killed once, somewhere; the second shard twice.
        for kill in 0..=u64::from(shard == "2/3") {
            let mut child = Command::new(env!("CARGO_BIN_EXE_metaplan"))
                .args(["sweep", STUDY, "--resume", "--shard", shard, "--output"])
                .arg(&parts)
                .current_dir(root())
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .expect("it runs");
            std::thread::sleep(Duration::from_millis(80 + 150 * kill));
            child.kill().expect("it can be killed");
            child.wait().expect("it ends");
        }
        // What a kill may leave of a line.
        let index = &shard[..1];
        let file = parts.join(format!("shard-000{index}-of-0003.jsonl"));
        let mut text = fs::read_to_string(&file).unwrap_or_default();
        text.push_str("{\"run\": 1, \"va");
        fs::create_dir_all(&parts).expect("it can be made");
        fs::write(&file, text).expect("it can be written");
        let outcome = sweep(STUDY, &parts, &["--shard", shard, "--resume"]);
        assert_eq!((outcome.status, &outcome.json()["done"]), (0, &4.into()), "{outcome:#?}");
    }
    let (same, same_answer) = merged(STUDY, &parts);
    assert_eq!(same, table);
    assert_eq!(same_answer, answer);
}

#[test]
fn results_are_not_mixed_up() {
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
    let again = sweep(&name, &results, &["--shard", "1/2"]);
    assert!(again.status == 3 && again.stdout.contains("--resume"), "{again:#?}");
    // A part is not taken for the whole.
    let part = sweep(&name, &results, &["--merge"]);
    assert_eq!((part.status, &part.json()["missing"]), (1, &serde_json::json!([1])), "{part:#?}");
    fs::write(&study, text(61)).expect("it can be written");
    for more in [["--resume", "--shard", "1/2"].as_slice(), &["--merge"]] {
        let other = sweep(&name, &results, more);
        assert!(other.status == 3 && other.stdout.contains("another study"), "{other:#?}");
    }
    let file = results.join("shard-0001-of-0002.jsonl");
    let damaged = fs::read_to_string(&file).expect("lines").replacen("\"run\":0", "\"run\":}", 1);
    fs::write(&file, damaged).expect("it can be written");
    fs::write(&study, text(60)).expect("it can be written");
    let other = sweep(&name, &results, &["--merge"]);
    assert!(other.status == 3 && other.stdout.contains("line 2 is damaged"), "{other:#?}");
}

#[test]
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

/// All ordered pairs of the made-up map, as its comparison has them.
#[test]
fn pairs_of_a_map_are_a_key() {
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
        .flat_map(|one| one["candidates"].as_array().expect("candidates"))
        .collect();
    let mut reader = csv::Reader::from_reader(table.as_bytes());
    let header = reader.headers().expect("a header").clone();
    let column = |name: &str| header.iter().position(|own| own == name).expect("a column");
    let rows: Vec<csv::StringRecord> = reader.records().map(|row| row.expect("a row")).collect();
    assert_eq!(rows.len(), expected.len());
    for (row, candidate) in rows.iter().zip(expected) {
        assert_eq!(row[column("name")], *candidate["name"].as_str().expect("a name"));
        let time: f64 = row[column("time")].parse().expect("a number");
        assert!((time - candidate["time"].as_f64().expect("a time")).abs() < 1e-9, "{row:?}");
    }
}
