//! The manifest of a certificate with its claim, and the result of a verification.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use crate::digest::digest;

/// Name and version of the certificate format.
pub const FORMAT: &str = "metaplan-certificate/3";
/// Name and version of the format of a front's certificate.
pub const FRONT_FORMAT: &str = "metaplan-front/1";
/// Upper limit on the total size of the streamed files, in bytes; see [`STREAMED`].
pub const SIZE_LIMIT: u64 = 1 << 30;
/// Upper limit on the total size of the files that are read into memory, in bytes.
pub const TEXT_LIMIT: u64 = 1 << 28;
/// Name of the file with the PDDL domain of the planning problem.
pub const DOMAIN: &str = "domain.pddl";
/// Name of the file with the PDDL problem, in which the knowledge base's facts and values are
/// filled in.
pub const PROBLEM: &str = "problem.pddl";
/// Name of the file with the plan; absent if the claim is that no plan exists.
pub const PLAN: &str = "plan.txt";
/// Name of the file with the two objectives of a front and the values of its points.
pub const FRONT: &str = "front.txt";
/// Name of the file with the ground task.
pub const TASK: &str = "task.json";
/// Name of the file with the witness, an over-approximation of the reachable states: possible atoms
/// and ranges of numbers.
pub const WITNESS: &str = "witness.json";
/// Name of the file with the optimality proof: labels (states), potentials (lower bounds on the
/// remaining cost) and needs (lower bounds on numbers that are required to reach the goal).
pub const ARGUMENT: &str = "argument.json";
/// Name of the file with the formula "some plan of at most T steps is cheaper" in DIMACS; for small
/// tasks only.
pub const FORMULA: &str = "formula.cnf";
/// Name of the file with the meaning of the formula's variables.
pub const LEGEND: &str = "legend.txt";
/// Name of the file with the refutation of the formula.
pub const PROOF: &str = "proof.drat";
/// Name of the file with the antecedents (numbers of clauses) of each line of the refutation.
pub const HINTS: &str = "hints.txt";
/// Names of the files that may be large, and are never read into memory as a whole.
pub const STREAMED: [&str; 4] = [FORMULA, LEGEND, PROOF, HINTS];
/// Upper limit on the size of the refutation, and on the size of its hints, in bytes.
pub const PROOF_LIMIT: u64 = 1 << 28;

/// The claim of a certificate, and the list of its files.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// The format identifier, [`FORMAT`].
    pub format: String,
    /// The claim that the certificate proves.
    pub claim: Claim,
    /// The refutation, or the reason for its absence.
    pub refutation: Refutation,
    /// All files of the certificate except the manifest.
    pub files: Vec<File>,
}

/// The additional proof of the claim by a formula and its refutation.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Refutation {
    /// The formula encodes plans of at most this number of steps; longer plans are not cheaper.
    Steps(usize),
    /// There is no formula; the text is the reason.
    None(String),
}

/// Claim of a certificate.
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
    /// These are all points of the Pareto front. The verification of a front's certificate reports this claim. A
    /// [`Manifest`] with it is refused, because it belongs to a certificate of a single plan.
    Front(Front),
}

/// A Pareto front: every plan has values that are at least those of one of the points in both objectives, each
/// point has a plan with its values, and no point has values that are at least those of another point.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Front {
    /// The two expressions that are minimized, in PDDL.
    pub objectives: [String; 2],
    /// The values of the points, exact: decimals or fractions. The first value increases, and the second one
    /// decreases.
    pub points: Vec<[String; 2]>,
}

/// The list of the files of a front's certificate.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrontManifest {
    /// The format identifier, [`FRONT_FORMAT`].
    pub format: String,
    /// All files in the directory except the manifest. The certificates in its subdirectories have manifests of
    /// their own.
    pub files: Vec<File>,
}

/// A file of a certificate.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Name of the file in the directory.
    pub name: String,
    /// Size in bytes.
    pub bytes: u64,
    /// SHA-256 digest in hexadecimal digits.
    pub sha256: String,
}

/// Names of the files that identify the subject of a certificate; [`Subject::digest`] covers them.
pub const SUBJECT: [&str; 4] = [DOMAIN, PROBLEM, crate::knowledge::DOCUMENT, crate::knowledge::ORIGIN];

/// The files or the mission that a claim was checked for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Subject {
    /// The inputs against which the claim was checked: `files`, `knowledge` or `mission`.
    pub kind: SubjectKind,
    /// The name of the mission, if one was given.
    pub mission: Option<String>,
    /// SHA-256 of the lines that `sha256sum` prints for `domain.pddl`, `problem.pddl`, and `knowledge.nt` and `origin.json` if
    /// the certificate has them.
    pub digest: String,
    /// Parts that were not given, and therefore not checked: `knowledge`, `mission`.
    pub not_checked: Vec<Unchecked>,
}

/// Inputs against which a claim was checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum SubjectKind {
    /// The PDDL files of the certificate, wherever they come from.
    Files,
    /// The PDDL files of the certificate. It was also checked that they follow from the knowledge base of the
    /// certificate.
    Knowledge,
    /// The files of a mission in its present situation, its knowledge base among them if it has one.
    Mission,
}

/// A part that was not given to the verification, and was therefore not checked.
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

/// The result of checking one part of a certificate.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct VerifiedPart {
    /// Name of the part: `files`, `derivations`, `knowledge`, `task`, `plan`, `argument`,
    /// `formula`, `proof`, `steps`, `point`, `front` or `mission`; or `limits` if the time or memory limit was
    /// reached; or `theorem` if the proved checker disagrees.
    pub part: &'static str,
    /// A summary of the check, or a description of the first defect as an error.
    pub result: Result<String, String>,
}

/// The result of verifying a certificate.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Verification {
    /// The claim of the certificate; `None` if the files cannot be read or the verification was aborted at a
    /// limit.
    pub claim: Option<Claim>,
    /// The files or the mission for which the claim was checked; `None` in the same cases as `claim`.
    pub subject: Option<Subject>,
    /// The results of the parts in the order of checking. Parts that depend on a failed part may be
    /// absent.
    pub parts: Vec<VerifiedPart>,
}

impl Verification {
    /// Returns `true` if the files could be read and no part has failed.
    pub fn verified(&self) -> bool {
        self.claim.is_some() && self.parts.iter().all(|part| part.result.is_ok())
    }
}
