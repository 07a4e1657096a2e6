//! Test that the modules of a crate do not import from each other in a cycle.
//!
//! A file imports from a module if one of its paths (`use` or inline, also in arguments of macros) refers to this
//! module. Modules and functions for tests are ignored, because tests can import from any module.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use petgraph::algo::tarjan_scc;
use petgraph::graphmap::DiGraphMap;
use syn::buffer::{Cursor, TokenBuffer};
use syn::visit::{self, Visit};

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

/// Path of a module below the crate root, without `crate`.
pub type Module = Vec<String>;

fn module(path: &str, folder: &str) -> Module {
    let inner = path.strip_prefix(folder).expect("below the folder").trim_start_matches('/');
    let mut parts: Module = inner.trim_end_matches(".rs").split('/').map(str::to_owned).collect();
    if ["mod", "lib", "main"].contains(&parts.last().map_or("", String::as_str)) {
        parts.pop();
    }
    parts
}

struct Paths<'m> {
    module: &'m Module,
    modules: &'m BTreeSet<Module>,
    /// Names that the crate root re-exports from other crates.
    foreign: &'m BTreeSet<String>,
    imports: BTreeSet<Module>,
}

impl Paths<'_> {
    fn add(&mut self, segments: &[String]) {
        let mut remaining = segments;
        let mut path = match remaining.first().map(String::as_str) {
            // The command line program refers to the library by its name.
            Some("crate" | "metaplan") => Vec::new(),
            _ => self.module.clone(),
        };
        while let Some(first @ ("crate" | "metaplan" | "self" | "super")) =
            remaining.first().map(String::as_str)
        {
            if first == "super" {
                path.pop();
            }
            remaining = &remaining[1..];
        }
        if path.is_empty() && remaining.first().is_some_and(|first| self.foreign.contains(first)) {
            return;
        }
        path.extend(remaining.iter().cloned());
        // Names of items are removed until the path names a module.
        while !self.modules.contains(&path) && !path.is_empty() {
            path.pop();
        }
        // A path without a module of the crate refers to an item of this file or of another crate.
        let is_import = path.len() > self.module.len() || !path.is_empty() || segments[0] == "crate";
        if path != *self.module && is_import {
            self.imports.insert(path);
        }
    }

    /// Adds the paths in the arguments of a macro, which are not parsed.
    fn tokens(&mut self, mut cursor: Cursor) {
        let (mut segments, mut colons) = (Vec::<String>::new(), 0);
        while !cursor.eof() {
            let name = cursor.ident();
            // After a leading `::`, the path refers to another crate.
            let continues = if name.is_some() {
                colons == 2
            } else {
                cursor.punct().is_some_and(|(mark, _)| mark.as_char() == ':')
            };
            if !continues {
                self.add_tokens(&mut segments);
                colons = 0;
            }
            if let Some((name, next)) = name {
                if continues && segments.is_empty() {
                    segments.push(String::new());
                }
                segments.push(name.to_string());
                (colons, cursor) = (0, next);
            } else if let Some((_, next)) = cursor.punct() {
                colons += usize::from(continues);
                cursor = next;
            } else if let Some((inner, _, _, next)) = cursor.any_group() {
                self.tokens(inner);
                cursor = next;
            } else if let Some((_, next)) = cursor.token_tree() {
                cursor = next;
            }
        }
        self.add_tokens(&mut segments);
    }

    fn add_tokens(&mut self, segments: &mut Vec<String>) {
        if segments.len() > 1 && !segments[0].is_empty() {
            self.add(segments);
        }
        segments.clear();
    }

    fn tree(&mut self, tree: &syn::UseTree, prefix: &[String]) {
        let path_to = |name: &syn::Ident| [prefix, &[name.to_string()]].concat();
        match tree {
            syn::UseTree::Path(path) => self.tree(&path.tree, &path_to(&path.ident)),
            syn::UseTree::Name(name) => self.add(&path_to(&name.ident)),
            syn::UseTree::Rename(name) => self.add(&path_to(&name.ident)),
            syn::UseTree::Glob(_) => self.add(prefix),
            syn::UseTree::Group(group) => group.items.iter().for_each(|item| self.tree(item, prefix)),
        }
    }
}

/// Names that the root of a crate re-exports from other crates: `pub use ::other::{name}`.
#[derive(Default)]
struct Reexports(BTreeSet<String>);

impl Reexports {
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

impl<'a> Visit<'a> for Reexports {
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
        // A leading `::` refers to another crate, even if a module of this crate has the same name.
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

