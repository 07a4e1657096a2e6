//! Every real knowledge base loads, alone and with its imports, with the contents recorded in
//! `golden/README.md`.

use std::path::{Path, PathBuf};

use ontology::EntityKind::{AnnotationProperty, Class, DataProperty, ObjectProperty};
use ontology::{Ontology, ReadOptions, Warning, lower, read_files, read_text};
use rules::Symbols;
use test_resources::data;

use crate::common::real_directory;

/// File, rules, classes, object properties, data properties, annotation properties, individuals (declared in
/// the file itself), rules including imports.
type Row = (&'static str, usize, usize, usize, usize, usize, usize, usize);

const INVENTORY: [Row; 34] = [
    ("suave/suave.owl", 1, 0, 0, 0, 0, 27, 27),
    ("suave_planta/suave.owl", 4, 0, 0, 0, 0, 32, 8),
    ("suave_planta/suave_extended.owl", 4, 0, 0, 0, 0, 33, 8),
    ("mc_mros_reasoner/MROS_ontology.owl", 4, 0, 1, 0, 2, 26, 15),
    ("mc_mros_reasoner/example_f1_fd1.owl", 0, 0, 0, 0, 0, 3, 11),
    ("mc_mros_reasoner/kb.owl", 2, 0, 0, 0, 1, 115, 13),
    ("mc_mros_reasoner/kb_hands_on.owl", 2, 0, 0, 0, 1, 27, 13),
    ("mc_mros_reasoner/test1.owl", 0, 0, 0, 0, 0, 7, 11),
    ("mc_mros_reasoner/tomasys.owl", 11, 12, 16, 10, 1, 0, 11),
    ("mros_ontology/mock.owl", 3, 0, 0, 0, 0, 16, 29),
    ("mros_ontology/mros.owl", 15, 0, 1, 0, 0, 3, 26),
    ("mros_ontology/navigation_domain.owl", 8, 0, 1, 0, 0, 3, 34),
    ("mros_ontology/test_pilot_laser.owl", 11, 0, 1, 0, 0, 27, 45),
    ("mros_ontology/test_pilot_nfr.owl", 11, 0, 1, 0, 0, 27, 45),
    ("mros_ontology/urjc_pilot.owl", 8, 0, 1, 0, 0, 25, 42),
    ("navigation_planta/experiment_combined_scalability/navigation_combined.owl", 2, 0, 0, 0, 0, 65, 6),
    ("navigation_planta/experiment_fd_scalability/navigation_fd_10.owl", 2, 0, 0, 0, 0, 35, 6),
    ("navigation_planta/experiment_fd_scalability/navigation_fd_12.owl", 2, 0, 0, 0, 0, 38, 6),
    ("navigation_planta/experiment_fd_scalability/navigation_fd_15.owl", 2, 0, 0, 0, 0, 42, 6),
    ("navigation_planta/experiment_fd_scalability/navigation_fd_2.owl", 2, 0, 0, 0, 0, 25, 6),
    ("navigation_planta/experiment_fd_scalability/navigation_fd_4.owl", 2, 0, 0, 0, 0, 27, 6),
    ("navigation_planta/experiment_fd_scalability/navigation_fd_8.owl", 2, 0, 0, 0, 0, 32, 6),
    ("navigation_planta/experiment_ma_scalability/navigation_ma_2.owl", 2, 0, 0, 0, 0, 33, 6),
    ("navigation_planta/experiment_ma_scalability/navigation_ma_3.owl", 2, 0, 0, 0, 0, 37, 6),
    ("navigation_planta/experiment_ma_scalability/navigation_ma_4.owl", 2, 0, 0, 0, 0, 41, 6),
    ("navigation_planta/experiment_ma_scalability/navigation_ma_5.owl", 2, 0, 0, 0, 0, 45, 6),
    ("navigation_planta/experiment_qa_scalability/navigation_ct_3.owl", 2, 0, 0, 0, 0, 33, 6),
    ("navigation_planta/experiment_qa_scalability/navigation_ct_4.owl", 2, 0, 0, 0, 0, 36, 6),
    ("navigation_planta/navigation.owl", 2, 0, 0, 0, 0, 29, 6),
    ("navigation_planta/navigation_with_imports.owl", 6, 7, 8, 6, 1, 38, 6),
    ("mc_mdl_tomasys/tomasys.owl", 11, 12, 16, 14, 1, 0, 11),
    ("mc_mdl_tomasys/tomasys_master.owl", 11, 12, 16, 10, 1, 0, 11),
    ("pddl_tomasys/pddl.owl", 0, 1, 1, 1, 0, 6, 0),
    ("pddl_tomasys/pddl_tomasys.owl", 4, 6, 7, 5, 1, 3, 4),
];

fn real() -> Option<PathBuf> {
    data("real/owl")
}

fn with_imports(file: &Path) -> Ontology {
    let options = ReadOptions { directories: vec![real_directory()], ..ReadOptions::default() };
    read_files(&[file], &options).unwrap_or_else(|errors| panic!("{}: {errors:?}", file.display()))
}

fn declared(ontology: &Ontology, kind: ontology::EntityKind) -> usize {
    let undeclared = |iri: &str| {
        let mut warnings = ontology.warnings.iter();
        warnings.any(|warning| matches!(warning, Warning::Undeclared { iri: other, .. } if other == iri))
    };
    ontology.entities(kind).filter(|iri| !undeclared(iri)).count()
}

#[test]
fn each_file_loads_alone_with_its_inventory() {
    let Some(real) = real() else { return };
    for (file, rules, classes, objects, data, annotations, individuals, _) in INVENTORY {
        let text = std::fs::read_to_string(real.join(file)).expect("readable");
        let alone = text.replace("owl:imports", "rdfs:seeAlso");
        let ontology = read_text(&alone, file, &ReadOptions::default()).expect(file);
        let counts =
            [Class, ObjectProperty, DataProperty, AnnotationProperty].map(|kind| declared(&ontology, kind));
        assert_eq!(ontology.rules().len(), rules, "{file}");
        assert_eq!(counts[..3], [classes, objects, data], "{file}");
        // The reader adds a declaration of `isRuleEnabled` to documents that use it without one.
        assert!(counts[3] <= annotations + 1, "{file}: {counts:?}");
        assert_eq!(ontology.individuals().len(), individuals, "{file}");
    }
}

#[test]
fn each_file_loads_with_its_imports() {
    let Some(real) = real() else { return };
    for (file, .., rules) in INVENTORY {
        let ontology = with_imports(&real.join(file));
        let unread =
            |warning: &&Warning| matches!(warning, Warning::Unread { .. } | Warning::UnreadRule { .. });
        let unread: Vec<_> = ontology.warnings.iter().filter(unread).map(ToString::to_string).collect();
        // In two files, 13 blank nodes have only `isRuleEnabled true`.
        assert!(
            unread.iter().all(|warning| warning.contains("isRuleEnabled> of 13 blank nodes")),
            "{file}: {unread:?}"
        );
        let lowered = lower(&ontology, &mut Symbols::new());
        assert_eq!(lowered.warnings, [], "{file}");
        assert_eq!(ontology.rules().len(), rules, "{file}");
    }
}

#[test]
fn suave_has_27_rules_of_which_one_is_stated_twice() {
    let Some(real) = real() else { return };
    let ontology = with_imports(&real.join("suave/suave.owl"));
    assert_eq!(ontology.rules().len(), 27);
    let stated_twice: Vec<_> =
        ontology.rules().iter().filter(|rule| rule.label.as_deref() == Some("S10")).collect();
    assert_eq!(stated_twice.len(), 2);
    assert_ne!(stated_twice[0].ontology, stated_twice[1].ontology);
    assert_eq!(lower(&ontology, &mut Symbols::new()).duplicates, 1);
}

#[test]
fn repeated_reads_give_identical_results() {
    let Some(real) = real() else { return };
    for (file, ..) in INVENTORY {
        let dump = || {
            let ontology = with_imports(&real.join(file));
            let mut symbols = Symbols::new();
            let lowered = lower(&ontology, &mut symbols);
            format!("{ontology:?}\n{lowered:?}")
        };
        let first = dump();
        assert!((1..4).all(|_| dump() == first), "{file}");
    }
}
