//! Coordinates of places for the map, from the section `report` of a manifest.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use num_traits::ToPrimitive as _;
use pddl::ast::{InitialElement, Name, Problem};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::file::source;
use crate::manifest::ManifestPath;
use crate::message::{Errors, Message};

/// The section `report` of a manifest: where the coordinates of places come from.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReportSection {
    /// Positions of places: a CSV file with lines `place,x,y`, or two functions of places, `["x",
    /// "y"]`; y points upwards.
    positions: Option<Written>,
}

/// Source of the positions of places.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "the name of a CSV file (place,x,y), or two functions of places: [\"x\", \"y\"]"
)]
enum Written {
    File(PathBuf),
    Functions([String; 2]),
}

/// Coordinates of the places of a mission.
#[derive(Debug, Clone, Default)]
pub enum Positions {
    /// No coordinates are given.
    #[default]
    Unknown,
    /// Names of two numeric functions of the problem, which give the x and the y coordinate of a
    /// place.
    Functions([String; 2]),
    /// Coordinates of each place by name: x to the right, y upwards.
    Known(BTreeMap<Name, (f64, f64)>),
}

impl ReportSection {
    /// Returns the path of the file with positions, if the section names one.
    pub fn file(&self, origin: &ManifestPath) -> Option<PathBuf> {
        match &self.positions {
            Some(Written::File(file)) => Some(origin.path(file)),
            _ => None,
        }
    }

    /// Reads the coordinates of places.
    ///
    /// # Errors
    /// The file cannot be read or is not CSV; otherwise all lines that are not coordinates or
    /// repeat a place.
    pub fn positions(&self, origin: &ManifestPath) -> Result<Positions, Errors> {
        match &self.positions {
            None => Ok(Positions::Unknown),
            Some(Written::Functions(functions)) => Ok(Positions::Functions(functions.clone())),
            Some(Written::File(file)) => read(&origin.path(file)).map(Positions::Known),
        }
    }
}

impl Positions {
    /// Returns coordinates by name, or `None` if those of one of `places` are unknown.
    pub(super) fn of(&self, problem: &Problem, places: &[Name]) -> Option<BTreeMap<Name, (f64, f64)>> {
        let coordinates = match self {
            Self::Unknown => return None,
            Self::Known(coordinates) => coordinates.clone(),
            Self::Functions([x, y]) => {
                let (x, y) = (values(problem, x), values(problem, y));
                x.into_iter().filter_map(|(place, x)| Some((place.clone(), (x, *y.get(&place)?)))).collect()
            }
        };
        places.iter().all(|place| coordinates.contains_key(place)).then_some(coordinates)
    }
}

fn values(problem: &Problem, function: &str) -> BTreeMap<Name, f64> {
    let function = Name::new(function);
    let value = |element: &InitialElement| match element {
        InitialElement::Value(atom, value, _) if atom.predicate.name == function => match &atom.arguments[..]
        {
            [place] => Some((place.name().clone(), value.to_f64()?)),
            _ => None,
        },
        _ => None,
    };
    problem.init.iter().filter_map(value).collect()
}

/// Reads a CSV file with lines `place,x,y`. A first line without numbers is a heading; lines that
/// begin with `#` are comments.
fn read(file: &Path) -> Result<BTreeMap<Name, (f64, f64)>, Errors> {
    let source = source(file)?;
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(source.text().as_bytes());
    let (mut positions, mut wrong) = (BTreeMap::new(), Vec::new());
    for record in reader.records() {
        let record =
            record.map_err(|error| vec![Message::at("M141", source.name(), None, error.to_string())])?;
        let line = record.position().map_or(1, |position| position.line() as usize);
        let coordinate =
            |field: usize| record.get(field)?.parse::<f64>().ok().filter(|value| value.is_finite());
        let is_heading = line == 1 && coordinate(1).is_none() && coordinate(2).is_none();
        match (record.get(0), coordinate(1), coordinate(2), record.len()) {
            (Some(place), Some(x), Some(y), 3) => {
                if positions.insert(Name::new(place), (x, y)).is_some() {
                    let text = format!("`{place}` has a position already");
                    wrong.push(
                        Message::at("M141", source.name(), Some((line, 1)), text).with_source(source.text()),
                    );
                }
            }
            _ if is_heading => {}
            _ => {
                let text = "a position is `place,x,y`, the last two numbers";
                wrong.push(
                    Message::at("M141", source.name(), Some((line, 1)), text).with_source(source.text()),
                );
            }
        }
    }
    if wrong.is_empty() { Ok(positions) } else { Err(wrong.into()) }
}
