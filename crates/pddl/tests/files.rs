//! Parses, checks and prints all available real PDDL files, and parses the printed text again.
//!
//! The files are not part of the project.

use std::collections::BTreeSet;
use std::path::PathBuf;

use metaplan_pddl::{
    Diagnostic, Errors, Severity, Source, check_domain, has_errors, parse_domain, parse_problem,
    print_domain, print_problem, read,
};
use test_resources::{data, data_path};

const REAL: &str = "real/pddl";

/// Expected diagnostics of domains: `CODE:line`, with a tilde before warnings. All other domains have no
/// diagnostics.
const DOMAINS: [(&str, &str); 16] = [
    ("navigation_planta/domain_sas.pddl", "P134:1 ~P127:59"),
    ("navigation_planta/experiment_combined_scalability/domain_sas_combined.pddl", "P134:1 ~P127:70"),
    ("navigation_planta/experiment_ma_scalability/domain_sas_ma_2.pddl", "P134:1 ~P127:62"),
    ("navigation_planta/experiment_ma_scalability/domain_sas_ma_3.pddl", "P134:1 ~P127:64"),
    ("navigation_planta/experiment_ma_scalability/domain_sas_ma_4.pddl", "P134:1 ~P127:66"),
    ("navigation_planta/experiment_ma_scalability/domain_sas_ma_5.pddl", "P134:1 ~P127:68"),
    ("navigation_planta/experiment_qa_scalability/domain_sas_ct_3.pddl", "P134:1 ~P127:60"),
    ("navigation_planta/experiment_qa_scalability/domain_sas_ct_4.pddl", "P134:1 ~P127:61"),
    ("plansys2/plansys2_domain_expert_test_pddl_domain_2_error.pddl", "P101:26"),
    ("plansys2/plansys2_domain_expert_test_pddl_domain_combined_processed.pddl", "~P127:10 ~P127:12"),
    ("plansys2/plansys2_domain_expert_test_pddl_domain_simple_derived.pddl", "P126:51"),
    ("plansys2/plansys2_domain_expert_test_pddl_domain_simple_derived_processed.pddl", "P126:46"),
    ("plansys2/plansys2_popf_plan_solver_test_pddl_domain_2_error.pddl", "P101:38"),
    ("suave_metaplan/suave_extended_metaplan_domain.pddl", "~P107:26"),
    ("suave_planta/suave_domain.pddl", "P134:1"),
    ("suave_planta/suave_domain_extended.pddl", "P134:1"),
];

/// Problems with their domains and the expected diagnostics about the problem.
const PROBLEMS: [(&str, &str, &str); 35] = [
    ("navigation_planta/problem", "navigation_planta/domain", ""),
    ("navigation_planta/problem_no_sas", "navigation_planta/domain_no_sas", "P100:1"),
    ("plansys2/domain_expert:problem_0", "plansys2/domain_expert:domain_1_ok", "P110:1"),
    ("plansys2/domain_expert:problem_charging", "plansys2/domain_expert:domain_charging", ""),
    ("plansys2/domain_expert:problem_simple_1", "plansys2/domain_expert:domain_simple", ""),
    ("plansys2/executor:elevator_problem", "plansys2/executor:elevator_domain", ""),
    ("plansys2/executor:problem_factory_1", "plansys2/executor:factory", ""),
    ("plansys2/executor:problem_simple_1", "plansys2/executor:domain_simple", ""),
    ("plansys2/executor:problem_simple_2", "plansys2/executor:domain_simple", ""),
    ("plansys2/executor:problem_simple_3", "plansys2/executor:domain_simple", "P101:1 P109:14"),
    ("plansys2/executor:road_trip_problem", "plansys2/executor:road_trip_domain", ""),
    ("plansys2/pddl_parser:prob1", "plansys2/pddl_parser:dom1", ""),
    ("plansys2/planner:problem_simple_1", "plansys2/planner:domain_simple", ""),
    ("plansys2/planner:problem_simple_2", "plansys2/planner:domain_simple", ""),
    ("plansys2/planner:problem_simple_3", "plansys2/planner:domain_simple", "P101:1 P109:14"),
    ("plansys2/planner:problem_simple_constants_1", "plansys2/planner:domain_simple_constants", ""),
    (
        "plansys2/planner:problem_simple_constants_2",
        "plansys2/planner:domain_simple_constants",
        "~P127:4 ~P127:4 ~P127:6 ~P127:6",
    ),
    ("plansys2/popf_plan_solver:problem_simple_1", "plansys2/popf_plan_solver:domain_simple", ""),
    ("plansys2/popf_plan_solver:problem_simple_2", "plansys2/popf_plan_solver:domain_simple", ""),
    (
        "plansys2/popf_plan_solver:problem_simple_3",
        "plansys2/popf_plan_solver:domain_simple",
        "P101:1 P109:14",
    ),
    ("plansys2/problem_expert:problem_charging", "plansys2/problem_expert:domain_charging", ""),
    ("plansys2/problem_expert:problem_empty_domain", "plansys2/problem_expert:domain_simple", "P106:2"),
    ("plansys2/problem_expert:problem_simple_1", "plansys2/problem_expert:domain_simple", ""),
    (
        "plansys2/problem_expert:problem_simple_constants_1",
        "plansys2/problem_expert:domain_simple_constants",
        "",
    ),
    (
        "plansys2/problem_expert:problem_simple_constants_2",
        "plansys2/problem_expert:domain_simple_constants",
        "~P127:4 ~P127:4 ~P127:6 ~P127:6",
    ),
    (
        "plansys2/problem_expert:problem_unexpected_syntax",
        "plansys2/problem_expert:domain_simple",
        "P125:16 P126:18",
    ),
    ("plansys2/terminal:problem_charging", "plansys2/terminal:simple_example", ""),
    ("plansys2/terminal:problem_empty_domain", "plansys2/problem_expert:domain_simple", "P106:2"),
    ("plansys2/tests_test_2_pddl_problem_2", "plansys2/tests_test_2_pddl_test_2", ""),
    (
        "suave_metaplan/inspect_pl_problem",
        "suave_metaplan/inspect_pl_domain",
        "P120:8 P121:11 P121:12 P121:13 P121:16 P121:17 P122:18 P122:19 P122:20 P122:21",
    ),
    (
        "suave_metaplan/suave_extended_metaplan_problem",
        "suave_metaplan/suave_extended_metaplan_domain",
        "~P131:2",
    ),
    ("suave_metaplan/suave_extended_problem", "suave_metaplan/suave_extended_domain", "~P131:2"),
    ("suave_metaplan/suave_problem", "suave_metaplan/suave_domain", ""),
    // The domains are templates of `OWLToPDDL`, so undeclared names are not reported.
    ("suave_planta/suave_problem", "suave_planta/suave_domain", ""),
    ("suave_planta/suave_problem_extended", "suave_planta/suave_domain_extended", ""),
];

