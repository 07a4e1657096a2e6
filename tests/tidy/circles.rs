//! Which file imports from which, and where that leads in a circle.
//!
//! A file imports from another where a path of it (`use` or in place) leads into the other's module. What is below `#[cfg(test)]` does not
//! count: a test may look at everything.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use petgraph::algo::tarjan_scc;
use petgraph::graphmap::DiGraphMap;
use syn::visit::{self, Visit};

/// Crates without circles.
const CRATES: [&str; 15] = [
    "crates/diagnostics/src",
    "crates/pddl/src",
    "crates/certificate/src",
    "rules/src",
    "ontology/src",
    "crates/mission/src",
    "crates/verify/src",
    "encodings/src",
    "crates/task/src",
    "crates/search/src",
    "crates/temporal/src",
    "crates/planner/src",
    "crates/probabilistic/src",
    "crates/picture/src",
    "src",
];

/// A module as its path below the crate, without `crate`.
pub type Module = Vec<String>;

/// The module that a file holds.
fn module(path: &str, folder: &str) -> Module {
    let inner = path.strip_prefix(folder).expect("below the folder").trim_start_matches('/');
    let mut parts: Module = inner.trim_end_matches(".rs").split('/').map(str::to_owned).collect();
    if ["mod", "lib", "main"].contains(&parts.last().map_or("", String::as_str)) {
        parts.pop();
    }
    parts
}

/// The modules that a file's paths lead to.
struct Paths<'m> {
    own: &'m Module,
    known: &'m BTreeSet<Module>,
    /// Modules of other crates that the root of this one hands on.
    foreign: &'m BTreeSet<String>,
    found: BTreeSet<Module>,
}

impl Paths<'_> {
    fn add(&mut self, segments: &[String]) {
        let mut rest = segments;
        let mut path = match rest.first().map(String::as_str) {
            // The command line calls the library by its name.
            Some("crate" | "metaplan") => Vec::new(),
            _ => self.own.clone(),
        };
        while let Some(first @ ("crate" | "metaplan" | "self" | "super")) = rest.first().map(String::as_str) {
            if first == "super" {
                path.pop();
            }
            rest = &rest[1..];
        }
        if path.is_empty() && rest.first().is_some_and(|first| self.foreign.contains(first)) {
            return;
        }
        path.extend(rest.iter().cloned());
        // An item of a module is found in the module.
        while !self.known.contains(&path) && !path.is_empty() {
            path.pop();
        }
        // What names no module of the crate is an item of the file, or of another crate.
        let leads_away = path.len() > self.own.len() || !path.is_empty() || segments[0] == "crate";
        if path != *self.own && leads_away {
            self.found.insert(path);
        }
    }

    fn tree(&mut self, tree: &syn::UseTree, before: &[String]) {
        let with = |name: &syn::Ident| [before, &[name.to_string()]].concat();
        match tree {
            syn::UseTree::Path(path) => self.tree(&path.tree, &with(&path.ident)),
            syn::UseTree::Name(name) => self.add(&with(&name.ident)),
            syn::UseTree::Rename(name) => self.add(&with(&name.ident)),
            syn::UseTree::Glob(_) => self.add(before),
            syn::UseTree::Group(group) => group.items.iter().for_each(|item| self.tree(item, before)),
        }
    }
}

/// What the root of a crate hands on of others: `pub use ::other::{name}`.
#[derive(Default)]
struct HandedOn(BTreeSet<String>);

impl HandedOn {
    fn tree(&mut self, tree: &syn::UseTree) {
        match tree {
            syn::UseTree::Path(path) => self.tree(&path.tree),
            syn::UseTree::Name(name) => drop(self.0.insert(name.ident.to_string())),
            syn::UseTree::Rename(name) => drop(self.0.insert(name.rename.to_string())),
            syn::UseTree::Glob(_) => {}
            syn::UseTree::Group(group) => group.items.iter().for_each(|item| self.tree(item)),
        }
    }
}

impl<'a> Visit<'a> for HandedOn {
    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        if item.leading_colon.is_some() && matches!(item.vis, syn::Visibility::Public(_)) {
            self.tree(&item.tree);
        }
    }
}

fn is_for_tests(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && attribute.parse_args::<syn::Ident>().is_ok_and(|argument| argument == "test")
    })
}

