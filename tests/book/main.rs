//! Tests of the README and the book: the blocks of each page are run as a reader would run them, or compared
//! with the file that they show.
//!
//! Each page is one test. It runs in a shell in a fresh copy of the project, with `metaplan` and
//! `metaplan-verify` in the path. By default these are the programs that cargo builds for the tests. With
//! `METAPLAN_PROGRAMS=DIR`, `metaplan` is the program in that directory, where `cargo install` has put it, as
//! in `.ci/newcomer`.
//!
//! The fence of a block, and the comment before the block, determine the check:
//!
//! | block | check |
//! |---|---|
//! | `console` | A session: lines `$ COMMAND`, each with its output, including standard error. `[..]` matches any text within a line, and a line `...` matches any lines. A status other than 0 must be shown by `$ echo $?`. |
//! | `sh` | A script, which must succeed. Its output is not shown. For commands of several lines, so that they can be pasted. |
//! | `rust` | A doctest, see `src/lib.rs`. |
//! | `text` | None: output of earlier commands, or a drawing. |
//! | any, after `<!-- file: PATH -->` | The block must be a part of that file, line by line. |
//! | `console`, `sh`, after `<!-- needs: NAME, … -->` | As above, if each name is a program in the path or an available [`page::Fixture`]. Otherwise the page lacks a resource of `crates/test-resources`; with `METAPLAN_REQUIRE` this is an error. |
//! | `console`, after `<!-- input ends after: SECONDS -->` | As above; the standard input of the last command stays open for this time. |
//! | any, after `<!-- not run: REASON -->` | None. The reason names the CI stage or the test that runs the block, if any. |
//!
//! `METAPLAN_BLESS=1` writes differing output into the pages. Elided parts remain elided if they still match.

mod formats;
mod generated;
mod help;
mod page;
mod session;

#[path = "../program/common.rs"]
#[allow(dead_code, reason = "the other tests of programs use the rest")]
mod common;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use libtest_mimic::{Arguments, Failed, Trial};
use test_resources::{Resource, missing_in};

use common::root;
use page::{Block, Kind};
use session::Session;

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let mut trials = generated::trials();
    let pages: Vec<Page> = pages().into_iter().map(Page::read).collect();
    trials.push(Trial::test("pages with commands", {
        // Guards against a parser that finds no blocks, because all tests would then pass.
        let count = pages.iter().filter(|page| page.has_commands()).count();
        move || {
            if count > 20 { Ok(()) } else { Err(Failed::from(format!("only {count} pages have commands"))) }
        }
    }));
    let in_order =
        Trial::test("all pages in one clone", pages_in_one_clone).with_kind("in the order of SUMMARY.md");
    trials.push(in_order.with_ignored_flag(true));
    trials.extend(pages.into_iter().map(Page::trial));
    libtest_mimic::run(&arguments, trials).exit_code()
}

fn pages() -> Vec<String> {
    let mut pages = vec!["README.md".to_owned(), "crates/verify/README.md".to_owned()];
    let mut folders = vec![PathBuf::from("docs")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(root().join(&folder)).expect("a folder") {
            let entry = entry.expect("an entry");
            let path = folder.join(entry.file_name());
            if entry.path().is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                pages.push(path.display().to_string().replace('\\', "/"));
            }
        }
    }
    pages.sort();
    pages
}

/// Runs the listed pages in order in one copy of the project, as a reader of the whole book would.
fn pages_in_one_clone() -> Result<(), Failed> {
    let summary = std::fs::read_to_string(root().join("docs/SUMMARY.md")).expect("the summary");
    let links = summary.lines().filter_map(|line| line.split_once("](")?.1.split_once(')'));
    let session = Session::new();
    let mut faults = Vec::new();
    for (link, _) in links {
        let page = Page::read(format!("docs/{link}"));
        let blocks: Vec<&Block> = page.blocks.iter().filter(|block| block.is_run()).collect();
        if !blocks.is_empty() {
            faults.extend(page.run(&session, &blocks));
        }
    }
    if faults.is_empty() { Ok(()) } else { Err(Failed::from(faults.join("\n"))) }
}

