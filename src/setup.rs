//! Reads a manifest with all its sections: the mission, its scenarios, and the settings for adaptation, comparison,
//! simulation and pictures.
//!
//! Each module defines its own section. `Sections` joins the sections, so that a key which no
//! section defines is rejected.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use pddl::ast::Name;
use schemars::{JsonSchema, Schema, schema_for};
use serde::Deserialize;

use crate::comparison::Roles;
use crate::file::source;
use crate::knowledge::{COADAPTATION, Knowledge, TOMASYS};
use crate::manifest::{self, Key, ManifestPath, Part};
use crate::mapek::{AdaptationSection, Settings};
use crate::message::{Errors, Message, did_you_mean};
use crate::mission::{
    BindingsSection, KnowledgeSection, Mission, Mistake, PlanningSection, Scenario, TimeUnit,
};
use crate::report::{Positions, ReportSection};
use crate::simulate::{Experiment, Simulation};

/// All sections of a manifest.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Sections {
    /// Name of the mission.
    name: String,
    /// Description of the mission in one sentence.
    #[serde(default)]
    description: String,
    /// The knowledge base.
    knowledge: KnowledgeSection,
    /// The PDDL files.
    planning: PlanningSection,
    /// Query of a PDDL symbol that differs from the default; the table `names` is for individuals.
    #[serde(default)]
    bindings: BindingsSection,
    /// Settings of the adaptation loop.
    #[serde(default)]
    adaptation: AdaptationSection,
    /// The symbols and parameters of the probabilistic process, for `compare` and for `export` to PRISM and JANI.
    #[serde(default)]
    probabilistic: Roles,
    /// Settings for pictures.
    #[serde(default)]
    report: ReportSection,
    /// Scenarios by name.
    #[serde(default)]
    scenarios: BTreeMap<String, Scenario<Simulation>>,
}

/// A mission with all settings of its manifest.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The mission.
    pub mission: Mission,
    /// Description of the mission in one sentence.
    pub description: String,
    /// Settings of the adaptation loop.
    pub settings: Settings,
    /// Unit of the times in the domain, e.g. of durations.
    pub time_unit: TimeUnit,
    /// PDDL symbols and parameters from which the co-adaptation process (Markov decision process of the mission) is
    /// built.
    pub roles: Roles,
    /// Scenarios by name.
    pub scenarios: BTreeMap<String, Scenario<Simulation>>,
    report: ReportSection,
    files: Vec<PathBuf>,
    origin: ManifestPath,
}

impl Setup {
    /// Reads a manifest with its knowledge base, domain and problem.
    ///
    /// ```
    /// use std::path::Path;
    /// use metaplan::setup::Setup;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let setup = Setup::read(Path::new("missions/ugv.toml"))?;
    /// assert_eq!(setup.mission.name, "ugv");
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// The faults of the manifest's text; otherwise those of its settings, bindings and the files that are read; otherwise
    /// names in the settings of filters that the knowledge base does not have, and faults of the section
    /// `probabilistic`. Faulty settings hide faults that only the whole mission shows. Scenarios are not checked; see
    /// [`Setup::mistakes`].
    pub fn read(manifest: &Path) -> Result<Self, Errors> {
        let (sections, origin) = manifest::read(manifest)?;
        Self::of(sections, origin)
    }

    /// Parses the text of a manifest and reads its knowledge base, domain and problem. Their paths are relative to
    /// `directory`. Messages use `name` as the file name of the manifest.
    ///
    /// # Errors
    /// The errors of [`Setup::read`].
    pub fn parse(name: &str, text: &str, directory: &Path) -> Result<Self, Errors> {
        let (sections, origin) = manifest::parse(name, text, directory)?;
        Self::of(sections, origin)
    }

