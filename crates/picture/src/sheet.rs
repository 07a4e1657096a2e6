//! Pages about Pareto fronts, comparisons and simulations, with scatter plots, distributions,
//! tables, and expandable plans.

use std::collections::{BTreeMap, BTreeSet};

use maud::{Markup, html};

use crate::data::{Group, Part, Plan, Points, Rows, Sheet};
use crate::frame::{Canvas, FILE, PAGE, RIGHT};
use crate::page::{page, reasons, shown, table};
use crate::palette::Palette;
use crate::report::alone;
use crate::scale::{Scale, compact, fit, number, px, range};
use crate::svg::Picture;

const HEIGHT: f64 = 300.0;
const TOP: f64 = 24.0;
const ROW: f64 = 46.0;
/// Width of the cells into which the axis is divided, in pixels. Dots in the same cell are stacked.
const NEAR: f64 = 6.0;
/// Maximum height of a stack of dots, in pixels.
const HIGHEST: f64 = 28.0;

impl Sheet {
    /// Renders the page as HTML.
    pub fn html(&self) -> String {
        let plans: Vec<&Plan> = self.plans().collect();
        let palette = Palette::of(&plans);
        let body = html! {
            p class="verdict" { (self.verdict) }
            @for (part, number) in self.parts.iter().zip(1..) { (drawn(part, number, &palette)) }
        };
        page(&self.name, &self.description, &body)
    }

    /// Renders the plots of the page as SVG files. Returns for each file its name and its contents;
    /// plans have no files.
    pub fn pictures(&self) -> Vec<(String, String)> {
        let pictures = self.parts.iter().filter_map(|part| match part {
            Part::Points(own) => Some(points(own, FILE)),
            Part::Rows(own) => Some(rows(own, FILE)),
            _ => None,
        });
        pictures.zip(1..).map(|(picture, number)| (format!("picture-{number}.svg"), picture.file())).collect()
    }

    fn plans(&self) -> impl Iterator<Item = &Plan> {
        self.parts
            .iter()
            .flat_map(|part| match part {
                Part::Plans(plans) => plans.as_slice(),
                _ => &[],
            })
            .map(|(_, plan)| plan)
    }
}

fn drawn(part: &Part, number: i32, palette: &Palette) -> Markup {
    let name = format!("part-{number}");
    html! {
        @match part {
            Part::Heading(text) => { h2 { (text) } },
            Part::Sentences(all) => {
                @for own in all {
                    @if own.because.is_empty() {
                        p { (own.text) }
                    } @else {
                        details { summary { (own.text) } (reasons(&own.because)) }
                    }
                }
            },
            Part::Points(own) => { (shown(&name, &PAGE, &|canvas| points(own, canvas))) },
            Part::Rows(own) => { (shown(&name, &PAGE, &|canvas| rows(own, canvas))) },
            Part::Table(title, header, lines) => {
                (table(title, &header.iter().map(String::as_str).collect::<Vec<_>>(), &html! {
                    @for line in lines { tr { @for cell in line { td { (cell) } } } }
                }))
            },
            Part::Plans(plans) => {
                @for ((title, own), number) in plans.iter().zip(1..) {
                    details data-plan=(number) {
                        summary { (title) }
                        (alone(own, &format!("{name}-{number}"), palette))
                    }
                }
            },
        }
    }
}

fn scale(values: impl Iterator<Item = f64>, to: (f64, f64)) -> Scale {
    let (low, high) = range(values);
    let margin = ((high - low) * 0.08).max(high.abs() * 1e-6);
    Scale::new((low - margin, high + margin), to)
}

fn points(own: &Points, canvas: Canvas) -> Picture {
    let (left, right, bottom) = (canvas.left, canvas.width - RIGHT, TOP + HEIGHT);
    let across =
        scale(own.points.iter().map(|own| own.2).chain(own.line.iter().map(|own| own.0)), (left, right));
    let upwards =
        scale(own.points.iter().map(|own| own.3).chain(own.line.iter().map(|own| own.1)), (bottom, TOP));
    let line: Vec<String> =
        own.line.iter().map(|(x, y)| format!("{} {}", px(across.at(*x)), px(upwards.at(*y)))).collect();
    // Points at the same position share a label, which contains each name once.
    let mut labels: BTreeMap<(String, String), BTreeSet<&str>> = BTreeMap::new();
    for (short, _, x, y) in &own.points {
        labels.entry((px(across.at(*x)), px(upwards.at(*y)))).or_default().insert(short);
    }
    let mut occupied: Vec<(f64, f64, f64)> = Vec::new();
    let body = html! {
        g class="axis" {
            @for tick in across.ticks(ticks(canvas)) {
                @let x = px(across.at(tick));
                line class="grid" x1=(x) x2=(x) y1=(px(TOP)) y2=(px(bottom)) {}
                text x=(x) y=(px(bottom + 15.0)) text-anchor="middle" { (compact(tick)) }
            }
            @for tick in upwards.ticks(6) {
                @let y = upwards.at(tick);
                line class="grid" x1=(px(left)) x2=(px(right)) y1=(px(y)) y2=(px(y)) {}
                text x=(px(left - 6.0)) y=(px(y + 4.0)) text-anchor="end" { (compact(tick)) }
            }
            text x=(px(right)) y=(px(bottom + 32.0)) text-anchor="end" { (fit(&own.axes[0], right - 20.0)) " →" }
            @let start = if canvas.has_names_above { 4.0 } else { left };
            text x=(px(start)) y="12" { "↑ " (fit(&own.axes[1], right - start - 20.0)) }
        }
        @if !line.is_empty() { path class="curve" d={ "M" (line.join("L")) } {} }
        @for (short, about, x, y) in &own.points {
            g data-point=(short) {
                title { (about) }
                circle class="point" cx=(px(across.at(*x))) cy=(px(upwards.at(*y))) r="4" {}
            }
        }
        @for ((x, y), names) in &labels {
            @if let Some((x, y, text)) = label(x, y, &names.iter().copied().collect::<Vec<_>>().join(", "), right, &mut occupied) {
                text x=(px(x)) y=(px(y)) { (text) }
            }
        }
    };
    let description = format!("{} points; the table has the same content.", own.points.len());
    Picture { width: right + RIGHT, height: bottom + 40.0, title: own.title.clone(), description, body }
}

