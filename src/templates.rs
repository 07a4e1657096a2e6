//! Templates of missions: small, commented, and solvable without changes.

use std::io;
use std::path::Path;

use ontology::kb;
use planner::shipped;

use crate::file::create_directory;

/// Name of the manifest's file in every template.
pub const MANIFEST: &str = "mission.toml";

/// File name of the JSON Schema of manifests, with which editors complete keys.
pub const SCHEMA: &str = "mission.schema.json";

/// A template of a mission.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Template {
    /// A mission with one function, two designs and one action.
    Blank,
    /// The ground vehicle of the Metaplan paper, with a plain domain.
    Ugv,
    /// A robot with an arm in a warehouse: two functions with three designs each, a battery, a
    /// charger, a dark aisle.
    Warehouse,
}

impl Template {
    /// All templates.
    pub const ALL: [Self; 3] = [Self::Blank, Self::Ugv, Self::Warehouse];

    /// Returns the name of the template.
    pub fn name(self) -> &'static str {
        match self {
            Self::Blank => "blank",
            Self::Ugv => "ugv",
            Self::Warehouse => "warehouse",
        }
    }

    /// Returns the names and texts of the template's files. `mission` becomes the mission's name,
    /// `schema` is the text of the JSON Schema of manifests.
    pub fn files(self, mission: &str, schema: &str) -> Vec<(&'static str, String)> {
        let texts: &[(&str, &str)] = match self {
            Self::Blank => &[
                (MANIFEST, include_str!("../missions/templates/blank/mission.toml")),
                ("domain.pddl", include_str!("../missions/templates/blank/domain.pddl")),
                ("problem.pddl", include_str!("../missions/templates/blank/problem.pddl")),
                ("robot.ttl", include_str!("../missions/templates/blank/robot.ttl")),
            ],
            Self::Ugv => &[
                (MANIFEST, include_str!("../missions/templates/ugv/mission.toml")),
                ("domain.pddl", shipped::UGV_PLAIN),
                ("problem.pddl", shipped::UGV_PROBLEM),
                ("robot.ttl", kb::UGV),
            ],
            Self::Warehouse => &[
                (MANIFEST, include_str!("../missions/templates/warehouse/mission.toml")),
                ("domain.pddl", include_str!("../missions/templates/warehouse/domain.pddl")),
                ("problem.pddl", include_str!("../missions/templates/warehouse/problem.pddl")),
                ("robot.ttl", include_str!("../missions/templates/warehouse/robot.ttl")),
                ("places.csv", include_str!("../missions/templates/warehouse/places.csv")),
            ],
        };
        let named = |(file, text): &(&'static str, &str)| match *file {
            MANIFEST => (*file, named(text, mission)),
            _ => (*file, (*text).to_owned()),
        };
        texts.iter().map(named).chain([(SCHEMA, schema.to_owned())]).collect()
    }

    /// Writes the template's files into a new directory, atomically.
    ///
    /// # Errors
    /// The name already exists, the parent directory does not exist, or the directory cannot be
    /// written.
    pub fn write(self, directory: &Path, mission: &str, schema: &str) -> io::Result<()> {
        if directory.symlink_metadata().is_ok() {
            return Err(io::ErrorKind::AlreadyExists.into());
        }
        let whole = create_directory(directory)?;
        for (file, text) in self.files(mission, schema) {
            std::fs::write(whole.path().join(file), text)?;
        }
        whole.commit()
    }
}

/// Sets the mission's name in the text of a manifest, and adds the line by which editors find the
/// JSON Schema.
fn named(manifest: &str, mission: &str) -> String {
    let name = toml::Value::String(mission.to_owned());
    let line = |line: &str| match line.strip_prefix("name = ") {
        Some(_) => format!("name = {name}\n"),
        None => format!("{line}\n"),
    };
    let schema = format!("#:schema ./{SCHEMA}\n");
    std::iter::once(schema).chain(manifest.lines().map(line)).collect()
}
