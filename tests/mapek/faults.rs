//! Fault injection into journals. After each small damage, the journal is refused, the damage is reported, or
//! the loop has the undamaged state. Directories with other files, links or pipes, and journals of a changed
//! mission are refused.
#![expect(clippy::print_stdout, reason = "figures are what the long test is for")]

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use metaplan::journal::{Journal, JournalReport, Policy, Sync};
use metaplan::mapek::{Answer, Loop};
use metaplan::setup::Setup;
use serde_json::Value;

use crate::common::control;
use crate::journal::{script, state};

/// Journal policy with such a small snapshot interval that the journal has two generations and an open
/// segment.
const POLICY: Policy = Policy { sync: Sync::Never, snapshot_every: 9 };

type Files = BTreeMap<String, Vec<u8>>;

fn written(pristine: &Loop) -> Files {
    let directory = tempfile::tempdir().expect("a directory");
    let mut control = pristine.clone();
    let (mut journal, _) = Journal::open(directory.path(), POLICY, &mut control).expect("it opens");
    journal.begin(&mut control).expect("written");
    for line in script() {
        journal.handle(&mut control, &line, Duration::ZERO).expect("written");
    }
    drop(journal);
    let entries = std::fs::read_dir(directory.path()).expect("a directory");
    entries
        .map(|entry| {
            let path = entry.expect("an entry").path();
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            (name, std::fs::read(path).expect("a file"))
        })
        .collect()
}

#[derive(Debug, PartialEq)]
enum Outcome {
    Refused,
    /// A part of the journal was cut off or is missing, and this was reported.
    Reported,
    /// Undamaged journal: state of the loop, and effects that it repeats.
    Sound(Value, Vec<Answer>),
}

/// Creates a temporary directory, in memory if possible. The tests open hundreds of thousands of
/// journals and flush each to disk.
pub fn temporary_directory() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    let in_memory = memory.is_dir().then(|| tempfile::tempdir_in(memory).ok()).flatten();
    in_memory.unwrap_or_else(|| tempfile::tempdir().expect("a directory"))
}

fn open(files: &Files, pristine: &Loop) -> Outcome {
    let directory = temporary_directory();
    for (name, bytes) in files {
        std::fs::write(directory.path().join(name), bytes).expect("a file");
    }
    let mut control = pristine.clone();
    let Ok((mut journal, recovery)) = Journal::open(directory.path(), POLICY, &mut control) else {
        for (name, bytes) in files.iter().filter(|(name, _)| *name != "lock") {
            let now = std::fs::read(directory.path().join(name)).expect("the file is still there");
            assert_eq!(now, *bytes, "{name} was changed by what was refused");
        }
        return Outcome::Refused;
    };
    if recovery.cut > 0 {
        let cut =
            std::fs::read_dir(directory.path()).expect("a directory").map(|entry| entry.expect("an entry"));
        let cut: u64 = cut
            .filter(|entry| entry.file_name().to_string_lossy().contains(".cut"))
            .map(|entry| entry.metadata().expect("a file").len())
            .sum();
        assert_eq!(cut, recovery.cut, "what was cut off is kept");
    }
    let answers = journal.begin(&mut control).expect("written");
    let is_lost = recovery.warnings.iter().any(|warning| warning.message.contains("are missing"));
    if recovery.cut > 0 || is_lost {
        return Outcome::Reported;
    }
    let sound = Outcome::Sound(state(&control), answers);
    drop(journal);
    // The recovered journal is complete and reports no damage.
    let report = JournalReport::read(directory.path()).expect("a journal");
    assert!(report.is_sound(), "{:?}", report.messages);
    sound
}

#[derive(Debug, Default)]
struct Count {
    refused: usize,
    reported: usize,
    harmless: usize,
}

struct Suite {
    pristine: Loop,
    files: Files,
    sound: Outcome,
    count: Count,
}

impl Suite {
    fn new() -> Self {
        let pristine = control("ugv");
        let files = written(&pristine);
        let sound = open(&files, &pristine);
        assert!(matches!(sound, Outcome::Sound(..)), "{sound:?}");
        assert!(files.values().map(Vec::len).sum::<usize>() > 10_000);
        Self { pristine, files, sound, count: Count::default() }
    }

