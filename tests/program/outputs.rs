//! Tests of output files: special files are written to, symbolic links are followed, and a file keeps its
//! mode, owner and hard links.
//!
//! No test uses a device file of the system such as `/dev/null`, because a faulty program could replace it. A
//! test creates its own device in a temporary directory.

use std::fs;
use std::os::unix::fs::{FileTypeExt as _, MetadataExt as _, PermissionsExt as _, symlink};
use std::path::Path;
use std::process::{Command, Stdio};

use test_resources::{Resource, missing, program};

use crate::common::{metaplan, root};

/// Commands that write deterministic content to `FILE`.
const OUTPUTS: [&[&str]; 11] = [
    &["plan", "missions/ugv.toml", "-o", "FILE"],
    &["plan", "missions/ugv.toml", "--svg", "FILE"],
    &["report", "missions/ugv.toml", "-o", "FILE"],
    &["convert", "ontology/kb/ugv.ttl", "--to", "turtle", "-o", "FILE"],
    &["export", "missions/camara_like.toml", "--to", "prism", "-o", "FILE"],
    &["simulate", "missions/uuv.toml", "--scenario", "suave", "--runs", "1", "--csv", "FILE"],
    &["simulate", "missions/uuv.toml", "--scenario", "suave", "--runs", "1", "--log", "FILE"],
    &["simulate", "missions/uuv.toml", "--scenario", "suave", "--runs", "1", "--report", "FILE"],
    &["check", "MODEL", "Pmax=? [ F \"done\" ]", "--const", "p=0.5", "--policy", "FILE"],
    &["check", "MODEL", "Pmax=? [ F \"done\" ]", "--const", "p=0.1:0.1:0.3", "--csv", "FILE"],
    &["verify", "PROOF", "--smt", "FILE"],
];

const MODEL: &str = "mdp\nconst double p;\nmodule m\ns : [0..1] init 0;\n[a] s=0 -> p:(s'=1) + 1-p:(s'=0);\n\
    [b] s=0 -> (s'=0);\nendmodule\nlabel \"done\" = s=1;\n";

fn run(arguments: &[&str]) {
    let outcome = metaplan(arguments);
    assert_eq!(outcome.status, 0, "{arguments:?}: {outcome:#?}");
}

fn mode(path: &Path) -> u32 {
    fs::metadata(path).expect("a file").mode() & 0o7777
}

/// Creates a FIFO and starts a process that copies its content to the file `copy`.
fn fifo(path: &Path, copy: &Path) -> std::process::Child {
    let status = Command::new("mkfifo").arg(path).status().expect("mkfifo runs");
    assert!(status.success());
    let script = "exec timeout 300 cat \"$1\" > \"$2\"";
    Command::new("sh").args(["-c", script, "sh"]).args([path, copy]).spawn().expect("the shell runs")
}

#[test]
fn outputs_follow_links_and_write_to_fifos() {
    let folder = tempfile::tempdir().expect("a folder");
    let within = |name: &str| folder.path().join(name);
    fs::write(within("model.prism"), MODEL).expect("a model");
    let (model, proof) = (within("model.prism").display().to_string(), within("proof").display().to_string());
    run(&["plan", "missions/ugv.toml", "--certificate", &proof]);
    for (number, output) in OUTPUTS.into_iter().enumerate() {
        let run_into = |file: &Path| {
            let file = file.display().to_string();
            let word = |word: &&str| match *word {
                "FILE" => file.clone(),
                "MODEL" => model.clone(),
                "PROOF" => proof.clone(),
                word => word.to_owned(),
            };
            let words: Vec<String> = output.iter().map(word).collect();
            run(&words.iter().map(String::as_str).collect::<Vec<_>>());
        };
        let [link, target, pipe, copy] =
            ["link", "target", "pipe", "copy"].map(|name| within(&format!("{name}-{number}")));
        fs::write(&target, "old").expect("a file");
        fs::set_permissions(&target, fs::Permissions::from_mode(0o600)).expect("a mode");
        symlink(&target, &link).expect("a link");
        run_into(&link);
        assert!(link.symlink_metadata().expect("a link").is_symlink(), "{output:?}");
        assert_eq!(mode(&target), 0o600, "{output:?}");
        let written = fs::read(&target).expect("a file");
        assert!(written.len() > 20, "{output:?}");

        let mut reader = fifo(&pipe, &copy);
        run_into(&pipe);
        assert!(reader.wait().expect("the reader ends").success(), "{output:?}");
        assert!(pipe.symlink_metadata().expect("a FIFO").file_type().is_fifo(), "{output:?}");
        assert_eq!(written, fs::read(&copy).expect("a copy"), "{output:?}");
    }
    let file_count = fs::read_dir(folder.path()).expect("a folder").count();
    assert_eq!(file_count, 2 + 4 * OUTPUTS.len(), "no temporary file is left");
}