    fn of(sections: Sections, origin: ManifestPath) -> Result<Self, Errors> {
        let (settings, bindings) =
            (sections.adaptation.settings(&origin), sections.bindings.bindings(&origin));
        let mut wrong: Vec<Message> = settings.as_ref().err().into_iter().cloned().collect();
        wrong.extend(bindings.as_ref().err().into_iter().flatten().cloned());
        let (domain, problem) =
            (origin.path(&sections.planning.domain), origin.path(&sections.planning.problem));
        let mut files = vec![domain.clone(), problem.clone()];
        files.extend(sections.report.file(&origin));
        let (domain, problem) = (source(&domain), source(&problem));
        let text = domain.as_ref().map_or("", |domain| domain.text());
        let knowledge = Knowledge::read_for(&sections.knowledge.sources(&origin), text);
        let mission = match (settings, bindings) {
            (Ok(settings), Ok(bindings)) => {
                Mission::new(&sections.name, Some(knowledge), bindings, domain, problem)
                    .map(|mission| (mission, settings))
            }
            // With faulty settings or bindings, the mission is not built. Only the faults of its files are added.
            _ => {
                Err(knowledge.err().into_iter().flatten().chain(domain.err()).chain(problem.err()).collect())
            }
        };
        let (mut mission, settings) = mission.map_err(|more| {
            wrong.extend(origin.quote(more));
            wrong
        })?;
        let mut mistakes: Vec<Message> =
            settings.check(mission.knowledge(), &origin).err().into_iter().flatten().collect();
        let of_process = sections.probabilistic.mistakes(&mission).into_iter().map(|(key, message)| {
            let place = origin.place_of(&["probabilistic".into(), key.into()], Part::Value);
            Message::at(&message.code, origin.file(), place, message.message.clone())
        });
        mistakes.extend(origin.quote(of_process));
        Errors::unless_empty(mistakes)?;
        mission.change_warnings(|warnings| origin.quote(warnings));
        let Sections { description, planning, probabilistic: roles, report, scenarios, .. } = sections;
        let time_unit = planning.time_unit;
        let settings = settings.with_time_unit(time_unit);
        files.extend(mission.knowledge().into_iter().flat_map(files_of));
        Ok(Self { mission, description, settings, time_unit, roles, scenarios, report, files, origin })
    }

    /// Applies a scenario of the manifest to the mission of this setup. Settings that fit the mission are applied even
    /// if others do not fit.
    ///
    /// # Errors
    /// M108 if the scenario does not exist; otherwise all settings of the scenario that do not fit the mission.
    pub fn apply(&mut self, scenario: &str) -> Result<(), Errors> {
        let Some(found) = self.scenarios.get(scenario) else { return Err(self.no_scenario(scenario).into()) };
        let mistakes = found.mistakes(&mut self.mission);
        Errors::unless_empty(mistakes.into_iter().map(|mistake| self.in_scenario(scenario, mistake)))
    }

    /// Prepares the simulation of a scenario: the mission in the scenario's situation, with the
    /// environment of the simulated robot.
    ///
    /// # Errors
    /// M108 if the scenario does not exist or has no section `simulation`; otherwise faults of the mission's problem;
    /// otherwise all faults of the scenario and its simulation.
    pub fn experiment(&self, scenario: &str) -> Result<Experiment, Errors> {
        let Some(found) = self.scenarios.get(scenario) else {
            return Err(self.not_simulated(scenario, "there is none of that name").into());
        };
        let Some(simulation) = &found.simulation else {
            return Err(self.not_simulated(scenario, "its scenario has no `simulation` section").into());
        };
        self.mission.filled()?;
        let (mission, mistakes) = self.situation(scenario, found);
        Errors::unless_empty(mistakes)?;
        Experiment::new(mission, self.settings.clone(), simulation.clone(), self.time_unit)
    }

    /// Returns all faults of the scenarios, each with its position in the manifest. If the mission's problem is faulty
    /// itself, PDDL faults are omitted.
    pub fn mistakes(&self) -> Vec<Message> {
        self.scenarios.iter().flat_map(|(name, scenario)| self.situation(name, scenario).1).collect()
    }

    fn situation(&self, name: &str, scenario: &Scenario<Simulation>) -> (Mission, Vec<Message>) {
        let mut mission = self.mission.clone();
        let is_sound = mission.filled().is_ok();
        let mut mistakes = scenario.mistakes(&mut mission);
        if let Some(simulation) = &scenario.simulation {
            let simulation_mistakes = simulation.mistakes(&mission).into_iter();
            let simulation_mistakes = simulation_mistakes.filter(|mistake| is_sound || !mistake.is_of_pddl());
            let below = |mistake: Mistake| {
                let path = std::iter::once(Key::from("simulation")).chain(mistake.path).collect();
                Mistake { path, ..mistake }
            };
            mistakes.extend(simulation_mistakes.map(below));
        }
        (mission, mistakes.into_iter().map(|mistake| self.in_scenario(name, mistake)).collect())
    }