fn is_blessing() -> bool {
    std::env::var_os("METAPLAN_BLESS").is_some()
}

struct Page {
    /// Path from the root of the project, with `/`.
    path: String,
    text: String,
    blocks: Vec<Block>,
}

impl Page {
    fn read(path: String) -> Self {
        let text = std::fs::read_to_string(root().join(&path)).expect("a page");
        let blocks = page::blocks(&text);
        Self { path, text, blocks }
    }

    fn has_commands(&self) -> bool {
        self.blocks.iter().any(Block::has_commands)
    }

    /// Creates the test of a page. Its kind, which the runner prints, lists missing programs and fixtures.
    fn trial(self) -> Trial {
        let mut missing: Vec<String> = self.blocks.iter().flat_map(Block::missing).collect();
        missing.sort();
        missing.dedup();
        let kind = if missing.is_empty() { String::new() } else { format!("without {}", missing.join(", ")) };
        Trial::test(self.path.clone(), move || self.check()).with_kind(kind)
    }

    fn check(&self) -> Result<(), Failed> {
        let mut faults: Vec<String> = Vec::new();
        for block in &self.blocks {
            let missing: Vec<String> = block.missing().collect();
            let fault = match &block.kind {
                Kind::Console | Kind::Script if !missing.is_empty() => {
                    // Fails if the resource is required.
                    for name in &missing {
                        self.lacks(page::resource(name), name);
                    }
                    continue;
                }
                Kind::File(file) if !is_part_of(&block.text, file) => format!("this is not a part of {file}"),
                Kind::Rust if !self.is_doctest() => {
                    "the library does not include the page as a doctest".to_owned()
                }
                Kind::Unknown(fence) => format!("`{fence}` is neither run nor a part of a file"),
                _ => continue,
            };
            faults.push(format!("{}:{}: {fault}", self.path, block.line));
        }
        let blocks: Vec<&Block> = self.blocks.iter().filter(|block| block.is_run()).collect();
        if !blocks.is_empty() {
            if Session::is_possible() {
                faults.extend(self.run(&Session::new(), &blocks));
            } else {
                self.lacks(Resource::Shell, "sh");
            }
        }
        if faults.is_empty() { Ok(()) } else { Err(Failed::from(faults.join("\n"))) }
    }

    fn lacks(&self, resource: Resource, name: &str) {
        missing_in(&self.path, resource, &format!("blocks that need {name} are not run"));
    }

    /// Runs blocks in order in one session. Returns the differences between their output and the page. If
    /// pages are to be rewritten (`METAPLAN_BLESS`), writes the actual output into the page.
    fn run(&self, session: &Session, blocks: &[&Block]) -> Vec<String> {
        let mut blessed = self.text.clone();
        let mut faults = Vec::new();
        for (block, outcome) in blocks.iter().zip(session.run(blocks)) {
            faults.extend(
                outcome.faults.into_iter().map(|fault| format!("{}:{}: {fault}", self.path, block.line)),
            );
            if outcome.text != block.text {
                blessed = blessed.replacen(&block.text, &outcome.text, 1);
            }
        }
        if is_blessing() && blessed != self.text {
            std::fs::write(root().join(&self.path), blessed).expect("the page is written");
        }
        faults
    }

    /// Returns `true` if the documentation of a library includes this page, so that cargo runs its Rust
    /// blocks.
    fn is_doctest(&self) -> bool {
        let (library, page) = match self.path.strip_prefix("crates/verify/") {
            Some(page) => ("crates/verify/src/lib.rs", page),
            None => ("src/lib.rs", self.path.as_str()),
        };
        let library = std::fs::read_to_string(root().join(library)).expect("a library");
        library.contains(&format!("include_str!(\"../{page}\")"))
    }
}

fn is_part_of(lines: &str, file: &str) -> bool {
    let file_text = std::fs::read_to_string(root().join(Path::new(file))).unwrap_or_default();
    format!("\n{file_text}").contains(&format!("\n{lines}"))
}
