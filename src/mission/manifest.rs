//! The manifest of a mission: which files it is made of, how symbols are bound, and its scenarios.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use num_rational::BigRational;
use ontology::ReadOptions;
use serde::Deserialize;

use crate::knowledge::{COADAPTATION, Sources, TOMASYS};
use crate::mapek::{Settings, number};
use crate::message::{Message, did_you_mean};
use crate::mission::binding::Bindings;
use crate::mission::kind::{self, Kind};
use crate::mission::source;
use crate::simulate::Simulation;

/// A manifest; paths in it are relative to the manifest.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// The mission's name.
    pub name: String,
    /// What it is about, in a sentence.
    #[serde(default)]
    pub description: String,
    knowledge: KnowledgeSection,
    planning: PlanningSection,
    /// PDDL symbol to query, beyond the defaults.
    #[serde(default)]
    bindings: BTreeMap<String, String>,
    #[serde(default)]
    adaptation: AdaptationSection,
    /// The symbols of the co-adaptation process, where they differ from the defaults.
    #[serde(default)]
    pub probabilistic: crate::comparison::Roles,
    /// Situations by name.
    #[serde(default)]
    pub scenarios: BTreeMap<String, Scenario>,
    #[serde(skip)]
    directory: PathBuf,
    #[serde(skip)]
    file: String,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct KnowledgeSection {
    files: Vec<PathBuf>,
    #[serde(default = "shipped_rules")]
    rules: Vec<String>,
    #[serde(default)]
    catalogs: Vec<PathBuf>,
    #[serde(default)]
    directories: Vec<PathBuf>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlanningSection {
    domain: PathBuf,
    problem: PathBuf,
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct AdaptationSection {
    minimum_benefit: Option<toml::Value>,
    settle: Option<toml::Value>,
    time_limit: Option<toml::Value>,
    #[serde(default)]
    stay_close: bool,
}

/// A situation: what has failed, and what has changed.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// What happens, in a sentence.
    #[serde(default)]
    pub description: String,
    /// Components that have failed.
    #[serde(default)]
    pub fail: Vec<String>,
    /// Measured attributes, fluents and facts by name, as for `--set`; strings, numbers or truth values.
    #[serde(default)]
    pub set: BTreeMap<String, toml::Value>,
    /// What a simulated robot meets.
    #[serde(default)]
    pub simulation: Option<Simulation>,
}

fn shipped_rules() -> Vec<String> {
    vec![COADAPTATION.to_owned()]
}

impl Manifest {
    /// Reads a manifest; `-` is standard input, and paths are relative to the current directory then.
    ///
    /// # Errors
    /// The file cannot be read, or is no manifest.
    pub fn read(file: &Path) -> Result<Self, Message> {
        let source = source(file)?;
        let (name, text) = (source.name().to_owned(), source.text());
        kind::expect(Kind::Manifest, &name, text)?;
        let mut manifest: Self = toml::from_str(text).map_err(|error| {
            let place = error.span().map(|span| line_and_column(text, span.start));
            Message::at("M104", &name, place, error.message().to_owned() + &meant(error.message()))
        })?;
        manifest.directory = file.parent().map(Path::to_owned).unwrap_or_default();
        manifest.file = name;
        Ok(manifest)
    }

    fn path(&self, path: &Path) -> PathBuf {
        self.directory.join(path)
    }

    /// The manifest's own name.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The knowledge base's files.
    pub fn sources(&self) -> Sources {
        let knowledge = &self.knowledge;
        let all = |paths: &[PathBuf]| paths.iter().map(|path| self.path(path)).collect();
        let rule = |name: &String| match name.as_str() {
            COADAPTATION | TOMASYS => name.clone(),
            path => self.path(Path::new(path)).display().to_string(),
        };
        Sources {
            documents: all(&knowledge.files),
            rules: knowledge.rules.iter().map(rule).collect(),
            options: ReadOptions {
                catalogs: all(&knowledge.catalogs),
                directories: all(&knowledge.directories),
                ..ReadOptions::default()
            },
            ..Sources::default()
        }
    }

    /// The domain file.
    pub fn domain(&self) -> PathBuf {
        self.path(&self.planning.domain)
    }

    /// The problem file.
    pub fn problem(&self) -> PathBuf {
        self.path(&self.planning.problem)
    }

    /// How eager the adaptation loop is.
    ///
    /// # Errors
    /// A value that is no number, or negative.
    pub fn settings(&self) -> Result<Settings, Message> {
        let section = &self.adaptation;
        let mut settings = Settings { stay_close: section.stay_close, ..Settings::default() };
        if let Some(value) = &section.minimum_benefit {
            settings.minimum_benefit = self.number("minimum_benefit", value)?;
        }
        let seconds = |name: &str, value: &toml::Value| {
            let number = self.number(name, value)?;
            let wrong = || Message::at("M105", &self.file, None, format!("`{name}` is too long"));
            Duration::try_from_secs_f64(number::to_f64(&number)).map_err(|_| wrong())
        };
        if let Some(value) = &section.settle {
            settings.settle = seconds("settle", value)?;
        }
        if let Some(value) = &section.time_limit {
            settings.time_limit = Some(seconds("time_limit", value)?);
        }
        Ok(settings)
    }

    fn number(&self, name: &str, value: &toml::Value) -> Result<BigRational, Message> {
        let text = match value {
            toml::Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        let number = number::exact(&text).filter(|number| *number >= BigRational::default());
        number.ok_or_else(|| {
            let text = format!("`{name}` is {value}, but should be a decimal number, not negative");
            Message::at("M105", &self.file, None, text)
        })
    }

    /// The bindings, the defaults among them.
    ///
    /// # Errors
    /// A query that is none.
    pub fn bindings(&self) -> Result<Bindings, Message> {
        Bindings::with(&self.bindings).map_err(|message| Message::at("M105", &self.file, None, message))
    }
}

/// Which key was meant, where the message of the parser lists those that there are.
fn meant(message: &str) -> String {
    let mut quoted = message.split('`').skip(1).step_by(2);
    match (message.starts_with("unknown field"), quoted.next()) {
        (true, Some(written)) => did_you_mean(written, quoted),
        _ => String::new(),
    }
}

fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().map_or(0, |last| last.chars().count()) + 1;
    (line, column)
}
