//! Compares a certificate with the current files and the current situation of a mission.

use mission::Mission;
use mission::knowledge::rule_text;
use ontology::OutputSyntax;
use pddl::ast::Problem;
use pddl::{print_domain, print_problem};

use crate::knowledge::{KnowledgeFiles, ORIGIN, Origin, first_message};
use crate::manifest::Claim;
use crate::task::read_pddl;

/// Returns a confirmation, or the first difference as an error.
pub(crate) fn about(
    claim: &Claim,
    certified: Option<&KnowledgeFiles<'_>>,
    (domain, problem): (&str, &str),
    mission: &Mission,
) -> Result<String, String> {
    let confirmation = format!("it is about `{}` as it is now", mission.name);
    let mismatch = |what: &str| Err(format!("it is not about `{}` as it is now: {what}", mission.name));
    let (certified, base) = match (certified, mission.knowledge()) {
        (Some(certified), Some(base)) => (certified, base),
        (None, None) => {
            let (mut filled, _) = mission.filled().map_err(|messages| first_message(&messages))?;
            if matches!(claim, Claim::Unsolvable) {
                // The metric does not matter if there is no plan.
                filled.metric = read_pddl(domain, problem)?.1.metric;
            }
            let equal = print_domain(mission.domain()) == domain && print_problem(&filled) == problem;
            return if equal { Ok(confirmation) } else { mismatch("domain or problem differ") };
        }
        _ => return mismatch("one has a knowledge base, and the other has none"),
    };
    let origin: Origin =
        serde_json::from_str(certified.origin).map_err(|error| format!("{ORIGIN}: {error}"))?;
    let sources = base.sources();
    if !sources.are_repeatable() {
        return Err(
            "the mission's knowledge base comes from standard input, which cannot be read again".to_owned()
        );
    }
    let (document, _) = ontology::convert_files(&sources.documents, &sources.options, OutputSyntax::NTriples)
        .map_err(|_| "the mission's knowledge base cannot be read again".to_owned())?;
    let texts = sources.rules.iter().map(|name| rule_text(name)).collect::<Result<Vec<_>, _>>();
    let texts = texts.map_err(|message| message.message.clone())?;
    if mission.domain_source().text() != origin.domain {
        return mismatch("the domain differs");
    }
    if document != certified.document {
        return mismatch("the knowledge base differs");
    }
    if !origin.rules.iter().map(|(_, text)| text).eq(&texts) {
        return mismatch("the rules differ");
    }
    let bindings = mission.bindings();
    if *bindings.written() != origin.bindings || bindings.names().written() != origin.names {
        return mismatch("the bindings differ");
    }
    if print_problem(mission.problem()) != origin.problem || base.statements() != origin.changes {
        return mismatch("the problem or the situation (`--scenario`, `--set`, `--fail`) differs");
    }
    // The metric does not matter if there is no plan. A front states its objectives.
    if matches!(claim, Claim::Optimal { .. }) {
        let (_, planned) = read_pddl(domain, problem)?;
        let with_metric = Problem { metric: planned.metric, ..mission.problem().clone() };
        if print_problem(&with_metric) != origin.problem {
            return mismatch("the metric differs (`--minimize`)");
        }
    }
    Ok(confirmation)
}
