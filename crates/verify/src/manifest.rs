//! The manifest of a certificate, its claim, and the result of a verification.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use crate::digest::digest;

/// Version of the format.
pub const FORMAT: &str = "metaplan-certificate/3";
/// Upper limit on the total size of the streamed files, in bytes.
pub const SIZE_LIMIT: u64 = 1 << 30;
/// Upper limit on the total size of the files that are read into memory, in bytes.
pub const TEXT_LIMIT: u64 = 1 << 28;
/// Name of the file with the planned PDDL domain.
pub const DOMAIN: &str = "domain.pddl";
/// Name of the file with the planned problem, with availability and values filled in.
pub const PROBLEM: &str = "problem.pddl";
/// Name of the file with the plan; absent if there is no plan.
pub const PLAN: &str = "plan.txt";
/// Name of the file with the ground task.
pub const TASK: &str = "task.json";
/// Name of the file with the possible atoms and the ranges of numbers.
pub const WITNESS: &str = "witness.json";
/// Name of the file with the optimality proof.
pub const ARGUMENT: &str = "argument.json";
/// Name of the file with the formula "a cheaper plan has at most T steps" of a small task, in
/// DIMACS.
pub const FORMULA: &str = "formula.cnf";
/// Name of the file with the meaning of the formula's variables.
pub const LEGEND: &str = "legend.txt";
/// Name of the file with the refutation of the formula.
pub const PROOF: &str = "proof.drat";
/// Name of the file with the antecedents of each line of the refutation.
pub const HINTS: &str = "hints.txt";
/// Names of the files that may be large and are never read into memory as a whole.
pub const STREAMED: [&str; 4] = [FORMULA, LEGEND, PROOF, HINTS];
/// Upper limit on the size of the proof and of its hints, each in bytes.
pub const PROOF_LIMIT: u64 = 1 << 28;

/// The claim and the files of a certificate.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// The constant [`FORMAT`].
    pub format: String,
    /// The claim.
    pub claim: Claim,
    /// The refutation, if there is one.
    pub refutation: Refutation,
    /// All files except the manifest.
    pub files: Vec<File>,
}

/// The second proof of the claim, by a formula and its refutation.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Refutation {
    /// A formula for plans of at most this number of steps; longer plans are not cheaper.
    Steps(usize),
    /// No formula, and the reason.
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
    /// Name of the file in the directory.
    pub name: String,
    /// Size in bytes.
    pub bytes: u64,
    /// SHA-256 in hexadecimal digits.
    pub sha256: String,
}

/// Names of the files that [`Subject::digest`] covers.
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

/// The result of one part of a verification.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct VerifiedPart {
    /// Name of the part: `files`, `derivations`, `knowledge`, `plan`, `task`, `argument`,
    /// `formula`, `proof`, `steps` or `mission`; or `limits` if the time or memory limit was
    /// reached.
    pub part: &'static str,
    /// A summary of the check, or the first defect.
    pub result: Result<String, String>,
}

/// The result of a verification.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Verification {
    /// The claim; `None` if the manifest cannot be read.
    pub claim: Option<Claim>,
    /// The files or the mission that the claim was checked for; `None` if the files cannot be
    /// read.
    pub subject: Option<Subject>,
    /// The parts in order. Parts that depend on a failed part may be absent.
    pub parts: Vec<VerifiedPart>,
}

impl Verification {
    /// Returns `true` if the claim is proved.
    pub fn verified(&self) -> bool {
        self.claim.is_some() && self.parts.iter().all(|part| part.result.is_ok())
    }
}