    fn check(&mut self, fault: &str, change: impl FnOnce(&mut Files)) {
        let mut files = self.files.clone();
        change(&mut files);
        match open(&files, &self.pristine) {
            Outcome::Refused => self.count.refused += 1,
            Outcome::Reported => self.count.reported += 1,
            sound @ Outcome::Sound(..) => {
                assert!(sound == self.sound, "{fault}: wrong without a word");
                self.count.harmless += 1;
            }
        }
    }

    /// Injects all kinds of faults; faults of single bits and bytes only at every `stride`-th position.
    fn inject_all(&mut self, stride: usize) {
        let names: Vec<String> = self.files.keys().cloned().collect();
        for name in &names {
            let length = self.files[name].len();
            let stride = stride.min(length);
            let mut tried = 0;
            for bit in (0..length * 8).step_by(stride) {
                self.check(&format!("bit {bit} of {name}"), |files| {
                    files.get_mut(name).expect("a file")[bit / 8] ^= 1 << (bit % 8);
                });
                tried += 1;
            }
            for keep in (0..length).step_by(stride.div_ceil(8)) {
                self.check(&format!("{name} cut to {keep}"), |files| {
                    files.get_mut(name).expect("a file").truncate(keep);
                });
                tried += 1;
            }
            assert!(tried > 4, "{name}");
        }
        self.lines(&names, stride == 1);
        for name in &names {
            self.check(&format!("no {name}"), |files| {
                files.remove(name);
            });
            for replaced in &names {
                self.check(&format!("{name} for {replaced}"), |files| {
                    files.insert(replaced.clone(), files[name].clone());
                });
                self.check(&format!("neither {name} nor {replaced}"), |files| {
                    files.remove(name);
                    files.remove(replaced);
                });
            }
            for (fault, tail) in [("zeros", &[0; 512][..]), ("a text", b"hello"), ("a line", b"hello\n")] {
                self.check(&format!("{fault} after {name}"), |files| {
                    files.get_mut(name).expect("a file").extend_from_slice(tail);
                });
            }
        }
        self.check("CRLF everywhere", |files| files.values_mut().for_each(|bytes| *bytes = crlf(bytes)));
    }

    fn lines(&mut self, names: &[String], thorough: bool) {
        for name in names {
            let bytes = self.files[name].clone();
            let lines: Vec<&[u8]> = bytes.split_inclusive(|&byte| byte == b'\n').collect();
            self.check(&format!("CRLF in {name}"), |files| {
                files.insert(name.clone(), crlf(&bytes));
            });
            let mut with = |fault: &str, lines: Vec<&[u8]>| {
                self.check(&format!("{fault} of {name}"), |files| {
                    files.insert(name.clone(), lines.concat());
                });
            };
            for index in 0..lines.len() {
                let mut shortened = lines.clone();
                shortened.remove(index);
                with(&format!("line {index} removed"), shortened);
                let remaining = lines.len() - index;
                for count in (2..=remaining).filter(|&count| thorough || count == remaining) {
                    let mut shortened = lines.clone();
                    shortened.drain(index..index + count);
                    with(&format!("lines from {index}, {count} of them, removed"), shortened);
                }
                let mut extended = lines.clone();
                extended.insert(index, lines[index]);
                with(&format!("line {index} doubled"), extended);
                for earlier in (0..index).filter(|&earlier| thorough || earlier + 1 == index) {
                    let mut exchanged = lines.clone();
                    exchanged.swap(index, earlier);
                    with(&format!("lines {index} and {earlier} exchanged"), exchanged);
                }
            }
        }
    }
}

fn crlf(bytes: &[u8]) -> Vec<u8> {
    String::from_utf8_lossy(bytes).replace('\n', "\r\n").into_bytes()
}

#[test]
fn damage_to_a_journal_never_goes_unnoticed() {
    let mut suite = Suite::new();
    suite.inject_all(997);
}

#[test]
#[ignore = "takes minutes; only a release build is of interest"]
fn damage_to_every_bit_and_byte_is_noticed() {
    let mut suite = Suite::new();
    suite.inject_all(1);
    println!("{:?}", suite.count);
}

