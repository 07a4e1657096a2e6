//! Tests of rules of style and structure that can be checked mechanically.

mod believed;
mod circles;
mod codes;
mod facade_layers;
mod language;
mod metadata;
mod packages;
mod pages;

use std::path::{Path, PathBuf};

const FILE_LINES: usize = 800;
const FUNCTION_LINES: usize = 100;

/// Folders, and the names that must not occur in their code.
const FORBIDDEN: [(&str, &[&str]); 14] = [
    ("ontology/src", &["planner::", "pddl::", "std::time"]),
    ("rules/src", &["ontology::", "planner::", "std::fs", "std::time"]),
    ("crates/pddl/src", &["ontology::", "rules::", "planner::", "varisat", "std::fs", "std::time"]),
    ("crates/certificate/src", &["ontology::", "rules::", "planner::", "varisat", "std::fs", "std::time"]),
    ("crates/mission/src", &["planner::", "varisat", "oxrdf", "horned", "std::time"]),
    ("crates/verify/src", &["planner::", "varisat", "oxrdf", "horned"]),
    ("encodings/src", &["ontology::", "oxrdf", "horned"]),
    (
        "crates/task/src",
        &["ontology::", "search::", "encodings::", "planner::", "varisat", "oxrdf", "std::fs"],
    ),
    (
        "crates/search/src",
        &["ontology::", "encodings::", "planner::", "pddl::", "varisat", "oxrdf", "std::fs"],
    ),
    ("crates/temporal/src", &["ontology::", "encodings::", "planner::", "varisat", "oxrdf", "std::fs"]),
    ("crates/planner/src", &["ontology::", "varisat::", "oxrdf", "horned"]),
    (
        "crates/picture/src",
        &["ontology::", "planner::", "rules::", "pddl::", "std::fs", "std::time", "std::net"],
    ),
    ("crates/probabilistic/src", &["ontology::", "planner::", "rules::", "pddl::", "std::fs"]),
    ("src/cli", &["horned", "oxrdf", "varisat", "crepe", "json!"]),
];

/// Crates that only one file or folder may use, with this file or folder.
const SINGLE_FILE: [(&str, &str); 6] = [
    ("horned_owl", "ontology/src/horned/"),
    ("varisat::", "encodings/src/sat/"),
    ("batsat::", "encodings/src/sat/"),
    ("cadical::", "encodings/src/sat/"),
    ("rustsat::", "encodings/src/sat/"),
    ("mcap::", "src/recording/"),
];

