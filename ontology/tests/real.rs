//! scratch
use std::path::PathBuf;
#[test]
fn scratch() {
    let root = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/real/owl"));
    let options = ontology::ReadOptions { directories: vec![root.clone()], ..Default::default() };
    let mut files = vec![];
    fn walk(p: &PathBuf, out: &mut Vec<PathBuf>) {
        for e in std::fs::read_dir(p).unwrap() {
            let p = e.unwrap().path();
            if p.is_dir() { walk(&p, out) } else { out.push(p) }
        }
    }
    walk(&root, &mut files);
    files.sort();
    for f in files {
        let t = std::time::Instant::now();
        let r = ontology::read_files(&[&f], &options);
        let name = f.strip_prefix(&root).unwrap().display().to_string();
        match r {
            Ok(o) => {
                use ontology::EntityKind::*;
                println!(
                    "{name}: rules {} C {} OP {} DP {} AP {} I {} ax {} {:?}",
                    o.rules.len(),
                    o.entities(Class).count(),
                    o.entities(ObjectProperty).count(),
                    o.entities(DataProperty).count(),
                    o.entities(AnnotationProperty).count(),
                    o.entities(NamedIndividual).count(),
                    o.axioms.len(),
                    t.elapsed()
                );
                for s in &o.sources {
                    println!("    from {}", s.name.rsplit("owl/").next().unwrap());
                }
                for w in &o.warnings {
                    println!("    {w}");
                }
            }
            Err(e) => {
                for e in e {
                    println!("{name}: {e}")
                }
            }
        }
    }
}
