//! Draws a plan as text for a terminal: a row for the actions, and a row for the designs of each
//! function.

use std::collections::BTreeMap;

use crate::data::{Axis, Plan, Step};
use crate::scale::number;

/// Minimum number of columns of a picture, including the names of its rows.
const LEAST: usize = 60;
/// Minimum number of columns of a step in a picture that is to scale.
const COLUMN: usize = 4;
/// Minimum number of columns of a step in a picture that is not to scale, including the mark at its
/// start.
const NARROW: usize = 7;
/// Maximum number of bands (groups of rows for consecutive steps) below each other.
const BANDS: usize = 6;
/// Maximum number of characters of a lane's name.
const NAME: usize = 24;

/// The steps of a band: the index of each step, and the columns at which it starts and ends.
type Columns = Vec<(usize, (usize, usize))>;

impl Plan {
    /// Draws the plan in this number of columns. Returns `None` if there are too few columns or no
    /// steps, if actions overlap, or if the picture needs too many lines.
    ///
    /// The widths of steps are proportional to their durations if each step then has enough
    /// columns. Otherwise short steps are widened, and a plan of many steps continues in further
    /// bands below. The numbers on the axis are right in both cases.
    ///
    /// Names are printed unchanged. Callers that write to a terminal must make invisible characters
    /// visible first.
    pub fn text(&self, columns: usize) -> Option<String> {
        let mut lanes: BTreeMap<&str, Vec<(usize, String)>> = BTreeMap::new();
        for (index, step) in self.steps.iter().enumerate() {
            for (function, design) in &step.configuration {
                let bars = lanes.entry(function).or_default();
                match bars.last_mut() {
                    // An action can use several designs for one function.
                    Some((last, names)) if *last == index => *names = format!("{names}, {design}"),
                    _ => bars.push((index, design.clone())),
                }
            }
        }
        let label = lanes.keys().map(|name| length(name)).max().unwrap_or(0).clamp("actions".len(), NAME);
        let room = columns.checked_sub(label + 2).filter(|_| columns >= LEAST)?;
        let actions: Vec<(usize, String)> =
            self.steps.iter().map(|step| step.label.clone()).enumerate().collect();
        let axis = match self.axis {
            Axis::Time => "time",
            Axis::Steps => "step",
        };
        let band = |places: Columns| {
            let line = |name: &str, bars: &[(usize, String)]| {
                format!("{:>label$}  {}\n", short(name, label), self.bars(name, bars, &places))
            };
            let functions = lanes.iter().map(|(function, bars)| line(function, bars));
            let ticks = format!("{axis:>label$}  {}\n", self.ticks(&places, room));
            std::iter::once(line("actions", &actions)).chain(functions).chain([ticks]).collect::<String>()
        };
        let bands: Vec<String> = self.bands(room)?.into_iter().map(band).collect();
        Some(bands.join("\n"))
    }

    fn bands(&self, room: usize) -> Option<Vec<Columns>> {
        let starts = self.steps.iter().skip(1).map(|step| step.start);
        let is_sequence = self.steps.iter().zip(starts).all(|(step, next)| step.end <= next + 1e-9);
        let count = self.steps.len();
        if count == 0 || !is_sequence {
            return None;
        }
        if let Some(places) = self.to_scale(room) {
            return Some(vec![places.into_iter().enumerate().collect()]);
        }
        let bands = count.div_ceil((room / NARROW).max(1));
        (bands <= BANDS).then(|| {
            let (size, mut band) = (count.div_ceil(bands), Vec::new());
            for first in (0..count).step_by(size) {
                band.push(self.widened(first..(first + size).min(count), room));
            }
            band
        })
    }

    /// Returns the columns at which each step starts and ends, to scale. Returns `None` if a step
    /// then has fewer than [`COLUMN`] columns.
    fn to_scale(&self, room: usize) -> Option<Vec<(usize, usize)>> {
        let end = self.steps.iter().map(|step| step.end).fold(0.0, f64::max);
        let column = |at: f64| if end > 0.0 { (at / end * room as f64).round() as usize } else { 0 };
        let mut previous = 0;
        let place = |step: &Step| {
            // The end of a step can exceed the start of the next one by a rounding error.
            let from = column(step.start).max(previous);
            previous = column(step.end);
            (from, previous)
        };
        let places: Vec<_> = self.steps.iter().map(place).collect();
        let is_wide = places.iter().all(|(from, to)| *to >= from + COLUMN);
        is_wide.then_some(places)
    }

    /// Places steps of minimum width side by side. The remaining columns are distributed in
    /// proportion to the durations.
    fn widened(&self, steps: std::ops::Range<usize>, room: usize) -> Columns {
        let duration = |index: usize| (self.steps[index].end - self.steps[index].start).max(0.0);
        let total: f64 = steps.clone().map(duration).sum();
        let spare = room.saturating_sub(steps.len() * NARROW) as f64;
        let (mut places, mut passed) = (Vec::new(), 0.0);
        let column = |number: usize, passed: f64| {
            number * NARROW + if total > 0.0 { (passed / total * spare).floor() as usize } else { 0 }
        };
        for (number, index) in steps.enumerate() {
            let from = column(number, passed);
            passed += duration(index);
            places.push((index, (from, column(number + 1, passed))));
        }
        places
    }

    fn bars(&self, lane: &str, bars: &[(usize, String)], places: &Columns) -> String {
        let mut line = String::new();
        let mut column = 0;
        let place = |step: usize| places.iter().find(|(index, _)| *index == step).map(|(_, place)| *place);
        for (index, name) in bars {
            let Some((from, to)) = place(*index) else { continue };
            line += &" ".repeat(from - column);
            let step: &Step = &self.steps[*index];
            let first =
                if step.reconfigured.iter().any(|(function, _)| function == lane) { '◆' } else { '▕' };
            let inner = short(name, to - from - 1);
            line.push(first);
            line += &inner;
            line += &"·".repeat(to - from - 1 - length(&inner));
            column = to;
        }
        line
    }

    /// Draws the start times of the steps and the end time of the last step. A number that would
    /// touch the previous one is omitted.
    fn ticks(&self, places: &Columns, room: usize) -> String {
        let last = places.last().map(|(index, (_, to))| (*to, self.steps[*index].end));
        let marks = places.iter().map(|(index, (from, _))| (*from, self.steps[*index].start)).chain(last);
        let mut line = String::new();
        for (column, value) in marks {
            let text = number(value);
            let free = length(&line) + usize::from(!line.is_empty());
            // The last number ends at the right edge of the picture at the latest.
            let column = column.min(room.saturating_sub(length(&text)));
            if column >= free {
                line += &" ".repeat(column - length(&line));
                line += &text;
            }
        }
        line
    }
}

fn length(text: &str) -> usize {
    text.chars().count()
}

fn short(text: &str, most: usize) -> String {
    if length(text) <= most {
        return text.to_owned();
    }
    text.chars().take(most.saturating_sub(1)).chain((most > 0).then_some('…')).collect()
}