    fn visit_macro(&mut self, invocation: &'a syn::Macro) {
        self.tokens(TokenBuffer::new2(invocation.tokens.clone()).begin());
        visit::visit_macro(self, invocation);
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        let segments: Vec<String> = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        if segments.len() > 1 && path.leading_colon.is_none() {
            self.add(&segments);
        }
        visit::visit_path(self, path);
    }
}

pub fn imports(files: &[(String, String)], folder: &str) -> BTreeMap<Module, BTreeSet<Module>> {
    let crate_files: Vec<_> = files.iter().filter(|(path, _)| Path::new(path).starts_with(folder)).collect();
    let modules: BTreeSet<Module> = crate_files.iter().map(|(path, _)| module(path, folder)).collect();
    let is_tests = |path: &str| path.ends_with("/tests.rs") || path.contains("/tests/");
    let parsed =
        |path: &str, text: &str| syn::parse_file(text).unwrap_or_else(|error| panic!("{path}: {error}"));
    let mut reexports = Reexports::default();
    for (path, text) in crate_files.iter().filter(|(path, _)| module(path, folder).is_empty()) {
        reexports.visit_file(&parsed(path, text));
    }
    let mut imports: BTreeMap<Module, BTreeSet<Module>> = BTreeMap::new();
    for (path, text) in crate_files.iter().filter(|(path, _)| !is_tests(path)) {
        let module_of_file = module(path, folder);
        let mut paths = Paths {
            module: &module_of_file,
            modules: &modules,
            foreign: &reexports.0,
            imports: BTreeSet::new(),
        };
        paths.visit_file(&parsed(path, text));
        let targets = paths.imports;
        // The roots of a library and of a program in the same crate count as one module.
        imports.entry(module_of_file).or_default().extend(targets);
    }
    imports
}

/// Returns one cycle for each group of modules that import from each other (strongly connected component).
fn circles(imports: &BTreeMap<Module, BTreeSet<Module>>) -> Vec<String> {
    let graph: DiGraphMap<&Module, ()> =
        imports.iter().flat_map(|(from, to)| to.iter().map(move |to| (from, to))).collect();
    let groups = tarjan_scc(&graph).into_iter().filter(|group| group.len() > 1);
    groups.map(|group| shortest(&group.into_iter().collect(), imports)).collect()
}

/// Returns the shortest cycle through the first module of a group, by breadth-first search.
fn shortest(group: &BTreeSet<&Module>, imports: &BTreeMap<Module, BTreeSet<Module>>) -> String {
    let first = *group.first().expect("a group has files");
    let mut paths = vec![vec![first]];
    let mut visited = BTreeSet::new();
    let mut next = 0;
    while let Some(path) = paths.get(next).cloned() {
        next += 1;
        for target in imports.get(*path.last().expect("a path has a start")).into_iter().flatten() {
            if target == first {
                let names = path.iter().chain([&first]).map(|module| format!("crate::{}", module.join("::")));
                let names: Vec<_> = names.collect();
                return format!("{} (a group of {})", names.join(" -> "), group.len());
            }
            if group.contains(target) && visited.insert(target) {
                paths.push([path.clone(), vec![target]].concat());
            }
        }
    }
    String::new()
}

#[test]
fn crates_have_no_import_cycles() {
    let files = super::files();
    let cycles: Vec<String> = CRATES
        .iter()
        .flat_map(|folder| {
            circles(&imports(&files, folder)).into_iter().map(move |circle| format!("{folder}: {circle}"))
        })
        .collect();
    assert!(cycles.is_empty(), "imports in a circle:\n{}", cycles.join("\n"));
}

#[test]
fn import_cycles_are_detected() {
    let file = |path: &str, text: &str| (format!("x/src/{path}"), text.to_owned());
    let files = [
        file("lib.rs", "mod a; mod b; mod c;"),
        file("a.rs", "use crate::b::{self, Item}; fn f() { crate::c::g() }"),
        file("b.rs", "#[cfg(test)] mod tests { use crate::a::f; }"),
        file("c.rs", "use ::b::Other; use std::fmt; fn g() -> super::a::F { h::i() }"),
    ];
    assert_eq!(circles(&imports(&files, "x/src")), ["crate::a -> crate::c -> crate::a (a group of 2)"]);
    assert!(circles(&imports(&files[..3], "x/src")).is_empty());
    for (argument, expected) in
        [("crate::a::f()", 1), ("\"crate::a\"", 0), ("::a::f()", 0), ("a: super::a::F", 1)]
    {
        let code = format!("fn g() {{ assert!(x({argument})); }}");
        let files = [file("lib.rs", "mod a; mod c;"), file("a.rs", "use crate::c::g;"), file("c.rs", &code)];
        assert_eq!(circles(&imports(&files, "x/src")).len(), expected, "{argument}");
    }
    // A re-export of another crate's item is not an import within this crate, but a re-export of an item of
    // this crate is.
    for (root, expected) in [("pub use ::other::c; mod a;", 0), ("pub use a::c; mod a;", 1)] {
        let files = [file("lib.rs", root), file("a.rs", "use crate::c::Item;")];
        assert_eq!(circles(&imports(&files, "x/src")).len(), expected, "{root}");
    }
}
