//! Options that select the mission of a command and change its initial situation.

use std::path::PathBuf;

use crate::file::source;
use crate::knowledge::{COADAPTATION, Knowledge, Sources};
use crate::message::{Errors, Message};
use crate::mission::{Bindings, Mission, Names, numbers};
use crate::planner;
use crate::setup::Setup;
use clap::Args;
use ontology::ReadOptions;

use crate::cli::common::{Common, Exit, Failure};
use crate::cli::progress::during;
use crate::cli::values::{existing_directory, setting};

/// Options for the situation to plan for: changes of the initial situation and, for a domain and a problem, the
/// knowledge base. The input files are separate arguments.
#[derive(Debug, Clone, Args)]
pub(super) struct Situation {
    /// A knowledge base for DOMAIN and PROBLEM (OWL; repeatable).
    #[arg(long = "kb", value_name = "FILE")]
    knowledge: Vec<PathBuf>,
    /// Rules for the knowledge base: a file, `coadaptation` or `tomasys` (repeatable; default `coadaptation`).
    #[arg(long = "rules", value_name = "FILE")]
    rules: Vec<String>,
    #[command(flatten)]
    imports: Imports,
    /// Name of an individual of the knowledge base in PROBLEM: `fd_spiral_low=fd_search_low`. A `*` on
    /// both sides matches the same characters: `fd_spiral_*=fd_search_*` (repeatable).
    #[arg(long = "name", value_name = "INDIVIDUAL=OBJECT", value_parser = setting)]
    names: Vec<(String, String)>,
    /// Apply a scenario of the mission's manifest.
    #[arg(long, value_name = "NAME")]
    scenario: Option<String>,
    /// Set a measured attribute, a numeric fluent or a fact: `ambient_light=0.9`, `battery=30`,
    /// `robot_at=wp2` (repeatable).
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    set: Vec<(String, String)>,
    /// Mark a component as failed (repeatable).
    #[arg(long, value_name = "COMPONENT")]
    fail: Vec<String>,
}

/// Options for the locations of imports, which are never read from the network.
#[derive(Debug, Clone, Args)]
pub(super) struct Imports {
    /// An OASIS XML catalog with the locations of imports (repeatable).
    #[arg(long, value_name = "FILE")]
    catalog: Vec<PathBuf>,
    /// Search a directory and its subdirectories for imports (repeatable).
    #[arg(long, value_name = "DIR", value_parser = existing_directory)]
    directory: Vec<PathBuf>,
    /// Continue with a warning if an import is not found.
    #[arg(long)]
    #[allow(clippy::struct_field_names)]
    ignore_missing_imports: bool,
}

impl Imports {
    pub(super) fn options(&self) -> ReadOptions {
        ReadOptions {
            catalogs: self.catalog.clone(),
            directories: self.directory.clone(),
            allow_missing_imports: self.ignore_missing_imports,
            ..ReadOptions::default()
        }
    }
}

impl Situation {
    pub(super) fn of_mission(
        scenario: Option<String>,
        set: Vec<(String, String)>,
        fail: Vec<String>,
    ) -> Self {
        let imports = Imports { catalog: Vec::new(), directory: Vec::new(), ignore_missing_imports: false };
        let (knowledge, rules, names) = (Vec::new(), Vec::new(), Vec::new());
        Self { knowledge, rules, imports, names, scenario, set, fail }
    }

    pub(super) fn is_empty(&self) -> bool {
        !self.adds_knowledge() && self.before().is_none()
    }

    fn adds_knowledge(&self) -> bool {
        let Self { knowledge, rules, imports, names, .. } = self;
        let Imports { catalog, directory, ignore_missing_imports } = imports;
        let has_no_files = knowledge.is_empty() && rules.is_empty() && names.is_empty();
        let is_unused = has_no_files && catalog.is_empty() && directory.is_empty();
        !is_unused || *ignore_missing_imports
    }

    /// Returns these options without scenario, set values and failed components. Returns `None` if
    /// they contain no such changes.
    pub(super) fn before(&self) -> Option<Self> {
        let (scenario, set, fail) = (None, Vec::new(), Vec::new());
        let differs = self.scenario.is_some() || !self.set.is_empty() || !self.fail.is_empty();
        differs.then(|| Self { scenario, set, fail, ..self.clone() })
    }

    pub(super) fn words(&self) -> Vec<String> {
        let scenario = self.scenario.iter().map(|name| format!("scenario {name}"));
        let fail = self.fail.iter().map(|component| format!("{component} has failed"));
        let set = self.set.iter().map(|(name, value)| format!("{name} = {value}"));
        scenario.chain(fail).chain(set).collect()
    }

    pub(super) fn knowledge(&self, documents: &[PathBuf], common: &Common) -> Result<Knowledge, Failure> {
        if !self.knowledge.is_empty() || !self.names.is_empty() || self.scenario.is_some() {
            let text = "with `--configure` the knowledge bases are the arguments, and there is no `--kb`, `--name` or `--scenario`";
            return Err(Failure::usage(Message::error("M107", text)));
        }
        during("reading", common, || knowledge(documents, &self.rules, &self.imports, &self.fail, &self.set))
    }

