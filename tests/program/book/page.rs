//! The fenced blocks of a page, with what the comment before each says of it.

use pulldown_cmark::{CodeBlockKind, Event, Options, Parser, Tag, TagEnd};

/// What is done with a block.
#[derive(Debug, PartialEq, Eq)]
pub enum Kind {
    Console,
    File(String),
    Rust,
    Text,
    NotRun(String),
    Unknown(String),
}

#[derive(Debug)]
pub struct Block {
    /// Where the block begins, from 1.
    pub line: usize,
    pub kind: Kind,
    pub text: String,
}

pub fn blocks(page: &str) -> Vec<Block> {
    let mut found: Vec<Block> = Vec::new();
    let (mut comment, mut inside) = (String::new(), false);
    for (event, range) in Parser::new_ext(page, Options::ENABLE_TABLES).into_offset_iter() {
        match event {
            Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(fence))) => {
                let line = page[..range.start].matches('\n').count() + 1;
                found.push(Block { line, kind: kind(&fence, &comment), text: String::new() });
                inside = true;
            }
            Event::End(TagEnd::CodeBlock) => {
                inside = false;
                comment.clear();
            }
            Event::Text(text) if inside => found.last_mut().expect("a block has begun").text += &text,
            Event::Html(text) => comment += &text,
            Event::End(TagEnd::HtmlBlock) => {}
            _ => comment.clear(),
        }
    }
    found
}

fn kind(fence: &str, comment: &str) -> Kind {
    let mark = |name: &str| {
        let rest = comment.trim().strip_prefix("<!--")?.trim_start().strip_prefix(name)?;
        Some(rest.trim().trim_end_matches("-->").trim().to_owned())
    };
    if let Some(file) = mark("file:") {
        return Kind::File(file);
    }
    if let Some(reason) = mark("not run:").or_else(|| mark("test command:")) {
        return Kind::NotRun(reason);
    }
    match fence {
        "console" => Kind::Console,
        "rust" => Kind::Rust,
        "text" => Kind::Text,
        other => Kind::Unknown(other.to_owned()),
    }
}
