//! Test that the examples in `metaplan help` work.

use crate::common::{copy_folder, metaplan, metaplan_in, root};

/// Runs the examples in the order of the commands, because some examples need the output of earlier ones.
#[test]
fn every_example_works() {
    let folder = tempfile::tempdir().expect("a folder");
    for part in ["missions", "encodings/ugv", "encodings/uuv", "encodings/camara_like", "ontology/kb"] {
        let from = root().join(part);
        if from.is_dir() {
            copy_folder(&from, &folder.path().join(part));
        }
    }
    let overview = metaplan(&["help"]).stdout;
    let (_, commands) = overview.split_once("\nCommands:\n").expect("commands");
    let names = commands.lines().take_while(|line| !line.is_empty());
    // A description can take several lines. Only its first line begins with the command.
    let names = names.filter_map(|line| line.strip_prefix("  ").filter(|line| !line.starts_with(' ')));
    let names = names.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help");
    let mut count = 0;
    for name in names {
        let help = metaplan(&["help", name]).stdout;
        let Some((_, examples)) = help.split_once("\nExamples:\n") else { continue };
        let examples = examples.replace(" \\\n   ", "");
        for line in examples.lines().map(str::trim).filter(|line| !line.is_empty()) {
            let line = line.replace("--serve", "--serve=0");
            let words: Vec<&str> = line.split(' ').skip(1).collect();
            let outcome = metaplan_in(folder.path(), &words, "");
            assert_eq!(outcome.status, 0, "{line}: {outcome:?}");
            count += 1;
        }
    }
    assert!(count > 20, "{count} examples");
}
