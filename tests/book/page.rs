//! Fenced blocks of a page, with the instructions in the comment before each block.

use pulldown_cmark::{CodeBlockKind, Event, Options, Parser, Tag, TagEnd};
use test_resources::{Resource, data_path, in_path};

#[derive(Debug, PartialEq, Eq)]
pub enum Kind {
    Console,
    Script,
    File(String),
    Rust,
    Text,
    NotRun,
    Unknown(String),
}

#[derive(Debug)]
pub struct Block {
    /// Line of the opening fence, from 1.
    pub line: usize,
    pub kind: Kind,
    pub text: String,
    /// Programs and fixtures that the block needs; without them the block is not run.
    pub needs: Vec<String>,
    /// Seconds for which the standard input of the last command stays open.
    pub input_ends_after: Option<u32>,
}

impl Block {
    pub fn has_commands(&self) -> bool {
        matches!(self.kind, Kind::Console | Kind::Script)
    }

    pub fn is_run(&self) -> bool {
        self.has_commands() && self.missing().next().is_none()
    }

    pub fn missing(&self) -> impl Iterator<Item = String> {
        self.needs.iter().filter(|name| !is_available(name)).cloned()
    }
}

/// Files that readers of a page have but this project must not ship. They are copied into the session's
/// directory.
pub struct Fixture {
    pub name: &'static str,
    /// Pairs of the source path below the directory of test data and the target path in the session's
    /// directory.
    pub files: [(&'static str, &'static str); 4],
}

pub const FIXTURES: [Fixture; 1] = [Fixture {
    name: "PLANTA's files",
    files: [
        ("real/pddl/suave_planta/suave_domain_extended.pddl", "suave_domain_extended.pddl"),
        ("real/pddl/suave_planta/suave_problem_extended.pddl", "suave_problem_extended.pddl"),
        ("real/owl/suave_planta/suave_extended.owl", "suave_extended.owl"),
        ("real/owl/pddl_tomasys", "pddl_tomasys"),
    ],
}];

fn is_available(name: &str) -> bool {
    match FIXTURES.iter().find(|fixture| fixture.name == name) {
        Some(fixture) => fixture.files.iter().all(|(source, _)| data_path(source).exists()),
        None => in_path(&[name]).is_some(),
    }
}

pub fn resource(name: &str) -> Resource {
    if FIXTURES.iter().any(|fixture| fixture.name == name) {
        return Resource::PublicData;
    }
    let resource = if name == "python3" { Some(Resource::Python) } else { Resource::named(name) };
    resource.unwrap_or_else(|| panic!("`needs: {name}`: no resource of crates/test-resources has this name"))
}

pub fn blocks(page: &str) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let (mut comment, mut is_inside) = (String::new(), false);
    for (event, range) in Parser::new_ext(page, Options::ENABLE_TABLES).into_offset_iter() {
        match event {
            Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(fence))) => {
                let line = page[..range.start].matches('\n').count() + 1;
                blocks.push(block(line, &fence, &comment));
                is_inside = true;
            }
            Event::End(TagEnd::CodeBlock) => {
                is_inside = false;
                comment.clear();
            }
            Event::Text(text) if is_inside => blocks.last_mut().expect("a block has begun").text += &text,
            Event::Html(text) => comment += &text,
            Event::End(TagEnd::HtmlBlock) => {}
            _ => comment.clear(),
        }
    }
    blocks
}

fn block(line: usize, fence: &str, comment: &str) -> Block {
    let mark = |name: &str| {
        let argument = comment.trim().strip_prefix("<!--")?.trim_start().strip_prefix(name)?;
        Some(argument.trim().trim_end_matches("-->").trim().to_owned())
    };
    let kind = if let Some(file) = mark("file:") {
        Kind::File(file)
    } else if mark("not run:").is_some() {
        Kind::NotRun
    } else {
        match fence {
            "console" => Kind::Console,
            "sh" => Kind::Script,
            "rust" => Kind::Rust,
            "text" => Kind::Text,
            unknown => Kind::Unknown(unknown.to_owned()),
        }
    };
    let names = mark("needs:").unwrap_or_default();
    let needs = names.split(',').map(|name| name.trim().to_owned()).filter(|name| !name.is_empty()).collect();
    let input_ends_after = mark("input ends after:").map(|seconds| seconds.parse().expect("seconds"));
    Block { line, kind, text: String::new(), needs, input_ends_after }
}
