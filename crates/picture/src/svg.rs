//! SVG pictures, either as a part of a page or as a file.

use maud::{Markup, PreEscaped, html};

use crate::scale::px;

/// The style sheet for a white background. Pages contain additional styles for dark mode.
const STYLE: &str = include_str!("picture.css");

pub(crate) struct Picture {
    pub(crate) width: f64,
    pub(crate) height: f64,
    pub(crate) title: String,
    pub(crate) description: String,
    pub(crate) body: Markup,
}

impl Picture {
    /// Renders the picture for a page. `name` must be unique on the page; `classes` are CSS classes
    /// for the columns in which the picture is shown.
    pub(crate) fn inline(&self, name: &str, classes: &str) -> Markup {
        let (title, description) = (format!("{name}-title"), format!("{name}-description"));
        html! {
            svg class={ "picture " (classes) } role="img" aria-labelledby={ (title) " " (description) }
                width=(px(self.width)) height=(px(self.height)) viewBox={ "0 0 " (px(self.width)) " " (px(self.height)) } {
                title id=(title) { (self.title) }
                desc id=(description) { (self.description) }
                (self.body)
            }
        }
    }

    pub(crate) fn file(&self) -> String {
        let picture = html! {
            svg xmlns="http://www.w3.org/2000/svg" class="picture" role="img"
                width=(px(self.width)) height=(px(self.height)) viewBox={ "0 0 " (px(self.width)) " " (px(self.height)) } {
                title { (self.title) }
                desc { (self.description) }
                style { (PreEscaped(STYLE)) }
                rect class="paper" width="100%" height="100%" {}
                (self.body)
            }
        };
        clean(&format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{}\n", picture.into_string()))
    }
}

/// Replaces U+FFFE, U+FFFF, and control characters except tabs and line breaks by U+FFFD. XML
/// forbids many of them.
pub(crate) fn clean(text: &str) -> String {
    let allowed = |character: char| {
        matches!(character, '\n' | '\t' | '\r')
            || !character.is_control() && !matches!(character, '\u{fffe}' | '\u{ffff}')
    };
    text.chars().map(|character| if allowed(character) { character } else { '\u{fffd}' }).collect()
}

/// Formats a note that a design has changed, such as ` (changed, before: d1)`. `before` is empty if
/// the previous design is unknown.
pub(crate) fn alternative(before: &str) -> String {
    if before.is_empty() { " (changed)".to_owned() } else { format!(" (changed, before: {before})") }
}
