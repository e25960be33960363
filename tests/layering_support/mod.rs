//! The sources as `syn` reads them: what each file names, defines and prints.
//!
//! Comments, doc links and strings do not count; grouped imports, inline paths,
//! `super::super`, attributes and the tokens inside macro calls do. Not seen: paths
//! that a macro puts together, and methods called without naming their type.

pub mod circles;

use std::path::{Path, PathBuf};

use proc_macro2::{Span, TokenStream, TokenTree};
use syn::visit::{self, Visit};
use syn::{Attribute, ImplItem, Item, Meta, TraitItem, UseTree, Visibility};

/// The macros that print.
const PRINTING: [&str; 5] = ["print", "println", "eprint", "eprintln", "dbg"];

/// The libraries' names, as the programs and the laboratory write them. Their modules are read as
/// those of one crate: no folder of one has the name of another's.
const LIBRARIES: [&str; 2] = ["scan2params", "scan2params_lab"];

/// Whether a path that begins with this word begins at the root of a crate.
pub fn is_root(word: &str) -> bool {
    word == "crate" || LIBRARIES.contains(&word)
}

/// One source file.
pub struct Source {
    /// Path from the package's root, with slashes.
    pub file: String,
    /// Module path below the crate: `["sim", "grid"]`; empty for lib.rs and main.rs.
    pub module: Vec<String>,
    /// Every path that the file names, imports included.
    pub mentions: Vec<Mention>,
    /// Names that the file defines, each with the module that it stands in.
    pub defined: Vec<(Vec<String>, String)>,
    /// Modules that it declares, inline or in files of their own.
    pub modules: Vec<Vec<String>>,
    /// Modules that it declares for tests only.
    pub test_modules: Vec<Vec<String>>,
    /// Modules that it declares for some features only, each with those.
    pub gated: Vec<(Vec<String>, Vec<String>)>,
    /// Lines of printing macros outside tests.
    pub prints: Vec<usize>,
}

/// A path as it is written.
pub struct Mention {
    /// Line, counted from 1.
    pub line: usize,
    /// Whether it stands in something marked `#[cfg(test)]`.
    pub test: bool,
    /// The features of the `#[cfg(feature = "...")]` around it.
    pub features: Vec<String>,
    /// The module that it stands in, inline modules included.
    pub scope: Vec<String>,
    /// Its segments.
    pub path: Vec<String>,
    /// What it is for.
    pub role: Role,
}

/// What a path is for.
#[derive(Clone, PartialEq, Eq)]
pub enum Role {
    /// It stands in code.
    Code,
    /// It is imported, under this name.
    Import(String),
    /// It is imported and passed on, under this name.
    ReExport(String),
    /// All of it is imported.
    Glob,
}

impl Source {
    /// Reads `text` as the file `file` below the package's root.
    pub fn new(file: &str, text: &str) -> Self {
        let inner = file.trim_start_matches("lab/");
        let inner = inner.trim_start_matches("src/").trim_end_matches(".rs");
        let mut module: Vec<String> = inner.split('/').map(String::from).collect();
        let last = module.last().map(String::as_str);
        if last == Some("mod") || matches!(inner, "lib" | "main") {
            module.pop();
        }
        let parsed = syn::parse_file(text).unwrap_or_else(|e| panic!("{file}: {e}"));
        let mut reader = Reader {
            scope: module.clone(),
            tests: 0,
            features: Vec::new(),
            source: Self::empty(file, module),
        };
        reader.visit_file(&parsed);
        reader.source
    }

    fn empty(file: &str, module: Vec<String>) -> Self {
        Self {
            file: file.into(),
            module,
            mentions: Vec::new(),
            defined: Vec::new(),
            modules: Vec::new(),
            test_modules: Vec::new(),
            gated: Vec::new(),
            prints: Vec::new(),
        }
    }

    /// The layer that the file belongs to; empty for lib.rs and main.rs.
    pub fn layer(&self) -> &str {
        self.module.first().map_or("", String::as_str)
    }
}

/// Walks one file.
struct Reader {
    source: Source,
    /// The module at this place.
    scope: Vec<String>,
    /// How many things marked `#[cfg(test)]` stand around this place.
    tests: usize,
    /// The features of those marked `#[cfg(feature = "...")]`.
    features: Vec<String>,
}

