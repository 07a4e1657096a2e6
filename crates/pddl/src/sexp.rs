//! Reads text into a tree of S-expressions, with recovery from unbalanced parentheses.
//!
//! The tree is one flat vector in the order of the text. A list is followed by its items and stores
//! the index after its last item. Reading is iterative, and no destructor recurses, so no text can
//! overflow the stack.

use super::ast::Span;
use super::diagnostic::Sink;
use crate::number::dense;

/// Maximum nesting depth of lists. At this depth, recursion in later stages fits into a stack of 2 MB even in
/// a debug build. Real files stay below 30.
const DEPTH_LIMIT: usize = 200;

/// Keywords of sections. A list inside a section that begins with such a keyword shows that the section was
/// not closed.
pub(super) const SECTIONS: [&str; 20] = [
    ":requirements",
    ":types",
    ":constants",
    ":predicates",
    ":functions",
    ":derived",
    ":action",
    ":durative-action",
    ":domain",
    ":objects",
    ":init",
    ":goal",
    ":metric",
    ":constraints",
    ":process",
    ":event",
    ":axiom",
    ":task",
    ":method",
    ":length",
];

#[derive(Debug, Clone, Copy)]
struct Node {
    span: Span,
    /// Index of the first node after this node and all nodes inside it.
    next: u32,
    is_list: bool,
}

#[derive(Debug)]
pub(super) struct Tree<'s> {
    text: &'s str,
    nodes: Vec<Node>,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Item<'t> {
    tree: &'t Tree<'t>,
    index: u32,
}

impl<'t> Item<'t> {
    fn node(self) -> Node {
        self.tree.nodes[self.index as usize]
    }

    pub(super) fn span(self) -> Span {
        self.node().span
    }

    pub(super) fn is_list(self) -> bool {
        self.node().is_list
    }

    pub(super) fn symbol(self) -> Option<&'t str> {
        let Node { span, is_list, .. } = self.node();
        (!is_list).then(|| &self.tree.text[span.start as usize..span.end as usize])
    }

    #[expect(clippy::arithmetic_side_effects, reason = "an index in the list of nodes")]
    pub(super) fn items(self) -> Items<'t> {
        Items { tree: self.tree, next: self.index + 1, end: self.node().next }
    }

    pub(super) fn head(self) -> Option<&'t str> {
        self.items().next().and_then(Item::symbol)
    }

    pub(super) fn is_headed(self, keyword: &str) -> bool {
        self.head().is_some_and(|head| head.eq_ignore_ascii_case(keyword))
    }

    pub(super) fn rest(self) -> Items<'t> {
        let mut items = self.items();
        items.next();
        items
    }
}

#[derive(Debug, Clone)]
pub(super) struct Items<'t> {
    tree: &'t Tree<'t>,
    next: u32,
    end: u32,
}

impl<'t> Iterator for Items<'t> {
    type Item = Item<'t>;

    fn next(&mut self) -> Option<Item<'t>> {
        if self.next >= self.end {
            return None;
        }
        let item = Item { tree: self.tree, index: self.next };
        self.next = item.node().next;
        Some(item)
    }
}

impl<'s> Tree<'s> {
    pub(super) fn top(&'s self) -> Items<'s> {
        Items { tree: self, next: 0, end: dense(self.nodes.len()) }
    }
}

/// Reads a text. Returns `None`, with a reported error, if the text is too large or nested too deeply.
pub(super) fn read<'s>(text: &'s str, sink: &mut Sink<'_>) -> Option<Tree<'s>> {
    if u32::try_from(text.len()).is_err() {
        sink.error("P100", Span::default(), "the file is larger than 4 GB");
        return None;
    }
    let mut reader =
        // Real files have about one node per six bytes.
        Reader { nodes: Vec::with_capacity(text.len() / 6), open: Vec::new(), sink, last_close: 0 };
    let mut at = 0;
    while let Some((start, end)) = next_token(text, at) {
        let span = Span { start: dense(start), end: dense(end) };
        if start == at && text[..at].ends_with(in_a_word) && text[at..].starts_with('?') {
            reader.glued_variable(span, &text[start..end]);
        }
        match text.as_bytes()[start] {
            b'(' => reader.open(span)?,
            b')' => reader.close(span),
            _ => reader.symbol(span, &text[start..end]),
        }
        at = end;
    }
    reader.end(dense(text.len()));
    let nodes = reader.nodes;
    Some(Tree { text, nodes })
}

/// Returns the extent of the next parenthesis or symbol at or after byte `at`, and `None` at the end of the
/// text. Skips white space and comments.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "positions in a text in memory, which are at most its length"
)]
fn next_token(text: &str, mut at: usize) -> Option<(usize, usize)> {
    let bytes = text.as_bytes();
    loop {
        match *bytes.get(at)? {
            // A comment extends to the end of the line.
            b';' => at += bytes[at..].iter().position(|byte| matches!(byte, b'\n' | b'\r'))?,
            b' ' | b'\t' | b'\n' | b'\r' | 0x0b | 0x0c => at += 1,
            b'(' | b')' => return Some((at, at + 1)),
            byte if byte.is_ascii() => break,
            _ => match text[at..].chars().next() {
                Some(character) if is_space(character) => at += character.len_utf8(),
                _ => break,
            },
        }
    }
    let ends = |(place, character): &(usize, char)| {
        // As in other planners, a variable begins at its question mark, even without a preceding space.
        !in_a_word(*character)
            || (*character == '?' && *place > 0 && text[at + place + 1..].starts_with(in_a_word))
    };
    let length = text[at..].char_indices().find(ends).map_or(text.len() - at, |(length, _)| length);
    Some((at, at + length))
}

