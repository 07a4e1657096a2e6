//! A picture, as a part of a page or as a file of its own.

use maud::{Markup, PreEscaped, html};

use crate::scale::px;

/// The style of pictures on white paper; pages add that for dark screens.
const STYLE: &str = include_str!("picture.css");

/// What is drawn, in pixels.
pub(crate) struct Picture {
    pub(crate) width: f64,
    pub(crate) height: f64,
    /// What it shows, in a few words.
    pub(crate) title: String,
    /// How it is to be read.
    pub(crate) description: String,
    pub(crate) body: Markup,
}

impl Picture {
    /// The picture in a page; `name` tells it from all others there, and `classes` say in which columns it is shown.
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

    /// The picture as a file: texts are texts, and there is no script.
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

/// Text without the characters that XML does not have.
pub(crate) fn clean(text: &str) -> String {
    let allowed = |character: char| {
        matches!(character, '\n' | '\t' | '\r')
            || !character.is_control() && !matches!(character, '\u{fffe}' | '\u{ffff}')
    };
    text.chars().map(|character| if allowed(character) { character } else { '\u{fffd}' }).collect()
}

/// What was there before, behind what is there now.
pub(crate) fn alternative(before: &str) -> String {
    if before.is_empty() { " (changed)".to_owned() } else { format!(" (changed, before: {before})") }
}