#[test]
fn traces_follow_links_and_write_to_fifos() {
    let folder = tempfile::tempdir().expect("a folder");
    let [link, pipe, copy] = ["link", "pipe", "copy"].map(|name| folder.path().join(name));
    let mut reader = fifo(&pipe, &copy);
    symlink("pipe", &link).expect("a link");
    run(&["plan", "missions/ugv.toml", "--trace", &link.display().to_string()]);
    assert!(reader.wait().expect("the reader ends").success());
    let trace: serde_json::Value = serde_json::from_slice(&fs::read(&copy).expect("a copy")).expect("JSON");
    assert!(trace.as_array().is_some_and(|events| events.len() > 10));
    assert!(pipe.symlink_metadata().expect("a FIFO").file_type().is_fifo());
    assert!(link.symlink_metadata().expect("a link").is_symlink());
}

/// The program follows chains of the length that Linux follows.
#[test]
fn long_chains_of_links_are_followed() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |number: usize| folder.path().join(format!("link-{number}"));
    let target = folder.path().join("target");
    symlink(&target, path(1)).expect("a link");
    for number in 2..=41 {
        symlink(path(number - 1), path(number)).expect("a link");
    }
    let plan = |number: usize| {
        let file = path(number).display().to_string();
        metaplan(&["plan", "missions/ugv.toml", "--output", &file])
    };
    assert_eq!(plan(40).status, 0);
    assert!(fs::read_to_string(&target).expect("a plan").contains("move"));
    let outcome = plan(41);
    assert_eq!(outcome.status, 3, "{outcome:#?}");
    assert!(outcome.stderr.contains("error[M109]: the file cannot be written"), "{outcome:#?}");
    assert!(path(41).symlink_metadata().expect("a link").is_symlink());
}

#[test]
fn devices_are_not_replaced() {
    let folder = tempfile::tempdir().expect("a folder");
    let null = folder.path().join("null");
    let created = Command::new("mknod").arg(&null).args(["c", "1", "3"]).stderr(Stdio::null()).status();
    if !created.is_ok_and(|status| status.success()) || fs::write(&null, "x").is_err() {
        missing(Resource::Root, "mknod cannot create a device");
        return;
    }
    run(&["convert", "ontology/kb/ugv.ttl", "--to", "turtle", "-o", &null.display().to_string()]);
    assert!(null.symlink_metadata().expect("a device").file_type().is_char_device());
}