fn in_a_word(character: char) -> bool {
    !matches!(character, '(' | ')' | ';') && !is_space(character)
}

/// Returns `true` for Unicode white space and byte order marks. Text copied from documents contains no-break
/// spaces and byte order marks.
fn is_space(character: char) -> bool {
    character.is_whitespace() || character == '\u{feff}'
}

struct Reader<'r, 's> {
    nodes: Vec<Node>,
    open: Vec<u32>,
    sink: &'r mut Sink<'s>,
    /// Byte offset behind the last closing parenthesis.
    last_close: u32,
}

impl Reader<'_, '_> {
    fn open(&mut self, span: Span) -> Option<()> {
        if self.open.len() >= DEPTH_LIMIT {
            let message = format!("parentheses are nested more than {DEPTH_LIMIT} deep");
            self.sink.error("P103", span, message);
            return None;
        }
        self.open.push(dense(self.nodes.len()));
        self.nodes.push(Node { span, next: 0, is_list: true });
        Some(())
    }

    #[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
    fn symbol(&mut self, span: Span, text: &str) {
        // Different invalid bytes become the same character, so different names would become equal.
        if text.contains(char::REPLACEMENT_CHARACTER) {
            self.sink
                .error(
                    "P106",
                    span,
                    format!("`{text}` contains bytes that are not valid in the encoding of the file"),
                )
                .help("convert the file to UTF-8; other encodings are accepted only in comments");
        }
        // A section keyword is the first item of a list directly below `(define`. At any other depth, a
        // parenthesis is superfluous or missing before the keyword.
        let is_first = self.open.last().is_some_and(|list| *list as usize + 1 == self.nodes.len());
        if is_first && text.starts_with(':') && SECTIONS.iter().any(|name| name.eq_ignore_ascii_case(text)) {
            match self.open.len() {
                1 => self.reopen_define(span, text),
                2 => {}
                _ => self.close_section_before(span, text),
            }
        }
        self.nodes.push(Node { span, next: dense(self.nodes.len()) + 1, is_list: false });
    }

    fn glued_variable(&mut self, span: Span, text: &str) {
        self.sink
            .warning("P116", span, format!("`{text}` is read as a word of its own"))
            .help("put a space before the question mark");
    }

    /// Handles a section keyword at top level: the preceding `(define …)` was closed too early and is
    /// reopened.
    #[expect(clippy::arithmetic_side_effects, reason = "the definition was closed before, by a parenthesis")]
    fn reopen_define(&mut self, span: Span, text: &str) {
        // Only the first item of the text can be reopened, and only if it is a list that precedes this
        // section.
        if self.open[0] == 0 || !self.nodes[0].is_list {
            return;
        }
        let extra = Span { start: self.last_close - 1, end: self.last_close };
        let source = self.sink.source();
        self.sink
            .error("P102", extra, "this `)` closes the whole definition, but sections follow")
            .related(source, span, format!("`{text}` stands outside"))
            .help("remove one `)` here or before");
        self.open.insert(0, 0);
    }

    /// Handles a section keyword inside another section: reports the unclosed parenthesis and ends the
    /// enclosing section before the keyword.
    fn close_section_before(&mut self, span: Span, text: &str) {
        let Some(list) = self.open.pop() else { return };
        let unclosed = self.nodes[self.open[1] as usize].span;
        let source = self.sink.source();
        self.sink
            .error("P101", unclosed, "this parenthesis is not closed before the next section begins")
            .related(source, span, format!("`{text}` begins here"))
            .help("add the missing `)` at the end of this section");
        let end = self.nodes[list as usize].span.start;
        for inner in self.open.drain(1..) {
            let node = &mut self.nodes[inner as usize];
            (node.next, node.span.end) = (list, end);
        }
        self.open.push(list);
    }

    fn close(&mut self, span: Span) {
        self.last_close = span.end;
        let Some(list) = self.open.pop() else {
            self.sink.error("P102", span, "this `)` closes nothing").help("remove it");
            return;
        };
        let next = dense(self.nodes.len());
        let node = &mut self.nodes[list as usize];
        (node.next, node.span.end) = (next, span.end);
    }

    #[expect(clippy::arithmetic_side_effects, reason = "a parenthesis is a byte of the text")]
    fn end(&mut self, end: u32) {
        if let Some(innermost) = self.open.last() {
            let span = Span {
                end: self.nodes[*innermost as usize].span.start + 1,
                ..self.nodes[*innermost as usize].span
            };
            let message = match self.open.len() {
                1 => "this parenthesis is never closed".to_owned(),
                count => format!("{count} parentheses are never closed, the last of them is this one"),
            };
            self.sink.error("P101", span, message).help("add the missing `)`");
        }
        let next = dense(self.nodes.len());
        for list in self.open.drain(..) {
            let node = &mut self.nodes[list as usize];
            (node.next, node.span.end) = (next, end);
        }
    }
}
