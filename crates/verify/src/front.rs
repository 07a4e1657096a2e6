//! Certificates of Pareto fronts of two objectives: the list of points, and the problems of the certificates
//! that prove it.
//!
//! Let the points be sorted by the first objective, with the values (a₁, b₁), …, (aₙ, bₙ). The certificate of the
//! point i proves that aᵢ is the least value of the first objective among the plans with a second value less than
//! bᵢ₋₁ (for i = 1, among all plans). One more certificate proves that bₙ is the least value of the second objective.
//! Every plan therefore has values that are at least those of some point: the first point whose second value is not
//! greater than that of the plan. This is the ε-constraint method \[1\], read as a proof.
//!
//! \[1\] Y. Haimes, L. Lasdon, D. Wismer: On a bicriterion formulation of the problems of integrated system
//! identification and system optimization, IEEE Trans. SMC 1(3), 1971.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use num_rational::BigRational;
use pddl::ast::{Comparison, Condition, Direction, Domain, Expression, Metric, Problem, Span};
use pddl::{Source, print_expression, print_problem, read_objective};

use crate::files::{Contents, read, text};
use crate::manifest::{Claim, DOMAIN, FRONT, Front, Manifest, PLAN, PROBLEM, VerifiedPart};
use crate::parts::parts;
use crate::plan::plan;

/// Upper limit on the number of points of a front with a certificate.
pub const MAX_POINTS: usize = 10_000;

const MINIMIZE: &str = "minimize ";

impl Front {
    /// Returns the content of the file [`FRONT`]: a line for each objective, then a line with both values of each
    /// point.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for objective in &self.objectives {
            let _ = writeln!(text, "{MINIMIZE}{objective}");
        }
        for [first, second] in &self.points {
            let _ = writeln!(text, "{first} {second}");
        }
        text
    }

    /// Parses the content of the file [`FRONT`]. The objectives are not parsed.
    ///
    /// # Errors
    /// The text is not exactly what [`Front::text`] returns for a front of 1 to [`MAX_POINTS`] points.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut lines = text.lines();
        let mut objective = || lines.next().and_then(|line| line.strip_prefix(MINIMIZE)).map(str::to_owned);
        let (Some(first), Some(second)) = (objective(), objective()) else {
            return Err(format!("{FRONT}: the first two lines are not objectives to minimize"));
        };
        let mut points = Vec::new();
        for line in lines {
            let Some((first, second)) = line.split_once(' ') else {
                return Err(format!("{FRONT}: a point does not have two values"));
            };
            points.push([first.to_owned(), second.to_owned()]);
        }
        if points.is_empty() || points.len() > MAX_POINTS {
            return Err(format!("{FRONT}: {} points, where 1 to {MAX_POINTS} are expected", points.len()));
        }
        let front = Self { objectives: [first, second], points };
        if front.text() == text { Ok(front) } else { Err(format!("{FRONT}: it is not in the usual form")) }
    }
}

/// Returns the problem of a certificate of a front. If `is_point`, it minimizes the first objective, and its goal
/// requires a second value less than `previous`, the second value of the preceding point, if there is one. Otherwise
/// it minimizes the second objective without a limit.
pub fn member_problem(
    problem: &Problem,
    [first, second]: &[Metric; 2],
    is_point: bool,
    previous: Option<&BigRational>,
) -> Problem {
    let mut problem = problem.clone();
    problem.metric = Some(if is_point { first.clone() } else { second.clone() });
    if let Some(limit) = previous.filter(|_| is_point) {
        let limit = Expression::Number(limit.clone(), Span::default());
        let limited = Condition::Compare(Comparison::Less, second.expression.clone(), limit, Span::default());
        problem.goal = Condition::And(vec![limited, problem.goal]);
    }
    problem
}

/// Returns `true` if a goal can limit the objective: its value does not depend on the total time.
pub fn can_be_limited(objective: &Metric) -> bool {
    fn is_untimed(expression: &Expression) -> bool {
        !matches!(expression, Expression::TotalTime(_)) && expression.operands().iter().all(is_untimed)
    }
    is_untimed(&objective.expression)
}

/// Returns the directory of the certificate at `position` (from 0) of a front.
pub fn member_directory(directory: &Path, position: usize) -> PathBuf {
    directory.join((position + 1).to_string())
}

fn read_member(directory: &Path, position: usize) -> Result<(Manifest, Contents), String> {
    let directory = member_directory(directory, position);
    if !directory.symlink_metadata().is_ok_and(|metadata| metadata.is_dir()) {
        return Err("there is no such directory".to_owned());
    }
    read(&directory)
}

/// Reads the certificates of the front in `directory`, without checking their proofs.
///
/// # Errors
/// A certificate cannot be read, has a file that is not a plain file, or does not claim that a plan is optimal.
pub fn read_members(directory: &Path, front: &Front) -> Result<(), String> {
    let member = |position: usize| match read_member(directory, position)?.0.claim {
        Claim::Optimal { .. } => Ok(()),
        _ => Err("the certificate does not claim that a plan is optimal".to_owned()),
    };
    let numbered = |position: usize| member(position).map_err(|reason| format!("{}: {reason}", position + 1));
    (0..=front.points.len()).try_for_each(numbered)
}

