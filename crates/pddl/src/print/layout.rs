//! Nested lists to lines: a list that fits stands on one line, otherwise each of its items on its own.

/// The longest line that a list may fill.
const WIDTH: usize = 100;

/// A list or a word to print.
#[derive(Debug)]
pub(super) struct Doc {
    /// What stands before the first parenthesis, if anything: the keyword of an action.
    keyword: String,
    content: Content,
    width: usize,
    is_broken: bool,
}

#[derive(Debug)]
enum Content {
    Text(String),
    /// The items, and how many of them stay beside the parenthesis when the list is broken.
    List(Vec<Doc>, usize),
}

/// A word.
pub(super) fn text(text: impl Into<String>) -> Doc {
    let text = text.into();
    Doc {
        keyword: String::new(),
        width: text.chars().count(),
        content: Content::Text(text),
        is_broken: false,
    }
}

/// `(head items…)`; broken, the first `beside` of head and items stay on the first line.
#[expect(clippy::arithmetic_side_effects, reason = "widths of what is written in memory")]
pub(super) fn list(head: &str, beside: usize, items: impl IntoIterator<Item = Doc>) -> Doc {
    let items: Vec<_> = std::iter::once(text(head)).chain(items).collect();
    let width = items.iter().map(|item| item.width + 1).sum::<usize>() + 1;
    let is_broken = items.iter().any(|item| item.is_broken);
    Doc { keyword: String::new(), content: Content::List(items, beside), width, is_broken }
}

impl Doc {
    /// The same with each item on a line of its own.
    pub(super) fn broken(mut self) -> Self {
        self.is_broken = match &self.content {
            Content::Text(_) => false,
            Content::List(items, beside) => items.len() > *beside,
        };
        self
    }

    /// The same behind a keyword.
    #[expect(clippy::arithmetic_side_effects, reason = "widths of what is written in memory")]
    pub(super) fn after(mut self, keyword: &str) -> Self {
        keyword.clone_into(&mut self.keyword);
        self.width += keyword.len() + 1;
        self
    }

    /// The text without line breaks.
    pub(super) fn on_one_line(&self) -> String {
        let mut out = String::new();
        self.write_inline(&mut out);
        out
    }

    fn write_inline(&self, out: &mut String) {
        if !self.keyword.is_empty() {
            out.push_str(&self.keyword);
            out.push(' ');
        }
        match &self.content {
            Content::Text(text) => out.push_str(text),
            Content::List(items, _) => {
                out.push('(');
                for (index, item) in items.iter().enumerate() {
                    if index > 0 {
                        out.push(' ');
                    }
                    item.write_inline(out);
                }
                out.push(')');
            }
        }
    }

    #[expect(clippy::arithmetic_side_effects, reason = "widths of what is written in memory")]
    fn write(&self, indent: usize, out: &mut String) {
        let Content::List(items, beside) = &self.content else { return self.write_inline(out) };
        if !self.is_broken && indent + self.width <= WIDTH {
            return self.write_inline(out);
        }
        if !self.keyword.is_empty() {
            out.push_str(&self.keyword);
            out.push(' ');
        }
        out.push('(');
        for (index, item) in items.iter().enumerate() {
            if index >= *beside {
                out.push('\n');
                out.extend(std::iter::repeat_n(' ', indent + 2));
                item.write(indent + 2, out);
            } else {
                if index > 0 {
                    out.push(' ');
                }
                item.write_inline(out);
            }
        }
        out.push(')');
    }
}

/// The whole text, with a line end.
pub(super) fn layout(doc: &Doc) -> String {
    let mut out = String::new();
    doc.write(0, &mut out);
    out.push('\n');
    out
}