impl Reader {
    fn mention(&mut self, span: Span, path: Vec<String>, role: Role) {
        let (line, test, scope) = (span.start().line, self.tests > 0, self.scope.clone());
        let features = self.features.clone();
        self.source.mentions.push(Mention { line, test, features, scope, path, role });
    }

    /// The plain paths of an import.
    fn import(&mut self, tree: &UseTree, mut prefix: Vec<String>, public: bool) {
        let role = |name: String| if public { Role::ReExport(name) } else { Role::Import(name) };
        match tree {
            UseTree::Path(path) => {
                prefix.push(path.ident.to_string());
                self.import(&path.tree, prefix, public);
            }
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.import(tree, prefix.clone(), public);
                }
            }
            UseTree::Name(name) => {
                if name.ident != "self" {
                    prefix.push(name.ident.to_string());
                }
                let alias = prefix.last().cloned().unwrap_or_default();
                self.mention(name.ident.span(), prefix, role(alias));
            }
            UseTree::Rename(name) => {
                if name.ident != "self" {
                    prefix.push(name.ident.to_string());
                }
                self.mention(name.ident.span(), prefix, role(name.rename.to_string()));
            }
            UseTree::Glob(glob) => {
                let span = glob.star_token.spans[0];
                self.mention(span, prefix, Role::Glob);
            }
        }
    }

    /// Paths and printing macros in tokens that are not parsed: what stands in a
    /// macro's call or in an attribute.
    fn tokens(&mut self, tokens: TokenStream) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let punct = |k: usize, c: char| matches!(tokens.get(k), Some(TokenTree::Punct(p)) if p.as_char() == c);
        let mut i = 0;
        while i < tokens.len() {
            match &tokens[i] {
                TokenTree::Group(group) => self.tokens(group.stream()),
                TokenTree::Ident(first) => {
                    let mut path = vec![first.to_string()];
                    while punct(i + 1, ':') && punct(i + 2, ':') {
                        let Some(TokenTree::Ident(next)) = tokens.get(i + 3) else { break };
                        path.push(next.to_string());
                        i += 3;
                    }
                    if punct(i + 1, '!') {
                        self.printing(first.span(), &path);
                    }
                    self.mention(first.span(), path, Role::Code);
                }
                _ => {}
            }
            // a field or a method is no path
            i += if punct(i, '.') && !punct(i + 1, '.') { 2 } else { 1 };
        }
    }

    fn printing(&mut self, span: Span, path: &[String]) {
        let prints = path.last().is_some_and(|name| PRINTING.contains(&name.as_str()));
        if prints && self.tests == 0 {
            self.source.prints.push(span.start().line);
        }
    }

    /// Walks what stands under `attributes`.
    fn under(&mut self, attributes: &[Attribute], walk: impl FnOnce(&mut Self)) {
        let marked = usize::from(attributes.iter().any(is_for_tests));
        let around = self.features.len();
        self.features.extend(attributes.iter().filter_map(feature));
        self.tests += marked;
        walk(self);
        self.tests -= marked;
        self.features.truncate(around);
    }
}

impl<'ast> Visit<'ast> for Reader {
    fn visit_item(&mut self, item: &'ast Item) {
        let (attributes, name) = described(item);
        if let Some(name) = name {
            self.source.defined.push((self.scope.clone(), name));
        }
        self.under(attributes, |this| visit::visit_item(this, item));
    }

    fn visit_impl_item(&mut self, item: &'ast ImplItem) {
        let attributes = match item {
            ImplItem::Const(item) => &item.attrs,
            ImplItem::Fn(item) => &item.attrs,
            ImplItem::Type(item) => &item.attrs,
            _ => &Vec::new(),
        };
        self.under(attributes, |this| visit::visit_impl_item(this, item));
    }

