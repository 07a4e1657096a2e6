//! What a certificate consists of and claims, and what came of checking it.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use crate::digest::digest;

/// The version of the format.
pub const FORMAT: &str = "metaplan-certificate/3";
/// All files that are never in memory as a whole are together at most this large, in bytes.
pub const SIZE_LIMIT: u64 = 1 << 30;
/// All files that are in memory as a whole are together at most this large, in bytes.
pub const TEXT_LIMIT: u64 = 1 << 28;
/// The PDDL domain as it was planned with.
pub const DOMAIN: &str = "domain.pddl";
/// The problem as it was planned with: availability and values filled in.
pub const PROBLEM: &str = "problem.pddl";
/// The plan; missing if there is none.
pub const PLAN: &str = "plan.txt";
/// The ground task.
pub const TASK: &str = "task.json";
/// The atoms that may ever hold, and the values that numbers may have.
pub const WITNESS: &str = "witness.json";
/// Why no plan is cheaper.
pub const ARGUMENT: &str = "argument.json";
/// For small tasks: "a cheaper plan has at most so many steps", in DIMACS.
pub const FORMULA: &str = "formula.cnf";
/// What the variables of the formula mean.
pub const LEGEND: &str = "legend.txt";
/// The refutation of the formula.
pub const PROOF: &str = "proof.drat";
/// What each line of the refutation follows from.
pub const HINTS: &str = "hints.txt";
/// These may be large, and are never in memory as a whole.
pub const STREAMED: [&str; 4] = [FORMULA, LEGEND, PROOF, HINTS];
/// A proof and its hints are at most this large each, in bytes.
pub const PROOF_LIMIT: u64 = 1 << 28;

/// What a certificate claims, and of which files it consists.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// [`FORMAT`].
    pub format: String,
    /// What is claimed.
    pub claim: Claim,
    /// Whether there is a formula.
    pub refutation: Refutation,
    /// All files but the manifest.
    pub files: Vec<File>,
}

/// Whether there is a formula with a proof besides the argument.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Refutation {
    /// For plans of at most so many steps; longer ones are not cheaper.
    Steps(usize),
    /// Why not.
    None(String),
}

/// What is claimed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Claim {
    /// The plan is valid, this is its metric, and no plan has a better one.
    Optimal {
        /// Exact: a decimal or a fraction.
        metric: String,
    },
    /// There is no plan.
    Unsolvable,
}

/// A file of a certificate.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Its name in the directory.
    pub name: String,
    /// Its size.
    pub bytes: u64,
    /// Its SHA-256 in hexadecimal digits.
    pub sha256: String,
}

/// The files that say what a certificate is about, of which [`Subject::digest`] is made.
pub const SUBJECT: [&str; 4] = [DOMAIN, PROBLEM, crate::knowledge::DOCUMENT, crate::knowledge::ORIGIN];

/// The files or the mission that a claim was checked for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Subject {
    /// The extent of the verification: `files`, `knowledge` or `mission`.
    pub kind: SubjectKind,
    /// The name of the mission, if one was given.
    pub mission: Option<String>,
    /// SHA-256 of the lines that `sha256sum` prints for `domain.pddl`, `problem.pddl`, and `knowledge.nt` and `origin.json` if
    /// the certificate has them.
    pub digest: String,
    /// Parts that were not given, and therefore not checked: `knowledge`, `mission`.
    pub not_checked: Vec<Unchecked>,
}

/// The extent of a verification.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum SubjectKind {
    /// The PDDL files of the certificate, wherever they come from.
    Files,
    /// The PDDL files, and that they follow from the knowledge base of the certificate.
    Knowledge,
    /// The files of a mission in its present situation, its knowledge base among them if it has one.
    Mission,
}

/// A part that a verification leaves out if it is not given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Unchecked {
    /// The knowledge base that the PDDL files follow from: the certificate has none.
    Knowledge,
    /// The mission that the certificate is about: none was given.
    Mission,
}

impl Subject {
    /// The subject of a certificate with these files.
    pub(crate) fn new(files: &[File], mission: Option<&str>) -> Self {
        let mut lines = String::new();
        for name in SUBJECT {
            for file in files.iter().filter(|file| file.name == name) {
                let _ = writeln!(lines, "{}  {name}", file.sha256);
            }
        }
        let has_knowledge = files.iter().any(|file| file.name == crate::knowledge::ORIGIN);
        let (kind, not_checked) = match (mission, has_knowledge) {
            (Some(_), _) => (SubjectKind::Mission, Vec::new()),
            (None, true) => (SubjectKind::Knowledge, vec![Unchecked::Mission]),
            (None, false) => (SubjectKind::Files, vec![Unchecked::Knowledge, Unchecked::Mission]),
        };
        let (mission, digest) = (mission.map(str::to_owned), digest(lines.as_bytes()));
        Self { kind, mission, digest, not_checked }
    }
}

/// What came of one part of a verification.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct VerifiedPart {
    /// `files`, `derivations`, `knowledge`, `plan`, `task`, `argument`, `formula`, `proof`, `steps` or `mission`; or
    /// `limits`, where time or memory was up.
    pub part: &'static str,
    /// What was checked; or why it fails, with the first thing that is wrong.
    pub result: Result<String, String>,
}

/// What came of a verification.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Verification {
    /// The claim; none if the manifest does not say.
    pub claim: Option<Claim>,
    /// The files or the mission that the claim was checked for; none if the files cannot be read.
    pub subject: Option<Subject>,
    /// In order; what rests on a part that fails is left out.
    pub parts: Vec<VerifiedPart>,
}

impl Verification {
    /// Whether the claim is proved.
    pub fn verified(&self) -> bool {
        self.claim.is_some() && self.parts.iter().all(|part| part.result.is_ok())
    }
}
