//! The page about a plan. If a situation changes the mission (for example a failed component), the
//! page shows two plans: before and after the change.

use maud::{Markup, html};

use crate::chart::{curve, search};
use crate::data::{Checked, Design, Plan, Report, Step};
use crate::frame::{Canvas, FILE, PAGE, PAIR, Span};
use crate::map::map;
use crate::page::{page, reasons, shown, table};
use crate::palette::{Palette, configuration};
use crate::svg::clean;
use crate::timeline::timeline;

impl Report {
    /// Renders the page about the plan as HTML.
    pub fn html(&self) -> String {
        let palette = self.palette();
        let body = html! {
            @if !self.situation.is_empty() {
                p { "Here: " (self.situation.join("; ")) "." }
            }
            p class="verdict" { (self.plan.verdict) }
            @if let Some(before) = &self.before {
                (changes(self))
                @let spans = spans(before, &self.plan);
                div class="pair" {
                    section data-plan="before" aria-label="before" { h2 { "Before" } p { (before.verdict) } (plan(before, "before", &palette, (&spans[0], &PAIR))) }
                    section data-plan="after" aria-label="after" { h2 { "After" } p { (self.plan.verdict) } (plan(&self.plan, "after", &palette, (&spans[1], &PAIR))) }
                }
            } @else {
                section data-plan="plan" aria-label="plan" { h2 { "Plan" } (alone(&self.plan, "plan", &palette)) }
            }
            (designs(&self.plan.designs))
            @if let Some(checked) = &self.checked { (verified(checked)) }
        };
        page(&self.name, &self.description, &body)
    }

    /// Renders the pictures of the page as SVG files. Returns for each file its name and its
    /// contents; pictures of the plan before the change have the prefix `before-`.
    pub fn pictures(&self) -> Vec<(String, String)> {
        let palette = self.palette();
        let before = self.before.iter().map(|plan| ("before-", plan));
        let current = std::iter::once(("", &self.plan));
        current.chain(before).flat_map(|(prefix, plan)| plan_pictures(plan, prefix, &palette)).collect()
    }

    fn palette(&self) -> Palette {
        let plans: Vec<&Plan> = self.before.iter().chain([&self.plan]).collect();
        Palette::of(&plans)
    }
}

impl Plan {
    /// Renders the timeline of the plan as an SVG file.
    pub fn svg(&self) -> String {
        timeline(self, &Palette::of(&[self]), &Span::of(&[self]), FILE).file()
    }

    /// Renders the plan as HTML for inclusion in another page, which must contain the style sheet
    /// [`crate::STYLE`].
    pub fn part(&self) -> String {
        let body = html! {
            @if !self.verdict.is_empty() { p { (self.verdict) } }
            (alone(self, "plan", &Palette::of(&[self])))
        };
        clean(&body.into_string())
    }
}

fn plan_pictures(plan: &Plan, prefix: &str, palette: &Palette) -> Vec<(String, String)> {
    let span = Span::of(&[plan]);
    let mut files = vec![(format!("{prefix}timeline.svg"), timeline(plan, palette, &span, FILE).file())];
    for (own, number) in plan.curves.iter().zip(1..) {
        files.push((format!("{prefix}number-{number}.svg"), curve(plan, own, &span, FILE).file()));
    }
    let maps = plan.map.iter().map(|own| map(plan, own, palette, FILE).file());
    files.extend(maps.map(|text| (format!("{prefix}map.svg"), text)));
    if plan.search.len() > 1 {
        files.push((format!("{prefix}search.svg"), search(&plan.search, FILE).file()));
    }
    files
}

/// Returns the axis ranges of two plans that are shown side by side. The ranges are equal if both
/// plans have the same kind of axis.
fn spans(before: &Plan, after: &Plan) -> [Span; 2] {
    let plans = [before, after];
    plans.map(|plan| if before.axis == after.axis { Span::of(&plans) } else { Span::of(&[plan]) })
}

/// Renders a plan over the full width of the page. `name` must be unique on the page.
pub(crate) fn alone(own: &Plan, name: &str, palette: &Palette) -> Markup {
    plan(own, name, palette, (&Span::of(&[own]), &PAGE))
}

