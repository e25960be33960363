//! Which file imports which, and the circles among them.
//!
//! A file imports another if it names something that the other defines, whatever
//! re-exports the name came through. A parent that declares a child, or passes on
//! what the child defines, does not import it by that. What stands under
//! `#[cfg(test)]` is left out.

use std::collections::{BTreeMap, BTreeSet};

use super::{Mention, Role, Source, is_root};

/// Re-exports of re-exports followed before a name is given up.
const DEEPEST: usize = 8;

/// Where one file names what another defines: the first place for each pair.
pub type Imports = BTreeMap<(String, String), Place>;

/// A line, and the path on it.
pub struct Place {
    pub line: usize,
    pub path: String,
}

/// All modules, and what can be named in each.
#[derive(Default)]
struct Modules {
    all: BTreeMap<Vec<String>, Module>,
}

#[derive(Default)]
struct Module {
    file: String,
    defined: BTreeSet<String>,
    /// Names brought in, with their paths as written in this module.
    names: BTreeMap<String, Vec<Vec<String>>>,
    globs: Vec<Vec<String>>,
}

/// What a path leads to.
enum Target {
    /// Something that this file defines.
    File(String),
    /// A module as a whole.
    Module(Vec<String>),
}

/// Which file imports which.
pub fn imports(sources: &[Source]) -> Imports {
    let modules = Modules::new(sources);
    let mut found = Imports::new();
    let tests: BTreeSet<_> = sources.iter().flat_map(|s| &s.test_modules).collect();
    let mut add = |file: &str, other: &str, mention: &Mention| {
        if file != other {
            let place = Place { line: mention.line, path: mention.path.join("::") };
            found.entry((file.into(), other.into())).or_insert(place);
        }
    };
    for source in sources {
        if (1..=source.module.len()).any(|k| tests.contains(&source.module[..k].to_vec())) {
            continue;
        }
        for mention in source.mentions.iter().filter(|m| !m.test) {
            match (&mention.role, modules.resolve(&mention.scope, &mention.path, DEEPEST)) {
                (Role::ReExport(_), _) => {}
                (_, Some(Target::File(other))) => add(&source.file, &other, mention),
                (Role::Glob, Some(Target::Module(module))) => {
                    add(&source.file, &modules.all[&module].file, mention);
                }
                _ => {}
            }
        }
    }
    found
}

/// Sets of files of which each imports every other, directly or by way of the rest.
pub fn circles(imports: &Imports) -> Vec<BTreeSet<String>> {
    let mut next: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for (from, to) in imports.keys() {
        next.entry(from).or_default().insert(to);
    }
    let reached = |from: &str| {
        let mut seen = BTreeSet::new();
        let mut open = vec![from];
        while let Some(file) = open.pop() {
            for &other in next.get(file).into_iter().flatten() {
                if seen.insert(other) {
                    open.push(other);
                }
            }
        }
        seen
    };
    let all: BTreeMap<&str, BTreeSet<&str>> = next.keys().map(|&f| (f, reached(f))).collect();
    let mut found = BTreeSet::new();
    for (&file, others) in &all {
        if others.contains(file) {
            let both = |other: &&&str| all.get(**other).is_some_and(|back| back.contains(file));
            found.insert(others.iter().filter(both).map(|&f| f.to_owned()).collect());
        }
    }
    found.into_iter().collect()
}

impl Modules {
    fn new(sources: &[Source]) -> Self {
        let mut modules = Self::default();
        for source in sources {
            let inline = source.modules.iter().filter(|inner| {
                // declared here and without a file of its own
                !sources.iter().any(|other| other.module == **inner)
            });
            for module in inline.chain([&source.module]) {
                modules.all.entry(module.clone()).or_default().file = source.file.clone();
            }
        }
        for source in sources {
            for (scope, name) in &source.defined {
                modules.all.entry(scope.clone()).or_default().defined.insert(name.clone());
            }
            for mention in &source.mentions {
                let module = modules.all.entry(mention.scope.clone()).or_default();
                let path = mention.path.clone();
                match &mention.role {
                    Role::Import(name) | Role::ReExport(name) => {
                        module.names.entry(name.clone()).or_default().push(path);
                    }
                    Role::Glob => module.globs.push(path),
                    Role::Code => {}
                }
            }
        }
        modules
    }

    /// What `path`, written in the module `scope`, leads to; `None` outside the crate.
    fn resolve(&self, scope: &[String], path: &[String], depth: usize) -> Option<Target> {
        let mut at = scope.to_vec();
        let mut rest = path;
        while let Some((first, after)) = rest.split_first() {
            match first.as_str() {
                name if is_root(name) => at.clear(),
                "self" => {}
                "super" => drop(at.pop()),
                _ => break,
            }
            rest = after;
        }
        self.walk(at, rest, depth)
    }

    /// What `rest` leads to from inside the module `at`.
    fn walk(&self, mut at: Vec<String>, rest: &[String], depth: usize) -> Option<Target> {
        let Some((name, after)) = rest.split_first() else { return Some(Target::Module(at)) };
        let module = self.all.get(&at)?;
        if module.defined.contains(name) {
            return Some(Target::File(module.file.clone()));
        }
        // a name can be a module and a function: the module if the path goes on
        let child = at.iter().chain([name]).cloned().collect::<Vec<_>>();
        let is_module = self.all.contains_key(&child);
        if is_module && !(after.is_empty() && module.names.contains_key(name)) {
            at.push(name.clone());
            return self.walk(at, after, depth);
        }
        let depth = depth.checked_sub(1)?;
        let mut whole = None;
        for path in module.names.get(name).into_iter().flatten() {
            let path: Vec<_> = path.iter().chain(after).cloned().collect();
            // an import that is named like its own module leads outside the crate
            if path.first() == Some(name) && !is_module {
                continue;
            }
            match self.resolve(&at, &path, depth) {
                Some(Target::File(file)) => return Some(Target::File(file)),
                Some(other) => whole = Some(other),
                None => {}
            }
        }
        if whole.is_some() {
            return whole;
        }
        module.globs.iter().find_map(|glob| match self.resolve(&at, glob, depth)? {
            Target::Module(inner) if inner != at => self.walk(inner, rest, depth),
            _ => None,
        })
    }
}