impl<'a> Visit<'a> for Paths<'_> {
    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        // What begins with `::` is another crate, though a module of this one may have its name.
        if item.leading_colon.is_none() {
            self.tree(&item.tree, &[]);
        }
    }

    fn visit_item_mod(&mut self, item: &'a syn::ItemMod) {
        if !is_for_tests(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_item_fn(&mut self, item: &'a syn::ItemFn) {
        if !is_for_tests(&item.attrs) {
            visit::visit_item_fn(self, item);
        }
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        let segments: Vec<String> = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        if segments.len() > 1 && path.leading_colon.is_none() {
            self.add(&segments);
        }
        visit::visit_path(self, path);
    }
}

/// For each file of a crate the files from which it imports.
pub fn imports(files: &[(String, String)], folder: &str) -> BTreeMap<Module, BTreeSet<Module>> {
    let own: Vec<_> = files.iter().filter(|(path, _)| Path::new(path).starts_with(folder)).collect();
    let known: BTreeSet<Module> = own.iter().map(|(path, _)| module(path, folder)).collect();
    let is_tests = |path: &str| path.ends_with("/tests.rs") || path.contains("/tests/");
    let parsed =
        |path: &str, text: &str| syn::parse_file(text).unwrap_or_else(|error| panic!("{path}: {error}"));
    let mut handed = HandedOn::default();
    for (path, text) in own.iter().filter(|(path, _)| module(path, folder).is_empty()) {
        handed.visit_file(&parsed(path, text));
    }
    let mut imports: BTreeMap<Module, BTreeSet<Module>> = BTreeMap::new();
    for (path, text) in own.iter().filter(|(path, _)| !is_tests(path)) {
        let own = module(path, folder);
        let mut paths = Paths { own: &own, known: &known, foreign: &handed.0, found: BTreeSet::new() };
        paths.visit_file(&parsed(path, text));
        let found = paths.found;
        // A library and a program of one crate are one root.
        imports.entry(own).or_default().extend(found);
    }
    imports
}

/// One circle through each group of files that import each other.
fn circles(imports: &BTreeMap<Module, BTreeSet<Module>>) -> Vec<String> {
    let graph: DiGraphMap<&Module, ()> =
        imports.iter().flat_map(|(from, to)| to.iter().map(move |to| (from, to))).collect();
    let groups = tarjan_scc(&graph).into_iter().filter(|group| group.len() > 1);
    groups.map(|group| shortest(&group.into_iter().collect(), imports)).collect()
}

/// The shortest circle through the first file of a group.
fn shortest(group: &BTreeSet<&Module>, imports: &BTreeMap<Module, BTreeSet<Module>>) -> String {
    let first = *group.first().expect("a group has files");
    let mut paths = vec![vec![first]];
    let mut seen = BTreeSet::new();
    let mut next = 0;
    while let Some(path) = paths.get(next).cloned() {
        next += 1;
        for to in imports.get(*path.last().expect("a path has a start")).into_iter().flatten() {
            if to == first {
                let names = path.iter().chain([&first]).map(|module| format!("crate::{}", module.join("::")));
                let names: Vec<_> = names.collect();
                return format!("{} (a group of {})", names.join(" -> "), group.len());
            }
            if group.contains(to) && seen.insert(to) {
                paths.push([path.clone(), vec![to]].concat());
            }
        }
    }
    String::new()
}

#[test]
fn nothing_imports_in_a_circle() {
    let files = super::files();
    let found: Vec<String> = CRATES
        .iter()
        .flat_map(|folder| {
            circles(&imports(&files, folder)).into_iter().map(move |circle| format!("{folder}: {circle}"))
        })
        .collect();
    assert!(found.is_empty(), "imports in a circle:\n{}", found.join("\n"));
}

#[test]
fn a_circle_is_found() {
    let file = |path: &str, text: &str| (format!("x/src/{path}"), text.to_owned());
    let files = [
        file("lib.rs", "mod a; mod b; mod c;"),
        file("a.rs", "use crate::b::{self, Item}; fn f() { crate::c::g() }"),
        file("b.rs", "#[cfg(test)] mod tests { use crate::a::f; }"),
        file("c.rs", "use ::b::Other; use std::fmt; fn g() -> super::a::F { h::i() }"),
    ];
    assert_eq!(circles(&imports(&files, "x/src")), ["crate::a -> crate::c -> crate::a (a group of 2)"]);
    assert!(circles(&imports(&files[..3], "x/src")).is_empty());
    // What the root has of another crate leads out of this one; what it has of its own does not.
    for (root, expected) in [("pub use ::other::c; mod a;", 0), ("pub use a::c; mod a;", 1)] {
        let files = [file("lib.rs", root), file("a.rs", "use crate::c::Item;")];
        assert_eq!(circles(&imports(&files, "x/src")).len(), expected, "{root}");
    }
}