fn rust_files(directory: &Path, files: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(directory) else { return };
    let mut paths: Vec<_> = entries.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() && !path.ends_with("target") {
            rust_files(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

/// Returns the Rust files of the workspace without its folder `examples`: path relative to the workspace root, and
/// text.
fn files() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths = Vec::new();
    for folder in ["src", "ontology", "rules", "encodings", "crates", "integrations", "tests", "benches"] {
        rust_files(&root.join(folder), &mut paths);
    }
    let relative =
        |path: PathBuf| path.strip_prefix(root).expect("below the root").to_string_lossy().replace('\\', "/");
    paths
        .into_iter()
        .map(|path| (relative(path.clone()), std::fs::read_to_string(path).expect("text")))
        .collect()
}

fn check(rule: &str, offends: impl Fn(&str, &str) -> Vec<String>) {
    let offenders: Vec<String> = files().iter().flat_map(|(path, text)| offends(path, text)).collect();
    assert!(offenders.is_empty(), "{rule}:\n{}", offenders.join("\n"));
}

/// Returns the code of a formatted file without the items that `#[cfg(test)]` marks.
fn without_tests(text: &str) -> String {
    let mut code = String::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let Some(tail) = line.trim_start().strip_prefix("#[cfg(test)]") else {
            code += line;
            code.push('\n');
            continue;
        };
        let indent = &line[..line.len() - line.trim_start().len()];
        let is_attribute = |line: &str| line.trim().is_empty() || line.trim_start().starts_with('#');
        let mut item = tail;
        while is_attribute(item) {
            let Some(next) = lines.next() else { return code };
            item = next;
        }
        // An item of several lines ends at the bracket with the indentation of the attribute.
        let ends = ["}", "];", ");"].map(|end| format!("{indent}{end}"));
        if !item.ends_with([';', '}', ',']) {
            lines.by_ref().find(|line| ends.iter().any(|end| line.starts_with(end)));
        }
    }
    code
}

/// Returns the code of a file without its tests. `None` if the file does not belong to one of the checked libraries.
fn library_part(path: &str, text: &str) -> Option<String> {
    let library = [
        "src/",
        "crates/diagnostics/src/",
        "ontology/src/",
        "rules/src/",
        "crates/pddl/src/",
        "crates/mission/src/",
        "crates/certificate/src/",
        "crates/verify/src/",
        "encodings/src/",
        "crates/task/src/",
        "crates/search/src/",
        "crates/temporal/src/",
        "crates/planner/src/",
        "crates/probabilistic/src/",
        "crates/picture/src/",
    ]
    .iter()
    .any(|folder| path.starts_with(folder));
    let is_exempt = path.ends_with("/tests.rs") || path.starts_with("src/cli") || path == "src/main.rs";
    (library && !is_exempt).then(|| without_tests(text))
}

#[test]
fn only_items_for_tests_are_left_out() {
    let text = "a();\n#[cfg(test)]\nmod tests;\nb();\n    #[cfg(test)]\n    #[must_use]\n    fn c() {\n        d();\n    }\n\
                e();\n#[cfg(test)] mod f {\n    g();\n}\nh();\n#[cfg(test)]\nfn i() {}\nj();\n\
                #[cfg(test)]\nconst K: [u8; 1] = [\n    1,\n];\nl();\n#[cfg(test)]\nconst M: u8 = n(\n    1,\n);\no();\n";
    assert_eq!(without_tests(text), "a();\nb();\ne();\nh();\nj();\nl();\no();\n");
}

#[test]
fn files_have_a_head_comment() {
    check("a file opens with `//!`", |path, text| {
        if text.starts_with("//!") { Vec::new() } else { vec![path.to_owned()] }
    });
}

#[test]
fn files_and_functions_are_short() {
    check("a file has at most 800 lines, a function at most 100", |path, text| {
        let mut offenders = Vec::new();
        if text.lines().count() > FILE_LINES {
            offenders.push(format!("{path}: {} lines", text.lines().count()));
        }
        let lines: Vec<&str> = text.lines().collect();
        for (start, line) in lines.iter().enumerate() {
            let indent = line.len() - line.trim_start().len();
            let head = line.trim_start();
            let is_function = head.starts_with("fn ") || head.contains(" fn ") && head.starts_with("pub");
            if is_function {
                let end =
                    lines[start..].iter().position(|l| l.starts_with(&format!("{}}}", " ".repeat(indent))));
                let length = end.unwrap_or(0) + 1;
                if length > FUNCTION_LINES {
                    offenders.push(format!("{path}:{}: a function of {length} lines", start + 1));
                }
            }
        }
        offenders
    });
}

#[test]
fn libraries_do_not_print() {
    check("a library prints nothing", |path, text| {
        let code = library_part(path, text).unwrap_or_default();
        let prints = ["println!", "eprintln!", "print!(", "dbg!("];
        let is_code = |line: &&str| !line.trim_start().starts_with("//");
        let is_used = |print: &&&str| code.lines().filter(is_code).any(|line| line.contains(**print));
        prints.iter().filter(is_used).map(|print| format!("{path}: {print}")).collect()
    });
}

#[test]
fn panics_state_an_invariant() {
    check("`unwrap` is not used, `expect` states an invariant, in library code", |path, text| {
        let library_code = library_part(path, text).unwrap_or_default();
        let is_violation = |line: &&str| {
            let is_code = !line.trim_start().starts_with("//");
            is_code
                && (line.contains(".unwrap()")
                    || line.contains(".expect(\"") && !line.contains(".expect(\"invariant: "))
        };
        library_code.lines().filter(is_violation).map(|line| format!("{path}: {}", line.trim())).collect()
    });
}

#[test]
fn folders_do_not_use_forbidden_names() {
    check("a room does not name what its invariant excludes", |path, text| {
        let mut offenders = Vec::new();
        for (folder, names) in FORBIDDEN.iter().filter(|(folder, _)| path.starts_with(folder)) {
            let code = text
                .lines()
                .filter(|line| !line.trim_start().starts_with("//"))
                .collect::<Vec<_>>()
                .join("\n");
            for name in names.iter().filter(|name| code.contains(**name)) {
                offenders.push(format!("{path}: {name} in {folder}"));
            }
        }
        for (name, permitted_path) in
            SINGLE_FILE.iter().filter(|(_, permitted_path)| !path.starts_with(permitted_path))
        {
            if library_part(path, text).is_some_and(|code| code.contains(name)) {
                offenders.push(format!("{path}: only {permitted_path} names {name}"));
            }
        }
        offenders
    });
}

/// A test that lacks a resource must not count as passed silently.
#[test]
fn tests_request_resources_from_their_crate() {
    check("only crates/test-resources finds test data and reports missing resources", |path, text| {
        // The texts are split so that this file does not contain them.
        let texts = [concat!("\"skip", "ped: "), concat!("../", "shared")];
        let is_own = path.starts_with("crates/test-resources/");
        let offends = |part: &&&str| !is_own && text.contains(**part);
        texts.iter().filter(offends).map(|part| format!("{path}: {part}")).collect()
    });
}

#[test]
fn no_marks_of_unfinished_work() {
    check("nothing is left for later", |path, text| {
        // The marks are split so that this file does not contain them.
        let marks =
            [concat!("TO", "DO"), concat!("FIX", "ME"), concat!("unimplemented", "!"), concat!("to", "do!(")];
        marks.iter().filter(|mark| text.contains(**mark)).map(|mark| format!("{path}: {mark}")).collect()
    });
}
