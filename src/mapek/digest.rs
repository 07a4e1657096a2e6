//! Checksum of a mission and its adaptation settings, to distinguish journals of different missions.

use sha2::{Digest as _, Sha256};

use crate::knowledge::Knowledge;
use crate::mapek::event::FORMAT;
use crate::mapek::settings::{Settings, Unrecorded};
use crate::mission::Mission;

/// Returns the checksum of the inputs and of the versions of program and format, on which initial decisions also depend.
pub(super) fn versioned(inputs: &str) -> String {
    checksum(&[env!("CARGO_PKG_VERSION").to_owned(), FORMAT.to_owned(), inputs.to_owned()])
}

pub(super) fn digest(mission: &Mission, settings: &Settings) -> String {
    // A journal that can be resumed is complete. Therefore, the reaction to a failed write does not matter.
    let settings = settings.clone().with_unrecorded(Unrecorded::default());
    let mut problem = mission.problem().clone();
    mission.fill(&mut problem);
    let mut parts = vec![
        mission.name.clone(),
        format!("{settings:?}"),
        format!("{:?}", mission.bindings()),
        pddl::print_domain(mission.domain()),
        pddl::print_problem(&problem),
    ];
    if let Some(knowledge) = mission.knowledge() {
        parts.extend(knowledge_parts(knowledge));
    }
    checksum(&parts)
}

pub(crate) fn knowledge_parts(knowledge: &Knowledge) -> [String; 2] {
    let engine = knowledge.engine();
    [
        ontology::ntriples(engine.symbols(), &knowledge.facts()),
        rules::print_rules(engine.program(), engine.symbols(), &rules::Prefixes::default()),
    ]
}

/// Returns the first half of the SHA-256 of the texts, as 32 hexadecimal digits. Each text is preceded by its length.
pub(crate) fn checksum(parts: &[String]) -> String {
    let mut hash = Sha256::new();
    for part in parts {
        hash.update((part.len() as u64).to_le_bytes());
        hash.update(part);
    }
    let half = hash.finalize().iter().take(16).fold(0_u128, |sum, byte| sum << 8 | u128::from(*byte));
    format!("{half:032x}")
}