/// Finds a free position for a label near the point (`x`, `y`), and marks it as occupied. Returns
/// the left end of the base line and the possibly truncated text, or `None` if no position is free.
fn label(
    x: &str,
    y: &str,
    text: &str,
    right: f64,
    taken: &mut Vec<(f64, f64, f64)>,
) -> Option<(f64, f64, String)> {
    let (x, y): (f64, f64) = (x.parse().ok()?, y.parse().ok()?);
    let text = fit(text, 200.0);
    let wide = crate::scale::width(&text);
    let start = (x + 7.0).min(right - wide);
    let place = [y - 6.0, y + 14.0, y - 20.0, y + 28.0].into_iter().find(|line| {
        let apart =
            |own: &(f64, f64, f64)| own.1 <= start || start + wide <= own.0 || (own.2 - line).abs() >= 13.0;
        *line > 24.0 && taken.iter().all(apart)
    })?;
    taken.push((start, start + wide, place));
    Some((start, place, text))
}

fn ticks(canvas: Canvas) -> usize {
    (canvas.inner() / 75.0).min(8.0) as usize
}

fn rows(own: &Rows, canvas: Canvas) -> Picture {
    let (left, right, row) = (canvas.left, canvas.width - RIGHT, ROW + canvas.name_height());
    let values = own.groups.iter().flat_map(|group| {
        let ends = group.mean.iter().flat_map(|(mean, half)| [mean - half, mean + half]);
        group.values.iter().map(|(value, _)| *value).chain(ends)
    });
    let across = scale(values, (left, right));
    let has_values = own.groups.iter().any(|group| !group.values.is_empty());
    let bottom = row * own.groups.len() as f64 + 6.0;
    let body = html! {
        g class="axis" {
            @for tick in across.ticks(if has_values { ticks(canvas) } else { 0 }) {
                @let x = px(across.at(tick));
                line class="grid" x1=(x) x2=(x) y1="6" y2=(px(bottom)) {}
                text x=(x) y=(px(bottom + 15.0)) text-anchor="middle" { (compact(tick)) }
            }
            text x=(px(right)) y=(px(bottom + 32.0)) text-anchor="end" { (fit(&own.axis, right - 4.0)) }
        }
        @for (Group { name, values, mean, nothing }, lane) in own.groups.iter().zip(0..) {
            @let base = 6.0 + row * f64::from(lane) + row - 12.0;
            @let place = canvas.name_place(base - HIGHEST, base - 8.0);
            g class="lane" data-group=(name) {
                text class="label" x=(px(place.x)) y=(px(place.y)) text-anchor=(place.anchor) { (fit(name, place.room)) }
                @if values.is_empty() { text class="nothing" x=(px(left + 4.0)) y=(px(base - 4.0)) { (fit(nothing, right - left)) } }
                line class="grid" x1=(px(left)) x2=(px(right)) y1=(px(base + 6.0)) y2=(px(base + 6.0)) {}
                @for ((value, about), height) in values.iter().zip(heights(values, &across)) {
                    circle class="point" cx=(px(across.at(*value))) cy=(px(base - height)) r="2.5" { title { (about) } }
                }
                @if let Some((mean, half)) = mean {
                    g class="bound" {
                        title { (name) ": mean " (number(*mean)) " ± " (number(*half)) }
                        line x1=(px(across.at(mean - half))) x2=(px(across.at(mean + half) + 1.0)) y1=(px(base + 6.0)) y2=(px(base + 6.0)) {}
                    }
                    path class="mark" d={ "M" (px(across.at(*mean) - 5.0)) " " (px(base + 6.0)) "l5 -5l5 5l-5 5Z" } {}
                }
            }
        }
    };
    let description = "A dot is a run, the diamond the mean with its interval of 95 percent.".to_owned();
    Picture { width: canvas.width, height: bottom + 40.0, title: own.title.clone(), description, body }
}

/// Returns the height of each dot above the base line. Dots in the same cell of the axis are stacked.
fn heights(values: &[(f64, String)], across: &Scale) -> Vec<f64> {
    let mut counts: BTreeMap<i64, usize> = BTreeMap::new();
    let mut place = |(value, _): &(f64, String)| {
        let count = counts.entry((across.at(*value) / NEAR).round() as i64).or_default();
        *count += 1;
        *count - 1
    };
    let places: Vec<usize> = values.iter().map(&mut place).collect();
    let highest = places.iter().max().map_or(1, |highest| (*highest).max(1));
    let apart = (HIGHEST / highest as f64).min(5.0);
    places.into_iter().map(|place| place as f64 * apart).collect()
}