/// After a crash between two steps of a checkpoint, the loop continues from the previous snapshot.
#[test]
fn an_unfinished_snapshot_loses_nothing() {
    let suite = Suite::new();
    let newest = suite.files.keys().rfind(|name| name.starts_with("snapshot")).expect("a snapshot").clone();
    assert!(!newest.ends_with("000001"), "{newest}: there is a generation before");
    let number = newest.trim_start_matches("snapshot-");
    for damaged in [None, Some(b"half a snap".to_vec())] {
        let mut files = suite.files.clone();
        files.remove(&newest);
        files.extend(damaged.map(|bytes| (newest.clone(), bytes)));
        assert!(open(&files, &suite.pristine) == suite.sound, "the newest snapshot");
        // The new segment contains only its header.
        let segment = format!("journal-{number}");
        let header = files[&segment].split_inclusive(|byte| *byte == b'\n').next().expect("a line").to_vec();
        files.insert(segment, header);
        files.remove("lock");
        let outcome = open(&files, &suite.pristine);
        assert!(matches!(outcome, Outcome::Sound(..)), "the newest segment: {outcome:?}");
    }
}

#[test]
fn a_foreign_file_with_the_name_of_a_later_snapshot_is_ignored() {
    let suite = Suite::new();
    let last = |kind: &str| suite.files.keys().rfind(|name| name.starts_with(kind)).expect("a file").clone();
    let (segment, snapshot) = (last("journal"), last("snapshot"));
    for number in ["000099", "18446744073709551615"] {
        let name = format!("snapshot-{number}");
        // The copy of a snapshot has another number in its header than in its name.
        for content in [b"a text".to_vec(), suite.files[&snapshot].clone()] {
            let mut files = suite.files.clone();
            files.insert(name.clone(), content);
            assert!(open(&files, &suite.pristine) == suite.sound, "{name}");

            let directory = temporary_directory();
            for (name, bytes) in &files {
                std::fs::write(directory.path().join(name), bytes).expect("a file");
            }
            let mut control = suite.pristine.clone();
            let (mut journal, recovery) =
                Journal::open(directory.path(), POLICY, &mut control).expect("it opens");
            let is_reported = recovery.warnings.iter().any(|warning| warning.message.contains(&name));
            assert!(is_reported, "{:?}", recovery.warnings);
            journal.begin(&mut control).expect("written");
            // The next checkpoint removes old files, but not this one.
            for _ in 0..POLICY.snapshot_every {
                journal.handle(&mut control, r#"{"event":"tick"}"#, Duration::ZERO).expect("written");
            }
            assert!(
                directory.path().join(&name).exists() && !directory.path().join("journal-000001").exists()
            );

            files.remove(&segment);
            assert_eq!(open(&files, &suite.pristine), Outcome::Refused, "the last segment is missing");
        }
    }
    // A sound snapshot proves that its segment is missing, even without the `end` record of the segment before.
    let mut files = suite.files.clone();
    files.remove(&segment);
    let before = files.keys().rfind(|name| name.starts_with("journal")).expect("a file").clone();
    let bytes = files[&before].clone();
    let end = bytes.split_inclusive(|byte| *byte == b'\n').next_back().expect("a line").len();
    files.insert(before, bytes[..bytes.len() - end].to_vec());
    assert_eq!(open(&files, &suite.pristine), Outcome::Refused);
}

fn refused(directory: &Path, control: &Loop, words: &str) {
    let refused = Journal::open(directory, POLICY, &mut control.clone());
    let message = refused.map(|(journal, _)| journal).expect_err("it is refused").message.clone();
    assert!(message.contains(words), "{message}");
}

#[test]
fn files_other_than_journals_are_not_changed() {
    let pristine = control("ugv");
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("journal-000000");
    for text in ["my diary", "my diary\n", ""] {
        std::fs::write(&file, text).expect("a file");
        refused(directory.path(), &pristine, "is not a journal");
        assert_eq!(std::fs::read_to_string(&file).expect("a file"), text);
    }
    // Header of the previous format version. The file is not damaged, so nothing must be repaired.
    let first = "6bcb2ca5 [\"mission\",\"metaplan-journal/1\",\"302a8d68\"]\n";
    std::fs::write(&file, first).expect("a file");
    let words = "or restart the mission with a journal in another directory; nothing was changed";
    refused(directory.path(), &pristine, words);
    assert_eq!(std::fs::read_to_string(&file).expect("a file"), first);
    std::fs::remove_file(&file).expect("removed");
    std::fs::create_dir(&file).expect("a directory");
    refused(directory.path(), &pristine, "is not a regular file");
}

#[cfg(unix)]
#[test]
fn links_and_pipes_are_refused_at_once_and_files_are_private() {
    use std::os::unix::fs::PermissionsExt as _;
    let pristine = control("ugv");
    for name in ["journal-000000", "snapshot-000001", "lock"] {
        let directory = tempfile::tempdir().expect("a directory");
        let place = directory.path().join(name);
        let status = std::process::Command::new("mkfifo").arg(&place).status().expect("mkfifo");
        assert!(status.success());
        refused(directory.path(), &pristine, "is not a regular file");
        std::fs::remove_file(&place).expect("removed");
        std::os::unix::fs::symlink("/etc/hostname", &place).expect("a link");
        refused(directory.path(), &pristine, "is not a regular file");
    }
    let directory = tempfile::tempdir().expect("a directory");
    let below = directory.path().join("below");
    let mut control = pristine.clone();
    let (mut journal, _) = Journal::open(&below, POLICY, &mut control).expect("it opens");
    journal.begin(&mut control).expect("written");
    for line in script() {
        journal.handle(&mut control, &line, Duration::ZERO).expect("written");
    }
    let mode = |path: &Path| std::fs::metadata(path).expect("it is there").permissions().mode() & 0o777;
    assert_eq!(mode(&below), 0o700);
    for entry in std::fs::read_dir(&below).expect("a directory") {
        let path = entry.expect("an entry").path();
        assert_eq!(mode(&path), 0o600, "{}", path.display());
    }
}

#[test]
fn a_journal_is_refused_after_a_change_of_its_mission() {
    let directory = crate::worlds::own_files(7);
    let read = |directory: &Path| {
        let Setup { mission, settings, .. } =
            Setup::read(&directory.join("m.toml")).expect("the mission is read");
        Loop::new(mission, settings).expect("the mission can be planned for")
    };
    let journal = tempfile::tempdir().expect("a directory");
    let mut control = read(directory.path());
    let (mut open, _) = Journal::open(journal.path(), POLICY, &mut control).expect("it opens");
    open.begin(&mut control).expect("written");
    drop(open);
    let edits = [
        ("m.toml", "name = \"m\"", "name = \"n\""),
        ("m.toml", "[planning]", "[adaptation]\nsettle = 6\n[planning]"),
        ("m.toml", "[planning]", "[adaptation]\nheal_time = 6\n[planning]"),
        ("m.toml", "[planning]", "[adaptation.measured.light]\nhysteresis = 0.3\n[planning]"),
        ("m.toml", "[planning]", "[adaptation]\nminimum_benefit = 5\n[planning]"),
        ("m.toml", "[planning]", "[adaptation]\ntime_limit = 5\n[planning]"),
        ("m.toml", "[planning]", "[adaptation]\nstay_close = true\n[planning]"),
        ("m.toml", "[planning]", "[bindings]\nusage = \"measured:light\"\n[planning]"),
        ("own.swrl", "\"FALSE\") -> ", "\"ERROR\") -> "),
        ("own.swrl", "[dependency]", "# [dependency]"),
        ("kb.ttl", "t:hasValue 0.5", "t:hasValue 0.4"),
        ("domain.pddl", "(+ 1 (usage))", "(+ 2 (usage))"),
        ("problem.pddl", "(done p2)", "(done p0)"),
    ];
    for (file, old, new) in edits {
        let path = directory.path().join(file);
        let text = std::fs::read_to_string(&path).expect("text");
        assert!(text.contains(old), "{file} has no `{old}`");
        std::fs::write(&path, text.replacen(old, new, 1)).expect("written");
        refused(journal.path(), &read(directory.path()), "have changed");
        std::fs::write(&path, text).expect("written");
    }
    let mut control = read(directory.path());
    Journal::open(journal.path(), POLICY, &mut control).expect("nothing has changed");
}
