//! The sections of a manifest about the mission: `knowledge`, `planning`, `bindings` and
//! `scenarios`.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use ::mission::{Bindings, Mission, Names};
use ontology::ReadOptions;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use toml::Spanned;

use crate::knowledge::{COADAPTATION, Sources, TOMASYS};
use crate::manifest::{Key, ManifestPath, Part};
use crate::message::{Errors, Message};
use crate::mission::conditions;

/// The section `knowledge` of a manifest; paths are relative to the manifest.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KnowledgeSection {
    /// OWL documents.
    files: Vec<PathBuf>,
    /// Rule files, or `coadaptation`, `tomasys`.
    #[serde(default = "shipped_rules")]
    rules: Vec<String>,
    /// Catalogs of IRIs, which are searched first for imports.
    #[serde(default)]
    catalogs: Vec<PathBuf>,
    /// Directories to search for imports.
    #[serde(default)]
    directories: Vec<PathBuf>,
}

fn shipped_rules() -> Vec<String> {
    vec![COADAPTATION.to_owned()]
}

impl KnowledgeSection {
    /// Returns the files of the section, with paths resolved relative to the manifest.
    pub fn sources(&self, origin: &ManifestPath) -> Sources {
        let resolve = |paths: &[PathBuf]| paths.iter().map(|path| origin.path(path)).collect();
        let rule = |name: &String| match name.as_str() {
            COADAPTATION | TOMASYS => name.clone(),
            path => origin.path(Path::new(path)).display().to_string(),
        };
        Sources {
            documents: resolve(&self.files),
            rules: self.rules.iter().map(rule).collect(),
            options: ReadOptions {
                catalogs: resolve(&self.catalogs),
                directories: resolve(&self.directories),
                ..ReadOptions::default()
            },
            ..Sources::default()
        }
    }
}

/// The section `planning`; paths are relative to the manifest.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlanningSection {
    /// The domain file.
    pub domain: PathBuf,
    /// The problem file.
    pub problem: PathBuf,
    /// Time unit of the domain: `seconds`, `minutes` or `hours`. It converts expected durations of actions,
    /// and the times of simulations, to the loop's clock in seconds.
    #[serde(default)]
    pub time_unit: TimeUnit,
}

/// The unit of a domain's times.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum TimeUnit {
    /// Seconds, as in robots and most domains.
    #[default]
    Seconds,
    /// 60 seconds.
    Minutes,
    /// 3600 seconds.
    Hours,
}

impl TimeUnit {
    /// Returns the number of seconds in this unit.
    pub fn seconds(self) -> f64 {
        match self {
            Self::Seconds => 1.0,
            Self::Minutes => 60.0,
            Self::Hours => 3600.0,
        }
    }
}

impl fmt::Display for TimeUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Seconds => "seconds",
            Self::Minutes => "minutes",
            Self::Hours => "hours",
        })
    }
}

/// The section `bindings` of a manifest: queries that define PDDL symbols, and names of
/// individuals.
#[derive(Debug, Clone, Default)]
pub struct BindingsSection {
    /// Query of each bound PDDL symbol, in addition to the default bindings or in place of them.
    symbols: BTreeMap<String, Spanned<String>>,
    /// Individuals with the names of their objects in PDDL. The span of an individual is its
    /// position in the manifest.
    names: Vec<(Spanned<String>, String)>,
}

impl BindingsSection {
    /// Parses the queries of the section and returns the bindings.
    ///
    /// # Errors
    /// All malformed queries.
    pub fn bindings(&self, origin: &ManifestPath) -> Result<Bindings, Errors> {
        let mut names = Names::default();
        for (individual, object) in &self.names {
            let place = (origin.file().to_owned(), Some(origin.place(individual.span().start)));
            names.add(individual.get_ref(), object, Some(place));
        }
        let error_of = |(symbol, query): (&String, &Spanned<String>)| {
            let binding = BTreeMap::from([(symbol.clone(), query.get_ref().clone())]);
            Bindings::with(&binding).err().map(|text| origin.wrong(query.span().start, text))
        };
        let wrong: Vec<Message> = self.symbols.iter().filter_map(error_of).collect();
        let symbols = self.symbols.iter().map(|(symbol, query)| (symbol.clone(), query.get_ref().clone()));
        let places = self.symbols.iter().map(|(symbol, query)| {
            (symbol.clone(), (origin.file().to_owned(), Some(origin.place(query.span().start))))
        });
        match Bindings::with(&symbols.collect()) {
            Ok(bindings) if wrong.is_empty() => Ok(bindings.naming(names).placed(places.collect())),
            _ => Err(wrong.into()),
        }
    }
}

impl JsonSchema for BindingsSection {
    fn schema_name() -> Cow<'static, str> {
        "BindingsSection".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "type": "object",
            "description": "Queries of PDDL symbols, and the table `names` with the names of individuals in the problem.",
            "properties": { "names": { "type": "object", "additionalProperties": { "type": "string" } } },
            "additionalProperties": { "type": "string" }
        })
    }
}

