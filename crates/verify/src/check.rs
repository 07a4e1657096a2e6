//! Verifies a certificate part by part.

use std::fmt;
use std::path::Path;
use std::time::{Duration, Instant};

use certificate::{GroundTask, verification_conditions};
use mission::Mission;
use mission::message::{Errors, Message};

use crate::about::about;
use crate::files::{is_front, read, read_front, text};
use crate::front;
use crate::manifest::{
    ARGUMENT, Claim, DOMAIN, FRONT, File, Front, Manifest, PLAN, PROBLEM, Subject, TASK, Verification,
    VerifiedPart, WITNESS,
};
use crate::parts::{MISPLACED, origin_parts, parts, written};
use crate::plan::plan;
use crate::task::{read_pddl, same_task};

/// Checks the certificate in a directory. The program that wrote the certificate is not trusted.
///
/// ```
/// use std::path::Path;
/// use std::time::Duration;
/// use metaplan_verify::Verifier;
///
/// let verification = Verifier::new(Path::new("no/such/directory")).time_limit(Duration::from_secs(60)).verify();
/// assert!(!verification.verified());
/// assert!(verification.to_string().starts_with("files       failed: manifest.json: cannot be read"));
/// ```
pub struct Verifier<'a> {
    directory: &'a Path,
    mission: Option<&'a Mission>,
    until: Option<Instant>,
    stop: Box<dyn Fn() -> bool + 'a>,
}

impl<'a> Verifier<'a> {
    /// Creates a verifier without limits, which does not compare the certificate with a mission.
    pub fn new(directory: &'a Path) -> Self {
        Self { directory, mission: None, until: None, stop: Box::new(|| false) }
    }

    /// Sets a mission. The verifier then also checks that the certificate matches the mission in
    /// its current situation.
    #[must_use]
    pub fn mission(self, mission: impl Into<Option<&'a Mission>>) -> Self {
        Self { mission: mission.into(), ..self }
    }

    /// Sets a time limit, counted from this call, for the checks of the ground task, the plan and the argument, and for
    /// the encoding of the formula. The other checks do not observe it. A check that reaches the limit fails.
    #[must_use]
    pub fn time_limit(self, time: Duration) -> Self {
        Self { until: Instant::now().checked_add(time), ..self }
    }

    /// Sets a function that the checks of [`Self::time_limit`] poll. When `stop` returns `true`, the check fails.
    #[must_use]
    pub fn stop(self, stop: impl Fn() -> bool + 'a) -> Self {
        Self { stop: Box::new(stop), ..self }
    }

    /// Verifies the parts of the certificate. A defect is reported as a failed part, not as an
    /// error. Parts that cannot be checked because of an earlier defect are omitted.
    pub fn verify(&self) -> Verification {
        if is_front(self.directory) {
            return self.verify_front();
        }
        match read(self.directory) {
            Ok((manifest, contents)) => {
                let mut report = self.report(manifest.claim.clone(), &manifest.files);
                report.parts.extend(parts(self.directory, &manifest, &contents, &|| self.is_over()));
                report.parts.extend(self.about_mission(&manifest.claim, &contents));
                report
            }
            Err(reason) => unreadable(reason),
        }
    }

    fn verify_front(&self) -> Verification {
        let read = read_front(self.directory).and_then(|(manifest, contents)| {
            let front = Front::parse(text(&contents, FRONT))?;
            let (domain, problem) = read_pddl(text(&contents, DOMAIN), text(&contents, PROBLEM))?;
            Ok((manifest, contents, front, domain, problem))
        });
        let (manifest, contents, front, domain, problem) = match read {
            Ok(read) => read,
            Err(reason) => return unreadable(reason),
        };
        let mut report = self.report(Claim::Front(front.clone()), &manifest.files);
        report.parts.extend(origin_parts(&contents, &domain, &problem));
        let texts = (text(&contents, DOMAIN), &domain, &problem);
        report.parts.extend(front::check(self.directory, &front, texts, &|| self.is_over()));
        report.parts.extend(self.about_mission(&Claim::Front(front), &contents));
        report
    }

    /// Creates the report of a certificate whose files match its manifest.
    fn report(&self, claim: Claim, files: &[File]) -> Verification {
        let mission = self.mission.map(|mission| mission.name.as_str());
        let bytes: u64 = files.iter().map(|file| file.bytes).sum();
        let summary = format!("{} files, {bytes} bytes, as the manifest has them", files.len());
        Verification {
            claim: Some(claim),
            subject: Some(Subject::new(files, mission)),
            parts: vec![VerifiedPart { part: "files", result: Ok(summary) }],
        }
    }

    /// Compares the certificate with the mission. Returns `None` without a mission.
    fn about_mission(&self, claim: &Claim, contents: &[(String, String)]) -> Option<VerifiedPart> {
        let texts = (text(contents, DOMAIN), text(contents, PROBLEM));
        let result = about(claim, written(contents).as_ref(), texts, self.mission?);
        Some(VerifiedPart { part: "mission", result })
    }

    /// Returns the optimality proof (argument) of the certificate as verification conditions in
    /// SMT-LIB 2. The proof itself is not checked.
    ///
    /// # Errors
    /// M121 if the certificate cannot be read or its task or argument is malformed. Also M121 if it is
    /// the certificate of a front, or its task has derived variables: there are no verification
    /// conditions for these. For an optimality claim, also M121 if the task is not faithful to the PDDL
    /// files, the plan is not as claimed, or a limit is reached.
    pub fn conditions(&self) -> Result<String, Errors> {
        conditions(self.directory, &|| self.is_over()).map_err(Errors::from)
    }

    fn is_over(&self) -> bool {
        self.until.is_some_and(|until| Instant::now() >= until) || (self.stop)()
    }
}

impl fmt::Debug for Verifier<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Verifier").field("directory", &self.directory).finish_non_exhaustive()
    }
}

fn conditions(directory: &Path, stop: &dyn Fn() -> bool) -> Result<String, Message> {
    let wrong = |reason: String| Message::at("M121", &directory.display().to_string(), None, reason);
    if is_front(directory) {
        let reason =
            "a front has no verification conditions, but the certificates in its subdirectories have";
        return Err(wrong(reason.to_owned()));
    }
    let (Manifest { claim, .. }, contents) = read(directory).map_err(wrong)?;
    let text = |name: &str| text(&contents, name);
    let metric = match &claim {
        Claim::Unsolvable => None,
        Claim::Front(_) => return Err(wrong(MISPLACED.to_owned())),
        Claim::Optimal { metric } => {
            let (domain, problem) = read_pddl(text(DOMAIN), text(PROBLEM)).map_err(wrong)?;
            let (_, timed) =
                same_task(&domain, &problem, (&GroundTask::read(text(TASK)), text(WITNESS)), stop)
                    .map_err(wrong)?;
            Some(plan(&domain, &problem, timed, text(PLAN), metric, stop).map_err(wrong)?.1)
        }
    };
    verification_conditions(text(TASK), text(ARGUMENT), metric.as_ref())
        .map_err(|fault| wrong(fault.to_string()))?
        .ok_or_else(|| wrong("a task with derived predicates has no verification conditions".to_owned()))
}

fn unreadable(reason: String) -> Verification {
    let parts = vec![VerifiedPart { part: "files", result: Err(reason) }];
    Verification { claim: None, subject: None, parts }
}