/// Checks the certificates of the front in `directory`, whose domain has the text `domain_text`. Returns a part
/// `point` for each point, and the part `front` for the remaining conditions. Stops at the first failed part.
pub(crate) fn check(
    directory: &Path,
    front: &Front,
    (domain_text, domain, problem): (&str, &Domain, &Problem),
    stop: &dyn Fn() -> bool,
) -> Vec<VerifiedPart> {
    let objectives = match objectives(front, domain, problem) {
        Ok(objectives) => objectives,
        Err(reason) => return vec![VerifiedPart { part: "front", result: Err(reason) }],
    };
    let members = Members { directory, domain_text, domain, stop };
    let mut results = Vec::new();
    let mut previous: Option<[BigRational; 2]> = None;
    for (claimed, position) in front.points.iter().zip(0..) {
        let limit = previous.as_ref().map(|[_, second]| second);
        let expected = member_problem(problem, &objectives, true, limit);
        let point = members.point(position, &expected, &objectives, claimed).and_then(|values| {
            if let Some(before) = &previous
                && (values[0] <= before[0] || values[1] >= before[1])
            {
                return Err("it and the point before it are not both on the front".to_owned());
            }
            previous = Some(values);
            Ok(format!("its plan is valid, values {} and {}, and no plan is better", claimed[0], claimed[1]))
        });
        let number = position + 1;
        let is_failed = point.is_err();
        let result =
            point.map(|text| format!("{number}: {text}")).map_err(|text| format!("{number}: {text}"));
        results.push(VerifiedPart { part: "point", result });
        if is_failed {
            return results;
        }
    }
    let count = front.points.len();
    let expected = member_problem(problem, &objectives, false, None);
    let complete = members.check(count, &expected, &front.points[count - 1][1]);
    let result = complete
        .map(|_| "complete: every plan has values that are at least those of one of the points".to_owned())
        .map_err(|reason| format!("certificate {}: {reason}", count + 1));
    results.push(VerifiedPart { part: "front", result });
    results
}

/// Parses the objectives. Rejects a second objective that no goal can limit.
fn objectives(front: &Front, domain: &Domain, problem: &Problem) -> Result<[Metric; 2], String> {
    let objective = |text: &String| {
        let metric = read_objective(Direction::Minimize, &Source::new(FRONT, text.as_str()), domain, problem);
        let metric = metric.map_err(|errors| {
            errors.first().map_or_else(String::new, |error| format!("{FRONT}: {}", error.message))
        })?;
        // Other readers must not understand the text differently, for example because of a comment in it.
        if print_expression(&metric.expression) == *text {
            Ok(metric)
        } else {
            Err(format!("{FRONT}: `{text}` is not in the usual form"))
        }
    };
    let objectives = [objective(&front.objectives[0])?, objective(&front.objectives[1])?];
    if can_be_limited(&objectives[1]) {
        Ok(objectives)
    } else {
        Err("no goal can limit the second objective, because it depends on the total time".to_owned())
    }
}

/// The certificates in the subdirectories of a front.
struct Members<'c> {
    directory: &'c Path,
    domain_text: &'c str,
    domain: &'c Domain,
    stop: &'c dyn Fn() -> bool,
}

impl Members<'_> {
    /// Checks the certificate of a point, and that its plan has the claimed values. Returns the values.
    fn point(
        &self,
        position: usize,
        problem: &Problem,
        [first, second]: &[Metric; 2],
        claimed: &[String; 2],
    ) -> Result<[BigRational; 2], String> {
        let steps = self.check(position, problem, &claimed[0])?;
        let value = |metric: &Metric, claimed: &str| {
            let problem = Problem { metric: Some(metric.clone()), ..problem.clone() };
            plan(self.domain, &problem, false, &steps, claimed, self.stop).map(|(_, value)| value)
        };
        Ok([value(first, &claimed[0])?, value(second, &claimed[1])?])
    }

    /// Checks a certificate: it proves that `claimed` is the optimal metric of `problem`. Returns the text of its plan.
    fn check(&self, position: usize, problem: &Problem, claimed: &str) -> Result<String, String> {
        let (manifest, contents) = read_member(self.directory, position)?;
        if manifest.claim != (Claim::Optimal { metric: claimed.to_owned() }) {
            return Err(format!("the certificate does not claim the optimal metric {claimed}"));
        }
        if text(&contents, DOMAIN) != self.domain_text {
            return Err(format!("{DOMAIN} is not that of the front"));
        }
        if text(&contents, PROBLEM) != print_problem(problem) {
            return Err(format!(
                "{PROBLEM} is not that of the front, with the metric and the limit of the point"
            ));
        }
        let directory = member_directory(self.directory, position);
        for VerifiedPart { part, result } in parts(&directory, &manifest, &contents, self.stop) {
            result.map_err(|reason| format!("{part}: {reason}"))?;
        }
        Ok(text(&contents, PLAN).to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_usual_form_of_a_front_is_read() {
        let text = "minimize (cost)\nminimize (+ (risk) 1)\n6.5 7\n8 1/3\n";
        let front = Front::parse(text).expect("a front");
        assert_eq!(front.objectives, ["(cost)", "(+ (risk) 1)"]);
        assert_eq!(front.points, [["6.5", "7"], ["8", "1/3"]]);
        assert_eq!(front.text(), text);
        for wrong in [
            "",
            "minimize (cost)\n",
            "minimize (cost)\nminimize (risk)\n",
            "maximize (cost)\nminimize (risk)\n1 2\n",
            "minimize (cost)\nminimize (risk)\n1\n",
            "minimize (cost)\nminimize (risk)\n1 2",
            "minimize (cost)\r\nminimize (risk)\n1 2\n",
        ] {
            assert!(Front::parse(wrong).is_err(), "{wrong:?}");
        }
    }
}