fn plan(plan: &Plan, name: &str, palette: &Palette, (span, canvases): (&Span, &[Canvas])) -> Markup {
    html! {
        @if plan.steps.is_empty() {
            p { "There is no action to show." }
        } @else {
            h3 { "Timeline" }
            (shown(&format!("{name}-timeline"), canvases, &|canvas| timeline(plan, palette, span, canvas)))
            (legend(plan, palette))
            details {
                summary { "Steps as a table" }
                (steps(plan))
            }
            @if !plan.curves.is_empty() {
                h3 { "Numbers" }
                p class="dim" { "Dashed lines are the bounds of conditions." }
                @for (own, number) in plan.curves.iter().zip(1..) {
                    (shown(&format!("{name}-number-{number}"), canvases, &|canvas| curve(plan, own, span, canvas)))
                }
            }
            @if let Some(own) = &plan.map {
                h3 { "Map" }
                (shown(&format!("{name}-map"), canvases, &|canvas| map(plan, own, palette, canvas)))
                @if own.places.iter().any(|place| place.position.is_none()) {
                    p class="dim" {
                        "The mission has no coordinates: the layout of places follows from the ways between them."
                    }
                }
            }
        }
        @if !plan.search.is_empty() {
            h3 { "Search" }
            @if let [only] = &plan.search[..] {
                p { "The search has a single message: " (only.text) "." }
            } @else {
                (shown(&format!("{name}-search"), canvases, &|canvas| search(&plan.search, canvas)))
                details {
                    summary { "Search as a list" }
                    ol { @for moment in &plan.search { li { (moment.text) } } }
                }
            }
        }
    }
}

fn legend(plan: &Plan, palette: &Palette) -> Markup {
    let mut names: Vec<String> =
        plan.steps.iter().flat_map(|step| &step.configuration).map(|(_, design)| design.clone()).collect();
    if plan.map.is_some() {
        names.extend(plan.steps.iter().filter(|step| step.way.is_some()).map(configuration));
    }
    let mut listed = std::collections::BTreeSet::new();
    names.retain(|name| !name.is_empty() && listed.insert(name.clone()));
    html! {
        ul class="legend" {
            @for name in &names {
                li {
                    svg class="picture" width="14" height="14" aria-hidden="true" {
                        rect class=(palette.class(name)) x="1" y="1" width="12" height="12" rx="2" {}
                    }
                    span class="name" { (name) }
                }
            }
            @if plan.steps.iter().any(|step| !step.reconfigured.is_empty()) {
                li {
                    svg class="picture" width="14" height="14" aria-hidden="true" {
                        path class="mark" d="M1 7L7 1L13 7L7 13Z" {}
                    }
                    "reconfiguration"
                }
            }
        }
    }
}

fn steps(plan: &Plan) -> Markup {
    let row = |number: usize, step: &Step| {
        let designs = step.configuration.iter().map(|(function, design)| {
            let changed = step.reconfigured.iter().any(|(name, _)| name == function);
            format!("{function} = {design}{}", if changed { " (changed)" } else { "" })
        });
        let designs: Vec<String> = designs.collect();
        html! {
            tr data-step=(number) {
                td class="number" { (number) }
                td class="number" { (step.start_text) }
                td class="number" { (step.duration_text) }
                td class="name" { (step.label) }
                td class="name" { (designs.join(", ")) }
                td class="number" { (step.cost_text) }
            }
        }
    };
    let rows = html! { @for (number, step) in (1..).zip(&plan.steps) { (row(number, step)) } };
    table("steps", &["step", "start", "duration", "action", "configuration", "cost"], &rows)
}

fn changes(report: &Report) -> Markup {
    html! {
        section aria-labelledby="changes" {
            h2 id="changes" { "What changed, and why" }
            @if report.changes.is_empty() { p { "Nothing that the plan depends on." } }
            @for change in &report.changes {
                @if change.because.is_empty() {
                    p { (change.text) }
                } @else {
                    details { summary { (change.text) } (reasons(&change.because)) }
                }
            }
        }
    }
}

fn designs(designs: &[Design]) -> Markup {
    let row = |design: &Design| {
        let used: Vec<String> = design.steps.iter().map(ToString::to_string).collect();
        html! {
            tr data-design=(design.name) {
                td class="name" { (design.name) }
                td class="name" { (design.functions.join(", ")) }
                td {
                    details {
                        summary class=(if design.available { "good" } else { "bad" }) {
                            (if design.available { "available" } else { "not available" })
                        }
                        (reasons(&design.because))
                    }
                }
                td { (if used.is_empty() { "–".to_owned() } else { used.join(", ") }) }
                td class="name" { @for text in &design.estimations { div { (text) } } }
                td class="name" { @for text in &design.needs { div { (text) } } }
            }
        }
    };
    html! {
        @if !designs.is_empty() {
            section aria-labelledby="designs" {
                h2 id="designs" { "Designs" }
                (table("designs", &["design", "function", "availability, and why", "steps", "estimates", "needs"],
                    &html! { @for design in designs { (row(design)) } }))
            }
        }
    }
}

fn verified(checked: &Checked) -> Markup {
    let failure = if checked.stopped { "not verified" } else { "failed" };
    let rows = html! {
        @for (part, holds, message) in &checked.parts {
            tr {
                td { (part) }
                td class=(if *holds { "good" } else { "bad" }) { (if *holds { "verified" } else { failure }) }
                td { (message) }
            }
        }
    };
    html! {
        section aria-labelledby="verified" {
            h2 id="verified" { "Verification" }
            p class={ "verdict " (if checked.verified { "good" } else { "bad" }) } { (checked.verdict) }
            (table("verification", &["part", "result", "details"], &rows))
        }
    }
}