fn path_of(short: &str) -> String {
    match short.split_once(':') {
        Some((package, file)) => {
            let package = package.replacen("plansys2/", "plansys2/plansys2_", 1);
            format!("{package}_test_pddl_{file}.pddl")
        }
        None => format!("{}.pddl", short.replacen("plansys2/", "plansys2/plansys2_", 1)),
    }
}

fn source(path: &str) -> Source {
    let bytes = std::fs::read(data_path(REAL).join(path)).unwrap_or_else(|error| panic!("{path}: {error}"));
    Source::from_bytes(path, &bytes)
}

fn files() -> BTreeSet<String> {
    let mut paths = BTreeSet::new();
    let Some(real) = data(REAL) else { return paths };
    let mut folders: Vec<PathBuf> = vec![real.clone()];
    while let Some(folder) = folders.pop() {
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        for path in entries.filter_map(Result::ok).map(|entry| entry.path()) {
            if path.is_dir() {
                folders.push(path);
            } else if let Ok(relative) = path.strip_prefix(&real) {
                paths.insert(relative.to_string_lossy().into_owned());
            }
        }
    }
    paths
}

fn summary<'d>(diagnostics: impl IntoIterator<Item = &'d Diagnostic>) -> String {
    let each = diagnostics.into_iter().map(|diagnostic| {
        let mark = if diagnostic.severity == Severity::Warning { "~" } else { "" };
        format!("{mark}{}:{}", diagnostic.code, diagnostic.line)
    });
    each.collect::<Vec<_>>().join(" ")
}

#[test]
fn domains_are_read_and_their_errors_reported() {
    let problems: BTreeSet<_> = PROBLEMS.iter().map(|(problem, ..)| path_of(problem)).collect();
    let files = files();
    for path in files.difference(&problems) {
        let source = source(path);
        let (domain, mut diagnostics) = parse_domain(&source);
        let domain = domain.unwrap_or_else(|| panic!("{path} has a domain"));
        if !has_errors(&diagnostics) {
            diagnostics.extend(check_domain(&domain, &source));
        }
        let expected =
            DOMAINS.iter().find(|(domain_path, _)| domain_path == path).map_or("", |(_, expected)| expected);
        assert_eq!(summary(&diagnostics), expected, "{path}");
        let printed = print_domain(&domain);
        let (again, diagnostics) = parse_domain(&Source::new("printed", printed.clone()));
        assert_eq!(summary(&diagnostics), "", "printed {path}");
        assert_eq!(again.map(|domain| print_domain(&domain)), Some(printed), "{path}");
    }
}

#[test]
fn problems_are_read_and_their_errors_reported() {
    let files = files();
    for (problem, domain, expected) in PROBLEMS {
        let path = path_of(problem);
        if !files.contains(&path) {
            continue;
        }
        let (domain, problem) = (source(&path_of(domain)), source(&path));
        let diagnostics =
            read(&domain, &problem).map_or_else(Errors::into_vec, |(_, _, diagnostics)| diagnostics);
        let diagnostics = diagnostics.iter().filter(|diagnostic| diagnostic.file == path);
        assert_eq!(summary(diagnostics), expected, "{path}");
        let (Some(tree), diagnostics) = parse_problem(&problem) else { continue };
        if has_errors(&diagnostics) {
            continue;
        }
        let printed = print_problem(&tree);
        let (again, diagnostics) = parse_problem(&Source::new("printed", printed.clone()));
        assert_eq!(summary(&diagnostics), "", "printed {path}");
        assert_eq!(again.map(|problem| print_problem(&problem)), Some(printed), "{path}");
    }
}

#[test]
fn tables_name_existing_files() {
    let files = files();
    let paths = DOMAINS.iter().map(|(domain, _)| (*domain).to_owned());
    let paths =
        paths.chain(PROBLEMS.iter().flat_map(|(problem, domain, _)| [path_of(problem), path_of(domain)]));
    for path in paths {
        assert!(files.is_empty() || files.contains(&path), "{path}");
    }
}
