//! README, the book and the other pages: links lead somewhere, the book is whole, and README is short.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

/// README is a page; the book has the rest.
const README_LINES: usize = 200;

/// Folders that hold no page of ours.
const NO_PAGES: [&str; 3] = ["target", ".git", "node_modules"];

/// All Markdown files below the root, relative to it.
pub fn pages(root: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![PathBuf::new()];
    while let Some(folder) = folders.pop() {
        for entry in
            std::fs::read_dir(root.join(&folder)).expect("a folder").map(|entry| entry.expect("an entry"))
        {
            let path = folder.join(entry.file_name());
            let skipped = NO_PAGES.iter().any(|name| path.ends_with(name));
            if entry.path().is_dir() && !skipped {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// A page with what it includes.
fn read(root: &Path, page: &Path) -> String {
    let text = std::fs::read_to_string(root.join(page)).expect("a page");
    let mut whole = String::new();
    for line in text.lines() {
        match line.strip_prefix("{{#include ").and_then(|rest| rest.strip_suffix("}}")) {
            Some(included) => whole += &read(root, &within(page, included).expect("below the root")),
            None => whole += line,
        }
        whole.push('\n');
    }
    whole
}

/// A path as a page names it, relative to the root; nothing if it leads out of the project.
fn within(page: &Path, target: &str) -> Option<PathBuf> {
    let mut path = page.parent().unwrap_or(Path::new("")).to_owned();
    for part in Path::new(target).components() {
        match part {
            Component::ParentDir => path.pop().then_some(())?,
            Component::CurDir => {}
            part => path.push(part),
        }
    }
    Some(path)
}

/// The anchors of a page, as mdBook and forges make them of headings, and where its links lead.
fn anchors_and_links(text: &str) -> (BTreeSet<String>, Vec<String>) {
    let (mut anchors, mut links) = (BTreeSet::new(), Vec::new());
    let (mut heading, mut used) = (None, BTreeMap::<String, usize>::new());
    for event in Parser::new_ext(text, Options::ENABLE_TABLES) {
        match event {
            Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
            Event::End(TagEnd::Heading(_)) => {
                let anchor = anchor(&heading.take().expect("a heading has begun"));
                let before = used.entry(anchor.clone()).or_default();
                anchors.insert(if *before == 0 { anchor } else { format!("{anchor}-{before}") });
                *before += 1;
            }
            Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                links.push(dest_url.into_string());
            }
            Event::Text(text) | Event::Code(text) => heading.iter_mut().for_each(|heading| *heading += &text),
            _ => {}
        }
    }
    (anchors, links)
}

fn anchor(heading: &str) -> String {
    let kept = |c: &char| c.is_alphanumeric() || c.is_whitespace() || matches!(c, '-' | '_');
    let kept = heading.trim().chars().filter(kept);
    kept.map(|c| if c.is_whitespace() { '-' } else { c }).flat_map(char::to_lowercase).collect()
}

#[test]
fn every_link_leads_somewhere() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let pages = pages(root);
    let known: BTreeMap<&Path, (BTreeSet<String>, Vec<String>)> =
        pages.iter().map(|page| (page.as_path(), anchors_and_links(&read(root, page)))).collect();
    let mut wrong = Vec::new();
    let mut seen = 0;
    for (page, (_, links)) in &known {
        for link in links.iter().filter(|link| !link.contains("://") && !link.starts_with("mailto:")) {
            seen += 1;
            let (path, fragment) = link.split_once('#').unwrap_or((link, ""));
            let target = if path.is_empty() { Some((*page).to_owned()) } else { within(page, path) };
            let Some(target) = target.filter(|target| root.join(target).exists()) else {
                wrong.push(format!("{}: {link} leads nowhere", page.display()));
                continue;
            };
            if page.starts_with("docs") && !target.starts_with("docs") {
                wrong.push(format!("{}: {link} leads out of the book", page.display()));
            }
            let anchors = known.get(target.as_path()).map(|(anchors, _)| anchors);
            if !fragment.is_empty() && !anchors.is_some_and(|anchors| anchors.contains(fragment)) {
                wrong.push(format!("{}: {link}: there is no such heading", page.display()));
            }
        }
    }
    assert!(seen > 100, "only {seen} links were found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_summary_has_every_page_of_the_book() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let summary = Path::new("docs/SUMMARY.md");
    let listed = anchors_and_links(&read(root, summary)).1;
    let twice: Vec<_> =
        (1..listed.len()).filter(|&at| listed[..at].contains(&listed[at])).map(|at| &listed[at]).collect();
    assert!(twice.is_empty(), "docs/SUMMARY.md has these twice, and mdBook refuses that: {twice:?}");
    let listed: BTreeSet<PathBuf> = listed.iter().filter_map(|link| within(summary, link)).collect();
    let book = pages(root).into_iter().filter(|page| page.starts_with("docs") && page != summary);
    let missing: Vec<_> = book.filter(|page| !listed.contains(page)).collect();
    assert!(missing.is_empty(), "docs/SUMMARY.md does not have {missing:?}");
}

#[test]
fn readme_is_short() {
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md");
    let lines = std::fs::read_to_string(readme).expect("a page").lines().count();
    assert!(
        lines <= README_LINES,
        "README.md has {lines} lines; the book is for all that is more than {README_LINES}"
    );
}