    fn no_scenario(&self, name: &str) -> Message {
        let names: Vec<_> = self.scenarios.keys().map(String::as_str).collect();
        let text = format!(
            "the mission has no scenario `{name}`; it has: {}{}",
            names.join(", "),
            did_you_mean(name, names.iter().copied())
        );
        Message::error("M108", text)
    }

    fn not_simulated(&self, name: &str, why: &str) -> Message {
        let simulated = self.scenarios.iter().filter(|(_, scenario)| scenario.simulation.is_some());
        let names: Vec<&str> = simulated.map(|(name, _)| name.as_str()).collect();
        let alternatives = if names.is_empty() {
            "no scenario of this mission can".to_owned()
        } else {
            format!("these can: {}", names.join(", "))
        };
        let suggestion = did_you_mean(name, names.iter().copied());
        Message::error("M108", format!("`{name}` cannot be simulated: {why}; {alternatives}{suggestion}"))
    }

    /// Reads the coordinates of places for pictures, from the section `report` of the manifest.
    ///
    /// # Errors
    /// The file of positions cannot be read or is faulty, or the domain does not have the functions of positions.
    pub fn positions(&self) -> Result<Positions, Errors> {
        let positions = self.report.positions(&self.origin)?;
        if let Positions::Functions(functions) = &positions {
            Errors::unless_empty(self.origin.quote(self.unknown_functions(functions)))?;
        }
        Ok(positions)
    }

    fn unknown_functions(&self, functions: &[String; 2]) -> Vec<Message> {
        let of_places =
            self.mission.domain().functions.iter().filter(|function| function.parameters.len() == 1);
        let names: Vec<&Name> = of_places.map(|function| &function.identifier.name).collect();
        let mut wrong = Vec::new();
        for (index, function) in functions.iter().enumerate() {
            let name = Name::new(function);
            if !names.contains(&&name) {
                let path: [Key; 3] = ["report".into(), "positions".into(), index.into()];
                let place = self.origin.place_of(&path, Part::Value);
                let suggestion = did_you_mean(function, names.iter().map(|other| other.as_str()));
                let text = format!(
                    "the domain has no function `{function}` with one parameter (a place){suggestion}"
                );
                wrong.push(Message::at("M141", self.file(), place, text));
            }
        }
        wrong
    }

    fn in_scenario(&self, name: &str, Mistake { path, part, message }: Mistake) -> Message {
        let path: Vec<Key> = ["scenarios".into(), name.into()].into_iter().chain(path).collect();
        let text = format!("scenario `{name}`: {}", message.message);
        let wrong = Message::at(&message.code, self.file(), self.origin.place_of(&path, part), text);
        let wrong = match &message.help {
            Some(help) => wrong.with_help(help),
            None => wrong,
        };
        self.origin.quote([wrong]).swap_remove(0)
    }

    /// Returns the paths of the files that the manifest names: PDDL files, knowledge bases with their imports,
    /// rules, catalogs and the positions of places. IRIs denote embedded knowledge bases. Empty for a mission without a
    /// manifest.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// Returns the name of the manifest's file; empty for a mission without a manifest.
    pub fn file(&self) -> &str {
        self.origin.file()
    }
}

fn files_of(knowledge: &Knowledge) -> Vec<PathBuf> {
    let sources = knowledge.sources();
    let rules = sources.rules.iter().filter(|rule| ![COADAPTATION, TOMASYS].contains(&rule.as_str()));
    let named = knowledge.documents().iter().chain(rules).map(PathBuf::from);
    named.chain(sources.options.catalogs.iter().cloned()).collect()
}

/// Returns the JSON Schema of a manifest.
pub fn schema() -> Schema {
    schema_for!(Sections)
}

/// A setup for a mission without a manifest, with default settings.
impl From<Mission> for Setup {
    fn from(mission: Mission) -> Self {
        Self {
            mission,
            description: String::new(),
            settings: Settings::default(),
            time_unit: TimeUnit::default(),
            roles: Roles::default(),
            scenarios: BTreeMap::new(),
            report: ReportSection::default(),
            files: Vec::new(),
            origin: ManifestPath::default(),
        }
    }
}
