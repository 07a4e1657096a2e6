//! A plan as lines of a terminal: a row for the actions, and one for the design of each function.

use std::collections::BTreeMap;

use crate::data::{Axis, Plan, Step};
use crate::scale::number;

/// Fewer columns than this are too few for a picture.
const LEAST: usize = 60;
/// A step has at least so many columns.
const COLUMN: usize = 4;
/// Names of lanes are shortened to this.
const NAME: usize = 24;

impl Plan {
    /// The plan drawn in so many columns; none where they are too few, or where actions overlap.
    ///
    /// Names are as they are given: whoever writes them to a terminal makes them visible first.
    pub fn text(&self, columns: usize) -> Option<String> {
        let mut lanes: BTreeMap<&str, Vec<(usize, &str)>> = BTreeMap::new();
        for (index, step) in self.steps.iter().enumerate() {
            for (function, design) in &step.configuration {
                lanes.entry(function).or_default().push((index, design));
            }
        }
        let label = lanes.keys().map(|name| length(name)).max().unwrap_or(0).clamp("actions".len(), NAME);
        let room = columns.checked_sub(label + 2).filter(|_| columns >= LEAST)?;
        let places = self.places(room)?;
        let mut lines = Vec::new();
        let actions: Vec<(usize, &str)> =
            self.steps.iter().map(|step| step.label.as_str()).enumerate().collect();
        let mut line = |name: &str, bars: &[(usize, &str)]| {
            lines.push(format!("{:>label$}  {}\n", short(name, label), self.bars(name, bars, &places)));
        };
        line("actions", &actions);
        for (function, bars) in &lanes {
            line(function, bars);
        }
        let axis = match self.axis {
            Axis::Time => "time",
            Axis::Steps => "step",
        };
        lines.push(format!("{axis:>label$}  {}\n", self.ticks(&places, room)));
        Some(lines.concat())
    }

    /// From which column to which each step is drawn.
    fn places(&self, room: usize) -> Option<Vec<(usize, usize)>> {
        let end = self.steps.iter().map(|step| step.end).fold(0.0, f64::max);
        let column = |at: f64| if end > 0.0 { (at / end * room as f64).round() as usize } else { 0 };
        let places: Vec<_> = self.steps.iter().map(|step| (column(step.start), column(step.end))).collect();
        let is_wide = places.iter().all(|(from, to)| *to >= from + COLUMN);
        let is_sequence = places.windows(2).all(|pair| pair[0].1 <= pair[1].0);
        (!places.is_empty() && is_wide && is_sequence).then_some(places)
    }

    fn bars(&self, lane: &str, bars: &[(usize, &str)], places: &[(usize, usize)]) -> String {
        let mut line = String::new();
        let mut column = 0;
        for (index, name) in bars {
            let (from, to) = places[*index];
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

    /// Where steps begin, and where the last one ends.
    fn ticks(&self, places: &[(usize, usize)], room: usize) -> String {
        let last = self.steps.last().zip(places.last()).map(|(step, (_, to))| (*to, step.end));
        let marks = self.steps.iter().zip(places).map(|(step, (from, _))| (*from, step.start)).chain(last);
        let mut line = String::new();
        for (column, value) in marks {
            let text = number(value);
            let free = length(&line) + usize::from(!line.is_empty());
            if column >= free && column + length(&text) <= room + text.len() {
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

/// The text in so many characters.
fn short(text: &str, most: usize) -> String {
    if length(text) <= most {
        return text.to_owned();
    }
    text.chars().take(most.saturating_sub(1)).chain((most > 0).then_some('…')).collect()
}
