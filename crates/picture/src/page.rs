//! The HTML frame of all pages: a self-contained file whose content security policy forbids network
//! access. Also renders the common elements of pages: pictures for several widths, tables, and
//! derivations.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::data::Reason;
use crate::frame::{Canvas, PAGE};
use crate::svg::{Picture, clean};

/// The style sheet of pages and of the pictures in them.
pub const STYLE: &str = concat!(include_str!("picture.css"), include_str!("page.css"));
/// The only script of a page. Without it, all contents are still visible.
const SCRIPT: &str = include_str!("page.js");
/// Digest of the only script that the content security policy admits.
const DIGEST: &str = "sha256-fZ3YNffJKRqSukU6Y8OoyeJ/9kokzwiOieJxn4wpNoc=";

/// The CSS classes of the columns in which pictures are shown, in the order of [`PAGE`].
const COLUMNS: [&str; 3] = ["in-wide", "in-half", "in-narrow"];

/// Maximum depth of rendered derivations. Deeper premises are replaced by an ellipsis.
const DEPTH: usize = 24;

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
                        button id="unfold" type="button" { "Expand all" } " "
                        button id="fold" type="button" { "Collapse all" }
                    }
                }
                main { (body) }
                footer { p class="dim" { "Created by metaplan. This page is a single file and loads nothing." } }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    clean(&page.into_string()) + "\n"
}

/// Renders a picture for several canvases, given in descending width. The page shows the widest
/// drawing that fits its column. A picture that exceeds its canvas gets a scroll bar and is not
/// drawn for narrower canvases.
pub(crate) fn shown(name: &str, canvases: &[Canvas], draw: &dyn Fn(Canvas) -> Picture) -> Markup {
    let mut drawn: Vec<(f64, Picture)> = Vec::new();
    for canvas in canvases {
        let picture = draw(*canvas);
        let is_long = picture.width > canvas.width;
        drawn.push((canvas.width, picture));
        if is_long {
            break;
        }
    }
    let fits = |column: f64| drawn.iter().position(|(width, _)| *width <= column);
    // For each column of a page, the index of the drawing to show, and the CSS class of the column.
    let columns = PAGE.iter().zip(COLUMNS);
    let columns = columns.map(|(canvas, class)| (fits(canvas.width).unwrap_or(drawn.len() - 1), class));
    let columns: Vec<(usize, &str)> = columns.collect();
    let classes = |number: usize| {
        let column_classes =
            columns.iter().filter(|(drawing, _)| *drawing == number).map(|(_, class)| *class);
        column_classes.collect::<Vec<_>>().join(" ")
    };
    html! {
        @if let Some((_, first)) = drawn.first() {
            div class="scroll drawn" data-picture=(name) tabindex="0" role="group" aria-label=(first.title) {
                @for (number, (width, picture)) in drawn.iter().enumerate() {
                    @let long = if picture.width > *width { " long" } else { "" };
                    (picture.inline(&format!("{name}-{}", number + 1), &format!("{}{long}", classes(number))))
                }
            }
        }
    }
}

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
    fn content_security_policy_has_the_digest_of_the_script() {
        let digest = base64::engine::general_purpose::STANDARD.encode(Sha256::digest(SCRIPT));
        assert_eq!(DIGEST, format!("sha256-{digest}"));
    }
}
