//! Parses the maps of Cámara et al. (JSON). Keeps the position in the text of names and measurements that may be
//! faulty, for messages.
//!
//! A place has `node-id`, `connected-to` and `coords`. Maps of 2017, for the first robots of the Rainbow project, have
//! `coord` instead of `coords`, no measurements, and rectangles that the robot should avoid (`unsafe-rects`). No
//! corridor crosses these rectangles.
use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Deserializer, de};
use serde_json::Value;
use serde_json::value::RawValue;

use crate::message::{Errors, Message, did_you_mean};

/// Upper limit on the magnitudes of coordinates and measured times. With it, all computed times and
/// energies are finite.
const MAX_NUMBER: f64 = 1e12;

#[derive(Deserialize)]
pub(super) struct Map<'t> {
    #[serde(rename = "map", borrow)]
    pub(super) nodes: Vec<Node<'t>>,
    #[serde(default, borrow)]
    pub(super) time: Vec<Measured<'t>>,
    #[serde(default, borrow)]
    pub(super) hitrate: Vec<Measured<'t>>,
    #[serde(default, borrow)]
    pub(super) successrate: Vec<Measured<'t>>,
    #[serde(rename = "unsafe-rects", default)]
    unsafe_rectangles: Vec<de::IgnoredAny>,
}

#[derive(Deserialize)]
pub(super) struct Node<'t> {
    #[serde(rename = "node-id", borrow)]
    pub(super) id: Placed<'t>,
    #[serde(alias = "coord")]
    pub(super) coords: Coordinates,
    #[serde(rename = "connected-to", default, borrow)]
    pub(super) neighbours: Vec<Placed<'t>>,
}

#[derive(Deserialize)]
pub(super) struct Coordinates {
    pub(super) x: f64,
    pub(super) y: f64,
}

pub(super) struct Placed<'t> {
    pub(super) text: String,
    raw: &'t str,
}

impl<'de: 't, 't> Deserialize<'de> for Placed<'t> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let raw = <&'t RawValue>::deserialize(deserializer)?.get();
        let text =
            serde_json::from_str(raw).map_err(|_| de::Error::custom("the name of a place is a string"))?;
        Ok(Self { text, raw })
    }
}

pub(super) struct Measured<'t> {
    pub(super) from: String,
    pub(super) to: String,
    pub(super) entry: Value,
    raw: &'t str,
}

impl<'de: 't, 't> Deserialize<'de> for Measured<'t> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let raw = <&'t RawValue>::deserialize(deserializer)?.get();
        let entry: Value = serde_json::from_str(raw).map_err(de::Error::custom)?;
        let end = |name: &str| {
            let text = entry[name].as_str().map(ToOwned::to_owned);
            text.ok_or_else(|| {
                de::Error::custom(format!("a measurement belongs to an arc and needs the place `{name}`"))
            })
        };
        let (from, to) = (end("from")?, end("to")?);
        Ok(Self { from, to, entry, raw })
    }
}

impl<'t> Map<'t> {
    pub(super) fn read(file: &str, text: &'t str) -> Result<Self, Errors> {
        let map: Self = serde_json::from_str(text).map_err(|error| {
            let older = if error.to_string().contains("missing field `coords`") {
                " (or `coord`, in maps of 2017)"
            } else {
                ""
            };
            let place = Some((error.line().max(1), error.column().max(1)));
            let sentence = error.to_string();
            let sentence = sentence.split(" at line ").next().unwrap_or_default();
            vec![
                Message::at("M123", file, place, format!("this is not a map: {sentence}{older}"))
                    .with_source(text),
            ]
        })?;
        let problems = map.problems(file, text);
        if problems.is_empty() { Ok(map) } else { Err(problems.into()) }
    }

    pub(super) fn places(&self) -> BTreeSet<&str> {
        self.nodes.iter().map(|node| node.id.text.as_str()).collect()
    }

