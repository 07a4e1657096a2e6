//! Pretty printer for nested lists. A list that fits is printed on one line; otherwise its first items stay on one
//! line, and each further item is on a separate line.

/// Maximum width of a list that is printed on one line, in characters, including the indentation.
const WIDTH: usize = 100;

#[derive(Debug)]
pub(super) struct Doc {
    /// Text before the opening parenthesis: the keyword of an action, or empty.
    keyword: String,
    content: Content,
    width: usize,
    is_broken: bool,
}

#[derive(Debug)]
enum Content {
    Text(String),
    /// Items, and the number of items that stay on the first line if the list is printed on several lines.
    List(Vec<Doc>, usize),
}

pub(super) fn text(text: impl Into<String>) -> Doc {
    let text = text.into();
    Doc {
        keyword: String::new(),
        width: text.chars().count(),
        content: Content::Text(text),
        is_broken: false,
    }
}

/// Creates the list `(head items…)`. If the list is printed on several lines, the first `first_line_items` of
/// head and items stay on the first line.
#[expect(clippy::arithmetic_side_effects, reason = "widths of what is written in memory")]
pub(super) fn list(head: &str, first_line_items: usize, items: impl IntoIterator<Item = Doc>) -> Doc {
    let items: Vec<_> = std::iter::once(text(head)).chain(items).collect();
    let width = items.iter().map(|item| item.width + 1).sum::<usize>() + 1;
    let is_broken = items.iter().any(|item| item.is_broken);
    Doc { keyword: String::new(), content: Content::List(items, first_line_items), width, is_broken }
}

impl Doc {
    /// Prints the list on several lines even if it fits: each item after the first line gets a separate line.
    /// Has no effect on a word, or if all items stay on the first line.
    pub(super) fn broken(mut self) -> Self {
        self.is_broken = match &self.content {
            Content::Text(_) => false,
            Content::List(items, first_line_items) => items.len() > *first_line_items,
        };
        self
    }

    #[expect(clippy::arithmetic_side_effects, reason = "widths of what is written in memory")]
    pub(super) fn after(mut self, keyword: &str) -> Self {
        keyword.clone_into(&mut self.keyword);
        self.width += keyword.len() + 1;
        self
    }

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
        let Content::List(items, first_line_items) = &self.content else { return self.write_inline(out) };
        if !self.is_broken && indent + self.width <= WIDTH {
            return self.write_inline(out);
        }
        if !self.keyword.is_empty() {
            out.push_str(&self.keyword);
            out.push(' ');
        }
        out.push('(');
        for (index, item) in items.iter().enumerate() {
            if index >= *first_line_items {
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

pub(super) fn layout(doc: &Doc) -> String {
    let mut out = String::new();
    doc.write(0, &mut out);
    out.push('\n');
    out
}