#[test]
fn files_keep_mode_owner_and_hard_links() {
    let folder = tempfile::tempdir().expect("a folder");
    let [file, hard_link, moved] = ["file", "other", "moved"].map(|name| folder.path().join(name));
    let convert = || {
        let file = file.display().to_string();
        run(&["convert", "ontology/kb/ugv.ttl", "--to", "turtle", "-o", &file]);
        fs::read_to_string(&file).expect("a file")
    };
    fs::write(&file, "old".repeat(100_000)).expect("a file");
    fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).expect("a mode");
    fs::hard_link(&file, &hard_link).expect("a link");
    let first = convert();
    assert!(first.starts_with('@') && first.len() < 100_000);
    assert_eq!(fs::read_to_string(&hard_link).expect("a file"), first);
    assert_eq!((mode(&file), fs::metadata(&file).expect("a file").nlink()), (0o640, 2));
    fs::remove_file(&hard_link).expect("removed");
    // Without further hard links the file is replaced atomically, so that a reader of the old file is not disturbed.
    let old_inode = fs::metadata(&file).expect("a file").ino();
    assert_eq!(convert(), first);
    assert_ne!(fs::metadata(&file).expect("a file").ino(), old_inode);
    assert_eq!(mode(&file), 0o640);
    // Only root can change the owner of a file.
    if std::os::unix::fs::chown(&file, Some(12345), Some(23456)).is_ok() {
        convert();
        let owned = fs::metadata(&file).expect("a file");
        assert_eq!((owned.uid(), owned.gid(), mode(&file)), (12345, 23456, 0o640));
    } else {
        missing(Resource::Root, "the owner of a file cannot be changed");
    }
    // If the target of a link does not exist, it is created.
    fs::remove_file(&file).expect("removed");
    symlink("moved", &file).expect("a link");
    convert();
    assert!(file.symlink_metadata().expect("a link").is_symlink() && moved.is_file());
}

