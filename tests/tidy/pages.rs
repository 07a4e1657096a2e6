//! Tests of README, the book and other pages: links have targets, the book is complete, and README is short.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

const README_LINES: usize = 200;

const NO_PAGES: [&str; 3] = ["target", ".git", "node_modules"];

/// Returns the paths of the Markdown files, relative to the root, without those in folders of [`NO_PAGES`].
pub fn pages(root: &Path) -> Vec<PathBuf> {
    let mut paths = Vec::new();
    let mut folders = vec![PathBuf::new()];
    while let Some(folder) = folders.pop() {
        for entry in
            std::fs::read_dir(root.join(&folder)).expect("a folder").map(|entry| entry.expect("an entry"))
        {
            let path = folder.join(entry.file_name());
            let is_skipped = NO_PAGES.iter().any(|name| path.ends_with(name));
            if entry.path().is_dir() && !is_skipped {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                paths.push(path);
            }
        }
    }
    paths.sort();
    paths
}

fn read(root: &Path, page: &Path) -> String {
    let text = std::fs::read_to_string(root.join(page)).expect("a page");
    let mut expanded = String::new();
    for line in text.lines() {
        match line.strip_prefix("{{#include ").and_then(|path| path.strip_suffix("}}")) {
            Some(included) => expanded += &read(root, &within(page, included).expect("below the root")),
            None => expanded += line,
        }
        expanded.push('\n');
    }
    expanded
}

/// Returns the target of a link, relative to the root; `None` if it is outside the project.
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

/// Returns the anchors of the headings, in the form of mdBook and of Git forges, and the targets of the
/// links.
fn anchors_and_links(text: &str) -> (BTreeSet<String>, Vec<String>) {
    let (mut anchors, mut links) = (BTreeSet::new(), Vec::new());
    let (mut heading, mut used) = (None, BTreeMap::<String, usize>::new());
    for event in Parser::new_ext(text, Options::ENABLE_TABLES) {
        match event {
            Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
            Event::End(TagEnd::Heading(_)) => {
                let anchor = anchor(&heading.take().expect("a heading has begun"));
                let occurrences = used.entry(anchor.clone()).or_default();
                anchors.insert(if *occurrences == 0 { anchor } else { format!("{anchor}-{occurrences}") });
                *occurrences += 1;
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
    let is_kept = |c: &char| c.is_alphanumeric() || c.is_whitespace() || matches!(c, '-' | '_');
    let kept = heading.trim().chars().filter(is_kept);
    kept.map(|c| if c.is_whitespace() { '-' } else { c }).flat_map(char::to_lowercase).collect()
}

#[test]
fn links_have_targets() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let pages = pages(root);
    let links_by_page: BTreeMap<&Path, (BTreeSet<String>, Vec<String>)> =
        pages.iter().map(|page| (page.as_path(), anchors_and_links(&read(root, page)))).collect();
    let mut failures = Vec::new();
    let mut link_count = 0;
    for (page, (_, links)) in &links_by_page {
        for link in links.iter().filter(|link| !link.contains("://") && !link.starts_with("mailto:")) {
            link_count += 1;
            let (path, fragment) = link.split_once('#').unwrap_or((link, ""));
            let target = if path.is_empty() { Some((*page).to_owned()) } else { within(page, path) };
            let Some(target) = target.filter(|target| root.join(target).exists()) else {
                failures.push(format!("{}: {link} leads nowhere", page.display()));
                continue;
            };
            if page.starts_with("docs") && !target.starts_with("docs") {
                failures.push(format!("{}: {link} leads out of the book", page.display()));
            }
            let anchors = links_by_page.get(target.as_path()).map(|(anchors, _)| anchors);
            if !fragment.is_empty() && !anchors.is_some_and(|anchors| anchors.contains(fragment)) {
                failures.push(format!("{}: {link}: there is no such heading", page.display()));
            }
        }
    }
    // Guards against a parser that finds no links, because the test would then always pass.
    assert!(link_count > 100, "only {link_count} links were found");
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn summary_lists_every_page_once() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let summary = Path::new("docs/SUMMARY.md");
    let listed = anchors_and_links(&read(root, summary)).1;
    let duplicates: Vec<_> =
        (1..listed.len()).filter(|&at| listed[..at].contains(&listed[at])).map(|at| &listed[at]).collect();
    assert!(
        duplicates.is_empty(),
        "docs/SUMMARY.md has these twice, and mdBook refuses that: {duplicates:?}"
    );
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