    pub(super) fn mission(&self, inputs: &[PathBuf], common: &Common) -> Result<Mission, Failure> {
        self.setup(inputs, common).map(|setup| setup.mission)
    }

    pub(super) fn setup(&self, inputs: &[PathBuf], common: &Common) -> Result<Setup, Failure> {
        during("reading", common, || self.read(inputs))
    }

    /// Returns the mission and, if these options change the initial situation, also the mission without these changes.
    pub(super) fn setups(
        &self,
        inputs: &[PathBuf],
        common: &Common,
    ) -> Result<(Setup, Option<Setup>), Failure> {
        during("reading", common, || {
            // Standard input cannot be read twice.
            let mut setup = self.unchanged(inputs)?;
            let before = self.before().map(|options| (options, setup.clone()));
            self.change(&mut setup)?;
            let before = before.map(|(options, mut setup)| options.change(&mut setup).map(|()| setup));
            Ok((setup, before.transpose()?))
        })
    }

    fn read(&self, inputs: &[PathBuf]) -> Result<Setup, Failure> {
        let mut setup = self.unchanged(inputs)?;
        self.change(&mut setup)?;
        Ok(setup)
    }

    fn unchanged(&self, inputs: &[PathBuf]) -> Result<Setup, Failure> {
        Ok(match inputs {
            [manifest] => {
                if self.adds_knowledge() {
                    let text = "`--kb`, `--rules`, `--name` and the options for imports require DOMAIN and \
                                PROBLEM; the manifest of a mission has keys for them";
                    return Err(Failure::usage(Message::error("M107", text)));
                }
                Setup::read(manifest)?
            }
            [domain, problem] => {
                if self.scenario.is_some() {
                    let text = "`--scenario` requires a mission's manifest";
                    return Err(Failure::usage(Message::error("M107", text)));
                }
                for (option, given) in
                    [("--rules", !self.rules.is_empty()), ("--name", !self.names.is_empty())]
                {
                    if self.knowledge.is_empty() && given {
                        let text = format!("`{option}` requires `--kb`");
                        return Err(Failure::usage(Message::error("M107", text)));
                    }
                }
                let mut names = Names::default();
                self.names.iter().for_each(|(individual, object)| names.add(individual, object, None));
                let (domain, problem) = (source(domain), source(problem));
                let text = domain.as_ref().map_or("", |domain| domain.text());
                let knowledge = (!self.knowledge.is_empty()).then(|| {
                    let rules = if self.rules.is_empty() {
                        vec![COADAPTATION.to_owned()]
                    } else {
                        self.rules.clone()
                    };
                    let (documents, options) = (self.knowledge.clone(), self.imports.options());
                    Knowledge::read_for(&Sources { documents, rules, options, ..Sources::default() }, text)
                });
                let bindings = Bindings::default().naming(names);
                Mission::new("", knowledge, bindings, domain, problem)?.into()
            }
            _ => {
                let text = "give a mission's manifest, or a domain and a problem";
                return Err(Failure::usage(Message::error("M107", text)));
            }
        })
    }

    /// Applies the scenario, the failures and the settings.
    fn change(&self, setup: &mut Setup) -> Result<(), Failure> {
        if let Some(name) = &self.scenario {
            setup.apply(name).map_err(scenario_failure)?;
        }
        let mission = &mut setup.mission;
        for component in &self.fail {
            mission.fail(component).map_err(Failure::usage)?;
        }
        for (name, value) in &self.set {
            mission.set(name, value).map_err(Failure::usage)?;
        }
        consistent(mission.knowledge())?;
        numbers::note_doubts(mission);
        Ok(())
    }
}

/// Chooses the exit status of errors in a scenario. A scenario that does not exist or cannot be simulated
/// (M108) is a usage error. One that does not fit the mission is bad input.
pub(super) fn scenario_failure(messages: Errors) -> Failure {
    let is_usage = messages.iter().any(|message| message.code == "M108");
    Failure { exit: if is_usage { Exit::Usage } else { Exit::BadInput }, messages }
}

pub(super) fn knowledge(
    documents: &[PathBuf],
    rules: &[String],
    imports: &Imports,
    fail: &[String],
    set: &[(String, String)],
) -> Result<Knowledge, Failure> {
    let (documents, rules) = (documents.to_vec(), rules.to_vec());
    let sources = Sources { documents, rules, options: imports.options(), ..Sources::default() };
    let mut knowledge = Knowledge::read(&sources)?;
    let mut wrong: Vec<Message> =
        fail.iter().filter_map(|component| knowledge.fail(component).err()).collect();
    wrong.extend(set.iter().filter_map(|(attribute, value)| knowledge.measure(attribute, value).err()));
    if wrong.is_empty() { Ok(knowledge) } else { Err(Failure { exit: Exit::Usage, messages: wrong.into() }) }
}

pub(super) fn consistent(knowledge: Option<&Knowledge>) -> Result<(), Failure> {
    planner::consistent(knowledge).map_err(|messages| Failure { exit: Exit::Inconsistent, messages })
}