/// Runs a script in the root of the project and returns its output. The tested program is in PATH, and `$1`
/// is `folder`.
fn shell(program: &str, script: &str, folder: &Path) -> String {
    let programs =
        Path::new(env!("CARGO_BIN_EXE_metaplan")).parent().expect("a folder").display().to_string();
    let path = format!("{programs}:{}", std::env::var("PATH").unwrap_or_default());
    let output = Command::new(program)
        .args(["-c", script, "sh"])
        .arg(folder)
        .current_dir(root())
        .env("PATH", path)
        .output()
        .expect("the shell runs");
    assert!(output.status.success(), "{script}: {output:?}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

#[test]
fn new_files_respect_the_umask() {
    let folder = tempfile::tempdir().expect("a folder");
    let script = "umask 027 && cd \"$1\" && metaplan init robot > made && metaplan plan robot/mission.toml \
        -q -o plan --certificate proof && metaplan plan robot/mission.toml -q --svg picture > shown";
    shell("sh", script, folder.path());
    for (name, expected) in [("plan", 0o640), ("picture", 0o640), ("proof", 0o750), ("robot", 0o750)] {
        assert_eq!(mode(&folder.path().join(name)), expected, "{name}");
    }
}

#[test]
fn dash_and_device_files_are_standard_output() {
    let folder = tempfile::tempdir().expect("a folder");
    let convert = "metaplan convert ontology/kb/ugv.ttl --to ntriples";
    let plain = shell("sh", convert, folder.path());
    assert!(plain.lines().count() > 50);
    // The links imitate `/dev/stdout`, because the test must not touch the real device file.
    symlink("/proc/self/fd/1", folder.path().join("stdout")).expect("a link");
    symlink("/proc/self/fd/3", folder.path().join("third")).expect("a link");
    for script in [
        format!("{convert} -o -"),
        format!("{convert} -o \"$1/stdout\" | cat"),
        format!("{convert} -o \"$1/stdout\" > \"$1/file\" && cat \"$1/file\""),
        format!("{convert} -o \"$1/third\" 3> \"$1/file\" && cat \"$1/file\""),
        format!("{convert} -o \"$1/third\" 3>&1 | cat"),
    ] {
        assert_eq!(shell("sh", &script, folder.path()), plain, "{script}");
    }
    let appended =
        format!("echo first > \"$1/file\"; {convert} -o \"$1/stdout\" >> \"$1/file\"; cat \"$1/file\"");
    assert_eq!(shell("sh", &appended, folder.path()), format!("first\n{plain}"));
    if program(Resource::Bash, &["bash"]).is_some() {
        let script = format!("{convert} -o >(cat > \"$1/copy\"); wait $!; cat \"$1/copy\"");
        assert_eq!(shell("bash", &script, folder.path()), plain);
    }
    // A plan on standard output has the human-readable format, regardless of the name of the output.
    let plan = "metaplan plan missions/ugv.toml";
    let table = shell("sh", plan, folder.path());
    assert!(table.starts_with(" step"));
    for output in ["-o -", "-o \"$1/stdout\""] {
        assert_eq!(shell("sh", &format!("{plan} {output}"), folder.path()), table, "{output}");
    }
    let simulate = "metaplan simulate missions/uuv.toml --scenario suave --runs 1 --quiet --csv";
    let separate_outputs = format!("{simulate} \"$1/csv\" > \"$1/table\"; cat \"$1/csv\" \"$1/table\"");
    let separate_outputs = shell("sh", &separate_outputs, folder.path());
    assert!(separate_outputs.starts_with("strategy,seed,"), "{separate_outputs}");
    assert_eq!(shell("sh", &format!("{simulate} -"), folder.path()), separate_outputs);
    assert!(!root().join("-").exists());
}

#[test]
fn certificates_fill_empty_directories_through_links() {
    let folder = tempfile::tempdir().expect("a folder");
    let [proof, link] = ["proof", "link"].map(|name| folder.path().join(name));
    fs::create_dir(&proof).expect("a directory");
    fs::set_permissions(&proof, fs::Permissions::from_mode(0o705)).expect("a mode");
    let inode = fs::metadata(&proof).expect("a directory").ino();
    symlink("proof", &link).expect("a link");
    let arguments = ["plan", "missions/ugv.toml", "--certificate", &link.display().to_string()];
    run(&arguments);
    assert!(link.symlink_metadata().expect("a link").is_symlink());
    assert_eq!((mode(&proof), fs::metadata(&proof).expect("a directory").ino()), (0o705, inode));
    assert!(fs::read_dir(&proof).expect("files").all(|entry| entry.expect("an entry").path().is_file()));
    run(&["verify", &link.display().to_string()]);
    let second_run = metaplan(&arguments);
    assert_eq!(second_run.status, 3);
    assert!(second_run.stderr.contains("directory not empty"), "{second_run:#?}");
}

#[test]
fn outputs_of_several_files_refuse_standard_output() {
    for arguments in [
        &["plan", "missions/ugv.toml", "--certificate", "-"][..],
        &["report", "missions/ugv.toml", "--svg", "-"],
        &["man", "-o", "-"],
        &["sweep", "missions/studies/kinect.toml", "-o", "-"],
        &[
            "import",
            "camara-map",
            "encodings/camara_like/map.json",
            "--start",
            "p1",
            "--goal",
            "p10",
            "-o",
            "-",
        ],
    ] {
        let outcome = metaplan(arguments);
        assert_eq!(outcome.status, 2, "{arguments:?}: {outcome:#?}");
        assert!(outcome.stderr.contains("`./-`"), "{arguments:?}: {outcome:#?}");
    }
    assert!(!root().join("-").exists());
}

#[test]
fn recordings_do_not_replace_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let [pipe, link] = ["pipe", "link"].map(|name| folder.path().join(name));
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo runs").success());
    symlink("nothing", &link).expect("a link");
    for (file, reason) in [
        (pipe.display().to_string(), "exists already"),
        (link.display().to_string(), "exists already"),
        ("-".to_owned(), "standard output is used for the answers"),
    ] {
        let outcome = metaplan(&["run", "missions/ugv.toml", "--mcap", &file]);
        assert_eq!(outcome.status, 3, "{outcome:#?}");
        assert!(outcome.stderr.contains(reason), "{outcome:#?}");
    }
    assert!(pipe.symlink_metadata().expect("a FIFO").file_type().is_fifo());
    assert!(link.symlink_metadata().expect("a link").is_symlink());
}