    fn problems(&self, file: &str, text: &str) -> Vec<Message> {
        let places = self.places();
        let mut problems = Vec::new();
        let mut wrong = |raw: &str, sentence: String| {
            problems.push(Message::at("M124", file, Some(place(text, raw)), sentence).with_source(text));
        };
        let mut objects: BTreeMap<String, &str> = BTreeMap::new();
        for node in &self.nodes {
            let id = node.id.text.as_str();
            match objects.insert(object(id), id) {
                Some(other) if other == id => {
                    wrong(node.id.raw, format!("the place `{id}` is repeated"));
                }
                Some(other) => {
                    wrong(
                        node.id.raw,
                        format!("`{id}` and `{other}` would be one object in PDDL; rename one"),
                    );
                }
                None if object(id).chars().next().is_none_or(|first| !first.is_ascii_alphabetic()) => {
                    let text = format!("`{id}` cannot name an object of PDDL; it should begin with a letter");
                    wrong(node.id.raw, text);
                }
                None => {}
            }
            if [node.coords.x, node.coords.y].iter().any(|metres| metres.abs() > MAX_NUMBER) {
                let text = format!("a coordinate of `{id}` is beyond {MAX_NUMBER:e} metres; correct it");
                wrong(node.id.raw, text);
            }
            for next in &node.neighbours {
                if !places.contains(next.text.as_str()) {
                    let suggestion = did_you_mean(&next.text, places.iter().copied());
                    wrong(
                        next.raw,
                        format!("`{id}` leads to `{}`, which is not a place{suggestion}", next.text),
                    );
                } else if next.text == id {
                    wrong(next.raw, format!("`{id}` leads to itself"));
                }
            }
        }
        let measured = self.time.iter().chain(&self.hitrate).chain(&self.successrate);
        for entry in measured.filter(|entry| entry.from == entry.to) {
            wrong(entry.raw, format!("this measures the way from `{}` to itself", entry.from));
        }
        for entry in &self.time {
            let measurements = entry.entry.as_object().into_iter().flatten();
            let means = measurements.filter_map(|(name, value)| Some((name, value["mean"].as_f64()?)));
            for (name, _) in means.filter(|(_, mean)| *mean > MAX_NUMBER) {
                wrong(entry.raw, format!("the mean of `{name}` is above {MAX_NUMBER:e} seconds; correct it"));
            }
        }
        problems
    }

    pub(super) fn warnings(&self, file: &str) -> Vec<Message> {
        let mut warnings = Vec::new();
        let mut warn = |text: &str| warnings.push(Message::warning("M132", format!("{file}: {text}")));
        if self.time.is_empty() {
            warn("the map has no measurements of time; each move takes its length at full speed");
        }
        if self.hitrate.is_empty() && self.successrate.is_empty() {
            warn("the map has no probabilities; every move is assumed to succeed without a collision");
        }
        if !self.unsafe_rectangles.is_empty() {
            warn("the rectangles in `unsafe-rects` are ignored; robots follow the arcs");
        }
        if let Some(corridors) = listed(&self.one_ended()) {
            warn(&format!(
                "{corridors}: only one end lists the other; robots are assumed to move in both directions"
            ));
        }
        if let Some(corridors) = listed(&self.ambiguous()) {
            warn(&format!(
                "{corridors}: several measurements differ; the last one is used, in both directions"
            ));
        }
        warnings
    }

    /// Returns the corridors of which only one end lists the other one.
    fn one_ended(&self) -> BTreeSet<(&str, &str)> {
        let ends = self
            .nodes
            .iter()
            .flat_map(|node| node.neighbours.iter().map(|next| (node.id.text.as_str(), next.text.as_str())));
        let ends: BTreeSet<(&str, &str)> = ends.collect();
        ends.iter().copied().filter(|(from, to)| !ends.contains(&(*to, *from))).collect()
    }

    /// Returns the corridors with different measurements of the same quantity, for example in the two directions.
    fn ambiguous(&self) -> BTreeSet<(&str, &str)> {
        let mut ambiguous = BTreeSet::new();
        let lists = [(&self.time, "mean"), (&self.hitrate, "hitrate"), (&self.successrate, "successrate")];
        for (list, field) in lists {
            let mut values: BTreeMap<((&str, &str), &str), f64> = BTreeMap::new();
            for Measured { from, to, entry, .. } in list {
                let corridor = if from <= to { (&from[..], &to[..]) } else { (&to[..], &from[..]) };
                for (design, measurement) in entry.as_object().into_iter().flatten() {
                    let Some(value) = measurement[field].as_f64() else { continue };
                    let earlier = values.insert((corridor, design), value);
                    if earlier.is_some_and(|earlier| (earlier - value).abs() > 0.0) {
                        ambiguous.insert(corridor);
                    }
                }
            }
        }
        ambiguous
    }
}

/// Greatest number of corridors that a warning lists.
const MAX_LISTED: usize = 5;

/// Lists corridors for a warning. Returns `None` for an empty set.
fn listed(corridors: &BTreeSet<(&str, &str)>) -> Option<String> {
    let names = corridors.iter().take(MAX_LISTED).map(|(from, to)| format!("`{from}`-`{to}`"));
    let names: Vec<String> = names.collect();
    let ellipsis = if corridors.len() > MAX_LISTED { ", …" } else { "" };
    (!names.is_empty()).then(|| format!("{}{ellipsis}", names.join(", ")))
}

/// Converts the name of a place or design to a PDDL name: lower case, with `_` in place of each character that
/// is not an ASCII letter or digit.
pub(super) fn object(name: &str) -> String {
    let safe: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    safe.to_ascii_lowercase()
}

fn place(text: &str, part: &str) -> (usize, usize) {
    let offset = (part.as_ptr() as usize).saturating_sub(text.as_ptr() as usize);
    let before = text.get(..offset).unwrap_or_default();
    let last = before.rsplit('\n').next().unwrap_or_default();
    (before.matches('\n').count() + 1, last.chars().count() + 1)
}