    fn visit_trait_item(&mut self, item: &'ast TraitItem) {
        let attributes = match item {
            TraitItem::Const(item) => &item.attrs,
            TraitItem::Fn(item) => &item.attrs,
            TraitItem::Type(item) => &item.attrs,
            _ => &Vec::new(),
        };
        self.under(attributes, |this| visit::visit_trait_item(this, item));
    }

    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        self.scope.push(item.ident.to_string());
        self.source.modules.push(self.scope.clone());
        if self.tests > 0 {
            self.source.test_modules.push(self.scope.clone());
        }
        if !self.features.is_empty() {
            self.source.gated.push((self.scope.clone(), self.features.clone()));
        }
        visit::visit_item_mod(self, item);
        self.scope.pop();
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let public = !matches!(item.vis, Visibility::Inherited);
        if item.leading_colon.is_none() {
            self.import(&item.tree, Vec::new(), public);
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        if let (None, Some(first)) = (&path.leading_colon, path.segments.first()) {
            let segments = path.segments.iter().map(|s| s.ident.to_string()).collect();
            self.mention(first.ident.span(), segments, Role::Code);
        }
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'ast syn::Macro) {
        visit::visit_macro(self, call);
        let path: Vec<_> = call.path.segments.iter().map(|s| s.ident.to_string()).collect();
        self.printing(call.path.segments[0].ident.span(), &path);
        self.tokens(call.tokens.clone());
    }

    fn visit_attribute(&mut self, attribute: &'ast Attribute) {
        if let Meta::List(list) = &attribute.meta {
            self.tokens(list.tokens.clone());
        }
    }

    /// `pub(super)` names no module.
    fn visit_visibility(&mut self, _: &'ast Visibility) {}
}

/// Whether it is `#[cfg(test)]` or `#[cfg(all(test, ...))]`.
fn is_for_tests(attribute: &Attribute) -> bool {
    fn holds(meta: &Meta) -> bool {
        let inner = |list: &syn::MetaList| {
            let parser = syn::punctuated::Punctuated::<Meta, syn::Token![,]>::parse_terminated;
            list.parse_args_with(parser).is_ok_and(|metas| metas.iter().any(holds))
        };
        match meta {
            Meta::Path(path) => path.is_ident("test"),
            Meta::List(list) => list.path.is_ident("all") && inner(list),
            _ => false,
        }
    }
    attribute.path().is_ident("cfg") && attribute.parse_args::<Meta>().is_ok_and(|m| holds(&m))
}

/// That of `#[cfg(feature = "...")]`.
fn feature(attribute: &Attribute) -> Option<String> {
    let meta = attribute.path().is_ident("cfg").then(|| attribute.parse_args::<Meta>().ok())??;
    match meta {
        Meta::NameValue(syn::MetaNameValue {
            path,
            value: syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Str(name), .. }),
            ..
        }) if path.is_ident("feature") => Some(name.value()),
        _ => None,
    }
}

/// The attributes of an item, and the name that it defines.
fn described(item: &Item) -> (&[Attribute], Option<String>) {
    let named = |attributes, name: &syn::Ident| -> (&[Attribute], _) {
        (attributes, Some(name.to_string()))
    };
    match item {
        Item::Const(item) => named(&item.attrs, &item.ident),
        Item::Enum(item) => named(&item.attrs, &item.ident),
        Item::Fn(item) => named(&item.attrs, &item.sig.ident),
        Item::Static(item) => named(&item.attrs, &item.ident),
        Item::Struct(item) => named(&item.attrs, &item.ident),
        Item::Trait(item) => named(&item.attrs, &item.ident),
        Item::Type(item) => named(&item.attrs, &item.ident),
        Item::Union(item) => named(&item.attrs, &item.ident),
        Item::Impl(item) => (&item.attrs, None),
        Item::Mod(item) => (&item.attrs, None),
        Item::Use(item) => (&item.attrs, None),
        Item::Macro(item) => match &item.ident {
            Some(ident) => named(&item.attrs, ident),
            None => (&item.attrs, None),
        },
        _ => (&[], None),
    }
}

/// The folder of the sources.
pub fn src() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// All `.rs` files below `src`, and those of the laboratory.
pub fn sources() -> Vec<Source> {
    let mut found = Vec::new();
    let mut folders = vec![src(), Path::new(env!("CARGO_MANIFEST_DIR")).join("lab/src")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let inner = path.strip_prefix(env!("CARGO_MANIFEST_DIR")).unwrap();
                let file: Vec<_> = inner.iter().map(|part| part.to_str().unwrap()).collect();
                let text = std::fs::read_to_string(&path).unwrap();
                found.push(Source::new(&file.join("/"), &text));
            }
        }
    }
    found.sort_by(|a, b| a.file.cmp(&b.file));
    found
}
