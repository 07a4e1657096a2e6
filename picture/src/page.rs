//! The frame of all pages: one file that needs nothing else, asks nothing of a network, and says so to the browser.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::data::Reason;
use crate::svg::{Picture, clean};

/// The style of pages and of the pictures in them.
pub const STYLE: &str = concat!(include_str!("picture.css"), include_str!("page.css"));
/// The only script; a page is whole without it.
const SCRIPT: &str = include_str!("page.js");
/// Its digest: browsers run no other script in a page.
const DIGEST: &str = "sha256-yEykJWcSva2UhKwr0DwJEadJ93sDtyfamJ/HHfWhRYY=";

/// How deep derivations unfold.
const DEPTH: usize = 24;

/// A whole page.
pub(crate) fn page(title: &str, description: &str, body: &Markup) -> String {
    let policy =
        format!("default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src '{DIGEST}'");
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(policy);
                meta name="viewport" content="width=device-width, initial-scale=1";
                link rel="icon" href="data:,";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    h1 { (title) }
                    @if !description.is_empty() { p class="dim" { (description) } }
                    p class="controls" {
                        button id="unfold" type="button" { "Unfold all" } " "
                        button id="fold" type="button" { "Fold all" }
                    }
                }
                main { (body) }
                footer { p class="dim" { "Made by metaplan. This page is a single file: it loads nothing." } }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    clean(&page.into_string()) + "\n"
}

/// A picture that may be wider than the screen: it is scrolled by itself, also by keyboard.
pub(crate) fn shown(picture: &Picture, name: &str) -> Markup {
    html! {
        div class="scroll" tabindex="0" role="group" aria-label=(picture.title) { (picture.inline(name)) }
    }
}

/// A table that may be wider than the screen.
pub(crate) fn table(name: &str, header: &[&str], rows: &Markup) -> Markup {
    html! {
        div class="scroll" tabindex="0" role="group" aria-label=(name) {
            table {
                thead { tr { @for cell in header { th scope="col" { (cell) } } } }
                tbody { (rows) }
            }
        }
    }
}

/// Reasons, each with what it rests on.
pub(crate) fn reasons(reasons: &[Reason]) -> Markup {
    unfolding(reasons, 0)
}

fn unfolding(reasons: &[Reason], depth: usize) -> Markup {
    html! {
        ul {
            @for reason in reasons {
                li {
                    @if reason.supports.is_empty() {
                        (reason.text)
                    } @else if depth == DEPTH {
                        (reason.text) " …"
                    } @else {
                        details { summary { (reason.text) } (unfolding(&reason.supports, depth + 1)) }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use base64::Engine as _;
    use sha2::{Digest as _, Sha256};

    use super::{DIGEST, SCRIPT};

    #[test]
    fn browsers_are_told_which_script_is_ours() {
        let digest = base64::engine::general_purpose::STANDARD.encode(Sha256::digest(SCRIPT));
        assert_eq!(DIGEST, format!("sha256-{digest}"));
    }
}