impl<'de> Deserialize<'de> for BindingsSection {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(Section)
    }
}

struct Section;

impl<'de> Visitor<'de> for Section {
    type Value = BindingsSection;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("PDDL symbols with queries, and the table `names`")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<BindingsSection, A::Error> {
        let mut section = BindingsSection::default();
        while let Some(symbol) = map.next_key::<String>()? {
            let value: Spanned<Bound> = map.next_value()?;
            let span = value.span();
            match value.into_inner() {
                Bound::Query(query) => {
                    section.symbols.insert(symbol, Spanned::new(span, query));
                }
                Bound::Names(names) if symbol == "names" => section.names = names,
                Bound::Names(_) => {
                    let text =
                        format!("`{symbol}` is a table; a symbol is bound to a query, which is a string");
                    return Err(de::Error::custom(text));
                }
            }
        }
        Ok(section)
    }
}

enum Bound {
    Query(String),
    Names(Vec<(Spanned<String>, String)>),
}

impl<'de> Deserialize<'de> for Bound {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(QueryOrNames)
    }
}

struct QueryOrNames;

impl<'de> Visitor<'de> for QueryOrNames {
    type Value = Bound;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a query, or in `names` a table of individuals and objects")
    }

    fn visit_str<E: de::Error>(self, query: &str) -> Result<Bound, E> {
        Ok(Bound::Query(query.to_owned()))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Bound, A::Error> {
        let mut names = Vec::new();
        while let Some(entry) = map.next_entry()? {
            names.push(entry);
        }
        Ok(Bound::Names(names))
    }
}

/// A situation: failed components, changed values, and the simulated environment, which is not part of the mission.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario<S> {
    /// Description of the scenario in one sentence.
    #[serde(default)]
    pub description: String,
    /// Components that have failed.
    #[serde(default)]
    pub fail: Vec<String>,
    /// Measured attributes, fluents and facts by name, as for `--set`; values are strings, numbers or truth values.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub set: BTreeMap<String, toml::Value>,
    /// Simulated environment of the robot.
    pub simulation: Option<S>,
}

/// A mistake in a part of a section, with its place.
#[derive(Debug, Clone)]
pub struct Mistake {
    /// Keys that lead to the mistaken entry, relative to the section.
    pub path: Vec<Key>,
    /// Mistaken part of the entry at the end of the path: its key, its value, or a position inside.
    pub part: Part,
    /// Message about the mistake.
    pub message: Message,
}

impl Mistake {
    /// Returns `true` if the PDDL checker found the mistake. If the mission's own files are faulty, such a
    /// mistake may be in these files.
    pub fn is_of_pddl(&self) -> bool {
        self.message.code.starts_with('P')
    }
}

impl<S> Scenario<S> {
    /// Applies the settings of the scenario to a mission. A setting that does not fit the mission does not prevent the
    /// others.
    ///
    /// # Errors
    /// All settings that do not fit the mission; see [`Scenario::mistakes`].
    pub fn apply(&self, mission: &mut Mission) -> Result<(), Errors> {
        Errors::unless_empty(self.mistakes(mission).into_iter().map(|mistake| mistake.message))
    }

    /// Applies the scenario as [`Scenario::apply`] does. Returns a mistake, with its position, for each setting that
    /// does not fit the mission. If the mission's own files are faulty, PDDL mistakes are omitted.
    pub fn mistakes(&self, mission: &mut Mission) -> Vec<Mistake> {
        let mut mistakes = Vec::new();
        // If the mission's own files are faulty, errors of PDDL may not be caused by the settings.
        let is_sound = mission.filled().is_ok();
        for (index, component) in self.fail.iter().enumerate() {
            let wrong = mission.fail(component).err();
            mistakes.extend(wrong.map(|message| Mistake {
                path: vec!["fail".into(), index.into()],
                part: Part::Value,
                message,
            }));
        }
        for (name, value) in &self.set {
            let value = match value {
                toml::Value::String(text) => text.clone(),
                other => other.to_string(),
            };
            let path = || vec!["set".into(), name.as_str().into()];
            mistakes
                .extend(setting(mission, name, &value, path).filter(|wrong| is_sound || !wrong.is_of_pddl()));
        }
        mistakes
    }
}

/// Sets a value of a mission by name. Returns the mistake in the setting, if any; the value may be set nevertheless.
/// `path` gives the keys of the setting in the manifest.
pub fn setting(
    mission: &mut Mission,
    name: &str,
    value: &str,
    path: impl FnOnce() -> Vec<Key>,
) -> Option<Mistake> {
    if let Err(message) = mission.set(name, value) {
        let part = if message.code == "M102" { Part::Value } else { Part::Key };
        return Some(Mistake { path: path(), part, message });
    }
    let wrong = conditions::setting(mission, name, value)?;
    Some(Mistake { path: path(), part: Part::Value, message: wrong })
}
