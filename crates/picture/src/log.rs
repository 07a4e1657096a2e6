//! The page about an adaptation loop: its inputs, inferences, plans and commands on a time axis.

use std::collections::BTreeMap;

use maud::{Markup, html};

use crate::data::{Happening, Kind, Log};
use crate::frame::{Canvas, PAGE, RIGHT};
use crate::page::{page, reasons, shown, table};
use crate::scale::{Scale, number, px, width};
use crate::svg::Picture;

/// Minimum width of the names of lanes, in pixels.
const NAMES: f64 = 90.0;
const LANE: f64 = 24.0;
const TOP: f64 = 6.0;
/// Width of the interval whose happenings share a mark, in pixels.
const MARK: f64 = 4.0;
const NAMED: usize = 5;
/// Maximum number of listed happenings. The page of a longer journal would be too large for
/// browsers.
const LISTED: usize = 1000;

impl Log {
    /// Renders the page as HTML.
    pub fn html(&self) -> String {
        let marked = self.happenings.iter().filter(|happening| happening.kind != Kind::Event).count();
        let body = html! {
            p class="verdict" { (self.verdict) }
            ul { @for part in &self.parts { li { (part) } } }
            @for message in &self.messages { p class="bad" { (message) } }
            h2 { "What happened" }
            (shown("log", &PAGE, &|canvas| self.picture(canvas)))
            p class="dim" { "A mark can represent several entries that are close together." }
            h2 { "List" }
            @let listed: Vec<&Happening> = self.listed();
            @if listed.len() < self.happenings.len() {
                p class="dim" {
                    "The journal has " (self.happenings.len()) " entries, " (marked)
                    " of which are not reports of the robot. The list shows "
                    (listed.len()) " of them: the earliest ones, and conclusions, plans and effects of the loop \
                                    rather than reports."
                }
            }
            (list(&listed))
        };
        page(&self.name, "Events, conclusions, plans and effects of an adaptation loop.", &body)
    }

    /// Renders the timeline of the page as an SVG file.
    pub fn svg(&self) -> String {
        self.picture(PAGE[0]).file()
    }

    /// Returns the happenings that the page lists, in chronological order. If there are too many,
    /// reports from the robot are omitted first, and then other happenings, each time beginning
    /// with the latest.
    fn listed(&self) -> Vec<&Happening> {
        if self.happenings.len() <= LISTED {
            return self.happenings.iter().collect();
        }
        let mut chosen: Vec<usize> = (0..self.happenings.len()).collect();
        chosen.sort_by_key(|index| (self.happenings[*index].kind == Kind::Event, *index));
        chosen.truncate(LISTED);
        chosen.sort_unstable();
        chosen.into_iter().map(|index| &self.happenings[index]).collect()
    }

    fn picture(&self, canvas: Canvas) -> Picture {
        let last = self.happenings.last().map_or(0.0, |happening| happening.time);
        let (left, right) = (canvas.left.max(NAMES), canvas.width - RIGHT);
        let scale = Scale::new((0.0, last), (left, right));
        let lanes = Kind::ALL.map(|kind| (kind, self.marks(kind, &scale)));
        let bottom = TOP + LANE * lanes.len() as f64;
        let ticks = scale.ticks(((right - left) / (width(&number(last)) + 24.0).max(60.0)) as usize);
        let body = html! {
            g class="axis" {
                @for tick in ticks {
                    @let x = px(scale.at(tick));
                    line class="grid" x1=(x) x2=(x) y1=(px(TOP)) y2=(px(bottom)) {}
                    text x=(x) y=(px(bottom + 15.0)) text-anchor="middle" { (number(tick)) }
                }
                text x=(px(left - 20.0)) y=(px(bottom + 15.0)) text-anchor="end" { "seconds" }
            }
            @for ((kind, marks), lane) in lanes.iter().zip(0..) {
                (draw(*kind, marks, (left, right), TOP + LANE * f64::from(lane)))
            }
        };
        let title = format!("{} entries in {} seconds", self.happenings.len(), number(last));
        let description = "One lane for each kind of entry. The list has the same content.".to_owned();
        Picture { width: canvas.width, height: bottom + 24.0, title, description, body }
    }

    fn marks(&self, kind: Kind, scale: &Scale) -> BTreeMap<i64, Vec<&Happening>> {
        let mut marks: BTreeMap<i64, Vec<&Happening>> = BTreeMap::new();
        for happening in self.happenings.iter().filter(|happening| happening.kind == kind) {
            marks.entry((scale.at(happening.time) / MARK).floor() as i64).or_default().push(happening);
        }
        marks
    }
}

fn draw(kind: Kind, marks: &BTreeMap<i64, Vec<&Happening>>, (left, right): (f64, f64), top: f64) -> Markup {
    html! {
        g class="lane" data-lane=(kind.name()) {
            rect class="track" x=(px(left)) y=(px(top + 1.0)) width=(px(right - left)) height=(px(LANE - 2.0)) {}
            text class="label" x=(px(left - 10.0)) y=(px(top + 16.0)) text-anchor="end" { (kind.name()) }
            @for (place, own) in marks {
                g class="bar" {
                    title { (titled(own)) }
                    rect class={ "c" (kind as usize) } data-count=(own.len()) x=(px(*place as f64 * MARK)) y=(px(top + 4.0)) width=(px(MARK - 0.5)) height=(px(LANE - 8.0)) {}
                }
            }
        }
    }
}

fn titled(marked: &[&Happening]) -> String {
    let named = marked
        .iter()
        .take(NAMED)
        .map(|happening| format!("{} s: {}", number(happening.time), happening.text));
    let remainder = (marked.len() > NAMED).then(|| format!("and {} more", marked.len() - NAMED));
    named.chain(remainder).collect::<Vec<_>>().join("\n")
}

fn list(listed: &[&Happening]) -> Markup {
    let rows = html! {
        @for own in listed {
            tr data-record=(own.record) {
                td class="number" { (own.record) }
                td class="number" { (number(own.time)) }
                td { (own.kind.name()) }
                td {
                    @if own.because.is_empty() {
                        (own.text)
                    } @else {
                        details { summary { (own.text) } (reasons(&own.because)) }
                    }
                }
            }
        }
    };
    table("happenings", &["record", "seconds", "kind", "what"], &rows)
}
