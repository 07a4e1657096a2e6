//! README and the book: each `console` block is run and its answer compared, and each listing of a file is compared with that file.
//!
//! What a block is stands in its fence, and in a comment right before it:
//!
//! | block | is |
//! |---|---|
//! | `console` | a session of a shell: `$ ` begins a command, `> ` goes on with it, the rest is what it answers, standard error among it. `[..]` stands for anything within a line, `...` for any lines. A status other than 0 must be shown by `$ echo $?`. All blocks of a page share a directory with copies of [`console::FILES`] |
//! | any, after `<!-- file: PATH -->` | a part of that file, line by line |
//! | `rust` | a doctest, see `src/lib.rs` |
//! | `text` | what a program has said elsewhere, or a drawing |
//! | any, after `<!-- not run: REASON -->` | not run |
//!
//! With `METAPLAN_BLESS=1` in the environment the pages get the answers that differ; what is elided stays elided where it still fits.

#![allow(clippy::print_stdout)] // what is skipped says so

mod console;
mod formats;
mod generated;
mod help;
mod page;

use std::path::PathBuf;

use crate::common::root;
use console::Session;
use page::{Block, Kind};

/// README, the book, and the pages of other packages whose programs are built with these tests.
fn pages() -> Vec<String> {
    let mut found = vec!["README.md".to_owned(), "verify/README.md".to_owned()];
    let mut folders = vec![PathBuf::from("docs")];
    while let Some(folder) = folders.pop() {
        for entry in
            std::fs::read_dir(root().join(&folder)).expect("a folder").map(|entry| entry.expect("an entry"))
        {
            let path = folder.join(entry.file_name());
            if entry.path().is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                found.push(path.display().to_string().replace('\\', "/"));
            }
        }
    }
    found.sort();
    found
}

/// The text of each page with its blocks.
fn pages_with_blocks() -> Vec<(String, String, Vec<Block>)> {
    let read = |page: String| {
        let text = std::fs::read_to_string(root().join(&page)).expect("a page");
        let blocks = page::blocks(&text);
        (page, text, blocks)
    };
    pages().into_iter().map(read).collect()
}

#[test]
fn every_session_is_as_shown() {
    if !Session::can_be_held() {
        println!("skipped: there is no shell `sh` of a Unix");
        return;
    }
    let mut wrong = Vec::new();
    let mut sessions = 0;
    for (page, text, blocks) in pages_with_blocks() {
        let shown: Vec<&Block> = blocks.iter().filter(|block| block.kind == Kind::Console).collect();
        if shown.is_empty() {
            continue;
        }
        let mut session = Session::new();
        let mut blessed = text.clone();
        for block in &shown {
            let (answer, faults) = session.hold(&block.text);
            sessions += 1;
            wrong.extend(faults.into_iter().map(|fault| format!("{page}:{}: {fault}", block.line)));
            if answer != block.text {
                blessed = blessed.replacen(&block.text, &answer, 1);
            }
        }
        if std::env::var_os("METAPLAN_BLESS").is_some() && blessed != text {
            std::fs::write(root().join(&page), blessed).expect("the page is written");
        }
    }
    assert!(sessions > 20, "only {sessions} sessions were found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_listing_is_a_part_of_its_file() {
    let mut wrong = Vec::new();
    for (page, _, blocks) in pages_with_blocks() {
        for block in blocks {
            let Kind::File(file) = &block.kind else { continue };
            let whole = std::fs::read_to_string(root().join(file)).unwrap_or_default();
            if !(format!("\n{whole}")).contains(&format!("\n{}", block.text)) {
                wrong.push(format!("{page}:{}: this is not part of {file}", block.line));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_block_is_of_a_kind_that_is_checked() {
    let included = |page: &str| {
        let (library, page) = match page.strip_prefix("verify/") {
            Some(page) => ("verify/src/lib.rs", page),
            None => ("src/lib.rs", page),
        };
        let library = std::fs::read_to_string(root().join(library)).expect("a library");
        library.contains(&format!("include_str!(\"../{page}\")"))
    };
    let mut wrong = Vec::new();
    for (page, _, blocks) in pages_with_blocks() {
        for block in blocks {
            match &block.kind {
                Kind::Console | Kind::File(_) | Kind::Text => {}
                Kind::NotRun(reason) => println!("skipped: {page}:{}: {reason}", block.line),
                Kind::Rust if included(&page) => {}
                Kind::Rust => wrong.push(format!(
                    "{page}:{}: the library does not include the page as a doctest",
                    block.line
                )),
                Kind::Unknown(fence) => wrong
                    .push(format!("{page}:{}: `{fence}` is neither run nor a part of a file", block.line)),
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
